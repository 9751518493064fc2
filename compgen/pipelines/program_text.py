"""A job's program: its poses, speeds and stops as FANUC text says them, with what the remarks tell of it."""

from compgen import __version__, fanuc
from compgen.core.arrays import Array, frozen, step_lengths
from compgen.fanuc import Program
from compgen.fanuc.configuration import turn_digits
from compgen.pipelines.job import Job
from compgen.planning.retiming import Trajectory
from compgen.planning.toolpath import ToolPath
from compgen.robot import inverse_kinematics, joint_path

DATE = "26-01-01"
REMARK_WIDTH = 32


def planned_program(job: Job, path: ToolPath, theta: Array, trajectory: Trajectory, date: str = DATE) -> Program:
    """The uncorrected program as its text would be read."""
    program, printed = compose_program(job, (path.position, path.rotation), theta, trajectory, path, date, None)
    return fanuc.as_written(program, printed)


def compose_program(
    job: Job,
    poses: tuple[Array, Array],
    theta: Array,
    trajectory: Trajectory,
    path: ToolPath,
    date: str,
    start_window: float | None,
) -> tuple[Program, tuple[Array, Array]]:
    """The program that names poses in the job's user frame, and these poses there rounded to its digits.

    Args:
        job: For names, tool, posture, controller and the warmth that the remarks tell.
        poses: To be named, in World, (N, 3) [m] and (N, 3, 3).
        theta: Joints there, (N, 6) [rad]; whole turns are taken from them.
        trajectory: For the speeds.
        path: For the stops.
        date: In the header.
        start_window: How long after its warmth the program may start [s]; None for a program that is not corrected.
    """
    decimals = job.robot.controller.decimals
    position, rotation = poses if job.frame is None else job.frame.register.from_world(*poses)
    printed = fanuc.printed_poses(position, rotation, decimals)
    # the digits of CONFIG belong to the pose as printed
    in_world = printed if job.frame is None else job.frame.register.to_world(*printed)
    joints, _ = inverse_kinematics.solve_tool(job.robot, *in_world, job.tool_position, job.tool_rotation, job.posture)
    remarks = [f"compgen {__version__} {job.robot.name}"[:REMARK_WIDTH], f"inputs {job.inputs_hash[:24]}"]
    remarks.append(f"robot file {job.robot_file_hash[:16]}")
    if start_window is None:
        remarks.append("planned, not corrected")
    else:
        rises = [f"{name} {rise:.1f}" for name, rise in zip(job.heat.names, job.start_rise())]
        pairs = [rises[i : i + 2] for i in range(0, len(rises), 2)]
        remarks += [f"rise K {' '.join(pair)}"[:REMARK_WIDTH] for pair in pairs]
        remarks.append(f"start within {start_window:.0f} s of that")
    program = Program(
        name=program_name_of(job),
        comment=f"compgen {job.inputs_hash[:8]}",
        date=date,
        remarks=tuple(remarks),
        uframe=0 if job.frame is None else job.frame.number,
        utool=job.tool_number,
        position=frozen(position),
        rotation=frozen(rotation),
        posture=job.posture,
        turns=frozen(turn_digits(job.robot, joint_path.nearest_turns(joints, theta))),
        speed=frozen(fanuc.written_feeds(trajectory.speed, step_lengths(position))),
        fine=path.stop,
        decimals=decimals,
    )
    return program, printed


def printed_in_world(job: Job, position: Array, rotation: Array) -> tuple[Array, Array]:
    """Where the controller has poses of World, (N, 3) [m] and (N, 3, 3), that the text says in its digits."""
    if job.frame is None:
        return fanuc.printed_poses(position, rotation, job.robot.controller.decimals)
    register = job.frame.register
    printed = fanuc.printed_poses(*register.from_world(position, rotation), job.robot.controller.decimals)
    return register.to_world(*printed)


def program_name_of(job: Job) -> str:
    """The name of the job's program on the controller."""
    return fanuc.program_name(job.name, job.robot.controller.name_length)
