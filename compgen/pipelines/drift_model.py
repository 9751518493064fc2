r"""What drifts from shift to shift, and what it does to a point of the tool: the linear model of touches.

    x = (rises of K nodes [K], shift of the base in World [m], its turn [rad])

A rise that is x off when the touches are made is exp(-rate t) x off t later, through the heat model's modes; the base
stays. The actual position of a tool moves by

    C x = (B F(t), A_base) x,      B = d p_actual / d rise,  A_base = d p_actual / d base,  F(t) = O exp(-rate t) O^+

What is known of x beforehand is what the files leave open at the start: of the rises the forecast's uncertainty, or
that of the state that stands in place of history; of the base what that state leaves open, else how far it may have
moved since the robot file was made.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, own
from compgen.core.pose import Pose
from compgen.core.units import MDEG, UM
from compgen.error_model.direction_memory import NO_DIRECTION
from compgen.error_model.knowledge import build_slopes, parameters_of
from compgen.pipelines.job import Cell, Job
from compgen.pipelines.state_in_place import base_rows
from compgen.pipelines.uncertainty import quantities_of_cell
from compgen.thermal.uncertainty import HeatChange, missed_rise, rise_by_air, rise_by_model

BASE_SHIFT = 50 * UM  # standard deviation of each coordinate since the robot file was made [assumed]
BASE_TURN = 3 * MDEG  # of each turn [assumed]
BASE = 6


@dataclass(frozen=True, eq=False, slots=True)
class DriftPrior:
    """What is known of x before any touch."""

    covariance: Array  # (K + 6, K + 6)

    def __post_init__(self) -> None:
        own(self, covariance=("X", "X"))


def forecast_prior(job: Job) -> DriftPrior:
    """Of a job's own history, or of the state in its place, at its planned start."""
    cell = job.cell
    K, uncertainty = len(cell.heat.names), quantities_of_cell(cell)
    base = base_rows(uncertainty.parameters)
    covariance = np.zeros((K + BASE, K + BASE))
    for quantity in uncertainty.quantities:
        change = quantity.cause.heat
        column = np.concatenate([_rise_at_start(job, change), quantity.cause.parameters[base]])
        covariance += (quantity.deviation**2 + quantity.mean**2) * np.outer(column, column)
    if cell.state is None:
        covariance[K:, K:] += np.diag(np.repeat([BASE_SHIFT, BASE_TURN], 3) ** 2)
    return DriftPrior(covariance)


def _rise_at_start(job: Job, change: HeatChange) -> Array:
    """What a change of the heat adds to the rises when the program starts, (K,) [K]."""
    cell, history, now = job.cell, job.history, np.zeros(1)
    rise = missed_rise(cell.warmth, cell.heat, history, change, now)
    rise = rise + change.air * rise_by_air(cell.heat, history, now)
    if change.changes_model:
        rise = rise + rise_by_model(cell.warmth, cell.heat, history, job.feed, change, now)
    return np.asarray(rise[0])


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
