r"""Residual error as measured along the World axes: positioning and straightness for each direction of travel.

    p -> p + sum_axis [ m_axis(s) + t_axis h_axis(s) ],   s = nominal TCP along the axis, t_axis its travel in [-1, 1]

    m = (forward + reverse) / 2,   h = (forward - reverse) / 2            each a vector (3) of s

Between the measured stations both are cubic splines with two continuous derivatives (natural ends; two stations: a
line), as a sum of powers that is linear in the values,

    f(s) = sum_j v_j B_j(x),   B_j(x) = a_j + b_j x + c_j x^2 + sum_k e_jk max(x - x_k, 0)^3,   x in [0, 1]

Beyond the first and the last station their values hold, and a finding says that the program leaves the hull.
The contributions of the axes add, so each line is zeroed where the lines cross. Source: bidirectional axis tests as in
the reference study, chapter 5 (ISO 230-2). A map holds for the postures and the tool it was measured with.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError
from compgen.core.units import MM, UM
from compgen.error_model.schema import MapTable
from compgen.error_model.source import (
    ArmFacts,
    DeclaredSource,
    Parameter,
    ReversalWidths,
    Shapes,
    State,
)
from compgen.robot.kinematics import Chain, is_zero


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class AxisMap(DeclaredSource):
    """One line of stations along a World axis."""

    forward: Any  # (S, 3) [m] actual less commanded while moving towards larger coordinates
    reverse: Any  # (S, 3) [m]
    axis: int  # 0, 1, 2 for x, y, z
    station: Array  # (S,) [m] World coordinate, rising
    place: Array  # (3,) [m] where in World the line was measured; the entry along it says nothing
    width: float  # [m] way over which the direction of travel blends after a reversal

    NAME: ClassVar[str] = "map"
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            field="forward",
            key="forward_um",
            shape=("S", 3),
            unit=UM,
            prior=300 * UM,
            meaning="deviation moving to larger coordinates",
        ),
        Parameter(
            field="reverse",
            key="reverse_um",
            shape=("S", 3),
            unit=UM,
            prior=300 * UM,
            meaning="deviation moving to smaller coordinates",
        ),
    )
    BUDGET: ClassVar[str] = "measured map"
    ARRAYS: ClassVar[Shapes] = {"station": ("S",), "place": (3,)}

    @staticmethod
    def derive(table: MapTable, arm: ArmFacts, key: str) -> dict[str, Any]:
        """Where the line was measured, and over which way a reversal blends."""
        station = np.array(table.station_mm) * MM
        if not (np.diff(station) > 0).all():
            raise InputError(f"{key}.station_mm: stations must rise; sort the rows, each place once")
        for name in ("forward_um", "reverse_um"):
            count = len(getattr(table, name))
            if count != len(station):
                raise InputError(f"{key}.{name}: {count} rows for {len(station)} stations; give one each")
        return {
            "axis": "xyz".index(table.axis),
            "station": station,
            "place": np.array(table.at_mm) * MM,
            "width": table.width_mm * MM,
        }

    def reversal_widths(self) -> ReversalWidths:
        """The line's own along its axis; nothing depends on the joints' directions."""
        return ReversalWidths(np.full(6, np.inf), np.where(np.arange(3) == self.axis, self.width, np.inf))

    def with_widths(self, factor: Array) -> "AxisMap":
        """Unchanged: its width is the TCP's."""
        return self

    def distort(self, chain: Chain, state: State) -> Chain:
        """The chain with its TCP moved."""
        if is_zero(self.forward) and is_zero(self.reverse):
            return chain
        s = state.nominal.tcp_expr().position[self.axis]
        low, high = float(self.station[0]), float(self.station[-1])
        x = (ca.fmin(ca.fmax(s, low), high) - low) / (high - low)
        basis = basis_expr((self.station - low) / (high - low), x)
        forward, reverse = (v if isinstance(v, ca.SX) else ca.DM(v) for v in (self.forward, self.reverse))
        mean, half = (forward + reverse) / 2, (forward - reverse) / 2
        shift = mean.T @ basis
        if not is_zero(half):
            shift = shift + state.travel[self.axis] * (half.T @ basis)
        return chain.moved(shift)


def basis_expr(station: Array, x: Any) -> Any:
    """B_j(x), (S, 1)."""
    S = len(station)
    if S == 2:
        return ca.vertcat(1 - x, x)
    from scipy.interpolate import CubicSpline  # loaded by runs that need it

    pieces = CubicSpline(station, np.eye(S), bc_type="natural").c  # (4, S - 1, S), highest power first
    jump = np.diff(pieces[0], axis=0, prepend=0.0)  # what each knot adds to the cubic term
    powers = [ca.DM(pieces[p][0]) for p in (3, 2, 1)]
    value = powers[0] + powers[1] * x + powers[2] * x**2
    for knot, coefficients in zip(station[:-1], jump, strict=True):
        beyond = ca.fmax(x - float(knot), 0)
        value = value + ca.DM(coefficients) * (beyond * beyond * beyond)
    return value
