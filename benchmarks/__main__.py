"""``python -m benchmarks``: everything side by side, as ratios; writes benchmarks/results.md.

Long: some 20 minutes and 2 GB. In short: python -m benchmarks --points 20000 --ipopt 500
"""

import argparse
import os
import tempfile
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks import bands, cases, commands, heat, identification, peers, shares, text, whole
from benchmarks.measure import ROUNDS, load, machine, seconds
from compgen import fanuc
from compgen.core import evaluation
from compgen.pipelines.planned import generate
from compgen.pipelines.planned.job_results import Planned

HERE = Path(__file__).parent
SOME = 100_000  # waypoints that parts of a run are measured on
WORKERS = 2
DRAWN = 10_000  # waypoints of the text that draws fly
COMPILED = "compgen"  # in the folder, where its commands keep compiled code as well: each function is made once
LONG = 1_000_000  # waypoints that whole runs and their growth are judged at

Row = tuple[str, str, str]  # what, what it shall reach, what it does here


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks")
    parser.add_argument(
        "--folder", default=str(Path.home() / ".cache" / "compgen-benchmarks"), help="peers, compiled code"
    )
    parser.add_argument("--out", default=str(HERE / "results.md"), help="where the table goes")
    parser.add_argument("--no-peers", action="store_true", help="only what is installed here")
    parser.add_argument("--ipopt", type=int, default=10_000, help="waypoints for the general program; 0: without")
    parser.add_argument("--points", type=int, default=LONG, help="waypoints of the largest whole run")
    parser.add_argument("--starts", type=int, default=2 * ROUNDS, help="how often the short job starts from the shell")
    given = parser.parse_args(arguments)
    if given.points < 1000:
        parser.error("--points: give 1000 or more")
    if given.starts < 1:
        parser.error("--starts: give 1 or more")
    rows: list[Row] = []
    busy = load()
    for row in measured(Path(given.folder), given.points, given.ipopt, given.starts, not given.no_peers):
        rows.append(row)
        print(f"{row[0]:<100} {row[1]:>10} {row[2]}", flush=True)
    asked = f"--points {given.points} --ipopt {given.ipopt}" + (" --no-peers" if given.no_peers else "")
    asked += f" --starts {given.starts}" if given.starts != parser.get_default("starts") else ""
    Path(given.out).write_text(table(rows, asked, busy))


def measured(folder: Path, points: int, ipopt: int, starts: int, others: bool) -> Iterator[Row]:
    """Every row, as it comes."""
    folder.mkdir(parents=True, exist_ok=True)
    compiler = evaluation.find_compiler(folder / COMPILED)
    evaluation.configure(compiler)
    planned = generate.predict(cases.job_of(max(min(points, SOME), 3 * ipopt)), cases.quiet)
    problem = cases.problem_of(planned)
    unit, operations = cases.unit(problem)
    told = "unit: one compiled scalar evaluation of the hot residual + 6x6 Jacobian of this job's model"
    yield f"{told}, {operations} operations", "1", f"1 ({1e9 * unit:.0f} ns here)"
    c = cases.correction(problem, compiler)
    one, N = c["vectorised"], len(problem.arc)
    yield "correction of a waypoint, compiled scalar, in units", "<= 2", f"{c['compiled scalar'] / unit:.2f}"
    yield "correction, vectorised", "<= 0.4", f"{one / unit:.2f}"
    yield "correction, no compiler", "<= 4", f"{c['no compiler'] / unit:.2f}"
    yield f"smoothing, nothing active, {N} waypoints", "<= + 1", f"+ {(c['with smoothing'] - one) / unit:.2f}"
    told = f"+ {(c['limited'] - one) / unit:.2f} ({100 * c['at a limit']:.1f} % at it)"
    yield "smoothing, 1 % of waypoints at a limit", "<= + 8", told
    yield from every_error(min(points, SOME))
    yield from whole_runs(folder, unit, points, starts)
    yield from texts(min(points, SOME))
    yield identified(1000 if points >= LONG else 60)
    yield from measuring(folder, 60 if points >= LONG else 20)
    if others:
        yield from against_peers(folder, planned, one, points)
    if ipopt:
        i = cases.against_ipopt(problem, ipopt)
        for name, label, reach in (("free", "nothing active", ">= 500"), ("limited", "limits active", ">= 30")):
            slow, fast, apart, solved = (i[f"{name} {key}"] for key in ("slow", "fast", "difference", "solved"))
            told = f"{slow / fast:.0f} ({1e6 * slow:.0f} us a waypoint, apart {apart:.0e} m)"
            if not solved:
                told += ", ipopt did not converge"
            yield f"ipopt with its set-up over compgen, the same program, {ipopt} waypoints, {label}", reach, told


def every_error(points: int) -> Iterator[Row]:
    """The unit and the correction of a robot with every kind of error, to compare other robots with."""
    with tempfile.TemporaryDirectory() as folder:
        planned = generate.predict(cases.job_of(points, cases.full_robot(Path(folder))), cases.quiet)
    problem = cases.problem_of(planned)
    full, operations = cases.unit(problem)
    told = "the same for a model with 24 DH errors, 9 thermal and offset inputs, compliance, a quadratic map"
    yield f"{told}, {operations} operations", "", f"{1e9 * full:.0f} ns here"
    spent = seconds(problem.pointwise_correction) / len(problem.arc)
    yield "correction with that model, vectorised, in units of that model", "", f"{spent / full:.2f}"


def whole_runs(folder: Path, unit: float, points: int, starts: int) -> Iterator[Row]:
    """From TOML to written, at three sizes; and a short job."""
    least = min(points, max(points // 100, 5000))
    sizes = [least, int(np.sqrt(least * points)), points]
    run = {size: whole.runs(folder / COMPILED, WORKERS, size) for size in dict.fromkeys(sizes)}
    small, middle, large = (run[size] for size in sizes)
    count, elapsed, spent, peak = large
    long = points >= LONG
    told = f"whole generate at {count:.0f} waypoints, {WORKERS} workers, in units a waypoint"
    yield f"{told}: elapsed", "<= 20" if long else "", f"{elapsed / count / unit:.1f}"
    yield f"{told}: processor time", "", f"{spent / count / unit:.1f}"
    # differences of sizes know no start-up
    if middle[0] > small[0] and count > middle[0]:
        late, early = ((b[2] - a[2]) / (b[0] - a[0]) for a, b in ((middle, large), (small, middle)))
        told = (
            f"growth: processor time a waypoint, {middle[0]:.0f} to {count:.0f} over {small[0]:.0f} to {middle[0]:.0f}"
        )
        yield told, "<= 1.1" if long else "", f"{late / early:.2f}"
        yield "start-up beside, in processor seconds", "", f"{small[2] - small[0] * early:.2f}"
    yield f"peak memory at {count:.0f}", "<= 2000 MB", f"{peak:.0f} MB"
    share = shares.shares(points)
    for part in shares.HONEST:
        yield (
            f"{part} at {count:.0f} waypoints, of the run, one worker",
            "<= 10 %" if long else "",
            f"{100 * share[part]:.1f} %",
        )
    of_band = bands.seconds_of_band(points)
    what_band_adds = f"linear band with its columns at {count:.0f} waypoints, over the rest of the run, processor time"
    yield what_band_adds, "<= + 25 %" if long else "", f"+ {100 * of_band / (spent - of_band):.1f} %"
    flown = bands.seconds_of_draws(folder / COMPILED, min(points, DRAWN), WORKERS)
    what = f"{flown.draws} flights of a draw each at {flown.waypoints} waypoints, {WORKERS} workers: elapsed"
    yield what, "<= 15 s" if points >= DRAWN else "", f"{flown.elapsed:.1f} s (processor {flown.processor:.1f} s)"
    processor, elapsed = whole.cold_start(folder, starts)
    told = f"{processor:.1f} (elapsed {elapsed:.1f})"
    yield "generate paths/spiral_1300.toml over importing casadi, pinocchio, scipy", "<= 3", told


def texts(points: int) -> Iterator[Row]:
    """A program written and read line by line."""
    program = text.spiral(points)
    data = fanuc.compose(program)
    write, slow_write = (seconds(partial(f, program)) for f in (fanuc.compose, text.write_by_lines))
    read, slow_read = (seconds(partial(f, data)) for f in (fanuc.interpret, text.read_by_lines))
    yield f"per-line LS writer over compgen, {points} points", ">= 5", f"{slow_write / write - 1:.1f}"
    yield f"per-line LS reader over compgen, {points} points", ">= 8", f"{slow_read / read:.1f}"


def identified(poses: int) -> Row:
    """An arm identified, against scipy's optimiser with its own numerical Jacobian."""
    parameters = 60 if poses >= 1000 else 30
    i = identification.against_scipy(parameters, poses)
    what = (
        f"scipy least_squares, numerical Jacobian, over the fit of identify, {parameters} parameters, {poses} poses x 3"
    )
    ratio = f"{i['scipy'] / i['compgen']:.0f} ({i['compgen']:.2f} s, apart {i['apart']:.0e} sigma)"
    return what, ">= 20" if poses >= 1000 else "", ratio


def measuring(folder: Path, poses: int) -> Iterator[Row]:
    """The commands that measure an arm, from the shell."""
    rounds = ROUNDS if poses >= 60 else 1
    for what, seconds_spent in commands.spent(folder, poses, rounds).items():
        reach = "<= 8 s" if what.startswith("identify, 180 poses") else ""
        yield f"cgen {what}, from the shell, processor time", reach, f"{seconds_spent:.1f} s"


def against_peers(folder: Path, planned: Planned, one: float, points: int) -> Iterator[Row]:
    """Other libraries; one that cannot be had says why."""
    arm = cases.arm_question(planned)
    mine, timing = cases.timed(planned, min(5000, points // 2))
    network = heat.network()
    modes, rises = heat.by_modes(network)
    asked = (
        ("scipy", arm, one, (("least_squares", "least_squares, hot", ">= 1000"),)),
        ("scipy", heat.question(network), modes, (("solve_ivp", "solve_ivp BDF, a day of heat in 100 volumes", ""),)),
        ("pinocchio", arm, one, (
            ("example", "closed loop in Python as in its example, hot", ""),
            ("whole steps", "closed loop in Python with whole steps, hot", ""),
        )),
        ("roboticstoolbox", arm, one, (
            ("ikine_LM", "DHRobot.ikine_LM, hot", ">= 1000"), ("ik_LM", "ETS.ik_LM, cold", ">= 15"),
        )),
        ("pybotics", arm, one, (("ik", "Robot.ik, hot", ""),)),
        ("toppra", timing, mine, (("timing", "timing", ">= 20"),)),
    )  # fmt: skip
    for name, question, ours, wanted in asked:
        answer = peers.ask(name, question, folder / "peers")
        for key, label, reach in wanted:
            what = f"{name} {label}, over compgen"
            if isinstance(answer, str):
                yield what, reach, answer
                continue
            told = f"{answer[key] / ours:.0f}"
            if f"{key} off" in answer:
                told += f" (off by {answer[f'{key} off']:.0e} m)"
            if "rises" in answer:
                told += f" (apart {np.abs(np.array(answer['rises']) - rises).max():.0e} K)"
            yield what, reach, told


def table(rows: Sequence[Row], asked: str, busy: float) -> str:
    """The results as a page."""
    told = f"- medians of {ROUNDS} warm rounds, processor time unless said; ratios taken in one run"
    cores = os.cpu_count() or 1
    lines = [
        "# Results",
        "",
        *(f"- {fact}" for fact in machine()),
        f"- load before {busy:.1f} of {cores} cores" + (": other work ran beside" if busy > 0.3 * cores else ""),
        told,
        f"- `python -m benchmarks {asked}`",
        "",
        "| what | reach | here |",
        "|---|---|---|",
        *(f"| {what} | {reach} | {value} |" for what, reach, value in rows),
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
