"""What the files say of heat: steps of duty, shifts, air and log of a path file; the models of a robot file."""

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from compgen.core.quantities import Length, NotNegative, Positive, Range, SixRates, ThreePlaces, Word
from compgen.core.toml import Table
from compgen.robot.dh_lengths import LengthName


class StepTable(Table):
    """What the cell does over a stretch: an entry of [[before]], [[cycle]] or [[after]]."""

    state: Literal["moving", "idle", "off"]
    program: str | None = None
    feed_mm_s: Annotated[FiniteFloat, Field(gt=0, le=1e4)] | None = None
    duration_h: Annotated[FiniteFloat, Field(ge=0, le=1e5)] | None = None
    repeat: Annotated[int, Field(ge=1, le=100_000)] | None = None
    dwell_s: Annotated[FiniteFloat, Field(ge=0, le=1e6)] | None = None
    dwell: Literal["idle", "off"] | None = None
    duty: Annotated[FiniteFloat, Field(ge=0, le=1)] | None = None
    shifts: bool = False


DayHour = Annotated[FiniteFloat, Field(ge=0, le=48)]


class ShiftTable(Table):
    """Working hours of every day; a night shift ends after 24."""

    from_h: Annotated[FiniteFloat, Field(ge=0, lt=24)]
    to_h: DayHour
    breaks_h: list[Annotated[list[DayHour], Field(min_length=2, max_length=2)]] = []


Celsius = Annotated[FiniteFloat, Field(ge=-20, le=60)]


class AmbientTable(Table):
    """The air around the robot, from the first [[before]] on."""

    kind: Literal["constant", "ramp", "wave", "csv"] = "constant"
    reference_degC: Celsius = 20.0
    clock_h: Annotated[FiniteFloat, Field(ge=0, lt=24)] = 0.0
    value_degC: Celsius | None = None
    from_degC: Celsius | None = None
    to_degC: Celsius | None = None
    over_h: Annotated[FiniteFloat, Field(gt=0, le=1e5)] | None = None
    amplitude_K: Annotated[FiniteFloat, Field(ge=0, le=20)] | None = None
    period_h: Annotated[FiniteFloat, Field(ge=0.01, le=1e5)] | None = None
    peak_h: Annotated[FiniteFloat, Field(ge=0, le=1e5)] | None = None
    file: str | None = None


class LogTable(Table):
    """A thermocouple log whose end is the state at the first [[before]]."""

    file: str
    reference: Literal["ambient", "start"] | Celsius | None = None
    window_min: Annotated[FiniteFloat, Field(ge=1, le=1e4)] = 20.0


class LossTable(Table):
    """Heat of a drive, shared by all joints: shares of its motor's rated power."""

    holding: NotNegative
    coulomb: NotNegative
    viscous: NotNegative


class BodyTable(Table):
    """A stretch of structure that conducts, cut into volumes; in order from the base plate."""

    name: Word
    length_mm: Length
    volumes: Annotated[int, Field(ge=1, le=200)]
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
    drives: list[Annotated[int, Field(ge=1, le=6)]]


class ProbeTable(Table):
    """A named rise of the network: of a housing, or of a body at a distance from its base end."""

    name: Word
    part: str
    at_mm: Annotated[FiniteFloat, Field(ge=0, le=1e4)] | None = None


class NetworkTable(Table):
    """Heat conduction from the base plate to the flange."""

    floor_W_K: NotNegative
    loss: LossTable
    rated_W: SixRates
    link_kg: Annotated[list[NotNegative], Field(min_length=6, max_length=6)]
    link_centre_mm: Annotated[list[ThreePlaces], Field(min_length=6, max_length=6)]
    payload_kg: NotNegative
    payload_centre_mm: ThreePlaces
    body: Annotated[list[BodyTable], Field(min_length=1)]
    housing: Annotated[list[HousingTable], Field(min_length=1)]
    probe: Annotated[list[ProbeTable], Field(min_length=1)]


class BoxTable(Table):
    """Where the thermal parameters hold."""

    feed_mm_s: Range
    hours: Positive
    rise_K: Positive


class NodeTable(Table):
    """One thermal node."""

    name: Word
    rise_K: Annotated[FiniteFloat, Field(ge=-500, le=500)]
    exponent: Annotated[FiniteFloat, Field(ge=0, le=5)]
    tau_h: Annotated[FiniteFloat, Field(ge=0.001, le=1e4)]


class SectionTable(Table):
    """A stretch of link, from the end of the one before."""

    to_mm: Positive
    from_: Annotated[str, Field(alias="from")]
    to: str
    shape: Literal["linear", "exponential"]


class ProfileTable(Table):
    """One heated length."""

    length: LengthName
    sections: Annotated[list[SectionTable], Field(min_length=1)]


Cte = Annotated[FiniteFloat, Field(ge=-1000, le=1000)]


class ThermalTable(Table):
    """The thermal models: the study's nodes, and the conduction network when the file has one."""

    model: Literal["nodes", "network"] = "nodes"
    cte_um_m_K: Cte | dict[str, Cte]
    reference_feed_mm_s: Annotated[FiniteFloat, Field(ge=0.001, le=1e4)]
    reference_h: Annotated[FiniteFloat, Field(ge=0.001, le=1e4)]
    idle_fraction: Annotated[FiniteFloat, Field(ge=0, le=1)]
    box: BoxTable
    node: Annotated[list[NodeTable], Field(min_length=1)]
    profile: list[ProfileTable]
    sensors: dict[str, str] = {}
    network: NetworkTable | None = None
