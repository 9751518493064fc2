"""How warm a robot is when its log ends: what no sensor shows, how well it is known, and what a sensor may hide."""

from dataclasses import replace

import numpy as np
import pytest
from logged_days import HOUR, REFERENCE, work
from lying_logs import logged_day
from numpy.testing import assert_allclose
from shipped import path_file

from compgen.pipelines.files.path_file import load_job
from compgen.thermal import log_end
from compgen.thermal.log_doubt import FLOOR, SIGMAS, doubt_of, hidden_lies
from compgen.thermal.log_end import end_of
from compgen.thermal.log_prior import Expected, LogPrior, Medians, medians_of, prior_from_log
from compgen.thermal.state_from_log import LogFit, TemperatureLog, fit_log
from compgen.thermal.temperature_log import read_temperature_log

DAYS = 40


@pytest.fixture(scope="module", params=["nodes", "network"])
def cell(request):
    return load_job(path_file("circle_1300"), overrides=[f"robot.thermal.model={request.param}"]).cell


@pytest.fixture(scope="module")
def nodes():
    return load_job(path_file("circle_1300")).cell


@pytest.fixture(scope="module")
def days(nodes, tmp_path_factory):
    """Logs of simulated days whose law is up to 20 % off, with the true rises at their ends."""
    file, drawn = tmp_path_factory.mktemp("days") / "log.csv", []
    for seed in range(DAYS):
        rng = np.random.default_rng([seed, 71])
        stretches = work(rng, rng.uniform(1, 7) * HOUR)
        end = sum(s.seconds for s in stretches)
        begin = 0.0 if rng.random() < 0.7 else rng.uniform(0, 0.6) * end  # in the middle of the day
        day = logged_day(rng, stretches, begin, end, begin)
        file.write_text(day.log.text())
        log = read_temperature_log(file, nodes.heat.names, nodes.sensors).rises(REFERENCE, 0.0)
        true = day.course.rises_at(day.end)
        drawn.append((log, np.array([true[name] for name in nodes.heat.names])))
    return drawn


def simple_log(cell, names=("j2", "link1", "j3", "wrist")):
    time = np.arange(0.0, 3 * HOUR, 60.0)
    scatter = np.random.default_rng(5)
    warm = -np.expm1(-time / (6.5 * HOUR))
    size = dict(zip(("j2", "link1", "j3", "wrist"), (11.0, 3.9, 13.0, 3.0), strict=True))
    readings = {n: 1.6 * size[n] * warm + scatter.normal(0, 0.05, len(time)) for n in names}
    return TemperatureLog(time, np.zeros(len(time)), readings)


def test_the_likeliest_end_is_that_of_least_squares_in_all_amounts(cell):
    """Against the normal equations of all amounts at once, noise and the sensors' errors among them."""
    prior = prior_from_log(simple_log(cell, ("j2", "wrist")), cell.heat, cell.warmth)
    A = prior.spread.shape[1]
    others = prior.covariance - prior.spread @ prior.spread.T
    information = np.eye(A) + prior.spread.T @ np.linalg.inv(others) @ prior.spread
    amounts = np.linalg.solve(information, prior.spread.T @ np.linalg.solve(others, prior.beyond))
    mean, covariance = prior.rises_at_end()
    assert_allclose(mean, prior.mean_at_end + prior.spread_at_end @ amounts, atol=1e-8)
    assert_allclose(covariance, prior.spread_at_end @ np.linalg.inv(information) @ prior.spread_at_end.T, atol=1e-8)


def test_what_no_sensor_shows_is_as_far_off_as_is_said(nodes, days, monkeypatch):
    """Each sensor is left out in turn. The days run at the fastest feed, the prior is midway: J2 is 1.3 sigma low."""
    fits: list[LogFit] = []  # that the ends are made of: each takes a quarter of a second

    def recorded(*given):
        fits.append(fit_log(*given))
        return fits[-1]

    monkeypatch.setattr(log_end, "fit_log", recorded)
    by_fit: dict[str, list[float]] = {}
    by_end: dict[str, list[float]] = {}
    for sensor in nodes.heat.names:
        k, normal = nodes.heat.names.index(sensor), []
        for log, true in days:
            left = replace(log, readings={n: v for n, v in log.readings.items() if n != sensor})
            if len(left.readings) < 2:
                continue
            end = end_of(left, nodes.heat, nodes.warmth)
            by_end.setdefault(sensor, []).append(end.state[k] - true[k])
            by_fit.setdefault(sensor, []).append(fits[-1].rise[-1, k] - true[k])
            assert end.warmth.start is not None
            normal.append(by_end[sensor][-1] / np.linalg.norm(end.warmth.start[k]))
        assert np.sqrt(np.mean(np.square(normal))) < 1.5, sensor
        assert np.mean(np.abs(normal) < 2) >= 0.9, sensor
        assert np.sqrt(np.mean(np.square(by_end[sensor]))) < 2.0, sensor  # K
    for sensor in ("link1", "j3", "face"):  # by the fit alone, up to 9 K
        assert np.abs(by_end[sensor]).max() < 0.8 * np.abs(by_fit[sensor]).max(), sensor


def test_a_sensor_is_believed_while_it_reads(nodes):
    log = simple_log(nodes)
    fitted, end = fit_log(log, nodes.heat).rise[-1], end_of(log, nodes.heat, nodes.warmth).state
    assert_allclose(end[:4], fitted[:4], atol=1e-12)
    log.readings["j3"][60:] = np.nan  # it has been silent for two hours
    later = end_of(log, nodes.heat, nodes.warmth)
    assert later.state[2] == pytest.approx(end[2], abs=1.0)
    full = end_of(simple_log(nodes), nodes.heat, nodes.warmth)
    assert full.warmth.start is not None
    assert later.warmth.start is not None
    assert np.linalg.norm(later.warmth.start[2]) > np.linalg.norm(full.warmth.start[2])


@pytest.mark.parametrize("names", [("j2", "link1", "j3", "wrist"), ("link1", "j3")])
def test_a_larger_lie_than_the_hidden_one_is_refused_and_a_smaller_one_moves_less(nodes, names):
    log = simple_log(nodes, names)
    columns = {n: f"{n}_degC" for n in names}

    def doubt(some):
        return doubt_of(some, nodes.heat, nodes.warmth, columns, REFERENCE)

    assert doubt(log) == ""
    which, size, _ = hidden_lies(
        prior_from_log(log, nodes.heat, nodes.warmth), [nodes.heat.names.index(n) for n in names]
    )
    end = end_of(log, nodes.heat, nodes.warmth)
    for k, name in enumerate(nodes.heat.names):
        if name not in names:
            continue
        largest = size[which == k].max()
        for sign in (-1, 1):
            lie = {**log.readings, name: log.readings[name] + sign * 2.5 * largest}
            assert doubt(replace(log, readings=lie)), name
            small = {**log.readings, name: log.readings[name] + sign * 0.5 * size[which == k].min()}
            moved = np.abs(end_of(replace(log, readings=small), nodes.heat, nodes.warmth).state - end.state)
            assert end.warmth.hidden is not None
            assert np.all(moved <= np.abs(end.warmth.hidden).max(axis=0) + 1e-6)


def test_what_a_sensor_hides_is_that_of_a_hand():
    """Of two sensors, what the other one leaves open; of one alone, how warm it may be."""
    S = np.array([[4.0, 1.0], [1.0, 9.0]])
    gain = np.array([[0.5, 0.2], [0.1, 0.3]])  # of two rises
    amounts = np.linalg.cholesky(S)
    at_end = (np.linalg.inv(amounts) @ S @ gain.T).T
    of_two = Medians(np.array([0.0, 1.0]), np.full(2, 60.0), np.zeros(2), np.zeros(2))
    of_one = Medians(np.zeros(2), np.array([0.0, 60.0]), np.zeros(2), np.zeros(2))
    prior = LogPrior(
        medians=of_two, beyond=np.zeros(2), spread=amounts, covariance=S, mean_at_end=np.zeros(2), spread_at_end=at_end
    )
    left_open = np.array([4 - 1 / 9, 9 - 1 / 4])  # of a reading beside the other: the inverse's diagonal
    nodes, size, off = hidden_lies(prior, [3, 5])
    assert nodes.tolist() == [3, 5]
    assert_allclose(size, SIGMAS * np.sqrt(left_open + FLOOR**2))
    assert_allclose(off, gain.T * size[:, None])
    nodes, size, off = hidden_lies(replace(prior, medians=of_one), [3])
    assert nodes.tolist() == [3, 3, 3]
    assert_allclose(size, SIGMAS * 3.0)
    courses = np.array([[1, 1], [0, 1], [0, 1]])  # off from the first reading on, running away, off from the second on
    assert_allclose(off, courses @ gain.T * size[:, None])


def test_what_a_known_history_leaves_open_is_that_of_a_hand(nodes):
    """Breaks that nobody told of, a start that was another, a night of 2 K and half of 4 K of air, a draught of 1 K."""
    heat, warmth, begin = nodes.heat, nodes.warmth, 500.0
    log = replace(simple_log(nodes), time=begin + simple_log(nodes).time, air=np.linspace(1.0, 3.0, 180))
    rise = np.outer(np.linspace(0.2, 1.0, 50), heat.reference_rise)
    expected = Expected(begin + np.linspace(0, 3 * HOUR, 50), rise, 4.0)
    prior = prior_from_log(log, heat, warmth, expected)
    node = [heat.names.index(list(log.readings)[int(n)]) for n in prior.medians.which]
    since = prior.medians.time - begin
    course = (0.2 + 0.8 * since / (3 * HOUR)) * heat.reference_rise[node]
    tau, lag, first = heat.tau[node], warmth.lag[node], since.min()  # of the medians
    air_then, air = np.interp(first, log.time - begin, log.air), np.interp(since, log.time - begin, log.air)
    start = (0.2 + 0.8 * first / (3 * HOUR)) * heat.reference_rise[node] - air_then
    work = [0.15 * (course - air), 0.15 * start * np.exp(-since / lag)]
    columns = [*work, 8**0.5 * np.exp(-since / tau), 1 - np.exp(-since / tau)]
    assert_allclose(prior.beyond, prior.medians.value - course - 2.0 * np.exp(-since / tau), atol=1e-9)
    assert_allclose(prior.spread[:, :4] @ prior.spread[:, :4].T, sum(np.outer(c, c) for c in columns), atol=1e-9)


@pytest.mark.parametrize(("count", "scatter"), [(2, 0.1), (3, 1.05 * 6.0)])
def test_two_readings_do_not_say_how_they_scatter(count, scatter):
    time = np.array([0.0, 600.0, 1200.0])[:count]
    values = np.array([0.0, 6.0, 12.0])[:count]
    medians = medians_of(TemperatureLog(time, np.zeros(count), {"j2": values}))
    rounding = 1 / 12**0.5  # of whole kelvins at most
    assert_allclose(medians.sigma, np.sqrt((1.25 * scatter) ** 2 + 0.15**2 + rounding**2))


def test_a_lone_sensor_hides_what_work_can_do(nodes):
    few, all_four = (
        end_of(simple_log(nodes, n), nodes.heat, nodes.warmth).warmth for n in (("j3",), ("j2", "link1", "j3", "wrist"))
    )
    assert few.hidden is not None
    assert all_four.hidden is not None
    assert few.start is not None
    assert all_four.start is not None
    assert np.abs(few.hidden).max() > 2 * np.abs(all_four.hidden).max()
    assert np.linalg.norm(few.start) > 2 * np.linalg.norm(all_four.start)


def test_a_second_model_goes_on_with_the_fit_and_says_how_far_it_is_from_the_likeliest(cell):
    log = simple_log(cell, ("j2", "wrist"))
    end = end_of(log, cell.heat, cell.warmth)
    mean, covariance = prior_from_log(log, cell.heat, cell.warmth).rises_at_end()
    apart = cell.heat.outputs @ end.state - mean
    assert end.warmth.start is not None
    assert_allclose(end.warmth.start @ end.warmth.start.T, covariance + np.outer(apart, apart), atol=1e-8)
