"""One scenario to one row: what is shared between scenarios is done once.

Path, joints, timing and the controller's execution depend on the geometry keys only; heat, growth and the error are
then a few array operations on its samples. A scenario that only changes temperatures costs those.
"""

from collections import OrderedDict
from typing import Any

from compgen.core.codes import Level
from compgen.core.exceptions import CompgenError
from compgen.core.findings import first_message
from compgen.core.units import UM
from compgen.job.job import Job
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.pipelines.study.geometry import Geometry, band_at_samples, execute_with, lay_out
from compgen.pipelines.study.scenarios import Scenario, Study
from compgen.verification.deviation import Deviation, deviation_from_path, statistics

Row = dict[str, Any]
KEPT = 4  # geometries at a time
#: tables whose keys leave path, joints and timing alone
WARM = (
    "before", "cycle", "after", "shift", "start", "ambient", "log",
    "bounds", "compensation", "title", "robot.thermal",
)  # fmt: skip


class Shared:
    """Geometries by their keys; the last few are kept."""

    def __init__(self) -> None:
        """With none yet."""
        self._kept: OrderedDict[tuple[tuple[str, str], ...], Geometry | CompgenError] = OrderedDict()

    def of(self, scenario: Scenario, job: Job) -> Geometry:
        """The geometry of a scenario.

        Raises:
            CompgenError: The robot cannot drive it.
        """
        key = geometry_key(scenario)
        if key not in self._kept:
            try:
                self._kept[key] = lay_out(job)
            except CompgenError as failure:
                self._kept[key] = failure
            if len(self._kept) > KEPT:
                self._kept.popitem(last=False)
        geometry = self._kept[key]
        if isinstance(geometry, CompgenError):
            raise geometry
        return geometry


def geometry_key(scenario: Scenario) -> tuple[tuple[str, str], ...]:
    """The values that path, joints and timing depend on."""
    return tuple((k, v) for k, v in scenario.values if not any(k == w or k.startswith(f"{w}.") for w in WARM))


def evaluate(study: Study, scenario: Scenario, shared: Shared) -> Row:
    """A scenario's row: its values with their results, or why it failed."""
    row: Row = {"index": scenario.index, **{key: value.strip('"') for key, value in scenario.values}}
    try:
        job = load_job(study.path, study.robot, [*study.base, *scenario.overrides()])
        geometry = shared.of(scenario, job)
        execution = execute_with(job, geometry)
        before = deviation_from_path(geometry.path, [execution], len(execution.time))
        row |= {"state": "done"} | _numbers("before", before)
        row |= {
            "duration_s": _round(float(execution.time[-1])),
            "waypoints": len(geometry.path.arc),
        } | {f"start_{n}_K": _round(float(r)) for n, r in zip(job.heat.names, execution.rise[0], strict=True)}
        band = band_at_samples(job, geometry)
        row["band_um"] = _round(band.largest / UM)
        if band.hidden:
            row["sensor_um"] = _round(band.hidden / UM)
        if study.correct:
            _, corrected = generate.generate(job, lambda stage, share: None)
            row |= _numbers("after", corrected.deviation)
            row |= {"inside": corrected.inside, "start_window_s": _round(corrected.start_window)}
            if not corrected.inside:
                row["reason"] = first_message(Level.OUTSIDE, corrected.findings)
    except CompgenError as failure:
        row |= {"state": "failed", "reason": " ".join(str(failure).split())}
    return row


def _numbers(side: str, deviation: Deviation) -> Row:
    table = statistics(deviation)
    out = {f"{side}_{k}": _round(v) for k, v in table["total"].items()}
    on_part = statistics(deviation, on_part=True)["total"]["max_um"]
    return out | {
        f"{side}_normal_max_um": _round(table["normal"]["max_um"]), f"{side}_on_part_max_um": _round(on_part)
    }  # fmt: skip


def _round(value: float) -> float:
    return float(f"{value:.6g}")
