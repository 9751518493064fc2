"""Fits the exponents and time constants of m710ic50.toml to m710ic50_temperatures.csv.

    python robots/m710ic50_fit.py

The rises after 6 h at 200 mm/s are held exactly (they define the model's amplitudes); exponent and time constant of
j2, link1, j3 and wrist are fitted to the rest, cooling included; face, never measured alone, follows the wrist. A weak
prior holds the time constants near the 5.91 h of the whole robot's cooling (study line 1428 with errata). What the fit
is worth is said by temperatures that it has not seen, left out one by one, a feed or a part at a time; where that takes
a node's rise at the reference, its amplitude is fitted as well. Only face, measured once, keeps its own.
"""

import csv
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import chi2

from compgen.core.units import HOUR, MM
from compgen.pipelines.files.path_file import load_job
from compgen.thermal import Duty, NodeModel, state_after

HERE = Path(__file__).parent
FITTED = ("j2", "link1", "j3", "wrist")
Rows = list[dict[str, str]]
#: which temperatures are left out of a fit together
GROUPS: dict[str, Callable[[dict[str, str]], str]] = {
    "one by one": lambda row: " ".join(row.values()),
    "a feed at a time": lambda row: row["feed_mm_s"],
    "a part at a time": lambda row: row["node"],
}
PRIOR_TAU_H, PRIOR_WIDTH, SENSOR_K = 5.91, 0.25, 0.3
TETHER_K = 1e-6  # so weakly each number is held at its start: only one that no temperature tells stays there
EXACT_K = 1e-9  # a temperature that defines its node's amplitude is met this well


def measured() -> Rows:
    with (HERE / "m710ic50_temperatures.csv").open() as file:
        return list(csv.DictReader(file))


def modelled(heat: NodeModel, row: dict[str, str]) -> float:
    """The rise that the model gives for a row; a feed of zero is cooling after the reference duty."""
    feed, hours = float(row["feed_mm_s"]), float(row["hours"])
    duties = [Duty("moving", feed * MM, hours * HOUR)]
    if feed == 0:
        duties = [Duty("moving", heat.reference_feed, heat.reference_time), Duty("off", 0.0, hours * HOUR)]
    return float(state_after(heat, duties)[heat.names.index(row["node"])])


def misses(heat: NodeModel, rows: Rows | None = None) -> np.ndarray:
    return np.array([modelled(heat, row) - float(row["rise_K"]) for row in rows or measured()])


def left_out(misses_without: Callable[[Rows, Rows], np.ndarray], group: Callable[[dict[str, str]], str]) -> np.ndarray:
    """How far each temperature is off by a fit that has not seen its group, in their order [K].

    Args:
        misses_without: Misses of the second rows by a fit to the first.
        group: The group of a temperature: itself, a feed, a part.
    """
    rows = measured()
    out = np.zeros(len(rows))
    for name in {group(row): None for row in rows}:
        places = [i for i, row in enumerate(rows) if group(row) == name]
        out[places] = misses_without([row for row in rows if group(row) != name], [rows[i] for i in places])
    return out


def misses_without(seen: Rows, unseen: Rows) -> np.ndarray:
    return misses(fit(shipped(), seen), unseen)


def with_parameters(heat: NodeModel, x: np.ndarray, free: list[int]) -> NodeModel:
    tau, exponent, amplitude = heat.tau.copy(), heat.exponent.copy(), heat.reference_rise.copy()
    amplitude[free] = np.exp(x[2 * len(FITTED) :])
    for k, node in enumerate(FITTED):
        for i, name in enumerate(heat.names):
            if name == node or (node == "wrist" and name == "face"):
                tau[i], exponent[i] = np.exp(x[k]) * HOUR, x[len(FITTED) + k]
    return replace(heat, tau=tau, exponent=exponent, reference_rise=amplitude)


def free_amplitudes(heat: NodeModel, rows: Rows) -> list[int]:
    """Nodes whose rise at the reference is not among the rows, though other temperatures of theirs are."""
    seen = {row["node"] for row in rows}
    held = {row["node"] for row in rows if float(row["feed_mm_s"]) > 0 and abs(misses(heat, [row])[0]) < EXACT_K}
    return [i for i, name in enumerate(heat.names) if name in seen - held]


def fit(heat: NodeModel, rows: Rows | None = None) -> NodeModel:
    """Exponents and time constants; also the amplitudes of nodes whose reference temperature was left out."""
    rows = measured() if rows is None else rows
    free = free_amplitudes(shipped(), rows)
    tau, exponent = np.full(len(FITTED), np.log(PRIOR_TAU_H)), np.full(len(FITTED), 0.5)
    start = np.concatenate([tau, exponent, np.log(heat.reference_rise[free])])

    def residuals(x: np.ndarray) -> np.ndarray:
        prior = (x[: len(FITTED)] - np.log(PRIOR_TAU_H)) / PRIOR_WIDTH * SENSOR_K
        return np.concatenate([misses(with_parameters(heat, x, free), rows), prior, TETHER_K * (x - start)])

    return with_parameters(heat, least_squares(residuals, start, xtol=1e-12, ftol=1e-12).x, free)


def shipped() -> NodeModel:
    heat = load_job(str(HERE.parent / "paths" / "circle_1300.toml")).heat
    if not isinstance(heat, NodeModel):
        raise TypeError("the shipped robot file's heat model in use must be [thermal.nodes]")
    return heat


class SharedError(NamedTuple):
    """What all temperatures of one occasion are off by together, as a standard deviation [K]."""

    likeliest: float
    most: float  # with 95 %
    scatter: float  # of each temperature beside it


def shared_error(off: np.ndarray) -> SharedError:
    """Of temperatures that their fits left out: random effects of the occasions, a feed for so many hours each.

    With N temperatures of k occasions, n_i of each, the mean square between occasions is about the variance within
    them and n times the shared one; its ratio to what is expected is chi-squared over k.
    """
    occasions = [(row["feed_mm_s"], row["hours"]) for row in measured()]
    parts = [off[[o == occasion for o in occasions]] for occasion in dict.fromkeys(occasions)]
    k, N = len(parts), len(off)
    between = sum(len(p) * p.mean() ** 2 for p in parts) / k
    within = sum(((p - p.mean()) ** 2).sum() for p in parts) / (N - k)
    each = (N - sum(len(p) ** 2 for p in parts) / N) / (k - 1)
    likeliest, most = (max(0.0, (b - within) / each) ** 0.5 for b in (between, between * k / chi2.ppf(0.05, k)))
    return SharedError(likeliest, most, float(np.sqrt(within)))


def main() -> None:
    heat = fit(shipped())
    for name, exponent, tau in zip(heat.names, heat.exponent, heat.tau, strict=False):
        print(f"{name:6s} exponent = {exponent:.3f}  tau_h = {tau / HOUR:.2f}")
    off = misses(heat)
    print(f"rms {np.sqrt(np.mean(off**2)):.3f} K, worst {np.abs(off).max():.2f} K over {len(off)} temperatures")
    for name, group in GROUPS.items():
        off = left_out(misses_without, group)
        print(f"left out {name}: rms {np.sqrt(np.mean(off**2)):.3f} K, worst {np.abs(off).max():.2f} K")
    shared = shared_error(left_out(misses_without, GROUPS["one by one"]))
    print(
        f"shared by an occasion: {shared.likeliest:.2f} K, {shared.most:.2f} at most (95 %), each {shared.scatter:.2f}"
    )


if __name__ == "__main__":
    main()
