"""Rasters on parts as shops have them: rectangles, polygons with holes, at an angle, one way, crossed."""

import naive_ls
import numpy as np
import pytest
from shipped import path_file, quiet

from compgen.core.exceptions import InputError
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned.generate import generate, predict

RECTANGLE = 'shape = "rectangle"\nsize_mm = [300, 200]\n'
NOTCHED = (
    'shape = "polygon"\ncorners_mm = [[-150, -100], [150, -100], [150, 0], [25, 0], [25, 100], [-150, 100]]\n'
    "[[boundary.holes]]\ncorners_mm = [[-100, -50], [-50, -50], [-50, 50], [-100, 50]]\n"
)


HEXAGON = 'shape = "hexagon"\ncorner_to_corner_mm = 130\nrotation_deg = 7\n'


def job_of(folder, raster="", boundary=RECTANGLE, lift=20, overrides=()):
    file = folder / "part.toml"
    file.write_text(
        f'[path]\npattern = "raster"\nstepover_mm = 50\nx_mm = 1100\ny_mm = 0\nz_mm = 100\n{raster}\n'
        f'[process]\nfeed_mm_s = 100\nlift_mm = {lift}\n[[before]]\nstate = "moving"\nfeed_mm_s = 200\nduration_h = 3\n'
        f"[bounds]\nmax_um = 5\n[boundary]\n{boundary}"
    )
    return load_job(str(file), None, overrides)


@pytest.mark.parametrize(
    "raster", ["", "angle_deg = 30", 'sweeps = "one way"', "cross_hatch = true", 'turn = "smooth"\ncross_hatch = true']
)
@pytest.mark.parametrize("boundary", [RECTANGLE, NOTCHED], ids=["rectangle", "notched"])
def test_every_raster_ends_inside(tmp_path, raster, boundary):
    planned, corrected = generate(job_of(tmp_path, raster, boundary), quiet)
    assert corrected.inside
    contact = planned.path.contact
    local = planned.path.target.position[:, :2] - [1.1, 0.0]
    assert 0.05 < contact.mean() < 1
    assert np.all(np.abs(local[contact]) <= np.array([0.15, 0.1]) + 1e-6)
    if boundary is NOTCHED:
        x, y = local[contact].T
        assert not ((x > 0.0251) & (y > 1e-4)).any()
        assert not ((x > -0.0999) & (x < -0.0501) & (np.abs(y) < 0.0499)).any()


def test_the_tool_is_not_on_the_part_over_round_holes_and_slots(tmp_path):
    boundary = (
        'shape = "circle"\ndiameter_mm = 240\n'
        '[[boundary.holes]]\nkind = "circle"\nx_mm = -60\ny_mm = 25\ndiameter_mm = 50\n'
        '[[boundary.holes]]\nkind = "slot"\nx_mm = 40\ny_mm = -25\nlength_mm = 90\nwidth_mm = 24\nrotation_deg = 20\n'
    )
    job = job_of(tmp_path, "angle_deg = 30", boundary)
    (note,) = (f.message for f in job.input_findings if f.code == "path.holes")
    assert "over 2 holes the tool runs on at the part's height and feed" in note
    path = generate(job, quiet)[0].path
    x, y = path.target.position.T[:2] - [[1.1], [0.0]]
    turned = np.radians(20)
    along = (x - 0.04) * np.cos(turned) + (y + 0.025) * np.sin(turned)
    across = (y + 0.025) * np.cos(turned) - (x - 0.04) * np.sin(turned)
    slot = np.hypot(np.maximum(np.abs(along) - 0.033, 0), across) < 0.012 - 1e-6
    hole = np.hypot(x + 0.06, y - 0.025) < 0.025 - 1e-6
    down = path.target.position[:, 2] < 0.1 + 1e-6
    assert (down & slot).any()
    assert (down & hole).any()
    assert np.array_equal(path.contact[down], (~slot & ~hole & (np.hypot(x, y) < 0.12 + 1e-7))[down])


def test_the_tool_is_off_the_part_on_its_way_back(tmp_path):
    planned, _ = generate(job_of(tmp_path, 'sweeps = "one way"'), quiet)
    path = planned.path
    back = np.diff(path.target.position[:, 0]) < -1e-6
    assert back.any()
    assert not (path.contact[:-1] & path.contact[1:])[back].any()


@pytest.mark.parametrize(
    ("raster", "boundary", "words"),
    [
        ("", 'shape = "rectangle"\n', r"boundary\.size_mm: missing"),
        ("", 'shape = "rectangle"\nsize_mm = [300, 200]\ndiameter_mm = 5\n', r"boundary\.diameter_mm: conflicts"),
        ("", 'shape = "polygon"\ncorners_mm = [[0,0],[9,9],[9,0],[0,9]]\n', r"boundary\.corners_mm: its edges cross"),
        (
            "",
            'shape = "circle"\ndiameter_mm = 100\nholes = [{corners_mm=[[0,0],[60,0],[0,1]]}]\n',
            r"holes\.0: it crosses",
        ),
        ('sweeps = "one way"\nturn = "smooth"', RECTANGLE, r"path\.turn: sweeps that go one way have no turns"),
    ],
)
def test_what_does_not_fit_is_refused(tmp_path, raster, boundary, words):
    with pytest.raises(InputError, match=words):
        job_of(tmp_path, raster, boundary)


@pytest.mark.parametrize("raster", ['sweeps = "one way"', "cross_hatch = true"])
def test_a_tool_that_goes_back_over_the_part_is_lifted(tmp_path, raster):
    with pytest.raises(InputError, match=r"process\.lift_mm: 0, and the tool goes over the part between sweeps"):
        job_of(tmp_path, raster, lift=0)
    assert job_of(tmp_path, lift=0).plan.process.lift == 0


@pytest.mark.parametrize("feed", [2.95, 7.95, 20.0])
def test_slow_rasters_are_at_feed_but_for_their_short_lines(tmp_path, feed):
    """Some lines last one period, and are laid shorter by what digits hide: 7 % of it at 2.95 mm/s."""
    overrides = [f"process.feed_mm_s={feed}", "path.stepover_mm=10", "path.x_mm=1300", "bounds.max_um=400"]
    planned, corrected = generate(job_of(tmp_path, "", HEXAGON, overrides=overrides), quiet)
    points, moves = naive_ls.read(corrected.text)
    places = [[points[int(m.targets[0][2:-1])].groups[1].axes[axis] for axis in "XYZ"] for m in moves]
    length = np.linalg.norm(np.diff(np.array(places, dtype=float), axis=0), axis=1)  # mm
    speed = np.array([naive_ls.mm_s(m.speed) for m in moves[1:]])
    on = planned.path.contact[:-1] & planned.path.contact[1:]
    long = on & (length > 2 * feed * 0.008)
    assert length[long].sum() > 1000
    assert speed[long].min() >= 0.98 * feed


def test_a_feed_that_no_program_can_say_is_told_before_and_after_the_correction(tmp_path):
    job = job_of(tmp_path, "", HEXAGON, overrides=["process.feed_mm_s=0.05", "path.x_mm=1300"])
    for findings in (predict(job, quiet).findings, generate(job, quiet)[1].findings):
        (message,) = (f.message for f in findings if f.code == "timing.feed")
        assert "process.feed_mm_s = 0.05 is written as 0.04233 mm/s" in message


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("raster_1300", "joint limits bind there"),
        ("spiral_1300", "segments there are shorter than feed x the interpolation period, or joint limits bind"),
    ],
)
def test_what_is_below_feed_is_told_without_a_correction_too(name, why):
    """At 200 mm/s the raster turns sharply, and has no line shorter than a period; the spiral's middle has."""
    findings = predict(load_job(path_file(name)), quiet).findings
    (message,) = (f.message for f in findings if f.code == "timing.below_feed")
    assert message.partition(" is programmed below feed: ")[2] == why
