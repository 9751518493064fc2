r"""Second thermal model: heat conduction along base, link 1, link 2 and wrist, in finite volumes.

Bodies are cut into volumes in a row, with a joint's housing between two bodies:

    C_i dT_i/dt = sum_j g_ij (T_j - T_i) + h_i (u - T_i) + P_i

C capacities [J/K], g conductances (g = k A / dx inside a body, contacts at the housings), h films to the air (the floor
belongs to the first volume), u the air's rise, P the losses of the drives in that housing (``drive_losses``).
The matrix C^-1/2 (L + diag h) C^-1/2 is symmetric and positive: its eigenvectors part the network into modes that
answer independently, T = C^-1/2 Q z, so that time needs no steps (``integration``). Valid while films and contacts are
constant (rises below some 40 K). Parameters: the robot file, fitted by robots/m710ic50_network_fit.py.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal, Self

import numpy as np
from scipy.linalg import eigh_tridiagonal

from compgen.core.arrays import Array, IntArray, owns
from compgen.robot.robot import Robot
from compgen.thermal.drive_losses import Drives, mean_losses, moving_losses
from compgen.thermal.duty import Duty, JointMotion, MeanLosses
from compgen.thermal.node_model import HeatSources, MeasuredBox, NodeModel

ANYWHERE = 0.01  # r of ``NetworkModel.state_gain``, of the largest of the others


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """A conducting stretch of structure."""

    name: str
    length: float  # [m]
    volumes: int
    capacity: float  # [J/K] of the whole
    conductance: float  # [W m/K] conductivity x section
    film: float  # [W/K] of the whole surface


@dataclass(frozen=True, slots=True, kw_only=True)
class Housing:
    """A joint between two bodies, where drives give off their heat."""

    name: str
    capacity: float  # [J/K]
    film: float  # [W/K]
    inward: float  # [W/K] contact with the body before it
    outward: float  # [W/K] contact with the body after it
    drives: tuple[int, ...]  # from 0


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(capacity=("V",), laplacian=("V", "V"), film=("V",), power=("V", 6), part=("V",), place=("V",))
class Volumes:
    """V volumes in a row."""

    capacity: Array  # (V,) [J/K]
    laplacian: Array  # (V, V) [W/K] conduction
    film: Array  # (V,) [W/K]
    power: Array  # (V, 6) share of each drive's loss
    part: IntArray  # (V,) index of the body or housing in the row: 2 k is body k, 2 k + 1 housing k
    place: Array  # (V,) [m] middle of the volume along its body, 0 for a housing


def assemble_volumes(bodies: Sequence[Body], housings: Sequence[Housing], floor: float) -> Volumes:
    """The row body, housing, body, housing, ..., body.

    Args:
        bodies: From the base plate outwards, one more than housings.
        housings: Between them.
        floor: Conductance of the base plate to the floor, which is at the air's temperature [W/K].
    """
    rows: list[tuple[int, float, float, float, float, tuple[float, ...]]] = []
    for k, body in enumerate(bodies):
        n, step = body.volumes, body.length / body.volumes
        reach = 2 * body.conductance / step  # [W/K] from a volume's middle to its face
        rows += [
            (2 * k, body.capacity / n, body.film / n, (i + 0.5) * body.length / n, reach, 6 * (0.0,)) for i in range(n)
        ]
        if k < len(housings):
            housing = housings[k]
            shares = tuple(float(j in housing.drives) for j in range(6))
            rows.append((2 * k + 1, housing.capacity, housing.film, 0.0, np.inf, shares))
    part, capacity, film, place, across, share = (np.array(column) for column in zip(*rows, strict=True))
    film[0] += floor
    contact = np.full(len(part) - 1, np.inf)  # [W/K] at the face between a volume and the next
    at = np.flatnonzero(part % 2)
    contact[at - 1], contact[at] = [h.inward for h in housings], [h.outward for h in housings]
    g = 1 / (1 / across[:-1] + 1 / across[1:] + 1 / contact)
    laplacian = np.diag(np.append(g, 0) + np.append(0, g)) - np.diag(g, 1) - np.diag(g, -1)
    return Volumes(capacity=capacity, laplacian=laplacian, film=film, power=share, part=part, place=place)


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(probe=("K", "V"), reference_rise=("K",), rate=("V",), to_volumes=("V", "V"))
class NetworkModel:
    """The network in its modes; fulfils ``ArmHeat``."""

    names: tuple[str, ...]
    robot: Robot
    drives: Drives
    bodies: tuple[Body, ...]
    housings: tuple[Housing, ...]
    floor: float  # [W/K] from the base plate
    volumes: Volumes
    probe: Array  # (K, V) what each named rise takes from the volumes
    reference_rise: Array  # (K,) [K]
    box: MeasuredBox
    rate: Array  # (V,) [1/s]
    to_volumes: Array  # (V, V) C^-1/2 Q
    start: Array | None = None  # (V,) state that a log ends with; None: cold

    @property
    def outputs(self) -> Array:
        """Named rises of a state, (K, V)."""
        return np.asarray(self.probe @ self.to_volumes)

    @property
    def ambient(self) -> Array:
        """State in air one kelvin above the reference, (V,): every volume follows."""
        return np.asarray(self.state_of(np.ones(len(self.rate))))

    def state_of(self, rise: Array) -> Array:
        """State of given volumes' rises, (V,) [K] to (V,)."""
        return np.asarray(self.to_volumes.T @ (self.volumes.capacity * rise))

    def steady_state_of(self, power: Array) -> Array:
        """State that steady losses (..., 6) [W] lead to, (..., V)."""
        return np.asarray(power @ self.volumes.power.T @ self.to_volumes / self.rate)

    def steady_state(self, duty: Duty) -> Array:
        """State that a duty would reach in the end, (V,)."""
        if duty.state == "off":
            return np.zeros(len(self.rate))
        if not duty.loss:
            raise ValueError("a duty of the network needs its losses")
        return self.steady_state_of(np.array(duty.loss))

    def steady_states(self, motion: JointMotion) -> Array:
        """State that each segment of a program leads to, by its joint speeds and torques, (N - 1, V)."""
        losses, heated = moving_losses(self.robot, self.drives, motion), self.volumes.power.any(axis=1)
        return np.asarray(losses @ self.volumes.power[heated].T @ (self.to_volumes[heated] / self.rate))

    @property
    def kind(self) -> Literal["network"]:
        """What a robot file calls it."""
        return "network"

    @property
    def law(self) -> NodeModel | None:
        """None: conduction ties the rises."""
        return None

    def starting(self, state: Array | None) -> Self:
        """The network that begins with a state, (V,); None: cold."""
        return replace(self, start=state)

    def mean_losses(self, motion: Callable[[], JointMotion]) -> MeanLosses:
        """Of the drives over a program."""
        return mean_losses(self.robot, self.drives, motion())

    @property
    def heated(self) -> Array:
        """Shares of the drives' losses, a row for each heated housing, (M, 6)."""
        kinds = np.unique(self.volumes.power, axis=0)
        return np.asarray(kinds[kinds.any(axis=1)])

    def heat_sources(self, loss: tuple[float, ...] = ()) -> HeatSources:
        """Goals of 100 W in each heated housing."""
        working = self.heated @ (np.array(loss) if loss else self.drives.rated_power)
        goals = np.array([self.steady_state_of(100.0 * k / k.sum()) for k in self.heated])
        return HeatSources(goals, working / np.linalg.norm(working))

    def state_gain(self, which: IntArray) -> Array:
        r"""What one kelvin more at each of some rises, (P,) numbers, does to the state, (V, P).

        The rises leave open how the warmth lies between the places that are named. Of all states with rises y, the most
        likely one is taken where states come about by heat in the drives' housings and by the air,

            z' = z + G (y - O z),      G = Z O^T (O Z O^T)^-1,      Z = sum_m g_m g_m^T + a a^T + r^2 I

        with O the outputs, g_m the steady states of heat in each housing and a that of the air, each so large that it
        warms a named place by one kelvin at most; r^2 I is heat that lies anywhere, of little size. Source: the
        conditional mean of a normal distribution.
        """
        goals = self.steady_state_of(self.heated)
        outputs = self.outputs[which]
        goals = np.vstack([goals / np.abs(goals @ self.outputs.T).max(axis=1, keepdims=True), self.ambient])
        spread = goals.T @ goals
        spread += ANYWHERE**2 * np.trace(spread) / len(spread) * np.eye(len(spread))
        return np.asarray(spread @ outputs.T @ np.linalg.inv(outputs @ spread @ outputs.T))


def modal_form(volumes: Volumes) -> tuple[Array, Array]:
    """Rates (V,) [1/s], and C^-1/2 Q (V, V); volumes in a row make the matrix tridiagonal."""
    root = 1 / np.sqrt(volumes.capacity)
    diagonal = (np.diag(volumes.laplacian) + volumes.film) * root**2
    rate, vectors = eigh_tridiagonal(diagonal, np.diag(volumes.laplacian, 1) * root[1:] * root[:-1])
    return rate, root[:, None] * vectors
