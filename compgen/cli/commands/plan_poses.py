"""The command that says which poses to measure: a CSV of them, what they will tell, and a program that visits them."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from compgen.cli.command_frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.output_files.marker import Run
from compgen.cli.output_files.ownership import Headed, check_folder, check_unfilled
from compgen.cli.output_files.publish import publish
from compgen.cli.screen.messages import finding_rows, table_of
from compgen.core.commands import Command
from compgen.core.dates import DEFAULT_DATE, checked_date
from compgen.core.exceptions import ImpossibleError, InputError
from compgen.core.units import DEG, MM, UM

if TYPE_CHECKING:
    from compgen.core.arrays import Array
    from compgen.core.findings import Finding
    from compgen.core.stages import Progress
    from compgen.identification.model import FreeParameter
    from compgen.identification.pose_planning import PosePlan, Site
    from compgen.pipelines.files.robot_file import Arm
    from compgen.robot.robot import Robot

FARTHEST_MM = 1e5  # of what stands in a cell
HEADERS = ("poses to measure", "reversal runs")  # comments of the programs
POSES, EXPECTED, REVERSALS = "poses.csv", "expected.csv", "reversals.csv"


@dataclass(frozen=True, slots=True, kw_only=True)
class SiteChoice:
    """What stands in the cell, and how well it measures."""

    box: Annotated[
        str | None,
        typer.Option("--box", help="World box of the reflectors, 'x0 y0 z0 x1 y1 z1' in mm; default the reach."),
    ] = None
    reflectors: Annotated[
        list[str] | None,
        typer.Option(
            "--reflector",
            help="Its place in the flange, 'x y z' in mm, off the last axis; default '60 0 100'; repeatable.",
        ),
    ] = None
    instrument: Annotated[
        str | None, typer.Option("--instrument", help="Where the instrument stands, World 'x y z' in mm.")
    ] = None
    view: Annotated[
        float,
        typer.Option("--view", callback=opt.in_range(1, 180), help="Widest angle at which reflectors are seen, deg."),
    ] = 60.0
    noise: Annotated[
        float,
        typer.Option(
            "--noise", callback=opt.in_range(0.1, 1e4), help="Standard deviation of a measured coordinate, um."
        ),
    ] = 30.0
    share: Annotated[
        float, typer.Option("--range", callback=opt.in_range(0.01, 1.0), help="Share of each joint's range to use.")
    ] = 0.9

    def site(self, robot: "Robot") -> "Site":
        """The same in SI units, without a box the reach of the robot; raises InputError."""
        import numpy as np

        from compgen.identification.pose_planning import Site

        reach = float(np.abs(robot.a).sum() + np.abs(robot.d).sum()) / MM
        box = np.array([-reach] * 3 + [reach] * 3) if self.box is None else _lengths("--box", self.box)
        if not all(low < high for low, high in zip(box[:3], box[3:], strict=True)):
            raise InputError(f"--box '{self.box}': each low corner must be below the high one: x0 y0 z0 x1 y1 z1")
        reflectors = [_lengths("--reflector", text) for text in self.reflectors or ["60 0 100"]]
        stand = None if self.instrument is None else _lengths("--instrument", self.instrument) * MM
        return Site(
            box=np.array([box[:3], box[3:]]) * MM,
            reflector=np.array(reflectors) * MM,
            instrument=stand,
            view=self.view * DEG,
            noise=self.noise * UM,
            share=self.share,
        )

    def input_findings(self) -> "list[Finding]":
        """Findings of lengths as they were typed."""
        from compgen.core.other_units import lengths_in_other_units

        given = [("--reflector", text) for text in self.reflectors or []]
        given += [("--instrument", self.instrument)] if self.instrument else []
        given += [("--box", self.box)] if self.box else []
        return [
            f for option, text in given for f in lengths_in_other_units(option, text, _lengths(option, text).tolist())
        ]


def plan_poses(
    robot: opt.RobotArgument,
    *,
    count: Annotated[int, typer.Option("-n", help="How many poses.")] = 50,
    choice: SiteChoice,
    reversals: Annotated[
        bool,
        typer.Option("--reversals/--no-reversals", help="Runs of small steps that tell how far play reaches."),
    ] = True,
    wait: Annotated[float, typer.Option("--wait", help="Seconds at each pose.")] = 3.0,
    output: Annotated[str | None, typer.Option("-o", "--output", help="Folder; default outputs/<robot>_poses.")] = None,
    date: opt.Date = DEFAULT_DATE,
    screen: opt.FindingScreen,
    cores: opt.Cores,
) -> Outcome:
    """Choose the poses that tell most of a robot's errors: a CSV, and a program that visits them.

    Examples:
        cgen plan-poses m710ic50 -n 60 -o poses
    """
    from compgen.cli.screen.progress_bar import show_progress
    from compgen.pipelines.files.robot_file import load_arm
    from compgen.program.program import program_name

    arm = load_arm(robot)
    folder = opt.output_folder(f"{arm.robot.name}_poses", output)
    length, run = arm.robot.controller.capacity.name_length, Run(Command.PLAN_POSES, arm.robot.name)
    names = [program_name(f"{arm.robot.name}_{what}", length) for what in ("poses", "reversals")]
    _check(folder, run, *(f"{name}.LS" for name in names))
    site = choice.site(arm.robot)
    try:
        with show_progress(quiet=screen.is_silent) as progress:
            planned = _planned(arm, site, count, progress, reversals=reversals)
    except ImpossibleError as exception:
        raise ImpossibleError("; ".join([str(exception), *(f.message for f in choice.input_findings())])) from None
    programs, tables = _files(planned, arm.robot, names, checked_date(date), wait)
    publish(folder, programs, tables, (f"{names[1]}.LS", REVERSALS), run=run)
    record = _record(planned, sorted([*programs, *tables]), [*arm.input_findings, *choice.input_findings()])
    return Outcome(record=record, shown=_shown(record, folder, verbose=screen.verbose))


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedPoses:
    """Poses to measure, and the runs that reverse joints."""

    site: "Site"
    terms: "Sequence[FreeParameter]"
    plan: "PosePlan"
    runs: "Sequence[tuple[Array, int]]"  # poses of each, and the reflector


def _planned(arm: "Arm", site: "Site", count: int, progress: "Progress", *, reversals: bool) -> PlannedPoses:
    """The poses that tell most of an arm's errors."""
    import numpy as np

    from compgen.identification.model import build_model
    from compgen.identification.parameters import symbolic_sources
    from compgen.identification.pose_planning import plan_poses, plan_reversals

    sources = symbolic_sources(arm.robot, arm.known, np.ones(6, dtype=bool), warm=False, facts=arm.facts)
    parts = [source for source in sources if source.original.NAME != "joint_ripple"]
    model = build_model(arm.robot, parts, len(arm.nodes))
    plan = plan_poses(arm.robot, model, len(arm.nodes), site, count, progress)
    runs = plan_reversals(arm.robot, model, len(arm.nodes), site, plan) if reversals else []
    return PlannedPoses(site=site, terms=model.parameters, plan=plan, runs=runs)


def _files(
    planned: PlannedPoses, robot: "Robot", names: Sequence[str], day: str, wait: float
) -> tuple[dict[str, bytes], dict[str, bytes]]:
    """The programs that visit the poses and reverse joints, and the tables to fill in."""
    import numpy as np

    from compgen.fanuc.measuring_programs import measuring_program

    def program(number: int, pendant: "Array") -> dict[str, bytes]:
        return {f"{names[number]}.LS": measuring_program(names[number], HEADERS[number], day, pendant, wait)}

    theta, runs = planned.plan.theta, planned.runs
    pendant = np.round(robot.to_pendant(theta) / DEG, 3)
    tables = {
        POSES: _poses_csv(pendant, [range(len(planned.site.reflector))] * len(theta)),
        EXPECTED: _expected_csv(planned.terms, planned.plan),
    }
    if not runs:
        return program(0, pendant), tables
    turned = np.round(robot.to_pendant(np.vstack([poses for poses, _ in runs])) / DEG, 3)
    targets = [[target] for poses, target in runs for _ in poses]
    return program(0, pendant) | program(1, turned), tables | {REVERSALS: _poses_csv(turned, targets)}


def _check(folder: Path, run: Run, program: str, turning: str) -> None:
    """Raises InputError when poses that are planned anew would replace another robot's, or measurements."""
    headed = [
        Headed(program=program, header=f'= "{HEADERS[0]}"', vouches=[POSES, EXPECTED]),
        Headed(program=turning, header=f'= "{HEADERS[1]}"', vouches=[REVERSALS]),
    ]
    check_folder(folder, run, others=[POSES, EXPECTED, REVERSALS], headed=headed)
    for table in (POSES, REVERSALS):
        check_unfilled(folder, table, "measurements")


def _lengths(option: str, text: str) -> "Array":
    """The corners of a box, or a place [mm]."""
    return opt.typed_numbers(option, text, 6 if option == "--box" else 3, FARTHEST_MM)


def _poses_csv(pendant: "Array", targets: Sequence[Sequence[int]]) -> bytes:
    """The poses (K, 6) [deg] and the reflectors to measure at each, from 0, as identify reads them, to be filled in."""
    lines = ["order,target,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm"]
    for n, row in enumerate(pendant):
        joints = ",".join(f"{v:.3f}" for v in row)
        lines += [f"{n},r{r + 1},{joints},,," for r in targets[n]]
    return ("\n".join(lines) + "\n").encode()


def _expected_csv(terms: "Sequence[FreeParameter]", plan: "PosePlan") -> bytes:
    """Each parameter's uncertainty before and after the measurement."""
    from compgen.core.csv_table import text_cell

    lines = ["parameter,prior_sigma,expected_sigma"]
    for term, prior, sigma in zip(terms, plan.prior, plan.sigma, strict=True):
        name = text_cell(term.name)
        name = f'"{name}"' if "," in name else name
        lines.append(f"{name},{prior / term.unit:.6g},{sigma / term.unit:.6g}")
    return ("\n".join(lines) + "\n").encode()


def _record(planned: PlannedPoses, files: list[str], findings: "Sequence[Finding]") -> dict[str, Any]:
    """How well each parameter will be known, the reversal runs, findings, and the files."""
    plan = planned.plan
    return {
        "command": Command.PLAN_POSES,
        "poses": len(plan.theta),
        "reversal_runs": len(planned.runs),
        "parameters": [
            {"name": t.name, "prior_sigma": prior / t.unit, "expected_sigma": sigma / t.unit}
            for t, prior, sigma in zip(planned.terms, plan.prior.tolist(), plan.sigma.tolist(), strict=True)
        ],
        "findings": [f.record() for f in findings],
        "files": files,
    }


def _shown(record: dict[str, Any], folder: Path, *, verbose: bool) -> list[object]:
    """How well each parameter will be known, findings, and the files."""
    rows = []
    for term in record["parameters"]:
        prior, sigma = term["prior_sigma"], term["expected_sigma"]
        rows.append([term["name"], f"{prior:.4g}", f"{sigma:.4g}", f"{100 * (1 - (sigma / prior) ** 2):.0f} %"])
    reversals = f", then reversal runs of {record['reversal_runs']} joints" if record["reversal_runs"] else ""
    return [
        table_of(("parameter", "sigma before", "expected after", "known"), rows),
        *finding_rows(record["findings"], verbose=verbose),
        f"{record['poses']} poses{reversals}; wrote {', '.join(record['files'])} to {folder}",
    ]
