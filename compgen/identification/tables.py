"""Tables of an artefact's file: spheres at certified or unknown places, planes, lengths, and the probe."""

from typing import Annotated

from pydantic import Field, FiniteFloat

from compgen.core.toml import NAME, Coordinate, Length, NotNegative, Table

Name = Annotated[str, Field(pattern=NAME, max_length=32)]
Direction = Annotated[list[Annotated[FiniteFloat, Field(ge=-1, le=1)]], Field(min_length=3, max_length=3)]


class OwnPlacesTable(Table):
    """That places are where this robot itself commanded its probe when it touched them: its cold errors are in them."""

    rise_K: dict[Annotated[str, Field(max_length=32)], Annotated[FiniteFloat, Field(ge=-80, le=80)]] = {}
    """Rise of each node then; a node that is not named was cold."""


class ArtefactTable(Table):
    """What was touched, as a whole."""

    frame: Annotated[str, Field(pattern=r"^(world|uframe [1-9])$")] = "world"
    """Frame that touches in x_mm to r_deg are commanded in."""
    cte_um_m_K: Annotated[FiniteFloat, Field(ge=0, le=100)] = 0.0
    """Expansion of the artefact; its places hold at 20 degC."""
    temperature_degC: Annotated[FiniteFloat, Field(ge=-20, le=60)] = 20.0
    """Temperature of the artefact while it is touched."""
    certified: bool | None = None
    """Whether places and lengths are certified; left out: a [[length]] is, places are not."""
    taught: OwnPlacesTable | None = None
    """That this robot has taught the places; left out: an instrument has measured them. For cgen anchor."""


class SphereTable(Table):
    """A sphere in the artefact's own coordinates; without a place it is unknown, and fitted along."""

    name: Name
    x_mm: Coordinate | None = None
    y_mm: Coordinate | None = None
    z_mm: Coordinate | None = None
    diameter_mm: Length | None = None
    sigma_um: NotNegative = 0.0


class PlaneTable(Table):
    """A plane through a point, that is touched against its normal; for cgen anchor."""

    name: Name
    x_mm: Coordinate
    y_mm: Coordinate
    z_mm: Coordinate
    normal: Direction
    """Unit vector out of the material."""
    sigma_um: NotNegative = 0.0
    """Of the plane along its normal."""


class LengthTable(Table):
    """A length between two spheres."""

    between: Annotated[list[str], Field(min_length=2, max_length=2)]
    mm: Length
    sigma_um: NotNegative = 0.0


class TouchProbeTable(Table):
    """The probe: its ball, and where its centre is in the flange."""

    diameter_mm: Annotated[FiniteFloat, Field(ge=0, le=1000)] = 0.0
    x_mm: Coordinate = 0.0
    y_mm: Coordinate = 0.0
    z_mm: Coordinate = 0.0


class ArtefactFile(Table):
    """An artefact's file."""

    artefact: ArtefactTable = ArtefactTable()
    sphere: Annotated[list[SphereTable], Field(max_length=1000)] = []
    plane: Annotated[list[PlaneTable], Field(max_length=1000)] = []
    length: list[LengthTable] = []
    probe: TouchProbeTable = TouchProbeTable()
