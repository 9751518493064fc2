"""A study as one page: the error against what was varied, maps over two keys, answers, and every scenario.

The files of a study by their names; who wants them on a disk writes them.

The first is the record that tells whose the others are.
"""

from collections.abc import Iterator, Sequence
from pathlib import PurePath
from typing import Any

from markupsafe import Markup

from compgen.core.unique_rows import grouped
from compgen.core.units import UM
from compgen.job.job import Job
from compgen.pipelines.study import Study, StudyRow
from compgen.report.answer_figures import TITLES, answer_figure, passes_rows
from compgen.report.band_words import rounded
from compgen.report.figure import Figure, Limit
from compgen.report.inputs import Inputs, job_inputs
from compgen.report.key_words import capital, title_of, unit_of, words_of
from compgen.report.live import NONE, LiveSection
from compgen.report.page import PLAIN, PageOptions, page
from compgen.report.study_figures import curves, error_map
from compgen.report.study_tables import (
    Grid,
    StudyOutcome,
    answer_csv,
    band_caveat,
    grid_of,
    largest_and_least,
    of_beyond_measured,
    plain,
    study_columns,
    study_csv,
    study_json,
)

MOST_ROWS = 500  # of the table on the page; the CSV file has all
#: columns that the page leaves to the CSV file
ONLY_IN_CSV = ("before_max_um", "after_max_um", "before_normal_max_um", "after_normal_max_um", "waypoints")


def study_html(title: str, outcome: StudyOutcome, *, options: PageOptions = PLAIN, live: str = "") -> bytes:
    """One page, the same bytes for the same inputs.

    Args:
        title: Its name.
        outcome: Of the study.
        options: Of the page.
        live: The part of the page that lives, as HTML.
    """
    study, rows, answers, base = outcome.study, outcome.rows, outcome.answers, outcome.base
    *sentences, caveat = study_sentences(outcome)
    inputs = Inputs() if base is None else job_inputs(base)
    shown: dict[str, Any] = {"grid": None, "figures": []}
    if study is not None and study.scenarios:
        grid = grid_of(study.keys, rows)
        figures = list(_figures(grid, study, _limit(study, base, outcome.max_um)))
        shown = {"grid": grid, "figures": figures, **_scenarios(study, grid, rows)}
        inputs = inputs.with_rows(("varied", _varied(grid)))
    return page(
        "study.html",
        title,
        inputs=inputs,
        options=options,
        sentences=[_printed(sentence) for sentence in sentences],
        caveat=_printed(caveat),
        answers=[(TITLES[answer.key], answer_figure(answer), answer.key, answer) for answer in answers],
        passes=passes_rows,
        live=Markup(live),
        **shown,
    )


def _figures(grid: Grid, study: Study, limit: Limit | None) -> Iterator[tuple[str, Figure, str, str]]:
    """Title, figure, id and note: of each key that varies, and of a map over the first two for each side."""
    if not grid.done:
        return
    for n, key in enumerate(study.keys):
        if key in grid.varied or len(study.keys) == 1:
            drawn, held = curves(grid, key, limit)
            yield f"Largest error against {words_of(key)}", drawn, f"vary{n}", held
    if len(grid.varied) >= 2:
        y, x = sorted(grid.varied[:2], key=lambda key: len(grid.values(key)))  # the longer one along the page
        for side in grid.sides:
            is_judged = side == grid.sides[-1] and limit is not None and (side == "after" or limit.is_asked)
            drawn, held = error_map(grid, x, y, side, limit if is_judged else None)
            heading = f"Largest error {side}, over {words_of(x)} and {words_of(y)}"
            yield heading, drawn, f"map_{side}", held


def _limit(study: Study, base: Job | None, max_um: float | None) -> Limit | None:
    """The bound that every scenario shares; None where there is none, or it is varied itself."""
    if max_um is not None:
        return Limit(f"--max-um {max_um:g} µm", max_um, is_asked=True)
    if base is None or base.bounds.max is None or "bounds.max_um" in study.keys:
        return None
    size = base.bounds.max / UM
    return Limit(f"bound {size:.6g} µm", size)


def _varied(grid: Grid) -> str:
    parts = []
    for key in grid.keys:
        values = [plain(value) for value in grid.values(key)]
        few = ", ".join(values) if len(values) <= 8 else f"{values[0]} to {values[-1]}, {len(values)} values"
        parts.append(f"{title_of(key)}: {few}")
    return "; ".join(parts)


def _printed(text: str) -> str:
    """A sentence with a page's signs, and with a capital unless it begins with a file's name."""
    text = text.replace(" um", " µm").replace("+-", "±")
    return capital(text) if text.split(" ", 1)[0].isalpha() else text


def _scenarios(study: Study, grid: Grid, rows: list[StudyRow]) -> dict[str, Any]:
    """Every scenario in words: those with an error, the others by their reasons, and what the columns are called."""
    hidden = ("state", "reason", *(name for row in rows for name in row if name.startswith("start_")))
    names = [n for n in study_columns(study, grid.done) if n not in hidden or n == "start_window_s"]
    reasons = grouped((str(row["reason"]), str(row["index"])) for row in grid.failed)
    legend = [(name, title_of(name)) for name in names]
    return {"failed": reasons, "legend": legend, "ranked": _ranked(grid, names) if grid.done else None}


def _ranked(grid: Grid, names: list[str]) -> dict[str, Any]:
    """What was varied and what came of it, the largest error first; what all have in common stands above."""
    by_error = f"{grid.sides[-1]}_on_part_max_um"
    ranked = sorted(grid.done, key=lambda row: (-row.get(by_error, 0.0), row["index"]))
    shown = {name: [_cell(grid, row, name) for row in ranked] for name in names if name not in ONLY_IN_CSV}
    common = [n for n, cells in shown.items() if len(cells) > 1 and len(set(cells)) == 1 and n != by_error]
    columns = sorted((n for n in shown if n not in common), key=lambda n: _place(grid, n))
    cells = [[shown[name][k] for name in columns] for k in range(min(len(ranked), MOST_ROWS))]
    cells[0] = [Markup("<strong>{}</strong>").format(cell) for cell in cells[0]]
    return {
        "side": grid.sides[-1],
        "more": len(ranked) - MOST_ROWS,
        "same": ", ".join(f"{words_of(n)} {shown[n][0]} {unit_of(n)}".rstrip() for n in common),
        "head": [title_of(name) for name in columns],
        "rows": cells,
        "words": [n for n, name in enumerate(columns) if name in grid.keys and name not in grid.numeric],
    }


def _place(grid: Grid, name: str) -> int:
    """Where a column stands: what was varied first, then the largest errors, the scenario's number last."""
    if name in grid.keys:
        return 0
    side = next((n for n, side in enumerate(("before_", "after_")) if name.startswith(side)), 2)
    return 9 if name == "index" else 1 + 2 * side + (not name.endswith("_on_part_max_um"))


def _cell(grid: Grid, row: StudyRow, name: str) -> str:
    """A value as the table shows it; the CSV file has all its digits."""
    if name in grid.keys:
        return plain(grid.value(row, name))
    value = row.get(name, "")
    if isinstance(value, bool):
        return "yes" if value else "no"
    if name == "band_um" and isinstance(value, float):
        return rounded(value)
    if isinstance(value, float):
        return f"{value:.2f}" if name.endswith(("_um", "_s")) else f"{value:.6g}"
    return str(value)


def study_files(
    path: str,
    overrides: Sequence[str],
    outcome: StudyOutcome,
    options: PageOptions = PLAIN,
    live: LiveSection = NONE,
) -> dict[str, bytes]:
    """The tables and the page of a study of a path file, and of the answers to its questions."""
    study, rows = outcome.study, outcome.rows
    sentences = study_sentences(outcome)
    return {
        "whatif.json": study_json(path, overrides, study, rows, sentences, outcome.base, live.record),
        **({"whatif.csv": study_csv(study, rows)} if study is not None else {}),
        **{f"{answer.key}.csv": answer_csv(answer) for answer in outcome.answers},
        "whatif.html": study_html(f"What if: {PurePath(path).stem}", outcome, options=options, live=live.html),
    }


def study_sentences(outcome: StudyOutcome) -> list[str]:
    """What a study comes to: a headline, a sentence for each question, and what none of the numbers says."""
    study, rows = outcome.study, outcome.rows
    of_scenarios = [largest_and_least(study, rows)] if study is not None else []
    return [
        *of_scenarios,
        *(answer.sentence for answer in outcome.answers),
        *of_beyond_measured(rows),
        band_caveat(rows),
    ]
