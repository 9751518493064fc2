"""The table that a correction prints at its end."""

from collections.abc import Iterable
from pathlib import Path

from compgen.cli.screen.messages import print_findings, print_table, sizes_table, stdout_console
from compgen.pipelines.correct import Correction
from compgen.report.band_words import guaranteed_text, headline
from compgen.report.correction import correction_summary

MOST_STATEMENTS = 40  # unsafe ones that are printed


def show_correction(correction: Correction, folder: Path, files: Iterable[str]) -> None:
    """Print the errors before and after, the positions, the warmth, the findings and the files."""
    summary = correction_summary(correction)
    console = stdout_console()
    if summary["before"]:
        table = sizes_table("error", ("before", "after"))
        for key, label in (("total", "position, um"), ("turn", "orientation, mdeg")):
            table.add_row(label, *(f"{v:.2f}" for side in ("before", "after") for v in summary[side][key].values()))
        print_table(console, f"{summary['name']} on {summary['provenance']['robot']}", table)
    if summary["before"] and summary["band"]:
        console.print(headline(summary))
    if "guaranteed" in summary:
        console.print(guaranteed_text(summary["guaranteed"]))
    console.print(f"verdict: {summary['verdict']}")
    count = summary["positions"]
    console.print(
        f"{count['corrected']} positions corrected, {count['new']} new, {count['unchanged']} unchanged; "
        f"{summary['duration_s']:.1f} s"
    )
    heat = summary["thermal"]
    console.print(
        "rise [K]: " + ", ".join(f"{n} {v:.2f} to {heat['end_K'][n]:.2f}" for n, v in heat["start_K"].items())
    )
    print_findings(console, summary["findings"])
    for statement in summary["unsafe"][:MOST_STATEMENTS]:
        console.print(f"  line {statement['line']}: {statement['text']}: {statement['reason']}")
    if len(summary["unsafe"]) > MOST_STATEMENTS:
        console.print(f"  and {len(summary['unsafe']) - MOST_STATEMENTS} more, all in report.json")
    console.print(f"wrote {', '.join(sorted(files))} to {folder}")
