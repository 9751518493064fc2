"""An arm's sheet as a record and as a picture of it at pendant zero."""

from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.units import DEG, MM
from compgen.pipelines.robot_sheet import RobotSheet

KEYS = ("x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg")
SIZE, EDGE = 420, 40  # of each view [px]
JOINT, FLANGE, LINK, TEXT = "#0f766e", "#c2410c", "#64748b", "#334155"


def sheet_record(sheet: RobotSheet) -> dict[str, Any]:
    """Everything on the sheet, in plain types."""
    robot, reach = sheet.arm.robot, sheet.reach
    rates = {
        "speed_deg_s": robot.speed, "acceleration_deg_s2": robot.acceleration, "jerk_deg_s3": robot.jerk,
    }  # fmt: skip
    return {
        "inspected_robot": robot.name,
        "file": sheet.arm.source,
        "d_mm": _rounded(robot.d / MM),
        "a_mm": _rounded(robot.a / MM),
        "alpha_deg": _rounded(robot.alpha / DEG),
        "wrist_reach_mm": {
            "outward": round(reach.outward / MM, 1), "inward": round(reach.inward / MM, 1),
            "low": round(reach.low / MM, 1), "high": round(reach.high / MM, 1),
        },
        "joints": [
            {
                "name": name,
                "lower_deg": low,
                "upper_deg": high,
                **{key: _rounded(values / DEG)[k] for key, values in rates.items()},
            }
            for k, (name, (low, high)) in enumerate(zip(robot.joint_names, np.round(sheet.limits, 6).tolist()))
        ],
        "pendant_J3": "against the horizontal" if sheet.coupled else "against the upper arm",
        "programs": sheet.obstacle or "generated and corrected",
        "nodes": list(sheet.arm.nodes),
        "sources": [known.source.NAME for known in sheet.arm.known],
        "poses": [
            {"joints_deg": list(p.joints), **dict(zip(KEYS, p.numbers)), "config": p.config} for p in sheet.poses
        ],
        "findings": [f.record() for f in sheet.findings],
    }  # fmt: skip


def zero_svg(sheet: RobotSheet) -> str:
    """The arm at pendant zero from the side and from above, with its lengths in mm."""
    places = sheet.zero.position
    corners = places[1:] - sheet.arm.robot.a[:, None] * sheet.zero.rotation[1:, :, 0]
    way = np.vstack([places[:1], np.stack([corners, places[1:]], axis=1).reshape(-1, 3)])
    spread = max(float(np.ptp(way[:, k])) for k in range(3))
    scale = (SIZE - 2 * EDGE) / max(spread, 1e-3)
    views = [_view(way, places, (0, 2), scale, 0, "side view"), _view(way, places, (0, 1), scale, SIZE, "from above")]
    name = sheet.arm.robot.name
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{2 * SIZE}" height="{SIZE}" font-family="sans-serif">\n'
        f'<rect width="{2 * SIZE}" height="{SIZE}" fill="white"/>\n' + "\n".join(views) + "\n"
        f'<text x="{EDGE}" y="{SIZE - 10}" font-size="12" fill="{TEXT}">{name}, all joints of the pendant zero; '
        "origins of the joints' frames, World in mm</text>\n</svg>\n"
    )


def _view(way: Array, places: Array, axes: tuple[int, int], scale: float, left: int, title: str) -> str:
    """One view: links as lines, joints as dots with their place, the flange in another colour."""
    low, spread = way[:, axes].min(axis=0), np.ptp(way[:, axes], axis=0)
    low = low - ((SIZE - 2 * EDGE) / scale - spread) / 2  # in the middle

    def pixel(point: Array) -> tuple[float, float]:
        x, y = (point[list(axes)] - low) * scale
        return left + EDGE + float(x), SIZE - EDGE - float(y)

    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in map(pixel, way))
    parts = [
        f'<text x="{left + EDGE}" y="20" font-size="13" fill="{TEXT}">{title} '
        f"({'xyz'[axes[0]]} right, {'xyz'[axes[1]]} up)</text>",
        f'<polyline points="{points}" fill="none" stroke="{LINK}" stroke-width="4"/>',
    ]
    drawn = set()
    for n, place in enumerate(places):
        x, y = pixel(place)
        colour = FLANGE if n == len(places) - 1 else JOINT
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="{colour}"/>')
        at = f"{x:.0f},{y:.0f}"
        if at not in drawn:
            drawn.add(at)
            u, v = (place[list(axes)] / MM).tolist()
            parts.append(f'<text x="{x + 7:.1f}" y="{y - 7:.1f}" font-size="11" fill="{TEXT}">{u:.0f}, {v:.0f}</text>')
    return "\n".join(parts)


def _rounded(values: Array) -> list[float]:
    return [float(v) + 0.0 for v in np.round(values, 6)]
