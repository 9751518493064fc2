"""Whether motion at stops matters beyond the bounds where the robot file's accelerations are assumed.

A ramp from or to a stop takes as long as the accelerations allow. Steeper or flatter ramps drive the same path at other
times, and so at another warmth: the written text is flown with them, and judged by the same bounds.
"""

from dataclasses import replace

import numpy as np

from compgen.core.arrays import row_norms
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding, first_message
from compgen.core.units import UM
from compgen.job.job import Job
from compgen.pipelines.files.twin_of_job import at_start, deviation_of, prepared_for
from compgen.pipelines.planned.job_results import Corrected, Planned
from compgen.pipelines.uncertainty.draws import RAMPS
from compgen.planning.toolpath import ToolPath
from compgen.program.program import Program
from compgen.thermal.ensemble import Ensemble, starts_to_fly
from compgen.verification.verdict import judge

SHARES = (float(np.exp(-2 * RAMPS)), float(np.exp(2 * RAMPS)))  # of the accelerations: two standard deviations


def judge_ramps(planned: Planned, corrected: Corrected) -> Corrected:
    """A proven program with what steeper and flatter ramps make of it: a note, or outside where they break a bound.

    Args:
        planned: What it was made from.
        corrected: The program; the same where the robot file knows its accelerations.
    """
    findings = ramp_findings(planned.job, planned.path, corrected.program)
    return replace(corrected, findings=(*corrected.findings, *findings)) if findings else corrected


def ramp_findings(job: Job, path: ToolPath, program: Program) -> list[Finding]:
    """What steeper and flatter ramps make of a written program; nothing where the robot file knows its accelerations.

    Args:
        job: Its bounds, and the day after which it is flown.
        path: At the program's positions.
        program: As it was read.
    """
    if job.robot.acceleration_known:
        return []
    prepared = prepared_for(job, program)
    moved, broken = 0.0, ""
    for start in starts_to_fly(job.ensemble or Ensemble()):
        usual = deviation_of(path, at_start(job, prepared, start))
        for share in SHARES:
            deviation = deviation_of(path, at_start(job, prepared.with_ramps(share), start))
            moved = max(moved, float(row_norms(deviation.error - usual.error).max()))
            failure = first_message(Level.OUTSIDE, judge(deviation, job.bounds))
            if failure and not broken and not first_message(Level.OUTSIDE, judge(usual, job.bounds)):
                broken = f"with ramps at {share:.2g} of them {failure}"
    facts = "accelerations are assumed (limits.acceleration_known = false)"
    if broken:
        mend = "time a run between two stops on the robot, mend limits.acceleration_deg_s2 and say true, or stop less"
        finding = Finding(Level.OUTSIDE, Code.TIMING_RAMPS, f"{facts}: {broken}; {mend}")
    else:
        low, high = SHARES
        size = f"{max(moved / UM, 0.01):.2f} um at most"
        message = f"{facts}: ramps at {low:.2g} to {high:.2g} of them move the tool by {size}"
        finding = Finding(Level.NOTE, Code.TIMING_RAMPS, message)
    return [finding]
