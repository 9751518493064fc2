"""The contract of an error source: what it may know of a moment, and what it declares of itself."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar, Literal, Protocol, runtime_checkable

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, BoolArray, own, owns
from compgen.core.exceptions import InputError
from compgen.core.toml import suggest
from compgen.error_model.loads import Loads
from compgen.error_model.schema import SourceTable
from compgen.robot.kinematics import Chain
from compgen.robot.robot import Robot

#: how the direction that a joint has come from follows its motion, as ``direction_memory`` has it
Law = Literal["dahl", "play"]
#: of fields by name; a letter stands for as many as the source has
Shapes = Mapping[str, tuple[int | str, ...]]
#: the steps of identification's ladder of models; "temperature" is in every model but the one of frames only
Rung = Literal["temperature", "joint zeros", "geometry", "joints", "ripple"]


@dataclass(frozen=True, eq=False, slots=True)
class State:
    """A moment as symbols, or as numbers.

    ``direction`` and ``travel`` are states with a memory, from ``direction_memory``: they blend through a reversal and
    are zero where nothing is known of the motion before.
    """

    nominal: Chain  # what the controller believes: commanded joints, nominal lengths, the tool
    rise: Any  # (K, 1) [K] of the heat model's nodes and gradients
    direction: Any  # (6, 1) [-1, 1] of the motion of each joint theta
    travel: Any  # (3, 1) [-1, 1] of the TCP's motion along each World axis


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """A field of a source that measurements may fit.

    In the robot file its key carries the unit; ``value_SI = value_file * unit``.
    """

    field: str
    key: str
    shape: tuple[int | str, ...]  # a letter stands for as many as the source has
    unit: float
    prior: float  # [SI] standard deviation of each entry before any measurement
    meaning: str


@dataclass(frozen=True, slots=True)
class Fact:
    """A field of a source that its table gives and that no pose fits; ``value_SI = value_file * unit``."""

    field: str
    key: str
    unit: float | None  # None: words


@dataclass(frozen=True, slots=True)
class ArmFacts:
    """What the robot file says of the arm outside a source's own table."""

    robot: Robot
    nodes: tuple[str, ...]  # names of the K rises
    growth: tuple[Array, Array]  # of a and d at the file's cte, (6, K) [m/K]
    loads: Loads


@dataclass(frozen=True, slots=True)
class Fitting:
    """How identification begins with a source."""

    rung: Rung  # the step of the ladder at which it enters
    table: SourceTable | None = None  # to begin with where the robot file has none; None: fitted only if it has one
    replaces: bool = False  # begin with ``table`` whatever the robot file has


@dataclass(frozen=True, slots=True)
class Visibility:
    """What measurements of the flange can show."""

    robot: Robot
    joints: tuple[int, ...]  # that move, from 0
    warm_up: bool  # the arm warmed up while it was measured
    temperatures: bool  # and its temperatures are known


@dataclass(frozen=True, slots=True)
class Entry:
    """An entry of a parameter that measurements may fit."""

    field: str
    index: tuple[int, ...]
    group: str = ""  # entries of a group share the scale of their prior; by default those of the field
    label: str = ""  # what it is called in place of its index


class Source(Protocol):
    """What makes the real arm differ from the nominal one: a frozen dataclass whose parameters are numbers or SX."""

    NAME: ClassVar[str]  # its table in the robot file
    PARAMETERS: ClassVar[tuple[Parameter, ...]]
    FACTS: ClassVar[tuple[Fact, ...]]
    FITTING: ClassVar[Fitting | None]  # None: identification leaves it as the robot file has it
    BUDGET: ClassVar[str]  # under which name its uncertainty stands in a budget

    @staticmethod
    def derive(table: Any, arm: ArmFacts, key: str) -> dict[str, Any]:
        """The fields that are neither parameters nor facts of the table alone.

        Args:
            table: The source's own.
            arm: What else the robot file says.
            key: File and table, for messages.

        Raises:
            InputError: The table does not fit the arm or itself.
        """

    def entries_to_fit(self, visible: Visibility) -> Sequence[Entry]:
        """What measurements can tell apart from the frames of instrument and reflectors, in order of PARAMETERS."""

    def distort(self, chain: Chain, state: State) -> Chain:
        """The chain with this error in it; parameters that are exactly zero leave it as it is."""


class DeclaredSource:
    """What sources have in common: by default no facts, nothing to derive, since the table says it all, nor to fit."""

    __slots__ = ()

    FACTS: ClassVar[tuple[Fact, ...]] = ()
    FITTING: ClassVar[Fitting | None] = None
    BUDGET: ClassVar[str] = "geometry"
    ARRAYS: ClassVar[Shapes] = MappingProxyType({})  # shapes of what is no parameter

    def __post_init__(self) -> None:
        lengths = freeze_parameters(self)
        own(self, **{name: tuple(lengths.get(n, n) for n in shape) for name, shape in self.ARRAYS.items()})

    @staticmethod
    def derive(table: Any, arm: ArmFacts, key: str) -> dict[str, Any]:
        """Nothing."""
        return {}

    def entries_to_fit(self, visible: Visibility) -> list[Entry]:
        """None."""
        return []


@dataclass(frozen=True, eq=False, slots=True)
@owns(joint=(6,), travel=(3,))
class ReversalWidths:
    """How far a motion must go to be forgotten; infinite where nothing depends on it."""

    joint: Array  # (6,) [rad]
    travel: Array  # (3,) [m] of the TCP along each World axis
    law: Law = "dahl"  # of the joints


@runtime_checkable
class DirectionDependent(Protocol):
    """A source that depends on where joints or TCP come from."""

    def reversal_widths(self) -> ReversalWidths:
        """Over which the direction blends after a reversal."""

    def with_widths(self, factor: Array) -> "Source":
        """The source with the widths of its joints times factors, (6,)."""


@runtime_checkable
class RiseDependent(Protocol):
    """A source of the arm that depends on rises."""

    def nodes(self) -> set[int]:
        """Columns of the rises that it depends on."""


@runtime_checkable
class Expanding(Protocol):
    """A source whose lengths grow by a coefficient of expansion."""

    def expansions(self) -> Mapping[str, Entry]:
        """Of each length that grows, the parameter that is its coefficient over the file's, less one."""


@runtime_checkable
class Doubtful(Protocol):
    """A source whose identified values may contradict what the robot file says of its loads."""

    def doubt(self, sigma: Mapping[str, Array]) -> str:
        """What contradicts, by standard deviations by field, in words; empty where nothing does."""


@runtime_checkable
class Extensible(Protocol):
    """A source of a list of terms, to which identification may add all others that physics knows of."""

    def extended(self, arm: ArmFacts, nodes: Sequence[str]) -> tuple["Source", Mapping[str, Array]]:
        """The source with all terms that follow some nodes, its own first, and the priors of those added, by field."""

    def only(self, terms: BoolArray) -> "Source":
        """The source with some of its terms, (B,)."""


@runtime_checkable
class LoadDependent(Protocol):
    """A source that depends on what the joints carry."""

    @property
    def loads(self) -> Loads:
        """Masses and forces."""


def check_terms(table: Any, count: int, of: str, lists: Sequence[str], arm: ArmFacts, key: str) -> None:
    """Raises InputError where a table's lists of terms are not all as long, or a term follows a rise that is none.

    Args:
        table: A source's, with a list ``node``.
        count: How many terms there are.
        of: What they are of, for the message.
        lists: Names of the lists.
        arm: With the names of the rises.
        key: File and table, for messages.
    """
    for name in lists:
        if len(getattr(table, name)) != count:
            raise InputError(f"{key}.{name}: {len(getattr(table, name))} entries for {count}{of}; give one each")
    for i, node in enumerate(table.node):
        if node not in arm.nodes:
            raise InputError(f"{key}.node.{i}: '{node}' is unknown{suggest(node, list(arm.nodes))}")


def freeze_parameters(source: Any) -> dict[int | str, int]:
    """Make the parameters of a frozen source read-only copies of their declared shape; expressions stay as they are.

    A vector (n,) may be an SX column (n, 1), a matrix (n, m) an SX of that shape.

    Returns:
        What the letters of the shapes stand for.

    Raises:
        ValueError: A parameter has another shape.
    """
    shapes = {p.field: p.shape for p in source.PARAMETERS}
    lengths: dict[int | str, int] = {}
    for name in shapes:
        value = getattr(source, name)
        if isinstance(value, (list, tuple)) and any(isinstance(v, ca.SX) for v in value):
            value = ca.vertcat(*value)
        shape = shapes[name]
        actual = value.shape if isinstance(value, ca.SX) else np.shape(value)
        if isinstance(value, ca.SX) and len(shape) == 1 and actual == (actual[0], 1):
            actual = actual[:1]
        expected = tuple(
            lengths.setdefault(s, n) if isinstance(s, str) else s for s, n in zip(shape, actual, strict=True)
        )
        if len(actual) != len(shape) or actual != expected:
            raise ValueError(f"{type(source).__name__}.{name}: shape {actual}, expected {shape}")
        if not isinstance(value, ca.SX):
            value = np.array(value, dtype=float)
            value.flags.writeable = False
        object.__setattr__(source, name, value)
    return lengths
