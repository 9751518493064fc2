"""A frame taught through the job's own model: what is left on the part, by the twin's arm and numpy's least squares."""

from dataclasses import replace

import numpy as np
import pytest
from changed import changed
from numpy.testing import assert_allclose
from shipped import path_file, quiet

from compgen.core.pose import Pose
from compgen.core.units import DEG, MDEG, UM
from compgen.error_model.posterior import KnownParameter, ParameterPosterior
from compgen.error_model.uncertain_sources import combined
from compgen.job.uncertainty import changed_job, quantities_of
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.pipelines.planned.generate import predict
from compgen.pipelines.uncertainty.band_columns import band_along, columns_along, job_uncertainty
from compgen.robot.inverse_kinematics import Posture, solve_tool
from compgen.verification.band import radius_of, random_field

PROBE = np.array([0.0, 0.0, 0.05])  # m, in the flange
RISE = np.array([8.0, 3.0, 9.0, 2.0, 1.0])  # K while it was taught
NOISE = 10 * UM
KNOWN = [
    "process.chord_um=200",
    "tool.z_mm=50",
    "tool.sigma_um=[3, 4, 8]",
    "robot.sources.link_offsets.a_um=[0, 50, 20, 0, 0, 0]",
    "robot.sources.link_offsets.sigma.a_um=[0, 30, 30, 0, 0, 0]",
    "robot.sources.joint_zeros.offset_mdeg=[0, 3, -2, 5, 1, 0]",
    "robot.sources.joint_zeros.sigma.offset_mdeg=[0, 1, 1, 2, 2, 0]",
]


def touching_joints(robot):
    """Six places around the spiral, three tilts of the flange each."""
    around = np.radians(np.repeat(np.arange(6) * 60.0, 3))
    place = np.column_stack([1.35 + 0.6 * np.cos(around), -0.03 + 0.6 * np.sin(around), np.tile([0.2, 0.22, 0.25], 6)])
    x, y = 0.3 * np.tile([1, -1, 0.3], 6), 0.3 * np.repeat([1, -1, 0.2, -0.8, 0.5, -0.1], 3)
    none, one = np.zeros(18), np.ones(18)
    about_x = np.array([[one, none, none], [none, np.cos(x), -np.sin(x)], [none, np.sin(x), np.cos(x)]])
    about_y = np.array([[np.cos(y), none, np.sin(y)], [none, one, none], [-np.sin(y), none, np.cos(y)]])
    down = np.einsum("ijn,jkn->nik", about_x, about_y) @ np.diag([1.0, -1.0, -1.0])
    return solve_tool(robot, Pose(place, down), Pose(PROBE, np.eye(3)), Posture())[0]


def touches_toml(robot, theta):
    rows = [", ".join(f"{v:.6f}" for v in q) for q in robot.to_pendant(theta) / DEG]
    return "[" + ", ".join(f"{{joints_deg = [{row}], noise_um = {NOISE / UM}}}" for row in rows) + "]"


@pytest.fixture(scope="module")
def jobs():
    """The job in a frame of which nobody said how it was taught, and in the same one that was taught by touches."""
    untaught = load_job(path_file("spiral_1300"), None, [*KNOWN, "frame.x_mm=-90"])
    theta, cell = touching_joints(untaught.robot), untaught.cell
    nodes = ", ".join(f"{n} = {r}" for n, r in zip(cell.heat.names, RISE, strict=True))
    taught = [
        "frame.taught.through='model'",
        f"frame.taught.robot_file='m710ic50 {cell.robot_file_hash[:16]}'",
        "frame.taught.probe_mm=[0, 0, 50]",
        "frame.taught.sigma_um=[3, 3, 4]",
        f"frame.taught.rise_K={{{nodes}}}",
        f"frame.taught.touches={touches_toml(untaught.robot, theta)}",
    ]
    words = [*KNOWN, "frame.x_mm=-90", *taught]
    return untaught, load_job(path_file("spiral_1300"), None, words), theta, words


def driven(job):
    planned = predict(job, quiet)
    return planned.driven(planned.theta, planned.motion)


def test_what_is_left_of_each_quantity_is_what_a_frame_fitted_to_the_touches_leaves(jobs):
    """The twin flies touches and path with and without the quantity; the frame is fitted by hand to what moved."""
    untaught, taught, theta, _ = jobs
    plain, program = driven(untaught), driven(taught)
    rows = np.arange(0, len(program.time), 40)
    columns = columns_along(program, job_uncertainty(program), rows)
    uncertainty = quantities_of(taught)
    names = [q.name for q in uncertainty.quantities]
    assert [q.name for q in job_uncertainty(program).quantities] == names
    at_touches, on_path = np.tile(RISE, (len(theta), 1)), program.rise[rows]

    def flown(job, joints, rise):
        return twin_of(job).actual_pose(joints, rise, lambda share: None)

    raw = job_uncertainty(plain)
    of_raw = columns_along(plain, raw, rows)
    before, place = flown(untaught, theta, at_touches), flown(untaught, program.theta[rows], on_path)
    middle, design = before.position.mean(axis=0), []
    for p, R in zip(before.position, before.rotation, strict=True):
        design.append(np.column_stack([np.eye(3), np.array([np.cross(e, p - middle) for e in np.eye(3)]).T, -R]))
    held = np.hstack([np.zeros((3, 6)), np.eye(3) * NOISE / 500e-6])
    compared = 0
    for q in raw.quantities:
        warms, moves = bool(q.cause.heat.start.any()), bool(q.cause.parameters.any())
        if not (warms or moves) or q.name.startswith(("part's", "tool")):
            continue
        amount = 0.1 * q.deviation
        changed = changed_job(untaught, raw.parameters, combined([q], [amount]))
        shown = amount * q.cause.heat.start  # sensors that err now erred when the frame was taught
        moved = flown(changed, theta, at_touches + shown).position - before.position
        u = np.linalg.lstsq(np.vstack([*design, held]), np.append(moved.ravel(), np.zeros(3)), rcond=None)[0]
        away = flown(changed, program.theta[rows], on_path).position - place.position
        away += of_raw.column[:, :, raw.quantities.index(q)] * amount if warms else 0.0
        frame = u[:3] + np.cross(u[3:6], place.position - middle)
        left = away - frame + place.rotation @ u[6:]
        column = columns.column[:, :, names.index(q.name)] * amount
        assert_allclose(column, left, atol=0.02 * np.abs(left).max() + 1e-9, err_msg=q.name)
        compared += 1
    assert compared >= 8


def fitted_by_numpy(at, place):
    """What frame and probe move at places, (M, 3, 9), and how touches fix them, (9, 3 T), by the pseudo-inverse."""
    middle = at.position.mean(axis=0)

    def design(pose):
        turned = [np.array([np.cross(e, p - middle) for e in np.eye(3)]).T for p in pose.position]
        return np.stack([np.hstack([np.eye(3), w, -R]) for w, R in zip(turned, pose.rotation, strict=True)])

    held = np.hstack([np.zeros((3, 6)), np.eye(3) * NOISE / 500e-6])
    return design(place), np.linalg.pinv(np.vstack([design(at).reshape(-1, 9), held]))[:, :-3]


def test_the_frame_and_the_probe_count_once_and_together(jobs):
    """The probe that taught is the tool: both are open by the touches' noise, through numpy's pseudo-inverse."""
    _, taught, theta, words = jobs
    program = driven(taught)
    rows = np.arange(0, len(program.time), 40)
    uncertainty = job_uncertainty(program)
    columns = columns_along(program, uncertainty, rows)
    own = columns.column[:, :, [name == "part's frame" for name in columns.source]]
    at, place = (
        twin_of(taught).actual_pose(q, r, lambda share: None)
        for q, r in ((theta, np.tile(RISE, (len(theta), 1))), (program.theta[rows], program.rise[rows]))
    )
    on_path, gain = fitted_by_numpy(at, place)
    F = on_path @ gain * NOISE
    assert_allclose(np.einsum("miq,mjq->mij", own, own), np.einsum("mir,mjr->mij", F, F), rtol=2e-3, atol=1e-15)
    assert "tool" not in columns.source
    other = load_job(path_file("spiral_1300"), None, [*words, "tool.z_mm=120"])
    assert [q.source for q in quantities_of(other).quantities].count("tool") == 3


def test_a_frame_taught_through_another_robot_file_takes_up_nothing(jobs):
    _, taught, _, words = jobs
    other = load_job(path_file("spiral_1300"), None, [*words, "frame.taught.robot_file='m710ic50 0123456789abcdef'"])
    moves = [q.cause.parameters.any() for q in quantities_of(other).quantities if q.name == "thermocouples"]
    assert moves == [False]
    assert [q.cause.parameters.any() for q in quantities_of(taught).quantities if q.name == "thermocouples"] == [True]


def test_a_frame_takes_up_of_identified_numbers_what_it_takes_up_of_the_same_numbers_alone(jobs):
    """Four zeros by a posterior without correlation are the four zeros of the file: on the part they leave the same."""
    _, taught, _, _ = jobs
    zeros = tuple(KnownParameter("joint_zeros", "offset", (i,), "offset_mdeg", MDEG) for i in (1, 2, 3, 4))
    posterior = ParameterPosterior(zeros, np.zeros(4), np.diag(np.array([1, 1, 2, 2]) * MDEG) ** 2)
    together = replace(taught, cell=replace(taught.cell, posterior=posterior))

    def left(job, is_one):
        program = driven(job)
        uncertainty = job_uncertainty(program)
        column = columns_along(program, uncertainty, np.arange(0, len(program.time), 40)).column
        own = column[:, :, [is_one(q) for q in uncertainty.quantities]]
        return own.shape[2], np.einsum("miq,mjq->mij", own, own)

    alone = left(taught, lambda q: q.name.startswith("joint_zeros"))
    by_posterior = left(together, lambda q: q.source == "identified parameters")
    assert alone[0] == by_posterior[0] == 4
    assert_allclose(by_posterior[1], alone[1], rtol=1e-6, atol=1e-6 * np.abs(alone[1]).max())


def test_untaught_the_band_of_an_identified_robot_is_parted_in_two(jobs):
    """By numpy: at each place the covariance of what a rigid motion of the part takes up, and of what it leaves."""
    untaught, taught, _, _ = jobs
    assert band_along(driven(taught)).parted is None
    program = driven(untaught)
    band, rows = band_along(program), np.flatnonzero(program.path.contact)
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, 256).astype(int))]
    columns, place = columns_along(program, job_uncertainty(program), rows), program.path.target.position[rows]
    middle = place.mean(axis=0)
    lever = np.stack(
        [np.column_stack([np.eye(3), *(np.cross(e, p - middle)[:, None] for e in np.eye(3))]) for p in place]
    )
    flat = columns.column.reshape(3 * len(rows), -1)
    design = lever.reshape(-1, 6)
    rigid = design @ np.linalg.lstsq(design, flat, rcond=None)[0]
    radius = []
    for part, alone in ((rigid, 0.0), (flat - rigid, 1.0)):
        amounts = np.hstack([part * columns.deviation, part @ columns.mean[:, None]]).reshape(len(rows), 3, -1)
        S = np.einsum("miq,mjq->mij", amounts, amounts)
        S += alone * sum((v**2 for v in columns.undirected.values()), np.zeros(len(rows)))[:, None, None] * np.eye(3)
        radius.append(radius_of(S[:, [0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]]).max())
    assert band.parted is not None
    assert_allclose([band.parted[0], band.parted[1].largest], radius, rtol=1e-6)
    assert max(radius) < band.largest


def test_what_the_thermal_physics_misses_is_less_by_what_the_frame_took_up(jobs):
    """5 % of the thermal error that is left on the part, by the twin's arm: hot as it was taught nearly all cancels."""
    untaught, taught, theta, _ = jobs
    program = driven(taught)
    rows = np.arange(0, len(program.time), 40)
    own = columns_along(program, job_uncertainty(program), rows).undirected["thermal physics missing"]

    def warm(joints, rise):
        hot, cold = (twin_of(untaught).actual_pose(joints, r, lambda share: None) for r in (rise, 0 * rise))
        return hot.position - cold.position, hot

    moved, at = warm(theta, np.tile(RISE, (len(theta), 1)))
    away, place = warm(program.theta[rows], program.rise[rows])
    middle, design = at.position.mean(axis=0), []
    for p, R in zip(at.position, at.rotation, strict=True):
        design.append(np.column_stack([np.eye(3), np.array([np.cross(e, p - middle) for e in np.eye(3)]).T, -R]))
    held = np.hstack([np.zeros((3, 6)), np.eye(3) * NOISE / 500e-6])
    u = np.linalg.lstsq(np.vstack([*design, held]), np.append(moved.ravel(), np.zeros(3)), rcond=None)[0]
    left = away - u[:3] - np.cross(u[3:6], place.position - middle) + place.rotation @ u[6:]
    share = untaught.cell.warmth.missing
    assert_allclose(own, share * np.linalg.norm(left, axis=1), rtol=1e-3, atol=2e-8)
    assert own.max() < 0.9 * share * np.linalg.norm(away, axis=1).max()


def test_of_the_fit_noise_a_frame_takes_up_what_is_alike_at_touches_and_path(jobs):
    """Smooth fields are drawn; to each the frame and the probe are fitted by numpy, and what is left is squared."""
    untaught, taught, theta, _ = jobs
    taught = changed(taught, "cell.fit", replace(taught.cell.fit, noise=10 * UM))
    program = driven(taught)
    rows = np.flatnonzero(program.path.contact)[::40]
    own = columns_along(program, job_uncertainty(program), rows).undirected["fit noise"]
    at, place = (
        twin_of(untaught).actual_pose(q, r, lambda share: None)
        for q, r in ((theta, np.tile(RISE, (len(theta), 1))), (program.theta[rows], program.rise[rows]))
    )
    on_path, gain = fitted_by_numpy(at, place)
    rng, square = np.random.default_rng(6), 0.0
    for _ in range(3000):
        z = random_field(rng, np.concatenate([at.position, place.position]))
        left = z[len(theta) :] - on_path @ (gain @ z[: len(theta)].ravel())
        square = square + (left**2).mean(axis=1) / 3000
    assert_allclose(own, 10 * UM * np.sqrt(square), rtol=0.05)
    assert own.mean() < 8 * UM
