"""Two outputs side by side as data; docs/compare.md has the keys."""

import json
from collections.abc import Iterable
from typing import Any

import numpy as np

from compgen.core.arrays import rms
from compgen.core.units import MDEG, UM
from compgen.pipelines.comparison.comparison import Comparison, FindingText, Pair
from compgen.pipelines.comparison.outputs import Output
from compgen.pipelines.comparison.positions import Movement
from compgen.pipelines.comparison.scenarios import MatchedScenarios
from compgen.report.key_words import unit_of, words_of

SCHEMA = 1
SHORT_LIST = 6  # values, up to which a list is shown whole
MILLIMETRE = 1000  # [um] from which a distance is shown in mm
WHOLE = 1e15  # below it a float without a fraction is shown as a whole number
_SIDES = {"on_part.before": "before, on the part", "on_part.after": "after, on the part", "before": "before",
          "after": "after", "largest": "largest of all scenarios", "least": "least of all scenarios",
          "band.first": "first run", "band.largest": "run that errs most"}  # fmt: skip


def comparison_record(comparison: Comparison) -> dict[str, Any]:
    """Everything a comparison says, in plain types."""
    scenarios = comparison.scenarios
    return {
        "schema": SCHEMA,
        "kind": comparison.kind,
        "a": whose_output(comparison.a),
        "b": whose_output(comparison.b),
        "equal": comparison.is_equal,
        "notes": list(comparison.notes),
        "inputs": [{"key": p.key, "a": p.a, "b": p.b, "unit": unit_of(p.key)} for p in comparison.inputs],
        **{name: [_pair(p) for p in getattr(comparison, name)] for name in ("error", "time", "program")},
        "final_error_um": comparison.final_error,
        "positions": _positions(comparison.movement),
        "scenarios": None if scenarios is None else _scenarios(scenarios),
        "findings": {name: _findings(getattr(comparison.findings, name)) for name in ("gone", "new", "changed")},
    }


def printed_unit(key: str) -> str:
    """The unit that ``cell`` writes a value in."""
    return "%" if key.endswith(".at_feed") else unit_of(key)


def label_of(key: str) -> str:
    """A key of a report in words, for a table of two outputs."""
    *tables, last = key.split(".")
    side = next((words for start, words in _SIDES.items() if key.startswith(f"{start}.")), "")
    name = words_of(last)
    if tables[-1:] in (["total"], ["turn"]):
        return f"{'error' if tables[-1] == 'total' else 'tool axis'} {side}: {last.split('_')[0]}"
    if tables[:1] == ["rise_K"]:
        return f"rise of {last} at the {tables[1]}"
    if last == "p95_um":
        return f"may be off (95 %){f', {side}' if side else ''}"
    return f"{name}, {side}" if side else words_of(key).replace(", ", " ")


def cell(value: Any, key: str, signed: bool = False) -> str:
    """A value for a table, with so many digits as its unit deserves."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "true" if value else "false"
    sign = "+" if signed else ""
    if isinstance(value, float) and unit_of(key) in ("µm", "mdeg", "s"):
        return f"{value:{sign}.2f}"
    if key.endswith(".at_feed"):
        return f"{100 * value:{sign}.2f}"
    if isinstance(value, int | float):
        return f"{value:{sign}{'d' if isinstance(value, int) else '.4g' if signed else '.6g'}}"
    return value if isinstance(value, str) and value.isprintable() else json.dumps(value)


def input_cells(pair: Pair) -> tuple[str, str]:
    """Both values of an input as a file spells them, no digit left out; of long lists the entries that differ."""
    a, b = pair.a, pair.b
    if isinstance(a, list) and isinstance(b, list) and len(a) == len(b) > SHORT_LIST:
        rows = [n for n, (x, y) in enumerate(zip(a, b)) if x != y]
        more = f" and {len(rows) - SHORT_LIST} more" if len(rows) > SHORT_LIST else ""
        one, other = (", ".join(f"no. {n + 1}: {_spelt(c[n])}" for n in rows[:SHORT_LIST]) + more for c in (a, b))
        return one, other
    return _spelt(a), _spelt(b)


def _spelt(value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, float) and value.is_integer() and abs(value) < WHOLE:
        return str(int(value))
    if isinstance(value, list):
        return f"[{', '.join(map(_spelt, value))}]"
    return value if isinstance(value, str) and value and value.isprintable() else json.dumps(value)


def change_of(pair: Pair) -> str:
    """What B has more than A, signed; empty where nothing of it would be shown."""
    if pair.is_same:
        return ""
    return "changed" if pair.change is None else cell(pair.change, pair.key, signed=True)


def headline(comparison: Comparison) -> str:
    """What changed, in one sentence."""
    if comparison.is_equal:
        return "the two are equal: inputs, errors, times, positions and findings"
    count = len(comparison.inputs)
    keys = (
        f"{count} {'key' if count == 1 else 'keys'} of the inputs changed" if count else "no key of the inputs changed"
    )
    return f"{keys}; {error_sentence(comparison)}; {positions_sentence(comparison)}"


def error_sentence(comparison: Comparison) -> str:
    """The largest error that is left, of both."""
    pairs = {pair.key: pair for pair in comparison.error if pair.a is not None and pair.b is not None}
    pair = next((pairs[key] for key in FINAL if key in pairs), None)
    if pair is None:
        return "no error of both is known"
    change = "unchanged" if pair.is_same else f"{pair.change:+.2f}"
    return f"{label_of(pair.key)} {pair.a:.2f} um, then {pair.b:.2f} ({change})"


#: what a comparison is about, by kind: the largest error that is left
FINAL = (
    "on_part.after.total.max_um", "on_part.before.total.max_um", "after.total.max_um", "before.total.max_um",
    "largest.after_on_part_max_um", "largest.before_on_part_max_um", "runs.residual_max_um",
)  # fmt: skip


def positions_sentence(comparison: Comparison) -> str:
    """How far the commanded positions moved."""
    movement = comparison.movement
    if isinstance(movement, str):
        if comparison.scenarios is not None:
            return _scenarios_sentence(comparison.scenarios)
        return f"positions are not compared: {movement}"
    record = _positions(movement)
    if movement.is_same:
        within = (
            ""
            if movement.matched == "number"
            else f" within the last digit of the texts, {record['same_within_um']:.2g} um"
        )
        return f"all {record['count']} commanded positions are the same{within}"
    largest, rms = _length(record["largest_um"]), _length(record["rms_um"])
    if movement.matched == "nearest":
        back = _length(record["largest_of_b_um"])
        there = f"A's positions are up to {largest} ({rms} rms) off the path of B"
        return f"the paths differ: {there}, B's up to {back} off that of A"
    turned = ""
    if movement.angle is not None and movement.angle.max() > movement.same_angle:
        turned = f" and turned, by up to {record['largest_mdeg']:.3g} mdeg"
    by = "" if movement.matched == "number" else ", matched by the length along the path"
    return (
        f"{record['moved']} of {record['count']} commanded positions moved, by up to {largest} at "
        f"P[{record['largest_at']}] ({rms} rms){turned}{by}"
    )


def _length(um: float) -> str:
    """A distance in the unit that leaves it short."""
    return f"{um:.3g} um" if um < MILLIMETRE else f"{um / MILLIMETRE:.3g} mm"


def _scenarios_sentence(scenarios: MatchedScenarios) -> str:
    text = f"{scenarios.both} scenarios are in both"
    if scenarios.only_a or scenarios.only_b:
        text += f", {scenarios.only_a} in A alone, {scenarios.only_b} in B alone"
    for side, change in scenarios.changes.items():
        text += f"; error {side} changed by up to {np.abs(change).max() / UM:.3g} um"
    return text


def whose_output(output: Output) -> dict[str, Any]:
    """Where an output is, and what made it."""
    made = output.record.get("provenance") or {}
    return {
        "output": output.name,
        "name": output.subject,
        "compgen": output.version,
        "inputs_sha256": made.get("inputs_sha256") or made.get("robot_sha256") or output.record.get("study_sha256"),
    }


def _pair(pair: Pair) -> dict[str, Any]:
    return {
        "key": pair.key,
        "a": pair.a,
        "b": pair.b,
        "change": pair.change,
        "same": pair.is_same,
        "unit": unit_of(pair.key),
    }


def _findings(findings: Iterable[FindingText]) -> list[dict[str, str]]:
    return [dict(zip(("level", "code", "message"), finding)) for finding in findings]


def _positions(movement: Movement | str) -> dict[str, Any]:
    if isinstance(movement, str):
        return {"matched": None, "reason": movement}
    worst = int(movement.distance.argmax())
    record = {
        "matched": movement.matched,
        "count": len(movement.distance),
        "moved": movement.moved,
        "largest_um": _figure(movement.distance[worst] / UM),
        "largest_at": int(movement.number[worst]),
        "rms_um": _figure(rms(movement.distance) / UM),
        "same_within_um": _figure(movement.same_within / UM),
    }
    if movement.angle is not None:
        record |= {
            "largest_mdeg": _figure(movement.angle.max() / MDEG),
            "rms_mdeg": _figure(rms(movement.angle) / MDEG),
        }
    if movement.back is not None:
        record |= {
            "largest_of_b_um": _figure(movement.back.max() / UM),
            "rms_of_b_um": _figure(rms(movement.back) / UM),
        }
    return record


def _scenarios(scenarios: MatchedScenarios) -> dict[str, Any]:
    changes = {
        side: {"largest_um": _figure(np.abs(change).max() / UM), "at": dict(scenarios.worst[side])}
        for side, change in scenarios.changes.items()
    }
    return {"both": scenarios.both, "only_a": scenarios.only_a, "only_b": scenarios.only_b, "changes": changes}


def _figure(value: float) -> float:
    return float(f"{value:.9g}")
