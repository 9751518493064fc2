"""The user's own points through the whole chain: corrected, proven against the user's curve, timed at their feeds."""

import re
from dataclasses import replace

import numpy as np
import pytest
from meshes import binary, grid_mesh, rounded_plate
from numpy.testing import assert_allclose
from shipped import quiet

from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Level
from compgen.core.pose import Pose
from compgen.core.rotations import from_wpr
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned.generate import generate
from compgen.pipelines.planned.written_program import fly_written
from compgen.planning.own_points import tables
from compgen.planning.own_points.given_points import GivenArcs


def job_of(folder, rows, header="x_mm,y_mm,z_mm", pattern="points", name="given.csv", extra="", warm=True):
    text = rows if isinstance(rows, str) else "\n".join([header, *(",".join(f"{v:.9g}" for v in r) for r in rows)])
    (folder / name).write_text(text)
    before = '[[before]]\nstate = "moving"\nfeed_mm_s = 200\nduration_h = 3\n' if warm else ""
    (folder / "own.toml").write_text(
        f'[path]\npattern = "{pattern}"\nfile = "{name}"\n{extra}\n[process]\nfeed_mm_s = 100\n{before}'
        "[bounds]\nmax_um = 4\n"
    )
    return load_job(str(folder / "own.toml"))


def circle(M, radius=200.0, centre=(1100.0, 0.0, 100.0)):
    t = np.linspace(0, 2 * np.pi, M)
    return np.column_stack([centre[0] + radius * np.cos(t), centre[1] + radius * np.sin(t), np.full(M, centre[2])])


def test_points_of_a_circle_are_corrected_as_the_circle_is(tmp_path):
    planned, corrected = generate(job_of(tmp_path, circle(2000)), quiet)
    (tmp_path / "own.toml").write_text(
        '[path]\npattern = "circle"\ndiameter_mm = 400\nx_mm = 1100\ny_mm = 0\nz_mm = 100\n[process]\nfeed_mm_s = 100\n'
        '[[before]]\nstate = "moving"\nfeed_mm_s = 200\nduration_h = 3\n[bounds]\nmax_um = 4\n'
    )
    pattern, other = generate(load_job(str(tmp_path / "own.toml")), quiet)
    assert corrected.inside
    before, after = (r.deviation.on_part["total"].max for r in (corrected, other))
    assert before < 4e-6
    assert_allclose(before, after, atol=5e-7)
    assert_allclose(planned.deviation().on_part["total"].max, pattern.deviation().on_part["total"].max, rtol=1e-2)
    # a user's lines are as long as they are: each lasts up to one period of 8 ms more
    later = corrected.trajectory.time[-1] - other.trajectory.time[-1]
    assert 0 <= later <= 8e-3 * len(corrected.trajectory.time)


def test_the_twin_judges_against_the_user_s_curve(tmp_path):
    job = job_of(tmp_path, circle(2000))
    _, corrected = generate(job, quiet)
    execution = corrected.execution()
    work = np.abs(execution.actual.position[:, 2] - 0.1) < 1e-5
    radius = np.hypot(*(execution.actual.position[work, :2] - [1.1, 0.0]).T)
    assert work.sum() > 100
    assert np.abs(radius - 0.2).max() < 2e-6 + corrected.deviation.on_part["total"].max


def test_each_stretch_is_driven_at_its_own_feed(tmp_path):
    x = np.linspace(900, 1300, 401)
    rows = np.column_stack([x, 20 * np.sin(x / 40), 100 + 0 * x, np.where(x > 1100, 40, 80)])
    _, corrected = generate(job_of(tmp_path, rows, "x_mm,y_mm,z_mm,feed_mm_s", warm=False), quiet)
    speed = corrected.program.speed
    places = corrected.program.position[1:]
    work = np.abs(places[:, 2] - 0.1) < 1e-5
    slow, fast = speed[work & (places[:, 0] > 1.16)], speed[work & (places[:, 0] < 1.04) & (places[:, 0] > 0.95)]
    assert slow.max() <= 0.0401
    assert np.median(fast) == pytest.approx(0.08, rel=0.02)
    assert fast.max() <= 0.0801


@pytest.mark.parametrize(
    ("pattern", "text"),
    [
        (
            "apt",
            "UNITS/MM\nFEDRAT/3000\n" + "".join(f"GOTO/{900 + 4 * k},{0.01 * k * k},100,0,0,1\n" for k in range(80)),
        ),
        ("gcode", "G21 G90\nG0 X1000 Y-50 Z100\nG1 X1100 F3000\nG3 X1100 Y50 I0 J50\nG1 X1000\n"),
    ],
)
def test_toolpaths_of_cam_end_inside(tmp_path, pattern, text):
    _, corrected = generate(job_of(tmp_path, text, pattern=pattern, name="cam.txt"), quiet)
    assert corrected.inside
    assert corrected.deviation.on_part["total"].max < 4e-6


def test_the_points_are_an_input_like_any_other(tmp_path):
    first = job_of(tmp_path, circle(200)).inputs_hash
    assert job_of(tmp_path, circle(201)).inputs_hash != first
    assert job_of(tmp_path, circle(200)).inputs_hash == first


def test_normals_beside_a_curved_surface_are_refused(tmp_path):
    rows = np.column_stack([circle(50), np.tile([0, 0, 1], (50, 1))])
    job_of(tmp_path, rows, "x_mm,y_mm,z_mm,i,j,k")
    text = (tmp_path / "own.toml").read_text()
    surface = '[surface]\nkind = "conic"\nradius_of_curvature_m = 3\nconic_constant = 0\noff_axis_m = 0\n'
    (tmp_path / "own.toml").write_text(text + surface)
    with pytest.raises(InputError, match=r"surface\.kind: the points of .* say themselves how the tool stands"):
        load_job(str(tmp_path / "own.toml"))


def test_what_the_curve_makes_of_the_points_is_told(tmp_path):
    square = [(1000 + x, y, 100.0) for x, y in ((0, 0), (50, 0), (100, 0), (100, 50), (100, 100))]
    note = next(f for f in job_of(tmp_path, np.array(square)).input_findings if f.code == "path.points")
    assert "it stops at 1 corner (" in note.message


def test_points_on_a_line_leave_no_line(tmp_path):
    straight = [[5.0 * k, 0, 0] for k in range(8)]
    note = next(f for f in job_of(tmp_path, np.array(straight)).input_findings if f.code == "path.points")
    assert note.message.endswith("by up to 0 mm")  # 8.67e-16 was said


def mesh_job(folder, corners, path, surface="", boundary=""):
    (folder / "part.stl").write_bytes(binary(corners))
    (folder / "part.toml").write_text(
        f'[path]\n{path}\n[surface]\nkind = "stl"\nfile = "part.stl"\n{surface}\n{boundary}\n[frame]\nnumber = 1\n'
        "x_mm = 1100\ny_mm = -50\nz_mm = 100\nw_deg = 2\n[process]\nfeed_mm_s = 100\n[[before]]\n"
        'state = "moving"\nfeed_mm_s = 200\nduration_h = 3\n[bounds]\nmax_um = 4\n'
    )
    return load_job(str(folder / "part.toml"))


RASTER = 'pattern = "raster"\nstepover_mm = 30\ndiameter_mm = 150\nx_mm = 0\ny_mm = 0\nz_mm = 0'
SPIRAL = 'pattern = "spiral"\nturns = 3\ndiameter_mm = 150\nx_mm = 5\ny_mm = 0\nz_mm = 0'
SKIN = "open = true\ntolerance_um = 5"


@pytest.mark.parametrize("path", [RASTER, SPIRAL])
def test_a_pattern_on_a_mesh_is_driven_on_the_smooth_surface(tmp_path, path):
    _, corrected = generate(mesh_job(tmp_path, grid_mesh(bowl, n=81), path, SKIN), quiet)
    assert corrected.inside
    frame = Pose(np.array([1.1, -0.05, 0.1]), from_wpr(*(np.array([np.deg2rad(a)]) for a in (2, 0, 0)))[0])
    actual = frame.inverse() @ corrected.execution().actual
    work = np.hypot(*actual.position[:, :2].T) < 0.07
    low = work & (actual.position[:, 2] < bowl(*actual.position[:, :2].T) + 1e-4)
    off = actual.position[low, 2] - bowl(*actual.position[low, :2].T)
    assert low.sum() > 500
    assert np.abs(off).max() < 5e-6 + 4e-6 + 0.0025**2 / 2  # the tolerance, the bound and the facets
    slope = -actual.position[low, :2] / 1.0
    normal = np.column_stack([slope, np.ones(low.sum())])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    assert np.abs(np.cross(normal, -actual.rotation[low][:, :, 2])).max() < np.deg2rad(0.3)


FINE_TURNS = 'pattern = "raster"\nstepover_mm = 2\nturn = "smooth"\ndiameter_mm = 40\nx_mm = 0\ny_mm = 0\nz_mm = 0'


@pytest.mark.parametrize("path", [SPIRAL.replace("turns = 3", "turns = 9"), FINE_TURNS])
def test_a_smooth_pattern_on_a_coarse_mesh_stops_at_its_end_alone(tmp_path, path):
    """Points 2 mm apart made corners of the turns between sweeps, and of a spiral's middle: it stopped on the part."""
    job = mesh_job(tmp_path, grid_mesh(bowl, n=21), path, "open = true")
    assert job.plan.path.pattern.stop.sum() == 1


@pytest.mark.parametrize(("half", "cuts"), [(100, False), (119.5, True)])
def test_a_path_that_cuts_into_a_mesh_between_its_points_is_named(tmp_path, half, cuts):
    """Points 2 mm apart on a rounding of 5 mm: only facets were named, though the path was further below them."""
    path = 'pattern = "raster"\nstepover_mm = 40\nlead_mm = 5\nx_mm = 0\ny_mm = 0\nz_mm = 0'
    boundary = f'[boundary]\nshape = "rectangle"\nsize_mm = [{half}, 80]'
    notes = mesh_job(tmp_path, rounded_plate(), path, "open = true", boundary).input_findings
    assert cuts == any(re.search(r"cuts \d+ um into the mesh at x -?5\d", note.message) for note in notes)


def bowl(x, y):
    return (x * x + y * y) / 2


def test_points_without_normals_stand_on_the_mesh(tmp_path):
    t = np.linspace(0, 2 * np.pi, 600)
    x, y = 40 * np.cos(t), 40 * np.sin(t)
    rows = np.column_stack([x, y, 1000 * bowl(x / 1000, y / 1000)])
    np.savetxt(tmp_path / "dish.csv", rows, delimiter=",", header="x_mm,y_mm,z_mm", comments="")
    job = mesh_job(tmp_path, grid_mesh(bowl, n=81), 'pattern = "points"\nfile = "dish.csv"', "open = true")
    _, corrected = generate(job, quiet)
    assert corrected.inside
    tilt = np.arccos(-corrected.execution().actual.rotation[:, 2, 2])
    assert np.rad2deg(tilt.max()) == pytest.approx(np.rad2deg(np.arctan(0.04)) + 2, abs=0.1)


@pytest.mark.parametrize(("lower", "level"), [(0, None), (3, Level.WARNING), (-3, Level.NOTE)])
def test_points_that_are_not_on_their_mesh_are_named(tmp_path, lower, level):
    """The tool went 3 mm into the part without a word: the mesh says only how it stands."""
    rows = "".join(f"{x},0,{x * x / 2000 - lower}\n" for x in range(-40, 41, 2))
    (tmp_path / "row.csv").write_text("x_mm,y_mm,z_mm\n" + rows)
    job = mesh_job(tmp_path, grid_mesh(bowl, n=81), 'pattern = "points"\nfile = "row.csv"', "open = true")
    levels = [f.level for f in job.input_findings if "mm from the mesh (below 0: in it)" in f.message]
    assert levels == ([] if level is None else [level])


@pytest.mark.parametrize("through", ["tolerance", "lines"])
@pytest.mark.parametrize(("lower", "level"), [(0, None), (3, Level.WARNING), (-3, Level.NOTE)])
def test_points_that_are_not_on_their_conic_are_named(tmp_path, lower, level, through):
    rows = [(x, 0, x * x / 2000 - lower) for x in range(-40, 41, 2)]
    conic = '[surface]\nkind = "conic"\nradius_of_curvature_m = 1\nconic_constant = -1\noff_axis_m = 0\n'
    job = job_of(tmp_path, rows, extra=f'through = "{through}"\n[frame]\nx_mm = 1100\n{conic}')
    levels = [f.level for f in job.input_findings if "mm from the conic (below 0: in it)" in f.message]
    assert levels == ([] if level is None else [level])


def test_points_on_a_mesh_that_faces_down_are_told_so(tmp_path):
    (tmp_path / "row.csv").write_text("x_mm,y_mm,z_mm\n" + "".join(f"{x},0,0\n" for x in range(-40, 41, 5)))
    corners = grid_mesh(bowl, n=81)[:, ::-1]
    with pytest.raises(InputError, match=r"inside out: the triangle on top at x -40\.0"):
        mesh_job(tmp_path, corners, 'pattern = "points"\nfile = "row.csv"', "open = true")


@pytest.mark.parametrize(
    ("surface", "words"),
    [
        ("", "open: 320 edges have no second facet"),
        ("open = true\nradius_of_curvature_m = 2", "surface.radius_of_curvature_m: a stl has none"),
        ("open = true\ntool_radius_mm = 2000", "sharper than the tool (surface.tool_radius_mm 2000)"),
    ],
)
def test_a_bad_mesh_is_refused(tmp_path, surface, words):
    with pytest.raises(InputError, match=re.escape(words)):
        mesh_job(tmp_path, grid_mesh(bowl, n=81), RASTER, surface)


def test_a_mesh_without_a_file_and_a_file_without_a_mesh_are_refused(tmp_path):
    text = "[path]\n{}\n[surface]\n{}\n[process]\nfeed_mm_s = 100\n[bounds]\nmax_um = 4\n"
    for surface, words in (('kind = "stl"', "surface.file: missing"), ('file = "a.stl"', "set surface.kind = 'stl'")):
        (tmp_path / "part.toml").write_text(text.format(RASTER, surface))
        with pytest.raises(InputError, match=words):
            load_job(str(tmp_path / "part.toml"))


def test_another_mesh_is_another_input(tmp_path):
    first = mesh_job(tmp_path, grid_mesh(bowl), RASTER, SKIN).inputs_hash
    assert mesh_job(tmp_path, grid_mesh(lambda x, y: 0.9 * bowl(x, y)), RASTER, SKIN).inputs_hash != first


TRIANGLE = (
    "G21 G90\nG0 X1000 Y0 Z110\nG1 Z100 F3000\nG1 X1100 Y0\nG1 X1000 Y60\nG1 X1000 Y0\nG0 Z110\nM30\nG1 X1400 Z60\n"
)


def code_of(findings, code):
    return next((f for f in findings if f.code == code), None)


def test_one_line_is_said_as_one(tmp_path):
    job = job_of(tmp_path, [[1000, 0, 100], [1100, 0, 100]], extra='through = "lines"')
    assert code_of(job.input_findings, "path.lines").message.startswith("1 line or arc, corners")


def test_three_lines_are_driven_as_three_lines(tmp_path):
    planned, corrected = generate(job_of(tmp_path, TRIANGLE, pattern="gcode", name="cam.nc"), quiet)
    assert corrected.inside
    place = planned.path.target.position * 1e3
    corner = np.array([[1000, 0, 110], [1000, 0, 100], [1100, 0, 100], [1000, 60, 100], [1000, 0, 100], [1000, 0, 110]])
    start, line = corner[:-1], np.diff(corner, axis=0)
    share = np.clip(((place[:, None] - start) * line).sum(2) / (line**2).sum(1), 0, 1)
    off = np.linalg.norm(place[:, None] - start - share[..., None] * line, axis=2).min(axis=1)
    assert off[place[:, 2] < 110 - 1e-6].max() < 2e-3  # all but approach and retract
    assert place[:, 2].min() > 100 - 1e-3
    assert "4 stops at corners" in code_of(corrected.findings, "path.lines").message
    assert "M30 in line 8 ends the program: line 9" in code_of(corrected.findings, "path.end").message
    assert code_of(corrected.findings, "path.file").level is Level.NOTE


@pytest.mark.parametrize("level", ["plan", "judge"])
def test_a_reading_that_only_one_side_has_is_never_inside(tmp_path, monkeypatch, level):
    """An arc turned the wrong way by one of the two readers."""
    text = "G21 G90\nG0 X1000 Y0 Z100\nG1 X1050 F3000\nG3 X1050 Y60 I0 J30\nG1 X1000\n"
    job = job_of(tmp_path, text, pattern="gcode", name="cam.nc")
    assert code_of(generate(job, quiet)[1].findings, "path.file").level is Level.NOTE
    if level == "plan":
        read = tables.READERS["gcode"]

        def wrong(source):
            points = read(source)
            assert points.arcs is not None
            return replace(points, arcs=GivenArcs(points.arcs.centre, -points.arcs.swept))

        monkeypatch.setitem(tables.READERS, "gcode", wrong)
        job = load_job(str(tmp_path / "own.toml"))
    else:
        job = replace(job, own_file=replace(job.own_file, corner=job.own_file.corner + np.array([0, 30e-6, 0])))
    corrected = generate(job, quiet)[1]
    assert not corrected.inside
    assert code_of(corrected.findings, "path.file").level is Level.OUTSIDE


def test_a_curve_far_from_the_lines_is_outside_until_it_is_asked_for(tmp_path):
    rows = [(1000, 0, 100), (1100, 0, 100), (1200, 30, 100), (1300, 60, 100)]
    assert code_of(generate(job_of(tmp_path, rows), quiet)[1].findings, "path.bulge").level is Level.OUTSIDE
    assert generate(job_of(tmp_path, rows, extra="bulge_um = 1e5"), quiet)[1].inside
    assert generate(job_of(tmp_path, rows, extra='through = "lines"'), quiet)[1].inside


def test_a_curve_below_the_lowest_point_is_a_finding(tmp_path):
    rows = [(1000, 0, 103), (1040, 0, 101), (1060, 0, 100), (1100, 0, 100), (1120, 0, 101), (1160, 0, 103)]
    finding = code_of(job_of(tmp_path, rows, extra="bulge_um = 1e5").input_findings, "path.below")
    assert finding.level is Level.WARNING
    assert "mm below the lowest point" in finding.message


def test_lines_are_lines_over_a_curved_surface(tmp_path):
    surface = "\n[surface]\nkind = 'conic'\nradius_of_curvature_m = 1.5\nconic_constant = -0.5\noff_axis_m = 0.2\n"
    text = "G0 X0 Y0 Z0\nG1 X100 F3000\nG1 X120 Y40\n"
    job = job_of(tmp_path, text, pattern="gcode", name="cam.nc", extra="x_mm = 1050\nz_mm = 200" + surface)
    planned, corrected = generate(job, quiet)
    assert corrected.inside
    assert code_of(corrected.findings, "path.file").level is Level.NOTE
    first, last = np.flatnonzero(planned.path.stop)[[1, -2]]
    assert np.ptp(planned.path.target.position[first : last + 1, 2]) < 1e-6
    tilt = planned.path.target.rotation[:, 0, 2]
    assert np.ptp(tilt) > 0.05  # 0.1 m on a radius of 1.5 m


def test_a_written_program_is_judged_by_the_file_too(tmp_path):
    job = job_of(tmp_path, TRIANGLE, pattern="gcode", name="cam.nc")
    text = generate(job, quiet)[1].text
    assert not [f for f in fly_written(job, text, lambda name: None, quiet).findings if f.level is Level.OUTSIDE]
    (tmp_path / "cam.nc").write_text(TRIANGLE.replace("Y60", "Y60.1"))
    moved = fly_written(load_job(str(tmp_path / "own.toml")), text, lambda name: None, quiet)
    assert code_of(moved.findings, "bounds.max_um").level is Level.OUTSIDE


def test_the_size_of_a_mesh_and_where_the_tool_meets_it_are_told(tmp_path):
    """A mesh in inches, or upside down, is as good a mesh; only its size tells."""
    notes = [
        f for f in mesh_job(tmp_path, grid_mesh(bowl, n=81), RASTER, SKIN).input_findings if f.code == "surface.mesh"
    ]
    assert "the mesh is 200.0 x 200.0 mm, z 0.0 to" in notes[0].message
    assert "the tool is on it at z 0.0 to" in notes[0].message
    assert [f.level.name for f in notes if "is not over the mesh" in f.message] == []
    job = mesh_job(tmp_path, grid_mesh(bowl, n=81) / 4, RASTER, SKIN)
    off = next(f for f in job.input_findings if "is not over the mesh" in f.message)
    assert off.level.name == "WARNING"


@pytest.mark.parametrize("path", [RASTER, 'pattern = "points"\nfile = "dish.csv"'])
def test_a_mesh_that_is_inside_out_is_refused(tmp_path, path):
    (tmp_path / "dish.csv").write_text("x_mm,y_mm,z_mm\n0,0,0\n10,0,0\n20,0,0\n")
    top = grid_mesh(bowl, n=21)
    closed = np.concatenate([top[:, ::-1], top - [0, 0, 0.05]])
    with pytest.raises(InputError, match="inside out"):
        mesh_job(tmp_path, closed, path, SKIN)


def test_own_points_that_are_too_many_for_the_controller_are_told_what_makes_them_fewer(tmp_path):
    """A point of its own is a waypoint whatever the chord: "raise process.chord_um" alone changed nothing."""
    exact = job_of(tmp_path, circle(300), extra='through = "points"\n')
    many = load_job(exact.plan.source, None, ("robot.controller.max_lines=250", "process.chord_um=20"))
    finding = next(f for f in generate(many, quiet)[1].findings if f.code == "controller.size")
    assert "process.page_stops = 'anywhere', or path.through = 'tolerance' with more tolerance_um" in finding.message
    few = load_job(exact.plan.source, None, (*many.overrides, "path.through=tolerance"))
    assert not [f for f in generate(few, quiet)[1].findings if f.code == "controller.size"]


@pytest.mark.parametrize("radius", [4.0, 12.0])
def test_points_on_arcs_are_met_by_the_arcs_and_not_by_chords_between_samples(tmp_path, radius):
    """Samples 1 mm apart have chords that leave a circle of 4 mm by 31 um."""
    job_of(tmp_path, circle(61, radius))
    planned, corrected = generate(load_job(str(tmp_path / "own.toml"), None, ["process.moves=arcs"]), quiet)
    assert corrected.program.via.any()
    (finding,) = [f for f in corrected.findings if f.code == "path.file"]
    (met,) = map(float, re.findall(r"met to ([\d.]+) um", finding.message))
    assert met < 1e6 * (planned.job.plan.path.tolerance + corrected.deviation.on_part["total"].max)
