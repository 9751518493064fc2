"""One file for many starts: against brute force over sampled starts, and against jobs that really start there."""

from dataclasses import replace

import numpy as np
import pytest
from flawed import flawed_file
from numpy.testing import assert_allclose
from problems import problem_of
from shipped import path_file, quiet

from compgen.compensation import optimise
from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Level
from compgen.core.units import HOUR, UM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.pipelines.planned import generate
from compgen.pipelines.planned.many_starts import planned_rises
from compgen.thermal import JointMotion
from compgen.thermal.ensemble import Start, rises_of
from compgen.verification.deviation import deviation_from_path
from compgen.verification.twin import prepare

DELAYS = "compensation.average_over={delay_s=[0, 1200]}"
WIDE = "compensation.average_over={delay_s=[0, 3600], override_percent=[50, 100], runs=[1, 8]}"
CYCLE = 'cycle=[{state="moving", repeat=4, dwell_s=1200}, {state="idle", duration_h=0.5}, {state="moving", repeat=4}]'
SAME_M = 1e-9


def averaged(*overrides, path="spiral_1300"):
    chord = ["process.chord_um=1.4"]  # so that what a start adds is not hidden by it
    return generate.generate(load_job(path_file(path), overrides=[*chord, *overrides]), quiet)


@pytest.fixture(scope="module")
def delays():
    return averaged(DELAYS)


@pytest.fixture(scope="module")
def wide():
    return averaged(WIDE, CYCLE)


def differences(arc, order):
    """Divided differences between waypoints, written out."""
    rows = np.zeros((len(arc) - order, len(arc)))
    for n, row in enumerate(rows):
        if order == 1:
            row[n : n + 2] = np.array([-1, 1]) / (arc[n + 1] - arc[n])
        else:
            a, b = arc[n + 1] - arc[n], arc[n + 2] - arc[n + 1]
            row[n : n + 3] = [2 / (a * (a + b)), -2 / (a * b), 2 / (b * (a + b))]
    return rows


def test_brute_force_over_sampled_starts_finds_the_correction_of_their_mean():
    """The expected cost over 200 starts, each with its own slopes, minimised by Newton's method on dense matrices."""
    job = load_job(path_file("circle_1300"), overrides=[WIDE, CYCLE, "compensation.curvature_period_mm=60"])
    planned = generate.predict(job, quiet)
    some = slice(400, 440)
    motion = JointMotion(planned.trajectory.time, planned.theta, planned.trajectory.driven_speed)
    random = np.random.default_rng(3)
    sampled = [random.integers(0, 8, 200), random.uniform(0, 3600, 200), random.choice([0.5, 1.0], 200)]
    starts = [Start(*values) for values in zip(*(column.tolist() for column in sampled), strict=True)]
    rises = [rises_of(job.heat, job.history, start, motion)[some] for start in starts]
    problem = problem_of(planned, some)
    of_mean = optimise.optimise(replace(problem, rise=np.mean(rises, axis=0)), job.settings).correction

    s, N = job.settings, len(problem.arc)
    h = np.diff(problem.arc)
    ds = np.concatenate([[h[0] / 2], (h[1:] + h[:-1]) / 2, [h[-1] / 2]])
    one, two = differences(problem.arc, 1), differences(problem.arc, 2)
    rough = (s.rate_period / (2 * np.pi)) ** 2 * one.T @ np.diag(h) @ one
    rough += (s.curvature_period / (2 * np.pi)) ** 4 * two.T @ np.diag((h[1:] + h[:-1]) / 2) @ two
    lever = np.array([1, 1, 1, *3 * [s.lever]]) ** 2
    stiff = np.kron(rough, np.diag(lever))

    def cost(c):
        errors = [replace(problem, rise=rise).residual(c) for rise in rises]
        fidelity = np.mean([(ds[:, None] * lever * e**2).sum() for e in errors])
        return fidelity + c.ravel() @ stiff @ c.ravel()

    c = np.zeros((N, 6))
    for _ in range(6):
        gradient, hessian = stiff @ c.ravel(), stiff.copy()
        for rise in rises:
            line = replace(problem, rise=rise).linearise(c)
            for n in range(N):
                at = slice(6 * n, 6 * n + 6)
                slope = line.error_jacobian[n]
                gradient[at] += ds[n] / len(rises) * slope.T @ (lever * line.e[n])
                hessian[at, at] += ds[n] / len(rises) * slope.T @ (lever[:, None] * slope)
        step = np.linalg.solve(hessian, -gradient).reshape(N, 6)
        c = c + step
    assert np.abs(step).max() < 1e-12
    assert np.abs(of_mean - c)[:, :3].max() < SAME_M
    assert np.abs(of_mean - c)[:, 3:].max() < 4e-9  # rad
    least = cost(of_mean)
    assert least == pytest.approx(cost(c), rel=1e-6)
    assert all(cost(of_mean + 1e-6 * random.normal(size=(N, 6))) > least for _ in range(5))
    # the file of one start alone is another, and worse for all of them
    alone = optimise.optimise(replace(problem, rise=rises[0]), job.settings).correction
    assert np.abs(alone - of_mean)[:, :3].max() > 1 * UM
    assert cost(alone) > 1.2 * least
    # what no correction changes: how the starts' errors lie about their mean
    errors = np.array([replace(problem, rise=rise).residual(of_mean) for rise in rises])
    about = np.mean([(ds[:, None] * lever * e**2).sum() for e in errors - errors.mean(axis=0)])
    at_mean = (ds[:, None] * lever * replace(problem, rise=np.mean(rises, axis=0)).residual(of_mean) ** 2).sum()
    assert_allclose(about + at_mean + of_mean.ravel() @ stiff @ of_mean.ravel(), least, rtol=1e-6)


def test_the_mean_of_sampled_starts_comes_to_the_mean_that_is_planned_for():
    job = load_job(path_file("line_y"), overrides=[WIDE, CYCLE])
    planned = generate.predict(job, quiet)
    motion = JointMotion(planned.trajectory.time, planned.theta, planned.trajectory.driven_speed)
    delays = (np.arange(300) + 0.5) * 12
    starts = [Start(run, delay, share) for run in range(8) for delay in delays.tolist() for share in (0.5, 1.0)]
    mean = np.mean([rises_of(job.heat, job.history, start, motion) for start in starts], axis=0)
    assert_allclose(planned_rises(job, motion), mean, atol=1e-5)
    assert_allclose(planned.rise, mean, atol=1e-5)
    assert np.abs(mean - load_rises("line_y", CYCLE)).max() > 0.1


def load_rises(path, *overrides):
    return generate.predict(load_job(path_file(path), overrides=list(overrides)), quiet).rise


def started_late(corrected, planned, path, delay, *overrides):
    """The written text on the twin of a job that has no ensemble, and that stands for the delay as its own history."""
    standing = f'{{state="idle", duration_h={delay / HOUR!r}}}'
    before = '{state="moving", program="circle_1300", feed_mm_s=200, duration_h=6}'
    job = load_job(path_file(path), overrides=[f"before=[{before}, {standing}]", *overrides])
    prepared = prepare(twin_of(job), corrected.program, job.history.before, job.history.air)
    return deviation_from_path(planned.path, prepared.chunks(), prepared.sample_count)


@pytest.mark.parametrize("delay", [600, 1200])
def test_what_was_flown_is_what_a_job_that_starts_late_finds(delays, delay):
    planned, corrected = delays
    late = started_late(corrected, planned, "spiral_1300", delay)
    flown = next(f for f in corrected.averaged.flown if f.start.delay == delay)
    assert flown.total.max == pytest.approx(late.on_part["total"].max, abs=1e-12)
    assert flown.total.rms == pytest.approx(late.on_part["total"].rms, abs=1e-12)


def test_the_file_made_anew_is_that_of_a_job_that_starts_late(delays):
    _, corrected = delays
    standing = '{state="idle", duration_h=%r}' % (1200 / HOUR)
    before = f'before=[{{state="moving", program="circle_1300", feed_mm_s=200, duration_h=6}}, {standing}]'
    _, alone = averaged(before)
    flown = next(f for f in corrected.averaged.flown if f.start.delay == 1200)
    assert flown.remade.max == pytest.approx(alone.deviation.on_part["total"].max, rel=0.02)
    assert flown.total.max > 2 * flown.remade.max


def test_ends_and_middle_are_flown_and_the_worst_is_told(delays):
    _, corrected = delays
    result = corrected.averaged
    assert [f.start for f in result.flown] == [Start(), Start(0, 1200.0), Start(0, 600.0)]
    assert corrected.deviation is result.worst
    assert corrected.deviation.on_part["total"].max == max(f.total.max for f in result.flown)
    for statistic in ("max", "p99", "rms"):
        each = [getattr(f.total, statistic) for f in result.flown]
        assert getattr(corrected.deviation.on_part["total"], statistic) == max(each) > min(each)
    assert corrected.deviation.total().max() == pytest.approx(corrected.deviation.extents["total"].max)
    assert result.at_mean.max < 2.2 * UM < 4 * UM < result.worst_flown.total.max
    # the middle of the delays is nearly their mean
    assert result.flown[2].total.max == pytest.approx(result.at_mean.max, rel=0.05)


def test_corners_of_all_that_varies_are_flown(wide):
    starts = {f.start for f in wide[1].averaged.flown}
    assert {Start(run, delay, share) for run in (0, 7) for delay in (0.0, 3600.0) for share in (0.5, 1.0)} <= starts
    assert len(starts) in (9, 10)


def test_what_is_foretold_is_what_the_twin_flies(delays, wide):
    for _, corrected in (delays, wide):
        result = corrected.averaged
        assert result.disagreement < 0.01 * UM < 0.5 * UM < result.spread
        foretold = dict(zip(result.starts, result.largest, strict=True))
        for f in result.flown:
            if f.start in foretold:
                assert foretold[f.start] == pytest.approx(f.total.max, rel=0.02)


def test_rms_is_that_of_what_was_flown_over_the_delays(delays):
    """Simpson's rule over three flown starts, against the sum of what stays at the mean and how starts differ."""
    _, corrected = delays
    at_once, late, middle = (f.total.rms**2 for f in corrected.averaged.flown)
    assert corrected.averaged.rms == pytest.approx(np.sqrt((at_once + 4 * middle + late) / 6), rel=0.02)


def test_bounds_are_judged_at_every_flown_start(delays):
    _, corrected = delays
    assert [f.code for f in corrected.findings if f.level is Level.OUTSIDE][:1] == ["bounds.max_um"]
    _, kept = averaged(DELAYS, "bounds.max_um=5", "bounds.normal_um=5")
    assert kept.inside
    _, missed = averaged(DELAYS, "bounds.max_um=4", "bounds.normal_um=5")
    assert not missed.inside  # at the mean and in the middle 2 um stay


def test_the_start_window_is_the_interval_and_stands_in_the_text(delays, wide):
    for _, corrected in (delays, wide):
        assert corrected.start_window == corrected.averaged.ensemble.delay[1]
    assert b"!start within 1200 s of that" in delays[1].text.replace(b"! ", b"!")
    assert b"start within 3600 s of that" in wide[1].text
    assert b"!runs 1 to 8 ;" in wide[1].text
    assert b"!RUN AT 50 TO 100% OVERRIDE ;" in wide[1].text
    assert b"!RUN AT 100% OVERRIDE ;" in delays[1].text
    _, later = averaged("compensation.average_over={delay_s=[600, 1200]}")
    assert b"start 600-1200 s after that" in later.text
    _, latest = averaged("compensation.average_over={delay_s=[10000, 57600]}")
    assert b"!start 10000-57600 s after that ;" in latest.text
    # the warmth in the remarks is that of the planned start, from which delays count
    assert [r for r in delays[1].program.remarks if "rise" in r] == [
        r for r in averaged()[1].program.remarks if "rise" in r
    ]


def test_delays_that_are_flown_are_no_uncertainty(delays):
    sources = {share.source for share in delays[1].band.budget}
    assert "start delay" not in sources
    for unflown in (averaged(), averaged("compensation.average_over={override_percent=[50, 100]}")):
        assert "start delay" in {share.source for share in unflown[1].band.budget}


def test_without_delays_the_start_window_is_from_the_drift():
    _, corrected = averaged("compensation.average_over={override_percent=[50, 100]}")
    assert corrected.start_window == pytest.approx(averaged()[1].start_window, rel=0.05)


def test_one_start_alone_is_the_file_that_it_always_was():
    planned, corrected = averaged("compensation.average_over={delay_s=[0, 0]}")
    plain, alone = averaged()
    assert_allclose(planned.rise, plain.rise, atol=1e-12)
    assert_allclose(corrected.solution.correction, alone.solution.correction, atol=1e-13)
    assert corrected.averaged.times == pytest.approx(1, abs=1e-6)
    assert alone.averaged is None


def test_a_wide_ensemble_is_a_warning_with_how_many_files_would_do(wide):
    _, corrected = wide
    result = corrected.averaged
    message = next(f for f in corrected.findings if f.code == "average.wide")
    assert message.level is Level.WARNING
    assert f"{result.times:.1f} times better" in message.message
    assert f"{result.files} files" in message.message
    assert result.files > 1
    assert not [f for f in averaged(DELAYS)[1].findings if f.code == "average.wide"]  # within start_drift_um


def test_more_files_keep_a_smaller_drift(wide):
    few = wide[1].averaged.files
    _, tight = averaged(WIDE, CYCLE, "compensation.start_drift_um=1")
    assert tight.averaged.files > 2 * few


def test_files_for_parts_of_an_interval_are_as_few_as_can_be():
    """Of a displacement that only grows with the delay: its range over twice the drift."""
    _, corrected = averaged("compensation.average_over={delay_s=[0, 14400]}", "compensation.start_drift_um=3")
    result = corrected.averaged
    at_end = [added for start, added in zip(result.starts, result.added, strict=True) if start.delay in (0.0, 14400.0)]
    least = int(np.ceil(sum(at_end) / (2 * 3 * UM)))
    assert least >= 4
    assert least <= result.files <= least + 1  # the mean is not where the displacements are straight


def test_uncorrected_the_mean_is_what_is_predicted():
    planned = generate.predict(load_job(path_file("spiral_1300"), overrides=[DELAYS]), quiet)
    late = generate.predict(
        load_job(
            path_file("spiral_1300"),
            overrides=[
                'before=[{state="moving", program="circle_1300", feed_mm_s=200, duration_h=6}, '
                f'{{state="idle", duration_h={600 / HOUR!r}}}]'
            ],
        ),
        quiet,
    )
    now = generate.predict(load_job(path_file("spiral_1300")), quiet)
    largest = [p.deviation().extents["total"].max for p in (now, planned, late)]
    assert largest[0] - largest[1] > 0.5 * UM
    assert largest[1] == pytest.approx(largest[2], abs=0.1 * UM)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("{delay_s=[1200, 0]}", "delay_s: [1200.0, 0.0] must rise"),
        ("{delay_s=[-1, 5]}", "delay_s.0: -1: must be greater"),
        ("{delay_s=[0, 60000]}", "delay_s.1: 60000: must be less than or equal to 57600"),
        ("{delay_s=[0]}", "delay_s: [0]"),
        ("{delay_s=[0, nan]}", "not a number"),
        ("{runs=[1, 40]}", "there is no run 40; runs are 1 to 8"),
        ("{runs=[3, 1]}", "runs: [3, 1] must rise"),
        ("{runs=[0, 1]}", "runs.0: 0"),
        ('{runs="some"}', "must be 'all'"),
        ("{}", "nothing to average over"),
        ("{delay=[0, 1]}", "did you mean 'delay_s'?"),
        ("{override_percent=[50, 150]}", "150: must be less than or equal to 100"),
        ("{override_percent=[50, 50]}", "50 stands twice"),
        ("{override_percent=[]}", "at least 1 item"),
        ("{override_percent=[50], feed_mm_s=[100]}", "conflicts with override_percent"),
        ("{feed_mm_s=[100, 300]}", "300 is above process.feed_mm_s = 200"),
        ("{feed_mm_s=[1]}", "an override goes from 1 to 100 %"),
        ("5", "must be a table"),
    ],
)
def test_what_cannot_be_averaged_over_is_refused_in_one_line(table, words):
    with pytest.raises(InputError) as refusal:
        load_job(path_file("spiral_1300"), overrides=[f"compensation.average_over={table}", CYCLE])
    message = str(refusal.value)
    assert "compensation.average_over" in message
    assert words in message
    assert "\n" not in message
    assert len(message) <= 300


def test_a_path_without_cycle_has_one_run():
    with pytest.raises(InputError, match="runs are 1 alone"):
        load_job(path_file("spiral_1300"), overrides=["compensation.average_over={runs=[1, 2]}"])
    job = load_job(path_file("spiral_1300"), overrides=['compensation.average_over={runs="all"}', CYCLE])
    assert job.ensemble is not None
    assert job.ensemble.runs == (0, 7)
    feeds = load_job(path_file("spiral_1300"), overrides=["compensation.average_over={feed_mm_s=[200, 50]}"])
    assert feeds.ensemble is not None
    assert feeds.ensemble.overrides == (0.25, 1.0)


def test_a_robot_with_every_error_source_is_foretold_as_the_twin_flies_it(tmp_path):
    """Play, maps, compliance and bends: none of them makes the error other than linear in the rises."""
    raster = ["path.diameter_mm=400", "path.stepover_mm=80", "robot.sources.hysteresis.backlash_mdeg=[2,1.6,2,4,4,4]"]
    starts = "compensation.average_over={delay_s=[0, 1200], override_percent=[50, 100]}"
    job = load_job(path_file("raster_1300"), flawed_file(tmp_path), [*raster, starts])
    _, corrected = generate.generate(job, quiet)
    result = corrected.averaged
    assert corrected.solution.status.is_legal
    assert result is not None
    assert result.disagreement < 0.01 * UM < 0.5 * UM < result.spread
    assert result.at_mean.max < 1 * UM < 2 * UM < result.worst_flown.total.max


def test_the_first_page_may_start_within_the_interval():
    starts = "compensation.average_over={delay_s=[60, 900]}"
    small = ("robot.controller.max_positions=3000", 'process.page_stops="anywhere"')
    _, corrected = averaged(starts, *small)
    plain = averaged(*small)[1].delivery
    first, second, *_ = corrected.delivery.starts
    assert first.window == 900
    assert second.window != 900
    assert_allclose(first.rise, plain.starts[0].rise, atol=1e-9)  # from there delays count
    assert np.all(second.rise < plain.starts[1].rise)
    page = dict(corrected.delivery.files)[f"{corrected.program.name}_01.LS"]
    assert b"start 60-900 s after that" in page


def test_thinned_programs_are_flown_as_well():
    _, corrected = averaged(DELAYS, "process.thin_um=1")
    assert corrected.averaged.disagreement < 0.02 * UM < corrected.averaged.spread


def test_the_planned_start_is_that_of_the_first_run_that_is_served():
    job = load_job(path_file("spiral_1300"), overrides=["compensation.average_over={runs=[3, 4]}", CYCLE])
    assert job.clock == job.history.clock + job.history.runs[2]
    assert_allclose(job.state(), rises_of(job.heat, job.history, Start(2), still_motion(job))[0], atol=1e-9)


def still_motion(job):
    """A program of two places, for the rises at its start; of the nodes, whose states are their rises."""
    return JointMotion(np.array([0.0, 1.0]), np.zeros((2, 6)), np.array([job.feed]))
