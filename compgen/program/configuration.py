"""CONFIG of a Cartesian position as text: three letters for the posture, three numbers for the turns of three joints.

CONFIG : 'N U T, 0, 0, 0'         wrist No flip / Flip, elbow Up / Down, arm fronT / Back; turns (``robot/turns.py``)
"""

import re

from compgen.robot.inverse_kinematics import Posture

#: The text between the quotes: wrist, elbow, arm, and the three turns where they are given.
CONFIG = re.compile(r"\s*([NF])\s*([UD])\s*([TB])\s*(?:,\s*(-?\d{1,4})\s*,\s*(-?\d{1,4})\s*,\s*(-?\d{1,4}))?\s*$")


def parse_config(text: str) -> tuple[Posture | None, tuple[int, ...]]:
    """Posture and turns of CONFIG's text; no posture and no turns where it names none of this arm."""
    match = CONFIG.match(text)
    if match is None:
        return None, (0, 0, 0)
    wrist, elbow, arm, *turns = match.groups()
    return Posture(arm == "T", elbow == "U", wrist == "F"), tuple(int(turn or 0) for turn in turns)


def config_letters(posture: Posture) -> str:
    """CONFIG's letters: wrist, elbow, arm."""
    return f"{'F' if posture.flip else 'N'} {'U' if posture.up else 'D'} {'T' if posture.front else 'B'}"
