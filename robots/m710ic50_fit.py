"""Fits the exponents and time constants of m710ic50.toml to m710ic50_temperatures.csv.

    python robots/m710ic50_fit.py

The rises after 6 h at 200 mm/s are held exactly (they define the model's amplitudes); exponent and time constant of
j2, link1, j3 and wrist are fitted to the rest, cooling included; face, never measured alone, follows the wrist. A weak
prior holds the time constants near the 5.91 h of the whole robot's cooling (study line 1428 with errata).
"""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from compgen.core.units import HOUR, MM
from compgen.pipelines.path_file import load_job
from compgen.thermal import Duty, NodeModel

HERE = Path(__file__).parent
FITTED = ("j2", "link1", "j3", "wrist")
PRIOR_TAU_H, PRIOR_WIDTH, SENSOR_K = 5.91, 0.25, 0.3


def measured() -> list[dict[str, str]]:
    with (HERE / "m710ic50_temperatures.csv").open() as file:
        return list(csv.DictReader(file))


def modelled(heat: NodeModel, row: dict[str, str]) -> float:
    """The rise that the model gives for a row; a feed of zero is cooling after the reference duty."""
    feed, hours = float(row["feed_mm_s"]), float(row["hours"])
    duties = [Duty("moving", feed * MM, hours * HOUR)]
    if feed == 0:
        duties = [Duty("moving", heat.reference_feed, heat.reference_time), Duty("off", 0.0, hours * HOUR)]
    return float(heat.rise_after(duties)[heat.names.index(row["node"])])


def misses(heat: NodeModel) -> np.ndarray:
    return np.array([modelled(heat, row) - float(row["rise_K"]) for row in measured()])


def with_parameters(heat: NodeModel, x: np.ndarray) -> NodeModel:
    tau, exponent = heat.tau.copy(), heat.exponent.copy()
    for k, node in enumerate(FITTED):
        for i, name in enumerate(heat.names):
            if name == node or (node == "wrist" and name == "face"):
                tau[i], exponent[i] = np.exp(x[k]) * HOUR, x[len(FITTED) + k]
    return replace(heat, tau=tau, exponent=exponent)


def fit(heat: NodeModel) -> NodeModel:
    def residuals(x: np.ndarray) -> np.ndarray:
        prior = (x[: len(FITTED)] - np.log(PRIOR_TAU_H)) / PRIOR_WIDTH * SENSOR_K
        return np.concatenate([misses(with_parameters(heat, x)), prior])

    start = np.concatenate([np.full(len(FITTED), np.log(PRIOR_TAU_H)), np.full(len(FITTED), 0.5)])
    return with_parameters(heat, least_squares(residuals, start, xtol=1e-12, ftol=1e-12).x)


def main() -> None:
    heat = fit(load_job(str(HERE.parent / "paths" / "circle_1300.toml")).heat)
    for name, exponent, tau in zip(heat.names, heat.exponent, heat.tau):
        print(f"{name:6s} exponent = {exponent:.3f}  tau_h = {tau / HOUR:.2f}")
    off = misses(heat)
    print(f"rms {np.sqrt(np.mean(off**2)):.3f} K, worst {np.abs(off).max():.2f} K over {len(off)} temperatures")


if __name__ == "__main__":
    main()
