"""What ``resume`` prints at its end: each page before and after, the join, the findings."""

from collections.abc import Sequence
from pathlib import Path

from rich.table import Table

from compgen.cli.screen.messages import finding_lines, print_table, sizes_table, stdout_console
from compgen.core.units import UM, limit_words
from compgen.pipelines.resume.result import PageResult, Resumed
from compgen.report.band_words import not_known_words, rounded
from compgen.report.resume import band_of_resumed


def pages_table(pages: Sequence[PageResult]) -> Table:
    """Each page before and after."""
    table = sizes_table("on the part, um", ("before", "after"))
    for page in pages:
        sides = (page.before, page.after)
        table.add_row(page.file, *(f"{getattr(s, name) / UM:.2f}" for s in sides for name in ("max", "p99", "rms")))
    return table


def show_resumed(resumed: Resumed, folder: Path, *, is_written: bool, verbose: bool) -> None:
    """Print the pages, why, and what became of them."""
    console = stdout_console()
    planned, begun = resumed.planned, resumed.begun
    print_table(console, f"{planned.job.name} from page {resumed.from_page} on", pages_table(resumed.pages))
    rises = ", ".join(
        f"{name} {now:.2f} ({now - then:+.2f})"
        for name, now, then in zip(
            planned.job.heat.names, planned.rise[0].tolist(), resumed.planned_rise.tolist(), strict=True
        )
    )
    lines = [f"because {begun.why}; rise [K], and against the plan: {rises}"]
    if resumed.join is not None:
        join = resumed.join
        place = "on the part" if join.on_the_part else "off the part"
        lines.append(
            f"join {place}: the tool steps by {join.step / UM:.2f} um, {join.demanded / UM:.2f} have drifted, "
            f"{join.beyond / UM:.2f} beyond that; start within {limit_words(resumed.starts[0].window)}"
        )
    largest = resumed.deviation.on_part["total"].max / UM
    lines.append(f"with the new pages: {rounded(largest)} um left by calculation")
    lines.append(not_known_words(band_of_resumed(resumed), verbose=verbose))
    lines += finding_lines(resumed.findings, verbose=verbose)
    if is_written:
        count = len(resumed.replaced)
        names = resumed.replaced[0] if count == 1 else f"{resumed.replaced[0]} to {resumed.replaced[-1]}"
        lines.append(f"wrote {names} anew, {resumed.written.manifest_file}, resume.html, resume.json in {folder}")
    elif not resumed.replaced:
        lines.append("nothing to do: the pages in the folder are these already")
    for line in lines:
        console.print(line)
