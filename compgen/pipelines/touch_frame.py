"""The frame that an artefact's places and its touches are in."""

from compgen.core.exceptions import InputError
from compgen.core.pose import IDENTITY, Pose
from compgen.fanuc.frames import load_frames
from compgen.identification.touches import Artefact
from compgen.pipelines.part_frame import PartFrame


def frame_of_artefact(artefact: Artefact, part: PartFrame | None, frames: str | None) -> tuple[int, Pose]:
    """Number of the frame, and where it is in World.

    Args:
        artefact: Says which frame.
        part: Of the path; its user frame is known.
        frames: A frames table or SYSFRAME.VA that says where others are.

    Raises:
        InputError: Nothing says where the user frame is.
    """
    if artefact.frame == "world":
        return 0, IDENTITY
    number = int(artefact.frame.split()[1])
    known = {} if part is None else {part.number: part.register}
    if frames is not None:
        known.update(load_frames(frames).uframe)
    if number not in known:
        raise InputError(
            f"{artefact.source}: artefact.frame: its places are in user frame {number}; say where that is with "
            "--frames FILE, or give the path file its [frame]"
        )
    return number, known[number]
