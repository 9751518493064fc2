"""``follow`` at the command line: one look, and a job that is followed to its end; the clock and the cell are files."""

import json
import shutil
import time
from dataclasses import replace

import numpy as np
import pytest
import states
from command_line import refused, run

from compgen.cli.output_files import figure_files
from compgen.core import interrupts
from compgen.pipelines.resume.paged_run import PlannedRun
from compgen.pipelines.resume.written_job import job_of_pages, read_written_job

SMALL = ("--set", "path.stepover_mm=240", "--set", "robot.controller.max_positions=200")
NODES = {"part_3": 9.7271, "part_4": 3.4739, "part_6": 11.5768, "part_11": 2.6751}  # rises when it is planned to start
ONCE = ("--once", "--date", "2026-01-31")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    out = tmp_path_factory.mktemp("made") / "out"
    assert run("generate", "paths/optic_raster.toml", *SMALL, "-q", "-o", out).returncode == 0
    return out


@pytest.fixture
def job(made, tmp_path):
    return shutil.copytree(made, tmp_path / "out")


def log(folder, until, colder=0.0, tau=7 * 3600.0, partial=""):
    """Thermocouples of an arm that cools from its planned start on, ``colder`` [K] than the file has it."""
    time = np.arange(0, until + 1, 10.0)
    rows = [
        f"{t:g},20," + ",".join(f"{20 + (r - colder) * np.exp(-t / tau):.3f}" for r in NODES.values()) for t in time
    ]
    file = folder / "log.csv"
    file.write_text("\n".join([f"time_s,ambient_degC,{','.join(f'{n}_degC' for n in NODES)}", *rows]) + "\n" + partial)
    return file


def pages_file(folder, *rows):
    file = folder / "pages.csv"
    file.write_text("\n".join(["time_s,page,loaded", *(",".join(map(str, row)) for row in rows)]) + "\n")
    return file


def contents(folder):
    return {p.name: p.read_bytes() for p in folder.iterdir()}


def look(*arguments):
    result = run("follow", *arguments, *ONCE, "--json")
    return result, json.loads(result.stdout.splitlines()[-1]) if result.stdout else None


def test_a_job_on_course_is_left_alone(job, tmp_path):
    before = contents(job)
    result, record = look(job, "--log", log(tmp_path, 30), "--started", "0s", "--lead", "0s")
    assert result.returncode == 0, result.stderr
    assert record["page"] == 1
    assert record["due"] == 0
    assert [f["page"] for f in record["forecast"]] == [1, 2]
    assert max(f["max_um"] for f in record["forecast"]) < 3
    assert contents(job) == before


def test_the_next_page_is_written_when_its_forecast_leaves_the_bound(job, tmp_path):
    """An arm that stands 40 min before it starts: page 1 is due; once it is written nothing is."""
    before = contents(job)
    file = log(tmp_path, 2400)
    result, record = look(job, "--log", file, "--pages", tmp_path / "none.csv")
    assert result.returncode == 0, result.stderr
    assert "none.csv: not there yet, so that no page counts as begun" in result.stderr
    assert (record["page"], record["due"]) == (0, 1)
    assert record["forecast"][0]["max_um"] > 5
    assert record["written"][0] == "OPTIC_RASTER_01.LS"
    assert record["after_um"] < 1.2
    after = contents(job)
    assert after["OPTIC_RASTER.LS"] == before["OPTIC_RASTER.LS"]
    assert after["OPTIC_RASTER_01.LS"] != before["OPTIC_RASTER_01.LS"]
    entry = json.loads(after["OPTIC_RASTER.pages.json"])["resumed"][0]
    assert (entry["from_page"], entry["log"], entry["log_end_s"]) == (1, "log.csv", 2400)
    again, record = look(job, "--log", file, "--pages", tmp_path / "none.csv")
    assert again.returncode == 0
    assert record["due"] == 0
    assert record["forecast"][0]["max_um"] < 2
    assert contents(job) == after


def test_a_log_is_read_as_the_path_file_says_of_its_columns(tmp_path):
    """The logger calls two sensors by each other's names; the same readings in compgen's columns say what is true."""
    plain = log(tmp_path, 2400)
    head, rows = plain.read_text().split("\n", 1)
    swapped = tmp_path / "swapped.csv"
    swapped.write_text(head.replace("time_s", "Time [s]").replace("3_degC,part_4", "4_degC,part_3") + "\n" + rows)
    columns = 'log.columns={ part_3 = "part_4_degC", part_4 = "part_3_degC" }'
    table = ("--set", f"log.file={swapped}", "--set", columns)
    made = run("generate", "paths/optic_raster.toml", *SMALL, *table, "-q", "-o", tmp_path / "out")
    assert made.returncode == 0, made.stderr
    given = ("--pages", pages_file(tmp_path), "--within-um", "500")
    results = [look(tmp_path / "out", "--log", file, *given) for file in (plain, swapped)]
    assert [result.returncode for result, _ in results] == [0, 0], results[1][0].stderr
    assert results[0][1] == results[1][1]


def test_pages_that_no_correction_brings_into_the_bound_are_told(job, tmp_path):
    """*written anew* was said of pages in which no byte changed, and exit 0 of 0.9 um where 0.4 may be."""
    given = ("--log", log(tmp_path, 2400), "--pages", pages_file(tmp_path), "--within-um", "0.4", *ONCE)
    first = run("follow", job, *given)
    assert "over 0.4 um: pages 1 to 6 written anew" in first.stdout
    refused(first, 1, "page 1: 0.", "um by its forecast, --within-um 0.4; corrected anew")
    before = contents(job)
    again = run("follow", job, *given)
    assert "over 0.4 um: pages 1 to 6 unchanged" in again.stdout
    refused(again, 1, "corrected anew")
    assert contents(job) == before


def test_the_figures_of_its_page_are_files_too(job, tmp_path, monkeypatch):
    monkeypatch.setattr(figure_files, "render", lambda figures, kind: {key: kind.encode() for key in figures})
    result, record = look(job, "--log", log(tmp_path, 2400), "--started", "3000s", "--figures", "png")
    assert (result.returncode, record["due"]) == (0, 1), result.stderr
    assert list(job.glob("resume_*.png"))


def test_its_refusals_do_not_speak_of_another_command(tmp_path):
    folder = tmp_path / "some"
    folder.mkdir()
    one = run("follow", folder, "--log", "log.csv")
    (folder / "A.pages.json").write_text("{}")
    for result in (one, run("follow", folder, "--log", "log.csv")):
        refused(result, 2, "give a folder that cgen generate, or cgen pages of a corrected program, wrote pages into")
        assert "resume" not in result.stderr


def test_a_page_that_the_controller_has_is_never_written(job, tmp_path):
    """Page 1 runs on an arm that is 1.5 K colder than planned; page 2 is loaded: page 3 is the first to be written."""
    before = contents(job)
    pages = pages_file(tmp_path, (0, 1, 2))
    result, record = look(job, "--log", log(tmp_path, 30, 1.5), "--pages", pages)
    refused(result, 1, "page 1", "it runs")
    assert (record["due"], record["loaded"]) == (3, 2)
    assert [f["page"] for f in record["forecast"]] == [1, 2, 3]
    changed = {n for n, c in contents(job).items() if before.get(n) != c}
    assert {"OPTIC_RASTER_01.LS", "OPTIC_RASTER_02.LS"} & changed == set()
    assert "OPTIC_RASTER_03.LS" in changed
    entry = json.loads((job / "OPTIC_RASTER.pages.json").read_bytes())["resumed"][0]
    assert (entry["loaded"], entry["from_page"]) == (2, 3)
    for option in (("--loaded", "2"), ("--lead", "9h")):  # the same by hand, and where page 2 begins too soon
        shutil.rmtree(job)
        job.mkdir()
        for name, data in before.items():
            (job / name).write_bytes(data)
        _, record = look(job, "--log", log(tmp_path, 30, 1.5), "--started", "0s", *option)
        assert record["due"] == 3


def test_touches_that_find_a_moved_base_make_the_next_page_due(job, tmp_path):
    """150 um at 10 s: page 1 runs and leaves it, the next that can be written is right for it."""
    whole = job_of_pages(read_written_job(job))
    state = states.written(states.state_of(whole, time=10.0, base=np.array([150e-6, 0, 0, 0, 0, 0])), tmp_path)
    arguments = (job, "--log", log(tmp_path, 30), "--started", "0s", "--lead", "0s", "--state", state)
    result, record = look(*arguments)
    refused(result, 1, "page 1", "it runs")
    assert record["due"] == 2
    assert record["forecast"][0]["max_um"] > 140
    assert record["after_um"] < 2
    entry = json.loads((job / "OPTIC_RASTER.pages.json").read_bytes())["resumed"][0]
    assert entry["state_time_s"] == 10
    assert record["notes"] == []
    _, again = look(*arguments)
    assert again["due"] == 0
    assert again["forecast"][1]["max_um"] < 3


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"verdict": "something moved"}, "(something moved, at 10 s): the pages are for the base and the targets as"),
        ({"made_from": {"robot_overrides": "0" * 64}}, "(anchored, at 10 s); it was found with other values of the"),
        ({"time": 5000.0}, "at 5000 s) is from behind the log's end: it does not count yet"),
        ({"time": 2.0}, "at 2 s) is from before the job was planned to start (--planned 5 s): it does not count"),
    ],
)
def test_what_a_state_itself_warns_of_is_told_at_each_look(job, tmp_path, changes, words):
    """Of a state that moved, one of another robot, and one of a time that does not count nothing was said."""
    whole = job_of_pages(read_written_job(job))
    state = states.state_of(whole, time=10.0, base=np.array([150e-6, 0, 0, 0, 0, 0]))
    changed = {**changes, "made_from": {**state.made_from, **changes.get("made_from", {})}}
    file = states.written(replace(state, **changed), tmp_path)
    times = ("--planned", "5s", "--started", "5s", "--lead", "0s")
    result, record = look(job, "--log", log(tmp_path, 30), *times, "--state", file)
    (note,) = record["notes"]
    assert words in note, result.stderr
    counts = "does not count" not in words
    assert (record["due"] == 2) == counts
    entries = json.loads((job / "OPTIC_RASTER.pages.json").read_bytes()).get("resumed", [])
    assert [note.split(" (")[0] in entry["why"] for entry in entries] == [True] * counts
    if counts:  # on the page of what was written too
        assert words[-40:] in (job / "resume.html").read_text()


def test_a_clock_that_stands_from_the_first_row_writes_nothing(job, tmp_path):
    """Sixty rows of 0 s on an arm 3 K too cold: pages were written for 0.06 s after the planned start."""
    before, file = contents(job), log(tmp_path, 590, 3.0)
    rows = file.read_text().splitlines()
    file.write_text("\n".join([rows[0], *("0," + row.partition(",")[2] for row in rows[1:])]) + "\n")
    result, record = look(job, "--log", file, "--started", "60s")
    refused(result, 1, "the log's clock stands: all its rows have the time of the first one", "pages stay as they are")
    assert record["doubt"]
    assert contents(job) == before


def test_it_says_what_it_sees_in_a_line(job, tmp_path):
    result = run("follow", job, "--log", log(tmp_path, 30), "--started", "0s", *ONCE)
    (line,) = result.stdout.splitlines()
    for words in ("30 s: page 1 runs", "page 1 forecast", "page 2 forecast", "at 95 %"):
        assert words in line
    empty = tmp_path / "empty.csv"
    empty.write_text("")
    silent = tmp_path / "silent.csv"  # sensors that have said nothing yet, and a row that stands twice
    silent.write_text("time_s,ambient_degC,part_3_degC\n0,20.1,\n10,20.1,\n10,20.1,\n")
    early = ("follow", job, "--log", log(tmp_path, 30), "--planned", "1h")
    for call in (("follow", job, "--log", empty), ("follow", job, "--log", silent), early):
        result = run(*call, *ONCE)
        assert "no reading yet since the job was planned to start (--planned)" in result.stdout
        assert result.returncode == 0


def test_a_wild_log_is_read_as_far_as_it_goes(job, tmp_path):
    """A partial last line, a row of noise, a loose contact, a clock set back: the same forecast, and it is told."""
    _, clean = look(job, "--log", log(tmp_path, 600), "--started", "0s")
    file = log(tmp_path, 600, partial="615,20,29.")
    text = file.read_text().splitlines()
    text[5] = "garbage"
    text[9] = text[9].replace(text[9].split(",")[2], "119.0")
    file.write_text("\n".join(text))
    _, wild = look(job, "--log", file, "--started", "0s")
    for a, b in zip(clean["forecast"], wild["forecast"], strict=True):
        assert a["max_um"] == pytest.approx(b["max_um"], abs=0.3)
    assert any("left out" in note for note in wild["notes"])


def test_what_a_look_leaves_out_is_told(job, tmp_path):
    """A sensor by another name, an hour without a row, and rows that no reader can part."""
    file = log(tmp_path, 30)
    head, *rows = file.read_text().splitlines()
    late = [f"{float(row.split(',')[0]) + 3600:g},{row.split(',', 1)[1]}" for row in rows]
    file.write_text("\n".join([head.replace("part_3_", "part_5_"), *rows, *late]) + "\n")
    result, seen = look(job, "--log", file, "--started", "0s", "--within-um", "1000")
    assert "left out: part_5_degC" in result.stderr
    assert seen["notes"] == ["the log has no row for 3570 s before 3600 s: a gap, or its clock was set forward"]
    for second in (0, 0.2):  # a logger of 15 min that writes two rows each time has no gap
        often = [f"{900 * (n // 2) + n % 2 * second:g},{rows[0].split(',', 1)[1]}{n}" for n in range(8)]
        file.write_text("\n".join([head.replace("part_3_", "part_5_"), *often]) + "\n")
        assert look(job, "--log", file, "--started", "0s", "--within-um", "1000")[1]["notes"] == []
    file.write_text("\n".join([head, *(row.replace(".", ",") for row in rows)]) + "\n")
    result, seen = look(job, "--log", file, "--started", "0s")
    refused(result, 1, "none of its 4 rows has a time_s and a cell for each column")
    assert "none of its 4 rows" in seen["doubt"]
    assert "none of its 4 rows" in run("follow", job, "--log", file, "--started", "0s", *ONCE).stdout


def test_a_page_that_begins_while_it_is_worked_out_is_not_written(job, tmp_path, monkeypatch):
    """Page 1 is due on an arm that stood 40 min; before its new text is ready the cell starts it: page 2 is written."""
    before = contents(job)
    rewrite = PlannedRun.rewrite

    def slowly(run, page, *given, **more):
        pages_file(tmp_path, (2400, 1, 1))
        return rewrite(run, page, *given, **more)

    monkeypatch.setattr(PlannedRun, "rewrite", slowly)
    _, record = look(job, "--log", log(tmp_path, 2400), "--pages", tmp_path / "pages.csv")
    assert record["due"] == 2
    changed = {name for name, data in contents(job).items() if before.get(name) != data}
    assert {"OPTIC_RASTER_01.LS", "OPTIC_RASTER_02.LS"} & changed == {"OPTIC_RASTER_02.LS"}


def test_pages_that_somebody_writes_meanwhile_are_kept(job, tmp_path, monkeypatch):
    """Between two looks somebody resumes from page 2; both that and what follow writes then stand in the manifest."""
    pages = pages_file(tmp_path)

    def resumed(pause):
        monkeypatch.setattr(time, "sleep", ended)
        call = run("resume", job, "--from-page", "2", "--late", "35min", "--date", "2026-01-31", "-q")
        assert call.returncode == 0, call.stderr
        log(tmp_path, 2400, 3.0)
        pages_file(tmp_path, (2390, 1, 2))

    def ended(pause):
        raise interrupts.Interrupted(2)

    monkeypatch.setattr(time, "sleep", resumed)
    with pytest.raises(interrupts.Interrupted):
        run("follow", job, "--log", log(tmp_path, 30), "--pages", pages, "--date", "2026-01-31", "-q")
    entries = json.loads((job / "OPTIC_RASTER.pages.json").read_bytes())["resumed"]
    assert [(e["from_page"], "late_s" in e) for e in entries] == [(2, True), (3, False)]


def test_a_log_that_no_longer_changes_is_told(job, tmp_path, monkeypatch):
    """Twice, while pages are still written down; a logger of 5 min may be silent for 15."""
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    spans = [p["start_s"] for p in json.loads((job / "OPTIC_RASTER.pages.json").read_bytes())["pages"]]
    pages = [(0, 1, ""), (spans[1], 2, ""), (spans[2], 3, "")]

    def slow(rows):
        head, first, *_ = log(tmp_path, 30).read_text().splitlines()
        lines = [f"{300 * n},{first.split(',', 1)[1]}" for n in range(rows)]
        (tmp_path / "log.csv").write_text("\n".join([head, *lines]) + "\n")

    told = [lambda n=n: pages_file(tmp_path, *pages[:n]) for n in (2, 3)]
    still, end = [lambda: None] * 4, [lambda: pages_file(tmp_path, *((s, k, "") for k, s in enumerate(spans, 1)))]
    steps = [*told, *still, lambda: log(tmp_path, 40), *still, lambda: slow(4), still[0], *end]
    steps += [lambda: log(tmp_path, spans[-1] + 40000)]
    pauses = iter(steps)

    def pause(seconds):
        now[0] += 301
        next(pauses)()

    monkeypatch.setattr(time, "sleep", pause)
    file, rows = log(tmp_path, 30), pages_file(tmp_path, *pages[:1])
    result = run("follow", job, "--log", file, "--pages", rows, "--within-um", "1000")
    assert result.stderr.count("has not changed for 10 min") == 2
    assert result.stderr.count("has not changed") == 2
    assert "30 s: by the log page 1 runs (" in result.stdout
    assert "; --pages says page 3 has begun; rises" in result.stdout
    assert "the last page has ended" in result.stdout


def test_killed_and_started_again_it_goes_on_as_if_it_had_run_through(job, tmp_path, monkeypatch):
    """Followed to the end in one go, and by single looks of processes that know nothing of each other."""
    other = shutil.copytree(job, tmp_path / "other")
    spans = [p["start_s"] for p in json.loads((job / "OPTIC_RASTER.pages.json").read_bytes())["pages"]]
    end = 2400 + spans[-1] + 400
    whole = log(tmp_path, end).read_text().splitlines(keepends=True)
    file = tmp_path / "growing.csv"
    pages = pages_file(tmp_path)
    moments = [0.3, 0.6, 0.8, 1.0]

    def grow(share):
        rows = whole[: max(2, int(len(whole) * share))]
        file.write_text("".join(rows))
        now = float(rows[-1].split(",")[0])
        pages_file(tmp_path, *((2400 + s, k, "") for k, s in enumerate(spans, 1) if 2400 + s <= now))

    ahead = iter(moments[1:])
    monkeypatch.setattr(time, "sleep", lambda pause: grow(next(ahead)))
    grow(moments[0])
    arguments = ("--log", file, "--pages", pages, "--date", "2026-01-31", "-q")
    result = run("follow", job, *arguments)
    assert result.returncode == 0, result.stderr
    for share in moments:
        grow(share)
        assert run("follow", other, *arguments, "--once").returncode in (0, 1)
    assert contents(job) == contents(other)
    assert json.loads((job / "OPTIC_RASTER.pages.json").read_bytes())["resumed"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--within-um", "0"), ("--within-um",)),
        (("--poll", "10"), ("--poll",)),
        (("--poll", "0s"), ("--poll",)),
        (("--pages", "x.csv", "--started", "0s"), ("--pages, --started",)),
        (("--started", "soon"), ("--started",)),
        (("--loaded", "99"), ("pages 1 to",)),
        (("--lead", "x"), ("--lead",)),
        (("--date", "soon"), ("not a date",)),
        (("--state", "nowhere.toml"), ("nowhere.toml",)),
    ],
)
def test_bad_calls_are_refused(job, tmp_path, arguments, words):
    before = contents(job)
    refused(run("follow", job, "--log", log(tmp_path, 30), *ONCE, *arguments), 2, *words)
    assert contents(job) == before


def test_a_log_that_is_none_is_refused(job, tmp_path):
    refused(run("follow", job, "--log", tmp_path / "no.csv", *ONCE), 2, "no.csv")
    other = tmp_path / "other.csv"
    other.write_text("a,b\n1,2\n")
    refused(run("follow", job, "--log", other, *ONCE), 2, "time_s")
    refused(run("follow", tmp_path / "no", "--log", other, *ONCE), 2, "no such folder")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda v: (v[0], 1.8 * v[1] + 32, *(1.8 * x + 32 for x in v[2:])), ("all sensors", "Fahrenheit")),
        (lambda v: (*v[:2], v[2] + 30, *v[3:]), ("part_3_degC", "sigma", "mend the sensor")),
        (lambda v: (*v[:2], v[2] + v[0] / 100, *v[3:]), ("part_3_degC", "sigma")),
        (lambda v: (*v[:2], v[5], *v[3:5], v[2]), ("part_3_degC and part_11_degC swapped",)),
        (lambda v: (v[0] + 1e6, *v[1:]), ("days after --planned",)),
        (lambda v: (v[0] + 1.7e9, *v[1:]), ("days after --planned",)),
        (lambda v: (v[0], *(x + 273.15 for x in v[1:])), ("kelvin",)),
    ],
)
def test_a_log_that_the_rest_contradicts_moves_nothing(job, tmp_path, change, words):
    before = contents(job)
    file = log(tmp_path, 2400)
    head, *rows = file.read_text().splitlines()
    told = [",".join(f"{x:.3f}" for x in change(tuple(map(float, row.split(","))))) for row in rows]
    file.write_text("\n".join([head, *told]) + "\n")
    result, _ = look(job, "--log", file, "--pages", pages_file(tmp_path, (0, 0, 0)))
    assert result.returncode == 1
    assert all(w in result.stderr for w in (*words, "the pages stay as they are")), result.stderr
    assert contents(job) == before


def test_the_log_of_a_robot_that_has_not_worked_moves_nothing(job, tmp_path):
    """Two sensors read the air, where three hours of work were planned: the others would be colder than any air."""
    before = contents(job)
    file = tmp_path / "log.csv"
    rng = np.random.default_rng(0)
    rows = [
        f"{t},{15 + t / 3600:.2f},{15.6 + rng.normal(0, 0.1):.2f},{16.4 + rng.normal(0, 0.1):.2f}"
        for t in range(0, 2401, 10)
    ]
    file.write_text("\n".join(["time_s,ambient_degC,part_3_degC,part_6_degC", *rows]) + "\n")
    result, seen = look("--log", file, job, "--pages", pages_file(tmp_path, (0, 0, 0)))
    assert result.returncode == 1
    assert "colder than all air and readings" in result.stderr
    assert seen["written"] == []
    assert contents(job) == before


def test_air_that_the_plan_says_is_the_same_on_any_clock_of_a_log(tmp_path):
    """A wave of the air, which no sensor of the log reads: the plan's day does not begin with the log."""
    out, wave = tmp_path / "out", ("--set", "ambient.kind=wave", "--set", "ambient.amplitude_K=5")
    assert run("generate", "paths/optic_raster.toml", *SMALL, *wave, "-q", "-o", out).returncode == 0
    rows = [line.split(",") for line in log(tmp_path, 600).read_text().splitlines()]
    forecasts = []
    for shift in (0, 18000, 30000):
        file = tmp_path / f"{shift}.csv"
        lines = [[str(float(t) + shift), *rest] for t, _, *rest in rows[1:]]
        file.write_text("\n".join(",".join(row) for row in ([rows[0][0], *rows[0][2:]], *lines)) + "\n")
        pages = pages_file(tmp_path, (shift + 300, 1, 3))
        job = shutil.copytree(out, tmp_path / f"job{shift}")
        forecasts.append(look(job, "--log", file, "--pages", pages, "--planned", f"{shift}s")[1]["forecast"])
    sizes = [[page["max_um"] for page in forecast] for forecast in forecasts]
    assert sizes[1] == pytest.approx(sizes[0], abs=0.01)
    assert sizes[2] == pytest.approx(sizes[0], abs=0.01)
