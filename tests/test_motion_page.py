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


def sizes(text):
    return [float(size) for size in text.split(", ")]


@pytest.mark.parametrize(("name", "feed", "controller"), [
    *(("circle_1300", feed, controller) for feed in (100, 200) for controller in motion.IN_TABLE),
    ("spiral_1300", 200, "0.2 + 0.1 s"),
])  # fmt: skip
def test_a_cell_is_what_the_twin_says_today(name, feed, controller):
    """To a little more than the last digit (processors round differently)."""
    row = cells(next(line for line in PAGE.splitlines() if line.startswith(f"| `{name}` | {feed} |")))
    shown = sizes(row[2 + motion.IN_TABLE.index(controller)])
    for old, new, digit in zip(shown, motion.sizes(name, feed, controller), (1.01, 0.11, 0.11), strict=True):
        assert new == pytest.approx(old, abs=digit, rel=0.01)


def test_the_table_has_every_path_feed_and_controller():
    begin, end = PAGE.index(motion.BEGIN) + len(motion.BEGIN), PAGE.index(motion.END)
    assert PAGE[begin:].startswith(motion.HEAD)
    rows = [cells(line) for line in PAGE[begin + len(motion.HEAD) : end].splitlines()]
    assert [row[:2] for row in rows] == [[f"`{n}`", str(f)] for n in motion.PATHS for f in motion.FEEDS]
    assert all(len(sizes(cell)) == 3 for row in rows for cell in row[2:])


def test_rounding_up_alone_is_as_the_ideal_controller():
    rounded, ideal = (motion.sizes("circle_1300", 200, controller) for controller in ("rounds up", "ideal"))
    assert "by the ideal controller" in PAGE
    assert rounded == pytest.approx(ideal, abs=0.11)


def test_the_raster_keeps_under_a_micrometre_known_or_not():
    assert "`raster_1300` has 0.8 to 0.9 um" in PAGE
    _, *left = motion.sizes("raster_1300", 200, "0.2 + 0.1 s")
    assert all(0.75 <= size < 0.95 for size in left)


def test_the_spectrum_is_that_of_two_means():
    lines = PAGE.splitlines()
    periods, shares = (
        [float(cell) for cell in cells(next(line for line in lines if line.startswith(start)))[1:]]
        for start in ("| period of the wave", "| H |")
    )
    H = passed(ControllerMotion(moving_averages=(0.2, 0.1)), 2 * np.pi * 200 / np.array(periods))
    assert shares == pytest.approx(H, abs=6e-4)
