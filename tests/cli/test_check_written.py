"""``cgen check --written``: the text that was written is flown, in the state of the path, and no other path's."""

import json
import re

import pytest
from command_line import refused, run
from shipped import ROOT, path_file, quiet

from compgen.core.units import UM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.pipelines.planned import generate
from compgen.report.job_summary import job_summary
from compgen.verification.deviation import deviation_from_path
from compgen.verification.twin import prepare

LINE = ROOT / "paths" / "line_y.toml"
CIRCLE = ROOT / "paths" / "circle_1300.toml"
SPIRAL = ROOT / "paths" / "spiral_1300.toml"
DRAWS_UM = 0.05  # that a late start of some ms less may change
STATE = ("--set", "before.0.duration_h=1", "--set", "ambient.value_degC=26")


def written(folder, path, *overrides):
    sets = [word for item in overrides for word in ("--set", item)]
    result = run("generate", path, *sets, "-q", "--force", "-o", folder / "o", cwd=folder)
    assert result.returncode in (0, 1), result.stderr
    return folder / "o" / f"{path.stem.upper()}.LS"


def report(path, program, *options):
    result = run("check", path, "--written", program, *options, "--json")
    assert result.returncode in (0, 1), result.stderr
    return result.returncode, json.loads(result.stdout)


@pytest.fixture(scope="module")
def line(tmp_path_factory):
    return written(tmp_path_factory.mktemp("line"), LINE)


def test_in_its_own_state_the_text_leaves_what_its_report_says(line):
    code, record = report(LINE, line)
    assert (code, record["verdict"]) == (0, "inside")
    made = json.loads((line.parent / "report.json").read_text())
    for side in ("before", "after"):
        for statistic, value in made["on_part"][side]["total"].items():
            assert record["on_part"][side]["total"][statistic] == pytest.approx(value, abs=1e-9)
    assert record["written"]["name"] == "LINE_Y"


def test_in_another_state_it_is_off_by_what_the_rises_do_and_the_exit_code_says_so(line):
    code, record = report(LINE, line, *STATE)
    overrides = [word for word in STATE if word != "--set"]
    job = load_job(path_file("line_y"), overrides=overrides)
    _, corrected = generate.generate(load_job(path_file("line_y")), quiet)
    planned = generate.predict(job, quiet)
    prepared = prepare(twin_of(job), corrected.program, job.history.before, job.history.air)
    deviation = deviation_from_path(planned.path, prepared.chunks(), prepared.sample_count)
    assert code == 1
    assert record["verdict"] == "outside"
    assert record["on_part"]["after"]["total"]["max_um"] == pytest.approx(deviation.on_part["total"].max / UM, abs=1e-9)
    assert record["on_part"]["after"]["total"]["max_um"] > 20
    assert "bounds.max_um" in {finding["code"] for finding in record["findings"]}


def test_the_bound_of_the_command_line_judges_it(line):
    assert report(LINE, line, *STATE, "--max-um", "500", "--set", "bounds.normal_um=500")[0] == 0
    result = run("check", LINE, "--written", line, *STATE)
    assert result.returncode == 1
    assert "in this state: largest error on the part" in result.stdout
    assert "outside bounds" in result.stderr


@pytest.mark.parametrize("override", ["process.moves=arcs", "process.thin_um=2"])
def test_a_program_that_leaves_waypoints_out_is_flown_in_another_state(tmp_path, override):
    program = written(tmp_path, CIRCLE, override)
    made = json.loads((program.parent / "report.json").read_text())
    _, own = report(CIRCLE, program, "--set", override)
    assert own["on_part"]["after"]["total"]["max_um"] == pytest.approx(
        made["on_part"]["after"]["total"]["max_um"], abs=1e-6
    )
    _, other = report(CIRCLE, program, "--set", override, *STATE)
    assert 20 < other["on_part"]["after"]["total"]["max_um"] < 200
    job = load_job(path_file("circle_1300"), None, [override, *(word for word in STATE if word != "--set")])
    predicted = job_summary(generate.predict(job, quiet), None)
    assert other["before"]["total"] == pytest.approx(predicted["before"]["total"], abs=1e-6)
    assert other["on_part"]["before"]["total"] == pytest.approx(predicted["on_part"]["before"]["total"], abs=1e-6)


@pytest.mark.parametrize("override", ["process.moves=arcs", "process.thin_um=2"])
def test_waypoints_nearer_to_one_another_than_a_correction_is_long_are_told_apart(tmp_path, override):
    """In the middle of a spiral they are 0.03 mm apart, and the correction is 0.12: the nearest is another one."""
    words = (override, "path.diameter_mm=10", "path.turns=5")
    program = written(tmp_path, SPIRAL, *words)
    made = json.loads((program.parent / "report.json").read_text())["on_part"]["after"]["total"]
    _, own = report(SPIRAL, program, *(word for item in words for word in ("--set", item)))
    assert own["on_part"]["after"]["total"] == pytest.approx(made, abs=1e-3)


MOTION = (
    'robot.motion={space="cartesian", moving_average_ms=[200,100], enabled=true}',
    'robot.motion.identified={robot="m710ic50", verdict="accepted", runs_began="both"}',
)


@pytest.mark.parametrize("more", [(), MOTION])
@pytest.mark.parametrize("override", ["process.moves=arcs", "process.thin_um=8"])
def test_the_motion_and_the_times_are_those_of_the_text_not_of_the_plan(tmp_path, override, more):
    """The plan's lines are other ones: 25.0 s for 21.5, led 111 um off for 240."""
    words = (override, "path.diameter_mm=300", *more)
    (program,) = written(tmp_path, CIRCLE, *words).parent.glob("*.LS")
    made = json.loads((program.parent / "report.json").read_text())
    _, own = report(CIRCLE, program, *(word for item in words for word in ("--set", item)))
    for summary in (made, own):
        summary["findings"] = [f for f in summary["findings"] if f["code"].startswith("motion.")]
    keys = ("duration_s", "as_written_s", "rounded_up_s", "at_feed")
    assert own["motion"] == made["motion"]
    assert own["findings"] == made["findings"] != []
    assert [own["timing"][key] for key in keys] == pytest.approx([made["timing"][key] for key in keys], abs=1e-9)
    assert own["band"]["unknown"] == made["band"]["unknown"]


CYCLE = ("--set", 'cycle=[{state="moving", repeat=6, dwell_s=600}]')
STARTS = ("--set", "compensation.average_over={runs=[1,3], delay_s=[0,600]}")


@pytest.mark.parametrize(
    ("start", "run_number", "delay_s"),
    [
        ((), 1, 0),
        (("start.delay_min=93",), 1, 5580),
        (("start.run=3",), 3, 0),
        (("start.run=3", "start.delay_min=2"), 3, 120),
    ],
)
def test_the_start_that_is_flown_is_named_as_the_day_has_it(line, start, run_number, delay_s):
    """The job's starts count from its [start]: the first run, at once, was said of each."""
    _, record = report(LINE, line, *CYCLE, *(word for item in start for word in ("--set", item)))
    assert (record["written"]["run"], record["written"]["delay_s"]) == (run_number, delay_s)


def test_of_starts_that_one_file_serves_the_worst_is_named_as_the_day_has_it(line):
    """The line is for the first run after a warm-up: of later ones the last, and latest, errs most."""
    _, one = report(LINE, line, *CYCLE, *STARTS)
    _, other = report(LINE, line, *CYCLE, *STARTS, "--set", "start.run=2", "--set", "start.delay_min=2")
    assert (one["written"]["run"], one["written"]["delay_s"]) == (3, 600)
    assert (other["written"]["run"], other["written"]["delay_s"]) == (4, 600)


def test_pages_are_read_through_their_main_program(tmp_path):
    few = ("robot.controller.max_positions=400", "process.page_stops=anywhere", "bounds.max_um=20")
    sets = [word for item in few for word in ("--set", item)]
    program = written(tmp_path, CIRCLE, *few)
    pages = sorted(file for file in program.parent.glob("*.LS") if file != program)
    assert len(pages) > 2
    made = json.loads((program.parent / "report.json").read_text())
    _, record = report(CIRCLE, program, *sets)
    assert record["on_part"]["after"]["total"]["max_um"] == pytest.approx(made["on_part"]["after"]["total"]["max_um"])
    named = record["written"]["name"], record["written"]["positions"]
    assert named == ("CIRCLE_1300", made["program"]["positions"]) == (program.stem, made["program"]["positions"])
    refused(run("check", CIRCLE, "--written", pages[0], *sets), 2, pages[0].name, "positions")
    text = pages[2].read_bytes()
    pages[2].write_bytes(re.sub(rb"X = +[-0-9.]+", b"X = 12.000", text, count=1))
    refused(run("check", CIRCLE, "--written", program, *sets), 2, f"(page {pages[2].stem}: it starts ", " from where ")
    pages[1].unlink()
    refused(run("check", CIRCLE, "--written", program, *sets), 2, f"(page {pages[1].stem}: ", "it is not there); gen")


def test_another_path_s_program_is_refused(line, tmp_path):
    refused(run("check", ROOT / "paths" / "line_x.toml", "--written", line), 2, "LINE_Y.LS", "another path's program")
    moved = ("--set", "path.x_mm=1300.0")
    refused(run("check", LINE, "--written", line, *moved), 2, "LINE_Y.LS", "line_y.toml", "another path's program")


EDITS = {
    "a stop taken away": ("FINE", "CNT100", "it does not stop there"),
    "a stop added": ("CNT100", "FINE", "it stops there"),
    "a speed": (r"\d+mm/sec", "999mm/sec", "999 mm/s lead there"),
    "a payload": (r"\d+:J P\[1\]", "99:  PAYLOAD[2] ;\r\n 100:J P[1]", "PAYLOAD 2"),
}


@pytest.mark.parametrize("edit", EDITS)
def test_a_text_that_was_edited_since_is_refused(edit, line, tmp_path):
    """Its places were this path's, and it was inside."""
    old, new, words = EDITS[edit]
    text = line.read_bytes().decode()
    begin = text.index("\r\n", text.index("J P[1]")) if edit != "a payload" else 0  # a stop at the first is a start
    edited = tmp_path / line.name
    edited.write_bytes((text[:begin] + re.sub(old, new, text[begin:], count=1)).encode())
    refused(run("check", LINE, "--written", edited), 2, line.name, words, "one was edited since")


@pytest.mark.parametrize("speed", [50, 240])
def test_a_speed_on_lines_shorter_than_a_millimetre_is_seen(speed, tmp_path):
    dense = ("process.spacing_mm=0.9", "path.length_mm=200")
    program = written(tmp_path, LINE, *dense)
    sets = [word for item in dense for word in ("--set", item)]
    assert report(LINE, program, *sets)[0] in (0, 1)
    edited = tmp_path / program.name
    edited.write_bytes(re.sub(rb"(L P\[1[0-4]\d\]) \d+mm/sec", rb"\1 %dmm/sec" % speed, program.read_bytes()))
    result = run("check", LINE, "--written", edited, *sets)
    refused(result, 2, "P[100]: ", f"{speed} mm/s lead there, and", "plans 113 mm/s: one was edited since")


def test_another_robot_file_than_it_was_written_with_is_a_warning(line, tmp_path):
    other = tmp_path / "other.toml"
    other.write_text((ROOT / "robots" / "m710ic50.toml").read_text() + "\n# a later state of the file\n")
    code, record = report(LINE, line, "--robot", other)
    assert code == 0
    [warning] = [finding for finding in record["findings"] if finding["code"] == "written.robot_file"]
    assert warning["level"] == "warning"
    assert record["written"]["made_as"][2].removeprefix("robot file ") in warning["message"]
    own = report(LINE, line, *STATE, "--set", "robot.thermal.cte_um_m_K=12")[1]
    assert "written.robot_file" not in {finding["code"] for finding in own["findings"]}


def test_what_is_no_program_and_several_paths_are_refused(line, tmp_path):
    (tmp_path / "NOTE.LS").write_text("/PROG NOTE\n/END\n")
    refused(run("check", LINE, "--written", tmp_path / "NOTE.LS"), 2, "NOTE.LS", "generate it anew")
    refused(run("check", LINE, "--written", tmp_path / "NONE.LS"), 2, "NONE.LS")
    refused(run("check", LINE, CIRCLE, "--written", line), 2, "--written", "one path")


PROMISE = ("--set", "bounds.guaranteed={max_um=200, normal_um=100, seed=3}")


def test_bounds_with_a_probability_are_judged_by_flying_the_text(line):
    code, record = report(LINE, line, *PROMISE)
    result = run("check", LINE, *PROMISE, "--json")
    made = json.loads(result.stdout)
    assert code == result.returncode == 0
    for key, bound in made["guaranteed"]["bounds"].items():
        assert record["guaranteed"]["bounds"][key]["bound"] == bound["bound"]
        assert record["guaranteed"]["bounds"][key]["value"] == pytest.approx(bound["value"], abs=DRAWS_UM)
    assert record["band"]["seed"] == 3
    broken = run("check", LINE, "--written", line, "--set", "bounds.guaranteed.max_um=5")
    refused(broken, 1, "95 % of arms and days", "bounds.guaranteed.max_um = 5")
    assert "guaranteed: 95 % of arms and days stay within max_um" in broken.stdout


def test_in_another_state_the_draws_are_of_that_state(line):
    loose = ("--max-um", "500", "--set", "bounds.normal_um=500")
    _, own = report(LINE, line, *PROMISE, *loose)
    _, record = report(LINE, line, *PROMISE, *loose, *STATE)
    difference = record["on_part"]["after"]["total"]["max_um"] - own["on_part"]["after"]["total"]["max_um"]
    values = [r["guaranteed"]["bounds"]["max_um"]["value"] for r in (record, own)]
    assert values[0] - values[1] > 0.3 * difference > 5


def test_strict_flies_the_text_with_other_ramps(line):
    made = json.loads(run("check", LINE, "--strict", "--json").stdout)
    code, record = report(LINE, line, "--strict")
    assert code == 0
    messages = [[f["message"] for f in r["findings"] if f["code"] == "timing.ramps"] for r in (made, record)]
    assert len(messages[0]) == 1
    assert messages[0] == messages[1]
    assert not any(f["code"] == "timing.ramps" for f in report(LINE, line)[1]["findings"])
