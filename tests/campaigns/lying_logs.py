"""Temperature logs that lie, at each command that reads one: what a lie moves is weighed against the printed band.

python tests/campaigns/lying_logs.py --seeds 0:504            draws, judges and adds to lying_logs.jsonl; again goes on
python tests/campaigns/lying_logs.py --seeds 0:504 --table    only the table of what is in lying_logs.jsonl

A seed draws a day of the cell (``logged_days.py``), a command and a lie (``lies.py``; 168 seeds have each pair once),
and runs the command twice: with the honest log and with the lie. How far the lie sends or expects the tool from where
the honest log does, at the worst position, is what it *moved*. Beyond the smaller one of both printed bands it is
WRONG, whatever the exit code, and so is a refusal that is not one line with a file's name in it. A printed band is its
95 % and what stands beside it of a sensor that is off unseen; for how many the 95 % are enough is counted.

A log of another day is a true one: a command that is given a log and nothing else is not blamed for it (``unseen``).
``off_um`` is how far the true arm, by the day's true rises and in numpy, is from its targets with what was written, or
from where it was expected.
"""

import csv
import json
import os
import resource
import shlex
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(Path(__file__).parent)]

import compgen.cli.blas_threads  # noqa: E402, F401, I001  before numpy
import jobs  # noqa: E402
import kills  # noqa: E402
import naive_ls  # noqa: E402
import numpy as np  # noqa: E402
import seed_journal  # noqa: E402
from lies import LIES, WHOLE_DAYS, LoggedDay  # noqa: E402
from logged_days import HOUR, LAW, MINUTE, REFERENCE, Log, Stretch, course, drawn_sensing, logged, work  # noqa: E402
from naive_arm import dh_angles, frame, joints_by_config  # noqa: E402
from shipped import load_everything  # noqa: E402

COMMANDS = ("generate", "resume", "check", "follow", "predict", "anchor", "heat", "whatif")
IN_PAGES = ("resume", "follow")
GIVEN_A_LOG_ALONE = ("generate", "resume", "check", "predict", "heat", "whatif")
IN_A_PROCESS = 20  # every so many seeds
HANGS_S, MEMORY_B = 300, 4_000_000_000  # a run that takes more is ended, and was no refusal
CTE = 11.25  # um/m K of the robot file
TOOL = frame(0, 0, 120, 0, 0, 0)
PLANNED_H = 3.0  # of work before the pages
PATH = """robot = "m710ic50"
path = {{ pattern = "raster", diameter_mm = {diameter}, stepover_mm = {stepover}, x_mm = 1300, y_mm = 100, z_mm = 200 }}
tool = {{ z_mm = 120 }}
process = {{ feed_mm_s = {feed} }}
bounds = {{ max_um = 20 }}
"""
JOB = PATH.format(diameter=300, stepover=70, feed=100)
PAGES = PATH.format(diameter=500, stepover=70, feed=20) + (
    f'before = [{{ state = "moving", feed_mm_s = 200, duration_h = {PLANNED_H} }}]\n'
)
SPHERES = {"a": (800, -700, 250), "b": (800, 640, 250), "c": (1700, -600, 250), "d": (1700, 540, 250)}
PROBE = frame(0, 0, 150, 0, 0, 0)
TOUCHES, TOUCH_NOISE_MM = 8, 0.012
ARTEFACT = "[artefact]\ncertified = true\n[probe]\nz_mm = 150\ndiameter_mm = 6\n" + "".join(
    f'[[sphere]]\nname = "{n}"\nx_mm = {x}\ny_mm = {y}\nz_mm = {z}\ndiameter_mm = 30\nsigma_um = 5\n'
    for n, (x, y, z) in SPHERES.items()
)

Places = dict[tuple[str, int], np.ndarray]  # (3,) [mm] by file and number of the position


# A day and its log ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Case:
    """What a seed draws."""

    seed: int
    command: str
    kind: str

    @property
    def process(self) -> bool:
        return self.seed % IN_A_PROCESS == 0


def case_of(seed: int) -> Case:
    """Commands and lies in turn: their numbers have no common divisor."""
    return Case(seed, COMMANDS[seed % len(COMMANDS)], list(LIES)[seed % len(LIES)])


@dataclass(frozen=True, eq=False)
class Question:
    """What is asked of a command on a day: its options beside the log."""

    day: LoggedDay
    options: tuple[str, ...] = ()
    page: int = 0  # the first that may be written anew
    pages: str = ""  # what the cell has written of the pages so far, CSV
    touches: str = ""  # CSV
    above: float = 0.0  # [K] of what rises count from over the reference


def drawn(case: Case, durations: list[float]) -> Question:
    """A day in which a command is asked, by the durations [s] of the pages."""
    rng = np.random.default_rng([case.seed, 71])
    if case.command in IN_PAGES:
        return in_the_middle_of_a_job(rng, case.command, durations)
    stretches = work(rng, rng.uniform(1, 7) * HOUR)
    end = sum(s.seconds for s in stretches)
    begin = 0.0 if rng.random() < 0.7 else rng.uniform(0, 0.6) * end
    day = logged_day(rng, stretches, begin, end, begin if rng.random() < 0.5 else 0.0)
    if case.command == "anchor":
        return Question(day, touches=touched(rng, day))
    if begin == 0.0 and rng.random() < 0.2:
        return Question(day, ("--set", "log.reference='start'"), above=float(day.course.air[0] - REFERENCE))
    return Question(day)


def logged_day(rng: np.random.Generator, stretches: list[Stretch], begin: float, end: float, zero: float) -> LoggedDay:
    real = course(rng, stretches)
    sensing = drawn_sensing(rng, begin, end)
    return LoggedDay(stretches, real, sensing, end, zero, logged(rng, real, sensing, end, zero))


def in_the_middle_of_a_job(rng: np.random.Generator, command: str, durations: list[float]) -> Question:
    """The job was planned after hours of work; it starts late, with breaks that nobody told of, and waits at pages."""
    planned = PLANNED_H * HOUR
    stretches = work(rng, planned) if rng.random() < 0.5 else [Stretch("moving", 200.0, planned)]
    stretches.append(Stretch("idle", 0.0, rng.uniform(0, 60) * MINUTE * (rng.random() < 0.6)))
    page = int(rng.integers(1, len(durations) + 1))
    starts = []
    for duration in durations[: page - 1]:
        starts.append(sum(s.seconds for s in stretches))
        pause = rng.uniform(0, 15) * MINUTE * (rng.random() < 0.5) + 90.0
        stretches += [Stretch("moving", 20.0, duration), Stretch("idle", 0.0, pause)]
    end = sum(s.seconds for s in stretches)
    if command == "follow" and starts and rng.random() < 0.5:  # it looks while a page runs
        end = starts[-1] + 0.5 * durations[page - 2]
    first = planned - rng.uniform(10, 60) * MINUTE  # or with the robot cold, as the job was to start, or during the job
    begin = float(rng.choice([0.0, first, planned, planned + 0.5 * max(end - planned - 10 * MINUTE, 0)]))
    begin = min(begin, end - 5 * MINUTE)
    zero = begin if begin <= planned and rng.random() < 0.5 else 0.0
    day = logged_day(rng, stretches, begin, end, zero)
    rows = [f"{start - zero:.1f},{n}" for n, start in enumerate(starts, 1)]
    return Question(day, ("--planned", f"{planned - zero:.3f}s"), page, "\n".join(["time_s,page", *rows]) + "\n")


def touched(rng: np.random.Generator, day: LoggedDay) -> str:
    """Touches in the log's last minutes: joints at which the true, warm arm holds the probe at the spheres."""
    names = [list(SPHERES)[n % len(SPHERES)] for n in range(TOUCHES)]
    when = day.end - 60.0 * np.arange(TOUCHES)[::-1]
    there = np.array([SPHERES[n] for n in names]) + TOUCH_NOISE_MM * rng.normal(size=(TOUCHES, 3))
    commanded = np.tile(frame(0, 0, 0, 180, 0, 0), (TOUCHES, 1, 1))
    commanded[:, :3, 3] = there
    rise = {node: np.interp(when, day.course.time, r) for node, r in day.course.rise.items()}
    for _ in range(4):
        joints = joints_by_config(commanded @ np.linalg.inv(PROBE), ["N U T, 0, 0, 0"] * TOUCHES)
        commanded[:, :3, 3] += there - real_tool(joints, rise, PROBE)
    rows = (",".join(f"{v:.6f}" for v in row) for row in np.degrees(joints))
    lines = [
        f"{t - day.zero:.0f},{n},{row},{1000 * TOUCH_NOISE_MM}" for t, n, row in zip(when, names, rows, strict=False)
    ]
    return "\n".join(["time_s,target,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,sigma_um", *lines]) + "\n"


# The judge's arm --------------------------------------------------------------------------------------------------


def real_tool(joints: np.ndarray, rise: dict, tool: np.ndarray = TOOL) -> np.ndarray:
    """Where the tool of an arm with rises is at pendant angles (N, 6) [rad], (N, 3) [mm]."""
    rise = {node: np.broadcast_to(r, len(joints)) for node, r in rise.items()}
    return jobs.tool_poses(dh_angles(joints), rise, CTE, {}, tool)[:, :3, 3]


@dataclass(frozen=True, eq=False)
class Positions:
    """Positions of programs, by file and number."""

    keys: list
    pose: np.ndarray  # (N, 4, 4) [mm]
    config: list[str | None]

    @property
    def places(self) -> Places:
        return dict(zip(self.keys, self.pose[:, :3, 3], strict=True))

    def flown(self, rise: dict) -> Places:
        """Where an arm with rises really brings the tool."""
        joints = joints_by_config(self.pose @ np.linalg.inv(TOOL), self.config)
        return dict(zip(self.keys, real_tool(joints, rise), strict=True))


def positions_of(files: Iterable[Path]) -> Positions:
    keys, groups = [], []
    for file in files:
        read = naive_ls.read(file.read_bytes())[0]
        keys += [(file.name, n) for n in read]
        groups += [p.groups[1] for p in read.values()]
    pose = np.array([frame(*(g.axes[k] for k in "XYZWPR")) for g in groups]).reshape(-1, 4, 4)
    return Positions(keys, pose, [g.config for g in groups])


def apart_um(a: Places, b: Places, files: Iterable[str] = ()) -> float:
    """The largest distance of what both have, in some files or in all."""
    both = [key for key in a if key in b and (not files or key[0] in files)]
    return 1000 * max((float(np.linalg.norm(a[key] - b[key])) for key in both), default=0.0)


# Running a command -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Outcome:
    """What a command made of a log."""

    result: str  # taken, kept (it had nothing to write), refused, outside (its bounds)
    code: int
    words: str
    places: Places = field(default_factory=dict)  # where it sends or expects the tool
    band_um: float = float("inf")  # of 95 %, as it is printed
    hidden_um: float = 0.0  # printed beside it: a sensor that is off unseen
    off_um: float | None = None  # what it leaves on the true arm
    written: tuple[str, ...] = ()  # pages that it has written anew


class Bench:
    """What all cases share: path files, the planned programs, and a job in pages."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        world = self.world()
        files = world / "in"
        for name, text in (("job.toml", JOB), ("pages.toml", PAGES)):
            (files / name).write_text(text)
            self.ran(world, ["predict", name, "--program", "-q", "-o", str(world / name)])
        self.ran(world, ["generate", "pages.toml", "--set", "robot.controller.max_positions=110", "-q",
                         "-o", str(world / "out")])  # fmt: skip
        self.plan = positions_of((world / "job.toml").glob("*.LS"))
        self.pages = self._folder / "pages"
        shutil.copytree(world / "out", self.pages)
        manifest = json.loads((self.pages / "PAGES.pages.json").read_text())
        report = json.loads((self.pages / "report.json").read_text())
        self.band_um = band_of(report["band"])[0]
        starts = [page["start_s"] for page in manifest["pages"]]
        self.durations = np.diff([*starts, report["timing"]["duration_s"]]).tolist()
        whole = positions_of((world / "pages.toml").glob("*.LS"))
        number = dict(zip((n for _, n in whole.keys), range(len(whole.keys)), strict=True))
        self.plan_of_pages = {
            (page["file"], n - page["first_position"] + 1): whole.pose[number[n], :3, 3]
            for page in manifest["pages"]
            for n in range(page["first_position"], page["last_position"] + 1)
        }

    def world(self) -> Path:
        """A folder for a run, with nothing in it but the path files."""
        world = self._folder / "world"
        shutil.rmtree(world, ignore_errors=True)
        (world / "in").mkdir(parents=True)
        for name, text in (("job.toml", JOB), ("pages.toml", PAGES), ("artefact.toml", ARTEFACT)):
            (world / "in" / name).write_text(text)
        return world

    @staticmethod
    def ran(world: Path, line: list[str]) -> None:
        end = kills.run(line, world, kills.Stop())
        assert end.code == 0, end.error

    def outcome(self, case: Case, question: Question, log: Log) -> Outcome:
        """A command with a log."""
        world = self.world()
        (world / "in" / "log.csv").write_text(log.text())
        (world / "in" / "cell.csv").write_text(question.pages)
        (world / "in" / "touches.csv").write_text(question.touches)
        if case.command in IN_PAGES:
            shutil.copytree(self.pages, world / "out")
        stop = kills.Stop(process=case.process)
        end = kills.run(line_of(case.command, question, world), world, stop)
        if end.code not in (0, 1) or "Traceback" in end.error or (case.command == "whatif" and end.code):
            return Outcome("refused", end.code, end.error)
        if case.command in IN_PAGES:
            return self._of_pages(question, world, end)
        if end.code:
            return Outcome("outside", end.code, end.error)
        if case.command == "anchor":
            more = kills.run(["generate", "job.toml", "--state", "state.toml", "-q", "-o", str(world / "out")],
                             world, stop)  # fmt: skip
            if more.code:
                return Outcome("outside", more.code, more.error)
        return self._told(case.command, question, world / "out", end)

    def _of_pages(self, question: Question, world: Path, end: kills.End) -> Outcome:
        pages = sorted(self.pages.glob("PAGES_*.LS"))
        now = [world / "out" / page.name for page in pages]
        written = tuple(a.name for a, b in zip(pages, now, strict=True) if a.read_bytes() != b.read_bytes())
        places = positions_of(now).places
        if not written:
            helpless = end.code == 0 or "it runs" in end.error  # the page that runs is off, and none else is
            return Outcome("kept" if helpless else "refused", end.code, end.error, places, self.band_um)
        anew = positions_of(world / "out" / name for name in written)
        off = apart_um(anew.flown(question.day.course.rises_at(question.day.end)), self.plan_of_pages)
        band = band_of(json.loads((world / "out" / "resume.json").read_text())["band"])
        return Outcome("taken", end.code, end.error, places, *band, off, written)

    def _told(self, command: str, question: Question, out: Path, end: kills.End) -> Outcome:
        true = {n: r - question.above for n, r in question.day.course.rises_at(question.day.end).items()}
        if command in ("generate", "anchor"):
            report = json.loads((out / "report.json").read_text())
            positions = positions_of(sorted(out.glob("*.LS")))
            planned = dict(zip(positions.keys, self.plan.pose[:, :3, 3], strict=True))
            off = apart_um(positions.flown(true), planned)
            return Outcome("taken", 0, end.error, positions.places, *band_of(report["band"]), off)
        rise, band = rises_told(command, out, end.error)
        places = self.plan.flown(rise)
        if command == "predict":
            places = dict(zip(self.plan.keys, predicted(out / "waypoints.csv"), strict=True))
        return Outcome("taken", 0, end.error, places, *band, apart_um(places, self.plan.flown(true)))


def line_of(command: str, question: Question, world: Path) -> list[str]:
    """The command line."""
    log = ["--set", "log.file='log.csv'", *question.options, "-q"]
    out = ["-o", str(world / "out")]
    match command:
        case "resume":
            start = ["--from-page", str(question.page), "--done", str(question.page - 1)]
            return ["resume", str(world / "out"), *start, "--log", "log.csv", "-q"]
        case "follow":
            cell = ["--pages", "cell.csv", "--lead", "5s", "--once", "--json"]
            return ["follow", str(world / "out"), "--log", "log.csv", *cell, *question.options]
        case "anchor":
            touches = ["--touches", "touches.csv", "--artefact", "artefact.toml"]
            return ["anchor", "job.toml", *touches, "--log", "log.csv", "-q", "-o", "state.toml"]
        case "check":
            return ["check", "job.toml", *log, "--json"]
        case "whatif":
            return ["whatif", "job.toml", "--vary", "process.feed_mm_s=100", "--no-live", "--workers", "1", *log, *out]
    return [command, "job.toml", *log, *out]


def rises_told(command: str, out: Path, printed: str) -> tuple[dict, tuple[float, float]]:
    """Rises [K] that a command believes the program to start with, and ``band_of``."""
    if command == "whatif":
        (row,) = csv.DictReader((out / "whatif.csv").open())
        band = float(row["band_um"]), float(row["sensor_um"])
        return {node: float(row[f"start_{node}_K"]) for node in LAW}, band
    if command == "heat":
        record = json.loads((out / "heat.json").read_text())
        return record["rise_K"]["start"], band_of(record["band"]["first"])
    record = json.loads(printed[printed.index("{") :] if command == "check" else (out / "report.json").read_text())
    return record["thermal"]["start_K"], band_of(record["band"])


def band_of(record: dict) -> tuple[float, float]:
    """The 95 % of a printed band, and what it says beside that of a sensor [um]."""
    return record["p95_um"], sum(u["size_um"][1] for u in record["unknown"] if "sensor" in u["what"])


def predicted(waypoints: Path) -> np.ndarray:
    """Where the tool is expected, uncorrected, (N, 3) [mm]."""
    rows = list(csv.DictReader(waypoints.open()))
    return np.array([[float(r[f"{k}_mm"]) + float(r[f"before_d{k}_um"]) / 1000 for k in "xyz"] for r in rows])


# Judging ---------------------------------------------------------------------------------------------------------


def judged(case: Case, honest: Outcome, lie: Outcome) -> dict:
    """A row of the journal."""
    row: dict[str, Any] = {"seed": case.seed, "command": case.command, "kind": case.kind, "process": case.process}
    row |= {"honest": told(honest), "lie": told(lie), "wrong": ""}
    row["p95_um"] = round(min(honest.band_um, lie.band_um), 2)
    row["band_um"] = round(min(o.band_um + o.hidden_um for o in (honest, lie)), 2)
    if lie.result == "taken":
        row["moved_um"] = round(moved_um(honest, lie), 2)
    if lie.result == "kept":
        row["withheld_um"] = round(apart_um(honest.places, lie.places, honest.written) if honest.written else 0.0, 2)
    for name, outcome in (("the honest log", honest), ("the lie", lie)):
        if outcome.result == "refused" and not well_told(case.command, outcome):
            row["wrong"] = f"{name} is badly refused: exit {outcome.code}"
    if row.get("moved_um", 0) > row["band_um"]:
        unseen = case.kind in WHOLE_DAYS and case.command in GIVEN_A_LOG_ALONE
        row["unseen" if unseen else "wrong"] = f"moved by {row['moved_um']:g} um, the band is {row['band_um']:g} um"
    return row


def moved_um(honest: Outcome, lie: Outcome) -> float:
    """How far a lie sends the tool from where the honest log does; without that one, what it leaves on the true arm."""
    if honest.places:
        return apart_um(honest.places, lie.places, lie.written)
    return lie.off_um or 0.0


def well_told(command: str, outcome: Outcome) -> bool:
    """Whether a refusal is one line that names a file; a look that keeps the pages names the log or a column of it."""
    if "Traceback" in outcome.words:
        return False
    if command == "follow" and outcome.code == 1:
        return any(word in outcome.words for word in ("log.csv", "_degC", "time_s"))
    lines = [line for line in outcome.words.splitlines() if not line.startswith(("{", "cgen: note:"))]
    named = len(lines) == 1 and len(lines[0]) <= 300 and ".csv" in lines[0]
    return named and outcome.code == (1 if command == "whatif" else 2)  # a study ends, and each scenario has its reason


def told(outcome: Outcome) -> dict:
    """An outcome in a row."""
    words = " ".join(line for line in outcome.words.splitlines() if line[:1] not in "{} ")[:300]
    shown = {"result": outcome.result, "code": outcome.code}
    shown |= {} if outcome.result in ("taken", "kept") else {"words": words}
    return shown | ({} if outcome.off_um is None else {"off_um": round(outcome.off_um, 2)})


def tried(bench: Bench, keep: Path | None, seed: int) -> dict:
    """A seed's day, honestly logged and with a lie; where to keep the files of what is wrong."""
    case = case_of(seed)
    question = drawn(case, bench.durations)
    lie = LIES[case.kind](question.day, np.random.default_rng([seed, 73]))
    honest = bench.outcome(case, question, question.day.log)
    row = judged(case, honest, bench.outcome(case, question, lie))
    if row["wrong"] and keep:
        kept = keep / str(seed)
        kept.mkdir(parents=True, exist_ok=True)
        line = shlex.join(line_of(case.command, question, Path()))
        for name, text in {
            "honest.csv": question.day.log.text(), "log.csv": lie.text(), "cell.csv": question.pages,
            "touches.csv": question.touches, "artefact.toml": ARTEFACT, "job.toml": JOB, "pages.toml": PAGES,
            "line.txt": f"cgen {line}\n",
        }.items():  # fmt: skip
            (kept / name).write_text(text)
    return row


# Telling ---------------------------------------------------------------------------------------------------------


def table(rows: list[dict]) -> str:
    """Counts by lie and by command; how honest logs fared; whatever is wrong."""
    lines = [f"seeds {seed_journal.ranges_of(row['seed'] for row in rows)}, "
             f"{sum(row['process'] for row in rows)} of them in a process too"]  # fmt: skip
    lines += counted("lie", "kind", rows, LIES) + counted("command", "command", rows, COMMANDS)
    honest = [row["honest"] for row in rows]
    used = [h for h in honest if h["result"] in ("taken", "kept")]
    beyond = [r for r in rows if r["honest"].get("off_um", 0) > r["band_um"]]
    lines.append(f"honest logs: {len(honest)}, {len(used)} used ({100 * len(used) / max(len(honest), 1):.1f} %); "
                 f"beyond the band on the true arm {len(beyond)}")  # fmt: skip
    lines += [f"  {r['seed']} {r['command']}: {r['honest']['off_um']:g} um, the band is {r['band_um']:g} um"
              for r in beyond]  # fmt: skip
    within = sum(r["lie"]["result"] == "taken" and r["moved_um"] <= r["p95_um"] for r in rows)
    lines.append(f"lies taken that move by no more than the 95 % alone: {within}")
    withheld = [r["withheld_um"] for r in rows if r.get("withheld_um")]
    lines.append(f"pages kept by a lie where the honest log writes them anew: {len(withheld)}, "
                 f"by up to {max(withheld, default=0):.1f} um")  # fmt: skip
    refused = Counter(
        (r["command"], h["result"], h["words"]) for r, h in zip(rows, honest, strict=False) if h not in used
    )
    lines += [f"  {count} {' '.join(key)}" for key, count in refused.most_common()]
    return "\n".join([*lines, *(f"WRONG {r['seed']} {r['command']}, {r['kind']}: {r['wrong']}"
                                for r in rows if r["wrong"])])  # fmt: skip


def counted(title: str, key: str, rows: list[dict], names: Iterable[str]) -> list[str]:
    """Lines of counts."""
    columns = ("tried", "taken", "kept", "refused", "outside", "unseen", "WRONG")
    lines = [f"{title:<21}" + "".join(f"{c:>8}" for c in columns) + "   largest move among the taken, not wrong [um]"]
    for name in (*names, "all"):
        of = [row for row in rows if name in ("all", row[key])]
        results = Counter(row["lie"]["result"] for row in of)
        counts = [len(of), *(results[c] for c in columns[1:5]), sum("unseen" in r for r in of),
                  sum(bool(r["wrong"]) for r in of)]  # fmt: skip
        hidden = max((r.get("moved_um", 0) for r in of if not r["wrong"] and "unseen" not in r), default=0)
        lines.append(f"{name:<21}" + "".join(f"{c:8}" for c in counts) + f"{hidden:11.1f}")
    return lines


def main() -> int:
    """Try the seeds that the journal has not, and print the table of all."""
    given = seed_journal.parser("lying_logs", __doc__, "0:168").parse_args()
    if not given.table:
        os.environ["CC"] = ""
        load_everything()
        kills.HANGS_S = HANGS_S
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_B, MEMORY_B))
        with tempfile.TemporaryDirectory() as folder:
            bench = Bench(Path(folder))
            given.journal.keep_trials(given.seeds, given.budget, partial(tried, bench, given.keep))
    rows = given.journal.rows(given.seeds)
    return seed_journal.conclude("lying_logs.py", rows, table(rows), lambda row: row["wrong"])


if __name__ == "__main__":
    sys.exit(main())
