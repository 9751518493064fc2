"""A plan and its correction at those waypoints only that the written program names."""

from dataclasses import replace

from compgen.compensation.solution import Solution
from compgen.core.arrays import IntArray
from compgen.core.findings import Finding
from compgen.pipelines.job_results import Planned
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
    trajectory, stops = planned.trajectory, planned.page_stops
    kept = replace(
        planned,
        path=path,
        page_stops=stops and replace(stops, stop=stops.stop[rows], added=stops.added[rows]),
        theta=planned.theta[rows],
        motion=planned.motion.at(rows),
        trajectory=replace(
            trajectory,
            time=trajectory.time[rows],
            speed=trajectory.speed[rows[1:] - 1],
            driven_speed=trajectory.driven_speed[rows[1:] - 1],
        ),
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
