"""What of an artefact touches can anchor by, and the frame that its places are in."""

import numpy as np

from compgen.core.arrays import Array
from compgen.core.codes import Code, Level
from compgen.core.exceptions import ImpossibleError, InputError
from compgen.core.findings import Finding
from compgen.core.pose import IDENTITY, Pose
from compgen.core.units import MM
from compgen.fanuc.frames import load_frames
from compgen.identification.touch_candidates import Targets, Ways
from compgen.identification.touches import Artefact
from compgen.job.part_frame import PartFrame

MOST_TARGETS = 60
LEAST_DIAMETER = 1 * MM


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


def targets_of(artefact: Artefact, frame: Pose, centres: bool) -> tuple[Targets, Array, list[Finding]]:
    """The spheres and planes that can anchor, in World, with the sigma of their places (S,) [m].

    Args:
        artefact: Its file.
        frame: Place in World of the frame that its places are in.
        centres: Whether a touch locates the centre of a sphere; planes are left out then.

    Raises:
        InputError: Nobody vouches for places, none is known, a diameter or the probe's place is missing.
    """
    source, placed, notes = artefact.source, np.isfinite(artefact.place[:, 0]), list[Finding]()
    if artefact.certified is False and artefact.taught is None:
        raise InputError(
            f"{source}: artefact.certified: false: places that nobody certified anchor nothing; give certified = true "
            "with what is certified and sigma_um, or [artefact.taught] if this robot taught them"
        )
    if artefact.certified is None and artefact.taught is None:
        message = f"{source}: artefact.certified: not said: places count as an instrument's, known to their sigma_um"
        notes.append(Finding(Level.NOTE, Code.TOUCHES_CERTIFIED, message))
    unplaced = ", ".join(n for n, known in zip(artefact.names, placed.tolist(), strict=True) if not known)
    planes = 0 if centres else len(artefact.planes)
    if not placed.any() and not planes:
        raise InputError(f"{source}: sphere: none has a place; give x_mm, y_mm, z_mm of those to be touched")
    if unplaced:
        message = f"{source}: sphere {unplaced}: no place, so a touch anchors nothing: left out"
        notes.append(Finding(Level.NOTE, Code.TOUCHES_UNKNOWN_PLACE, message))
    if placed.sum() + planes > MOST_TARGETS:
        count = placed.sum() + planes
        raise InputError(f"{source}: {count} targets; at most {MOST_TARGETS} are planned for: leave some out")
    if not artefact.probe.any():
        raise InputError(f"{source}: probe: no place in the flange; give [probe] x_mm, y_mm, z_mm of its ball's centre")
    undefined = placed & np.isnan(artefact.diameter)
    if undefined.any() and not centres:
        name = artefact.names[int(np.argmax(undefined))]
        raise InputError(
            f"{source}: sphere '{name}': diameter_mm: missing; touches from one side need it: give it, or plan with "
            "--centres"
        )
    small = artefact.diameter < LEAST_DIAMETER
    if small.any():
        name, size = artefact.names[int(np.argmax(small))], float(artefact.diameter[small][0]) / MM
        raise InputError(f"{source}: sphere '{name}': diameter_mm: {size:g} is no sphere to touch; give millimetres")
    rows = np.flatnonzero(placed)
    return (
        Targets(
            (*(artefact.names[i] for i in rows.tolist()), *artefact.planes[:planes]),
            frame.act(np.vstack([artefact.place[rows], artefact.point[:planes]])),
            np.append(np.nan_to_num(artefact.diameter[rows]) / 2, np.zeros(planes)),
            np.vstack([np.full((len(rows), 3), np.nan), artefact.normal[:planes] @ frame.rotation.T]),
        ),
        np.append(artefact.sigma[rows], artefact.plane_sigma[:planes]),
        notes,
    )


def unreached(artefact: Artefact, targets: Targets, ways: Ways) -> list[Finding]:
    """Names the targets that the arm does not reach.

    Raises:
        ImpossibleError: It reaches none.
    """
    missed = [n for s, n in enumerate(targets.name) if not (ways.target == s).any()]
    if len(missed) == len(targets.name):
        x, y, z = (targets.place[0] / MM).tolist()
        raise ImpossibleError(
            f"{artefact.source}: {', '.join(missed)[:60]}: out of the arm's reach in the program's posture "
            f"('{missed[0]}' at World {x:.0f} {y:.0f} {z:.0f} mm); check [artefact] frame and places"
        )
    if not missed:
        return []
    message = f"{', '.join(missed)}: no way to touch it in the program's posture: left out"
    return [Finding(Level.WARNING, Code.TOUCHES_REACH, message)]
