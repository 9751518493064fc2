r"""The general program on a path of any length: in windows that end only where no limit binds, and grow otherwise.

Each window is tied to what was settled before it, and runs on beyond the end of what it settles. Where no limit binds,
a change dies away within ``influence_length``; a rate that binds carries it on. So what a window settles ends before a
stretch of that length in which no limit binds; if there is none, the window is solved again twice as long. Where a
limit binds within that length of its beginning, the window before settled too much: both are solved again as one.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from compgen.compensation import general_solver
from compgen.compensation.limits import active_limits, find_violations, influence_length
from compgen.compensation.problem import Joints, Problem, Settings
from compgen.compensation.solution import Optimum, Solution, Status
from compgen.core.arrays import Array, BoolArray, frozen

WINDOW = 4000  # waypoints
TIES = 2  # waypoints before a window that stay as they are: smoothness reaches so far
OVERLAP = 1.25  # influence lengths


class _Ended(NamedTuple):
    """A window of which the optimum is known, or the one in which it could not be found."""

    correction: Array  # (N, 6) of the whole program
    optimum: Optimum
    first: int  # row of the window's first waypoint
    end: int
    iterations: int  # of all windows
    last_step: float


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
    ended = _solve_windows(problem, settings, progress, window)
    correction, status = ended.correction, ended.optimum.status
    residual, theta, margin = problem.evaluate_residual(correction)
    active = active_limits(problem, settings, correction)
    if status is Status.CONVERGED and find_violations(problem, settings, correction, Joints(theta, margin)).any():
        status = Status.FAILED
    if status is Status.CONVERGED and active:
        status = Status.LIMITED
    unsolved = None if ended.optimum.converged else (ended.first + 1, ended.end)
    progress(1.0)
    return Solution(
        correction=frozen(correction),
        theta=frozen(theta),
        residual=frozen(residual),
        status=status,
        iterations=ended.iterations,
        last_step=ended.last_step,
        active_limits=active,
        unsolved=unsolved,
    )


def _solve_windows(problem: Problem, settings: Settings, progress: Callable[[float], None], window: int) -> _Ended:
    """One window after the other, until the last or one without an optimum."""
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

        optimum = general_solver.solve(part, settings, correction[first:end], free, report)
        iterations, last_step = iterations + optimum.iterations, max(last_step, optimum.last_step)
        binding = _binding(part, settings, optimum.correction)
        near = np.searchsorted(part.arc, arc[begin] + overlap, "right")
        if begin > 0 and (not optimum.converged or binding[:near].any()):
            begins.pop()
            size = max(end - begins[-1], 2 * size)
            correction[begins[-1] :] = 0.0
            continue
        settled = end if end == N else first + _settled_rows(part.arc, binding, overlap)
        if not optimum.converged or end == N:
            correction[begin:end] = optimum.correction[begin - first :]
            return _Ended(
                correction=correction, optimum=optimum, first=first, end=end, iterations=iterations, last_step=last_step
            )
        if settled <= begin:
            size *= 2
            continue
        correction[begin:settled] = optimum.correction[begin - first : settled - first]
        begins.append(settled)
        size = window


def _binding(part: Problem, settings: Settings, correction: Array) -> BoolArray:
    """Waypoints at which a limit binds, (N,)."""
    binding = np.zeros(len(part.arc), dtype=bool)
    binding[np.array([n for n, _ in active_limits(part, settings, correction)], dtype=np.int64) - 1] = True
    return binding


def _settled_rows(arc: Array, binding: BoolArray, overlap: float) -> int:
    """How many rows of a window hold whatever comes after it: no limit binds in the overlap behind them."""
    N = len(arc)
    behind = np.searchsorted(arc, arc + overlap)  # (N,) the first row beyond each row's overlap
    rows = np.arange(N)
    next_binding = np.minimum.accumulate(np.where(binding, rows, N)[::-1])[::-1]
    holds = np.flatnonzero((behind < N) & (next_binding >= behind))
    return int(holds[-1]) if len(holds) else 0
