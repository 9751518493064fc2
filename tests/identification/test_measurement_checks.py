"""How many numbers are enough, what is a copy, and which reading of the joints is named: counted by hand."""

import re
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from synthetic import random_theta

from compgen.core.arrays import norm
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.rotations import rotation_matrix, rotation_vector, to_wpr
from compgen.core.units import DEG
from compgen.identification.fit import Fit, fit
from compgen.identification.instrument_frames import InstrumentFrames, with_orientations
from compgen.identification.measured_turns import check_fitted_turns, refuse_turned, wild_turns
from compgen.identification.measurement_checks import (
    better_reading,
    check_copies,
    check_plausible,
    check_row_count,
    check_scale,
)
from compgen.identification.measurements import DISTANCE, NONE, PLACE, TOUCH, WORLD, FixedPlaces, blank_rows
from compgen.identification.model import active_in_groups, build_model
from compgen.identification.parameters import candidate_models, symbolic_sources
from compgen.identification.validation import validate
from compgen.pipelines.files.robot_file import load_arm
from compgen.robot.inverse_kinematics import Posture, solve_tool
from compgen.robot.kinematics import flange_pose


def rows(places, *, distances=0, instruments=1, reflectors=2, oriented=0, names=(), known=0, lengths=0):
    """Places that instruments measured, then distances; of fixed places the first few known, with lengths between."""
    N = places + distances
    data = blank_rows(np.zeros((N, 6)), np.arange(N), [f"m.csv: line {n + 2}" for n in range(N)], 0)
    fixed = np.full((len(names), 3), np.nan)
    fixed[:known] = 0.5
    rotation = np.full((N, 3, 3), np.nan)
    rotation[:oriented] = np.eye(3)
    return replace(
        data,
        position=np.where(np.arange(N)[:, None] < places, 1.0, np.nan) * np.ones(3),
        ends=replace(
            data.ends,
            distance=np.where(np.arange(N) < places, np.nan, 0.3),
            kind=np.where(np.arange(N) < places, 0, TOUCH),
        ),
        rotation=rotation,
        reflectors=tuple("abcdef"[:reflectors]),
        instruments=tuple("uvw"[:instruments]),
        fixed=FixedPlaces(
            names=names,
            frame=np.zeros(len(names), dtype=int),
            place=fixed,
            sigma=np.zeros(len(names)),
            between=np.zeros((lengths, 2), dtype=int),
            length=np.full(lengths, 0.2),
            length_sigma=np.zeros(lengths),
        ),
        aligned=np.zeros(instruments, dtype=bool),
    )


@pytest.mark.parametrize(
    ("few", "unknowns", "missing"),
    [
        (dict(places=4), 12, 1),  # a frame of six, two reflectors of three each: 4 x 3 numbers just make it
        (dict(places=3), 12, 2),
        (dict(places=1), 12, 4),
        (dict(places=6, instruments=2), 18, 1),
        (dict(places=5, reflectors=3), 15, 1),
        (dict(places=2, oriented=2), 12, 1),  # a row with its orientation is worth two
        (dict(places=6, names=("s", "t"), known=0), 18, 1),
        (dict(places=5, names=("s", "t"), known=1), 15, 1),
        (dict(places=5, distances=2, names=("s", "t"), lengths=1), 17, 1),
        (dict(places=0, distances=12), 12, 1),
        (dict(places=0, distances=5, instruments=0, reflectors=3), 9, 5),
    ],
)
def test_numbers_must_be_more_than_frames_reflectors_and_places_have_unknowns(few, unknowns, missing):
    with pytest.raises(InputError, match=f"the {unknowns} unknowns") as caught:
        check_row_count(rows(**few))
    assert f"measure {missing} or more rows more" in str(caught.value)
    assert f"{3 * few['places'] + 3 * few.get('oriented', 0) + few.get('distances', 0)} measured numbers" in str(
        caught.value
    )
    kind = "places" if few["places"] else "distances"
    check_row_count(rows(**few | {kind: few[kind] + missing}))
    open_places = len(few.get("names", ())) - few.get("known", 0)
    assert (f", {open_places} fixed place(s)" in str(caught.value)) == (open_places > 0)


def test_touches_alone_tell_no_scale_without_a_certificate():
    touches = rows(0, distances=20, names=("s",))
    with pytest.raises(InputError, match=r"^m.csv: no row tells the scale"):
        check_scale(touches)
    check_scale(replace(touches, fixed=replace(touches.fixed, certified=True)))
    check_scale(rows(1, distances=20, names=("s",)))


def measured_again(same, others):
    """Ten places; then some of them again to the last digit, and others again a little off."""
    once = rows(10)
    first = np.arange(10.0)[:, None] * np.ones(3)
    again = first[: same + others] + np.where(np.arange(same + others) < same, 0.0, 1e-5)[:, None]
    N = 10 + same + others
    data = rows(N)
    pose = np.concatenate([np.arange(10), np.arange(same + others)])
    theta = np.tile(np.arange(10.0)[:, None], 6)[pose]
    assert len(once.pose) == 10
    return replace(data, theta=theta, position=np.concatenate([first, again]))


@pytest.mark.parametrize(
    ("same", "others", "refused"),
    [(3, 0, True), (2, 0, False), (3, 2, True), (3, 3, False), (4, 3, True), (0, 5, False)],
)
def test_three_copies_and_more_than_half_of_what_was_measured_again_are_refused(same, others, refused):
    data = measured_again(same, others)
    if refused:
        with pytest.raises(
            InputError, match=f"m.csv: line 12: the joints and the place of m.csv: line 2 .*{same} rows"
        ):
            check_copies(data)
    else:
        check_copies(data)
    check_copies(replace(data, aligned=np.ones(1, dtype=bool)))  # places on an axis test's line
    check_copies(replace(data, reflector=np.arange(len(data.pose))))  # of other reflectors
    if refused:
        with pytest.raises(InputError, match="a copy is no second measurement"):
            check_copies(replace(data, instrument=np.full(len(data.pose), WORLD)))


def distances_again(values):
    """Six distances of ballbars, of another end each, and then four of them with other values in metres."""
    N = 6 + len(values)
    data = rows(0, distances=N, instruments=0)
    pose = np.concatenate([np.arange(6), np.arange(len(values))])
    other = np.where(pose % 2 == 0, NONE, (pose + 1) % 6)  # a socket, or a second reflector
    ends = replace(
        data.ends,
        kind=np.full(N, DISTANCE),
        pose=other,
        place=np.where(other == NONE, 0, NONE),
        distance=np.concatenate([np.full(6, 0.3), values]),
    )
    return replace(data, theta=np.tile(np.arange(float(N))[:, None], 6), pose=pose, ends=ends)


def touches_again(values, normal=(0.0, 0.0, 1.0), sphere=0):
    """Six touches along z that pushed the ball back by nothing, and then four of them along a direction."""
    N = 6 + len(values)
    data = rows(0, distances=N, names=("s", "t"))
    pose = np.concatenate([np.arange(6), np.arange(len(values))])
    toward = np.concatenate([np.tile((0.0, 0.0, 1.0), (6, 1)), np.tile(normal, (len(values), 1))])
    shift = -np.concatenate([np.zeros(6), values])[:, None] * toward
    ends = replace(data.ends, place=np.where(np.arange(N) < 6, 0, sphere), toward=toward, shift=shift)
    return replace(data, theta=np.tile(np.arange(float(N))[:, None], 6), pose=pose, ends=ends)


@pytest.mark.parametrize(
    ("copied", "honest", "words"),
    [
        (distances_again(np.full(4, 0.3)), distances_again(0.3 + 1e-6 * np.arange(1, 5)), "the ends and the distance"),
        (
            touches_again(np.zeros(4)),
            touches_again(1e-6 * np.arange(1, 5)),
            "the joints, target, direction and value",
        ),
    ],
)
def test_a_copied_distance_or_touch_is_no_second_one_and_another_value_is(copied, honest, words):
    with pytest.raises(InputError, match=f"m.csv: line 8: {words} of m.csv: line 2 .* 4 rows: a copy is no second"):
        check_copies(copied)
    check_copies(honest)


def test_touches_of_another_sphere_or_side_are_no_copies():
    check_copies(touches_again(np.zeros(4), normal=(1.0, 0.0, 0.0)))
    check_copies(touches_again(np.zeros(4), sphere=1))
    N, centred = 10, touches_again(np.zeros(4))  # centres that were located: the joints are what was measured
    ends = replace(centred.ends, toward=np.full((N, 3), np.nan), distance=np.full(N, np.nan), shift=np.zeros((N, 3)))
    with pytest.raises(InputError, match="a copy is no second"):
        check_copies(replace(centred, ends=ends))
    theta = np.random.default_rng(1).normal(size=(N, 6))
    check_copies(replace(centred, ends=ends, theta=theta, pose=np.arange(N)))


def readings_of(right, pendant, scale=1.0):
    """Distances [m] of a row for each pose, as far as its angles are from the right ones [m/rad]."""
    return lambda angles: scale * np.abs(angles - right(pendant)).sum(axis=1)


PENDANT = np.random.default_rng(2).uniform(-2, 2, (40, 6))


def turned(k, degrees):
    return lambda p: p + degrees * DEG * np.eye(6)[k]


def signed(*joints):
    return lambda p: p * np.where(np.isin(np.arange(6), joints), -1, 1)


def exchanged(i, j):
    order = list(range(6))
    order[i], order[j] = j, i
    return lambda p: p[:, order]


def coupled(sign):
    return lambda p: p + sign * p[:, [1]] * np.eye(6)[2]


LINK = "J3 fits the convention of the angle against link 2 (theta_3 = J3), not of the horizontal"
OTHER_WAY = "J3 fits the convention of the horizontal with J2 of the opposite sign (theta_3 = J3 - J2)"
HORIZONTAL = "J3 fits the pendant's convention of the horizontal (theta_3 = J2 + J3)"
TURNS = [(0, -90), (5, 90), (3, 180)]
PAIRS = [(0, 1), (1, 2), (3, 4), (4, 5), (3, 5)]


def sign_of_theta_2(pendant):
    """Where J3 counts against the horizontal, and keeps its own sign."""
    return signed(1)(pendant) + 2 * pendant[:, [1]] * np.eye(6)[2]


@pytest.mark.parametrize(
    ("right", "coupling", "words"),
    [
        *((signed(k), 0, f"J{k + 1} fits with the opposite sign") for k in range(6)),
        *((turned(k, d), 1, f"J{k + 1} fits with its zero turned by {d:+d} deg") for k, d in TURNS),
        *((exchanged(i, j), 1, f"J{i + 1} and J{j + 1} fit exchanged") for i, j in PAIRS),
        (coupled(-1), 1, LINK),
        (coupled(1), -1, LINK),
        (coupled(-1), 0, OTHER_WAY),
        (coupled(-2), 1, OTHER_WAY),
        (coupled(1), 0, HORIZONTAL),
        (coupled(2), -1, HORIZONTAL),
        (coupled(1), 1, f"{HORIZONTAL}, which the robot file has already"),
        (coupled(-1), -1, f"{OTHER_WAY}, which the robot file has already"),
        (sign_of_theta_2, 1, "J2 fits with the opposite sign, and J3 as it is against the horizontal"),
        (
            lambda p: turned(5, 90)(signed(0)(p)),
            0,
            "J1 fits with the opposite sign; J6 fits with its zero turned by +90 deg",
        ),
    ],
)
def test_the_reading_that_explains_the_places_is_named(right, coupling, words):
    distance_of = readings_of(right, PENDANT)
    as_given = float(np.sort(distance_of(PENDANT))[:38].mean())
    found = better_reading(PENDANT, distance_of, as_given, coupling)
    assert found is not None
    assert found[0] == words
    assert found[1] == pytest.approx(0.0, abs=1e-12)


def test_a_reading_is_named_from_five_times_nearer_on_and_by_all_but_a_twentieth_of_the_rows():
    right = signed(2)
    for far, named in ((5.2, True), (4.8, False)):
        left = 0.05 / far  # what no reading explains, where the columns as they stand are 50 mm off

        def distance_of(angles, left=left):
            away = np.abs(angles - right(PENDANT)).max(axis=1) > 1e-9
            distance = np.where(away.any(), 0.05, left) * np.ones(40)
            distance[:2] = 9.0  # of forty rows, two that were misread
            return distance

        found = better_reading(PENDANT, distance_of, 0.05, 0)
        assert (found is not None) == named
        if found is not None:
            assert found[0] == "J3 fits with the opposite sign"
            assert found[1] == pytest.approx(left)


def weighed(right, weights):
    """Distances [m] by how far each joint is from the right one, each with its lever [m/rad]."""
    return lambda angles: np.abs(angles - right(PENDANT)) @ np.array(weights)


J1_TURNED, J2_TURNED = "J1 fits with its zero turned by +180 deg", "J2 fits with its zero turned by +90 deg"


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (300, 10),  # mm: far nearer, but by no more than 8 mm is a right reading off
        (14, 6),  # near, but not five times nearer
    ],
)
def test_a_second_reading_is_looked_for_where_the_first_leaves_much(first, second):
    weights = [first / 1e3 / np.pi, second / 1e3 / (np.pi / 2), 1.0, 1.0, 1.0, 1.0]
    distance_of = weighed(lambda p: turned(1, 90)(turned(0, 180)(p)), weights)
    found = better_reading(PENDANT, distance_of, (first + second) / 1e3, 1)
    assert found is not None
    assert found[0] == f"{J1_TURNED}; {J2_TURNED}"
    assert found[1] == pytest.approx(0.0, abs=1e-9)


def test_three_wrong_columns_and_two_that_only_together_come_nearer_are_not_guessed_at():
    three = weighed(lambda p: turned(2, 90)(turned(1, 90)(turned(0, 180)(p))), [0.1] * 6)
    assert better_reading(PENDANT, three, 0.2 * np.pi, 1) is None
    two = turned(1, 90)(turned(0, 90)(PENDANT))

    def farther(angles):
        """310 mm with both wrong, 260 with one of them."""
        right = (np.abs(angles - two).max(axis=0) < 1e-9)[:2].sum()
        return np.full(40, (0.31, 0.26, 0.0)[right])

    assert better_reading(PENDANT, farther, 0.31, 1) is None


def seen_by_a_tracker(theta, position, rotation):
    """Poses of a reflector as an instrument in a frame of its own measured them."""
    count = len(theta)
    return replace(
        blank_rows(theta, np.arange(count), [f"m.csv: line {n + 2}" for n in range(count)], 0),
        position=position,
        rotation=rotation,
        reflectors=("r",),
        instruments=("m.csv",),
        aligned=np.array([False]),
    )


def check_turns(arm, data):
    """As `identify` does, by the fit of the joints' zeros."""
    parts = symbolic_sources(arm.robot, arm.known, np.ones(6, dtype=bool), warm=False)
    model = build_model(arm.robot, parts, len(arm.nodes))
    cold = np.zeros((len(data.theta), len(arm.nodes)))
    data = replace(data, rise=cold, lag=cold)
    zeros = next(c for c in candidate_models(model.groups()[0]) if c.groups)
    check_fitted_turns(data, fit(model, data, active_in_groups(model, zeros.groups)))


def test_orientations_far_from_the_arms_are_named_by_their_rows():
    """Three of sixty turned by 1 deg, drawn; the rest within 0.01 deg. They widened the noise without a word."""
    rng = np.random.default_rng(8)
    turn = rng.normal(0, 0.006 * DEG, (60, 3))
    data = seen_by_a_tracker(np.zeros((60, 6)), np.zeros((60, 3)), np.zeros((60, 3, 3)))
    none = np.zeros(60, dtype=bool)

    def told(turn, outlier=none):
        linear = SimpleNamespace(oriented=np.arange(60), turn=turn)
        return [f.message for f in wild_turns(data, cast(Fit, SimpleNamespace(linear=linear, outlier=outlier)))]

    assert told(turn) == []
    turn[[4, 30, 31]] = np.array([1, 0, 0]) * DEG
    (message,) = told(turn)
    assert "from the arm's: line 6: 1 deg, line 32: 1 deg, line 33: 1 deg, where 0.01 deg is usual" in message
    assert len(message) <= 300
    assert "line 6" not in told(turn, np.arange(60) == 4)[0]  # its place is named already
    turn[10:19] = np.array([1, 0, 0]) * DEG
    assert "line 15: 1 deg and 7 more, where" in told(turn)[0]


REFUSED = r"^m.csv: columns rx_deg, ry_deg, rz_deg: they turn by \d+\.\d deg \(median\) otherwise than the arm"


def by_columns(change):
    return lambda turn: rotation_matrix(rotation_vector(turn) @ change.T)


ORIENTATIONS = {
    "right": lambda turn: turn,
    "radians": by_columns(np.eye(3) * DEG),
    "W P R": lambda turn: rotation_matrix(np.column_stack(to_wpr(turn))),
    "the other way": lambda turn: np.swapaxes(turn, 1, 2),
    "y z x": by_columns(np.eye(3)[[1, 2, 0]]),  # rotation vectors of an instrument that stands otherwise
    "two signs": by_columns(np.diag([-1, -1, 1])),
}


@pytest.mark.parametrize("read", ORIENTATIONS)
@pytest.mark.parametrize("oriented", [3, 20])
def test_orientations_that_are_no_rotation_vectors_of_the_flange_are_refused(read, oriented):
    """Any zeros, frame and axes explained three of any kind, and columns in another order: accepted without a word."""
    arm = load_arm("m710ic50")
    rng, count = np.random.default_rng(5), 20
    theta = random_theta(arm.robot, rng, count)
    flange, base = flange_pose(arm.robot, theta), rotation_matrix(rng.normal(size=(1, 3)))[0]
    axes = rotation_matrix(rng.normal(size=(1, 3)))[0]  # of the reflector, in the flange
    at = flange.position + flange.rotation @ [0.06, 0.01, 0.1]
    turn = base @ flange.rotation @ axes @ rotation_matrix(rng.normal(0, 0.1 * DEG, (count, 3)))
    turn = np.where((np.arange(count) < oriented)[:, None, None], ORIENTATIONS[read](turn), np.nan)
    data = seen_by_a_tracker(theta, at @ base.T, turn)
    known = InstrumentFrames(base[None], np.zeros((1, 3)), np.array([[0.06, 0.01, 0.1]]))
    model = build_model(arm.robot, [], 0)
    check_plausible(arm.robot, model, data)
    if read == "right":
        check_turns(arm, data)
        check_plausible(arm.robot, model, data, known)
        return
    with pytest.raises(InputError, match=REFUSED):
        check_turns(arm, data)
    with pytest.raises(InputError, match=REFUSED):
        check_plausible(arm.robot, model, data, known)


def test_the_file_whose_orientations_turn_most_is_named():
    """The rows of both count for a reflector's axes, and a right file may be off by their mean."""
    turn, of = np.zeros((6, 3)), np.array([0, 0, 0, 1, 1, 1])
    turn[:, 0] = np.where(of == 0, 2.0, 40.0) * DEG
    data = seen_by_a_tracker(np.zeros((6, 6)), np.zeros((6, 3)), np.tile(np.eye(3), (6, 1, 1)))
    label = tuple(f"{'ab'[i]}.csv: line {n + 2}" for n, i in enumerate(of.tolist()))
    with pytest.raises(InputError, match=r"^b.csv: columns rx_deg, .* 40\.0 deg"):
        refuse_turned(replace(data, instrument=of, label=label, instruments=("a", "b")), np.arange(6), turn)


@pytest.mark.parametrize("joint", range(6))
def test_an_arm_whose_zero_is_off_by_two_degrees_is_no_file_of_other_angles(joint):
    """Its orientations were refused as *W P R, other Euler angles, or radians*, and they were right."""
    arm, rng, count = load_arm("m710ic50"), np.random.default_rng(5), 40
    theta = random_theta(arm.robot, rng, count)
    flange = flange_pose(arm.robot, theta + 2 * DEG * np.eye(6)[joint])
    turns = flange.rotation @ rotation_matrix(rng.normal(0, 0.02 * DEG, (count, 3)))
    data = seen_by_a_tracker(theta, flange.position + flange.rotation @ [0.06, 0.01, 0.1], turns)
    check_plausible(arm.robot, build_model(arm.robot, [], 0), data)
    check_turns(arm, data)
    with pytest.raises(InputError, match=REFUSED):
        check_turns(arm, replace(data, rotation=rotation_matrix(rotation_vector(turns) * 0.9)))


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("zeros", [(0, 0, 2, 0, 0, 0), (0, 0, 0, 0, 2, 0), (0, 0, 0, 1.5, 1.5, 0)])
def test_an_arm_mastered_anew_is_told_how_far_it_is_off(zeros, known):
    """`check-robot` fits no zeros: its right orientations were refused as *W P R*, and there was no table."""
    arm, rng, count = load_arm("m710ic50"), np.random.default_rng(5), 40
    theta, ball = random_theta(arm.robot, rng, count), np.array([0.06, 0.01, 0.1])
    nominal, flange = flange_pose(arm.robot, theta), flange_pose(arm.robot, theta + np.array(zeros) * DEG)
    data = seen_by_a_tracker(theta, flange.position + flange.rotation @ ball, flange.rotation)
    frames = InstrumentFrames(np.eye(3)[None], np.zeros((1, 3)), ball[None]) if known else None
    result = validate(arm.robot, [], data, 0, frames)
    off = norm(flange.position + flange.rotation @ ball - nominal.position - nominal.rotation @ ball)
    if known:
        np.testing.assert_allclose(result.identified, off, atol=1e-9)
    (turned,) = (f for f in result.findings if f.code == "turned")
    words = r"m.csv: orientations turn by [12]\.\d deg \(median\) otherwise than the arm: a joint was mastered anew, or"
    assert re.match(words, turned.message)
    assert turned.level == "warning"
    exact = seen_by_a_tracker(theta, nominal.position + nominal.rotation @ ball, nominal.rotation)
    assert not [f for f in validate(arm.robot, [], exact, 0, frames).findings if f.code == "turned"]
    with pytest.raises(InputError, match=REFUSED):
        validate(arm.robot, [], replace(exact, rotation=ORIENTATIONS["W P R"](exact.rotation)), 0, frames)


def test_places_on_a_line_leave_open_how_the_instrument_stands_about_it():
    """Right orientations were refused: the frame that places alone tell was turned by 42 deg about the line."""
    arm, rng, count = load_arm("m710ic50"), np.random.default_rng(4), 20
    ball = np.array([0.06, 0.01, 0.1])
    place = np.array([1.3, 0.0, 0.3]) + np.linspace(-0.5, 0.5, count)[:, None] * [0, 1, 0]
    tilted = np.diag([1.0, -1.0, -1.0]) @ rotation_matrix(rng.uniform(-0.5, 0.5, (count, 3)))
    theta = solve_tool(arm.robot, Pose(place, tilted), Pose(ball, np.eye(3)), Posture())[0]
    base = rotation_matrix(rng.normal(size=(1, 3)))[0]
    data = seen_by_a_tracker(theta, (place + rng.normal(0, 1e-4, (count, 3))) @ base.T, base @ tilted)
    check_turns(arm, data)
    with pytest.raises(InputError, match=REFUSED):
        check_turns(arm, replace(data, rotation=np.swapaxes(data.rotation, 1, 2)))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("tilt", "noise"), [(0.3, 1e-4), (0.1, 1e-4), (0.1, 0.0), (0.03, 1e-4)])
@pytest.mark.parametrize("reflectors", [1, 2])
def test_places_on_a_line_take_how_the_instrument_stands_from_small_tilts(tilt, noise, seed, reflectors):
    """Frame and axes that only alternate were up to 57 deg from where they would come: *W P R, other Euler angles*."""
    arm, rng, count = load_arm("m710ic50"), np.random.default_rng(seed), 20
    ball = np.array([0.06, 0.01, 0.1])
    place = np.array([1.3, 0.0, 0.3]) + np.linspace(-0.5, 0.5, count)[:, None] * [0, 1, 0]
    tilted = np.diag([1.0, -1.0, -1.0]) @ rotation_matrix(rng.uniform(-tilt, tilt, (count, 3)))
    theta = solve_tool(arm.robot, Pose(place, tilted), Pose(ball, np.eye(3)), Posture())[0]
    base, *axes = rotation_matrix(rng.normal(size=(1 + reflectors, 3)))
    of = np.arange(count) % reflectors
    measured = place + rng.normal(0, 1, (count, 3)) * noise
    data = seen_by_a_tracker(theta, measured @ base.T, base @ tilted @ np.array(axes)[of])
    data = replace(data, reflector=of, reflectors=tuple("rs"[:reflectors]))
    check_turns(arm, data)


def test_sockets_of_distances_stay_where_orientations_say_how_the_tracker_stands():
    arm, rng, count = load_arm("m710ic50"), np.random.default_rng(6), 20
    theta = random_theta(arm.robot, rng, count)
    flange, base = flange_pose(arm.robot, theta), rotation_matrix(rng.normal(size=(1, 3)))[0]
    ball, socket, far = np.array([0.06, 0.01, 0.1]), np.array([1.2, 0.3, -0.4]), np.arange(count) >= 12
    at = flange.position + flange.rotation @ ball
    data = seen_by_a_tracker(theta, at @ base.T, base @ flange.rotation)
    data = replace(
        data,
        instrument=np.where(far, WORLD, 0),
        position=np.where(far[:, None], np.nan, data.position),
        rotation=np.where(far[:, None, None], np.nan, data.rotation),
        ends=replace(
            data.ends,
            kind=np.where(far, DISTANCE, PLACE),
            place=np.where(far, 0, NONE),
            distance=np.where(far, np.linalg.norm(at - socket, axis=1), np.nan),
        ),
        fixed=FixedPlaces(names=("s",), frame=np.array([WORLD]), place=np.full((1, 3), np.nan), sigma=np.zeros(1)),
    )
    true = InstrumentFrames(base[None], np.zeros((1, 3)), ball[None], socket[None])
    assert np.abs(np.nan_to_num(true.residual(data, flange.position, flange.rotation))).max() < 1e-12
    kept = with_orientations(data, true, flange.position, flange.rotation)
    for part in ("rotation", "origin", "reflector", "place"):
        np.testing.assert_allclose(getattr(kept, part), getattr(true, part), atol=1e-9)


def test_a_distance_that_a_coarse_gauge_reads_again_at_another_time_is_no_copy():
    data = distances_again(np.full(4, 0.3))
    times = np.arange(len(data.time), dtype=float)
    with pytest.raises(InputError, match="a copy is no second"):
        check_copies(replace(data, timed=True, time=np.zeros(len(times))))
    visits = replace(data, pose=np.arange(len(data.pose)), timed=True, time=np.arange(len(data.pose), dtype=float))
    check_copies(replace(visits, theta=data.theta[data.pose]))
