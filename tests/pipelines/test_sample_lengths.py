"""Errors of a corrected program are averaged over its path, however unevenly its positions lie on it."""

import naive_arm as arm
import numpy as np
import pytest
from corrected import HOME, corrected
from ls_text import at, cartesian, program
from numpy.testing import assert_allclose
from shipped import ROOT

from compgen.pipelines.files.robot_file import load_cell
from compgen.report.correction import correction_summary

AWAY = (40.0, 30.0, -5.0, 10.0, -70.0, 20.0)


@pytest.fixture(scope="module")
def hot():
    return load_cell(str(ROOT / "robots" / "m710ic50.toml"))


def line(shares, z=(0.0, 0.0)):
    """A program along a straight line of 600 mm, with positions at shares of it."""
    points = [cartesian(n, (700 + 600 * s, -300, 100, 180, 0, 0)) for n, s in enumerate(shares, 1)]
    moves = ["J P[1] 10% FINE", *(f"L P[{n}] 100mm/sec CNT100" for n in range(2, len(shares) + 1))]
    return program(moves, points)


def summary(data, cell):
    return correction_summary(corrected(data, cell))


def test_statistics_do_not_depend_on_how_positions_lie_on_the_path(hot):
    fine = summary(line(np.linspace(0, 1, 401)), hot)["before"]["total"]
    crowded = np.concatenate([np.linspace(0, 0.05, 300), np.linspace(0.06, 1, 20)])
    uneven = summary(line(crowded), hot)["before"]["total"]
    assert uneven["rms_um"] == pytest.approx(fine["rms_um"], rel=2e-4)
    assert uneven["p99_um"] == pytest.approx(fine["p99_um"], rel=2e-3)
    error = corrected(line(crowded), hot).error[0]
    assert np.sqrt(np.mean(error**2)) * 1e6 < 0.97 * fine["rms_um"]  # what counting samples would say


def test_a_sample_stands_for_half_of_the_ways_beside_it(hot):
    result = corrected(line([0, 0.1, 0.5, 1]), hot)
    assert result.execution.fraction.tolist() == [1, *3 * [0.25, 0.5, 0.75, 1]]
    quarter = np.repeat([60, 240, 300], 4) / 4000
    assert_allclose(result.length, (np.append(quarter, 0) + np.append(0, quarter)) / 2, rtol=1e-9)


def test_joint_motions_count_the_tools_own_way(hot):
    data = program(["J P[1] 10% FINE", "J P[2] 10% FINE"], [at(1, HOME), at(2, AWAY)])
    shares = np.linspace(0, 1, 2001)[:, None]
    places = [arm.flange(q)[:3, 3] for q in np.array(HOME) * (1 - shares) + np.array(AWAY) * shares]
    way = np.linalg.norm(np.diff(places, axis=0), axis=1).sum() / 1000
    straight = np.linalg.norm(places[-1] - places[0]) / 1000
    length = corrected(data, hot).length
    assert_allclose(length, [way / 2, way / 2], rtol=2e-3)
    assert straight < 0.995 * way  # it is no straight way


def test_a_circle_counts_its_arc(hot):
    def place(n, angle):
        return cartesian(n, (900 + 100 * np.cos(angle), 100 * np.sin(angle), 100, 180, 0, 0))

    points = [place(1, 0), place(2, np.pi / 2), place(3, np.pi)]
    result = corrected(program(["J P[1] 10% FINE", "C P[2]\n    :  P[3] 100mm/sec FINE"], points), hot)
    assert result.execution.fraction.tolist() == [1, *2 * [0.25, 0.5, 0.75, 1]]
    assert_allclose(result.length, np.pi * 0.1 / 8 * np.array([0.5, *7 * [1], 0.5]), rtol=1e-6)


def test_what_may_be_driven_elsewhere_counts_for_nothing(hot):
    points = [at(1, HOME), at(2, AWAY), at(3, HOME), at(4, AWAY)]
    moves = ["J P[1] 10% FINE", "L P[2] 100mm/sec FINE", "CALL ELSEWHERE", "L P[3] 100mm/sec FINE"]
    result = corrected(program(moves, points[:3]), hot)
    assert result.judged.all()
    assert result.length[:-1].all()
    assert result.length[-1] == 0
    apart = program(["J P[1] 10% FINE", "CALL ELSEWHERE", "L P[2] 100mm/sec FINE"], points[:2])
    assert corrected(apart, hot).length.tolist() == [1, 1]  # nothing lies between: each counts alike


def test_only_what_is_judged_counts(hot):
    moves = ["J P[1] 10% FINE", "L P[2] 100mm/sec FINE", "L P[1] 100mm/sec FINE Offset,PR[1]", "L P[2] 100mm/sec FINE"]
    result = corrected(program(moves, [at(1, HOME), at(2, AWAY)]), hot)
    assert not result.judged.all()
    assert not result.length[~result.judged].any()
