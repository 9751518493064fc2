"""Long programs of compgen's own: stops for their pages, the pages, and the proof from their texts."""

import json
from dataclasses import replace
from hashlib import sha256

import naive_ls
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from shipped import path_file, quiet

from compgen import fanuc as ls
from compgen.core.finding_codes import Level
from compgen.core.units import UM
from compgen.fanuc.paging.join_check import check_join, check_manifest, interpret_pages
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.pipelines.planned import delivery, generate
from compgen.program.page_stops import add_stops, head_line_count, joint_rates, positions_per_page
from compgen.program.pages import JoinError
from compgen.robot.robot import Capacity
from compgen.thermal import Duty, state_after
from compgen.verification.twin import execute
from compgen.verification.verdict import Verdict

SMALL = ("robot.controller.max_lines=60", "process.page_stops=anywhere")


@pytest.fixture(scope="module")
def made():
    """A line in three pages; the undivided program that went in is caught on its way."""
    caught = {}
    real = delivery.deliver_pages

    def catch(job, program, start_at):
        caught["program"] = program
        return real(job, program, start_at)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(delivery, "deliver_pages", catch)
        job = load_job(path_file("line_x"), None, SMALL)
        planned, corrected = generate.generate(job, quiet)
    return planned, corrected, caught["program"]


def files_of(corrected):
    return dict(corrected.delivery.files)


def manifest_of(corrected):
    return json.loads(next(c for n, c in corrected.delivery.files if n.endswith(".json")))


# Where it stops --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("count", "pages"), [(10, 1), (11, 2), (19, 2), (20, 3), (28, 3), (29, 4)])
def test_a_path_on_the_part_without_stops_has_as_few_pages_as_can_be(robot, count, pages):
    """Ten positions a page, the last of one the first of the next: nine ways each."""
    arc, on_part = np.arange(count) * 1e-2, np.ones(count, dtype=bool)
    theta = np.outer(np.arange(count), np.ones(6)) * 1e-2
    page_stops = add_stops(joint_rates(robot, arc, theta), ~on_part, on_part, 10, on_the_part=True)
    assert not page_stops.obstacle
    assert page_stops.added.sum() == page_stops.on_the_part == pages - 1


@settings(max_examples=200, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(3, 120), st.integers(2, 30), st.booleans())
def test_every_page_holds_what_it_may(robot, seed, count, per_page, on_the_part):
    rng = np.random.default_rng(seed)
    arc = np.cumsum(rng.uniform(1e-3, 1e-2, count))
    theta = np.cumsum(rng.normal(size=(count, 6)), axis=0) * 1e-2
    stop, contact = rng.random(count) < 0.05, rng.random(count) < 0.7
    stop[[0, -1]] = True
    page_stops = add_stops(joint_rates(robot, arc, theta), stop, contact, per_page, on_the_part=on_the_part)
    if page_stops.obstacle:
        assert not on_the_part
        assert_array_equal(page_stops.stop, stop)
        return
    positions = np.flatnonzero(page_stops.stop)
    assert page_stops.stop[stop].all()
    assert_array_equal(page_stops.added, page_stops.stop & ~stop)
    assert page_stops.on_the_part == (page_stops.added & contact).sum()
    # taking the last stop that fits, page after page, reaches the end
    first = 0
    while count - first > per_page:
        last = positions[positions <= first + per_page - 1][-1]
        assert last > first
        first = int(last)
    if not on_the_part:
        assert not (page_stops.added & contact).any()


@pytest.mark.parametrize(("per_page", "stops"), [(51, [50]), (61, [48]), (31, [30, 48, 77]), (45, [38, 77])])
def test_the_calmest_waypoint_that_costs_no_page_is_taken(robot, per_page, stops):
    """Joints that hardly move at waypoints 38, 48 and 77."""
    calm = np.isin(np.arange(100), [37, 38, 47, 48, 76, 77])
    theta = np.zeros((101, 6))
    theta[1:, 2] = np.cumsum(np.where(calm, 0.001, 0.01))
    ends = np.zeros(101, dtype=bool)
    ends[[0, -1]] = True
    page_stops = add_stops(
        joint_rates(robot, np.linspace(0, 1, 101), theta), ends, np.ones(101, dtype=bool), per_page, on_the_part=True
    )
    added = np.flatnonzero(page_stops.added).tolist()
    assert len(added) == len(stops) == -(-100 // (per_page - 1)) - 1
    assert set(added) >= set(stops) & {38, 48, 77}


@settings(max_examples=300, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(3, 120), st.integers(4, 30))
def test_a_path_of_arcs_can_be_parted_wherever_one_ends(robot, seed, count, per_page):
    """Where fewest pages ask for a stop in the middle of an arc it comes at its start; no place was said to be left."""
    rng = np.random.default_rng(seed)
    via = np.zeros(count, dtype=bool)
    via[1 : count - 1 : 2] = rng.random(len(via[1 : count - 1 : 2])) < 0.8
    rate, stop = rng.uniform(1, 2, count), np.zeros(count, dtype=bool)
    stop[[0, -1]] = True
    pages = add_stops(rate, stop, np.ones(count, dtype=bool), per_page, on_the_part=True, via=via)
    assert not pages.obstacle
    assert not (pages.stop & via).any()
    assert np.diff(np.flatnonzero(pages.stop)).max() < per_page


def test_a_stop_off_the_part_comes_before_any_on_it(robot):
    contact = np.ones(101, dtype=bool)
    contact[40:43] = False
    theta = np.linspace(0, 1, 101)[:, None] * np.ones(6)
    ends = np.zeros(101, dtype=bool)
    ends[[0, -1]] = True
    for on_the_part in (False, True):
        page_stops = add_stops(
            joint_rates(robot, np.linspace(0, 1, 101), theta), ends, contact, 61, on_the_part=on_the_part
        )
        assert np.flatnonzero(page_stops.added).tolist() == [42]
        assert page_stops.on_the_part == 0


def test_a_stop_that_is_there_is_used(robot):
    stop = np.zeros(101, dtype=bool)
    stop[[0, 45, 60, -1]] = True
    theta = np.linspace(0, 1, 101)[:, None] * np.ones(6)
    page_stops = add_stops(
        joint_rates(robot, np.linspace(0, 1, 101), theta), stop, np.ones(101, dtype=bool), 61, on_the_part=False
    )
    assert not page_stops.added.any()
    assert not page_stops.obstacle


@pytest.mark.parametrize(
    ("capacity", "count", "per_page"),
    [
        (Capacity(100, 1000, 1e6, 8), 5000, 100 - 7 - 2),
        (Capacity(9999, 50, 1e6, 8), 5000, 50),
        (Capacity(9999, 9999, 1e6, 8), 200, 200),
        (Capacity(9999, 9999, 10e3, 8), 5000, None),
    ],
)
def test_capacity_is_what_a_page_can_hold(capacity, count, per_page):
    n = positions_per_page(capacity, count, 7)
    assert per_page is None or n == per_page
    pages = -(-count // (n - 1))
    main = 400 + 50 + pages * (8 + 50)
    assert 400 + 7 * 40 + 64 + 63 * n + main <= capacity.memory or n == 2


# The pages -------------------------------------------------------------------------------------------------------


def test_the_robot_really_stops_where_a_page_ends(made):
    planned, corrected, _ = made
    added = np.flatnonzero(planned.page_stops.added)
    assert len(added) == len(corrected.delivery.paged.pages) - 1
    assert corrected.program.fine[added].all()
    phases = corrected.trajectory.phases  # of the motion that is not rounded: by place, not by time
    _, speed, _, _ = phases.motion(phases.locate(planned.path.arc).at(added))
    assert speed.max() < 1e-3
    free = load_job(path_file("line_x"), None, ("robot.controller.max_lines=60",))
    assert planned.trajectory.time[-1] > generate.predict(free, quiet, pages=False).trajectory.time[-1] + 0.1


def test_the_delivered_pages_are_the_program_and_the_twin_rides_them(made):
    """Poses, speeds and stops to the last bit; the ride is that of the undivided text; no gap anywhere."""
    _, corrected, program = made
    undivided = ls.interpret(ls.compose(replace(program, remarks=())))
    for field in ("position", "rotation", "turns", "speed", "fine"):
        assert_array_equal(getattr(corrected.program, field), getattr(undivided, field), err_msg=field)
    job = load_job(path_file("line_x"), None, SMALL)
    execution = execute(twin_of(job), undivided, job.history.before)
    paged = corrected.execution()
    for field in ("time", "rise", "theta"):
        assert_array_equal(getattr(paged, field), getattr(execution, field), err_msg=field)
    assert paged.actual == execution.actual
    assert np.abs(np.diff(paged.rise, axis=0)).max() < 1e-3


def test_a_naive_reader_drives_the_pages_without_a_gap(made):
    _, corrected, program = made
    files = {n.removesuffix(".LS"): c for n, c in corrected.delivery.files if n.endswith(".LS")}
    main = files.pop(program.name)
    whole = naive_ls.driven(ls.compose(program))
    motions: list[tuple] = []
    for k, name in enumerate(naive_ls.calls(main)):
        rows = naive_ls.driven(files[name])
        if k:
            letter, goal, speed, end, _ = rows[0]
            assert (letter, speed, end) == ("J", "10%", "FINE")
            assert goal == motions[-1][1]  # every number of the position where the page before stopped
            assert motions[-1][3] == "FINE"
            rows = rows[1:]
        motions += rows
    assert motions == whole
    assert check_join(ls.loads(ls.compose(program)), main, files) == len(whole)


def test_each_page_is_text_of_our_own_form_with_its_own_head(made):
    planned, corrected, program = made
    pages = corrected.delivery.paged.pages
    for k, (page, start) in enumerate(zip(pages, corrected.delivery.starts, strict=True)):
        own = ls.interpret(page.data)
        assert ls.compose(own) == page.data
        assert own.name == page.name
        assert own.comment == program.comment
        assert own.remarks[:4] == program.remarks[:4]
        assert own.remarks[4].startswith(f"page {k + 1} of {len(pages)}")
        assert f"{start.rise[0]:.1f}" in own.remarks[5]
        assert own.remarks[-1].startswith("start within" if k == 0 else "wait before")
        assert own.remarks[-1].endswith(f" {np.floor(start.window):.0f} s")
        assert page.size.lines <= 60
        assert (page.size.lines, page.size.positions) == (len(own.remarks) + 2 + len(own.position), len(own.position))
    assert planned.page_stops.on_the_part == 2


def test_the_manifest_says_order_checksum_start_and_warmth(made):
    planned, corrected, _ = made
    files, manifest = files_of(corrected), manifest_of(corrected)
    assert [p["order"] for p in manifest["pages"]] == [1, 2, 3]
    assert list(files)[-1] == manifest["main"]["file"] == "LINE_X.LS"
    for entry in [manifest["main"], *manifest["pages"]]:
        assert entry["sha256"] == sha256(files[entry["file"]]).hexdigest()
        assert entry["bytes"] == len(files[entry["file"]])
    execution, program = corrected.execution(), corrected.program
    for before, page in zip([None, *manifest["pages"]], manifest["pages"], strict=False):
        first = page["first_position"] - 1
        assert before is None or page["first_position"] == before["last_position"]
        own = ls.interpret(files[page["file"]])
        assert_array_equal(own.position, program.position[first : page["last_position"]])
        assert page["start_s"] == pytest.approx(planned.trajectory.time[first], abs=1e-3)
        m = int(np.argmax(execution.segment == first)) if first < len(own.position) * 9 else 0
        rise = list(page["rise_K"].values())
        assert_allclose(rise, planned.rise[first], atol=1e-4)
        assert_allclose(rise, execution.rise[m], atol=2e-3)  # the twin's own clock and heat
    assert manifest["drip_feed"] is False
    assert manifest["loads"] == 1


def stepped(heat, rise, time, driven):
    """Rises at each moment, node by node through every segment."""
    out = [rise]
    for goal, dt in zip(heat.steady_rise("moving", driven), np.diff(time), strict=True):
        out.append(goal + (out[-1] - goal) * np.exp(-dt / heat.tau))
    return np.array(out)


def test_the_window_of_a_page_is_how_long_one_may_wait_before_it(made):
    """By driving on from the late robot: what is added is start_drift, and more with a longer wait."""
    planned, corrected, _ = made
    job, solution = planned.job, corrected.solution
    page, start = corrected.delivery.paged.pages[1], corrected.delivery.starts[1]
    n = page.motions[0] - 1
    time = planned.trajectory.time[n:] - planned.trajectory.time[n]
    now = planned.model.actual_pose(solution.theta[n:], planned.rise[n:]).position

    def added(wait):
        late = state_after(job.heat, [Duty("idle", 0.0, wait)], planned.rise[n])
        rise = stepped(job.heat, late, time, planned.trajectory.driven_speed[n:])
        moved = planned.model.actual_pose(solution.theta[n:], rise).position
        return np.linalg.norm(moved - now, axis=1).max()

    assert added(start.window) == pytest.approx(job.start_drift, rel=1e-3)
    assert added(1.1 * start.window) > job.start_drift


def test_beyond_the_memory_it_is_a_drip_feed():
    job = load_job(path_file("line_x"), None, (*SMALL, "robot.controller.memory_kB=5"))
    _, corrected = generate.generate(job, quiet)
    manifest = manifest_of(corrected)
    assert manifest["drip_feed"] is True
    assert manifest["loads"] == 4  # of 145 positions
    assert manifest["largest_load_kB"] < 5
    assert corrected.text.count(b":  PAUSE ;") == 3
    assert any("drip feed" in f.message for f in corrected.findings)


# When it cannot be, or need not ----------------------------------------------------------------------------------


def test_without_a_stop_it_is_one_file_and_the_mend_is_said():
    job = load_job(path_file("line_x"), None, ("robot.controller.max_lines=60",))
    planned, corrected = generate.generate(job, quiet)
    assert [n for n, _ in corrected.delivery.files] == ["LINE_X.LS"]
    assert not planned.path.stop[5:-5].any()
    finding = next(f for f in corrected.findings if f.code == "controller.size")
    assert finding.level is Level.OUTSIDE
    assert corrected.verdict is Verdict.NOT_LOADABLE
    assert "page_stops = 'anywhere'" in finding.message
    assert "waypoints" in finding.message


def test_a_program_that_fits_is_one_file_as_before():
    plain = generate.generate(load_job(path_file("line_x")), quiet)[1]
    allowed = generate.generate(load_job(path_file("line_x"), None, ("process.page_stops=anywhere",)), quiet)[1]
    assert [n for n, _ in plain.delivery.files] == ["LINE_X.LS"]
    assert plain.program.position.tobytes() == allowed.program.position.tobytes()
    assert plain.program.speed.tobytes() == allowed.program.speed.tobytes()


# The proof can fail ----------------------------------------------------------------------------------------------


def test_a_page_that_was_changed_is_refused(made):
    _, corrected, _ = made
    files = files_of(corrected)
    manifest = files["LINE_X.pages.json"]
    name = corrected.delivery.paged.pages[1].name
    changed = {**files, f"{name}.LS": files[f"{name}.LS"].replace(b"CNT100", b"FINE  ", 1)}
    with pytest.raises(JoinError, match="not the file"):
        check_manifest(manifest, changed)
    with pytest.raises(JoinError, match="not there"):
        check_manifest(manifest, {n: c for n, c in files.items() if n != f"{name}.LS"})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda p: replace(p, position=p.position + np.array([1e-6, 0, 0])), r"starts 0.001 mm from"),
        (lambda p: replace(p, turns=p.turns + 1), "turns differ"),
        (lambda p: replace(p, utool=p.utool + 1), "utool differ"),
        (lambda p: replace(p, comment="another"), "comment differ"),
        (lambda p: replace(p, name="OTHER"), "calls itself"),
    ],
)
def test_pages_that_do_not_meet_are_refused(made, change, message):
    _, corrected, _ = made
    pages = {p.name: p.data for p in corrected.delivery.paged.pages}
    name = corrected.delivery.paged.pages[1].name
    pages[name] = ls.compose(change(ls.interpret(pages[name])))
    with pytest.raises(JoinError, match=message):
        interpret_pages(corrected.text, pages)


def test_a_page_that_does_not_stop_is_refused(made):
    _, corrected, _ = made
    pages = {p.name: p.data for p in corrected.delivery.paged.pages}
    first = ls.interpret(pages[corrected.delivery.paged.pages[0].name])
    running = replace(first, fine=np.append(first.fine[:-1], False))
    pages[first.name] = ls.compose(running)
    with pytest.raises(JoinError, match="does not stop"):
        interpret_pages(corrected.text, pages)


def test_added_stops_leave_the_correction_smooth(made):
    """No corner where a page ends: second differences there are those of their neighbours."""
    _, corrected, _ = made
    free = load_job(path_file("line_x"), None, ("robot.controller.max_lines=9999",))
    plain = generate.generate(free, quiet)[1].solution.correction
    assert np.abs(corrected.solution.correction - plain).max() < 0.05 * UM


def test_what_a_wait_does_counts_from_there_on():
    """Across the arm's front the first half is the more sensitive: it is over when the robot waits in the middle."""
    planned, corrected = generate.generate(load_job(path_file("line_y")), quiet)
    job, theta, n = planned.job, corrected.solution.theta, len(planned.path.arc) // 2
    window = generate.start_windows(planned, corrected.solution.theta, np.array([n]))[0]
    assert window > corrected.start_window + 20
    late = state_after(job.heat, [Duty("idle", 0.0, window)], planned.rise[n])
    rise = stepped(
        job.heat, late, planned.trajectory.time[n:] - planned.trajectory.time[n], planned.trajectory.driven_speed[n:]
    )
    now, late = (planned.model.actual_pose(theta[n:], r).position for r in (planned.rise[n:], rise))
    moved = late - now
    assert np.linalg.norm(moved, axis=1).max() == pytest.approx(job.start_drift, rel=1e-3)


@pytest.mark.parametrize(("nodes", "lines"), [(1, 7), (2, 7), (5, 9), (6, 9)])
def test_a_head_has_six_remarks_and_two_rises_a_line(nodes, lines):
    assert head_line_count(nodes) == lines
