r"""A program lifted off the part, for a first run in the cell: the whole way shifted rigidly along z of its frame.

    target_n -> target_n + h z,        z of the part's frame, of World without one

A rigid shift keeps lengths, speeds and stops, so what is seen is the real program's motion, h higher on the pendant's
screen. Error, correction and bounds are those of the lifted place. Where the tool leans by an angle a from z it clears
the part by h cos a only.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from hashlib import sha256

import numpy as np

from compgen.core.exceptions import ImpossibleError, InputError
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.units import DEG, MM
from compgen.job.job import Job
from compgen.planning.toolpath import ToolPath

HIGHEST = 1.0  # [m] of a lift
LEAST_SHARE = 0.5  # of the lift that the tool must clear the part by, everywhere


def lifted(job: Job, height: float) -> Job:
    """A job whose program runs above the part, under another name.

    Args:
        job: Of the real program.
        height: h [m].

    Raises:
        InputError: A height that is none.
    """
    check_height(height)
    other = job.on_other_heat_model
    return replace(
        job,
        name=f"{job.name}_dry",
        title=f"{dry_run_words(height)}: {job.title}",
        plan=replace(job.plan, path=replace(job.plan.path, raised=height)),
        inputs_hash=sha256(f"{job.inputs_hash} lifted by {height!r} m".encode()).hexdigest(),
        inputs={**job.inputs, "options": {"lift_all_mm": height / MM}},
        on_other_heat_model=None if other is None else lambda _: lifted(other(None), height),
    )


def check_height(height: float) -> None:
    """Raises InputError for a lift [m] that is none."""
    if not 0 < height <= HIGHEST:
        raise InputError(f"--lift-all {height / MM:g}: must be above 0 and at most {HIGHEST / MM:g} mm")


def dry_run_words(height: float) -> str:
    """What a remark says of a lifted program."""
    return f"DRY RUN +{height / MM:.4g} MM"


def dry_run_findings(job: Job, path: ToolPath) -> Iterator[Finding]:
    """That a lifted program is not the one for the part, and by how much its tool clears it.

    Raises:
        InputError: The tool leans so far that it hardly clears the part.
    """
    height = job.plan.path.raised
    if height == 0:
        return
    place = job.plan.path.place
    up = np.array([0.0, 0.0, 1.0]) if place is None else place.rotation[:, 2]
    on_part = path.rows_on_part()
    share = -path.target.rotation[on_part, :, 2] @ up
    worst = int(np.argmin(share))
    if share[worst] < LEAST_SHARE:
        lean = np.arccos(np.clip(share[worst], -1, 1)) / DEG
        raise InputError(
            f"--lift-all {height / MM:g}: at waypoint {on_part[worst] + 1} the tool leans {lean:.0f} deg from the lift "
            f"and would clear the part by {max(0.0, share[worst]) * height / MM:.1f} mm; "
            "give the part a [frame] whose z points away from it"
        )
    yield Finding.of(
        Code.PROGRAM_DRY_RUN,
        f"{dry_run_words(height)}: this program runs {height / MM:g} mm above its place, at least "
        f"{share[worst] * height / MM:.1f} mm clear of the part; its correction is for there: not for the part",
    )


def raised_findings(height: float) -> Iterator[Finding]:
    """That a corrected program is a dry run, lifted by so much [m]; none for 0."""
    if height != 0:
        yield Finding.of(
            Code.PROGRAM_DRY_RUN,
            f"{dry_run_words(height)}: Z of all positions is {height / MM:g} mm larger in their frame; not for the "
            "part",
        )


@contextmanager
def naming_lift(height: float | None) -> Iterator[None]:
    """What the robot cannot do so high is due to the lift, or not: it follows the message."""
    try:
        yield
    except ImpossibleError as failure:
        if height is not None:
            failure.args = (f"{failure}; the program is lifted by {height / MM:g} mm (--lift-all): lift it less",)
        raise
