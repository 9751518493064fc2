"""A corrected program: nothing but numbers has changed, and the real arm is where the planned program says."""

from functools import cache

import naive_arm as arm
import naive_heat
import naive_ls
import numpy as np
import pytest
from corrected import GOLDEN, HOME, MANY, POLISHED, REAL, ROUNDED_UM, STILL, corrected, missed_um, polishing, pose
from hypothesis import given, settings
from hypothesis import strategies as st
from ls_text import at, cartesian, joint_form, program
from shipped import ROOT, quiet

from compgen.core.exceptions import CompgenError, InputError
from compgen.core.finding_codes import Level
from compgen.core.pose import IDENTITY, Pose
from compgen.fanuc import compose
from compgen.fanuc.editing.numbers import format_like
from compgen.pipelines.correct import Options, correct
from compgen.pipelines.correct.program_file import load_before
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.robot_file import load_cell
from compgen.pipelines.planned import generate
from compgen.pipelines.planned.program_text import planned_program
from compgen.program.frames import Frames, default_frames, load_frames
from compgen.thermal import Duty
from compgen.thermal.ensemble import Ensemble
from compgen.verification.verdict import Verdict


@pytest.fixture(scope="module")
def hot():
    return load_cell(str(ROOT / "robots" / "m710ic50.toml"))


@pytest.fixture(scope="module")
def warm(hot):
    """A golden or a real program as corrected for the warm robot, once for all tests."""
    return cache(lambda path: corrected(path.read_bytes(), hot, MANY))


@pytest.fixture(scope="module")
def rigid():
    return load_cell(str(ROOT / "robots" / "m710ic50.toml"), ["thermal.cte_um_m_K=0"])


def masked(data, free):
    """The text with every number and turn digit of the free positions' first group blanked, line by line."""
    out, number, group = [], None, 1
    for line in naive_ls.lines_of(data.decode("latin-1").replace("\r\n", "\r\n ")):
        text = line.strip(" \t\r")
        if text[:2].upper() == "P[" and "{" in text:
            number, group = int(text[2:].split("]")[0].split(":")[0]), 1
        if text[:2].upper() == "GP":
            group = int(text[2])
        if number in free and group == 1 and ("=" in text or "CONFIG" in text.upper()):
            behind = max(0, line.upper().find("CONFIG"))  # the frames stand before it
            line = line[:behind] + "".join("#" if c in "+-.0123456789" else c for c in line[behind:])
            while "##" in line:
                line = line.replace("##", "#")
            line = line.replace(" #", "#").replace(" #", "#")
        out.append(line)
    return "\n".join(out)


# Nothing but numbers -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", [*GOLDEN, *REAL], ids=lambda p: p.name)
def test_a_robot_without_error_changes_no_byte(path, rigid):
    data = path.read_bytes()
    for options in ({}, {"split": True, "insert": 5e-6}):
        try:
            result = corrected(data, rigid, MANY, **options)
        except InputError:  # what each refusal says is tested beside its cause
            continue
        assert result.text == data
        assert (result.changed, result.added) == (0, 0)


@pytest.mark.parametrize(("limits", "zero"), [("[-90, 20.0005]", -8), ("[19.9995, 90]", 8)])
def test_what_is_left_as_it_is_says_how_far_it_stays_off(limits, zero):
    """J2 at its limit, and its zero 8 mdeg off: the forearm's angle to the horizontal counts by itself."""
    off = [f"limits.j2_deg={limits}", f"sources.joint_zeros.offset_mdeg=[0, {zero}, 0, 0, 0, 0]"]
    cell = load_cell(str(ROOT / "robots" / "m710ic50.toml"), off)
    high, inside = (0, 20, -30, 0, -60, 0), (0, 20 + np.sign(zero) * 2, -30, 0, -60, 0)
    moves = ["J P[1] 20% FINE", "L P[2] 100mm/sec FINE"]
    result = corrected(program(moves, [at(1, high), at(2, inside)]), cell, before=())
    assert [station for station, _ in result.plan.stations.held] == [0]
    real = (0, 20 + 1e-3 * zero, -30 - 1e-3 * zero, 0, -60, 0)
    stays = 1e3 * np.linalg.norm(arm.flange(real)[:3, 3] - arm.flange(high)[:3, 3])
    held = next(f.message for f in result.findings if f.code == "correction.held")
    assert f"left as it is, up to {stays:.0f} um off: its correction would drive joint J2 beyond" in held


@pytest.mark.skipif(not REAL, reason="no programs of other people here")
def test_only_five_kinds_of_refusal_meet_real_programs(hot, warm):
    """Each of the 88 is corrected, passed through, or refused because a frame is not known."""
    without, refusals = 0, []
    for path in REAL:
        try:
            warm(path)
        except CompgenError as refused:
            refusals.append(str(refused))
        try:
            corrected(path.read_bytes(), hot)
        except InputError as refused:
            without += "give [uframe." in str(refused) or "give [utool." in str(refused)
    assert refusals == []
    assert without > 40


@pytest.mark.parametrize("path", [*GOLDEN, *REAL], ids=lambda p: p.name)
def test_a_warm_robot_changes_only_numbers_of_intended_positions(path, warm):
    data = path.read_bytes()
    result = warm(path)
    free = set(result.plan.poses.number[result.shared.changed].tolist())
    assert masked(result.text, free) == masked(data, free)
    before, after = naive_ls.read(data), naive_ls.read(result.text)
    assert [(m.letter, m.targets, m.speed, m.termination, m.rest, m.disabled) for m in before[1]] == [
        (m.letter, m.targets, m.speed, m.termination, m.rest, m.disabled) for m in after[1]
    ]
    moved = 0
    for n, was in before[0].items():
        now = after[0][n]
        assert now.name == was.name
        same = all(now.groups[g].axes == was.groups[g].axes for g in was.groups)
        assert same or n in free, n
        moved += not same
        for g, group in was.groups.items():
            assert (now.groups[g].uf, now.groups[g].ut) == (group.uf, group.ut)
            assert set(now.groups[g].axes) == set(group.axes)
            assert g == 1 or now.groups[g].axes == group.axes
            assert (now.groups[g].config or "").split(",")[0] == (group.config or "").split(",")[0]
            assert all(now.groups[g].axes[e] == group.axes[e] for e in ("E1", "E2", "E3") if e in group.axes)
    assert moved == result.changed


def test_the_mask_sees_what_it_must_not_hide():
    a = program(["J P[1] 10% FINE"], [at(1, HOME)])
    for wound in ((b"10%", b"11%"), (b"UF : 0", b"UF : 1"), (b"N U T", b"F U T"), (b"deg,", b"deg;")):
        assert masked(a.replace(*wound), {1}) != masked(a, {1})
    assert masked(a.replace(b"45", b"46"), {1}) == masked(a, {1})
    assert masked(a.replace(b"X =", b"x ="), {1}) != masked(a, {1})


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_line_ends_stay(end, hot):
    data = program(["J P[1] 10% FINE"], [at(1, HOME)], end=end)
    result = corrected(data, hot)
    assert result.changed == 1
    other = {"\n": b"\r", "\r": b"\n"}.get(end)
    assert other not in result.text if other else result.text.count(b"\r\n") == result.text.count(b"\n")
    assert masked(result.text, {1}) == masked(data, {1})


@pytest.mark.parametrize("decimals", [0, 1, 2, 3, 4, 6])
def test_decimals_stay_and_more_of_them_are_nearer(decimals, hot):
    data = program(["J P[1] 10% FINE"], [at(1, HOME, form=f"{{:.{decimals}f}}")])
    result = corrected(data, hot)
    numbers = [t for line in result.text.decode().split("\n") if "=" in line for t in line.split() if "." in t]
    assert all(len(t.split(".")[1]) == decimals for t in numbers)
    assert len(numbers) == (6 if decimals else 0)
    if decimals > 1:
        assert missed_um(data, result.text, 1, HOME) < max(0.87 * 10.0 ** (3 - decimals), 0.005) + 0.03
    assert any(f.code == "text.decimals" for f in result.findings) == (decimals < 3)


def test_a_missing_zero_before_the_point_stays_missing(hot):
    """Exports print .044 and -.242; exact zero is 0.000."""
    base = np.linalg.inv(arm.flange(HOME))
    near = arm.frame(0.02, -0.01, 0.03, 0.01, -0.02, 0.5)
    frame = np.linalg.inv(base) @ np.linalg.inv(near)
    frames = Frames({0: STILL, 1: Pose(frame[:3, 3] / 1e3, frame[:3, :3])}, {0: STILL})
    values = [f"{v:.3f}".replace("0.", ".", 1) for v in arm.numbers(near)]
    data = program(["J P[1] 10% FINE"], [cartesian(1, values, uf=1, letters=arm.config(HOME))])
    assert b" .020" in data
    result = corrected(data, hot, frames)
    texts = [t for line in result.text.decode().split("\n") if "X =" in line or "W =" in line for t in line.split()]
    numbers = [t for t in texts if "." in t]
    assert result.changed == 1
    assert all(t.lstrip("-")[0] == "." for t in numbers if abs(float(t)) > 0)
    assert all(t == "0.000" for t in numbers if float(t) == 0)


def test_plus_signs_and_old_zeros_are_kept(hot):
    """A number that the correction does not change keeps its odd text."""
    w = arm.numbers(arm.flange(HOME))
    values = [f"+{w[0]:.3f}", f"+{w[1]:.3f}", *(f"{v:.3f}" for v in w[2:])]
    data = program(["J P[1] 10% FINE"], [cartesian(1, values, letters=arm.config(HOME))])
    text = corrected(data, hot).text
    assert text.count(b" = +") == 2
    flat = (0.0, 0.0, 0.0, 0.0, -90.0, 0.0)  # Y exactly zero, and stays there
    values = [f"{v:.3f}" for v in arm.numbers(arm.flange(flat))]
    values[1] = "-.000"
    data = program(["J P[1] 10% FINE"], [cartesian(1, values, letters=arm.config(flat))])
    result = corrected(data, hot)
    assert result.changed == 1
    assert b"Y = -.000  mm" in result.text


def test_no_new_number_is_a_negative_zero(hot):
    """P = 0.0004 deg corrected to nearly zero prints 0.000, never -0.000."""
    checked = 0
    for z in np.linspace(-0.08, 0.08, 41):
        frame = arm.flange(HOME) @ arm.frame(z, 0, 0, 0, 0, 0)
        frames = Frames({0: STILL, 1: Pose(frame[:3, 3] / 1e3, frame[:3, :3])}, {0: STILL})
        data = program(["J P[1] 10% FINE"], [cartesian(1, [-z, 0, 0, 0, 0, 0], uf=1, letters=arm.config(HOME))])
        text = corrected(data, hot, frames).text
        assert b"-0.000" not in text.replace(b"W = -0.000", b"") or b"-0.000" in data
        checked += 1
    assert checked == 41


def test_the_same_program_gives_the_same_bytes(hot):
    data = program(["J P[1] 10% FINE", "L P[2] 100mm/sec FINE"], [at(1, HOME), at(2, (12, 22, -14, 28, -58, 40))])
    assert corrected(data, hot).text == corrected(data, hot).text


# Where the arm is ----------------------------------------------------------------------------------------------------


angles = st.tuples(
    st.floats(-170, 170), st.floats(-30, 70), st.floats(-60, 60), st.floats(-350, 350), st.floats(-120, 120),
    st.floats(-350, 350),
)  # fmt: skip


@settings(max_examples=60, deadline=None)
@given(q=angles, back=st.booleans(), seed=st.integers(0, 10_000))
def test_the_arm_is_where_the_program_says(q, back, seed):
    """All postures and turns, any frame and tool: the residual that a second reader and a second arm see."""
    hot = load_cell(str(ROOT / "robots" / "m710ic50.toml"))
    if abs(q[4]) < 3 or not -150 < q[1] + q[2] < 270:
        return
    if back:
        q = (q[0], -85.0, 130 + q[2] / 3, *q[3:])
    rng = np.random.default_rng(seed)
    uf = arm.frame(*rng.uniform(-1000, 1000, 3), *rng.uniform(-180, 180, 3))
    ut = arm.frame(*rng.uniform(-300, 300, 3), *rng.uniform(-180, 180, 3))
    frames = Frames({0: STILL, 3: Pose(uf[:3, 3] / 1e3, uf[:3, :3])}, {0: STILL, 7: Pose(ut[:3, 3] / 1e3, ut[:3, :3])})
    data = program(["J P[1] 10% FINE"], [at(1, q, uf, ut, (3, 7))])
    result = corrected(data, hot, frames)
    for u in result.plan.scope.unsafe:
        assert "from zero" in u.reason or "full stretch" in u.reason
    if not result.plan.scope.unsafe and not result.plan.stations.held:
        assert missed_um(data, data, 1, q, uf, ut) > 3
        assert missed_um(data, result.text, 1, q, uf, ut) < ROUNDED_UM
        letters = naive_ls.read(result.text)[0][1].groups[1].config
        new = arm.joints_at(pose(naive_ls.read(result.text)[0][1], uf) @ np.linalg.inv(ut), q)
        assert letters == arm.config(new)


def test_the_check_itself_sees_a_wrong_frame(hot):
    """A tool left out, or a frame taken for another, is far outside what the test above allows."""
    uf, ut = arm.frame(100, 200, 300, 10, 20, 30), arm.frame(0, 0, 250, 0, 45, 0)
    place = {0: STILL, 1: Pose(uf[:3, 3] / 1e3, uf[:3, :3])}, {0: STILL, 1: Pose(ut[:3, 3] / 1e3, ut[:3, :3])}
    data = program(["J P[1] 10% FINE"], [at(1, HOME, uf, ut, (1, 1))])
    right = corrected(data, hot, Frames(*place)).text
    assert missed_um(data, right, 1, HOME, uf, ut) < ROUNDED_UM
    assert missed_um(data, right, 1, HOME, uf, ut, lengths=arm.NOMINAL) > 50


def test_frames_of_a_table_and_of_a_backup_give_the_same_program(hot, tmp_path):
    uf, ut = (812.5, -40.25, 130.0, 5.0, -170.0, 33.0), (12.0, -7.5, 240.125, 90.0, 0.0, -45.0)
    keys = ("x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg")
    table = tmp_path / "frames.toml"
    table.write_text(
        "\n".join(
            f"[{kind}.2]\n" + "\n".join(f"{k} = {v}" for k, v in zip(keys, values, strict=True))
            for kind, values in (("uframe", uf), ("utool", ut))
        )
    )
    body = "[*SYSTEM*]$MNU{kind}  Storage: CMOS  Access: RW  : ARRAY[1,9] OF POSITION\n" + "".join(
        "    [1,{n}] = \n      Group: 1   Config: N D B, 0, 0, 0\n"
        "      X:  {v[0]:.3f}   Y:  {v[1]:.3f}   Z:  {v[2]:.3f}\n"
        "      W:  {v[3]:.3f}   P:  {v[4]:.3f}   R:  {v[5]:.3f}\n".replace("{n}", str(n)).replace(
            "{v[", "{v" + str(n) + "["
        )
        for n in (1, 2)
    )
    backup = tmp_path / "SYSFRAME.VA"
    backup.write_text(body.format(kind="FRAME", v1=[0] * 6, v2=uf) + "\n" + body.format(kind="TOOL", v1=[1] * 6, v2=ut))
    data = program(["J P[1] 10% FINE"], [at(1, HOME, arm.frame(*uf), arm.frame(*ut), (2, 2))])
    texts = {corrected(data, hot, load_frames(str(p))).text for p in (table, backup)}
    assert len(texts) == 1
    assert missed_um(data, texts.pop(), 1, HOME, arm.frame(*uf), arm.frame(*ut)) < ROUNDED_UM


@pytest.mark.parametrize("flat", [89.99, 90.0, -90.0, -89.9995])
def test_near_p_90_the_tool_stays_right(flat, hot):
    """W and R are not fixed one by one there: the numbers may not jump, the turn must be right."""
    where = [*arm.flange(HOME)[:3, 3], 20, flat, 35]
    ut = np.linalg.inv(arm.flange(HOME)) @ arm.frame(*where)
    frames = Frames({0: STILL}, {0: STILL, 1: Pose(ut[:3, 3] / 1e3, ut[:3, :3])})
    data = program(["J P[1] 10% FINE"], [cartesian(1, where, ut=1, letters=arm.config(HOME), form="{:.4f}")])
    text = corrected(data, hot, frames).text
    now = naive_ls.read(text)[0][1].groups[1].axes
    assert missed_um(data, text, 1, HOME, None, ut) < ROUNDED_UM
    assert max(abs(now[k] - v) for k, v in zip("WPR", where[3:], strict=True)) < 0.05
    real = arm.flange(
        arm.joints_at(pose(naive_ls.read(text)[0][1]) @ np.linalg.inv(ut), HOME), naive_heat.warm_lengths()
    )
    away = (real @ ut)[:3, :3].T @ arm.frame(*where)[:3, :3] - np.eye(3)
    assert np.linalg.norm(away) < 0.02e-3 * np.sqrt(2)  # rad


@pytest.mark.parametrize("w", [179.9995, -179.9995, 180.0, -180.0])
def test_w_at_180_does_not_grow_by_a_turn(w, hot):
    """A tool pointing down: W goes over the edge as the program writes it, and nothing jumps by 360."""
    down = (0.0, 10.0, -20.0, 5.0, -70.0, 3.0)
    ut = np.linalg.inv(arm.flange(down)) @ arm.frame(*[*arm.flange(down)[:3, 3], w, 0.0003, 179.9996])
    frames = Frames({0: STILL}, {0: STILL, 1: Pose(ut[:3, 3] / 1e3, ut[:3, :3])})
    data = program(["J P[1] 10% FINE"], [at(1, down, None, ut, (0, 1))])
    text = corrected(data, hot, frames).text
    now = naive_ls.read(text)[0][1].groups[1].axes
    assert (np.abs(np.array([now[k] for k in "WPR"], float)) <= 180).all()
    assert missed_um(data, text, 1, down, None, ut) < ROUNDED_UM


def test_places_of_two_tools_and_postures_are_corrected_each_with_its_own(hot):
    """A tool of 200 mm, before and behind a flip of the wrist and a place of the flange."""
    long = arm.frame(0, 0, 200, 0, 0, 0)
    frames = Frames({0: IDENTITY}, {0: IDENTITY, 1: Pose(np.array([0, 0, 0.2]), np.eye(3))})
    joints = ((10.0, 20.0, -15.0, 30.0, 60.0, 45.0), (15.0, 25.0, -20.0, 25.0, -55.0, 40.0), HOME)
    tools = (long, None, long)
    places = [
        at(n, q, ut=ut, numbered=(0, 0 if ut is None else 1))
        for n, (q, ut) in enumerate(zip(joints, tools, strict=True), 1)
    ]
    data = program([f"J P[{n}] 10% FINE" for n in (1, 2, 3)], places)
    text = corrected(data, hot, frames).text
    for n, (q, ut) in enumerate(zip(joints, tools, strict=True), 1):
        assert missed_um(data, data, n, q, ut=ut) > 50
        assert missed_um(data, text, n, q, ut=ut) < ROUNDED_UM


@pytest.mark.parametrize("edge", [180.0, -180.0])
def test_turn_digits_follow_the_joint_over_180(edge, hot):
    """Near +-180 deg the corrected J6 may lie on the other side: the digit says so, and the joint is continuous."""
    checked, joint = set(), 5
    for more in np.linspace(-0.002, 0.002, 21):
        q = list(HOME)
        q[joint] = edge + more
        data = program(["J P[1] 10% FINE"], [at(1, q, form="{:.6f}")])
        text = corrected(data, hot).text
        new = arm.joints_at(pose(naive_ls.read(text)[0][1]), q)
        config = naive_ls.read(text)[0][1].groups[1].config
        assert abs(new[joint] - q[joint]) < 0.1
        if abs(abs(new[joint]) - 180) > 1e-5 and abs(abs(q[joint]) - 180) > 1e-5:
            assert config == arm.config(new)
            checked.add(config == arm.config(q))
    assert checked == {True, False}


def test_joint_form_stays_joint_form_and_is_right(hot):
    """0.001 deg on each joint alone would leave 33 um."""
    worst = 0.0
    for q in (HOME, (10, 20, -15, 30, -60, 180), (-50, 40, 10, -80, 70, 20), (80, -20, 30, 10, -100, -300)):
        data = program(["J P[1] 10% FINE", "L P[1] 100mm/sec FINE"], [joint_form(1, q)])
        result = corrected(data, hot)
        assert b"J1=" in result.text
        assert b"X =" not in result.text
        assert missed_um(data, data, 1, None) > 20
        worst = max(worst, missed_um(data, result.text, 1, None))
        assert any(f.code == "text.joint_form" for f in result.findings)
    assert worst < 6.0


def test_a_tool_that_no_table_tells_of_a_joint_form_position_is_named(hot):
    """It was placed at the flange, and nothing said so: by the second arm twice as much is left at 500 mm of tool."""
    data = program(["J P[1] 10% FINE"], [joint_form(1, (80, -20, 30, 10, -100, -300), ut=1)])
    long = np.eye(4)
    long[2, 3] = 500.0
    tool = Pose(long[:3, 3] / 1e3, long[:3, :3])
    at_tip, at_flange = (corrected(data, hot, Frames({0: STILL}, {n: tool})) for n in (1, 2))
    for result, share in ((at_tip, 1.0), (at_flange, 2.1)):
        left = missed_um(data, result.text, 1, None, ut=long)
        assert left == pytest.approx(share * 1e6 * result.residual.distance.max(), rel=0.01)
    warned = [f.level for result in (at_tip, at_flange) for f in result.findings if f.code == "text.joint_form"]
    assert warned == [Level.NOTE, Level.WARNING]
    assert any("judged at the flange: give the tool, utool 1, with --frames" in f.message for f in at_flange.findings)


# Time runs --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("moves", "duties"),
    [
        (["J P[1] 10% FINE", "WAIT 86400.00(sec)", "J P[2] 1sec FINE"], [("idle", 0, 24.0)]),
        (["J P[1] 10% FINE", "WAIT   .50(sec)", "L P[2] 3600.0sec FINE"], [("moving", "v", 1.0)]),
        (["J P[1] 10% FINE", "L P[2] 3600000msec FINE"], [("moving", "v", 1.0)]),
        (["J P[1] 10% FINE", "!WAIT 3600.00(sec)", "//WAIT 3600.00(sec)", "J P[2] 1sec FINE"], []),
        (["J P[1] 10% FINE", "//L P[2] 3600.0sec FINE", "J P[2] 1sec FINE"], []),
    ],
)  # fmt: skip
def test_the_arm_warms_while_the_program_runs(moves, duties, hot):
    """From cold: the second position is corrected for the warmth of its own moment."""
    q = (-20.0, 30.0, -25.0, 40.0, -70.0, 10.0)
    data = program(moves, [at(1, HOME), at(2, q)])
    result = corrected(data, hot, before=())
    feed = float(np.linalg.norm(arm.flange(HOME)[:3, 3] - arm.flange(q)[:3, 3])) / 3600
    rise = naive_heat.rises([(s, feed if f == "v" else f, h) for s, f, h in duties])
    lengths = naive_heat.warm_lengths(rise)
    if duties:
        assert missed_um(data, data, 2, q, lengths=lengths) > 1.9
    assert missed_um(data, result.text, 2, q, lengths=lengths) < ROUNDED_UM


@pytest.mark.parametrize(("moves", "hours"), [([], 0.0), (["WAIT 14400.00(sec)"], 4.0)])
@pytest.mark.parametrize("starts", [{}, {"ensemble": Ensemble((0.0, 1e-3))}])
def test_the_arm_is_as_much_warmer_as_the_air(moves, hours, starts, hot):
    """In balance with it before, and while it works: by the nodes' law, a room of 30 degC is 10 K on every node."""
    q = (-20.0, 30.0, -25.0, 40.0, -70.0, 10.0)
    data = program(["J P[1] 10% FINE", *moves, "J P[2] 1sec FINE"], [at(1, HOME), at(2, q)])
    result = corrected(data, hot, before=("moving 200mm/s 5h",), air=10.0, **starts)
    rise = naive_heat.rises([("moving", 200, 5.0), ("idle", 0, hours)])
    lengths = naive_heat.warm_lengths({node: value + 10 for node, value in rise.items()})
    assert missed_um(data, data, 2, q, lengths=lengths) > 100
    assert missed_um(data, result.text, 2, q, lengths=lengths) < ROUNDED_UM
    end = np.flatnonzero(result.execution.station == 1)[-1]  # the twin, which judges it
    assert result.execution.rise[end] == pytest.approx([rise[n] + 10 for n in hot.heat.names], abs=0.02)
    assert result.band.largest > 1.3 * corrected(data, hot, before=("moving 200mm/s 5h",), **starts).band.largest


def test_a_file_says_how_warm_the_air_is(tmp_path):
    day, idle = tmp_path / "day.toml", Duty("idle", 0.0, 3600.0)

    def loaded(text):
        day.write_text(text)
        return load_before(("idle 1h", str(day)))

    assert loaded("[ambient]\nvalue_degC = 27\nreference_degC = 22\n") == ((idle,), 5.0, 22.0)
    assert loaded('[[before]]\nstate = "off"\nduration_h = 1\n') == ((idle, Duty("off", 0.0, 3600.0)), None, None)
    assert loaded("[ambient]\nclock_h = 7\n") == ((idle,), None, None)  # nobody says: 20, or as a state has it
    with pytest.raises(InputError, match=r"day\.toml: ambient\.kind: a program that exists takes air that stays"):
        loaded('[ambient]\nkind = "wave"\namplitude_K = 3\n')
    for key in ("shift", "start", "log", "state", "cycle", "befor", "Ambient"):
        with pytest.raises(InputError, match=rf"day\.toml: {key}: here \[\[before\]\] and \[ambient\] count alone"):
            loaded(f"[{key}]\n")
    with pytest.raises(InputError, match=r"day\.toml: ambient\.value_degc: unknown key"):
        loaded("[ambient]\nvalue_degc = 27\n")


@pytest.mark.parametrize(
    ("speed", "seconds"),
    [("50mm/sec", 10.0), ("300cm/min", 10.0), ("118.1inch/min", 10.002), ("5sec", 5.0), ("5000msec", 5.0),
     ("R[1]mm/sec", 5.0)],
)  # fmt: skip
def test_a_line_takes_its_length_over_its_speed(speed, seconds, hot):
    """500 mm between stops; ramps add some tenths."""
    q = arm.joints_at(arm.frame(0, -500, 0, 0, 0, 0) @ arm.flange(HOME), HOME)
    data = program(["J P[1] 10% FINE", f"L P[2] {speed} FINE", f"L P[1] {speed} CNT100"], [at(1, HOME), at(2, q)])
    result = corrected(data, hot)
    out, back = result.plan.stations.time[1:] - result.plan.stations.time[:-1]
    assert seconds - 1e-3 <= out < seconds + 1.5
    assert back <= out
    assert any(f.code == "timing.assumed" for f in result.findings) == ("R[" in speed)


@pytest.mark.parametrize(
    ("words", "twice"),
    [
        ("moving 200mm/s 5h 30min", "30min says duration"),
        ("moving 200mm/s 5h, idle 30min", "idle says state"),
        ("moving 200mm/s 100mm/s 5h", "100mm/s says feed"),
        ("moving feed_mm_s=200 5h duration_h=1", "duration_h=1 says duration"),
    ],
)
def test_what_went_before_says_each_thing_once(words, twice):
    """The last one counted: half an hour, or standing, where five hours of work were said."""
    with pytest.raises(InputError, match=f"{twice} a second time; give each stretch its own --before"):
        load_before([words])


@pytest.mark.parametrize(
    ("words", "why"),
    [("5h", "moving, idle or off?"), ("duration_h=5", "moving, idle or off?"), ("idle 200mm/s 5h", "idle has no feed"),
     ("200mm/s 5h off", "off has no feed")],
)  # fmt: skip
def test_what_went_before_says_whether_the_arm_moved(words, why):
    """It counted as standing: 3.3 um before the correction where five hours of work were 66."""
    with pytest.raises(InputError, match=why.replace("?", "[?]")):
        load_before([words])
    assert load_before(["200mm/s 5h"]).duties == (Duty("moving", 0.2, 5 * 3600.0, 1.0),)
    assert load_before(["idle 5h"]).duties == (Duty("idle", 0.0, 5 * 3600.0, 1.0),)


@pytest.mark.parametrize(
    ("statement", "open_time"),
    [
        ("OVERRIDE=30%", True),
        ("OVERRIDE=R[6:SPEED]", True),
        ("OVERRIDE=100%", False),
        ("LINEAR_MAX_SPEED=20", True),
        ("JOINT_MAX_SPEED[1]=5", True),
        ("WAIT DI[1]=ON", True),
        ("WAIT R[3]", True),
        ("PAUSE", True),
        ("WAIT    .50(sec)", False),
        ("WAIT   5.00(sec)", False),
        ("TIMER[1]=START", False),
    ],
)
def test_what_lasts_as_run_time_decides_is_said(statement, open_time, hot):
    q = arm.joints_at(arm.frame(0, -500, 0, 0, 0, 0) @ arm.flange(HOME), HOME)
    data = program(["J P[1] 10% FINE", statement, "L P[2] 50mm/sec FINE"], [at(1, HOME), at(2, q)])
    assumed = [f.message for f in corrected(data, hot).findings if f.code == "timing.assumed"]
    assert len(assumed) == open_time
    assert all(message.startswith("line 5: ") for message in assumed)


def test_what_takes_no_time_in_the_heat_is_said(hot):
    """A call may last hours, a wait for a signal too: the stations behind them are as if they did not."""
    q = arm.joints_at(arm.frame(0, -500, 0, 0, 0, 0) @ arm.flange(HOME), HOME)
    lines, positions = ["J P[1] 10% FINE", "L P[2] 50mm/sec FINE"], [at(1, HOME), at(2, q)]
    plain = corrected(program(lines, positions), hot)
    for statement, code, words in (
        ("CALL POLISH", "timing.order", "without all that POLISH may do"),
        ("WAIT DI[1]=ON", "timing.assumed", "takes no time"),
    ):
        result = corrected(program([lines[0], statement, lines[1]], positions), hot)
        assert result.plan.stations.time.tolist() == plain.plan.stations.time.tolist()
        assert [words in f.message for f in result.findings if f.code == code] == [True]


def test_a_wait_is_no_motion_that_the_thermal_parameters_were_measured_over(hot):
    """They were over 6.5 h: 5 h and a wait of two hours are less, 7 h of motion are more."""
    move = ["J P[1] 10% FINE", "WAIT 7300.00(sec)", "L P[2] 50mm/sec FINE"]
    q = arm.joints_at(arm.frame(0, -500, 0, 0, 0, 0) @ arm.flange(HOME), HOME)
    data = program(move, [at(1, HOME), at(2, q)])
    for hours, count in ((5, 0), (7, 1)):
        findings = corrected(data, hot, before=(f"moving 200mm/s {hours}h",)).findings
        assert len([f for f in findings if f.code == "thermal.box" and "of motion" in f.message]) == count


@pytest.mark.parametrize("through", [False, True])
def test_a_called_program_warms_the_arm_as_it_is_listed(through, hot):
    """By the second arm and the nodes' law: before the call it is cold, behind it as after 3.5 h at 20 mm/s."""
    q = arm.joints_at(arm.frame(0, -500, 0, 0, 0, 0) @ arm.flange(HOME), HOME)
    day = program(["R[1]=1", "CALL POLISH", "J P[1] 10% FINE"], [at(1, HOME)], name="DAY")
    lines = ["J P[1] 10% FINE", f"CALL {'DAY' if through else 'polish'}", "L P[2] 50mm/sec FINE"]
    data = program(lines, [at(1, HOME), at(2, q)])
    beside = {"POLISH": polishing("POLISH"), "DAY": day}
    result = correct(data, hot, default_frames(), (), Options(), quiet, beside.get)
    warm = naive_heat.rises([POLISHED])
    assert warm["j2"] > 2
    for number, rise in ((1, dict.fromkeys(warm, 0.0)), (2, warm)):
        assert missed_um(data, result.text, number, q, lengths=naive_heat.warm_lengths(rise)) < ROUNDED_UM
    assert not any("may do" in f.message for f in result.findings)
    assert result.residual.distance[result.judged].max() < 2e-6
    drive = result.plan.drive
    half, full = (d.joint_motion().time[d.reached[-1]] for d in (drive.at_override(0.5), drive))
    assert 1.9 < half / full < 2.1


def test_what_a_called_program_waits_and_settles_no_override_stretches(hot):
    """At half speed a called hour of waiting took two, in the heat of --average-over."""
    q = arm.joints_at(arm.frame(0, -500, 0, 0, 0, 0) @ arm.flange(HOME), HOME)
    there = ["J P[1] 10% FINE", "WAIT 3600.00(sec)", "L P[2] 50mm/sec FINE"]
    beside = {"REST": program([*there, "WAIT 60.00(sec)"], [at(1, HOME), at(2, q)], name="REST")}
    calls = ["J P[1] 10% FINE", "CALL REST", "CALL REST", "L P[2] 50mm/sec FINE"]
    data = program(calls, [at(1, HOME), at(2, q)])
    drive = correct(data, hot, default_frames(), (), Options(), quiet, beside.get).plan.drive
    half, full = (d.joint_motion().time[-1] for d in (drive.at_override(0.5), drive))
    assert full == pytest.approx(2 * 3660 + 3 * (10 + 0.424), abs=0.1)
    assert half == pytest.approx(full + 3 * 10, abs=0.1)


@pytest.mark.parametrize(
    "does",
    [
        ("WAIT 7200.00(sec)",),
        ("CALL PAUSE",),
        ("J P[1] 10% FINE", "WAIT 7200.00(sec)"),
        ("J P[1] 10% FINE", "CALL PAUSE"),
    ],
)
def test_a_called_program_waits_as_it_is_listed(does, hot):
    """Whether or not it moves the arm, and behind its last motion: the arm cools by the nodes' law."""
    q = arm.joints_at(arm.frame(0, -500, 0, 0, 0, 0) @ arm.flange(HOME), HOME)
    data = program(["J P[1] 10% FINE", "CALL REST", "L P[2] 50mm/sec FINE"], [at(1, HOME), at(2, q)])
    rest, pause = program(does, [at(1, HOME)], name="REST"), program(["WAIT 7200.00(sec)"], [], name="PAUSE")
    before = load_before(["moving 200mm/s 6h"]).duties
    result = correct(data, hot, default_frames(), before, Options(), quiet, {"REST": rest, "PAUSE": pause}.get)
    cooled = naive_heat.rises([("moving", 200.0, 6.0), ("idle", 0.0, 2.0)])
    assert naive_heat.WARM["j3"] - cooled["j3"] > 2
    assert missed_um(data, result.text, 2, q, lengths=naive_heat.warm_lengths(cooled)) < ROUNDED_UM


@pytest.mark.parametrize("stands", ["WAIT 7200.00(sec)", "CALL PAUSE"])
@pytest.mark.parametrize("waits_first", [True, False])
def test_a_wait_behind_a_call_cools_what_the_called_program_warmed(waits_first, stands, hot):
    """By the second arm and the nodes' law: warmed for 3.5 h and then idle for 2 h is not idle and then warmed."""
    q = arm.joints_at(arm.frame(0, -500, 0, 0, 0, 0) @ arm.flange(HOME), HOME)
    between = [stands, "CALL POLISH"] if waits_first else ["CALL POLISH", stands]
    data = program(["J P[1] 10% FINE", *between, "L P[2] 50mm/sec FINE"], [at(1, HOME), at(2, q)])
    beside = {"POLISH": polishing("POLISH"), "PAUSE": program(["WAIT 7200.00(sec)"], [], name="PAUSE")}
    result = correct(data, hot, default_frames(), (), Options(), quiet, beside.get)
    duties = [("idle", 0.0, 2.0), POLISHED] if waits_first else [POLISHED, ("idle", 0.0, 2.0)]
    assert missed_um(data, result.text, 2, q, lengths=naive_heat.warm_lengths(naive_heat.rises(duties))) < ROUNDED_UM


@pytest.mark.parametrize("stands", ["WAIT 7200.00(sec)", "CALL PAUSE"])
def test_a_place_at_which_the_arm_stands_is_judged_as_it_leaves_too(stands, hot):
    """By the second arm and the nodes' law: the position is right as the arm comes, and two hours cooler it is not."""
    q = arm.joints_at(arm.frame(0, -500, 0, 0, 0, 0) @ arm.flange(HOME), HOME)
    data = program(["J P[2] 10% FINE", stands, "L P[1] 50mm/sec FINE"], [at(1, HOME), at(2, q)])
    pause = program(["WAIT 7200.00(sec)"], [], name="PAUSE")
    before = load_before(["moving 200mm/s 6h"]).duties
    result = correct(data, hot, default_frames(), before, Options(bound=20e-6), quiet, {"PAUSE": pause}.get)
    (beyond,) = (f.message for f in result.findings if f.code == "bounds.max")
    assert "line 6, as it sets off after standing: 23.5" in beyond
    cooled = naive_heat.rises([("moving", 200.0, 6.0), ("idle", 0.0, 2.0)])
    leaves = missed_um(data, result.text, 2, q, lengths=naive_heat.warm_lengths(cooled))
    assert leaves > 10
    assert 1e6 * result.residual.distance[result.judged].max() == pytest.approx(leaves, abs=0.3)


@pytest.mark.parametrize("does", ["J P[1] 10% FINE", "R[1]=1"])
@pytest.mark.parametrize("untold", ["WAIT R[2]", "WAIT DI[1]=ON", "CALL PAUSE"])
def test_a_called_program_whose_times_only_run_time_knows_is_named(does, untold, hot):
    """Of its waits for signals, and of speeds in registers, nothing was said."""
    q = arm.joints_at(arm.frame(0, -500, 0, 0, 0, 0) @ arm.flange(HOME), HOME)
    pause = program(["WAIT DI[1]=ON"], [], name="PAUSE")
    for own, words in ((), "in REST: how"), (("WAIT DI[2]=ON",), "line 5 and in REST: how"), (None, ""):
        lines = ["J P[1] 10% FINE", *(own or ()), "CALL REST", "L P[2] 50mm/sec FINE"]
        rest = program([does, "WAIT 1.00(sec)" if own is None else untold], [at(1, HOME)], name="REST")
        data = program(lines, [at(1, HOME), at(2, q)])
        result = correct(data, hot, default_frames(), (), Options(), quiet, {"REST": rest, "PAUSE": pause}.get)
        messages = [f.message for f in result.findings if f.code == "timing.assumed"]
        assert [m[: len(words)] for m in messages] == [words] * (own is not None)


@pytest.mark.parametrize("loop", [("FOR R[1]=1 TO 100", "ENDFOR"), ("LBL[1]", "IF R[1]<9,JMP LBL[1]"), ("", "")])
def test_a_called_program_that_may_repeat_what_it_does_is_named(loop, hot):
    """A hundred minutes of rest counted as one, and only the line of the call was named."""
    data = program(["J P[1] 10% FINE", "CALL DAY", "L P[1] 50mm/sec FINE"], [at(1, HOME)])
    rest = program([loop[0] or "R[1]=1", "WAIT 60.00(sec)", loop[1] or "R[1]=2"], [], name="REST")
    beside = {"REST": rest, "DAY": program(["CALL REST"], [], name="DAY")}
    result = correct(data, hot, default_frames(), (), Options(), quiet, beside.get)
    (message,) = (f.message for f in result.findings if f.code == "timing.order")
    assert message.startswith("line 5 and in REST: jumps" if loop[0] else "line 5: jumps")


@pytest.mark.parametrize(
    ("level", "call", "does"),
    [
        ("warning", "IF R[1]=1,CALL POLISH", "L P[1] 50mm/sec FINE"),
        ("warning", "FOR R[1]=1 TO 9\n  3:  CALL POLISH ;\n  4:  ENDFOR", "L P[1] 50mm/sec FINE"),
        ("warning", "CALL NOTHING\n  3:L P[1] 50mm/sec FINE TB .00sec,CALL POLISH", "L P[1] 50mm/sec FINE"),
        ("warning", "CALL POLISH", "L PR[7] 50mm/sec FINE"),
        ("warning", "CALL POLISH", "CALL T"),
        ("warning", "CALL POLISH", "CALL MORE"),
        ("warning", "CALL POLISH", "J P[1] 10% FINE\n  2:  CALL MORE"),
        ("note", "CALL POLISH", "R[1]=1"),
        ("note", "CALL POLISH", None),
    ],
)
def test_a_called_program_that_moves_the_arm_and_is_not_counted_is_warned_of(level, call, does, hot):
    """Which way is taken, or where it leads, is not told: it is known to warm the arm, and by how much is not."""
    beside = {} if does is None else {"POLISH": program([does], [at(1, HOME)], name="POLISH")}
    data = program(["J P[1] 10% FINE", call, "L P[1] 50mm/sec FINE"], [at(1, HOME)])
    beside |= {"T": data, "NOTHING": program(["R[1]=1"], [at(1, HOME)], name="NOTHING"), "MORE": polishing("MORE")}
    result = correct(data, hot, default_frames(), (), Options(), quiet, beside.get)
    (order,) = (f for f in result.findings if f.code == "timing.order")
    assert order.level == level
    assert ("without all that POLISH may do" in order.message) == (does != "R[1]=1")


def test_turning_on_the_spot_takes_seconds(hot):
    """A line of some micrometres at 250 mm/s with a turn of the wrist: joints, not length, take the time."""
    q = (*HOME[:5], HOME[5] + 120)
    data = program(["J P[1] 10% FINE", "L P[2] 250mm/sec FINE", "L P[1] 30deg/sec FINE"], [at(1, HOME), at(2, q)])
    time = corrected(data, hot).plan.stations.time
    assert 120 / 355 < time[1] - time[0] < 120 / 355 + 1.5
    assert 4 - 1e-3 < time[2] - time[1] < 5.5


def test_a_joint_motion_takes_the_slowest_joint_at_its_percent(hot):
    q = (HOME[0] + 87.5, *HOME[1:])
    data = program(["J P[1] 10% FINE", "J P[2] 25% FINE"], [joint_form(1, HOME), joint_form(2, q)])
    time = corrected(data, hot).plan.stations.time
    assert 2.0 <= time[1] - time[0] < 3.5  # 87.5 deg at a quarter of 175 deg/s


def test_times_do_not_depend_on_what_is_not_driven(hot):
    a = program(["J P[1] 10% FINE", "J P[2] 10% FINE"], [at(1, HOME), at(2, (0, 0, 0, 0, -60, 0))])
    b = program(
        ["J P[1] 10% FINE", "//J P[3] 1% FINE", "!L P[3] 1mm/sec FINE", "J P[2] 10% FINE"],
        [at(1, HOME), at(2, (0, 0, 0, 0, -60, 0)), at(3, (90, 0, 0, 0, -60, 0))],
    )
    assert np.array_equal(corrected(a, hot).plan.stations.time, corrected(b, hot).plan.stations.time)
    assert corrected(b, hot).changed == 2


# The proof ---------------------------------------------------------------------------------------------------------


def test_the_twin_says_what_the_second_arm_says(hot):
    data = program(["J P[1] 10% FINE", "L P[2] 100mm/sec FINE"], [at(1, HOME), at(2, (15, 25, -20, 25, -55, 40))])
    result = corrected(data, hot)
    ends = result.execution.fraction == 1
    for k, n, guess in zip(np.flatnonzero(ends), (1, 2), (HOME, (15, 25, -20, 25, -55, 40)), strict=True):
        assert result.error.distance[k] * 1e6 == pytest.approx(missed_um(data, data, n, guess), abs=0.1)
        assert result.residual.distance[k] * 1e6 == pytest.approx(missed_um(data, result.text, n, guess), abs=0.1)
    assert result.judged.all()


def test_a_bound_that_is_not_kept_is_outside(hot):
    data = program(["J P[1] 10% FINE"], [at(1, HOME, form="{:.1f}")])
    assert corrected(data, hot, bound=1e-3).verdict is Verdict.INSIDE
    assert corrected(data, hot).verdict is Verdict.NO_BOUNDS
    result = corrected(data, hot, bound=5e-6)
    assert result.verdict is Verdict.OUTSIDE
    assert not result.is_usable
    assert "--max-um" in next(f.message for f in result.findings if f.level is Level.OUTSIDE)


def test_a_planned_program_agrees_with_generate():
    """generate's planned program, corrected in place, is generate's corrected program."""
    for name in ("circle_1300", "line_x"):
        job = load_job(str(ROOT / "paths" / f"{name}.toml"))
        before, done = generate.generate(job, quiet)
        planned = compose(planned_program(job, before.path, before.theta, before.trajectory))
        cell = load_cell(str(ROOT / "robots" / "m710ic50.toml"))
        result = correct(
            planned, cell, Frames({0: STILL}, {0: STILL, 1: job.tool.pose}), job.history.before, Options(), quiet
        )
        written, expected = (naive_ls.read(t)[0] for t in (result.text, done.text))
        assert set(written) == set(expected)
        places, meant = (
            np.array([[p[n].groups[1].axes[a] for a in "XYZ"] for n in written], float) for p in (written, expected)
        )
        assert np.linalg.norm(places - meant, axis=1).max() < 2e-3  # mm: both round to 0.001
        assert result.changed == len(written)
        assert all(written[n].groups[1].config == expected[n].groups[1].config for n in written)
        assert result.residual.distance[result.judged].max() < 3e-6


@pytest.mark.parametrize(
    ("old", "value", "extra_units", "new"),
    [
        (b"180.000", 180.0012, 0, b"-179.999"),
        (b"-180.000", -180.0012, 0, b"179.999"),
        (b"180.000", 180.0, 1, b"-179.999"),
        (b"-179.9999", -180.00015, 0, b"179.9998"),
        (b"200.000", 200.5, 0, b"200.500"),  # written beyond 180 by whoever wrote it
        (b"180.000", -180.0, 0, b"180.000"),  # the same turn: its text stays
        (b"+.500", 0.25, 0, b"+.250"),
        (b"-.500", 0.0001, 0, b"0.000"),
        (b"7.", 8.4, 0, b"8."),
        (b"7", -0.4, 0, b"0"),
        (b"-.000", -0.0004, 0, b"-.000"),
    ],
)
def test_a_number_is_written_as_the_program_writes_its_own(old, value, extra_units, new):
    omit_zero, is_angle = old.lstrip(b"+-")[:1] == b".", abs(value) > 100
    assert format_like(old, value, omit_zero=omit_zero, is_angle=is_angle, extra_units=extra_units) == new
