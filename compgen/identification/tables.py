"""What a robot file says of its identification."""

from typing import Annotated

from pydantic import Field

from compgen.core.quantities import Angle, NotNegative, Number, Place
from compgen.core.toml import Table


class IdentifiedTable(Table):
    """What identification found beside the sources: where instrument and reflectors were, and how good it is."""

    model: str = ""
    noise_um: NotNegative = 0.0
    held_out_um: Annotated[list[Number], Field(max_length=3)] = []  # mean and its 95 % interval
    instrument_mm: Annotated[list[Number], Field(min_length=3, max_length=3)]
    instrument_deg: Annotated[list[Angle], Field(min_length=3, max_length=3)]  # rotation vector, World to instrument
    reflector_mm: dict[str, Annotated[list[Place], Field(min_length=3, max_length=3)]]  # in the flange
