"""Waypoints against the true path: chords, spacing, arc length, stops, contact and tool axes."""

from functools import cache, partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.exceptions import InputError
from compgen.core.units import UM
from compgen.pipelines.files.path_file import load_job
from compgen.planning import boundaries, curves, patterns, surfaces, toolpath
from compgen.planning.exact_path import ExactPath
from compgen.planning.whole_periods import Periods

PATHS = Path(__file__).parents[2] / "paths"
ATOL_M = 1e-12
CENTRE = np.array([1.2, -0.03, 0.203])
FLAT = surfaces.plane(CENTRE)
OPTIC = surfaces.conic(CENTRE, 84.0, -0.993, 14.0)
BOWL = surfaces.conic(CENTRE, 1.5, -0.5, 0.4)  # steep, so that mistakes show
HEXAGON = boundaries.hexagon(0.4, 0.2)

PATTERNS = {
    "line": patterns.line("x", 0.3),
    "upwards": patterns.line("z", 0.3),
    "circle": patterns.circle(0.3),
    "spiral": patterns.spiral(0.4, 5),
    "iso9283": patterns.iso9283(0.3),
    "square raster": patterns.raster(HEXAGON, 0.03, 0.01, smooth=False),
    "smooth raster": patterns.raster(HEXAGON, 0.03, 0.01, smooth=True),
}
PERIODS = Periods(length=0.05e-3, rounding=1.8e-6)  # so short that the chord decides where lines end
SURFACES = {"plane": FLAT, "optic": OPTIC, "bowl": BOWL}
EVERY = [(p, s) for p in PATTERNS for s in SURFACES]


@cache
def path(pattern, surface="bowl", chord=1.5e-6, lift=0.02, boundary=HEXAGON, spin=0.3, periods=None):
    pattern = PATTERNS[pattern] if isinstance(pattern, str) else pattern
    bare = ExactPath(curve=pattern, surface=SURFACES[surface], boundary=boundary, spin=spin)
    return toolpath.plan_tool_path(bare, toolpath.LayoutSettings(chord, periods=periods), lift=lift)


def off_chord(tool, every=1):
    """Largest distance of the true path from the straight line of every so many segments [m]."""
    segment, u = np.arange(0, len(tool.span), every), np.linspace(0.2, 0.8, 5)
    p = tool.at(np.repeat(segment, 5), np.tile(u, len(segment)))[0].position.reshape(-1, 5, 3)
    a, b = tool.target.position[segment, None], tool.target.position[segment + 1, None]
    along = (b - a) / np.linalg.norm(b - a, axis=2, keepdims=True)
    gap = p - a
    return np.linalg.norm(gap - (gap * along).sum(axis=2, keepdims=True) * along, axis=2).max(axis=1)


def off_balanced(tool):
    """Largest distance of the true path from the line between where its ends stand, at eleven places of each [m]."""
    ends, segment = tool.target.position + tool.balance, np.arange(len(tool.span))
    along = np.diff(ends, axis=0) / np.linalg.norm(np.diff(ends, axis=0), axis=1, keepdims=True)
    gaps = []
    for share in np.linspace(0, 1, 11):
        gap = tool.at(segment, np.full(len(segment), share)).pose.position - ends[:-1]
        gaps.append(np.linalg.norm(gap - (gap * along).sum(axis=1, keepdims=True) * along, axis=1))
    return np.max(gaps, axis=0)


def local(tool, surface):
    return tool.target.position - SURFACES[surface].origin


def height_over(surface, xy):
    """z of the surface over local (x, y) [m]."""
    return SURFACES[surface].lift(xy, np.zeros(len(xy)))[0][:, 2] - SURFACES[surface].origin[2]


def height_above(tool, surface):
    """Signed distance of waypoints from the surface, first order [m]."""
    p = local(tool, surface)
    h = p[:, 2] - height_over(surface, p[:, :2])
    return h / np.sqrt(1 + (slopes(surface, p[:, :2]) ** 2).sum(axis=1))


def slopes(surface, xy, d=1e-5):
    f = partial(height_over, surface)
    return np.column_stack([(f(xy + e) - f(xy - e)) / (2 * d) for e in ([d, 0], [0, d])])


@pytest.mark.parametrize("chord_um", [1.5, 50.0])
@pytest.mark.parametrize(("pattern", "surface"), EVERY)
def test_true_path_stays_within_the_chord_of_every_segment(pattern, surface, chord_um):
    assert off_chord(path(pattern, surface, chord=chord_um * 1e-6)).max() <= chord_um * 1e-6


def test_fine_chords_are_kept_as_well():
    assert off_chord(path("circle", chord=10e-9), every=5).max() <= 10e-9


def test_chords_use_what_they_are_given():
    """The largest distance of a curve is near the setting, so the bound above bites."""
    for pattern in ("circle", "spiral", "iso9283"):
        assert off_chord(path(pattern)).max() > 0.9 * 1.5e-6


@pytest.mark.parametrize(("periods", "most"), [(None, 1.05), (PERIODS, 1.09)])
@pytest.mark.parametrize(("pattern", "surface"), EVERY)
def test_a_path_has_hardly_more_lines_than_its_curvature_asks_for(pattern, surface, periods, most):
    """Against the integral of ds over the spacing, and three a piece: whole lines, rests, corners take the others."""
    tool, t = path(pattern, surface, periods=periods), (np.arange(2000) + 0.5) / 2000
    chord = 1.5e-6 if periods is None else 2 * 1.5e-6  # to either side
    asked = 0.0
    for piece in range(len(tool.exact.curve.poly)):
        speed, spacing = tool.exact.speed_and_spacing(np.full(2000, piece), t, chord, 10e-3)
        asked += max(3.0, (speed / spacing).mean())
    assert len(tool.span) < most * asked


@pytest.mark.parametrize("chord_um", [1.5, 20.0])
@pytest.mark.parametrize(("pattern", "surface"), EVERY)
def test_lines_of_whole_periods_leave_the_path_by_the_chord_to_either_side_beside_corners_too(
    pattern, surface, chord_um
):
    tool = path(pattern, surface, chord=chord_um * 1e-6, periods=PERIODS)
    assert off_balanced(tool).max() <= chord_um * 1e-6


@pytest.mark.parametrize("periods", [None, PERIODS])
@pytest.mark.parametrize("chord_um", [1.5, 20.0, 100.0])
def test_a_path_that_begins_and_ends_where_curvature_changes_fast_keeps_its_chord(chord_um, periods):
    """The first line and the last one are those that leave it too far as they are laid at first."""
    turn = curves.u_turns(np.zeros((1, 2)), np.array([[0.0, 0.01]]), np.array([[1.0, 0.0]]), 0.01)
    tool = path(turn, "plane", chord=chord_um * 1e-6, lift=0.0, periods=periods)
    assert (off_chord(tool) if periods is None else off_balanced(tool)).max() <= chord_um * 1e-6


def half_circle(x, radius=0.1):
    """About (x, 0), to a stop."""
    return curves.spiral((x, 0), (radius, radius), (np.pi, 0), stop=True)


@pytest.mark.parametrize("radius", [0.1, 0.8])  # of the larger ones all lines are as long
def test_lines_on_both_sides_of_a_corner_keep_the_chord(radius):
    tool = path(curves.join(half_circle(0, radius), half_circle(2 * radius, radius)), "plane", lift=0, periods=PERIODS)
    assert off_balanced(tool).max() <= 1.5e-6


def test_lines_beside_a_corner_end_on_it_and_use_the_chord_as_others_do():
    """Where two half circles of 100 mm meet: of a line that ends on the path 3/4 of the sag count, not a half."""
    tool = path(curves.join(half_circle(0.0), half_circle(0.2)), "plane", lift=0.0, periods=PERIODS)
    off, length, corner = off_balanced(tool), np.diff(tool.arc), int(np.flatnonzero(tool.stop)[1])
    assert_allclose(tool.target.position[corner] - CENTRE, [0.1, 0, 0], atol=ATOL_M)
    assert_allclose(tool.balance[corner], 0, atol=ATOL_M)
    for beside, away in ((corner - 1, corner - 10), (corner, corner + 10)):
        assert 0.55 * 1.5e-6 < off[beside] < 1.5e-6
        assert 0.9 * 1.5e-6 < off[away] < 1.5e-6
        assert length[away] / np.sqrt(1.5) - PERIODS.length < length[beside] < length[away]


def test_a_corner_makes_lines_shorter_only_between_two_curves_and_where_they_are_balanced():
    before, arc, behind = curves.line((-0.3, 0), (-0.1, 0), stop=True), half_circle(0), curves.line((0.1, 0), (0.3, 0))
    way, *alone = (
        np.diff(path(c, "plane", lift=0.0, periods=PERIODS).arc)
        for c in (curves.join(before, arc, behind), before, arc, behind)
    )
    assert_allclose(way, np.concatenate(alone), atol=1e-9)
    alone, twice = (path(c, "plane", lift=0.0) for c in (arc, curves.join(arc, half_circle(0.2))))
    assert_allclose(np.diff(twice.arc), np.tile(np.diff(alone.arc), 2), atol=1e-9)


def test_a_path_of_fewer_waypoints_is_the_same_curve_and_stands_beside_it_by_its_own_lines():
    tool = path("circle", "plane", lift=0.0, periods=PERIODS)
    rows = np.append(np.arange(0, len(tool.arc) - 1, 2), len(tool.arc) - 1)
    fewer, arcs = tool.subset(rows), tool.subset(rows, via=np.arange(len(rows)) % 2 == 1)
    segment = np.arange(len(rows) - 1)
    for share, whole in ((0.0, rows[:-1]), (1.0, rows[1:])):
        position = fewer.at(segment, np.full(len(segment), share)).pose.position
        assert_allclose(position, tool.target.position[whole], atol=ATOL_M)
    assert_allclose(off_chord(fewer)[:-1], 4 * off_chord(tool).max(), rtol=0.05)  # as much farther as two by two lines
    assert off_balanced(fewer)[2:-2].max() < 0.6 * off_chord(fewer).max()  # to both sides
    assert not fewer.via.any()
    assert (arcs.via == (np.arange(len(rows)) % 2 == 1)).all()
    assert not arcs.balance.any()  # an arc lies on the path
    assert not path("circle", "plane", lift=0.0).subset(rows[:2]).balance.any()


@pytest.mark.parametrize(("radius", "chord_um"), [(0.65, 1.5), (0.65, 10.0), (0.05, 1.5), (0.05, 0.1)])
def test_circle_needs_two_pi_r_over_root_8_r_e_points(radius, chord_um):
    needed = 2 * np.pi * radius / np.sqrt(8 * radius * chord_um * 1e-6)
    segments = len(path(patterns.circle(2 * radius), "plane", chord=chord_um * 1e-6, lift=0).span)
    assert needed <= segments <= 1.3 * needed


def test_spiral_is_denser_at_its_centre_by_the_root_of_the_radius():
    tool = path("spiral", "plane", lift=0)
    step = np.diff(tool.arc)
    b = 0.2 / (10 * np.pi)  # r = b f
    radius = np.hypot(*local(tool, "plane")[:, :2].T)
    middle = (radius[1:] + radius[:-1]) / 2
    curvature = (middle**2 + 2 * b**2) / (middle**2 + b**2) ** 1.5
    assert_allclose(step * np.sqrt(curvature / (8 * 1.5e-6)), 0.97, atol=0.05)  # 0.98, and whole numbers of segments
    assert step.max() > 3 * step.min()


def test_straight_lines_are_cut_at_10_mm():
    tool = path("line", "plane", lift=0)
    assert_allclose(np.diff(tool.arc), 0.01, atol=ATOL_M)


def test_waypoints_are_never_more_than_10_mm_apart():
    for pattern, surface in EVERY:
        assert np.diff(path(pattern, surface, chord=1e-3).arc).max() <= 10e-3 * (
            1 + 1e-6
        )  # the last 1e-6 of a segment is forgiven


@pytest.mark.parametrize(("pattern", "surface"), EVERY)
def test_fraction_0_and_1_are_the_waypoints(pattern, surface):
    tool = path(pattern, surface)
    segment = np.arange(len(tool.span))
    for u, n in ((0.0, segment), (1.0, segment + 1)):
        pose, _ = tool.at(segment, np.full(len(segment), u))
        assert_allclose(pose.position, tool.target.position[n], atol=ATOL_M)
        assert_allclose(pose.rotation, tool.target.rotation[n], atol=1e-11)  # rad


@pytest.mark.parametrize("chord_um", [1.5, 1000.0])
@pytest.mark.parametrize("pattern", PATTERNS)
def test_fractions_split_the_arc_length(pattern, chord_um):
    """Against the length of a fine polyline along the piece, which asks nothing of arc lengths."""
    tool = path(pattern, chord=chord_um * 1e-6)
    pick = np.unique(np.linspace(0, len(tool.span) - 1, 16).astype(int))
    for k in pick:
        t = np.linspace(tool.span[k, 0], tool.span[k, 1], 2001)
        p = tool.exact.pose(np.full(2001, tool.piece[k]), t)[0].position
        run = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1))])
        assert_allclose(run[-1], np.diff(tool.arc)[k], atol=1e-9)  # m
        u = np.linspace(0, 1, 9)
        position = tool.at(np.full(9, k), u)[0].position
        want = np.column_stack([np.interp(u * run[-1], run, p[:, i]) for i in range(3)])
        assert_allclose(position, want, atol=1e-9)  # m


@pytest.mark.parametrize(("pattern", "want"), [("line", 0.3), ("circle", 0.3 * np.pi), ("upwards", 0.3)])
def test_arc_length_is_approach_pattern_and_retract(pattern, want):
    tool = path(pattern, "plane", lift=0.02)
    assert tool.arc[0] == 0
    assert_allclose(tool.arc[-1], want + 0.04, atol=ATOL_M)


def test_spiral_arc_length_is_the_closed_form():
    f = 10 * np.pi
    want = 0.2 / f / 2 * (f * np.sqrt(1 + f * f) + np.arcsinh(f))
    assert_allclose(path("spiral", "plane", lift=0).arc[-1], want, rtol=1e-11)


@pytest.mark.parametrize(("pattern", "surface"), EVERY)
def test_direction_of_travel_is_the_slope_of_position(pattern, surface):
    tool, d = path(pattern, surface, chord=1e-5), 1e-3
    segment = np.arange(len(tool.span))
    mid = np.full(len(segment), 0.5)
    ahead, behind = (tool.at(segment, mid + side * d)[0].position for side in (1, -1))
    step = ahead - behind
    assert_allclose(tool.at(segment, mid)[1], step / np.linalg.norm(step, axis=1, keepdims=True), atol=1e-7)


@pytest.mark.parametrize(("pattern", "surface"), EVERY)
def test_tool_points_into_the_surface(pattern, surface):
    tool = path(pattern, surface)
    xy = local(tool, surface)[:, :2]
    if pattern == "upwards":
        xy = 0 * xy  # all stand over the same point
    else:
        down, up = np.flatnonzero(tool.stop)[[1, -2]]
        xy[:down], xy[up:] = xy[down], xy[up]
    normal = np.column_stack([-slopes(surface, xy), np.ones(len(xy))])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    assert_allclose(tool.target.rotation[:, :, 2], -normal, atol=1e-9)  # rad


@pytest.mark.parametrize("spin_deg", [0.0, 30.0, -120.0, 90.0])
def test_tool_frame_is_right_handed_and_its_x_follows_the_spin(spin_deg):
    tool = path("spiral", spin=np.radians(spin_deg))
    R = tool.target.rotation
    assert_allclose(R.transpose(0, 2, 1) @ R, np.tile(np.eye(3), (len(R), 1, 1)), atol=1e-14)
    assert_allclose(np.linalg.det(R), 1, atol=1e-14)
    along = np.array([np.cos(np.radians(spin_deg)), np.sin(np.radians(spin_deg)), 0])
    assert np.all(R[:, :, 0] @ along > 0.8)
    across = np.cross(along, R[:, :, 2])
    assert_allclose((across * R[:, :, 0]).sum(axis=1), 0, atol=1e-14)  # x in the plane of z and the spin's direction


@pytest.mark.parametrize(("pattern", "surface"), [(p, s) for p, s in EVERY if p != "upwards"])
def test_waypoints_lie_on_the_surface_between_approach_and_retract(pattern, surface):
    tool = path(pattern, surface)
    above = height_above(tool, surface)
    ways = np.flatnonzero(tool.stop)
    down, up = int(ways[1]), int(ways[-2])
    assert_allclose(above[down : up + 1], 0, atol=1e-12)
    assert np.all(np.diff(above[: down + 1]) < 0)
    assert np.all(np.diff(above[up:]) > 0)


def test_approach_and_retract_go_along_the_normal_for_the_lift():
    tool = path("circle", lift=0.02)
    for n, foot in ((0, np.flatnonzero(tool.stop)[1]), (-1, np.flatnonzero(tool.stop)[-2])):
        assert_allclose(
            tool.target.position[n] - tool.target.position[foot], -0.02 * tool.target.rotation[foot, :, 2], atol=ATOL_M
        )


def test_without_lift_the_path_is_the_pattern():
    tool = path("circle", "plane", lift=0)
    assert_allclose(tool.target.position[[0, -1]], np.tile(CENTRE + np.array([0.15, 0, 0]), (2, 1)), atol=ATOL_M)
    assert tool.contact.all()


@pytest.mark.parametrize("pattern", ["spiral", "square raster", "smooth raster", "circle"])
def test_nothing_above_the_surface_touches(pattern):
    tool = path(pattern)
    above = height_above(tool, "bowl") > 1e-9
    assert above.sum() == 6  # three segments down, three up
    assert not tool.contact[above].any()


@pytest.mark.parametrize("pattern", ["spiral", "square raster", "smooth raster"])
def test_contact_is_inside_the_hexagon_only(pattern):
    """Corners written out; a point is inside when it is left of all six edges."""
    tool = path(pattern)
    xy = local(tool, "bowl")[:, :2]
    angles = 0.2 + np.arange(6) * np.pi / 3
    corners = 0.2 * np.column_stack([np.cos(angles), np.sin(angles)])
    left = [
        (b - a)[0] * (xy[:, 1] - a[1]) - (b - a)[1] * (xy[:, 0] - a[0])
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)
    ]
    depth = np.min(left, axis=0) / 0.2
    on_surface = np.abs(height_above(tool, "bowl")) < 1e-9
    outside, inside = depth < -1e-8, (depth > 1e-8) & on_surface
    assert outside.sum() > 50
    assert inside.sum() > 100
    assert not tool.contact[outside].any()
    assert tool.contact[inside].all()


def test_raster_has_a_waypoint_in_contact_on_both_edges_of_every_sweep():
    tool = path("square raster", "plane")
    xy = local(tool, "plane")[:, :2]
    for y in np.unique(np.round(xy[tool.contact, 1], 9)):
        x = xy[tool.contact & (np.abs(xy[:, 1] - y) < 1e-9), 0]
        assert_allclose([x.min(), x.max()], HEXAGON.clip(float(y)), atol=1e-9)


def test_robot_stops_at_the_ends_and_at_the_foot_of_approach_and_retract():
    for pattern in ("line", "circle", "spiral", "smooth raster"):
        tool = path(pattern)
        stops = np.flatnonzero(tool.stop)
        assert len(stops) == 4
        assert stops[0] == 0
        assert stops[-1] == len(tool.target.position) - 1
        assert_allclose(tool.arc[stops], [0, 0.02, tool.arc[-1] - 0.02, tool.arc[-1]], atol=ATOL_M)


def turned(tool):
    """Angle between arriving and leaving at each inner waypoint [rad]."""
    segment = np.arange(len(tool.span))
    arriving, leaving = tool.at(segment, np.ones(len(segment)))[1], tool.at(segment, np.zeros(len(segment)))[1]
    cross = np.linalg.norm(np.cross(arriving[:-1], leaving[1:]), axis=1)
    return np.arctan2(cross, (arriving[:-1] * leaving[1:]).sum(axis=1))


@pytest.mark.parametrize(("pattern", "surface"), EVERY)
def test_robot_stops_at_every_corner_and_nowhere_else(pattern, surface):
    tool = path(pattern, surface)
    corner = turned(tool) > 1e-6  # rad
    stop = tool.stop[1:-1]
    assert not np.any(corner & ~stop)
    assert (stop & ~corner).sum() == (pattern == "upwards")  # its line runs on straight into the retract
    assert pattern == "upwards" or corner.sum() >= 2


@pytest.mark.parametrize("rotation_deg", [0.0, 17.0, 30.0])
@pytest.mark.parametrize("lead_mm", [0.0, 5.0])
def test_square_raster_stops_at_every_corner_whatever_its_lead(rotation_deg, lead_mm):
    part = boundaries.hexagon(1.45, np.radians(rotation_deg))  # m, the shipped optic
    tool = path(patterns.raster(part, 0.02, lead_mm * 1e-3, smooth=False), "plane", boundary=part)
    corner = turned(tool) > 0.1  # rad
    assert corner.sum() > 80
    assert tool.stop[1:-1][corner].all()


def test_a_stop_at_the_end_of_a_piece_without_length_is_kept():
    elbow = curves.join(
        curves.line((0, 0), (0.1, 0)), curves.line((0.1, 0), (0.1, 0), stop=True), curves.line((0.1, 0), (0.1, 0.1))
    )
    tool = path(elbow, "plane", lift=0)
    assert_allclose(tool.arc[tool.stop], [0, 0.1, 0.2], atol=ATOL_M)


def test_every_piece_is_at_least_three_segments():
    tool = path("square raster", "plane")
    assert np.unique(tool.piece, return_counts=True)[1].min() >= 3


def test_arc_length_rises_at_every_waypoint():
    for pattern, surface in EVERY:
        assert np.all(np.diff(path(pattern, surface).arc) > 1e-6)  # m


@pytest.mark.parametrize("name", ["circle_1300", "optic_spiral"])
def test_shipped_paths_keep_their_chord(name):
    job = load_job(str(PATHS / f"{name}.toml"))
    plan, process = job.plan.path, job.plan.process
    layout = toolpath.LayoutSettings(process.chord)
    tool = toolpath.plan_tool_path(plan.exact(job.tool.spin), layout, lift=process.lift)
    assert off_chord(tool, every=11).max() <= process.chord


def test_path_without_length_is_refused():
    with pytest.raises(InputError, match="zero length"):
        path(curves.line((0.1, 0.1), (0.1, 0.1), stop=True), lift=0)


def test_path_beyond_its_surface_is_refused():
    with pytest.raises(InputError, match="radius_of_curvature_m"):
        path(patterns.circle(4.0))


def test_a_piece_that_is_dust_hands_its_stop_to_the_piece_before():
    dust = curves.line((0.1, 0.0), (0.1 + 1e-13, 0.0), stop=True)
    way = curves.join(
        curves.line((0.0, 0.0), (0.1, 0.0)), dust, dust, curves.line((0.1, 0.0), (0.1, 0.1)), dust,
        curves.line((0.1, 0.1), (0.2, 0.1), stop=True),
    )  # fmt: skip
    tool = path(way, "plane", lift=0.0)
    corners = np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0.2, 0.1, 0]])
    assert_allclose(tool.target.position[tool.stop] - tool.target.position[0], corners, atol=1e-9)


@pytest.mark.parametrize("pattern", ["circle", "iso9283", "spiral"])
def test_where_lines_end_does_not_hang_on_a_processor_s_last_digits(pattern):
    """Lines of a circle are all as long: which of two neighbours is the longer is not for rounding to say."""
    way, rng = path(pattern, "plane", lift=0.0), np.random.default_rng(3)
    goes_on = way.piece[:-1] == way.piece[1:]
    ends = way.span[:-1, 1] + np.where(goes_on, 1e-13 * rng.standard_normal(len(goes_on)), 0.0)
    shaken = way.span.copy()
    shaken[:-1, 1] = ends
    shaken[1:, 0] = np.where(goes_on, ends, shaken[1:, 0])
    found = [toolpath.balance_of(way.exact, way.piece, span, way.stop) for span in (way.span, shaken)]
    assert np.abs(found[0] - found[1]).max() < 1e-10
    assert np.abs(found[0]).max() > 1e-7


@pytest.mark.parametrize(
    ("before", "after", "is_stop", "expected"),
    [
        (2.0, 1.0, False, 1.0),
        (1.0, 3.0, False, 1.5),
        (2.0, -1.0, False, 1.0),  # where a curve bends over to the other side it goes on
        (2.0, -1.0, True, 0.0),  # a corner
        (2.0, 1.0, True, 1.0),  # a stop on the way round
        (1.0, 2.0, True, 1.0),
        (2.0, 0.0, True, 1.0),  # of a curve that goes on as a straight line
    ],
)
def test_a_waypoint_stands_beside_the_path_by_half_the_larger_sag_and_a_corner_on_it(before, after, is_stop, expected):
    sag = np.array([[0, 0, before], [0, 0, after]]) * UM
    exact: Any = SimpleNamespace(sag=lambda piece, span: sag)
    stop = np.array([True, is_stop, True])
    balance = toolpath.balance_of(exact, np.zeros(2, dtype=np.int64), np.zeros((2, 2)), stop)
    assert_allclose(balance[:, 2] / UM, [before / 2, expected, after / 2], atol=1e-12)
    assert not balance[:, :2].any()
