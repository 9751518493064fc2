"""Surfaces against hand formulas, finite differences and the equation of the parent conic."""

import casadi as ca
import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.evaluation import evaluate
from compgen.core.exceptions import InputError
from compgen.planning import surfaces

ATOL_M = 1e-14
ORIGIN = np.array([1.2, -0.03, 0.203])

# R [m], k [-], rho [m]: the shipped optic, a steep ellipsoid, a paraboloid, a sphere, a hyperboloid, an oblate one
CONICS = [(84.0, -0.993, 14.0), (2.0, -0.5, 0.7), (3.0, -1.0, 1.0), (2.5, 0.0, 0.8), (4.0, -2.5, 2.0), (5.0, 1.5, 1.0)]


def disc(radius, count=400):
    """Points spread over a disc about the local origin, (count, 2) [m]."""
    share, turn = np.random.default_rng(84).uniform(0, 1, (2, count))
    angle, r = 2 * np.pi * turn, radius * np.sqrt(share)
    return np.column_stack([r * np.cos(angle), r * np.sin(angle)])


def sag(R, k, r2):
    """Height of the parent over its vertex, the textbook formula."""
    return r2 / (R * (1 + np.sqrt(1 - (1 + k) * r2 / R**2)))


def parent_frame(R, k, rho):
    """Where the segment stands on the parent, from the slope of the sag: origin, and axes as columns."""
    z = sag(R, k, rho**2)
    tilt = np.arctan(rho / (R - (1 + k) * z))  # dz/drho = rho / (R - (1 + k) z)
    c, s = np.cos(tilt), np.sin(tilt)
    return np.array([rho, 0, z]), np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])


def curve_derivatives(surface, xy, height):
    """First and second derivative of the lifted point along a plane curve, (M, 3) each [m]."""
    symbols = [ca.SX.sym(name, size) for name in ("xy", "xy1", "xy2", "h", "h1", "h2") for size in [2 - ("h" in name)]]
    coefficients = ca.SX.sym("surface", 15)
    xy0, xy1, xy2, h0, h1, h2 = symbols
    outputs = surfaces.curve_derivatives_expr(coefficients, (xy0, xy1, xy2), (h0, h1, h2))
    function = ca.Function("curve_derivatives", [coefficients, *symbols], [*outputs])
    first, second, extent = evaluate(function, surface.coefficients(), *xy, *(h[:, None] for h in height))
    assert np.all(extent > 0)
    return first, second


def height_over(surface, xy):
    """z of the surface over local (x, y) [m]."""
    return surface.lift(xy, np.zeros(len(xy)))[0][:, 2] - surface.origin[2]


def test_any_quadric_goes_through_its_points_square_to_its_normals():
    """One that is twisted and stands askew: its equation p' A p + b' p = 0, and the gradient of that."""
    A = np.array([[0.3, 0.2, -0.1], [0.2, -0.25, 0.15], [-0.1, 0.15, 0.2]])
    b = np.array([0.2, -0.1, 1.0])
    surface = surfaces.Quadric(ORIGIN, A, b)
    xy = disc(0.3)
    position, normal = surface.lift(xy, np.zeros(len(xy)))
    local = position - ORIGIN
    assert_allclose(local[:, :2], xy, atol=ATOL_M)
    assert_allclose(np.einsum("ni,ij,nj->n", local, A, local) + local @ b, 0, atol=ATOL_M)
    gradient = 2 * local @ A + b
    assert_allclose(normal, gradient / np.linalg.norm(gradient, axis=1)[:, None], atol=1e-13)
    assert np.ptp(local[:, 2]) > 0.05


def test_plane_is_flat_and_faces_up():
    xy = disc(1.0)
    position, normal = surfaces.plane(ORIGIN).lift(xy, np.zeros(len(xy)))
    assert_allclose(position, ORIGIN + np.column_stack([xy, np.zeros(len(xy))]), atol=0)
    assert_allclose(normal, np.tile([0, 0, 1], (len(xy), 1)), atol=0)


def test_sphere_height_is_r_minus_root():
    R, xy = 2.0, disc(1.5)
    assert_allclose(
        height_over(surfaces.conic(ORIGIN, R, 0.0, 0.0), xy), R - np.sqrt(R**2 - (xy**2).sum(1)), atol=ATOL_M
    )


def test_sphere_normal_points_at_its_centre():
    R, xy = 2.0, disc(1.0)
    position, normal = surfaces.conic(ORIGIN, R, 0.0, 0.0).lift(xy, np.zeros(len(xy)))
    centre = ORIGIN + np.array([0, 0, R])
    assert_allclose(position + R * normal, np.tile(centre, (len(xy), 1)), atol=ATOL_M)


def test_off_axis_segment_of_a_sphere_is_the_same_sphere():
    R, xy = 2.5, disc(0.5)
    assert_allclose(
        height_over(surfaces.conic(ORIGIN, R, 0.0, 0.8), xy), R - np.sqrt(R**2 - (xy**2).sum(1)), atol=ATOL_M
    )


def test_paraboloid_height_is_r2_over_2r():
    R, xy = 3.0, disc(2.0)
    assert_allclose(height_over(surfaces.conic(ORIGIN, R, -1.0, 0.0), xy), (xy**2).sum(1) / (2 * R), atol=ATOL_M)


@pytest.mark.parametrize(("R", "k"), [(2.0, -0.5), (4.0, -2.5), (5.0, 1.5), (84.0, -0.993)])
def test_conic_on_its_axis_has_the_textbook_sag(R, k):
    xy = disc(1.0)
    assert_allclose(height_over(surfaces.conic(ORIGIN, R, k, 0.0), xy), sag(R, k, (xy**2).sum(1)), atol=ATOL_M)


@pytest.mark.parametrize(("R", "k", "rho"), CONICS)
def test_segment_stands_level_on_its_origin(R, k, rho):
    position, normal = surfaces.conic(ORIGIN, R, k, rho).lift(np.zeros((1, 2)), np.zeros(1))
    assert_allclose(position[0], ORIGIN, atol=ATOL_M)
    assert_allclose(normal[0], [0, 0, 1], atol=1e-15)


@pytest.mark.parametrize(("R", "k", "rho"), CONICS)
def test_points_of_the_segment_lie_on_the_parent(R, k, rho):
    xy = disc(0.6)
    local = np.column_stack([xy, height_over(surfaces.conic(np.zeros(3), R, k, rho), xy)])
    p0, axes = parent_frame(R, k, rho)
    x, y, z = (p0 + local @ axes.T).T
    assert_allclose(z, sag(R, k, x**2 + y**2), atol=1e-13)
    assert np.ptp(local[:, 2]) > 1e-3  # m: the set-up bites, the surface is not flat


@pytest.mark.parametrize(("R", "k", "rho"), CONICS)
def test_local_x_points_away_from_the_parents_axis(R, k, rho):
    """A tall ellipsoid flattens outwards, so the meridian must be on the right side."""
    h = 0.3
    z = height_over(surfaces.conic(np.zeros(3), R, k, rho), np.array([[h, 0.0], [-h, 0.0]]))
    p0, axes = parent_frame(R, k, rho)
    radius = np.hypot(*(p0 + np.array([[h, 0, z[0]], [-h, 0, z[1]]]) @ axes.T)[:, :2].T)
    assert radius[0] > rho > radius[1]


@pytest.mark.parametrize(("R", "k", "rho"), CONICS)
def test_normal_agrees_with_the_slope_of_the_height(R, k, rho):
    surface, xy, h = surfaces.conic(ORIGIN, R, k, rho), disc(0.5), 1e-5
    slopes = [(height_over(surface, xy + d) - height_over(surface, xy - d)) / (2 * h) for d in ([h, 0], [0, h])]
    want = np.column_stack([-slopes[0], -slopes[1], np.ones(len(xy))])
    want /= np.linalg.norm(want, axis=1, keepdims=True)
    _, normal = surface.lift(xy, np.zeros(len(xy)))
    assert_allclose(normal, want, atol=1e-9)


def test_lift_goes_along_the_normal():
    surface, xy, height = surfaces.conic(ORIGIN, 2.0, -0.5, 0.7), disc(0.5), np.full(400, 0.02)
    foot, normal = surface.lift(xy, np.zeros(400))
    above, same = surface.lift(xy, height)
    assert_allclose(above - foot, 0.02 * normal, atol=ATOL_M)
    assert_allclose(same, normal, atol=0)


def curve(t):
    """A plane curve with everything in it, and its first two derivatives."""
    p = np.column_stack([0.2 * np.cos(2 * t) + 0.1 * t**3, 0.3 * np.sin(t) - 0.1 * t**2])
    d1 = np.column_stack([-0.4 * np.sin(2 * t) + 0.3 * t**2, 0.3 * np.cos(t) - 0.2 * t])
    d2 = np.column_stack([-0.8 * np.cos(2 * t) + 0.6 * t, -0.3 * np.sin(t) - 0.2])
    return p, d1, d2


@pytest.mark.parametrize(("R", "k", "rho"), CONICS)
@pytest.mark.parametrize("h", [(0.0, 0.0), (0.05, 0.0), (0.02, -0.03)])
def test_first_derivative_along_a_curve(R, k, rho, h):
    surface, t, d = surfaces.conic(ORIGIN, R, k, rho), np.linspace(-0.8, 0.8, 33), 1e-5
    first, _ = curve_derivatives(surface, curve(t), (h[0] + h[1] * t, np.full(33, h[1]), np.zeros(33)))
    ahead, behind = (surface.lift(curve(t + e)[0], h[0] + h[1] * (t + e))[0] for e in (d, -d))
    assert_allclose(first, (ahead - behind) / (2 * d), atol=1e-9)


@pytest.mark.parametrize(("R", "k", "rho"), CONICS)
def test_second_derivative_along_a_curve_on_the_surface(R, k, rho):
    surface, t, d = surfaces.conic(ORIGIN, R, k, rho), np.linspace(-0.8, 0.8, 33), 1e-5
    zero = (np.zeros(33), np.zeros(33), np.zeros(33))
    _, second = curve_derivatives(surface, curve(t), zero)
    ahead, behind = (curve_derivatives(surface, curve(t + e), zero)[0] for e in (d, -d))
    assert_allclose(second, (ahead - behind) / (2 * d), atol=1e-8)


def test_second_derivative_of_a_curve_above_a_plane():
    surface, t, d = surfaces.plane(ORIGIN), np.linspace(-0.8, 0.8, 33), 1e-5

    def height(t):
        return 0.02 - 0.03 * t + 0.05 * t**3, -0.03 + 0.15 * t**2, 0.3 * t

    first, second = curve_derivatives(surface, curve(t), height(t))
    places = [surface.lift(curve(t + e)[0], height(t + e)[0])[0] for e in (d, -d)]
    assert_allclose(first, (places[0] - places[1]) / (2 * d), atol=1e-9)
    ahead, behind = (curve_derivatives(surface, curve(t + e), height(t + e))[0] for e in (d, -d))
    assert_allclose(second, (ahead - behind) / (2 * d), atol=1e-8)


def test_a_move_along_the_normal_has_no_second_derivative():
    surface, still = surfaces.conic(ORIGIN, 2.0, -0.5, 0.7), np.zeros((5, 2))
    first, second = curve_derivatives(
        surface, (disc(0.5, 5), still, still), (np.linspace(0, 0.02, 5), np.full(5, 0.02), np.zeros(5))
    )
    assert not second.any()
    assert_allclose(np.linalg.norm(first, axis=1), 0.02, atol=ATOL_M)


def test_surface_that_ends_inside_the_path_is_refused():
    with pytest.raises(InputError, match="radius_of_curvature_m"):
        height_over(surfaces.conic(ORIGIN, 0.5, 0.0, 0.0), np.array([[0.0, 0.0], [0.6, 0.0]]))


def test_segment_beyond_its_parent_is_refused():
    with pytest.raises(InputError, match=r"off_axis_m: 3\.0"):
        surfaces.conic(ORIGIN, 2.0, 0.0, 3.0)
