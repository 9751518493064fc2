"""process.moves = "arcs": fewer positions for the same promise, proven from the text and by a circle of our own."""

import naive_arm
import naive_ls
import numpy as np
import pytest
from flawed import flawed_file
from numpy.testing import assert_allclose
from shipped import path_file, quiet

from compgen import fanuc
from compgen.core.exceptions import CompgenError
from compgen.core.units import MM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.pipelines.resume.rest import plan_whole
from compgen.report.job_summary import job_summary
from compgen.robot.kinematics import flange_pose

ARCS = "process.moves=arcs"


CHORD = "process.chord_um=1.5"


def made(name, *overrides, robot=None):
    return generate.generate(load_job(path_file(name), robot, overrides), quiet)


@pytest.fixture(scope="module", params=["circle_1300", "spiral_1300"])
def both(request):
    return {moves: made(request.param, f"process.moves={moves}", CHORD) for moves in ("lines", "arcs")}


def statements(program):
    """Lengths [m] and durations [s] of a program's statements."""
    starts = np.flatnonzero(~program.via[:-1])
    length = np.add.reduceat(program.lengths(), starts)
    return length, length / program.speed[starts]


def test_arcs_need_a_tenth_of_the_positions_for_the_same_promise(both):
    lines, arcs = both["lines"][1], both["arcs"][1]
    assert 10 * len(arcs.program.position) < len(lines.program.position)
    assert arcs.inside
    assert len(arcs.text) < 0.1 * len(lines.text)
    assert arcs.deviation.on_part["total"].max < 2.5e-6


def test_statements_last_five_interpolation_periods(both):
    planned, corrected = both["arcs"]
    length, duration = statements(corrected.program)
    lasting = duration >= 5 * planned.job.robot.controller.period * (1 - 1e-9)
    assert length[lasting].sum() >= 0.99 * length.sum()
    assert corrected.written.use.max() <= 1


def test_the_spiral_is_driven_at_feed():
    _, corrected = made("spiral_1300", ARCS)
    assert corrected.written.at_feed >= 0.98


def arc_points(a, b, c, shares):
    """On the circle from a through b to c at shares of both halves: the centre by linear equations."""
    normal = np.cross(b - a, c - a)
    centre = np.linalg.solve([b - a, c - a, normal], [(b - a) @ (b + a) / 2, (c - a) @ (c + a) / 2, normal @ a])
    places = []
    for start, end in ((a, b), (b, c)):
        r, s = start - centre, end - centre
        x = r / np.linalg.norm(r)
        y = np.cross(normal, x) / np.linalg.norm(normal)
        whole = np.arctan2(s @ y, s @ x)
        angle = shares[:, None] * whole
        places.append(centre + np.linalg.norm(r) * (np.cos(angle) * x + np.sin(angle) * y))
    return places


def test_a_naive_reader_and_a_circle_by_linear_algebra_see_the_flight_of_the_twin(both):
    """From the text alone: where the controller commands the TCP, against the twin's joints by nominal kinematics."""
    planned, corrected = both["arcs"]
    positions, moves = naive_ls.read(corrected.text)
    place = {n: np.array([p.groups[1].axes[a] for a in "XYZ"]) * MM for n, p in positions.items()}
    execution = corrected.execution()
    tool = flange_pose(planned.job.robot, execution.theta) @ planned.job.tool.pose
    at, segment, checked = 1, 0, 0
    for move in moves[1:]:
        numbers = [int(target[2:-1]) for target in move.targets]
        if move.letter == "C":
            for points_of, k in zip((0, 1), (segment, segment + 1), strict=True):
                rows = execution.segment == k
                shares = execution.fraction[rows]
                expected = arc_points(place[at], place[numbers[0]], place[numbers[1]], shares)[points_of]
                assert_allclose(tool.position[rows], expected, atol=2e-9)
                checked += rows.sum()
        segment += len(numbers)
        at = numbers[-1]
    assert checked > 0.9 * len(execution.segment)
    spacing = np.linalg.norm(np.diff(tool.position, axis=0), axis=1)
    assert spacing.max() <= 1.0001e-3


def test_rows_of_the_report_are_positions_of_the_text(both):
    planned, corrected = both["arcs"]
    N = len(corrected.program.position)
    assert len(planned.path.arc) == len(corrected.solution.correction) == len(planned.theta) == N
    assert planned.path.via.tolist() == corrected.program.via.tolist()
    record = job_summary(planned, corrected)["program"]
    assert record["positions"] == N
    assert record["arcs"] == int(corrected.program.via.sum())
    ends = np.diff(corrected.deviation.arc[corrected.samples])
    assert_allclose(ends, np.diff(planned.path.arc), atol=1e-12)


def test_the_range_of_the_joints_is_of_the_way_not_of_the_few_positions(both):
    """By Newton's method at the many positions of the same path in lines; of a circle J1 was 0.03 deg short."""
    positions = naive_ls.read(both["lines"][1].text)[0]
    axes = np.array([[positions[n].groups[1].axes[a] for a in "XYZWPR"] for n in sorted(positions)])
    joints = np.degrees(naive_arm.pendant_angles(axes[:, :3], naive_arm.rotation(*np.radians(axes[:, 3:].T))))
    for result in both.values():
        ranges = job_summary(*result)["provenance"]["joint_range_deg"]
        reported = np.array([ranges[f"J{i}"] for i in (1, 2)])
        assert_allclose(reported, np.column_stack([joints.min(axis=0), joints.max(axis=0)])[:2], atol=0.005)


def test_both_say_the_same_correction():
    """At its positions the program of arcs says what the program of lines says there, to the rounding."""
    (of_lines, lines), (of_arcs, arcs) = (made("spiral_1300", f"process.moves={m}", CHORD) for m in ("lines", "arcs"))
    at = of_arcs.path.arc
    correction = [np.interp(at, of_lines.path.arc, column) for column in lines.solution.correction[:, :3].T]
    by_arcs = arcs.program.position - of_arcs.path.target.position
    assert_allclose(by_arcs, np.transpose(correction), atol=0.6e-6)  # m: half a digit, and smoothing by other spacings


@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("optic_raster", ("path.stepover_mm=60",)),
        ("optic_spiral", ("path.stepover_mm=60",)),
        ("raster_1300", ("path.stepover_mm=100", "path.turn=smooth", "path.diameter_mm=900")),
        ("iso9283", ()),
        ("line_y", ()),
        ("circle_1300", ("path.diameter_mm=40",)),
        ("spiral_1300", ("process.chord_um=0.5", "path.diameter_mm=300")),
        ("circle_1300", ("process.thin_um=4", "bounds.max_um=5", "bounds.normal_um=5")),
        ("spiral_spindle", ("path.turns=3",)),
    ],
)
def test_every_pattern_keeps_its_promise_with_fewer_positions(name, overrides):
    lines, arcs = (made(name, f"process.moves={moves}", *overrides) for moves in ("lines", "arcs"))
    assert arcs[1].inside
    assert len(arcs[1].program.position) < 0.5 * len(lines[1].program.position)
    assert fanuc.compose(fanuc.interpret(fanuc.compose(arcs[1].program))) == fanuc.compose(arcs[1].program)
    assert arcs[1].written.time[-1] < 1.05 * lines[1].written.time[-1]


@pytest.mark.parametrize(
    "overrides",
    [
        ("robot.controller.decimals=6", "process.chord_um=0.753", "path.diameter_mm=600", "path.stepover_mm=45.3"),
        ("process.feed_mm_s=241.83", "process.chord_um=4", "path.diameter_mm=203.53", "path.stepover_mm=75.6"),
    ],
)
def test_tight_loops_keep_the_chord_off_the_part_as_well(overrides):
    planned, corrected = made("raster_1300", ARCS, "path.turn=smooth", *overrides)
    process, decimals = planned.job.plan.process, planned.job.robot.controller.decimals
    assert corrected.program.via.any()
    assert corrected.deviation.extents["total"].max < process.chord + np.sqrt(3) / 2 * 10.0 ** -(3 + decimals) + 5e-8


def test_straight_sweeps_on_a_plane_stay_lines():
    _, corrected = made("raster_1300", ARCS, "path.stepover_mm=100")
    assert not corrected.program.via.any()
    assert b":C P[" not in corrected.text


def test_sweeps_over_a_curved_mirror_are_arcs():
    _, corrected = made("optic_raster", ARCS, "path.stepover_mm=60")
    length = corrected.program.lengths()
    on_arc = corrected.program.via[1:] | corrected.program.via[:-1]
    assert length[on_arc].sum() > 0.8 * length.sum()


def test_an_arm_with_play_and_every_other_error_is_corrected_on_arcs(tmp_path):
    overrides = (
        "path.diameter_mm=500",
        "path.turns=3",
        "process.feed_mm_s=50",
        "bounds.max_um=12",
        "bounds.normal_um=8",
    )
    robot = flawed_file(tmp_path)
    lines, arcs = (made("spiral_1300", f"process.moves={m}", *overrides, robot=robot)[1] for m in ("lines", "arcs"))
    p99 = [c.deviation.on_part["total"].p99 for c in (lines, arcs)]
    assert p99[1] < p99[0] + 1.5e-6
    assert len(arcs.program.position) < 0.5 * len(lines.program.position)


def test_pages_begin_and_end_with_whole_arcs():
    words = ("robot.controller.max_lines=80", "process.page_stops=anywhere", ARCS)
    planned, corrected = made("spiral_1300", *words)
    pages = corrected.delivery.paged.pages
    assert len(pages) > 5
    assert corrected.inside
    for page in pages:
        own = fanuc.interpret(page.data)
        assert not own.via[0]
        assert not own.via[-1]
        assert own.fine[0]
        assert own.fine[-1]
        assert page.size.lines <= 80
    assert not (planned.page_stops.stop & planned.path.via).any()
    assert int(sum(fanuc.interpret(p.data).via.sum() for p in pages)) == int(corrected.program.via.sum())


def test_a_program_of_arcs_that_fits_has_no_pages_where_lines_need_them():
    _, corrected = made("spiral_1300", ARCS, "robot.controller.max_lines=1000")
    assert corrected.delivery.paged is None
    assert corrected.inside


def test_one_file_for_several_starts_is_flown_on_arcs():
    words = ("compensation.average_over={delay_s=[0,1200]}", "bounds.max_um=60", "bounds.normal_um=60")
    _, corrected = made("circle_1300", ARCS, *words)
    assert corrected.averaged is not None
    assert corrected.program.via.any()


def test_what_an_ignored_via_orientation_would_do_is_told():
    """Over a mirror of 0.8 m the tool turns on a cone: half way between two vias it is not half way turned."""
    words = ("surface.radius_of_curvature_m=0.8", "surface.off_axis_m=0.1", "boundary.corner_to_corner_mm=500")
    _, corrected = made("optic_raster", ARCS, *words, "path.lead_mm=20", "path.stepover_mm=60", "bounds.normal_um=3")
    (finding,) = [f for f in corrected.findings if f.code == "path.arcs_orientation"]
    program, via = corrected.program, np.flatnonzero(corrected.program.via)
    worst = 0.0
    for v in via:  # spherical means of the tool's axis alone say nearly as much
        a, m, b = (program.rotation[v + k][:, 2] for k in (-1, 0, 1))
        length = program.lengths()[v - 1 : v + 1]
        t = length[0] / length.sum()
        angle = np.arccos(np.clip(a @ b, -1, 1))
        even = (np.sin((1 - t) * angle) * a + np.sin(t * angle) * b) / np.sin(angle)
        worst = max(worst, np.degrees(np.linalg.norm(np.cross(even, m))) * 1e3)
    warned_mdeg = float(finding.message.split(" mdeg")[0].split()[-1])
    assert 1 < worst < 1.05 * warned_mdeg
    assert warned_mdeg < 20
    _, flat = made("circle_1300", ARCS)
    assert "path.arcs_orientation" not in {f.code for f in flat.findings}


def test_turns_of_config_change_between_statements_only():
    """The spiral about the place where J6 passes half a turn: no arc leads across."""
    _, corrected = made("circle_1300", ARCS, "tool.spin_deg=179.9", "path.diameter_mm=600", "path.y_mm=0")
    turns, via = corrected.program.turns, np.flatnonzero(corrected.program.via)
    assert len(np.unique(turns, axis=0)) > 1
    assert (turns[via] == turns[via - 1]).all()
    assert (turns[via] == turns[via + 1]).all()
    assert corrected.inside


def test_single_pages_of_arcs_are_not_written_anew():
    job = load_job(
        path_file("spiral_1300"), None, (ARCS, "robot.controller.max_lines=80", "process.page_stops=anywhere")
    )
    with pytest.raises(
        CompgenError, match=r"process\.moves = 'arcs': .* generate the job anew, or in lines"
    ) as refusal:
        plan_whole(job, quiet)
    assert len(str(refusal.value)) <= 300


def test_a_wrong_word_for_the_moves_is_refused():
    with pytest.raises(CompgenError, match=r"process\.moves"):
        load_job(path_file("circle_1300"), None, ("process.moves=curves",))
