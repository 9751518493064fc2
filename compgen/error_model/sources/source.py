"""What an error source may know about a moment, and how its parameters are declared."""

from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import casadi as ca
import numpy as np

from compgen.robot.kinematics import Chain


@dataclass(frozen=True, eq=False, slots=True)
class State:
    """A moment as symbols, or as numbers.

    ``direction`` and ``travel`` are states with a memory, from ``sources.motion``: they blend through a reversal and
    are zero where nothing is known of the motion before.
    """

    nominal: Chain  # what the controller believes: commanded joints, nominal lengths, the tool
    rise: Any  # (K, 1) [K] of the heat model's nodes and gradients
    direction: Any  # (6, 1) [-1, 1] of the motion of each joint theta
    travel: Any  # (3, 1) [-1, 1] of the TCP's motion along each World axis


@dataclass(frozen=True, slots=True)
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


class Source(Protocol):
    """What makes the real arm differ from the nominal one: a frozen dataclass whose parameters are numbers or SX."""

    NAME: ClassVar[str]  # its table in the robot file
    PARAMETERS: ClassVar[tuple[Parameter, ...]]

    def distort(self, chain: Chain, state: State) -> Chain:
        """The chain with this error in it; parameters that are exactly zero leave it as it is."""
        ...


def settle(source: Any, *fields: str) -> None:
    """Make the parameters of a frozen source read-only copies of their declared shape; expressions stay as they are.

    A vector (n,) may be an SX column (n, 1), a matrix (n, m) an SX of that shape.

    Raises:
        ValueError: A parameter has another shape.
    """
    shapes = {p.field: p.shape for p in source.PARAMETERS}
    lengths: dict[str, int] = {}
    for name in fields or shapes:
        value = getattr(source, name)
        if isinstance(value, (list, tuple)) and any(isinstance(v, ca.SX) for v in value):
            value = ca.vertcat(*value)
        shape = shapes[name]
        have = value.shape if isinstance(value, ca.SX) else np.shape(value)
        if isinstance(value, ca.SX) and len(shape) == 1 and have == (have[0], 1):
            have = have[:1]
        want = tuple(lengths.setdefault(s, n) if isinstance(s, str) else s for s, n in zip(shape, have))
        if len(have) != len(shape) or have != want:
            raise ValueError(f"{type(source).__name__}.{name}: shape {have}, expected {shape}")
        if not isinstance(value, ca.SX):
            value = np.array(value, dtype=float)
            value.flags.writeable = False
        object.__setattr__(source, name, value)
