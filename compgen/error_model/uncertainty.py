"""A source with how well its parameters are known: what a robot file carries, and identification changes."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.error_model.source import Source


@dataclass(frozen=True, eq=False, slots=True)
class UncertainSource:
    """A source, and for each of its parameters how far it may be off, by field, in SI and in the parameter's shape."""

    source: Source
    prior: Mapping[str, Array]  # standard deviation before measurements; zero holds an entry
    sigma: Mapping[str, Array]  # after them; empty when the values were never identified
    provenance: str  # where the values are from


def prior_of(source: Source) -> dict[str, Array]:
    """The declared standard deviations in the shape of each parameter."""
    return {p.field: np.full(np.shape(getattr(source, p.field)), p.prior) for p in source.PARAMETERS}


def table_of(known: UncertainSource) -> dict[str, Any]:
    """A source's table in the robot file: facts, provenance, values, sigma, prior where it is not the declared one."""
    source = known.source
    table: dict[str, Any] = {f.key: _listed(getattr(source, f.field), f.unit) for f in source.FACTS}
    if known.provenance:
        table["provenance"] = known.provenance
    declared = prior_of(source)
    for p in source.PARAMETERS:
        table[p.key] = _listed(getattr(source, p.field), p.unit)
    for name, values in (("sigma", known.sigma), ("prior", known.prior)):
        rows = {
            p.key: _listed(values[p.field], p.unit)
            for p in source.PARAMETERS
            if p.field in values and not (name == "prior" and np.array_equal(values[p.field], declared[p.field]))
        }
        if rows:
            table[name] = rows
    return table


def _listed(value: Any, unit: float | None) -> Any:
    """Numbers of a file, with nine digits for its readers; whole numbers and words stay."""
    if np.ndim(value):
        return [_listed(entry, unit) for entry in value]
    if unit is None:
        return str(value)
    return int(value) if isinstance(value, np.integer) else float(f"{value / unit:.9g}")
