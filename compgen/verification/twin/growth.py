r"""How the twin's lengths grow with the rises of the nodes: thin elements of each link's profile, summed.

    growth per kelvin of node a = sum over elements of cte dx share_a,      share_b = 1 - share_a

A section of a profile lies between two nodes a and b; share_a is node a's part of the rise at the middle of an element,
by the fixed shape of the reference state.
"""

from collections.abc import Sequence

import numpy as np

from compgen.core.arrays import Array
from compgen.thermal import Profile, Section, ThermalModel
from compgen.verification.twin.nominal_arm import LENGTHS

ELEMENT = 0.1e-3  # m


def growth_per_kelvin(heat: ThermalModel, profiles: Sequence[Profile]) -> Array:
    """Growth of each of ``LENGTHS`` per kelvin of each node, (K, 6) [m/K]."""
    reference = dict(zip(heat.names, heat.reference_rise.tolist(), strict=True))
    growth = np.zeros((len(heat.names), len(LENGTHS)))
    for profile in profiles:
        column = list(LENGTHS).index(profile.length)
        for s in profile.sections:
            a, b = (heat.names.index(n) for n in (s.node_a, s.node_b))
            count = max(1, round((s.end - s.start) / ELEMENT))
            share = _element_shares(s, reference, count)
            element = profile.cte * (s.end - s.start) / count
            growth[a, column] += element * share.sum()
            growth[b, column] += element * (1 - share).sum()
    return growth


def _element_shares(section: Section, reference: dict[str, float], count: int) -> Array:
    """Share of node a's rise at the middle of each element, (count,)."""
    u = (np.arange(count) + 0.5) / count
    ra, rb = reference[section.node_a], reference[section.node_b]
    if section.shape == "linear" or ra == rb:
        return 1 - u
    return np.asarray((ra ** (1 - u) * rb**u - rb) / (ra - rb))
