"""What the controller's motion does to a program, as JSON has it."""

from typing import Any

from compgen.core.units import MM, MS, UM
from compgen.verification.motion_effect import MotionEffect


def motion_record(effect: MotionEffect | None) -> dict[str, Any] | None:
    """The effect of the controller's motion on the written text; docs/report.md has the keys."""
    if effect is None:
        return None
    motion = effect.motion
    return {
        "known": effect.known,
        "predistorted": motion.may_predistort,
        "space": motion.space,
        "moving_average_ms": [round(t / MS, 9) for t in motion.moving_averages],
        "first_order_ms": [round(t / MS, 9) for t in motion.first_orders],
        "lag_ms": round(motion.lag / MS, 9),
        "off_path_um": effect.largest / UM,
        "where_m": effect.where,
        "along_um": effect.along / UM,
        "behind_mm": effect.lag / MM,
    }
