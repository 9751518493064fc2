"""A study as one page, a CSV table and JSON: curves of the error against what was varied, and answers."""

import csv
import io
import json
from html import escape
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from compgen.report.page import COOL, GREY, LINES, WARM, div, dress, page
from compgen.study import Answer, Row, Study

TITLES = {
    "warmup": "Drift within one program after a warm-up",
    "validity": "What a late start, or another ambient, adds to one corrected file",
    "contributions": "Where the error comes from",
    "steady": "The way to the steady state",
    "passes": "Orders and feeds of the passes",
}
MOST_ROWS = 500  # of the table on the page; the CSV file has all


def study_csv(study: Study, rows: list[Row]) -> bytes:
    """A row for each scenario, in the order of the study."""
    return _csv(_columns(study, rows), rows)


def answer_csv(answer: Answer) -> bytes:
    """The numbers behind an answer."""
    names = [*answer.columns, *(["what"] if answer.labels else [])]
    rows = [
        {
            **{n: "" if np.isnan(v) else float(f"{v:.6g}") for n, v in zip(answer.columns, line)},
            **({"what": answer.labels[i]} if answer.labels else {}),
        }
        for i, line in enumerate(answer.table)
    ]
    return _csv(names, rows)


def _csv(names: list[str], rows: list[Row]) -> bytes:
    out = io.StringIO()
    writer = csv.DictWriter(out, names, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return out.getvalue().encode()


def _columns(study: Study, rows: list[Row]) -> list[str]:
    names = ["index", *study.keys, "state"]
    for row in rows:
        names += [n for n in row if n not in names and n != "reason"]
    return [*names, "reason"]


def study_json(study: Study, rows: list[Row], sentences: list[str]) -> bytes:
    """The same for machines."""
    data = {
        "schema": 1,
        "path": study.path,
        "study_sha256": study.identity,
        "keys": list(study.keys),
        "overrides": list(study.base),
        "answers": sentences,
        "scenarios": rows,
    }
    return (json.dumps(data, indent=1, allow_nan=False) + "\n").encode()


def headline(study: Study, rows: list[Row]) -> str:
    """What a grid shows, in one sentence."""
    good = [r for r in rows if r["state"] == "done"]
    failed = len(rows) - len(good)
    told = f"{len(rows)} scenarios" + (f", {failed} failed" if failed else "")
    if not good:
        return told
    low, high = (f(good, key=lambda r: (r["before_max_um"], r["index"])) for f in (min, max))

    def at(row: Row) -> str:
        return ", ".join(f"{k.split('.')[-1]} = {row[k]}" for k in study.keys)

    told += f": error {low['before_max_um']:.1f} um ({at(low)}) to {high['before_max_um']:.1f} um ({at(high)})"
    if any("after_max_um" in r for r in good):
        worst = max((r for r in good if "after_max_um" in r), key=lambda r: r["after_max_um"])
        outside = sum(not r.get("inside", True) for r in good)
        told += f"; corrected at most {worst['after_max_um']:.2f} um, {outside} outside bounds"
    return told


def study_html(title: str, study: Study | None, rows: list[Row], answers: list[Answer]) -> bytes:
    """One self-contained page."""
    body = "".join(f'<p class="big predicted">{escape(a.sentence)}</p>' for a in answers)
    if study is not None and study.scenarios:
        body = f'<p class="big predicted">{escape(headline(study, rows))}</p>{body}'
        body += "".join(
            f"<h2>Error against {escape(key)}</h2>{div(_against(study, rows, key), f'vary{n}')}"
            for n, key in enumerate(study.keys)
        )
    for answer in answers:
        body += f"<h2>{TITLES[answer.key]}</h2>{div(_curve(answer), answer.key)}"
    if study is not None and study.scenarios:
        body += _table(study, rows)
    return page(title, body)


def _against(study: Study, rows: list[Row], key: str) -> go.Figure:
    figure = go.Figure()
    good = [r for r in rows if r["state"] == "done"]
    numbers = [_number(r[key]) for r in good]
    plain = all(n is not None for n in numbers)
    others = [k for k in study.keys if k != key]
    groups: dict[str, list[tuple[Any, Row]]] = {}
    for number, row in zip(numbers, good):
        name = ", ".join(f"{k.split('.')[-1]} = {row[k]}" for k in others)
        groups.setdefault(name, []).append((number if plain else str(row[key]), row))
    for n, (name, points) in enumerate(groups.items()):
        points.sort(key=lambda p: p[0])
        tint = LINES[n % len(LINES)]
        for side, dash, colour in (("before", "solid", WARM if not others else tint), ("after", "dot", COOL)):
            shown = [(x, r[f"{side}_max_um"]) for x, r in points if f"{side}_max_um" in r]
            if shown:
                figure.add_scatter(
                    x=[p[0] for p in shown],
                    y=[p[1] for p in shown],
                    name=f"{side} {name}".strip(),
                    mode="lines+markers" if len(shown) < 60 else "lines",
                    line={"color": colour, "dash": dash, "width": 1.5},
                    showlegend=n < 12,
                )
    figure.update_xaxes(title_text=key)
    figure.update_yaxes(title_text="largest error [µm]", rangemode="tozero")
    return dress(figure, 380)


def _number(value: Any) -> float | None:
    try:
        return float(value)
    except (TypeError, ValueError):
        return None


def _curve(answer: Answer) -> go.Figure:
    figure = go.Figure()
    if answer.key == "contributions":
        figure.add_bar(
            x=list(answer.labels),
            y=np.round(answer.table[:, 1], 3),
            marker={"color": WARM},
            name="of the largest error",
        )
        figure.add_bar(
            x=list(answer.labels), y=np.round(answer.table[:, 2], 3), marker={"color": GREY}, name="its own largest"
        )
        figure.update_yaxes(title_text="µm")
        return dress(figure, 380)
    if answer.key == "passes":
        figure.add_scatter(
            x=np.round(answer.table[:, 1], 4), y=np.round(answer.table[:, 2], 4), mode="markers",
            text=[f"{w}, {f:g} mm/s" for w, f in zip(answer.labels, answer.table[:, 0])], marker={"color": WARM},
        )  # fmt: skip
        figure.update_xaxes(title_text="minutes")
        figure.update_yaxes(title_text="error_um")
        return dress(figure, 380)
    pairs = [(0, 1), (2, 3)] if answer.key == "validity" else [(0, k) for k in range(1, len(answer.columns))]
    columns = 2 if answer.key == "validity" else 1
    figure = make_subplots(rows=1, cols=columns, shared_yaxes=True, horizontal_spacing=0.05)
    for n, (x, y) in enumerate(pairs):
        seen = ~np.isnan(answer.table[:, x])
        place = {"row": 1, "col": n + 1 if columns == 2 else 1}
        figure.add_scatter(
            x=np.round(answer.table[seen, x], 4), y=np.round(answer.table[seen, y], 4), name=answer.columns[y],
            line={"color": LINES[n], "width": 1.5}, **place,
        )  # fmt: skip
        figure.update_xaxes(title_text=answer.columns[x], **place)
    figure.update_yaxes(title_text="µm", rangemode="tozero", row=1, col=1)
    return dress(figure, 380)


def _table(study: Study, rows: list[Row]) -> str:
    names = [n for n in _columns(study, rows) if not n.startswith("start_") or n == "start_window_s"]
    head = "".join(f"<th>{escape(n)}</th>" for n in names)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(str(row.get(n, '')))}</td>" for n in names) + "</tr>" for row in rows[:MOST_ROWS]
    )
    more = f"<p class=lead>{len(rows) - MOST_ROWS} more in the CSV file</p>" if len(rows) > MOST_ROWS else ""
    return (
        f'<h2>Scenarios</h2><div style="overflow-x:auto"><table><thead><tr>{head}</tr></thead>'
        f"<tbody>{body}</tbody></table></div>{more}"
    )
