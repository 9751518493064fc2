"""Damaged TOML, CSV and JSON files at every command: it takes them, or refuses them in one line.

python tests/campaigns/mutants.py --seeds 0:1000                 draws, tries and adds to mutants.jsonl; again goes on
python tests/campaigns/mutants.py --seeds 0:1000 --table         only the table of what is in mutants.jsonl

A seed draws a command with its files and damages them in one to three places. Wrong is: a Python traceback, more than
one line on the error stream, a line that is over 300 characters or not printable, an exit code other than 0 to 3, a
refusal without a message, an output folder after a refusal. A run over the time limit is counted as slow, and its seed
is told. A failure is shrunk to the fewest changes that fail, and its files stay under --keep.
"""

import io
import os
import random
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterable
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

import seed_journal  # noqa: E402
from ls_text import at, program  # noqa: E402
from shrinking import shrunk  # noqa: E402

from compgen.cli import main  # noqa: E402
from compgen.core import evaluation  # noqa: E402

ROBOT = ROOT / "robots" / "m710ic50.toml"
LIMIT = 60  # s of one run
AT_ONCE = 200  # seeds in one process
MEMORY = 6 << 30  # bytes of the whole process

PATH = """title = "a short line"
robot = "arm.toml"
[path]
pattern = "line"
axis = "y"
length_mm = 60
x_mm = 1350
y_mm = -30
z_mm = 203
[tool]
number = 1
z_mm = 150.5
w_deg = 0
[process]
feed_mm_s = 50
chord_um = 5
spacing_mm = 5
[posture]
elbow = "up"
[compensation]
start_drift_um = 5
[[before]]
state = "moving"
feed_mm_s = 200
duration_h = 2
duty = 0.5
[[before]]
state = "idle"
duration_h = 0.5
[[after]]
state = "off"
duration_h = 1
[bounds]
max_um = 5
"""
AMBIENT = '[ambient]\nkind = "csv"\nfile = "air.csv"\nreference_degC = 20\n'
LOG = '[log]\nfile = "log.csv"\nreference = "start"\n'
SPIRAL = PATH.replace(
    'pattern = "line"\naxis = "y"\nlength_mm = 60', 'pattern = "spiral"\ndiameter_mm = 60\nstepover_mm = 15'
)
RASTER = PATH.replace(
    'pattern = "line"\naxis = "y"\nlength_mm = 60', 'pattern = "raster"\ndiameter_mm = 60\nstepover_mm = 20'
)
FRAMES = "".join(
    f"[{kind}.{n}]\nx_mm = {x}\ny_mm = 0\nz_mm = 10\nw_deg = 0\np_deg = 1.5\nr_deg = 0\n"
    for kind, n, x in (("uframe", 1, 1200), ("utool", 1, 0))
)
BACKUP = """[*SYSTEM*]$MNUFRAME  Storage: CMOS  Access: RW  : ARRAY[1,9] OF POSITION
    [1,1] =
  Group: 1   Config: N D B, 0, 0, 0
  X:  1200.000   Y:     0.000   Z:    10.000
  W:     0.000   P:     1.500   R:     0.000
[*SYSTEM*]$MNUTOOL  Storage: CMOS  Access: RW  : ARRAY[1,9] OF POSITION
    [1,1] =
  Group: 1   Config: N D B, 0, 0, 0
  X:     0.000   Y:     0.000   Z:    10.000
  W:     0.000   P:     1.500   R:     0.000
"""
BEFORE = '[[before]]\nstate = "moving"\nfeed_mm_s = 200\nduration_h = 3\n'
AIR = "time_s,ambient_degC\n" + "".join(f"{600 * n},{20 + 0.1 * n:.1f}\n" for n in range(12))
READINGS = "time_s,ambient_degC,part_6_degC\n" + "".join(f"{600 * n},20,{20 + 0.4 * n:.1f}\n" for n in range(12))
LIST = "feed,before.0.duration_h\n20,1\n40,2\n"
LINES = "line,run,direction,x_mm,y_mm,z_mm,dx_um,dy_um,dz_um\n" + "".join(
    f"x,{run},{sense},{900 + 20 * n},0,0,{sense * n:.1f},{n / 7:.3f},\n"
    for run in (1, 2)
    for sense in (1, -1)
    for n in range(8)
)
WORDS = (
    "1e308", "-1e308", "nan", "inf", "-inf", "0", "-1", "1e-300", "-0.0", '""', '"' + "x" * 1000 + '"', "[]", "{}",
    "true",
    "9" * 400, "9" * 5000, "1979-05-27", "07:32:00", "[" * 3000 + "]" * 3000, "[[1, 2], [3]]", '"a\\nb"',
    '"\\u001b[31m"',
    '"漢"', '"/etc/passwd"', '"/dev/zero"', '".."', '"\\u0000"', "0x10", "1_000", "'", '"', "= 3",
    "{a = {b = {c = 1}}}",
    "[1, 2, 3]", '["a", 1]', "-273.15", "1e6", "0.5", "7", "root:x:0:0:root", "=cmd|' /C calc'!A0", " ", "\t", "1,5",
    "١٢",
)  # fmt: skip
NUMBERS = (0, 1, -1, 2, 3, 5, 7, 12, 30, 90, -90, 180, 360, 100, 1000, 1e4, 0.5, 0.01, 1e-6, -0.3)
SET = (
    "a." * 3000 + "b=1", "process.feed_mm_s=", "=", "before.0=[]", "before.9.state=off", "tool={z_mm=1}", "robot.dh=3",
    "robot.name=x", "path.x_mm=" + "[" * 3000, "title=漢", "bounds.max_um=1e-3", "before.x=1", "ambient.kind=ramp",
    "robot.thermal.model=network", "process.thin_um=1", "compensation={}", "path=1", "cycle.0.program=job", "robot=..",
)  # fmt: skip


@dataclass(frozen=True)
class Case:
    """A command and the files that it reads."""

    arguments: tuple[str, ...]
    files: dict[str, bytes]


@dataclass(frozen=True)
class Outcome:
    """How a run ended: passed, refused, slow or failed, and what it said."""

    kind: str
    reason: str
    seconds: float


def base_cases(robot: str, poses: str) -> list[tuple[int, tuple[str, ...], dict[str, str]]]:
    """Weight, arguments and files of each command; the first files are damaged most."""
    arm = {"arm.toml": robot}
    listing = program(
        ["J P[1] 50% FINE", "L P[2] 100mm/sec CNT50", "L P[3] 100mm/sec FINE"],
        [at(n, [5 * n, 10, -20, 3, -60, 8]) for n in (1, 2, 3)],
    ).decode()
    air = {"job.toml": PATH + AMBIENT, "air.csv": AIR, **arm}
    log = {"job.toml": PATH + LOG, "log.csv": READINGS, **arm}
    out = ("-o", "out")
    return [
        (10, ("check", "job.toml"), {"job.toml": PATH, **arm}),
        (3, ("check", "job.toml"), {"job.toml": SPIRAL, **arm}),
        (3, ("check", "job.toml"), {"job.toml": RASTER, **arm}),
        (6, ("generate", "job.toml", *out), air),
        (6, ("predict", "job.toml", *out), log),
        (6, ("heat", "job.toml", *out), air),
        (6, ("heat", "job.toml", *out), log),
        (4, ("whatif", "job.toml", "--list", "list.csv", "--workers", "1", *out),
         {"list.csv": LIST, "job.toml": PATH, **arm}),
        (1, ("whatif", "job.toml", "--ask", "steady", *out), {"job.toml": PATH, **arm}),
        (6, ("inspect", "t.ls", "--robot", "arm.toml", "--frames", "f.toml"),
         {"f.toml": FRAMES, "t.ls": listing, **arm}),
        (6, ("inspect", "t.ls", "--frames", "f.va"), {"f.va": BACKUP, "t.ls": listing}),
        (6, ("correct", "t.ls", "--robot", "arm.toml", "--frames", "f.toml", "--before", "b.toml", "--force", *out),
         {"b.toml": BEFORE, "f.toml": FRAMES, **arm, "t.ls": listing}),
        (2, ("pages", "t.ls", "--robot", "arm.toml", *out), {**arm, "t.ls": listing}),
        (2, ("identify", "arm.toml", "--poses", "p.csv", "--lines", "l.csv", "-o", "out/r.toml"),
         {"p.csv": poses, "l.csv": LINES, **arm}),
        (3, ("check-robot", "arm.toml", "--poses", "p.csv", "--refit-frames"), {"p.csv": poses, **arm}),
        (2, ("plan-poses", "arm.toml", "-n", "8", *out), arm),
    ]  # fmt: skip


def draw(seed: int, bases: list[tuple[int, tuple[str, ...], dict[str, str]]]) -> tuple[Case, list[tuple[str, int]]]:
    """A case as it is, and its changes: a file and the seed of one change each."""
    rng = random.Random(seed)
    _, arguments, files = rng.choices(bases, weights=[w for w, _, _ in bases])[0]
    names = rng.choices(list(files), weights=[4.0 / (1 + k) for k in range(len(files))], k=rng.choice((1, 1, 1, 2, 3)))
    if arguments[0] in ("check", "generate", "predict", "heat", "whatif", "correct") and rng.random() < 0.2:
        arguments = (*arguments, "--set", rng.choice(SET))
    case = Case(arguments, {name: text.encode() for name, text in files.items()})
    return case, [(name, rng.randrange(1 << 30)) for name in names if not name.endswith(".ls")] or [(names[0], 1)]


def damaged(case: Case, changes: list[tuple[str, int]]) -> Case:
    """A case with its changes made."""
    files = dict(case.files)
    for name, seed in changes:
        files[name] = _changed(files[name], name.endswith(".csv"), random.Random(seed))
    return Case(case.arguments, files)


def _changed(content: bytes, is_csv: bool, rng: random.Random) -> bytes:
    """A file with one change: mostly of a value, at times of a line, a byte or the whole."""
    draw = rng.random()
    if draw < 0.6:
        return (_changed_cell if is_csv else _changed_value)(content, rng)
    lines = content.split(b"\n")
    n = rng.randrange(len(lines))
    if draw < 0.75:
        match rng.randrange(4):
            case 0:
                del lines[n]
            case 1:
                lines.insert(n, lines[n])
            case 2:
                lines.insert(
                    n, rng.choice((b"nonsense = 1", b"[nonsense]", b"[[before]]", b"#", b",", b"\xff\xfe", b"= "))
                )
            case _:
                lines = lines[:n]
        return b"\n".join(lines)
    if draw < 0.9 and content:
        at_byte = rng.randrange(len(content))
        new = rng.choice((b"", bytes([rng.randrange(256)]), b"\0", b"\r", b'"', b"\xc3", b"[", b"e9", b"."))
        return content[:at_byte] + new + content[at_byte + 1 :]
    whole: tuple[Callable[[], bytes], ...] = (
        lambda: content.replace(b"\n", b"\r\n"), lambda: content.replace(b"\n", b"\r"),
        lambda: b"\xef\xbb\xbf" + content,
        lambda: content.decode("latin-1").encode("utf-16"), lambda: b"",
        lambda: content[: rng.randrange(len(content) + 1)],
        lambda: b".".join([b"a"] * 3000) + b" = 1\n" + content, lambda: b'a = "' + b"x" * 200_000 + b'"\n' + content,
        lambda: b"a," + b"x" * 140_000 + b"\n" + content, lambda: content + content, lambda: content.replace(b".",
        b","),
        lambda: content.replace(b",", b";"), lambda: b"\0" * 100,
        lambda: b"a = " + b"[" * 2000 + b"]" * 2000 + b"\n" + content,
    )  # fmt: skip
    return rng.choice(whole)()


def _changed_value(content: bytes, rng: random.Random) -> bytes:
    """A key's value replaced, a number in it moved, or the key renamed."""
    lines = content.split(b"\n")
    keyed = [n for n, line in enumerate(lines) if re.search(rb"[=:]", line) and not line.startswith(b"#")]
    if not keyed:
        return content
    n = rng.choice(keyed)
    key, mark, value = re.split(rb"([=:])", lines[n], maxsplit=1)
    numbers = list(re.finditer(rb"-?\d+(\.\d+)?", value))
    draw = rng.random()
    if draw < 0.1:
        lines[n] = key + rng.choice((mark, b".x =", b"x =", b" ", b"\xc3\xa9 =")) + value
    elif draw < 0.7 and numbers:
        number = rng.choice(numbers)
        new = float(number[0]) * 10 ** rng.uniform(-3, 3) if rng.random() < 0.6 else rng.choice(NUMBERS)
        text = repr(round(new)) if number[1] is None and rng.random() < 0.8 else repr(new)
        lines[n] = key + mark + value[: number.start()] + text.encode() + value[number.end() :]
    else:
        lines[n] = key + mark + b" " + rng.choice(WORDS).encode()
    return b"\n".join(lines)


def _changed_cell(content: bytes, rng: random.Random) -> bytes:
    """A cell, or a whole column, replaced or scaled."""
    rows = [line.split(b",") for line in content.split(b"\n")]
    n = rng.randrange(len(rows))
    k = rng.randrange(len(rows[n]))
    word, factor = rng.choice(WORDS).encode(), rng.choice((-1, 1e3, 1e-3, 57.29578, 1e6, 0))
    whole, scaled = rng.random() < 0.3, rng.random() < 0.4
    for i, row in enumerate(rows):
        if (i == n or (whole and i > 0)) and k < len(row):
            try:
                row[k] = repr(float(row[k]) * factor).encode() if scaled else word
            except ValueError:
                row[k] = word
    return b"\n".join(b",".join(row) for row in rows)


class TooSlow(BaseException):
    """The time limit of one run."""


def _stop(signum: int, frame: object) -> None:
    raise TooSlow


def attempt(case: Case, folder: Path, limit: int = LIMIT) -> Outcome:
    """Run a case in a folder of its own, and judge how it ends."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name, content in case.files.items():
        (folder / name).write_bytes(content)
    out, err, code, start = io.StringIO(), io.StringIO(), None, time.monotonic()
    before, sys.argv = sys.argv, ["cgen", *case.arguments]
    previous = signal.signal(signal.SIGALRM, _stop)
    signal.alarm(limit)
    try:
        with chdir(folder), redirect_stdout(out), redirect_stderr(err), warnings.catch_warnings():
            warnings.simplefilter("always")
            main.main()
    except SystemExit as ending:
        code = ending.code
    except TooSlow:
        return Outcome("slow", f"over {limit} s", time.monotonic() - start)
    except BaseException as failure:
        last = traceback.extract_tb(failure.__traceback__)[-1]
        where = f"{Path(last.filename).name}:{last.lineno}"
        return Outcome("failed", f"{type(failure).__name__} at {where}: {failure}"[:200], time.monotonic() - start)
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, previous)
        sys.argv = before
        evaluation.configure(None)
    return Outcome(*_judged(code, out.getvalue(), err.getvalue(), folder), time.monotonic() - start)


def _judged(code: object, out: str, err: str, folder: Path) -> tuple[str, str]:
    """Passed, refused or failed, and why."""
    lines = [line for line in err.splitlines() if not line.startswith("cgen: note: ")]
    if code not in (0, 1, 2, 3):
        return "failed", f"exit code {code}"
    if len(lines) > 1 or any(len(line) > 300 or not line.isprintable() for line in lines):
        return "failed", f"stderr: {err[:300]!r}"
    if "Traceback" in out or "Traceback" in err:
        return "failed", "a traceback in the output"
    if code == 0:
        return ("failed", f"exit 0, and yet: {err[:200]!r}") if lines else ("passed", "")
    if not lines:
        return "failed", f"exit {code} without a word"
    if code in (2, 3) and (folder / "out").exists():
        return "failed", f"exit {code}, and yet there is an output folder: {err[:150]!r}"
    return ("passed" if code == 1 else "refused"), err.strip()


def smallest(case: Case, changes: list[tuple[str, int]], folder: Path) -> Case:
    """The case with the fewest of the changes with which it still fails."""
    fewest = shrunk(changes, lambda fewer: bool(fewer) and attempt(damaged(case, fewer), folder).kind == "failed")
    return damaged(case, fewest)


def measured_poses(count: int) -> str:
    """A CSV file of poses that fit the shipped robot to 0.05 mm."""
    import numpy as np

    from compgen.core.units import DEG, MM
    from compgen.pipelines.files.robot_file import load_any_robot
    from compgen.robot.kinematics import flange_pose

    arm, rng = load_any_robot(str(ROBOT)), np.random.default_rng(1)
    low, high = np.array([-60, -30, -20, -120, -110, -150]), np.array([60, 60, 40, 120, -20, 150])
    pendant = np.round(rng.uniform(low, high, (count, 6)), 3)
    flange = flange_pose(arm, arm.to_theta(pendant * DEG))
    place = flange.act(np.array([0.06, 0, 0.1])) / MM + rng.normal(0, 0.05, (count, 3))
    head = ",".join(f"j{k}_deg" for k in range(1, 7)) + ",x_mm,y_mm,z_mm\n"
    return head + "".join(",".join(f"{v:.4f}" for v in (*p, *q)) + "\n" for p, q in zip(pendant, place, strict=False))


def made_bases(folder: Path) -> list[tuple[int, tuple[str, ...], dict[str, str]]]:
    """The base cases, with poses that fit the shipped robot."""
    bases = base_cases(ROBOT.read_text(), measured_poses(14))
    listing = next(files["t.ls"] for _, arguments, files in bases if arguments[0] == "pages")
    attempt(
        Case(
            ("correct", "t.ls", "--robot", "m710ic50", "--before", "moving 200mm/s 3h", "--force", "-o", "out"),
            {"t.ls": listing.encode()},
        ),
        folder,
    )
    written = {name: (folder / "out" / name).read_text() for name in ("t.compgen.json", "t.ls")}
    bases.append((3, ("correct", "t.ls", "--restore", "-o", "out"), written))
    study = ("whatif", "job.toml", "--list", "list.csv", "--workers", "1", "-o", ".")
    files = {"list.csv": LIST, "job.toml": PATH, "arm.toml": ROBOT.read_text()}
    attempt(Case(study, {name: text.encode() for name, text in files.items()}), folder)
    bases.append((3, study, {"scenarios.jsonl": (folder / "scenarios.jsonl").read_text(), **files}))
    return bases


def table(entries: list[dict]) -> str:
    """Tried, passed, refused, slow and failed, by command."""
    counts: dict[str, Counter[str]] = {}
    for entry in entries:
        for name in (entry["command"], "all"):
            counts.setdefault(name, Counter())[entry["kind"]] += 1
    kinds = ("passed", "refused", "slow", "failed")
    rows: list[tuple[str, ...]] = [(f"seeds {seed_journal.ranges_of(e['seed'] for e in entries)}", "tried", *kinds)]
    rows += [
        (name, str(counts[name].total()), *(str(counts[name][kind]) for kind in kinds))
        for name in sorted(counts, key=lambda n: (n == "all", n))
    ]
    return "\n".join(f"{name:<16}" + "".join(f"{cell:>9}" for cell in cells) for name, *cells in rows)


def run(seeds: Iterable[int], journal: seed_journal.Journal | None = None, keep: Path | None = None) -> list[dict]:
    """Try seeds and add them to the journal; their entries."""
    entries = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "run"
        bases = made_bases(folder)
        for seed in seeds:
            case, changes = draw(seed, bases)
            outcome = attempt(damaged(case, changes), folder)
            seconds = round(outcome.seconds, 2)
            entry = {"seed": seed, "command": case.arguments[0], "kind": outcome.kind, "seconds": seconds}
            if outcome.kind in ("failed", "slow"):
                entry["reason"] = outcome.reason
                print(f"seed {seed}: {' '.join(case.arguments)}: {outcome.kind}: {outcome.reason}", flush=True)
            if outcome.kind == "failed" and keep:
                (keep / str(seed)).mkdir(parents=True, exist_ok=True)
                for name, content in smallest(case, changes, folder).files.items():
                    (keep / str(seed) / name).write_bytes(content)
            entries.append(entry)
            if journal:
                journal.add(entry)
    return entries


def in_a_fork(seeds: list[int], journal: seed_journal.Journal, keep: Path | None) -> None:
    """Try seeds in a process of their own: the memory that libraries keep goes with it."""
    child = os.fork()
    if not child:
        try:
            run(seeds, journal, keep)
        finally:
            os._exit(0)
    os.waitpid(child, 0)


if __name__ == "__main__":
    options = seed_journal.parser("mutants", __doc__, "0:1000").parse_args()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    os.environ["CC"] = ""  # what few rows there are need no compiler
    if not options.table:
        left = options.journal.left(options.seeds, options.budget)
        while seeds := list(islice(left, AT_ONCE)):
            in_a_fork(seeds, options.journal, options.keep)
    everything = options.journal.rows(options.seeds)
    sys.exit(
        seed_journal.conclude("mutants.py", everything, table(everything), lambda entry: entry["kind"] == "failed")
    )
