"""An arm for other software: URDF, or JSON with the same numbers."""

from collections.abc import Mapping

import numpy as np

from compgen.core.arrays import Array
from compgen.core.commands import Command
from compgen.core.rotations import to_wpr
from compgen.core.units import UM
from compgen.error_model.rigid_chain import RigidChain
from compgen.robot.robot import Robot

NOTHING = 1e-14  # m or a direction's part: rounding of right angles
FRAMES = ("World, whose links are parallel to it at pendant zero", "tool0, the flange with z out of it")


def urdf_text(robot: Robot, chain: RigidChain, words: tuple[str, ...]) -> str:
    """A URDF of six revolute joints without shapes and masses, base to tool0 [m, rad].

    Args:
        robot: Limits of joints and speeds.
        chain: Its lines and flange.
        words: What the file says of itself.
    """
    low, high = _range(robot)
    links = ["base", *(f"link_{i}" for i in range(1, 7)), "tool0"]
    rows = ['<?xml version="1.0"?>', *(f"<!-- {word.replace('--', '- -')} -->" for word in words)]
    rows.append(f'<robot name="{robot.name}">')
    rows += [f'  <link name="{link}"/>' for link in links]
    before = np.zeros(3)
    for i in range(6):
        rows += [
            f'  <joint name="joint_{i + 1}" type="revolute">',
            f'    <origin xyz="{_numbers(chain.point[i] - before)}" rpy="0 0 0"/>',
            f'    <parent link="{links[i]}"/>',
            f'    <child link="{links[i + 1]}"/>',
            f'    <axis xyz="{_numbers(chain.line[i])}"/>',
            f'    <limit lower="{low[i]:.15g}" upper="{high[i]:.15g}" effort="0" velocity="{robot.speed[i]:.15g}"/>',
            "  </joint>",
        ]
        before = chain.point[i]
    angles = np.array([a[0] for a in to_wpr(chain.flange.rotation[None])])
    rows += [
        '  <joint name="joint_6-tool0" type="fixed">',
        f'    <origin xyz="{_numbers(chain.flange.position - before)}" rpy="{_numbers(angles)}"/>',
        '    <parent link="link_6"/>',
        '    <child link="tool0"/>',
        "  </joint>",
        "</robot>",
    ]
    return "\n".join(rows) + "\n"


def export_record(robot: Robot, chain: RigidChain, rise_K: Mapping[str, float], source: str) -> dict[str, object]:
    """The same as JSON holds it: lines and flange in World at pendant zero [m], limits [rad], what is left out."""
    low, high = _range(robot)
    joints = [
        {"name": f"joint_{i + 1}", "axis": w, "point_m": p, "lower_rad": a, "upper_rad": b, "velocity_rad_s": v}
        for i, (w, p, a, b, v) in enumerate(
            zip(
                chain.line.tolist(),
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
        "pendant": "joint 3 is J2 + J3" if robot.joint_names[2] != "J3" else "joint 3 is J3",
        "joints": joints,
        "flange": {"position_m": chain.flange.position.tolist(), "rotation": chain.flange.rotation.tolist()},
        "left_out": list(chain.left_out),
        "left_out_um": round(chain.off / UM, 3),
    }


def _range(robot: Robot) -> tuple[Array, Array]:
    zero = robot.to_theta(np.zeros(6))
    return robot.lower - zero, robot.upper - zero


def _numbers(values: Array) -> str:
    return " ".join(f"{0.0 if abs(v) < NOTHING else v:.15g}" for v in values)
