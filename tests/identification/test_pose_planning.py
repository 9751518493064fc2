"""Which poses can be measured: reflectors in the box, and facing the instrument."""

import numpy as np
from naive_arm import flange

from compgen.identification.model import build_model
from compgen.identification.pose_planning import Site, visible_poses
from compgen.pipelines.files.robot_file import load_robot


def seen(reflector, box, instrument=None, view=90.0, joints=(0, 20, -10, 0, -60, 0)):
    robot = load_robot("m710ic50")
    site = Site(
        box=np.array(box) / 1e3,
        reflector=np.array([reflector]) / 1e3,
        instrument=instrument,
        view=np.radians(view),
        noise=1e-5,
        share=0.8,
    )
    theta = robot.to_theta(np.radians([joints]))
    return bool(visible_poses(build_model(robot, (), 0), 0, site, theta)[0])


def test_the_box_holds_the_reflector_and_not_the_flange():
    """The judge's arm says where a reflector 200 mm beside and 300 mm before the flange is."""
    place = flange((0, 20, -10, 0, -60, 0)) @ np.array([200.0, 0, 300.0, 1])
    box = place[:3] + np.array([[-5.0] * 3, [5.0] * 3])
    assert seen((200, 0, 300), box)
    for axis in range(3):
        away = box + 12 * np.eye(3)[axis]
        assert not seen((200, 0, 300), away)


def test_the_instrument_is_seen_within_the_view_only():
    pose = flange((0, 20, -10, 0, -60, 0))
    everywhere = [[-1e5] * 3, [1e5] * 3]
    before = (pose @ np.array([0.0, 0, 3000, 1]))[:3] / 1e3  # straight out of the flange
    beside = (pose @ np.array([3000 * np.sin(0.5), 0, 3000 * np.cos(0.5), 1]))[:3] / 1e3  # 28.6 deg off its axis
    assert seen((0, 0, 0), everywhere, before, 1.0)
    assert seen((0, 0, 0), everywhere, beside, 29.0)
    assert not seen((0, 0, 0), everywhere, beside, 28.0)
