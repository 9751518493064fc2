"""The tables that identify and validate print at their end."""

from typing import Any

from rich.table import Table

from compgen.cli.screen.messages import print_findings, stdout_console
from compgen.identification.identify import Identification
from compgen.report.identification import identification_summary, ladder_cells, limits_sentence

MOST_PARAMETERS = 20  # that are printed, those that move the tool most first


def show_identification(identified: Identification, *, verbose: bool) -> None:
    """Print the models tried, how well the joints were covered, the parameters, the findings and the verdict."""
    summary = identification_summary(identified)
    console = stdout_console()
    table = Table("model", "parameters", "effective", "held-out um", "95 %", "noise um")
    for step in summary["ladder"]:
        mark = " <-" if step["model"] == summary["model"] else ""
        table.add_row(step["model"] + mark, str(step["parameters"]), *ladder_cells(step))
    console.print(table)
    if list(summary["kinds"]) != ["places"]:
        rows = (f"{k['rows']} {kind}, noise {k['noise_um']:.1f} um" for kind, k in summary["kinds"].items())
        console.print(f"measured: {'; '.join(rows)}")
    coverage = ", ".join(f"{joint} {100 * c['share']:.0f} %" for joint, c in summary["coverage"].items())
    console.print(f"condition {summary['condition']}; coverage of the joints: {coverage}")
    console.print(limits_sentence(summary))
    known = sorted((p for p in summary["parameters"] if not p["held_by_prior"]), key=lambda p: -p["moves_um"])
    for p in known[:MOST_PARAMETERS]:
        console.print(f"{p['name']} = {p['value']:.4g} +- {p['sigma']:.2g}, moves the tool by {p['moves_um']:.0f} um")
    if len(known) > MOST_PARAMETERS:
        console.print(f"and {len(known) - MOST_PARAMETERS} more, see the report")
    print_findings(console, summary["findings"], verbose=verbose)
    console.print(f"verdict: {summary['verdict']}")


def show_validation(summary: dict[str, Any], *, verbose: bool) -> None:
    """Print the errors at each target, of the nominal and of the identified arm."""
    console = stdout_console()
    table = Table("target", "arm", "places", "mean mm", "rms mm", "p99 mm", "max mm")
    rows = [*summary["targets"].items(), *summary["states"].items(), ("overall", summary["overall"])]
    if summary["set_aside"]:
        rows.append(("all rows", summary["all_rows"]))
    for target, arms in rows:
        for arm, errors in arms.items():
            statistics = (f"{errors[k]:.4f}" for k in ("mean", "rms", "p99", "max"))
            table.add_row(target, arm, str(errors["count"]), *statistics)
    console.print(table)
    print_findings(console, summary["findings"], verbose=verbose)
