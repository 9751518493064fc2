"""A robot file with the identified values in it: what changed, and everything else as the user wrote it.

Nodes without a sensor get the height and the lag that were fitted beside the robot file's, in that file and in words.

The posterior of an identification by the names that the robot file has: what is written beside that file.

Instruments and reflectors are integrated out, and so is what was fitted along and is not written. Rows of the width of
lost motion, which reversal runs tell before the fit, stand alone.
"""

import tomllib
from collections.abc import Iterator, Mapping, MutableMapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import InlineTable, Item, Table

from compgen.core.arrays import Array, nine_digits
from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.units import DEG
from compgen.error_model.posterior import KnownParameter, ParameterPosterior
from compgen.error_model.source import DirectionDependent, Extensible, Source, Visibility
from compgen.error_model.uncertain_sources import UncertainSource, source_table
from compgen.identification.fit import Fit
from compgen.identification.identify import Identification
from compgen.identification.model import ArmModel, FreeParameter
from compgen.identification.reversals import SPREAD
from compgen.robot.robot import Robot
from compgen.thermal.law_fit import PLAUSIBLE

PER_DEGREE = 1000  # steps to which the box is widened
_MEND = "give each source a table [sources.<name>] of its own"
LEAST = 0.1  # share that the measurements determine, below which the file's value stays


def robot_text(
    text: str, known: Sequence[UncertainSource], box: Array, provenance: str, record: Mapping[str, Any]
) -> str:
    """The robot file's text with the identified sources; comments, order and all other values stay.

    Values go into the tables that the file has, new tables after its last line. What the file says of priors stays
    as it is written.

    Args:
        text: The file that was identified.
        known: Sources; those with a sigma were identified.
        box: Range of pendant angles that the poses cover, (6, 2) [rad].
        provenance: Where the values are from.
        record: The table ``identified``.

    Raises:
        InputError: The file's tables are laid out in a way that cannot be updated.
    """
    identified = {
        entry.source.NAME: {**source_table(entry), "provenance": provenance} for entry in known if entry.sigma
    }
    return _updated(text, {"identified": record}, {"box": box_table(box), **identified}, _MEND)


def text_with_sources(text: str, sources: Mapping[str, Any]) -> str:
    """A robot file's text with tables of ``[sources]``, by their names, in it; comments, order and all else stay.

    Raises:
        InputError: The file's tables are laid out in a way that cannot be updated.
    """
    return _updated(text, {}, sources, _MEND)


def box_table(box: Array) -> dict[str, Any]:
    """A box of pendant angles (6, 2) [rad] as the table of a robot file [deg], rounded outwards."""
    low, high = box.T / DEG
    return {"low_deg": np.floor(low * PER_DEGREE) / PER_DEGREE, "high_deg": np.ceil(high * PER_DEGREE) / PER_DEGREE}


def _plain(value: Any) -> Any:
    """Tables and lists of Python's own numbers; floats have the nine digits that the file gives them."""
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [_plain(entry) for entry in value]
    if isinstance(value, (float, np.floating)):
        return nine_digits(float(value))
    return value


def text_with_table(text: str, name: str, values: Mapping[str, Any]) -> str:
    """A robot file's text with one table's values in it; comments, order and all else stay.

    Raises:
        InputError: The file's tables are laid out in a way that cannot be updated.
    """
    return _updated(text, {name: values}, {}, f"give [{name}] a table of its own")


def _updated(text: str, tables: Mapping[str, Any], sources: Mapping[str, Any], mend: str) -> str:
    """The text with tables, and tables of ``[sources]``, by their names; read again, it says nothing else."""
    expected = tomllib.loads(text)
    try:
        updated = _update(text, expected, _plain(tables), _plain(sources))
    except TOMLKitError as exception:
        raise InputError(f"robot file: cannot be updated: {exception}; {mend}") from None
    check_written(updated, expected)
    return updated


def _update(text: str, expected: dict[str, Any], tables: dict[str, Any], sources: dict[str, Any]) -> str:
    """The text with new values; ``expected``, what it says, gets them too."""
    document, added = tomlkit.parse(text), tomlkit.document()
    for name, values in tables.items():
        _merge(document, expected, added, name, values)
    old_sources: Any = document.get("sources", {})
    added_sources: Any = old_sources if isinstance(old_sources, InlineTable) else tomlkit.table(is_super_table=True)
    for name, values in sources.items():
        _merge(old_sources, expected.setdefault("sources", {}), added_sources, name, values)
    if added_sources is not old_sources and len(added_sources):
        added.append("sources", added_sources)
    updated = tomlkit.dumps(document)
    return updated.rstrip("\n") + "\n\n" + tomlkit.dumps(added) if len(added) else updated


def _merge(tables: Any, expected: dict[str, Any], added: Any, name: str, values: dict[str, Any]) -> None:
    """Put a table's values into the table of that name, or into a new one, and into what the file shall say."""
    if name in tables:
        if "prior" in expected[name] and _same_shapes(expected[name]["prior"], values.get("prior", {})):
            values = {**values, "prior": expected[name]["prior"]}
        _set(tables, name, values)
    else:
        added[name] = _inline(values) if isinstance(added, InlineTable) else _table(values)
    expected[name] = values


def _same_shapes(old: Mapping[str, Any], new: Mapping[str, Any]) -> bool:
    """Whether priors that the file gives still fit: a table of terms may have got more of them."""
    return not any(np.ndim(value) and np.shape(value) != np.shape(new.get(key, value)) for key, value in old.items())


def _set(container: Any, key: Any, value: Any) -> None:
    """Give an entry its value; what is equal keeps its digits, and all entries keep their comments."""
    old = container[key]
    if isinstance(value, dict) and isinstance(old, MutableMapping):
        for stale in [name for name in old if name not in value]:
            del old[stale]
        for name, entry in value.items():
            if name in old:
                _set(old, name, entry)
            else:
                _append(old, name, _inline(entry) if isinstance(entry, dict) else _item(entry))
    elif isinstance(value, list) and isinstance(old, list) and len(old) == len(value):
        for i, entry in enumerate(value):
            _set(old, i, entry)
    elif old != value:
        container[key] = _item(value)


def _append(table: Any, name: str, item: Item) -> None:
    """Add an entry after the last one, above the comments that close the table: those belong to the next."""
    body = table.value.body if isinstance(table, Table) else []
    closing = []
    while body and body[-1][0] is None:
        closing.append(body.pop())
    table[name] = item
    body.extend(reversed(closing))


def _item(value: Any) -> Item:
    if isinstance(value, list):
        array = tomlkit.array()
        array.multiline(any(isinstance(entry, list) for entry in value))
        array.extend(_item(entry) for entry in value)
        return array
    item: Item = tomlkit.value(f"{value:.9g}") if isinstance(value, float) else tomlkit.item(value)
    return item


def _table(values: Mapping[str, Any]) -> Item:
    table = tomlkit.table()
    for key, value in sorted(values.items(), key=lambda entry: isinstance(entry[1], dict)):  # tables after values
        table.append(key, _table(value) if isinstance(value, dict) else _item(value))
    return table


def _inline(values: Mapping[str, Any]) -> Item:
    table = tomlkit.inline_table()
    for key, value in values.items():
        table.append(key, _inline(value) if isinstance(value, dict) else _item(value))
    return table


def check_written(text: str, expected: Mapping[str, Any]) -> None:
    """Raises InputError unless a text says what it shall."""
    try:
        if tomllib.loads(text) == expected:
            return
    except tomllib.TOMLDecodeError:
        pass
    raise InputError(f"robot file: cannot be updated: its sources are laid out in an unusual way; {_MEND}")


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorlessNode:
    """What the fit says of a node's rise: factors on the robot file's rise_K and tau_h."""

    name: str
    height: float
    height_sigma: float
    lag: float
    is_plausible: bool  # whether both are within three sigmas of what a node can be
    is_known: bool  # and the measurements say more than the file

    def written(self, rise_K: float, tau_h: float) -> tuple[float, float]:
        """Rise and time constant for the file, from those that it has."""
        return float(f"{rise_K * self.height:.4g}"), float(f"{tau_h * self.lag:.4g}")


def sensorless_nodes(model: ArmModel, fitted: Fit, names: Sequence[str]) -> list[SensorlessNode]:
    """Of a fit with a log; none where every node had a sensor.

    Args:
        model: That was fitted.
        fitted: The fit that was selected.
        names: Of the heat model's nodes.
    """
    free = [(p, k) for k, p in enumerate(model.parameters) if p.source == "warm_up" and fitted.active[k]]
    heights, lags = ({p.index[0]: k for p, k in free if p.field == field} for field in ("height", "lag"))
    nodes = []
    for node, at in heights.items():
        lag, height = lags[node], 1 + float(fitted.p[at])
        is_plausible = height > 0 and bool((np.abs(fitted.p) <= PLAUSIBLE * model.prior)[[at, lag]].all())
        nodes.append(
            SensorlessNode(
                name=names[node],
                height=height,
                height_sigma=float(fitted.sigma[at]),
                lag=float(np.exp(fitted.p[lag])),
                is_plausible=is_plausible,
                is_known=is_plausible and bool(fitted.gamma[at] > LEAST),
            )
        )
    return nodes


def with_sensorless_nodes(text: str, nodes: Sequence[SensorlessNode]) -> str:
    """A robot file with ``rise_K`` and ``tau_h`` of these nodes as fitted; the others stay."""
    known = {node.name: node for node in nodes if node.is_known}
    tables = tomllib.loads(text)["thermal"]["node"] if known else []
    values = {t["name"]: known[t["name"]].written(t["rise_K"], t["tau_h"]) for t in tables if t["name"] in known}
    return text_with_nodes(text, {n: {"rise_K": rise, "tau_h": tau} for n, (rise, tau) in values.items()})


def text_with_nodes(text: str, values: Mapping[str, Mapping[str, float]]) -> str:
    """A robot file's text with values of its ``[[thermal.node]]``, by their names; the others stay."""
    document: Any = tomlkit.parse(text)
    for table in document["thermal"]["node"] if values else ():
        for key, value in values.get(str(table["name"]), {}).items():
            if key in table:
                table[key] = value
            else:
                _append(table, key, _item(value))
    return str(tomlkit.dumps(document))


def sensorless_findings(nodes: Sequence[SensorlessNode], *, is_written: bool) -> Iterator[Finding]:
    """What was fitted of nodes without a sensor, in words.

    Args:
        nodes: As fitted.
        is_written: Whether the robot file can carry it: nodes, not a network.
    """
    for node in nodes:
        if node.is_known:
            ending = "rise_K and tau_h are written" if is_written else "a network's file cannot carry it: not written"
            yield Finding.of(
                Code.LOG_FITTED,
                f"{node.name} has no sensor: it rose {node.height:.2f} +- {node.height_sigma:.2f} times what the file "
                f"says beside the others, with {node.lag:.2f} times its time constant; {ending}",
            )
        elif not node.is_plausible:
            yield Finding(
                Level.WARNING,
                Code.HELD,
                f"{node.name} has no sensor: the fit asks for {node.height:.3g} times its rise with {node.lag:.3g} "
                f"times its time constant, beyond {PLAUSIBLE:g} sigmas of what a node can be: the log does not show "
                "it, its rise_K and tau_h stay; put a sensor on it",
            )


def posterior_of(
    identification: Identification, numbers: Mapping[str, tuple[KnownParameter, float]], nodes: frozenset[int]
) -> ParameterPosterior:
    """What the fit knows of the parameters that a robot file carries.

    Args:
        identification: Whose values are in the file.
        numbers: Of that file, by name, as ``error_model.posterior.numbers_of`` gives them.
        nodes: Without a sensor, whose rise and time constant are written as fitted.
    """
    fit, free = identification.selected.fit, identification.model.parameters
    written = {k.source.NAME: k.source for k in identification.known if k.sigma}
    rows, names, scale = [], [], []
    for row, k in enumerate(np.flatnonzero(fit.active).tolist()):
        name = _name(free[k], written.get(free[k].source), identification.robot, nodes)
        if name not in numbers:
            continue
        rows.append(row)
        names.append(name)
        scale.append(identification.model.prior[k] * _per_unit(free[k], numbers[name][1], float(fit.p[k])))
    of_fit = np.array(scale)[:, None] * fit.posterior.covariance[np.ix_(rows, rows)] * np.array(scale)
    widths = _width_sigmas(identification, numbers)
    covariance = np.zeros((len(rows) + len(widths), len(rows) + len(widths)))
    covariance[: len(rows), : len(rows)] = of_fit
    covariance[len(rows) :, len(rows) :] = np.diag(np.square(list(widths.values())))
    known = [numbers[name] for name in (*names, *widths)]
    return ParameterPosterior(tuple(p for p, _ in known), np.array([value for _, value in known]), covariance)


def _name(parameter: FreeParameter, source: Source | None, robot: Robot, nodes: frozenset[int]) -> str:
    """A fitted parameter's name in the robot file; none where it is not written."""
    key, index = parameter.key, parameter.index
    if parameter.source == "warm_up" and parameter.field in ("height", "lag") and index[0] in nodes:
        return f"thermal.node.{'rise_K' if parameter.field == 'height' else 'tau_h'}[{index[0] + 1}]"
    if source is None:
        return ""
    if isinstance(source, Extensible):  # terms that were not needed are gone, the others have moved up
        terms = source.entries_to_fit(Visibility(robot, tuple(range(6)), warm_up=True, temperatures=True))
        index = next((term.index for term in terms if term.label == parameter.label), ())
    return f"{parameter.source}.{key}[{','.join(str(i + 1) for i in index)}]"


def _per_unit(parameter: FreeParameter, value: float, p: float) -> float:
    """How much a number of the file changes with its parameter: factors act on a node's rise and time constant."""
    if parameter.source != "warm_up":
        return 1.0
    return value / (1 + p) if parameter.field == "height" else value


def _width_sigmas(
    identification: Identification, numbers: Mapping[str, tuple[KnownParameter, float]]
) -> dict[str, float]:
    """Standard deviations of the widths of joints that play [rad], by name: from runs, else what is assumed of any."""
    motion = identification.lost_motion
    of_log = np.full(6, SPREAD) if motion is None else np.minimum(motion.width_sigma, SPREAD)
    joints = {
        f"{known.source.NAME}.width_mdeg[{i + 1}]": i
        for known in identification.known
        if isinstance(known.source, DirectionDependent) and "backlash" in known.sigma
        for i in np.flatnonzero(known.sigma["backlash"]).tolist()
    }
    return {name: numbers[name][1] * float(of_log[i]) for name, i in joints.items()}
