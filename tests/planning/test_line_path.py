"""Lines and arcs of a user's file: kept as they are, corners rounded within the tolerance, or stops."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.planning import boundaries, surfaces, toolpath
from compgen.planning.exact_path import ExactPath
from compgen.planning.own_points.given_points import GivenArcs
from compgen.planning.own_points.line_path import SHORTEST, line_path
from compgen.planning.own_points.space_curve import LocalPoints, Tolerance

NEAR = Tolerance(place=2e-6, tilt=2e-4, corner=np.pi, exact=False)
COARSE = replace(NEAR, place=100e-6, tilt=1e-2)
PLANE = surfaces.plane(np.zeros(3))
RNG = np.random.default_rng(11)


def local(place, tilt=None, **changed):
    M = len(place)
    parts = {"contact": np.ones(M, dtype=bool), "stop": np.zeros(M, dtype=bool), "pace": np.ones(M)} | changed
    return LocalPoints(np.asarray(place, dtype=float), np.zeros((M, 3)) if tilt is None else tilt, **parts)


def polygon(turn_deg, side=0.02, corners=6):
    """Corners of a way that turns by as much at each, with a height that changes as well."""
    angle = np.radians(turn_deg) * np.arange(corners)
    step = side * np.column_stack([np.cos(angle), np.sin(angle), 0.1 * np.cos(3 * angle)])
    return np.vstack([np.zeros(3), np.cumsum(step, axis=0)])


def sampled(curve, per_piece=60):
    """Places (M, 3) along all pieces, and the tilts."""
    K = len(curve.poly)
    piece, t = np.repeat(np.arange(K), per_piece), np.tile(np.linspace(0, 1, per_piece, endpoint=False), K)
    piece, t = np.append(piece, K - 1), np.append(t, 1.0)
    place = np.column_stack([curve.derivatives(piece, t)[0], curve.height(piece, t)[0]])
    tilt = np.einsum("mk,mkc->mc", t[:, None] ** np.arange(4), curve.tilt[piece])
    return place, tilt, piece


def to_lines(points, corner):
    start, line = corner[:-1], np.diff(corner, axis=0)
    share = np.clip(((points[:, None] - start) * line).sum(2) / (line**2).sum(1), 0, 1)
    return np.linalg.norm(points[:, None] - start - share[..., None] * line, axis=2).min(axis=1)


@pytest.mark.parametrize("tolerance", [NEAR, COARSE])
@pytest.mark.parametrize("turn", [0.05, 1, 5, 20, 60, 100, 149])
def test_corners_are_rounded_within_the_tolerance_or_are_stops(turn, tolerance):
    corner = polygon(turn)
    path = line_path(local(corner), None, tolerance)
    place = sampled(path.curve)[0]
    assert to_lines(place, corner).max() <= tolerance.place
    assert to_lines(corner, place).max() <= tolerance.place
    stops = path.curve.stop.sum() - 1
    assert stops == path.corners
    assert path.corners in (0, 5)
    # the length of the rounding that just keeps the tolerance, by hand: 3/16 d 2 sin(a / 2)
    u, v = (np.diff(corner[k : k + 2], axis=0)[0] for k in (0, 1))
    angle = np.arccos(np.clip(u @ v / np.linalg.norm(u) / np.linalg.norm(v), -1, 1))
    assert (path.corners == 0) == (0.95 * tolerance.place / (3 / 8 * np.sin(angle / 2)) >= SHORTEST)


def test_a_way_back_over_itself_stops():
    corner = np.array([[0, 0, 0], [0.1, 0, 0], [0.02, 0, 0], [0.02, 0, 0.01]])
    path = line_path(local(corner), None, replace(COARSE, place=1e-3))
    assert path.curve.stop[:-1].sum() == 1  # the plunge's right angle is rounded, the way back is not
    assert_allclose(to_lines(corner, sampled(path.curve)[0])[:2], 0, atol=1e-12)


def test_corners_sharper_than_corner_deg_stop():
    assert line_path(local(polygon(10)), None, replace(COARSE, corner=np.radians(9))).corners == 5
    assert line_path(local(polygon(10)), None, replace(COARSE, corner=np.radians(11))).corners == 0


def test_place_direction_and_curvature_run_on_through_rounded_corners():
    corner = polygon(12)
    tilt = np.cumsum(RNG.normal(0, 1e-4, corner.shape), axis=0)
    curve = line_path(local(corner, tilt), None, COARSE).curve
    K = len(curve.poly)
    ends = [
        np.column_stack([*d])
        for d in zip(curve.derivatives(np.arange(K), np.ones(K)), _heights(curve, 1.0), strict=True)
    ]
    starts = [
        np.column_stack([*d])
        for d in zip(curve.derivatives(np.arange(K), np.zeros(K)), _heights(curve, 0.0), strict=True)
    ]
    assert_allclose(ends[0][:-1], starts[0][1:], atol=1e-12)
    speed = [np.linalg.norm(d[1], axis=1) for d in (ends, starts)]
    assert_allclose(ends[1][:-1] / speed[0][:-1, None], starts[1][1:] / speed[1][1:, None], atol=1e-9)

    def curvature(d):
        return np.cross(d[1], d[2]) / np.linalg.norm(d[1], axis=1)[:, None] ** 3

    assert_allclose(curvature(ends)[:-1], curvature(starts)[1:], atol=1e-6)
    at = np.einsum("k,mkc->mc", np.ones(4), curve.tilt)
    assert_allclose(at[:-1], curve.tilt[1:, 0], atol=1e-12)
    # and the tilt keeps its tolerance at the corners
    _, all_tilts, piece = sampled(curve)
    place = sampled(curve)[0]
    for k in range(1, len(corner) - 1):
        nearest = int(np.argmin(np.linalg.norm(place - corner[k], axis=1)))
        assert 2 * np.linalg.norm(all_tilts[nearest] - tilt[k]) < COARSE.tilt
    assert len(piece) == len(place)


def _heights(curve, t):
    """Height and its first two derivatives at one end of every piece."""
    h = curve.lift.T
    return h[0] + t * (h[1] + t * (h[2] + t * h[3])), h[1] + t * (2 * h[2] + 3 * t * h[3]), 2 * h[2] + 6 * t * h[3]


def test_arcs_and_helices_are_arcs_to_the_last_digit():
    place = np.array([[0, 0, 0], [0.05, 0, 0], [0.05, 0.06, 0.004], [0.0, 0.06, 0.004]])
    arcs = GivenArcs(np.array([[0, 0], [0, 0], [0.05, 0.03], [0, 0]]), np.array([0, 0, np.pi, 0]))
    path = line_path(local(place), arcs, NEAR)
    assert path.corners == 0
    on = sampled(path.curve)[0]
    right = on[on[:, 0] > 0.0502]
    assert len(right) > 50
    assert_allclose(np.linalg.norm(right[:, :2] - [0.05, 0.03], axis=1), 0.03, atol=2e-6)
    share = (np.arctan2(right[:, 1] - 0.03, right[:, 0] - 0.05) + np.pi / 2) / np.pi
    assert_allclose(right[:, 2], 0.004 * share, atol=2e-6)


def test_a_whole_circle_comes_back():
    place = np.array([[0, 0, 0.01], [0.0, 0, 0], [0, 0, 0], [0, 0, 0.01]])
    arcs = GivenArcs(np.array([[0, 0], [0, 0], [0.04, 0], [0, 0]]), np.array([0, 0, -2 * np.pi, 0]))
    path = line_path(local(place), arcs, NEAR)
    on = sampled(path.curve)[0]
    assert on[:, 0].max() == pytest.approx(0.08, abs=1e-9)
    assert path.corners == 2  # down and up at right angles


def test_ten_thousand_short_blocks_make_no_stop_and_few_waypoints():
    turn = np.radians(RNG.uniform(-1.99, 1.99, 10_000))
    step = RNG.uniform(0.2e-3, 0.8e-3, 10_000)
    angle = np.cumsum(turn)
    corner = np.column_stack([np.cumsum(step * np.cos(angle)), np.cumsum(step * np.sin(angle)), 0 * step])
    path = line_path(local(corner), None, NEAR)
    assert path.corners == 0
    assert path.curve.stop.sum() == 1
    bare = ExactPath(curve=path.curve, surface=PLANE, boundary=boundaries.unbounded(), spin=0.0)
    tool = toolpath.plan_tool_path(bare, toolpath.LayoutSettings(1.5e-6))
    assert len(tool.arc) < 4 * len(corner)


def test_pace_and_contact_change_at_the_corner():
    corner = polygon(5)
    pace, contact = np.array([1, 1, 0.5, 0.5, 1, 1, 1.0]), np.array([1, 0, 0, 1, 1, 1, 1], dtype=bool)
    curve = line_path(local(corner, contact=contact, pace=pace), None, COARSE).curve
    ends = np.column_stack([curve.derivatives(np.arange(len(curve.poly)), np.ones(len(curve.poly)))[0]])
    for k, (p, c) in enumerate(zip(pace[1:], contact[1:], strict=False)):
        along = np.linalg.norm(ends[:, :2] - (corner[k, :2] + corner[k + 1, :2]) / 2, axis=1)
        piece = int(np.argmin(along + 0.02 * (np.abs(np.arange(len(ends)) - 3 * k) > 2)))
        assert (curve.pace[piece], curve.working[piece]) == (p, c)
