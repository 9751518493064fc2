"""What a living page carries, in plain types and packed arrays, for its script."""

from base64 import b64encode
from typing import Any

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.units import HOUR, MM
from compgen.pipelines.study.live_band import LiveBand, LiveQuantity
from compgen.pipelines.study.live_build import LiveJob
from compgen.pipelines.study.live_day import ONE_START, Slider, Stage
from compgen.pipelines.study.live_places import Live, LivePlaces
from compgen.pipelines.uncertainty.band_columns import MISSING
from compgen.report.figure import LIGHT_TO_DARK
from compgen.thermal import NodeModel
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
        "heat": _heat(live),
        "before": _places(live.before),
        "after": _places(live.after),
        "band": _band(live_job),
        "cte": live.cte,
        "cte_limits": None if limits is None else list(limits),
        "box": {
            "feed": (np.array(box.feed) / MM).round(9).tolist() if np.isfinite(box.feed).all() else [0, 1e9],
            "hours": _finite(box.time / HOUR),
            "rise": _finite(box.rise),
        },
        "duration": float(live_job.before.geometry.now[-1]),
        "window": live_job.corrected.start_window,
        "early": 0.0 if job.ensemble is None else job.ensemble.delay[0],
        "averaged": job.ensemble is not None,
        "one_start": ONE_START,
        "colours": list(LIGHT_TO_DARK),
    }


def _finite(value: float) -> float:
    return value if np.isfinite(value) else 1e9


def packed(values: Array | IntArray, kind: str = "f8") -> dict[str, str] | None:
    """An array as bytes, little-endian."""
    return {"dtype": kind, "bdata": b64encode(np.asarray(values).astype(f"<{kind}").tobytes()).decode("ascii")}


def sources_of(band: LiveBand) -> list[str]:
    """Under which names a band's sources stand, in the order of the page."""
    names = [q.quantity.source or "" for q in band.quantities]
    return list(dict.fromkeys([*names, MISSING, *(name for name, _ in band.undirected), ONE_SIDED]))


def _slider(slider: Slider, live_job: LiveJob) -> dict[str, Any]:
    return {
        "kind": slider.kind,
        "key": slider.key,
        "low": slider.low,
        "high": slider.high,
        "step": slider.step,
        "value": slider.value,
        "stops": list(slider.stops),
        "stage": slider.stage,
        "knots": list(slider.knots),
        "unit": slider.unit.replace("deg", "°").replace("um", "µm"),
        "spoken": CELSIUS_SPOKEN.get(slider.unit, slider.unit),
        **({"when": [_when(float(t)) for t in live_job.live.cycle.run]} if slider.kind == "run" else {}),
    }


def _when(time: float) -> str:
    """When a run begins, from the first of the schedule on."""
    if time == 0:
        return "the first run"
    day, hours = int(time // (24 * HOUR)) + 1, time / HOUR
    return f"{hours:.2f} h after the first" + (f", day {day}" if day > 1 else "")


def _stage(stage: Stage) -> dict[str, Any]:
    step, stops = stage.step, stage.stops
    return {
        "state": step.state,
        "duration": step.duration if step.repeat is None else stage.run_time,
        "feed": step.feed,
        "share": step.share,
        "count": step.repeat or 1,
        "dwell": step.dwell,
        "rest": step.rest,
        "repeated": step.repeat is not None,
        "keeps_to_shifts": step.shifts,
        "goal": None if stage.goal is None else packed(stage.goal),
        "stops": None
        if stops is None
        else {
            "feed": stops.feed.tolist(),
            "run_time": stops.run_time.tolist(),
            "moving": packed(stops.moving),
            "held": packed(stops.held),
        },
    }


def _heat(live: Live) -> dict[str, Any]:
    heat, history = live.day.cell.heat, live.day.history
    law, air = heat.law, history.air
    moving = [sum(d.duration * d.share for d in until if d.state == "moving") for until in live.cycle.duties]
    return {
        "names": list(heat.names),
        "rate": packed(heat.rate),
        "outputs": packed(heat.outputs),
        "ambient": packed(heat.ambient),
        "start": None if heat.start is None else packed(heat.start),
        "law": None if law is None else _law(law),
        "standing": packed(heat.steady_state(history.standing)),
        "run": live.cycle.run.tolist(),
        "cycle": packed(live.cycle.modes(heat)),
        "run_moving": moving,
        "air": {
            "time": packed(air.time),
            "rise": packed(air.rise),
            "amplitude": air.amplitude,
            "period": air.period,
            "peak": air.peak,
        },
    }


def _law(law: NodeModel) -> dict[str, Any]:
    amplitude = law.steady_rise("moving", np.array([law.reference_feed]))[0]
    return {
        "rate": packed(law.rate),
        "amplitude": packed(amplitude),
        "exponent": packed(law.exponent),
        "idle": law.idle,
        "reference_feed": law.reference_feed,
    }


def _places(places: LivePlaces) -> dict[str, Any]:
    return {
        "arc": packed(places.arc),
        "position": packed(places.position, "f4"),
        "time": packed(places.time),
        "program": packed(places.program, "f4"),
        "slope": packed(places.slope),
        "growth": packed(places.growth),
        "shape": packed(places.shape, "i2"),
        "own": packed(places.own, "f4"),
        "at": packed(places.at, "f4"),
        "length": packed(places.length, "f4"),
        "gap": places.gap.astype(int).tolist(),
    }


def _band(live_job: LiveJob) -> dict[str, Any]:
    band, warmth = live_job.band, live_job.job.cell.warmth
    sources = sources_of(band)
    return {
        "time": packed(band.time),
        "on_part": band.on_part.astype(int).tolist(),
        "slope": packed(band.slope, "f4") if band.slope.any() else None,
        "growth": packed(band.growth, "f4"),
        "program": packed(band.program, "f4"),
        "quantities": [_quantity(q, sources) for q in band.quantities],
        "models": [
            {"laws": [_law(law) for law in pair.laws], "cycle": [packed(c) for c in pair.cycle], "step": pair.step}
            for pair in band.models
        ],
        "build_up": {"rate": packed(1 / warmth.lag), "idle": warmth.idle},
        "build_up_cycle": packed(band.build_up_cycle),
        "sources": sources,
        "one_sided": sources.index(ONE_SIDED),
        "missing_source": sources.index(MISSING),
        "undirected": [[sources.index(name), size] for name, size in band.undirected],
        "missing": band.missing,
        "taken": packed(band.taken, "f4") if band.taken.any() else None,
        "scale": band.scale,
        "feed": band.feed,
        "quantile": packed(quantiles()[1]),
    }


def _quantity(live_quantity: LiveQuantity, sources: list[str]) -> dict[str, Any]:
    q, by_rise, absolute = live_quantity.quantity, live_quantity.by_rise, live_quantity.absolute
    return {
        "source": sources.index(q.source or ""),
        "column": packed(live_quantity.column, "f4"),
        "by_rise": None if by_rise is None else packed(by_rise, "f4"),
        "expands": live_quantity.expands,
        "mean": q.mean,
        "deviation": q.deviation,
        "absolute": None if absolute is None else list(absolute),
        "missed": live_quantity.missed.tolist(),
        "start": q.cause.heat.start.tolist(),
        "air": q.cause.heat.air,
        "model": live_quantity.model,
        "has_heat": live_quantity.has_heat,
    }
