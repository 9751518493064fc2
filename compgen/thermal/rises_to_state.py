r"""The modal state of a thermal model that shows given rises.

A model with more modes than rises leaves open how the warmth lies between the places that are named. Of all states with
rises y, the most likely one is taken where states come about by heat in the drives' housings and by the air,

    z' = z + G (y - O z),      G = Z O^T (O Z O^T)^-1,      Z = sum_m g_m g_m^T + a a^T + r^2 I

with O the outputs, g_m the steady states of heat in each housing and a that of the air, each so large that it warms a
named place by one kelvin at most; r^2 I is heat that lies anywhere, of little size. A model whose modes are its rises
has one such state only. Source: the conditional mean of a normal distribution.
"""

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.thermal.network import NetworkModel
from compgen.thermal.node_model import NodeModel

ANYWHERE = 0.01  # r, of the largest of the others


def state_gain(heat: NodeModel | NetworkModel, which: IntArray) -> Array:
    """What one kelvin more at each of some rises, (P,) numbers, does to the state, (S, P)."""
    if isinstance(heat, NodeModel):
        return np.eye(len(heat.rate))[:, which]
    kinds = np.unique(heat.volumes.power, axis=0)
    goals = heat.steady_state_of(kinds[kinds.any(axis=1)])
    outputs = heat.outputs[which]
    goals = np.vstack([goals / np.abs(goals @ heat.outputs.T).max(axis=1, keepdims=True), heat.ambient])
    spread = goals.T @ goals
    spread += ANYWHERE**2 * np.trace(spread) / len(spread) * np.eye(len(spread))
    return np.asarray(spread @ outputs.T @ np.linalg.inv(outputs @ spread @ outputs.T))


def state_with_rises(heat: NodeModel | NetworkModel, which: IntArray, rise: Array, state: Array | None = None) -> Array:
    """A state that shows rises.

    Args:
        heat: The model.
        which: Numbers of the rises that are known, (P,).
        rise: (P,) [K].
        state: From which it differs by as little as is likely, (S,); None: cold.

    Returns:
        (S,).
    """
    state = np.zeros(len(heat.rate)) if state is None else state
    return np.asarray(state + state_gain(heat, which) @ (rise - heat.outputs[which] @ state))
