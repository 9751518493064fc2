"""Draws of an arm and a day, flown by the twin from the text, and the bounds with a probability that they verify."""

import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from flawed import KNOWN_WITH_SIGMAS
from shipped import ROOT, path_file, quiet

from compgen.compensation.problem import Status
from compgen.core.exceptions import InputError
from compgen.core.units import UM
from compgen.job.bounds import Bounds, Guarantee
from compgen.job.job import Job
from compgen.job.uncertainty import changed_job
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.pipelines.planned import generate
from compgen.pipelines.planned.job_results import Corrected, Planned
from compgen.pipelines.uncertainty import draws as flown
from compgen.pipelines.uncertainty.band_columns import WaypointProgram, columns_along, job_uncertainty, rows_of_band
from compgen.verification.band import directed_moment
from compgen.verification.deviation import deviation_from_path
from compgen.verification.twin import prepare
from compgen.verification.verdict import Verdict

LINE = path_file("line_x")
#: a robot that knows everything but what a test adds
KNOWN = [
    "robot.thermal.uncertainty={law_K=0, sensors_K=0, air_K=0, feed_percent=0, missing_percent=0, "
    "cte_um_m_K=[11.25, 11.25]}",
    "compensation.start_drift_um=0.01",
]
#: a robot with a bit of everything, each known with a sigma
FLAWED = [
    *KNOWN_WITH_SIGMAS,
    "frame.x_mm=-40",
    "frame.taught.through='model'",
    "frame.taught.sigma_um=[5, 6, 7]",
    "frame.taught.sigma_mdeg=[1, 2, 3]",
]


def corrected(*overrides: str, robot: str | None = None) -> tuple[Planned, Corrected]:
    return generate.generate(load_job(LINE, robot, overrides), quiet)


def promise(draws: int = 59, seed: int = 0) -> Guarantee:
    return Guarantee(bounds=Bounds(max=1e-3), share=0.95, confidence=0.95, draws=draws, may_break=0, seed=seed)


def fly(result: tuple[Planned, Corrected], guarantee: Guarantee) -> flown.FlownDraws:
    planned, made = result
    prepared = prepare(twin_of(planned.job), made.program, made.before, made.air)
    draws = flown.fly_program_draws(driven(result), prepared, made.deviation, made.start_window, guarantee=guarantee)
    assert draws is not None
    return draws


def driven(result: tuple[Planned, Corrected]) -> WaypointProgram:
    planned, made = result
    time = made.trajectory.time
    return WaypointProgram(
        job=planned.job,
        model=planned.model,
        path=planned.path,
        theta=made.solution.theta,
        time=time,
        rise=planned.rise,
        motion=planned.motion,
    )


@pytest.fixture(scope="module")
def line() -> tuple[Planned, Corrected]:
    return corrected()


def test_a_draw_of_one_value_is_the_arm_that_has_it() -> None:
    """An interval of cte without a width: every draw is the arm of another robot file, to what pinocchio leaves."""
    planned, made = corrected(*KNOWN, "robot.thermal.uncertainty.cte_um_m_K=[13, 13]")
    other = load_job(LINE, None, ["robot.thermal.cte_um_m_K=13"])
    prepared = prepare(twin_of(other), made.program, other.history.before, other.history.air)
    expected = deviation_from_path(planned.path, prepared.chunks(), prepared.sample_count).on_part["total"]
    draws = fly((planned, made), promise(59))
    np.testing.assert_allclose(draws.total, expected.max, rtol=0, atol=0.03 * UM)
    assert expected.max > 15 * UM


def test_the_same_seed_draws_the_same_and_more_draws_go_on(line: tuple[Planned, Corrected]) -> None:
    first, again, more = fly(line, promise()), fly(line, promise()), fly(line, promise(70))
    np.testing.assert_array_equal(first.total, again.total)
    np.testing.assert_array_equal(first.total, more.total[:59])
    assert len(set(first.total.tolist())) == 59
    assert np.abs(fly(line, promise(seed=1)).total - first.total).max() > 1 * UM


def test_draws_spread_as_the_linear_band_says(line: tuple[Planned, Corrected]) -> None:
    draws, program = fly(line, promise(400)), driven(line)
    rows = rows_of_band(program)
    columns = columns_along(program, job_uncertainty(program, line[1].start_window), rows)
    on_part = program.path.contact[rows]
    variance = directed_moment(columns)[on_part][:, [0, 3, 5]].sum(axis=1).mean()
    assert 0.9 < np.sqrt(np.mean(draws.moved**2) / variance) < 1.1
    assert 0.001 < draws.linearity < 0.07


def test_what_is_guaranteed_holds_for_other_draws(line: tuple[Planned, Corrected]) -> None:
    guaranteed = fly(line, promise()).bounds[0].guaranteed
    assert np.mean(fly(line, promise(400, seed=7)).total <= guaranteed) >= 0.95 - 2 * np.sqrt(0.05 * 0.95 / 400)


def test_slopes_and_flights_agree_draw_by_draw_on_an_arm_with_every_kind_of_source() -> None:
    draws = fly(corrected(*FLAWED), promise())
    assert draws.linearity < flown.AGREEMENT
    assert [f.code for f in draws.findings()] == []


def without_heat(job: Job, *rest: object) -> Job:
    """A twin that forgets how the warmth differs."""
    changed = changed_job(job, *rest)  # type: ignore[arg-type]
    return replace(changed, cell=replace(changed.cell, heat_change=None))


def without_sources(job: Job, *rest: object) -> Job:
    """A twin that forgets how the sources differ."""
    changed = changed_job(job, *rest)  # type: ignore[arg-type]
    return replace(changed, cell=replace(changed.cell, sources=job.sources))


OF_WARMTH = ("law of link1", "law of j3", "law of wrist", "thermocouples", "air", "feed")
OF_EXPANSION = ("cte", "profile of a2", "profile of d4", "profile of d6")


@pytest.mark.parametrize(("forgetful", "among"), [(without_heat, OF_WARMTH), (without_sources, OF_EXPANSION)])
def test_quantities_that_the_twin_ignores_are_found(
    line: tuple[Planned, Corrected], monkeypatch: pytest.MonkeyPatch, forgetful: object, among: tuple[str, ...]
) -> None:
    monkeypatch.setattr(flown, "changed_job", forgetful)
    draws = fly(line, promise())
    assert draws.linearity > 2 * flown.AGREEMENT
    (finding,) = draws.findings()
    assert finding.code == "band.linear"
    assert draws.disagrees_in in among
    assert f"most in '{draws.disagrees_in}'" in finding.message
    assert len(finding.message) <= 300


def test_what_no_quantity_explains_moves_the_tool_too() -> None:
    planned, made = corrected(*KNOWN, "robot.thermal.uncertainty.missing_percent=20")
    draws = fly((planned, made), promise(100))
    thermal = planned.deviation().on_part["total"].max
    assert draws.moved.max() < 0.01 * UM  # the quantities leave nothing open
    # a field of 20 % of the thermal error in three directions: its largest along the line
    assert 0.2 * thermal < np.median(draws.total) < 0.7 * thermal


def test_a_broken_promise_is_outside_and_a_kept_one_inside(line: tuple[Planned, Corrected]) -> None:
    guaranteed = fly(line, promise()).bounds[0].guaranteed / UM
    for bound, verdict in ((guaranteed * 1.01, Verdict.INSIDE), (guaranteed * 0.99, Verdict.OUTSIDE)):
        _, made = corrected(f"bounds.guaranteed.max_um={bound}")
        assert made.draws is not None
        assert made.verdict is verdict
        assert ("bounds.guaranteed.max_um" in {f.code for f in made.findings}) == (verdict is Verdict.OUTSIDE)


def test_one_file_for_many_starts_is_flown_at_some_of_them(line: tuple[Planned, Corrected]) -> None:
    delays = "compensation.average_over.delay_s=[0, 3600]"
    _, made = corrected(delays, "bounds.guaranteed.max_um=1000", *KNOWN, "robot.thermal.uncertainty.air_K=0.001")
    assert made.draws is not None
    assert made.draws.linearity < flown.AGREEMENT or made.draws.moved.max() < 0.1 * UM
    assert np.ptp(made.draws.total) > 1 * UM  # by the delays alone
    assert made.draws.total.max() <= made.deviation.on_part["total"].max + 0.2 * UM


@pytest.mark.parametrize("silent", ["", '[thermal.uncertainty]\nprovenance = "none"\n\n'])
def test_a_robot_that_does_not_say_how_well_it_is_known_promises_nothing(tmp_path: Path, silent: str) -> None:
    text = (ROOT / "robots" / "m710ic50.toml").read_text()
    begin, end = text.index("[thermal.uncertainty]"), text.index("# Second thermal model")
    robot = tmp_path / "silent.toml"
    robot.write_text(text[:begin] + silent + text[end:])
    with pytest.raises(
        InputError, match=r"bounds\.guaranteed: .*silent\.toml does not say .* \[thermal\.uncertainty\]"
    ):
        load_job(LINE, str(robot), ["bounds.guaranteed.max_um=60"])
    assert load_job(LINE, str(robot)).bounds.guaranteed is None
    with pytest.raises(InputError, match="does not say how well"):
        load_job(LINE, None, ["bounds.guaranteed.max_um=60", *KNOWN])


def test_a_late_start_within_its_window_is_drawn() -> None:
    made = corrected(KNOWN[0], "compensation.start_drift_um=20")
    moved = np.sort(fly(made, promise()).moved)
    assert moved[0] < 3 * UM  # at once
    assert 8 * UM < moved[-1] < 20 * UM  # at the window's end, where it is 20 um at the worst place


def test_memory_does_not_grow_with_the_draws(line: tuple[Planned, Corrected]) -> None:
    def peak(draws: int) -> int:
        tracemalloc.start()
        fly(line, promise(draws))
        used = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return used

    fly(line, promise())
    kept = (peak(300) - peak(60)) / 240
    assert kept < 0.1 * line[1].deviation.error.nbytes  # its numbers, and nothing as long as the path
    assert kept < 4096


def test_joints_keep_sigmas_of_the_band_from_their_limits_where_asked() -> None:
    planned, free = corrected()
    joint, robot = 1, planned.job.robot
    lowest = np.rad2deg(free.solution.theta[:, joint].min() - robot.pendant_zero[joint])
    limit = f"robot.limits.j2_deg=[{lowest - 2e-3:.6f}, 135]"
    _, touching = corrected(limit)
    assert touching.solution.status is Status.CONVERGED
    _, kept = corrected(limit, "compensation.margin_sigma=3")
    assert kept.solution.status is Status.LIMITED
    assert kept.solution.theta[:, joint].min() - touching.solution.theta[:, joint].min() > 2e-5
    assert kept.deviation.extents["total"].max > 5 * touching.deviation.extents["total"].max


def test_ramps_at_half_the_acceleration_take_the_program_longer(line: tuple[Planned, Corrected]) -> None:
    planned, made = line
    prepared = prepare(twin_of(planned.job), made.program, made.before, made.air)
    np.testing.assert_array_equal(prepared.with_ramps(1.0).timing.time, prepared.timing.time)
    slower = prepared.with_ramps(0.5)
    assert slower.timing.time[-1] > 1.05 * prepared.timing.time[-1]
    gaps = np.linalg.norm(np.diff(prepared.program.position, axis=0), axis=1)
    np.testing.assert_allclose(np.diff(slower.timing.time) * slower.timing.driven, gaps, rtol=1e-9, atol=1e-12)
