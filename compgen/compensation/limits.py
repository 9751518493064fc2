r"""Where the limits of a correction bind: which waypoints, and the best legal correction of them and those around.

    lower <= theta_n <= upper,      |c_n| <= clamp,      |c_{n+1} - c_n| <= rate ds,      (J2, J3) inside its polygon

What a limit changes dies away within ``influence_length`` along the path. So only the waypoints around a violation are
solved again, by ``solve_stretch``, window by window; all others keep the unlimited solution and tie the ends. A stretch
is the problem of ``optimise`` in the interior point's unknowns,

    minimise   1/2 sum ds [ |W e|^2 + l1 |W c'|^2 + l2 |W c''|^2 ]

e, theta and their derivatives in c are CasADi's; the Hessian is Gauss-Newton's. The unknowns x are c in micrometres
and, for rotations, micrometres at the lever; joints are in microradians.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from compgen.compensation import interior_point
from compgen.compensation.banded_matrix import transposed_times
from compgen.compensation.constraints import Balls, Box, Changes, Constraint, Rows
from compgen.compensation.interior_point import LocalProgram
from compgen.compensation.problem import NEAR_EDGE, ActiveLimits, Joints, Optimum, Problem, Settings, Status
from compgen.compensation.smoothness import component_weights, smoothing_matrix, waypoint_lengths
from compgen.core.arrays import Array, BoolArray, IntArray, dot, norm
from compgen.core.units import UM

WINDOW = 8192  # waypoints solved together
MAX_WINDOW = 8 * WINDOW  # where they cannot be parted without a limit binding across
DECAY_LENGTHS = 16  # of e that a change dies away by
ACTIVE_JOINT = 1e-7  # [rad] how near a joint limit counts as on it
ACTIVE = 1 - 1e-4  # share of a clamp or a rate that counts as on it
VIOLATED = 1 + 1e-6  # share of a clamp or a rate that counts as over it
CHANGE_NOISE = 1e-10  # [m] of a correction's change that is no change: waypoints may stand nanometres apart
NEAR_LIMIT = 0.02  # [rad] how near a limit a planned joint must come for its correction to reach it
HELD_FROM = 5e-3  # rad from a limit within which a joint is constrained


def with_rounding_margin(problem: Problem, step: tuple[float, float]) -> Problem:
    """The problem with joint limits drawn in by what rounding may move a joint that comes near one.

    Args:
        problem: The whole program.
        step: Of the text's coordinates [m] and angles [rad].
    """

    def rounding(rows: IntArray, G: Array) -> Array:
        # half a step of each coordinate, and of three angles whose axes need not be square to each other
        along, about = np.abs(G[:, :, :3]).sum(axis=2), norm(G[:, :, 3:])
        return np.asarray(step[0] / 2 * along + np.sqrt(5) * step[1] / 2 * about)

    return _drawn_in(problem, np.arange(len(problem.arc)), rounding)


def with_uncertainty_margin(problem: Problem, rows: IntArray, moment: Array, sigmas: float) -> Problem:
    r"""The problem with joint limits drawn in by what joints may yet have to move once the error is known better.

    A correction that follows an error of second moment S turns joint i by sqrt(g_i^T S g_i), g_i = d theta_i / d c.

    Args:
        problem: The whole program.
        rows: Waypoints at which the band is known, rising, (M,).
        moment: S of the position error there, (M, 6) [m^2] xx, xy, xz, yy, yz, zz.
        sigmas: How many of these each joint that comes near a limit keeps from it.
    """

    def turn(which: IntArray, G: Array) -> Array:
        xx, xy, xz, yy, yz, zz = moment[which].T
        S = np.moveaxis(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), 2, 0)
        return np.asarray(sigmas * np.sqrt(np.einsum("nji,nik,njk->nj", G[:, :, :3], S, G[:, :, :3]).clip(min=0.0)))

    return _drawn_in(problem, rows, turn)


def _drawn_in(problem: Problem, rows: IntArray, margin: Callable[[IntArray, Array], Array]) -> Problem:
    """The problem with the limits of joints that come near one drawn in.

    Args:
        problem: The whole program.
        rows: Waypoints to look at, (M,).
        margin: Of some of these (n,), numbers into ``rows``, and dtheta/dc there (n, 6, 6), to [rad] (n, 6).
    """
    robot, theta = problem.robot, problem.theta[rows]
    margins = zip(theta.min(axis=0) - robot.lower, robot.upper - theta.max(axis=0), strict=True)
    area = robot.interference
    at_edge = np.zeros(len(theta), dtype=bool) if area is None else area.clearance(theta) < NEAR_LIMIT
    if all(min(pair) > NEAR_LIMIT for pair in margins) and not at_edge.any():
        return problem
    near = np.stack([theta < robot.lower + NEAR_LIMIT, theta > robot.upper - NEAR_LIMIT])  # (2, M, 6)
    which = np.flatnonzero(near.any(axis=(0, 2)) | at_edge)
    G = problem.window(rows[which]).linearise(np.zeros((len(which), 6))).theta_jacobian
    moved = margin(which, G)
    lower, upper = np.where(near[:, which], moved, 0.0).max(axis=1)
    if area is not None and at_edge.any():
        area = replace(area, margin=area.margin + float(norm(moved[at_edge[which]] @ np.abs(area.to_plane).T).max()))
    drawn_in = replace(robot, lower=robot.lower + lower, upper=robot.upper - upper, interference=area)
    return replace(problem, robot=drawn_in)


def find_violations(problem: Problem, settings: Settings, correction: Array, joints: Joints | None = None) -> BoolArray:
    """Which waypoints break a limit, (N,); ``joints`` where they are known."""
    theta, margin = joints or problem.joints(correction)
    violating = margin < 0
    for q, lower, upper in zip(theta.T, problem.robot.lower - 1e-12, problem.robot.upper + 1e-12, strict=True):
        if q.min() < lower or q.max() > upper:
            violating |= (q < lower) | (q > upper)
    if problem.robot.interference is not None:
        violating |= problem.robot.interference.clearance(theta) < -1e-12
    violating |= dot(correction[:, :3], correction[:, :3]) > (settings.clamp_position * VIOLATED) ** 2
    violating |= dot(correction[:, 3:], correction[:, 3:]) > (settings.clamp_rotation * VIOLATED) ** 2
    change = correction[1:] - correction[:-1]
    steep = dot(change[:, :3], change[:, :3]) > (settings.rate * VIOLATED * np.diff(problem.arc) + CHANGE_NOISE) ** 2
    violating[:-1] |= steep
    violating[1:] |= steep
    return np.asarray(violating)


def neighbourhood(arc: Array, rows: BoolArray, distance: float) -> BoolArray:
    """Rows no farther along the path than a distance [m], or than two rows, from a marked one, (N,)."""
    change = np.zeros(len(rows) + 1, dtype=np.int64)
    marked = np.flatnonzero(rows)
    first, last = np.searchsorted(arc, arc[marked] - distance), np.searchsorted(arc, arc[marked] + distance, "right")
    np.add.at(change, np.maximum(np.minimum(first, marked - 2), 0), 1)
    np.add.at(change, np.minimum(np.maximum(last, marked + 3), len(rows)), -1)
    return np.asarray(np.cumsum(change)[:-1] > 0)


def influence_length(settings: Settings) -> float:
    """The length of path beyond which a change of the correction has died away [m]."""
    first, second = settings.rate_period / (2 * np.pi), settings.curvature_period / (2 * np.pi)
    return float(DECAY_LENGTHS * np.hypot(first, np.sqrt(2) * second))


def enforce_limits(
    problem: Problem,
    settings: Settings,
    correction: Array,
    violating: BoolArray,
    progress: Callable[[float], None],
    window: int,
    max_window: int,
) -> tuple[Array, ActiveLimits, Status]:
    """The best legal correction, solved again around the waypoints that break a limit.

    Args:
        problem: The whole program.
        settings: Smoothness and limits.
        correction: The solution without limits, (N, 6).
        violating: Waypoints that break a limit, (N,).
        progress: Called with the share done.
        window: Waypoints solved together.
        max_window: Where they cannot be parted without a limit binding across.

    Returns:
        The correction, the limits that bind, and LIMITED where all is legal.
    """
    correction = correction.copy()
    influence = influence_length(settings)
    distance = 1.25 * influence
    while True:  # until no limit binds so near to a waypoint that stays as it is that it would have to change too
        free = neighbourhood(problem.arc, violating, distance)
        rows = np.flatnonzero(neighbourhood(problem.arc, free, 0.0))  # two waypoints on either side tie the ends
        part, part_free = problem.window(rows), free[rows]
        optimum = _solve_windows(part, settings, correction[rows], part_free, distance, progress, (window, max_window))
        solved = optimum.correction
        broken = find_violations(part, settings, solved)
        active = active_limits(part, settings, solved)
        binding = broken | waypoints_of(active, len(broken))
        legal = optimum.converged and not broken.any()
        wide_enough = legal and not (neighbourhood(part.arc, binding, influence) & ~part_free).any()
        if wide_enough or distance > np.ptp(problem.arc):
            break
        violating = violating.copy()
        violating[rows] |= binding
        distance = distance if legal else 2 * distance
    correction[rows] = solved
    status = Status.LIMITED if legal else Status.FAILED if optimum.converged else optimum.status
    return correction, tuple((int(rows[n - 1]) + 1, name) for n, name in active), status


def _solve_windows(
    problem: Problem,
    settings: Settings,
    start: Array,
    free: BoolArray,
    overlap: float,
    progress: Callable[[float], None],
    sizes: tuple[int, int],
) -> Optimum:
    """The correction of the free waypoints (N,), in bounded memory.

    One window after the other is tied to what the one before settled, and runs on by the overlap [m] beyond its own
    end. A window ends where nothing is free, if there is such a place before the larger size. Else what is solved in
    the overlap is thrown away: there what comes later has no more influence on what is kept. Only a rate that binds
    without a break past all that carries influence farther: that solution is legal, micrometres off the best.
    """
    N, arc = len(free), problem.arc
    usual, longest = sizes
    correction, begin = start.copy(), 0
    while begin < N:
        end = min(N, begin + usual)
        if end < N and free[end]:
            gap = np.flatnonzero(~free[end : begin + longest])
            end = end + int(gap[0]) if len(gap) else min(N, begin + longest)
        last = min(N, max(int(np.searchsorted(arc, arc[end - 1] + overlap, "right")), end + 2))
        if last - begin < usual + usual // 2 and N == last:
            end = N  # the rest is no window of its own
        first = max(0, begin - 2)
        window_free = free[first:last].copy()
        window_free[: begin - first] = False
        if window_free.any():
            window = problem.window(slice(first, last))
            optimum = solve_stretch(window, settings, correction[first:last], window_free, progress)
            correction[begin:end] = optimum.correction[begin - first : end - first]
            if not optimum.converged:
                return Optimum(correction, optimum.status)
        begin = end
    return Optimum(correction, Status.CONVERGED)


def waypoints_of(active: ActiveLimits, count: int) -> BoolArray:
    """At which of so many waypoints a limit binds, (N,)."""
    return np.isin(np.arange(1, count + 1), [n for n, _ in active])


def active_limits(problem: Problem, settings: Settings, correction: Array) -> ActiveLimits:
    """The limits that bind."""
    theta, _ = problem.joints(correction)
    robot = problem.robot
    change = correction[1:] - correction[:-1]
    active = {
        f"joint {name} limit": (q < lower + ACTIVE_JOINT) | (q > upper - ACTIVE_JOINT)
        for q, lower, upper, name in zip(theta.T, robot.lower, robot.upper, robot.joint_names, strict=True)
    } | {
        "J2/J3 interference": np.zeros(len(theta), dtype=bool)
        if robot.interference is None
        else robot.interference.clearance(theta) < ACTIVE_JOINT,
        "position clamp": norm(correction[:, :3]) > settings.clamp_position * ACTIVE,
        "rotation clamp": norm(correction[:, 3:]) > settings.clamp_rotation * ACTIVE,
        "rate limit": norm(change[:, :3]) > settings.rate * np.diff(problem.arc) * ACTIVE,
    }
    return tuple(sorted((int(n) + 1, name) for name, binding in active.items() for n in np.flatnonzero(binding)))


def solve_stretch(
    problem: Problem,
    settings: Settings,
    start: Array,
    free: BoolArray,
    progress: Callable[[float], None] = lambda share: None,
) -> Optimum:
    """Best legal correction of the free waypoints (N,), the others as they are.

    Args:
        problem: The stretch, N waypoints.
        settings: Smoothness and limits.
        start: (N, 6) [m] and [rad].
        free: (N,).
        progress: Called with the share done, a guess.
    """
    robot, unit = problem.robot, np.array([UM, UM, UM, *3 * [UM / settings.lever]])
    h, ds = np.maximum(np.diff(problem.arc), 1e-12), waypoint_lengths(problem.arc)
    scale = 1 / float(ds[free].mean())  # a waypoint counts about one
    smoothness = smoothing_matrix(problem.arc, problem.stop, settings, 0.0) * scale
    weight = (component_weights(settings) / UM) ** 2 * (scale * ds)[:, None]
    clamps = Balls(
        np.repeat(free[:, None], 2, axis=1),
        np.array([settings.clamp_position, settings.clamp_rotation * settings.lever]) / UM,
    )
    rate = Changes(free[1:] | free[:-1], settings.rate * h / UM)
    lower, upper = robot.lower / UM, robot.upper / UM
    planned = problem.joints(start)[0] / UM
    near = free[:, None] & np.stack([planned > upper - HELD_FROM / UM, planned < lower + HELD_FROM / UM])
    joint_rows = np.flatnonzero(near.any(axis=(0, 2)))
    # the planned pose decides on which side of which edges a waypoint stays
    edges = None if robot.interference is None else robot.interference.half_planes(problem.theta, NEAR_EDGE)

    def linearise(x: Array) -> LocalProgram:
        e, E, theta, G = problem.linearise(x * unit)
        E, G = E * unit, G * unit / UM
        hessian = np.matmul(np.swapaxes(E, 1, 2), weight[:, :, None] * E)
        limits = Box(included=near, rows=joint_rows, x=x, f=theta / UM, jacobian=G, lower=lower, upper=upper)
        constraints: tuple[Constraint, ...] = (limits, clamps, rate)
        if robot.interference is not None and edges is not None:
            beyond = (edges.bound - (edges.normal * robot.interference.plane(theta)[:, None, :]).sum(axis=2)) / UM
            constraints += (
                Rows(edges.near & free[:, None], x, beyond, -edges.normal @ robot.interference.to_plane @ G),
            )
        return LocalProgram(x, transposed_times(E, weight * e), hessian, constraints)

    end, status = interior_point.solve(linearise, smoothness, start / unit, free, progress)
    solved = free & (status is not Status.FAILED)
    return Optimum(np.where(solved[:, None], end * unit, start), status)
