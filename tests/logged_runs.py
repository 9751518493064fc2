"""Logs of a controller whose means go by how each run begins: from a program's text, by the formula, with numpy alone.

Nothing here is of the package: lines and arcs as the text says them, each for whole periods, a run from a stop to the
next through two moving means of its own, by how long its first statement lasts.
"""

import re

import numpy as np

PERIOD, STEP = 0.008, 0.001  # s


def read_program(text):
    """Statements: places (M, 3) [mm] from the one before on, seconds, whether it stops."""
    places = {
        int(n): np.array([float(v) for v in values])
        for n, *values in re.findall(r"P\[(\d+)\]\{.*?X =\s*(\S+).*?Y =\s*(\S+).*?Z =\s*(\S+)", text, re.DOTALL)
    }
    here, via, statements = None, None, []
    for kind, n, speed, end in re.findall(r":(?:([JLC]) |\s+)P\[(\d+)\](?: (\d+)(?:mm/sec|%) (FINE|CNT100))?", text):
        place = places[int(n)]
        if kind == "C":
            via = place
        elif kind == "J":
            here = place
        else:
            way = np.array([here, place]) if via is None else arc(here, via, place)
            length = np.linalg.norm(np.diff(way, axis=0), axis=1).sum()
            lasts = PERIOD * np.ceil(length / float(speed) / PERIOD - 1e-4)
            statements.append((way, lasts, end == "FINE"))
            here, via = place, None
    return statements


def arc(a, b, c, places=400):
    """Places (M, 3) evenly along the circle from a through b to c."""
    normal = np.cross(b - a, c - b)
    normal /= np.linalg.norm(normal)
    system = np.array([b - a, c - a, normal])
    centre = np.linalg.solve(system, [(b - a) @ (a + b) / 2, (c - a) @ (a + c) / 2, normal @ a])
    x = a - centre
    y = np.cross(normal, x)
    full = np.arctan2((c - centre) @ y, (c - centre) @ x) % (2 * np.pi)
    angle = np.linspace(0, full, places)[:, None]
    return centre + np.cos(angle) * x + np.sin(angle) * y


def mean(rows, window):
    n = round(window / STEP)
    total = np.cumsum(np.concatenate([np.repeat(rows[:1], n + 1, axis=0), rows]) - rows[0], axis=0)
    total = (total[1:] + total[:-1]) / 2
    return (total[n:] - total[:-n]) / n + rows[0]


def drive(text, short, long):
    """Time [s] and places [mm] of a run: ``short`` means [s] where a run's first statement lasts less than ``long``."""
    runs: list[list] = []
    run: list = []
    for statement in read_program(text):
        run.append(statement)
        if statement[2]:
            runs, run = [*runs, run], []
    parts = []
    for run in runs:
        means = long if run[0][1] >= sum(long) - 1e-6 else short
        parts.append(smoothed(run, means))
    place = np.concatenate([np.repeat(parts[0][:1], 1000, axis=0), *parts, np.repeat(parts[-1][-1:], 1000, axis=0)])
    return STEP * np.arange(len(place)), place


def smoothed(run, means):
    """Places (M, 3) [mm] of one run until it has come to rest."""
    ends = np.concatenate([[0.0], np.cumsum([lasts for _, lasts, _ in run])])
    time = STEP * np.arange(round((ends[-1] + sum(means)) / STEP))
    k = np.minimum(np.searchsorted(ends, time + 1e-9, side="right") - 1, len(run) - 1)
    place = np.empty((len(time), 3))
    for number, (way, lasts, _) in enumerate(run):
        share = np.clip((time[k == number] - ends[number]) / lasts, 0, 1)
        place[k == number] = np.column_stack([np.interp(share, np.linspace(0, 1, len(way)), c) for c in way.T])
    for window in means:
        place = mean(place, window)
    return place


def csv(time, place, noise=0.002, seed=0):
    """Rows every period, with noise [mm]."""
    rows = slice(0, None, round(PERIOD / STEP))
    seen = place[rows] + np.random.default_rng(seed).normal(size=place[rows].shape) * noise
    lines = [f"{1e3 * t:.0f},{x:.3f},{y:.3f},{z:.3f},180,0,0" for t, (x, y, z) in zip(time[rows], seen, strict=True)]
    return "\n".join(["time_ms,x_mm,y_mm,z_mm,w_deg,p_deg,r_deg", *lines, ""])
