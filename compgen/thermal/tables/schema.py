"""Tables of heat: duty, shifts, air and temperature log of a path file; the thermal models of a robot file."""

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from compgen.core.recorded.layout import DialectTable
from compgen.core.toml import Identifier, Length, NotNegative, Point, Positive, Range, SixRates, Table
from compgen.core.units import MINUTE
from compgen.robot.robot import LengthName
from compgen.thermal.temperature_log import COLD_START

DayHour = Annotated[FiniteFloat, Field(ge=0, le=48)]
Celsius = Annotated[FiniteFloat, Field(ge=-20, le=60)]
Expansion = Annotated[FiniteFloat, Field(ge=-1000, le=1000)]  # um/(m K)
Kelvins = Annotated[FiniteFloat, Field(ge=0, le=100)]
Growth = Annotated[FiniteFloat, Field(ge=-100, le=500)]  # %
Axis = Annotated[int, Field(ge=1, le=6)]
MaterialName = Literal["steel", "cast iron", "aluminium"]


class StepTable(Table):
    """A stretch of what the cell does: an entry of [[before]], [[cycle]] or [[after]], in order."""

    state: Literal["moving", "idle", "off"]
    """What the robot does: runs a program, stands with the servo on, or stands with it off."""
    program: str | None = None
    """Path file of the program that moves; default this one, at the feed given."""
    feed_mm_s: Annotated[FiniteFloat, Field(gt=0, le=1e4)] | None = None
    """Feed while moving; default that of the program named; moving needs one of the two."""
    duration_h: Annotated[FiniteFloat, Field(ge=0, le=1e5)] | None = None
    """Length of the stretch; this or repeat."""
    repeat: Annotated[int, Field(ge=1, le=100_000)] | None = None
    """Runs of the program, each followed by a dwell; this or duration_h. Refused where duty or shifts leave fewer."""
    dwell_s: Annotated[FiniteFloat, Field(ge=0, le=1e6)] | None = None
    """Pause after each run; default 0."""
    dwell: Literal["idle", "off"] | None = None
    """Servo on (idle) or off during the dwell; default idle."""
    duty: Annotated[FiniteFloat, Field(ge=0, le=1)] | None = None
    """Share of duration_h in motion, the rest idle; default 1."""
    shifts: bool = False
    """Whether the program moves inside the working hours of [[shift]] only."""


class ShiftTable(Table):
    """Working hours of every day."""

    from_h: Annotated[FiniteFloat, Field(ge=0, lt=24)]
    """Hour of the day at which the shift begins."""
    to_h: DayHour
    """Hour at which it ends; above 24 for a night shift."""
    breaks_h: list[Annotated[list[DayHour], Field(min_length=2, max_length=2)]] = []
    """Breaks, each its first and its last hour; the robot is idle."""


class AmbientTable(Table):
    """Temperature of the air around the robot, from the first [[before]] on."""

    kind: Literal["constant", "ramp", "wave", "csv"] = "constant"
    """Course of the air temperature."""
    reference_degC: Celsius = 20.0
    """Temperature at which the robot was calibrated: every rise counts from it."""
    clock_h: Annotated[FiniteFloat, Field(ge=0, lt=24)] = 0.0
    """Hour of the day at which the first [[before]] begins: shifts, a wave and clock times of a csv count by it."""
    value_degC: Celsius | None = None
    """constant: the temperature; wave: its mean; default reference_degC."""
    from_degC: Celsius | None = None
    """ramp: temperature at its beginning."""
    to_degC: Celsius | None = None
    """ramp: temperature at its end and afterwards."""
    over_h: Annotated[FiniteFloat, Field(gt=0, le=1e5)] | None = None
    """ramp: how long it takes."""
    amplitude_K: Annotated[FiniteFloat, Field(ge=0, le=20)] | None = None
    """wave: half of its peak-to-peak difference."""
    period_h: Annotated[FiniteFloat, Field(ge=0.01, le=1e5)] | None = None
    """wave: its period; default 24."""
    peak_h: Annotated[FiniteFloat, Field(ge=0, le=1e5)] | None = None
    """wave: hour of the highest temperature; default 15."""
    file: str | None = None
    """csv: file beside the path file: ambient_degC by time_s from the first [[before]] on, or by clock times."""

    @property
    def is_given(self) -> bool:
        """Whether it says how warm the air is."""
        return bool(self.model_fields_set - {"reference_degC", "clock_h"})

    @property
    def counts_from(self) -> float | None:
        """What rises count from [degC] where it says so, by its key or by the air that counts from it; else None."""
        return self.reference_degC if self.is_given or "reference_degC" in self.model_fields_set else None


class LogTable(DialectTable):
    """A thermocouple log; its end is the thermal state at the first [[before]]."""

    file: str
    """File beside the path file: time_s, ambient_degC, <node>_degC or part_<n>_degC; or as a logger writes it."""
    reference: Literal["ambient", "start"] | Celsius | None = None
    """What rises, and the air of [ambient], count from: degC (default ambient.reference_degC), air, cold start."""
    window_min: Annotated[FiniteFloat, Field(ge=0.01, le=1e4)] = COLD_START / MINUTE
    """How much of the log's beginning reference = "start" takes the median of."""


class LossTable(Table):
    """Heat of a drive as shares of its motor's rated power, the same for all joints."""

    holding: NotNegative
    """Copper loss at the torque that the joint holds."""
    coulomb: NotNegative
    """Friction that does not depend on speed."""
    viscous: NotNegative
    """Friction that rises with speed."""


class BodyTable(Table):
    """A body that conducts heat, cut into volumes; bodies are listed from the base plate to the flange."""

    name: Identifier
    """Name of the body; a heated length has a body of its name."""
    length_mm: Length
    """Length along the conduction."""
    volumes: Annotated[int, Field(ge=1, le=200)]
    """Number of finite volumes."""
    material: MaterialName | None = None
    """What it is made of, which bounds heat capacity and conductance; default any of these that would do."""
    mass_kg: Positive
    """Mass."""
    heat_capacity_J_kgK: Positive
    """Specific heat capacity, within its material's."""
    conductance_W_mm_K: Positive
    """Conductivity times cross-section: watts per kelvin across one millimetre; at most what its mass could conduct."""
    film_W_K: NotNegative
    """Heat transfer of the whole surface to the air."""


class HousingTable(Table):
    """A joint's housing, behind the body of the same place in the list; motors heat it."""

    name: Identifier
    """Name of the housing."""
    mass_kg: Positive
    """Mass."""
    heat_capacity_J_kgK: Positive
    """Specific heat capacity."""
    film_W_K: NotNegative
    """Heat transfer of the whole surface to the air."""
    inward_W_K: Positive
    """Contact with the body towards the base."""
    outward_W_K: Positive
    """Contact with the body towards the flange."""
    drives: list[Axis]
    """Joints whose motors heat this housing."""


class ProbeTable(Table):
    """A named rise of the network, at a housing or along a body."""

    name: Identifier
    """Name of the rise."""
    part: str
    """Name of the housing or body."""
    at_mm: Annotated[FiniteFloat, Field(ge=0, le=1e4)] | None = None
    """Distance from the body's base end; default 0."""


class NetworkTable(Table):
    """Heat conduction from the base plate to the flange, with heat from the motion itself."""

    floor_W_K: NotNegative
    """Contact of the base plate with the floor."""
    loss: LossTable
    rated_W: SixRates
    """Rated power of each joint's motor."""
    link_kg: Annotated[list[NotNegative], Field(min_length=6, max_length=6)]
    """Mass of each link."""
    link_centre_mm: Annotated[list[Point], Field(min_length=6, max_length=6)]
    """Centre of each link's mass from its joint, World axes, pendant angles zero."""
    payload_kg: NotNegative
    """Mass of tool and spindle."""
    payload_centre_mm: Point
    """Centre of mass of tool and spindle in the flange."""
    body: Annotated[list[BodyTable], Field(min_length=1)]
    """Bodies from the base plate to the flange."""
    housing: Annotated[list[HousingTable], Field(min_length=1)]
    """Housings, one between two bodies."""
    probe: Annotated[list[ProbeTable], Field(min_length=1)]
    """Rises that the file names."""


class BoxTable(Table):
    """Range in which the thermal parameters were measured; beyond it a finding."""

    feed_mm_s: Range
    """Lowest and highest feed."""
    hours: Positive
    """Longest time in motion [h]."""
    rise_K: Positive
    """Largest rise."""


class NodeTable(Table):
    """A node of the thermal model: its rise follows the feed with a first-order lag."""

    name: Identifier
    """Name of the node."""
    rise_K: Annotated[FiniteFloat, Field(ge=-500, le=500)]
    """Rise at the reference: reference_h at reference_feed_mm_s, from cold."""
    exponent: Annotated[FiniteFloat, Field(ge=0, le=5)]
    """Exponent of the feed in the steady rise."""
    tau_h: Annotated[FiniteFloat, Field(ge=0.001, le=1e4)]
    """Time constant."""
    law_K: Kelvins | None = None
    """Error of its rise by a law that was fitted to this arm, in place of thermal.uncertainty.law_K."""


class StateTable(Table):
    """What the robot is before the program, as cgen anchor found it: it stands in place of [[before]] and [log]."""

    file: str
    """The state's file, from the path file's folder; cgen's --state."""
    age_min: Annotated[FiniteFloat, Field(ge=0, le=1e5)] = 0.0
    """How long before the program it was; the robot has stood since, with its servo on; cgen's --state-age."""


class StartTable(Table):
    """Which start of the program is meant, where it is not the first run, at once."""

    run: Annotated[int, Field(ge=1, le=20_000)] = 1
    """Run of [[cycle]], from 1: what the cycle does until then goes before."""
    delay_min: Annotated[FiniteFloat, Field(ge=0, le=960)] = 0.0
    """How much later than planned it starts; the robot stands until then, with its servo on."""


class SectionTable(Table):
    """A section of a profile, from the end of the one before it."""

    to_mm: Positive
    """Where it ends, from the base end of the length."""
    from_: Annotated[str, Field(alias="from")]
    """Node whose rise it has at its beginning."""
    to: str
    """Node whose rise it has at its end."""
    shape: Literal["linear", "exponential"]
    """Course of the rise between them."""


class ProfileTable(Table):
    """Rise along a length that grows."""

    length: LengthName
    """DH length that grows; d1 is the base column."""
    sections: Annotated[list[SectionTable], Field(min_length=1)]
    """Sections from the base end of the length to its other end."""


class UncertaintyTable(Table):
    """How well the warmth is known: standard deviations, intervals of equal likelihood; what is missing is assumed."""

    provenance: Annotated[str, Field(max_length=400)] = ""
    """Where the values are from."""
    law_K: Kelvins | None = None
    """Error of a node's rise by the law, at states that its fit left out; each node by itself."""
    sensors_K: Kelvins | None = None
    """Error of the measured rises that all sensors share."""
    air_K: Kelvins | None = None
    """Error of the air's temperature."""
    feed_percent: Annotated[FiniteFloat, Field(ge=0, le=100)] | None = None
    """Error of the feed that the robot really drives."""
    missing_percent: Annotated[FiniteFloat, Field(ge=0, le=200)] | None = None
    """What the physics of the model leaves out, as a share of the thermal error, along any direction."""
    cte_um_m_K: Annotated[list[Expansion], Field(min_length=2, max_length=2)] | None = None
    """Lowest and highest coefficient of expansion; not used where the lengths have coefficients of their own."""
    growth_percent: dict[str, Annotated[list[Growth], Field(min_length=2, max_length=2)]] = {}
    """By length: least and most that it grows by another temperature profile, over what this file's profiles say."""


class ThermalTable(Table):
    """Thermal models of the robot: nodes, and the conduction network where the file has one."""

    model: Literal["nodes", "network"] = "nodes"
    """Which of the models is used."""
    cte_um_m_K: Expansion | dict[str, Expansion]
    """Coefficient of thermal expansion, one for all lengths or a table by length."""
    reference_feed_mm_s: Annotated[FiniteFloat, Field(ge=0.001, le=1e4)]
    """Feed of the reference."""
    reference_h: Annotated[FiniteFloat, Field(ge=0.001, le=1e4)]
    """Time of the reference, from cold."""
    idle_fraction: Annotated[FiniteFloat, Field(ge=0, le=1)]
    """Heat while standing with the servo on, as a share of that at the reference feed."""
    box: BoxTable
    node: Annotated[list[NodeTable], Field(min_length=1)]
    """Nodes of the thermal model."""
    profile: list[ProfileTable]
    """Lengths that grow, and the rise along them."""
    sensors: dict[str, str] = {}
    """Which rise each part_<n> of a thermocouple log shows, or a column of the logger's own name."""
    network: NetworkTable | None = None
    uncertainty: UncertaintyTable | None = None
