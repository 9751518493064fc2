"""``follow`` on the pages of a corrected program: as on a planned job's, its log made by the heat model itself."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
import states
from command_line import refused, run
from corrected_pages import pages_of

from compgen import fanuc as ls
from compgen.core.units import HOUR
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.resume.corrected_job import read_corrected
from compgen.pipelines.resume.corrected_run import corrected_run
from compgen.pipelines.resume.written_job import read_written_job
from compgen.thermal import Duty, state_after

DATE = ("--date", "2026-01-31")
BOUND = ("--max-um", "5")
LATE = 2100.0  # s
SPEED = "1mm/sec"  # 40 s a page


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return pages_of(tmp_path_factory.mktemp("made"), "pages", speed=SPEED)


@pytest.fixture
def job(made, tmp_path):
    return shutil.copytree(made, tmp_path / "out")


def log(job, folder, until, lie=0.0, zero=20):
    """An arm that stands from its planned start on; a sensor lies [K]. Air is measured at ``zero`` [degC] alone."""
    course = corrected_run(read_corrected(read_written_job(job)), lambda stage, share: None)
    heat, cell, lines = course.heat, course.cell, []
    standing, air = course.history.standing, course.history.air
    measured = [str(zero)] if air.is_still else []
    for t in np.arange(0, until + 1, 10.0).tolist():
        rise = heat.outputs @ state_after(heat, [replace(standing, duration=t)], course.start, air)
        readings = [zero + rise[heat.names.index(node)] for node in cell.sensors.values()]
        readings[0] += lie
        lines.append(",".join([f"{t:.3f}", *measured, *(f"{value:.3f}" for value in readings)]))
    file = folder / "log.csv"
    head = ",".join(["time_s", *(["ambient_degC"] * len(measured)), *(f"{part}_degC" for part in cell.sensors)])
    file.write_text("\n".join([head, *lines]) + "\n")
    return file


def pages_file(folder, *rows):
    file = folder / "pages.csv"
    file.write_text("\n".join(["time_s,page,loaded", *(",".join(map(str, row)) for row in rows)]) + "\n")
    return file


def contents(folder):
    return {p.name: p.read_bytes() for p in folder.iterdir()}


def look(*arguments):
    result = run("follow", *arguments, *DATE, *BOUND, "--once", "--json")
    return result, json.loads(result.stdout.splitlines()[-1]) if result.stdout else None


def apart(folder, other, page):
    """Distances between the coordinates of a page's positions in two folders [um]."""
    ours, its = (ls.loads((f / f"LONG_0{page}.LS").read_bytes()).positions.value[:, :3] for f in (folder, other))
    return 1000 * np.abs(ours - its)


def same_but_for_rounding(folder, other, pages):
    """Whether pages made of a log and of a delay differ by a last digit (1 um), in one coordinate of a hundred."""
    off = np.concatenate([apart(folder, other, page) for page in pages]).ravel()
    return off.max() < 1.01 and np.mean(off > 0.3) < 0.01


def test_a_program_on_course_is_left_alone(job, tmp_path):
    before = contents(job)
    result, record = look(job, "--log", log(job, tmp_path, 20), "--started", "0s", "--lead", "0s")
    assert result.returncode == 0, result.stderr
    assert (record["page"], record["due"]) == (1, 0)
    assert [f["page"] for f in record["forecast"]] == [1, 2]
    assert max(f["max_um"] for f in record["forecast"]) < 1
    assert contents(job) == before


def test_a_late_start_writes_what_resume_makes_of_it(job, made, tmp_path):
    oracle = shutil.copytree(made, tmp_path / "oracle")
    assert run("resume", oracle, "--from-page", "1", "--late", "35min", *BOUND, *DATE).returncode == 0
    assert apart(job, oracle, 1).max() > 5
    arguments = (job, "--log", log(job, tmp_path, LATE), "--pages", pages_file(tmp_path))
    result, record = look(*arguments)
    assert result.returncode == 0, result.stderr
    assert (record["page"], record["due"]) == (0, 1)
    assert record["forecast"][0]["max_um"] > 5 > 1 > record["after_um"]
    assert record["written"] == ["LONG_01.LS", "LONG_02.LS", "LONG_03.LS"]
    assert same_but_for_rounding(job, oracle, (1, 2, 3))
    entry = json.loads((job / "LONG.pages.json").read_bytes())["resumed"][0]
    assert (entry["from_page"], entry["log"], entry["log_end_s"]) == (1, "log.csv", LATE)
    after = contents(job)
    again, record = look(*arguments)
    assert again.returncode == 0
    assert record["due"] == 0
    assert record["forecast"][0]["max_um"] < 1
    assert contents(job) == after


def test_a_log_without_air_leaves_the_air_as_it_was(tmp_path):
    (day := tmp_path / "day.toml").write_text("[ambient]\nvalue_degC = 30\n")
    job = pages_of(tmp_path, "hot", "--before", day, speed="0.01mm/sec")  # 1 h a page
    oracle = shutil.copytree(job, tmp_path / "oracle")
    assert run("resume", oracle, "--from-page", "1", "--late", "35min", *BOUND, *DATE).returncode == 0
    assert look(job, "--log", log(job, tmp_path, LATE), "--pages", pages_file(tmp_path))[1]["due"] == 1
    assert same_but_for_rounding(job, oracle, (1, 2, 3))
    ours, its = (json.loads((f / "LONG.pages.json").read_bytes())["resumed"][0]["air_K"] for f in (job, oracle))
    assert ours == its == 10


@pytest.mark.parametrize(
    ("given", "parted"),
    [
        ((), ("--set", "controller.max_positions=45")),  # positions of each page are numbered from 1
        (("--set", "thermal.model=network"), ()),
    ],
)
def test_a_forecast_is_what_the_twin_flies(tmp_path, given, parted):
    """Pages as they stand, 2 and 3 written anew for another wait, against what ``resume`` flies before it writes."""
    job = pages_of(tmp_path / "made", "pages", *given, speed=SPEED, parted=parted)
    assert run("resume", job, "--from-page", "2", "--late", "10min", *BOUND, *DATE).returncode == 0
    file = log(job, tmp_path, LATE)
    for rows, page in (((0, 0, 3), 1), ((LATE - 39, 2, 3), 3)):
        oracle = shutil.copytree(job, tmp_path / f"oracle{page}")
        _, record = look(job, "--log", file, "--pages", pages_file(tmp_path, rows))
        (forecast,) = (f["max_um"] for f in record["forecast"] if f["page"] == page)
        result = run("resume", oracle, "--from-page", page, "--log", file, *BOUND, *DATE, "--json")
        assert json.loads(result.stdout)["pages"][0]["before"]["max_um"] == pytest.approx(forecast, abs=0.3)


def test_a_page_that_runs_or_is_loaded_is_never_written(job, made, tmp_path):
    oracle, before = shutil.copytree(made, tmp_path / "oracle"), contents(job)
    assert run("resume", oracle, "--from-page", "2", "--late", "35min", *BOUND, *DATE).returncode == 0
    file = log(job, tmp_path, LATE + 10)
    result, record = look(job, "--log", file, "--pages", pages_file(tmp_path, (LATE, 1, 2)))
    refused(result, 1, "page 1", "it runs")
    assert (record["due"], record["loaded"], record["written"]) == (3, 2, ["LONG_03.LS"])
    assert all(contents(job)[f"LONG_0{page}.LS"] == before[f"LONG_0{page}.LS"] for page in (1, 2))
    again = shutil.copytree(made, tmp_path / "again")
    result, record = look(again, "--log", file, "--pages", pages_file(tmp_path, (LATE, 1, 1)), "--lead", "0s")
    refused(result, 1, "page 1", "it runs")
    assert record["due"] == 2
    assert (again / "LONG_01.LS").read_bytes() == before["LONG_01.LS"]
    assert same_but_for_rounding(again, oracle, (2, 3))
    for option in (("--loaded", "2"), ("--lead", "9h")):
        fresh = shutil.copytree(made, tmp_path / option[0])
        _, record = look(fresh, "--log", file, "--started", f"{LATE:.0f}s", *option)
        assert record["due"] == 3


def test_a_lying_log_moves_nothing(job, tmp_path):
    before = contents(job)
    result, record = look(job, "--log", log(job, tmp_path, LATE, lie=20.0), "--pages", pages_file(tmp_path))
    assert result.returncode == 1
    assert "the pages stay as they are" in result.stderr
    assert record["written"] == []
    assert contents(job) == before


def test_touches_that_find_a_moved_base_make_the_next_page_due(job, tmp_path):
    planned = load_job("paths/spiral_1300.toml")
    rise = planned.heat.outputs @ state_after(planned.heat, [Duty("moving", 0.2, 5 * HOUR)])
    state = states.state_of(planned, rise=rise, time=10.0, base=np.array([150e-6, 0, 0, 0, 0, 0]))
    at_once = ("--log", log(job, tmp_path, 20), "--started", "0s", "--lead", "0s")
    arguments = (job, *at_once, "--state", states.written(state, tmp_path))
    result, record = look(*arguments)
    refused(result, 1, "page 1", "it runs")
    assert record["due"] == 2
    assert record["forecast"][0]["max_um"] > 140
    assert record["after_um"] < 2
    assert json.loads((job / "LONG.pages.json").read_bytes())["resumed"][0]["state_time_s"] == 10
    _, again = look(*arguments)
    assert again["due"] == 0
    assert again["forecast"][1]["max_um"] < 3


def test_without_a_bound_of_its_own_a_page_is_written_all_the_same(job, tmp_path):
    result = run("follow", job, "--log", log(job, tmp_path, LATE), "--pages", pages_file(tmp_path), "--once", *DATE)
    assert result.returncode == 0, result.stderr
    assert "over 5 um: pages 1 to 3 written anew" in result.stdout


def test_a_log_counts_from_where_the_robot_was_calibrated(tmp_path):
    """The same work at a robot that was calibrated at 25 degC, in air of 25 degC: the same rises."""
    (day := tmp_path / "day.toml").write_text("[ambient]\nreference_degC = 25\n")
    calibrated = pages_of(tmp_path, "at_25", history=("--before", day, "--before", "moving 200mm/s 5h"), speed=SPEED)
    file = log(calibrated, tmp_path, 600, zero=25)
    assert max(f["max_um"] for f in look(calibrated, "--log", file, "--pages", pages_file(tmp_path))[1]["forecast"]) < 5
    result = run("resume", calibrated, "--from-page", "1", "--log", file, *BOUND, *DATE, "--json")
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout)["pages"][0]["before"]["max_um"] < 5
