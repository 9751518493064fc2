"""A position that is elsewhere than the text has it, in logs as the maker's motion code writes them."""

import numpy as np
import pytest
from motion_code import DOWN, driven, program
from shipped import ROOT

from compgen.core.finding_codes import Code
from compgen.pipelines.executed.executed import Situation, judge_log, read_program_text
from compgen.pipelines.files.robot_file import load_robot
from compgen.program.frames import default_frames
from compgen.verification.executed.position_log import read_position_log

LINES = [(1300, -500, 100), (1300, 0, 100), (1560, 310, 100)]
ANGLE = np.radians(np.arange(0, 361, 12))
CHAIN = [(1200 + 250 * np.cos(a), 250 * np.sin(a), 100 + 40 * np.sin(3 * a)) for a in ANGLE]  # lines of 52 to 60 mm
MEANS = (0.176, 0.168)


def findings(folder, points, speed, moved=None, by=(0, 0, 0), means=MEANS, noise=0.0):
    """What is said of a run through points by a program in which one of them is moved [mm]."""
    points = np.array(points, dtype=float)
    fine = [True, *[False] * (len(points) - 2), True]
    time, place = driven(points, speed, fine, means=means)
    rows = np.column_stack([time, place, np.broadcast_to(DOWN, place.shape)])
    rows[:, 1:4] += noise * np.random.default_rng(1).normal(size=place.shape)
    text = "\n".join(["time_s,x_mm,y_mm,z_mm,w_deg,p_deg,r_deg", *(",".join(f"{v:.4f}" for v in r) for r in rows), ""])
    (folder / "log.csv").write_text(text)
    if moved is not None:
        points[moved] += by
    content = program(points, speed, fine)
    (folder / "RUN.LS").write_bytes(content)
    robot = load_robot(str(ROOT / "robots" / "m710ic50.toml"))
    around = Situation(robot, default_frames(), {}, lambda name: None)
    written = read_program_text(str(folder / "RUN.LS"), content)
    return judge_log(written, around.course(content), read_position_log(folder / "log.csv"), around)


def strays(run):
    return [f.message for f in run.findings if f.code is Code.EXECUTED_ANOTHER]


@pytest.mark.parametrize("by", [(0, 1, 0), (1, 0, 0), (0, 0, -1), (0.6, 0, 0.8)], ids=str)
@pytest.mark.parametrize("means", [MEANS, (0.32, 0.32)], ids=str)
def test_a_corner_of_two_lines_that_is_a_millimetre_elsewhere_is_another_program(tmp_path, by, means):
    run = findings(tmp_path, LINES, 200, moved=1, by=by, means=means)
    assert not run.inside
    assert len(strays(run)) == 1
    assert "near P[2]" in strays(run)[0] or "near P[3]" in strays(run)[0]


@pytest.mark.parametrize(("moved", "by"), [(8, (0, 0, 1)), (15, (1, 0, 0)), (22, (0, -0.8, 0.6))], ids=str)
@pytest.mark.parametrize("speed", [200, 450])
def test_a_position_of_a_chain_of_short_lines_that_is_a_millimetre_elsewhere_is_another_program(
    tmp_path, moved, by, speed
):
    run = findings(tmp_path, CHAIN, speed, moved=moved, by=by, noise=0.002)
    assert not run.inside
    assert any(f"near P[{n}]" in strays(run)[0] for n in (moved, moved + 1, moved + 2))


@pytest.mark.parametrize("points", [LINES, CHAIN], ids=["lines", "chain"])
@pytest.mark.parametrize(("speed", "means"), [(200, MEANS), (450, MEANS), (250, (0.32, 0.32))], ids=str)
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_run_of_the_text_is_inside(tmp_path, points, speed, means, noise):
    run = findings(tmp_path, points, speed, means=means, noise=noise)
    assert run.inside
    assert not strays(run)
