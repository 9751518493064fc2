"""What a robot is now, by touches against its forecast: days, moved things, mistakes, and the mathematics otherwise."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import refused, run
from numpy.testing import assert_allclose
from scipy.stats import multivariate_normal
from shipped import path_file
from simulated_days import AIR, IDENTIFIED, NOISE, SPHERES, anchored, drawn_day, outcome, share_of_shift
from states import state_of, written

from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Code
from compgen.core.pose import Pose
from compgen.core.units import DEG, HOUR, MDEG, MINUTE, MM, UM
from compgen.error_model.anchored_state import read_state
from compgen.identification.touches import read_artefact, read_touches
from compgen.job.anchored_start import base_rows
from compgen.pipelines.anchor.anchor import anchor, anchor_files
from compgen.pipelines.anchor.estimate import compare, estimate, path_places, widened
from compgen.pipelines.anchor.forecast import forecast_now
from compgen.pipelines.anchor.hypotheses import AS_FORECAST, BETTER, Hypothesis, Weighed, left_out, weigh
from compgen.pipelines.anchor.result import anchor_findings
from compgen.pipelines.anchor.touching import innovation_of, touched
from compgen.pipelines.anchor.unknowns import unknowns_of, with_open_world
from compgen.pipelines.anchor.verdict import anchor_verdict
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.robot_file import load_arm
from compgen.robot.inverse_kinematics import Posture, solve_tool
from compgen.robot.kinematics import flange_pose

WORLD = Pose(np.zeros(3), np.eye(3))
SPIRAL = path_file("spiral_1300")


@pytest.fixture(scope="module")
def days(tmp_path_factory):
    """Days by seed, each drawn once: an even one by its history, an odd one by a log."""
    drawn = {}

    def day(seed):
        if seed not in drawn:
            drawn[seed] = drawn_day(seed, tmp_path_factory.mktemp(f"day{seed}"))
        return drawn[seed]

    return day


def pieces(day):
    """What an anchoring is made of."""
    forecast, path = forecast_now(day.job, day.touches), path_places(day.job, 20)
    seen = touched(day.artefact, day.touches, WORLD, forecast)
    unknowns = unknowns_of(day.job, forecast, path.middle, path.radius, 10 * UM)
    return forecast, seen, unknowns, innovation_of(seen, forecast, unknowns)


@pytest.mark.parametrize("seed", [0, 1, 6])
def test_eight_touches_leave_no_more_than_their_noise_along_the_path(days, seed):
    result, left = outcome(days(seed))
    assert result.verdict in ("anchored", "leave it")
    assert left["after"][0] < 16 * UM
    assert left["after"][0] < left["before"][0] + NOISE


def test_a_break_that_nobody_told_of_is_found(days):
    result, left = outcome(days(0))
    assert left["before"][0] > 25 * UM  # the forecast is that far off
    assert result.verdict == "anchored"
    assert left["after"][0] < 0.5 * left["before"][0]


def test_touches_tell_a_growth_of_which_the_robot_file_says_nothing(tmp_path):
    """Its prior of 30 % stood in the band beside the state, which had measured it."""
    day = drawn_day(2, tmp_path, overrides=[])
    warmth = replace(day.job.cell.warmth, expansion=None, growth={})
    job = replace(day.job, cell=replace(day.job.cell, warmth=warmth))
    unknowns = unknowns_of(job, forecast_now(job, day.touches), np.zeros(3), 0.6, 10 * UM)
    assert unknowns.named == tuple(f"thermal_growth.excess_{n}" for n in ("a[2]", "d[4]", "d[6]"))
    assert_allclose(unknowns.prior.forecast[-3:, -3:], 0.09 * np.eye(3))


def test_a_state_holds_as_long_as_its_own_warmth_changes_little(days):
    """Of a warm arm whose day nobody told *holds for 4 hours* was said: so long the cold forecast would have."""
    day = days(2)
    standing = f'before=[{{state="idle",duration_h={day.touches.time.max() / HOUR}}}]'
    untold = load_job(day.job.source, overrides=[*day.job.overrides, standing])
    windows = [anchored(each).state.window for each in (day, replace(day, job=untold))]
    assert windows[0] < 3600
    assert 0.5 < windows[1] / windows[0] < 2


def test_a_base_that_moved_is_named_and_found(tmp_path):
    shift = np.array([120, -150, 60, 0, 0, 0]) * UM
    day = drawn_day(3, tmp_path, base=shift)
    result, left = outcome(day)
    assert result.verdict == "something moved"
    assert [m.what for m in result.moved if m.is_sure] == ["the base"]
    assert any("a probe that is not where [probe] says looks alike" in f.message for f in result.findings)
    assert share_of_shift(day, result) < 20 * UM
    assert left["after"][0] < 16 * UM < 180 * UM < left["before"][0]


def test_a_knocked_sphere_is_named_and_left_out(tmp_path):
    day = drawn_day(4, tmp_path, knocked=("c", np.array([300, 0, 400]) * UM))
    result, left = outcome(day)
    assert result.verdict == "something moved"
    assert [m.what for m in result.moved] == ["sphere c"]
    assert_allclose(result.moved[0].shift, np.array([300, 0, 400]) * UM, atol=45 * UM)
    assert left["after"][0] < 18 * UM
    assert set(result.left.touch.tolist()) == set(np.flatnonzero(day.touches.target != 2).tolist())
    assert not any(f.code == "anchor.physics" for f in result.findings)  # the sphere is the whole reason


def test_one_touch_that_went_wrong_is_named_and_left_out(days):
    day = days(2)
    theta = day.touches.theta.copy()
    theta[3, 0] += 3e-4  # half a millimetre
    result, left = outcome(day, anchored(day, theta=theta))
    assert result.verdict == "anchored"
    assert any(f.code == "anchor.touch" and "line 5" in f.message for f in result.findings)
    assert 3 not in result.left.touch.tolist()
    assert not any(f.code == "anchor.physics" for f in result.findings)
    other_day = replace(result, judged=(replace(result.judged[0], hypothesis=Hypothesis(day=4.0)), *result.judged))
    assert any(f.code == "anchor.physics" for f in anchor_findings(other_day))
    assert left["after"][0] < 16 * UM


def test_a_forecast_that_is_exact_is_left(days):
    _, _, unknowns, innovation = pieces(days(1))
    quiet = replace(innovation, y=NOISE * np.random.default_rng(0).standard_normal(len(innovation.y)))
    assert weigh(quiet, unknowns.prior)[0].hypothesis == BETTER


def test_touches_from_one_side_anchor_as_well(tmp_path):
    result, left = outcome(drawn_day(0, tmp_path, count=16, sided=True))
    assert len(result.innovation.y) == 16
    assert result.verdict == "anchored"
    assert left["after"][0] < 20 * UM < left["before"][0]


def test_the_slopes_are_those_of_the_innovation(days, tmp_path):
    day = days(0)
    text = day.files["artefact"].read_text() + (
        '[[plane]]\nname = "table"\nx_mm = 1250\ny_mm = 0\nz_mm = 100\nnormal = [0, 0.6, 0.8]\nsigma_um = 5\n'
    )
    (tmp_path / "artefact.toml").write_text(text)
    lines = day.files["touches"].read_text().splitlines()
    rows = [lines[0] + ",nx,ny,nz"] + [f"{line},,," for line in lines[1:5]]
    rows += [f"{line},0.6,0,-0.8" for line in lines[5:9]]
    pose = lines[1].split(",")
    rows.append(",".join([pose[0], "table", *pose[2:], "0", "-0.6", "-0.8"]))
    (tmp_path / "touches.csv").write_text("\n".join(rows) + "\n")
    artefact = read_artefact(str(tmp_path / "artefact.toml"))
    touches = read_touches(str(tmp_path / "touches.csv"), day.job.robot, artefact, {}, planes=True)
    # a sphere that is touched from one side: its place is so that the probe's ball just meets it
    place, reach = artefact.place.copy(), 18 * MM
    now = forecast_now(day.job, touches)
    nominal = touched(replace(artefact, diameter=np.full(4, 30 * MM)), _centres(touches), WORLD, now)
    for n in range(4, 8):
        place[touches.target[n]] = nominal.actual[n] + reach * touches.normal[n]
    artefact = replace(artefact, place=place)
    touches = _rows(touches, [4, 5, 6, 7, 8, 8])
    forecast = _at(now, 6)
    path = path_places(day.job, 20)
    seen = touched(artefact, touches, WORLD, forecast)
    assert len(seen.y) == 6
    unknowns = unknowns_of(day.job, forecast, path.middle, path.radius, 10 * UM)
    innovation = innovation_of(seen, forecast, unknowns)
    K, X = len(forecast.rise), innovation.H.shape[1]
    x = np.random.default_rng(5).standard_normal((X,))
    x *= np.concatenate([np.full(K, 0.2), np.full(3, 20 * UM), np.full(3, 1 * MDEG), np.full(X - K - 6, 0.003)])
    change = np.zeros(len(unknowns.parameters.entries))
    change[list(unknowns.rows)] = x[K:]
    moved = replace(
        forecast,
        cell=replace(forecast.cell, sources=unknowns.parameters.moved(change)),
        touch_rise=forecast.touch_rise + x[:K],
    )
    after = touched(artefact, touches, WORLD, moved)
    # what the tangents of a sphere miss: less than a thousandth of the shift
    assert_allclose(seen.y - after.y, innovation.H @ x, atol=0.3 * UM)
    assert np.abs(innovation.H @ x).max() > 20 * UM
    assert unknowns.rows[:6] == tuple(base_rows(unknowns.parameters))


def _centres(touches):
    return replace(touches, normal=np.full_like(touches.normal, np.nan))


def _rows(touches, rows):
    return replace(
        touches, label=tuple(touches.label[n] for n in rows), time=touches.time[rows], target=touches.target[rows],
        theta=touches.theta[rows], normal=touches.normal[rows], deflection=touches.deflection[rows],
        sigma=touches.sigma[rows],
    )  # fmt: skip


def _at(forecast, count):
    return replace(forecast, touch_rise=forecast.touch_rise[-count:])


def test_the_evidence_is_that_of_a_normal_distribution(days):
    _, _, unknowns, innovation = pieces(days(0))
    judged = weigh(innovation, unknowns.prior)
    values = {j.hypothesis: j for j in judged}
    for h in (AS_FORECAST, Hypothesis(day=4.0, base="turned"), Hypothesis(target=1, noise=2.0)):
        V = innovation.covariance(unknowns.prior, h)
        expected = multivariate_normal(np.zeros(len(V)), V).logpdf(innovation.y) + len(V) / 2 * np.log(2 * np.pi)
        assert_allclose(values[h].evidence, expected + h.odds, rtol=1e-9)


def test_a_touch_left_out_is_predicted_by_the_others(days):
    _, _, unknowns, innovation = pieces(days(0))
    V = innovation.covariance(unknowns.prior, AS_FORECAST)
    left = left_out(innovation, V)
    a, b = np.flatnonzero(innovation.touch == 3), np.flatnonzero(innovation.touch != 3)
    predicted = V[np.ix_(a, b)] @ np.linalg.solve(V[np.ix_(b, b)], innovation.y[b])
    assert_allclose(left.error[3], np.sqrt(np.mean((innovation.y[a] - predicted) ** 2)), rtol=1e-9)


def test_a_state_leaves_along_the_path_what_it_says(days):
    """Draws of all that is unknown, touched and anchored each: the rms that is left is the rms that is told."""
    day = days(0)
    beside = compare(day.job, day.artefact, day.touches, WORLD, path_places(day.job, 20))
    columns, innovation, prior, R = beside.columns, beside.innovation, beside.prior, len(beside.innovation.y)
    columns = replace(columns, missed=0 * columns.missed, field=0 * columns.field)
    innovation = replace(innovation, field=np.zeros((R, R)))
    estimated = estimate(replace(beside, innovation=innovation, columns=columns), AS_FORECAST)
    rng, draws, left = np.random.default_rng(0), 3000, []
    root = np.linalg.cholesky(prior.forecast + 1e-18 * np.eye(len(prior.forecast)))
    for _ in range(draws):
        x, q = root @ rng.standard_normal(len(root)), rng.standard_normal(innovation.N.shape[1])
        u = innovation.place[:, None] * rng.standard_normal((len(innovation.place), 3))
        y = innovation.H @ x + innovation.N @ q + (innovation.along * u[innovation.target]).sum(axis=1)
        y += innovation.sigma * rng.standard_normal(R)
        real = columns.G @ x + columns.N @ q
        left.append(real - (columns.G @ (estimated.gain @ y)))
    rms = np.sqrt(np.mean(np.sum(np.square(left), axis=2), axis=0))
    assert_allclose(rms, estimated.after, rtol=0.06)


@pytest.mark.parametrize(
    ("mistake", "words"),
    [
        (lambda t: replace(t, target=np.array([1, 0, 2, 3])[t.target]), "'b' and 'a' are swapped"),
        (lambda t: replace(t, time=t.time + 3 * HOUR), "of another hour"),
        (lambda t: replace(t, time=t.time - 3 * HOUR), "of another hour"),
        (lambda t: _rows(t, [0]), "a state needs 6 at least"),
        (lambda t: replace(t, time=t.time * np.linspace(0, 1, len(t.time))), "a state is one moment"),
    ],
)  # fmt: skip
def test_mistakes_are_refused(days, mistake, words):
    day = days(0)
    with pytest.raises(InputError, match=words):
        anchored(replace(day, touches=mistake(day.touches)))


def test_directions_where_centres_were_located_and_none_where_they_were_not_are_named(days, tmp_path):
    """*touched 0 mm from where the sphere is; mend place, probe or joints* was said: ball and probe are 18 mm apart."""
    located, sided = days(0), drawn_day(0, tmp_path, sided=True)
    down = replace(located.touches, normal=np.tile([0.0, 0.0, -1.0], (8, 1)))
    with pytest.raises(InputError, match="one with a direction stands 18 mm off, by both diameters: remove nx, ny, nz"):
        anchored(replace(located, touches=down))
    with pytest.raises(InputError, match=r"touched 18 mm from where sphere '.' is; as one from one side does: give"):
        anchored(replace(sided, touches=_centres(sided.touches)))


@pytest.mark.parametrize("probe_too", [False, True])
@pytest.mark.parametrize(("unit", "factor"), [("metres", 1e-3), ("inches", 1 / 25.4)])
def test_places_in_another_unit_are_named_the_probe_in_it_too_or_not(days, unit, factor, probe_too):
    day = days(0)
    probe = day.artefact.probe * (factor if probe_too else 1)
    typed = replace(day.artefact, place=factor * day.artefact.place, probe=probe)
    with pytest.raises(InputError, match=f"x_mm, y_mm, z_mm are {unit}, as the touches say"):
        anchored(replace(day, artefact=typed))


def test_joints_in_radians_are_named(days):
    day = days(0)
    robot = day.job.robot
    typed = robot.to_theta(np.radians(robot.to_pendant(day.touches.theta)))
    with pytest.raises(InputError, match="joints are in radians, not degrees"):
        anchored(day, theta=typed)


def test_touches_of_another_hour_than_the_log_are_refused(days):
    day = days(1)
    with pytest.raises(InputError, match="of another hour; give the log of the same clock"):
        anchored(replace(day, touches=replace(day.touches, time=day.touches.time + HOUR)))


def test_a_touch_after_the_log_s_end_is_of_an_arm_that_stood(days):
    """By the law: A + (r - A) exp(-t / tau), A = idle fraction of what the reference comes to in the end."""
    day = days(1)
    log, heat, touches = day.job.log, day.job.cell.heat, day.touches
    end, count = float(log.time[-1]), len(touches.target)
    at_end = forecast_now(day.job, replace(touches, time=np.full(count, end)))
    later = forecast_now(day.job, replace(touches, time=np.append(np.full(count - 1, end), end + 9 * MINUTE)))
    idle = heat.idle * heat.reference_rise / -np.expm1(-heat.reference_time / heat.tau) + at_end.air
    stood = idle + (at_end.rise - idle) * np.exp(-9 * MINUTE / heat.tau)
    assert np.abs(stood - at_end.rise).max() > 0.02
    assert_allclose(later.touch_rise[-1], stood, atol=1e-9)
    assert_allclose(later.rise, stood, atol=1e-9)
    assert_allclose(later.touch_rise[0], at_end.rise, atol=1e-9)


def test_what_a_log_left_open_is_open_after_what_follows_it(days):
    """Six minutes of standing behind a log, as [[before]]: the rises are known little better than at its end."""
    day = days(1)
    later = load_job(day.job.source, overrides=[*day.job.overrides, 'before=[{state="idle",duration_h=0.1}]'])
    spreads = []
    for job in (day.job, later):
        forecast = forecast_now(job, replace(day.touches, timed=False))
        spreads.append(np.sqrt(np.diag(unknowns_of(job, forecast, np.zeros(3), 0.6, 10 * UM).prior.forecast)[:5]))
    assert (spreads[1] > 0.8 * spreads[0]).all()


def test_air_that_the_path_file_says_is_the_state_s_where_the_log_has_none(days, tmp_path):
    day = days(1)
    file = tmp_path / "log.csv"
    rows = [row.split(",") for row in day.files["log"].read_text().splitlines()]
    file.write_text("".join(",".join([time, *rest]) + "\n" for time, _, *rest in rows))
    given = [*day.job.overrides, f"log.file='{file}'", "ambient.value_degC=26"]
    assert anchored(replace(day, job=load_job(day.job.source, overrides=given))).state.air == pytest.approx(6.0)


def test_a_log_beside_a_state_is_refused(days, tmp_path):
    """The state was taken and the log passed over, with a note."""
    day = days(1)
    state = written(state_of(day.job), tmp_path)
    files = ("--touches", day.files["touches"], "--artefact", day.files["artefact"], "--log", day.files["log"])
    overrides = [word for item in IDENTIFIED for word in ("--set", item)]
    refused(run("anchor", SPIRAL, *files, *overrides, "--set", f"state.file={state!r}"), 2, "[state]", "leave")


def test_an_arm_that_nobody_identified_is_sent_to_identification(days):
    day = days(0)
    before = [o for o in day.job.overrides if o.startswith("before")]
    with pytest.raises(InputError, match="never identified; cgen identify first"):
        anchor_files(SPIRAL, None, before, str(day.files["touches"]), str(day.files["artefact"]))


def test_places_that_the_robot_taught_carry_its_cold_errors(tmp_path):
    day = drawn_day(2, tmp_path, geometry=3.0, taught=True)
    result, left = outcome(day)
    assert result.verdict in ("anchored", "leave it")
    assert left["after"][0] < 18 * UM
    undeclared = replace(day, artefact=replace(day.artefact, taught=None))
    with pytest.raises(InputError, match=r"artefact\.taught: missing"):
        anchored(undeclared)


def test_what_taught_places_share_with_the_path_is_open_on_neither(tmp_path):
    """J1's zero turns World, path and taught spheres alike: known to 4 mdeg or to 0.3, the state is the same."""
    results = []
    for sigma in (0.3, 4):
        of_zeros = f"robot.sources.joint_zeros.sigma.offset_mdeg=[{sigma}, 0.3, 0.3, 0, 0.5, 0]"
        day = drawn_day(0, tmp_path, taught=True, overrides=(*IDENTIFIED, of_zeros))
        results.append(anchored(day))
        _, left = outcome(day, results[-1])
        assert results[-1].verdict == "anchored"
        assert left["after"][0] < min(0.75 * left["before"][0], 1.5 * results[-1].rms[1])
    assert_allclose(results[1].rms, results[0].rms, rtol=0.01)
    certified = drawn_day(0, tmp_path, overrides=(*IDENTIFIED, of_zeros))
    assert anchored(certified).rms[0] > 90 * UM  # 4 mdeg at 1.35 m


DOWN = np.array([0, 0, -1])


def turned(day, seen, way):
    """By how much 10 mm before each touch turn the joints, by the inverse, (N, 6) [rad]."""
    pose = flange_pose(day.job.robot, seen.touches.theta) @ seen.probe
    before = Pose(pose.position - 10 * MM * way, pose.rotation)
    return seen.touches.theta - solve_tool(day.job.robot, before, seen.probe, day.job.posture)[0]


def test_play_of_no_known_sense_is_open_in_each_touch_and_in_all(days, tmp_path):
    """Half of its variance is alike in all touches; of places that the robot taught so, none is open."""
    mdeg = np.array([2, 1, 1, 2, 1, 0])
    play = f"robot.sources.hysteresis={{backlash_mdeg={mdeg.tolist()},width_mdeg=[200,200,200,200,200,200]}}"
    day = drawn_day(0, tmp_path, overrides=(*IDENTIFIED, play))
    parts, still = pieces(day), pieces(days(0))
    theta, touch, robot = parts[1].touches.theta, parts[3].touch, parts[0].cell.robot
    moved = [
        (flange_pose(robot, theta + s * mdeg[j] * MDEG * np.eye(6)[j]) @ parts[1].probe).position
        for j in range(6) for s in (1, -1)
    ]  # fmt: skip
    D = np.stack([(a - b) / 2 for a, b in zip(moved[::2], moved[1::2], strict=True)], axis=2)  # of the nominal arm
    D = np.where(np.abs(turned(day, parts[1], DOWN))[:, None] > np.radians(0.172), 0.0, D)
    d = np.einsum("ri,rij->rj", parts[3].along, D[touch])
    expected = d @ d.T * np.where(touch[:, None] == touch, 1.0, 0.5)
    assert_allclose(parts[3].field - still[3].field, expected, atol=0.02 * expected.max())
    assert np.sqrt(expected.max()) > 30 * UM
    taught = pieces(drawn_day(0, tmp_path, taught=True, overrides=(*IDENTIFIED, play)))
    assert_allclose(taught[3].field, pieces(drawn_day(0, tmp_path, taught=True))[3].field, atol=1e-13)


def test_a_joint_that_stands_at_all_touches_is_named_where_the_robot_taught_and_the_arm_plays(tmp_path):
    """J4 of a probe that points down: its play is as the way before has left it, and was otherwise when it taught."""
    play = "robot.sources.hysteresis={backlash_mdeg=[2,1,1,2,1,0],width_mdeg=[200,200,200,200,200,200]}"
    said = []
    for taught, own in ((True, IDENTIFIED), (True, (*IDENTIFIED, play)), (False, (*IDENTIFIED, play))):
        day = drawn_day(0, tmp_path, taught=taught, overrides=own)
        still = [f"J{k + 1}" for k in range(6) if np.ptp(day.touches.theta[:, k]) < np.radians(1)]
        said.append([f.message for f in anchored(day).findings if f.code == Code.ANCHOR_PLAY])
    assert said[0] == said[2] == []
    assert [m.partition(" did not turn")[0] for m in said[1]] == [", ".join(still)] == ["J4"]


def test_what_identification_was_too_sure_of_is_open_by_its_scale(days):
    day = days(0)
    surer = replace(day.job.cell, fit=replace(day.job.cell.fit, scale=1.7))
    once, more = pieces(day), pieces(replace(day, job=replace(day.job, cell=surer)))
    assert_allclose(more[3].N, 1.7 * once[3].N, rtol=1e-12)
    assert np.abs(once[3].N).max() > 5 * UM


@pytest.mark.parametrize("sided", [True, False])
def test_a_search_says_the_sense_of_joints_that_it_turns_through_their_play(tmp_path, sided):
    """A joint that turned by less than 0.17 deg has no known sense; to a centre the probe comes down its stem."""
    play = "robot.sources.hysteresis={backlash_mdeg=[2,1,1,2,1,0],width_mdeg=[200,200,200,200,200,200]}"
    day = drawn_day(0, tmp_path, sided=sided, overrides=(*IDENTIFIED, play))
    _, seen, _, _ = pieces(day)
    turn = turned(day, seen, seen.touches.normal if sided else DOWN)
    sure = np.abs(np.abs(turn) - np.radians(0.172)) > np.radians(0.03)  # what the way's bend may change
    expected = np.where(np.abs(turn) > np.radians(0.172), np.sign(turn), 0.0)
    assert_allclose(seen.motion.direction[sure], expected[sure])
    assert (expected[sure] == 0).any()
    assert (expected[sure] != 0).any()


def test_an_identified_world_is_as_open_again_where_an_instrument_placed_the_targets(days):
    """A turn of World that N has with 3 mdeg is open by 3 mdeg more in the base: about J1, not about the part."""
    _, _, unknowns, _ = pieces(days(0))
    place = path_places(days(0).job, 20).position
    turn = 3 * MDEG * np.cross([0, 0, 1], place)[:, :, None]
    P, base = unknowns.prior.forecast, slice(len(unknowns.prior.forecast) - len(unknowns.rows), None)
    more = (with_open_world(unknowns, turn, place).prior.forecast - P)[base, base]
    expected = np.zeros_like(more)
    expected[5, 5] = (3 * MDEG) ** 2
    assert_allclose(more, expected, atol=1e-6 * expected.max())


def test_what_touches_off_by_more_than_is_open_leave_open_grows_with_them(days):
    """chi^2 of four times as many coordinates: all standard deviations count twice; of fewer none counts less."""
    day = days(0)
    beside = compare(day.job, day.artefact, day.touches, WORLD, path_places(day.job, 20))
    chosen = estimate(beside, AS_FORECAST)
    root, R = np.linalg.cholesky(chosen.V), len(chosen.V)
    y = root @ np.full(R, 2.0)
    assert_allclose(widened(chosen, y).after, 2 * chosen.after)
    assert_allclose(widened(chosen, y).covariance, 4 * chosen.covariance)
    assert_allclose(widened(chosen, y / 4).after, chosen.after)


@pytest.mark.parametrize(("change", "verdict"), [(20 * UM, "leave it"), (60 * UM, "anchored")])
def test_a_forecast_is_left_only_where_the_touches_agree_with_it(change, verdict):
    """Open by 50 um before and 49 after: touches that move the path by more than that are not left unsaid."""
    best, error = Weighed(AS_FORECAST, 0.0, 24.0), np.full(8, 10 * UM)
    judged, reason = anchor_verdict(best, 24, (50 * UM, 49 * UM, change), error, (), None, NOISE)
    assert judged == verdict
    assert ("with the touches to 49" in reason) is (verdict == "anchored")  # elsewhere a line of the screen's own


def test_a_state_that_is_left_is_as_open_as_touches_lie_farther_off_than_it_allows(days):
    """Touches too coarse to tell, and off by more than they say: the forecast's covariance counts chi^2 / R times."""
    day, rng, open_by = days(1), np.random.default_rng(3), []
    for size in (2e-4, 1.5e-4):  # rad, of each joint
        theta = day.touches.theta + rng.normal(0, size, day.touches.theta.shape)
        result = anchored(
            replace(day, touches=replace(day.touches, theta=theta, sigma=0 * day.touches.sigma + 200 * UM))
        )
        assert result.verdict == "leave it"
        open_by.append((result.as_forecast.chi2 / len(result.innovation.y), result.state.covariance))
    (far, wide), (near, narrow) = open_by
    assert far > 1.5 * near > 1.5
    assert_allclose(wide, far / near * narrow, rtol=1e-6, atol=1e-9 * np.abs(wide).max())


def test_what_a_robot_file_marks_as_drifting_is_found(tmp_path):
    drifting = 'robot.anchor={drifting={"joint_zeros.offset_mdeg[1]"=5}}'
    drifted = drawn_day(0, tmp_path, overrides=(*IDENTIFIED, drifting))
    turned = drawn_day(0, tmp_path, overrides=IDENTIFIED)
    wanted = 4 * MDEG
    touches = replace(turned.touches, theta=turned.touches.theta - wanted * np.eye(6)[0])  # commanded less: it is there
    result = anchored(replace(drifted, touches=touches))
    name = "joint_zeros.offset_mdeg[1]"
    drift_value = dict(zip(result.state.drifting, result.state.drift.tolist(), strict=True))[name]
    assert_allclose(drift_value, 4.0, atol=1.5)
    with pytest.raises(InputError, match=r"anchor\.drifting: 'joint_zeros.offset_mdeg\[9\]' is no number"):
        anchored(drawn_day(0, tmp_path, overrides=(*IDENTIFIED, drifting.replace("[1]", "[9]"))))


def test_touches_that_tell_nothing_leave_an_earlier_state_as_it_is(tmp_path):
    """What grows and what drifts was lost, or known exactly: a noon's state had forgotten the morning's touches."""
    overrides = (*IDENTIFIED, 'robot.anchor={drifting={"joint_zeros.offset_mdeg[1]"=5}}')
    day = drawn_day(0, tmp_path, overrides=overrides)
    names = (*(f"thermal_growth.excess_{n}" for n in ("a[2]", "d[4]", "d[6]")), "joint_zeros.offset_mdeg[1]")
    size = np.array([*[0.5] * 5, *[12 * UM] * 3, *[0.5 * MDEG] * 3, 0.1, 0.12, 0.09, 2.0])
    root = np.eye(len(size)) + 0.4 * np.random.default_rng(2).standard_normal((len(size), len(size)))
    earlier = state_of(
        day.job, base=np.array([20, -30, 10, 0, 0, 0]) * UM, drifting=names, drift=np.array([-0.07, 0.03, 0.05, 1.5]),
        covariance=np.outer(size, size) * (root @ root.T),
    )  # fmt: skip
    begun = load_job(SPIRAL, overrides=[*overrides, f"state.file='{written(earlier, tmp_path)}'"])
    vague = replace(day.touches, timed=False, sigma=np.full(len(day.touches.target), 1.0))
    later = anchor(begun, day.artefact, vague, WORLD).state
    assert later.drifting == names
    assert_allclose(later.drift, earlier.drift, rtol=1e-6)
    assert_allclose(later.base, earlier.base, atol=0.001 * UM)
    assert_allclose(later.rise, earlier.rise, rtol=1e-6)
    assert_allclose(later.covariance / np.outer(size, size), root @ root.T, atol=1e-5)


def test_the_command_writes_state_page_and_record(days, tmp_path):
    day = days(1)
    sets = [part for o in IDENTIFIED for part in ("--set", o)]
    files = ["--touches", day.files["touches"], "--artefact", day.files["artefact"], "--log", day.files["log"]]
    target = tmp_path / "state.toml"
    result = run("anchor", SPIRAL, *files, *sets, "-o", target, "--html", tmp_path / "page")
    assert result.returncode == 0, result.stderr
    first = target.read_bytes()
    assert read_state(str(target)).verdict in ("anchored", "leave it")
    assert read_state(str(target)).reference == 20.0
    assert result.stdout.count("um rms, with the touches to ") == 1
    record = json.loads((tmp_path / "page" / "anchor.json").read_text())
    assert len(record["touches"]) == 8
    assert (tmp_path / "page" / "anchor.html").read_bytes().startswith(b"<!doctype html>")
    again = run("anchor", SPIRAL, *files, *sets, "-o", target, "-q", "--json")
    assert again.returncode == 0
    assert target.read_bytes() == first
    found_with = "found with other values of the robot file"
    begun = run("predict", SPIRAL, *sets, "--state", target, "-o", tmp_path / "out")
    assert begun.returncode == 0, begun.stderr
    assert found_with not in begun.stdout + begun.stderr
    begun = run("predict", SPIRAL, *sets[2:], "--state", target, "-o", tmp_path / "other")
    assert found_with in begun.stdout + begun.stderr
    other = Path(tmp_path / "other.toml")
    other.write_text("x = 1\n")
    refused(run("anchor", SPIRAL, *files, *sets, "-o", other), 2, "not what cgen anchor wrote")
    refused(run("anchor", SPIRAL, "-o", target), 2, "--touches: missing")


def test_the_command_ends_with_one_where_something_moved(tmp_path):
    day = drawn_day(3, tmp_path, base=np.array([0, 200, 0, 0, 0, 0]) * UM)
    sets = [part for o in IDENTIFIED for part in ("--set", o)]
    files = ["--touches", day.files["touches"], "--artefact", day.files["artefact"], "--log", day.files["log"]]
    result = run("anchor", SPIRAL, *files, *sets, "-o", tmp_path / "state.toml")
    assert "was known to" not in result.stdout  # a base that may be anywhere leaves a path open by millimetres
    assert re.search(r"with the touches the path is known to \d\d um rms", result.stdout)
    refused(result, 1, "something moved: 0.2", "the base", "written")
    assert read_state(str(tmp_path / "state.toml")).verdict == "something moved"
    assert AIR == 20.0
    assert set(SPHERES) == set(day.artefact.names)


def test_touches_that_nothing_explains_write_no_state(days, tmp_path):
    day = days(1)
    rng = np.random.default_rng(3)
    head, *rows = day.files["touches"].read_text().splitlines()
    cells = [row.split(",") for row in rows]
    for row in cells:
        row[2:8] = [f"{float(v) + 0.02 * rng.standard_normal():.6f}" for v in row[2:8]]  # some 0.3 mm
    touches = tmp_path / "touches.csv"
    touches.write_text("\n".join([head, *(",".join(row) for row in cells)]) + "\n")
    sets = [part for o in IDENTIFIED for part in ("--set", o)]
    files = ["--touches", touches, "--artefact", day.files["artefact"], "--log", day.files["log"]]
    result = run("anchor", SPIRAL, *files, *sets, "-o", tmp_path / "state.toml", "-q")
    refused(
        result,
        1,
        "cannot tell: no state explains the touches: the best leaves them",
        "times too far off; touch",
        "not written",
    )
    assert not (tmp_path / "state.toml").exists()


def test_warmth_that_a_robot_file_does_not_know_is_no_noise(tmp_path):
    """An arm that has grown by 0.01 % all round its base was *anchored*, and its path said to be known to 19 um."""
    robot, names = load_arm("m20ia").robot, "abcdef"
    about = np.array([-120, -70, -25, 25, 70, 120]) * DEG
    out = np.column_stack([np.cos(about), np.sin(about), np.zeros(6)])
    away = np.array([1.0, 1.3, 0.95, 1.2, 1.1, 1.05])[:, None]
    down = np.repeat(np.diag([1.0, -1.0, -1.0])[None], 6, axis=0)
    seen = Pose(away * out + np.linspace(0.0, 0.25, 6)[:, None] * [0, 0, 1], down)
    theta, margin = solve_tool(robot, seen, Pose(np.array([0, 0, 0.2]), np.eye(3)), Posture())
    assert (margin > 0).all()
    joints = np.round(robot.to_pendant(theta) / DEG, 5)
    places = (seen.position + 1e-4 * away * out) / MM
    head = ",".join(["target", *(f"j{k}_deg" for k in range(1, 7))])
    rows = [",".join([name, *map(str, row)]) for name, row in zip(names, joints.tolist(), strict=True)]
    (tmp_path / "touches.csv").write_text("\n".join([head, *rows]) + "\n")
    spheres = [
        f'[[sphere]]\nname = "{name}"\nx_mm = {x:.4f}\ny_mm = {y:.4f}\nz_mm = {z:.4f}\n'
        for name, (x, y, z) in zip(names, places.tolist(), strict=True)
    ]
    probe = "[probe]\nx_mm = 0\ny_mm = 0\nz_mm = 200\ndiameter_mm = 6\n"
    (tmp_path / "artefact.toml").write_text("".join(["[artefact]\ntaught = {}\n", *spheres, probe]))
    place = ["path.diameter_mm=500", "path.x_mm=1100", "path.y_mm=0", "path.z_mm=100", "before=[]"]
    touches = str(tmp_path / "touches.csv")
    result = anchor_files(path_file("circle_1300"), "m20ia", place, touches=touches, artefact=None)
    assert result.verdict == "cannot tell"
    assert Code.ANCHOR_PHYSICS in {f.code for f in result.findings}


def test_one_touch_that_says_its_noise_says_nothing_of_the_others(days):
    """Of eight touches one was said to be known to 300 um: all were, and touches that are off were *left*."""
    day = days(0)
    sigma = np.where(np.arange(8) == 2, 300 * UM, np.nan)
    seen = touched(day.artefact, replace(day.touches, sigma=sigma), WORLD, forecast_now(day.job, day.touches))
    assert_allclose(seen.sigma, np.where(seen.touch == 2, 300, 15) * UM)


def test_a_deflected_probe_met_its_target_before(tmp_path):
    day = drawn_day(0, tmp_path, sided=True)
    forecast = forecast_now(day.job, day.touches)
    still = touched(day.artefact, day.touches, WORLD, forecast)
    deflected = replace(day.touches, deflection=np.full(8, 0.2 * MM))
    pushed = touched(day.artefact, deflected, WORLD, forecast)
    assert_allclose(pushed.actual - still.actual, -0.2 * MM * day.touches.normal, atol=1e-12)
    assert_allclose(pushed.y - still.y, 0.2 * MM, atol=2 * UM)  # its ball was that much farther from the sphere


def test_a_direction_out_of_the_target_is_refused(tmp_path):
    """With a deflection it would count twice, to the wrong side."""
    day = drawn_day(0, tmp_path, sided=True)
    anchored(day)
    with pytest.raises(InputError, match=r"line 2, columns nx, ny, nz: the direction points out .* at 8 of 8 touches"):
        anchored(replace(day, touches=replace(day.touches, normal=-day.touches.normal)))
