"""Planned touches as a record and as the CSV that the shop fills in."""

from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.commands import Command
from compgen.core.pose import POSE_KEYS
from compgen.core.units import DEG, UM
from compgen.pipelines.anchor.touch_plan import PlannedTouches
from compgen.program.digits import pose_numbers
from compgen.program.program import Signal, TouchPositions


def touches_csv(planned: PlannedTouches, touches: TouchPositions, *, stops: bool) -> bytes:
    """The touches as cgen anchor reads them, with empty cells for what the shop measures.

    Where the program stops at a touch, its place is known and the deflection is read; where a signal ends the search,
    the position register says the place.
    """
    sided = bool(np.isfinite(planned.ways.normal).all())
    read_place = not (stops and sided)
    lines = [
        ",".join(["time_s", "target", *POSE_KEYS, "config", *(("nx", "ny", "nz", "value_mm") * sided), "sigma_um"])
    ]
    numbers = _at_touch(planned, touches)
    for n, (row, normal) in enumerate(zip(numbers, planned.ways.normal.tolist(), strict=True)):
        place = [""] * 3 if read_place else [f"{v:.{touches.decimals}f}" for v in row[:3]]
        turn = [f"{v:.{touches.decimals}f}" for v in row[3:]]
        way = [*(f"{v + 0.0:.9g}" for v in normal), ""] if sided else []
        cells = ["", touches.name[n], *place, *turn, f'"{_config(touches, n)}"', *way, f"{planned.sigma / UM:g}"]
        lines.append(",".join(cells))
    return ("\n".join(lines) + "\n").encode()


def touch_record(planned: PlannedTouches, touches: TouchPositions, signal: Signal | None) -> dict[str, Any]:
    """Everything that was planned, in plain types."""
    job, numbers = planned.job, _at_touch(planned, touches)
    rms = (planned.rms / UM).tolist()
    joints = job.robot.to_pendant(planned.ways.theta[:, 2]) / DEG
    sided = bool(np.isfinite(planned.ways.normal).all())
    return {
        "command": Command.PLAN_TOUCHES,
        "planned_touches": len(touches.name),
        "path": job.name,
        "robot": job.robot.name,
        "artefact": planned.artefact.source,
        "uframe": touches.uframe,
        "utool": touches.utool,
        "sigma_um": planned.sigma / UM,
        "before": {"rms_um": rms[0], "p99_um": planned.p99[0] / UM},
        "after": {"rms_um": rms[-1], "p99_um": planned.p99[1] / UM},
        "by_anchoring_rms_um": None if planned.by_anchoring is None else planned.by_anchoring / UM,
        "one_more": {"rms_um": planned.next_rms / UM, "gain": planned.next_gain},
        "touches": [
            {
                "target": name,
                "position": dict(zip(POSE_KEYS, numbers[n], strict=True)),
                "config": _config(touches, n),
                "joints_deg": joints[n].tolist(),
                "normal": (planned.ways.normal[n] + 0.0).tolist() if sided else None,
                "register": None if signal is None else signal.register + n,
                "rms_um": rms[n + 1],
                "gain": 1 - rms[n + 1] / rms[n] if rms[n] else 0.0,
            }
            for n, name in enumerate(touches.name)
        ],
        "findings": [f.record() for f in planned.findings],
    }


def _at_touch(planned: PlannedTouches, touches: TouchPositions) -> list[list[float]]:
    """X Y Z [mm] and W P R [deg] of the touches themselves, in the program's frame."""
    touch: Array = planned.frame.inverse().act(planned.ways.position[:, 2])
    return pose_numbers(touch, touches.pose.rotation[::3], touches.decimals).tolist()  # type: ignore[no-any-return]


def _config(touches: TouchPositions, n: int) -> str:
    return touches.config(3 * n + 2)
