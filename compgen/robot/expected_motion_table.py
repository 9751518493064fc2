"""The table of what controllers of a class of arm do, where a robot file does not know its own motion."""

from dataclasses import replace
from math import inf
from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from compgen.core.exceptions import InputError
from compgen.core.toml import Table
from compgen.core.units import MS
from compgen.robot.motion import ANY_ARM, ControllerMotion, ExpectedMotion
from compgen.robot.motion_tables import LONGEST

TwoMeans = Annotated[list[Annotated[FiniteFloat, Field(ge=0, le=LONGEST)]], Field(min_length=2, max_length=2)]  # ms


class ExpectedMotionTable(Table):
    """What controllers of this class of arm do, by evidence; predicted without [motion], never commanded against."""

    moving_average_ms: TwoMeans
    """Windows of the two moving means that are expected."""
    after_long_ms: TwoMeans | None = None
    """The same in a run, from a stop to the next, whose first statement lasts at least their sum; default alike."""
    lowest_ms: TwoMeans
    """Windows that smooth least of what was seen."""
    highest_ms: TwoMeans
    """Windows that smooth most of what was seen."""
    evidence: Literal["simulated", "other arms"]
    """The maker's motion code (a virtual controller) of such an arm, or logs and motion code of other arms."""
    source: Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[^\x00-\x1f\x7f]*$")]
    """What was seen where."""


def expected_motion_of(table: ExpectedMotionTable | None, where: str) -> ExpectedMotion:
    """What the controller is expected to do where its motion is not known; of a file without a word, what any arm does.

    Raises:
        InputError: What is expected does not lie between the lowest and the highest.
    """
    if table is None:
        return ANY_ARM
    lowest, expected, highest = (
        ControllerMotion(moving_averages=tuple(window * MS for window in windows))
        for windows in (table.lowest_ms, table.moving_average_ms, table.highest_ms)
    )
    expected = replace(expected, after_long=tuple(window * MS for window in table.after_long_ms or ()))
    for key, means in (("moving_average_ms", expected), ("after_long_ms", expected.in_run(inf))):
        if not lowest.variance <= means.variance <= highest.variance:
            raise InputError(
                f"{where}: expected_motion.{key}: {getattr(table, key)} must lie between lowest_ms {table.lowest_ms} "
                f"and highest_ms {table.highest_ms}, by the sum of their squares"
            )
    return ExpectedMotion(
        expected=expected, lowest=lowest, highest=highest, evidence=table.evidence, source=table.source
    )
