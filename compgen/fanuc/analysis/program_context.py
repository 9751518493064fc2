"""What a program relies on and does not say: frames, registers at its start, and the programs that it calls."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from compgen.fanuc.analysis.called_programs import UNKNOWN_PROGRAMS, CalledPrograms
from compgen.fanuc.analysis.placements import read_placements
from compgen.fanuc.analysis.poses import Poses, read_poses
from compgen.fanuc.analysis.traversal import read_traversal
from compgen.fanuc.listing.listing import LsProgram
from compgen.program.driven import DrivenProgram
from compgen.program.frames import Frames
from compgen.program.registers import Register
from compgen.program.ways import measure_reach
from compgen.robot.robot import Robot


@dataclass(frozen=True, slots=True)
class ProgramContext:
    """Frames, registers and called programs of one program."""

    frames: Frames
    registers: Mapping[int, Register] = field(default_factory=dict)  # by number
    called: CalledPrograms = UNKNOWN_PROGRAMS

    def poses(self, program: LsProgram, robot: Robot | None) -> Poses:
        """Those of the program's positions, as its motions place them."""
        return read_poses(
            program, robot, self.frames, read_placements(program, self.frames, self.registers, self.called)
        )

    def drive(self, program: LsProgram, robot: Robot) -> tuple[Poses, DrivenProgram]:
        """Its positions, and the program as the robot drives it, with what its ways keep of the reach."""
        poses = self.poses(program, robot)
        return poses, measure_reach(robot, read_traversal(program, poses, robot, self.called.motionless))
