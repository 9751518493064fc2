r"""The correction with its limits as a general nonlinear program, solved by ipopt: slow, and written independently.

    minimise   sum_n ds_n [ |W e_n|^2 + l1 |W c'_n|^2 + l2 |W c''_n|^2 ]
    subject to lower <= theta_n <= upper,   |c_n| <= clamp,   |c_{n+1} - c_n| <= rate ds

The unknowns are the joints, theta_n = theta_n(start) + 1e-4 x_n, so joint limits are bounds; the commanded pose is the
nominal forward kinematics, and c_n and e_n follow from it. It costs milliseconds a waypoint. It is the solver
``compensation.solver = "ipopt"``, and in the tests it judges the optimum of ``structured_solver``.

A path of any length is solved in windows that end only where no limit binds, and grow otherwise. Each window is tied to
what was settled before it, and runs on beyond the end of what it settles. Where no limit binds, a change dies away
within ``influence_length``; a rate that binds carries it on. So what a window settles ends before a stretch of that
length in which no limit binds; if there is none, the window is solved again twice as long. Where a limit binds within
that length of its beginning, the window before settled too much: both are solved again as one.
"""

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

from compgen.compensation.limits import active_limits, find_violations, influence_length, waypoints_of
from compgen.compensation.problem import NEAR_EDGE, Joints, Optimum, Problem, Settings, Solution, Status
from compgen.compensation.smoothness import MIN_SEGMENT, component_weights, waypoint_lengths
from compgen.core import interrupts
from compgen.core.arrays import Array, BoolArray, frozen, norm
from compgen.core.units import UM
from compgen.robot.kinematics import nominal_chain

WINDOW = 4000  # waypoints
TIES = 2  # waypoints before a window that stay as they are: smoothness reaches so far
OVERLAP = 1.25  # influence lengths
JOINT_SCALE = 1e-4  # [rad] of one unit of x
STEP_OF_GRADIENT = 5e-9  # [m] off the optimum, about, where the Lagrangian's gradient is 1 um^2 per 1e-4 rad
MAX_ITERATIONS = 500
USUAL_ITERATIONS = 15
INSIDE = 0.9  # of a clamp
OPTIONS: dict[str, Any] = {
    "print_time": False,
    "ipopt": {
        "print_level": 0,
        "sb": "yes",
        "tol": 1e-3,  # um^2 per 1e-4 rad; below lies the noise of double precision
        "s_max": 1.0,  # where multipliers are larger than 1, relative to them: they carry the noise
        "compl_inf_tol": 1e-8,  # how exactly an active limit is met: some 1e-10 rad
        "barrier_tol_factor": 1e3,  # the noise of double precision must not hold the barrier up
        "constr_viol_tol": 1e-7,  # relative to a clamp or a rate
        "acceptable_iter": 0,
        "bound_relax_factor": 0.0,
        "honor_original_bounds": "yes",
        "nlp_scaling_method": "none",
        "fixed_variable_treatment": "make_parameter",
    },
}


def optimise(
    problem: Problem,
    settings: Settings,
    progress: Callable[[float], None] = lambda share: None,
    window: int = WINDOW,
) -> Solution:
    """Best legal correction of a program by ipopt.

    Args:
        problem: Targets, joints and temperatures of N waypoints.
        settings: Smoothness and limits.
        progress: Called with the share done, a guess, at every iteration.
        window: Waypoints solved together where no limit binds at their end.

    Returns:
        The correction; with a status that is not legal, ``unsolved`` names the waypoints it ended at.
    """
    optimum, last_window = _solve_windows(problem, settings, progress, window)
    correction, status = optimum.correction, optimum.status
    residual, theta, margin = problem.evaluate_residual(correction)
    active = active_limits(problem, settings, correction)
    if status is Status.CONVERGED and find_violations(problem, settings, correction, Joints(theta, margin)).any():
        status = Status.FAILED
    if status is Status.CONVERGED and active:
        status = Status.LIMITED
    progress(1.0)
    return Solution(
        correction=frozen(correction),
        theta=frozen(theta),
        residual=frozen(residual),
        status=status,
        iterations=optimum.iterations,
        last_step=optimum.last_step,
        active_limits=active,
        unsolved=None if optimum.converged else last_window,
    )


def _solve_windows(
    problem: Problem, settings: Settings, progress: Callable[[float], None], window: int
) -> tuple[Optimum, tuple[int, int]]:
    """One window after the other, until the last or one without an optimum: its first and last waypoint, from 1."""
    N, arc = len(problem.arc), problem.arc
    overlap = OVERLAP * influence_length(settings)
    correction, iterations, last_step = np.zeros((N, 6)), 0, 0.0
    begins, size = [0], window
    while True:
        begin = begins[-1]
        end = N if N - begin < size + size // 2 else begin + size
        first = max(0, begin - TIES)
        part = problem.window(slice(first, end))
        free = np.arange(first, end) >= begin

        def report(share: float, begin: int = begin, end: int = end) -> None:
            progress(min(0.99, (begin + share * (end - begin)) / N))

        optimum = solve(part, settings, correction[first:end], free, report)
        iterations, last_step = iterations + optimum.iterations, max(last_step, optimum.last_step)
        binding = waypoints_of(active_limits(part, settings, optimum.correction), len(part.arc))
        near = np.searchsorted(part.arc, arc[begin] + overlap, "right")
        if begin > 0 and (not optimum.converged or binding[:near].any()):
            begins.pop()
            size = max(end - begins[-1], 2 * size)
            correction[begins[-1] :] = 0.0
            continue
        settled = end if end == N else first + _settled_rows(part.arc, binding, overlap)
        if not optimum.converged or end == N:
            correction[begin:end] = optimum.correction[begin - first :]
            return Optimum(correction, optimum.status, iterations, last_step), (first + 1, end)
        if settled <= begin:
            size *= 2
            continue
        correction[begin:settled] = optimum.correction[begin - first : settled - first]
        begins.append(settled)
        size = window


def _settled_rows(arc: Array, binding: BoolArray, overlap: float) -> int:
    """How many rows of a window hold whatever comes after it: no limit binds in the overlap behind them."""
    N = len(arc)
    behind = np.searchsorted(arc, arc + overlap)  # (N,) the first row beyond each row's overlap
    next_binding = np.minimum.accumulate(np.where(binding, np.arange(N), N)[::-1])[::-1]
    holds = np.flatnonzero((behind < N) & (next_binding >= behind))
    return int(holds[-1]) if len(holds) else 0


def solve(
    problem: Problem,
    settings: Settings,
    start: Array,
    free: BoolArray,
    progress: Callable[[float], None] = lambda share: None,
    max_iterations: int = MAX_ITERATIONS,
) -> Optimum:
    """Best legal correction of the free waypoints (N,), the others as they are.

    Args:
        problem: The stretch, N waypoints.
        settings: Smoothness and limits.
        start: (N, 6) [m] and [rad].
        free: (N,).
        progress: Called at every iteration with the share done, a guess. What it raises ends the solution.
        max_iterations: After which it gives up.
    """
    N, robot = len(free), problem.robot
    theta0, _ = problem.joints(start)
    pose = build_pose_differences(problem)
    x = ca.MX.sym("x", 6, N)
    targets = np.swapaxes(problem.target.rotation, 1, 2).reshape(N, 9)
    state = (_columns(problem.direction_state.direction, N), _columns(problem.direction_state.travel, N))
    given = (ca.DM(problem.rise.T), *state, ca.DM(problem.target.position.T), ca.DM(targets.T))
    c, e = pose.map(N)(ca.DM(theta0.T) + JOINT_SCALE * x, *given)
    gap = np.maximum(np.diff(problem.arc), 1e-12)
    r = _residuals(problem, settings, c, e)
    edges = _edge_values(problem, theta0, x, free)
    constraints, bounds = _constraints(settings, c, gap, edges, free)
    lower = np.where(free[:, None], (robot.lower - theta0) / JOINT_SCALE, 0.0)
    upper = np.where(free[:, None], (robot.upper - theta0) / JOINT_SCALE, 0.0)
    program = {"x": ca.vec(x), "f": ca.sumsqr(r), "g": constraints}
    hessian = _gauss_newton_hessian(program["x"], r, c, gap, settings, edges.numel())
    iterations = _Iterations(6 * N, constraints.numel(), progress)
    ipopt = {**OPTIONS["ipopt"], "max_iter": max_iterations}
    options = {**OPTIONS, "ipopt": ipopt, "hess_lag": hessian, "iteration_callback": iterations}
    solver = ca.nlpsol("limits", "ipopt", program, options)
    x0 = np.where(free[:, None], _initial_joints(problem, settings, theta0) - theta0, 0.0) / JOINT_SCALE
    with interrupts.raise_later():
        optimum = solver(x0=x0.ravel(), lbx=lower.ravel(), ubx=upper.ravel(), lbg=-np.inf, ubg=bounds)
    if iterations.exception is not None:
        raise iterations.exception
    theta = np.clip(theta0 + JOINT_SCALE * np.asarray(optimum["x"]).reshape(N, 6), robot.lower, robot.upper)
    c_of_theta, _ = pose.map(N)(ca.DM(theta.T), *given)
    stats = solver.stats()
    further = STEP_OF_GRADIENT * float(stats["iterations"]["inf_du"][-1])
    return Optimum(
        np.where(free[:, None], np.asarray(c_of_theta).T, start), _status(stats), stats["iter_count"], further
    )


def _constraints(settings: Settings, c: Any, gap: Array, edges: Any, free: BoolArray) -> tuple[Any, Array]:
    """Clamps of all waypoints, rates between neighbours, and the edges near them; and what they may be at most.

    Those between two waypoints that both stay as they are cannot be changed.
    """
    clamp = ca.vertcat(
        ca.sum1(c[:3, :] ** 2) / settings.clamp_position**2, ca.sum1(c[3:, :] ** 2) / settings.clamp_rotation**2
    )
    rate = ca.sum1((c[:3, 1:] - c[:3, :-1]) ** 2) * _repeated(1 / (settings.rate * gap) ** 2, 1)
    counts = np.concatenate([np.repeat(free, 2), free[:-1] | free[1:]])
    bounds = np.concatenate([np.where(counts, 1.0, np.inf), np.zeros(edges.numel())])
    return ca.vertcat(ca.vec(clamp), ca.vec(rate), edges), bounds


def _residuals(problem: Problem, settings: Settings, c: Any, e: Any) -> Any:
    """What is squared and summed: errors, and first and second differences of the correction, in micrometres."""
    N, ds = len(problem.arc), waypoint_lengths(problem.arc)
    h = np.maximum(np.diff(problem.arc), MIN_SEGMENT)
    scale = 1 / float(ds.mean())  # a waypoint counts about one
    scaled = ca.repmat(ca.DM([1.0, 1.0, 1.0, *3 * [settings.lever]]) / UM, 1, N) * c
    first = scaled[:, 1:] - scaled[:, :-1]
    residuals = [
        ca.repmat(ca.DM(component_weights(settings)) / UM, 1, N) * e * _repeated(np.sqrt(ds * scale)),
        settings.rate_period / (2 * np.pi) * first * _repeated(np.sqrt(scale / h)),
    ]
    if N > 2:
        between = (h[:-1] + h[1:]) / 2
        second = first[:, 1:] / _repeated(h[1:]) - first[:, :-1] / _repeated(h[:-1])
        weight = (settings.curvature_period / (2 * np.pi)) ** 2
        residuals.append(weight * second * _repeated(np.sqrt(scale / between) * ~problem.stop[1:-1]))
    return ca.vertcat(*(ca.vec(part) for part in residuals))


def _initial_joints(problem: Problem, settings: Settings, theta0: Array) -> Array:
    """Joints to begin with, (N, 6): of the correction that leaves no error, shrunk into its clamps.

    At no correction at all the constraints have no slope, and ipopt may not find its way.
    """
    guess = problem.pointwise_correction()
    for part, clamp in ((guess[:, :3], settings.clamp_position), (guess[:, 3:], settings.clamp_rotation)):
        part *= np.minimum(1.0, INSIDE * clamp / np.maximum(norm(part), 1e-12))[:, None]
    theta, margin = problem.joints(guess)
    return np.where((margin > 0)[:, None], theta, theta0)


def _status(stats: dict[str, Any]) -> Status:
    """What ipopt's own word means."""
    if stats["success"]:
        return Status.CONVERGED
    return Status.FAILED if stats["return_status"] == "Infeasible_Problem_Detected" else Status.STOPPED


class _Iterations(ca.Callback):
    """What ipopt calls after each of its iterations."""

    def __init__(self, unknowns: int, constraints: int, progress: Callable[[float], None]) -> None:
        ca.Callback.__init__(self)
        self.exception: BaseException | None = None
        self._count = 0
        self._sizes = {"f": 1, "x": unknowns, "lam_x": unknowns, "g": constraints, "lam_g": constraints}
        self._progress = progress
        self.construct("iterations", {})

    def get_n_in(self) -> int:
        return int(ca.nlpsol_n_out())

    def get_n_out(self) -> int:
        return 1

    def get_name_in(self, i: int) -> str:
        return str(ca.nlpsol_out(i))

    def get_sparsity_in(self, i: int) -> Any:
        return ca.Sparsity.dense(self._sizes.get(ca.nlpsol_out(i), 0), 1)

    def eval(self, values: Sequence[Any]) -> list[int]:
        """What is raised here would be lost in ipopt: it is kept, and ipopt asked to stop."""
        try:
            self._count += 1
            self._progress(1 - USUAL_ITERATIONS / (USUAL_ITERATIONS + self._count))
        except BaseException as exception:  # noqa: BLE001  raised again behind ipopt
            self.exception = exception
            return [1]
        return [0]


def build_pose_differences(problem: Problem) -> Any:
    """(theta, rise, direction, travel, target position, target rotation column-major) -> c (6), e (6)."""
    theta, rise = ca.SX.sym("theta", 6), ca.SX.sym("rise", problem.rise.shape[1])
    direction, travel = ca.SX.sym("direction", 6), ca.SX.sym("travel", 3)
    p, r = ca.SX.sym("p", 3), ca.SX.sym("r", 9)
    R = ca.reshape(r, 3, 3)
    nominal = nominal_chain(problem.robot, theta, problem.tool).tcp_expr()
    actual = problem.model.actual(theta, rise, direction, travel)
    c = ca.vertcat(nominal.position - p, _rotation_vector_expr(R.T @ nominal.rotation))
    e = ca.vertcat(actual[0] - p, _rotation_vector_expr(R.T @ actual[1]))
    return ca.Function("pose_differences", [theta, rise, direction, travel, p, r], [c, e])


def _rotation_vector_expr(rotation: Any) -> Any:
    """Rotation vector of a small rotation: (axial / 2) asin(s) / s with asin(s) / s = 1 + s^2/6 + 3 s^4/40."""
    axial = (
        ca.vertcat(rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1])
        / 2
    )
    s2 = ca.dot(axial, axial)
    return axial * (1 + s2 / 6 + 3 * s2 * s2 / 40)


def _edge_values(problem: Problem, theta0: Array, x: Any, free: BoolArray) -> Any:
    """How far free waypoints are past the edges of the J2/J3 polygon near them, linear in x; not above zero, (R, 1)."""
    area = problem.robot.interference
    if area is None:
        return ca.MX(0, 1)
    edges = area.half_planes(problem.theta, NEAR_EDGE)
    waypoint, edge = np.nonzero(edges.near & free[:, None])
    normal, bound = edges.normal[waypoint, edge], edges.bound[waypoint, edge]
    at_start = (bound - (normal * area.plane(theta0)[waypoint]).sum(axis=1)) / JOINT_SCALE
    return ca.DM(at_start) - ca.sum1(ca.DM((normal @ area.to_plane).T) * x[:, waypoint.tolist()]).T


def _gauss_newton_hessian(x: Any, r: Any, c: Any, h: Array, settings: Settings, edges: int) -> Any:
    """Hessian of the Lagrangian without the curvature of theta -> c, e, which is parts in 10^4 of it.

    The edges, last of the constraints, are linear and have none.
    """
    N = c.shape[1]
    weight, multiplier, none = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", 3 * N - 1 + edges), ca.MX.sym("p", 0)
    J = ca.jacobian(r, x)
    change = c[:3, 1:] - c[:3, :-1]
    parts = [
        (c[:3, :], multiplier[0 : 2 * N : 2].T / settings.clamp_position**2),
        (c[3:, :], multiplier[1 : 2 * N : 2].T / settings.clamp_rotation**2),
        (change, multiplier[2 * N : 3 * N - 1].T * _repeated(1 / (settings.rate * h) ** 2, 1)),
    ]
    H = 2 * weight * J.T @ J
    for constrained, multipliers in parts:
        D = ca.jacobian(ca.vec(constrained), x)
        H += 2 * D.T @ ca.diag(ca.vec(ca.repmat(multipliers, 3, 1))) @ D
    return ca.Function("hess_lag", [x, none, weight, multiplier], [ca.triu(H)], ["x", "p", "lam_f", "lam_g"], ["H"])


def _repeated(values: Array, count: int = 6) -> Any:
    """One row of numbers (N,) for each of ``count`` components, (count, N)."""
    return ca.repmat(ca.DM(values).T, count, 1)


def _columns(rows: Array, count: int) -> Any:
    """Rows (N, k) as columns (k, N), one for each waypoint; a single row serves all."""
    return ca.DM(np.broadcast_to(rows, (count, rows.shape[1])).T.copy())
