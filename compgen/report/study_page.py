"""A study as one page: the error against what was varied, maps over two keys, answers, and every scenario."""

from html import escape

from compgen.core.units import UM
from compgen.job.job import Job
from compgen.pipelines.study import Answer, Row, Study
from compgen.report.answer_figures import TITLES, answer_figure, passes_table
from compgen.report.band_words import rounded
from compgen.report.figure_limits import Limit
from compgen.report.inputs import Inputs, job_inputs
from compgen.report.key_words import capital, title_of, unit_of, words_of
from compgen.report.page import PLAIN, PageOptions, figure_section, page, section, verdict
from compgen.report.study_figures import curves, error_map
from compgen.report.study_grid import Grid, grid_of, plain
from compgen.report.study_tables import band_caveat, column_names, headline
from compgen.report.table import table

MOST_ROWS = 500  # of the table on the page; the CSV file has all
#: columns that the page leaves to the CSV file
ONLY_IN_CSV = ("before_max_um", "after_max_um", "before_normal_max_um", "after_normal_max_um", "waypoints")


def study_html(
    title: str, study: Study | None, rows: list[Row], answers: list[Answer], base: Job | None = None,
    options: PageOptions = PLAIN, live: str = "", max_um: float | None = None,
) -> bytes:  # fmt: skip
    """One page, the same bytes for the same inputs.

    Args:
        title: Its name.
        study: None where only questions were asked.
        rows: Of its scenarios.
        answers: To the questions.
        base: The job that all scenarios share; None where none can be read without their values.
        options: Of the page.
        live: The part of the page that lives, as HTML.
        max_um: The largest error allowed [um], where the command line says one.
    """
    has_scenarios = study is not None and bool(study.scenarios)
    sentences = [headline(study, rows)] if study is not None and has_scenarios else []
    sentences += [answer.sentence for answer in answers]
    opening = "".join(verdict("predicted", escape(_printed(sentence))) for sentence in sentences)
    opening += f'<p class="lead">{escape(_printed(band_caveat(rows)))}.</p>'
    body, inputs = "", None if base is None else job_inputs(base)
    if study is not None and has_scenarios:
        grid = grid_of(study.keys, rows)
        body += _figures(grid, study, _limit(study, base, max_um))
        inputs = (inputs or Inputs()).with_rows(("varied", _varied(grid)))
    for answer in answers:
        body += figure_section(TITLES[answer.key], answer_figure(answer), answer.key)
        body += passes_table(answer) if answer.key == "passes" else ""
    body += live
    if study is not None and has_scenarios:
        body += _scenarios(study, grid, rows)
    return page(title, body, opening, inputs, options=options)


def _figures(grid: Grid, study: Study, limit: Limit | None) -> str:
    """A figure over each key that has more than one value, and a map over the first two for each side of the error."""
    body = ""
    if not grid.done:
        return body
    for n, key in enumerate(study.keys):
        if key in grid.varied or len(study.keys) == 1:
            drawn, held = curves(grid, key, limit)
            body += figure_section(f"Largest error against {escape(words_of(key))}", drawn, f"vary{n}", _note(held))
    if len(grid.varied) >= 2:
        y, x = sorted(grid.varied[:2], key=lambda key: len(grid.values(key)))  # the longer one along the page
        for side in grid.sides:
            is_judged = side == grid.sides[-1] and limit is not None and (side == "after" or limit.is_asked)
            judged = limit if is_judged else None
            drawn, held = error_map(grid, x, y, side, judged)
            heading = f"Largest error {side}, over {escape(words_of(x))} and {escape(words_of(y))}"
            body += figure_section(heading, drawn, f"map_{side}", _note(held))
    return body


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


def _note(text: str) -> str:
    return f'<p class="lead">{escape(text)}</p>' if text else ""


def _printed(text: str) -> str:
    """A sentence with a page's signs, and with a capital unless it begins with a file's name."""
    text = text.replace(" um", " µm").replace("+-", "±")
    return capital(text) if text.split(" ", 1)[0].isalpha() else text


def _scenarios(study: Study, grid: Grid, rows: list[Row]) -> str:
    """Every scenario in words, the largest error first and in bold; then those that failed, by reason."""
    hidden = ("state", "reason", *(name for row in rows for name in row if name.startswith("start_")))
    names = [n for n in column_names(study, grid.done) if n not in hidden or n == "start_window_s"]
    text = _ranked(grid, names) if grid.done else ""
    columns = "".join(f"<dt><code>{escape(name)}</code></dt><dd>{escape(title_of(name))}</dd>" for name in names)
    legend = f"<details><summary>Columns of whatif.csv</summary><dl>{columns}</dl></details>"
    return section("Scenarios", f"{text}{_failed(grid)}{legend}")


def _ranked(grid: Grid, names: list[str]) -> str:
    """What was varied and what came of it, the largest error first; what all have in common stands above."""
    side = grid.sides[-1]
    by_error = f"{side}_on_part_max_um"
    ranked = sorted(grid.done, key=lambda row: (-row.get(by_error, 0.0), row["index"]))
    shown = {name: [_cell(grid, row, name) for row in ranked] for name in names if name not in ONLY_IN_CSV}
    common = [n for n, cells in shown.items() if len(cells) > 1 and len(set(cells)) == 1 and n != by_error]
    columns = sorted((n for n in shown if n not in common), key=lambda n: _place(grid, n))
    cells = [[shown[name][k] for name in columns] for k in range(min(len(ranked), MOST_ROWS))]
    cells[0] = [f"<strong>{cell}</strong>" for cell in cells[0]]
    words = [n for n, name in enumerate(columns) if name in grid.keys and name not in grid.numeric]
    more = f"; {len(ranked) - MOST_ROWS} more are in the CSV file" if len(ranked) > MOST_ROWS else ""
    same = ", ".join(f"{escape(words_of(n))} {shown[n][0]} {unit_of(n)}".rstrip() for n in common)
    text = f"The largest error {side} first{more}. " + (f"The same in all: {same}. " if same else "")
    text = f'<p class="lead">{text}All columns and digits: <a href="whatif.csv">whatif.csv</a>.</p>'
    return text + table([escape(title_of(name)) for name in columns], cells, words, stacks=False)


def _place(grid: Grid, name: str) -> int:
    """Where a column stands: what was varied first, then the largest errors, the scenario's number last."""
    if name in grid.keys:
        return 0
    side = next((n for n, side in enumerate(("before_", "after_")) if name.startswith(side)), 2)
    return 9 if name == "index" else 1 + 2 * side + (not name.endswith("_on_part_max_um"))


def _failed(grid: Grid) -> str:
    """The scenarios without an error, those with one reason together."""
    reasons: dict[str, list[str]] = {}
    for row in grid.failed:
        reasons.setdefault(str(row["reason"]), []).append(str(row["index"]))
    lines = "".join(
        f'<li class="outside">failed: scenario{"s" if len(which) > 1 else ""} {", ".join(which)}: {escape(reason)}</li>'
        for reason, which in reasons.items()
    )
    return f'<ul class="findings">{lines}</ul>' if lines else ""


def _cell(grid: Grid, row: Row, name: str) -> str:
    """A value as the table shows it; the CSV file has all its digits."""
    if name in grid.keys:
        return escape(plain(grid.value(row, name)))
    value = row.get(name, "")
    if isinstance(value, bool):
        return "yes" if value else "no"
    if name == "band_um" and isinstance(value, float):
        return rounded(value)
    if isinstance(value, float):
        return f"{value:.2f}" if name.endswith(("_um", "_s")) else f"{value:.6g}"
    return escape(str(value))
