"""Triangle meshes: files, what is over a place, patterns laid onto them, and one line for what is refused."""

import struct
from dataclasses import replace

import numpy as np
import pytest
from meshes import binary, grid_mesh, rounded_plate, strip_mesh
from numpy.testing import assert_allclose

from compgen.core.exceptions import InputError
from compgen.core.units import DEG, MM, UM
from compgen.planning import boundaries, patterns
from compgen.planning.mesh import Mesh, read_stl
from compgen.planning.own_points.pattern_on_mesh import lay
from compgen.planning.own_points.space_curve import Tolerance, space_curve
from compgen.planning.own_points.tool_stands import place_points
from compgen.planning.surfaces import plane

NO_SHIFT = np.zeros(3)


def box(low, high):
    """The twelve facets of a box, counter-clockwise from outside."""
    x, y, z = zip(low, high, strict=True)
    p = np.array([[x[i], y[j], z[k]] for k in (0, 1) for j in (0, 1) for i in (0, 1)])
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return np.array([p[[q[0], q[k], q[k + 1]]] for q in quads for k in (1, 2)])


def text(corners, keyword="vertex"):
    facets = [
        "facet normal 0 0 1\n outer loop\n"
        + "".join(f"  {keyword} {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in facet * 1e3)
        + " endloop\nendfacet\n"
        for facet in corners
    ]
    return ("solid part\n" + "".join(facets) + "endsolid part\n").encode()


@pytest.mark.parametrize("form", [binary, text, lambda c: text(c, "VERTEX")])
def test_both_kinds_of_file_say_the_same(tmp_path, form):
    corners = box((-0.03, -0.02, 0), (0.03, 0.02, 0.01))
    (tmp_path / "part.stl").write_bytes(form(corners))
    assert_allclose(read_stl(tmp_path / "part.stl"), corners, atol=1e-9)


def test_a_binary_file_may_begin_with_solid(tmp_path):
    content = b"solid".ljust(80) + binary(box((0, 0, 0), (1, 1, 1)))[80:]
    (tmp_path / "part.stl").write_bytes(content)
    assert read_stl(tmp_path / "part.stl").shape == (12, 3, 3)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "0 bytes are no STL file"),
        (binary(box((0, 0, 0), (1, 1, 1)))[:-7], "cut off: 12 facets need 684 bytes, and it has 677"),
        (b"x".ljust(80) + struct.pack("<I", 0), "no facets"),
        (text(box((0, 0, 0), (1, 1, 1)))[:-20], "cut off after line"),
        (
            text(box((0, 0, 0), (1, 1, 1))).replace(b"vertex 0 1000 0", b"vertex 0 1o00 0", 1),
            "line 5: a vertex has three",
        ),
        (
            text(box((0, 0, 0), (1, 1, 1))).replace(b"vertex 0 1000 0", b"vertex 0 1000", 1),
            "line 5: a vertex has three",
        ),
        (text(np.full((1, 3, 3), np.nan)), "facet 1: a coordinate is not a number"),
        (binary(np.full((1, 3, 3), 1e3)), "facet 1: a coordinate is not a number, or beyond 100000 mm"),
        (b"x".ljust(80) + struct.pack("<I12IH", 1, *[0x7FA00000] * 12, 0), "facet 1: a coordinate is not a number"),
        (b"solid part\nendsolid part\n", "no facets"),
        (
            b"x".ljust(80) + struct.pack("<I", 7) + binary(box((0, 0, 0), (1, 1, 1)))[84:],
            "its count says 7 facets, and it has room for 5 more",
        ),
        (
            text(box((0, 0, 0), (1, 1, 1))).replace(b" endloop", b"  vertex 0 0 0\n endloop"),
            "line 8: a facet with 4 vertices",
        ),
        (
            text(box((0, 0, 0), (1, 1, 1))).replace(b"outer loop\n  ", b"outer loop "),
            "line 6: a facet with 2 vertices",
        ),
    ],
)
def test_a_bad_file_is_refused_in_one_line(tmp_path, content, words):
    (tmp_path / "part.stl").write_bytes(content)
    with pytest.raises(InputError) as refusal:
        read_stl(tmp_path / "part.stl")
    assert words in str(refusal.value)
    assert "\n" not in str(refusal.value)
    assert len(str(refusal.value)) <= 300 + len(str(tmp_path))


def brute_force(corners, xy):
    """The highest point of all facets over each place, one facet at a time."""
    height = np.full(len(xy), np.nan)
    for a, b, c in corners:
        m = np.column_stack([b[:2] - a[:2], c[:2] - a[:2]])
        if abs(np.linalg.det(m)) < 1e-15 or np.cross(b - a, c - a)[2] <= 0:
            continue
        u = np.linalg.solve(m, (xy - a[:2]).T).T
        inside = (u >= -1e-9).all(axis=1) & (u.sum(axis=1) <= 1 + 1e-9)
        z = a[2] + u @ np.array([b[2] - a[2], c[2] - a[2]])
        height = np.where(inside & ~(z <= height), z, height)
    return height


@pytest.mark.parametrize("seed", range(6))
def test_heights_are_those_of_brute_force(seed):
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-0.1, 0.1, (60, 3, 3)) * [1, 1, 0.2] * rng.choice([0.1, 1.0], (60, 1, 1))
    mesh, xy = Mesh.of_corners(corners), rng.uniform(-0.12, 0.12, (400, 2))
    over = mesh.over(xy)
    assert_allclose(over.height, brute_force(corners, xy), atol=1e-12)
    assert ((over.facet < 0) == np.isnan(over.height)).all()


def test_a_box_is_closed_and_a_skin_is_not():
    corners = box((0, 0, 0), (1, 2, 3))
    assert len(Mesh.of_corners(corners).open_edges()) == 0
    assert len(Mesh.of_corners(corners[1:]).open_edges()) == 3
    assert len(Mesh.of_corners(np.concatenate([corners, corners[:1]])).open_edges()) > 0
    assert len(Mesh.of_corners(corners[:, ::-1]).open_edges()) == 0


def test_normals_run_on_over_a_smooth_surface():
    mesh = Mesh.of_corners(grid_mesh(lambda x, y: (x * x + y * y) / 2))
    xy = np.random.default_rng(1).uniform(-0.09, 0.09, (500, 2))
    normal = np.column_stack([-xy, np.ones(500)])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    assert np.abs(mesh.over(xy).normal - normal).max() < 2e-4
    assert np.abs(mesh.over(xy).height - (xy**2).sum(axis=1) / 2).max() < 0.005**2 / 8 * 2


def laid_raster(mesh, tool_radius=0.0, lift=0.02, half=0.06, one_way=False):
    edge = boundaries.round_part(2 * half)
    sweeps = patterns.raster(edge, 0.02, 0.005, smooth=False)
    if one_way:
        sweeps = patterns.one_way_raster(edge, 0.02, 0.005, lift)
    return lay(sweeps, edge, mesh, NO_SHIFT, "part.stl", 10 * UM, tool_radius)


@pytest.mark.parametrize("one_way", [False, True])
def test_a_raster_lies_on_the_mesh(one_way):
    mesh = Mesh.of_corners(grid_mesh(lambda x, y: 0.02 * np.sin(10 * x) * np.cos(8 * y)))
    laid = laid_raster(mesh, one_way=one_way)
    points = laid.points
    on = points.contact & (np.hypot(*points.position[:, :2].T) < 0.0599)
    surface = 0.02 * np.sin(10 * points.position[:, 0]) * np.cos(8 * points.position[:, 1])
    assert np.abs(points.position[on, 2] - surface[on]).max() < 2e-5
    assert laid.on_mesh == 1
    assert np.linalg.norm(np.diff(points.position, axis=0), axis=1).min() > 1e-9
    # it stops at every corner: two for each of the five ways between six sweeps, and at the end
    assert points.stop.sum() == (4 * 5 + 1 if one_way else 2 * 5 + 1)
    if one_way:
        off = ~points.contact & ~np.append(False, points.contact[:-1]) & (np.abs(points.position[:, 0]) < 0.02)
        assert np.abs(points.position[off, 2] - surface[off] - 0.02).max() < 2e-3


def test_off_the_mesh_there_is_no_contact():
    mesh = Mesh.of_corners(grid_mesh(lambda x, y: 0 * x, half=0.03))
    laid = laid_raster(mesh)
    inside = (np.abs(laid.points.position[:, :2]) < 0.0301).all(axis=1)
    assert not laid.points.contact[~inside].any()
    assert 0.2 < laid.on_mesh < 0.4
    assert_allclose(laid.points.position[:, 2], 0, atol=1e-12)


SLOPE, DOME = (lambda x, y: 0.3 * x - 0.1 * y), (lambda x, y: 0.02 - 5 * (x * x + y * y))


@pytest.mark.parametrize("turn", ["square", "smooth", "one way"])
@pytest.mark.parametrize("lead", [0.002, 0.005])
@pytest.mark.parametrize(
    ("height", "n"), [(SLOPE, 15), (SLOPE, 101), (DOME, 101), (lambda x, y: 0.01 * np.sin(20 * x + y), 101)]
)
def test_the_curve_keeps_to_the_surface_up_to_the_edge_of_the_mesh(height, n, lead, turn):
    """The way out bends behind the edge: a smooth curve would cut a corner there, 27 um and more below the surface.

    Between the last point on the mesh and the edge the tool is on the part, too: 0.5 mm below it, on a coarse mesh.
    """
    half, tolerance, part = 0.0437, 10 * UM, boundaries.round_part(0.09)
    sweeps = patterns.raster(part, 0.02, lead, smooth=turn == "smooth")
    if turn == "one way":
        sweeps = patterns.one_way_raster(part, 0.02, lead, 0.02)
    mesh = Mesh.of_corners(grid_mesh(height, half=half, n=n))
    x, y, z, working = along_the_curve(sweeps, part, mesh, tolerance)
    above = z - height(x, y)
    beside = half - np.maximum(np.abs(x), np.abs(y))
    at_edge = (beside > 0) & (beside < 2 * MM)
    assert at_edge.sum() > 100
    assert above[at_edge].min() > -1.2 * tolerance
    assert above[at_edge & (working if turn == "one way" else True)].max() < 1.2 * tolerance  # one way: lifted back
    # and off the part it goes down no further than the bend behind an edge needs
    assert z.min() > height(x, y)[beside > 0].min() - 0.3 * 10 * MM


def along_the_curve(sweeps, part, mesh, tolerance):
    """x, y and z of a hundred places on each piece of a pattern's curve on a mesh, and where the tool touches."""
    points = lay(sweeps, part, mesh, NO_SHIFT, "part.stl", tolerance, 0.0).points
    local = place_points(points, plane(NO_SHIFT), 0.0, 1.0)
    curve = space_curve(local, Tolerance(tolerance, 0.2 * DEG, 30 * DEG, exact=False)).curve
    pieces, t = np.repeat(np.arange(len(curve.poly)), 100), np.tile(np.linspace(0, 1, 100), len(curve.poly))
    return *curve.derivatives(pieces, t)[0].T, curve.height(pieces, t)[0], curve.working[pieces]


@pytest.mark.parametrize(("radius_mm", "turn_deg", "strips"), [(5, 60, 16), (5, 45, 4), (20, 45, 4), (50, 30, 3)])
def test_between_its_points_the_curve_keeps_to_a_mesh_that_bends(radius_mm, turn_deg, strips):
    """Points were 2 mm apart wherever facets are long: the curve was 24 to 70 um below roundings, tolerance 10."""
    tolerance, half, radius = 10 * UM, 60 * MM, radius_mm * MM
    turn = np.linspace(0, turn_deg * DEG, strips + 1)
    x = half + radius * (np.sin(turn) - np.sin(turn[-1]))
    profile = np.concatenate([-x[::-1], x]), radius * (np.cos(np.concatenate([turn[::-1], turn])) - 1)
    part = boundaries.rectangle(2 * half - 2 * MM, 0.08, 0.0)
    sweeps = patterns.raster(part, 0.02, 1 * MM, smooth=False)
    x, _, z, working = along_the_curve(sweeps, part, Mesh.of_corners(strip_mesh(*profile)), tolerance)
    slope = (np.diff(profile[1]) / np.diff(profile[0]))[np.searchsorted(profile[0], x[working]) - 1]
    off = (z - np.interp(x, *profile))[working] / np.hypot(1.0, slope)
    assert np.abs(off).max() < 2 * tolerance


@pytest.mark.parametrize("half", [0.0532, 0.0548, 0.0582])
def test_behind_a_rounding_that_ends_upright_the_way_does_not_fall_beside_the_part(half):
    """Its plane at the last point falls by 80 deg: the tool went down to 150 mm beside a plate 25 mm thick."""
    mesh, part = Mesh.of_corners(rounded_plate()), boundaries.rectangle(2 * half, 0.08, 0.0)
    laid = lay(patterns.raster(part, 0.02, 0.01, smooth=False), part, mesh, NO_SHIFT, "part.stl", 10 * UM, 0.0)
    assert laid.points.position[:, 2].min() > -(5 + 8) * MM  # the rounding, and what the bend behind it needs


def test_a_place_on_a_mesh_is_named_by_where_it_is():
    """A tool that has no x axis there was refused at *line 26* of a binary file."""
    mesh, part = Mesh.of_corners(rounded_plate()), boundaries.rectangle(0.11, 0.08, 0.0)
    points = lay(
        patterns.raster(part, 0.02, 0.005, smooth=False), part, mesh, NO_SHIFT, "part.stl", 10 * UM, 0.0
    ).points
    upright = replace(points, normal=np.tile([1.0, 0, 0], (len(points.position), 1)))
    with pytest.raises(InputError, match=r"part\.stl: at x -60\.0, y -30\.0 mm: the normal points along the tool's x"):
        place_points(upright, plane(NO_SHIFT), 0.0, 1.0)


def test_long_strips_of_a_cylinder_stand_off_it_across_and_not_along():
    """The note said 1,067 um of 41: an edge from end to end counted with a turn across it."""
    turn = np.linspace(-0.8, 0.8, 26)
    mesh, part = Mesh.of_corners(strip_mesh(0.08 * np.sin(turn), 0.08 * np.cos(turn))), boundaries.round_part(0.08)
    laid = lay(patterns.raster(part, 0.02, 0.005, smooth=False), part, mesh, NO_SHIFT, "part.stl", 10 * UM, 0.0)
    assert laid.facets == pytest.approx(0.08 * (1 - np.cos(0.032)), rel=0.01)


def test_a_way_between_sweeps_goes_through_no_side_of_a_face_that_is_worked():
    """Two faces are worked, one 50 mm higher: the way to the next sweep, 20 mm above the lower one, meets its side."""
    block = grid_mesh(lambda x, y: 0 * x + 0.07, half=0.012) + np.array([0, -0.04, 0])
    mesh = Mesh.of_corners(np.concatenate([grid_mesh(bump, half=0.06), block]))
    part = boundaries.rectangle(0.02, 0.1, 0.0)
    with pytest.raises(InputError, match=r"runs into the mesh at .* is 30\.\d mm higher there; keep off it"):
        lay(patterns.one_way_raster(part, 0.04, 0.005, 0.02), part, mesh, NO_SHIFT, "part.stl", 10 * UM, 0.0)


def test_a_sweep_one_way_has_no_piece_without_length():
    """An end and the start behind it differ in the last digit: the piece between them ended in a fault on a mesh."""
    for diameter in np.linspace(0.03, 0.12, 46):
        sweeps = patterns.one_way_raster(boundaries.round_part(diameter), 0.0176, 0.0108, 0.02)
        assert (np.hypot(*sweeps.poly[:, 1].T) + np.abs(sweeps.lift[:, 1]) > 1e-6).all()


def test_a_lower_face_beside_what_the_tool_works_is_no_way_down():
    """A part on a table: a sweep's end beyond the part is not at the height of the table, with the part in its way."""
    top, table = grid_mesh(bump, half=0.05), grid_mesh(lambda x, y: 0 * x - 0.05)
    mesh = Mesh.of_corners(np.concatenate([top, table]))
    boundary = boundaries.round_part(0.08)
    laid = lay(patterns.raster(boundary, 0.02, 0.02, smooth=False), boundary, mesh, NO_SHIFT, "part.stl", 10 * UM, 0.0)
    position = laid.points.position
    assert np.abs(position[:, 0]).max() > 0.055
    assert position[:, 2].min() > bump(0.05, 0.03) - 0.2 * 10 * MM * 0.1  # slopes differ by 0.1 at most
    assert laid.on_mesh == 1


def test_a_higher_face_beside_what_the_tool_works_is_refused_and_not_climbed():
    block = grid_mesh(lambda x, y: 0 * x + 0.09, half=0.02)
    mesh = Mesh.of_corners(np.concatenate([grid_mesh(bump, half=0.05), block + np.array([0.072, 0, 0])]))
    boundary = boundaries.round_part(0.08)
    with pytest.raises(InputError, match=r"runs into the mesh at x 58\.\d, y -19\.\d mm.* is 71\.\d mm higher there"):
        lay(patterns.raster(boundary, 0.02, 0.02, smooth=False), boundary, mesh, NO_SHIFT, "part.stl", 10 * UM, 0.0)
    short = lay(
        patterns.raster(boundary, 0.02, 0.005, smooth=False), boundary, mesh, NO_SHIFT, "part.stl", 10 * UM, 0.0
    )
    assert short.points.position[:, 2].max() < 0.0201


def test_the_sharpest_hollow_is_that_of_the_sphere():
    mesh = Mesh.of_corners(grid_mesh(lambda x, y: -np.sqrt(0.25 - x * x - y * y)))
    assert laid_raster(mesh).hollow == pytest.approx(0.5, rel=0.02)
    saddle = Mesh.of_corners(grid_mesh(lambda x, y: x * x / 0.6 - y * y / 0.2))
    assert laid_raster(saddle).hollow == pytest.approx(0.3, rel=0.02)
    dome = Mesh.of_corners(grid_mesh(lambda x, y: np.sqrt(0.25 - x * x - y * y)))
    assert laid_raster(dome, 0.2).hollow == np.inf
    steep, table = grid_mesh(lambda x, y: 0.02 - 5 * (x * x + y * y), half=0.05), grid_mesh(lambda x, y: 0 * x - 0.05)
    assert laid_raster(Mesh.of_corners(np.concatenate([steep, table])), 0.06, half=0.045).hollow == np.inf


@pytest.mark.parametrize(
    ("height", "half", "tool_radius", "words"),
    [
        (lambda x, y: -np.sqrt(0.25 - x * x - y * y), 0.1, 0.6, "has a radius of 49"),
        (lambda x, y: 2 * np.abs(x), 0.1, 0.0, "a sharp edge under the path at x"),
        (
            lambda x, y: 0 * x,
            0.001,
            0.0,
            "it covers x 499 to 501, y -1 to 1 mm, the path x -64 to 65, y -50 to 50; is it in metres?",
        ),
    ],
)
def test_what_no_tool_can_follow_is_refused(height, half, tool_radius, words):
    mesh = Mesh.of_corners(grid_mesh(height, half=half) + (np.array([0.5, 0, 0]) if half < 0.01 else 0))
    with pytest.raises(InputError) as refusal:
        laid_raster(mesh, tool_radius)
    assert words in str(refusal.value)
    assert len(str(refusal.value)) <= 300


def bump(x, y):
    return 0.02 - (x * x + y * y) / 2


def test_triangles_that_face_down_are_told_and_not_that_the_mesh_is_elsewhere():
    corners = grid_mesh(bump)
    laid_raster(Mesh.of_corners(corners))
    with pytest.raises(InputError, match=r"inside out: the triangle on top at x .* faces down .*turn its normals"):
        laid_raster(Mesh.of_corners(corners[:, ::-1]))
    half = corners.copy()
    half[::2] = half[::2, ::-1]
    with pytest.raises(InputError, match="inside out: the triangle on top"):
        laid_raster(Mesh.of_corners(half))


def test_a_body_that_is_inside_out_is_told():
    body = box((-0.1, -0.1, -0.05), (0.1, 0.1, 0.0))
    laid_raster(Mesh.of_corners(body))
    with pytest.raises(InputError, match=r"part\.stl: inside out: .*turn its normals"):
        laid_raster(Mesh.of_corners(body[:, ::-1]))


def test_a_skin_over_its_own_underside_is_no_fault():
    lower = grid_mesh(lambda x, y: bump(x, y) - 0.01)[:, ::-1]
    laid_raster(Mesh.of_corners(np.concatenate([grid_mesh(bump), lower])))


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_part_that_is_inside_out_is_refused_and_not_driven_through(mirrored):
    """Its facets that face up are those of its bottom: the tool would go there, through the part."""
    top = grid_mesh(lambda x, y: 0 * x)
    part = np.concatenate([top, top[:, ::-1] - [0, 0, 0.1]])
    laid = laid_raster(Mesh.of_corners(part))
    assert_allclose(laid.points.position[laid.points.contact, 2], 0, atol=1e-12)
    turned = part * [-1, 1, 1] if mirrored else part[:, ::-1]
    with pytest.raises(InputError, match=r"part\.stl: inside out: the triangle on top at x .* faces down"):
        laid_raster(Mesh.of_corners(turned))


def test_facets_that_are_turned_are_no_hole():
    corners = grid_mesh(lambda x, y: 0 * x)
    turned = (np.abs(corners.mean(axis=1)[:, :2]) < 0.02).all(axis=1)
    corners[turned] = corners[turned, ::-1]
    with pytest.raises(InputError, match="inside out"):
        laid_raster(Mesh.of_corners(corners))


def test_an_overhang_and_a_knife_edge_are_not_inside_out():
    """A bracket over a plate: its lower side faces down, below its upper one."""
    plate, bracket = box((-0.1, -0.1, -0.1), (0.1, 0.1, 0.0)), box((-0.2, -0.2, 0.05), (0.2, 0.2, 0.06))
    assert laid_raster(Mesh.of_corners(np.concatenate([plate, bracket]))).on_mesh == 1
    a, b, c, d = np.array([[-0.2, -0.2, 0], [0.2, -0.2, 0], [0.0, 0.2, 0], [0, 0, -0.1]])
    wedge = np.array([[a, b, c], [a, d, b], [b, d, c], [c, d, a]])
    assert laid_raster(Mesh.of_corners(wedge)).on_mesh > 0.5


def test_a_face_over_another_with_no_wall_between_is_refused():
    """No facet turns at such a step: the tool would be driven through the upper face."""
    skin, plate = grid_mesh(lambda x, y: 0 * x), grid_mesh(lambda x, y: 0 * x + 0.003, half=0.02)
    with pytest.raises(
        InputError, match=r"part\.stl: a step or .* under the path at x .* is 3 mm higher [\d.]+ mm further; keep"
    ):
        laid_raster(Mesh.of_corners(np.concatenate([skin, plate])))


@pytest.mark.parametrize("depth", [0.02, 0.1, 0.2])
def test_walls_do_not_lean_the_face_that_they_end_at(depth):
    """Two triangles to each side of a block: its corners are where they meet, and its face is flat up to them."""
    mesh = Mesh.of_corners(box((-0.1, -0.1, -depth), (0.1, 0.1, 0.0)))
    assert_allclose(mesh.over(np.random.default_rng(3).uniform(-0.1, 0.1, (500, 2))).normal, [[0, 0, 1]] * 500, atol=0)
    laid = laid_raster(mesh)
    assert_allclose(laid.points.normal, [[0, 0, 1]] * len(laid.points.normal), atol=1e-12)
    assert laid.facets == 0


def test_an_edge_between_two_points_is_found_where_neither_facet_turns():
    """Two faces of a roof, of two triangles each: no point's facet leans from its own normal."""
    a, b, c, d, e, f = np.array([[-1, -1, 0], [0, -1, 0.5], [1, -1, 0], [-1, 1, 0], [0, 1, 0.5], [1, 1, 0]]) * 0.1
    roof = np.array([[a, b, e], [a, e, d], [b, c, f], [b, f, e]])
    with pytest.raises(InputError, match=r"a sharp edge under the path at x .*: facets turn by 53 deg"):
        laid_raster(Mesh.of_corners(roof))


@pytest.mark.parametrize("step", [0.0003, 0.00005])
def test_a_low_step_is_refused(step):
    """Less than the points are apart, and more than the path's tolerance."""
    low, high = box((-0.1, -0.1, -0.01), (0.0035, 0.1, 0.0)), box((0.0035, -0.1, -0.01), (0.1, 0.1, step))
    with pytest.raises(InputError, match=rf"a step or .* the mesh is {step * 1e3:g} mm higher [\d.]+ mm further"):
        laid_raster(Mesh.of_corners(np.concatenate([low, high])))
