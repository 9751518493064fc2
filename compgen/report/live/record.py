"""What a living page carries, in plain types and packed arrays, for its script."""

from base64 import b64encode
from typing import Any

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.units import HOUR, MM
from compgen.pipelines.study.live_band import LiveBand, LiveQuantity
from compgen.pipelines.study.live_build import LiveJob
from compgen.pipelines.study.live_day import NodeLaw, Stage
from compgen.pipelines.study.live_model import ONE_START, Heat
from compgen.pipelines.study.live_places import Places
from compgen.pipelines.study.live_sliders import Slider
from compgen.pipelines.uncertainty.band import MISSING
from compgen.report.figure import LIGHT_TO_DARK
from compgen.verification.band import ONE_SIDED, quantiles

CELSIUS_SPOKEN = {"h": "hours", "mm/s": "millimetres per second", "degC": "degrees Celsius", "min": "minutes"}


def live_record(live_job: LiveJob) -> dict[str, Any]:
    """The numbers of a living page."""
    live, job = live_job.live, live_job.job
    box = job.cell.heat.box
    limits = next((q.absolute for q in live_job.band.quantities if q.absolute is not None), None)
    return {
        "sliders": [_slider(slider, live_job) for slider in live.day.sliders],
        "stages": [_stage(stage) for stage in live.day.stages],
        "shifts": [[[s.start, s.end], *map(list, s.breaks)] for s in live.day.shifts],
        "clock": live.day.clock,
        "heat": _heat(live.heat, live_job),
        "before": _places(live.before),
        "after": _places(live.after),
        "band": _band(live_job.band),
        "cte": live.cte,
        "cte_limits": None if limits is None else list(limits),
        "box": {
            "feed": (np.array(box.feed) / MM).round(9).tolist() if np.isfinite(box.feed).all() else [0, 1e9],
            "hours": _finite(box.time / HOUR), "rise": _finite(box.rise),
        },
        "duration": float(live_job.before.geometry.now[-1]),
        "window": live_job.corrected.start_window,
        "averaged": job.ensemble is not None,
        "one_start": ONE_START,
        "colours": list(LIGHT_TO_DARK),
    }  # fmt: skip


def _finite(value: float) -> float:
    return value if np.isfinite(value) else 1e9


def packed(values: Array | IntArray, kind: str = "f8") -> dict[str, str] | None:
    """An array as bytes, little-endian."""
    return {"dtype": kind, "bdata": b64encode(np.asarray(values).astype(f"<{kind}").tobytes()).decode("ascii")}


def sources_of(band: LiveBand) -> list[str]:
    """Under which names a band's sources stand, in the order of the page."""
    names = [q.source for q in band.quantities]
    return list(dict.fromkeys([*names, MISSING, *(name for name, _ in band.undirected), ONE_SIDED]))


def _slider(slider: Slider, live_job: LiveJob) -> dict[str, Any]:
    record: dict[str, Any] = {
        "kind": slider.kind, "key": slider.key, "low": slider.low, "high": slider.high, "step": slider.step,
        "value": slider.value, "stops": list(slider.stops), "stage": slider.stage, "knots": list(slider.knots),
        "unit": slider.unit.replace("deg", "°").replace("um", "µm"),
        "spoken": CELSIUS_SPOKEN.get(slider.unit, slider.unit),
    }  # fmt: skip
    if slider.kind == "run":
        record["when"] = [_when(float(t), live_job) for t in live_job.live.heat.run]
    return record


def _when(time: float, live_job: LiveJob) -> str:
    """When a run begins, from the first of the schedule on."""
    if time == 0:
        return "the first run"
    day, hours = int(time // (24 * HOUR)) + 1, time / HOUR
    return f"{hours:.2f} h after the first" + (f", day {day}" if day > 1 else "")


def _stage(stage: Stage) -> dict[str, Any]:
    stops = stage.stops
    return {
        "state": stage.state, "duration": stage.duration, "feed": stage.feed, "share": stage.share,
        "count": stage.count, "dwell": stage.dwell, "rest": stage.rest, "repeated": stage.repeated,
        "keeps_to_shifts": stage.keeps_to_shifts,
        "goal": None if stage.goal is None else packed(stage.goal),
        "stops": None if stops is None else {
            "feed": stops.feed.tolist(), "run_time": stops.run_time.tolist(), "moving": packed(stops.moving),
            "held": packed(stops.held),
        },
    }  # fmt: skip


def _heat(heat: Heat, live_job: LiveJob) -> dict[str, Any]:
    model, air = heat.model, heat.air
    moving = [
        sum(stage.total * stage.share for stage in stages if stage.state == "moving") for stages in heat.cycle_stages
    ]
    return {
        "names": list(model.names), "rate": packed(model.rate), "outputs": packed(model.outputs),
        "ambient": packed(model.ambient), "start": None if model.start is None else packed(model.start),
        "law": None if heat.law is None else _law(heat.law), "standing": packed(heat.standing),
        "run": heat.run.tolist(), "cycle": packed(heat.cycle), "run_moving": moving,
        "air": {
            "time": packed(air.time), "rise": packed(air.rise), "amplitude": air.amplitude, "period": air.period,
            "peak": air.peak,
        },
    }  # fmt: skip


def _law(law: NodeLaw) -> dict[str, Any]:
    return {
        "rate": packed(law.rate), "amplitude": packed(law.amplitude), "exponent": packed(law.exponent),
        "idle": law.idle, "reference_feed": law.reference_feed,
    }  # fmt: skip


def _places(places: Places) -> dict[str, Any]:
    return {
        "arc": packed(places.arc), "position": packed(places.position, "f4"), "time": packed(places.time),
        "slope": packed(places.slope, "f4") if places.slope.any() else None, "growth": packed(places.growth, "f4"),
        "program": packed(places.program, "f4"), "own": packed(places.own, "f4"), "place": packed(places.place, "i4"),
        "share": packed(places.share, "f4"), "length": packed(places.length, "f4"),
        "gap": places.gap.astype(int).tolist(),
    }  # fmt: skip


def _band(band: LiveBand) -> dict[str, Any]:
    sources = sources_of(band)
    return {
        "time": packed(band.time), "on_part": band.on_part.astype(int).tolist(),
        "slope": packed(band.slope, "f4") if band.slope.any() else None, "growth": packed(band.growth, "f4"),
        "program": packed(band.program, "f4"),
        "quantities": [_quantity(q, sources) for q in band.quantities],
        "models": [
            {"laws": [_law(law) for law in pair.laws], "cycle": [packed(c) for c in pair.cycle], "step": pair.step}
            for pair in band.models
        ],
        "build_up": {"rate": packed(band.build_up.rate), "idle": band.build_up.idle},
        "build_up_cycle": packed(band.build_up_cycle),
        "sources": sources, "one_sided": sources.index(ONE_SIDED), "missing_source": sources.index(MISSING),
        "undirected": [[sources.index(name), size] for name, size in band.undirected],
        "missing": band.missing, "scale": band.scale, "feed": band.feed,
        "quantile": packed(quantiles()[1]),
    }  # fmt: skip


def _quantity(q: LiveQuantity, sources: list[str]) -> dict[str, Any]:
    return {
        "source": sources.index(q.source), "column": packed(q.column, "f4"),
        "by_rise": None if q.by_rise is None else packed(q.by_rise, "f4"), "expands": q.expands, "mean": q.mean,
        "deviation": q.deviation, "absolute": None if q.absolute is None else list(q.absolute),
        "missed": q.missed.tolist(), "start": q.start.tolist(), "air": q.air, "model": q.model,
        "has_heat": bool(q.missed.any() or q.start.any() or q.air or q.model >= 0),
    }  # fmt: skip
