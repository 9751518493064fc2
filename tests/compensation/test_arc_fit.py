"""Arcs through a dense path: within the tolerance everywhere between their places, as few as the third order allows."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from compgen.compensation.arc_fit import MAX_ANGLE, MIN_SAGITTA, DensePath, fit_moves
from compgen.core.arcs import arcs_through
from compgen.core.pose import Pose
from compgen.core.rotations import rotation_matrix, rotation_vector
from compgen.core.units import MDEG, UM

DIGIT = 1 * UM
CHORD = 1.5 * UM


def dense(place, parameter, turn=None, chord=CHORD):
    """A dense path of a curve: function of a parameter to places (N, 3), and to rotation vectors."""
    p = place(parameter)
    fine = np.linspace(parameter[0], parameter[-1], 50 * len(parameter))
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(place(fine), axis=0), axis=1))])
    axes = rotation_matrix(np.zeros_like(p) if turn is None else turn(parameter))
    arc = np.interp(parameter, fine, length)
    return DensePath(
        arc=arc,
        commanded=Pose(p, axes),
        printed=Pose(np.round(p / DIGIT) * DIGIT, axes),
        digit=DIGIT,
        chord=chord,
        angle=1 * MDEG,
    )


def ends_only(path):
    ends = np.zeros(len(path.arc), dtype=bool)
    ends[[0, -1]] = True
    return ends


def worst_deviation(path, moves, place, parameter):
    """Of the moves through the printed places from the true curve, at many places of each half; and of orientations."""
    rows, via = moves
    fine = np.linspace(parameter[0], parameter[-1], 200 * len(parameter))
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(place(fine), axis=0), axis=1))])
    worst = 0.0
    for n, (first, last) in enumerate(zip(rows[:-1], rows[1:], strict=True)):
        f = np.linspace(0, 1, 41)
        at = np.interp(path.arc[first] + f * (path.arc[last] - path.arc[first]), length, fine)
        a, b = path.printed.position[[first, last]]
        flown = a + f[:, None] * (b - a)
        middle = n + 1 if via[n + 1] else n if via[n] else None
        if middle is not None:
            arc = arcs_through(*(path.printed.position[rows[middle + k]][None] for k in (-1, 0, 1)))
            low, high = (0.0, arc.angle[0, 0]) if middle == n + 1 else arc.angle[0]
            flown = arc.at(low + f[None] * (high - low))[0]
        worst = max(worst, np.linalg.norm(flown - place(at), axis=1).max())
    return worst


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_drawn_curves_in_space_are_kept_to_between_all_places(seed):
    rng = np.random.default_rng(seed)
    size, waves = 10 ** rng.uniform(-2, 0), rng.normal(size=(3, 3, 2))

    def place(t):
        phase = np.outer(t, np.arange(1, 4))
        return size * np.stack([np.sin(phase) @ w[:, 0] + np.cos(phase) @ w[:, 1] for w in waves], axis=1)

    def turn(t):
        return 0.1 * np.stack([np.sin(t), np.cos(2 * t), t / 3], axis=1)

    # dense as a path's chord asks for, and no farther apart than 10 mm
    coarse = np.linspace(0, 2, 20001)
    d1, d2 = (
        np.gradient(place(coarse), coarse, axis=0),
        np.gradient(np.gradient(place(coarse), coarse, axis=0), coarse, axis=0),
    )
    speed = np.linalg.norm(d1, axis=1)
    curvature = np.linalg.norm(np.cross(d1, d2), axis=1) / speed**3
    step = np.minimum(np.sqrt(8 * 0.95 * CHORD / curvature), 0.01)
    count = np.concatenate([[0], np.cumsum(np.diff(coarse) * (speed / step)[1:])])
    t = np.interp(np.linspace(0, count[-1], int(count[-1]) + 2), count, coarse)
    path = dense(place, t, turn)
    moves = fit_moves(path, ends_only(path))
    assert worst_deviation(path, moves, place, t) <= CHORD + 1.02 * np.sqrt(3) / 2 * DIGIT
    rows, via = moves
    assert not via[[0, -1]].any()
    assert not (via[1:] & via[:-1]).any()
    assert (np.diff(rows) > 0).all()
    middle = np.flatnonzero(via)
    arcs = arcs_through(*(path.printed.position[rows[middle + k]] for k in (-1, 0, 1)))
    assert (arcs.angle[:, 1] <= MAX_ANGLE).all()
    assert (arcs.sagitta >= MIN_SAGITTA * DIGIT).all()
    # orientation: even between the places, to a digit of the text
    for n, (first, last) in enumerate(zip(rows[:-1], rows[1:], strict=True)):
        k = np.arange(first, last + 1)
        share = (path.arc[k] - path.arc[first]) / (path.arc[last] - path.arc[first])
        whole = rotation_vector(path.commanded.rotation[first].T @ path.commanded.rotation[last])
        even = path.commanded.rotation[first] @ rotation_matrix(share[:, None] * whole)
        off = rotation_vector(np.swapaxes(even, 1, 2) @ path.commanded.rotation[k])
        assert np.linalg.norm(off, axis=1).max() <= 1.1 * MDEG, n


def spiral(pitch):
    return lambda t: pitch / (2 * np.pi) * t[:, None] * np.column_stack([np.cos(t), np.sin(t), 0 * t])


def test_on_a_spiral_arcs_have_the_angle_of_the_third_order():
    """L^3 = 72 sqrt(3) chord / kappa' with kappa' = b / r^3: one angle everywhere, (72 sqrt(3) chord / b)^(1/3)."""
    pitch = 0.08
    b = pitch / (2 * np.pi)
    t = np.arange(3 * np.pi, 11 * np.pi, 0.004)
    path = dense(spiral(pitch), t, chord=CHORD)
    exact = DensePath(
        arc=path.arc, commanded=path.commanded, printed=path.commanded, digit=DIGIT, chord=CHORD, angle=1 * MDEG
    )
    rows, via = fit_moves(exact, ends_only(exact))
    ends = rows[~via]
    angle = np.diff(t[ends])[2:-2]
    expected = np.cbrt(72 * np.sqrt(3) * 0.95 * CHORD / b)
    assert angle.mean() == pytest.approx(expected, rel=0.06)


def test_a_straight_way_is_lines_and_a_circle_is_arcs_of_equal_length():
    t = np.linspace(0, 1, 101)
    line = dense(lambda t: np.column_stack([t, 0.3 * t, 0 * t]), t)
    assert not fit_moves(line, ends_only(line)).via.any()
    round_ = np.linspace(0, 2 * np.pi, 801)
    circle = dense(lambda t: 0.3 * np.column_stack([np.cos(t), np.sin(t), 0 * t]), round_)
    rows, via = fit_moves(circle, ends_only(circle))
    assert via[1::2].all()
    halves = np.diff(circle.arc[rows])
    assert halves.max() < 1.2 * halves.min()


def test_what_is_too_flat_for_three_rounded_places_is_lines():
    """On a radius of 2 km an arc of 200 mm bulges by 2.5 um: less than ten digits."""
    t = np.linspace(0, 1, 101)
    flat = dense(lambda t: np.column_stack([t, t**2 / 4000, 0 * t]), t)
    assert not fit_moves(flat, ends_only(flat)).via.any()


def test_no_statement_leads_across_an_end():
    t = np.linspace(0, 2 * np.pi, 801)
    path = dense(lambda t: 0.3 * np.column_stack([np.cos(t), np.sin(t), 0 * t]), t)
    ends = ends_only(path)
    ends[[7, 8, 9, 301, 640]] = True
    rows, via = fit_moves(path, ends)
    assert set(np.flatnonzero(ends)) <= set(rows[~via].tolist())
