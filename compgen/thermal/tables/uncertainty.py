"""The table of a robot file for how well its warmth is known."""

from collections.abc import Sequence

import numpy as np

from compgen.core.exceptions import InputError
from compgen.core.units import HOUR, PERCENT, UM
from compgen.thermal import Profile
from compgen.thermal.model import ThermalModel
from compgen.thermal.tables import schema as sc
from compgen.thermal.uncertainty import Interval, ThermalUncertainty

#: of a file that says nothing: what a class of such arms may be off by, wider than any that was measured
LAW, SENSORS, AIR, FEED, MISSING = 1.0, 0.5, 1.0, 0.02, 0.15


def uncertainty_of(
    thermal: sc.ThermalTable, heat: ThermalModel, profiles: tuple[Profile, ...], where: str
) -> ThermalUncertainty:
    """How well a robot file knows its warmth.

    Args:
        thermal: Its table.
        heat: The model that is used.
        profiles: Of the heated lengths.
        where: The file, for messages.

    Raises:
        InputError: Intervals that do not rise, or of lengths that do not grow.
    """
    table = thermal.uncertainty or sc.UncertaintyTable()
    key = f"{where}: thermal.uncertainty"
    ctes = {profile.cte for profile in profiles}
    expansion: Interval | None = None
    if table.cte_um_m_K is not None:
        low, high = table.cte_um_m_K
        _check_rising(table.cte_um_m_K, f"{key}.cte_um_m_K")
        cte = next(iter(ctes), 0.0) / UM
        if len(ctes) == 1 and cte:  # lengths with coefficients of their own keep the priors of their own
            expansion = low / cte - 1, high / cte - 1
    growth = _growth_of(table, [profile.length for profile in profiles], key)
    is_network = heat.law is None
    if is_network:
        growth = {length: _from_the_other_end(limits) for length, limits in growth.items()}

    def value_or(value: float | None, assumed: float, unit: float = 1.0) -> float:
        return assumed if value is None else value * unit

    # the network has other names; its errors build up like the arm as a whole
    lag = np.array([node.tau_h for node in thermal.node]) * HOUR
    if is_network:
        lag = np.full(len(heat.names), float(lag.mean()))
    return ThermalUncertainty(
        law=value_or(table.law_K, LAW),
        sensors=value_or(table.sensors_K, SENSORS),
        air=value_or(table.air_K, AIR),
        feed=value_or(table.feed_percent, FEED, PERCENT),
        missing=value_or(table.missing_percent, MISSING, PERCENT),
        lag=lag,
        reference_time=thermal.reference_h * HOUR,
        idle=thermal.idle_fraction,
        expansion=expansion,
        growth=growth,
        own=None if is_network else np.array([np.nan if n.law_K is None else n.law_K for n in thermal.node]),
        is_assumed=not table.model_dump(exclude={"provenance"}, exclude_defaults=True),
    )


def _growth_of(table: sc.UncertaintyTable, grown: Sequence[str], key: str) -> dict[str, Interval]:
    """How much each length that grows may grow beside its profile, less one."""
    growth: dict[str, Interval] = {}
    for length, limits in table.growth_percent.items():
        _check_rising(limits, f"{key}.growth_percent.{length}")
        if length not in grown:
            raise InputError(f"{key}.growth_percent.{length}: no profile; they are of {', '.join(grown)}")
        growth[length] = limits[0] * PERCENT, limits[1] * PERCENT
    return growth


def _from_the_other_end(limits: Interval) -> Interval:
    """An interval over one model's growth as one over the other's, which is its farther end."""
    other = 1 + max(limits, key=abs)
    return ((1 + limits[0]) / other - 1, (1 + limits[1]) / other - 1) if other > 0 else limits


def _check_rising(limits: list[float], key: str) -> None:
    if limits[0] > limits[1]:
        raise InputError(f"{key}: {limits} must rise; give the lower end first")
