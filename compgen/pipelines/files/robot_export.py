"""A robot file for other software: its arm, identified or not, cold or with its nodes at given rises."""

from dataclasses import dataclass

import numpy as np

from compgen.core.exceptions import InputError
from compgen.core.toml import suggest
from compgen.core.units import UM
from compgen.error_model.rigid_chain import RigidChain, rigid_chain
from compgen.pipelines.files.robot_file import Arm, load_arm

RANGE = (-100.0, 200.0)  # K of a rise


@dataclass(frozen=True, eq=False, slots=True)
class ExportedArm:
    """An arm as six lines."""

    arm: Arm
    rise_K: dict[str, float]
    chain: RigidChain

    def words(self) -> tuple[str, ...]:
        """What the file says of itself."""
        warm = ", ".join(f"{name} {rise:g} K" for name, rise in self.rise_K.items() if rise) or "cold"
        robot = self.arm.robot
        joint_3 = f"joint 3 is {robot.joint_names[2]} of the pendant"
        lines = [f"{robot.name} as its robot file knows it, {warm}; base is World; {joint_3}"]
        if self.chain.left_out:
            left = ", ".join(self.chain.left_out)
            lines.append(
                f"left out, for they are no fixed lines: {left}; up to {self.chain.off / UM:.3g} um of the flange"
            )
        return tuple(lines)


def export_arm(name: str, rises: str | None = None) -> ExportedArm:
    """An arm by its robot's name or file.

    Args:
        name: Robot name or file.
        rises: Of its nodes, ``j2=11,j3=13`` [K]; those that are not named are cold.

    Raises:
        InputError: An unknown robot or node, or a rise that is no number or out of range.
    """
    arm = load_arm(name)
    rise_K = dict.fromkeys(arm.nodes, 0.0)
    for item in (rises or "").split(",") if rises is not None else ():
        node, sign, number = (word.strip() for word in item.partition("="))
        if node not in rise_K:
            known = f"known: {', '.join(arm.nodes)}" if arm.nodes else f"{name} has no nodes: leave it out"
            raise InputError(f"--rise-K: no node '{node:.40}'{suggest(node, arm.nodes)}; {known}")
        try:
            value = float(number)
        except ValueError:
            value = np.nan
        if not sign or not RANGE[0] <= value <= RANGE[1]:
            raise InputError(f"--rise-K: {node}: '{number:.40}' is no rise of {RANGE[0]:g} to {RANGE[1]:g} K; mend it")
        rise_K[node] = value
    sources = [known.source for known in arm.known]
    return ExportedArm(arm, rise_K, rigid_chain(arm.robot, sources, np.array(list(rise_K.values()))))
