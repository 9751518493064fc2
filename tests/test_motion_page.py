"""The numbers of docs/motion.md are what its script gives."""

import sys

import numpy as np
import pytest
from shipped import ROOT
from smoothing_gain import passed

from compgen.robot.motion import ControllerMotion

sys.path.insert(0, str(ROOT / "docs"))
import motion

PAGE = (ROOT / "docs" / "motion.md").read_text()


def cells(row):
    return [cell.strip() for cell in row.strip().strip("|").split("|")]


@pytest.mark.parametrize(("name", "feed", "controller"), [
    *(("circle_1300", feed, controller) for feed in (100, 200) for controller in motion.IN_TABLE),
    ("spiral_1300", 200, "0.2 + 0.1 s"),
])  # fmt: skip
def test_a_row_is_what_the_twin_says_today(name, feed, controller):
    """Words to the letter, numbers to a little more than their last digit (processors round differently)."""
    key = f"| `{name}` | {feed} | {controller} |"
    shown = next(line for line in PAGE.splitlines() if line.startswith(key))
    computed = cells(motion.row(name, feed, controller))
    assert cells(shown)[:3] == computed[:3]
    for old, new in zip(cells(shown)[3:], computed[3:], strict=True):
        assert float(new) == pytest.approx(float(old), abs=1.01 if "." not in old else 0.11, rel=0.01)


def test_the_table_has_every_path_feed_and_controller():
    rows = [cells(line)[:3] for line in PAGE.splitlines() if line.startswith("| `") and line.count("|") == 7]
    expected = [[f"`{n}`", str(f), c] for n in motion.PATHS for f in motion.FEEDS for c in motion.IN_TABLE]
    assert rows == expected


def test_rounding_up_alone_is_as_the_ideal_controller():
    rounded, ideal = (cells(motion.row("circle_1300", 200, controller)) for controller in ("rounds up", "ideal"))
    assert "by the ideal controller" in PAGE
    for one, other in zip(rounded[3:], ideal[3:], strict=True):
        assert float(one) == pytest.approx(float(other), abs=0.11)


def test_the_raster_keeps_under_a_micrometre_known_or_not():
    assert "`raster_1300` has 0.8 to 0.9 um" in PAGE
    left = cells(motion.row("raster_1300", 200, "0.2 + 0.1 s"))[4:]
    assert all(0.75 <= float(size) < 0.95 for size in left)


def test_the_spectrum_is_that_of_two_means():
    lines = PAGE.splitlines()
    periods, shares = (
        [float(cell) for cell in cells(next(line for line in lines if line.startswith(start)))[1:]]
        for start in ("| period of the wave", "| H |")
    )
    H = passed(ControllerMotion(moving_averages=(0.2, 0.1)), 2 * np.pi * 200 / np.array(periods))
    assert shares == pytest.approx(H, abs=6e-4)
