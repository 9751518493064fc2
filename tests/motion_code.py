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


def spread(points):
    """Squares of the distances of elbow and wrist from the J1 axis, added up (N,) [m2], of an M-710iC/50 pointing down.

    By the triangle of upper arm 870, forearm (170, 1016) and the line between J2 and the wrist, 175 above the flange.
    """
    x, y, z = np.array(points, dtype=float).T / 1000
    wrist, up = np.hypot(x, y), z + 0.175
    far, forearm = np.hypot(wrist - 0.15, up), np.hypot(0.17, 1.016)
    upper = np.arctan2(up, wrist - 0.15) + np.arccos((0.87**2 + far**2 - forearm**2) / (2 * 0.87 * far))
    down = np.arctan2(up - 0.87 * np.sin(upper), wrist - 0.15 - 0.87 * np.cos(upper)) - np.arctan2(0.17, 1.016)
    elbow = 0.15 + 0.87 * np.cos(upper) - 0.17 * np.sin(down)
    return wrist**2 + elbow**2


def driven(points, speed, fine, means=(0.104, 0.104), slower=None, before=1.0, after=1.0, override=1.0, waits=0.0):
    """Time (M,) [s] and positions (M, 3) [mm] of a run at CNT100, at FINE where it says so.

    ``speed`` is one [mm/s], or what each line is written to take (N - 1,) [s]; ``means`` are one pair, or each
    line's, and so are ``waits`` [s] behind them.
    """
    points = np.array(points, dtype=float)
    words = (
        np.linalg.norm(np.diff(points, axis=0), axis=1) / speed if isinstance(speed, int | float) else np.asarray(speed)
    )
    lasts = np.ceil(words / override / PERIOD - 1e-6)
    lasts = PERIOD * (lasts + (0 if slower is None else np.asarray(slower)))
    means = np.broadcast_to(means, (len(lasts), 2))
    begins = np.concatenate([[0.0], np.cumsum(lasts + waits + means.sum(axis=1) * np.array(fine[1:]))])
    time = PERIOD * np.arange(round((begins[-1] + means[-1].sum() + before + after) / PERIOD)) - before
    place = np.tile(points[0], (len(time), 1))
    for k, step in enumerate(np.diff(points, axis=0)):
        place += leg(time - begins[k], lasts[k], *means[k])[:, None] * step
    return time + before, place


def program(points, speed, fine, cnt=100, turned=None):
    words = ["UFRAME_NUM=0", "UTOOL_NUM=0", "J P[1] 20% FINE"]
    each = (
        [f"{speed}mm/sec"] * len(points)
        if isinstance(speed, int | float)
        else [f"{seconds:.2f}sec" for seconds in speed]
    )
    words += [f"L P[{n}] {each[n - 2]} {'FINE' if stops else f'CNT{cnt}'}" for n, stops in enumerate(fine[1:], 2)]
    turned = [DOWN] * len(points) if turned is None else turned
    places = [ls_text.cartesian(n, (*p, *w)) for n, (p, w) in enumerate(zip(points, turned, strict=True), 1)]
    return ls_text.program(words, places, name="RUN")
