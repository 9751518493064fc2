"""Days of a cell and the thermocouple logs of them, by a heat law of their own: nothing here is the package's.

The nodes warm by first-order lags as the robot file says, but each day has a law that is up to 20 % off, in gain and
in time constant, and air that wanders: cold mornings, heating, sun, doors. An honest log has offsets, noise, lag,
rounding, gaps, missing columns and a clock of its own; it may begin with the robot cold or in the middle of the day.
"""

from dataclasses import dataclass, field

import numpy as np

HOUR, MINUTE = 3600.0, 60.0
#: typed from docs/sources.md and the robot file: rise [K] after 6 h at 200 mm/s, exponent of the feed, lag [h]
LAW = {
    "j2": (11.0, 0.589, 7.39),
    "link1": (3.9, 0.162, 6.45),
    "j3": (13.0, 0.360, 6.48),
    "wrist": (3.0, 0.155, 6.33),
    "face": (2.3, 0.155, 6.33),
}
IDLE = 0.05  # of the goal, standing with the servo on
REFERENCE = 20.0  # degC at which the robot was calibrated
PARTS = {"j2": "part_3", "link1": "part_4", "j3": "part_6", "wrist": "part_11"}  # nodes that have a thermocouple
STEP = 10.0  # s of the simulation


@dataclass(frozen=True)
class Stretch:
    """What the cell does for a while."""

    state: str  # moving, idle, off
    feed: float  # mm/s
    seconds: float


@dataclass(frozen=True, eq=False)
class Course:
    """How warm a cell was over a day."""

    time: np.ndarray  # (M,) [s] from the first stretch
    air: np.ndarray  # (M,) [degC]
    rise: dict[str, np.ndarray]  # of each node, (M,) [K] above the reference

    def rises_at(self, moment: float) -> dict[str, float]:
        return {node: float(np.interp(moment, self.time, rise)) for node, rise in self.rise.items()}


@dataclass(frozen=True, eq=False)
class Log:
    """A temperature log: empty cells are NaN, infinite ones are written as a word."""

    time: np.ndarray  # (M,) [s] on the log's clock
    columns: dict[str, np.ndarray]  # (M,) [degC] by name
    digits: int = 2
    word: str = "NaN"

    def text(self) -> str:
        """As CSV."""
        cells = [[f"{t:.12g}" for t in self.time]]
        for values in self.columns.values():
            shown = (f"{v:.{self.digits}f}" if np.isfinite(v) else "" if np.isnan(v) else self.word for v in values)
            cells.append(list(shown))
        return "\n".join([",".join(["time_s", *self.columns]), *map(",".join, zip(*cells, strict=True))]) + "\n"


@dataclass(frozen=True, kw_only=True)
class Sensing:
    """How a day is logged."""

    begin: float  # [s] of the course
    every: float  # [s]
    noise: float  # K
    lag: float  # [s] of each thermocouple
    digits: int
    names: dict[str, str] = field(default_factory=dict)  # column of each thing that is logged
    offset: dict[str, float] = field(default_factory=dict)  # [K] of each
    gaps: tuple[tuple[float, float], ...] = ()  # [s] of the course


def work(rng: np.random.Generator, seconds: float, feed: float = 200.0) -> list[Stretch]:
    """Work and breaks for a while."""
    day: list[Stretch] = []
    while seconds > 0:
        moving = min(seconds, rng.uniform(0.5, 2.0) * HOUR)
        standing = min(max(seconds - moving, 0.0), rng.uniform(5, 45) * MINUTE)
        day += [Stretch("moving", feed, moving), Stretch("off" if rng.random() < 0.1 else "idle", 0.0, standing)]
        seconds -= moving + standing
    return day


def course(rng: np.random.Generator, day: list[Stretch]) -> Course:
    """A day, warmed by a law that is off, in air that wanders."""
    time = np.arange(0.0, sum(s.seconds for s in day) + 2 * STEP, STEP)
    air = drawn_air(rng, time)
    gain, slow = 1 + rng.uniform(-0.15, 0.15), 1 + rng.uniform(-0.15, 0.15)
    feed = 1 + rng.normal(0, 0.01)
    off = {node: tuple(v * (1 + rng.uniform(-0.04, 0.04)) for v in (gain, slow)) for node in LAW}
    return Course(time, air, warmed(day, time, air, off, feed))


def warmed(
    day: list[Stretch], time: np.ndarray, air: np.ndarray, off: dict[str, tuple[float, ...]], override: float = 1.0
) -> dict[str, np.ndarray]:
    """Rise of each node (M,) [K], by a law with its goals and lags times ``off``."""
    edges = np.cumsum([s.seconds for s in day])
    now = np.minimum(np.searchsorted(edges, time, side="right"), len(day) - 1)
    feed = override * np.array([s.feed for s in day])[now]
    moving, on = (np.array([s.state in states for s in day])[now] for states in (("moving",), ("moving", "idle")))
    rise = {}
    for node, (reference, exponent, lag) in LAW.items():
        gain, slow = off[node]
        goal = reference / -np.expm1(-6 / lag) * gain * (on * IDLE + moving * (1 - IDLE) * (feed / 200) ** exponent)
        rise[node] = lagged(goal + air - REFERENCE, lag * HOUR * slow, air[0] - REFERENCE)
    return rise


def lagged(goal: np.ndarray, lag: float, first: float) -> np.ndarray:
    """A first-order response at each step of the simulation."""
    keep, value, out = np.exp(-STEP / lag) if lag else 0.0, first, np.empty(len(goal))
    for n, towards in enumerate(goal):
        out[n] = value
        value = towards + (value - towards) * keep
    return out


def drawn_air(rng: np.random.Generator, time: np.ndarray) -> np.ndarray:
    """A morning of 12 to 22 degC, heating, sun, doors [degC]."""
    warmer = rng.uniform(0, 6) * -np.expm1(-time / (rng.uniform(0.5, 4) * HOUR))
    air = rng.uniform(12, 22) + warmer + 0.5 * np.sin(2 * np.pi * (time / (rng.uniform(1, 6) * HOUR) + rng.random()))
    if rng.random() < 0.3:  # sun for an hour or two
        air += rng.uniform(1, 3) * np.exp(-(((time - rng.uniform(0, time[-1])) / rng.uniform(2000, 5000)) ** 2))
    for _ in range(rng.integers(0, 3)):  # doors
        since = time - rng.uniform(0, time[-1])
        shut = rng.uniform(5, 40) * MINUTE
        open_, back = (1 - np.exp(-np.maximum(x, 0) / 300) for x in (since, since - shut))
        air -= rng.uniform(1, 5) * (open_ - back)
    return air


def drawn_sensing(rng: np.random.Generator, begin: float, end: float) -> Sensing:
    """How a log of a day is taken."""
    seconds = [s for s in (1, 5, 10, 30, 60, 300) if 20 <= (end - begin) / s <= 10_000]
    nodes = list(PARTS)
    for _ in range(rng.integers(1, 3) if rng.random() < 0.3 else 0):
        nodes.pop(rng.integers(len(nodes)))
    style = rng.random() < 0.5
    names = {node: f"{PARTS[node] if style else node}_degC" for node in nodes}
    if rng.random() < 0.8:
        names = {"air": "ambient_degC"} | names
    together = rng.uniform(-0.3, 0.3)
    gaps = [(g := rng.uniform(begin, end), g + rng.uniform(1, 15) * MINUTE) for _ in range(rng.integers(0, 3))]
    return Sensing(
        begin=begin,
        every=float(rng.choice(seconds)),
        noise=rng.uniform(0.1, 0.5),
        lag=rng.uniform(0, 120),
        digits=int(rng.choice([0, 1, 2], p=[0.15, 0.6, 0.25])),
        names=names,
        offset={thing: together + rng.uniform(-0.2, 0.2) for thing in names},
        gaps=tuple((a, b) for a, b in gaps if b < end - 5 * MINUTE),
    )


def logged(rng: np.random.Generator, course: Course, sensing: Sensing, end: float, zero: float = 0.0) -> Log:
    """An honest log of a course until a moment; its clock is 0 at ``zero`` of the course."""
    time = np.arange(sensing.begin, end + 1e-6, sensing.every)
    hidden = np.zeros(len(time), dtype=bool)
    for a, b in sensing.gaps:
        hidden |= (time > a) & (time < b)
    columns = {}
    for thing, name in sensing.names.items():
        real = course.air if thing == "air" else REFERENCE + course.rise[thing]
        real = np.interp(time, course.time, lagged(real, sensing.lag, real[0]))
        columns[name] = real + sensing.offset[thing] + sensing.noise * rng.normal(size=len(time))
    if rng.random() < 0.5:  # rows that are missing, or their cells
        return Log(time[~hidden] - zero, {n: c[~hidden] for n, c in columns.items()}, sensing.digits)
    return Log(time - zero, {n: np.where(hidden, np.nan, c) for n, c in columns.items()}, sensing.digits)
