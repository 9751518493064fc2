"""The judge of tests/campaigns/cam_judge.py: programs that are right by hand, and ones with a planted error."""

import cam_draws
import cam_judge
import naive_cam
import naive_way
import numpy as np
import pytest
from ls_text import cartesian, program
from numpy.testing import assert_allclose

#: Stands where every drawn way is reached; nothing was driven before, so that the arm is cold.
KEYS = {
    "frame": {"x_mm": 1100.0, "y_mm": -60.0, "z_mm": 150.0, "w_deg": 1.0, "r_deg": 35.0},
    "process": {"feed_mm_s": 100.0, "lift_mm": 5.0, "chord_um": 1.5},
    "tool": {"z_mm": 80.0},
}
TRIANGLE = "G21 G90 G17\nG0 X0 Y0 Z10\nG1 Z0 F3000\nG1 X100 Y0\nG1 X0 Y60\nG1 X0 Y0\nG0 Z10\nM30\nG1 X250 Y-90 Z-40\n"
ARCS = "G1 X0 Y0 Z0 F3000\nG2 X10 Y10 I10 J0\nG3 X15 Y15 R5\nG1 X30\nG2 I-4 J-3\nM2\n"


def keys_of(pattern, **path):
    return KEYS | {"path": {"pattern": pattern, "file": "part", "tolerance_um": 2.0} | path}


def driven(read, keys, change=lambda place, speed: (place, speed)):
    """A program by hand: exactly along the lines and arcs, the tool against the normal."""
    lift = keys["process"]["lift_mm"]
    ways = [np.round(naive_way.cut(m), 6) for m in read.moves]
    place = np.vstack([ways[0][:1], *(w[1:] for w in ways)])
    speed = [
        0.0,
        *(m.feed or keys["process"]["feed_mm_s"] for m, w in zip(read.moves, ways, strict=True) for _ in w[1:]),
    ]
    place = np.vstack([place[0] + [0, 0, lift], place, place[-1] + [0, 0, lift]])
    speed = [0.0, 10.0, *speed[1:], 10.0]
    place, speed = change(place, speed)
    place = place + [keys["path"].get(k, 0.0) for k in ("x_mm", "y_mm", "z_mm")]
    points = [cartesian(n, [*p, 180, 0, 0], uf=1, ut=1) for n, p in enumerate(place, 1)]
    moves = [f"L P[{n}] {v:.3f}mm/sec CNT100" for n, v in enumerate(speed, 1)]
    text = program(["J P[1] 10% FINE", *moves[1:]], points)
    return cam_judge.contradiction(cam_judge.wanted(read, keys, 0.0), cam_judge.flown([text], keys))


@pytest.mark.parametrize("seed", range(40))
def test_a_program_that_is_right_is_not_contradicted(seed):
    case = cam_draws.drawn(seed)
    try:
        read = naive_cam.READERS[case.pattern](case.text)
    except naive_cam.Unreadable:
        return
    if sum(len(naive_way.cut(m)) for m in read.moves) > 1200 or read.moves[0].normal not in (None, (0, 0, 1)):
        return
    keys = keys_of(case.pattern) | {"path": case.keys["path"]}
    share, why = driven(read, keys)
    assert (share < 1, why) == (True, "")


def test_only_the_formats_rounding_is_off_a_right_program():
    read = naive_cam.gcode(TRIANGLE)
    assert driven(read, keys_of("gcode", x_mm=12.0, z_mm=-7.0))[0] < 0.2


def along(place, a, b):
    """Rows between two places of the triangle's first side, as a mask."""
    return (place[:, 2] < 1e-6) & (place[:, 1] == 0) & (place[:, 0] > a) & (place[:, 0] < b)


def aside(place, speed):
    place[along(place, 40, 60), 1] += 0.03
    return place, speed


def deeper(place, speed):
    place[along(place, 40, 60), 2] -= 0.03
    return place, speed


def one_place(place, speed):
    place[np.flatnonzero(along(place, 40, 60))[0], 1] -= 0.03
    return place, speed


def cut_corner(place, speed):
    corner = np.flatnonzero((place == [100, 0, 0]).all(axis=1))[0]
    return np.delete(place, corner, axis=0), np.delete(speed, corner)


def twice(place, speed):
    k = np.flatnonzero((place == [0, 0, 10]).all(axis=1))[-1]
    return np.vstack([place[:k], place[2:]]), [*speed[:k], *speed[2:]]


def backward(place, speed):
    inside = slice(2, -2)
    place[inside] = place[inside][::-1].copy()
    return place, speed


def behind_the_end(place, speed):
    return np.vstack([place, [250, -90, -40]]), [*speed, 50.0]


def low_over_the_air(place, speed):
    place[-2, 2] -= 10.1
    return place, speed


def faster(place, speed):
    return place, [v * 1.05 for v in speed]


def all_shifted(place, speed):
    return place - np.array([0, 0, 0.03]), speed


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (aside, "leaves the lines"), (deeper, "leaves the lines"), (one_place, "leaves the lines"),
        (cut_corner, "leaves the lines"), (twice, "leaves the lines"), (backward, "leaves"),
        (behind_the_end, "leaves the lines"), (low_over_the_air, "leaves the lines"), (faster, "faster than the feed"),
        (all_shifted, "leaves the lines"),
    ],
)  # fmt: skip
def test_a_planted_error_is_seen(change, words):
    """30 um aside or deeper, a corner cut or left out, a side driven twice or backward, words behind M30."""
    share, why = driven(naive_cam.gcode(TRIANGLE), keys_of("gcode"), change)
    assert words in why
    assert share > 1 or change is faster


def test_a_spike_that_is_left_out_is_seen():
    """Every place of the tool is on the user's lines, and one of the user's places is not passed."""
    spike, short = (naive_cam.gcode(f"G1 X0 Y0 Z0\nX50\n{out}Y30\nM2") for out in ("X100\nX50\n", ""))
    want = cam_judge.wanted(spike, keys_of("gcode"), 0.0)
    why = cam_judge.contradiction(want, flown_of(short, keys_of("gcode")))[1]
    assert "a place is not passed: 50000.0 um" in why


def test_a_rapid_may_leave_its_line_but_not_downward():
    def higher(place, speed):
        place[-2] += [0.5, 0, 0.5]
        return place, speed

    assert driven(naive_cam.gcode(TRIANGLE), keys_of("gcode"), higher)[1] == ""


@pytest.mark.parametrize(("word", "other"), [("G2 X10", "G3 X10"), ("G3 X15", "G2 X15"), ("G2 I-4", "G3 I-4")])
def test_an_arc_turned_the_wrong_way_is_seen(word, other):
    keys = keys_of("gcode")
    wrong = naive_cam.gcode(ARCS.replace(word, other))
    assert driven(wrong, keys)[1] == ""

    want = cam_judge.wanted(naive_cam.gcode(ARCS), keys, 0.0)
    share, why = cam_judge.contradiction(want, flown_of(wrong, keys))
    assert "leaves the lines" in why
    assert share > 5


def flown_of(read, keys):
    place = np.vstack([naive_way.cut(m) for m in read.moves])
    pose = np.tile(np.eye(4), (len(place), 1, 1))
    pose[:, :3, 3] = place
    return cam_judge.Flown(pose, np.zeros(len(place) - 1, dtype=int), np.array([1.0]))


def test_a_tool_that_stands_otherwise_is_seen():
    text = "GOTO/0,0,0,0,{0},{1}\nGOTO/50,0,0,0,{0},{1}\nFINI"
    upright, tilted = (naive_cam.apt(text.format(np.sin(a), np.cos(a))) for a in (0.0, 1e-3))
    keys = keys_of("apt")
    drive = flown_of(upright, keys)
    drive.pose[:, :3, :3] = np.diag([1, -1, -1])
    assert cam_judge.contradiction(
        cam_judge.wanted(tilted, keys | {"process": {**KEYS["process"], "lift_mm": 0}}, 0.0), drive
    )[1]


def test_circular_motions_are_driven_on_their_circle():
    a, b, c = np.array([10.0, 0, 0]), np.array([0, 10.0, 0]), np.array([0, -10.0, 0])
    for share in (0.0, 1 / 3, 0.5, 1.0):
        turn = 1.5 * np.pi * share
        assert_allclose(cam_judge.on_circle(a, b, c, share), [10 * np.cos(turn), 10 * np.sin(turn), 0], atol=1e-9)
    assert_allclose(
        cam_judge.on_circle(a, c, b, 0.5), [10 * np.cos(0.75 * np.pi), -10 * np.sin(0.75 * np.pi), 0], atol=1e-9
    )


def test_a_curve_through_points_may_be_as_round_as_they_are_and_no_rounder():
    t = np.linspace(0, 1, 20)
    circle = np.column_stack([50 * np.cos(t), 50 * np.sin(t), 0 * t])
    sagitta = 50 * (1 - np.cos(t[1] / 2))
    out = cam_judge.explained_mm(circle) - cam_judge.BULGE_UM / 1000
    assert_allclose(out[1:-1], 1.5 * sagitta, rtol=1e-3)
    square = np.array([[0, 0, 0], [100, 0, 0], [100, 100, 0.0]])
    assert_allclose(cam_judge.explained_mm(square), cam_judge.BULGE_UM / 1000)


@pytest.mark.parametrize("seed", [1, 6, 7, 9, 13, 19, 27, 30, 45, 58, 64, 90])
def test_a_drawn_way_30_um_too_low_is_seen(seed):
    case = cam_draws.drawn(seed)
    read = naive_cam.READERS[case.pattern](case.text)
    read.moves = read.moves[:40]

    def lower(place, speed):
        place[3:-3, 2] -= 0.03
        return place, speed

    share, why = driven(read, keys_of(case.pattern), lower)
    assert share > 4, why
