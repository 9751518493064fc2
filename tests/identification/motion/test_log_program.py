"""The program whose log tells all that identify-motion fits, read from its text by the format alone."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen import fanuc
from compgen.core.exceptions import ImpossibleError
from compgen.core.units import MM
from compgen.identification.motion.log_program import least_size, motion_log_program
from compgen.pipelines.files.robot_file import load_robot

CENTRE, SIZE, SPEED = np.array([1.3, 0.1, 0.3]), 0.3, 0.2


def text_of(robot, **changes):
    given = {"centre": CENTRE, "size": SIZE, "speed": SPEED, **changes}
    return fanuc.compose(motion_log_program(robot, "LOG", "26-01-01", **given)).decode()


def read(text):
    """Places [mm] in order, with word and stop of each line, and numbers of vias."""
    places = {
        int(n): [float(v) for v in values]
        for n, *values in re.findall(r"P\[(\d+)\]\{.*?X =\s*(\S+).*?Y =\s*(\S+).*?Z =\s*(\S+)", text, re.DOTALL)
    }
    lines = re.findall(r"P\[(\d+)\] (\d+)mm/sec (FINE|CNT100)", text)
    vias = [int(n) for n in re.findall(r":C P\[(\d+)\]", text)]
    return np.array([places[n] for n in sorted(places)]), [(int(n), int(v), t == "FINE") for n, v, t in lines], vias


def test_the_text_has_the_figures():
    places, lines, vias = read(text_of(load_robot("m710ic50")))
    low, high = (CENTRE - SIZE / 2) / MM, (CENTRE + SIZE / 2) / MM
    assert_allclose(places.min(axis=0), low, atol=1e-3)
    assert_allclose(places.max(axis=0), high, atol=1e-3)
    assert {v for _, v, _ in lines} == {200, 100}
    # to and fro: whole ways between two stops; corners: a right angle at a line that does not stop
    before = {n: places[n - 2] for n, _, _ in lines}
    stops = {1, *(n for n, _, fine in lines if fine)}
    whole = [n for n in stops if n - 1 in stops and np.linalg.norm(places[n - 1] - places[n - 2]) > 0.99 * SIZE / MM]
    assert len(whole) == 10
    turning = {"xy": 0, "xz": 0}
    for n, _, fine in lines:
        if fine or {n, n + 1, n - 1} & set(vias):
            continue
        one, other = places[n - 1] - before[n], places[n] - places[n - 1]
        if abs(one @ other) < 1e-6 * np.linalg.norm(one) * np.linalg.norm(other):
            turning["xz" if abs(one[2] + other[2]) > 1 else "xy"] += 1
    assert turning == {"xy": 26, "xz": 26}
    radius = np.linalg.norm(places[[n - 1 for n in vias]] - CENTRE / MM, axis=1)
    assert_allclose(radius, SIZE / MM / 2, atol=1e-3)
    assert len(vias) == 12


def test_short_lines_take_a_broken_number_of_periods():
    places, lines, _ = read(text_of(load_robot("m710ic50")))
    period_mm = 200 * 0.008
    length = np.array([np.linalg.norm(places[n - 1] - places[n - 2]) for n, _, _ in lines])
    short = length[length < 5 * period_mm]
    assert len(short) > 50
    assert_allclose(short / period_mm, 3.15, atol=0.01)


def test_a_figure_out_of_reach_is_refused():
    with pytest.raises(ImpossibleError, match="waypoint"):
        text_of(load_robot("m710ic50"), centre=np.array([2.4, 0.0, 0.0]))


@pytest.mark.parametrize("speed", [0.05, 0.2, 1.0])
def test_sides_have_room_for_the_slowest_filters(speed):
    # 320 + 320 ms are the longest that any log shows: at both ends of a side
    assert least_size(speed) >= 2 * speed * 0.64
