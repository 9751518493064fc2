"""How far a living page's formula is from the full computation, at settings drawn with a seed."""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, own, rms
from compgen.core.units import UM
from compgen.job.job import Job
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.study.geometry import flown_pose
from compgen.pipelines.study.live_band import band_at
from compgen.pipelines.study.live_build import LiveJob
from compgen.pipelines.study.live_model import Setting, at, overrides_of, planned_setting
from compgen.pipelines.study.live_places import Flown
from compgen.pipelines.study.live_sliders import Slider
from compgen.pipelines.study.sample_band import band_at_samples, some_samples
from compgen.verification.deviation import percentile99, sample_lengths

DRAWN = 20
SEED = 19
BOUND = 0.2 * UM


@dataclass(frozen=True, eq=False, slots=True)
class Agreement:
    """The formula less the full computation at D settings: largest, p99 and rms of the error on the part."""

    settings: tuple[Setting, ...]
    before: Array  # (D, 3) [m]
    after: Array  # (D, 3) [m]
    band: Array  # (D,) [m] of its largest radius

    def __post_init__(self) -> None:
        own(self, before=("D", 3), after=("D", 3), band=("D",))

    @property
    def largest(self) -> float:
        """How far the two are apart at most, in any of the numbers that are shown [m]."""
        return float(max(np.abs(rows).max() for rows in (self.before, self.after, self.band)))

    @property
    def is_close(self) -> bool:
        """Whether that is within what a page promises."""
        return self.largest <= BOUND


def drawn_settings(sliders: tuple[Slider, ...], count: int = DRAWN, seed: int = SEED) -> tuple[Setting, ...]:
    """Settings anywhere in the ranges of the sliders, at their steps; the same for the same sliders."""
    generator = np.random.default_rng(seed)

    def draw(slider: Slider) -> float:
        if slider.stops:
            return slider.stops[int(generator.integers(len(slider.stops)))]
        steps = round((slider.high - slider.low) / slider.step)
        return float(round(slider.low + slider.step * int(generator.integers(steps + 1)), 9))

    return tuple(tuple(draw(slider) for slider in sliders) for _ in range(count))


def check(live_job: LiveJob) -> Agreement:
    """Compare at the planned setting and at drawn ones: the job read anew with each, both texts flown by the twin.

    Raises:
        CompgenError: A setting cannot be read or flown.
    """
    day = live_job.live.day
    settings = (planned_setting(day), *drawn_settings(day.sliders))
    before: list[Array] = []
    after: list[Array] = []
    band: list[float] = []
    for setting in settings:
        job = job_at(live_job, setting)
        for rows, flown, places in (
            (before, live_job.before, live_job.live.before), (after, live_job.after, live_job.live.after),
        ):  # fmt: skip
            shown = at(live_job.live, setting, places)
            rows.append(np.array([shown.largest, shown.p99, shown.rms]) - full(job, flown))
        geometry = live_job.before.geometry
        rise = geometry.rises(job)[some_samples(geometry)]
        whole = band_at_samples(job, geometry, rise=rise).largest
        band.append(band_at(live_job.live, live_job.band, setting).largest - whole)
    return Agreement(settings, np.array(before), np.array(after), np.array(band))


def job_at(live_job: LiveJob, setting: Setting) -> Job:
    """The job of a setting, read from its files."""
    overrides = overrides_of(live_job.live.day, setting, live_job.job.ensemble is not None)
    return load_job(live_job.path_file, live_job.robot, [*live_job.overrides, *overrides])


def full(job: Job, flown: Flown) -> Array:
    """Largest, p99 and rms of the error of a text on the part, flown by the twin in another state, (3,) [m]."""
    actual = flown_pose(job, flown.geometry, flown.geometry.rises(job)).position
    size = np.linalg.norm((flown.error + actual - flown.position)[flown.on_part], axis=1)
    weight = sample_lengths(flown.arc)[flown.on_part]
    return np.array([size.max(), percentile99(size, weight), rms(size, weight)])
