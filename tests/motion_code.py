"""Runs as the maker's motion code drives them: each line rect(T) in whole periods, smoothed by two means.

Written out by the formula, with nothing of the package: each leg is its third-order spline, summed over legs.
"""

import ls_text
import numpy as np

PERIOD = 0.008
DOWN = (180.0, 0.0, 0.0)


def leg(time, lasts, one, other):
    """Share of a leg that is done at times: the integral of rect(T) * mean * mean."""
    total = np.zeros_like(time)
    for a, x in ((0, 1), (lasts, -1)):
        for b, y in ((0, 1), (one, -1)):
            for c, z in ((0, 1), (other, -1)):
                total += x * y * z * np.clip(time - a - b - c, 0, None) ** 3 / 6
    return total / (lasts * one * other)


def driven(points, speed, fine, means=(0.104, 0.104), slower=None, before=1.0, after=1.0, override=1.0):
    """Time (M,) [s] and positions (M, 3) [mm] of a run at CNT100, at FINE where it says so.

    ``speed`` is one [mm/s], or what each line is written to take (N - 1,) [s].
    """
    points = np.array(points, dtype=float)
    words = (
        np.linalg.norm(np.diff(points, axis=0), axis=1) / speed if isinstance(speed, int | float) else np.asarray(speed)
    )
    lasts = np.ceil(words / override / PERIOD - 1e-6)
    lasts = PERIOD * (lasts + (0 if slower is None else np.asarray(slower)))
    begins = np.concatenate([[0.0], np.cumsum(lasts + sum(means) * np.array(fine[1:]))])
    time = PERIOD * np.arange(round((begins[-1] + sum(means) + before + after) / PERIOD)) - before
    place = np.tile(points[0], (len(time), 1))
    for k, step in enumerate(np.diff(points, axis=0)):
        place += leg(time - begins[k], lasts[k], *means)[:, None] * step
    return time + before, place


def program(points, speed, fine):
    words = ["UFRAME_NUM=0", "UTOOL_NUM=0", "J P[1] 20% FINE"]
    each = (
        [f"{speed}mm/sec"] * len(points)
        if isinstance(speed, int | float)
        else [f"{seconds:.2f}sec" for seconds in speed]
    )
    words += [f"L P[{n}] {each[n - 2]} {'FINE' if stops else 'CNT100'}" for n, stops in enumerate(fine[1:], 2)]
    return ls_text.program(words, [ls_text.cartesian(n, (*p, *DOWN)) for n, p in enumerate(points, 1)], name="RUN")
