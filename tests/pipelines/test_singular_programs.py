"""A short run of programs near singularities; tests/campaigns/singular_programs.py has the long one."""

import naive_ls
import numpy as np
import pytest
import singular_programs
from ls_text import cartesian, program
from shipped import ROOT

from compgen.pipelines.correct.station_corrections import LARGEST_TURN, TURN_OF_MOVE
from compgen.pipelines.files.robot_file import load_cell

ROBOT = str(ROOT / "robots" / "m710ic50.toml")
#: each was passed as inside with joints that turned round: 7, 15, 32 and 36 on a line, 11 and 37 at the shoulder
SEEDS = (7, 11, 15, 32, 36, 37, 53)


@pytest.mark.parametrize("seed", SEEDS)
def test_no_joint_turns_round_between_the_planned_and_the_corrected_text(seed):
    result, reason = singular_programs.judged(singular_programs.drawn(seed), load_cell(ROBOT))
    assert result == "inside", reason


def test_the_judge_allows_what_is_promised_and_no_more():
    assert TURN_OF_MOVE < singular_programs.EXPLAINED < 1.2 * TURN_OF_MOVE
    assert LARGEST_TURN < singular_programs.LARGEST < 1.3 * LARGEST_TURN


def test_the_judge_bites(monkeypatch):
    """A text in which the mark alone turns J1 by 33 deg."""
    points = [cartesian(n, (x, y, z, 0, 0, 0)) for n, (x, y, z) in enumerate(((600, 0, 900), (-0.02, 0.01, 1200)), 1)]
    data = program(["J P[1] 50% FINE", "J P[2] 50% FINE", "J P[1] 50% FINE"], points)
    text = data.replace(b"P = 0.000 deg,\tR = 0.000 deg\n};\n/END", b"P = -0.001 deg,\tR = -0.001 deg\n};\n/END")
    assert text != data
    result = type("Result", (), {"findings": (), "text": text})()
    monkeypatch.setattr(singular_programs, "corrected", lambda *_, **__: result)
    verdict, reason = singular_programs.judged(data, None)
    assert verdict == "wrong"
    assert reason.startswith("P[2]: joints turn by")
    assert np.isfinite(np.array(list(naive_ls.read(text)[0][2].groups[1].axes.values()), float)).all()
