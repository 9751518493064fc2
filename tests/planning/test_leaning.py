"""A tool that leans: its axis by the definition in docs/own_paths.md, on planes and spheres, and at the flange."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from shipped import quiet

from compgen.core.exceptions import InputError
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned.generate import generate

MRAD = 1e-6  # rad by which the tool's axis may be off: the cubics along a piece
RADIUS = 1.5  # m, of the sphere
PLACE = "x_mm = 1100\ny_mm = 0\nz_mm = 100\n"
RECTANGLE = '[boundary]\nshape = "rectangle"\nsize_mm = [300, 200]\n'
ROUND = '[boundary]\nshape = "circle"\ndiameter_mm = 300\n'
SPHERE = '[surface]\nkind = "conic"\nradius_of_curvature_m = 1.5\nconic_constant = 0\noff_axis_m = 0.1\n'
PATTERNS = {
    "line": 'pattern = "line"\naxis = "y"\nlength_mm = 300\n' + PLACE,
    "circle": 'pattern = "circle"\ndiameter_mm = 300\n' + PLACE,
    "spiral": 'pattern = "spiral"\nstepover_mm = 50\ndiameter_mm = 300\n' + PLACE,
    "both ways": 'pattern = "raster"\nstepover_mm = 50\nangle_deg = 30\n' + PLACE + RECTANGLE,
    "smooth": 'pattern = "raster"\nstepover_mm = 50\nturn = "smooth"\n' + PLACE + ROUND,
    "crossed": 'pattern = "raster"\nstepover_mm = 50\nsweeps = "one way"\ncross_hatch = true\n' + PLACE + ROUND,
    "spiral on a sphere": 'pattern = "spiral"\nstepover_mm = 50\ndiameter_mm = 300\n' + PLACE + SPHERE,
    "own points": 'pattern = "points"\nfile = "own.csv"\n' + PLACE,
    "own corners": 'pattern = "points"\nfile = "corner.csv"\nthrough = "lines"\ntolerance_um = 50\n' + PLACE,
    "own G-code": 'pattern = "gcode"\nfile = "own.nc"\n' + PLACE,
    "own points on a sphere": 'pattern = "points"\nfile = "own.csv"\ntolerance_mdeg = 0.01\n' + PLACE + SPHERE,
    "raster on a sphere": 'pattern = "raster"\nstepover_mm = 50\nangle_deg = 20\ndiameter_mm = 300\n' + PLACE + SPHERE,
}

WAVE = [(x, 60 * np.sin(x / 40), 3 * np.cos(x / 60)) for x in range(-150, 151, 5)]
OWN = {
    "own.csv": "x_mm,y_mm,z_mm\n" + "".join(f"{x},{y:.6f},{z:.6f}\n" for x, y, z in WAVE),
    "corner.csv": "x_mm,y_mm,z_mm\n-50,0,0\n50,0,0\n50,100,2\n",
    "own.nc": "G0 X-150 Y0 Z10\nG1 Z0\nG1 X0 Y0\nG3 X100 Y100 I0 J100\nG1 Y200\nG2 X150 Y250 I50 J0\nG0 Z10\n",
}


def job_of(folder, path, process="", more=""):
    for name, text in OWN.items():
        (folder / name).write_text(text)
    file = folder / "part.toml"
    file.write_text(
        f"[path]\n{path}[process]\nfeed_mm_s = 100\n{process}\n"
        f'[[before]]\nstate = "moving"\nfeed_mm_s = 200\nduration_h = 3\n[bounds]\nmax_um = 5\n{more}'
    )
    return load_job(str(file))


def exact(job):
    return job.plan.path.exact(job.plan.tool.spin)


def axis_of(normal, feed, lead_deg, lean_deg):
    """u of the definition: the tool's axis out of the part."""
    a, b = np.tan(np.radians([lead_deg, lean_deg]))
    u = normal + a * feed + b * np.cross(normal, feed)
    return u / np.linalg.norm(u, axis=1)[:, None]


def looked_at(path):
    """Pose, direction of travel by differences, and contact at places of every piece."""
    K = len(path.curve.poly)
    piece, t, h = np.repeat(np.arange(K), 7), np.tile(np.linspace(0.05, 0.95, 7), K), 1e-5
    pose, there = path.pose(piece, t)
    way = path.pose(piece, t + h)[0].position - path.pose(piece, t - h)[0].position
    return pose, way / np.linalg.norm(way, axis=1)[:, None], there & path.curve.working[piece]


@pytest.mark.parametrize("name", PATTERNS)
@pytest.mark.parametrize(("lead", "lean"), [(12.0, -7.0), (-20.0, 0.0), (0.0, 35.0)])
def test_the_axis_leans_as_it_is_defined(tmp_path, name, lead, lean):
    path = exact(job_of(tmp_path, PATTERNS[name], f"lead_deg = {lead}\nlean_deg = {lean}"))
    pose, feed, contact = looked_at(path)
    normal = np.tile([0.0, 0.0, 1.0], (len(feed), 1))
    if "sphere" in name:  # normals go through its centre, over the middle of the pattern by its own tilt there
        upright = exact(job_of(tmp_path, PATTERNS[name]))
        ends = upright.pose(np.array([0, len(upright.curve.poly) - 1]), np.array([0.5, 0.5]))[0]
        along = -ends.rotation[:, :, 2]
        height = np.linalg.lstsq(np.transpose(along * [[1], [-1]]), ends.position[1] - ends.position[0])[0]
        centre = ends.position[0] + height[0] * along[0]
        normal = centre - pose.position
        distance = np.linalg.norm(normal, axis=1)[:, None]
        if "own" not in name:
            assert_allclose(distance[contact], RADIUS, atol=1e-8)
        normal /= distance
    assert contact.any()
    feed = feed - normal * (feed * normal).sum(axis=1)[:, None]
    contact &= np.linalg.norm(feed, axis=1) > 0.1  # no plunge, on which the tool turns to where it is wanted
    normal, feed, axis = normal[contact], feed[contact], -pose.rotation[contact, :, 2]
    want = axis_of(normal, feed / np.linalg.norm(feed, axis=1)[:, None], lead, lean)
    assert np.linalg.norm(np.cross(want, axis), axis=1).max() < MRAD * (2 if "own" in name else 1)
    assert ((want * axis).sum(axis=1) > 0).all()


@pytest.mark.parametrize("name", PATTERNS)
def test_the_tool_turns_without_a_jump_and_stops_where_it_did(tmp_path, name):
    plain, leaning = exact(job_of(tmp_path, PATTERNS[name])), exact(job_of(tmp_path, PATTERNS[name], "lead_deg = 15"))
    ends = [leaning.curve.place_and_tilt(k, t) for k in range(len(leaning.curve.poly)) for t in (0.0, 1.0)]
    for (place, tilt), (following, next_tilt) in zip(ends[1:-1:2], ends[2::2], strict=True):
        assert_allclose(place, following, atol=1e-9)
        assert_allclose(tilt, next_tilt, atol=1e-9)
    assert plain.curve.stop.sum() == leaning.curve.stop.sum()


@pytest.mark.parametrize("name", PATTERNS)
def test_a_curve_that_is_cut_is_the_same_curve(tmp_path, name):
    whole = exact(job_of(tmp_path, PATTERNS[name], "lead_deg = 15")).curve
    rng = np.random.default_rng(3)
    count = rng.integers(1, 6, len(whole.poly))
    parts = whole.cut(count)
    of = np.repeat(np.arange(len(count)), count)
    number = np.concatenate([np.arange(n) for n in count])
    u = rng.uniform(0, 1, len(of))
    t = (number + u) / count[of]
    part = np.arange(len(of))
    assert_allclose(parts.derivatives(part, u)[0], whole.derivatives(of, t)[0], atol=1e-12)
    assert_allclose(parts.height(part, u)[0], whole.height(of, t)[0], atol=1e-12)
    for k in part[:: max(1, len(part) // 40)].tolist():
        assert_allclose(parts.place_and_tilt(k, u[k])[1], whole.place_and_tilt(int(of[k]), t[k])[1], atol=1e-12)


def test_a_program_with_a_leaning_tool_ends_inside(tmp_path):
    tool = "[tool]\nz_mm = 40\nlength_mm = 220\ntilt_deg = 30\ntilt_towards_deg = 20\n"
    planned, corrected = generate(job_of(tmp_path, PATTERNS["both ways"], "lead_deg = 8\nlean_deg = -5", tool), quiet)
    assert corrected.inside
    path = planned.path
    step = np.diff(path.target.position, axis=0)
    both = path.contact[1:] & path.contact[:-1]
    feed = step[both] / np.linalg.norm(step[both], axis=1)[:, None]
    want = axis_of(np.tile([0.0, 0.0, 1.0], (len(feed), 1)), feed, 8.0, -5.0)
    assert_allclose(-path.target.rotation[1:][both][:, :, 2], want, atol=MRAD)


@pytest.mark.parametrize(
    ("path", "process", "words"),
    [
        ('pattern = "iso9283"\nsize_mm = 300\n' + PLACE, "lead_deg = 5", "process.lead_deg: the path turns sharply"),
        ('pattern = "line"\naxis = "z"\nlength_mm = 90\n' + PLACE, "lean_deg = 5", "along the surface's normal"),
        ('pattern = "points"\nfile = "a.csv"\n', "lead_deg = 5", "your own points say how the tool stands"),
        ('pattern = "points"\nfile = "corner.csv"\n', "lean_deg = 5", "path.through = 'tolerance'"),
    ],
)
def test_paths_on_which_the_tool_cannot_lean_are_refused(tmp_path, path, process, words):
    (tmp_path / "a.csv").write_text("x_mm,y_mm,z_mm,i,j,k\n1000,0,0,0,0,1\n1050,0,0,0,0,1\n1100,0,0,0,0,1\n")
    with pytest.raises(InputError, match=words):
        job_of(tmp_path, path, process)


@pytest.mark.parametrize("seed", range(6))
def test_a_leaning_spindle_has_its_tip_where_trigonometry_says(tmp_path, seed):
    x, y, z, length, tilt, towards = np.random.default_rng(seed).uniform(
        [-90, -90, 10, 30, -120, -180], [90, 90, 200, 400, 120, 180]
    )
    tool = (
        f"[tool]\nx_mm = {x}\ny_mm = {y}\nz_mm = {z}\nlength_mm = {length}\n"
        f"tilt_deg = {tilt}\ntilt_towards_deg = {towards}\n"
    )
    pose = job_of(tmp_path, PATTERNS["line"], more=tool).plan.tool.pose
    s, c, phi = np.sin(np.radians(tilt)), np.cos(np.radians(tilt)), np.radians(towards)
    axis = np.array([s * np.cos(phi), s * np.sin(phi), c])
    assert_allclose(pose.position, np.array([x, y, z]) / 1e3 + length / 1e3 * axis, atol=1e-12)
    assert_allclose(pose.rotation[:, 2], axis, atol=1e-12)
    square = np.array([-np.sin(phi), np.cos(phi), 0.0])  # what it is turned about stays
    assert_allclose(pose.rotation @ square, square, atol=1e-12)


def test_a_length_without_a_tilt_goes_along_the_tools_own_axis(tmp_path):
    angles = "w_deg = 10\np_deg = -25\nr_deg = 70\n"
    pose = job_of(tmp_path, PATTERNS["line"], more=f"[tool]\nz_mm = 40\nlength_mm = 100\n{angles}").plan.tool.pose
    assert_allclose(pose.position, np.array([0, 0, 0.04]) + 0.1 * pose.rotation[:, 2], atol=1e-12)
    with pytest.raises(InputError, match=r"tool\.tilt_deg: w_deg, p_deg, r_deg say how the tool stands too"):
        job_of(tmp_path, PATTERNS["line"], more=f"[tool]\ntilt_deg = 5\n{angles}")
    with pytest.raises(InputError, match=r"tool\.tilt_towards_deg: nothing leans that way; give tilt_deg"):
        job_of(tmp_path, PATTERNS["line"], more="[tool]\nz_mm = 40\ntilt_towards_deg = 90\n")
    flat = job_of(tmp_path, PATTERNS["line"], more="[tool]\nz_mm = 40\ntilt_deg = 0\ntilt_towards_deg = 90\n")
    assert_allclose(flat.plan.tool.pose.rotation, np.eye(3), atol=1e-12)


@pytest.mark.parametrize(
    ("path", "wide"),
    [
        ('pattern = "raster"\nstepover_mm = 250\n' + PLACE + RECTANGLE, "200 mm"),
        ('pattern = "raster"\nstepover_mm = 310\nangle_deg = 90\n' + PLACE + RECTANGLE, "300 mm"),
        ('pattern = "raster"\nstepover_mm = 250\nangle_deg = 90\ncross_hatch = true\n' + PLACE + RECTANGLE, "200 mm"),
        ('pattern = "spiral"\nstepover_mm = 151\ndiameter_mm = 300\n' + PLACE, "150 mm"),
        ('pattern = "raster"\nstepover_mm = 200\n' + PLACE + RECTANGLE, ""),
        ('pattern = "raster"\nstepover_mm = 250\nangle_deg = 90\n' + PLACE + RECTANGLE, ""),
        ('pattern = "spiral"\nstepover_mm = 150\ndiameter_mm = 300\n' + PLACE, ""),
    ],
)
def test_a_stepover_larger_than_the_part_is_questioned(tmp_path, path, wide):
    notes = [f.message for f in job_of(tmp_path, path).input_findings if f.code == "path.stepover"]
    assert len(notes) == bool(wide)
    assert all(f"({wide})" in note for note in notes)
