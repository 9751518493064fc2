r"""What touches may tell of a robot, and what else is not known of it: columns of a place's position.

    x = (rises of K nodes [K], base shift [m] and turn [rad], growth of lengths, drifting numbers)

    H = (B, A_base, A_growth, A_drifting),   N = (A dp_q + B dr_q) s_q,   A = d p_actual / d p,  B = d p_actual / d rise

Everything else the robot file does not know (identified parameters together, sigmas of sources) stands in N with its
standard deviation, times the scale that the identification's own forecasts ask for. Where the robot itself taught a
target in another state, what it then had wrong is in the target's place: growth, drifting numbers and N count as what
they do now less what they did then.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array
from compgen.core.pose import Pose
from compgen.core.rotations import cross_matrix
from compgen.core.units import MDEG, MM, UM
from compgen.error_model.direction_memory import DirectionState
from compgen.error_model.parameter_slopes import SourceParameters, build_slopes
from compgen.error_model.posterior import known_numbers
from compgen.error_model.rigid_share import rigid_share
from compgen.error_model.source import Expanding
from compgen.error_model.uncertain_sources import Quantity
from compgen.job.anchored_start import base_rows, drifting_row, drifting_rows
from compgen.job.job import Cell, Job
from compgen.job.uncertainty import quantities_of_cell
from compgen.pipelines.anchor.forecast import Forecast
from compgen.pipelines.anchor.hypotheses import TouchPrior

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
    prior: TouchPrior

    def columns(
        self,
        forecast: Forecast,
        theta: Array,
        tool: Pose,
        rise: Array | None = None,
        motion: DirectionState | None = None,
        *,
        then: bool = False,
    ) -> tuple[Array, Array, Array]:
        """H (M, 3, X), N (M, 3, Q) and D (M, 3, 6), of each joint's play run through, at M poses of a tool.

        Args:
            forecast: Of the robot now.
            theta: Joints (M, 6) [rad].
            tool: TCP in the flange.
            rise: (M, K) [K]; None: those of the forecast.
            motion: That each joint came with; None: it is not known.
            then: Whether the rises are of another time, and known.
        """
        M = len(theta)
        rise = np.broadcast_to(forecast.rise, (M, len(forecast.rise))) if rise is None else rise
        motion = DirectionState(np.zeros((M, 6)), np.zeros((M, 3))) if motion is None else motion
        changes = np.array([q.cause.parameters for q in self.others]).reshape(-1, len(self.parameters.entries))
        of_others = np.flatnonzero(changes.any(axis=0)).tolist()
        which = tuple(dict.fromkeys([*self.rows, *of_others]))
        A, B, D = build_slopes(forecast.cell.robot, self.parameters, which, rise.shape[1], tool)(theta, rise, motion)
        H = np.concatenate([B, A[:, :, [which.index(r) for r in self.rows]]], axis=2)
        deviation = forecast.cell.fit.scale * np.array([np.hypot(q.deviation, q.mean) for q in self.others])
        N = A @ changes[:, which].T
        return H, deviation * (N if then else N + np.einsum("mik,qk->miq", B, self.other_rise)), D

    def columns_of_touches(
        self, forecast: Forecast, theta: Array, probe: Pose, rise: Array, motion: DirectionState, taught: Array | None
    ) -> tuple[Array, Array, Array]:
        """H, N, and D of the joints whose play has no known sense, of touches.

        Of targets that the robot taught, with rises (K,) [K], less what they were then; play was the same.
        """
        H, N, D = self.columns(forecast, theta, probe, rise, motion)
        if taught is None:
            return H, N, D * (motion.direction == 0)[:, None]
        H_then, N_then, _ = self.columns(forecast, theta, probe, np.broadcast_to(taught, rise.shape), motion, then=True)
        grown = slice(
            rise.shape[1] + 6, H.shape[2] - len(forecast.cell.drifting.numbers)
        )  # what drifts has drifted since
        H = H.copy()
        H[:, :, grown] -= H_then[:, :, grown]
        return H, N - N_then, 0 * D


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
    parameters, base = known.parameters, base_rows(known.parameters)
    moves = {id(q): set(np.flatnonzero(q.cause.parameters).tolist()) for q in known.quantities}
    of_state = {*base, *drifting_rows(cell, parameters)}  # that an earlier state knows, together with its rises
    alone = of_state, _unmeasured_growth(cell, parameters)
    growth = [
        q for q in known.quantities if (m := moves[id(q)]) and (q.source in GROWTH or any(m <= rows for rows in alone))
    ]
    thermal = [q for q in known.quantities if not moves[id(q)]]
    others = [q for q in known.quantities if q not in [*growth, *thermal]]
    named = _named(cell, parameters, of_state.union(*(moves[id(q)] for q in growth)) - set(base))
    rows = (*base, *(row for row, _ in named.values()))
    other_rise = np.array([forecast.added_rise(q) for q in others]).reshape(-1, len(forecast.rise))
    return Unknowns(
        parameters=parameters,
        rows=rows,
        named=tuple(named),
        unit=np.array([unit for _, unit in named.values()]),
        others=tuple(others),
        other_rise=other_rise,
        prior=_prior(job, forecast, thermal, growth, rows, _base_prior(job, middle, radius, missed), middle),
    )


def _unmeasured_growth(cell: Cell, parameters: SourceParameters) -> set[int]:
    """Rows of lengths' expansions of which the robot file says nothing, so that their priors count."""
    measured = {known.source.NAME for known in cell.known if known.sigma}
    return {
        parameters.at(k, entry.field, entry.index)
        for k, source in enumerate(parameters.sources)
        if isinstance(source, Expanding) and source.NAME not in measured
        for entry in source.expansions().values()
    }


def _named(cell: Cell, parameters: SourceParameters, grown: set[int]) -> dict[str, tuple[int, float]]:
    """Row and unit of each number that a state names: what grows, then what drifts."""
    places = {_place(parameters, n) for n in grown}
    of_place = {(p.table, p.field, p.index): name for name, (p, _) in known_numbers(cell.known).items()}
    growing = [name for place, name in of_place.items() if place in places and name not in cell.drifting.numbers]
    where = f"{cell.robot_file}: anchor.drifting"
    return {name: drifting_row(cell, parameters, name, where) for name in (*growing, *cell.drifting.numbers)}


def _prior(
    job: Job,
    forecast: Forecast,
    thermal: Sequence[Quantity],
    growth: Sequence[Quantity],
    rows: Sequence[int],
    base: Array,
    middle: Array,
) -> TouchPrior:
    """What is known of x beforehand, and by how much more a day that went otherwise, or a base that was hit, moves it.

    Args:
        job: Its robot, and what drifts of it.
        forecast: Of the robot now.
        thermal: Quantities that move rises alone.
        growth: Those that move rises and growth.
        rows: Of the parameters in x, those of the base first.
        base: Covariance of its shift and turn, (6, 6).
        middle: Of the part, World, (3,) [m].
    """
    cell, K, X = forecast.cell, len(forecast.rise), len(forecast.rise) + len(rows)

    def known_to(quantities: Sequence[Quantity]) -> Array:
        columns = [
            np.hypot(q.deviation, q.mean) * np.append(forecast.added_rise(q), q.cause.parameters[list(rows)])
            for q in quantities
        ]
        F = np.array(columns).reshape(-1, X)
        return np.asarray(F.T @ F)

    warm = known_to(thermal) + np.diag(np.append(forecast.own**2, np.zeros(len(rows))))
    rise = np.append(forecast.rise, np.zeros(len(rows)))
    P = warm + known_to(growth)
    for name, sigma in zip(cell.drifting.numbers, cell.drifting.sigma, strict=True):
        if cell.state is not None and name in cell.state.drifting:
            continue  # how well that is known the state says
        row, unit = drifting_row(cell, quantities_of_cell(cell).parameters, name, f"{cell.robot_file}: anchor.drifting")
        P[K + rows.index(row), K + rows.index(row)] += (sigma * unit) ** 2
    shifted, turned, of_base = *np.zeros((2, X, X)), np.s_[K : K + 6, K : K + 6]
    if cell.state is None:
        P[of_base] += base
    shifted[of_base] = _about(middle, _diagonal(MOVED_SHIFT, 0.0))
    turned[of_base] = _about(middle, _diagonal(MOVED_SHIFT, MOVED_TURN))
    return TouchPrior(P, warm + OTHER_DAY**2 * np.outer(rise, rise), shifted, turned)


def _place(parameters: SourceParameters, n: int) -> tuple[str, str, tuple[int, ...]]:
    entry = parameters.entries[n]
    return parameters.sources[entry.source].NAME, entry.field, entry.index


def _base_prior(job: Job, middle: Array, radius: float, missed: float) -> Array:
    """Of the base's shift and turn, (6, 6): as the robot file says, else what moves the part by so much."""
    drifting = job.cell.drifting
    usual = float(np.hypot(BASE_SHIFT, missed))
    if drifting.shift is None and drifting.turn is None:
        return _about(middle, _diagonal(usual, usual / max(radius, LEAST_RADIUS)))
    shift = np.full(3, usual) if drifting.shift is None else drifting.shift
    turn = np.full(3, usual / max(radius, LEAST_RADIUS)) if drifting.turn is None else drifting.turn
    return np.diag(np.concatenate([shift, turn]) ** 2)


def with_open_world(unknowns: Unknowns, N: Array, place: Array) -> Unknowns:
    """The unknowns of an identified robot whose targets stand where an instrument says: its World is open as well.

    An instrument that measures an arm sees no World: where it is follows from the parameters alone. What no source
    has of the true arm moves it by as much again as the parameters may [assumed], and this the base carries.

    Args:
        unknowns: As a robot knows them that was anchored to its World.
        N: Of M places along the path, (M, 3, Q) [m].
        place: Where these are, World (M, 3) [m].
    """
    share, prior = rigid_share(place), unknowns.prior
    motion, P, K = share.motion(N), prior.forecast.copy(), len(prior.forecast) - len(unknowns.rows)
    P[K : K + 6, K : K + 6] += _about(share.middle, motion @ motion.T)
    return replace(unknowns, prior=replace(prior, forecast=P))


def _diagonal(shift: float, turn: float) -> Array:
    return np.diag(np.repeat([shift, turn], 3) ** 2)


def _about(middle: Array, covariance: Array) -> Array:
    """Covariance (6, 6) of the base, by that of a shift d and a turn w about a point c: base = d - w x c."""
    J = np.eye(6)
    J[:3, 3:] = cross_matrix(middle[None])[0]  # -w x c = c x w
    return np.asarray(J @ covariance @ J.T)
