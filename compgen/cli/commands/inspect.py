"""Commands that read programs and write nothing: inspect says what one is, check-backup whether two are the same."""

from collections.abc import Iterator
from typing import Annotated, Any

import typer

from compgen.cli.command_frame import Outcome
from compgen.cli.commands.check import begin_files, judge_all, outcome_of_all
from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_programs, complete_robots
from compgen.cli.screen.messages import MOST_UNSAFE, unsafe_lines
from compgen.core.commands import Command

#: Where a program says that compgen has corrected it.
MARKS = {
    "remark": "a remark says so",
    "digits": "the last digits of its positions say so",
    "record": "the provenance file beside it says so",
}


def inspect(
    programs: opt.ProgramFiles,
    *,
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot",
            autocompletion=complete_robots,
            help="Robot name or file, for reach and limits; default: the one that the program names.",
        ),
    ] = None,
    tables: opt.ProgramTables,
    sarif: opt.Sarif = None,
    screen: opt.Screen,
) -> Outcome:
    """Say what a program is, and what makes correcting it unsafe. Changes nothing.

    Examples:
        cgen inspect JOB.LS --frames SYSFRAME.VA
        cgen inspect JOB.LS --robot m20ia --json
        cgen inspect programs --sarif results.sarif
    """
    from compgen.pipelines.correct.program_file import inspect_file

    names = begin_files(programs, None, sarif, Command.INSPECT)
    frames, registers = tables.read()

    def judge(program: str) -> tuple[dict[str, Any], str]:
        record = inspect_file(program, robot, frames, registers)
        missing = ", ".join(f"P[{n}]" for n in record["positions"]["undefined"][:6])
        mend = f"{program}: {missing}: used but not defined; mend the program" if missing else ""
        return {"command": Command.INSPECT, **record}, mend

    judged = judge_all(names, judge, None, sarif)
    alone = len(programs) == 1
    shown = (
        line
        for one in judged
        for line in (*(() if alone else (f"{one.path}:",)), *(program_lines(one.summary) if one.summary else ()))
    )
    return outcome_of_all(judged, shown, alone=alone)


def check_backup(
    written: Annotated[
        str,
        typer.Argument(
            autocompletion=complete_programs, help="The program that was loaded, or its folder.", show_default=False
        ),
    ],
    backup: Annotated[
        str, typer.Argument(help="What the controller saved as ASCII: NAME.LS, or the folder.", show_default=False)
    ],
    *,
    first: Annotated[int, typer.Option("--first", min=0, help="Differences that are printed of each program.")] = 20,
    screen: opt.Screen,
) -> Outcome:
    """Check that a controller's ASCII backup is the program that was written, to the last digit; else exit 1.

    Examples:
        cgen check-backup out/SPIRAL_1300.LS backup/SPIRAL_1300.LS
        cgen check-backup outputs/optic_spiral backup --json
    """
    from compgen.pipelines.comparison.backup_files import verify_backup as compare

    programs = compare(written, backup)
    count = sum(len(program.differences) for program in programs)
    record = {
        "command": Command.CHECK_BACKUP,
        "same": count == 0,
        "programs": [program.record() for program in programs],
    }
    lines = [line for program in programs for line in program.lines(first)]
    errors = []
    if count:
        worst = next(program for program in programs if program.differences)
        message = f"{worst.name}: {worst.differences[0]}; {count} in all: load it again, and compare again"
        errors.append(f"the backup differs: {message}")
    return Outcome(record=record, lines=lines, errors=errors)


def _path_words(report: dict[str, Any]) -> str:
    """How long lines and arcs of a program are, and how long its motions take."""
    length, duration = report["path_length_mm"], report["duration_s"]
    if not report["motions"].keys() - {"J"}:
        return ": no line and no arc"
    if length is None:
        return ": its length is not known: of no line or arc are both ends"
    time = "its time is not known" if duration is None else f"{duration:.1f} s at programmed speeds"
    return f" {length:.1f} mm, {time}"


def program_lines(report: dict[str, Any]) -> Iterator[str]:
    """What a program is, and what makes correcting it unsafe."""
    positions, motions = report["positions"], report["motions"]
    counts = ", ".join(f"{n} {letter}" for letter, n in sorted(motions.items())) or "none"
    yield f"{report['name']}  {report['comment']}".rstrip()
    if report["mark"] in MARKS:
        yield f"corrected by compgen: {MARKS[report['mark']]}; correct refuses it"
    yield f"motions: {counts}; {report['disabled_motions']} disabled"
    yield (
        f"positions: {positions['defined']} defined, {positions['used']} used, {len(positions['shared'])} shared, "
        f"{positions['joint_form']} in joint form"
    )
    for key in ("unused", "undefined"):
        if positions[key]:
            yield f"{key}: {', '.join(f'P[{n}]' for n in positions[key][:20])}{' ...' if positions[key][20:] else ''}"
    pairs = [f"UF {f['uframe']} UT {f['utool']} ({f['positions']})".replace("-1", "F") for f in report["frames"]]
    yield from (
        f"frames: {', '.join(pairs) or 'none'}",
        f"postures: {', '.join(f'{k} ({n})' for k, n in report['postures'].items()) or 'none'}",
        f"path{_path_words(report)}; motions without a time of their own: {report['motions_without_time']}",
    )
    for joint, margin in report["limits"].items():
        unit = "mm" if "room_mm" in margin else "deg"
        yield f"{joint}: {margin['room_' + unit]:.2f} {unit} from its limit at P[{margin['position']}]"
    if report["robot"] is None:
        yield "reach and joint limits: not looked at, the program names no robot; say which with --robot"
    if report["out_of_reach"]:
        yield f"out of reach of {report['robot']}: {', '.join(f'P[{n}]' for n in report['out_of_reach'][:20])}"
    count = len(report["unsafe"])
    yield f"statements that make compensation unsafe: {count}" + (":" if count else "")
    yield from unsafe_lines(report["unsafe"], MOST_UNSAFE, "with --json")
