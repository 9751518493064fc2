"""What plan-poses writes and prints: the poses as CSV, what they will tell, and a table of it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.table import Table

from compgen.cli.screen.console import print_findings, stdout_console
from compgen.core.arrays import Array
from compgen.core.commands import Command
from compgen.core.csv_table import text_cell
from compgen.core.findings import Finding
from compgen.identification.model import FreeParameter
from compgen.identification.pose_planning import PosePlan


def poses_csv(pendant: Array, targets: Sequence[Sequence[int]]) -> bytes:
    """The poses (K, 6) [deg] and the reflectors to measure at each, from 0, as identify reads them, to be filled in."""
    lines = ["order,target,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm"]
    for n, row in enumerate(pendant):
        joints = ",".join(f"{v:.3f}" for v in row)
        lines += [f"{n},r{r + 1},{joints},,," for r in targets[n]]
    return ("\n".join(lines) + "\n").encode()


def expected_csv(terms: Sequence[FreeParameter], plan: PosePlan) -> bytes:
    """Each parameter's uncertainty before and after the measurement."""
    lines = ["parameter,prior_sigma,expected_sigma"]
    for term, prior, sigma in zip(terms, plan.prior, plan.sigma, strict=True):
        name = text_cell(term.name)
        name = f'"{name}"' if "," in name else name
        lines.append(f"{name},{prior / term.unit:.6g},{sigma / term.unit:.6g}")
    return ("\n".join(lines) + "\n").encode()


def pose_plan_record(
    terms: Sequence[FreeParameter], plan: PosePlan, runs: int, files: list[str], findings: Sequence[Finding]
) -> dict[str, Any]:
    """What ``--json`` prints: how well each parameter will be known, the reversal runs, findings, and the files."""
    return {
        "command": Command.PLAN_POSES,
        "poses": len(plan.theta),
        "reversal_runs": runs,
        "parameters": [
            {"name": t.name, "prior_sigma": prior / t.unit, "expected_sigma": sigma / t.unit}
            for t, prior, sigma in zip(terms, plan.prior.tolist(), plan.sigma.tolist(), strict=True)
        ],
        "findings": [f.record() for f in findings],
        "files": files,
    }


def show_pose_plan(
    terms: Sequence[FreeParameter],
    plan: PosePlan,
    runs: int,
    folder: Path,
    files: list[str],
    findings: Sequence[Finding],
) -> None:
    """Print how well each parameter will be known, findings, and the files."""
    console = stdout_console()
    table = Table("parameter", "sigma before", "expected after", "known")
    for term, prior, sigma in zip(terms, plan.prior, plan.sigma, strict=True):
        known = 100 * (1 - (sigma / prior) ** 2)
        table.add_row(term.name, f"{prior / term.unit:.4g}", f"{sigma / term.unit:.4g}", f"{known:.0f} %")
    console.print(table)
    print_findings(console, findings)
    reversals = f", then reversal runs of {runs} joints" if runs else ""
    console.print(f"{len(plan.theta)} poses{reversals}; wrote {', '.join(files)} to {folder}")
