"""Pieces of plane curve against finite differences and polynomials written out."""

import numpy as np
import pytest
from numpy.polynomial import polynomial as P
from numpy.testing import assert_allclose

from compgen.planning import curves
from compgen.planning.curves import PiecewiseCurve

ATOL_M = 1e-14


def anything():
    """One piece with every coefficient at work."""
    rng, off = np.random.default_rng(7), np.array([False])
    poly, polar, lift = rng.normal(size=(1, 8, 2)), rng.normal(size=(1, 4)), rng.normal(size=(1, 4))
    return PiecewiseCurve(
        poly=poly,
        polar=polar,
        lift=lift,
        stop=off,
        working=off,
        tilt=rng.normal(size=(1, 4, 3)),
        pace=np.ones(1),
        least=np.ones(1, dtype=int),
    )


KINDS = {
    "line": curves.line((0.1, -0.2), (0.7, 0.4)),
    "lifted line": curves.line((0.1, -0.2, 0.3), (0.1, -0.2, 0.0)),
    "arc": curves.spiral((0.1, 0.2), (0.65, 0.65), (0.3, 0.3 + 2 * np.pi)),
    "spiral": curves.spiral((0.0, 0.0), (0.0, 0.65), (0.0, 6 * np.pi)),
    "clockwise": curves.spiral((0.0, 0.0), (0.5, 0.1), (1.0, -4.0)),
    "turn": curves.u_turns(np.array([[0.5, -0.02]]), np.array([[0.5, 0.0]]), np.array([[1.0, 0.0]]), 0.032),
    "anything": anything(),
}


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_agree_with_finite_differences(kind):
    table, h = KINDS[kind], 1e-4
    K = len(table.poly)
    piece, t = np.repeat(np.arange(K), 21), np.tile(np.linspace(0.01, 0.99, 21), K)
    near = {e: table.derivatives(piece, t + e * h) for e in (-2, -1, 1, 2)}
    _, d1, d2 = table.derivatives(piece, t)
    for order, exact in ((0, d1), (1, d2)):
        fd = (8 * (near[1][order] - near[-1][order]) - (near[2][order] - near[-2][order])) / (12 * h)
        scale = max(1.0, float(np.abs(exact).max()))
        assert_allclose(fd, exact, atol=2e-10 * scale)


@pytest.mark.parametrize("kind", KINDS)
def test_height_rises_at_its_derivative(kind):
    table = KINDS[kind]
    K = len(table.poly)
    piece = np.arange(K)
    h = 1e-3
    near = {e: table.height(piece, np.full(K, 0.4 + e * h))[0] for e in (-2, -1, 1, 2)}
    slope = (8 * (near[1] - near[-1]) - (near[2] - near[-2])) / (12 * h)
    assert_allclose(table.height(piece, np.full(K, 0.4))[1], slope, atol=1e-11)
    assert_allclose(table.height(piece, np.zeros(K))[0], table.lift[:, 0], atol=0)


def test_general_piece_is_the_formula_written_out():
    table, t = KINDS["anything"], np.linspace(0, 1, 13)
    (r0, r1, f0, f1), c = table.polar[0], table.poly[0]
    angle = f0 + f1 * t
    want = P.polyval(t, c).T + ((r0 + r1 * t) * np.array([np.cos(angle), np.sin(angle)])).T
    assert_allclose(table.derivatives(np.zeros(13, dtype=int), t)[0], want, atol=1e-13)


def test_line_runs_evenly_from_start_to_end():
    p, d1, d2 = KINDS["line"].derivatives(np.zeros(3, dtype=int), np.array([0.0, 0.5, 1.0]))
    assert_allclose(p, [[0.1, -0.2], [0.4, 0.1], [0.7, 0.4]], atol=ATOL_M)
    assert_allclose(d1, np.tile([0.6, 0.6], (3, 1)), atol=ATOL_M)
    assert not d2.any()


def test_lifted_line_moves_in_height_only():
    h, rate = KINDS["lifted line"].height(np.zeros(3, dtype=int), np.array([0.0, 0.5, 1.0]))
    assert_allclose(h, [0.3, 0.15, 0.0], atol=ATOL_M)
    assert_allclose(rate, -0.3, atol=ATOL_M)
    assert not KINDS["lifted line"].derivatives(np.zeros(3, dtype=int), np.linspace(0, 1, 3))[1].any()


def test_arc_keeps_its_distance_and_is_cut_into_quarters():
    table = KINDS["arc"]
    assert len(table.poly) == 4
    piece, t = np.repeat(np.arange(4), 50), np.tile(np.linspace(0, 1, 50), 4)
    p = table.derivatives(piece, t)[0] - [0.1, 0.2]
    assert_allclose(np.hypot(*p.T), 0.65, atol=ATOL_M)
    assert_allclose(np.abs(table.polar[:, 3]), np.pi / 2, atol=ATOL_M)


def test_spiral_radius_grows_with_the_angle():
    table = KINDS["spiral"]
    piece, t = np.repeat(np.arange(12), 50), np.tile(np.linspace(0, 1, 50), 12)
    p = table.derivatives(piece, t)[0]
    angle = (piece + t) * np.pi / 2
    want = (0.65 * angle / (6 * np.pi))[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    assert_allclose(p, want, atol=ATOL_M)


def test_pieces_of_a_spiral_join_in_position_direction_and_curvature():
    for kind in ("arc", "spiral", "clockwise"):
        table = KINDS[kind]
        K = len(table.poly)
        before = table.derivatives(np.arange(K - 1), np.ones(K - 1))
        after = table.derivatives(np.arange(1, K), np.zeros(K - 1))
        for a, b in zip(before, after, strict=True):
            assert_allclose(a, b, atol=1e-13)


@pytest.mark.parametrize("heading", [(1.0, 0.0), (-1.0, 0.0), (0.6, 0.8)])
def test_turn_leaves_along_its_heading_and_comes_back_against_it(heading):
    reach = 0.032
    table = curves.u_turns(np.array([[0.5, -0.02]]), np.array([[0.5, 0.0]]), np.array([heading]), reach)
    p, d1, d2 = table.derivatives(np.zeros(2, dtype=int), np.array([0.0, 1.0]))
    assert_allclose(p, [[0.5, -0.02], [0.5, 0.0]], atol=ATOL_M)
    assert_allclose(d1, reach * np.array([heading, heading]) * [[1], [-1]], atol=ATOL_M)
    assert_allclose(d2, 0, atol=1e-13)


def test_turn_has_no_third_derivative_at_its_ends():
    c = KINDS["turn"].poly[0]
    for order, size in ((2, None), (3, None), (4, 1e-3)):
        ends = P.polyval(np.array([0.0, 1.0]), P.polyder(c, order))
        if size is None:
            assert_allclose(ends, 0, atol=1e-13)
        else:
            assert np.abs(ends).max() > size  # the set-up bites: the next one does not vanish


def test_turn_is_mirrored_about_its_middle():
    t = np.linspace(0, 0.5, 20)
    piece = np.zeros(20, dtype=int)
    out, back = (KINDS["turn"].derivatives(piece, s)[0] for s in (t, 1 - t))
    assert_allclose(out[:, 0], back[:, 0], atol=ATOL_M)
    assert_allclose(out[:, 1] + 0.02, -back[:, 1], atol=ATOL_M)


def test_turn_never_touches_and_never_stops():
    assert not KINDS["turn"].working.any()
    assert not KINDS["turn"].stop.any()


def test_stop_is_at_the_end_of_the_last_quarter_only():
    table = curves.spiral((0.0, 0.0), (0.1, 0.1), (0.0, 2 * np.pi), stop=True)
    assert table.stop.tolist() == [False, False, False, True]


def test_join_keeps_the_order_and_every_column():
    a, b = KINDS["line"], KINDS["spiral"]
    both = curves.join(a, b)
    for name in PiecewiseCurve.__slots__:
        assert np.array_equal(getattr(both, name), np.concatenate([getattr(a, name), getattr(b, name)]))


def test_start_and_end_are_those_of_the_curve():
    zero = np.zeros(3)
    for name, start, end in (("line", (0.1, -0.2, 0), (0.7, 0.4, 0)), ("spiral", (0, 0, 0), (0.65, 0, 0))):
        for (place, tilt), want in ((KINDS[name].start(), start), (KINDS[name].end(), end)):
            assert_allclose(place, want, atol=ATOL_M)
            assert_allclose(tilt, zero, atol=0)
    tilted = curves.tilted(KINDS["lifted line"], np.array([0.1, 0.2, 0.3]), np.array([0.0, -0.1, 0.2]))
    assert_allclose(tilted.start()[0], (0.1, -0.2, 0.3), atol=ATOL_M)
    assert_allclose(tilted.start()[1], (0.1, 0.2, 0.3), atol=0)
    assert_allclose(tilted.end()[1], (0, -0.1, 0.2), atol=1e-16)
