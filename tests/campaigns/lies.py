"""What sensors and clocks of a temperature log may say that is not so: each lie makes another log of an honest one."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from logged_days import HOUR, PARTS, REFERENCE, Course, Log, Sensing, Stretch, course, logged, work


@dataclass(frozen=True, eq=False)
class LoggedDay:
    """A day, and the honest log of it so far."""

    stretches: list[Stretch]
    course: Course
    sensing: Sensing
    end: float  # [s] of the course: the log's end
    zero: float  # [s] of the course when the log's clock is 0
    log: Log


Lie = Callable[[LoggedDay, np.random.Generator], Log]


def nodes_of(log: Log) -> list[str]:
    """Columns of thermocouples on the arm."""
    return [name for name in log.columns if name != "ambient_degC"]


def with_column(log: Log, name: str, values: np.ndarray) -> Log:
    return replace(log, columns=log.columns | {name: values})


def converted(scale: float, offset: float) -> Lie:
    def lie(day: LoggedDay, rng: np.random.Generator) -> Log:
        return replace(day.log, columns={name: c * scale + offset for name, c in day.log.columns.items()})

    return lie


def since(log: Log, rng: np.random.Generator, first: float, last: float) -> np.ndarray:
    """Time since a moment of the log, nothing before it [s]."""
    begin, end = log.time[0], log.time[-1]
    return np.maximum(log.time - (begin + rng.uniform(first, last) * (end - begin)), 0)


def sensor_off(day: LoggedDay, rng: np.random.Generator) -> Log:
    name = rng.choice(nodes_of(day.log))
    return with_column(day.log, name, day.log.columns[name] + sign(rng) * rng.uniform(3, 30))


def sensor_jumps(day: LoggedDay, rng: np.random.Generator) -> Log:
    name, size = rng.choice(nodes_of(day.log)), sign(rng) * rng.uniform(3, 30)
    return with_column(day.log, name, day.log.columns[name] + size * (since(day.log, rng, 0.1, 0.95) > 0))


def sensor_drifts(day: LoggedDay, rng: np.random.Generator) -> Log:
    name, rate = rng.choice(nodes_of(day.log)), sign(rng) * np.exp(rng.uniform(0, np.log(20)))
    return with_column(day.log, name, day.log.columns[name] + rate * since(day.log, rng, 0.0, 0.5) / HOUR)


def sensor_stuck(day: LoggedDay, rng: np.random.Generator) -> Log:
    name = rng.choice(nodes_of(day.log))
    stands = since(day.log, rng, 0.0, 0.8) > 0
    values = day.log.columns[name]
    last = values[~stands & np.isfinite(values)]
    return with_column(day.log, name, np.where(stands, last[-1] if len(last) else REFERENCE, values))


def swapped(day: LoggedDay, rng: np.random.Generator) -> Log:
    a, b = rng.choice(nodes_of(day.log), 2, replace=False)
    return replace(day.log, columns=day.log.columns | {a: day.log.columns[b], b: day.log.columns[a]})


def averaged(day: LoggedDay, rng: np.random.Generator) -> Log:
    a, b = rng.choice(nodes_of(day.log), 2, replace=False)
    mean = (day.log.columns[a] + day.log.columns[b]) / 2
    return replace(day.log, columns=day.log.columns | {a: mean, b: mean})


def spikes(day: LoggedDay, rng: np.random.Generator) -> Log:
    name, share = rng.choice(nodes_of(day.log)), rng.uniform(0.01, 0.1)
    values = day.log.columns[name]
    size = rng.uniform(5, 100, len(values)) * rng.choice([-1, 1], len(values))
    return with_column(day.log, name, values + size * (rng.random(len(values)) < share))


def open_thermocouple(day: LoggedDay, rng: np.random.Generator) -> Log:
    """From a moment on, or now and then: the end of the converter's range, 0, or a word."""
    name = rng.choice(nodes_of(day.log))
    values = day.log.columns[name]
    gone = since(day.log, rng, 0.0, 0.9) > 0
    if rng.random() < 0.3:
        gone &= rng.random(len(values)) < 0.5
    value = rng.choice([1372.0, -270.0, 0.0, 850.0, 3276.7, 9999.0, np.inf])
    word = str(rng.choice(["NaN", "nan", "-", "OPEN", "inf"]))
    return replace(with_column(day.log, name, np.where(gone, value, values)), word=word)


def reads_air(day: LoggedDay, rng: np.random.Generator) -> Log:
    name = rng.choice(nodes_of(day.log))
    return with_column(day.log, name, noisy(day, rng, np.zeros(len(day.course.time))))


def air_beside_motor(day: LoggedDay, rng: np.random.Generator) -> Log:
    node = rng.choice(list(PARTS))
    warm = day.course.rise[node] + REFERENCE - day.course.air
    return replace(
        day.log, columns={"ambient_degC": noisy(day, rng, rng.uniform(0.3, 1.0) * warm)} | nodes_only(day.log)
    )


def nodes_only(log: Log) -> dict[str, np.ndarray]:
    return {name: log.columns[name] for name in nodes_of(log)}


def noisy(day: LoggedDay, rng: np.random.Generator, above_air: np.ndarray) -> np.ndarray:
    """A sensor that shows the air and something more, at the log's rows [degC]."""
    shown = np.interp(day.log.time + day.zero, day.course.time, day.course.air + above_air)
    return shown + rng.uniform(-0.5, 0.5) + day.sensing.noise * rng.normal(size=len(shown))


def clock(scale: float, offset: float = 0.0) -> Lie:
    def lie(day: LoggedDay, rng: np.random.Generator) -> Log:
        return replace(day.log, time=day.log.time * scale + offset)

    return lie


def clock_elsewhere(day: LoggedDay, rng: np.random.Generator) -> Log:
    return replace(day.log, time=day.log.time + sign(rng) * rng.uniform(1, 12) * HOUR)


def clock_fast(day: LoggedDay, rng: np.random.Generator) -> Log:
    return replace(
        day.log, time=day.log.time[0] + (day.log.time - day.log.time[0]) * np.exp(rng.uniform(0.05, np.log(3)))
    )


def block_repeated(day: LoggedDay, rng: np.random.Generator) -> Log:
    """A block of rows comes twice: with its times, or its readings once more while time goes on."""
    count = len(day.log.time)
    size = int(count * rng.uniform(0.05, 0.4))
    first = int(rng.uniform(0, count - 2 * size))
    rows = np.arange(count)
    if rng.random() < 0.5:
        return of_rows(day.log, np.concatenate([rows[: first + size], rows[first:]]))
    read = rows.copy()
    read[first + size : first + 2 * size] = rows[first : first + size]
    return replace(of_rows(day.log, read), time=day.log.time)


def blocks_shuffled(day: LoggedDay, rng: np.random.Generator) -> Log:
    """Blocks of rows stand in another order: with their times, or under times that go on."""
    blocks = np.array_split(np.arange(len(day.log.time)), rng.integers(3, 9))
    order = rng.permutation(len(blocks))
    order = order[::-1] if (np.diff(order) > 0).all() else order
    mixed = of_rows(day.log, np.concatenate([blocks[n] for n in order]))
    return mixed if rng.random() < 0.5 else replace(mixed, time=day.log.time)


def of_rows(log: Log, rows: np.ndarray) -> Log:
    return replace(log, time=log.time[rows], columns={name: c[rows] for name, c in log.columns.items()})


def yesterday(day: LoggedDay, rng: np.random.Generator) -> Log:
    """The same hours of another day: other air, other breaks, the same sensors."""
    return logged(rng, course(rng, work(rng, day.end)), day.sensing, day.end, day.zero)


def another_job(day: LoggedDay, rng: np.random.Generator) -> Log:
    """The same hours at another feed, with other breaks."""
    stretches = work(rng, day.end, float(np.exp(rng.uniform(np.log(15), np.log(80)))))
    return logged(rng, course(rng, stretches), day.sensing, day.end, day.zero)


def sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


LIES: dict[str, Lie] = {
    "Fahrenheit": converted(1.8, 32),
    "Kelvin": converted(1, 273.15),
    "sensor off": sensor_off,
    "sensor jumps": sensor_jumps,
    "sensor drifts": sensor_drifts,
    "sensor stuck": sensor_stuck,
    "columns swapped": swapped,
    "spikes": spikes,
    "open thermocouple": open_thermocouple,
    "sensor reads the air": reads_air,
    "air beside a motor": air_beside_motor,
    "two averaged": averaged,
    "clock in ms": clock(1000),
    "clock in min": clock(1 / 60),
    "clock from 1970": clock(1, 1.76e9),
    "clock elsewhere": clock_elsewhere,
    "clock fast": clock_fast,
    "block repeated": block_repeated,
    "blocks shuffled": blocks_shuffled,
    "yesterday": yesterday,
    "another job": another_job,
}
#: logs of a real day: a command that is given a log and nothing else has nothing that could contradict them
WHOLE_DAYS = ("yesterday", "another job")
