r"""Second thermal model: heat conduction along base, link 1, link 2 and wrist, in finite volumes.

Bodies are cut into volumes in a row, with a joint's housing between two bodies:

    C_i dT_i/dt = sum_j g_ij (T_j - T_i) + h_i (u - T_i) + P_i

C capacities [J/K], g conductances (g = k A / dx inside a body, contacts at the housings), h films to the air (the floor
belongs to the first volume), u the air's rise, P the losses of the drives in that housing (``drive_losses``).
The matrix C^-1/2 (L + diag h) C^-1/2 is symmetric and positive: its eigenvectors part the network into modes that
answer independently, T = C^-1/2 Q z, so that time needs no steps (``integration``). Valid while films and contacts are
constant (rises below some 40 K). Parameters: the robot file, fitted by robots/m710ic50_network_fit.py.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh_tridiagonal

from compgen.core.arrays import Array, IntArray, own
from compgen.core.units import HOUR, MM
from compgen.robot.robot import Robot
from compgen.thermal.drive_losses import Drives, mean_losses, segment_losses
from compgen.thermal.duty import Duty, JointMotion
from compgen.thermal.model import ThermalModel


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
class Volumes:
    """V volumes in a row."""

    capacity: Array  # (V,) [J/K]
    laplacian: Array  # (V, V) [W/K] conduction
    film: Array  # (V,) [W/K]
    power: Array  # (V, 6) share of each drive's loss
    part: IntArray  # (V,) index of the body or housing in the row: 2 k is body k, 2 k + 1 housing k
    place: Array  # (V,) [m] middle of the volume along its body, 0 for a housing

    def __post_init__(self) -> None:
        own(self, capacity=("V",), laplacian=("V", "V"), film=("V",), power=("V", 6), part=("V",), place=("V",))


def assemble_volumes(bodies: Sequence[Body], housings: Sequence[Housing], floor: float) -> Volumes:
    """The row body, housing, body, housing, ..., body.

    Args:
        bodies: From the base plate outwards, one more than housings.
        housings: Between them.
        floor: Conductance of the base plate to the floor, which is at the air's temperature [W/K].
    """
    capacity: list[float] = []
    film: list[float] = []
    part: list[int] = []
    place: list[float] = []
    reach: list[float] = []  # [W/K] from a volume's middle to its face
    contact: list[float] = []  # [W/K] at the face between a volume and the next, inf inside a body
    power: list[Array] = []
    for k, body in enumerate(bodies):
        n = body.volumes
        capacity += [body.capacity / n] * n
        film += [body.film / n] * n
        part += [2 * k] * n
        place += [(i + 0.5) * body.length / n for i in range(n)]
        reach += [2 * body.conductance / (body.length / n)] * n
        power += [np.zeros(6)] * n
        contact += [np.inf] * (n - 1)
        if k < len(housings):
            housing = housings[k]
            contact += [housing.inward, housing.outward]
            capacity.append(housing.capacity)
            film.append(housing.film)
            part.append(2 * k + 1)
            place.append(0.0)
            reach.append(np.inf)
            power.append(np.array([float(j in housing.drives) for j in range(6)]))
    film[0] += floor
    across = np.array(reach)
    g = 1 / (1 / across[:-1] + 1 / across[1:] + 1 / np.array(contact))
    laplacian = np.diag(np.append(g, 0) + np.append(0, g)) - np.diag(g, 1) - np.diag(g, -1)
    share = np.array(power)
    return Volumes(
        capacity=np.array(capacity),
        laplacian=laplacian,
        film=np.array(film),
        power=share,
        part=np.array(part),
        place=np.array(place),
    )


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class NetworkModel:
    """The network in its modes; fulfils ``ThermalModel``."""

    names: tuple[str, ...]
    robot: Robot
    drives: Drives
    bodies: tuple[Body, ...]
    housings: tuple[Housing, ...]
    floor: float  # [W/K] from the base plate
    volumes: Volumes
    probe: Array  # (K, V) what each named rise takes from the volumes
    reference_rise: Array  # (K,) [K]
    box_feed: Array  # (2,) [m/s]
    box_time: float  # [s]
    box_rise: float  # [K]
    rate: Array  # (V,) [1/s]
    to_volumes: Array  # (V, V) C^-1/2 Q
    start: Array | None = None  # (V,) state that a log ends with; None: cold

    def __post_init__(self) -> None:
        own(self, probe=("K", "V"), reference_rise=("K",), box_feed=(2,), rate=("V",), to_volumes=("V", "V"))

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
        return self.steady_state_of(segment_losses(self.robot, self.drives, motion).moving)

    def rise_along(self, length: str, state: Array, x: Array) -> Array:
        """Rise along a body, from volume to volume, (M,) [m] to (M,) [K]; zero where the network has none."""
        rise = self.to_volumes @ state
        for k, body in enumerate(self.bodies):
            if body.name == length:
                inside = self.volumes.part == 2 * k
                return np.asarray(np.interp(x, self.volumes.place[inside], rise[inside]))
        return np.zeros(len(x))

    def extrapolations(self, duties: Sequence[Duty], feed: float, duration: float, rise: Array) -> list[str]:
        """In words, where a job leaves the box in which the parameters were measured."""
        messages = []
        low, high = self.box_feed / MM
        feeds = [feed, *(d.feed for d in duties if d.state == "moving")]
        if outside := sorted({f / MM for f in feeds if not low <= f / MM <= high}):
            values = ", ".join(f"{f:g}" for f in outside)
            messages.append(f"feed {values} mm/s lies outside {low:g} to {high:g} mm/s, where the network was fitted")
        hours = (sum(d.duration * d.share for d in duties if d.state == "moving") + duration) / HOUR
        if hours > self.box_time / HOUR:
            messages.append(
                f"{hours:.2f} h of motion exceed the {self.box_time / HOUR:g} h the network was fitted over"
            )
        if rise.max(initial=0.0) > self.box_rise:
            messages.append(f"a rise of {rise.max():.1f} K is above the {self.box_rise:g} K measured")
        if rise.min(initial=0.0) < -self.box_rise:
            messages.append(
                f"a rise of {rise.min():.1f} K lies further below zero than the {self.box_rise:g} K measured above it"
            )
        return messages


def modal_form(volumes: Volumes) -> tuple[Array, Array]:
    """Rates (V,) [1/s], and C^-1/2 Q (V, V); volumes in a row make the matrix tridiagonal."""
    root = 1 / np.sqrt(volumes.capacity)
    diagonal = (np.diag(volumes.laplacian) + volumes.film) * root**2
    rate, vectors = eigh_tridiagonal(diagonal, np.diag(volumes.laplacian, 1) * root[1:] * root[:-1])
    return rate, root[:, None] * vectors


class EnergyBalance(NamedTuple):
    """Where the heat of a stretch of time goes: supplied = lost + stored, each in joules."""

    supplied: float  # by the drives
    lost: float  # to the air
    stored: float  # in the arm


def energy_balance(network: NetworkModel, power: Array, start: Array, duration: float) -> EnergyBalance:
    """Heat in, heat out and heat stored over a stretch of constant losses in still air, exactly [J].

    Args:
        network: The model.
        power: Losses of the drives, (6,) [W].
        start: State at its beginning, (V,).
        duration: [s].
    """
    goal = network.steady_state_of(power)
    approach = -np.expm1(-network.rate * duration)  # share of the way to the goal
    mean = goal * duration + (start - goal) * approach / network.rate
    lost = float(network.volumes.film @ (network.to_volumes @ mean))
    change = network.to_volumes @ ((goal - start) * approach)
    supplied = float((network.volumes.power @ power).sum() * duration)
    return EnergyBalance(supplied, lost, float(network.volumes.capacity @ change))


def with_losses(heat: ThermalModel, duties: Sequence[Duty], motion: JointMotion) -> list[Duty]:
    """Duties with the losses of a program that ran at their feeds, where the model asks for them.

    Args:
        heat: The model; the nodes ask for nothing.
        duties: In order.
        motion: The program as it is driven; at another feed it takes its time in proportion.
    """
    if not isinstance(heat, NetworkModel):
        return list(duties)
    step = np.diff(motion.time)
    mean_speed = float(np.average(motion.driven, weights=step)) if step.sum() > 0 else 0.0
    powered = []
    for duty in duties:
        stretch = mean_speed / duty.feed if duty.feed > 0 and mean_speed > 0 else 1.0
        paced = JointMotion(motion.time * stretch, motion.theta, motion.driven / stretch)
        moving, holding = mean_losses(heat.robot, heat.drives, paced)
        share = duty.share if duty.state == "moving" else 0.0
        loss = tuple((share * np.array(moving) + (1 - share) * np.array(holding)).tolist())
        powered.append(duty if duty.state == "off" else replace(duty, loss=loss))
    return powered
