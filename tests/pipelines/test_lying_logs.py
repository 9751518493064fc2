"""A short run of the campaign of temperature logs that lie; tests/campaigns/lying_logs.py has the long one."""

import csv
from dataclasses import replace

import lies
import logged_days
import lying_logs
import numpy as np
import pytest
from logged_days import HOUR, Stretch
from lying_logs import Case, Outcome
from naive_heat import NODES, THERMAL, rises
from shipped import load_everything

#: the whole campaign is by hand; from 9 on they were wrong once
SEEDS = (1, 8, 13, 9, 83, 86, 90, 91, 355)
PLACES = {("A.LS", n): np.array([1300.0, 10 * n, 200]) for n in range(1, 4)}
TAKEN = Outcome("taken", 0, "", PLACES, 20.0, 0.0, 3.0)


def moved(um, **changes):
    places = PLACES | {("A.LS", 2): PLACES["A.LS", 2] + [0, 0, um / 1000]}
    return replace(TAKEN, places=places, **changes)


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CC", "")
        load_everything()
        yield lying_logs.Bench(tmp_path_factory.mktemp("bench"))


def test_each_command_meets_each_lie():
    cases = [lying_logs.case_of(seed) for seed in range(168)]
    assert len({(c.command, c.kind) for c in cases}) == 168


def test_the_days_have_the_law_that_the_robot_file_says():
    assert {n: (v["rise_K"], v["exponent"], v["tau_h"]) for n, v in NODES.items()} == logged_days.LAW
    assert THERMAL["idle_fraction"] == logged_days.IDLE
    assert THERMAL["cte_um_m_K"] == lying_logs.CTE
    day = [Stretch("moving", 200, 2 * HOUR), Stretch("idle", 0, HOUR), Stretch("off", 0, HOUR)]
    time = np.arange(0, 4 * HOUR + 20, logged_days.STEP)
    exact = rises([(s.state, s.feed, s.seconds / HOUR) for s in day])
    right: dict[str, tuple[float, ...]] = dict.fromkeys(logged_days.LAW, (1.0, 1.0))
    warm = logged_days.warmed(day, time, np.full(len(time), logged_days.REFERENCE), right)
    for node, rise in warm.items():
        assert np.interp(4 * HOUR, time, rise) == pytest.approx(exact[node], abs=0.001)  # K
    colder = logged_days.warmed(day, time, np.full(len(time), logged_days.REFERENCE - 8), right)
    assert all(np.allclose(colder[node], warm[node] - 8) for node in warm)


@pytest.mark.parametrize("kind", lies.LIES)
def test_a_lie_is_another_log_with_the_same_columns(kind):
    for seed in range(6):
        rng = np.random.default_rng(seed)
        stretches = logged_days.work(rng, 2 * HOUR)
        day = lying_logs.logged_day(rng, stretches, 0.0, sum(s.seconds for s in stretches), 0.0)
        honest, lie = (list(csv.reader(log.text().splitlines())) for log in (day.log, lies.LIES[kind](day, rng)))
        assert honest != lie
        assert set(honest[0]) - {"ambient_degC"} == set(lie[0]) - {"ambient_degC"}
        assert len(honest) > 20
        assert all(len(row) == len(lie[0]) for row in lie)


def test_the_judge_sees_a_planted_lie():
    generate, follow = Case(1, "generate", "sensor off"), Case(3, "follow", "yesterday")
    assert lying_logs.judged(generate, TAKEN, moved(19))["wrong"] == ""
    assert lying_logs.judged(generate, TAKEN, moved(21))["wrong"] == "moved by 21 um, the band is 20 um"
    assert lying_logs.judged(generate, TAKEN, moved(21, code=1))["wrong"]  # whatever it ends with
    assert lying_logs.judged(generate, TAKEN, moved(21, band_um=900.0))["wrong"]  # a lie prints a wide band of its own
    assert lying_logs.judged(follow, TAKEN, moved(21))["wrong"]
    row = lying_logs.judged(replace(generate, kind="yesterday"), TAKEN, moved(21))
    assert (row["wrong"], "unseen" in row) == ("", True)
    nothing = Outcome("refused", 2, "cgen: log.csv: j2_degC is off")
    assert lying_logs.judged(generate, nothing, replace(TAKEN, off_um=30.0))["wrong"]  # there the true arm tells


def test_pages_that_a_lie_leaves_alone_are_not_moved_by_it():
    follow = Case(3, "follow", "sensor off")
    assert lying_logs.judged(follow, TAKEN, moved(90, written=("B.LS",)))["wrong"] == ""
    kept = lying_logs.judged(follow, moved(90, written=("A.LS",)), replace(TAKEN, result="kept", band_um=20.0))
    assert (kept["wrong"], kept["withheld_um"]) == ("", 90)


@pytest.mark.parametrize(
    ("command", "code", "words", "well"),
    [
        ("generate", 2, "cgen: log.csv: j2_degC: 30 K off", True),
        ("generate", 3, "cgen: log.csv: j2_degC: 30 K off", False),
        ("generate", 2, "cgen: j2_degC: 30 K off", False),
        ("generate", 2, "cgen: log.csv: 30 K off\nand more", False),
        ("generate", 2, "cgen: log.csv: " + 300 * "x", False),
        ("generate", 1, "Traceback: log.csv", False),
        ("check", 2, '{"error": "log.csv: 30 K off"}\ncgen: log.csv: 30 K off', True),
        ("resume", 2, "cgen: note: no C compiler\ncgen: log.csv: 30 K off", True),
        ("resume", 2, "cgen: not enough memory", False),
        ("follow", 1, '{"notes": ["j2_degC is off"]}', True),
        ("follow", 1, '{"notes": []}', False),
    ],
)
def test_a_refusal_is_one_line_that_names_a_file(command, code, words, well):
    assert lying_logs.well_told(command, Outcome("refused", code, words)) is well
    row = lying_logs.judged(Case(1, command, "Kelvin"), TAKEN, Outcome("refused", code, words))
    assert bool(row["wrong"]) is not well


def test_the_table_says_how_many_were_wrong():
    generate = Case(1, "generate", "sensor off")
    rows = [lying_logs.judged(generate, TAKEN, moved(um)) for um in (5, 21)]
    text = lying_logs.table(rows)
    (line,) = [line for line in text.splitlines() if line.startswith("sensor off ")]
    assert line.split()[2:] == ["2", "2", "0", "0", "0", "0", "1", "5.0"]
    assert "WRONG 1 generate, sensor off: moved by 21 um" in text
    far = lying_logs.judged(generate, replace(TAKEN, off_um=45.0), TAKEN)
    assert "1 generate: 45 um, the band is 20 um" in lying_logs.table([far])
    assert "beyond the band on the true arm 0" in text


def test_an_honest_log_is_right_on_the_true_arm_and_no_sensor_is_off_unseen(bench):
    """The judge and the package agree on an honest day; 30 K more at one sensor is refused, or the judge sees it."""
    case = Case(8, "generate", "sensor off")
    question = lying_logs.drawn(case, bench.durations)
    log = question.day.log
    honest = bench.outcome(case, question, log)
    assert (honest.result, honest.code) == ("taken", 0)
    assert honest.off_um < honest.band_um
    rise = question.day.course.rises_at(question.day.end)
    warmer = {node: r + 10 for node, r in rise.items()}
    assert lying_logs.apart_um(bench.plan.flown(rise), bench.plan.flown(warmer)) > 2 * honest.band_um
    assert lying_logs.apart_um(bench.plan.flown(dict.fromkeys(rise, 0.0)), bench.plan.places) < 1e-6
    name = lies.nodes_of(log)[1]
    lie = bench.outcome(case, question, lies.with_column(log, name, log.columns[name] + 30))
    row = lying_logs.judged(case, honest, lie)
    assert lie.result == "refused" or "moved by" in row["wrong"]


@pytest.mark.parametrize("seed", SEEDS)
def test_no_drawn_lie_moves_a_program_by_more_than_its_band(bench, seed):
    row = lying_logs.tried(bench, None, seed)
    assert row["wrong"] == ""
    assert row["honest"]["result"] in ("taken", "kept")
