"""Two outputs side by side as one page: what changed in what went in, and in what came out."""

from typing import Any

import numpy as np
from markupsafe import Markup

from compgen.core.commands import Command
from compgen.core.json_text import json_text
from compgen.core.units import UM
from compgen.pipelines.comparison.comparison import Comparison, Pair
from compgen.report.compare_words import (
    MOST_ROWS,
    NOT_KNOWN,
    SAME,
    cell,
    change_of,
    comparison_record,
    file_of,
    input_cells,
    label_of,
    positions_sentence,
    printed_unit,
    ranked,
    what_changed,
    whose_output,
)
from compgen.report.curves import curves_in_words
from compgen.report.figure import (
    COOL,
    WARM,
    Figure,
    Trace,
    axis,
    figure,
    horizontal_line,
    limit_label,
    rows_to_draw,
    spans,
    trace,
)
from compgen.report.inputs import SHORT, Inputs
from compgen.report.key_words import capital, title_of
from compgen.report.page import PLAIN, PageOptions, page

A, B = "A", "B"
_MARKERS = ("circle", "diamond")
FEW = 60  # points of a curve, up to which each is marked
MANY = 1000  # beyond which a curve may cover the other


def comparison_files(
    comparison: Comparison, max_um: float | None = None, options: PageOptions = PLAIN
) -> dict[str, bytes]:
    """The record and the page of a comparison, by name."""
    return {
        "compare.json": json_text(comparison_record(comparison)),
        "compare.html": comparison_html(comparison, max_um, options),
    }


def comparison_html(comparison: Comparison, max_um: float | None, options: PageOptions) -> bytes:
    """One page; ``max_um`` is the largest error allowed of B [um], drawn as a limit."""
    kind, judged = "predicted", ""
    if max_um is not None and comparison.final_error is not None:
        broken = comparison.broken_bound(max_um)
        kind = "inside" if broken is None else "outside"
        judged = f" {broken or f'B is within --max-um {max_um:g} um'}."
    inputs, findings = comparison.inputs, comparison.findings
    return page(
        "compare.html",
        "Two outputs compared",
        inputs=_whose(comparison),
        options=options,
        kind=kind,
        words=f"{what_changed(comparison)}.{judged}",
        notes=comparison.notes,
        not_known=NOT_KNOWN,
        input_rows=None if inputs is None else [_input_row(pair, comparison.kind) for pair in inputs],
        most_rows=MOST_ROWS,
        error=_pairs(comparison.error),
        same=SAME,
        over=_over(comparison),
        courses=courses_figure(comparison, max_um),
        at_positions=comparison.kind in (Command.GENERATE, Command.PREDICT),
        has_scenarios=comparison.scenarios is not None,
        positions=positions_sentence(comparison),
        size=_pairs((*comparison.time, *comparison.program)),
        findings=[("gone", findings.gone), ("new", findings.new), ("with other numbers", findings.changed)],
    )


def _whose(comparison: Comparison) -> Inputs:
    """Both outputs, for the block of inputs and the foot of the page."""
    rows, hashes = [("of", f"cgen {comparison.kind}")], []
    for letter, whose in zip((A, B), (whose_output(comparison.a), whose_output(comparison.b)), strict=True):
        digest = str(whose["inputs_sha256"] or "")
        of_inputs = f", inputs sha256 {digest[:SHORT]}" if digest else ""
        rows.append((letter, f"{whose['name']} in {whose['output']}, by compgen {whose['compgen']}{of_inputs}"))
        hashes += [(f"{letter}: inputs", digest)] if digest else []
    return Inputs(tuple(rows), tuple(hashes))


def courses_figure(comparison: Comparison, max_um: float | None = None) -> Figure | None:
    """The errors of both over the path: before, and under it after on its own scale; None where no table has them."""
    sides = [
        (side, [None if course is None else getattr(course, side) for course in comparison.courses])
        for side in ("before", "after")
    ]
    sides = [(side, both) for side, both in sides if any(values is not None for values in both)]
    if not sides:
        return None
    traces: list[Trace] = []
    axes: dict[str, Any] = {}
    lowest = "" if len(sides) == 1 else str(len(sides))
    for n, ((side, both), span) in enumerate(zip(sides, reversed(spans(len(sides), 0.1)), strict=True)):
        which = "" if n == 0 else str(n + 1)
        for letter, values, course, colour, dash, marker in zip(
            (A, B), both, comparison.courses, (WARM, COOL), ("solid", "dash"), _MARKERS, strict=True
        ):
            if values is None or course is None:
                continue
            rows = rows_to_draw(np.nan_to_num(values))
            look = {"line": {"color": colour, "dash": dash, "width": 1.4}, "marker": {"symbol": marker, "size": 6}}
            mode = "lines+markers" if len(rows) <= FEW else "lines"
            seen_through = {"opacity": 0.7} if letter == B and len(rows) > MANY else {}
            xy = np.round(course.at[rows], 5), np.round(values[rows] / UM, 4)
            place = {"xaxis": f"x{which}", "yaxis": f"y{which}", "legendgroup": letter, "showlegend": n == 0}
            traces.append(trace("scatter", *xy, name=letter, mode=mode, **look, **place, **seen_through))
        axes[f"yaxis{which}"] = axis(f"{side} [µm]", anchor=f"x{which}", domain=span, rangemode="tozero")
        axes[f"xaxis{which}"] = {"anchor": f"y{which}", "domain": [0.0, 1.0]}
        if which != lowest:
            axes[f"xaxis{which}"].update(matches=f"x{lowest}", showticklabels=False)
    limits = [] if max_um is None else [limit_label(f"--max-um {max_um:g} µm", max_um, lowest)]
    shapes = [horizontal_line(max_um, lowest)] if max_um is not None else []
    title = next(course.title for course in comparison.courses if course is not None)
    axes[f"xaxis{lowest}"] |= axis(title)
    alt = curves_in_words(f"Errors over the {_over(comparison)}, before and then after", traces, "µm")
    return figure(traces, 240 * len(sides) + 60, alt, shapes=shapes, annotations=limits, **axes)


def _over(comparison: Comparison) -> str:
    """What the errors are drawn over."""
    return {Command.CORRECT: "stations", Command.HEAT: "runs", Command.WHATIF: "scenarios"}.get(comparison.kind, "path")


def _input_row(pair: Pair, kind: Command) -> tuple[str, ...]:
    what = Markup("{}<br><code>{}</code> of the {}").format(
        capital(title_of(pair.key)), pair.key, file_of(pair.key, kind)
    )
    return what, *input_cells(pair)


def _pairs(pairs: tuple[Pair, ...]) -> list[list[str]]:
    rows = []
    for pair in ranked(pairs):
        unit = printed_unit(pair.key)
        label = capital(label_of(pair.key)) + (f" [{unit}]" if unit else "")
        rows.append([label, cell(pair.a, pair.key), cell(pair.b, pair.key), change_of(pair)])
    return rows
