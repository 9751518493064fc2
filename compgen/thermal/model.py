r"""The contract of a thermal model: first-order modes, and how their states become rises along the links.

    dz/dt = rate (goal + ambient u(t) - z)        rise = outputs z

with u the rise of the air and goal the steady state of the present duty. A state z (S,) says all of the robot's
temperature; between changes of duty the goal is constant and the solution exact (``integration``). Two models
fulfil it, ``node_model`` (the study's) and ``network`` (conduction); ``log_fit`` starts either from a thermocouple log.
"""

from collections.abc import Sequence
from typing import Protocol

from compgen.core.arrays import Array
from compgen.thermal.duty import Duty, JointMotion


class ThermalModel(Protocol):
    """A thermal model with S modes and K named rises."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the K rises."""
        ...

    @property
    def rate(self) -> Array:
        """Of each mode, (S,) [1/s]."""
        ...

    @property
    def outputs(self) -> Array:
        """Rises of a state, (K, S)."""
        ...

    @property
    def ambient(self) -> Array:
        """State that a robot reaches in air one kelvin above the reference, (S,)."""
        ...

    @property
    def reference_rise(self) -> Array:
        """Rises after the reference duty, (K,) [K]: they fix the shapes of profiles."""
        ...

    @property
    def start(self) -> Array | None:
        """State that a log ends with, (S,); None: the robot is cold, in balance with the air."""
        ...

    def steady_state(self, duty: Duty) -> Array:
        """State that a duty would reach in the end, in air at the reference, (S,)."""
        ...

    def steady_states(self, motion: JointMotion) -> Array:
        """State that each segment of a program would reach in the end, (N - 1, S)."""
        ...

    def rise_along(self, length: str, state: Array, x: Array) -> Array:
        """Rise along a link ("a2", "d4", ...) at distances x (M,) [m] from its base end, (M,) [K]."""
        ...

    def extrapolations(self, duties: Sequence[Duty], feed: float, duration: float, rise: Array) -> list[str]:
        """In words, where a job leaves the box in which the parameters were measured."""
        ...
