r"""The symbolic chain, and the one bridge from CasADi to numpy.

A chain is six DH rows with symbols in them; an error source takes a chain and gives a chain. Its pose is

    T = base  prod_i  Rz(theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i)  tool

Numbers cross by ``evaluate``: rows in, rows out. It runs the instruction list of the SX function over blocks of rows
with numpy, about 2 us a row for a whole error model, with no Python call and no ``DM`` per waypoint.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from compgen.arrays import Array
from compgen.robot import Robot

BLOCK = 4096  # rows at a time: the work arrays stay in cache


@dataclass(frozen=True, eq=False, slots=True)
class Chain:
    """DH rows as CasADi expressions; ``theta`` holds the joint variables."""

    theta: tuple[Any, ...]  # 6 [rad]
    d: tuple[Any, ...]  # 6 [m]
    a: tuple[Any, ...]  # 6 [m]
    alpha: tuple[Any, ...]  # 6 [rad]

    def pose_expr(self) -> tuple[Any, Any]:
        """Flange position (3, 1) and rotation (3, 3)."""
        position, rotation = ca.SX.zeros(3), ca.SX.eye(3)
        for theta, d, a, alpha in zip(self.theta, self.d, self.a, self.alpha):
            c, s, ca_, sa = ca.cos(theta), ca.sin(theta), _cos(alpha), _sin(alpha)
            position = position + rotation @ ca.vertcat(a * c, a * s, d)
            rotation = rotation @ ca.vertcat(
                ca.horzcat(c, -s * ca_, s * sa), ca.horzcat(s, c * ca_, -c * sa), ca.horzcat(0, sa, ca_)
            )
        return position, rotation


def nominal_chain(robot: Robot, theta: Any) -> Chain:
    """The chain the controller believes in."""
    six = range(6)
    return Chain(
        tuple(theta[i] for i in six),
        tuple(float(robot.d[i]) for i in six),
        tuple(float(robot.a[i]) for i in six),
        tuple(float(robot.alpha[i]) for i in six),
    )


def with_tool_expr(pose: tuple[Any, Any], tool_position: Array, tool_rotation: Array) -> tuple[Any, Any]:
    """TCP position and rotation of a flange pose."""
    position, rotation = pose
    return position + rotation @ ca.DM(tool_position), rotation @ ca.DM(tool_rotation)


def evaluate(function: Any, *rows: Array) -> tuple[Array, ...]:
    """A CasADi SX function on many points at once.

    Args:
        function: Each input a column vector (k, 1), each output dense.
        rows: One array per input, (N, k); a single row (1, k) serves all points.

    Returns:
        One array per output, (N, entries in column-major order).
    """
    N = max(len(r) for r in rows)
    program = _instructions(function)
    outs = [np.zeros((N, function.numel_out(k))) for k in range(function.n_out())]
    for start in range(0, N, BLOCK):
        stop = min(start + BLOCK, N)
        ins = [(r if len(r) == 1 else r[start:stop]).T for r in rows]
        work: list[Any] = [None] * function.sz_w()
        for code, inputs, target in program:
            if code == ca.OP_INPUT:
                work[target] = ins[inputs[0]][inputs[1]]
            elif code == ca.OP_OUTPUT:
                outs[target[0]][start:stop, target[1]] = work[inputs]
            elif code == ca.OP_CONST:
                work[target] = inputs
            else:
                work[target] = _OPERATIONS[code](*(work[i] for i in inputs))
    return tuple(outs)


_PROGRAMS: dict[int, tuple[Any, list[Any]]] = {}


def _instructions(function: Any) -> list[Any]:
    """The instruction list as Python tuples, kept beside the function it belongs to."""
    key = function.__hash__()
    if key in _PROGRAMS:
        return _PROGRAMS[key][1]
    program: list[Any] = []
    for k in range(function.n_instructions()):
        code, i, o = function.instruction_id(k), function.instruction_input(k), function.instruction_output(k)
        if code == ca.OP_OUTPUT:
            program.append((code, i[0], (o[0], o[1])))
        elif code == ca.OP_CONST:
            program.append((code, function.instruction_constant(k), o[0]))
        else:
            program.append((code, tuple(i), o[0]))
    _PROGRAMS[key] = (function, program)
    return program


_OPERATIONS: dict[int, Callable[..., Any]] = {
    ca.OP_ASSIGN: lambda x: x,
    ca.OP_ADD: np.add,
    ca.OP_SUB: np.subtract,
    ca.OP_MUL: np.multiply,
    ca.OP_DIV: np.divide,
    ca.OP_NEG: np.negative,
    ca.OP_SQ: np.square,
    ca.OP_TWICE: lambda x: x + x,
    ca.OP_SQRT: np.sqrt,
    ca.OP_SIN: np.sin,
    ca.OP_COS: np.cos,
    ca.OP_ATAN2: np.arctan2,
    ca.OP_INV: lambda x: 1 / x,
    ca.OP_FABS: np.abs,
    ca.OP_EXP: np.exp,
    ca.OP_POW: np.power,
    ca.OP_CONSTPOW: np.power,
}


def _cos(angle: Any) -> Any:
    return _exact(np.cos(angle)) if isinstance(angle, float) else ca.cos(angle)


def _sin(angle: Any) -> Any:
    return _exact(np.sin(angle)) if isinstance(angle, float) else ca.sin(angle)


def _exact(value: float) -> float:
    """Right angles give 0 and 1 exactly, so their products vanish from the graph."""
    return float(round(value)) if abs(value - round(value)) < 1e-15 else float(value)
