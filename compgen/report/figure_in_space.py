"""Paths in space, coloured by a value: a scene for each, beside each other on a wide page, else below each other."""

from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import Any

import numpy as np

from compgen.core.arrays import Array, BoolArray
from compgen.report.curves import between, rounded_number, sentence
from compgen.report.figure import LIGHT_TO_DARK, Figure, axis, colour_at, figure, packed_array, scale, spans, trace
from compgen.report.still_picture import still_svg
from compgen.report.view import View, middle_tick, ticks, view_of

TALL, TALL_ON_PHONE, TOP = 510, 400, 68  # a scene with its scale of colours, and that alone [px]
LARGEST = "\u25c7 largest"  # the mark in the picture
FEW = 150  # places that are marked one by one
TICKS = 5  # on the longest side
NEAR_END = 0.06  # of an axis


@dataclass(frozen=True, eq=False, slots=True)
class Coloured:
    """A path with a value at each place."""

    title: str  # what the values are, without their unit
    places: Array  # (N, 3) [mm]; a row of NaN interrupts the path
    values: Array  # (N,)
    labels: Sequence[str] = ()  # of the places


def figure_in_space(subject: str, paths: Sequence[Coloured], all_places: Array, part: BoolArray) -> Figure:
    """Paths in one view, each on a scale of its own.

    Args:
        subject: What the figure shows, for the sentence.
        paths: A scene for each.
        all_places: Of the path, (M, 3) [mm].
        part: Which of them are on the part: the view is chosen by these, (M,).
    """
    view = view_of(all_places, part)
    note = _note(view, all_places)
    traces, panels, parts = [], [], []
    layout: dict[str, Any] = {"meta": {"extent": {}, "up": view.up.round(4).tolist()}}
    for k, path in enumerate(paths):
        which = str(k + 1) if k else ""
        seen = view.shows(np.nan_to_num(path.places))
        places = np.where(seen[:, None], path.places, np.nan)
        values = np.where(seen, path.values, np.nan)
        largest = float(np.nanmax(values, initial=0.0))
        title = f"{path.title} [µm]" + (", own scale" if len(paths) > 1 else "")
        mark = f"{LARGEST} {rounded_number(largest)}" if largest > 0 else ""
        traces += _traces(path, places, values, which)
        layout[f"scene{which}"] = _scene(view)
        layout["meta"]["extent"][f"scene{which}"] = [round(e, 4) for e in view.extent]
        layout[f"coloraxis{which}"] = {
            "colorscale": scale(LIGHT_TO_DARK),
            "cmin": 0,
            "cmax": max(largest, 1e-3),
            "colorbar": _bar(f"{title}<br>{mark}"),
        }
        panels.append(still_svg([title, mark], view, places, values, largest, _steps()))
        parts.append(f"{path.title} {between(values, 'µm')}{_where(places, values)}")
    for name, change in _arranged(len(paths), stacked=False).items():
        layout[name] = _merge(layout[name], change)
    height, narrow = TALL, {**_arranged(len(paths), stacked=True), "height": TALL_ON_PHONE * len(paths)}
    margin = {"l": 5, "r": 5, "t": 10, "b": 30 if note else 10}
    if note:
        layout["annotations"] = [_annotation(note)]
        narrow["annotations"] = [_annotation("<br>".join(wrap(note, 52)))]
        narrow["margin"] = {"l": 5, "r": 5, "b": 50}
    else:
        narrow["margin"] = {"l": 5, "r": 5}
    drawn = figure(traces, height, sentence(subject, [*parts, _sides(view), note]), narrow, margin=margin, **layout)
    return {**drawn, "still": panels, "note": note}


def _traces(path: Coloured, places: Array, values: Array, which: str) -> list[dict[str, Any]]:
    few = int(np.isfinite(values).sum()) <= FEW
    shades = packed_array(np.round(values, 3))
    coloured = {"color": shades, "coloraxis": f"coloraxis{which}"}
    line = {"color": "#64748b", "width": 1.5} if few else {**coloured, "width": 4}
    place = {"scene": f"scene{which}", "showlegend": False, "name": path.title}
    words = {"text": list(path.labels)} if path.labels else {}
    template = "%{marker.color:.2f}<br>%{x:.1f}, %{y:.1f}, %{z:.1f} mm<extra></extra>"
    marker = {**coloured, "size": 5 if few else 2, "line": {"width": 0}}
    columns = (np.round(places[:, k], 2) for k in range(3))
    look = {
        "mode": "lines+markers",
        "marker": marker,
        "line": line,
        "hovertemplate": ("%{text} " if path.labels else "") + template,
    }
    traces = [trace("scatter3d", *columns, **look, **words, **place)]
    if np.isfinite(values).any() and np.nanmax(values) > 0:
        worst = places[int(np.nanargmax(values))]
        mark = {"symbol": "diamond-open", "size": 7, "color": "#2a3f5f", "line": {"width": 2}}
        at = ([round(float(v), 2)] for v in worst)
        traces.append(trace("scatter3d", *at, mode="markers", marker=mark, hoverinfo="skip", **place))
    return traces


def _scene(view: View) -> dict[str, Any]:
    """Axes of one scale in space, as the view has them; how large they are is decided where the figure is drawn."""
    ratio = view.size / view.size.max()
    axes = {}
    for k, name in enumerate("xyz"):
        low, high = float(view.low[k]), float(view.high[k])
        numbers = _off_corners(ticks(low, high, max(2, round(TICKS * float(ratio[k])))), low, high).tolist()
        title, words = f"{name.upper()} [mm]", {}
        if view.short[k]:
            numbers, title = [middle_tick(low, high)], ""
            words = {"ticktext": [f"{name.upper()} {numbers[0]:g} mm"]}
        axes[f"{name}axis"] = axis(
            f"<br><br><br>{title}" if name == "z" and title else title,
            **words,  # off its numbers
            range=[low, high],
            tickvals=numbers,
            tickfont={"size": 11},
            tickangle=0,
            showbackground=False,
            gridcolor="#c8d4e3",
            showline=True,
            linecolor="#94a3b8",
            showspikes=False,
            zeroline=False,
        )
    fit = 0.7 / max(view.extent[1], view.extent[0])  # until figure.js knows how much room there is
    return {
        **axes,
        "aspectmode": "manual",
        "aspectratio": {name: round(float(r * fit), 4) for name, r in zip("xyz", ratio, strict=True)},
        "camera": {
            "eye": {name: round(float(2 * e), 4) for name, e in zip("xyz", view.eye, strict=True)},
            "projection": {"type": "orthographic"},
        },
    }


def _off_corners(numbers: Array, low: float, high: float) -> Array:
    """Numbers of an axis without those so near its ends that they would meet another axis' numbers."""
    inner = numbers[(numbers > low + NEAR_END * (high - low)) & (numbers < high - NEAR_END * (high - low))]
    return inner if len(inner) > 1 else numbers


def _bar(title: str) -> dict[str, Any]:
    return {
        "title": {"text": title, "side": "top", "font": {"size": 13}},
        "orientation": "h",
        "thickness": 10,
        "nticks": 6,
        "outlinewidth": 0,
    }


def _arranged(count: int, *, stacked: bool) -> dict[str, Any]:
    """Where each scene and its scale of colours are, in shares of the figure."""
    places: dict[str, Any] = {}
    for k in range(count):
        which = str(k + 1) if k else ""
        if stacked:
            x, (low, high) = [0.0, 1.0], [(count - 1 - k) / count, (count - k) / count]
        else:
            x, (low, high) = spans(count, 0.03)[k], [0.0, 1.0]
        top = TOP / (TALL_ON_PHONE if stacked else TALL) * (high - low)
        places[f"scene{which}"] = {"domain": {"x": x, "y": [low, high - top]}}
        bar = {"x": sum(x) / 2, "xanchor": "center", "y": high, "yanchor": "top", "len": 0.7 * (x[1] - x[0])}
        places[f"coloraxis{which}"] = {"colorbar": bar}
    return places


def _merge(base: dict[str, Any], change: dict[str, Any]) -> dict[str, Any]:
    return {**base, **{k: _merge(base[k], v) if isinstance(v, dict) and k in base else v for k, v in change.items()}}


def _steps() -> list[str]:
    """The scale of colours in even steps."""
    last = 2 * (len(LIGHT_TO_DARK) - 1)
    return [colour_at(LIGHT_TO_DARK, step / last) for step in range(last + 1)]


def _annotation(text: str) -> dict[str, Any]:
    place = {"x": 0, "xanchor": "left", "y": 0, "yanchor": "top", "xref": "paper", "yref": "paper"}
    return {"text": text, "showarrow": False, "align": "left", **place}


def _note(view: View, places: Array) -> str:
    """Which places are not shown, and how far away they are."""
    beyond = places[~view.shows(places)]
    if not len(beyond):
        return ""
    away = np.linalg.norm(np.maximum(np.maximum(view.low - beyond, beyond - view.high), 0), axis=1).max()
    return f"Not shown: {len(beyond)} of {len(places)} places, up to {away:,.0f} mm beyond these axes"


def _where(places: Array, values: Array) -> str:
    if not np.isfinite(values).any():
        return ""
    x, y, z = places[int(np.nanargmax(values))]
    return f", largest at X {rounded_number(x)}, Y {rounded_number(y)}, Z {rounded_number(z)} mm"


def _sides(view: View) -> str:
    return "axes " + ", ".join(
        f"{name} {low:z,.0f} to {high:z,.0f} mm" for name, low, high in zip("XYZ", view.low, view.high, strict=True)
    )
