r"""Mid-spatial content: what a correction itself puts onto the surface at the periods of a smoothing tool.

A fourth-order Butterworth band-pass of 1 to 20 mm, forth and back, by its spectrum (bilinear transform):

    |H|^2 = 1 / (1 + Q^8),    Q = (w^2 - w1 w2) / (w (w2 - w1)),    w = tan(pi f step)

Forth and back leaves |H|^2 of the amplitude and no shift. What is d away from a sample counts there by no more than
exp(-0.38 2 pi d / 20 mm), the filter's slowest mode: a long run is filtered in windows that overlap and stay in cache.
"""

from functools import lru_cache

import numpy as np

from compgen.core.arrays import Array, dot, frozen
from compgen.core.units import MM
from compgen.planning.toolpath import ToolPath

BAND = (1 * MM, 20 * MM)  # periods
STEP = 0.25 * MM
MARGIN = 1000  # samples on either side that a sample's band-pass needs: 1e-13 of what is beyond them
WINDOW = 24576  # samples that are transformed at a time
FFT_LENGTHS = (8, 9, 10, 12, 15)  # times a power of two: lengths that are quick to transform


def mid_spatial(path: ToolPath, correction: Array) -> float:
    """Rms of the correction along the tool axis at periods of 1 to 20 mm along the path [m].

    Sampled every quarter millimetre between stops and band-passed; before rounding. Runs shorter than five of the
    longest period say nothing and are left out.

    Args:
        path: With N waypoints.
        correction: (N, 3) or (N, 6) [m].
    """
    sum_of_squares, count = 0.0, 0
    stops = np.flatnonzero(path.stop)
    for first, last in zip(stops[:-1].tolist(), stops[1:].tolist(), strict=True):
        arc = path.arc[first : last + 1]
        if arc[-1] - arc[0] > 5 * BAND[1]:
            rows = slice(first, last + 1)
            sum_of_squares += _filtered_sum_of_squares(arc, correction[rows, :3], path.target.rotation[rows, :, 2])
            count += _sample_count(arc)
    return float(np.sqrt(sum_of_squares / count)) if count else 0.0


def _sample_count(arc: Array) -> int:
    return int(np.ceil((arc[-1] - arc[0]) / STEP))


def _filtered_sum_of_squares(arc: Array, correction: Array, axis: Array) -> float:
    """Sum of squares over the samples of a run of what the filter passes [m2].

    Args:
        arc: (N,) [m].
        correction: (N, 3) [m].
        axis: Of the tool, (N, 3).
    """
    count, sum_of_squares = _sample_count(arc), 0.0
    for begin in range(0, count, WINDOW - 4 * MARGIN):
        end = min(count, begin + WINDOW - 4 * MARGIN)
        # with a margin, so that cutting the window out leaves no trace
        low, high = max(0, begin - MARGIN), min(count, end + MARGIN)
        left, right = np.searchsorted(arc, arc[0] + STEP * np.array([low, high])).tolist()
        rows = slice(max(0, left - 2), right + 2)
        normal = dot(correction[rows], -axis[rows])
        passed = band_pass(_resampled(arc[rows] - arc[0], normal, low, high))[begin - low : end - low]
        sum_of_squares += float(np.einsum("i,i->", passed, passed))
    return sum_of_squares


def _resampled(x: Array, y: Array, low: int, high: int) -> Array:
    """Points x, y (N,) at the samples low to high, by a cubic through the four points around each.

    Straight lines would put their own corners into the band.
    """
    at = STEP * np.arange(low, high)
    N = len(x)
    if N < 4:
        return np.asarray(np.interp(at, x, y))
    # the cubic of four points from the second on: y + s (c1 + s (c2 + s c3)), by divided differences
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


def band_pass(samples: Array) -> Array:
    """Samples (M,) through the filter; both ends are padded by their own odd reflection."""
    M = len(samples)
    pad = min(MARGIN, M - 1)
    size = M + 2 * pad
    if pad == MARGIN:  # zeros between the far ends are beyond the filter's reach
        size = min(p << max(0, ((size - 1) // p).bit_length()) for p in FFT_LENGTHS)
    padded = np.zeros(size)
    padded[:pad] = 2 * samples[0] - samples[pad:0:-1]
    padded[pad : pad + M] = samples
    padded[pad + M : M + 2 * pad] = 2 * samples[-1] - samples[-2 : -pad - 2 : -1]
    return np.asarray(np.fft.irfft(np.fft.rfft(padded) * _filter_gain(size), size)[pad : pad + M])


@lru_cache(maxsize=8)
def _filter_gain(size: int) -> Array:
    """|H|^2 at the frequencies of a transform of so many samples."""
    w1, w2 = (np.tan(np.pi * STEP / period) for period in (BAND[1], BAND[0]))
    w = np.tan(np.pi * np.minimum(np.fft.rfftfreq(size), 0.4999))
    w[0] = 1e-12
    return frozen(1 / (1 + ((w * w - w1 * w2) / (w * (w2 - w1))) ** 8))
