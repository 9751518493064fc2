"""Which starts stand for an ensemble: weighted ones for its means, and those that a proof flies."""

from itertools import product
from typing import TypeVar

import numpy as np

from compgen.core.arrays import Array
from compgen.thermal.ensemble import Ensemble, Start

DELAYS, DELAYS_OF_MANY = 33, 9  # evenly, alone or with runs or overrides
MOST_OF_A_KIND = 9  # runs, and overrides
NODES = 8  # of the quadrature over the delays
T = TypeVar("T")


def weighted_starts(ensemble: Ensemble) -> tuple[list[Start], Array]:
    """Starts evenly over an ensemble, both ends among them, and how much each counts in a mean, (G,); some nothing."""
    runs, of_run = _some(ensemble.run_numbers.tolist())
    overrides, of_override = _some(list(ensemble.overrides))
    low, high = ensemble.delay
    node, weight = np.polynomial.legendre.leggauss(NODES)
    delays, share = np.array([low]), np.ones(1)
    if high > low:
        even = np.linspace(low, high, DELAYS if len(runs) * len(overrides) == 1 else DELAYS_OF_MANY)
        delays = np.concatenate([even, low + (high - low) * (node + 1) / 2])
        share = np.concatenate([np.zeros(len(even)), weight / 2])
        order = np.argsort(delays, kind="stable")
        delays, share = delays[order], share[order]
    starts = [Start(*values) for values in product(runs, delays.tolist(), overrides)]
    weights = np.einsum("r,d,o->rdo", of_run, share, of_override).ravel()
    return starts, np.asarray(weights / weights.sum())


def starts_to_fly(ensemble: Ensemble, *foretold: Start) -> list[Start]:
    """Corners, middle and what is foretold to be the worst, each once."""
    runs, delays, overrides = ensemble.run_numbers.tolist(), ensemble.delay, ensemble.overrides
    ends = product(_ends(runs), _ends(list(delays)), _ends(list(overrides)))
    corners = [Start(*values) for values in ends]
    middle = Start(runs[len(runs) // 2], sum(delays) / 2, overrides[len(overrides) // 2])
    return list(dict.fromkeys([*corners, middle, *foretold]))


def _ends(values: list[T]) -> list[T]:
    return list(dict.fromkeys([values[0], values[-1]]))


def _some(values: list[T]) -> tuple[list[T], Array]:
    """Values evenly over a list, both ends among them, and how many each of them stands for."""
    rows = np.linspace(0, len(values) - 1, min(len(values), MOST_OF_A_KIND)).round().astype(int)
    nearest = np.abs(np.arange(len(values))[:, None] - rows).argmin(axis=1)
    return [values[k] for k in rows.tolist()], np.bincount(nearest).astype(float)
