"""least_squares on the hot arm, pose by pose, and solve_ivp on a warming robot; answers seconds a pose and an hour."""

import json
import sys

import numpy as np
from chain import flange, off
from clock import median
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

question = json.load(sys.stdin)
answer = {}

if "hot" in question:
    hot, cold, theta = (np.array(question[name]) for name in ("hot", "cold", "theta"))
    theta = theta[:20]
    poses = [flange(cold, q) for q in theta]

    def solved(T, start):
        """The joints that bring the hot arm's flange to a pose."""

        def residual(q):
            found = flange(hot, q)
            turn = Rotation.from_matrix(T[:3, :3].T @ found[:3, :3]).as_rotvec()
            return np.concatenate([found[:3, 3] - T[:3, 3], turn])

        return least_squares(residual, start, method="lm", xtol=1e-12, ftol=1e-12, gtol=1e-12).x

    def every():
        """Joints of every pose."""
        return [solved(T, q) for T, q in zip(poses, theta, strict=False)]

    answer["least_squares"] = median(every) / len(theta)
    answer["least_squares off"] = off(hot, every(), poses)

if "rate" in question:
    matrix, powers = np.array(question["matrix"]), np.array(question["powers"])  # [1/s], [K/s] of each duty
    spans, hours = question["spans"], question["hours"]  # [s] of each duty, in turn

    def day():
        """Rises at every second, (V, T)."""
        rise, now, seen, k = np.zeros(len(matrix)), 0.0, [], 0
        while now < hours * 3600:
            end = min(now + spans[k % len(spans)], hours * 3600)
            power = powers[k % len(spans)]
            at = np.append(np.arange(np.ceil(now), end), end)
            done = solve_ivp(
                lambda t, y, power=power: matrix @ y + power,
                (now, end), rise, "BDF", at, jac=matrix, rtol=question["rate"], atol=question["rate"],
            )  # fmt: skip
            seen.append(done.y[:, :-1])
            rise, now, k = done.y[:, -1], end, k + 1
        return np.column_stack([*seen, rise])

    answer["solve_ivp"] = median(day) / hours
    answer["rises"] = day().T[:: question["every"]].tolist()

print(json.dumps(answer))
