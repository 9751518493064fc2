"""One offset in place of a corrected program, judged by the study's arm a second time on numbers moved by hand."""

import naive_ls
import numpy as np
import pytest
from ls_text import at, cartesian, joint_form, program
from naive_arm import flange, frame, joints_at, numbers
from numpy.testing import assert_allclose
from shipped import path_file, quiet
from states import state_of, written

from compgen import fanuc
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.rotations import rotation_matrix
from compgen.job.anchored_start import cell_with_state
from compgen.job.motion_plan import plan_motion
from compgen.pipelines.correct.program_offsets import offsets_of_program
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.robot_file import load_cell
from compgen.pipelines.planned.offsets import FRAME, FULL, NOTHING, REGISTER, SHIFT, offsets_of_job, with_offset
from compgen.pipelines.planned.program_text import planned_program
from compgen.program.frames import Frames, default_frames
from compgen.thermal import Duty

SHIFTED = np.array([0.12, -0.08, 0.05])  # mm
TURNED = np.array([5.0, -10.0, 20.0])  # mdeg
UF = (1200.0, -30.0, 150.0, 0.3, -0.2, 15.0)
PLACES = [(0, 0, 0), (150, 20, 10), (120, 200, -10), (-80, 150, 30), (-160, -90, 5), (60, -180, 0), (0, 0, 0)]


def base():
    """Where the arm has moved to, as a matrix in mm."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation_matrix(np.radians(TURNED / 1e3)), SHIFTED
    return matrix


def state_of_moved(job):
    """Cold, and standing elsewhere."""
    moved_base = np.concatenate([SHIFTED / 1e3, np.radians(TURNED / 1e3)])
    return state_of(job, rise=np.zeros(len(job.heat.names)), base=moved_base)


@pytest.fixture(scope="module")
def day():
    return load_job(path_file("circle_1300"))


@pytest.fixture(scope="module")
def text():
    points = [cartesian(n, (*xyz, 180, 0, 15), uf=1) for n, xyz in enumerate(PLACES, 1)]
    moves = ["UFRAME_NUM=1", "UTOOL_NUM=0", "J P[1] 10% FINE", *(f"L P[{n}] 50mm/sec FINE" for n in range(2, 8))]
    return program(moves, points)


@pytest.fixture(scope="module")
def offsets(day, text):
    cell = cell_with_state(load_cell("m710ic50"), state_of_moved(day), "state.toml")
    matrix = frame(*UF)
    uframe = {**default_frames().uframe, 1: Pose(matrix[:3, 3] / 1e3, matrix[:3, :3])}
    return offsets_of_program(text, cell, Frames(uframe, default_frames().utool), (), quiet)


def way(offsets, kind):
    return next(w for w in offsets.ways if w.kind == kind)


def driven(commanded):
    """Where the moved arm's flange is, sent to a pose in World."""
    return base() @ flange(joints_at(commanded, (0, 20, -20, 0, -70, 0)))


def errors_with(uf, add):
    """How far the flange is from where the program wants it at its positions, um, numbers added as the pendant adds."""
    targets = [frame(*UF) @ frame(*xyz, 180, 0, 15) for xyz in PLACES]
    there = [driven(frame(*uf) @ frame(*(np.array([*xyz, 180, 0, 15]) + add))) for xyz in PLACES]
    return 1e3 * np.array([np.linalg.norm((a - t)[:3, 3]) for a, t in zip(there, targets, strict=True)])


def test_a_frame_typed_in_brings_the_moved_arm_back(offsets):
    """5 um for a thousandth of a degree at 0.25 m, and the digits of X Y Z."""
    assert errors_with(UF, np.zeros(6)).max() > 100
    typed = way(offsets, FRAME)
    assert errors_with(typed.numbers, np.zeros(6)).max() < 5
    assert_allclose(typed.numbers, np.round(typed.numbers, 3), atol=1e-9)
    assert typed.left.max < 5e-6
    back = numbers(np.linalg.inv(base()) @ frame(*UF))
    assert_allclose(typed.numbers[3:], back[3:], atol=1.5e-3)


def test_a_register_leaves_what_the_second_arm_says(offsets):
    """The largest is at a position: what the arm errs by is the same function on the lines between them."""
    for kind in (SHIFT, REGISTER):
        left = way(offsets, kind)
        assert_allclose(errors_with(UF, left.numbers).max() / 1e6, left.left.max, atol=0.2e-6)
    assert way(offsets, REGISTER).left.turn < way(offsets, SHIFT).left.turn / 5
    assert_allclose(errors_with(UF, np.zeros(6)).max() / 1e6, way(offsets, NOTHING).left.max, atol=0.2e-6)


def test_a_register_moved_either_way_leaves_more(offsets):
    """Along the path; the second arm is asked at points of it 10 mm apart."""
    places = np.array(PLACES, dtype=float)
    ways = np.diff(places, axis=0)
    points = np.vstack(
        [
            a + np.outer(np.arange(0.5, n) / n, d)
            for a, d, n in zip(places, ways, (np.linalg.norm(ways, axis=1) // 10).astype(int), strict=False)
        ]
    )
    targets = [frame(*UF) @ frame(x, y, z, 180, 0, 15) for x, y, z in points]
    error = np.array([(base() @ t - t)[:3, 3] for t in targets]) @ frame(*UF)[:3, :3]
    typed = way(offsets, SHIFT).numbers[:3]
    least = ((error + typed) ** 2).sum()
    for i in range(3):
        for step in (-0.002, 0.002):
            assert ((error + typed + step * np.eye(3)[i]) ** 2).sum() > least


def test_each_way_leaves_less_than_the_one_before(offsets):
    rms = [way(offsets, kind).left.rms for kind in (NOTHING, SHIFT, FRAME, FULL)]
    assert rms == sorted(rms, reverse=True)
    assert rms[0] > 3 * rms[1] > 9 * rms[3]


@pytest.mark.parametrize("uf", [(0.0,) * 6, (1330.0, -30.0, 200.0, 0.4, -0.3, 75.0)], ids=["world", "frame"])
def test_a_planned_path_s_offset_is_judged_on_the_text_with_its_numbers_moved(uf, day, tmp_path):
    """The text of the planned circle, its numbers moved by hand, on the moved arm: to the chord and the digits."""
    overrides = [f"state.file='{written(state_of_moved(day), tmp_path)}'"]
    if any(uf):
        keys = ("x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg")
        overrides += ["frame.number=1", *(f"frame.{k}={v}" for k, v in zip(keys, uf, strict=True))]
        overrides += ["path.x_mm=20", "path.y_mm=0", "path.z_mm=3"]
    job = load_job(path_file("circle_1300"), overrides=overrides)
    result = offsets_of_job(job, quiet)
    positions, _ = naive_ls.read(fanuc.compose(generate_planned(job)))
    rows = [positions[n].groups[1].axes for n in sorted(positions)]
    for kind in (SHIFT, REGISTER, FRAME):
        typed = way(result, kind)
        size, turn = [], []
        for axes in rows[2:-2:100]:
            values = np.array([axes[a] for a in "XYZWPR"])
            target = frame(*uf) @ frame(*values)
            moved_there = frame(*uf) @ frame(*(values + typed.numbers))
            there = driven(frame(*typed.numbers) @ frame(*values) if kind == FRAME else moved_there)
            size.append(np.linalg.norm((there - target)[:3, 3]) * 1e3)
            turn.append(np.arccos(min(there[:3, 2] @ target[:3, 2], 1.0)))
        assert_allclose(np.sqrt(np.mean(np.square(size))) / 1e6, typed.left.rms, rtol=0.01, atol=1.2e-6)
        assert max(size) < typed.left.max * 1e6 + 0.5
        assert_allclose(max(turn), typed.left.turn, atol=2e-6)
    assert way(result, REGISTER).left.turn < way(result, SHIFT).left.turn / 20


def generate_planned(job):
    plan = plan_motion(job.plan, job.cell, job.feed, quiet)
    return planned_program(job, plan.path, plan.theta, plan.trajectory)


def test_moved_programs_stand_where_their_numbers_say(day):
    planned = generate_planned(day)
    add = np.array([0.5, -0.25, 0.125, 0.01, -0.02, 0.03])
    there = with_offset(planned, Pose(np.zeros(3), np.eye(3)), REGISTER, add)
    before, _ = naive_ls.read(fanuc.compose(planned))
    after, _ = naive_ls.read(fanuc.compose(there))
    for n in (1, 50, 200):
        a, b = (np.array([p[n].groups[1].axes[k] for k in "XYZWPR"]) for p in (before, after))
        assert_allclose(frame(*b), frame(*(a + add)), atol=2e-3)


def test_programs_in_joint_form_or_several_frames_are_refused(text):
    cell, world = load_cell("m710ic50"), default_frames()
    joints = [(0, 20, -20, 0, -70, 0), (5, 22, -18, 3, -68, 4), (9, 25, -15, 6, -64, 9)]
    moves = ["J P[1] 10% FINE", "L P[2] 50mm/sec FINE", "L P[3] 50mm/sec FINE"]
    before = [Duty("moving", 0.2, 3600.0)]
    with pytest.raises(InputError, match="joint form"):
        offsets_of_program(
            program(moves, [joint_form(n, j) for n, j in enumerate(joints, 1)]), cell, world, before, quiet
        )
    frames = Frames({**world.uframe, 1: Pose(np.array([1.0, 0, 0]), np.eye(3)), 2: world.uframe[0]}, world.utool)
    points = [
        at(n, j, uf=frame(1000, 0, 0, 0, 0, 0) if n < 3 else None, numbered=(1 if n < 3 else 2, 0))
        for n, j in enumerate(joints, 1)
    ]
    moves = ["UFRAME_NUM=1", *moves[:2], "UFRAME_NUM=2", moves[2]]
    with pytest.raises(InputError, match="user frames 1, 2"):
        offsets_of_program(program(moves, points), cell, frames, before, quiet)
