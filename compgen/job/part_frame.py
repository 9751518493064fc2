"""The frame that a part stands in: from a path file's table or a frame's own file, and what its teaching means."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.pose import POSE_KEYS, Pose
from compgen.core.toml import suggest
from compgen.planning.tables import FrameTable, TaughtTable
from compgen.program.digits import printed_poses
from compgen.program.frames import load_frames, place_of, read_frame_file

WARM = 1.0  # [K] from which a frame is taught hot


@dataclass(frozen=True, eq=False, slots=True)
class PartFrame:
    """Where the part stands, and the user frame that the program is written in."""

    number: int
    place: Pose  # in World, of the part, as taught
    register: Pose  # what the controller holds: the place to the digits of its screen
    taught: TaughtTable | None


def frame_of(table: FrameTable | None, decimals: int, where: str) -> PartFrame | None:
    """The frame of a path file's table; None where it has none.

    Args:
        table: Numbers, or a file beside the path file.
        decimals: Of the controller's numbers.
        where: The path file.

    Raises:
        InputError: Numbers beside a file, a file that is none, or a frame that the file does not have.
    """
    if table is None:
        return None
    if table.file is None:
        return _rounded(table.number or 1, place_of(table), table.taught, decimals)
    doubled = next((key for key in (*POSE_KEYS, "taught") if key in table.model_fields_set), None)
    if doubled is not None:
        raise InputError(f"{where}: frame.{doubled}: the frame's file says it; remove it, or frame.file")
    source = Path(where).parent / table.file
    if table.file.lower().endswith(".va"):
        number, frames = table.number or 1, load_frames(str(source)).uframe
        if number not in frames:
            known = ", ".join(str(n) for n in sorted(frames) if n)
            raise InputError(f"{source}: frame {number} is not set in it (set: {known}); mend frame.number")
        return _rounded(number, frames[number], None, decimals)
    of_file = read_frame_file(source)
    number = of_file.number or 1
    if table.number is not None and of_file.number is not None and table.number != number:
        raise InputError(f"{where}: frame.number: {table.number}, and {source} is of frame {number}; remove one")
    return _rounded(table.number or number, place_of(of_file), of_file.taught, decimals)


def _rounded(number: int, place: Pose, taught: TaughtTable | None, decimals: int) -> PartFrame:
    return PartFrame(number, place, printed_poses(Pose.stack([place]), decimals)[0], taught)


def frame_findings(frame: PartFrame | None, robot_file_hash: str, nodes: Sequence[str]) -> Iterator[Finding]:
    """What a user must know of how the frame was taught; ``nodes`` are those of the arm's heat."""
    if frame is None:
        return
    taught = frame.taught
    if taught is None:
        yield Finding.of(
            Code.FRAME_TAUGHT,
            "[frame] does not say how it was taught: touched on the pendant with a warm arm it holds the heat, which "
            "would be corrected twice; teach it with cgen teach-frame, or say frame.taught",
        )
        return
    if taught.through == "pendant":
        yield _by_pendant(max(taught.rise_K.values(), default=0.0))
        return
    if strange := [node for node in taught.rise_K if node not in nodes]:
        message = f"frame.taught.rise_K: the robot file has no node '{strange[0]}': its rise does not count"
        yield Finding.of(Code.FRAME_TAUGHT, message + suggest(strange[0], nodes, listed=True))
    if taught.robot_file and not taught.robot_file.endswith(robot_file_hash[:16]):
        message = f"the frame was taught through {taught.robot_file}, another robot file than this; teach it anew"
        yield Finding.of(Code.FRAME_MODEL, message)
    if any(taught.sigma_um):
        k2 = ", ".join(f"{2 * s:.0f}" for s in taught.sigma_um)
        tool = " by the probe that taught it" if taught.touches else ""
        message = f"the part's place is known to {k2} um (k = 2, World x, y, z){tool}: in the band, and in no bound"
        yield Finding.of(Code.FRAME_UNCERTAINTY, message)


def _by_pendant(hottest: float) -> Finding:
    """Of a frame that the pendant taught, its warmest node so warm [K]."""
    if hottest > WARM:
        return Finding.of(
            Code.FRAME_HOT,
            f"the frame was taught on the pendant by an arm {hottest:.1f} K warm, without a model: the heat is in it "
            "and would be corrected twice; teach it with cgen teach-frame",
        )
    message = "the frame was taught on the pendant: what the arm errs by at the touched places is in it"
    return Finding.of(Code.FRAME_PENDANT, message)
