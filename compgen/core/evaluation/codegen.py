"""An SX function as C: several rows at once in the lanes of the processor's vector registers.

Every row is computed by the same instructions whatever its neighbours are, so the numbers do not depend on how rows are
shared out. A processor or a C library without vector functions gets loops over the lanes.
"""

import re
from functools import lru_cache
from pathlib import Path
from typing import Any

import casadi as ca

from compgen.core.evaluation.interpreter import Instructions

FUNCTION_NAME = "rows"  # that the library exports

_HEAD = """#include <math.h>
#if defined(__AVX512F__)
#define LANES 8
#define VECTOR(f) _ZGVeN8##f
#elif defined(__AVX2__)
#define LANES 4
#define VECTOR(f) _ZGVdN4##f
#else
#define LANES 2
#define VECTOR(f) _ZGVbN2##f
#endif
typedef double v __attribute__((vector_size(8 * LANES)));
typedef long long w __attribute__((vector_size(8 * LANES)));
#if LANES == 8
#define EACH(e) {e(0), e(1), e(2), e(3), e(4), e(5), e(6), e(7)}
#elif LANES == 4
#define EACH(e) {e(0), e(1), e(2), e(3)}
#else
#define EACH(e) {e(0), e(1)}
#endif
static inline v all(double x) {
#define E(k) x
  v r = EACH(E); return r;
#undef E
}
static inline __attribute__((always_inline)) v load(const double *p, const long long *at) {
#define E(k) p[at[k]]
  v r = EACH(E); return r;
#undef E
}
#define LOOP1(name, f) static inline v name(v a) { v r; for (int k = 0; k < LANES; k++) r[k] = f(a[k]); return r; }
#define LOOP2(name, f) static inline v name(v a, v b) \\
  { v r; for (int k = 0; k < LANES; k++) r[k] = f(a[k], b[k]); return r; }
#define EVERY_LANE _Pragma("GCC unroll 8") for (int k = 0; k < LANES; k++)
#if defined(__x86_64__) && defined(__GLIBC__)
#if __GLIBC_PREREQ(2, 35)
#define HAS_VECTOR 1
#endif
#endif
#ifdef HAS_VECTOR
#define FAR1(name, f) extern v VECTOR(v_##f)(v); static inline v name(v a) { return VECTOR(v_##f)(a); }
#define FAR2(name, f) extern v VECTOR(vv_##f)(v, v); static inline v name(v a, v b) { return VECTOR(vv_##f)(a, b); }
#else
#define FAR1(name, f) LOOP1(name, f)
#define FAR2(name, f) LOOP2(name, f)
#endif
static inline v pick(w c, v a, v b) { return (v)((c & (w)a) | (~c & (w)b)); }
#define FIRST(name, op) static inline v name(v a, v b) { return pick((w)(a op b) | (w)(b != b), a, b); }
#define TRUTH(name, op) static inline v name(v a, v b) { return (v)((w)(a op b) & (w)all(1.0)); }
"""

#: operation to (C, helper line or nothing); {0} and {1} are its inputs
C_OPERATIONS: dict[int, tuple[str, str]] = {
    ca.OP_ASSIGN: ("{0}", ""),
    ca.OP_ADD: ("{0} + {1}", ""),
    ca.OP_SUB: ("{0} - {1}", ""),
    ca.OP_MUL: ("{0} * {1}", ""),
    ca.OP_DIV: ("{0} / {1}", ""),
    ca.OP_NEG: ("-{0}", ""),
    ca.OP_SQ: ("{0} * {0}", ""),
    ca.OP_TWICE: ("{0} + {0}", ""),
    ca.OP_INV: ("all(1.0) / {0}", ""),
    ca.OP_SQRT: ("v_sqrt({0})", "LOOP1(v_sqrt, __builtin_sqrt)"),
    ca.OP_SIN: ("v_sin({0})", "FAR1(v_sin, sin)"),
    ca.OP_COS: ("v_cos({0})", "FAR1(v_cos, cos)"),
    ca.OP_TAN: ("v_tan({0})", "FAR1(v_tan, tan)"),
    ca.OP_ASIN: ("v_asin({0})", "FAR1(v_asin, asin)"),
    ca.OP_ACOS: ("v_acos({0})", "FAR1(v_acos, acos)"),
    ca.OP_ATAN: ("v_atan({0})", "FAR1(v_atan, atan)"),
    ca.OP_ATAN2: ("v_atan2({0}, {1})", "FAR2(v_atan2, atan2)"),
    ca.OP_HYPOT: ("v_hypot({0}, {1})", "FAR2(v_hypot, hypot)"),
    ca.OP_TANH: ("v_tanh({0})", "FAR1(v_tanh, tanh)"),
    ca.OP_EXP: ("v_exp({0})", "FAR1(v_exp, exp)"),
    ca.OP_EXPM1: ("v_expm1({0})", "FAR1(v_expm1, expm1)"),
    ca.OP_LOG: ("v_log({0})", "FAR1(v_log, log)"),
    ca.OP_LOG1P: ("v_log1p({0})", "FAR1(v_log1p, log1p)"),
    ca.OP_POW: ("v_pow({0}, {1})", "FAR2(v_pow, pow)"),
    ca.OP_CONSTPOW: ("v_pow({0}, {1})", "FAR2(v_pow, pow)"),
    ca.OP_FABS: ("v_fabs({0})", "LOOP1(v_fabs, __builtin_fabs)"),
    ca.OP_FLOOR: ("v_floor({0})", "LOOP1(v_floor, __builtin_floor)"),
    ca.OP_CEIL: ("v_ceil({0})", "LOOP1(v_ceil, __builtin_ceil)"),
    ca.OP_COPYSIGN: ("v_copysign({0}, {1})", "LOOP2(v_copysign, __builtin_copysign)"),
    ca.OP_SIGN: (
        "v_sign({0})",
        "static inline v v_sign(v a) { return pick(a != a, a, (v)((w)(a > 0) & (w)all(1.0)) - "
        "(v)((w)(a < 0) & (w)all(1.0))); }",
    ),
    ca.OP_FMIN: ("v_fmin({0}, {1})", "FIRST(v_fmin, <=)"),
    ca.OP_FMAX: ("v_fmax({0}, {1})", "FIRST(v_fmax, >=)"),
    ca.OP_LT: ("v_lt({0}, {1})", "TRUTH(v_lt, <)"),
    ca.OP_LE: ("v_le({0}, {1})", "TRUTH(v_le, <=)"),
    ca.OP_EQ: ("v_eq({0}, {1})", "TRUTH(v_eq, ==)"),
    ca.OP_NE: ("v_ne({0}, {1})", "TRUTH(v_ne, !=)"),
    ca.OP_NOT: ("v_eq({0}, all(0.0))", "TRUTH(v_eq, ==)"),
    ca.OP_AND: ("(v)((w)({0} != 0) & (w)({1} != 0) & (w)all(1.0))", ""),
    ca.OP_OR: ("(v)(((w)({0} != 0) | (w)({1} != 0)) & (w)all(1.0))", ""),
    ca.OP_IF_ELSE_ZERO: ("pick({0} != 0, {1}, all(0.0))", ""),
}


def identity(function: Any) -> str:
    """All that decides the C of a function: its own text and this package's; a hundred times faster than the C."""
    return f"{_generator_text()}\0{function.serialize()}"


@lru_cache(maxsize=1)
def _generator_text() -> str:
    return "\0".join(Path(__file__).with_name(f"{name}.py").read_text() for name in ("codegen", "interpreter"))


def c_source(instructions: Instructions) -> str | None:
    """The C of a function, or None where an operation has none.

    It exports ``rows(start, stop, in, index, stride, out)``: point n reads input i at row ``index[i][n]``, or n where
    there is no index, ``stride[i]`` entries after the row before (0: one row for all), and writes row n of each output.
    """
    helpers: dict[str, None] = {}
    body: list[str] = []
    used_inputs: dict[int, None] = {}
    for operation, inputs, target in instructions.steps:
        if operation == ca.OP_INPUT:
            used_inputs[inputs[0]] = None
            body.append(f"v w{target} = load(in[{inputs[0]}] + {inputs[1]}, at{inputs[0]});")
        elif operation == ca.OP_OUTPUT:
            size = instructions.output_sizes[target[0]]
            body.append(f"EVERY_LANE out[{target[0]}][{size} * at[k] + {target[1]}] = w{inputs}[k];")
        elif operation == ca.OP_CONST:
            body.append(f"v w{target} = all({_literal(float(inputs))});")
        elif operation in C_OPERATIONS:
            expression, helper = C_OPERATIONS[operation]
            helpers[helper] = None
            body.append(f"v w{target} = {expression.format(*(f'w{i}' for i in inputs))};")
        else:
            return None
    declarations = [f"long long at{i}[LANES];" for i in used_inputs]
    offsets = [f"at{i}[k] = (index[{i}] ? index[{i}][at[k]] : at[k]) * stride[{i}];" for i in used_inputs]
    return "\n".join(
        [
            _HEAD,
            *filter(None, helpers),
            f"void {FUNCTION_NAME}(long long start, long long stop, const double *const *in,",
            "    const long long *const *index, const long long *stride, double *const *out) {",
            "  for (long long row = start; row < stop; row += LANES) {",
            "  long long at[LANES];",
            *declarations,
            "  EVERY_LANE {",
            "    at[k] = row + k < stop ? row + k : stop - 1;",  # the last rows are computed twice, and are the same
            *offsets,
            "  }",
            *_single_assignment(body),
            "  }",
            "}",
            "",
        ]
    )


def _single_assignment(body: list[str]) -> list[str]:
    """Every assignment to a variable of its own: CasADi uses its work variables again and again."""
    version: dict[str, int] = {}
    lines = []
    for line in body:
        target = line.split(" ")[1] if line.startswith("v ") else ""
        expression = line.partition(" = ")[2] if target else line
        expression = _WORK_VARIABLE.sub(lambda m: f"{m[0]}_{version[m[0]]}", expression)
        if target:
            version[target] = version.get(target, -1) + 1
            lines.append(f"  const v {target}_{version[target]} = {expression}")
        else:
            lines.append(f"  {expression}")
    return lines


def _literal(value: float) -> str:
    """A number in C, exactly."""
    if value != value:
        return "NAN"
    if abs(value) == float("inf"):
        return "INFINITY" if value > 0 else "-INFINITY"
    return value.hex()


_WORK_VARIABLE = re.compile(r"\bw\d+\b")
