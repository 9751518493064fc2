"""Logs of a controller whose means go by how a run begins: what is identified, and what may be commanded by it."""

import json
import tomllib

import logged_runs
import ls_text
import numpy as np
import pytest
from command_line import run
from shipped import ROOT, path_file, quiet

from compgen.identification.motion.beginnings import explains
from compgen.identification.motion.windows import windows_of
from compgen.pipelines.executed.executed import Situation, judge_log, read_program_text
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.program.frames import default_frames
from compgen.robot.motion import ControllerMotion
from compgen.verification.executed.position_log import read_position_log

SHORT, LONG = (0.176, 0.168), (0.256, 0.168)
ANGLE = np.radians(np.arange(0, 361, 6))
HERE, BACK = (1300.0, 0.0, 100.0), (1300.0, -200.0, 100.0)
CURVE = [(1100 + 200 * np.cos(a), 200 * np.sin(a), 100 + 40 * np.sin(2 * a)) for a in ANGLE]  # lines of 14 periods
SHORT_RUN = [(place, "CNT100") for place in CURVE[1:-1]] + [(HERE, "FINE"), (BACK, "FINE")]
LONG_RUN = [(HERE, "CNT100"), *SHORT_RUN]  # from BACK on, a line of 1 s


def program(start, runs):
    places = [start, *(place for place, _ in runs)]
    words = ["UFRAME_NUM=0", "UTOOL_NUM=0", "J P[1] 20% FINE"]
    words += [f"L P[{n}] 200mm/sec {word}" for n, (_, word) in enumerate(runs, 2)]
    return ls_text.program(words, [ls_text.cartesian(n, (*p, 180, 0, 0)) for n, p in enumerate(places, 1)], name="RUN")


BOTH = program(HERE, [*SHORT_RUN, *LONG_RUN])


def identified(folder, text, short, long):
    """What the copy of the robot file says of a controller that drives a program, and what the command said."""
    (folder / "RUN.LS").write_bytes(text)
    (folder / "log.csv").write_text(logged_runs.csv(*logged_runs.drive(text.decode(), short, long)))
    (folder / "mine.toml").write_text((ROOT / "robots" / "m710ic50.toml").read_text())
    result = run("identify-motion", "RUN.LS", "--log", "log.csv", "--robot", "mine.toml", "-o", "new.toml", cwd=folder)
    assert result.returncode == 0, result.stderr
    return tomllib.loads((folder / "new.toml").read_text())["motion"], result.stdout


def sets_of(motion):
    """The same numbers for a shipped job."""
    told = motion["identified"]
    identified = f'robot="m710ic50", verdict="{told["verdict"]}", runs_began="{told["runs_began"]}"'
    keys = [f"robot.motion.{key}={motion[key]}" for key in ("moving_average_ms", "after_long_ms") if key in motion]
    return [*keys, f"robot.motion.identified={{{identified}}}", "robot.motion.enabled=true"]


def test_a_log_with_runs_of_both_kinds_tells_both_pairs_and_a_spiral_is_commanded_by_its_own(tmp_path):
    motion, screen = identified(tmp_path, BOTH, SHORT, LONG)
    assert motion["identified"]["verdict"] == "may be commanded against"
    assert motion["identified"]["runs_began"] == "both"
    np.testing.assert_allclose(motion["moving_average_ms"], 1e3 * np.array(SHORT), atol=8)
    np.testing.assert_allclose(motion["after_long_ms"], 1e3 * np.array(LONG), atol=8)
    assert "in runs that begin with a long line" in screen
    report = json.loads((tmp_path / "new.json").read_text())
    assert report["motion"]["runs_began"] == ["long", "short"]
    assert len(report["motion"]["interval_ms"]) == 4
    left = []
    for enabled in ("true", "false"):
        job = load_job(path_file("spiral_1300"), None, [*sets_of(motion), f"robot.motion.enabled={enabled}"])
        _, corrected = generate.generate(job, quiet)
        assert corrected.program.name.endswith("_V100") is (enabled == "true")
        left.append(corrected.deviation.on_part["total"].max)
    assert left[0] < 0.5 * left[1]


@pytest.mark.parametrize(("text", "means", "began"), [
    (program(BACK, LONG_RUN), LONG, "long"), (program(HERE, SHORT_RUN), SHORT, "short"),
])  # fmt: skip
def test_a_log_with_runs_of_one_kind_is_for_jobs_of_that_kind_alone(tmp_path, text, means, began):
    """The straight way back that begins long bends nowhere, and is no evidence."""
    motion, screen = identified(tmp_path, text, SHORT, LONG)
    assert motion["identified"]["verdict"] == "may be commanded against"
    assert motion["identified"]["runs_began"] == began
    assert "after_long_ms" not in motion
    np.testing.assert_allclose(motion["moving_average_ms"], 1e3 * np.array(means), atol=8)
    assert f"known for runs that begin with a {began} line\n" in screen
    planned = generate.predict(load_job(path_file("circle_1300"), None, sets_of(motion)), quiet)
    assert ("motion.predistorted" in {f.code for f in planned.findings}) is (began == "short")
    assert ("motion.runs" in {f.code for f in planned.findings}) is (began == "long")


def test_bends_are_explained_by_the_pair_of_their_own_runs_and_straight_ways_tell_nothing(tmp_path, robot):
    (tmp_path / "log.csv").write_text(logged_runs.csv(*logged_runs.drive(BOTH.decode(), SHORT, LONG)))
    around = Situation(robot, default_frames(), {}, lambda name: None)
    log = read_position_log(str(tmp_path / "log.csv"))
    driven = judge_log(read_program_text("RUN.LS", BOTH), around.course(BOTH), log, around)
    curves = [w for w in windows_of(driven, robot) if np.ptp(w.position[:, 0]) > 0.1]
    straight = [w for w in windows_of(driven, robot) if np.ptp(w.position[:, 0]) < 0.1]
    begun = {"short": [w for w in curves if w.first < 0.3], "long": [w for w in curves if w.first > 0.9]}
    for kind, some in begun.items():
        for name, pair in (("short", SHORT), ("long", LONG)):
            known = ControllerMotion(moving_averages=pair)
            assert explains(known, 2e-6, some, robot, driven.course.tool) is (kind == name)
            assert explains(known, 2e-6, straight, robot, driven.course.tool) is None


def test_a_controller_without_the_rule_has_one_pair_for_both(tmp_path):
    motion, _ = identified(tmp_path, BOTH, (0.2, 0.1), (0.2, 0.1))
    assert motion["identified"]["runs_began"] == "both"
    assert "after_long_ms" not in motion
    np.testing.assert_allclose(motion["moving_average_ms"], [200, 100], atol=2)
