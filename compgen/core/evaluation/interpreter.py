"""An SX function as a list of instructions, and numpy running it over blocks of rows."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.evaluation.lifetime import kept_with

BLOCK = 4096  # rows at a time: the work arrays stay in cache


@dataclass(frozen=True, eq=False, slots=True)
class IndexedRows:
    """Rows of a table, picked without a copy: row n is ``table[index[n]]``."""

    table: Array  # (T, k)
    index: IntArray  # (N,)

    def __len__(self) -> int:
        return len(self.index)


Rows = Array | IndexedRows


@dataclass(frozen=True, eq=False, slots=True)
class Instructions:
    """What a function does, in order."""

    steps: tuple[tuple[int, Any, Any], ...]  # operation, inputs, target
    output_sizes: tuple[int, ...]  # entries of each output
    work_size: int  # work variables


@kept_with("function")
def instructions_of(function: Any) -> Instructions:
    """The instruction list as Python tuples."""
    steps: list[tuple[int, Any, Any]] = []
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        inputs, target = function.instruction_input(k), function.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            steps.append((operation, inputs[0], (target[0], target[1])))
        elif operation == ca.OP_CONST:
            steps.append((operation, function.instruction_constant(k), target[0]))
        else:
            steps.append((operation, tuple(inputs), target[0]))
    return Instructions(tuple(steps), tuple(function.numel_out(k) for k in range(function.n_out())), function.sz_w())


def run_instructions(
    instructions: Instructions, rows: Sequence[Rows], outputs: Sequence[Array], start: int, stop: int
) -> None:
    """Fill rows start to stop of the outputs, (N, entries) each, from rows as ``evaluate`` takes them."""
    work: list[Any] = [None] * instructions.work_size
    with np.errstate(all="ignore"):  # as the compiled function does: NaN and infinity pass through
        for first in range(start, stop, BLOCK):
            last = min(first + BLOCK, stop)
            columns = [_columns(r, first, last) for r in rows]
            for operation, inputs, target in instructions.steps:
                operate = OPERATIONS.get(operation)
                if operate is not None and len(inputs) == 2:  # what comes most often first: few rows take no longer
                    work[target] = operate(work[inputs[0]], work[inputs[1]])
                elif operate is not None:
                    work[target] = operate(work[inputs[0]])
                elif operation == ca.OP_INPUT:
                    work[target] = columns[inputs[0]][inputs[1]]
                elif operation == ca.OP_OUTPUT:
                    outputs[target[0]][first:last, target[1]] = work[inputs]
                elif operation == ca.OP_CONST:
                    work[target] = inputs
                else:
                    raise KeyError(operation)


def _columns(rows: Rows, first: int, last: int) -> Array:
    """Rows first to last as contiguous columns, (k, last - first); (k, 1) of a single row."""
    if isinstance(rows, IndexedRows):
        return np.ascontiguousarray(rows.table[rows.index[first:last]].T)
    return rows.T if len(rows) == 1 else np.ascontiguousarray(rows[first:last].T)


OPERATIONS: dict[int, Callable[..., Any]] = {
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
    ca.OP_TAN: np.tan,
    ca.OP_ASIN: np.arcsin,
    ca.OP_ACOS: np.arccos,
    ca.OP_ATAN: np.arctan,
    ca.OP_ATAN2: np.arctan2,
    ca.OP_HYPOT: np.hypot,
    ca.OP_TANH: np.tanh,
    ca.OP_INV: lambda x: 1 / x,
    ca.OP_FABS: np.abs,
    ca.OP_SIGN: np.sign,
    ca.OP_COPYSIGN: np.copysign,
    ca.OP_FLOOR: np.floor,
    ca.OP_CEIL: np.ceil,
    ca.OP_FMIN: np.fmin,
    ca.OP_FMAX: np.fmax,
    ca.OP_EXP: np.exp,
    ca.OP_EXPM1: np.expm1,
    ca.OP_LOG: np.log,
    ca.OP_LOG1P: np.log1p,
    ca.OP_POW: np.power,
    ca.OP_CONSTPOW: np.power,
    ca.OP_LT: lambda a, b: np.less(a, b) * 1.0,
    ca.OP_LE: lambda a, b: np.less_equal(a, b) * 1.0,
    ca.OP_EQ: lambda a, b: np.equal(a, b) * 1.0,
    ca.OP_NE: lambda a, b: np.not_equal(a, b) * 1.0,
    ca.OP_NOT: lambda a: np.equal(a, 0) * 1.0,
    ca.OP_AND: lambda a, b: np.logical_and(a, b) * 1.0,
    ca.OP_OR: lambda a, b: np.logical_or(a, b) * 1.0,
    ca.OP_IF_ELSE_ZERO: lambda a, b: np.where(a, b, 0.0),
}
