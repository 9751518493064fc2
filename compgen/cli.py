"""The command line: the only place that prints, writes files, catches exceptions and sets exit codes.

Exit codes: 0 inside the bounds, 1 outside, 2 bad input, 3 the job cannot be done.
"""

import json
import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from io import TextIOWrapper
from pathlib import Path
from typing import Annotated, Any
from xml.sax.saxutils import quoteattr

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from compgen import __version__, inspection, outbox, pipeline
from compgen.config import load_job, load_robot
from compgen.dialects import fanuc_ls
from compgen.dialects.fanuc_ls.frames import known_without_a_table, load_frames
from compgen.exceptions import CompgenError, InputError
from compgen.job import Job
from compgen.pipeline import Corrected, Planned
from compgen.reading import shipped
from compgen.report import report_html, report_json, summary, waypoints_csv

app = typer.Typer(
    help="Predict where a warming robot's tool will be, and write the program that cancels the error.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

PathFile = Annotated[str, typer.Argument(help="A path file, e.g. paths/spiral_1300.toml", show_default=False)]
RobotName = Annotated[str | None, typer.Option("--robot", help="Robot name or file; default: what the path file says.")]
OutDir = Annotated[
    str | None, typer.Option("-o", "--output", help="Folder for the results; default outputs/<path name>.")
]
Set = Annotated[
    list[str] | None, typer.Option("--set", help="Override a key of the path or robot file, key=value; repeatable.")
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress, no table; errors only.")]
Date = Annotated[str, typer.Option("--date", help="Date in the program's header, YY-MM-DD.")]


@app.command()
def generate(
    path: PathFile,
    robot: RobotName = None,
    output: OutDir = None,
    set_: Set = None,
    date: Date = pipeline.DATE,
    force: Annotated[bool, typer.Option("--force", help="Write the program even outside its bounds.")] = False,
    quiet: Quiet = False,
) -> None:
    """Write the corrected program and its proof."""
    folder = _folder(path, output)
    with _stages(quiet) as progress:
        job = load_job(path, robot, set_ or ())
        planned, corrected = pipeline.generate(job, progress, _checked_date(date))
        progress("report", 0.5)
        files = _files(planned, corrected)
        program = f"{corrected.program.name}.LS"
        if corrected.inside or force:
            files[program] = corrected.text
        _publish(folder, files, job)
    if not quiet:
        _show(planned, corrected, folder, files)
    if not corrected.inside:
        told = "written all the same (--force)" if force else f"{program} not written; --force writes it"
        worst = next(f.message for f in corrected.findings if f.level == "outside")
        raise typer.Exit(_say_error(f"outside bounds: {worst}; {told}", 1))


@app.command()
def predict(
    path: PathFile,
    robot: RobotName = None,
    output: OutDir = None,
    set_: Set = None,
    quiet: Quiet = False,
) -> None:
    """Predict the error of the planned program, without correcting it."""
    folder = _folder(path, output)
    with _stages(quiet) as progress:
        job = load_job(path, robot, set_ or ())
        planned = pipeline.predict(job, progress)
        progress("report", 0.5)
        files = _files(planned, None)
        _publish(folder, files, job)
    if not quiet:
        _show(planned, None, folder, files)


@app.command()
def check(
    path: PathFile,
    robot: RobotName = None,
    set_: Set = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
    junit: Annotated[str | None, typer.Option("--junit", help="Write a JUnit XML file.")] = None,
    quiet: Quiet = False,
) -> None:
    """Generate in memory and verify; exit 1 outside the bounds. Writes no program."""
    with _stages(quiet or as_json) as progress:
        job = load_job(path, robot, set_ or ())
        if junit is not None:
            if not junit or Path(junit).is_dir():
                raise InputError(f"--junit '{junit}': not a file's name; give one")
            outbox.check_writable(Path(junit).absolute().parent)
        planned, corrected = pipeline.generate(job, progress)
    data = summary(planned, corrected)
    if junit is not None:
        _write(Path(junit), _junit(data))
    if as_json:
        sys.stdout.write(json.dumps(data, indent=2, allow_nan=False) + "\n")
    elif not quiet:
        _show(planned, corrected, None, {})
    if not corrected.inside:
        worst = next(f.message for f in corrected.findings if f.level == "outside")
        raise typer.Exit(1 if as_json else _say_error(f"outside bounds: {worst}", 1))


@app.command()
def inspect(
    program: Annotated[str, typer.Argument(help="A FANUC program, NAME.LS", show_default=False)],
    robot: Annotated[str, typer.Option("--robot", help="Robot name or file, for limits.")] = "m710ic50",
    frames: Annotated[str | None, typer.Option("--frames", help="Frames table (.toml) or SYSFRAME.VA.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print as JSON.")] = False,
) -> None:
    """Say what a program is, and what makes correcting it unsafe. Changes nothing."""
    table = load_frames(frames) if frames is not None else known_without_a_table()
    arm = load_robot(robot)
    try:
        data = Path(program).read_bytes()
    except OSError as failure:
        raise InputError(f"{program}: cannot be read: {failure.strerror}; give a program listing (.LS)") from None
    try:
        found = inspection.inspect(fanuc_ls.loads(data), arm, table)
    except InputError as failure:
        raise InputError(f"{program}: {failure}") from failure
    if as_json:
        sys.stdout.write(json.dumps(found, indent=2, allow_nan=False) + "\n")
    else:
        _show_program(found)


@app.command()
def init(folder: Annotated[str, typer.Argument(help="Where to; default here.")] = ".") -> None:
    """Lay down the robots and paths that come with compgen."""
    place = Path(folder)
    kinds = ("robots", "paths")
    for kind in kinds:
        outbox.check_writable((place / kind).absolute())
    laid = 0
    for kind in kinds:
        target = place / kind
        try:
            target.mkdir(parents=True, exist_ok=True)
            for source in sorted((shipped() / kind).glob("*.toml")):
                if not os.path.lexists(target / source.name):
                    _write(target / source.name, source.read_bytes())
                    laid += 1
        except OSError as failure:
            raise InputError(f"{target}: cannot be written: {failure.strerror}; give another folder") from failure
    sys.stdout.write(
        f"{laid} files laid down in {place / 'robots'} and {place / 'paths'}; files already there are kept\n"
    )


@app.callback(invoke_without_command=True)
def _version(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    if version:
        sys.stdout.write(f"compgen {__version__}\n")
        raise typer.Exit()


def main() -> None:
    """Run, and turn every refusal into one line and an exit code."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        code = app(sys.argv[1:] or ["--help"], standalone_mode=False) or 0
        sys.stdout.flush()
    except CompgenError as failure:
        code = _say_error(str(failure), failure.exit_code)
    except (KeyboardInterrupt, typer.Abort):
        code = _say_error("interrupted; nothing was written", 130)
    except typer.TyperException as failure:
        code = _say_error(f"{getattr(failure, 'format_message', failure.__str__)().rstrip('.')}; see compgen --help", 2)
    except MemoryError:
        code = _say_error("not enough memory; make the path smaller, or raise process.chord_um", 2)
    except BrokenPipeError:  # whoever read the output has seen enough
        code = 0
    except OSError as failure:
        code = _say_error(f"output: cannot be written: {failure.strerror}; see where it goes", 2)
    _leave(code)


def _leave(code: int) -> None:
    """Exit without Python flushing a stream that is gone."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    sys.exit(code)


def _folder(path: str, output: str | None) -> Path:
    if output == "":
        raise InputError("-o: an empty name; give a folder")
    folder = Path(output) if output is not None else Path("outputs") / Path(path).stem
    outbox.check_writable(folder.absolute())
    return folder


def _checked_date(date: str) -> str:
    try:
        if not re.fullmatch(r"\d\d-\d\d-\d\d", date):
            raise ValueError
        datetime.strptime(f"20{date}", "%Y-%m-%d")
    except ValueError:
        raise InputError(f"--date {date}: not a date YY-MM-DD, as in {pipeline.DATE}") from None
    return date


def _files(planned: Planned, corrected: Corrected | None) -> dict[str, bytes]:
    return {
        "report.json": report_json(planned, corrected),
        "waypoints.csv": waypoints_csv(planned, corrected),
        "report.html": report_html(planned, corrected),
    }


def _publish(folder: Path, files: dict[str, bytes], job: Job) -> None:
    program = f"{pipeline.program_name_of(job)}.LS"
    outbox.publish(folder, files, {"report.json", "waypoints.csv", "report.html", program})


def _write(path: Path, content: bytes) -> None:
    """One file, whole or not at all."""
    part = path.with_name(f".{path.name}.part")
    try:
        part.write_bytes(content)
        part.replace(path)
    except OSError as failure:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise InputError(f"{path}: cannot be written: {failure.strerror}; give another file") from failure


def _junit(data: dict[str, Any]) -> bytes:
    """A test case for each bound, failed by its finding."""
    broken = {f["code"]: f["message"] for f in data["findings"] if f["level"] == "outside"}
    cases = [f"bounds.{key}" for key in data["bounds"]]
    cases += [code for code in broken if code not in cases]
    lines = ['<?xml version="1.0" encoding="UTF-8"?>']
    lines.append(
        f'<testsuite name={quoteattr("compgen." + data["name"])} tests="{len(cases)}" failures="{len(broken)}">'
    )
    for case in cases:
        start = f"  <testcase classname={quoteattr('compgen.' + data['name'])} name={quoteattr(case)}"
        if case in broken:
            lines.append(f"{start}><failure message={quoteattr(broken[case])}/></testcase>")
        else:
            lines.append(f"{start}/>")
    return ("\n".join([*lines, "</testsuite>"]) + "\n").encode()


@contextmanager
def _stages(quiet: bool) -> Iterator[pipeline.Progress]:
    """A bar for the stage at work, on a terminal only; errors come after it has gone."""
    console = Console(stderr=True)
    columns = (TextColumn("{task.description:<14}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=quiet or not console.is_terminal) as bar:
        task = bar.add_task("reading", total=1.0)
        yield lambda stage, share: bar.update(task, description=stage, completed=share)


def _say_error(message: str, code: int) -> int:
    sys.stderr.write(f"compgen: {' '.join(message.split())}\n")
    return code


def _show_program(found: dict[str, Any]) -> None:
    """What ``inspect`` found, for a reader."""
    console = Console(width=None if sys.stdout.isatty() else 100, highlight=False, markup=False)
    places, moves = found["positions"], found["motions"]
    told = ", ".join(f"{n} {letter}" for letter, n in sorted(moves.items())) or "none"
    console.print(f"{found['name']}  {found['comment']}".rstrip())
    console.print(f"motions: {told}; {found['disabled_motions']} disabled")
    console.print(
        f"positions: {places['defined']} defined, {places['used']} used, {len(places['shared'])} shared, "
        f"{places['joint_form']} in joint form"
    )
    for key in ("unused", "undefined"):
        if places[key]:
            console.print(
                f"{key}: {', '.join(f'P[{n}]' for n in places[key][:20])}{' ...' if places[key][20:] else ''}"
            )
    pairs = [f"UF {f['uframe']} UT {f['utool']} ({f['positions']})".replace("-1", "F") for f in found["frames"]]
    console.print(f"frames: {', '.join(pairs) or 'none'}")
    console.print(f"postures: {', '.join(f'{k} ({n})' for k, n in found['postures'].items()) or 'none'}")
    console.print(
        f"path {found['path_length_mm']:.1f} mm, {found['duration_s']:.1f} s at programmed speeds; "
        f"{found['motions_without_time']} motions without a time of their own"
    )
    for joint, room in found["limits"].items():
        unit = "mm" if "room_mm" in room else "deg"
        console.print(f"{joint}: {room['room_' + unit]:.2f} {unit} from its limit at P[{room['position']}]")
    if found["out_of_reach"]:
        console.print(f"out of reach of {found['robot']}: {', '.join(f'P[{n}]' for n in found['out_of_reach'][:20])}")
    console.print(f"{len(found['unsafe'])} statements make compensation unsafe" + (":" if found["unsafe"] else ""))
    for item in found["unsafe"]:
        console.print(f"  line {item['line']}: {item['text']}: {item['reason']}")


def _show(planned: Planned, corrected: Corrected | None, folder: Path | None, files: dict[str, bytes]) -> None:
    """The table at the end."""
    data = summary(planned, corrected)
    console = Console(width=None if sys.stdout.isatty() else 100)
    table = Table(title=Text(planned.job.title or planned.job.name), title_justify="left", title_style="bold")
    table.add_column("TCP error", no_wrap=True)
    names = ["before", "after"] if corrected else ["predicted"]
    for name in names:
        for part in ("max", "p99", "rms"):
            table.add_column(f"{name} {part}", justify="right")
    table.add_column("bound", justify="right")
    bound_keys = {
        "total": "max_um",
        "feed": "feed_um",
        "cross": "cross_um",
        "normal": "normal_um",
        "axis_angle": "axis_mdeg",
    }
    for row, label in (
        ("total", "total, um"),
        ("feed", "along feed, um"),
        ("cross", "cross feed, um"),
        ("normal", "normal, um"),
        ("axis_angle", "tool axis, mdeg"),
    ):
        cells = [f"{v:.2f}" for side in ("before", "after") if data[side] for v in data[side][row].values()]
        bound = data["bounds"].get(bound_keys[row])
        table.add_row(label, *cells, "" if bound is None else f"{bound:g}")
    console.print(table)
    path, time, heat = data["path"], data["timing"], data["thermal"]
    console.print(
        f"{path['waypoints']} waypoints, {path['length_m']:.2f} m, {time['duration_s']:.1f} s, "
        f"{100 * time['at_feed']:.1f} % of the length at feed, {path['stops']} stops"
    )
    rises = ", ".join(f"{n} {heat['start_K'][n]:.2f} to {heat['end_K'][n]:.2f}" for n in heat["start_K"])
    console.print(f"rise [K]: {rises}")
    if corrected:
        console.print(
            f"{data['ratio']:.0f} times smaller; start within {heat['start_window_s']:.0f} s of the state it is for"
        )
    for finding in data["findings"]:
        console.print(f"{finding['level']}: {finding['message']}", markup=False, highlight=False)
    if folder is not None:
        console.print(f"wrote {', '.join(sorted(files))} to {folder}", markup=False, highlight=False)
