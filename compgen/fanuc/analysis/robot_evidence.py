"""What a program tells of the robot it is for: names in its remarks, and positions that an arm cannot take."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compgen.fanuc.analysis.poses import Poses
from compgen.fanuc.analysis.unsafe_statements import unsafe_statements
from compgen.fanuc.listing.listing import LsProgram
from compgen.program.driven import DrivenProgram
from compgen.robot.robot import Robot

_WORD = re.compile(r"[A-Za-z0-9]+")
_MOST_WORDS = 5  # that make up one name, as in LR Mate 200 iD 7L
#: FANUC's models, their blanks and marks left out
_MODEL = re.compile(
    r"(?:LR|ARC)MATE(?:\d{2,3}I[A-Z]?)?(?:\d+[A-Z]{0,2})?|(?:R\d{4}|M\d{1,4}|S\d{3}|P\d{2,3}|(?:CRX?|SR|DR)\d{1,2})I[ABCDFW](?:\d+[A-Z]{0,2})?"
)
TOLERANCE = 1e-9  # [rad]


@dataclass(frozen=True, slots=True)
class Unattainable:
    """Positions that plain motions drive to and that an arm cannot take."""

    positions: tuple[int, ...]  # n of P[n]
    driven: int  # so many are driven to and known


def robots_named(program: LsProgram, names: Sequence[str]) -> list[str]:
    """Those of some robots that a program's remarks or comment name, blanks and marks left out."""
    spoken = set(_names_in(program))
    return [name for name in names if _plain(name) in spoken]


def other_models(program: LsProgram, robot: Robot) -> list[str]:
    """FANUC models that a program's remarks or comment name and that are not this robot's, nor of its family."""
    own = _plain(robot.name)
    if not _MODEL.fullmatch(own):
        return []  # a name of the user's own: no model to compare with
    models = [name for name in _names_in(program) if _MODEL.fullmatch(name)]
    others = [name for name in models if not (own.startswith(name) or name.startswith(own))]
    return sorted({name for name in others if not any(name != other and other.startswith(name) for other in others)})


def unattainable(program: LsProgram, poses: Poses, traversal: DrivenProgram, robot: Robot) -> Unattainable:
    """Positions out of reach or beyond a joint limit, where the motion drives to the position itself."""
    held = {u.line for u in unsafe_statements(program, poses.placements)}
    plain = (traversal.pose >= 0) & ~np.isin(program.motions.line[traversal.motion], list(held))
    rows = np.unique(traversal.pose[plain])
    rows = rows[~poses.extended[rows] & ~np.isin(poses.line[rows], list(held))]
    theta, far = poses.theta[rows], poses.margin[rows] < 0
    with np.errstate(invalid="ignore"):
        beyond = (np.maximum(robot.lower - theta, theta - robot.upper) > TOLERANCE).any(axis=1)
        beyond |= ~robot.is_clear(theta)
    known = np.isfinite(theta).all(axis=1) | far
    return Unattainable(tuple(poses.number[rows[far | beyond]].tolist()), int(known.sum()))


def _names_in(program: LsProgram) -> list[str]:
    """Words of the remarks and the comment, alone and with those that follow, in capitals."""
    texts = [dict(program.attributes).get("COMMENT", ""), *program.remarks]
    runs = [[w.upper() for w in _WORD.findall(text)] for text in texts]
    return [
        "".join(words[i : i + n])
        for words in runs
        for i in range(len(words))
        for n in range(1, min(_MOST_WORDS, len(words) - i) + 1)
    ]


def _plain(name: str) -> str:
    return "".join(_WORD.findall(name)).upper()
