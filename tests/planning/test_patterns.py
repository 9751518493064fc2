"""Sizes of the patterns by hand formula, and the promises of the raster at the part's edge."""

import time
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.exceptions import InputError
from compgen.planning import boundaries, patterns
from compgen.planning.curves import PiecewiseCurve

ATOL_M = 1e-12
TURN_DEPTH = 0.55  # of the stepover: 11/32 of 1.6, the septic's middle
NODES, WEIGHTS = np.polynomial.legendre.leggauss(20)

PARTS = {
    "circle": boundaries.round_part(1.3),
    "hexagon 0": boundaries.hexagon(1.45, 0.0),
    "hexagon 17": boundaries.hexagon(1.45, np.radians(17)),
    "hexagon 30": boundaries.hexagon(1.45, np.radians(30)),
}
SIZES_M = [(0.02, 0.03), (0.02, 0.005), (0.0203, 0.005), (0.0137, 0.0), (0.1, 0.05)]  # stepover, lead


@cache
def raster(part: str, stepover: float, lead: float, smooth: bool) -> PiecewiseCurve:
    return patterns.raster(PARTS[part], stepover, lead, smooth=smooth)


def traced(table: PiecewiseCurve, count: int = 21):
    """Which piece, and the plane curve with its derivatives, ends of pieces included."""
    K = len(table.poly)
    piece, t = np.repeat(np.arange(K), count), np.tile(np.linspace(0, 1, count), K)
    return piece, *table.derivatives(piece, t)


def length(table: PiecewiseCurve) -> float:
    """Arc length in the plane, twenty-point Gauss on every piece [m]."""
    K = len(table.poly)
    piece, t = np.repeat(np.arange(K), 20), np.tile((NODES + 1) / 2, K)
    speed = np.linalg.norm(table.derivatives(piece, t)[1], axis=1)
    return float(speed @ np.tile(WEIGHTS / 2, K))


def joints(table: PiecewiseCurve):
    """Plane curve and derivatives at the end of each piece but the last and at the start of the next."""
    K = len(table.poly)
    return table.derivatives(np.arange(K - 1), np.ones(K - 1)), table.derivatives(np.arange(1, K), np.zeros(K - 1))


def unit(v):
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def curvature(d1, d2):
    return (d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]) / np.linalg.norm(d1, axis=1) ** 3


def outside(part, xy):
    """Distance of points from the part, 0 inside, by hand: radius, or nearest edge of the polygon [m]."""
    if not len(part.normals):
        return np.maximum(np.linalg.norm(xy, axis=1) - part.radius, 0)
    angles = np.arctan2(part.normals[0, 1], part.normals[0, 0]) + np.pi / 6 + np.arange(6) * np.pi / 3
    corners = 1.45 / 2 * np.column_stack([np.cos(angles), np.sin(angles)])
    nearest = np.full(len(xy), np.inf)
    beyond = np.zeros(len(xy), dtype=bool)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along = b - a
        u = np.clip((xy - a) @ along / (along @ along), 0, 1)
        nearest = np.minimum(nearest, np.linalg.norm(xy - a - u[:, None] * along, axis=1))
        beyond |= along[0] * (xy[:, 1] - a[1]) - along[1] * (xy[:, 0] - a[0]) < 0  # right of an edge
    return np.where(beyond, nearest, 0.0)


def is_sweep(table: PiecewiseCurve):
    """Straight along x: no polar part, no y."""
    return ~table.poly[:, 1:, 1].any(axis=1) & ~table.poly[:, 2:].any(axis=(1, 2)) & ~table.polar.any(axis=1)


def sweeps(table: PiecewiseCurve):
    """(y, x at the start, x at the end) of each sweep, its pieces joined."""
    runs: list[list[float]] = []
    keep = is_sweep(table)
    for k in np.flatnonzero(keep):
        (x0, y), slope = table.poly[k, 0], table.poly[k, 1, 0]
        if runs and k and keep[k - 1]:
            runs[-1][2] = x0 + slope
        else:
            runs.append([y, x0, x0 + slope])
    return np.array(runs)


def test_line_is_centred_and_upwards_along_z():
    for axis, start, end in (("x", (-0.65, 0), (0.65, 0)), ("y", (0, -0.65), (0, 0.65))):
        table = patterns.line(axis, 1.3)
        assert_allclose([table.start()[0][:2], table.end()[0][:2]], [start, end], atol=ATOL_M)
        assert_allclose(table.height(np.array([0]), np.array([0.5]))[0], 0, atol=0)
    up = patterns.line("z", 1.0)
    assert_allclose([up.start()[0][:2], up.end()[0][:2]], 0, atol=0)
    assert_allclose(up.height(np.array([0, 0]), np.array([0.0, 1.0]))[0], [0, 1.0], atol=ATOL_M)


def test_circle_is_pi_d_long():
    assert_allclose(length(patterns.circle(1.3)), np.pi * 1.3, atol=ATOL_M)


def test_circle_runs_counter_clockwise_from_largest_x_and_closes():
    table = patterns.circle(1.3)
    _, p, d1, _ = traced(table)
    assert_allclose(np.hypot(*p.T), 0.65, atol=ATOL_M)
    assert_allclose([table.start()[0][:2], table.end()[0][:2]], [(0.65, 0)] * 2, atol=ATOL_M)
    assert np.all(p[:, 0] * d1[:, 1] - p[:, 1] * d1[:, 0] > 0)


@pytest.mark.parametrize(("diameter", "turns"), [(1.3, 8), (1.45, 36.25), (0.5, 0.6)])
def test_spiral_is_as_long_as_the_closed_form(diameter, turns):
    angle = 2 * np.pi * turns
    b = diameter / 2 / angle  # r = b f
    want = b / 2 * (angle * np.sqrt(1 + angle**2) + np.arcsinh(angle))
    assert_allclose(length(patterns.spiral(diameter, turns)), want, rtol=1e-12)


def test_spiral_pitch_is_d_over_twice_the_turns():
    table = patterns.spiral(1.3, 8)
    ends = table.derivatives(np.arange(3, 32, 4), np.ones(8))[0]  # where each turn crosses the x axis
    assert_allclose(ends, np.column_stack([1.3 / 16 * np.arange(1, 9), np.zeros(8)]), atol=ATOL_M)
    assert_allclose(table.start()[0][:2], (0, 0), atol=0)


def test_spiral_bends_most_at_its_centre_pitch_over_4_pi():
    _, _, d1, d2 = traced(patterns.spiral(1.3, 8))
    radius = 1 / curvature(d1, d2)
    assert_allclose(radius[0], 1.3 / 16 / (4 * np.pi), rtol=1e-12)
    assert_allclose(radius[0], 6.466e-3, atol=1e-6)  # m
    assert np.all(np.diff(radius) > -1e-12)


@pytest.mark.parametrize("size", [0.63, 0.25])
def test_iso9283_stays_inside_its_square_and_touches_all_four_sides(size):
    _, p, _, _ = traced(patterns.iso9283(size))
    assert_allclose([p.min(axis=0), p.max(axis=0)], [[-size / 2] * 2, [size / 2] * 2], atol=ATOL_M)


def test_iso9283_ends_where_it_starts_and_never_jumps():
    table = patterns.iso9283(0.63)
    assert_allclose(table.end()[0][:2], table.start()[0][:2], atol=ATOL_M)
    before, after = joints(table)
    assert_allclose(before[0], after[0], atol=ATOL_M)


def test_iso9283_drives_the_square_from_corner_to_corner_and_the_meander_back():
    size = 2.0
    table = patterns.iso9283(size)
    K = len(table.poly)
    ends = np.array([table.derivatives(np.array([k]), np.array([1.0]))[0][0] for k in range(K)])
    corners = [(1, -1), (1, 1), (-1, 1), (-1, -1)]
    assert_allclose(table.start()[0][:2], (-1, -1), atol=ATOL_M)
    assert_allclose(ends[:4], corners, atol=ATOL_M)
    assert_allclose(ends[4:6], [(0, -1), (0, -0.8)], atol=ATOL_M)
    meander = [(-0.4, -0.1), (-0.4, 0.2), (-0.6, 0.2), (-0.6, -0.2), (-0.8, 0), (-0.8, -1), (-1, -1)]
    assert_allclose(ends[-7:], meander, atol=ATOL_M)


def test_iso9283_has_two_full_circles_of_08_and_01_sides():
    table = patterns.iso9283(0.63)
    round_ = np.flatnonzero(table.polar[:, 3])
    assert_allclose(table.polar[round_, 0], 0.63 / 2 * np.repeat([0.8, 0.1], 4), atol=ATOL_M)
    assert_allclose(table.polar[round_, 3].sum(), 4 * np.pi, atol=ATOL_M)


ALL = {
    "line": patterns.line("x", 1.3),
    "circle": patterns.circle(1.3),
    "spiral": patterns.spiral(1.3, 8),
    "iso9283": patterns.iso9283(0.63),
    **{
        f"raster {part} {'smooth' if smooth else 'square'}": raster(part, 0.02, 0.005, smooth)
        for part in PARTS
        for smooth in (False, True)
    },
}


@pytest.mark.parametrize("name", ALL)
def test_pieces_meet_and_where_none_stops_direction_and_curvature_run_on(name):
    (p0, v0, a0), (p1, v1, a1) = joints(ALL[name])
    assert_allclose(p0, p1, atol=ATOL_M)
    on = ~ALL[name].stop[:-1]
    assert_allclose(unit(v0)[on], unit(v1)[on], atol=1e-9)  # rad
    assert_allclose(curvature(v0, a0)[on], curvature(v1, a1)[on], atol=1e-9)  # 1/m


@pytest.mark.parametrize("name", ALL)
def test_every_pattern_stops_at_its_end(name):
    assert ALL[name].stop[-1]


def test_smooth_raster_stops_only_at_its_end():
    assert np.flatnonzero(ALL["raster circle smooth"].stop).tolist() == [len(ALL["raster circle smooth"].stop) - 1]


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize(("stepover", "lead"), SIZES_M)
def test_sweeps_are_a_stepover_apart_and_go_there_and_back(part, stepover, lead, smooth):
    y, x0, x1 = sweeps(raster(part, stepover, lead, smooth=smooth)).T
    assert_allclose(np.diff(y), stepover, atol=ATOL_M)
    assert_allclose(y + y[::-1], 0, atol=ATOL_M)  # centred
    assert np.array_equal(np.sign(x1 - x0), np.where(np.arange(len(y)) % 2, -1, 1))


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize(("stepover", "lead"), SIZES_M)
def test_no_point_of_the_part_is_more_than_half_a_stepover_from_a_sweep(part, stepover, lead):
    y = sweeps(raster(part, stepover, lead, False))[:, 0]
    points = np.random.default_rng(3).uniform(-0.8, 0.8, (20_000, 2))
    points = points[PARTS[part].contains(points)]
    assert np.abs(points[:, 1, None] - y).min(axis=1).max() <= stepover / 2 + ATOL_M


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize(("stepover", "lead"), SIZES_M)
def test_each_sweep_runs_past_the_part_by_at_least_the_lead(part, stepover, lead, smooth):
    for y, x0, x1 in sweeps(raster(part, stepover, lead, smooth=smooth)):
        low, high = PARTS[part].clip(float(y))
        assert min(x0, x1) <= low - lead + ATOL_M
        assert max(x0, x1) >= high + lead - ATOL_M


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize(("stepover", "lead"), SIZES_M)
def test_first_and_last_sweep_begin_and_end_exactly_a_lead_outside(part, stepover, lead):
    rows = sweeps(raster(part, stepover, lead, False))
    for y, x in ((rows[0, 0], rows[0, 1]), (rows[-1, 0], rows[-1, 2])):
        low, high = PARTS[part].clip(float(y))
        assert_allclose(min(abs(x - low), abs(x - high)), lead, atol=ATOL_M)


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize(("stepover", "lead"), [*SIZES_M, (0.002, 0.03)])
def test_square_raster_goes_no_farther_out_than_its_lead_and_one_step(part, stepover, lead):
    """A turn's corner is a lead beside and a stepover above a point of the edge: the hypotenuse holds it."""
    _, p, _, _ = traced(raster(part, stepover, lead, False))
    far = outside(PARTS[part], p).max()
    assert far <= np.hypot(lead, stepover) + ATOL_M
    assert far >= 0.8 * lead  # the set-up bites


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize(("stepover", "lead"), [*SIZES_M, (0.002, 0.03)])
def test_smooth_raster_goes_farther_out_by_the_depth_of_a_turn_only(part, stepover, lead):
    _, p, _, _ = traced(raster(part, stepover, lead, True))
    assert outside(PARTS[part], p).max() <= np.hypot(lead + TURN_DEPTH * stepover, stepover) + ATOL_M


@pytest.mark.parametrize("part", PARTS)
def test_with_a_fine_stepover_the_raster_stays_within_its_lead(part):
    _, p, _, _ = traced(raster(part, 0.002, 0.03, False), 11)
    assert outside(PARTS[part], p).max() <= 0.03 + 70e-6  # m: 2^2 / (2 x 30) mm


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize(("stepover", "lead"), SIZES_M)
def test_turns_lie_outside_the_part(part, stepover, lead, smooth):
    table = raster(part, stepover, lead, smooth=smooth)
    piece, p, _, _ = traced(table)
    turning = ~is_sweep(table)[piece]
    assert turning.any()
    just_out = p[turning] * (1 + 1e-8)  # on the edge, to 15 nm, is outside
    assert np.all(outside(PARTS[part], just_out) > 0)
    if not smooth:
        assert_allclose(p[turning][:, 0].reshape(-1, 21).std(axis=1), 0, atol=ATOL_M)  # straight along y


@pytest.mark.parametrize("part", PARTS)
def test_square_turns_stop_at_both_corners(part):
    table = raster(part, 0.02, 0.005, False)
    turns = np.flatnonzero(~is_sweep(table))
    assert table.stop[turns].all()
    assert table.stop[turns - 1].all()
    assert table.stop.sum() == 2 * len(turns) + 1


def test_sweeps_are_cut_where_they_cross_the_edge():
    part = PARTS["hexagon 17"]
    table = raster("hexagon 17", 0.02, 0.03, False)
    ends = {round(float(x), 9) for k in np.flatnonzero(is_sweep(table)) for x in table.poly[k, :2, 0].cumsum()}
    for y in sweeps(table)[:, 0]:
        assert {round(float(x), 9) for x in part.clip(float(y))} <= ends


def test_a_part_that_no_sweep_meets_is_refused():
    with pytest.raises(InputError, match="stepover_mm"):
        patterns.raster(boundaries.round_part(5e-10), 0.02, 0.0, smooth=False)


def test_a_stepover_wider_than_the_part_leaves_one_sweep_through_its_middle():
    rows = sweeps(raster("circle", 2.0, 0.01, False))
    assert_allclose(rows, [[0, -0.66, 0.66]], atol=ATOL_M)


def test_finer_stepover_gives_a_longer_raster():
    sizes = [length(raster("hexagon 0", s, 0.01, False)) for s in (0.08, 0.04, 0.02)]
    assert all(b > 1.8 * a for a, b in pairwise(sizes))


@pytest.mark.parametrize("smooth", [False, True])
def test_a_raster_of_one_sweep_has_no_turn(smooth):
    table = patterns.raster(boundaries.round_part(0.1), 0.2, 0.01, smooth=smooth)
    assert len(table.poly) == 3
    assert table.stop.tolist() == [False, False, True]
    assert_allclose([*table.start()[0][:2], *table.end()[0][:2]], [-0.06, 0, 0.06, 0], atol=ATOL_M)


@pytest.mark.parametrize("smooth", [False, True])
def test_fifty_thousand_sweeps_are_laid_together(smooth):
    begin = time.process_time()
    table = patterns.raster(boundaries.round_part(0.04), 8e-7, 1e-3, smooth=smooth)
    assert time.process_time() - begin < 2
    assert table.stop.sum() == (1 if smooth else 99_999)


def ends_of(curve):
    K = len(curve.poly)
    rows = np.arange(K)
    start, end = (curve.derivatives(rows, np.full(K, t))[0] for t in (0.0, 1.0))
    heights = [curve.height(rows, np.full(K, t))[0] for t in (0.0, 1.0)]
    return np.column_stack([start, heights[0]]), np.column_stack([end, heights[1]])


def test_one_way_sweeps_all_go_to_larger_x_and_come_back_above_the_part():
    curve = patterns.one_way_raster(boundaries.rectangle(0.6, 0.4, 0.0), 0.1, 0.005, 0.02)
    start, end = ends_of(curve)
    assert_allclose(end[:-1], start[1:], atol=1e-15)  # it hangs together
    work = curve.working
    assert np.all(end[work, 0] > start[work, 0])
    assert np.all(start[work, 2] == 0)
    assert_allclose(np.unique(start[work, 1]), [-0.15, -0.05, 0.05, 0.15], atol=1e-15)
    assert_allclose([start[work, 0].min(), end[work, 0].max()], [-0.305, 0.305], atol=1e-12)
    back = ~work & (np.abs(end[:, 0] - start[:, 0]) > 0.1)
    assert back.sum() == 3
    assert np.all(start[back, 2] == 0.02)


def test_cross_hatch_is_one_raster_after_the_other():
    part = boundaries.rectangle(0.6, 0.4, 0.0)
    first = patterns.raster(part, 0.1, 0.005, smooth=False)
    second = patterns.raster(part.turned(-np.pi / 2), 0.1, 0.005, smooth=False).turned(np.pi / 2)
    both = patterns.cross_hatch(first, second, 0.02)
    start, end = ends_of(both)
    assert_allclose(end[:-1], start[1:], atol=1e-15)
    assert len(both.poly) == len(first.poly) + 3 + len(second.poly)
    assert_allclose([np.ptp(ends_of(second)[0][:, 0]), np.ptp(ends_of(second)[0][:, 1])], [0.5, 0.41], atol=1e-12)


def test_a_turned_curve_is_turned():
    curve = patterns.spiral(0.4, 3)
    turned = curve.turned(0.7)
    piece, t = np.arange(len(curve.poly)), np.full(len(curve.poly), 0.3)
    turn = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])
    for before, after in zip(curve.derivatives(piece, t), turned.derivatives(piece, t), strict=True):
        assert_allclose(after, before @ turn.T, atol=1e-13)
