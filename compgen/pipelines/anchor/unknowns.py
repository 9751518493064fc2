r"""What touches may tell of a robot, and what else is not known of it: columns of a place's position.

    x = (rises of K nodes [K], base shift [m] and turn [rad], growth of lengths, drifting numbers)

    H = (B, A_base, A_growth, A_drifting),   N = (A dp_q + B dr_q) s_q,   A = d p_actual / d p,  B = d p_actual / d rise

Everything else the robot file does not know (identified parameters together, sigmas of sources) stands in N with its
standard deviation. Where the robot itself taught a target in another state, what it then had wrong is in the target's
place: growth, drifting numbers and N count as what they do now less what they did then.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array
from compgen.core.pose import Pose
from compgen.core.units import MDEG, MM, UM
from compgen.error_model.direction_memory import DirectionState
from compgen.error_model.parameter_slopes import SourceParameters, build_slopes
from compgen.error_model.posterior import numbers_of
from compgen.error_model.quantities import Quantity
from compgen.job.anchored_start import base_rows, drifting_row
from compgen.job.job import Job
from compgen.job.uncertainty import quantities_of_cell
from compgen.pipelines.anchor.forecast import Forecast
from compgen.pipelines.anchor.hypotheses import Prior

BASE_SHIFT = 10 * UM  # standard deviation from day to day where the robot file says none [assumed]
MOVED_SHIFT, MOVED_TURN = 1 * MM, 50 * MDEG  # of a base that was hit [assumed]
OTHER_DAY = 0.05  # of the rises: what a day that went otherwise adds, all nodes alike [assumed]
LEAST_RADIUS = 0.2  # [m] of a part
GROWTH = ("cte", "profile shape")  # in the budget


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Unknowns:
    """The X numbers of x and the Q others, with what is known of x."""

    parameters: SourceParameters
    rows: tuple[int, ...]  # of the parameters in x
    named: tuple[str, ...]  # D growth and drifting numbers, as the robot file has them
    unit: Array  # (D,) [SI] of what their names say
    others: tuple[Quantity, ...]
    other_rise: Array  # (Q, K) [K] that one unit of each adds
    prior: Prior

    def columns(
        self, forecast: Forecast, theta: Array, rise: Array, motion: DirectionState, tool: Pose, *, then: bool = False
    ) -> tuple[Array, Array]:
        """H (M, 3, X) and N (M, 3, Q) at M poses of a tool; ``then``: of another time, whose rises are known."""
        changes = np.array([q.cause.parameters for q in self.others]).reshape(-1, len(self.parameters.entries))
        of_others = np.flatnonzero(changes.any(axis=0)).tolist()
        which = tuple(dict.fromkeys([*self.rows, *of_others]))
        cell = forecast.cell
        slopes = build_slopes(cell.robot, self.parameters, which, len(cell.heat.names), tool)
        A, B, _ = slopes(theta, rise, motion)
        H = np.concatenate([B, A[:, :, [which.index(r) for r in self.rows]]], axis=2)
        deviation = np.array([np.hypot(q.deviation, q.mean) for q in self.others])
        N = A @ changes[:, which].T
        if not then:
            N = N + np.einsum("mik,qk->miq", B, self.other_rise)
        return H, N * deviation


def unknowns_of(job: Job, forecast: Forecast, middle: Array, radius: float, missed: float) -> Unknowns:
    """What touches of a job's robot may tell.

    Args:
        job: Its quantities.
        forecast: Of the robot now.
        middle: Of the part, World, (3,) [m].
        radius: Of the part [m].
        missed: What the thermal physics leaves out there [m].

    Raises:
        InputError: The robot file marks a number as drifting that it does not have.
    """
    cell = forecast.cell
    known = quantities_of_cell(cell)
    parameters, K = known.parameters, len(cell.heat.names)
    base = base_rows(parameters)
    thermal, growth, others = [], [], []
    for q in known.quantities:
        if not q.cause.parameters.any():
            thermal.append(q)
        elif q.source in GROWTH or set(np.flatnonzero(q.cause.parameters).tolist()) <= set(base):
            growth.append(q)
        else:
            others.append(q)
    grown = sorted({int(n) for q in growth for n in np.flatnonzero(q.cause.parameters) if n not in base})
    names = {_place(parameters, n): n for n in grown}
    named, units = [], []
    for name, (parameter, _) in numbers_of(cell.known).items():
        if (parameter.table, parameter.field, parameter.index) in names:
            named.append(name)
            units.append(parameter.unit)
    rows = [drifting_row(cell, parameters, name, "growth")[0] for name in named]
    drift_sigma = []
    for name, sigma in zip(job.cell.drifting.numbers, job.cell.drifting.sigma, strict=True):
        row, unit = drifting_row(cell, parameters, name, f"{cell.robot_file}: anchor.drifting")
        if row not in rows:
            rows.append(row)
            named.append(name)
            units.append(unit)
        drift_sigma.append((rows.index(row), sigma * unit))
    D, X = len(rows), K + 6 + len(rows)
    all_rows = [*base, *rows]
    P = np.zeros((X, X))
    day = np.zeros((X, X))
    for q in thermal:
        r = forecast.added_rise(q, job.feed)
        P[:K, :K] += (q.deviation**2 + q.mean**2) * np.outer(r, r)
    P[:K, :K] += np.diag(forecast.own**2)
    day[:K, :K] = P[:K, :K] + OTHER_DAY**2 * np.outer(forecast.rise, forecast.rise)
    for q in growth:
        v = np.concatenate([forecast.added_rise(q, job.feed), q.cause.parameters[all_rows]])
        P += (q.deviation**2 + q.mean**2) * np.outer(v, v)
    for k, sigma in drift_sigma:
        P[K + 6 + k, K + 6 + k] += sigma**2
    if cell.state is None:
        P[K : K + 6, K : K + 6] += _base_prior(job, middle, radius, missed)
    shifted, turned = np.zeros((2, X, X))
    shifted[K : K + 6, K : K + 6] = _about(middle, np.full(3, MOVED_SHIFT), np.zeros(3))
    turned[K : K + 6, K : K + 6] = _about(middle, np.full(3, MOVED_SHIFT), np.full(3, MOVED_TURN))
    other_rise = np.array([forecast.added_rise(q, job.feed) for q in others]).reshape(-1, K)
    prior = Prior(P, day, shifted, turned)
    return Unknowns(
        parameters=parameters,
        rows=tuple(all_rows),
        named=tuple(named),
        unit=np.array(units[:D]),
        others=tuple(others),
        other_rise=other_rise,
        prior=prior,
    )


def _place(parameters: SourceParameters, n: int) -> tuple[str, str, tuple[int, ...]]:
    entry = parameters.entries[n]
    return parameters.sources[entry.source].NAME, entry.field, entry.index


def _base_prior(job: Job, middle: Array, radius: float, missed: float) -> Array:
    """Of the base's shift and turn, (6, 6): as the robot file says, else what moves the part by so much."""
    drifting = job.cell.drifting
    usual = float(np.hypot(BASE_SHIFT, missed))
    if drifting.shift is None and drifting.turn is None:
        return _about(middle, np.full(3, usual), np.full(3, usual / max(radius, LEAST_RADIUS)))
    shift = np.full(3, usual) if drifting.shift is None else drifting.shift
    turn = np.full(3, usual / max(radius, LEAST_RADIUS)) if drifting.turn is None else drifting.turn
    return np.diag(np.concatenate([shift, turn]) ** 2)


def _about(middle: Array, shift: Array, turn: Array) -> Array:
    """Covariance of the base's shift and turn, where a point c shifts by d and all turns by w: base = d - w x c."""
    x, y, z = middle.tolist()
    J = np.eye(6)
    J[:3, 3:] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]  # -w x c = c x w
    return np.asarray(J @ np.diag(np.concatenate([shift, turn]) ** 2) @ J.T)
