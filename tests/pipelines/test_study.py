"""What-if studies: the same numbers as one run, kept through a kill, the same over processes and a cluster."""

import csv
import io
import json
import os
import random
import re
import subprocess
import sys
import time
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from command_line import run as command
from flawed import flawed_file
from numpy.testing import assert_allclose
from shipped import ROOT, path_file, quiet
from states import state_of, written

from compgen.cli.output_files import study_files
from compgen.core.exceptions import InputError
from compgen.core.units import UM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.pipelines.study import ASKS, build, questions, run, scenarios, timeline, workers
from compgen.pipelines.study.geometry import execute_with, part_weight, plan_geometry
from compgen.pipelines.study.questions import answer_questions, first_above, first_below, passes, when_settled
from compgen.pipelines.study.scenarios import Scenario
from compgen.pipelines.study.workers import geometry_key
from compgen.report.study_page import study_html, study_sentences
from compgen.report.study_tables import StudyOutcome, answer_csv, largest_and_least, study_csv
from compgen.thermal.schedule import History
from compgen.verification.deviation import deviation_from_path, statistics

PATH = path_file("line_y")
#: sources of the flawed robot that do not grow with temperature along a link
NOT_GROWTH = (
    "loads", "link_offsets", "joint_zeros", "joint_coupling", "compliance", "gear_harmonics", "joint_ripple",
    "hysteresis", "base_frame", "thermal_bend", "thermal_shift", "tool_frame", "map", "box",
)  # fmt: skip
GRID = ("before.0.duration_h=0,3,6", "robot.thermal.cte_um_m_K=10,12")


def rows_of(study, workers=1, done=()):
    rows: list[dict[str, Any]] = []
    run(study, set(done), rows.extend, workers)
    return sorted(rows, key=lambda r: r["index"])


@pytest.fixture(scope="module")
def study():
    return build(PATH, None, (), GRID, None, correct=False)


@pytest.fixture(scope="module")
def rows(study):
    return rows_of(study)


def compgen(*arguments, **more):
    return subprocess.run(
        [sys.executable, "-m", "compgen", *arguments], cwd=ROOT, capture_output=True, text=True, **more
    )


def test_a_grid_is_the_product_in_order(study):
    assert len(study.scenarios) == 6
    assert study.scenarios[1].values == (("before.0.duration_h", "0"), ("robot.thermal.cte_um_m_K", "12"))
    assert [s.index for s in study.scenarios] == list(range(6))


def test_every_row_is_what_predict_says(study, rows):
    for row, scenario in zip(rows, study.scenarios, strict=True):
        planned = generate.predict(load_job(PATH, overrides=scenario.overrides()), quiet)
        told = statistics(planned.deviation())["total"]
        for name in ("max_um", "p99_um", "rms_um"):
            assert row[f"before_{name}"] == pytest.approx(told[name], rel=1e-5, abs=1e-5)
        assert row["duration_s"] == pytest.approx(planned.deviation().time[-1], rel=1e-5)
        assert row["waypoints"] == len(planned.theta)
        assert row["start_j3_K"] == pytest.approx(planned.rise[0, 2], rel=1e-5)
        assert row["band_um"] == pytest.approx(planned.band_of_plan().largest / UM, rel=1e-3)
        assert "sensor_um" not in row  # without a log
    assert rows[5]["before_max_um"] > rows[4]["before_max_um"] > rows[0]["before_max_um"]


@pytest.mark.parametrize("override", ['process.moves="arcs"', "process.thin_um=20"])
def test_a_row_is_of_the_positions_that_the_planned_program_names(override):
    circle = path_file("circle_1300")
    (row,) = rows_of(build(circle, None, (override,), ("process.feed_mm_s=200",), None, correct=False))
    planned = generate.predict(load_job(circle, overrides=[override]), quiet)
    deviation = planned.deviation()
    assert row["waypoints"] == len(planned.theta)
    assert row["duration_s"] == pytest.approx(deviation.time[-1], rel=1e-5)
    assert row["before_on_part_max_um"] == pytest.approx(deviation.on_part["total"].max / UM, rel=1e-5)
    assert row["before_rms_um"] == pytest.approx(deviation.extents["total"].rms / UM, rel=1e-5)


def test_scenarios_that_change_temperatures_share_their_geometry(study):
    assert len({geometry_key(s) for s in study.scenarios}) == 1
    feeds = build(PATH, None, (), ("feed=50,100",), None, correct=False)
    assert len({geometry_key(s) for s in feeds.scenarios}) == 2


def test_sweeps_that_run_in_for_another_rate_are_another_geometry():
    raster = path_file("optic_raster")
    play = "robot.sources.hysteresis={backlash_mdeg=[2,2,2,2,2,2], width_mdeg=[10,10,10,10,10,10]}"
    base = (play, "path.stepover_mm=5")
    study = build(raster, None, base, ("compensation.rate_um_mm=1,100",), None, correct=False)
    planned = [generate.predict(load_job(raster, overrides=[*base, *s.overrides()]), quiet) for s in study.scenarios]
    counts = [len(one.theta) for one in planned]
    assert [row["waypoints"] for row in rows_of(study)] == counts
    assert counts[0] != counts[1]


@pytest.mark.parametrize(("path", "motion"), [(PATH, "[]"), (path_file("circle_1300"), "[200, 100]")])
def test_the_shared_ride_is_the_twins_own(path, motion):
    smoothed = f"robot.motion={{moving_average_ms={motion}}}"
    cold, warm = (load_job(path, overrides=[f"before.0.duration_h={h}", smoothed]) for h in (0, 6))
    execution = execute_with(warm, plan_geometry(cold))
    own = generate.predict(warm, quiet)
    found = deviation_from_path(own.path, [execution], len(execution.time))
    assert_allclose(found.error, own.deviation().error, atol=1e-10)  # m; pinocchio's arm against the symbolic one
    assert np.abs(found.error).max() > 20 * UM


def test_other_workers_give_the_same_rows(study, rows, monkeypatch):
    assert rows_of(study, workers=2) == rows
    monkeypatch.setattr(workers, "CHUNK", 2)  # three chunks, over processes
    assert rows_of(study, workers=2) == rows
    assert rows_of(study, done={0, 1, 2, 3}) == rows[4:]


def test_one_worker_and_one_chunk_are_this_process_and_no_scenario_is_nothing_to_do(study, monkeypatch):
    feeds = build(PATH, None, (), ("feed=50,100",), None, correct=False)
    monkeypatch.setattr(workers, "evaluate", lambda _, scenario, __: {"index": scenario.index, "process": os.getpid()})
    for asked, count in ((feeds, 1), (study, 0), (study, 2)):
        assert {row["process"] for row in rows_of(asked, count)} == {os.getpid()}
    for count in (0, 1, 2):
        assert rows_of(feeds, count, done={0, 1}) == []


def test_more_geometries_than_are_kept_are_laid_out_and_the_last_ones_once(monkeypatch):
    """Refusals among them: each is the scenario's own."""
    made, shared = [], workers.Shared()

    def plan_geometry(job):
        made.append(job)
        if job == 2:
            raise InputError("out of reach")
        return job

    def of(n):
        return shared.of(Scenario(n, (("feed", str(n)),)), n)

    monkeypatch.setattr(workers, "plan_geometry", plan_geometry)
    count = workers.KEPT + 1
    for n in (*range(count), *range(1, count), 0):
        if n == 2:
            with pytest.raises(InputError, match="out of reach"):
                of(n)
        else:
            assert of(n) == n
    assert made == [*range(count), 0]


def test_a_corrected_scenario_outside_its_bounds_says_why():
    base = ("bounds.max_um=0.01",)
    (row,) = rows_of(build(PATH, None, base, ("before.0.duration_h=3",), None, correct=True))
    assert row["inside"] is False
    assert "above bounds.max_um = 0.01" in row["reason"]


def test_what_the_sensors_of_a_log_may_hide_stands_in_the_row(tmp_path):
    log = tmp_path / "log.csv"
    rows = [(t, 20.0, 20 - 17.6 * np.expm1(-t / 23400) + 0.1 * np.sin(t)) for t in range(0, 14400, 60)]
    log.write_text("time_s,ambient_degC,part_3_degC\n" + "".join(f"{t},{air:.2f},{arm:.2f}\n" for t, air, arm in rows))
    study = build(PATH, None, (f"log.file='{log}'",), ("process.feed_mm_s=100",), None, correct=False)
    planned = generate.predict(load_job(PATH, overrides=[*study.base, *study.scenarios[0].overrides()]), quiet)
    hidden = planned.band_of_plan().hidden
    assert hidden > 10 * UM
    assert rows_of(study)[0]["sensor_um"] == pytest.approx(hidden / UM, rel=1e-3)


def test_correction_is_the_pipelines(rows):
    corrected = rows_of(build(PATH, None, (), ("before.0.duration_h=3",), None, correct=True))[0]
    _, whole = generate.generate(load_job(PATH, overrides=["before.0.duration_h=3"]), quiet)
    assert corrected["after_max_um"] == pytest.approx(statistics(whole.deviation)["total"]["max_um"], rel=1e-5)
    assert corrected["inside"] is True
    assert "reason" not in corrected
    assert corrected["start_window_s"] == pytest.approx(whole.start_window, rel=1e-5)
    assert corrected["band_um"] == pytest.approx(whole.band.largest / UM, rel=1e-5)
    on_part = statistics(whole.deviation, on_part=True)["total"]["max_um"]
    assert corrected["after_on_part_max_um"] == pytest.approx(on_part, rel=1e-5)
    assert corrected["before_max_um"] > 10 * corrected["after_max_um"]


def test_a_scenario_that_fails_is_a_row_with_its_reason():
    rows = rows_of(build(PATH, None, (), ("path.x_mm=1350,9000", "before.0.duty=0.5,1"), None, correct=False))
    assert [r["state"] for r in rows] == ["done", "done", "failed", "failed"]
    assert "out of reach" in rows[2]["reason"]
    table = list(csv.DictReader(io.StringIO(study_csv(build_of(rows), rows).decode())))
    assert table[2]["state"] == "failed"
    assert "out of reach" in table[2]["reason"]
    assert "2 failed" in largest_and_least(build_of(rows), rows)


def build_of(found):
    return build(PATH, None, (), ("path.x_mm=1350,9000", "before.0.duty=0.5,1"), None, correct=False)


def test_a_list_is_read_row_by_row(tmp_path):
    (tmp_path / "l.csv").write_text("feed,before.0.duration_h\n50,1\n100,2\n")
    study = build(PATH, None, (), (), str(tmp_path / "l.csv"), correct=False)
    assert [dict(s.values) for s in study.scenarios] == [
        {"process.feed_mm_s": "50", "before.0.duration_h": "1"},
        {"process.feed_mm_s": "100", "before.0.duration_h": "2"},
    ]


@pytest.mark.parametrize(
    ("vary", "words"),
    [
        (("process.fed_mm_s=1,2",), ("process.fed_mm_s", "unknown key", "feed_mm_s")),
        (("robot.thermal.cte=1,2",), ("robot.thermal.cte", "unknown key")),
        (("feed=",), ("empty", "process.feed_mm_s")),
        (("feed=1:2:0",), ("empty",)),
        (("feed=20:200:1",), ("feed=20:200:1", "one value is no range")),
        (("fed=1,2",), ("did you mean 'feed'",)),
        (("process=20",), ("process: 20 must be a table; vary a key of it",)),
        (("titel=a,b",), ("did you mean 'title'",)),
        (("feed=1:2:1000000000",), ("more than 100000 values",)),
        (("feed=1,,2",), ("feed=1,,2", "a value is missing")),
        ((), ("nothing to vary",)),
        (("feed",), ("expected KEY",)),
        (("feed=1,2", "process.feed_mm_s=3"), ("twice",)),
        (("feed=20:200:400", "duty=0:1:400"), ("160000", "100000")),
        (("feed=a,b",), ("--vary process.feed_mm_s: ", "'a'", "valid number", "; change this value or leave it out")),
        (("feed=100,200,-1,50",), ("process.feed_mm_s", "-1", "must be greater than")),
        (("feed=100,true",), ("process.feed_mm_s", "True")),
        (("duty=0.5,7", "feed=100,200"), ("before.0.duty", "7", "must be less than")),
        (("feed=100,200", "process.feed_profile=a"), ("process.feed_profile", "unknown key")),
    ],
)
def test_a_study_that_cannot_be_is_refused(vary, words):
    with pytest.raises(InputError) as told:
        build(PATH, None, (), vary, None, correct=False)
    assert all(w in str(told.value) for w in words), told.value


@pytest.mark.parametrize(
    ("path", "base", "refusal"),
    [
        (PATH, ("proces.feed=1",), "line_y.toml: proces: unknown key; did you mean 'process'?"),
        ("nowhere.toml", (), "nowhere.toml: no such file"),
    ],
)
def test_what_no_scenario_can_mend_is_not_laid_on_what_varies(path, base, refusal):
    with pytest.raises(InputError, match=re.escape(refusal)) as refused:
        build(path, None, base, ("duty=0.1,0.2",), None, correct=False)
    assert "--vary" not in str(refused.value)


def test_scenarios_beyond_what_was_measured_are_named_as_predict_names_them():
    """Thirty hours of work where the law is known for six and a half: 144 um, without a word."""
    hours = (5, 30)
    study = build(PATH, None, (), (f"before.0.duration_h={hours[0]},{hours[1]}",), None, correct=False)
    rows = rows_of(study)
    for row, hour in zip(rows, hours, strict=True):
        planned = generate.predict(load_job(PATH, overrides=[f"before.0.duration_h={hour}"]), quiet)
        wanted = "; ".join(f.message for f in planned.findings if f.code == "thermal.box")
        assert row.get("beyond_measured", "") == wanted
    outcome = StudyOutcome(study=study, rows=rows, answers=[])
    assert any(
        s.startswith("1 of 2 scenarios beyond what was measured: scenario 1: 30") for s in study_sentences(outcome)
    )


def test_a_key_that_only_the_scenarios_have_is_known(tmp_path):
    text = (ROOT / "paths" / "optic_spiral.toml").read_text()
    (tmp_path / "p.toml").write_text(text.replace('"spiral"', '"raster"').replace("stepover_mm", "# stepover_mm"))
    study = build(str(tmp_path / "p.toml"), None, ("path.turns=2",), ("path.pattern=spiral",), None, correct=False)
    assert len(study.scenarios) == 1


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a,b\n", ("empty",)),
        ("feed,chord\n1\n", ("line 2", "1 cells", "header has 2")),
        ("feed,chord\n1,\n", ("line 2, column chord", "empty")),
        ("feed,chord\n1,2:3:0\n", ("line 2, column chord", "0 values")),
        ('feed,chord\n1,"2,3"\n', ("line 2, column chord", "2 values")),
        ("feed,process.feed_mm_s\n1,2\n", ("process.feed_mm_s stands twice in the header", "keep one")),
    ],
)
def test_a_list_that_cannot_be_is_refused(tmp_path, text, words):
    (tmp_path / "l.csv").write_text(text)
    with pytest.raises(InputError) as told:
        build(PATH, None, (), (), str(tmp_path / "l.csv"), correct=False)
    assert all(w in str(told.value) for w in words), told.value


@pytest.mark.parametrize(
    ("typed", "values"),
    [
        ("20:200:10", ["20.0", "40.0", "60.0", "80.0", "100.0", "120.0", "140.0", "160.0", "180.0", "200.0"]),
        ("0.1:0.4:4", ["0.1", "0.2", "0.3", "0.4"]),  # as they are typed, not as sums round
        ("200:80:3", ["200.0", "140.0", "80.0"]),
        ("50:50:1", ["50.0"]),
        ("50:50:2", ["50.0", "50.0"]),
        ("50:80:2", ["50.0", "80.0"]),
    ],
)
def test_a_range_is_so_many_values_both_ends_among_them(typed, values):
    ranged = build(PATH, None, (), (f"feed={typed}",), None, correct=False)
    assert [s.overrides() for s in ranged.scenarios] == [[f"process.feed_mm_s={value}"] for value in values]


def test_as_many_scenarios_as_are_allowed_are_taken(monkeypatch):
    monkeypatch.setattr(scenarios, "MOST", 4)
    for vary in (("feed=20:50:4",), ("feed=20,30", "duty=0.5,1")):
        assert len(build(PATH, None, (), vary, None, correct=False).scenarios) == 4
    for vary, words in ((("feed=20:60:5",), "more than 4 values"), (("feed=20,30", "duty=0,0.5,1"), "6 .* over 4")):
        with pytest.raises(InputError, match=words):
            build(PATH, None, (), vary, None, correct=False)


def test_values_are_not_refused_for_what_the_files_say_of_another_key():
    study = build(PATH, None, ("process.chord_um=-1",), ("duty=0.5,1",), None, correct=False)
    rows = rows_of(study)
    assert [row["state"] for row in rows] == ["failed", "failed"]
    assert all("process.chord_um: -1" in row["reason"] for row in rows)


def test_a_value_that_looks_like_another_units_is_asked_about_once(tmp_path):
    """Of all that its scenarios' files make one say, no more than this."""
    study = build(PATH, None, (), ("robot.thermal.cte_um_m_K=11.25e-6,12", "feed=50,100"), None, correct=False)
    assert {f.code for f in study.questions} == {"units.unlikely"}
    assert len(study.questions) == 1
    assert build(PATH, None, (), ("feed=50,100",), None, correct=False).questions == ()


def test_a_row_that_the_file_does_not_have_is_named_with_its_short_name():
    with pytest.raises(InputError, match=r"no such \[\[before\]\] to vary; write it there") as told:
        build(PATH, None, ("before=[]",), ("warmup_h=1,2",), None, correct=False)
    assert str(told.value).startswith("--vary warmup_h, before.0.duration_h: ")


def test_whatever_the_results_depend_on_makes_another_study(tmp_path):
    """Also where the file alone makes no job: what is varied gives what it lacks."""
    feed, broken = ("feed=20,30",), tmp_path / "p.toml"
    text = Path(PATH).read_text()
    line = next(line for line in text.splitlines() if line.startswith("feed_mm_s"))

    def identity(path=PATH, robot=None, base=(), vary=feed, correct=False):
        return build(path, robot, base, vary, None, correct=correct).identity

    def of_text(content, robot="m710ic50"):
        broken.write_text(content)
        return identity(str(broken), robot)

    first = identity()
    assert identity() == first
    without = text.replace(line, "")
    asked = [
        first,
        identity(base=("process.chord_um=7",)),
        identity(vary=("feed=20,31",)),
        identity(correct=True),
        identity(robot="m710ic70"),
        of_text(without),
        of_text(f"{without}\n# more"),
        of_text(without, "m710ic70"),
    ]
    files = [tmp_path / name for name in ("day.csv", "night.csv")]
    for temperature in (20, 34):
        for file in files:
            file.write_text(f"time_s,ambient_degC\n0,{temperature}\n90000,{temperature}\n")
            varied = ",".join(f'"{name}"' for name in files)
            asked.append(identity(base=('ambient.kind="csv"',), vary=(f"ambient.file={varied}",)))
    assert len(set(asked)) == len(asked)
    assert of_text(without) == asked[5]


def test_a_journal_gives_back_whole_lines_of_the_same_study(tmp_path):
    first, second = ({"index": n, "x": 2.5, "state": "failed", "reason": "none"} for n in (1, 0))
    book = study_files.Journal(tmp_path, "one", [])
    book.add([first, second])
    book.close()
    file = tmp_path / study_files.JOURNAL
    whole = file.read_bytes()
    for cut in range(len(whole)):
        file.write_bytes(whole[:cut])
        rows = study_files.read_finished(tmp_path, "one")
        assert rows in ([], [first], [first, second])
        assert len(rows) == max(0, whole[:cut].count(b"\n") - 1)
    file.write_bytes(whole)
    assert study_files.read_finished(tmp_path, "another") == []
    assert study_files.journal_text("one", study_files.read_finished(tmp_path, "one")).count(b"\n") == 3


@pytest.mark.parametrize(
    "row",
    [
        '{"index": 0}', "[]", "7", '{"index": true, "state": "failed", "reason": "none"}',
        '{"index": -1, "state": "failed", "reason": "none"}', '{"index": 0, "state": "failed"}',
        '{"index": 0, "state": "done"}', '{"index": 0, "state": "done", "before_on_part_max_um": "one"}',
        '{"index": 0, "state": "done", "before_on_part_max_um": 1, "before_rms_um": 1, "duration_s": NaN, '
        '"waypoints": 5}',
        '{"index": 0, "state": ["done"]}',
    ],
)  # fmt: skip
def test_a_journal_with_a_row_that_no_study_writes_is_refused(tmp_path, row):
    book = study_files.Journal(tmp_path, "one", [])
    book.close()
    with (tmp_path / study_files.JOURNAL).open("a") as file:
        file.write(f"{row}\n")
    with pytest.raises(InputError, match=r"scenarios\.jsonl: line 2: not a row of this study; .* or say --fresh"):
        study_files.read_finished(tmp_path, "one")


def test_killed_again_and_again_a_study_ends_with_the_same_table(tmp_path):
    """kill -9 once so many scenarios are on the disk; KILLS=20 in the environment for the whole proof."""
    arguments = ["whatif", "paths/line_y.toml", "--vary", "before.0.duration_h=0:6:24", "--workers", "2", "-q", "-o"]
    assert command(*arguments, str(tmp_path / "whole")).returncode == 0
    whole = {f.name: f.read_bytes() for f in (tmp_path / "whole").iterdir()}
    dice = random.Random(4)
    for n in range(int(os.environ.get("KILLS", "1"))):
        folder, kept = tmp_path / f"cut{n}", 0
        for lines in sorted(dice.sample(range(2, 20), 2)):  # the first names the study
            kept = _kill_when_journal_has([*arguments, str(folder)], folder / study_files.JOURNAL, lines)
            assert kept >= lines
        assert command(*arguments, str(folder)).returncode == 0
        assert {f.name: f.read_bytes() for f in folder.iterdir()} == whole


def _kill_when_journal_has(arguments, journal, lines):
    """Kill the main process alone, its workers end by themselves; the lines that are then in the journal."""
    work = subprocess.Popen([sys.executable, "-m", "compgen", *arguments], cwd=ROOT, start_new_session=True)
    while work.poll() is None:
        if journal.exists() and journal.read_bytes().count(b"\n") >= lines:
            work.kill()
            work.wait()
            break
        time.sleep(0.005)
    return journal.read_bytes().count(b"\n")


def test_workers_end_with_their_parent(tmp_path):
    work = subprocess.Popen(
        [sys.executable, "-m", "compgen", "whatif", "paths/spiral_1300.toml", "--vary", "chord=1:5:60", "--workers",
         "2", "-q", "-o", str(tmp_path / "o")], cwd=ROOT,
    )  # fmt: skip
    children = f"/proc/{work.pid}/task/{work.pid}/children"
    pids: list[int] = []
    while len(pids) < 3 and work.poll() is None:
        time.sleep(0.05)
        pids = [int(p) for p in Path(children).read_text().split()]
    assert len(pids) >= 3, "the study ended before its workers were seen"
    work.kill()
    work.wait()
    for _ in range(12_000):  # ten minutes: one may still be loading its libraries on a busy machine
        if not any(Path(f"/proc/{p}").exists() and "Z" not in _state(p) for p in pids):
            return
        time.sleep(0.05)
    pytest.fail("workers outlive a killed study")


def _state(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().split(")")[1].split()[0]
    except OSError:
        return "Z"


def test_two_workers_of_a_cluster_give_the_same_table(tmp_path, study, rows):
    distributed = pytest.importorskip("distributed")
    script = tmp_path / "cluster.py"
    script.write_text(
        "import sys\n"
        "from distributed import LocalCluster\n"
        "if __name__ == '__main__':\n"
        "    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:\n"
        "        print(cluster.scheduler_address, flush=True)\n"
        "        sys.stdin.read()\n"
    )
    assert distributed
    with subprocess.Popen(
        [sys.executable, str(script)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)}, stderr=subprocess.DEVNULL,
    ) as cluster:  # fmt: skip
        assert cluster.stdin is not None
        assert cluster.stdout is not None
        address = cluster.stdout.readline().strip()
        done = compgen(
            "whatif", "paths/line_y.toml", *(w for g in GRID for w in ("--vary", g)), "--cluster", address, "-q",
            "-o", str(tmp_path / "o"),
        )  # fmt: skip
        cluster.stdin.close()
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "o" / "whatif.csv").read_bytes() == study_csv(study, rows)


class OneMachine:
    """As much of Dask as a study asks for, all in this process."""

    def __init__(self, address="", timeout=0.0, security=None):
        self.asked = (address, timeout, security)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        return None

    def map(self, compute, chunks, pure):
        done: list[Future[Any]] = [Future() for _ in chunks]
        for future, chunk in zip(done, chunks, strict=True):
            future.set_result(compute(chunk))
        return done


def test_a_machine_of_a_cluster_gives_the_same_rows_of_one_study_after_another(study, rows, monkeypatch):
    """It keeps the geometries of one study, and may have had another before."""
    dask = SimpleNamespace(Client=OneMachine, Security=OneMachine, as_completed=iter)
    monkeypatch.setitem(sys.modules, "distributed", cast(ModuleType, dask))
    monkeypatch.setattr(workers, "CHUNK", 4)
    other = build(PATH, None, (), ("feed=50,100",), None, correct=False)
    for asked, expected in ((study, rows), (other, rows_of(other)), (study, rows)):
        computed: list[dict[str, Any]] = []
        run(asked, set(), computed.extend, 0, "tcp://here:1")
        assert computed == expected


def test_a_cluster_that_does_not_answer_is_said_in_time(tmp_path):
    pytest.importorskip("distributed")
    done = compgen(
        "whatif", "paths/line_y.toml", "--vary", "feed=100,200", "--cluster", "tcp://127.0.0.1:9", "-o", str(tmp_path)
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "does not answer within 10 s" in done.stderr
    assert "leave --cluster out" in done.stderr


# questions


@pytest.fixture(scope="module")
def line():
    return load_job(PATH)


def test_warm_up_is_long_enough_and_no_longer():
    """A slow spiral drifts: at the answer the drift is at the limit, a little earlier above."""
    job = load_job(path_file("circle_1300"), overrides=["before=[]", "process.feed_mm_s=20"])
    limit = 0.35 * UM
    answer = ASKS["warmup"](job, limit)
    hours = float(answer.sentence.split()[2])
    assert 0.1 < hours < 40
    table = answer.table
    assert np.interp(hours, table[:, 0], table[:, 1]) * UM == pytest.approx(limit, rel=0.05)
    still = table[:-1, 1] > 1e-3  # um; the last is of the order of what whole periods change in a cycle's mean speed
    assert still.sum() > 50
    assert np.all(np.diff(table[:, 1])[still] < 1e-9)  # the longer, the less drift
    assert table[np.flatnonzero(still)[-1] + 1 :, 1].max() <= 1e-3


def test_what_follows_the_warm_up_stays_behind_it():
    """Six hours of it are what the file says: the drift of its own program, after the rest."""
    warm = """{state="moving", feed_mm_s=200, duration_h=%d}"""
    rests = f"""before=[{warm % 1}, {warm % 6}, {{state="idle", duration_h=2}}]"""
    job = load_job(PATH, overrides=[rests, "process.feed_mm_s=20"])
    table, geometry = ASKS["warmup"](job, UM).table, plan_geometry(job)
    rise = execute_with(job, geometry).rise
    both = [execute_with(job, geometry, np.broadcast_to(end, rise.shape)).actual for end in (rise[0], rise[-1])]
    drift = np.linalg.norm(both[1].position - both[0].position, axis=1).max()
    assert table[table[:, 0] == 6.0, 1] * UM == pytest.approx(drift, rel=0.01)


def test_runs_with_dwells_have_no_length_to_vary(tmp_path):
    runs = """before=[{state="moving", feed_mm_s=200, repeat=9, dwell_s=30}]"""
    job = load_job(PATH, overrides=[runs])
    with pytest.raises(InputError, match="say them as duration_h with a duty"):
        ASKS["warmup"](job, UM)
    begun = load_job(PATH, overrides=[runs, f"state.file='{written(state_of(job), tmp_path)}'"])
    assert "drift within one program" in ASKS["warmup"](begun, UM).sentence  # a state stands in the runs' place


def test_hours_in_shifts_have_no_length_to_vary():
    """Cut at a break they are two stretches: of the second alone it was said that none is needed."""
    moving = 'before=[{state="moving", feed_mm_s=200, duration_h=6, shifts=true}]'
    job = load_job(PATH, overrides=[moving, "shift=[{from_h=6, to_h=14, breaks_h=[[9, 9.5]]}]", "ambient.clock_h=6"])
    with pytest.raises(InputError, match="a stretch in shifts has no one length"):
        ASKS["warmup"](job, UM)


def test_the_warm_up_is_what_was_before_not_an_earlier_run_of_the_cycle():
    cycle = 'cycle=[{state="moving", repeat=5, dwell_s=60}]'
    job = load_job(PATH, overrides=["before.0.feed_mm_s=200", "process.feed_mm_s=20", cycle, "start.run=3"])
    for question in ("warmup", "steady"):
        assert " at 200 mm/s" in ASKS[question](job, UM).sentence


def test_a_warm_up_that_is_enough_for_a_while_is_not_called_none():
    """Air that swings takes what a longer warm-up has won, so the drift falls and rises with the hours."""
    job = load_job(PATH, overrides=["process.feed_mm_s=5", "ambient={kind='wave', amplitude_K=8}"])
    drift = ASKS["warmup"](job, UM).table[:, 1] * UM
    assert drift[-1] > drift.min()
    below = ASKS["warmup"](job, (drift[-1] + drift.min()) / 2).sentence
    assert "is then below" in below
    assert "but not after every longer one up to 48 h" in below
    assert ASKS["warmup"](job, drift.min() / 2).sentence.startswith("no warm-up up to 48 h")


def test_a_curve_is_followed_to_where_it_meets_the_limit():
    """10 exp(-x) falls to 2 at ln 5 and x^2 rises to 2 at the root of it, from inside: no limit is rounded up."""
    x = np.linspace(0, 4, 9)
    fall, rise = (lambda x: 10 * np.exp(-x)), (lambda x: x**2)
    assert first_below(fall, x, fall(x), 2.0) == pytest.approx(np.log(5), rel=1e-8)
    assert first_above(rise, x, rise(x), 2.0) == pytest.approx(np.sqrt(2), rel=1e-8)
    assert fall(first_below(fall, x, fall(x), 2.0)) <= 2.0
    assert rise(first_above(rise, x, rise(x), 2.0)) <= 2.0
    assert first_below(fall, x, fall(x), 10.0) == first_above(fall, x, fall(x), 9.0) == 0.0
    assert first_below(fall, x, fall(x), fall(4.0) * 0.99) is None
    assert first_below(fall, x, fall(x), fall(3.75)) == pytest.approx(3.75)
    assert first_above(rise, x, rise(x), 16.0) is None


def test_a_curve_that_meets_its_limit_twice_is_below_it_for_good_and_above_it_at_once():
    x = np.linspace(0, 5, 26)
    wave = lambda x: np.sin(np.pi * x)  # noqa: E731  above 1/2 from 1/6 to 5/6, and so on each two
    assert first_above(wave, x, wave(x), 0.5) == pytest.approx(1 / 6)
    assert first_below(wave, x, wave(x), 0.5) == pytest.approx(4 + 5 / 6)


def test_validity_is_looked_for_over_sixteen_hours_and_five_kelvin(line):
    answer = ASKS["validity"](line, 1.0)
    assert "for a start even 16 h late, or an ambient within" in answer.sentence
    late, warm = answer.table[:, 0], answer.table[:, 2]
    assert np.nanmax(late) == 960
    assert [float(np.nanmin(late)), float(np.nanmin(warm)), float(np.nanmax(warm))] == [0, -5, 5]

    assert late[np.isfinite(late)].tolist() == [*range(0, 60, 5), *range(60, 961, 20)]
    assert warm[np.isfinite(warm)].tolist() == [n / 2 for n in range(-10, 11)]
    assert (np.isnan(late) == np.isfinite(warm)).all()


def test_validity_says_where_its_table_meets_the_limit(line):
    """Halfway between what 100 and 120 minutes add; in kelvin what one adds, for the error is linear in the air."""
    table = ASKS["validity"](line, 5 * UM).table
    minutes, late, kelvin, warm = table.T
    limit = late[np.isin(minutes, (100, 120))].mean()
    sentence = ASKS["validity"](line, limit * UM).sentence
    assert 109 <= int(sentence.split(" up to ")[1].split()[0]) <= 111
    assert float(sentence.split("+-")[1].split()[0]) == pytest.approx(limit / warm[kelvin == 1][0], abs=0.006)


def test_a_late_start_on_a_day_that_warms_is_off_by_what_starting_then_would_show():
    """The same path with its standing and the air of an hour later, on the twin."""
    air = 'ambient={kind="wave",value_degC=21,amplitude_K=2,period_h=24,peak_h=15}'
    moving, idle = '{state="moving", feed_mm_s=200, duration_h=2}', '{state="idle", duration_h=1}'
    job = load_job(PATH, overrides=[air, f"before=[{moving}]"])
    later = load_job(PATH, overrides=[air, f"before=[{moving}, {idle}]"])
    geometry = plan_geometry(job)
    apart = execute_with(later, geometry).actual.position - execute_with(job, geometry).actual.position
    table = ASKS["validity"](job, 5 * UM).table
    assert table[table[:, 0] == 60, 1] * UM == pytest.approx(np.linalg.norm(apart, axis=1).max(), rel=0.02)


def test_validity_is_the_start_window(line):
    """The same question, asked of the correction: pipeline.start_window."""
    _, corrected = generate.generate(line, quiet)
    answer = ASKS["validity"](line, line.start_drift)
    seconds = float(answer.sentence.split(" up to ")[1].split()[0]) * 60
    assert corrected.start_window - 61 < seconds <= corrected.start_window + 1  # a limit is never rounded up
    kelvin = float(answer.sentence.split("+-")[1].split()[0])
    warmer = load_job(PATH, overrides=[f"ambient.value_degC={20 + kelvin}"])
    geometry = plan_geometry(line)
    apart = execute_with(warmer, geometry).actual.position - execute_with(line, geometry).actual.position
    assert np.linalg.norm(apart, axis=1).max() == pytest.approx(line.start_drift, rel=0.02)


def test_words_keep_their_letters():
    words = build(PATH, None, (), ("title=Größe,部品,😀",), None, correct=False)
    assert [dict(scenario.values)["title"] for scenario in words.scenarios] == ['"Größe"', '"部品"', '"😀"']


def test_a_file_for_many_starts_is_valid_for_no_one_start():
    job = load_job(PATH, overrides=["compensation.average_over.delay_s=[0, 1200]"])
    with pytest.raises(InputError, match=r"compensation.average_over: .*; leave it out"):
        ASKS["validity"](job, 5 * UM)


def test_contributions_add_up(line):
    answer = ASKS["contributions"](line, 5 * UM)
    nodes = [v for label, v in zip(answer.labels, answer.table[:, 1], strict=True) if label.startswith("node")]
    lengths = [v for label, v in zip(answer.labels, answer.table[:, 1], strict=True) if label.startswith("length")]
    whole = generate.predict(line, quiet)
    assert sum(nodes) == pytest.approx(statistics(whole.deviation())["total"]["max_um"], abs=2.5)
    assert sum(lengths) == pytest.approx(sum(nodes), abs=0.05)
    own = answer.table[:, 2]  # anywhere on the path
    assert (own > np.abs(answer.table[:, 1]) - 1e-6).all()
    assert own.max() < 2 * np.abs(answer.table[:, 1]).max()
    for part in answer.sentence.split(", comes from ")[1].split("; by lengths "):
        told = [abs(float(word.split()[1])) for word in part.split(", ")]
        assert len(told) > 1
        assert told == sorted(told, reverse=True)


def test_no_node_counts_what_the_arm_errs_cold():
    job = load_job(PATH, overrides=["robot.sources.joint_zeros.offset_mdeg=[0,30,-20,0,15,0]"])
    answer = ASKS["contributions"](job, 5 * UM)
    shares = dict(zip(answer.labels, answer.table[:, 1].tolist(), strict=True))
    total = float(answer.sentence.split("part, ")[1].split()[0])
    nodes = sum(share for label, share in shares.items() if label.startswith("node"))
    assert shares["cold arm"] > 100
    assert dict(zip(answer.labels, answer.table[:, 2], strict=True))["cold arm"] >= shares["cold arm"]
    assert nodes + shares["cold arm"] == pytest.approx(total, abs=0.1)
    assert answer.sentence.endswith(f"; the cold arm errs {shares['cold arm']:.1f} um of it")


def test_a_cold_arm_has_no_warmth_to_ask_about():
    job = load_job(PATH, "m710ic45m", ["before=[]", "robot.sources.joint_zeros.offset_mdeg=[0,30,-20,0,15,0]"])
    sentence = ASKS["contributions"](job, 5 * UM).sentence
    assert re.fullmatch(r"the largest error on the part, ([\d.]+) um; the cold arm errs \1 um of it", sentence)
    sentence = ASKS["validity"](job, 5 * UM).sentence  # more: beside the um that the file leaves in any case
    assert re.fullmatch(
        r"one corrected file errs at most 5 um more for a start .*, or any ambient; regenerate beyond", sentence
    )


def test_answers_name_the_duty_that_they_are_of():
    job = load_job(PATH, overrides=["before.0.duty=0.6"])
    assert " h at 200 mm/s with a duty of 60 % (95 %); within 5 um " in ASKS["steady"](job, 5 * UM).sentence
    assert " at 200 mm/s with a duty of 60 %: drift within " in ASKS["warmup"](job, 5 * UM).sentence


def test_an_arm_that_errs_nothing_has_nothing_to_part():
    assert ASKS["contributions"](load_job(PATH, "m20ia"), 5 * UM).sentence == "the largest error on the part, 0.0 um"


def test_contributions_are_of_the_largest_error_on_the_part_as_everything_else_says_it(line):
    """The twin's flight of the text: on its leads the tool errs more, and that was *the largest error*."""
    deviation = generate.predict(line, quiet).deviation()
    on_part, anywhere = deviation.on_part["total"].max / UM, deviation.extents["total"].max / UM
    largest = float(ASKS["contributions"](line, 5 * UM).sentence.split("on the part, ")[1].split()[0])
    assert largest == pytest.approx(on_part, abs=0.1)
    assert anywhere > on_part + 0.2


def largest_on_part(path, *overrides):
    """As the twin flies the planned text, [um]."""
    deviation = generate.predict(load_job(path, overrides=overrides), quiet).deviation()
    return deviation.on_part["total"].max / UM


def test_the_rim_of_a_raster_is_in_every_answer():
    """Few of its samples lie there, where the error is largest."""
    raster, feed = path_file("raster_1300"), "process.feed_mm_s=300"
    changes, endless = ["path.stepover_mm=26", feed], ["before.0.duration_h=2000", "before.0.feed_mm_s=300"]
    job, largest = load_job(raster, overrides=changes), largest_on_part(raster, *changes)
    answer = answer_questions(raster, None, changes, ["passes"], 5 * UM, [raster], "300")[0]
    assert answer.table[0, 2] == pytest.approx(largest, abs=0.7)
    assert timeline(job).error[0] / UM == pytest.approx(largest, abs=1.2)  # with the warmth of its start
    hot = [*changes, *endless]
    final = ASKS["steady"](load_job(raster, overrides=hot), 5 * UM).sentence.split("of the final ")[1].split()[0]
    assert float(final) == pytest.approx(largest_on_part(raster, *hot), abs=1)


def test_the_play_of_the_joints_is_in_every_answer():
    """As the twin flies the same texts, rounding and chords apart."""
    play = "robot.sources.hysteresis={backlash_mdeg=[10,10,10,10,10,10], width_mdeg=[100,100,100,100,100,100]}"
    changes, endless = [play, "process.feed_mm_s=100"], "before.0.duration_h=2000"
    job = load_job(PATH, overrides=changes)
    largest, final = (largest_on_part(PATH, *day) for day in (changes, [*changes, endless]))
    sentences = [ASKS[key](job, 5 * UM).sentence for key in ("contributions", "steady")]
    assert float(sentences[0].split("on the part, ")[1].split()[0]) == pytest.approx(largest, abs=1)
    assert float(sentences[1].split("of the final ")[1].split()[0]) == pytest.approx(final, abs=1)
    assert ask_passes(*changes, passes=[PATH]) == pytest.approx(largest, abs=1)
    assert timeline(job).error[0] / UM == pytest.approx(largest, abs=1)


def test_contributions_count_every_length_that_a_robot_file_may_heat(tmp_path):
    """The growth of the column (d1) and of a3 lift the tool as much as their profiles say."""
    robot = flawed_file(tmp_path, drop=NOT_GROWTH)
    job = load_job(PATH, robot=robot)
    answer = ASKS["contributions"](job, 5 * UM)
    lengths = dict(zip(answer.labels, answer.table[:, 1].tolist(), strict=True))
    assert {"length d1", "length a3"} <= set(lengths)
    nodes = sum(v for label, v in lengths.items() if label.startswith("node"))
    assert sum(v for label, v in lengths.items() if label.startswith("length")) == pytest.approx(nodes, abs=0.05)
    alone = dict(zip(answer.labels, answer.table[:, 2].tolist(), strict=True))["length d1"]
    warmest = execute_with(job, plan_geometry(job)).rise[:, 0].max()
    assert alone == pytest.approx(0.565 * 10.5 * 1.1 * warmest, rel=1e-3)  # um: length, cte, its excess, rise of j2


def test_steady_is_ninety_five_percent_of_the_end(line):
    answer = ASKS["steady"](line, 5 * UM)
    hours, error = answer.table[:, 0], answer.table[:, 1]
    assert hours.tolist() == [*(n / 4 for n in range(49)), *range(13, 97)]
    late = load_job(PATH, overrides=["before.0.duration_h=2000"])
    cold, geometry = load_job(PATH, overrides=["before=[]"]), plan_geometry(late)
    end = np.linalg.norm(
        execute_with(late, geometry).actual.position - execute_with(cold, geometry).actual.position, axis=1
    ).max()
    at = float(answer.sentence.split("after ")[1].split()[0])
    assert np.interp(at, hours, error) / (end / UM) == pytest.approx(0.95, abs=0.01)


def test_steady_is_of_the_part_as_scenarios_are(line):
    """The twin's flight behind a warm-up without end: on the leads the tool errs more, and that was *the final*."""
    endless = load_job(PATH, overrides=["before.0.duration_h=2000"])
    deviation = generate.predict(endless, quiet).deviation()
    on_part, anywhere = deviation.on_part["total"].max / UM, deviation.extents["total"].max / UM
    final = float(ASKS["steady"](line, 5 * UM).sentence.split("of the final ")[1].split(" um on the part ")[0])
    assert final == pytest.approx(on_part, abs=0.15)
    assert anywhere > on_part + 0.4


def test_a_path_that_nowhere_touches_is_answered_whole(tmp_path):
    rows = "".join(f"1300,{20 * k - 100},200,0\n" for k in range(11))
    (tmp_path / "air.csv").write_text(f"x_mm,y_mm,z_mm,contact\n{rows}")
    (tmp_path / "air.toml").write_text(
        'robot = "m710ic50"\n[path]\npattern = "points"\nfile = "air.csv"\n[process]\nfeed_mm_s = 200\nchord_um = 1.5\n'
        '[[before]]\nstate = "moving"\nfeed_mm_s = 200\nduration_h = 2000\n[bounds]\nmax_um = 5\n'
    )
    job = load_job(str(tmp_path / "air.toml"))
    largest = generate.predict(job, quiet).deviation().extents["total"].max / UM
    assert ASKS["contributions"](job, 0.0).sentence.startswith(f"the largest error on the part, {largest:.1f} um, ")
    assert f"of the final {largest:.1f} um " in ASKS["steady"](job, 5 * UM).sentence


def test_steady_is_in_the_air_of_the_job():
    job = load_job(PATH, overrides=["ambient.value_degC=26"])
    late = load_job(PATH, overrides=["ambient.value_degC=26", "before.0.duration_h=2000"])
    cold = load_job(PATH, overrides=["before=[]"])
    geometry = plan_geometry(late)
    ends = [execute_with(day, geometry).actual.position for day in (late, cold)]
    final = (np.linalg.norm(ends[0] - ends[1], axis=1) * part_weight(geometry, geometry)).max() / UM
    answer = ASKS["steady"](job, 5 * UM)
    assert float(answer.sentence.split("the final ")[1].split()[0]) == pytest.approx(final, abs=0.3)


def test_what_the_day_adds_to_the_air_never_settles_and_is_left_out(line):
    air = 'ambient={kind="wave",value_degC=20,amplitude_K=3,period_h=24,peak_h=15}'
    assert ASKS["steady"](load_job(PATH, overrides=[air]), 5 * UM).sentence == ASKS["steady"](line, 5 * UM).sentence


def test_what_takes_longer_than_is_asked_is_said():
    job = load_job(PATH, overrides=["robot.thermal.node.0.tau_h=200", "robot.thermal.node.2.tau_h=100"])
    sentence = ASKS["steady"](job, 5 * UM).sentence
    assert sentence.startswith("steady after more than 96 h at")
    assert sentence.endswith("um on the part after more than 96 h")


def test_steady_is_from_when_on_the_error_stays_near_its_end():
    """A gap that is closed on the way, and opens again, is not closed."""
    hours, gaps = np.arange(5.0), np.array([9.0, 1.0, 4.0, 3.0, 0.5])
    assert when_settled(hours, gaps, 2.0) == "after 4.0 h"
    assert when_settled(hours, gaps, 9.5) == "after 0.0 h"
    assert when_settled(hours, gaps, 0.2) == "after more than 4 h"


@pytest.mark.parametrize(
    ("stretches", "feed"),
    [
        ([("moving", 100), ("moving", 150), ("idle", 0), ("moving", 250), ("idle", 0)], 250),
        ([("idle", 0)], 90),  # without motion before it the program's own
        ([], 90),
    ],
)
def test_a_duty_that_is_asked_about_is_the_last_motion_before_the_program(stretches, feed):
    told = [f'{{state="{state}", duration_h=1{f", feed_mm_s={speed}" if speed else ""}}}' for state, speed in stretches]
    job = load_job(PATH, overrides=[f"before=[{', '.join(told)}]", "process.feed_mm_s=90"])
    assert f" at {feed} mm/s " in ASKS["steady"](job, 5 * UM).sentence


def ask_passes(*changes, passes):
    return answer_questions(PATH, None, changes, ["passes"], 5 * UM, passes, "100")[0].table[:, 2].max()


def test_the_robots_keys_are_those_of_every_pass():
    other = path_file("line_x")
    twice = ask_passes("robot.thermal.cte_um_m_K=22.5", passes=[other])
    assert twice == pytest.approx(2 * ask_passes(passes=[other]), rel=1e-3)


def test_a_pass_is_the_path_in_question_however_it_is_spelt():
    spelt = f"{Path(PATH).parent}/../paths/line_y.toml"
    assert ask_passes("before.0.duration_h=1", passes=[spelt]) < 0.5 * ask_passes(passes=[PATH])
    with pytest.raises(InputError, match=r"--set before.0.duration_h=1: it is of .*line_y.toml, which is no --pass"):
        ask_passes("before.0.duration_h=1", passes=[path_file("line_x")])


def test_passes_are_driven_at_the_feeds_that_are_typed_or_at_a_quarter_a_half_and_all_of_their_own():
    def feeds_of(typed):
        answer = answer_questions(PATH, None, ["process.feed_mm_s=80"], ["passes"], 5 * UM, [], typed)[0]
        return answer.table[:, 0].tolist()

    assert feeds_of(None) == pytest.approx([20, 40, 80])
    assert feeds_of("30, 60") == pytest.approx([30, 60])
    with pytest.raises(InputError, match="--feeds 30;60: not numbers"):
        feeds_of("30;60")


def test_what_all_scenarios_share_is_a_job_where_the_files_make_one():
    job = questions.base_job(PATH, None, ["process.feed_mm_s=80"])
    assert job is not None
    assert job.feed == pytest.approx(0.08)
    assert questions.base_job(PATH, None, ["process.feed_mm_s=-1"]) is None


def test_passes_are_judged_on_the_part_as_a_bound_is():
    changes = ["process.lift_mm=400"]  # where the tool errs more than on the part
    planned = generate.predict(load_job(PATH, overrides=changes), quiet).deviation()
    assert planned.extents["total"].max > planned.on_part["total"].max + 5 * UM
    assert ask_passes(*changes, "process.feed_mm_s=100", passes=[PATH]) * UM == pytest.approx(
        planned.on_part["total"].max, abs=0.2 * UM
    )


def test_what_is_of_passes_alone_is_refused_without_them():
    for passed, feeds in (([PATH], None), ([], "20,100")):
        with pytest.raises(InputError, match=r"--pass, --feeds: .*; give --ask passes, or leave them out"):
            answer_questions(PATH, None, (), ["steady"], 5 * UM, passed, feeds)


def test_passes_are_of_one_robot(tmp_path):
    other = tmp_path / "other.toml"
    other.write_text(Path(PATH).read_text().replace('robot = "m710ic50"', f'robot = "{flawed_file(tmp_path)}"'))
    with pytest.raises(InputError, match="two robots; name the one with --robot"):
        ask_passes(passes=[PATH, str(other)])


def test_more_passes_than_can_be_ordered_are_refused(line, monkeypatch):
    monkeypatch.setattr(questions, "MOST_PASSES", 2)
    assert len(passes([line, line], [0.1], lambda job, feed: job, 5 * UM).table) == 2
    with pytest.raises(InputError, match="3 passes have too many orders; give at most 2"):
        passes([line] * 3, [0.1], lambda job, feed: job, 5 * UM)


@pytest.mark.parametrize(
    ("asked", "limit", "varied", "words"),
    [
        (["steady", "everything"], 5, True, "--ask everything: unknown"),
        (["steady"], 0, False, "--within-um 0: must be above 0"),
        (["steady"], 1e6, False, "--within-um 1e.06"),
        ([], 5, False, "nothing to study"),
        (["passes"], 0.5, False, None),
        ([], 9e5, True, None),
    ],
)
def test_a_study_asks_or_varies_something_it_knows(asked, limit, varied, words):
    if words is None:
        questions.check_study(asked, limit, varied=varied)
        return
    with pytest.raises(InputError, match=words):
        questions.check_study(asked, limit, varied=varied)


def test_passes_take_the_quickest_that_stays_inside(line):
    cold = replace(line, history=History())

    def plan(job, feed):
        return replace(load_job(job.source, overrides=["before=[]", f"process.feed_mm_s={feed * 1e3}"]))

    told = passes([cold, load_job(path_file("line_x"))], [0.1, 0.2], plan, 5 * UM)
    assert "at 200 mm/s" in told.sentence
    assert "stays within" in told.sentence
    assert told.table[:, 0].tolist() == [100, 100, 200, 200]  # mm/s
    assert f"{told.table[-1, 1]:.1f} min, largest error {told.table[-2:, 2].min():.1f} um" in told.sentence
    none = passes([cold], [0.2], plan, 1e-9)
    assert "no order and feed" in none.sentence


def test_pages_and_tables_hold_what_was_found(study, rows, line):
    answers = [ASKS[key](line, 5 * UM) for key in ("contributions", "validity")]
    page = study_html("t", StudyOutcome(study=study, rows=rows, answers=answers)).decode()
    printed = page.replace("&#x27;", "'").replace("µm", "um").casefold()
    assert all(a.sentence.split(",")[0].casefold() in printed for a in answers)
    assert "https://" not in page.split("</script>")[-1]
    table = answer_csv(answers[0]).decode().splitlines()
    assert table[0] == "row,of_largest_um,own_largest_um,what"
    assert table[1].endswith("node j2")
    assert set(ASKS) == {"warmup", "validity", "contributions", "steady"}


def test_the_command_says_its_answers_and_writes_them(tmp_path):
    done = command(
        "whatif", "paths/line_y.toml", "--vary", "warmup_h=1,2", "--ask", "steady", "-o", str(tmp_path / "o")
    )
    assert done.returncode == 0, done.stderr
    assert "2 scenarios: error" in done.stdout
    assert "steady after" in done.stdout
    assert {f.name for f in (tmp_path / "o").iterdir()} == {
        "compgen.json", "scenarios.jsonl", "whatif.csv", "whatif.json", "whatif.html", "steady.csv"
    }  # fmt: skip
    told = json.loads((tmp_path / "o" / "whatif.json").read_text())
    assert len(told["scenarios"]) == 2
    assert told["keys"] == ["before.0.duration_h"]
    small = ["--ask", "steady", "--within-um", "0"]
    for wrong, word in ((["--ask", "everything"], "unknown"), (["--no-live"], "nothing to study"), (small, "above 0")):
        refused = command("whatif", "paths/line_y.toml", *wrong, "-o", str(tmp_path / "x"))
        assert refused.returncode == 2
        assert word in refused.stderr
        assert not (tmp_path / "x").exists()


def test_the_row_of_a_file_for_many_starts_is_what_predict_says_of_them():
    """Of the mean of its starts, with the band until the last of them."""
    cycle = """cycle=[{state="moving", repeat=20, dwell_s=600}]"""
    starts = (cycle, "compensation.average_over={runs=[1, 20], delay_s=[0, 3600]}")
    study = build(PATH, None, starts, ("before.0.duration_h=1,2",), None, correct=False)
    for row, scenario in zip(rows_of(study), study.scenarios, strict=True):
        planned = generate.predict(load_job(PATH, overrides=[*starts, *scenario.overrides()]), quiet)
        sizes = statistics(planned.deviation())["total"]
        assert row["before_max_um"] == pytest.approx(sizes["max_um"], rel=1e-3)
        assert row["start_j3_K"] == pytest.approx(planned.rise[0, 2], rel=1e-5)
        assert row["band_um"] == pytest.approx(planned.band_of_plan().largest / UM, rel=1e-3)
