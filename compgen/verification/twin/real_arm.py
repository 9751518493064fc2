r"""The real arm, independently: a nominal arm whose lengths grow with heat, and whose faults are known.

Nothing here comes from the optimiser's chain. The arm is ``nominal_arm``'s, confirmed by pinocchio on samples of every
motion; its lengths grow by thin elements of each link's profile,

    growth per kelvin of node a = sum over elements of cte dx share_a,      share_b = 1 - share_a

A section of a profile lies between two nodes a and b; share_a is node a's part of the rise at the middle of an element,
by the fixed shape of the reference state.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, IntArray, norm
from compgen.core.evaluation import evaluate
from compgen.core.pose import Pose
from compgen.core.units import DEG
from compgen.robot.robot import Robot
from compgen.thermal import Profile, Section, ThermalModel
from compgen.verification.twin.direction_history import DirectionHistory
from compgen.verification.twin.faults import Faults
from compgen.verification.twin.faulty_arm import TwinError, build_faulty_arm
from compgen.verification.twin.nominal_arm import (
    AGREEMENT,
    LENGTHS,
    build_grown_pose,
    nominal_lengths,
    pinocchio_difference,
)

BEYOND = 1e-6  # [rad] past a limit that rounding of the text may lead
INVERSE_TOLERANCE = 1e-9  # m; ten times that in a rotation: how far the nominal arm may be from a commanded pose
ELEMENT = 0.1e-3  # m
CONFIRMED = 1000  # samples of a motion that pinocchio repeats


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Twin:
    """The real arm with its tool, its heat and its faults."""

    robot: Robot
    heat: ThermalModel
    profiles: tuple[Profile, ...]
    tool: Pose  # TCP in the flange
    faults: Faults | None = None  # beside growth; None is a perfect arm that only grows
    uframe: Pose | None = None  # the controller's register that programs are read in; None: World
    confirmed: int = CONFIRMED  # samples of a motion that pinocchio repeats

    @property
    def remembers_direction(self) -> bool:
        """Whether where the tool is hangs on the way it came."""
        f = self.faults
        return f is not None and bool(f.backlash.any() or f.windup.any() or f.axis_deviations)

    def actual_pose(
        self, theta: Array, rise: Array, progress: Callable[[float], None], tools: Pose | None = None
    ) -> Pose:
        """Where the tool really is, at M samples in the order in which they are executed.

        Args:
            theta: Commanded joints, (M, 6) [rad].
            rise: (M, K) [K].
            progress: Called with the share done.
            tools: M tools, one a sample; default the twin's own.
        """
        if not len(theta) or (self.only_grows and tools is None):
            return self._grown_pose(theta, self.growth(rise), progress)
        every = max(1, len(theta) // self.confirmed)
        pose, _ = self.faulty_pose(theta, self.growth(rise), rise, DirectionHistory(), every, tools)
        progress(1.0)
        return pose

    def faulty_pose(
        self,
        theta: Array,
        growth: Array,
        rise: Array,
        history: DirectionHistory,
        every: int,
        tools: Pose | None = None,
    ) -> tuple[Pose, DirectionHistory]:
        """The TCP with all faults at M samples, and the history that they leave."""
        arm = build_faulty_arm(self.robot, self.faults or Faults())
        growth_of_length = dict(zip(LENGTHS, growth.T, strict=True))
        tools = Pose.stack([self.tool]) if tools is None else tools
        return arm.actual_pose(theta, growth_of_length, rise, tools, history, every)

    def confirm_inverse(
        self, theta: Array, commanded: Pose, segment: IntArray, progress: Callable[[float], None]
    ) -> None:
        """Raises TwinError unless the nominal arm at theta is at the commanded poses, to 1e-9 m."""
        nominal = self._grown_pose(theta, np.zeros((len(theta), len(LENGTHS))), progress)
        distance = norm(nominal.position - commanded.position)
        turned = np.linalg.norm(nominal.rotation - commanded.rotation, axis=(1, 2))
        refuse_wrong_inverse(segment, distance, turned)

    def _grown_pose(self, theta: Array, growth: Array, progress: Callable[[float], None]) -> Pose:
        """The real TCP at joints (M, 6) [rad] and growths (M, 6) [m], confirmed by pinocchio on samples."""
        pose = Pose.from_rows(*evaluate(build_grown_pose(self.robot, self.tool), theta, growth))
        self.confirm_by_pinocchio(theta, growth, pose, max(1, len(theta) // self.confirmed))
        progress(1.0)
        return pose

    def confirm_by_pinocchio(self, theta: Array, growth: Array, pose: Pose, every: int) -> None:
        """Raises TwinError unless pinocchio agrees on one of so many samples, and on the last."""
        rows = np.unique(np.append(np.arange(0, len(theta), every), max(len(theta) - 1, 0)))[: len(theta)]
        difference = pinocchio_difference(self.robot, self.tool, theta[rows], growth[rows], pose[rows])
        if not difference <= AGREEMENT:
            raise TwinError(f"pinocchio's arm is {difference:.1e} from the twin's: the twin cannot be trusted")

    def growth(self, rise: Array) -> Array:
        """Growth of each of ``LENGTHS`` at rises (M, K) [K], (M, 6) [m]."""
        return np.asarray(rise @ self.growth_per_kelvin())

    def growth_per_kelvin(self) -> Array:
        """Growth of each of ``LENGTHS`` per kelvin of each node, (K, 6) [m/K]."""
        excess = {} if self.faults is None else self.faults.cte_excess
        away = np.where(np.array(nominal_lengths(self.robot)) < 0, -1, 1)  # from zero, whatever side a length is on
        factors = away * np.array([1 + excess.get(length, 0.0) for length in LENGTHS])
        return np.asarray(growth_per_kelvin(self.heat, self.profiles) * factors)

    @property
    def only_grows(self) -> bool:
        """Whether the arm is perfect but for its growth: then what it did before leaves it as it is."""
        return self.faults is None or self.faults.only_growth


def refuse_interference(robot: Robot, theta: Array, row: IntArray) -> None:
    """Raises TwinError where joints (M, 6) [rad], at or behind positions (M,) from 0, are where the arm hits itself."""
    if robot.interference is None or not len(theta):
        return
    clearance = robot.interference.clearance(theta)
    m = int(np.argmin(clearance))
    if clearance[m] < -BEYOND:
        j2, j3 = robot.interference.plane(theta[m : m + 1])[0] / DEG
        raise TwinError(
            f"P[{row[m] + 1}]: J2 = {j2:.3f} deg with J3 = {j3:.3f} deg, there or on the way from there, is outside "
            "the polygon limits.interference.j2_j3_deg, where the arm hits itself"
        )


def refuse_wrong_inverse(segment: IntArray, distance: Array, turned: Array) -> None:
    """Raises TwinError where the nominal TCP is off a commanded pose, by (M,) [m] and by (M,) of rotation."""
    if not (distance.max(initial=0.0) <= INVERSE_TOLERANCE and turned.max(initial=0.0) <= 10 * INVERSE_TOLERANCE):
        m = int(np.argmax(distance + turned))
        raise TwinError(
            f"P[{segment[m] + 1}]: the nominal arm is {distance[m]:.1e} m from the pose asked for: "
            "the inverse kinematics cannot be trusted here"
        )


def growth_per_kelvin(heat: ThermalModel, profiles: Sequence[Profile]) -> Array:
    """Growth of each of ``LENGTHS`` per kelvin of each node, (K, 6) [m/K]."""
    reference = dict(zip(heat.names, heat.reference_rise.tolist(), strict=True))
    growth = np.zeros((len(heat.names), len(LENGTHS)))
    for profile in profiles:
        column = list(LENGTHS).index(profile.length)
        for s in profile.sections:
            a, b = (heat.names.index(n) for n in (s.node_a, s.node_b))
            count = max(1, round((s.end - s.start) / ELEMENT))
            share = _element_shares(s, reference, count)
            element = profile.cte * (s.end - s.start) / count
            growth[a, column] += element * share.sum()
            growth[b, column] += element * (1 - share).sum()
    return growth


def _element_shares(section: Section, reference: dict[str, float], count: int) -> Array:
    """Share of node a's rise at the middle of each element, (count,)."""
    u = (np.arange(count) + 0.5) / count
    ra, rb = reference[section.node_a], reference[section.node_b]
    if section.shape == "linear" or ra == rb:
        return 1 - u
    return np.asarray((ra ** (1 - u) * rb**u - rb) / (ra - rb))
