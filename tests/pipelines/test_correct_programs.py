"""A short run of the campaign of generated programs; tests/campaigns/correct_programs.py has the long one."""

import correct_programs
import pytest
from shipped import ROOT

from compgen.pipelines.files.robot_file import load_cell

ROBOT = str(ROOT / "robots" / "m710ic50.toml")


@pytest.mark.parametrize("seed", range(6))
def test_what_may_be_corrected_is_and_nothing_else_has_moved(seed):
    result, reason = correct_programs.judged(*correct_programs.drawn(seed), load_cell(ROBOT))
    assert result == "corrected", reason


def test_the_judge_bites():
    """An arm that grows otherwise misses; a place that the correction moved is no held one."""
    lines, positions = correct_programs.drawn(1)
    other = load_cell(ROBOT, ["thermal.cte_um_m_K=12"])
    assert "is missed by" in correct_programs.judged(lines, positions, other)[1]
    held = [(text, tuple((n, False) for n, _ in places)) for text, places in lines]
    assert "is held, and has moved" in correct_programs.judged(held, positions, load_cell(ROBOT))[1]
    rigid = load_cell(ROBOT, ["thermal.cte_um_m_K=0"])
    assert "may be corrected, and is not" in correct_programs.judged(lines, positions, rigid)[1]
