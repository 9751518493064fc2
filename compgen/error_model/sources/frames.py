r"""Displacement of the base and of the tool.

    base:  T -> (p, R(w)) T          in World                   tool:  flange -> flange (p, R(w))          in the flange

R(w) is the rotation of the rotation vector w. What the cell calls World is the frame that parts are placed in; a base
error moves the whole arm in it. Source: Mooring, Roth and Driels (1991). Valid for turns below half a turn.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

from compgen.core.units import MDEG, MM, UM
from compgen.error_model.expressions import column, rotation_expr
from compgen.error_model.source import DeclaredSource, Parameter, State
from compgen.robot.kinematics import Chain, is_zero


@dataclass(frozen=True, eq=False, slots=True)
class BaseFrame(DeclaredSource):
    """Displacement of the arm in World; in identification the frame of the instrument takes its place."""

    position: Any  # (3,) [m] World
    rotation: Any  # (3,) [rad] rotation vector, World

    NAME: ClassVar[str] = "base_frame"
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            field="position", key="position_um", shape=(3,), unit=UM, prior=1 * MM, meaning="of the arm in World"
        ),
        Parameter(
            field="rotation",
            key="rotation_mdeg",
            shape=(3,),
            unit=MDEG,
            prior=50 * MDEG,
            meaning="of the arm in World, rotation vector",
        ),
    )

    def distort(self, chain: Chain, state: State) -> Chain:
        """The chain on its real base."""
        return _inserted(chain, 0, self.position, self.rotation)


@dataclass(frozen=True, eq=False, slots=True)
class ToolFrame(DeclaredSource):
    """Displacement of the tool in the flange; in identification the places of the reflectors take its place."""

    position: Any  # (3,) [m] flange
    rotation: Any  # (3,) [rad] rotation vector, flange

    NAME: ClassVar[str] = "tool_frame"
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            field="position",
            key="position_um",
            shape=(3,),
            unit=UM,
            prior=500 * UM,
            meaning="of the tool in the flange",
        ),
        Parameter(
            field="rotation",
            key="rotation_mdeg",
            shape=(3,),
            unit=MDEG,
            prior=100 * MDEG,
            meaning="of the tool in the flange, rotation vector",
        ),
    )

    def distort(self, chain: Chain, state: State) -> Chain:
        """The chain with its real tool."""
        return _inserted(chain, 6, self.position, self.rotation)


def _inserted(chain: Chain, row: int, position: Any, rotation: Any) -> Chain:
    if is_zero(position) and is_zero(rotation):
        return chain
    return chain.inserted(row, column(position), rotation_expr(rotation))
