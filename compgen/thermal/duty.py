"""What the robot does over a stretch of time, as far as its warmth goes."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class Duty:
    """Moving at a feed, idle with the servo on, or off."""

    state: Literal["moving", "idle", "off"]
    feed: float  # [m/s], 0 unless moving
    duration: float  # [s]
