"""What a program relies on and does not say: frames, registers at its start, and the programs that it calls."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from compgen.fanuc.analysis.called_programs import UNKNOWN_PROGRAMS, CalledPrograms
from compgen.fanuc.analysis.placements import read_placements
from compgen.fanuc.analysis.poses import Poses, read_poses
from compgen.fanuc.frames import Frames
from compgen.fanuc.listing.listing import LsProgram
from compgen.fanuc.registers import Register
from compgen.robot.robot import Robot


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Of one program."""

    frames: Frames
    registers: Mapping[int, Register] = field(default_factory=dict)  # by number
    called: CalledPrograms = UNKNOWN_PROGRAMS

    def poses(self, program: LsProgram, robot: Robot | None) -> Poses:
        """Those of the program's positions, as its motions place them."""
        return read_poses(
            program, robot, self.frames, read_placements(program, self.frames, self.registers, self.called)
        )
