"""An arm as files: its sheet as a record and as a picture at pendant zero, and for other software as URDF or JSON."""

from collections.abc import Iterator, Mapping
from html import escape
from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.commands import Command
from compgen.core.pose import POSE_KEYS
from compgen.core.rotations import to_wpr
from compgen.core.units import DEG, MM, UM
from compgen.error_model.rigid_chain import RigidChain
from compgen.pipelines.files.robot_sheet import RobotSheet
from compgen.robot.robot import Robot

SIZE, EDGE = 440, 72  # of each view [px]
LETTER = 6.2  # of a word, at most [px]
#: Colours on white, and in the dark where the picture is shown there.
STYLE = (
    "<style>.ground{fill:#ffffff}.joint{fill:#0f766e}.flange{fill:#c2410c}.link{stroke:#64748b}text{fill:#334155}"
    "@media screen and (prefers-color-scheme:dark){.ground{fill:#0f172a}.joint{fill:#2dd4bf}.flange{fill:#fb923c}"
    ".link{stroke:#94a3b8}text{fill:#e2e8f0}}</style>"
)

NOTHING = 1e-14  # m or a direction's part: rounding of right angles
FRAMES = ("World, whose links are parallel to it at pendant zero", "tool0, the flange with z out of it")


def sheet_record(sheet: RobotSheet) -> dict[str, Any]:
    """Everything on the sheet, in plain types."""
    robot, reach = sheet.arm.robot, sheet.reach
    rates = {
        "speed_deg_s": robot.speed,
        "acceleration_deg_s2": robot.acceleration,
        "jerk_deg_s3": robot.jerk,
    }
    limits = np.round(sheet.limits, 6).tolist()
    return {
        "command": Command.INSPECT_ROBOT,
        "inspected_robot": robot.name,
        "file": sheet.arm.source,
        "d_mm": _rounded(robot.d / MM),
        "a_mm": _rounded(robot.a / MM),
        "alpha_deg": _rounded(robot.alpha / DEG),
        "wrist_reach_mm": {
            "outward": round(reach.outward / MM, 1),
            "inward": round(reach.inward / MM, 1),
            "low": round(reach.low / MM, 1),
            "high": round(reach.high / MM, 1),
        },
        "joints": [
            {
                "name": name,
                "lower_deg": low,
                "upper_deg": high,
                **{key: _rounded(values / DEG)[k] for key, values in rates.items()},
            }
            for k, (name, (low, high)) in enumerate(zip(robot.joint_names, limits, strict=True))
        ],
        "pendant_J3": "against the horizontal" if sheet.coupled else "against the upper arm",
        "programs": sheet.obstacle or "generated and corrected",
        "nodes": list(sheet.arm.nodes),
        "sources": [known.source.NAME for known in sheet.arm.known],
        "poses": [
            {"joints_deg": list(p.joints), **dict(zip(POSE_KEYS, p.numbers, strict=True)), "config": p.config}
            for p in sheet.poses
        ],
        "findings": [f.record() for f in sheet.findings],
    }


def zero_svg(sheet: RobotSheet) -> str:
    """The arm at pendant zero from the side and from above, with its lengths in mm."""
    places = sheet.zero.position
    corners = places[1:] - sheet.arm.robot.a[:, None] * sheet.zero.rotation[1:, :, 0]
    way = np.vstack([places[:1], np.stack([corners, places[1:]], axis=1).reshape(-1, 3)])
    spread = max(float(np.ptp(way[:, k])) for k in range(3))
    scale = (SIZE - 2 * EDGE) / max(spread, 1e-3)
    views = [_view(way, places, (0, 2), scale, 0, "side view"), _view(way, places, (0, 1), scale, SIZE, "from above")]
    name, (x, y, z) = escape(sheet.arm.robot.name), (places[-1] / MM).tolist()
    words = (
        f"{name} with all joints of the pendant at zero, from the side and from above: its flange is at X {x:.0f}, "
        f"Y {y:.0f}, Z {z:.0f} mm in World, {len(places)} joint frames are marked."
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {2 * SIZE} {SIZE}" width="{2 * SIZE}" height="{SIZE}" '
        f'font-family="sans-serif" role="img" aria-labelledby="title">\n<title id="title">{words}</title>\n{STYLE}\n'
        f'<rect class="ground" width="{2 * SIZE}" height="{SIZE}"/>\n' + "\n".join(views) + "\n"
        f'<text x="{EDGE}" y="{SIZE - 10}" font-size="12">{name}, all joints of the pendant zero; '
        "origins of the joints' frames, World in mm; the larger dot is the flange</text>\n</svg>\n"
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
        f'<text x="{left + EDGE}" y="20" font-size="13">{title} ({"xyz"[axes[0]]} right, {"xyz"[axes[1]]} up)</text>',
        f'<polyline points="{points}" fill="none" class="link" stroke-width="4"/>',
    ]
    words: dict[str, tuple[float, float, str]] = {}
    for n, place in enumerate(places):
        x, y = pixel(place)
        kind, radius = ("flange", 7) if n == len(places) - 1 else ("joint", 5)
        parts.append(f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{radius}" class="{kind}"/>')
        u, v = (place[list(axes)] / MM).tolist()
        words[f"{x:.0f},{y:.0f}"] = (x, y, f"{u:.0f}, {v:.0f}")
    return "\n".join([*parts, *_beside(list(words.values())[::-1], left)])


def _beside(words: list[tuple[float, float, str]], left: float) -> Iterator[str]:
    """Words beside their places, each where it neither meets another nor leaves its view; ``left`` is the view's."""
    taken: list[tuple[float, float]] = []  # left and top of words, each as long as the longest
    length, height = LETTER * max(len(text) for _, _, text in words), 12.0
    for x, y, text in words:
        own = LETTER * len(text)
        corners = [
            (x + dx - (own if dx < 0 else 0), y + dy - 10) for dy in (-7, 17, -21, 31, -35, 45) for dx in (7, -7)
        ]
        inside = [(a, b) for a, b in corners if left <= a <= left + SIZE - own]
        free = [(a, b) for a, b in inside if all(abs(a - c) >= length or abs(b - d) >= height for c, d in taken)]
        a, b = (free or corners)[0]
        taken.append((a, b))
        yield f'<text x="{a:.1f}" y="{b + 10:.1f}" font-size="11">{text}</text>'


def _rounded(values: Array) -> list[float]:
    return [float(v) + 0.0 for v in np.round(values, 6)]


def urdf_text(robot: Robot, chain: RigidChain, words: tuple[str, ...]) -> str:
    """A URDF of six revolute joints without shapes and masses, base to tool0 [m, rad].

    Args:
        robot: Limits of joints and speeds.
        chain: Its lines and flange.
        words: What the file says of itself.
    """
    line, low, high = _joints(robot, chain)
    links = ["base", *(f"link_{i}" for i in range(1, 7)), "tool0"]
    rows = [
        '<?xml version="1.0"?>',
        *(f"<!-- {word.replace('--', '- -')} -->" for word in words),
        f'<robot name="{robot.name}">',
        *(f'  <link name="{link}"/>' for link in links),
    ]
    before = np.zeros(3)
    for i in range(6):
        rows += [
            f'  <joint name="joint_{i + 1}" type="revolute">',
            f'    <origin xyz="{_row_of_numbers(chain.point[i] - before)}" rpy="0 0 0"/>',
            f'    <parent link="{links[i]}"/>',
            f'    <child link="{links[i + 1]}"/>',
            f'    <axis xyz="{_row_of_numbers(line[i])}"/>',
            f'    <limit lower="{low[i]:.15g}" upper="{high[i]:.15g}" effort="0" velocity="{robot.speed[i]:.15g}"/>',
            "  </joint>",
        ]
        before = chain.point[i]
    angles = np.array([a[0] for a in to_wpr(chain.flange.rotation[None])])
    rows += [
        '  <joint name="joint_6-tool0" type="fixed">',
        f'    <origin xyz="{_row_of_numbers(chain.flange.position - before)}" rpy="{_row_of_numbers(angles)}"/>',
        '    <parent link="link_6"/>',
        '    <child link="tool0"/>',
        "  </joint>",
        "</robot>",
    ]
    return "\n".join(rows) + "\n"


def export_record(robot: Robot, chain: RigidChain, rise_K: Mapping[str, float], source: str) -> dict[str, object]:
    """The same as JSON holds it: lines and flange in World at pendant zero [m], limits [rad], what is left out."""
    line, low, high = _joints(robot, chain)
    joints = [
        {"name": f"joint_{i + 1}", "axis": w, "point_m": p, "lower_rad": a, "upper_rad": b, "velocity_rad_s": v}
        for i, (w, p, a, b, v) in enumerate(
            zip(
                line.tolist(),
                chain.point.tolist(),
                low.tolist(),
                high.tolist(),
                robot.speed.tolist(),
                strict=True,
            )
        )
    ]
    return {
        "command": Command.EXPORT_ROBOT,
        "robot": robot.name,
        "source": source,
        "rise_K": dict(rise_K),
        "frames": list(FRAMES),
        "pendant": f"joint 3 is {robot.joint_names[2].replace('+', ' + ').replace('-', ' - ')}",
        "joints": joints,
        "flange": {"position_m": chain.flange.position.tolist(), "rotation": chain.flange.rotation.tolist()},
        "left_out": list(chain.left_out),
        "left_out_um": round(chain.off / UM, 3),
    }


def _joints(robot: Robot, chain: RigidChain) -> tuple[Array, Array, Array]:
    """Lines (6, 3) about which joints turn as the pendant counts them, and their limits [rad]."""
    return chain.line * robot.pendant_way[:, None], *robot.quoted_limits


def _row_of_numbers(values: Array) -> str:
    return " ".join(f"{0.0 if abs(v) < NOTHING else v:.15g}" for v in values)
