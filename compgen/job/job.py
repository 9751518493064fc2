"""What one run needs, in SI, with nothing left to look up: a job plans a program, a cell takes one that exists."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from compgen.compensation.problem import Settings
from compgen.core.arrays import Array
from compgen.core.exceptions import refuse_changes
from compgen.core.findings import Finding
from compgen.core.pose import IDENTITY, Pose
from compgen.error_model.anchored_state import AnchoredState
from compgen.error_model.model import ErrorModel, build_error_model
from compgen.error_model.posterior import ParameterPosterior
from compgen.error_model.source import Source
from compgen.error_model.uncertain_sources import UncertainSource
from compgen.error_model.unmeasured import Unknown
from compgen.job.bounds import Bounds, OwnFile
from compgen.job.part_frame import PartFrame
from compgen.job.tables import Drifting, FitLimits
from compgen.planning.boundaries import Boundary
from compgen.planning.curves import PiecewiseCurve
from compgen.planning.exact_path import ExactPath
from compgen.planning.surfaces import Quadric
from compgen.robot.inverse_kinematics import Posture
from compgen.robot.robot import Robot
from compgen.thermal import Duty, JointMotion, Profile, ThermalModel, state_after
from compgen.thermal.ensemble import Ensemble, Start, duties_before
from compgen.thermal.model import ArmHeat
from compgen.thermal.schedule import History
from compgen.thermal.state_from_log import TemperatureLog
from compgen.thermal.uncertainty import DisturbedHeat, HeatChange, Past, ThermalUncertainty


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Cell:
    """A robot, how it warms, and what makes it err: all that a program which exists already needs."""

    robot: Robot
    heat: ArmHeat
    profiles: tuple[Profile, ...]
    warmth: ThermalUncertainty  # how well it is known
    unknown: tuple[Unknown, ...]  # what the file does not know
    known: tuple[UncertainSource, ...]  # the sources with how well each parameter is known
    sources: tuple[Source, ...]
    joint_box: Array | None  # (6, 2) [rad] pendant angles that the parameters were identified in
    overrides: tuple[str, ...]
    inputs_hash: str  # of the robot file and the overrides
    robot_file: str  # that was read
    robot_file_hash: str  # sha256 of its bytes
    sensors: Mapping[str, str] = field(default_factory=dict)  # part_<n> of a thermocouple log to the name of a rise
    held_out: float | None = None  # [m] error of the file's prediction at poses that its identification did not see
    input_findings: tuple[Finding, ...] = ()  # values of the robot file that look like another unit's; what is missing
    posterior: ParameterPosterior | None = None  # how well identification knows its parameters together
    fit: FitLimits = field(default_factory=FitLimits)  # what its identification says that it cannot do
    drifting: Drifting = field(default_factory=Drifting)  # what touches shall tell of beside warmth and base
    state: AnchoredState | None = None  # that its heat begins with, and that its base and sources are moved by
    inputs: Mapping[str, Any] = field(default_factory=dict)  # every key of the robot file, overrides in it
    past: Past | None = None  # that led to where its heat begins, of the rest of a program; None: nothing since
    heat_change: HeatChange | None = None  # of a draw: how the warmth differs from what the files say

    @property
    def warming(self) -> ThermalModel:
        """How the robot warms: as its heat says, or as a draw changes it."""
        return self.heat if self.heat_change is None else DisturbedHeat(self.heat, self.warmth, self.heat_change)

    @property
    def missing(self) -> float:
        """kappa: of the thermal error, what the physics leaves out: as its warm-up showed, else as the file has it."""
        return self.warmth.missing if self.fit.missing is None else self.fit.missing

    def error_model(self, tool: Pose) -> ErrorModel:
        """Of the robot with a TCP in its flange."""
        return build_error_model(self.robot, self.sources, len(self.heat.names), tool)


@dataclass(frozen=True, slots=True)
class Tool:
    """What the robot carries along the path."""

    number: int  # UTOOL on the controller
    pose: Pose  # TCP in the flange
    spin: float  # [rad] its x axis against base x on the path
    sigma: tuple[float, ...] = (0.0, 0.0, 0.0)  # [m] of its TCP along the flange's axes
    payload: int | None = None  # schedule on the controller that holds its mass


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class PathPlan:
    """Where the tool goes: a pattern laid on a surface."""

    pattern: PiecewiseCurve
    surface: Quadric
    boundary: Boundary
    frame: PartFrame | None = None  # that the path is given in; None: World
    raised: float = 0.0  # [m] along z of that frame: a dry run
    tolerance: float = 0.0  # [m] by which the pattern may leave the user's own points or lines

    def exact(self, spin: float) -> ExactPath:
        """The pattern on its surface, for a tool whose x axis is turned by ``spin`` [rad]."""
        return ExactPath(curve=self.pattern, surface=self.surface, boundary=self.boundary, spin=spin, frame=self.place)

    @property
    def place(self) -> Pose | None:
        """Where the path is laid: the part's place, raised for a dry run; None: World."""
        place = None if self.frame is None else self.frame.place
        if self.raised == 0:
            return place
        if place is None:
            place = IDENTITY
        return Pose(place.position + self.raised * place.rotation[:, 2], place.rotation)


@dataclass(frozen=True, slots=True, kw_only=True)
class Process:
    """How the tool goes along its path."""

    feed: float  # [m/s]
    chord: float  # [m] largest distance of the path from the line between two waypoints
    spacing: float  # [m] largest distance of two waypoints
    arcs: bool  # circular motions where the path curves
    thin: float | None  # [m] tolerance for leaving waypoints out of the program; None keeps all
    lift: float  # [m] approach and retract
    lead_in: bool | None  # whether the approach turns every joint through its play; None: where the robot has play
    stop_on_the_part: bool  # may the robot be stopped there, where a long program is parted into pages?
    acc: int | None = None  # [%] of the robot's accelerations; None: all


@dataclass(frozen=True, eq=False, slots=True)
class ProgramPlan:
    """What a program shall do, on whatever robot and however warm: path, process, tool and posture."""

    source: str  # the path file, for messages
    path: PathPlan
    process: Process
    tool: Tool
    posture: Posture


@dataclass(frozen=True, eq=False, slots=True, weakref_slot=True, repr=False, kw_only=True)
class Job:
    """A planned program, the cell that shall run it, and what went before."""

    name: str
    title: str
    plan: ProgramPlan
    cell: Cell  # its heat begins where a log ends
    history: History  # what the cell does before this program and around its runs
    settings: Settings  # of the correction
    start_drift: float  # [m] how much a late start may add
    bounds: Bounds
    overrides: tuple[str, ...]  # on both files
    inputs_hash: str  # of both files, what they name, and the overrides
    input_findings: tuple[Finding, ...] = ()  # values of both files that look like another unit's
    #: plans the day anew for it, of the program as it is known to be driven; None: the robot file has one
    on_other_heat_model: "Callable[[JointMotion | None], Job] | None" = None
    log: TemperatureLog | None = None  # that its heat begins with, as it was read
    own_file: OwnFile | None = None  # the user's own path, as the judge reads it; None: a pattern
    ensemble: Ensemble | None = None  # the starts that the file shall serve; None: the planned one alone
    inputs: Mapping[str, Any] = field(default_factory=dict)  # keys of ``path`` and ``robot``, ``files`` that they name

    def __repr__(self) -> str:
        return f"<Job {self.name}: {self.title}, on {self.cell.robot.name}>"

    @property
    def source(self) -> str:
        """The path file."""
        return self.plan.source

    @property
    def tool(self) -> Tool:
        """What the robot carries."""
        return self.plan.tool

    @property
    def posture(self) -> Posture:
        """In which the program is driven."""
        return self.plan.posture

    @property
    def frame(self) -> PartFrame | None:
        """That the path is given in; None: World."""
        return self.plan.path.frame

    @property
    def feed(self) -> float:
        """Wanted along the path [m/s]."""
        return self.plan.process.feed

    @property
    def robot(self) -> Robot:
        """That runs the program."""
        return self.cell.robot

    @property
    def heat(self) -> ThermalModel:
        """How the robot warms."""
        return self.cell.warming

    @property
    def sources(self) -> tuple[Source, ...]:
        """What makes the robot err."""
        return self.cell.sources

    @property
    def clock(self) -> float:
        """When it is planned to start, from the first duty of ``before`` on [s]."""
        first = 0.0 if self.ensemble is None else self.history.runs[self.ensemble.runs[0]]
        return self.history.clock + first

    def duties_before(self) -> tuple[Duty, ...]:
        """What the cell does until the last run that the file serves."""
        if self.ensemble is None:
            return self.history.before
        return duties_before(self.history, Start(self.ensemble.runs[1]))

    def state(self) -> Array:
        """Thermal state at the planned start, (S,); of several runs that one file serves, at the first of them."""
        if self.ensemble is None:
            return self.history.state(self.heat)
        return state_after(self.heat, duties_before(self.history, self.ensemble.first), air=self.history.air)

    def start_rise(self) -> Array:
        """Rises then, (K,) [K]."""
        return np.asarray(self.heat.outputs @ self.state())


ANOTHER = "give overrides to compgen.load_job for another one"
refuse_changes(Job, "a job", ANOTHER)
for _part in (Cell, ProgramPlan, PathPlan, Process, Tool, History, Settings, Bounds):
    refuse_changes(_part, "a part of a job", ANOTHER)
