"""``python -m benchmarks.motion_logs FOLDER``: what logs of a maker's motion code say, asked beside measured.

FOLDER holds logs and commands of a public repository (hehonglu123/Motion-Primitive-Planning, ``simulation/roboguide``),
named as there with the folders joined by "_". Each program is written as a listing, each arm as a robot file from its
lengths, and ``executed`` and ``identify-motion`` run on them as a user runs them.
"""

import argparse
import csv
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from compgen.core.rotations import to_wpr
from compgen.identification.motion.timed_windows import timed_windows
from compgen.identification.motion.windows import residuals
from compgen.pipelines.executed.executed import Situation, judge_log, read_program_text
from compgen.pipelines.files.robot_file import load_robot
from compgen.program.frames import load_frames
from compgen.robot.motion import ControllerMotion
from compgen.verification.executed.position_log import read_position_log
from compgen.verification.twin.controller.command import corner_wait
from compgen.verification.twin.controller.smoothing import smooth

Array = NDArray[np.float64]

LENGTHS = {  # mm: height of J2, J1 to J2, J2 to J3, J3 to J4, J4 to J5, J5 to the flange
    "m710ic70": (565, 150, 870, 170, 1016, 175),
    "m900ia350": (950, 370, 1050, 200, 1250, 270),
}
AXES = ((2, 1), (1, 1), (1, -1), (0, -1), (1, -1), (0, -1))  # world axis and sense of each joint, all at zero
SISTER, SHIPPED = "m710ic70", "m710ic50"  # an arm with logs, and the shipped robot file that expects as much of its own
TOOL = np.array([493.301, 0.0, -75.0])  # mm in the flange, x out of it
TOOL_TURN = np.radians(120)  # about the flange's y
FEED = {"blade_0.5": 452, "blade_0.1": 499, "wood_0.5": 160}  # mm/s, read from the plateaus
PERIOD = 8  # ms
SPARE = 10  # periods after a log
TOGETHER = range(70, 85)  # periods that two means last together, tried
BESIDE = 0.35  # s around the corner where the lowest speed is looked for
MOVED = 0.1  # mm
BLADE = re.compile(r"m710ic_(\w+_[\d.]+)_curve_js_exe\.csv")
CORNER = re.compile(r"movel_smooth_car_movel_(\d+)_(\d+)_CNT(\d+)\.csv")
REAL_ANGLE = {("30", "200"): 46.0}  # deg: what older scripts of the source turned instead of the name's

ROBOT = """name = "{name}"
maker = "FANUC"
[dh]
d_mm = [0, 0, 0, -{d4}, 0, -{d6}]
a_mm = [{a1}, {a2}, {a3}, 0, 0, 0]
alpha_deg = [-90, 180, -90, 90, -90, 180]
[pendant]
matrix = [[1,0,0,0,0,0], [0,1,0,0,0,0], [0,1,1,0,0,0], [0,0,0,1,0,0], [0,0,0,0,1,0], [0,0,0,0,0,1]]
offset_deg = [0, -90, 0, 0, 0, 0]
[limits]
j1_deg = [-180, 180]
j2_deg = [-90, 135]
j2_plus_j3_deg = [-160, 280]
j4_deg = [-360, 360]
j5_deg = [-125, 125]
j6_deg = [-360, 360]
speed_deg_s = [105, 105, 105, 110, 110, 180]
acceleration_deg_s2 = [200, 200, 200, 400, 400, 500]
jerk_deg_s3 = [1000, 1000, 1000, 2000, 2000, 2500]
acceleration_known = false
[singularity]
shoulder_mm = 20
elbow_mm = 1
wrist_deg = 1
[controller]
compensation = "none"
interpolation_ms = 8
rounds_up_to_period = true
max_lines = 9999
max_positions = 32767
memory_kB = 1000
name_length = 32
decimals = 3
turn_joints = [1, 4, 6]
"""


@dataclass(frozen=True, eq=False, kw_only=True)
class LoggedRun:
    """A log with the program that was driven."""

    name: str
    arm: str
    log: Path
    places: Array  # (N, 3) [mm] above the floor
    turns: Array  # (N, 3, 3) of the tool
    words: list[str]  # speed and termination of the N - 1 motions
    wrist: str  # N or F


def forward(arm: str, q: Array) -> tuple[Array, Array]:
    """Tool places (M, 3) [mm] above the floor and turns of joints (M, 6) [rad], J3 against link 2."""
    height, a1, a2, a3, d4, d6 = LENGTHS[arm]
    steps = np.array([(a1, 0, 0), (0, 0, a2), (0, 0, a3), (d4, 0, 0), (d6, 0, 0), (0, 0, 0)], dtype=float)
    place, turn = np.tile([0.0, 0.0, float(height)], (len(q), 1)), np.tile(np.eye(3), (len(q), 1, 1))
    for (axis, sense), step, angle in zip(AXES, steps, q.T, strict=True):
        turn = turn @ about(axis, sense * angle)
        place = place + turn @ step
    return place + turn @ TOOL, turn @ about(1, np.full(len(q), TOOL_TURN))


def about(axis: int, angle: Array) -> Array:
    """Turns about an axis, (M, 3, 3)."""
    turn = np.tile(np.eye(3), (len(angle), 1, 1))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn[:, i, i] = turn[:, j, j] = np.cos(angle)
    turn[:, j, i] = np.sin(angle)
    turn[:, i, j] = -turn[:, j, i]
    return turn


def logged_runs(folder: Path) -> Iterator[LoggedRun]:
    """The runs of a folder whose programs are known."""
    for log in sorted(folder.glob("*.csv")):
        if (blade := BLADE.fullmatch(log.name)) and blade[1] in FEED:
            yield curve_run(blade[1], log, folder / f"m710ic_{blade[1]}_command.csv")
        elif corner := CORNER.fullmatch(log.name):
            yield corner_run(log, *corner.groups())


def curve_run(name: str, log: Path, command: Path) -> LoggedRun:
    """A curve in lines at CNT100, with 100 mm in line before its first and behind its last position."""
    with command.open() as file:
        q = np.array([[float(cell) for cell in row[-6:]] for row in list(csv.reader(file))[1:]])
    p, turn = forward("m710ic70", q)
    first, last = (100 * d / np.linalg.norm(d) for d in (p[0] - p[1], p[-1] - p[-2]))
    places = np.vstack([p[0] + first, p, p[-1] + last])
    speed = f"L {{}} {FEED[name]}mm/sec"
    return LoggedRun(
        name=name,
        arm="m710ic70",
        log=log,
        places=places,
        turns=np.concatenate([turn[:1], turn, turn[-1:]]),
        words=[f"{speed} CNT100"] * len(p) + [f"{speed} FINE"],
        wrist="N",
    )


def corner_run(log: Path, angle: str, speed: str, cnt: str) -> LoggedRun:
    """Two lines of 500 mm with a corner a sample behind their meeting, the tool turning by 45 deg over both."""
    way = np.radians(REAL_ANGLE.get((angle, speed), float(angle)))
    along = np.array([np.sin(way), -np.cos(way), 0.0])
    corner = np.array([2200.0, 0.0, 1000.0])
    places = np.array(
        [[2200.006, 499.997, 1000.014], corner + (0.2 if speed == "200" else 0.02) * along, corner + 500 * along]
    )
    return LoggedRun(
        name=f"{angle}_{speed}_CNT{cnt}",
        arm="m900ia350",
        log=log,
        places=places,
        turns=about(1, np.radians([135.0, 112.491, 90.0])),
        words=[f"L {{}} {speed}mm/sec CNT{cnt}", f"L {{}} {speed}mm/sec FINE"],
        wrist="F",
    )


def listing(run: LoggedRun) -> str:
    """The program as text: to where the robot stands, then the logged motions, in World and UTOOL 1."""
    words = ["UFRAME_NUM=0", "UTOOL_NUM=1", "J P[1] 50% FINE"]
    words += [word.format(f"P[{n}]") for n, word in enumerate(run.words, 2)]
    height = LENGTHS[run.arm][0]
    positions = []
    for n, (place, angles) in enumerate(zip(run.places, np.degrees(to_wpr(run.turns)).T, strict=True), 1):
        x, y, z = place - [0, 0, height]
        w, p, r = angles
        positions.append(
            f"P[{n}]{{\n   GP1:\n\tUF : 0, UT : 1,\t\tCONFIG : '{run.wrist} U T, 0, 0, 0',\n"
            f"\tX = {x:9.3f}  mm,\tY = {y:9.3f}  mm,\tZ = {z:9.3f}  mm,\n"
            f"\tW = {w:9.3f} deg,\tP = {p:9.3f} deg,\tR = {r:9.3f} deg\n}};"
        )
    lines = "\n".join(f"{n:4}:  {word} ;" for n, word in enumerate(words, 1))
    return "\n".join(["/PROG  RUN", "/ATTR", "/MN", lines, "/POS", *positions, "/END", ""])


def frames() -> str:
    """The tool in the flange as the maker has it: z out of it, x up where all joints are zero."""
    flange = np.array([[0, 0, 1], [0, -1, 0], [1, 0, 0]])  # columns: its axes in those of TOOL
    x, y, z = flange.T @ TOOL
    w, p, r = np.degrees(np.ravel(to_wpr(flange.T @ about(1, np.array([TOOL_TURN])))))
    return f"[utool.1]\nx_mm = {x}\ny_mm = {y}\nz_mm = {z}\nw_deg = {w}\np_deg = {p}\nr_deg = {r}\n"


def rows_of(log: Path) -> Array:
    """Milliseconds and joints in degrees, J3 against link 2, (M, 7)."""
    with log.open() as file:
        return np.array([[float(cell) for cell in row] for row in list(csv.reader(file))[1:]])


def expected_motion() -> str:
    """The table of the shipped file that says what runs of the sister arm differ by, by how they begin."""
    text = (Path(__file__).parents[1] / "robots" / f"{SHIPPED}.toml").read_text()
    return text[text.index("\n[expected_motion]\n") :].lstrip().partition("\n\n")[0] + "\n"


def written(run: LoggedRun, folder: Path) -> Path:
    """A folder with the listing, the robot file, the frames and the log as a user would have them."""
    place = folder / run.name
    place.mkdir(parents=True, exist_ok=True)
    _, a1, a2, a3, d4, d6 = LENGTHS[run.arm]
    robot = ROBOT.format(name=run.arm, a1=a1, a2=a2, a3=a3, d4=d4, d6=d6)
    (place / "arm.toml").write_text(robot + (expected_motion() if run.arm == SISTER else ""))
    (place / "RUN.LS").write_text(listing(run))
    (place / "frames.toml").write_text(frames())
    rows = rows_of(run.log)
    head = "time_ms," + ",".join(f"j{k}_deg" for k in range(1, 7))
    (place / "log.csv").write_text("\n".join([head, *(",".join(f"{v:g}" for v in row) for row in rows)]) + "\n")
    return place


def cgen(place: Path, command: str, *more: str) -> tuple[int, str]:
    """Exit code and what a command says."""
    words = ["RUN.LS", "--log", "log.csv", "--robot", "arm.toml", "--frames", "frames.toml", "--j3", "link2"]
    call = [sys.executable, "-m", "compgen", command, *words, *more]
    done = subprocess.run(call, cwd=place, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def foretold(place: Path, motion: ControllerMotion) -> tuple[float, float]:
    """What the plain program and a motion that the log was not asked for leave of a run, rms of distances [um]."""
    robot = load_robot(str(place / "arm.toml"))
    around = Situation(robot, load_frames(str(place / "frames.toml")), {}, lambda name: None)
    content = (place / "RUN.LS").read_bytes()
    log = read_position_log(place / "log.csv", third_on_link2=True)
    run = judge_log(read_program_text(str(place / "RUN.LS"), content), around.course(content), log, around)
    windows = timed_windows(run, robot).windows
    course = run.course
    first = float(np.diff(course.counted_clock())[windows[0].run[0]])
    left = (residuals(windows, robot, course.tool, m)[:, :3] for m in (ControllerMotion(), motion.in_run(first)))
    plain, after = (1e6 * float(np.sqrt((rows**2).sum(axis=1).mean())) for rows in left)
    return plain, after


def show_foretold(places: dict[str, Path]) -> None:
    """How much of each run the others' motions take away, and that of the shipped robot file of the sister arm."""
    expected = load_robot(SHIPPED).expected_motion.expected
    for name, place in places.items():
        others = {other: load_robot(str(p / "motion.toml")).motion for other, p in places.items() if other != name}
        for source, motion in {**others, SHIPPED: expected}.items():
            if motion is not None:
                plain, left = foretold(place, motion)
                away = 100 * (1 - left / plain)
                print(f"{name} foretold from {source}: {left:.1f} um rms of {plain:.1f}, {away:.0f} % away", flush=True)


@dataclass(frozen=True, slots=True)
class Passage:
    """How a program of two lines was passed."""

    nearest: float  # [mm] to the corner
    lowest: float  # [mm/s] there
    lasted: float  # [s] from 0.1 mm behind its start to 0.1 mm before its end

    def beside(self, logged: "Passage") -> str:
        """In words, with what was logged."""
        pairs = ((self.nearest, logged.nearest, "mm from the corner"), (self.lowest, logged.lowest, "mm/s there"))
        words = [f"{a:.2f} of {b:.2f} {what} ({100 * (a / b - 1):+.1f} %)" for a, b, what in pairs]
        periods = 1000 * (self.lasted - logged.lasted) / PERIOD
        return ", ".join([*words, f"{self.lasted:.3f} of {logged.lasted:.3f} s ({periods:+.1f} periods)"])


def passage(time: Array, places: Array, corner: Array) -> Passage:
    """Of places (M, 3) [mm] at times [s], by a cubic through them."""
    curve = CubicSpline(time, places)
    fine = np.linspace(time[0], time[-1], 50 * len(time))
    distance = np.linalg.norm(curve(fine) - corner, axis=1)
    at = fine[np.argmin(distance)]
    speed = np.linalg.norm(curve(fine, 1), axis=1)[np.abs(fine - at) < BESIDE]
    begun, ends = (np.linalg.norm(curve(fine) - end, axis=1) > MOVED for end in (places[0], places[-1]))
    return Passage(float(distance.min()), float(speed.min()), float(fine[ends][-1] - fine[begun][0]))


def flown(run: LoggedRun, time: Array, means: Sequence[ControllerMotion]) -> Array:
    """Places (M, 3) [mm] of a run whose lines are smoothed each by means of its own, at times a period apart."""
    step, robot = PERIOD / 1000, load_robot(SHIPPED)
    lines = np.diff(run.places, axis=0)
    speed, kept = (float(re.search(word, run.words[0])[1]) for word in (r"(\d+)mm/sec", r"CNT(\d+)"))  # type: ignore[index]
    takes = step * np.ceil(np.linalg.norm(lines, axis=1) / speed / step - 1e-6)
    waits = corner_wait(replace(robot, motion=means[0]), np.array([kept / 100, 1.0]), np.full(2, means[0].reach_at))
    begins = takes[0] * np.array([0, 1]) + waits[0] * np.array([0, 1])
    gone = sum(
        smooth(np.clip((time - begin) / take, 0, 1)[:, None] * line, step, motion)
        for begin, take, line, motion in zip(begins, takes, lines, means, strict=True)
    )
    return np.asarray(run.places[0] + gone)


def means_of(periods: int) -> ControllerMotion:
    """Two means that last so many periods together, alike or a period apart."""
    return ControllerMotion(moving_averages=tuple(PERIOD / 1000 * np.array([(periods + 1) // 2, periods // 2])))


def show_corner(run: LoggedRun, place: Path, sources: Sequence[Path]) -> None:
    """The corner, the lowest speed and the time of a run: by each line's own periods, and as logs foretell them."""
    rows = rows_of(run.log)
    held = np.append((np.diff(rows[:, 0])[:-1] > PERIOD) & (np.diff(rows[1:, 1:], axis=0) == 0).all(axis=1), False)
    rows = rows[~np.insert(held, 0, False)]  # of two rows alike the first is late
    time, (seen, _) = rows[:, 0] / 1000, forward(run.arm, np.radians(rows[:, 1:]))
    logged, clock = (
        passage(time, seen, run.places[1]),
        np.asarray(PERIOD / 1000 * np.arange(rows[-1, 0] / PERIOD + SPARE)),
    )

    def missed(pair: tuple[int, ...]) -> float:
        curve = flown(run, clock, [means_of(n) for n in pair])
        there = [np.interp(time - PERIOD / 1000, clock, column) for column in curve.T]
        return float(((np.column_stack(there) - seen) ** 2).sum())

    best = min(product(TOGETHER, repeat=2), key=missed)
    tried = {f"{best[0]} and {best[1]} periods": [means_of(n) for n in best]}
    for source in sources:
        robot = load_robot(str(source / "motion.toml"))
        around = Situation(robot, load_frames(str(place / "frames.toml")), {}, lambda name: None)
        spreads = around.course((place / "RUN.LS").read_bytes()).spreads(robot)[-2:]
        if robot.motion is not None:
            tried[f"as the log of {source.name} foretells"] = [robot.motion.on_line(s) for s in spreads.tolist()]
    for words, means in tried.items():
        print(f"{run.name}, {words}: {passage(clock, flown(run, clock, means), run.places[1]).beside(logged)}")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run both commands on each log and print what they say."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.motion_logs")
    parser.add_argument("folder", type=Path, help="where the logs are")
    parser.add_argument("--out", type=Path, default=None, help="keeps what is written; default a folder that goes")
    parser.add_argument("--only", default="", help="runs whose names contain this")
    given = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as temporary:
        out = given.out or Path(temporary)
        places, corners = dict[str, Path](), dict[Path, LoggedRun]()
        for run in logged_runs(given.folder):
            if given.only not in run.name:
                continue
            place = written(run, out)
            for command, more in (("executed", ("-o", "executed")), ("identify-motion", ("-o", "motion.toml"))):
                code, words = cgen(place, command, *more)
                print(f"{run.name} {command}: exit {code}\n{words}", flush=True)
            if run.arm == SISTER:
                places[run.name] = place
            elif "CNT" in run.name:
                corners[place] = run
        for place, run in corners.items():
            show_corner(run, place, list(corners))
        show_foretold(places)


if __name__ == "__main__":
    main()
