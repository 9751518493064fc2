"""What a solver of the correction answers: the correction, how it ended, and which limits bind."""

from dataclasses import dataclass
from enum import Enum

from compgen.core.arrays import Array, own


class Status(Enum):
    """How it ended, in the user's words."""

    CONVERGED = "every waypoint reaches its target within the smoothness asked for"
    LIMITED = "limits hold some waypoints off their targets; the best legal correction is taken there"
    FAILED = "the optimiser found no legal correction"
    UNSETTLED = "the optimiser did not converge"
    STOPPED = 'ipopt stopped before the optimum; compensation.solver = "structured" solves the same problem'

    @property
    def is_legal(self) -> bool:
        """Whether there is a correction to command."""
        return self in (Status.CONVERGED, Status.LIMITED)


@dataclass(frozen=True, eq=False, slots=True)
class Optimum:
    """What one solver says of one stretch."""

    correction: Array  # (N, 6)
    status: Status
    iterations: int = 0
    last_step: float = 0.0  # [m] what a further iteration would change, about

    @property
    def converged(self) -> bool:
        """Whether it is the optimum."""
        return self.status is Status.CONVERGED


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Solution:
    """The correction of a program and how it was found."""

    correction: Array  # (N, 6)
    theta: Array  # (N, 6) [rad] joints of the commanded poses
    residual: Array  # (N, 6) predicted error that stays
    status: Status
    iterations: int
    last_step: float  # [m] what a further iteration would change, about
    active_limits: tuple[tuple[int, str], ...]  # (waypoint from 1, limit) that bind
    unsolved: tuple[int, int] | None = None  # first and last waypoint, from 1, of a stretch without an optimum

    def __post_init__(self) -> None:
        own(self, correction=("N", 6), theta=("N", 6), residual=("N", 6))
