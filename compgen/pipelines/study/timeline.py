"""The whole day of a job: rises over before, cycle and after, and what one corrected file is worth in each run."""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, owns
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.job.job import Job
from compgen.job.uncertainty import is_taught_with
from compgen.pipelines.study.geometry import band_at_samples, displacement, plan_geometry, some_samples
from compgen.pipelines.uncertainty.not_known import WorkSetting, setting_of
from compgen.thermal import Duty, rise_history
from compgen.thermal.ensemble import Start, duties_before, mean_rises
from compgen.thermal.model import extrapolations
from compgen.verification.band import Band

POINTS = 2000


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(time=("M",), rise=("M", "K"), air=("M",), run=("R",), run_rise=("R", "K"), error=("R",), residual=("R",))
class Timeline:
    """A day at M moments, and R runs of the program in it."""

    time: Array  # (M,) [s] from the first duty of ``before``
    rise: Array  # (M, K) [K]
    air: Array  # (M,) [K]
    start: float  # [s] when the program first starts
    run: Array  # (R,) [s] when each run starts
    run_rise: Array  # (R, K) [K] then
    error: Array  # (R,) [m] largest on the part in each run without correction
    residual: Array  # (R,) [m] what one file leaves in each: for the first run, or for the job's starts
    setting: WorkSetting  # that the program works in
    band: tuple[Band, Band]  # what the files leave open in the first run, and in the one that errs most
    findings: tuple[Finding, ...]  # of the files, and where the day leaves what was measured


def timeline(job: Job) -> Timeline:
    """Follow a job's day.

    A run warms the robot by what its duty says; within one run the rises are taken as those at its start, which is what
    differs from run to run.
    """
    geometry, history = plan_geometry(job), job.history
    run = Duty("moving", job.feed, float(geometry.prepared.timing.time[-1]))
    cycle = history.cycle or (job.heat.mean_losses(lambda: geometry.motion).warming(run),)
    duties = [*history.before, *cycle, *history.after]
    end = max(sum(d.duration for d in duties), history.clock + run.duration)
    edges = np.cumsum([0.0, *(d.duration for d in duties)])
    even = np.linspace(0.0, end, POINTS)
    time = np.unique(np.concatenate([even, edges[edges <= end] if len(edges) < POINTS else even]))
    starts = history.clock + np.array(history.runs)
    rise = rise_history(job.heat, duties, time, air=history.air)
    run_rise = rise_history(job.heat, duties, starts, air=history.air)
    thin = geometry.at(some_samples(geometry))
    shifts = [displacement(job, thin, r) for r in run_rise]
    largest = [float(np.linalg.norm(s, axis=1).max()) for s in shifts]
    of_file = shifts[0]
    if job.ensemble is not None:
        of_file = displacement(job, thin, mean_rises(job.heat, history, job.ensemble, geometry.motion)[0])
    left = [float(np.linalg.norm(s - of_file, axis=1).max()) for s in shifts]
    bands = [
        band_at_samples(job, geometry, replace(history, before=duties_before(history, Start(n))), run_rise[n])
        for n in (0, int(np.argmax(largest)))
    ]
    tool, is_taught = job.tool.pose, is_taught_with(job.tool.pose, job.frame, job.cell)
    hot = extrapolations(job.cell.heat, duties, job.feed, 0.0, rise, history.step_at, "the day's end")
    return Timeline(
        time=time,
        rise=rise,
        air=history.air.at(time),
        start=history.clock,
        run=starts,
        run_rise=run_rise,
        error=np.array(largest),
        residual=np.array(left),
        setting=setting_of(geometry.path.target.position, tool.position[None], run_rise, is_tool_taught=is_taught),
        band=(bands[0], bands[1]),
        findings=(*(Finding.of(Code.THERMAL_BOX, text) for text in hot), *job.input_findings),
    )
