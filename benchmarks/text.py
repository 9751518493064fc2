"""Text speed: write and read of a long program, beside the obvious loop over its lines, and of any program by shape.

python -m benchmarks.text --points 1000000

Speeds hang on the machine and on what else it does; the ratios are measured side by side and hang on it less.
"""

import argparse
import re
import sys
import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from compgen import fanuc
from compgen.core.rotations import from_wpr
from compgen.core.units import DEG, MM
from compgen.program.digits import pose_numbers
from compgen.program.program import Program
from compgen.program.speeds import parse_speed, speed_text
from compgen.robot.configuration import config_letters
from compgen.robot.inverse_kinematics import Posture

Result = TypeVar("Result")
REPEATS = 3
WRITE_MB_S, READ_MB_S, TIMES = 150.0, 150.0, 10.0
_MOVE = re.compile(r"\s*\d+:L P\[\d+\] (\S+) (FINE|CNT100)")
_CONFIG = re.compile(r"CONFIG : '(.) (.) (.), (-?\d+), (-?\d+), (-?\d+)'")
_NUMBER = re.compile(r"= +(-?\d+\.\d+)")


def spiral(points: int) -> Program:
    """A program of so many points on a spiral, with a tilting tool and a few speeds."""
    t = np.arange(points)
    radius = 0.2 * t / points
    position = np.column_stack([1.3 + radius * np.cos(t / 300), radius * np.sin(t / 300), 0.2 + 0.01 * np.sin(t / 777)])
    rotation = from_wpr((np.pi - 1e-4 * (t % 997)).astype(np.float64), 0.02 * np.sin(t / 301), 0.03 * np.cos(t / 503))
    turns = np.zeros((points, 3), dtype=np.int64)
    turns[:, 2] = t % 3 - 1
    speed = np.array([0.02, 0.025, 0.03, 0.125 / 60])[t[1:] % 4]
    fine = t % 1000 == 0
    posture = Posture(True, True, False)
    return Program(
        name="LONG",
        comment="benchmark",
        date="26-01-01",
        remarks=("one remark",),
        uframe=0,
        utool=1,
        position=position,
        rotation=rotation,
        posture=posture,
        turns=turns,
        speed=speed,
        fine=fine,
    )


def write_by_lines(program: Program) -> bytes:
    """The same text, one line after the other."""
    small = fanuc.compose(program).split(b"/MN\r\n", 1)[0].decode()
    numbers = pose_numbers(program.position, program.rotation).tolist()
    out = [small, "/MN\r\n   1:  !one remark ;\r\n   2:  UFRAME_NUM=0 ;\r\n   3:  UTOOL_NUM=1 ;\r\n"]
    out.append("   4:J P[1] 10% FINE    ;\r\n")
    for n, (speed, fine) in enumerate(zip(program.speed.tolist(), program.fine[1:].tolist(), strict=False), 2):
        out.append(f"{n + 3:4d}:L P[{n}] {speed_text(speed)} {'FINE' if fine else 'CNT100'}    ;\r\n")
    out.append("/POS\r\n")
    posture = config_letters(program.posture)
    for n, (row, (a, b, c)) in enumerate(zip(numbers, program.turns.tolist(), strict=False), 1):
        x, y, z, w, p, r = (f"{v:9.3f}" for v in row)
        out.append(
            f"P[{n}]{{\r\n   GP1:\r\n\tUF : 0, UT : 1,\t\tCONFIG : '{posture}, {a}, {b}, {c}',"
            f"\r\n\tX = {x}  mm,\tY = {y}  mm,\tZ = {z}  mm,\r\n\tW = {w} deg,\tP = {p} deg,\tR = {r} deg\r\n}};\r\n"
        )
    return ("".join(out) + "/END\r\n").encode()


def read_by_lines(data: bytes) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions [m], angles [rad] and speeds [m/s], one line after the other."""
    numbers: list[float] = []
    speeds, turns = [], []
    for line in data.decode("latin-1").split("\r\n"):
        if move := _MOVE.match(line):
            speeds.append(parse_speed(move[1]))
        elif line.startswith(("\tX =", "\tW =")):
            numbers += [float(v) for v in _NUMBER.findall(line)]
        elif config := _CONFIG.search(line):
            turns.append([int(v) for v in config.groups()[3:]])
    table = np.array(numbers).reshape(-1, 6)
    return table[:, :3] * MM, table[:, 3:] * DEG, np.array(speeds)


def timed(work: Callable[[], Result], repeats: int) -> tuple[Result, float]:
    """What comes of a work, and the shortest time it took [s]."""
    best = np.inf
    for _ in range(repeats):
        start = time.perf_counter()
        result = work()
        best = min(best, time.perf_counter() - start)
    return result, float(best)


def main() -> int:
    """Measure, check that both ways give the same to the last digit, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=1_000_000)
    parser.add_argument("--check", action="store_true", help="exit 1 when a wanted speed or ratio is missed")
    given = parser.parse_args()
    program = spiral(given.points)
    text, write_s = timed(lambda: fanuc.compose(program), REPEATS)
    slow_text, slow_write_s = timed(lambda: write_by_lines(program), 1)
    slow_write_s = max(slow_write_s - write_s, 1e-9)  # the loop took its header from compose
    read, read_s = timed(lambda: fanuc.interpret(text), REPEATS)
    (position, angles, speed), slow_read_s = timed(lambda: read_by_lines(text), 1)
    exact = (
        text == slow_text
        and np.array_equal(read.position, position)
        and np.array_equal(read.rotation, from_wpr(*angles.T))
        and np.array_equal(read.speed, speed)
        and fanuc.compose(read) == text
    )
    whole, loads_s = timed(lambda: fanuc.loads(text), 1)
    exact = exact and fanuc.dumps(whole) == text and np.array_equal(whole.positions.value[:, :3] * MM, position)
    size = len(text) / 1e6
    print(f"{given.points} points, {size:.1f} MB, exact to the last digit: {'yes' if exact else 'NO'}")
    rows = (("write", write_s, slow_write_s, WRITE_MB_S), ("read", read_s, slow_read_s, READ_MB_S))
    good = exact
    for name, quick, slow, wanted in rows:
        good = good and size / quick >= wanted and slow / quick >= TIMES
        print(
            f"{name:5s} {size / quick:6.0f} MB/s (wanted {wanted:.0f}), line by line {size / slow:6.1f} MB/s: "
            f"{slow / quick:.1f} times faster (wanted {TIMES:.0f})"
        )
    print(f"loads {size / loads_s:6.0f} MB/s (any program, by shape)")
    return 0 if exact and (good or not given.check) else 1


if __name__ == "__main__":
    sys.exit(main())
