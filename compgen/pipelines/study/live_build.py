"""From a path file to what its living page carries: plan, correction and text once, and what each kelvin does."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array
from compgen.core.stages import Progress
from compgen.job.job import Job
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.pipelines.planned import generate
from compgen.pipelines.planned.averaging import planned_rises
from compgen.pipelines.planned.job_results import Corrected, Planned
from compgen.pipelines.study.geometry import Geometry, executed, lay_out
from compgen.pipelines.study.live_band import LiveBand, band_places
from compgen.pipelines.study.live_day import NodeLaw, fixed_stages
from compgen.pipelines.study.live_model import Heat, Live
from compgen.pipelines.study.live_places import Flown, fly_planned, places_of
from compgen.pipelines.study.live_sliders import Day, day_of
from compgen.thermal import Duty, state_after
from compgen.thermal.ensemble import Start, duties_before
from compgen.thermal.history import History
from compgen.verification.twin import prepare

FIRST_START = "start={run=1, delay_min=0}"


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class LiveJob:
    """A living page's numbers with the runs that they come from."""

    path_file: str
    robot: str | None
    overrides: tuple[str, ...]
    job: Job
    planned: Planned
    corrected: Corrected
    before: Flown  # the planned text
    after: Flown  # the corrected one
    live: Live
    band: LiveBand


def build_live(path_file: str, robot: str | None, overrides: Sequence[str], progress: Progress) -> LiveJob:
    """Plan, correct and execute a path, and take what its living page carries.

    Raises:
        CompgenError: The path cannot be read, driven or corrected.
    """
    job = load_job(path_file, robot, overrides)
    first = job if job.inputs["path"]["start"] is None else load_job(path_file, robot, [*overrides, FIRST_START])
    day = day_of(path_file, robot, overrides, first)
    planned_text = lay_out(job)
    planned, corrected = generate.generate(job, progress)
    prepared = prepare(twin_of(job), corrected.program, job.history.before, job.history.air)
    before, after = (
        fly_planned(job, geometry, rises_as_planned(job, geometry))
        for geometry in (planned_text, executed(job, planned.path, prepared))
    )
    cte = next((slider.value for slider in day.sliders if slider.kind == "cte"), None)
    dearer = None
    if cte is not None:
        dearer = load_job(path_file, robot, [*overrides, f"robot.thermal.cte_um_m_K={2 * cte!r}"])
    places = [places_of(job, flown, dearer) for flown in (before, after)]
    live = Live(day, _heat(first, day), places[0], places[1], 1.0 if cte is None else cte)
    band = band_places(job, live, planned_text, dearer)
    return LiveJob(
        path_file=path_file,
        robot=robot,
        overrides=tuple(overrides),
        job=job,
        planned=planned,
        corrected=corrected,
        before=before,
        after=after,
        live=live,
        band=band,
    )


def rises_as_planned(job: Job, geometry: Geometry) -> Array:
    """Rises at the samples of a text as planned; of a file for several starts their mean, (M, K) [K]."""
    if job.ensemble is None:
        return geometry.rises(job)
    return geometry.rises_of(geometry.prepared.with_rise(planned_rises(job, geometry.motion)))


def _heat(job: Job, day: Day) -> Heat:
    heat, history = job.cell.heat, job.history
    stops = next((slider.stops for slider in day.sliders if slider.kind == "run"), (1.0,))
    run = np.array([history.runs[int(n) - 1] for n in stops])
    until = [cycle_until(history, t) for t in run.tolist()]
    cycle = np.array([state_after(heat, duties, np.zeros(len(heat.rate))) for duties in until])
    stages = tuple(tuple(fixed_stages(duties)) for duties in until)
    law = None if heat.law is None else NodeLaw.of(heat.law)
    return Heat(
        model=heat,
        law=law,
        air=history.air,
        standing=heat.steady_state(history.standing),
        run=run,
        cycle=cycle,
        cycle_stages=stages,
    )


def cycle_until(history: History, time: float) -> tuple[Duty, ...]:
    """What the cycle does until a moment [s] after the first run's start."""
    alone = replace(history, before=(), runs=(time,))
    return duties_before(alone, Start())
