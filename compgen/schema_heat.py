"""Heat in the files: steps of duty, shifts, air and log of a path file; the network of a robot file."""

from typing import Annotated, Literal

from compgen.tables import FiniteFloat, Table, within

# Upper ends are far beyond any cell: they keep a slip of the keyboard from becoming a number that overflows.
Positive = Annotated[FiniteFloat, within(gt=0, le=1e6)]
NotNegative = Annotated[FiniteFloat, within(ge=0, le=1e6)]
Length = Annotated[FiniteFloat, within(gt=0, le=1e4)]  # mm
Place = Annotated[FiniteFloat, within(ge=-1e4, le=1e4)]  # mm
Word = Annotated[str, within(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=16)]
ThreePlaces = Annotated[list[Place], within(min_length=3, max_length=3)]
SixRates = Annotated[list[Annotated[FiniteFloat, within(ge=1e-3, le=1e6)]], within(min_length=6, max_length=6)]


class StepTable(Table):
    """What the cell does over a stretch: an entry of [[before]], [[cycle]] or [[after]]."""

    state: Literal["moving", "idle", "off"]
    program: str | None = None
    feed_mm_s: Annotated[FiniteFloat, within(gt=0, le=1e4)] | None = None
    duration_h: Annotated[FiniteFloat, within(ge=0, le=1e5)] | None = None
    repeat: Annotated[int, within(ge=1, le=100_000)] | None = None
    dwell_s: Annotated[FiniteFloat, within(ge=0, le=1e6)] | None = None
    dwell: Literal["idle", "off"] | None = None
    duty: Annotated[FiniteFloat, within(ge=0, le=1)] | None = None
    shifts: bool = False


DayHour = Annotated[FiniteFloat, within(ge=0, le=48)]


class ShiftTable(Table):
    """Working hours of every day; a night shift ends after 24."""

    from_h: Annotated[FiniteFloat, within(ge=0, lt=24)]
    to_h: DayHour
    breaks_h: list[Annotated[list[DayHour], within(min_length=2, max_length=2)]] = []


Celsius = Annotated[FiniteFloat, within(ge=-20, le=60)]


class AmbientTable(Table):
    """The air around the robot, from the first [[before]] on."""

    kind: Literal["constant", "ramp", "wave", "csv"] = "constant"
    reference_degC: Celsius = 20.0
    clock_h: Annotated[FiniteFloat, within(ge=0, lt=24)] = 0.0
    value_degC: Celsius | None = None
    from_degC: Celsius | None = None
    to_degC: Celsius | None = None
    over_h: Annotated[FiniteFloat, within(gt=0, le=1e5)] | None = None
    amplitude_K: Annotated[FiniteFloat, within(ge=0, le=20)] | None = None
    period_h: Annotated[FiniteFloat, within(ge=0.01, le=1e5)] | None = None
    peak_h: Annotated[FiniteFloat, within(ge=0, le=1e5)] | None = None
    file: str | None = None


class LogTable(Table):
    """A thermocouple log whose end is the state at the first [[before]]."""

    file: str
    reference: Literal["ambient", "start"] | Celsius | None = None
    window_min: Annotated[FiniteFloat, within(ge=1, le=1e4)] = 20.0


class LossTable(Table):
    """Heat of a drive, shared by all joints: shares of its motor's rated power."""

    holding: NotNegative
    coulomb: NotNegative
    viscous: NotNegative


class BodyTable(Table):
    """A stretch of structure that conducts, cut into volumes; in order from the base plate."""

    name: Word
    length_mm: Length
    volumes: Annotated[int, within(ge=1, le=200)]
    mass_kg: Positive
    heat_capacity_J_kgK: Positive
    conductance_W_mm_K: Positive  # conductivity x section: W per K across one millimetre
    film_W_K: NotNegative  # of the whole surface to the air


class HousingTable(Table):
    """A joint's housing, after the body of the same place in the list; motors give their heat to it."""

    name: Word
    mass_kg: Positive
    heat_capacity_J_kgK: Positive
    film_W_K: NotNegative
    inward_W_K: Positive  # contact with the body towards the base
    outward_W_K: Positive  # contact with the next body
    drives: list[Annotated[int, within(ge=1, le=6)]]


class ProbeTable(Table):
    """A named rise of the network: of a housing, or of a body at a distance from its base end."""

    name: Word
    part: str
    at_mm: Annotated[FiniteFloat, within(ge=0, le=1e4)] | None = None


class NetworkTable(Table):
    """Heat conduction from the base plate to the flange."""

    floor_W_K: NotNegative
    loss: LossTable
    rated_W: SixRates
    link_kg: Annotated[list[NotNegative], within(min_length=6, max_length=6)]
    link_centre_mm: Annotated[list[ThreePlaces], within(min_length=6, max_length=6)]
    payload_kg: NotNegative
    payload_centre_mm: ThreePlaces
    body: Annotated[list[BodyTable], within(min_length=1)]
    housing: Annotated[list[HousingTable], within(min_length=1)]
    probe: Annotated[list[ProbeTable], within(min_length=1)]
