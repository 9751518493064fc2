"""From a path file to what its living page carries, and how far its formula is from the full computation.

Plan, correction and text are made once, with what each kelvin does to them. Then the files are read anew at settings
that are drawn with a seed, and both texts flown by the twin at every sample.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, owns, rms
from compgen.core.exceptions import InputError
from compgen.core.stages import Progress
from compgen.core.units import UM
from compgen.job.job import Job
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.twin_of_job import prepared_for
from compgen.pipelines.planned import generate
from compgen.pipelines.planned.job_results import Corrected, Planned
from compgen.pipelines.study.geometry import band_at_samples, executed, flown_pose, plan_geometry, some_samples
from compgen.pipelines.study.live_band import LiveBand, band_at, band_places
from compgen.pipelines.study.live_day import SliderValues, cycle_of, drawn_settings, overrides_of, planned_setting
from compgen.pipelines.study.live_places import FlownText, Live, at, fly_planned, places_of
from compgen.pipelines.study.live_sliders import day_of
from compgen.verification.deviation import percentile99, sample_lengths

FIRST_START = "start={run=1, delay_min=0}"
BOUND = 0.2 * UM


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class LiveJob:
    """A living page's numbers with the runs that they come from."""

    path_file: str
    robot: str | None
    overrides: tuple[str, ...]
    job: Job
    planned: Planned
    corrected: Corrected
    before: FlownText  # the planned text
    after: FlownText  # the corrected one
    live: Live
    band: LiveBand


@dataclass(frozen=True, eq=False, slots=True)
@owns(before=("D", 3), after=("D", 3), band=("D",))
class Agreement:
    """The formula less the full computation at D settings: largest, p99 and rms of the error on the part."""

    settings: tuple[SliderValues, ...]
    before: Array  # (D, 3) [m]
    after: Array  # (D, 3) [m]
    band: Array  # (D,) [m] of its largest radius

    @property
    def largest(self) -> float:
        """How far the two are apart at most, in any of the numbers that are shown [m]."""
        return float(max(np.abs(rows).max() for rows in (self.before, self.after, self.band)))

    @property
    def is_close(self) -> bool:
        """Whether that is within what a page promises."""
        return self.largest <= BOUND


def build_live(path_file: str, robot: str | None, overrides: Sequence[str], progress: Progress) -> LiveJob:
    """Plan, correct and execute a path, and take what its living page carries.

    Raises:
        CompgenError: The path cannot be read, driven or corrected.
    """
    job = load_job(path_file, robot, overrides)
    first = job if job.inputs["path"]["start"] is None else load_job(path_file, robot, [*overrides, FIRST_START])
    day = day_of(path_file, robot, overrides, first)
    planned_text = plan_geometry(job)
    planned, corrected = generate.generate(job, progress)
    prepared = prepared_for(job, corrected.program)
    before, after = (
        fly_planned(job, geometry, geometry.rises_as_planned(job))
        for geometry in (planned_text, executed(job, planned.path, prepared))
    )
    cte, dearer = next((slider.value for slider in day.sliders if slider.kind == "cte"), None), None
    if cte is not None:
        dearer = load_job(path_file, robot, [*overrides, f"robot.thermal.cte_um_m_K={2 * cte!r}"])
    live = Live(
        day=day,
        cycle=cycle_of(day),
        before=places_of(job, before, dearer),
        after=places_of(job, after, dearer),
        cte=1.0 if cte is None else cte,
    )
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
        band=band_places(job, live, planned_text, dearer),
    )


def check_agreement(live_job: LiveJob) -> Agreement:
    """Compare at the planned setting and at drawn ones: the job read anew with each, both texts flown by the twin.

    A drawn setting that the files refuse, as where no shift is left to move in, is none to compare at.

    Raises:
        CompgenError: The planned setting cannot be read, or one cannot be flown.
    """
    live = live_job.live
    settings: list[SliderValues] = []
    texts = ((live_job.before, live.before), (live_job.after, live.after))
    errors: tuple[list[Array], list[Array]] = ([], [])
    band: list[float] = []
    for setting in (planned_setting(live.day), *drawn_settings(live.day.sliders)):
        try:
            job = _job_at(live_job, setting)
        except InputError:
            if not settings:
                raise
            continue
        settings.append(setting)
        for rows, (flown, places) in zip(errors, texts, strict=True):
            shown = at(live, setting, places)
            rows.append(np.array([shown.max, shown.p99, shown.rms]) - _full(job, flown))
        geometry = live_job.before.geometry
        whole = band_at_samples(job, geometry, rise=geometry.rises(job)[some_samples(geometry)]).largest
        band.append(band_at(live, live_job.band, setting).largest - whole)
    return Agreement(tuple(settings), np.array(errors[0]), np.array(errors[1]), np.array(band))


def _job_at(live_job: LiveJob, setting: SliderValues) -> Job:
    """The job of a setting, read from its files."""
    overrides = overrides_of(live_job.live.day, setting, averaged=live_job.job.ensemble is not None)
    return load_job(live_job.path_file, live_job.robot, [*live_job.overrides, *overrides])


def _full(job: Job, flown: FlownText) -> Array:
    """Largest, p99 and rms of the error of a text on the part, flown by the twin in another state, (3,) [m]."""
    actual = flown_pose(job, flown.geometry, flown.geometry.rises(job)).position
    size = np.linalg.norm((flown.error + actual - flown.position)[flown.on_part], axis=1)
    weight = sample_lengths(flown.arc)[flown.on_part]
    return np.array([size.max(), percentile99(size, weight), rms(size, weight)])
