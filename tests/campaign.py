"""The synthetic campaign: made-up robots, identified and judged. Run it with [seeds] [first]: a row is printed each.

M-710iC/50, parameters drawn from their priors (offsets, Hayati, zeros, coupling, compliance, harmonics, backlash,
windup, growth, bend); 60 poses x 3 reflectors with 25 um of noise and 1 % outliers, three bidirectional lines, one
warm-up of 40 poses over 5 h; judged on 500 fresh poses, both directions.
"""

import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from flawed import flawed_file
from synthetic import NOISE, axis_lines, made_up, measured, random_theta, warming, with_outliers

from compgen.identification.fit import fit
from compgen.identification.identify import identify
from compgen.identification.instrument_frames import InstrumentFrames
from compgen.identification.measurements import concatenate
from compgen.identification.model import active_in_groups

SOURCES = (
    "thermal_growth", "link_offsets", "joint_zeros", "joint_coupling", "compliance", "gear_harmonics", "joint_ripple",
    "hysteresis", "base_frame", "tool_frame", "thermal_bend", "map",
)  # fmt: skip


def quiet(stage, share):
    """Says nothing."""


def robot_file(folder):
    """The study's arm with masses, widths and heated lengths, and nothing wrong yet."""
    return flawed_file(
        Path(folder), "nominal", drop=tuple(s for s in SOURCES if s not in ("hysteresis", "thermal_bend"))
    )


def aligned_error(truth, model, p, frames, theta, direction):
    """Predicted less true place of three reflectors at cold poses, per coordinate; frames as they were fitted."""
    rng = np.random.default_rng(0)
    fresh = measured(truth, theta, rng, noise=0.0, direction=direction)
    instrument = InstrumentFrames(frames.rotation[:1], frames.origin[:1], frames.reflector[:3])
    return instrument.predict(fresh, *model.pose(fresh, p)) - fresh.position


def warm_excess(truth, model, best, rng, temperatures):
    """How far warmth moves fresh poses, and how much of that the model leaves, per coordinate."""
    theta = random_theta(truth.arm.robot, rng, 100)
    time = rng.uniform(0, 5 * 3600, 100)
    final, tau = np.array([11, 4, 13, 3, 2.3]), np.array([2.2, 1.4, 2.0, 1.8, 1.8]) * 3600
    rise = final * (1 - np.exp(-time[:, None] / tau))
    warm = measured(truth, theta, rng, noise=0.0, rise=rise, time=np.arange(100.0), warm=time)
    cold = replace(warm, rise=0 * rise, warm=0 * time)
    real = truth.noiseless(warm) - truth.noiseless(cold)
    instrument = InstrumentFrames(best.frames.rotation[:1], best.frames.origin[:1], best.frames.reflector[:3])
    known = warm if temperatures else replace(warm, rise=0 * rise)
    predicted_warm, predicted_cold = (instrument.predict(rows, *model.pose(rows, best.p)) for rows in (known, cold))
    actual = np.einsum("ij,nj->ni", truth.frames.rotation[0].T, real)
    predicted_world = np.einsum("ij,nj->ni", best.frames.rotation[0].T, predicted_warm - predicted_cold)
    return np.sqrt((actual**2).mean()), np.sqrt(((predicted_world - actual) ** 2).mean())


def run(seed, temperatures=True, file=None):
    """One made-up robot: how well it was identified, in numbers."""
    truth = made_up(file, seed)
    rng = np.random.default_rng(1000 + seed)
    robot, nodes = truth.arm.robot, len(truth.arm.nodes)
    cold, outlier = with_outliers(measured(truth, random_theta(robot, rng, 60), rng), rng)
    lines = axis_lines(truth, rng)
    warm, _ = warming(truth, rng)
    if not temperatures:
        warm = replace(warm, rise=np.zeros_like(warm.rise))
    data = concatenate([cold, warm, lines])
    # one instrument for cold and warm: it stays where it is
    same = np.where(data.instrument <= 1, 0, data.instrument - 1)
    data = replace(
        data, instrument=same, instruments=data.instruments[:1] + data.instruments[2:],
        aligned=np.delete(np.array(data.aligned), 1),
    )  # fmt: skip
    start = time.perf_counter()
    identification = identify(robot, truth.arm.known, data, nodes, quiet, temperatures=temperatures)
    seconds = time.perf_counter() - start
    best = identification.selected.fit
    theta = random_theta(robot, rng, 500)
    direction = rng.choice([-1.0, 1.0], theta.shape)
    error = aligned_error(truth, identification.model, best.p, best.frames, theta, direction)
    rms = np.sqrt((error**2).mean())
    noisy = np.sqrt(rms**2 + NOISE**2)
    flagged = best.outlier[: len(outlier)]
    hits = int((flagged & outlier).sum())
    extra = int(best.outlier.sum()) - hits
    value = {t.name: v for t, v in zip(truth.model.parameters, truth.p, strict=True)}
    covered = [
        abs(best.p[k] - value[t.name]) <= 1.96 * best.sigma[k]
        for k, t in enumerate(identification.model.parameters)
        if best.active[k]
        and t.name in value
        and t.source != "joint_ripple"
        and (temperatures or not t.source.startswith("thermal"))  # else rise and rate are only known together
    ]
    # what the warm-up does to the cold parameters when nothing explains it, and when something does
    level = identification.selected.candidate
    clean = fit(identification.model, concatenate([cold, lines]), active_in_groups(identification.model, level.groups))
    plain = [g for g in level.groups if g.split(".")[0] not in ("thermal_growth", "thermal_bend", "warm_up")]
    blind = fit(identification.model, replace(data, rise=np.zeros_like(data.rise), warm=np.zeros_like(data.warm)),
                active_in_groups(identification.model, plain))  # fmt: skip
    base = np.sqrt((aligned_error(truth, identification.model, clean.p, clean.frames, theta, direction) ** 2).mean())
    bad = np.sqrt((aligned_error(truth, identification.model, blind.p, blind.frames, theta, direction) ** 2).mean())
    excess, left = warm_excess(truth, identification.model, best, rng, temperatures)
    return {
        "seed": seed, "temperatures": temperatures, "excess_um": excess * 1e6, "left_um": left * 1e6,
        "model": level.name, "rms_um": rms * 1e6, "noisy": noisy / NOISE, "cover": float(np.mean(covered)),
        "counted": len(covered), "hits": hits, "wild": int(outlier.sum()), "extra": extra, "blind_um": bad * 1e6,
        "cold_only_um": base * 1e6, "seconds": seconds, "noise_um": best.noise * 1e6, "refused": identification.refused,
    }  # fmt: skip


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    first = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    with tempfile.TemporaryDirectory() as folder:
        file = robot_file(folder)
        for s in range(first, first + count):
            for temperatures in (True, False):
                numbers = run(s, temperatures, file)
                row = (f"{k}={v:.4g}" if isinstance(v, float) else f"{k}={v}" for k, v in numbers.items())
                print(" ".join(row), flush=True)
