"""Logs of runs that never were: a course driven with ramps, override, waits and smoothing, then sampled as loggers do.

Written for tests alone, with nothing of what judges logs but the course: plain time steps, means by cumulative sums.
"""

from dataclasses import dataclass, field, replace

import ls_text
import numpy as np
from numpy.typing import ArrayLike

TICK = 0.002  # s; finer than any controller's period


@dataclass
class Run:
    """What happens in a run."""

    override: float = 1.0
    later: tuple = ()  # (cruise clock [s], override) from there on
    ramp: float = 0.3  # s of each stop's ramps at full override
    wait: dict = field(default_factory=dict)  # node to seconds stood there
    hold: tuple = ()  # (cruise clock [s], seconds) where the operator holds the robot
    means: tuple = ()  # s
    lags: tuple = ()  # s, of first order
    clock: str = "cruise"
    settle: bool = True


@dataclass
class Logger:
    """How the run is written down."""

    step: float = 0.008
    noise: float = 0.0  # m
    quantum: float = 1e-6  # m
    jitter: float = 0.0  # s
    offset: float = 0.0  # s
    rate: float = 0.0  # of the clock, beyond one
    before: float = 1.0  # s of standing before the program
    after: float = 1.0
    start: float = 0.0  # share of the run that is missed at the beginning
    end: float = 1.0
    lag: float = 0.0  # s, of first order, that it filters by
    drop: float = 0.0  # share of rows that are lost
    seed: int = 0


def motion(course, run):
    """Time (T,) [s] and arc length (T,) [m] of a run, without the standing before and behind it."""
    clock = getattr(course, run.clock)
    stops = np.flatnonzero(course.stop)
    times: list[ArrayLike] = []
    arcs: list[ArrayLike] = []
    now = 0.0
    for a, b in zip(stops[:-1], stops[1:], strict=True):
        stand = run.wait.get(int(a), 0.0)
        if stand:
            times.append([now, now + stand])
            arcs.append([course.arc[a]] * 2)
            now += stand
        u, t = _profile(clock[b] - clock[a], run.ramp)
        rate = np.full(len(u) - 1, run.override)
        for where, share in run.later:
            rate[clock[a] + u[1:] > where] = share
        t = np.concatenate([[0.0], np.cumsum(np.diff(t) / rate)])
        for where, seconds in run.hold:
            if clock[a] < where <= clock[b]:
                row = np.searchsorted(clock[a] + u, where, side="right")
                u, t = (np.insert(x, row, x[row - 1]) for x in (u, t))
                t[row:] += seconds
        times.append(now + t)
        arcs.append(np.interp(clock[a] + u, clock, course.arc))
        now += t[-1]
        if run.settle:  # a stop waits until the smoothing has come to rest
            rest = sum(run.means) + 8 * sum(run.lags)
            times.append([now, now + rest])
            arcs.append([course.arc[b]] * 2)
            now += rest
    return np.concatenate(times), np.concatenate(arcs)


def _profile(cruise, ramp):
    """Cruise clock against time of a run between two stops: linear rise of the rate, plateau, linear fall."""
    ramp = min(ramp, cruise)
    total = cruise + ramp
    if not ramp:  # by the law, smoothing alone makes ramps
        t = np.unique(np.concatenate([np.arange(0, total, TICK), [total]]))
        return t, t
    t = np.unique(np.concatenate([np.arange(0, total, TICK), [total]]))
    u = np.where(
        t < ramp, t**2 / (2 * ramp), np.where(t < total - ramp, t - ramp / 2, cruise - (total - t) ** 2 / (2 * ramp))
    )
    return u, t


def moving_mean(values, count):
    """The mean of the last ``count`` rows, the first row standing for what was before, (T, k)."""
    if count <= 1:
        return values
    padded = np.concatenate([np.repeat(values[:1], count, axis=0), values])
    total = np.cumsum(padded - values[:1], axis=0)
    return values[:1] + (total[count:] - total[:-count]) / count


def first_order(values, tau):
    """The answer of a first-order lag at steps of TICK, (T, k)."""
    from scipy.signal import lfilter

    share = 1 - np.exp(-TICK / tau)
    state = (1 - share) * values[:1]
    return lfilter([share], [1, share - 1], values, axis=0, zi=state)[0]


def place_and_turn(course, arc):
    """Positions (T, 3) and the rows of the nearest nodes' rotations."""
    return course.place(arc), course.rotation[course.way(arc)]


def commanded(course, run, before=1.0, after=1.0):
    """Time (T,) and positions (T, 3) of the smoothed motion, with standing before and after."""
    t, s = motion(course, run)
    grid = np.arange(-before, t[-1] + after + 0.6, TICK)
    arc = np.interp(grid, t, s)
    place = course.place(arc)
    for mean in run.means:
        place = moving_mean(place, round(mean / TICK))
    for tau in run.lags:
        place = first_order(place, tau)
    return grid, place, arc


def log_rows(course, run, logger):
    """time_s, X Y Z [m], W P R [rad] in World, and the arc length driven, as a logger has them."""
    from compgen.core.rotations import to_wpr

    rng = np.random.default_rng(logger.seed)
    grid, place, arc = commanded(course, run, logger.before, logger.after)
    place = first_order(place, logger.lag) if logger.lag else place
    time = np.arange(grid[0], grid[-1], logger.step)
    n = len(time)
    time = time[int(logger.start * n) : max(int(logger.end * n), 1)]
    seen = np.clip(time, grid[0], grid[-1])
    places = np.column_stack([np.interp(seen, grid, c) for c in place.T])
    places = places + rng.normal(size=places.shape) * logger.noise
    places = np.round(places / logger.quantum) * logger.quantum
    along = np.interp(seen, grid, arc)
    turn = np.column_stack(to_wpr(course.rotation[course.way(along)]))
    shown = (time + rng.uniform(-1, 1, len(time)) * logger.jitter) * (1 + logger.rate) + logger.offset
    keep = rng.random(len(time)) >= logger.drop
    return np.maximum.accumulate(np.round(shown, 6))[keep], places[keep], turn[keep], along[keep]


def csv(time, places, turn):
    """A Cartesian log as text."""
    rows = np.column_stack([time, places * 1e3, np.degrees(turn)])
    lines = "\n".join(",".join(f"{v:.6f}" for v in row) for row in rows.tolist())
    return f"time_s,x_mm,y_mm,z_mm,w_deg,p_deg,r_deg\n{lines}\n"


FRAMES = """[uframe.1]
x_mm = 900
y_mm = -150
z_mm = -100
w_deg = 0
p_deg = 0
r_deg = 20
[utool.1]
x_mm = 40
y_mm = 0
z_mm = 250
w_deg = 0
p_deg = 0
r_deg = 0
"""


def part(name="PART", shift=None, speed=0.1, numbers=(0, 0)):
    """A program of compgen's form: a run in, three sweeps with corners at CNT100, a circle, a run out; 3 stops inside.

    ``shift`` (N, 3) [m] moves its positions, as another correction does.
    """
    from compgen import fanuc
    from compgen.program.program import Program
    from compgen.robot.inverse_kinematics import Posture

    corners = [(0, 0), (0.30, 0), (0.30, 0.04), (0, 0.04), (0, 0.08), (0.30, 0.08)]
    points, fine = [(0.0, -0.03, 0.0)], [True]
    for k, (a, b) in enumerate(zip(corners[:-1], corners[1:], strict=True)):
        n = round(np.hypot(b[0] - a[0], b[1] - a[1]) / 0.02)
        for j in range(k > 0, n + 1):
            points.append((a[0] + (b[0] - a[0]) * j / n, a[1] + (b[1] - a[1]) * j / n, 0.0))
            fine.append(k == 0 and j == 0)
    fine[-1] = True
    for angle in np.radians(np.arange(3, 361, 3)):
        points.append((0.30 - 0.10 * np.sin(angle), 0.18 - 0.10 * np.cos(angle), 0.01 * (1 - np.cos(angle))))
        fine.append(False)
    fine[-1] = True
    points += [(0.30, 0.08, 0.02), (0.30, 0.10, 0.03)]
    fine += [False, True]
    local = np.array(points) + (np.array([1.0, -0.1, 0.1]) if numbers == (0, 0) else np.array([0.1, 0.1, 0.1]))
    local = local + (0 if shift is None else shift)
    N = len(local)
    return fanuc.compose(
        Program(
            name=name,
            comment="test",
            date="26-01-01",
            remarks=("compgen 0.1.0 m710ic50",),
            uframe=numbers[0],
            utool=numbers[1],
            position=local,
            rotation=np.tile(np.diag([1.0, -1.0, -1.0]), (N, 1, 1)),
            posture=Posture(),
            turns=np.zeros((N, 3), dtype=np.int64),
            speed=np.full(N - 1, speed),
            fine=np.array(fine),
        )
    )


def pages(content, name="PART"):
    """A program in two pages: its main program, and the pages by name."""
    from compgen import fanuc

    whole = fanuc.interpret(content)
    k = int(np.flatnonzero(whole.fine)[2])

    def page(name, rows, speeds):
        arrays = {n: getattr(whole, n)[rows] for n in ("position", "rotation", "turns", "fine", "via")}
        arrays["fine"] = arrays["fine"].copy()
        arrays["fine"][[0, -1]] = True
        return fanuc.compose(replace(whole, name=name, speed=whole.speed[speeds], **arrays))

    programs = {
        f"{name}A": page(f"{name}A", slice(0, k + 1), slice(0, k)),
        f"{name}B": page(f"{name}B", slice(k, None), slice(k, None)),
    }
    return ls_text.program([f"CALL {page}" for page in programs], [], name=name), programs


def circle(name="PART", radius=0.15, speed=0.1):
    """A program that is one circle, from stop to stop."""
    angle = np.radians(np.arange(0, 361, 2))
    local = np.column_stack([1.1 + radius * np.cos(angle), radius * np.sin(angle), np.full(len(angle), 0.1)])
    return listing(local, np.isin(np.arange(len(local)), [0, len(local) - 1]), name, speed)


def listing(local, fine, name="PART", speed=0.1):
    """A program of lines between places (N, 3) [m] in World, that stops where ``fine`` says (N,)."""
    from compgen import fanuc
    from compgen.program.program import Program
    from compgen.robot.inverse_kinematics import Posture

    N = len(local)
    return fanuc.compose(
        Program(
            name=name,
            comment="test",
            date="26-01-01",
            remarks=("compgen 0.1.0 m710ic50",),
            uframe=0,
            utool=0,
            position=local,
            rotation=np.tile(np.diag([1.0, -1.0, -1.0]), (N, 1, 1)),
            posture=Posture(),
            turns=np.zeros((N, 3), dtype=np.int64),
            speed=np.full(N - 1, speed),
            fine=fine,
        )
    )
