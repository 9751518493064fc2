"""A program's motion before any correction: path, joints and timing, the same for every story that drives the program.

It does not depend on how warm the robot is. What asks for more waypoints than the chord does are maps, gears and
reversals; growth and bends by heat vary over metres of path. So the day before a program can be planned from the very
motion that the program will have.
"""

from dataclasses import dataclass, replace

import numpy as np

from compgen.compensation import simplify
from compgen.compensation.refinement import ErringArm, refine
from compgen.core import stages
from compgen.core.arrays import Array
from compgen.core.exceptions import ImpossibleError, naming_file
from compgen.core.pose import Pose
from compgen.core.stages import Progress, RunStage
from compgen.core.units import DEG
from compgen.error_model.beyond_measured import joint_halves, settling
from compgen.error_model.direction_memory import reversal_widths
from compgen.error_model.model import ErrorModel
from compgen.job.job import Cell, Process, ProgramPlan
from compgen.job.moves_in_arcs import page_stops_of_arcs, without_period
from compgen.planning import retiming, toolpath
from compgen.planning.exact_path import MAX_SPACING
from compgen.planning.lead_in import LeadIn, LeadInArm, plan_lead_in
from compgen.planning.retiming import Trajectory
from compgen.planning.toolpath import LayoutSettings, ToolPath
from compgen.planning.whole_periods import Periods
from compgen.program.digits import resolution
from compgen.program.page_stops import PageStops, place_page_stops
from compgen.program.speeds import writable_speed
from compgen.robot import inverse_kinematics, joint_path
from compgen.robot.kinematics import flange_pose
from compgen.robot.robot import Robot
from compgen.thermal import JointMotion

FIRST_PIECES = 8  # of a pattern: they say to which side its joints turn first
HEAT_CHORD = 20e-6  # [m] of the path on which losses of the drives are looked at
COARSE = 1e-3  # [m] chord of the path on which reversals are looked for
LEAST_TURN = 0.2 * DEG  # of each joint on a lead-in, also where the robot file knows of no play


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class MotionPlan:
    """N waypoints with joints and times."""

    feed: float  # [m/s] the wanted one as a program can say it
    path: ToolPath  # with the stops that its pages need
    page_stops: PageStops | None  # None when one file holds it, or when pages are not wanted
    model: ErrorModel
    theta: Array  # (N, 6) [rad]
    trajectory: Trajectory

    @property
    def joint_motion(self) -> JointMotion:
        """What the drives do, for the heat."""
        return JointMotion(self.trajectory.time, self.theta, self.trajectory.driven_speed)


def plan_motion(program: ProgramPlan, cell: Cell, feed: float, progress: Progress, *, pages: bool = True) -> MotionPlan:
    """Lay a program's path, find its joints and time it.

    Args:
        program: Path, process, tool and posture.
        cell: The robot and its errors; of its heat only how many nodes there are.
        feed: Wanted along the path [m/s].
        progress: Called with the stage and the share done.
        pages: Whether a program that is more than the controller holds in one file gets the stops of its pages.

    Raises:
        InputError: The path cannot be laid; names the path file.
        ImpossibleError: The robot cannot drive it.
    """
    progress(stages.PATH, 0.0)
    robot, nodes, tool, process = cell.robot, len(cell.heat.names), program.tool, program.process
    model = cell.error_model(tool.pose)
    feed = writable_speed(feed)
    layout = _layout(process, robot, feed)
    with naming_file(program.source):
        path = toolpath.plan_tool_path(
            program.path.exact(tool.spin), layout, lift=process.lift, lead_in=_lead_in(program, cell, model)
        )
        arm = ErringArm(robot=robot, posture=program.posture, tool=tool.pose, sources=cell.sources, model=model)
        path, theta = refine(arm, path, feed, layout)
        progress(RunStage(stages.PATH, waypoints=len(theta)), 1.0)
        page_stops, payload = None, tool.payload is not None
        if pages and process.arcs:
            page_stops = page_stops_of_arcs(robot, process, path, theta, feed, nodes, payload=payload)
        elif pages:
            page_stops = place_page_stops(
                robot, path, theta, nodes, on_the_part=process.stop_on_the_part, payload=payload
            )
        if page_stops is not None:
            path = replace(path, stop=page_stops.stop)
        progress(stages.TIMING, 0.0)
        followed = without_period(robot) if process.arcs else robot
        trajectory = retiming.retime(
            followed.at_acceleration(process.acc), path.arc, theta, path.stop, feed * path.pace,
            lambda share: progress(stages.TIMING, share), lines=not process.arcs,
        )  # fmt: skip
    return MotionPlan(feed=feed, path=path, page_stops=page_stops, model=model, theta=theta, trajectory=trajectory)


def _layout(process: Process, robot: Robot, feed: float) -> LayoutSettings:
    """How waypoints are laid: for lines whole periods apart; for arcs, which are fitted to them, as close as can be."""
    if process.arcs:
        return LayoutSettings(process.chord, process.spacing)
    # a distance of two positions grows by half a digit in each coordinate of both at most
    rounding = float(np.sqrt(3)) * resolution(robot.controller.decimals)[0]
    return LayoutSettings(process.chord, process.spacing, Periods(feed * robot.controller.period, rounding))


def leads_in(process: Process, cell: Cell) -> bool:
    """Whether play is run through before the tool touches: as the process says, else where the robot has play."""
    return reversal_widths(cell.sources) is not None if process.lead_in is None else process.lead_in


def run_in_length(program: ProgramPlan, cell: Cell, rate: float) -> float:
    r"""How long before the part each sweep must begin for its joints' reversals to be over on the part [m].

    By its half-width joint i moves the TCP by b_i; where it reverses, that blends over w_i / \|theta_i'\| of way. Of
    the joints that reverse off the part and ask the correction for more than a quarter of its rate [m/m], 2 b_i / the
    blend,

        L = 2 sum_i b_i / rate + 3 max_i w_i / \|theta_i'\|

    Zero for a robot without play, or where the arm cannot drive the path.
    """
    widths = reversal_widths(cell.sources)
    if widths is None or (motion := coarse_motion(program, cell.robot)) is None:
        return 0.0
    path, theta = motion
    slope = np.diff(theta, axis=0) / np.diff(path.arc)[:, None]
    on, S = path.contact, len(slope)
    leaves, enters = (np.flatnonzero(edge) for edge in (on[:-1] & ~on[1:], ~on[:-1] & on[1:]))
    enters = enters[enters > leaves[0]] + 1 if len(leaves) else enters[:0]
    if not len(enters):
        return 0.0
    leaves = leaves[np.searchsorted(leaves, enters) - 1]
    before, after = slope[np.maximum(leaves - 1, 0)], slope[np.minimum(enters, S - 1)]
    model = cell.error_model(program.tool.pose)
    half = joint_halves(model, theta[enters])
    steep = (before * after < 0) & (2 * half * np.abs(after) > rate / 4 * widths.joint)
    blend = np.where(steep, widths.joint / np.maximum(np.abs(after), 1e-12), 0.0)
    return float((2 * np.where(steep, half, 0.0).sum(axis=1) / rate + 3 * blend.max(axis=1)).max())


def coarse_motion(program: ProgramPlan, robot: Robot) -> tuple[ToolPath, Array] | None:
    """The pattern with as few waypoints as show its joints, and these, (N, 6) [rad]; None where the arm cannot."""
    path = toolpath.plan_tool_path(program.path.exact(program.tool.spin), LayoutSettings(COARSE))
    try:
        return path, _joints(program, robot, path.target)
    except ImpossibleError:
        return None


def _lead_in(program: ProgramPlan, cell: Cell, model: ErrorModel) -> LeadIn | None:
    """The lead-in that is asked for, or that the robot's play asks for; None where it comes down the tool axis."""
    plan, process, robot = program.path, program.process, cell.robot
    if process.lift == 0 or not leads_in(process, cell):
        return None
    first = plan.pattern.subset(np.arange(min(FIRST_PIECES, len(plan.pattern.poly))))
    beginning = toolpath.plan_tool_path(
        replace(plan, pattern=first).exact(program.tool.spin), LayoutSettings(process.chord, process.spacing)
    )

    def tcp(theta: Array) -> Pose:
        return flange_pose(robot, theta) @ program.tool.pose

    def can_drive(pose: Pose) -> bool:
        try:
            _joints(program, robot, pose)
        except ImpossibleError:
            return False
        return True

    if not can_drive(beginning.target):
        return None  # what stops the robot is named by its waypoint where the whole path is followed
    theta = _joints(program, robot, beginning.target)
    least, travel = settling(cell.sources, model, theta[0])
    arm = LeadInArm(tcp, can_drive, robot.lower, robot.upper)
    return plan_lead_in(arm, theta, np.maximum(least, LEAST_TURN), travel, beginning.exact, process.lift)


def _joints(program: ProgramPlan, robot: Robot, pose: Pose) -> Array:
    """Joints of a continuous way of the TCP, (N, 6) [rad]; raises ImpossibleError where the arm cannot follow it."""
    flange = inverse_kinematics.flange_from_tool(pose, program.tool.pose)
    return joint_path.follow_branch(robot, flange, program.posture)


def keeps_waypoints(process: Process) -> bool:
    """Whether the program is driven through each waypoint that is laid."""
    return process.thin is None or process.arcs


def plan_motion_for_heat(program: ProgramPlan, cell: Cell, feed: float) -> JointMotion:
    """A program's motion on as few waypoints as show what its drives lose in the mean, in one file.

    On all that a chord of 1.5 um asks for, with the stops of pages, the losses are within 0.5 % the same.

    Raises:
        InputError: The path cannot be laid.
        ImpossibleError: The robot cannot drive it.
    """
    process = program.process
    spacing = max(process.spacing, MAX_SPACING)
    coarse = replace(process, chord=max(process.chord, HEAT_CHORD), spacing=spacing, thin=None)
    return plan_motion(
        replace(program, process=coarse), cell, feed, lambda stage, share: None, pages=False
    ).joint_motion


def plan_written_motion(program: ProgramPlan, cell: Cell, feed: float) -> MotionPlan:
    """A program's motion as it will stand in its file: without the waypoints that ``process.thin_um`` drops.

    Raises:
        InputError: The path cannot be laid.
        ImpossibleError: The robot cannot drive it.
    """
    plan = plan_motion(program, cell, feed, lambda stage, share: None)
    thin = program.process.thin
    if thin is None or keeps_waypoints(program.process):
        return plan
    unmoved, period = np.zeros_like(plan.path.target.position), cell.robot.controller.period
    rows = simplify.simplify(plan.path, plan.theta, unmoved, thin, plan.feed * period)
    path, theta = plan.path.subset(rows), plan.theta[rows]
    robot = cell.robot.at_acceleration(program.process.acc)
    trajectory = retiming.retime(robot, path.arc, theta, path.stop, plan.feed * path.pace, lines=True)
    return replace(plan, path=path, page_stops=None, theta=theta, trajectory=trajectory)
