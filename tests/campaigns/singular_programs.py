"""Programs near every singularity of the arm: does a joint ever turn round between the planned and the corrected text?

python tests/campaigns/singular_programs.py --seeds 0:1000            draws, judges and adds to a journal; again goes on
python tests/campaigns/singular_programs.py --seeds 0:1000 --table    only the table of what is in the journal

A seed draws positions near the J1 axis, the stretched or folded arm, J5 = 0 or J4, J6 = 180 deg, at distances from a
nanometre up, with the letters of CONFIG of either side, in Cartesian and joint form, and lines past such places. The
judge reads both texts with the second reader, finds the joints in closed form and drives each line in small steps:
wherever they turn by more than a correction of that size explains, the program must not have been passed as inside.
"""

import math
import random
import sys
import traceback
from collections import Counter
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[n]) for n in (2, 1, 0)]

import naive_arm as arm  # noqa: E402
import naive_ls  # noqa: E402
import numpy as np  # noqa: E402
import seed_journal  # noqa: E402
from corrected import corrected  # noqa: E402
from ls_text import cartesian, joint_form, program  # noqa: E402
from shipped import ROOT  # noqa: E402

from compgen.core.exceptions import CompgenError  # noqa: E402
from compgen.core.finding_codes import Level  # noqa: E402
from compgen.pipelines.files.robot_file import load_cell  # noqa: E402

EXPLAINED = 110.0  # [rad/m], [rad/rad] a tenth more than is promised
LARGEST = math.radians(7.0)  # that a correction of any size explains
STEPS = 400  # of a line
KINDS = ("shoulder", "wrist", "elbow", "turn", "plain")


def near(rng: random.Random, kind: str) -> list[float]:
    """Pendant angles [deg] near a singularity."""
    q = [rng.uniform(-170, 170), rng.uniform(-40, 60), rng.uniform(-60, 40), rng.uniform(-170, 170), 0.0, 0.0]
    q[4], q[5] = rng.choice((-1, 1)) * rng.uniform(15, 110), rng.uniform(-350, 350)
    off = rng.choice((-1, 1)) * 10 ** rng.uniform(-9, 2)  # mm, or a hundredth of it in deg
    if rng.random() < 0.1:
        off = 0.0
    if kind == "wrist":
        q[4] = off / 10
    elif kind == "turn":
        q[rng.choice((3, 5))] = rng.choice((-180, 180)) + off / 100
    elif kind == "elbow":  # full stretch: J2 + J3 turns the forearm's line, with its bend, into the upper arm's
        q[2] = (
            90
            - math.degrees(math.atan2(170, 1016))
            - q[1]
            + rng.choice((-1, 1)) * math.degrees(math.sqrt(2e-6 * abs(off) * 1.9 / 0.9))
        )
    elif kind == "shoulder":  # the wrist centre at ``off`` mm from the axis
        a = math.radians(q[2])
        s = (off - 150 - 1016 * math.cos(a) + 170 * math.sin(a)) / 870
        if abs(s) > 0.7:
            q[2] = rng.uniform(75, 110)
            a = math.radians(q[2])
            s = (off - 150 - 1016 * math.cos(a) + 170 * math.sin(a)) / 870
        q[1] = math.degrees(math.asin(max(-1.0, min(1.0, s))))
    return q


def drawn(seed: int) -> bytes:
    """A program; a plain place first and last, so that something is corrected."""
    rng = random.Random(seed)
    plain = (10.0, 20.0, -15.0, 30.0, -60.0, 45.0)
    places = [plain, *(near(rng, rng.choice(KINDS)) for _ in range(rng.randint(1, 5)))]
    matrices = [arm.flange(q) for q in places]
    letters = [arm.config(q) for q in places]
    points, moves = [], ["J P[1] 30% FINE"]
    for n, (q, config) in enumerate(zip(places, letters, strict=False), 1):
        if n > 1 and rng.random() < 0.3:  # the other side's letters for the same place
            k = rng.randrange(3)
            words = config.split(",")[0].split()
            words[k] = {"N": "F", "F": "N", "U": "D", "D": "U", "T": "B", "B": "T"}[words[k]]
            config = " ".join(words) + ", 0, 0, 0"
        form = rng.choice(("{:.3f}", "{:.3f}", "{:.6f}"))
        if n > 1 and rng.random() < 0.15:
            points.append(joint_form(n, q, form=form))
        else:
            points.append(cartesian(n, arm.numbers(matrices[n - 1]), letters=config, form=form))
        if n > 1:
            moves.append(f"J P[{n}] 30% FINE")
    for _ in range(rng.randint(0, 3)):  # lines past a place, and over it
        k = rng.randrange(1, len(places))
        way = np.array([rng.uniform(-1, 1) for _ in range(3)])
        way *= rng.uniform(1, 300) / np.linalg.norm(way)
        turn = arm.by_vector(np.array([rng.uniform(-0.3, 0.3) for _ in range(3)]) * rng.choice((0, 1)))
        middle = matrices[k] @ arm.shifted(*(rng.uniform(-1, 1) * 10 ** rng.uniform(-4, 1) for _ in range(3)))[0]
        for sign in (-1, 1):
            end = arm.shifted(*(sign * way))[0] @ middle @ (turn if sign > 0 else turn.T)
            points.append(cartesian(len(points) + 1, arm.numbers(end), letters=letters[k]))
            letter = "J P[{}] 30% FINE" if sign < 0 else "L P[{}] 100mm/sec FINE"
            moves.append(letter.format(len(points)))
    return program([*moves, "J P[1] 30% FINE"], points)


def known(value: float | None) -> float:
    """A number that is written, and not asterisks."""
    assert value is not None
    return value


def told(position: naive_ls.Position) -> tuple[np.ndarray, str | None, np.ndarray | None]:
    """Flange of a position, and its CONFIG; or its joints [rad]."""
    group = position.groups[1]
    if "J1" in group.axes:
        q = [known(group.axes[f"J{i}"]) for i in range(1, 7)]
        return arm.flange(q), None, np.radians(q)
    return arm.frame(*(group.axes[k] for k in "XYZWPR")), group.config, None


def joints(flanges: np.ndarray, config: str) -> np.ndarray:
    """Pendant angles (N, 6) [rad] by CONFIG; NaN where a place is out of reach, or its digit none that an angle has."""
    with np.errstate(invalid="ignore"):
        try:
            return arm.joints_by_config(flanges, [config] * len(flanges))
        except AssertionError:
            return np.full((len(flanges), 6), np.nan)


def moved(a: np.ndarray, b: np.ndarray) -> float:
    """Way [m] and turn [rad] between two places, added."""
    r = a[:3, :3].T @ b[:3, :3]
    axis = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    return 1e-3 * float(np.linalg.norm(b[:3, 3] - a[:3, 3])) + float(np.linalg.norm(axis)) / 2


def line_joints(start: np.ndarray, end: np.ndarray, config: str) -> np.ndarray:
    """Joints along a line without jumps, the tool turning about one axis."""
    r = start[:3, :3].T @ end[:3, :3]
    axis = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]]) / 2
    size = float(np.linalg.norm(axis))
    vector = axis / size * math.atan2(size, (np.trace(r) - 1) / 2) if size else axis
    ways = []
    for f in np.linspace(0, 1, STEPS + 1):
        pose = start @ arm.by_vector(f * vector)
        pose[:3, 3] = start[:3, 3] + f * (end[:3, 3] - start[:3, 3])
        ways.append(pose)
    letters = config.split(",")[0] + ", 0, 0, 0"
    q = joints(np.array(ways), letters)
    return np.unwrap(q, axis=0) if np.isfinite(q).all() else np.full_like(q, np.nan)


def judged(data: bytes, cell: object) -> tuple[str, str]:
    """``inside``, ``outside``, ``refused`` or ``wrong``, and why."""
    try:
        result = corrected(data, cell, bound=1e-3)
    except CompgenError as refused:
        return "refused", str(refused)
    if any(f.level is Level.OUTSIDE for f in result.findings):
        return "outside", next(f.code for f in result.findings if f.level is Level.OUTSIDE)
    before, moves = naive_ls.read(data)
    after, _ = naive_ls.read(result.text)
    at: dict[int, tuple[np.ndarray, np.ndarray]] = {}
    for n in before:
        pair = []
        for texts in (before, after):
            flange, config, q = told(texts[n])
            turned = q if config is None else joints(flange[None], config)[0]
            assert turned is not None
            pair.append(turned)
        a, b = told(before[n])[0], told(after[n])[0]
        if a.tobytes() != b.tobytes() or told(before[n])[1] != told(after[n])[1]:
            turn = np.abs(pair[1] - pair[0]).max()
            if not turn <= min(EXPLAINED * moved(a, b), LARGEST) + 1e-6:
                return "wrong", f"P[{n}]: joints turn by {np.degrees(pair[1] - pair[0])} deg for {moved(a, b):.2e}"
        at[n] = (a, b)
    for one, two in zip(moves, moves[1:], strict=False):
        n, k = (int(m.targets[0][2:-1]) for m in (one, two))
        config = told(before[k])[1]
        if two.letter != "L" or (at[n][0].tobytes() == at[n][1].tobytes() and at[k][0].tobytes() == at[k][1].tobytes()):
            continue
        if config is None or told(before[n])[1] != config:
            continue
        ways = [line_joints(at[n][i], at[k][i], config) for i in (0, 1)]
        if not all(np.isfinite(way).all() for way in ways):
            continue
        turns = [way[-1] - way[0] for way in ways]
        apart = np.abs(ways[1] - ways[0] - 2 * np.pi * np.round((ways[1] - ways[0])[0] / (2 * np.pi)))
        if np.abs(turns[1] - turns[0]).max() > LARGEST or apart.max() > 2 * LARGEST:
            return "wrong", f"L P[{k}]: joints turn by {np.degrees(apart.max()):.2f} deg on the way there"
    return "inside", ""


def tried(seed: int, cell: object) -> dict:
    """A row of the journal."""
    try:
        result, reason = judged(drawn(seed), cell)
    except Exception:  # any other exception is what is looked for here
        result, reason = "wrong", traceback.format_exc(limit=3)
    if result == "wrong":
        print(f"seed {seed}: {reason}", flush=True)
    return {"seed": seed, "result": result, "reason": reason[:300]}


def table(rows: list[dict]) -> str:
    """What the rows add up to."""
    counts = Counter(row["result"] for row in rows)
    words = ", ".join(f"{counts[name]} {name}" for name in ("inside", "outside", "refused", "wrong"))
    return f"seeds {seed_journal.ranges_of(row['seed'] for row in rows)}: {words}"


def main() -> int:
    """Try the seeds that the journal has not, and print the table of all."""
    given = seed_journal.parser("singular_programs", __doc__, "0:20").parse_args()
    cell = load_cell(str(ROOT / "robots" / "m710ic50.toml"))
    for seed in () if given.table else given.journal.left(given.seeds, given.budget):
        given.journal.add(tried(seed, cell))
    rows = given.journal.rows(given.seeds)
    return seed_journal.conclude("singular_programs.py", rows, table(rows), lambda row: row["result"] == "wrong")


if __name__ == "__main__":
    sys.exit(main())
