"""What a reader sees of a job at its end, or of several."""

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

from rich.table import Table
from rich.text import Text

from compgen.cli.screen.ci_reports import JudgedPath
from compgen.cli.screen.messages import finding_rows, sizes_table, table_of, titled
from compgen.core.exit_codes import ExitCode
from compgen.core.finding_codes import Code
from compgen.core.units import counted
from compgen.pipelines.planned.job_results import Corrected, Planned
from compgen.report import job_summary
from compgen.report.band_words import before_and_after, gain_words, guaranteed_text, is_corrected, not_known_words

ROWS = (  # row of the report, its label, its bound
    ("total", "TCP error, um", "max_um"),
    ("feed", "along feed, um", "feed_um"),
    ("cross", "cross feed, um", "cross_um"),
    ("normal", "along tool, um", "normal_um"),
    ("axis_angle", "tool axis, mdeg", "axis_mdeg"),
)
_SIZES = ("max_um", "p99_um", "rms_um")
STARTS = "one file for many starts, largest error on the part, um"
MOST_LISTED = 4  # numbered files of one name; of more, only the first and the last are


def job_shown(
    planned: Planned, corrected: Corrected | None, folder: Path | None, files: Iterable[str], *, verbose: bool
) -> Iterator[object]:
    """The errors, then in four sentences: before and after, what is not known, what to read, what was written."""
    summary = job_summary(planned, corrected)
    yield Text(" ".join((planned.job.title or planned.job.name).split()), style="bold")
    if is_corrected(summary) or corrected is None or verbose:
        yield _errors_table(summary)
    if summary.get("guaranteed"):
        yield guaranteed_text(summary["guaranteed"])
    path, time, heat = summary["path"], summary["timing"], summary["thermal"]
    yield (
        f"{path['waypoints']} waypoints, {path['length_m']:.2f} m, {time['duration_s']:.1f} s, "
        f"{100 * time['at_feed']:.1f} % of the length at feed, {counted(path['stops'], 'stop', 'stops')}"
    )
    if verbose:
        rises = ", ".join(f"{n} {heat['start_K'][n]:.2f} to {heat['end_K'][n]:.2f}" for n in heat["start_K"])
        yield f"rise [K]{' mean over the starts' if 'average_over' in summary else ''}: {rises}"
    if corrected and corrected.averaged is not None:
        yield from titled(STARTS, _starts_table(summary["average_over"]))
    robot_file = summary["provenance"]["robot_file"]
    yield from (
        f"{before_and_after(summary)}{gain_words(summary)}",
        not_known_words(summary["band"], verbose=verbose),
        *finding_rows(summary["findings"], verbose=verbose),
        f"robot file {robot_file['path']}, sha256 {robot_file['sha256'][:16]}",
        *(() if folder is None else (f"wrote {name_list(files)} to {folder}",)),
    )


def _errors_table(summary: dict[str, Any]) -> Table:
    """The error on the part by its parts, and its bounds, which judge it there."""
    on_part = summary["on_part"]
    sides = [side for side in ("before", "after") if on_part[side]]
    rows = [
        [label, *(f"{v:.2f}" for side in sides for v in on_part[side][row].values()), _bound(summary, key)]
        for row, label, key in ROWS
    ]
    return sizes_table("on the part", sides if summary["after"] else ["predicted"], rows, "bound")


def _bound(report: dict[str, Any], key: str) -> str:
    bound = report["bounds"].get(key)
    return "" if bound is None else f"{bound:g}"


def outcomes_shown(outcomes: Sequence[JudgedPath]) -> list[object]:
    """What became of each of several paths, what a project's file gave them, and how many are inside."""
    rows = []
    for outcome in outcomes:
        report = outcome.summary
        kind = "" if outcome.code is None else ExitCode(outcome.code).kind
        words, sizes = (kind, ["", "", ""]) if report is None else (report["verdict"], _largest(report))
        rows.append([Text(outcome.path), words, *sizes, f"{outcome.seconds:.1f}"])
    head = ("path", "outcome", "before max, um", "after max, um", "bound, um", "s")
    findings = [finding for outcome in outcomes for finding in (outcome.summary or {}).get("findings", ())]
    of_project = {finding["message"]: finding for finding in findings if finding["code"] == Code.PROJECT_FILE}
    inside = sum(outcome.code == 0 for outcome in outcomes)
    return [
        table_of(head, rows, slice(2, None)),
        *finding_rows(of_project.values(), verbose=False),
        f"{inside} of {len(outcomes)} paths inside their bounds",
    ]


def _largest(report: dict[str, Any]) -> list[str]:
    """The largest error on the part before and after, and its bound."""
    sides = (report["on_part"][side] for side in ("before", "after"))
    return [*(f"{errors['total']['max_um']:.2f}" for errors in sides), _bound(report, "max_um")]


def _starts_table(average: dict[str, Any]) -> Table:
    """What one file leaves at each start that was flown, and what one made anew for it would."""
    rows = [["mean of the rises", *(f"{average['at_mean'][key]:.2f}" for key in _SIZES), ""]]
    for one in average["flown"]:
        words = f"run {one['run']}, {one['delay_s']:.0f} s late, {one['override_percent']:.4g} %"
        anew = one["remade_max_um"]
        rows.append([words, *(f"{one[k]:.2f}" for k in _SIZES), "none is legal" if anew is None else f"{anew:.2f}"])
    return table_of(("start", "this file", "p99", "rms", "made anew"), rows, slice(1, None))


def name_list(files: Iterable[str]) -> str:
    """Names of files, numbered ones in a row as the first and the last of them."""
    parts: list[str] = []
    for stem, group in groupby(sorted(files), lambda name: re.sub(r"_\d{2,}(?=\.LS$)", "", name)):
        group_names = list(group)
        numbered = [name for name in group_names if name != stem]
        if len(numbered) <= MOST_LISTED:
            parts += group_names
        else:
            parts += [name for name in group_names if name == stem] + [f"{numbered[0]} to {numbered[-1]}"]
    return ", ".join(parts)
