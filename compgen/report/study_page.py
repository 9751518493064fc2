"""A study as one page: curves of the error against what was varied, and answers."""

from html import escape
from typing import Any

import numpy as np

from compgen.pipelines.job import Job
from compgen.pipelines.study import Answer, Row, Study
from compgen.report.figure import COOL, GREY, LINES, WARM, Figure, axis, figure, spans, trace
from compgen.report.figure_words import curves_in_words
from compgen.report.inputs import job_inputs
from compgen.report.page import PLAIN, PageOptions, figure_section, page, section, verdict
from compgen.report.study_tables import band_caveat, column_names, headline
from compgen.report.table import table

TITLES = {
    "warmup": "Drift within one program after a warm-up",
    "validity": "What a late start, or another ambient, adds to one corrected file",
    "contributions": "Where the error comes from",
    "steady": "The way to the steady state",
    "passes": "Orders and feeds of the passes",
}
MOST_ROWS = 500  # of the table on the page; the CSV file has all


def study_html(
    title: str, study: Study | None, rows: list[Row], answers: list[Answer], base: Job | None = None,
    options: PageOptions = PLAIN, live: str = "",
) -> bytes:  # fmt: skip
    """One page, the same bytes for the same inputs.

    ``base`` is the job that all scenarios share, ``live`` the part of the page that lives.
    """
    opening, body = "".join(verdict("predicted", escape(a.sentence)) for a in answers), ""
    if study is not None and study.scenarios:
        opening = verdict("predicted", escape(headline(study, rows))) + opening
    opening += f'<p class="lead">{escape(band_caveat(rows))}</p>'
    if study is not None and study.scenarios:
        body += "".join(
            figure_section(f"Error against {escape(key)}", error_against(study, rows, key), f"vary{n}")
            for n, key in enumerate(study.keys)
        )
    for answer in answers:
        body += figure_section(TITLES[answer.key], answer_figure(answer), answer.key)
    body += live
    if study is not None and study.scenarios:
        body += _table(study, rows)
    return page(title, body, opening, None if base is None else job_inputs(base), options=options)


def error_against(study: Study, rows: list[Row], key: str) -> Figure:
    """The largest error over the values of one key, a curve for each combination of the others."""
    traces = []
    done = [r for r in rows if r["state"] == "done"]
    numbers = [_number(r[key]) for r in done]
    numeric = all(n is not None for n in numbers)
    others = [k for k in study.keys if k != key]
    groups: dict[str, list[tuple[Any, Row]]] = {}
    for number, row in zip(numbers, done):
        name = ", ".join(f"{k.split('.')[-1]} = {row[k]}" for k in others)
        groups.setdefault(name, []).append((number if numeric else str(row[key]), row))
    for n, (name, points) in enumerate(groups.items()):
        points.sort(key=lambda p: p[0])
        line_colour = LINES[n % len(LINES)]
        for side, dash, colour in (("before", "solid", WARM if not others else line_colour), ("after", "dot", COOL)):
            shown = [(x, r[f"{side}_max_um"]) for x, r in points if f"{side}_max_um" in r]
            if shown:
                look = {"name": f"{side} {name}".strip(), "line": {"color": colour, "dash": dash, "width": 1.5}}
                mode = "lines+markers" if len(shown) < 60 else "lines"
                xy = ([p[k] for p in shown] for k in range(2))
                traces.append(trace("scatter", *xy, mode=mode, showlegend=n < 12, **look))
    alt = curves_in_words(f"Largest error against {key}", traces, "µm")
    return figure(traces, 380, alt, xaxis=axis(key), yaxis=axis("largest error [µm]", rangemode="tozero"))


def _number(value: Any) -> float | None:
    try:
        return float(value)
    except (TypeError, ValueError):
        return None


def answer_figure(answer: Answer) -> Figure:
    """The curve, or the bars, behind an answer."""
    if answer.key == "contributions":
        bars = (("of the largest error", WARM), ("its own largest", GREY))
        traces = [
            trace("bar", list(answer.labels), np.round(answer.table[:, k], 3), marker={"color": colour}, name=name)
            for k, (name, colour) in enumerate(bars, 1)
        ]
        return figure(traces, 380, curves_in_words(TITLES[answer.key], traces, "µm"), yaxis=axis("µm"))
    if answer.key == "passes":
        text = [f"{w}, {f:g} mm/s" for w, f in zip(answer.labels, answer.table[:, 0])]
        xy = (np.round(answer.table[:, k], 4) for k in (1, 2))
        points = trace("scatter", *xy, mode="markers", text=text, marker={"color": WARM})
        alt = curves_in_words(TITLES[answer.key], [points], "µm")
        return figure([points], 380, alt, xaxis=axis("minutes"), yaxis=axis("error_um"))
    side_by_side = answer.key == "validity"  # two plots
    pairs = [(0, 1), (2, 3)] if side_by_side else [(0, k) for k in range(1, len(answer.columns))]
    traces, axes = [], {"yaxis": axis("µm", rangemode="tozero", anchor="x", domain=[0.0, 1.0])}
    for n, (x, y) in enumerate(pairs):
        known = ~np.isnan(answer.table[:, x])
        which = "2" if side_by_side and n else ""
        xy = (np.round(answer.table[known, k], 4) for k in (x, y))
        look = {"name": answer.columns[y], "line": {"color": LINES[n], "width": 1.5}}
        traces.append(trace("scatter", *xy, xaxis=f"x{which}", yaxis=f"y{which}", **look))
        span = spans(2, 0.05)[n] if side_by_side else [0.0, 1.0]
        axes[f"xaxis{which}"] = axis(answer.columns[x], anchor=f"y{which}", domain=span)
    if side_by_side:
        axes["yaxis2"] = {"anchor": "x2", "domain": [0.0, 1.0], "matches": "y", "showticklabels": False}
    return figure(traces, 380, curves_in_words(TITLES[answer.key], traces, ""), **axes)


def _table(study: Study, rows: list[Row]) -> str:
    names = [n for n in column_names(study, rows) if not n.startswith("start_") or n == "start_window_s"]
    cells = [[escape(str(row.get(name, ""))) for name in names] for row in rows[:MOST_ROWS]]
    more = f"<p class=lead>{len(rows) - MOST_ROWS} more in the CSV file</p>" if len(rows) > MOST_ROWS else ""
    return section("Scenarios", table([escape(name) for name in names], cells) + more)
