"""The table that a correction prints at its end."""

from collections.abc import Iterable
from pathlib import Path

from compgen.cli.screen.messages import print_findings, print_table, sizes_table, stdout_console
from compgen.pipelines.correct import Correction
from compgen.report.band_words import before_and_after, gain_words, guaranteed_text, not_known_words
from compgen.report.correction import correction_summary

MOST_STATEMENTS, FEW_STATEMENTS = 40, 5  # unsafe ones that are printed, asked for more and not


def show_correction(correction: Correction, folder: Path, files: Iterable[str], *, verbose: bool) -> None:
    """Print the errors, then: before and after, what is not known, what to read, what was written."""
    summary = correction_summary(correction)
    console = stdout_console()
    if summary["before"]:
        table = sizes_table("error", ("before", "after"))
        for key, label in (("total", "position, um"), ("turn", "orientation, mdeg")):
            table.add_row(label, *(f"{v:.2f}" for side in ("before", "after") for v in summary[side][key].values()))
        print_table(console, f"{summary['name']} on {summary['provenance']['robot']}", table)
    if "guaranteed" in summary:
        console.print(guaranteed_text(summary["guaranteed"]))
    if summary["before"]:
        console.print(f"{before_and_after(summary)}{gain_words(summary)}")
    console.print(f"verdict: {summary['verdict']}")
    count = summary["positions"]
    console.print(
        f"{count['corrected']} positions corrected, {count['new']} new, {count['unchanged']} unchanged; "
        f"{summary['duration_s']:.1f} s"
    )
    if verbose:
        heat = summary["thermal"]
        rises = (f"{n} {v:.2f} to {heat['end_K'][n]:.2f}" for n, v in heat["start_K"].items())
        console.print(f"rise [K]: {', '.join(rises)}")
    if summary["before"] and summary["band"]:
        console.print(not_known_words(summary["band"], verbose=verbose))
    print_findings(console, summary["findings"], verbose=verbose)
    most = MOST_STATEMENTS if verbose else FEW_STATEMENTS
    for statement in summary["unsafe"][:most]:
        console.print(f"  line {statement['line']}: {statement['text']}: {statement['reason']}")
    if len(summary["unsafe"]) > most:
        console.print(f"  and {len(summary['unsafe']) - most} more, all in report.json")
    console.print(f"wrote {', '.join(sorted(files))} to {folder}")
