"""A made-up arm identified from places of three reflectors, and the same objective left to scipy's least_squares."""

import time
from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from benchmarks.measure import seconds
from compgen.core.arrays import Array
from compgen.core.rotations import rotation_matrix
from compgen.core.units import DEG, UM
from compgen.identification.fit import fit
from compgen.identification.instrument_frames import InstrumentFrames
from compgen.identification.measurements import Measurements, plain_ends
from compgen.identification.model import ArmModel, build_model
from compgen.identification.parameters import symbolic_sources
from compgen.pipelines.files.robot_file import load_arm

SOURCES = ("link_offsets", "joint_zeros", "gear_harmonics", "joint_coupling")
NOISE = 25 * UM
PRISM = np.array([[60, 10, 120], [-50, 40, 150], [5, -60, 180]]) * 1e-3  # [m] in the flange
LOW, HIGH = (np.array(a) * DEG for a in ([-60, -90, -20, -120, -110, -150], [60, 0, 120, 120, 110, 150]))
TOLERANCE = 1e-10


def against_scipy(parameters: int, poses: int) -> dict[str, float]:
    """Seconds of both, how far apart their parameters are over their sigmas, and their costs' ratio.

    Both minimise sum |y - f(p, frames)|^2 / s^2 + sum (p / sigma)^2 over the same rows, from zero and from frames that
    fit the nominal arm; scipy with its default numerical Jacobian of the same residual function.
    """
    model, data = problem(parameters, poses)
    active = np.arange(len(model.parameters)) < parameters
    spent = seconds(lambda: fit(model, data, active, learn=False, robust=False, noise=NOISE))
    fitted = fit(model, data, active, learn=False, robust=False, noise=NOISE)
    frames = fit(model, data, np.zeros(len(active), dtype=bool), robust=False).frames
    scale = model.prior[active]

    def residual(x: Array) -> Array:
        p = np.zeros(len(active))
        p[active] = x[:parameters] * scale
        step = x[parameters:]
        moved = InstrumentFrames(
            rotation_matrix(step[None, :3]) @ frames.rotation, frames.origin + step[3:6],
            frames.reflector + step[6:].reshape(3, 3),
        )  # fmt: skip
        z = data.position - moved.predict(data, *model.pose(data, p))
        return np.concatenate([z.ravel() / NOISE, x[:parameters]])

    begin = time.process_time()
    options = {"xtol": TOLERANCE, "ftol": TOLERANCE, "gtol": TOLERANCE}
    by_scipy = least_squares(residual, np.zeros(parameters + 15), x_scale="jac", **options)
    scipy_spent = time.process_time() - begin
    p = fitted.p[active] / scale
    cost = float((fitted.residual**2).sum() / NOISE**2 + (p**2).sum())
    apart = np.abs(p - by_scipy.x[:parameters]) / (fitted.sigma[active] / scale)
    return {"compgen": spent, "scipy": scipy_spent, "apart": float(apart.max()), "cost": cost / (2 * by_scipy.cost)}


def problem(parameters: int, poses: int) -> tuple[ArmModel, Measurements]:
    """The shipped arm with so many errors drawn from their priors, and what a tracker measured of it."""
    arm = load_arm("m710ic50")
    sources = symbolic_sources(arm.robot, arm.known, np.ones(6, dtype=bool), warm=False, facts=arm.facts)
    by_name = {source.original.NAME: source for source in sources}
    model = build_model(arm.robot, [by_name[name] for name in SOURCES], len(arm.nodes))
    rng = np.random.default_rng(4)
    p = np.where(np.arange(len(model.parameters)) < parameters, rng.normal(0, model.prior), 0.0)
    theta = rng.uniform(LOW, HIGH, (poses, 6))
    pose, N = np.repeat(np.arange(poses), 3), 3 * poses
    data = Measurements(
        theta=theta, rise=np.zeros((poses, len(arm.nodes))), lag=np.zeros((poses, len(arm.nodes))),
        direction=np.zeros((poses, 6)),
        time=np.arange(poses, dtype=float), warm=np.zeros(poses), pose=pose, instrument=np.zeros(N, dtype=np.int64),
        reflector=np.tile(np.arange(3), poses), ends=plain_ends(N), position=np.zeros((N, 3)),
        rotation=np.full((N, 3, 3), np.nan),
        sigma=np.ones(N), label=("",) * N, reflectors=("r1", "r2", "r3"), instruments=("tracker",),
        aligned=np.array([False]),
    )  # fmt: skip
    frames = InstrumentFrames(rotation_matrix(rng.normal(0, 1, (1, 3))), rng.uniform(-3, 3, (1, 3)), PRISM)
    places = frames.predict(data, *model.pose(data, p)) + rng.normal(0, NOISE, (N, 3))
    return model, replace(data, position=places)
