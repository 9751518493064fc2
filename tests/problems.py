"""The optimiser's problem of a planned program, as ``generate`` poses it for a path without pages."""

from compgen.compensation.problem import Problem


def problem_of(planned, rows=slice(None)):
    job, path = planned.job, planned.path
    whole = Problem(
        job.robot, planned.model, job.posture, job.tool.pose, path.target,
        planned.theta, planned.rise, path.arc, path.stop, planned.motion,
    )  # fmt: skip
    return whole.window(rows)
