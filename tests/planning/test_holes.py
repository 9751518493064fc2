"""Holes of every kind in every outline, against the definition of each, written out."""

from typing import Any

import numpy as np
import pytest

from compgen.core.exceptions import InputError
from compgen.planning.boundary_schema import BoundaryTable, boundary_from_table

NEAR = 1e-7  # m from an edge, where the two may say different things
OUTLINES: dict[str, dict[str, Any]] = {
    "circle": {"shape": "circle", "diameter_mm": 900.0},
    "hexagon": {"shape": "hexagon", "corner_to_corner_mm": 1000.0, "rotation_deg": 11.0},
    "rectangle": {"shape": "rectangle", "size_mm": [800.0, 640.0], "rotation_deg": -23.0},
    "polygon": {
        "shape": "polygon",
        "corners_mm": [[-400.0, -320.0], [400.0, -320.0], [400.0, 300.0], [0.0, 200.0], [-400.0, 320.0]],
        "rotation_deg": 40.0,
    },
}


def turn(points, angle):
    return points @ np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]).T


def distance_to_ring(points, corners):
    """Of the nearest edge, and whether the angles to the corners add up to a whole turn."""
    nearest, total = np.full(len(points), np.inf), np.zeros(len(points))
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        u = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        nearest = np.minimum(nearest, np.linalg.norm(points - a - u[:, None] * (b - a), axis=1))
        p, q = a - points, b - points
        total += np.arctan2(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0], (p * q).sum(axis=1))
    return np.where(np.abs(total) > np.pi, -nearest, nearest)


def outside_hole(points, hole):
    """How far outside a hole's edge points are [m], negative in it, from its keys in mm and degrees."""
    kind = hole.get("kind", "polygon")
    if kind == "polygon":
        return distance_to_ring(points, np.array(hole["corners_mm"]) / 1e3)
    own = turn(points - np.array([hole["x_mm"], hole["y_mm"]]) / 1e3, -np.radians(hole.get("rotation_deg", 0.0)))
    if kind == "circle":
        return np.hypot(*own.T) - hole["diameter_mm"] / 2e3
    if kind == "slot":  # two half circles, and straight between them
        half, radius = (hole["length_mm"] - hole["width_mm"]) / 2e3, hole["width_mm"] / 2e3
        beyond = np.maximum(np.abs(own[:, 0]) - half, 0.0)
        return np.hypot(beyond, own[:, 1]) - radius
    x, y = np.array(hole["size_mm"]) / 2e3
    return distance_to_ring(own, np.array([(-x, -y), (x, -y), (x, y), (-x, y)]))


def outside_outline(points, table):
    own = turn(points, -np.radians(table.get("rotation_deg", 0.0)))
    if table["shape"] == "circle":
        return np.hypot(*own.T) - table["diameter_mm"] / 2e3
    if table["shape"] == "polygon":
        return distance_to_ring(own, np.array(table["corners_mm"]) / 1e3)
    if table["shape"] == "hexagon":
        angle = np.radians(60 * np.arange(6))
        return distance_to_ring(
            own, table["corner_to_corner_mm"] / 2e3 * np.column_stack([np.cos(angle), np.sin(angle)])
        )
    x, y = np.array(table["size_mm"]) / 2e3
    return distance_to_ring(own, np.array([(-x, -y), (x, -y), (x, y), (-x, y)]))


def drawn_holes(rng):
    """One in each quarter of the part, of a random kind, place, size and turn: they cannot meet."""
    holes = []
    for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
        at = {"x_mm": x * rng.uniform(80, 140), "y_mm": y * rng.uniform(70, 110)}
        size = rng.uniform(10, 60)
        slim = size * rng.uniform(0.2, 1.0)
        turned = {"rotation_deg": rng.uniform(-200, 200)}
        angle = np.sort(rng.uniform(0, 2 * np.pi, 5))
        star = size * rng.uniform(0.4, 1.0, (5, 1)) * np.column_stack([np.cos(angle), np.sin(angle)])
        holes.append(
            [
                {"kind": "circle", **at, "diameter_mm": 2 * size},
                {"kind": "slot", **at, "length_mm": 2 * size, "width_mm": 2 * slim, **turned},
                {"kind": "rectangle", **at, "size_mm": [1.4 * size, 1.4 * slim], **turned},
                {"corners_mm": (star + np.array([at["x_mm"], at["y_mm"]])).tolist()},
            ][rng.integers(4)]
        )
    return holes


def part_of(outline, *holes):
    return boundary_from_table(BoundaryTable(**OUTLINES[outline], holes=list(holes)), "part.toml")


@pytest.mark.parametrize("outline", OUTLINES)
@pytest.mark.parametrize("seed", range(4))
def test_a_point_is_on_the_part_where_the_definitions_say(outline, seed):
    rng = np.random.default_rng([seed, len(outline)])
    holes = drawn_holes(rng)
    points = rng.uniform(-0.55, 0.55, (20_000, 2)) * rng.choice([0.4, 1.0], (20_000, 1))
    rotation = np.radians(OUTLINES[outline].get("rotation_deg", 0.0))  # holes turn with the part
    own = turn(points, -rotation)
    outline_first = [outside_outline(points, OUTLINES[outline]), *(-outside_hole(own, hole) for hole in holes)]
    beyond: np.ndarray = np.stack(outline_first)
    clear = np.asarray((np.abs(beyond) > NEAR).all(axis=0))
    want = np.asarray((beyond <= 0).all(axis=0))
    assert (want & (beyond[0] < 0)).any()
    assert ((beyond[1:] > 0).sum(axis=1) > 5).all()  # each hole is met
    assert np.array_equal(part_of(outline, *holes).contains(points)[clear], want[clear])


def test_the_edge_of_a_round_hole_belongs_to_the_part_and_a_micrometre_inside_does_not():
    slot = {"kind": "slot", "x_mm": 50.0, "y_mm": -20.0, "length_mm": 90.0, "width_mm": 30.0, "rotation_deg": 30.0}
    part, angle = part_of("circle", slot), np.linspace(-np.pi / 2, np.pi / 2, 51)
    end = np.column_stack([0.03 + 0.015 * np.cos(angle), 0.015 * np.sin(angle)])  # of its own half circle
    for half, inward in ((end, [0.03, 0.0]), (-end, [-0.03, 0.0])):
        middle = np.array([0.05, -0.02])
        assert part.contains(turn(half, np.radians(30)) + middle).all()
        assert not part.contains(turn(half + 1e-6 * (inward - half) / 0.015, np.radians(30)) + middle).any()


BIG = {"kind": "circle", "x_mm": 0.0, "y_mm": 0.0, "diameter_mm": 200.0}


@pytest.mark.parametrize(
    ("outline", "holes", "words"),
    [
        ("circle", [{**BIG, "x_mm": 360.0}], "holes.0: it crosses another edge"),
        ("circle", [{**BIG, "x_mm": 800.0}], "holes.0: it is not inside the outline"),
        ("rectangle", [{**BIG, "y_mm": 230.0}], "holes.0: it crosses another edge"),
        ("polygon", [{**BIG, "y_mm": 150.0}], "holes.0: it crosses another edge"),  # the notch
        ("hexagon", [BIG, {**BIG, "x_mm": 199.0}], "holes.1: it crosses another edge"),
        ("hexagon", [BIG, {**BIG, "diameter_mm": 50.0}], "holes.1: it is not inside"),
        ("hexagon", [{**BIG, "diameter_mm": 50.0}, BIG], "holes.1: it is not inside"),
        ("hexagon", [BIG, {"corners_mm": [[90.0, -300.0], [110.0, -300.0], [90.0, 300.0]]}], "holes.1: it crosses"),
        (
            "hexagon",
            [BIG, {"kind": "rectangle", "x_mm": 95.0, "y_mm": 0.0, "size_mm": [20.0, 500.0]}],
            "holes.1: it crosses another edge",
        ),
        ("circle", [{"kind": "circle", "x_mm": 0.0, "y_mm": 0.0}], "holes.0.diameter_mm: missing"),
        ("circle", [{**BIG, "width_mm": 3.0}], "holes.0.width_mm: a circle has none"),
        ("circle", [{**BIG, "rotation_deg": 3.0}], "holes.0.rotation_deg: a circle has none"),
        (
            "circle",
            [{"kind": "slot", "x_mm": 0.0, "y_mm": 0.0, "length_mm": 20.0, "width_mm": 30.0}],
            "holes.0.length_mm: 20 is less than width_mm = 30",
        ),
    ],
)
def test_holes_that_do_not_fit_are_refused(outline, holes, words):
    with pytest.raises(InputError, match=f"boundary.{words}"):
        part_of(outline, *holes)


def test_holes_that_touch_are_two():
    part_of("hexagon", BIG, {**BIG, "x_mm": 200.0})
