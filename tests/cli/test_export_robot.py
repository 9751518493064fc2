"""An arm for other software: pinocchio reads the URDF and finds the flange where the model says, cold and hot."""

import json

import numpy as np
import pinocchio as pin
import pytest
from command_line import run
from flawed import flawed_file

from compgen.core.pose import Pose
from compgen.error_model.model import build_error_model
from compgen.pipelines.files.robot_file import load_arm

HOT = {"j2": 11.0, "link1": 3.9, "j3": 13.0, "wrist": 3.0, "face": 2.3}
RISES = ",".join(f"{name}={rise}" for name, rise in HOT.items())


def flange_by_pinocchio(urdf, q):
    model = pin.buildModelFromXML(urdf)
    data, frame = model.createData(), model.getFrameId("tool0")
    pin.framesForwardKinematics(model, data, q)
    return data.oMf[frame].translation, data.oMf[frame].rotation


def by_the_model(arm, sources, rise, q):
    model = build_error_model(arm.robot, sources, len(rise), Pose(np.zeros(3), np.eye(3)))
    return model.actual_pose(arm.robot.to_theta(np.zeros(6)) + q, np.tile(rise, (len(q), 1)))


@pytest.mark.parametrize("hot", [False, True])
def test_pinocchio_finds_the_flange_where_the_model_says(tmp_path, hot):
    arm = load_arm(flawed_file(tmp_path))
    file, option = str(tmp_path / "arm.urdf"), ["--rise-K", RISES] if hot else []
    assert run("export-robot", arm.source, "-o", file, *option).returncode == 0
    text = (tmp_path / "arm.urdf").read_text()
    assert "left out, for they are no fixed lines:" in text
    sources = [known.source for known in arm.known if known.source.NAME not in text.split("lines:")[1].split(";")[0]]
    q = np.random.default_rng(2).uniform(-1, 1, (1000, 6))
    expected = by_the_model(arm, sources, np.array(list(HOT.values())) * hot, q)
    for n in range(0, 1000, 7):
        position, rotation = flange_by_pinocchio(text, q[n])
        assert np.abs(position - expected.position[n]).max() < 1e-9
        assert np.abs(rotation - expected.rotation[n]).max() < 1e-9


def test_json_has_the_same_lines(tmp_path):
    file = str(tmp_path / "arm.json")
    assert run("export-robot", "m20ia", "-o", file).returncode == 0
    record = json.loads((tmp_path / "arm.json").read_text())
    assert record["left_out"] == []
    assert record["left_out_um"] == 0
    assert record["pendant"] == "joint 3 is J2 + J3"
    assert [joint["axis"] for joint in record["joints"]][1] == pytest.approx([0, 1, 0])
    assert record["flange"]["position_m"] == pytest.approx([0.15 + 0.835 + 0.1, 0, 0.79 + 0.25])
    assert run("export-robot", "m20ia", "-o", file).returncode == 0  # its own file is replaced


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("m710ic50", "--rise-K", "j9=1"), "--rise-K: no node 'j9'; did you mean 'j3'?"),
        (("m710ic50", "--rise-K", "j2"), "j2: '' is no rise of -100 to 200 K"),
        (("m710ic50", "--rise-K", "j2=nan"), "j2: 'nan' is no rise"),
        (("m710ic50", "--rise-K", "j2=3,j3=1,j2=5"), "--rise-K: j2: stands twice, 3 and 5 K; keep one"),
        (("m20ia", "--rise-K", "j2=1"), "m20ia has no nodes: leave it out"),
        (("m710ic50", "-o", "arm.txt"), "ends in neither .urdf nor .json"),
        (("nosuch",), "nosuch"),
    ],
)
def test_bad_input_is_one_line(arguments, words):
    result = run("export-robot", *arguments)
    assert result.returncode == 2
    assert words in result.stderr
    assert result.stderr.count("\n") == 1


def test_another_file_is_not_replaced(tmp_path):
    (tmp_path / "arm.urdf").write_text("<robot/>")
    result = run("export-robot", "m20ia", "-o", str(tmp_path / "arm.urdf"))
    assert result.returncode == 2
    assert (tmp_path / "arm.urdf").read_text() == "<robot/>"
