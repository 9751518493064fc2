r"""Where a constraint binds: which waypoints, and the best legal correction of them and of those around.

``hold`` has it from ``interior``. ``solve_stretch`` is the same problem as a general nonlinear program in CasADi, the
oracle of both fast solutions in the tests. Its variables are the joints, theta_n = theta_n(free solution) + 1e-4 x_n,
so joint limits are bounds; the commanded pose is
the nominal forward kinematics, and c_n and e_n follow from it. Waypoints around the stretch keep the free solution and
tie its ends. It costs milliseconds a waypoint.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from compgen.compensation import interior_point
from compgen.compensation.problem import Problem, Settings, measure, weights
from compgen.core.arrays import Array, BoolArray, dot, norm
from compgen.core.units import UM
from compgen.robot.kinematics import nominal_chain

WINDOW = 8192  # waypoints solved together
LARGEST = 8 * WINDOW  # where they cannot be parted without a limit binding across
FOLDS = 16  # of e that a change dies away by
SCALE = 1e-4  # [rad] of one unit of x
ON = 1e-7  # [rad] how near a joint limit counts as on it
OVER = 1 + 1e-6  # how far over a clamp or a rate counts as broken
NOISE = 1e-10  # [m] of a correction's change that is no change: waypoints may stand nanometres apart
NEAR = 1 - 1e-4  # how near it counts as on it
CLOSE = 0.02  # [rad] how near a limit a planned joint must come for its correction to reach it


def with_room(problem: Problem, step: tuple[float, float]) -> Problem:
    """The same with joint limits drawn in by what rounding may move a joint that comes near one.

    Args:
        problem: The whole program.
        step: Of the text's coordinates [m] and angles [rad].
    """
    robot = problem.robot
    sides = zip(problem.theta.min(axis=0) - robot.lower, robot.upper - problem.theta.max(axis=0))
    if all(min(pair) > CLOSE for pair in sides):
        return problem
    close = np.stack([problem.theta < robot.lower + CLOSE, problem.theta > robot.upper - CLOSE])  # (2, N, 6)
    rows = np.flatnonzero(close.any(axis=(0, 2)))
    turn = problem.window(rows).linear(np.zeros((len(rows), 6)))[3]
    # half a step of each coordinate, and of three angles whose axes need not be square to each other
    moved = step[0] / 2 * np.abs(turn[:, :, :3]).sum(axis=2) + np.sqrt(5) * step[1] / 2 * norm(turn[:, :, 3:])
    low, high = np.where(close[:, rows], moved, 0.0).max(axis=1)
    return replace(problem, robot=replace(robot, lower=robot.lower + low, upper=robot.upper - high))


def violated(
    problem: Problem, settings: Settings, correction: Array, joints: tuple[Array, Array] | None = None
) -> BoolArray:
    """Which waypoints break a limit, (N,); ``joints`` are theta and the reach margin where they are known."""
    theta, margin = joints or problem.joints(correction)
    bad = margin < 0
    for q, lower, upper in zip(theta.T, problem.robot.lower - 1e-12, problem.robot.upper + 1e-12):
        if q.min() < lower or q.max() > upper:
            bad |= (q < lower) | (q > upper)
    bad |= dot(correction[:, :3], correction[:, :3]) > (settings.clamp_position * OVER) ** 2
    bad |= dot(correction[:, 3:], correction[:, 3:]) > (settings.clamp_rotation * OVER) ** 2
    change = correction[1:] - correction[:-1]
    steep = dot(change[:, :3], change[:, :3]) > (settings.rate * OVER * np.diff(problem.arc) + NOISE) ** 2
    bad[:-1] |= steep
    bad[1:] |= steep
    return np.asarray(bad)


def near(arc: Array, rows: BoolArray, reach: float) -> BoolArray:
    """Rows no farther along the path than a reach [m], or than two rows, from a marked one, (N,)."""
    change = np.zeros(len(rows) + 1, dtype=np.int64)
    marked = np.flatnonzero(rows)
    first, last = np.searchsorted(arc, arc[marked] - reach), np.searchsorted(arc, arc[marked] + reach, "right")
    np.add.at(change, np.maximum(np.minimum(first, marked - 2), 0), 1)
    np.add.at(change, np.minimum(np.maximum(last, marked + 3), len(rows)), -1)
    return np.asarray(np.cumsum(change)[:-1] > 0)


def reach_of(settings: Settings) -> float:
    """The length of path beyond which a change of the correction has died away [m]."""
    first, second = settings.rate_period / (2 * np.pi), settings.curvature_period / (2 * np.pi)
    return float(FOLDS * np.hypot(first, np.sqrt(2) * second))


def hold(
    problem: Problem,
    settings: Settings,
    correction: Array,
    rows: BoolArray,
    progress: Callable[[float], None] = lambda share: None,
) -> tuple[Array, tuple[tuple[int, str], ...], bool]:
    """Solve the stretches around violating waypoints.

    Args:
        problem: The whole program.
        settings: Smoothness and limits.
        correction: Free solution, (N, 6).
        rows: Waypoints that break a limit, (N,).
        progress: Called with the share done.

    Returns:
        The legal correction (N, 6), the limits that bind as (waypoint from 1, name), and whether all is legal.
    """
    correction = correction.copy()
    reach = reach_of(settings)
    around = 1.25 * reach
    while True:  # as long as something binds nearer to what stays as it is than its influence goes
        loose = near(problem.arc, rows, around)
        part = np.flatnonzero(near(problem.arc, loose, 0.0))  # two waypoints on either side tie the ends
        window, held = problem.window(part), loose[part]
        found, converged = _by_windows(window, settings, correction[part], held, around, progress)
        broken = violated(window, settings, found)
        active = _active(window, settings, found)
        binds = broken.copy()
        binds[np.array([n for n, _ in active], dtype=np.int64) - 1] = True
        legal = converged and not broken.any()
        if (legal and not (near(window.arc, binds, reach) & ~held).any()) or around > np.ptp(problem.arc):
            break
        rows = rows.copy()
        rows[part] |= binds
        around = around if legal else 2 * around
    correction[part] = found
    return correction, tuple((int(part[n - 1]) + 1, name) for n, name in active), legal


def _by_windows(
    problem: Problem,
    settings: Settings,
    start: Array,
    loose: BoolArray,
    beyond: float,
    progress: Callable[[float], None],
) -> tuple[Array, bool]:
    """One window after the other, each tied to what the one before settled and run on so far beyond its own end [m].

    A window ends where nothing is solved, if there is such a place before ``LARGEST``. Else what is solved beyond its
    end is thrown away: by there what comes later has no more influence. So memory is bounded. Only a rate that binds
    without a break past all that carries influence farther: what is found then is legal, micrometres off the best.
    """
    N, arc = len(loose), problem.arc
    result, begin = start.copy(), 0
    while begin < N:
        end = min(N, begin + WINDOW)
        if end < N and loose[end]:
            gap = np.flatnonzero(~loose[end : begin + LARGEST])
            end = end + int(gap[0]) if len(gap) else min(N, begin + LARGEST)
        last = min(N, max(int(np.searchsorted(arc, arc[end - 1] + beyond, "right")), end + 2))
        if last - begin < WINDOW + WINDOW // 2 and N == last:
            end = N  # the rest is no window of its own
        first = max(0, begin - 2)
        free = loose[first:last].copy()
        free[: begin - first] = False
        if free.any():
            window = problem.window(slice(first, last))
            found, solved = interior_point.solve(window, settings, result[first:last], free, progress)
            result[begin:end] = found[begin - first : end - first]
            if not solved:
                return result, False
        begin = end
    return result, True


def pose_functions(problem: Problem) -> Any:
    """(theta, rise, direction, travel, target position, target rotation column-major) -> c (6), e (6)."""
    theta, rise = ca.SX.sym("theta", 6), ca.SX.sym("rise", problem.rise.shape[1])
    direction, travel = ca.SX.sym("direction", 6), ca.SX.sym("travel", 3)
    p, r = ca.SX.sym("p", 3), ca.SX.sym("r", 9)
    R = ca.reshape(r, 3, 3)
    nominal = nominal_chain(problem.robot, theta, (problem.tool_position, problem.tool_rotation)).tcp_expr()
    actual = problem.model.actual(theta, rise, direction, travel)
    c = ca.vertcat(nominal[0] - p, _vector_expr(R.T @ nominal[1]))
    e = ca.vertcat(actual[0] - p, _vector_expr(R.T @ actual[1]))
    return ca.Function("pose", [theta, rise, direction, travel, p, r], [c, e])


def _vector_expr(rotation: Any) -> Any:
    """Rotation vector of a small rotation: (axial / 2) asin(s) / s with asin(s) / s = 1 + s^2/6 + 3 s^4/40."""
    axial = (
        ca.vertcat(rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1])
        / 2
    )
    s2 = ca.dot(axial, axial)
    return axial * (1 + s2 / 6 + 3 * s2 * s2 / 40)


def solve_stretch(problem: Problem, settings: Settings, start: Array, loose: BoolArray) -> tuple[Array, bool]:
    """One stretch: minimise over the loose waypoints (N,), the others as they are; and whether it converged."""
    N = len(loose)
    robot = problem.robot
    theta0, _ = problem.joints(start)
    function = pose_functions(problem)
    x = ca.MX.sym("x", 6, N)
    targets = np.swapaxes(problem.rotation, 1, 2).reshape(N, 9)
    motion = (_each(problem.motion.direction, N), _each(problem.motion.travel, N))
    given = (ca.DM(problem.rise.T), *motion, ca.DM(problem.position.T), ca.DM(targets.T))
    c, e = function.map(N)(ca.DM(theta0.T) + SCALE * x, *given)
    h, ds = np.diff(problem.arc), measure(problem.arc)
    share = 1 / float(ds.mean())  # a waypoint counts about one
    lever = ca.repmat(ca.DM([1.0, 1.0, 1.0, *3 * [settings.lever]]) / UM, 1, N) * c
    first = lever[:, 1:] - lever[:, :-1]
    residuals = [
        ca.repmat(ca.DM(weights(settings)) / UM, 1, N) * e * _rows(np.sqrt(ds * share)),
        settings.rate_period / (2 * np.pi) * first * _rows(np.sqrt(share / h)),
    ]
    if N > 2:
        between = (h[:-1] + h[1:]) / 2
        bend = first[:, 1:] / _rows(h[1:]) - first[:, :-1] / _rows(h[:-1])
        size = (settings.curvature_period / (2 * np.pi)) ** 2
        residuals.append(size * bend * _rows(np.sqrt(share / between) * ~problem.stop[1:-1]))
    r = ca.vertcat(*(ca.vec(part) for part in residuals))
    clamp = ca.vertcat(
        ca.sum1(c[:3, :] ** 2) / settings.clamp_position**2, ca.sum1(c[3:, :] ** 2) / settings.clamp_rotation**2
    )
    rate = ca.sum1((c[:3, 1:] - c[:3, :-1]) ** 2) * _rows(1 / (settings.rate * h) ** 2, 1)
    constraints = ca.vertcat(ca.vec(clamp), ca.vec(rate))
    lower = np.where(loose[:, None], (robot.lower - theta0) / SCALE, 0.0)
    upper = np.where(loose[:, None], (robot.upper - theta0) / SCALE, 0.0)
    program = {"x": ca.vec(x), "f": ca.sumsqr(r), "g": constraints}
    solver = ca.nlpsol(
        "limits", "ipopt", program, {**_OPTIONS, "hess_lag": _gauss_newton(program["x"], r, c, h, settings)}
    )
    # constraints between two waypoints that both stay as they are cannot be changed
    bounds = np.ones(constraints.numel())
    bounds[: 2 * N] = np.where(np.repeat(loose, 2), 1.0, np.inf)
    bounds[2 * N :] = np.where(loose[:-1] | loose[1:], 1.0, np.inf)
    found = solver(x0=0, lbx=lower.ravel(), ubx=upper.ravel(), lbg=-np.inf, ubg=bounds)
    theta = theta0 + SCALE * np.asarray(found["x"]).reshape(N, 6)
    theta = np.clip(theta, robot.lower, robot.upper)
    c_of, _ = function.map(N)(ca.DM(theta.T), *given)
    result = start.copy()
    result[loose] = np.asarray(c_of).T[loose]
    return result, bool(solver.stats()["success"])


_OPTIONS: dict[str, Any] = {
    "print_time": False,
    "ipopt": {
        "print_level": 0,
        "sb": "yes",
        "tol": 1e-3,  # um^2 per 1e-4 rad: 5e-6 um off the optimum; below lies the noise of double precision
        "compl_inf_tol": 1e-8,  # how exactly an active limit is met: some 1e-10 rad
        "barrier_tol_factor": 1e3,  # the noise of double precision must not hold the barrier up
        "constr_viol_tol": 1e-7,  # relative to a clamp or a rate
        "acceptable_iter": 0,
        "bound_relax_factor": 0.0,
        "honor_original_bounds": "yes",
        "nlp_scaling_method": "none",
        "max_iter": 100,
        "fixed_variable_treatment": "make_parameter",
    },
}


def _gauss_newton(x: Any, r: Any, c: Any, h: Array, settings: Settings) -> Any:
    """Hessian of the Lagrangian without the curvature of theta -> c, e, which is parts in 10^4 of it."""
    N = c.shape[1]
    weight, multiplier, none = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", 3 * N - 1), ca.MX.sym("p", 0)
    J = ca.jacobian(r, x)
    step = c[:3, 1:] - c[:3, :-1]
    parts = [
        (c[:3, :], multiplier[0 : 2 * N : 2].T / settings.clamp_position**2),
        (c[3:, :], multiplier[1 : 2 * N : 2].T / settings.clamp_rotation**2),
        (step, multiplier[2 * N :].T * _rows(1 / (settings.rate * h) ** 2, 1)),
    ]
    H = 2 * weight * J.T @ J
    for value, force in parts:
        D = ca.jacobian(ca.vec(value), x)
        H += 2 * D.T @ ca.diag(ca.vec(ca.repmat(force, 3, 1))) @ D
    return ca.Function("hess_lag", [x, none, weight, multiplier], [ca.triu(H)], ["x", "p", "lam_f", "lam_g"], ["H"])


def _rows(values: Array, count: int = 6) -> Any:
    """The same row for each of ``count`` components, to multiply with."""
    return ca.repmat(ca.DM(values).T, count, 1)


def _each(rows: Array, count: int) -> Any:
    """Rows as columns, one for each waypoint; a single row serves all."""
    return ca.DM(np.broadcast_to(rows, (count, rows.shape[1])).T.copy())


def _active(problem: Problem, settings: Settings, correction: Array) -> tuple[tuple[int, str], ...]:
    """The limits that bind, as (waypoint from 1, name)."""
    theta, _ = problem.joints(correction)
    robot = problem.robot
    step = correction[1:] - correction[:-1]
    found = {
        f"joint {name} limit": (q < lower + ON) | (q > upper - ON)
        for q, lower, upper, name in zip(theta.T, robot.lower, robot.upper, robot.joint_names)
    } | {
        "position clamp": norm(correction[:, :3]) > settings.clamp_position * NEAR,
        "rotation clamp": norm(correction[:, 3:]) > settings.clamp_rotation * NEAR,
        "rate limit": norm(step[:, :3]) > settings.rate * np.diff(problem.arc) * NEAR,
    }
    return tuple(sorted((int(n) + 1, name) for name, on in found.items() for n in np.flatnonzero(on)))
