r"""What drifts from shift to shift, and what it does to a point of the tool: the linear model of touches.

    x = (rises of K nodes [K], shift of the base in World [m], its turn [rad])

A rise that is x off when the touches are made is exp(-rate t) x off t later, through the heat model's modes; the base
stays. The actual position of a tool moves by

    C x = (B F(t), A_base) x,      B = d p_actual / d rise,  A_base = d p_actual / d base,  F(t) = O exp(-rate t) O^+

What is known of x beforehand: of the rises what the thermal forecast leaves open at the start, of the base the spread
that touches find from day to day.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, own
from compgen.core.pose import Pose
from compgen.core.units import MDEG, UM
from compgen.error_model.direction_memory import NO_DIRECTION
from compgen.error_model.knowledge import build_slopes, parameters_of
from compgen.pipelines.job import Cell, Job
from compgen.pipelines.uncertainty import quantities_of_cell
from compgen.thermal.uncertainty import missed_rise, rise_by_air, rise_by_model

BASE_SHIFT = 50 * UM  # standard deviation of each coordinate from day to day [assumed]
BASE_TURN = 3 * MDEG  # of each turn [assumed]
BASE = 6


@dataclass(frozen=True, eq=False, slots=True)
class DriftPrior:
    """What is known of x before any touch."""

    covariance: Array  # (K + 6, K + 6)

    def __post_init__(self) -> None:
        own(self, covariance=("X", "X"))


def forecast_prior(job: Job) -> DriftPrior:
    """Of the forecast of a job's own history, at its planned start."""
    history, warmth, heat = job.history, job.cell.warmth, job.cell.heat
    K, now = len(heat.names), np.zeros(1)
    by_air = rise_by_air(heat, history, now)[0]
    P = np.zeros((K, K))
    for quantity in quantities_of_cell(job.cell).quantities:
        change = quantity.cause.heat
        rise = missed_rise(warmth, heat, history, change, now)[0] + change.air * by_air
        if change.changes_model:
            rise = rise + rise_by_model(warmth, heat, history, job.feed, change, now)[0]
        P += (quantity.deviation**2 + quantity.mean**2) * np.outer(rise, rise)
    covariance = np.zeros((K + BASE, K + BASE))
    covariance[:K, :K] = P
    covariance[K:, K:] = np.diag(np.repeat([BASE_SHIFT, BASE_TURN], 3) ** 2)
    return DriftPrior(covariance)


def drift_columns(cell: Cell, theta: Array, rise: Array, later: Array, tool: Pose) -> Array:
    """C at M poses, (M, 3, K + 6).

    Args:
        cell: The robot.
        theta: Commanded joints (M, 6) [rad].
        rise: Rises there (M, K) [K].
        later: How long after the touches (M,) [s].
        tool: Whose position, in the flange.
    """
    parameters, heat = parameters_of(cell.sources), cell.heat
    which = tuple(n for part in parameters.base() for n in part)
    A, B, _ = build_slopes(cell.robot, parameters, which, len(heat.names), tool)(theta, rise, NO_DIRECTION)
    decay = np.exp(-np.outer(later, heat.rate))  # (M, S)
    F = np.einsum("ks,ms,sj->mkj", heat.outputs, decay, np.linalg.pinv(heat.outputs))
    return np.concatenate([B @ F, A], axis=2)
