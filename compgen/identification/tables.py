"""Table of a robot file for its identification."""

from typing import Annotated

from pydantic import Field

from compgen.core.quantities import Angle, NotNegative, Number, Point
from compgen.core.toml import Table


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
