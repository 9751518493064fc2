r"""Temperature along a link between its nodes, and how much the link grows with each node's rise.

A section from x0 to x1 runs between the rises of two nodes,

    rise(x) = rise_b + (rise_a - rise_b) f(u),    u = (x - x0) / (x1 - x0)

    linear        f(u) = 1 - u
    exponential   f(u) = (r_a (r_b / r_a)^u - r_b) / (r_a - r_b)

with r the rises of the reference state, so that there the profile falls by a constant ratio from r_a to r_b. Because
f is fixed, rise(x) is linear in the node rises: zero, negative and cooling states are defined. Growth of a length is

    dL = cte integral rise(x) dx = cte sum_sections (x1 - x0) (F rise_a + (1 - F) rise_b)

    F = integral f du = 1 / ln(r_a / r_b) - r_b / (r_a - r_b)      (exponential; 1/2 when r_a = r_b or linear)

Source: the reference study, section 4.4.1 (lines 1047-1057) and equation 8, with its errata.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from compgen.core.arrays import Array
from compgen.robot.robot import LengthName


@dataclass(frozen=True, slots=True)
class Section:
    """A stretch of link between two nodes."""

    start: float  # [m]
    end: float  # [m]
    node_a: str  # at the start
    node_b: str  # at the end
    shape: Literal["linear", "exponential"]


@dataclass(frozen=True, slots=True)
class Profile:
    """One heated length."""

    length: LengthName
    cte: float  # [1/K]
    sections: tuple[Section, ...]


def mean_share(shape: str, rise_a: float, rise_b: float) -> float:
    """F: how much of node a's rise the mean of a section carries."""
    if shape == "linear" or abs(rise_a - rise_b) < 1e-9 * max(abs(rise_a), abs(rise_b)):
        return 0.5
    return float(1 / np.log(rise_a / rise_b) - rise_b / (rise_a - rise_b))


def growth_weights(profile: Profile, reference_rise: Mapping[str, float], nodes: Sequence[str]) -> Array:
    """Growth of the length per kelvin of each node, (K,) [m/K]."""
    weights = np.zeros(len(nodes))
    for s in profile.sections:
        share = mean_share(s.shape, reference_rise[s.node_a], reference_rise[s.node_b])
        weights[nodes.index(s.node_a)] += profile.cte * (s.end - s.start) * share
        weights[nodes.index(s.node_b)] += profile.cte * (s.end - s.start) * (1 - share)
    return weights
