"""The optimiser's problem of a planned program, as ``generate`` poses it for a path without pages."""

from compgen.compensation.problem import Problem


def problem_of(planned, rows=slice(None)):
    job, path = planned.job, planned.path
    whole = Problem(
        robot=job.robot,
        model=planned.model,
        posture=job.posture,
        tool=job.tool.pose,
        target=path.target,
        theta=planned.theta,
        rise=planned.rise,
        arc=path.arc,
        stop=path.stop,
        direction_state=planned.motion,
    )
    return whole.window(rows)
