"""The robot file that identification writes: the user's comments, order and digits stay, and it always loads."""

import re
import tomllib

import numpy as np
import pytest
from campaign import robot_file
from shipped import quiet
from synthetic import made_up, measured, random_theta

from compgen.core.exceptions import InputError
from compgen.core.units import DEG, MDEG
from compgen.error_model.sources.hysteresis import Hysteresis
from compgen.error_model.sources.joint_waves import GearHarmonics
from compgen.error_model.sources.joint_zeros import JointZeros
from compgen.error_model.uncertain_sources import UncertainSource, prior_of
from compgen.identification import identified_robot_file
from compgen.identification.identified_robot_file import robot_text
from compgen.identification.identify import identify
from compgen.pipelines.files.robot_file import arm_of, load_arm

RECORD = {
    "model": "joints",
    "noise_um": 21.5,
    "instrument_mm": [1200.25, 0.0, -3.0],
    "instrument_deg": [0.0, 0.0, 12.5],
    "reflector_mm": {"r1": [60.0, 10.0, 120.0], 'nest "2"\n': [1.0, 2.0, 3.0]},
}
SOURCES = """
# measured in May
[sources.joint_zeros]  # by laser tracker
# J1 is held by World
provenance = "by hand"  # replaced
offset_mdeg = [0, 1.50, 2, 3, 4, 0]  # pendant order
prior = { offset_mdeg = 60 }

# speeds from the manual
[sources.hysteresis]
width_mdeg = [600, 600, 6e2, 600, 600, 600]
backlash_mdeg = [
    0.5, # J1
    0.4, # J2
    0, 0, 0, 0, # wrist
]
windup_urad_Nm = [0, 0, 0, 0, 0, 0]
# nothing below this line yet
"""
LAYOUTS = {
    "none": "",
    "headers": SOURCES,
    "sub-tables": SOURCES + "[sources.joint_zeros.sigma]\noffset_mdeg = 5 # all\n\n# the end\n",
    "only a prior": "\n# about it\n[sources.joint_zeros.prior]\noffset_mdeg = 60 # wide\n",
    "inline tables": "\n[sources] # all\njoint_zeros = { offset_mdeg = [0, 1, 2, 3, 4, 0], provenance = '' } # z\n",
    "dotted keys": "\n[sources]\n# zeros\njoint_zeros.offset_mdeg = [0, 1, 2, 3, 4, 0] # typed\n"
    "box.low_deg = [0, 0, 0, 0, 0, 0]\nbox.high_deg = [1, 1, 1, 1, 1, 1]\n",
    "no line end": "\n[sources.joint_zeros]\noffset_mdeg = [0, 1, 2, 3, 4, 0] # last",
    "carriage returns": SOURCES.replace("\n", "\r\n"),
    "an identified one": SOURCES + '\n[identified] # once\nmodel = "old" # plain\ninstrument_mm = [0, 0, 0] # near\n'
    "instrument_deg = [0, 0, 0]\n[identified.reflector_mm]\nlost = [1, 2, 3]\nr1 = [4, 5, 6] # sphere\n",
}  # fmt: skip


@pytest.fixture(scope="module")
def arm():
    return load_arm("m710ic50")


def identified():
    """Two sources with values and sigmas."""
    zeros = JointZeros(np.array([0, -12.3456789012, 2e-6, 3, 4, 0]) * MDEG)
    waves = GearHarmonics(np.full((6, 2), MDEG / 3), np.zeros((6, 2)), np.ones(6))
    return [
        UncertainSource(
            source, prior_of(source), {p.field: np.abs(getattr(source, p.field)) / 10 for p in source.PARAMETERS}, ""
        )
        for source in (zeros, waves)
    ]


def written(arm, text, known=None):
    box = np.column_stack([arm.robot.lower, arm.robot.upper])
    return robot_text(text, identified() if known is None else known, box, "identified here", RECORD)


def comments(text):
    return re.findall(r"#[^\n]*", text)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_comments_survive_and_the_file_loads(arm, layout):
    text = arm.text.rstrip() + "\n" + LAYOUTS[layout]
    new = written(arm, text)
    assert sorted(comments(new)) == sorted(comments(text))
    read = arm_of(tomllib.loads(new), new, "new.toml")
    zeros = next(k for k in read.known if isinstance(k.source, JointZeros))
    assert isinstance(zeros.source, JointZeros)
    np.testing.assert_allclose(zeros.source.offset, identified()[0].source.offset, rtol=1e-8)
    np.testing.assert_allclose(zeros.sigma["offset"], identified()[0].sigma["offset"], rtol=1e-8)
    assert zeros.provenance == "identified here"
    assert read.identified is not None
    assert read.identified.reflector_mm == RECORD["reflector_mm"]
    assert read.identified.model == "joints"


@pytest.mark.parametrize("layout", LAYOUTS)
def test_writing_twice_gives_the_same_bytes(arm, layout):
    once = written(arm, arm.text.rstrip() + "\n" + LAYOUTS[layout])
    assert written(arm, once) == once


@pytest.mark.parametrize("layout", LAYOUTS)
def test_all_that_was_not_identified_stays_to_the_letter(arm, layout):
    text = arm.text.rstrip() + "\n" + LAYOUTS[layout]
    lines = written(arm, text).splitlines()
    changed = ("provenance", "offset_mdeg", "joint_zeros", "box", "model", "instrument", "lost", "r1", "low", "high")
    kept = [line for line in text.splitlines() if not line.startswith(changed)]
    places = [lines.index(line) for line in kept if line]
    first = [line for line in dict.fromkeys(lines) if line in kept and line]
    assert first == [line for line in dict.fromkeys(kept) if line]  # in the order they had
    assert len(places) > 100


def test_keys_keep_their_order_and_numbers_their_digits(arm):
    new = written(arm, arm.text + SOURCES, [k for k in identified() if isinstance(k.source, JointZeros)])
    table = new[new.index("[sources.joint_zeros]") : new.index("[sources.hysteresis]")]
    keys = re.findall(r"^(\w+) =", table, re.MULTILINE)
    assert keys == ["provenance", "offset_mdeg", "prior", "sigma"]
    assert "offset_mdeg = [0, -12.3456789, 2e-06, 3, 4, 0]  # pendant order" in table
    assert "prior = { offset_mdeg = 60 }" in table
    assert "width_mdeg = [600, 600, 6e2, 600, 600, 600]" in new
    assert "noise_um = 21.5\n" in new
    assert "instrument_mm = [1200.25, 0, -3]\n" in new


def test_a_value_that_stays_keeps_its_spelling(arm):
    source = JointZeros(np.array([0, 1.5, 2, 3, 4, 0]) * MDEG)
    known = [UncertainSource(source, prior_of(source), {"offset": np.full(6, 1e-6)}, "")]
    assert "offset_mdeg = [0, 1.50, 2, 3, 4, 0]  # pendant order" in written(arm, arm.text + SOURCES, known)


def test_sigmas_that_are_no_longer_known_go(arm):
    text = SOURCES + "[sources.hysteresis.sigma]\nbacklash_mdeg = 1\nwindup_urad_Nm = 2\n"
    with_bend = arm.text + text
    old = next(k for k in arm_of(tomllib.loads(with_bend), with_bend, "a").known if isinstance(k.source, Hysteresis))
    known = [UncertainSource(old.source, old.prior, {"backlash": np.full(6, 1e-5)}, "")]
    new = tomllib.loads(written(arm, with_bend, known))["sources"]["hysteresis"]
    assert set(new["sigma"]) == {"backlash_mdeg"}


def test_new_tables_come_after_the_last_line(arm):
    text = arm.text.rstrip() + "\n"
    new = written(arm, text)
    assert new.startswith(text)
    headers = re.findall(r"^\[.*\]$", new[len(text) :], re.MULTILINE)
    assert headers == [
        "[identified]",
        "[identified.reflector_mm]",
        "[sources.box]",
        "[sources.joint_zeros]",
        "[sources.joint_zeros.sigma]",
        "[sources.gear_harmonics]",
        "[sources.gear_harmonics.sigma]",
    ]


def test_a_text_that_does_not_say_what_it_shall_is_refused_in_one_line():
    for text in ("[sources]\nbox = 1\n", "[sources.box]\n[sources.box]\n", ""):
        with pytest.raises(InputError, match=r"cannot be updated.*; give each source a table") as caught:
            identified_robot_file.check_written(text, {"sources": {"box": {"low_deg": 1}}})
        assert "\n" not in str(caught.value)
    identified_robot_file.check_written("sources.box.low_deg = 1", {"sources": {"box": {"low_deg": 1}}})


def test_the_box_of_the_measured_joints_is_rounded_outwards():
    low, high = np.array([-60.12345, -30, -20, -120, -110, -150]), np.array([60, 60.00049, 40, 120, -20, 150.7777])
    box = identified_robot_file.box_table(np.column_stack([low, high]) * DEG)
    for name, true, outwards in (("low_deg", low, 1), ("high_deg", high, -1)):
        assert (outwards * (true - box[name]) > -1e-9).all()
        np.testing.assert_allclose(box[name], true, atol=1.001e-3)


def test_the_box_is_of_the_pendants_angles_that_were_measured(tmp_path):
    """J3 of the pendant is theta3 - J2: its ends are no ends of theta's box."""
    truth = made_up(robot_file(tmp_path), 3)
    rng = np.random.default_rng(5)
    data = measured(truth, random_theta(truth.arm.robot, rng, 40), rng)
    result = identify(truth.arm.robot, truth.arm.known, data, len(truth.arm.nodes), quiet, temperatures=False)
    box = identified_robot_file.box_table(result.box)
    pendant = truth.arm.robot.to_pendant(data.theta) / DEG
    np.testing.assert_allclose(box["low_deg"], pendant.min(axis=0), atol=2e-3)
    np.testing.assert_allclose(box["high_deg"], pendant.max(axis=0), atol=2e-3)
