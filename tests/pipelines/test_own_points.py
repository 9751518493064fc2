"""The user's own points through the whole chain: corrected, proven against the user's curve, timed at their feeds."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.exceptions import InputError
from compgen.pipelines.generate import generate
from compgen.pipelines.path_file import load_job
from tests.shipped import quiet


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
    assert_allclose(corrected.trajectory.time[-1], other.trajectory.time[-1], rtol=1e-2)


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
    note = next(f for f in job_of(tmp_path, np.array(square)).unlikely if f.code == "path.points")
    assert "it stops at 1 corners" in note.message
