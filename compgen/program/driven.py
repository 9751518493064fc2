"""A program as it is driven: the positions it names, the stations it drives to in order, and the ways there."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, cumulated
from compgen.core.pose import Pose
from compgen.robot.inverse_kinematics import BranchSolution, solve_tools
from compgen.robot.robot import Robot
from compgen.thermal import JointMotion

NONE = -1


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Positions:
    """K positions, NaN and ``NONE`` where something is not known."""

    number: IntArray  # (K,) by which the program names it
    tcp: Pose  # K of them, in the arm's World
    theta: Array  # (K, 6) [rad]
    margin: Array  # (K,) [m] inside reach; NaN where joints are given
    posture: IntArray  # (K,) in ``ALL_POSTURES``
    tool: IntArray  # (K,) in ``tools``
    tools: Pose  # TCP in the flange; the last, which NONE picks, is the flange itself
    first: IntArray  # (K,) first row of the same position: it stands for the others where numbers are written

    def solve(self, robot: Robot, tcp: Pose, rows: IntArray) -> BranchSolution:
        """Joints that bring the TCP to n poses, by the tools and in the postures of rows, (n,)."""
        return solve_tools(robot, tcp, self.tools, self.tool[rows], self.posture[rows])


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class DrivenProgram:
    """S stations in the order listed, the via point of an arc before its end point."""

    at: Positions  # that it names
    motion: IntArray  # (S,) statement that leads there
    pose: IntArray  # (S,) row of ``at``, NONE when the target is not known
    joint: BoolArray  # (S,) reached by a joint motion
    line: BoolArray  # (S,) reached by a straight line
    via: BoolArray  # (S,) on the way of an arc
    stop: BoolArray  # (S,) the robot stops there
    length: Array  # (S,) [m] of the way there, NaN when an end is not known
    written: Array  # (S,) [s] of the way there at its written speed, had it neither periods nor stops
    duration: Array  # (S,) [s] of the way there
    pause: Array  # (S,) [s] waited before leaving for it
    untimed: tuple[int, ...]  # lines whose speed, way or wait is not told, or whose override
    flow: tuple[int, ...]  # lines of statements that may change the order
    origin: IntArray  # (S,) station from which the robot surely comes, NONE when it or its place is not known
    carried: BoolArray  # (S,) an extended axis may move on the way there
    circular: BoolArray  # (S,) on an arc of three places that are surely known, to its via or from there
    beyond: Array  # (S,) [m] by which the straight way there leaves the reach between its ends; 0 where it does not
    rest: float = 0.0  # [s] waited behind the last station; NaN where called programs may move the arm there
    called: Mapping[int, tuple["DrivenProgram", ...]] = field(default_factory=dict)  # before leaving for one, in order
    untold: tuple[str, ...] = ()  # called programs in which a speed, a way or a wait is not told
    uncounted: tuple[str, ...] = ()  # called programs that may move the arm more, or otherwise, than ``called`` says

    def at_override(self, share: float) -> "DrivenProgram":
        """The same ways at a share of their speeds; what the program waits for, and what settles, takes as long."""
        written = self.written / share
        slower = {key: its.at_override(share) for key, its in self._called_once().items()}
        called = {station: tuple(slower[id(its)] for its in drives) for station, drives in self.called.items()}
        return replace(self, written=written, duration=self.duration + (written - self.written), called=called)

    def joint_motion(self) -> JointMotion:
        """What the drives do, for heat: a pause and a way to each station, and what called programs do between them.

        It stands where a station was while a called program begins and ends elsewhere: those ways take no time. Its
        places are (2 S + 1) and those of the called programs; ``reached`` says which are the stations.
        """
        step = np.column_stack([self.pause, self.duration]).ravel()
        with np.errstate(invalid="ignore", divide="ignore"):
            speed = np.nan_to_num(self.length / self.duration, nan=0.0, posinf=0.0)
        driven, theta = np.column_stack([np.zeros(len(speed)), speed]).ravel(), self._joint_sequence()
        if self.called:
            stations, motions = zip(*sorted(self._called_motions().items()), strict=True)
            way = np.repeat(2 * np.array(stations) + 1, [len(m.time) + 1 for m in motions])
            stands = theta[2 * np.array(stations) + 1]
            step = np.insert(step, way, np.concatenate([[0.0, *np.diff(m.time), 0.0] for m in motions]))
            driven = np.insert(driven, way, np.concatenate([[0.0, *m.driven, 0.0] for m in motions]))
            places = [np.vstack([m.theta, stand]) for m, stand in zip(motions, stands, strict=True)]
            theta = np.insert(theta, way + 1, np.concatenate(places), axis=0)
        return JointMotion(cumulated(step), theta, driven)

    def motion_when_called(self) -> JointMotion:
        """``joint_motion``, and how long it stands behind its last station."""
        motion = self.joint_motion()
        if not self.rest > 0:
            return motion
        time, theta = np.append(motion.time, motion.time[-1] + self.rest), np.vstack([motion.theta, motion.theta[-1:]])
        return JointMotion(time, theta, np.append(motion.driven, 0.0))

    def _called_once(self) -> dict[int, "DrivenProgram"]:
        """Called programs, each once however often it is called, by their identity."""
        return {id(its): its for drives in self.called.values() for its in drives}

    def _called_motions(self) -> dict[int, JointMotion]:
        """What called programs do before leaving for a station, by the station."""
        motions = {key: its.motion_when_called() for key, its in self._called_once().items()}
        return {s: _one_behind_the_other([motions[id(its)] for its in drives]) for s, drives in self.called.items()}

    @property
    def reached(self) -> IntArray:
        """Places of ``joint_motion`` where it begins, and where each station is reached, (S + 1,)."""
        places = np.full(len(self.pose), 2)
        for station, motion in self._called_motions().items():
            places[station] += len(motion.time) + 1
        return np.concatenate([[0], np.cumsum(places)])

    def _joint_sequence(self) -> Array:
        """Joints at the beginning, after each pause and at each station, (2 S + 1, 6) [rad]."""
        if not len(self.pose):
            return np.zeros((1, 6))
        theta = np.full((len(self.pose), 6), np.nan)
        defined = self.pose != NONE
        theta[defined] = self.at.theta[self.pose[defined]]
        last_known = np.maximum.accumulate(np.where(np.isnan(theta).any(axis=1), 0, np.arange(len(theta))))
        theta = np.nan_to_num(theta[last_known])  # a position without joints: as if the robot stayed
        return np.vstack([theta[:1], np.repeat(np.vstack([theta[:1], theta]), 2, axis=0)[1:-1]])


def _one_behind_the_other(motions: Sequence[JointMotion]) -> JointMotion:
    """Motions as one, the ways between them in no time."""
    ends = cumulated(np.array([m.time[-1] for m in motions]))
    return JointMotion(
        np.concatenate([begin + m.time for begin, m in zip(ends[:-1], motions, strict=True)]),
        np.vstack([m.theta for m in motions]),
        np.concatenate([motions[0].driven, *(np.append(0.0, m.driven) for m in motions[1:])]),
    )
