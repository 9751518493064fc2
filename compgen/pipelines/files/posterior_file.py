"""The posterior beside a robot file: found by the name that the file gives, refused where it is not the one meant."""

from collections.abc import Sequence
from pathlib import Path

from compgen.core.codes import Code, Level
from compgen.core.exceptions import InputError
from compgen.core.files import read_regular
from compgen.core.findings import Finding
from compgen.error_model.posterior import ParameterPosterior, numbers_of, posterior_hash, read_posterior
from compgen.error_model.uncertain_sources import UncertainSource
from compgen.job.tables import IdentifiedTable
from compgen.thermal.model import ArmHeat

MOST_BYTES = 64_000_000
_TOO_WIDE = "the sigmas alone say how well its parameters are known, and without their correlations a band is too wide"


def posterior_beside(
    identified: IdentifiedTable | None,
    robot_file: Path,
    known: Sequence[UncertainSource],
    heat: ArmHeat | None,
    *,
    is_overridden: bool = False,
) -> tuple[ParameterPosterior | None, list[Finding]]:
    """The posterior of an identified robot file, None without one, and what the user must know of it.

    Args:
        identified: The file's record of its identification.
        robot_file: Where it was read.
        known: Its sources.
        heat: Its heat model.
        is_overridden: Whether values were given that are not the file's.

    Raises:
        InputError: There is a file of that name, and it is not this robot file's posterior.
    """
    if identified is None:
        return None, []
    if not identified.posterior:
        if not any(k.sigma for k in known):
            return None, []
        message = f"{robot_file}: identified.posterior: no file is named; {_TOO_WIDE}; identify again"
        return None, [Finding(Level.WARNING, Code.POSTERIOR_MISSING, message)]
    beside = [folder / identified.posterior for folder in (robot_file.parent, robot_file.resolve().parent)]
    file = next((f for f in beside if f.exists()), None)
    if file is None:
        message = f"{beside[0]}: not there; {_TOO_WIDE}; copy it along with its robot file"
        return None, [Finding(Level.WARNING, Code.POSTERIOR_MISSING, message)]
    try:
        content = read_regular(file, MOST_BYTES)
    except OSError as failure:
        raise InputError(f"{file}: cannot be read: {failure.strerror}") from failure
    if posterior_hash(content) != identified.posterior_sha256:
        raise InputError(
            f"{file}: its sha256 begins with {posterior_hash(content)[:12]}, {robot_file.name} names one that begins "
            f"with {identified.posterior_sha256[:12] or 'nothing'}: of another identification; take the file that "
            "was written with this robot file, or identify again"
        )
    law = None if heat is None else heat.law
    rise, tau = (None, None) if law is None else (law.reference_rise, law.tau)
    try:
        return read_posterior(content, numbers_of(known, rise, tau), str(file)), []
    except InputError:
        if not is_overridden:
            raise
        message = f"{file}: it belongs to the values that the robot file has without overrides; {_TOO_WIDE}"
        return None, [Finding(Level.WARNING, Code.POSTERIOR_OVERRIDDEN, message)]
