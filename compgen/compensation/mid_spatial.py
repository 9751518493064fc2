r"""What a correction itself puts onto the surface at the periods of a smoothing tool.

A fourth-order Butterworth band of 1 to 20 mm, forth and back, by its spectrum (bilinear transform):

    |H|^2 = 1 / (1 + Q^8),    Q = (w^2 - w1 w2) / (w (w2 - w1)),    w = tan(pi f step)

Forth and back leaves |H|^2 of the amplitude and no shift. What is d away from a place counts there by no more than
exp(-0.38 2 pi d / 20 mm), the band's slowest mode: a long way goes in windows that overlap and stay in cache.
"""

from functools import lru_cache

import numpy as np

from compgen.core.arrays import Array, dot, frozen
from compgen.core.units import MM
from compgen.planning.toolpath import ToolPath

BAND = (1 * MM, 20 * MM)  # periods
STEP = 0.25 * MM
AROUND = 1000  # samples beside a place that its band-pass needs: 1e-13 of what is beyond them
WINDOW = 24576  # samples that are transformed at a time
QUICK = (8, 9, 10, 12, 15)  # times a power of two: lengths that are quick to transform


def mid_spatial(path: ToolPath, correction: Array) -> float:
    """Rms of what the correction itself puts onto the surface at periods of 1 to 20 mm along the path [m].

    Its component along the tool axis, sampled every quarter millimetre between stops and passed through the band;
    before rounding. Runs shorter than five periods of the longest say nothing and are left out.
    """
    power, count = 0.0, 0
    stops = np.flatnonzero(path.stop)
    for first, last in zip(stops[:-1].tolist(), stops[1:].tolist()):
        arc = path.arc[first : last + 1]
        if arc[-1] - arc[0] > 5 * BAND[1]:
            rows = slice(first, last + 1)
            power += _power(arc, correction[rows, :3], path.rotation[rows, :, 2])
            count += _samples(arc)
    return float(np.sqrt(power / count)) if count else 0.0


def _samples(arc: Array) -> int:
    return int(np.ceil((arc[-1] - arc[0]) / STEP))


def _power(arc: Array, correction: Array, axis: Array) -> float:
    """Sum of the squares of what passes, over the samples of a run: (N,) [m], (N, 3) [m] and (N, 3)."""
    total, power = _samples(arc), 0.0
    for begin in range(0, total, WINDOW - 4 * AROUND):
        end = min(total, begin + WINDOW - 4 * AROUND)
        # with its surroundings, so that cutting it out leaves no trace
        low, high = max(0, begin - AROUND), min(total, end + AROUND)
        left, right = np.searchsorted(arc, arc[0] + STEP * np.array([low, high])).tolist()
        near = slice(max(0, left - 2), right + 2)
        heave = dot(correction[near], -axis[near])
        passed = band_passed(_through(arc[near] - arc[0], heave, low, high))[begin - low : end - low]
        power += float(np.einsum("i,i->", passed, passed))
    return power


def _through(x: Array, y: Array, low: int, high: int) -> Array:
    """Heave (N,) at places (N,) brought to the samples low to high, by a cubic through the four points around each.

    Straight lines would put their own corners into the band.
    """
    at = STEP * np.arange(low, high)
    N = len(x)
    if N < 4:
        return np.asarray(np.interp(at, x, y))
    # the cubic of four points from the second on: y + s (c1 + s (c2 + s c3))
    step = np.diff(x)
    f1 = np.diff(y) / step
    f2 = np.diff(f1) / (x[2:] - x[:-2])
    c3 = np.diff(f2) / (x[3:] - x[:-3])
    before, after = step[:-2], step[1:-1]
    c2 = f2[:-1] + (before - after) * c3
    c1 = f1[1:-1] - after * (f2[:-1] + before * c3)
    # each takes the samples from its second point to its third, the first and the last those beyond as well
    ends = np.clip(np.ceil(x[2:-2] / STEP).astype(np.int64), low, high)
    counts = np.diff(ends, prepend=low, append=high)
    x0, y0, c1, c2, c3 = (np.repeat(c, counts) for c in (x[1:-2], y[1:-2], c1, c2, c3))
    s = at - x0
    return np.asarray(y0 + s * (c1 + s * (c2 + s * c3)))


def band_passed(run: Array) -> Array:
    """Samples (M,) through the band; both ends are carried on turned about the end point."""
    M = len(run)
    pad = min(AROUND, M - 1)
    size = M + 2 * pad
    if pad == AROUND:  # what is put between the far ends is out of sight
        size = min(p << max(0, ((size - 1) // p).bit_length()) for p in QUICK)
    whole = np.zeros(size)
    whole[:pad] = 2 * run[0] - run[pad:0:-1]
    whole[pad : pad + M] = run
    whole[pad + M : M + 2 * pad] = 2 * run[-1] - run[-2 : -pad - 2 : -1]
    return np.asarray(np.fft.irfft(np.fft.rfft(whole) * _gain(size), size)[pad : pad + M])


@lru_cache(maxsize=8)
def _gain(size: int) -> Array:
    """|H|^2 at the frequencies of a transform of so many samples."""
    w1, w2 = (np.tan(np.pi * STEP / period) for period in (BAND[1], BAND[0]))
    w = np.tan(np.pi * np.minimum(np.fft.rfftfreq(size), 0.4999))
    w[0] = 1e-12
    return frozen(1 / (1 + ((w * w - w1 * w2) / (w * (w2 - w1))) ** 8))
