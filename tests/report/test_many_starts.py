"""A file that serves many starts, in JSON, on the page, in a notebook and on the screen."""

import csv
import json
from base64 import b64decode

import numpy as np
import pytest
from numpy.testing import assert_allclose
from shipped import path_file

import compgen
from compgen.core.units import UM
from compgen.report.many_starts import averaged_figure

CYCLE = 'cycle=[{state="moving", repeat=4, dwell_s=600}]'
STARTS = "compensation.average_over={delay_s=[0, 1800], override_percent=[40, 100], runs=[2, 4]}"


@pytest.fixture(scope="module")
def result():
    return compgen.generate(compgen.load_job(path_file("line_y"), overrides=[STARTS, CYCLE]))


def numbers(packed):
    return np.frombuffer(b64decode(packed["bdata"]))


def test_the_report_says_what_stays_at_the_mean_and_over_the_starts(result):
    record = result.report["average_over"]
    assert (record["delay_s"], record["override_percent"], record["runs"]) == ([0, 1800], [40, 100], [2, 4])
    assert len(record["flown"]) in (9, 10)
    assert record["max_um"] == max(one["max_um"] for one in record["flown"])
    assert record["max_um"] == result.report["on_part"]["after"]["total"]["max_um"]
    assert record["max_um"] > record["spread_max_um"] > record["at_mean"]["max_um"]
    assert record["rms_um"] ** 2 == pytest.approx(record["at_mean"]["rms_um"] ** 2 + record["spread_rms_um"] ** 2)
    assert record["remade_max_um"] == max(one["remade_max_um"] for one in record["flown"])
    assert record["times_better"] == pytest.approx(record["max_um"] / record["remade_max_um"])
    assert record["files"]["within_um"] == pytest.approx(5)
    assert json.loads(result.files()["report.json"]) == json.loads(json.dumps(result.report))


def test_a_job_of_one_start_says_nothing_of_it():
    plain = compgen.generate(compgen.load_job(path_file("line_y")))
    assert "average_over" not in plain.report
    assert plain.averaged is None
    assert b'id="average"' not in plain.files()["report.html"]
    with pytest.raises(compgen.InputError, match="unknown; known: time"):
        plain.plot("average")


def test_a_prediction_names_the_starts_that_it_is_the_mean_of():
    job = compgen.load_job(path_file("line_y"), overrides={"compensation.average_over": {"delay_s": [0, 1800]}})
    prediction = compgen.predict(job)
    assert prediction.report["average_over"] == {"delay_s": [0, 1800], "override_percent": [100], "runs": [1, 1]}
    now = compgen.predict(compgen.load_job(path_file("line_y")))
    assert np.all(prediction.rise < now.rise)


def test_the_page_has_the_figure_and_says_worst_and_mean(result):
    html = result.files()["report.html"].decode()
    record = result.report["average_over"]
    assert 'id="average"' in html
    assert f"leaves {record['at_mean']['max_um']:.2f}" in html
    assert f"flown starts {record['max_um']:.2f}" in html


def test_the_figure_is_what_was_flown_and_foretold(result):
    traces = averaged_figure(result.averaged)["data"]
    lines, marks = ([t for t in traces if t["mode"] == mode] for mode in ("lines", "markers"))
    served = {(100 * f.start.override, f.start.run + 1) for f in result.averaged.flown}
    assert {(40, 2), (40, 4), (100, 2), (100, 4)} <= served
    assert [t["name"] for t in lines] == [f"this file, {share:.4g} %, run {run}" for share, run in sorted(served)]
    flown, anew = marks
    assert_allclose(sorted(numbers(flown["y"])), sorted(f.total.max / UM for f in result.averaged.flown), atol=1e-3)
    assert_allclose(numbers(flown["x"]), numbers(anew["x"]))
    assert numbers(anew["y"]).max() < numbers(flown["y"]).max()
    assert result.plot("average").data[0].name == lines[0]["name"]
    for line in lines:
        assert np.all(np.diff(numbers(line["x"])) > 0)
        assert {0.0, 1800.0} <= set(numbers(line["x"]))


def test_without_delays_the_figure_runs_over_runs_or_overrides():
    for table, title, last in (
        ('{runs="all"}', "run", 4),
        ("{override_percent=[20, 60, 100]}", "override [%]", 100),
    ):
        job = compgen.load_job(path_file("line_y"), overrides=[f"compensation.average_over={table}", CYCLE])
        averaged = compgen.generate(job).averaged
        assert averaged is not None
        figure = averaged_figure(averaged)
        assert figure["layout"]["xaxis"]["title"]["text"] == title
        assert numbers(figure["data"][0]["x"])[-1] == last


def test_a_row_of_waypoints_has_the_mean_of_the_rises_and_the_worst_start(result):
    rows = list(csv.DictReader(result.files()["waypoints.csv"].decode().splitlines()))
    after = np.array([[float(row[f"after_d{a}_um"]) for a in "xyz"] for row in rows])
    worst = result.averaged.worst.error[result.corrected.samples]
    assert_allclose(after, worst / UM, atol=1e-3)
    assert_allclose([float(row["rise_j2_K"]) for row in rows], result.rise[:, 0], atol=1e-4)
