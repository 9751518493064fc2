"""The linear band: its columns against the whole chain with a changed job, its size by hand, and what has none."""

from dataclasses import replace

import numpy as np
import pytest
from flawed import KNOWN_WITH_SIGMAS
from numpy.testing import assert_allclose
from scipy.stats import chi2
from shipped import ROOT, path_file, quiet

from compgen.core.units import MDEG, UM
from compgen.error_model.direction_memory import direction_states, reversal_widths
from compgen.error_model.model import build_error_model
from compgen.error_model.posterior import KnownParameter, ParameterPosterior
from compgen.error_model.sources.thermal_growth import ThermalGrowth
from compgen.error_model.uncertain_sources import combined
from compgen.job.tables import FitLimits
from compgen.job.uncertainty import amounts, changed_job, quantities_of
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned.generate import predict
from compgen.pipelines.uncertainty import band_columns as band_module
from compgen.pipelines.uncertainty.band_columns import (
    WaypointProgram,
    assumed_findings,
    band_along,
    columns_along,
    job_uncertainty,
)
from compgen.pipelines.uncertainty.not_known import UNSEEN, not_known, setting_of
from compgen.thermal import rises_during
from compgen.thermal.duty import JointMotion
from compgen.verification.band import radius_of

WINDOW = 120.0  # s
COARSE = ["process.chord_um=20"]
#: a robot that knows a little of everything
FLAWED = [
    *KNOWN_WITH_SIGMAS,
    "robot.sources.thermal_bend.link=['column']",
    "robot.sources.thermal_bend.plane=['x']",
    "robot.sources.thermal_bend.node=['j2']",
    "robot.sources.thermal_bend.rate_arcsec_K=[0.2]",
    "robot.sources.thermal_bend.sigma.rate_arcsec_K=0.1",
    "tool.z_mm=50",
    "tool.sigma_um=[3, 4, 8]",
    "frame.x_mm=-90",
    "frame.taught.through='model'",
    "frame.taught.sigma_um=[5, 6, 7]",
    "frame.taught.sigma_mdeg=[1, 2, 3]",
]


def program_of(*overrides, path="spiral_1300"):
    job = load_job(path_file(path), None, [*COARSE, *overrides])
    planned = predict(job, quiet)
    return WaypointProgram(
        job=job,
        model=planned.model,
        path=planned.path,
        theta=planned.theta,
        time=planned.trajectory.time,
        rise=planned.rise,
        motion=planned.motion,
    )


def position_of(job, program):
    """Where the whole chain says that the tool is, (N, 3), with the job's own sources, heat, air and start."""
    model = build_error_model(job.robot, job.sources, len(job.heat.names), job.tool.pose)
    way = np.diff(program.path.arc) / np.diff(program.time)
    motion = JointMotion(program.time, program.theta, np.where(np.isfinite(way), way, job.feed))
    rise, _ = rises_during(job.heat, job.state(), motion, job.history.air, job.history.clock)
    directions = direction_states(reversal_widths(job.sources), program.theta, program.path.target.position)
    return model.actual_pose(program.theta, rise, directions).position


@pytest.fixture(scope="module")
def plain():
    return program_of()


@pytest.mark.parametrize("overrides", [(), FLAWED, ["robot.thermal.model=network"]], ids=["plain", "flawed", "network"])
def test_each_column_is_what_one_sigma_of_its_quantity_does_to_the_whole_chain(overrides):
    program = program_of(*overrides)
    job, rows = program.job, np.arange(len(program.time))
    uncertainty = job_uncertainty(program, WINDOW)
    columns = columns_along(program, uncertainty, rows)
    here = position_of(job, program)
    assert len({q.name for q in uncertainty.quantities}) == len(uncertainty.quantities)
    for k, quantity in enumerate(uncertainty.quantities):
        wide = "width" in quantity.name  # differenced over one sigma to both sides: a direction stays within its play
        ends = [combined([quantity], [sign * quantity.deviation]) for sign in ((1, -1) if wide else (1,))]
        there = [position_of(changed_job(job, uncertainty.parameters, cause), program) for cause in ends]
        moved = (there[0] - there[1]) / 2 if wide else there[0] - here
        expected = quantity.deviation * columns.column[:, :, k]
        size = max(np.abs(moved).max(), 0.1 * UM)
        slack = 0.15 if quantity.source in ("start delay", "feed") else 0.01  # linear in them only to first order
        assert np.abs(moved - expected).max() <= slack * size, quantity.name
        # the network has no feed of its own and nodes that nothing grows with; joints 4 to 6 have no play
        if "network" not in str(overrides) and not quantity.name.endswith(("width[4]", "width[5]", "width[6]")):
            assert np.abs(moved).max() > 1e-9, quantity.name


def test_the_band_of_one_expansion_is_its_share_of_the_thermal_error(plain):
    """By hand: cte off by 10 % is 10 % of the error that the warmth makes; 1.96 of such a sigma is 95 %."""
    job = plain.job
    warmth = replace(
        job.cell.warmth,
        law=0.0,
        sensors=0.0,
        air=0.0,
        feed=0.0,
        missing=0.0,
        growth={},
        expansion=(-0.1 * np.sqrt(3), 0.1 * np.sqrt(3)),
    )
    known = replace(plain, job=replace(job, cell=replace(job.cell, warmth=warmth)))
    band = band_along(known)
    error = np.linalg.norm(plain.model.error(plain.theta, plain.rise, plain.path.target, plain.motion)[:, :3], axis=1)
    assert_allclose(band.radius, 1.959964 * 0.1 * error, rtol=2e-3)
    assert [share.source for share in band.budget] == ["cte"]


@pytest.mark.parametrize("expansion", [(-0.1, 0.3), None], ids=["an interval", "priors"])
def test_a_warm_up_that_was_measured_counts_in_place_of_the_expansion_that_was_assumed(plain, expansion):
    """By hand: 3 % of the thermal error along any direction, and nothing of cte and profiles beside it."""
    job = plain.job
    warmth = replace(job.cell.warmth, law=0.0, sensors=0.0, air=0.0, feed=0.0, expansion=expansion)
    assumed = replace(plain, job=replace(job, cell=replace(job.cell, warmth=warmth)))
    measured = replace(plain, job=replace(job, cell=replace(job.cell, warmth=warmth, fit=FitLimits(missing=0.03))))
    band = band_along(measured)
    error = np.linalg.norm(plain.model.error(plain.theta, plain.rise, plain.path.target, plain.motion)[:, :3], axis=1)
    assert_allclose(band.radius, np.sqrt(chi2.ppf(0.95, 3)) * 0.03 * error, rtol=2e-3)
    assert [share.source for share in band.budget] == ["thermal physics missing"]
    assert len(band_along(assumed).budget) > 1


def test_nothing_unknown_is_no_band(plain):
    job = plain.job
    warmth = replace(
        job.cell.warmth, law=0.0, sensors=0.0, air=0.0, feed=0.0, missing=0.0, growth={}, expansion=(0.0, 0.0)
    )
    band = band_along(replace(plain, job=replace(job, cell=replace(job.cell, warmth=warmth))))
    assert band.largest == 0.0
    assert not band.half_widths(plain.path).any()


def test_fit_noise_and_repeatability_are_rows_of_the_band_by_hand_and_scaled(plain):
    """Alike along three coordinates, 7 and 11 um, with what blocks of measurements asked for: 1.2 times."""
    cell, none = plain.job.cell, {"law": 0.0, "sensors": 0.0, "air": 0.0, "feed": 0.0, "missing": 0.0, "growth": {}}
    warmth = replace(cell.warmth, expansion=(0.0, 0.0), **none)
    fit = FitLimits(noise=7 * UM, repeatability=11 * UM, scale=1.2)
    band = band_along(replace(plain, job=replace(plain.job, cell=replace(cell, warmth=warmth, fit=fit))))
    assert_allclose(band.world(), 2 * 1.2 * np.hypot(7, 11) * UM, rtol=1e-6)
    budget = {share.source: share.largest / (1.2 * np.sqrt(chi2.ppf(0.95, 3)) * UM) for share in band.budget}
    assert budget == pytest.approx({"repeatability": 11, "fit noise": 7}, rel=1e-5)


def test_what_a_taught_frame_parts_grows_with_what_blocks_asked_for_as_the_band_does():
    program = program_of("robot.sources.joint_zeros.sigma.offset_mdeg=[0, 5, 5, 0, 0, 0]")
    bands = []
    for scale in (1.0, 1.2):
        cell = replace(program.job.cell, fit=FitLimits(scale=scale))
        bands.append(band_along(replace(program, job=replace(program.job, cell=cell))))
    parted = np.array([(p[0], p[1].largest) for band in bands if (p := band.parted) is not None])
    assert parted.min() > 1 * UM
    assert_allclose(parted[1], 1.2 * parted[0], rtol=1e-9)
    assert_allclose(bands[1].largest, 1.2 * bands[0].largest, rtol=1e-9)


def test_the_second_moment_is_positive_and_alike_in_both_frames(plain):
    band = band_along(plain, WINDOW)
    xx, xy, xz, yy, yz, zz = band.moment.T
    matrices = np.stack([np.stack([xx, xy, xz]), np.stack([xy, yy, yz]), np.stack([xz, yz, zz])]).transpose(2, 0, 1)
    assert np.linalg.eigvalsh(matrices).min() >= -1e-12 * matrices.max()
    widths = band.half_widths(plain.path)
    assert_allclose(np.linalg.norm(widths[:, :3], axis=1), np.linalg.norm(widths[:, 3:], axis=1), rtol=1e-9)
    assert_allclose(widths[7:9], band.half_widths(plain.path, slice(7, 9)))
    ahead, axis = np.gradient(plain.path.target.position, axis=0), plain.path.target.rotation[:, :, 2]
    side = np.cross(ahead, axis)
    way = np.flatnonzero(np.linalg.norm(side, axis=1) > 0.5 * np.linalg.norm(ahead, axis=1))
    side = side[way] / np.linalg.norm(side[way], axis=1, keepdims=True)
    for k, d in ((3, np.cross(axis[way], side)), (4, side), (5, -axis[way])):
        by_hand = 2 * np.sqrt(np.einsum("ni,nij,nj->n", d, matrices[way], d))
        assert_allclose(widths[way, k], by_hand, rtol=1e-6)


def test_a_posterior_is_counted_with_its_correlations(plain):
    """Two zeros that are known only as a sum: alone each is off by 5 mdeg, together by 0.1."""
    job = program_of(
        "robot.sources.joint_zeros.sigma.offset_mdeg=[0, 5, 5, 0, 0, 0]", "robot.thermal.uncertainty.missing_percent=0"
    ).job
    C = (5 * MDEG) ** 2 * np.array([[1.0, -0.999], [-0.999, 1.0]])
    parameters = tuple(KnownParameter("joint_zeros", "offset", (i,), "offset_mdeg", MDEG) for i in (1, 2))
    posterior = ParameterPosterior(parameters, np.zeros(2), C)
    with_posterior = replace(plain, job=replace(job, cell=replace(job.cell, posterior=posterior)))
    uncertainty = job_uncertainty(with_posterior)
    columns = columns_along(with_posterior, uncertainty, np.arange(5))
    identified = [k for k, q in enumerate(uncertainty.quantities) if q.source == "identified parameters"]
    moment = columns.column[:, :, identified] @ np.swapaxes(columns.column[:, :, identified], 1, 2)
    step, slopes, nominal = 1e-6, [], plain.model.nominal_pose(plain.theta[:5]).position
    for i in (1, 2):
        theta = plain.theta[:5].copy()
        theta[:, i] += step
        slopes.append((plain.model.nominal_pose(theta).position - nominal) / step)
    A = np.stack(slopes, axis=2)
    assert_allclose(moment, A @ C @ np.swapaxes(A, 1, 2), atol=2e-3 * np.abs(moment).max())
    alone = band_along(replace(plain, job=job)).budget
    assert next(s.largest for s in alone if s.source == "geometry") > 3 * 1.96 * np.sqrt(moment[:, 0, 0].max())


def test_play_that_the_rest_does_not_tell_stands_as_lost_motion(plain):
    """A zero and J1's half-width, correlated, and a width: by hand, what is left of each once the zero is known."""
    half, wide = 0.5 * MDEG, 200 * MDEG
    rows = (("joint_zeros", "offset", "offset_mdeg"), ("hysteresis", "backlash", "backlash_mdeg"),
            ("hysteresis", "width", "width_mdeg"))  # fmt: skip
    parameters = tuple(KnownParameter(table, field, (0,), key, MDEG) for table, field, key in rows)
    sigma, r = np.array([2 * MDEG, half, wide]), 0.6
    C = np.outer(sigma, sigma) * np.array([[1.0, r, 0.0], [r, 1.0, 0.0], [0.0, 0.0, 1.0]])
    posterior = ParameterPosterior(parameters, np.array([0.0, half, wide]), C)
    table = "{ backlash_mdeg = [0.5, 0, 0, 0, 0, 0], width_mdeg = [200, 200, 200, 200, 200, 200] }"
    zeros = "robot.sources.joint_zeros.sigma.offset_mdeg=[2, 0, 0, 0, 0, 0]"
    given = program_of(f"robot.sources.hysteresis={table}", zeros)
    program = replace(given, job=replace(given.job, cell=replace(given.job.cell, posterior=posterior)))
    uncertainty = job_uncertainty(program)
    own = [q for q in uncertainty.quantities if q.name.startswith("identified")]
    place = {
        (uncertainty.parameters.sources[e.source].NAME, e.field): n
        for n, e in reversed([*enumerate(uncertainty.parameters.entries)])
    }
    zero, play = place["joint_zeros", "offset"], place["hysteresis", "backlash"]
    F = np.array([[q.cause.parameters[zero], q.cause.parameters[play], q.cause.width[0] * wide] for q in own]).T
    assert_allclose(F @ F.T / np.outer(sigma, sigma), C / np.outer(sigma, sigma), atol=1e-9)
    lost = F[:, [q.source == "lost motion" for q in own]]
    assert_allclose(lost @ lost.T / np.outer(sigma, sigma), np.diag([0.0, 1 - r**2, 1.0]), atol=1e-9)
    assert {"lost motion", "identified parameters"} <= {s.source for s in band_along(program).budget}


@pytest.mark.parametrize("field", ["scale", "lag"])
def test_an_identified_rise_and_lag_move_the_whole_chain(field):
    """After two hours: at the reference, which the rises are held at, a lag says nothing."""
    plain = program_of("before.0.duration_h=2")
    key, unit = ("rise_K", 1.0) if field == "scale" else ("tau_h", 3600.0)
    parameter = KnownParameter("thermal.node", key, (2,), key, unit)
    value = {"scale": plain.job.heat.reference_rise, "lag": plain.job.heat.tau}[field][2]
    posterior = ParameterPosterior((parameter,), np.array([value]), np.array([[(0.02 * value) ** 2]]))
    job = replace(plain.job, cell=replace(plain.job.cell, posterior=posterior))
    program = replace(plain, job=job)
    uncertainty = job_uncertainty(program)
    k = next(k for k, q in enumerate(uncertainty.quantities) if q.source == "identified parameters")
    columns = columns_along(program, uncertainty, np.arange(len(plain.time)))
    cause = combined([uncertainty.quantities[k]], [1.0])
    moved = position_of(changed_job(job, uncertainty.parameters, cause), program) - position_of(job, program)
    assert np.abs(moved).max() > 0.1 * UM
    assert_allclose(columns.column[:, :, k], moved, atol=0.03 * np.abs(moved).max())


def test_the_band_of_a_link_is_what_plain_trigonometry_says(plain):
    """An oracle without the chain: link 1 longer by s moves the tool along link 1, up by cos J2 and out by sin J2."""
    job = program_of(
        "robot.sources.link_offsets.a_um=[0, 0, 0, 0, 0, 0]",
        "robot.sources.link_offsets.sigma.a_um=[0, 40, 0, 0, 0, 0]",
    ).job
    warmth = replace(
        job.cell.warmth, law=0.0, sensors=0.0, air=0.0, feed=0.0, missing=0.0, growth={}, expansion=(0.0, 0.0)
    )
    band = band_along(replace(plain, job=replace(job, cell=replace(job.cell, warmth=warmth))))
    j1, j2 = job.robot.to_pendant(plain.theta)[:, :2].T
    along = np.stack([np.sin(j2) * np.cos(j1), np.sin(j2) * np.sin(j1), np.cos(j2)], axis=1)
    assert_allclose(band.half_widths(plain.path)[:, :3], 2 * 40 * UM * np.abs(along), atol=1e-9)
    assert_allclose(band.radius, 1.959964 * 40 * UM, rtol=1e-5)


def test_a_row_of_waypoints_in_between_has_the_band_of_its_neighbours(plain, monkeypatch):
    """Few rows, with straight lines between, against all of them: within a hundredth of the half-width."""
    every = band_along(plain, WINDOW).half_widths(plain.path)
    for name in ("ROWS", "MOST_ROWS"):
        monkeypatch.setattr(band_module, name, 300)
    few = band_along(plain, WINDOW)
    assert len(few.rows) < 320
    assert_allclose(few.half_widths(plain.path), every, atol=0.01 * every.max())


def test_reversals_keep_their_rows(monkeypatch):
    """Where a joint reverses, what its play may be off by turns over: a line between two rows serves there too."""
    program = program_of(*FLAWED, path="raster_1300")
    every = band_along(program)
    for name in ("ROWS", "MOST_ROWS"):
        monkeypatch.setattr(band_module, name, len(program.time) // 8)
    few = band_along(program)
    assert len(few.rows) < 0.7 * len(every.rows)
    difference = np.abs(few.half_widths(program.path) - every.half_widths(program.path))
    assert difference.max() <= 0.1 * every.half_widths(program.path).max()


@pytest.mark.parametrize(
    ("moment", "sigmas"),
    [([1, 0, 0, 0, 0, 0], 1.95996), ([1, 0, 0, 1, 0, 0], 2.44775), ([1, 0, 0, 1, 0, 1], 2.79548)],
    ids=["line", "plane", "space"],
)
def test_the_radius_of_a_ball_a_disc_and_a_line_is_exact(moment, sigmas):
    assert_allclose(radius_of(np.array([moment], dtype=float)), sigmas, rtol=1e-5)


def test_the_radius_holds_for_ellipsoids():
    rng = np.random.default_rng(5)
    for _ in range(6):
        half = rng.normal(size=(3, 3)) * rng.uniform(0.1, 1, 3)
        S = half @ half.T
        x = np.linalg.norm(rng.normal(size=(200_000, 3)) @ half.T, axis=1)
        radius = radius_of(S[np.triu_indices(3)][None])[0]
        assert 0.94 <= np.mean(x <= radius) <= 0.96


def test_a_part_that_stands_elsewhere_is_missed_the_other_way():
    """Moved by d the tool is off by -d, turned by w about its middle c by -w x (p - c): by hand, without the chain."""
    program = program_of(*FLAWED)
    place, contact = program.path.target.position, program.path.contact
    middle = (place[contact].min(axis=0) + place[contact].max(axis=0)) / 2
    uncertainty = job_uncertainty(program)
    columns = columns_along(program, uncertainty, np.arange(len(place)))
    by_name = {q.name: columns.column[:, :, k] for k, q in enumerate(uncertainty.quantities)}
    actual = program.model.actual_pose(program.theta, program.rise, program.motion).position
    for axis, unit, shift, turn in zip("xyz", np.eye(3), (5, 6, 7), (1, 2, 3), strict=True):
        assert_allclose(by_name[f"part's place {axis}"], np.broadcast_to(-shift * UM * unit, place.shape), atol=1e-12)
        turned = -np.cross(turn * MDEG * unit, actual - middle)
        assert_allclose(by_name[f"part's turn {axis}"], turned, atol=1e-9)


def test_values_without_a_sigma_count_by_priors_as_far_as_a_pose_shows_them_and_it_is_said():
    job = load_job(path_file("line_y"), None, ["robot.sources.link_offsets.a_um=[0, 50, 0, 0, 0, 0]"])
    names = {q.name for q in quantities_of(job).quantities}
    assert "link_offsets.a[2]" in names
    assert not names & {"link_offsets.d[1]", "link_offsets.a[6]"}  # those the frames of base and tool contain
    assert [f.code for f in assumed_findings(job.cell)] == ["sources.sigma"]


def test_the_radius_covers_what_draws_of_the_amounts_make_of_it():
    """Rectangles and normals together, not one normal: 95 of 100 draws stay within, along the whole path as well."""
    program = program_of("robot.thermal.uncertainty.missing_percent=0")
    uncertainty, band = job_uncertainty(program, WINDOW), band_along(program, WINDOW)
    rows = np.arange(0, len(program.time), 20)
    columns = columns_along(program, uncertainty, rows)
    z = np.random.default_rng(3).normal(size=(4000, len(uncertainty.quantities)))
    drawn = np.array([amounts(uncertainty.quantities, row) for row in z])
    away = np.linalg.norm(np.einsum("miq,sq->smi", columns.column, drawn), axis=2)
    inside = (away <= band.radius[rows]).mean(axis=0)
    assert 0.94 <= inside.min()
    assert inside.max() <= 0.975
    assert 0.93 <= (away.max(axis=1) <= band.largest).mean() <= 0.975


def test_the_shipped_file_has_the_distance_of_its_two_models():
    """Growth by the network over that by the nodes after the reference: the ends of the file's intervals."""
    grown = []
    for model in ("nodes", "network"):
        job = load_job(path_file("spiral_1300"), None, [f"robot.thermal.model={model}"])
        growth = next(source for source in job.sources if isinstance(source, ThermalGrowth))
        rise = job.start_rise()
        grown.append(np.array([growth.a[1] @ rise, growth.d[3] @ rise, growth.d[5] @ rise]))
    ends = load_job(path_file("spiral_1300")).cell.warmth.growth
    largest = [max(ends[length], key=abs) for length in ("a2", "d4", "d6")]
    assert_allclose(largest, grown[1] / grown[0] - 1, atol=2e-3)  # of waypoints that show losses within half a percent


def test_the_shipped_spiral_has_the_budget_that_its_page_says():
    band = band_along(program_of(), 1068.0)
    sizes = {share.source: share.largest / UM for share in band.budget} | {"**all**": band.largest / UM}
    page = (ROOT / "docs" / "uncertainty.md").read_text().split("## The shipped spiral")[1].split("## ")[0]
    rows = [line.split("|")[1:3] for line in page.splitlines() if line.startswith("| ")][1:]
    assert {name.strip() for name, _ in rows} == set(sizes)
    for name, size in rows:
        assert_allclose(float(size.strip(" *")), sizes[name.strip()], atol=0.6, err_msg=name)


def test_a_log_of_few_sensors_widens_the_band_and_says_what_they_may_hide(tmp_path):
    """J3, which warms most, without a sensor; then with all four, and with a day in place of a log."""
    log = tmp_path / "log.csv"
    bands = {}
    for sensors in ({"part_3": 11.0, "part_11": 3.0}, {"part_3": 11.0, "part_4": 3.9, "part_6": 13.0, "part_11": 3.0}):
        rows = [
            [t, 20.0, *(20 + 1.6 * size * -np.expm1(-t / 23400) + 0.1 * np.sin(t) for size in sensors.values())]
            for t in range(0, 14400, 60)
        ]
        head = ["time_s", "ambient_degC", *(f"{name}_degC" for name in sensors)]
        log.write_text("\n".join([",".join(head), *(",".join(f"{v:.2f}" for v in row) for row in rows)]) + "\n")
        program = program_of(f"log.file='{log}'")
        bands[len(sensors)] = band_along(program)
        setting = setting_of(program.path.target.position, np.zeros((1, 3)), program.rise)
        rows_of = {row.what: row for row in not_known(program.job.cell, bands[len(sensors)], setting)}
        assert rows_of[UNSEEN].size == (0.0, bands[len(sensors)].hidden)
    few, all_four = bands[2], bands[4]
    of_log = [next(s.largest for s in band.budget if s.source == "temperature log") for band in (few, all_four)]
    assert of_log[0] > 1.3 * of_log[1] > 5 * UM
    assert few.hidden > 2 * all_four.hidden > 10 * UM
    assert band_along(program_of()).hidden == 0


def test_what_a_log_left_of_the_motion_is_a_row_of_the_band_wherever_the_tool_is():
    """Alike along three coordinates: 95 % of cases within sqrt(chi2_3) = 2.795 of its sigma."""
    identified = 'robot.motion.identified={robot="m710ic50", verdict="foretells", held_out_rms_um=13}'
    known = ["robot.motion.moving_average_ms=[200, 100]", identified]
    with_row, without = (band_along(program_of(*sets, path="line_x")) for sets in (known, known[:1]))
    row = {share.source: share for share in with_row.budget}["the controller's motion"]
    assert row.largest == pytest.approx(np.sqrt(chi2.ppf(0.95, 3)) * 13 * UM, rel=1e-5)
    assert_allclose(with_row.moment[:, [0, 3, 5]] - without.moment[:, [0, 3, 5]], (13 * UM) ** 2, rtol=1e-6)
    assert "the controller's motion" not in {share.source for share in without.budget}
