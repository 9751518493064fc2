"""Whether a program carries compgen's mark, whatever its frames are."""

from compgen.fanuc.analysis.correctable import read_scope
from compgen.fanuc.analysis.surroundings import Surroundings
from compgen.fanuc.analysis.traversal import read_traversal
from compgen.fanuc.analysis.watermark import Mark, mark_of
from compgen.fanuc.frames import default_frames
from compgen.fanuc.listing.listing import LsProgram
from compgen.robot.robot import Robot


def is_marked(program: LsProgram, robot: Robot) -> bool:
    """Whether a remark or the digits of a program say that compgen has written or corrected it."""
    poses = Surroundings(default_frames()).poses(program, robot)
    traversal = read_traversal(program, poses, robot)
    return mark_of(program, poses, traversal, read_scope(program, poses, traversal, robot).free) is not Mark.NONE
