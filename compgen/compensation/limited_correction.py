r"""The best legal correction of one stretch: the problem of ``optimise`` in the interior point's unknowns.

    minimise   1/2 sum ds [ |W e|^2 + l1 |W c'|^2 + l2 |W c''|^2 ]
    subject to theta inside its limits,   |c| <= clamp,   |c_{n+1} - c_n| <= rate ds,   (J2, J3) behind its edges

e, theta and their derivatives in c are CasADi's; the Hessian is Gauss-Newton's. The unknowns x are c in micrometres
and, for rotations, micrometres at the lever; joints are in microradians.
"""

from collections.abc import Callable

import numpy as np

from compgen.compensation import interior_point
from compgen.compensation.band import transposed_times
from compgen.compensation.constraints import Balls, Box, Changes, Constraint, Rows
from compgen.compensation.interior_point import LocalProgram
from compgen.compensation.problem import NEAR_EDGE, Problem, Settings
from compgen.compensation.smoothness import component_weights, smoothing_matrix, waypoint_lengths
from compgen.compensation.solution import Optimum, Status
from compgen.core.arrays import Array, BoolArray
from compgen.core.units import UM

NEAR_LIMIT = 5e-3  # rad from a limit within which a joint is constrained


def solve(
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
    robot = problem.robot
    unit = np.array([UM, UM, UM, *3 * [UM / settings.lever]])
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
    near = free[:, None] & np.stack([planned > upper - NEAR_LIMIT / UM, planned < lower + NEAR_LIMIT / UM])
    joint_rows = np.flatnonzero(near.any(axis=(0, 2)))
    edges, edge_counts = None, np.zeros((len(free), 0), dtype=bool)
    if robot.interference is not None:  # the planned pose decides on which side of which edges a waypoint stays
        edges = robot.interference.half_planes(problem.theta, NEAR_EDGE)
        edge_counts = edges.near & free[:, None]

    def linearise(x: Array) -> LocalProgram:
        e, E, theta, G = problem.linearise(x * unit)
        E, G = E * unit, G * unit / UM
        hessian = np.matmul(np.swapaxes(E, 1, 2), weight[:, :, None] * E)
        limits = Box(included=near, rows=joint_rows, x=x, f=theta / UM, jacobian=G, lower=lower, upper=upper)
        constraints: tuple[Constraint, ...] = (limits, clamps, rate)
        if robot.interference is not None and edges is not None:
            plane = robot.interference.plane(theta)[:, None, :]
            beyond = (edges.bound - (edges.normal * plane).sum(axis=2)) / UM
            constraints += (Rows(edge_counts, x, beyond, -edges.normal @ robot.interference.to_plane @ G),)
        return LocalProgram(x, transposed_times(E, weight * e), hessian, constraints)

    end = interior_point.solve(linearise, smoothness, start / unit, free, progress)
    if end.status is Status.FAILED:
        return Optimum(start, end.status, end.iterations)
    return Optimum(np.where(free[:, None], end.x * unit, start), end.status, end.iterations)
