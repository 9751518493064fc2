r"""Error sources with how well each of their parameters is known: from the tables of a robot file, and back.

What is not known, one quantity at a time: a number, and what it changes.

A quantity q has an amount a_q: standard normal, or anything between two limits as likely as anything else (GUM,
type B). One unit of it changes parameters of the sources, the warmth, how far joints turn to forget a reversal, when
the program starts: its cause. Causes add, so a draw of all amounts is one cause, and the position error at waypoint n
moves to first order by

    sum_q a_q c_q(n),      c_q(n) = A(n) dp_q + B(n) drise_q(t_n) + D(n) du_q(n)
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import ndtr

from compgen.core.arrays import Array, nine_digits, owns
from compgen.core.exceptions import InputError
from compgen.core.toml import suggest
from compgen.core.units import DEG
from compgen.error_model.schema import SourcesTable, SourceTable
from compgen.error_model.source import ArmFacts, LoadDependent, Parameter, Source
from compgen.error_model.sources import ORDER
from compgen.thermal.uncertainty import HeatChange, Interval


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


def source_table(known: UncertainSource) -> dict[str, Any]:
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
    return int(value) if isinstance(value, np.integer) else nine_digits(value / unit)


def read_sources(tables: SourcesTable, arm: ArmFacts, where: str) -> tuple[UncertainSource, ...]:
    """The sources of a robot file in the order in which they are folded.

    Args:
        tables: The file's ``sources``.
        arm: What else the file says of the arm.
        where: The file, for messages.

    Raises:
        InputError: A shape, node or key does not fit, named.
    """
    axes = [row.axis for row in tables.map]
    if twice := next((a for a in axes if axes.count(a) > 1), None):
        raise InputError(f"{where}: sources.map: two lines along {twice}; their contributions would add, keep one")
    known: list[UncertainSource] = []
    for kind in ORDER:
        table = getattr(tables, kind.NAME)
        if isinstance(table, list):
            rows = enumerate(table)
            known += [_known(kind, row, arm, f"{where}: sources.{kind.NAME}.{i}") for i, row in rows]
        elif table is not None:
            known.append(_known(kind, table, arm, f"{where}: sources.{kind.NAME}"))
    return tuple(known)


def without_effect(tables: SourcesTable, known: Sequence[UncertainSource]) -> list[str]:
    """Tables of errors that move no tool whatever the arm does, each with what is missing."""
    idle = []
    for name in dict.fromkeys(of.source.NAME for of in known if of.source.NAME in tables.model_fields_set):
        table, sources = getattr(tables, name), [of.source for of in known if of.source.NAME == name]
        has_values = any(np.any(getattr(source, p.field)) for source in sources for p in source.PARAMETERS)
        to_fit = any(row.sigma or row.prior for row in (table if isinstance(table, list) else [table]))
        is_loaded = any(isinstance(source, LoadDependent) and source.loads.act for source in sources)
        if name == "compliance" and has_values and not is_loaded:
            missing = "a mass under gravity, or force_N, in [sources.loads]"
            idle.append(f"[sources.compliance]: nothing loads the joints; give {missing}")
        elif name != "thermal_growth" and not has_values and not to_fit:
            idle.append(f"[sources.{name}]: all its values are zero; give them, or remove it")
    return idle


def read_joint_box(tables: SourcesTable, where: str) -> Array | None:
    """Pendant angles that the parameters hold in, (6, 2) [rad]."""
    if tables.box is None:
        return None
    box = np.array([tables.box.low_deg, tables.box.high_deg]).T * DEG
    if not (box[:, 0] < box[:, 1]).all():
        i = int(np.argmin(box[:, 1] - box[:, 0]))
        raise InputError(f"{where}: sources.box.high_deg.{i}: {tables.box.high_deg[i]:g} must be above low_deg")
    return box


def source_of(kind: type[Source], table: SourceTable, arm: ArmFacts, key: str) -> Source:
    """The source that a table describes.

    Args:
        kind: Its class.
        table: Its table.
        arm: What else the robot file says.
        key: File and table, for messages.

    Raises:
        InputError: The table does not fit the arm or itself.
    """
    derived = kind.derive(table, arm, key)
    fields: dict[str, Any] = {c.field: np.array(getattr(table, c.key)) * c.unit for c in kind.PARAMETERS}
    for fact in kind.FACTS:
        value = getattr(table, fact.key)
        if fact.unit is None:
            fields[fact.field] = value if isinstance(value, str) else tuple(value)
        else:
            fields[fact.field] = np.array(value) * fact.unit
    make: Any = kind
    try:
        source: Source = make(**fields, **derived)
    except ValueError as failure:  # rows of unequal length, or not as many columns as orders
        raise InputError(f"{key}: {failure}; give each row an entry for each order") from None
    return source


def _known(kind: type[Source], table: SourceTable, arm: ArmFacts, key: str) -> UncertainSource:
    source = source_of(kind, table, arm, key)
    prior = prior_of(source) | _deviations(table.prior, source, f"{key}.prior")
    return UncertainSource(source, prior, _deviations(table.sigma, source, f"{key}.sigma"), table.provenance)


def _deviations(rows: Mapping[str, Any], source: Source, key: str) -> dict[str, Array]:
    """Standard deviations by field; one number serves all entries."""
    parameters: dict[str, Parameter] = {p.key: p for p in source.PARAMETERS}
    deviations = {}
    for name, value in rows.items():
        if name not in parameters:
            raise InputError(f"{key}.{name}: unknown key{suggest(name, list(parameters))}")
        parameter = parameters[name]
        shape = np.shape(getattr(source, parameter.field))
        try:
            deviation = np.broadcast_to(np.array(value, dtype=float), shape)
        except (ValueError, TypeError):
            expected = " x ".join(map(str, shape))
            raise InputError(f"{key}.{name}: must be one number, or {expected} as the values are") from None
        if not (np.isfinite(deviation).all() and (deviation >= 0).all()) or isinstance(value, (bool, str)):
            raise InputError(f"{key}.{name}: a standard deviation is a number from 0 up")
        deviations[parameter.field] = np.array(deviation) * parameter.unit
    return deviations


@dataclass(frozen=True, eq=False, slots=True)
@owns(parameters=("P",), width=(6,))
class DrawnCause:
    """How the world differs from what the files say."""

    parameters: Array  # (P,) [SI] of the sources
    heat: HeatChange
    width: Array  # (6,) change of the logarithm of the way over which each joint forgets a reversal
    delay: float = 0.0  # [s] that the program starts late


@dataclass(frozen=True, eq=False, slots=True)
class Quantity:
    """A number that is not known."""

    name: str
    source: str | None  # under which it stands in the budget; None: its parameters' sources
    cause: DrawnCause  # of one unit
    limits: Interval | None = None  # of the amount; None: standard normal

    @property
    def mean(self) -> float:
        """Of the amount."""
        return 0.0 if self.limits is None else (self.limits[0] + self.limits[1]) / 2

    @property
    def deviation(self) -> float:
        """Standard deviation of the amount."""
        return 1.0 if self.limits is None else float((self.limits[1] - self.limits[0]) / np.sqrt(12))

    def amount(self, z: float) -> float:
        """The amount that is as likely to be exceeded as a standard normal number z."""
        if self.limits is None:
            return z
        return float(self.limits[0] + (self.limits[1] - self.limits[0]) * ndtr(z))


def combined(quantities: Sequence[Quantity], amounts: Sequence[float]) -> DrawnCause:
    """The cause of all quantities at some amounts."""
    parts = [(amount, q.cause) for amount, q in zip(amounts, quantities, strict=True)]
    heat = HeatChange(
        rise=np.sum([a * c.heat.rise for a, c in parts], axis=0),
        start=np.sum([a * c.heat.start for a, c in parts], axis=0),
        scale=np.sum([a * c.heat.scale for a, c in parts], axis=0),
        lag=np.sum([a * c.heat.lag for a, c in parts], axis=0),
        air=sum(a * c.heat.air for a, c in parts),
        feed=sum(a * c.heat.feed for a, c in parts),
    )
    return DrawnCause(
        parameters=np.sum([a * c.parameters for a, c in parts], axis=0),
        heat=heat,
        width=np.sum([a * c.width for a, c in parts], axis=0),
        delay=sum(a * c.delay for a, c in parts),
    )
