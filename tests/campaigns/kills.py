"""Runs that are stopped, and disks that are full: nothing half-written, nothing lost, and the next run clears up.

python tests/campaigns/kills.py --seeds 0:400            stops, judges and adds to kills.jsonl; again goes on
python tests/campaigns/kills.py --seeds 0:400 --table    only the table of what is in kills.jsonl

The first seeds end each command with SIGKILL at each of its steps of writing, one after the other in a drawn order:
into a new folder, over its own earlier result, and beside files of others. The seeds after them draw the command, what
comes (SIGKILL, SIGTERM, SIGINT, a disk that is full at a step or after some bytes, a step that is not permitted) and
when: at a step, or after a share of the time that the whole run takes, half of these in a process of the command line.
Then the same command runs to its end.
"""

import errno
import json
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Mapping
from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(Path(__file__).parent)]

import mutants  # noqa: E402
import seed_journal  # noqa: E402
from ls_text import cartesian, program  # noqa: E402
from shipped import load_everything, quiet  # noqa: E402

from compgen import __main__ as command_line  # noqa: E402
from compgen.cli.output_files import study_files  # noqa: E402
from compgen.identification.identify import identify  # noqa: E402
from compgen.identification.measurements import Measurements  # noqa: E402
from compgen.pipelines.files.robot_file import load_arm  # noqa: E402
from compgen.pipelines.measure import identification_files  # noqa: E402
from compgen.pipelines.measure.identification_files import MeasurementFiles, read_measurements  # noqa: E402
from compgen.robot.robot import Robot  # noqa: E402

AUDITED = {"open", "os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.chmod", "ctypes.dlsym"}
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT
SIGNALS = {"SIGKILL": signal.SIGKILL, "SIGTERM": signal.SIGTERM, "SIGINT": signal.SIGINT}
DISKS = {"no space": errno.ENOSPC, "no permission": errno.EACCES, "broken disk": errno.EIO}
SITUATIONS = ("new", "own", "foreign")
COPIES = "copies"  # of what a run has on the disk at each of its steps: what it would leave if it were killed there
FOREIGN = {"mine.txt": b"mine", "deep/er.txt": b"deep"}
HANGS_S = 900


@dataclass(frozen=True)
class Command:
    """A command, with an option that makes its files others."""

    arguments: tuple[str, ...]
    older: tuple[str, ...]
    newer: tuple[str, ...]
    file: str = ""  # what -o names in the folder

    def line(self, folder: Path, older: bool = False) -> list[str]:
        more = self.older if older else self.newer
        return [*self.arguments, *more, "-o", str(folder / self.file)]


FEED = ("--set", "process.feed_mm_s=50"), ("--set", "process.feed_mm_s=60")
BEFORE = ("--before", "moving 200mm/s 2h"), ("--before", "moving 200mm/s 3h")
LINES = ("--set", "controller.max_lines=40"), ("--set", "controller.max_lines=60")
ROBOT_LINES = ("--set", "robot.controller.max_lines=40"), ("--set", "robot.controller.max_lines=60")
POSES = {"few.csv": 12, "poses.csv": 14}
COMMANDS = {
    "generate": Command(("generate", "job.toml", "-q"), *FEED),
    "generate pages": Command(("generate", "job.toml", "-q", "--set", "process.spacing_mm=0.5"), *ROBOT_LINES),
    "predict": Command(("predict", "job.toml", "-q"), *FEED),
    "correct": Command(("correct", "PART.LS", "--robot", "arm.toml", "--force", "-q"), *BEFORE),
    "pages": Command(("pages", "LONG.LS", "--robot", "arm.toml", "-q"), *LINES),
    "heat": Command(("heat", "job.toml", "-q"), *FEED),
    "whatif": Command(("whatif", "job.toml", "--vary", "feed=20:60:6", "--workers", "1", "-q"), (), ()),
    "identify": Command(
        ("identify", "arm.toml", "--force", "-q"), ("--poses", "few.csv"), ("--poses", "poses.csv"), "r.toml"
    ),
    "plan-poses": Command(("plan-poses", "arm.toml"), ("-n", "7"), ("-n", "8")),
}  # fmt: skip


def made_inputs(folder: Path) -> None:
    """The files that the commands read."""
    points = [cartesian(n, (1300 + n, 20, 200, 180, 0, 0)) for n in range(1, 100)]
    long = program([f"L P[{n}] 100mm/sec FINE" for n in range(1, 100)], points, name="LONG")
    part = program(["J P[1] 10% FINE", *(f"L P[{n}] 50mm/sec FINE" for n in range(2, 9))], points[:8], name="PART")
    arm = (ROOT / "robots" / "m710ic50.toml").read_text()
    for name, content in {
        "job.toml": mutants.PATH.encode(), "arm.toml": arm.encode(), "LONG.LS": long, "PART.LS": part,
        **{file: mutants.measured_poses(count).encode() for file, count in POSES.items()},
    }.items():  # fmt: skip
        (folder / name).write_bytes(content)


# A run -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Stop:
    """What comes, and when: at a step of writing, after bytes of a file, or after seconds; COPIES changes nothing."""

    what: str = ""
    step: int = 0
    size: int = 0
    seconds: float = 0.0
    process: bool = False


@dataclass(frozen=True)
class End:
    """How a run ended."""

    code: int  # of the exit, or less than zero the signal
    error: str
    steps: list[str]
    seconds: float


def run(line: list[str], world: Path, stop: Stop) -> End:
    """A command in a world, in a forked process or one of its own."""
    start = time.monotonic()
    stderr, steps = world / "stderr", world / "steps"
    process = None
    if stop.process:
        with stderr.open("wb") as error:
            command = [sys.executable, "-m", "compgen", *line]
            environment = {**os.environ, "PYTHONPATH": str(ROOT)}
            process = subprocess.Popen(command, cwd=world / "in", stderr=error, stdout=error, env=environment)
            child = process.pid
    else:
        child = os.fork()
        if not child:
            be_the_command(line, world, stop)
    if stop.seconds:
        time.sleep(stop.seconds)
        os.kill(child, SIGNALS[stop.what])
    code = os.waitstatus_to_exitcode(waited(child))
    if process is not None:
        process.returncode = code  # it was waited for here
    events = steps.read_text().splitlines() if steps.exists() else []
    steps.unlink(missing_ok=True)
    return End(code, stderr.read_text(errors="replace"), events, time.monotonic() - start)


def waited(child: int) -> int:
    signal.signal(signal.SIGALRM, lambda *_: os.kill(child, signal.SIGKILL))
    signal.alarm(HANGS_S)
    try:
        return os.waitpid(child, 0)[1]
    finally:
        signal.alarm(0)


def be_the_command(line: list[str], world: Path, stop: Stop, number: str = "") -> None:
    """The forked process: the command line, with somebody who counts its steps and comes at one of them."""
    code = 70
    try:
        os.chdir(world / "in")
        error = os.open(world / f"stderr{number}", os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        book = os.open(world / f"steps{number}", os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        os.dup2(error, 1)
        os.dup2(error, 2)
        sys.stdout, sys.stderr = os.fdopen(1, "w", closefd=False), os.fdopen(2, "w", closefd=False)
        if stop.size:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (stop.size, stop.size))
        _watch(str(world), book, stop)
        sys.argv = ["cgen", *line]
        command_line.main()
    except SystemExit as ending:
        code = int(ending.code or 0)
        sys.stdout.flush()
        sys.stderr.flush()
    except BaseException as failure:
        os.write(2, f"Traceback: {type(failure).__name__}: {failure}\n".encode())
    finally:
        os._exit(code)


def _watch(world: str, book: int, stop: Stop) -> None:
    """Count the steps of writing, and do what comes at one of them."""
    count, inside = 0, False
    write, fsync = os.write, os.fsync

    def step(event: str) -> None:
        nonlocal count
        count += 1
        if not stop.size:
            write(book, f"{event}\n".encode())
        if stop.what == COPIES:
            for path in Path(world).glob("*out*"):
                shutil.copytree(path, Path(world, COPIES, str(count), path.name), symlinks=True)
        if count == stop.step:
            if stop.what in DISKS:
                raise OSError(DISKS[stop.what], os.strerror(DISKS[stop.what]))
            os.kill(os.getpid(), SIGNALS[stop.what])

    def audit(event: str, arguments: tuple) -> None:
        nonlocal inside
        if inside or event not in AUDITED:
            return
        inside = True  # what happens here is none of its steps
        try:
            if event == "ctypes.dlsym":
                happens = arguments[1] == "renameat2"
            else:
                here = str(arguments[0]).startswith((f"{world}/out", f"{world}/.out"))
                happens = here and (event != "open" or bool((arguments[2] or 0) & WRITING))
            if happens:
                step(event)
        finally:
            inside = False

    def slow_write(file: int, data: bytes) -> int:
        if len(data) > 1 and os.path.realpath(f"/proc/self/fd/{file}").startswith(f"{world}/out"):
            first = write(file, data[: len(data) // 2])
            step("os.write")
            return first + write(file, data[len(data) // 2 :])
        return write(file, data)

    def watched_fsync(file: int) -> None:
        step("os.fsync")
        fsync(file)

    patch.object(os, "write", slow_write).start()
    patch.object(os, "fsync", watched_fsync).start()
    sys.addaudithook(audit)


# The judge -------------------------------------------------------------------------------------------------------


def content(folder: Path) -> dict[str, bytes]:
    """Visible files by name."""
    files = (p for p in folder.rglob("*") if p.is_file())
    return {n: p.read_bytes() for p in files if not (n := str(p.relative_to(folder))).startswith(".")}


def hidden(world: Path) -> list[str]:
    """What lies about under hidden names."""
    return [str(p.relative_to(world)) for p in world.rglob(".*")]


def faults_of_files(together: bool, situation: str, older: dict, whole: dict, out: dict) -> list[str]:
    """What is wrong with the files of a folder after a run that was stopped; they may have to come in one step."""
    wrong = []
    foreign = FOREIGN if situation == "foreign" else {}
    if {n: out.get(n) for n in foreign} != foreign:
        wrong.append("a foreign file has changed")
    own, was, will = (
        {n: c for n, c in files.items() if n not in foreign and n != study_files.JOURNAL}
        for files in (out, older, whole)
    )
    sets = (was, will) if situation == "own" else ({}, will)
    if together and own not in sets:
        wrong.append(f"neither the older set nor the new one: {sorted(own)}")
    provenance = {n for n in own if n.endswith(".compgen.json") and own[n] == will.get(n)}
    others = {n: c for n, c in own.items() if n not in provenance}  # a newer one is refused beside an older program
    if all(n.endswith(".LS") for n in others) and not any(n.endswith(".pages.json") for n in will):
        others = {n: c for n, c in others.items() if c not in (was.get(n), will.get(n))}  # each stands for itself
    if not (others.items() <= was.items() or own.items() <= will.items()):
        wrong.append(f"files of two runs, or half of one: {sorted(n for n, c in own.items() if will.get(n) != c)}")
    programs = [n for n in was if n.endswith((".LS", ".toml"))]
    if len(programs) == 1 and programs[0] not in own:
        wrong.append(f"{programs[0]} is lost")
    if study_files.JOURNAL in older:
        wrong += faults_of_journal(older[study_files.JOURNAL], out.get(study_files.JOURNAL, b""))
    return wrong


def faults_of_journal(older: bytes, now: bytes) -> list[str]:
    """Scenarios that were finished stay finished."""
    rows = set(older.split(b"\n")[:-1])
    return [] if rows <= set(now.split(b"\n")) else ["finished scenarios are lost"]


def faults_of_end(world: Path, stop: Stop, end: End) -> list[str]:
    """How the end is said, and what is left lying about.

    A killed run may leave hidden files of its own, and one that was not permitted to remove them.
    """
    killed = end.code == -signal.SIGKILL
    removing = stop.what in DISKS and end.steps[stop.step - 1 : stop.step] in (["os.remove"], ["os.rmdir"])
    left = [name for name in hidden(world) if not ((killed or removing) and ".compgen-" in name)]
    return ([f"left lying about: {left[:3]}"] if left else []) + faults_of_words(stop, end, killed)


def faults_of_words(stop: Stop, end: End, killed: bool) -> list[str]:
    code = {"SIGTERM": 143, "SIGINT": 130}.get(stop.what, 2)
    lines = end.error.splitlines()
    if killed:
        return [] if stop.what == "SIGKILL" else ["killed, and yet nobody sent SIGKILL"]
    if "Traceback" in end.error or end.code not in (0, 1, code):
        return [f"exit {end.code}: {end.error[-300:]!r}"]
    if end.code == code and (len(lines) != 1 or len(lines[0]) > 300):
        return [f"exit {end.code}, and says {end.error[:300]!r}"]
    return []


def remember_fits() -> None:
    """Fit each set of poses here, once, and let the forked runs have it: a fit takes seconds and writes nothing."""
    fits = {}
    for file in POSES:
        arm = load_arm("arm.toml")
        measurements, _ = read_measurements(arm, MeasurementFiles(poses=[file]), force=True)
        fits[len(measurements.position)] = identify(
            arm.robot, arm.known, measurements, len(arm.nodes), quiet, arm.facts, temperatures=False
        )

    def remembered(robot: Robot, known: object, measurements: Measurements, *more: object, **named: object) -> object:
        return fits[len(measurements.position)]

    patch.object(identification_files, "identify", remembered).start()


class Campaign:
    """The commands' results without a stop, and the steps of each."""

    def __init__(self, folder: Path, commands: Mapping[str, Command] = COMMANDS) -> None:
        self._folder = folder
        self._inputs = folder / "inputs"
        self._inputs.mkdir()
        made_inputs(self._inputs)
        if "identify" in commands:
            with chdir(self._inputs):
                remember_fits()
        os.environ["XDG_CACHE_HOME"] = str(folder / "cache")
        self.older: dict[str, dict[str, bytes]] = {}
        self.whole: dict[str, dict[str, bytes]] = {}
        self.finished: dict[tuple[str, bool], dict[str, bytes]] = {}  # by command, and whether it is the older one
        self.ends: dict[tuple[str, str], End] = {}
        self._next: dict[tuple, list[str]] = {}
        for name, command in commands.items():
            world = self.world("reference")
            first = run(command.line(world / "out", older=True), world, Stop())
            assert first.code in (0, 1), f"{name}: exit {first.code}: {first.error}"
            self.older[name] = self.finished[name, True] = content(world / "out")
            if name == "whatif":  # what a study that was stopped has left
                lines = self.older[name][study_files.JOURNAL].split(b"\n")
                self.older[name] = {study_files.JOURNAL: b"\n".join(lines[:3]) + b"\n" + lines[3][:20]}
            for situation in SITUATIONS:
                world = self._prepared(name, situation)
                self.ends[name, situation] = run(command.line(world / "out"), world, Stop())
                self.whole[name] = {n: c for n, c in content(world / "out").items() if n not in FOREIGN}
                self.finished[name, False] = self.whole[name]
        self.boundaries = [(n, s, k) for (n, s), end in self.ends.items() for k in range(1, len(end.steps) + 1)]
        random.Random(0).shuffle(self.boundaries)

    def world(self, name: str) -> Path:
        world = self._folder / name
        shutil.rmtree(world, ignore_errors=True)
        shutil.copytree(self._inputs, world / "in")
        return world

    def _prepared(self, name: str, situation: str) -> Path:
        world = self.world("world")
        for file, data in self.files_before(name, situation).items():
            (world / "out" / file).parent.mkdir(parents=True, exist_ok=True)
            (world / "out" / file).write_bytes(data)
        return world

    def files_before(self, name: str, situation: str) -> dict[str, bytes]:
        """What a folder holds before a run."""
        return {**(self.older[name] if situation != "new" else {}), **(FOREIGN if situation == "foreign" else {})}

    def drawn(self, seed: int) -> tuple[str, str, Stop]:
        """A command, what its folder holds, and the stop."""
        if seed < len(self.boundaries):
            name, situation, step = self.boundaries[seed]
            return name, situation, Stop("SIGKILL", step)
        rng = random.Random(seed)
        (name, situation), end = rng.choice(list(self.ends.items()))
        what = rng.choice([*SIGNALS, *SIGNALS, *DISKS, "small disk"])
        if what == "small disk":
            return name, situation, Stop(what, size=int(10 ** rng.uniform(1, 5)))
        if what in DISKS or rng.random() < 0.5:
            return name, situation, Stop(what, rng.randint(1, len(end.steps)))
        process = rng.random() < 0.5
        start = 1.0 if process else 0.0
        return name, situation, Stop(what, seconds=rng.uniform(0.02, start + 1.1 * end.seconds), process=process)

    def tried(self, seed: int) -> dict:
        """A row of the journal."""
        name, situation, stop = self.drawn(seed)
        end, wrong = self.stopped(name, situation, stop)
        row = {"seed": seed, "command": name, "situation": situation, **stop.__dict__, "code": end.code, "wrong": wrong}
        reached = self.ends[name, situation].steps
        row["boundary"] = seed < len(self.boundaries)
        row["at"] = reached[stop.step - 1] if stop.step else ""
        if wrong:
            simpler = [s for s in SITUATIONS[: SITUATIONS.index(situation)] if self.stopped(name, s, stop)[1]]
            row["simplest"] = (simpler or [situation])[0]
        return row

    def stopped(self, name: str, situation: str, stop: Stop) -> tuple[End, list[str]]:
        """How a stopped run ended, and what is wrong then or after the next."""
        world = self._prepared(name, situation)
        older = self.older[name] if situation != "new" else {}
        line = COMMANDS[name].line(world / "out")
        end = run(line, world, stop)
        together = situation == "new" or (situation == "own" and not COMMANDS[name].file)
        wrong = faults_of_files(together, situation, older, self.whole[name], content(world / "out"))
        wrong += faults_of_end(world, stop, end)
        left = self._left(name, situation, world)
        if left not in self._next:
            self._next[left] = self._faults_of_next(name, situation, world)
        return end, wrong + self._next[left]

    def _left(self, name: str, situation: str, world: Path) -> tuple:
        """What a stopped run has left: what the next makes of it depends on nothing else."""
        paths = [p for p in world.rglob("*") if not p.is_relative_to(world / "in") and p.name != "stderr"]
        files = ((_without_numbers(p, world), p.read_bytes() if p.is_file() else b"/") for p in paths)
        return name, situation, *sorted(files)

    def _faults_of_next(self, name: str, situation: str, world: Path) -> list[str]:
        """What is wrong after the same command has run to its end."""
        wrong = []
        again = run(COMMANDS[name].line(world / "out"), world, Stop())
        if again.code != self.ends[name, situation].code:
            wrong.append(f"the next run ends with {again.code}: {again.error[:200]!r}")
        if content(world / "out") != {**self.whole[name], **(FOREIGN if situation == "foreign" else {})}:
            wrong.append("the next run ends with other files")
        if left := hidden(world):
            wrong.append(f"the next run leaves {left[:3]}")
        return wrong


def _without_numbers(path: Path, world: Path) -> str:
    """A name without the process and the chance in it."""
    return re.sub(r"-\d+-[0-9a-f]{16}$", "", str(path.relative_to(world)))


# Telling ---------------------------------------------------------------------------------------------------------


def kind_of(row: dict) -> str:
    if row["wrong"]:
        return "failed"
    if row["code"] == -signal.SIGKILL:
        return "killed"
    return {143: "terminated", 130: "interrupted", 2: "refused"}.get(row["code"], "too late")


def table(rows: list[dict]) -> str:
    """How the runs of each command ended."""
    kinds = ("killed", "terminated", "interrupted", "refused", "too late", "failed")
    counts: dict[str, Counter[str]] = {}
    for row in rows:
        for name in (row["command"], "all"):
            counts.setdefault(name, Counter())[kind_of(row)] += 1
    lines = [
        f"seeds {seed_journal.ranges_of(row['seed'] for row in rows)}: {sum(row['boundary'] for row in rows)} at steps "
        f"of writing in turn, {sum(row['process'] for row in rows)} in a process of the command line",
        f"{'command':<15}" + "".join(f"{kind:>12}" for kind in ("tried", *kinds)),
    ]
    for name in sorted(counts, key=lambda n: (n == "all", n)):
        cells = (counts[name].total(), *(counts[name][kind] for kind in kinds))
        lines.append(f"{name:<15}" + "".join(f"{cell:>12}" for cell in cells))
    return "\n".join([*lines, *(f"  {json.dumps(row)}" for row in rows if row["wrong"])])


def main() -> int:
    """Try the seeds that the journal has not, and print the table of all."""
    given = seed_journal.parser("kills", __doc__, "0:20").parse_args()
    if not given.table:
        os.environ["CC"] = ""
        with tempfile.TemporaryDirectory() as folder:
            load_everything()
            campaign = Campaign(Path(folder))
            print(f"{len(campaign.boundaries)} steps of writing in {len(campaign.ends)} worlds", flush=True)
            given.journal.keep_trials(given.seeds, given.budget, campaign.tried)
    rows = given.journal.rows(given.seeds)
    return seed_journal.conclude("kills.py", rows, table(rows), lambda row: row["wrong"])


if __name__ == "__main__":
    sys.exit(main())
