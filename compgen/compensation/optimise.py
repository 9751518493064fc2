r"""The optimiser: what to command so that the real tool goes where it shall.

The unknowns are the corrections c_n of the commanded pose at every waypoint, all in one problem: three of position in
base axes [m] and three of rotation in tool axes [rad],

    commanded_n = target_n (+) c_n,      e_n(c) = actual(theta(commanded_n), rise_n) (-) target_n

    minimise   sum_n ds_n [ |W e_n|^2 + l1 |W c'_n|^2 + l2 |W c''_n|^2 ]         (``problem``)

    subject to lower <= theta_n <= upper,   |c_n| <= clamp,   |c_{n+1} - c_n| <= rate ds

Two solvers give the same optimum to a nanometre. ``structured_solver`` uses what is special about it (the error hardly
depends on the correction, a waypoint is coupled with four others) and takes microseconds a waypoint.
``nonlinear_program`` hands the same problem, written independently, to CasADi's interface of ipopt, and takes
milliseconds.
"""

from collections.abc import Callable

from compgen.compensation import nonlinear_program, structured_solver
from compgen.compensation.problem import Problem, Settings, Solution, Solver, Status

__all__ = ["Solution", "Status", "optimise"]


def optimise(problem: Problem, settings: Settings, progress: Callable[[float], None] = lambda share: None) -> Solution:
    """Best legal correction of a program, by the solver that the settings name.

    Args:
        problem: Targets, joints and temperatures.
        settings: Smoothness, limits and the solver.
        progress: Called with the share done.

    Returns:
        The correction. Where a limit binds, ``status`` is LIMITED and ``active_limits`` names waypoints and limits.
    """
    solve = nonlinear_program.optimise if settings.solver is Solver.IPOPT else structured_solver.optimise
    return solve(problem, settings, progress)
