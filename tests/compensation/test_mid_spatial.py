"""What a correction puts onto the surface: known waves, and windows against a whole run."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import BarycentricInterpolator
from scipy.signal import butter, sosfiltfilt
from toolpaths import laid

from compgen.compensation import mid_spatial
from compgen.core.units import MM, UM
from compgen.planning import curves, surfaces
from compgen.planning.boundaries import unbounded

NM = 1e-3 * UM


def straight(length, spacing=0.5 * MM):
    table = curves.line((0.0, 0.0), (length, 0.0))
    settings = {"spin": 0.0, "chord": 1.5 * UM, "lift": 0.0, "spacing": spacing}
    return laid(table, surfaces.plane(np.array([1.2, 0.0, 0.2])), unbounded(), **settings)


def along_normal(path, normal):
    return np.column_stack([-normal[:, None] * path.target.rotation[:, :, 2], np.zeros((len(normal), 3))])


def rms_at_once(path, normal):
    """The mean over one run's samples, its transform of twice its length and more, point by point."""
    arc = path.arc
    at = np.arange(0.0, arc[-1], mid_spatial.STEP)
    k = np.clip(np.searchsorted(arc, at, side="right") - 2, 0, len(arc) - 4)
    cubic = [BarycentricInterpolator(arc[i : i + 4], normal[i : i + 4])(x) for i, x in zip(k, at, strict=True)]
    run = np.array(cubic, dtype=float)
    pad = min(2000, len(run) - 1)
    padded = np.concatenate([2 * run[0] - run[pad:0:-1], run, 2 * run[-1] - run[-2 : -pad - 2 : -1]])
    w1, w2 = (np.tan(np.pi * mid_spatial.STEP / period) for period in mid_spatial.BAND[::-1])
    w = np.tan(np.pi * np.minimum(np.fft.rfftfreq(len(padded)), 0.4999)) + 1e-12
    gain = 1 / (1 + ((w * w - w1 * w2) / (w * (w2 - w1))) ** 8)
    passed = np.fft.irfft(np.fft.rfft(padded) * gain, len(padded))[pad : pad + len(run)]
    return np.sqrt(np.mean(passed**2))


def test_a_wave_inside_the_band_counts_whole_and_those_outside_do_not():
    path = straight(12.0)
    assert path.arc[-1] / mid_spatial.STEP > 2 * mid_spatial.WINDOW - 8 * mid_spatial.MARGIN  # more than two windows
    wave = 7 * NM * np.sin(2 * np.pi * path.arc / (5 * MM))
    slow = 100 * UM * np.sin(2 * np.pi * path.arc / 3.0)
    rms = mid_spatial.mid_spatial(path, along_normal(path, wave + slow))
    assert rms == pytest.approx(7 * NM / np.sqrt(2), rel=2e-3)  # ends aside
    assert mid_spatial.mid_spatial(path, along_normal(path, slow)) < 1e-3 * NM


@pytest.mark.parametrize("length", [0.12, 0.4, 6.1])
def test_windows_give_what_one_long_run_gives(length):
    path = straight(length)
    noise = np.cumsum(np.random.default_rng(3).normal(size=len(path.arc))) * NM
    normal = noise + 200 * UM * path.arc
    assert mid_spatial.mid_spatial(path, along_normal(path, normal)) == pytest.approx(
        rms_at_once(path, normal), rel=1e-9
    )


def test_runs_between_stops_are_filtered_each_for_itself_and_counted_by_their_lengths():
    """Three lines of 400, 600 and 50 mm, the last too short to say anything."""
    ends = [(0.0, 0.0), (0.4, 0.0), (0.4, 0.6), (0.45, 0.6)]
    table = curves.join(*(curves.line(a, b, stop=True) for a, b in zip(ends, ends[1:], strict=False)))
    plane = surfaces.plane(np.array([1.2, 0.0, 0.2]))
    path = laid(table, plane, unbounded(), chord=1.5 * UM, spacing=0.5 * MM)
    first, second, last = np.flatnonzero(path.stop)[1:]
    normal = np.cumsum(np.random.default_rng(5).normal(size=len(path.arc))) * NM
    normal[second + 1 :] += 50 * UM
    alone = [straight(length) for length in (0.4, 0.6)]
    parts = (normal[: first + 1], normal[first : second + 1])
    each = [mid_spatial.mid_spatial(p, along_normal(p, n)) for p, n in zip(alone, parts, strict=True)]
    pooled = np.sqrt((0.4 * each[0] ** 2 + 0.6 * each[1] ** 2) / 1.0)
    assert mid_spatial.mid_spatial(path, along_normal(path, normal)) == pytest.approx(pooled, rel=1e-9)
    assert path.arc[last] - path.arc[second] == pytest.approx(0.05)


@pytest.mark.parametrize("points", [2, 3, 4])
def test_a_long_line_of_a_few_waypoints_puts_nothing_on_the_surface(points):
    path = straight(3.0)
    few = path.subset(np.linspace(0, len(path.arc) - 1, points).astype(int))
    assert mid_spatial.mid_spatial(few, along_normal(few, 200 * UM * few.arc)) < 1e-3 * NM


def test_runs_shorter_than_five_periods_say_nothing():
    path = straight(0.09)
    assert mid_spatial.mid_spatial(path, along_normal(path, np.sin(path.arc / 1e-3))) == 0.0


def test_the_band_is_scipys_butterworth_forth_and_back():
    run = np.cumsum(np.random.default_rng(8).normal(size=12_000))
    band = butter(
        4, [1 / mid_spatial.BAND[1], 1 / mid_spatial.BAND[0]], "bandpass", fs=1 / mid_spatial.STEP, output="sos"
    )
    inside = slice(mid_spatial.MARGIN, -mid_spatial.MARGIN)
    assert_allclose(mid_spatial.band_pass(run)[inside], sosfiltfilt(band, run)[inside], atol=1e-9)
