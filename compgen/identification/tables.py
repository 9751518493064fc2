"""Table of a robot file for its identification."""

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field, FiniteFloat

from compgen.core.quantities import Angle, NotNegative, Number, Point
from compgen.core.toml import Table
from compgen.core.units import PERCENT, UM


class IdentifiedTable(Table):
    """Record of the identification: where instrument and reflectors stood, and how well the fit predicts."""

    model: str = ""
    """Which groups of parameters were identified."""
    noise_um: NotNegative = 0.0
    """Standard deviation of one measured coordinate."""
    held_out_um: Annotated[list[Number], Field(max_length=3)] = []
    """Error at poses that the fit did not see: mean and its 95 % interval."""
    posterior: Annotated[str, Field(pattern=r"^([^/\\]{1,120}\.posterior\.json)?$")] = ""
    """File beside this one with the covariance of the identified parameters."""
    posterior_sha256: Annotated[str, Field(pattern="^([0-9a-f]{64})?$")] = ""
    """Its sha256 (line ends as LF): no other file is taken for it."""
    fit_noise_um: NotNegative = 0.0
    """Error of the fit along any direction that is neither the instrument's nor the robot's repeatability."""
    thermal_missing_percent: Annotated[FiniteFloat, Field(ge=0, le=200)] | None = None
    """What the fitted physics leaves out of the thermal error, along any direction; from blocks foretold in time."""
    repeatability_um: NotNegative | None = None
    """Standard deviation of one run from the mean of all, along any direction."""
    forecast_scale: Annotated[FiniteFloat, Field(ge=1, le=100)] = 1.0
    """Factor of the band: rms score of blocks of warm poses that were foretold from those before, at least 1."""
    forecast_blocks: Annotated[int, Field(ge=0, le=10_000)] = 0
    """How many blocks that score is of."""
    instrument: str = ""
    """Name of the instrument, where the measurements name it."""
    instrument_mm: Annotated[list[Number], Field(min_length=3, max_length=3)] | None = None
    """Origin of World in the instrument's frame."""
    instrument_deg: Annotated[list[Angle], Field(min_length=3, max_length=3)] | None = None
    """Rotation vector from World to the instrument's frame."""
    reflector_mm: dict[str, Point]
    """Place of each reflector in the flange, by its name."""
    artefact_mm: dict[str, Point] = {}
    """Origin of World in the frame of each artefact of known places that was touched, by its file's name."""
    artefact_deg: dict[str, Annotated[list[Angle], Field(min_length=3, max_length=3)]] = {}
    """Rotation vector from World to that frame."""
    place_mm: dict[str, Point] = {}
    """Place of each sphere, in its artefact's frame or in World, and of each socket of a ballbar."""


@dataclass(frozen=True, slots=True)
class FitLimits:
    """What an identification says that its fit cannot do."""

    noise: float = 0.0  # [m] tau
    missing: float | None = None  # kappa, of the thermal error; None: the file's own for warmth holds
    repeatability: float | None = None  # [m] of one run; None: not known
    scale: float = 1.0  # lambda, of the whole band
    blocks: int = 0  # that the scale was found from


def fit_limits_of(table: IdentifiedTable | None) -> FitLimits:
    """What a robot file's record of its identification says of its fit."""
    if table is None:
        return FitLimits()
    missing, repeatability = table.thermal_missing_percent, table.repeatability_um
    return FitLimits(
        noise=table.fit_noise_um * UM,
        missing=None if missing is None else missing * PERCENT,
        repeatability=None if repeatability is None else repeatability * UM,
        scale=table.forecast_scale,
        blocks=table.forecast_blocks,
    )
