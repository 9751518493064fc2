"""Edges against polygons: ray casting and edge crossings, written out."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.exceptions import InputError
from compgen.planning import boundaries
from compgen.planning.boundaries import pierced, ring_hole

ATOL_M = 1e-12
SIZE = 1.45  # m corner to corner
ROTATIONS_DEG = [0.0, 30.0, 17.0]


def scattered(count, reach=0.8):
    return np.random.default_rng(6).uniform(-reach, reach, (count, 2))


def corners(rotation_deg):
    angles = np.radians(rotation_deg + 60 * np.arange(6))
    return SIZE / 2 * np.column_stack([np.cos(angles), np.sin(angles)])


def edges(rotation_deg):
    points = corners(rotation_deg)
    return list(zip(points, np.roll(points, -1, axis=0), strict=True))


def inside_by_ray(points, rotation_deg):
    """Odd number of edges crossed by the ray towards +x."""
    x, y = points.T
    inside = np.zeros(len(points), dtype=bool)
    for (x1, y1), (x2, y2) in edges(rotation_deg):
        crosses = (y1 > y) != (y2 > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            inside ^= crosses & (x < x1 + (y - y1) / (y2 - y1) * (x2 - x1))
    return inside


def from_edge(points, rotation_deg):
    """Distance to the nearest edge."""
    nearest = np.full(len(points), np.inf)
    for a, b in edges(rotation_deg):
        u = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        nearest = np.minimum(nearest, np.linalg.norm(points - a - u[:, None] * (b - a), axis=1))
    return nearest


def hexagon(rotation_deg):
    return boundaries.hexagon(SIZE, np.radians(rotation_deg))


@pytest.mark.parametrize("rotation_deg", ROTATIONS_DEG)
def test_hexagon_contains_what_the_polygon_contains(rotation_deg):
    points = scattered(20_000)
    points = points[from_edge(points, rotation_deg) > 1e-7]
    want = inside_by_ray(points, rotation_deg)
    assert 0.4 < want.mean() < 0.8  # both kinds are there
    assert np.array_equal(hexagon(rotation_deg).contains(points), want)


@pytest.mark.parametrize("rotation_deg", ROTATIONS_DEG)
def test_hexagon_covers_its_share_of_the_square(rotation_deg):
    grid = np.linspace(-0.8, 0.8, 401)
    points = np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2)
    area = hexagon(rotation_deg).contains(points).mean() * (1.6 * 401 / 400) ** 2
    assert_allclose(area, 3 * np.sqrt(3) / 8 * SIZE**2, rtol=4e-3)


@pytest.mark.parametrize("rotation_deg", ROTATIONS_DEG)
def test_edge_and_corners_belong_to_the_part_and_a_micrometre_outside_does_not(rotation_deg):
    share = np.linspace(0, 1, 11)[:, None]
    rim = np.concatenate([a + share * (b - a) for a, b in edges(rotation_deg)])
    part = hexagon(rotation_deg)
    assert part.contains(rim).all()
    out = rim * (1 + 1e-6 / np.linalg.norm(rim, axis=1, keepdims=True))
    assert not part.contains(out).any()


@pytest.mark.parametrize("rotation_deg", ROTATIONS_DEG)
def test_clip_finds_where_the_line_crosses_the_polygon(rotation_deg):
    part, top = hexagon(rotation_deg), np.abs(corners(rotation_deg)[:, 1]).max()
    for y in np.linspace(-top, top, 203)[1:-1]:
        crossings = [
            x1 + (y - y1) / (y2 - y1) * (x2 - x1) for (x1, y1), (x2, y2) in edges(rotation_deg) if (y1 > y) != (y2 > y)
        ]
        assert_allclose(part.clip(float(y)), [min(crossings), max(crossings)], atol=1e-11)


@pytest.mark.parametrize("rotation_deg", ROTATIONS_DEG)
def test_clip_misses_above_and_below_the_part(rotation_deg):
    part, top = hexagon(rotation_deg), float(np.abs(corners(rotation_deg)[:, 1]).max())
    assert np.isnan(part.clip(np.array([top + 1e-6, -top - 1e-6, 10.0]))).all()


@pytest.mark.parametrize("rotation_deg", ROTATIONS_DEG)
def test_circumradius_is_the_farthest_corner(rotation_deg):
    want = np.linalg.norm(corners(rotation_deg), axis=1).max()
    assert_allclose(hexagon(rotation_deg).circumradius(), want, atol=ATOL_M)


@pytest.mark.parametrize("rotation_deg", ROTATIONS_DEG)
def test_y_range_ends_at_the_highest_corner(rotation_deg):
    want = np.abs(corners(rotation_deg)[:, 1]).max()
    assert_allclose(hexagon(rotation_deg).y_range(), [-want, want], atol=ATOL_M)


@pytest.mark.parametrize("rotation_deg", ROTATIONS_DEG)
def test_widest_is_the_reach_of_the_rim_between_two_lines(rotation_deg):
    part, share = hexagon(rotation_deg), np.linspace(0, 1, 20_001)[:, None]
    rim = np.concatenate([a + share * (b - a) for a, b in edges(rotation_deg)])
    top = np.abs(corners(rotation_deg)[:, 1]).max() * 0.999
    for y0, y1 in np.random.default_rng(4).uniform(-top, top, (40, 2)):
        between = rim[(rim[:, 1] >= min(y0, y1)) & (rim[:, 1] <= max(y0, y1)), 0]
        want = [between.min(), between.max()]
        assert_allclose(part.x_range(float(y0), float(y1)), want, atol=2e-4)  # m, steps of 36 um along the rim
        assert np.array_equal(part.x_range(float(y0), float(y1)), part.x_range(float(y1), float(y0)))


def test_widest_sees_a_corner_between_the_lines_and_a_circle_its_diameter():
    assert_allclose(hexagon(0).x_range(-0.01, 0.02), [-SIZE / 2, SIZE / 2], atol=ATOL_M)
    assert_allclose(hexagon(0).x_range(0.01, 0.02), hexagon(0).clip(0.01), atol=ATOL_M)
    assert_allclose(boundaries.round_part(1.3).x_range(-0.1, 0.2), [-0.65, 0.65], atol=ATOL_M)
    assert_allclose(boundaries.round_part(1.3).x_range(0.25, 0.39), [-0.6, 0.6], atol=ATOL_M)


def test_hexagon_sizes_by_hand():
    assert_allclose(hexagon(0).y_range()[1], SIZE / 2 * np.sqrt(3) / 2, atol=ATOL_M)  # corners on the x axis
    assert_allclose(hexagon(30).y_range()[1], SIZE / 2, atol=ATOL_M)
    assert_allclose(hexagon(0).clip(0.0), [-SIZE / 2, SIZE / 2], atol=ATOL_M)


def test_hexagon_repeats_every_60_deg():
    points = scattered(5000)
    points = points[from_edge(points, 17) > 1e-7]
    assert np.array_equal(hexagon(17).contains(points), hexagon(77).contains(points))


def test_circle_holds_points_up_to_its_radius():
    part, angle = boundaries.round_part(1.3), np.linspace(0, 2 * np.pi, 100)
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    assert part.contains(0.65 * ring).all()
    assert not part.contains((0.65 + 1e-6) * ring).any()
    assert part.circumradius() == part.y_range()[1] == 0.65


def test_circle_clips_to_its_chord():
    part = boundaries.round_part(1.3)
    assert_allclose(part.clip(0.25), [-0.6, 0.6], atol=ATOL_M)  # 0.25^2 + 0.6^2 = 0.65^2
    assert_allclose(part.clip(-0.39), [-0.52, 0.52], atol=ATOL_M)
    assert np.isnan(part.clip(np.array([0.65, -0.7]))).all()


def test_no_edge_means_everything_is_on_the_part():
    part = boundaries.unbounded()
    assert part.contains(scattered(100, reach=1e6)).all()
    assert_allclose(part.clip(3.0), [-np.inf, np.inf])
    assert part.circumradius() == np.inf


L_SHAPE = np.array([(-0.3, -0.2), (0.3, -0.2), (0.3, 0.0), (0.05, 0.0), (0.05, 0.2), (-0.3, 0.2)])
HOLE = np.array([(-0.2, -0.1), (-0.1, -0.1), (-0.1, 0.1), (-0.2, 0.1)])


def on_l_shape(points):
    x, y = points.T
    shape = (np.abs(x) < 0.3) & (np.abs(y) < 0.2) & ((x < 0.05) | (y < 0.0))
    return shape & ~((x > -0.2) & (x < -0.1) & (np.abs(y) < 0.1))


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize("angle_deg", [0.0, 25.0])
def test_a_polygon_with_a_notch_and_a_hole_contains_what_it_should(order, angle_deg):
    angle = np.radians(angle_deg)
    part = pierced(boundaries.polygon(L_SHAPE[::order]), [ring_hole(HOLE[::order], "holes.0")]).turned(angle)
    points = scattered(20_000, 0.4)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    assert np.array_equal(part.contains(points @ turn.T), on_l_shape(points))


def test_a_rectangle_is_the_polygon_of_its_corners():
    corners = np.array([(-0.3, -0.2), (0.3, -0.2), (0.3, 0.2), (-0.3, 0.2)])
    part, same = boundaries.rectangle(0.6, 0.4, 0.3), boundaries.polygon(corners).turned(0.3)
    points = scattered(5000, 0.4)
    assert np.array_equal(part.contains(points), same.contains(points))
    assert_allclose(part.circumradius(), np.hypot(0.3, 0.2), atol=ATOL_M)
    assert_allclose(boundaries.rectangle(0.6, 0.4, 0.0).clip(0.1), [-0.3, 0.3], atol=ATOL_M)
    assert len(same.edges) == 0


@pytest.mark.parametrize(
    ("outline", "holes", "words"),
    [
        ([(0, 0), (1, 0)], [], "corners_mm: 2 corners"),
        ([(0, 0), (1, 1), (1, 0), (0, 1)], [], "corners_mm: its edges cross each other"),
        ([(0, 0), (1, 0), (2, 0)], [], "corners_mm: it has no area"),
        ([(0, 0), (1, 0), (1, 0), (0, 1)], [], "corners_mm: a corner stands twice running"),
        ([(0, 0), (1, 0), (1, 1), (0, 1)], [[(2, 2), (3, 2), (2, 3)]], "holes.0: it is not inside the outline"),
        ([(0, 0), (1, 0), (1, 1), (0, 1)], [[(0.5, 0.5), (1.5, 0.6), (0.5, 0.7)]], "holes.0: it crosses another edge"),
    ],
)
def test_polygons_that_are_none(outline, holes, words):
    def make():
        part = boundaries.polygon(np.array(outline, dtype=float))
        pierced(part, [ring_hole(np.array(hole, dtype=float), f"holes.{n}") for n, hole in enumerate(holes)])

    with pytest.raises(InputError, match=words):
        make()
