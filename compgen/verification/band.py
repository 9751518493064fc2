r"""The band of a position error along a program: what the files leave open, to first order.

With columns c_q(n) of quantities whose amounts have means m_q and standard deviations s_q,

    S(n) = lambda^2 (sum_q s_q^2 c_q c_q^T + m m^T + sum_i v_i(n) I),      m(n) = sum_q m_q c_q(n)

is the second moment about what the program uses, v_i the variances that have no direction (fit noise, what the thermal
physics misses, repeatability). Half-widths are 2 sqrt(d^T S d) along a direction d. How far the point is off at all in
95 of 100 cases is the radius r of

    |x|^2 ~ g chi^2_h,    g = tr S^2 / tr S,   h = (tr S)^2 / tr S^2        (Welch and Satterthwaite)

exact for an error along one line, and for one that is alike in all directions. Columns are taken at some waypoints,
and S is a straight line between them.

An error of which only its size is known: a smooth random field over the cell, for draws of whole paths.

What no quantity explains (fit noise, what the thermal physics misses) has a size at each waypoint and no direction. Two
waypoints side by side share it, two at either end of a part do not. Component i of a draw is

    z_i(p) = sqrt(2 / F) sum_f cos(w_if . p + b_if),     w_if ~ N(0, I / L^2),  b_if ~ U(0, 2 pi)

F random waves of a field of unit variance with E[z(p) z(q)] = exp(-|p - q|^2 / (2 L^2)) (Rahimi and Recht 2007).
L is assumed: half a metre, over which the cold error maps of arms of this size turn.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from scipy.special import gammaincinv

from compgen.core.arrays import Array, BoolArray, IntArray, interpolated, owns, rms
from compgen.core.evaluation import IndexedRows, evaluate
from compgen.error_model.rigid_share import rigid_share
from compgen.planning.toolpath import ToolPath
from compgen.verification.deviation import percentile99

COVERAGE = 2.0  # k
SHARE = 0.95
ONE_SIDED = "one-sided intervals"  # in the budget: how far those lie from what the program uses
ALONG = 1e-3  # sine of the angle to the axis, below which the path runs along it
_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
LENGTH = 0.5  # m, over which the field changes
WAVES = 64


@dataclass(frozen=True, slots=True)
class BudgetShare:
    """What one source adds to the band."""

    source: str
    largest: float  # [m] radius of 95 % along the part
    rms: float  # [m] of that radius along the part


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Columns:
    """What one unit of each of Q quantities does to the position error at M waypoints."""

    column: Array  # (M, 3, Q) [m] World
    mean: Array  # (Q,) of the amounts
    deviation: Array  # (Q,)
    source: tuple[str, ...]  # (Q,) of the budget
    undirected: Mapping[str, Array]  # standard deviation along any direction, of a source, (M,) [m]
    hidden: Array  # (M,) [m] most that a sensor's error moves the tool before anything contradicts it


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(rows=("M",), moment=("M", 6), radius=("M",))
class Band:
    """What a file leaves open along a program of N waypoints."""

    rows: IntArray  # (M,) waypoints at which it was evaluated, the first and the last among them
    moment: Array  # (M, 6) [m^2] xx, xy, xz, yy, yz, zz of S
    radius: Array  # (M,) [m] that the point stays within in 95 of 100 cases
    largest: float  # [m] radius on the part
    p99: float  # [m] what 99 % of the part's length stay at or below
    budget: tuple[BudgetShare, ...]  # the largest first
    hidden: float = 0.0  # [m] most on the part that a temperature sensor may add unseen; no part of the radius
    parted: "tuple[float, Band] | None" = None  # [m] where the part stands, and what is left once that is taught

    def world(self) -> Array:
        """k = 2 along World x, y, z where it was evaluated, (M, 3) [m]."""
        return np.asarray(COVERAGE * np.sqrt(np.maximum(self.moment[:, [0, 3, 5]], 0.0)))

    def half_widths(self, path: ToolPath, rows: slice = slice(None)) -> Array:
        """k = 2 at some waypoints: along World x, y, z, feed, cross and normal, (n, 6) [m]."""
        first, last, _ = rows.indices(len(path.arc))
        arc, number, place = path.arc[first:last], np.arange(first, last), path.target.position
        near = slice(max(np.searchsorted(self.rows, first) - 1, 0), np.searchsorted(self.rows, last) + 1)
        knots = path.arc[self.rows[near]]
        moment = interpolated(arc, knots, self.moment[near])
        before, after = np.maximum(number - 1, 0), np.minimum(number + 1, len(path.arc) - 1)
        (variances,) = evaluate(
            _build_variances(), IndexedRows(place, before), IndexedRows(place, after),
            path.target.rotation_rows[first:last], moment,
        )  # fmt: skip
        return np.asarray(COVERAGE * np.sqrt(np.maximum(variances, 0.0)))


@lru_cache(maxsize=1)
def _build_variances() -> Any:
    """(places before and after (3 each) [m], rotation (9, row by row), moment (6)) -> variances (6) [m^2].

    Along World x, y and z, and along feed, cross and normal as the deviation has them: cross = t x z, feed = z x cross,
    normal = -z, with the tool's axis z and the way t. Where the path runs along the axis, and where it turns back, feed
    is the tool's x.
    """
    before, after, rows, moment = (ca.SX.sym(name, k) for name, k in (("p", 3), ("q", 3), ("r", 9), ("s", 6)))
    rotation, way = ca.reshape(rows, 3, 3).T, after - before
    axis = rotation[:, 2]
    side = ca.cross(way, axis)
    along = ca.norm_2(side) <= ALONG * ca.norm_2(way)
    side = ca.if_else(along, ca.cross(rotation[:, 0], axis), side)
    length = ca.norm_2(side)
    side = side / ca.if_else(length > 0, length, 1.0)
    xx, xy, xz, yy, yz, zz = ca.vertsplit(moment)
    S = ca.blockcat([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    across = [ca.dot(d, S @ d) for d in (ca.cross(axis, side), side, -axis)]
    return ca.Function("variances", [before, after, rows, moment], [ca.cse(ca.vertcat(xx, yy, zz, *across))])


def band_of(columns: Iterable[Columns], rows: IntArray, weight: Array, scale: float = 1.0) -> Band:
    """The band of a program, and its budget.

    Args:
        columns: At some of its waypoints, some after some.
        rows: Which they are, (M,), rising.
        weight: Length of part that each stands for, (M,) [m]; all zero counts all alike.
        scale: lambda.
    """
    parts, hidden = zip(*((_moments(some), some.hidden) for some in columns), strict=True)
    moments = {source: np.concatenate([part[source] for part in parts]) * scale**2 for source in parts[0]}
    moment = sum(moments.values(), np.zeros((len(rows), 6)))
    on_part: BoolArray = weight > 0 if weight.any() else np.ones(len(rows), dtype=bool)
    lengths = weight[on_part] if weight.any() else np.ones(len(rows))
    radii = {source: radius_of(own)[on_part] for source, own in moments.items() if own.any()}
    shares = [BudgetShare(source, float(own.max()), rms(own, lengths)) for source, own in radii.items()]
    radius = radius_of(moment)
    touched = radius[on_part]
    largest, unseen = float(touched.max()), float(np.concatenate(hidden)[on_part].max())
    return Band(
        rows=rows,
        moment=moment,
        radius=radius,
        largest=largest,
        p99=percentile99(touched, lengths),
        budget=tuple(sorted(shares, key=lambda share: (-share.largest, share.source))),
        hidden=unseen,
    )


def parted_by_teaching(columns: Columns, place: Array, weight: Array, scale: float) -> tuple[float, Band]:
    """The largest radius of where the part stands, which teaching its frame would take up, and what would be left.

    Args:
        columns: At some places of the path.
        place: (M, 3) [m] World.
        weight: Length of part that each stands for, (M,) [m].
        scale: lambda.
    """
    share, rows = rigid_share(place), np.arange(len(place))
    left = share.left(columns.column, share.motion(columns.column), place)
    stands = replace(columns, column=columns.column - left, undirected={})
    rest = replace(columns, column=left)
    return band_of([stands], rows, weight, scale).largest, band_of([rest], rows, weight, scale)


def radius_of(moment: Array) -> Array:
    """The radius of 95 % of second moments (M, 6) [m^2], (M,) [m]."""
    xx, xy, xz, yy, yz, zz = moment.T
    trace = xx + yy + zz
    square = xx**2 + yy**2 + zz**2 + 2 * (xy**2 + xz**2 + yz**2)
    safe = np.where(trace > 0, trace, 1.0)
    freedom = np.clip(np.where(trace > 0, safe**2 / np.where(trace > 0, square, 1.0), 1.0), 1.0, 3.0)
    return np.asarray(np.sqrt(np.maximum(trace, 0.0) / freedom * np.interp(freedom, *quantiles())))


@lru_cache(maxsize=1)
def quantiles() -> tuple[Array, Array]:
    """Degrees of freedom from 1 to 3, and the quantile of chi^2 at 95 % for each; a line between them errs by 1e-6."""
    freedom = np.linspace(1.0, 3.0, 1001)
    return freedom, 2 * gammaincinv(freedom / 2, SHARE)


def directed_moment(columns: Columns) -> Array:
    """Second moment of the quantities alone about what the program uses, (M, 6) [m^2]."""
    offset = (columns.column @ columns.mean)[:, :, None]
    return squares(np.concatenate([columns.column * columns.deviation, offset], axis=2))


def _moments(columns: Columns) -> dict[str, Array]:
    """Second moment of each source alone about its mean, and of the means together, (M, 6) [m^2]."""
    sources = dict.fromkeys([*columns.source, *columns.undirected])
    moments = {source: _moment(columns, source) for source in sources}
    return {**moments, ONE_SIDED: squares((columns.column @ columns.mean)[:, :, None])}


def _moment(columns: Columns, source: str) -> Array:
    """Second moment of one source alone about its mean, (M, 6) [m^2]."""
    of_source = np.array([name == source for name in columns.source], dtype=bool)
    moment = squares(columns.column[:, :, of_source] * columns.deviation[of_source])
    if source in columns.undirected:
        moment[:, [0, 3, 5]] += columns.undirected[source][:, None] ** 2
    return moment


def squares(C: Array) -> Array:
    """C C^T of columns (M, 3, Q), (M, 6)."""
    return np.stack([np.einsum("mq,mq->m", C[:, i], C[:, j]) for i, j in _PAIRS], axis=1)


def field_correlation(one: Array, other: Array) -> Array:
    """E[z(p) z(q)] between places (M, 3) and (T, 3) [m], (M, T)."""
    square = ((one[:, None] - other[None]) ** 2).sum(axis=2)
    return np.asarray(np.exp(-square / (2 * LENGTH**2)))


def random_field(rng: np.random.Generator, position: Array) -> Array:
    """One draw of the field at places (M, 3) [m], (M, 3) of unit variance."""
    frequency = rng.standard_normal((3, WAVES, 3)) / LENGTH
    phase = rng.uniform(0, 2 * np.pi, (3, WAVES))
    sums = [np.cos(position @ w.T + b).sum(axis=1) for w, b in zip(frequency, phase, strict=True)]
    return np.asarray(np.column_stack(sums) * np.sqrt(2 / WAVES))
