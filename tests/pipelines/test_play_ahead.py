"""Play of a joint that hardly moves and stands ahead: the command turns round where the arm shall not."""

import numpy as np
import pytest
from shipped import ROOT, quiet

from compgen.core.units import UM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned.generate import generate

FRAME = "[frame]\nnumber = 1\nx_mm = 1350\ny_mm = -30\nz_mm = 203\nw_deg = 0.8\np_deg = -0.6\nr_deg = 3\n"
PLAY = """
[sources.hysteresis]
backlash_mdeg = [0, 0, 0, {:g}, 0, 0]
width_mdeg = [200, 200, 200, 12, 200, 200]
law = "play"
"""


@pytest.mark.parametrize(("half", "most"), [(-24.0, 8.0), (9.0, 4.0)])
def test_what_is_left_of_play_is_small_where_a_joint_moves_by_little_more(tmp_path, half, most):
    """J4 of an upright tool turns by 163 mdeg; flown by the twin. By directions of a first command: 114, 10 um."""
    robot = tmp_path / "robot.toml"
    robot.write_text((ROOT / "robots" / "m710ic50.toml").read_text() + PLAY.format(half))
    text = (ROOT / "paths" / "circle_1300.toml").read_text()
    for line in ("x_mm = 1350 # centre, World frame", "y_mm = -30", "z_mm = 203"):
        text = text.replace(line, line.split("=")[0] + "= 0")
    path = tmp_path / "path.toml"
    before, after = text.index("[[before]]"), text.index("[bounds]")
    path.write_text(text[:before].replace("diameter_mm = 1300", "diameter_mm = 300") + FRAME + text[after:])
    planned, corrected = generate(load_job(str(path), str(robot)), quiet)
    j4 = planned.theta[planned.path.contact, 3]
    assert np.ptp(j4) * 180e3 / np.pi < 2000
    assert corrected.deviation.on_part["total"].p99 < most * UM
