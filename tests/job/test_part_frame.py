"""A part in a frame of its own: the path stands in it, the text is written in it, the twin reads it in it."""

import re
from pathlib import Path

import numpy as np
import pytest
from changed import changed
from numpy.testing import assert_allclose
from shipped import path_file, quiet

from compgen import fanuc
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.rotations import from_wpr
from compgen.core.units import DEG, MM, UM
from compgen.job.motion_plan import coarse_motion
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.pipelines.planned.generate import generate
from compgen.verification.deviation import deviation_from_path
from compgen.verification.twin import execute

PLACE = (1350.1234, -30.4321, 203.2468, 1.25037, -0.8, 33.33333)
FAST = ["process.chord_um=20"]


def frame_text(values=PLACE, **more):
    keys = ("x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg")
    lines = [f"{k} = {v}" for k, v in zip(keys, values, strict=True)] + [f"{k} = {v!r}" for k, v in more.items()]
    return "[frame]\n" + "\n".join(lines).replace("'", '"') + "\n"


def job_in(folder, frame):
    text = Path(path_file("circle_1300")).read_text()
    text = re.sub(r"x_mm = 1350[^\n]*\ny_mm = -30\nz_mm = 203", "x_mm = 0\ny_mm = 0\nz_mm = 0", text)
    text = text.replace("[process]", frame + "\n[process]")
    (folder / "part.toml").write_text(text)
    return load_job(str(folder / "part.toml"), overrides=FAST)


def place_of(values=PLACE):
    angles = (np.array([a * DEG]) for a in values[3:])
    return Pose(np.array(values[:3]) * MM, from_wpr(*angles)[0])


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    job = job_in(tmp_path_factory.mktemp("frame"), frame_text(number=3))
    return job, *generate(job, quiet)


def test_the_path_stands_in_the_frame(made):
    _, planned, _ = made
    place = place_of()
    local = (place.inverse() @ planned.path.target).position
    on_part = planned.path.contact
    assert_allclose(np.linalg.norm(local[on_part, :2], axis=1), 0.65, atol=1e-9)  # m
    assert_allclose(local[on_part, 2], 0, atol=1e-9)
    assert_allclose(-planned.path.target.rotation[on_part][:, :, 2], np.tile(place.rotation[:, 2], (on_part.sum(), 1)))


def test_the_text_is_written_in_the_user_frame_and_proven_in_it(made):
    job, planned, corrected = made
    assert b"UFRAME_NUM=3" in corrected.text
    assert b"UF : 3" in corrected.text
    text = fanuc.interpret(corrected.text)
    radius = np.linalg.norm(text.position[planned.path.contact, :2], axis=1)
    assert_allclose(radius, 0.65, atol=2e-3)  # circle about zero, in the part's own coordinates
    assert corrected.deviation.total().max() < 25 * UM  # chord of 20 um
    # the same text, read by an arm whose register is elsewhere, is off by as much
    other = job_moved(job, [1e-3, 0, 0])
    flown = execute(twin_of(other), corrected.program, job.history.before, air=job.history.air)
    off = deviation_from_path(planned.path, [flown], len(flown.time))
    assert off.total().max() == pytest.approx(1e-3, abs=30 * UM)


def job_moved(job, by):
    from dataclasses import replace

    register = replace(job.frame.register, position=job.frame.register.position + np.array(by))
    return changed(job, "plan.path.frame.register", register)


def test_a_frame_is_held_to_the_controllers_digits_and_the_part_is_where_it_was_taught(made):
    job, _, _ = made
    assert_allclose(job.frame.place.position / MM, PLACE[:3], atol=1e-9)
    assert_allclose(job.frame.register.position / MM, np.round(PLACE[:3], 3), atol=1e-9)
    assert np.abs(job.frame.register.rotation - job.frame.place.rotation).max() < 0.001 * DEG


def test_a_program_in_world_is_what_a_frame_at_world_says(tmp_path):
    plain = load_job(path_file("circle_1300"), overrides=FAST)
    text = Path(path_file("circle_1300")).read_text().replace("[process]", frame_text((0,) * 6) + "\n[process]")
    (tmp_path / "circle_1300.toml").write_text(text)
    framed = load_job(str(tmp_path / "circle_1300.toml"), overrides=FAST)
    one, other = generate(plain, quiet)[1], generate(framed, quiet)[1]
    assert_allclose(one.program.position, other.program.position, atol=1.1e-6)
    assert other.program.uframe == 1
    assert one.program.uframe == 0


def codes(job):
    from compgen.job.part_frame import frame_findings

    return [(f.level.value, f.code) for f in frame_findings(job.frame, job.cell.robot_file_hash, job.cell.heat.names)]


def test_how_a_frame_was_taught_is_a_finding(tmp_path):
    hot = '\n[frame.taught]\nthrough = "pendant"\nrise_K = { j2 = 8.0, j3 = 9.5 }\n'
    assert codes(job_in(tmp_path, frame_text() + hot)) == [("warning", "frame.hot")]
    cold = '\n[frame.taught]\nthrough = "pendant"\n'
    assert codes(job_in(tmp_path, frame_text() + cold)) == [("note", "frame.pendant")]
    assert codes(job_in(tmp_path, frame_text())) == [("note", "frame.taught")]
    by_model = hot.replace("pendant", "model")
    assert codes(job_in(tmp_path, frame_text() + by_model)) == []
    assert codes(job_in(tmp_path, frame_text() + by_model.replace("j3", "J3"))) == [("note", "frame.taught")]
    other = '\n[frame.taught]\nthrough = "model"\nrobot_file = "other 0123456789abcdef"\n'
    assert codes(job_in(tmp_path, frame_text() + other)) == [("warning", "frame.model")]
    assert codes(load_job(path_file("circle_1300"))) == []


@pytest.mark.parametrize(
    ("frame", "words"),
    [
        ('[frame]\nfile = "none.toml"\n', ("none.toml", "no such file")),
        ('[frame]\nfile = "f.toml"\nx_mm = 3\n', ("frame.x_mm", "remove")),
        ('[frame]\nfile = "f.toml"\nnumber = 4\n', ("frame.number: 4", "frame 2")),
        ("[frame]\nnumber = 0\n", ("frame.number",)),
        ("[frame]\nx_m = 1\n", ("frame.x_m", "unknown key")),
    ],
)
def test_wrong_frames_are_refused(tmp_path, frame, words):
    (tmp_path / "f.toml").write_text(frame_text(number=2))
    with pytest.raises(InputError) as refusal:
        job_in(tmp_path, frame)
    assert all(w in str(refusal.value) for w in words), refusal.value


def test_a_frame_of_a_file_is_that_of_its_numbers(tmp_path):
    (tmp_path / "f.toml").write_text(frame_text(number=2))
    job = job_in(tmp_path, '[frame]\nfile = "f.toml"\n')
    assert job.frame.number == 2
    assert_allclose(job.frame.place.rotation, place_of().rotation)
    before = job.inputs_hash
    (tmp_path / "f.toml").write_text(frame_text((*PLACE[:5], 33.4), number=2))
    assert job_in(tmp_path, '[frame]\nfile = "f.toml"\n').inputs_hash != before


def test_the_coarse_motion_is_that_of_the_part_where_it_stands(tmp_path):
    """By which sweeps are begun early for play: not that of the frame's numbers in World."""
    place = "x_mm = {}\ny_mm = {}\nz_mm = {}\n"
    there, origin, motions = place.format(1350, -30, 203), place.format(0, 0, 0), []
    for name, path, frame in (("world", there, ""), ("part", origin, f"[frame]\nnumber = 1\n{there}")):
        (tmp_path / f"{name}.toml").write_text(
            f'[path]\npattern = "raster"\nstepover_mm = 100\ndiameter_mm = 600\n{path}{frame}'
            "[process]\nfeed_mm_s = 100\n[bounds]\nmax_um = 100\n"
        )
        job = load_job(str(tmp_path / f"{name}.toml"))
        motion = coarse_motion(job.plan, job.robot)
        assert motion is not None
        motions.append(motion)
    assert_allclose(motions[1][1], motions[0][1], atol=1e-9)
