"""A plan and its correction at those waypoints only that the written program names."""

from dataclasses import replace

from compgen.compensation.problem import Solution
from compgen.core.arrays import IntArray
from compgen.core.findings import Finding
from compgen.pipelines.planned.job_results import Planned
from compgen.planning.toolpath import ToolPath


def at_waypoints(
    planned: Planned, solution: Solution, rows: IntArray, path: ToolPath, finding: Finding
) -> tuple[Planned, Solution]:
    """What is left of a plan and its solution.

    Args:
        planned: Of N waypoints.
        solution: Of its problem.
        rows: The waypoints that stay, (M,).
        path: Of these.
        finding: That says so.
    """
    stops = planned.page_stops
    kept = replace(
        planned,
        path=path,
        page_stops=stops and stops.at(rows),
        theta=planned.theta[rows],
        motion=planned.motion.at(rows),
        trajectory=planned.trajectory.at(rows),
        rise=planned.rise[rows],
        findings=(*planned.findings, finding),
        rows=rows,
    )
    return kept, replace(
        solution,
        correction=solution.correction[rows],
        theta=solution.theta[rows],
        residual=solution.residual[rows],
    )
