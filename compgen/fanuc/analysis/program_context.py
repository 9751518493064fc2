"""What a program relies on and does not say: frames, registers at its start, and the programs that it calls."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from compgen.fanuc.analysis.called_programs import UNKNOWN_PROGRAMS, CalledPrograms, called_programs, with_called_motion
from compgen.fanuc.analysis.placements import read_placements
from compgen.fanuc.analysis.poses import Poses, program_poses
from compgen.fanuc.analysis.traversal import read_traversal
from compgen.fanuc.listing.listing import LsProgram, loads
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
        return program_poses(
            program, robot, self.frames, read_placements(program, self.frames, self.registers, self.called)
        )

    def drive(self, program: LsProgram, robot: Robot) -> tuple[Poses, DrivenProgram]:
        """Its positions, and the program as the robot drives it, with what its ways keep of the reach."""
        return self._drive(program, robot, {})

    def _drive(
        self, program: LsProgram, robot: Robot, known: dict[str, DrivenProgram | None]
    ) -> tuple[Poses, DrivenProgram]:
        """The same, with the programs that are driven already, by name; None for one whose calls are being read."""
        known[program.name.upper()] = None
        listings = dict(self.called.listings)

        def drive_of(name: str) -> DrivenProgram | None:
            if name not in known:
                listing = loads(listings[name])
                around = replace(self, called=called_programs(listing, listings.get))
                known[name] = around._drive(listing, robot, known)[1]
            return known[name]

        poses = self.poses(program, robot)
        drive = measure_reach(robot, read_traversal(program, poses, robot, self.called.motionless))
        return poses, with_called_motion(program, drive, self.called, drive_of)
