"""A file that serves many starts, as data and as a figure: its error at each of them, beside the file made anew."""

from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from compgen.core.units import UM
from compgen.pipelines.planned.many_starts import Averaged
from compgen.report.curves import curves_in_words, line_style
from compgen.report.figure import GREY, WARM, Figure, Trace, axis, figure, trace
from compgen.thermal.ensemble import Ensemble, Start
from compgen.verification.deviation import Extent

if TYPE_CHECKING:
    from compgen.pipelines.correct.proof import Residue, ServedStarts


def ensemble_record(ensemble: Ensemble) -> dict[str, Any]:
    """The starts as the path file's keys have them."""
    return {**starts_record(ensemble), "runs": [run + 1 for run in ensemble.runs]}


def starts_record(ensemble: Ensemble) -> dict[str, Any]:
    """The starts of one run, which is all that a program that exists has."""
    return {"delay_s": list(ensemble.delay), "override_percent": [100 * share for share in ensemble.overrides]}


def averaged_record(averaged: Averaged) -> dict[str, Any]:
    """What one file leaves over its starts, in plain types; docs/report.md has the keys."""
    return {
        **ensemble_record(averaged.ensemble),
        "at_mean": _sizes(averaged.at_mean),
        "max_um": averaged.worst_flown.total.max / UM,
        "rms_um": averaged.rms / UM,
        "spread_rms_um": averaged.spread / UM,
        "spread_max_um": float(averaged.added.max() / UM),
        "remade_max_um": None if averaged.remade is None else averaged.remade / UM,
        "times_better": averaged.times,
        "files": {"count": averaged.files, "within_um": averaged.tolerance / UM},
        "twin_from_model_rms_um": averaged.disagreement / UM,
        "flown": [
            {
                **_start(one.start),
                **_sizes(one.total),
                "remade_max_um": None if one.remade is None else one.remade.max / UM,
            }
            for one in averaged.flown
        ],
        "foretold": [
            {**_start(start), "max_um": float(size / UM)}
            for start, size in zip(averaged.starts, averaged.largest, strict=True)
        ],
    }


def served_record(served: "ServedStarts") -> dict[str, Any]:
    """The same of a program that exists."""

    def sizes(residue: "Residue") -> dict[str, float]:
        return {"max_um": residue.largest / UM, "rms_um": residue.rms / UM}

    return {
        **starts_record(served.ensemble),
        "at_mean": sizes(served.at_mean),
        "max_um": served.worst[1].largest / UM,
        "flown": [{**_start_of_run(start), **sizes(residue)} for start, residue in served.flown],
    }


def served_figure(served: "ServedStarts") -> Figure:
    """The largest error at each start of a program that exists, over delays or overrides, and at the mean."""
    key, title = _abscissa(served.ensemble)
    points = sorted((_start(start)[key], residue.largest / UM) for start, residue in served.flown)
    x, y = (np.round(np.array(column, dtype=float), 3) for column in zip(*points, strict=True))
    marks = trace("scatter", x, y, name="flown by the twin", mode="markers", marker={"color": WARM, "size": 8})
    level = np.full(2, round(served.at_mean.largest / UM, 3))
    look = {"mode": "lines", "line": {"color": GREY, "dash": "dash"}}
    mean = trace("scatter", x[[0, -1]], level, name="with the mean of the rises", **look)
    alt = curves_in_words("Largest error at each start", [marks, mean], "µm")
    return figure([marks, mean], 300, alt, xaxis=axis(title), yaxis=axis("largest error [µm]", rangemode="tozero"))


def averaged_figure(averaged: Averaged) -> Figure:
    """The largest error over delays (else runs, else overrides): foretold as lines, flown as marks, made anew below."""
    key, title = _abscissa(averaged.ensemble)
    rows = sorted(zip(averaged.starts, averaged.largest.tolist(), strict=True), key=lambda row: _others(row[0], key))
    ends = {_others(one.start, key) for one in averaged.flown}
    lines = [(others, list(group)) for others, group in groupby(rows, lambda row: _others(row[0], key))]
    traces: list[Trace] = []
    for k, (others, group) in enumerate((o, g) for o, g in lines if o in ends):
        points = sorted((_start(start)[key], size / UM) for start, size in group)
        x, y = (np.round(np.array(column, dtype=float), 3) for column in zip(*points, strict=True))
        name = ", ".join(["this file", *_words(others, averaged.ensemble)])
        traces.append(trace("scatter", x, y, name=name, mode="lines", line=line_style(k)))
    flown = sorted((_start(one.start)[key], one.total.max / UM) for one in averaged.flown)
    anew = sorted((_start(one.start)[key], one.remade.max / UM) for one in averaged.flown if one.remade is not None)
    for name, points, marker in (
        ("this file, flown by the twin", flown, {"color": WARM, "size": 8}),
        ("made anew for each start, flown", anew, {"color": GREY, "size": 7, "symbol": "diamond"}),
    ):
        if points:
            x, y = (np.round(np.array(column, dtype=float), 3) for column in zip(*points, strict=True))
            traces.append(trace("scatter", x, y, name=name, mode="markers", marker=marker))
    alt = curves_in_words("Largest error at each start", traces, "µm")
    return figure(traces, 340, alt, xaxis=axis(title), yaxis=axis("largest error [µm]", rangemode="tozero"))


def _abscissa(ensemble: Ensemble) -> tuple[str, str]:
    """The key of a start that the figure runs over, and the title of its axis."""
    if ensemble.delay[1] > ensemble.delay[0]:
        return "delay_s", "start later than planned [s]"
    if ensemble.runs[1] > ensemble.runs[0]:
        return "run", "run"
    return "override_percent", "override [%]"


def _start(start: Start) -> dict[str, float]:
    return {**_start_of_run(start), "run": start.run + 1}


def _start_of_run(start: Start) -> dict[str, float]:
    return {"delay_s": start.delay, "override_percent": 100 * start.override}


def _others(start: Start, key: str) -> tuple[tuple[str, float], ...]:
    """What says a start beside one of its keys."""
    return tuple((name, value) for name, value in _start(start).items() if name != key)


def _words(others: tuple[tuple[str, float], ...], ensemble: Ensemble) -> list[str]:
    """Those of them that vary."""
    varies = {"run": ensemble.runs[1] > ensemble.runs[0], "override_percent": len(ensemble.overrides) > 1}
    forms = {"run": "run {:.0f}", "override_percent": "{:.4g} %"}
    return [forms[name].format(value) for name, value in others if varies.get(name)]


def _sizes(extent: Extent) -> dict[str, float]:
    return {"max_um": extent.max / UM, "p99_um": extent.p99 / UM, "rms_um": extent.rms / UM}
