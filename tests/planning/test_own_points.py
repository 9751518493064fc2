"""A curve through given points: near every one, smooth between corners, the tool as it was given."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from toolpaths import laid

from compgen.core.exceptions import InputError
from compgen.planning import boundaries, surfaces, toolpath
from compgen.planning.exact_path import ExactPath
from compgen.planning.own_points.given_points import GivenPoints, check_points
from compgen.planning.own_points.space_curve import Tolerance, space_curve
from compgen.planning.own_points.tool_stands import place_points

ORIGIN = np.zeros(3)
PLANE = surfaces.plane(ORIGIN)
SPIN, FEED = 0.3, 0.1
NEAR = Tolerance(place=2e-6, tilt=2e-4, corner=np.radians(25), exact=False)
EXACT = replace(NEAR, exact=True)
RNG = np.random.default_rng(3)


def given(position, normal=None, rotation=None, **changed):
    M = len(position)
    parts = {"feed": np.full(M, np.nan), "contact": np.ones(M, dtype=bool), "stop": np.zeros(M, dtype=bool)} | changed
    return GivenPoints(
        source="points.csv", line=np.arange(2, M + 2), position=position, normal=normal, rotation=rotation, **parts
    )


def bowl(M=800):
    """A spiral in a bowl, rounded to a micrometre, with its normals."""
    t = np.linspace(0, 8 * np.pi, M)
    r = 0.05 + 0.2 * t / t[-1]
    x, y = r * np.cos(t), r * np.sin(t)
    normal = np.column_stack([-0.6 * x, -0.6 * y, np.ones(M)])
    return np.round(np.column_stack([x, y, 0.3 * (x**2 + y**2)]), 6), normal / np.linalg.norm(normal, axis=1)[:, None]


def planned(points, tolerance=NEAR, surface=PLANE):
    curve = space_curve(place_points(points, surface, SPIN, FEED), tolerance).curve
    bare = ExactPath(curve=curve, surface=surface, boundary=boundaries.unbounded(), spin=SPIN)
    return toolpath.plan_tool_path(bare, toolpath.LayoutSettings(1.5e-6), lift=0.02)


def nearest(tool, places):
    """Distance of places from the true path, and the tool's axes at the nearest point."""
    work = np.flatnonzero(tool.exact.curve.working[tool.piece])
    segment, u = np.repeat(work, 40), np.tile(np.linspace(0, 1, 40), len(work))
    pose = tool.at(segment, u)[0]
    rows = [int(np.argmin(np.linalg.norm(pose.position - p, axis=1))) for p in places]
    distance = []
    for row, p in zip(rows, places, strict=True):
        a, b = pose.position[max(row - 1, 0)], pose.position[min(row + 1, len(segment) - 1)]
        along = (b - a) / np.linalg.norm(b - a)
        gap = p - pose.position[row]
        distance.append(np.linalg.norm(gap - (gap @ along) * along))
    return np.array(distance), pose.rotation[rows]


@pytest.mark.parametrize(("tolerance", "limit"), [(NEAR, 2e-6), (EXACT, 1e-7)])
def test_the_path_passes_every_point_and_the_tool_stands_against_its_normal(tolerance, limit):
    position, normal = bowl()
    rows = np.arange(0, len(position), 37)
    distance, rotation = nearest(planned(given(position, normal), tolerance), position[rows])
    assert distance.max() < limit
    angle = np.arccos(np.clip(-(rotation[:, :, 2] * normal[rows]).sum(axis=1), -1, 1))
    assert angle.max() < 5e-4


@pytest.mark.parametrize("tolerance", [NEAR, EXACT])
def test_a_tool_that_turns_evenly_between_waypoints_keeps_to_its_tolerance(tolerance):
    x = np.linspace(0, 0.15, 61)
    lean = 0.1 * np.sin(x / 3e-3)
    normal = np.column_stack([np.sin(lean), 0 * x, np.cos(lean)])
    tool = planned(given(np.column_stack([x, 0 * x, 0 * x]), normal), tolerance)
    work = np.flatnonzero(tool.exact.curve.working[tool.piece])
    axis, middle, end = (tool.at(work, np.full(len(work), u))[0].rotation[:, :, 2] for u in (0.0, 0.5, 1.0))
    assert np.linalg.norm((axis + end) / 2 - middle, axis=1).max() < 1.2 * tolerance.tilt


def test_noise_of_the_tools_axis_asks_for_no_waypoints():
    """Points 0.2 mm apart whose axes scatter by half a degree: seven times as many, 25 um apart, were driven."""
    x = np.arange(250) * 2e-4
    lean = np.deg2rad(0.5) * np.random.default_rng(3).normal(size=(2, 250))
    normal = np.column_stack([np.sin(lean[0]), np.sin(lean[1]), np.sqrt(1 - (np.sin(lean) ** 2).sum(axis=0))])
    points = place_points(given(np.column_stack([x, 0 * x, 0 * x]), normal), PLANE, SPIN, FEED)
    least = space_curve(points, Tolerance(2e-6, np.deg2rad(0.01), 0.5, exact=True)).curve.least
    assert least.sum() <= len(x)


def test_few_pieces_do_for_many_rounded_points():
    position, normal = bowl(20_000)
    pieces = len(space_curve(place_points(given(position, normal), PLANE, SPIN, FEED), NEAR).curve.poly)
    assert pieces < 2000


@pytest.mark.parametrize("tolerance", [NEAR, EXACT])
def test_place_slope_and_curvature_run_on_from_piece_to_piece(tolerance):
    position, normal = bowl()
    points = place_points(given(position, normal), PLANE, SPIN, FEED)
    curve = space_curve(points, tolerance).curve
    K = len(curve.poly)
    ends, starts = (
        curve.derivatives(np.arange(K - 1), np.ones(K - 1)),
        curve.derivatives(np.arange(1, K), np.zeros(K - 1)),
    )
    # per metre of the spline's own parameter: the length of each piece
    h = np.linalg.norm(curve.poly[:, 1], axis=1)
    assert_allclose(ends[0], starts[0], atol=1e-12)
    unit_end, unit_start = (d[1] / np.linalg.norm(d[1], axis=1)[:, None] for d in (ends, starts))
    assert_allclose(unit_end, unit_start, atol=1e-7)

    def curvature(d):
        return (d[1][:, 0] * d[2][:, 1] - d[1][:, 1] * d[2][:, 0]) / np.linalg.norm(d[1], axis=1) ** 3

    assert_allclose(curvature(ends), curvature(starts), atol=1e-4)
    assert h.min() > 0


def test_the_tool_is_turned_as_w_p_r_say():
    M = 60
    t = np.linspace(0, 1, M)
    position = np.column_stack([0.3 * t, 0.05 * np.sin(3 * t), 0.02 * t])
    turn = Rotation.from_euler("xyz", np.column_stack([180 - 20 * t, 15 * t, 30 * t - 10]), degrees=True)
    distance, rotation = nearest(planned(given(position, rotation=turn.as_matrix())), position)
    assert distance.max() < 2e-6
    off = (Rotation.from_matrix(rotation).inv() * turn).magnitude()
    assert off.max() < 5e-4


def test_points_without_a_normal_stand_on_the_surface():
    surface = surfaces.conic(np.array([1.2, 0.1, 0.3]), 1.5, -0.5, 0.4)
    t = np.linspace(0, 6, 200)
    xy = np.column_stack([0.1 * np.cos(t), 0.08 * np.sin(t)])
    place, normal = surface.lift(xy, np.full(200, 0.001))
    tool = planned(given(place - surface.origin), NEAR, surface)
    distance, rotation = nearest(tool, place)
    assert distance.max() < 2e-6
    assert_allclose(-rotation[:, :, 2], normal, atol=5e-4)


def test_the_robot_stops_at_corners_and_the_sides_stay_straight():
    side = np.linspace(0, 0.1, 11)[:-1]
    zero = np.zeros(10)
    square = [(side, zero), (zero + 0.1, side), (0.1 - side, zero + 0.1), (zero, 0.1 - side)]
    position = np.vstack([np.column_stack([x, y, zero]) for x, y in square])
    drawn = space_curve(place_points(given(position), PLANE, SPIN, FEED), NEAR)
    assert drawn.corners == 3
    assert drawn.bulge.size < 1e-9


@pytest.mark.parametrize("tolerance", [NEAR, EXACT])
def test_corners_far_apart_do_not_hide_one_another(tolerance):
    triangle = np.array([[0, 0, 0.01], [0, 0, 0], [0.1, 0, 0], [0, 0.06, 0], [0, 0, 0], [0, 0, 0.01]])
    drawn = space_curve(place_points(given(triangle), PLANE, SPIN, FEED), tolerance)
    assert drawn.corners == 4
    assert drawn.bulge.size < 1e-9


def test_neighbours_within_the_noise_are_one_corner():
    x = np.linspace(0, 0.1, 21)
    out = np.column_stack([x, 0 * x, 0 * x])
    tip = np.array([[0.1 + 3e-6, 3e-6, 0]])  # a corner of two points, 4 um apart
    back = np.column_stack([0 * x[1:] + 0.1 + 3e-6, x[1:], 0 * x[1:]])
    assert space_curve(place_points(given(np.vstack([out, tip, back])), PLANE, SPIN, FEED), NEAR).corners == 1


def ring(M, radius=0.2):
    t = np.linspace(0, 2 * np.pi, M + 1)
    return radius * np.column_stack([np.cos(t), np.sin(t), 0 * t])


def asphere(M, turns=6):
    t = np.linspace(0.1, 1, M) * turns * 2 * np.pi
    r = 0.25 * t / t[-1]
    return np.column_stack([r * np.cos(t), r * np.sin(t), r**2 / 3 + 0.5 * r**4])


@pytest.mark.parametrize("tolerance", [NEAR, EXACT])
@pytest.mark.parametrize("place", [ring(15), ring(18), ring(36), ring(500), asphere(150), asphere(1500)], ids=len)
def test_coarsely_sampled_circles_and_aspheres_explain_their_bulge(place, tolerance):
    bulge = space_curve(place_points(given(place), PLANE, SPIN, FEED), tolerance).bulge
    assert bulge.beyond < 50e-6
    if len(place) == 19:  # by hand: the rise of an arc of 20 deg over its chord
        assert bulge.size == pytest.approx(0.2 * (1 - np.cos(np.radians(10))), rel=0.05)


@pytest.mark.parametrize("tolerance", [NEAR, EXACT])
def test_a_turn_that_stands_alone_explains_nothing(tolerance):
    bent = np.array([[0, 0, 0], [0.1, 0, 0], [0.2, 0.03, 0], [0.3, 0.06, 0]])
    bulge = space_curve(place_points(given(bent), PLANE, SPIN, FEED), tolerance).bulge
    assert bulge.beyond == pytest.approx(bulge.size)
    assert bulge.size > 1e-3
    assert bulge.row in (0, 1)


def test_the_largest_distance_is_measured_and_not_that_of_the_middles():
    # a plunge into a level line: in the middle of the second span the curve is half as far off as at its worst
    position = np.array([[0, 0, 0], [0.05, 0, 0], [0.06, 0, 0.003], [0.11, 0, 0.003]])
    points = place_points(given(position), PLANE, SPIN, FEED)
    drawn = space_curve(points, EXACT)
    K = len(drawn.curve.poly)
    piece, t = np.repeat(np.arange(K), 400), np.tile(np.linspace(0, 1, 400), K)
    place = np.column_stack([drawn.curve.derivatives(piece, t)[0], drawn.curve.height(piece, t)[0]])
    line = position[:-1, None] + np.linspace(0, 1, 4000)[None, :, None] * np.diff(position, axis=0)[:, None]
    worst = max(np.linalg.norm(line.reshape(-1, 3) - p, axis=1).min() for p in place[::7])
    assert drawn.bulge.size == pytest.approx(worst, rel=0.02)
    assert drawn.bulge.lowest == pytest.approx(place[:, 2].min(), abs=2e-6)
    assert drawn.bulge.lowest < -1e-4


def test_a_long_span_beside_short_ones_stays_straight():
    arc = np.linspace(0, np.pi / 2, 40)
    end = np.column_stack([0.05 * np.sin(arc), 0.05 * (1 - np.cos(arc)), np.zeros(40)])
    position = np.vstack([[-0.4, 0.0, 0.0], end])
    tool = planned(given(position))
    work = np.flatnonzero(tool.exact.curve.working[tool.piece])
    places = tool.at(np.repeat(work, 5), np.tile(np.linspace(0, 1, 5), len(work)))[0].position
    on_line = places[(places[:, 0] < -0.01)]
    assert len(on_line) > 10
    assert np.abs(on_line[:, 1]).max() < 4e-6


@pytest.mark.parametrize("tolerance", [EXACT, NEAR])
def test_a_span_four_times_as_long_as_both_neighbours_is_one_line(tolerance):
    """Points were put onto it from both ends up to its middle, where two of them were one: the fit ended in a fault."""
    x = np.array([0, 2903, 5806, 17418, 20321, 23224]) * 1e-6
    position = np.column_stack([x, np.zeros((len(x), 2))])
    assert space_curve(place_points(given(position), PLANE, SPIN, FEED), tolerance).bulge.size < 1e-12


def test_contact_and_feed_hold_from_point_to_point():
    x = np.linspace(0, 0.3, 31)
    position = np.column_stack([x, 0.01 * np.sin(9 * x), 0 * x])
    contact, feed = (x > 0.055) & (x < 0.255), np.where(x > 0.155, 0.05, np.nan)
    tool = planned(given(position, contact=contact, feed=feed))
    middle = tool.at(np.arange(len(tool.span)), np.full(len(tool.span), 0.5))[0].position
    work = np.abs(middle[:, 2]) < 1e-9
    assert_allclose(tool.exact.curve.working[tool.piece][work], (middle[work, 0] > 0.05) & (middle[work, 0] < 0.25))
    assert_allclose(tool.pace[work], np.where(middle[work, 0] > 0.15, 0.5, 1.0))


def test_approach_and_retract_go_along_the_tool():
    position, normal = bowl()
    tool = planned(given(position, normal))
    for first, last, at in ((0, 1, 0), (-1, -2, -1)):
        steps = tool.target.position[first] - tool.target.position[np.flatnonzero(tool.stop)[[1, -2]][at]]
        assert_allclose(np.linalg.norm(steps), 0.02, rtol=1e-6)
        assert_allclose(steps / 0.02, normal[at], atol=1e-3)
        assert_allclose(tool.target.rotation[first], tool.target.rotation[last], atol=1e-9)


@pytest.mark.parametrize(
    ("position", "words"),
    [
        (np.array([[0, 0, 0]]), "give two at least"),
        (np.column_stack([np.linspace(0, 0.0006, 20)] * 3), "if it is in metres, give millimetres"),
        (np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0, 0], [0.2, 0, 0]]), "line 4: the same place as line 3"),
        (np.array([[0.01 * k + 0.3 * (k > 5), 0, 0] for k in range(30)]), "line 8: 310.0 mm from the point before"),
    ],
)
def test_points_that_make_no_path_are_refused(position, words):
    with pytest.raises(InputError, match=words):
        check_points(given(np.asarray(position, dtype=float)), 0.1)


def test_points_a_last_digit_apart_are_two():
    x = np.arange(0, 900.0005, 0.001) * 1e-3
    check_points(given(np.column_stack([x, 0 * x, 0 * x])), 0.1)


def test_a_tool_upside_down_is_refused_by_its_line():
    normal = np.tile([0.0, 0.0, 1.0], (20, 1))
    normal[12] = [0.0, np.sin(3.0), np.cos(3.0)]
    x = np.linspace(0, 0.3, 20)
    with pytest.raises(InputError, match=r"line 14: the tool is turned 172 deg.*i, j, k point out of the part"):
        place_points(given(np.column_stack([x, 0 * x, 0 * x]), normal), PLANE, SPIN, FEED)


def test_what_is_round_at_the_end_does_not_shake_the_rest():
    # the first turns of a spiral bend a hundred times as sharply as its last
    t = np.sqrt(np.linspace(0, 1, 100_000)) * 2 * np.pi * 100
    position = np.round(np.column_stack([0.2 * t / t[-1] * np.cos(t), 0.2 * t / t[-1] * np.sin(t), 0 * t]), 6)
    made = space_curve(place_points(given(position), PLANE, SPIN, FEED), NEAR)
    assert len(made.curve.poly) < 100_000 / 25
    work = laid(made.curve, PLANE, boundaries.unbounded(), spin=SPIN, chord=1.5e-6, lift=0.0)
    rows = np.arange(5, len(position), 9999)
    assert nearest(work, position[rows])[0].max() < 2e-6


def test_rounding_along_the_way_asks_for_no_knots():
    x = np.cumsum(RNG.uniform(1e-5, 3e-5, 20_000))
    position = np.column_stack([x, 0.02 * np.sin(4 * x), 0 * x]) + RNG.uniform(-5e-7, 5e-7, (len(x), 3))
    assert len(space_curve(place_points(given(position), PLANE, SPIN, FEED), NEAR).curve.poly) < len(x) / 20
