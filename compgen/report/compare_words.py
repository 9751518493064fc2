"""Two outputs side by side as data (docs/compare.md has the keys) and in words, for the terminal and the page."""

import json
from collections.abc import Iterable
from typing import Any

import numpy as np

from compgen.core.arrays import nine_digits, rms
from compgen.core.commands import Command
from compgen.core.units import MDEG, UM, counted
from compgen.pipelines.comparison.comparison import Comparison, FindingText, MatchedScenarios, Pair
from compgen.pipelines.comparison.numbers import RISES
from compgen.pipelines.comparison.outputs import Output
from compgen.pipelines.comparison.positions import Movement
from compgen.report.inputs import SHORT
from compgen.report.key_words import ascii_units, unit_of, words_of

SCHEMA = 1
UNCORRECTED = (Command.PREDICT, Command.HEAT)  # commands that write no program
NOT_KNOWN = "what changed in the inputs is not known"
MOST_ROWS = 30  # of inputs that are shown at once
SAME = "less than 0.01 um, mdeg, s, K or % apart; of other numbers, less than the sixth digit"
LONG = 40  # characters of a value, beyond which a sentence does not spell it
SHORT_LIST = 6  # values, up to which a list is shown whole
MILLIMETRE = 1000  # [um] from which a distance is shown in mm
WHOLE = 1e15  # below it a float without a fraction is shown as a whole number
_MATCHED = {"length": "the length along the path", "nearest": "their nearest places"}
_SIDES = {
    "on_part.before": "before, on the part",
    "on_part.after": "after, on the part",
    "before": "before",
    "after": "after",
    "largest": "largest of all scenarios",
    "least": "least of all scenarios",
    "band.first": "first run",
    "band.largest": "run that errs most",
}
#: what a comparison is about, by kind: the largest error that is left
FINAL = {
    "on_part.after.total.max_um": "the largest error left on the part",
    "on_part.before.total.max_um": "the largest error on the part",
    "after.total.max_um": "the largest error left",
    "before.total.max_um": "the largest error",
    "largest.after_on_part_max_um": "the largest error left on the part in any scenario",
    "largest.before_on_part_max_um": "the largest error on the part in any scenario",
    "runs.residual_max_um": "the most that one corrected file leaves in a run",
}


def comparison_record(comparison: Comparison) -> dict[str, Any]:
    """Everything a comparison says, in plain types."""
    scenarios = comparison.scenarios
    return {
        "schema": SCHEMA,
        "command": Command.COMPARE,
        "kind": comparison.kind,
        "a": whose_output(comparison.a),
        "b": whose_output(comparison.b),
        "equal": comparison.is_equal,
        "notes": list(comparison.notes),
        "inputs": None if comparison.inputs is None else [_input(p) for p in comparison.inputs],
        **{name: [_pair(p) for p in getattr(comparison, name)] for name in ("error", "time", "program")},
        "final_error_um": comparison.final_error,
        "positions": positions_record(comparison.movement),
        "scenarios": None if scenarios is None else _scenarios(scenarios),
        "findings": {name: _findings(getattr(comparison.findings, name)) for name in ("gone", "new", "changed")},
    }


def whose_output(output: Output) -> dict[str, Any]:
    """Where an output is, and what made it."""
    made = output.record.get("provenance") or {}
    return {
        "output": output.name,
        "name": output.subject,
        "compgen": output.version,
        "inputs_sha256": made.get("inputs_sha256") or output.record.get("study_sha256"),
    }


def _input(pair: Pair) -> dict[str, Any]:
    return {"key": pair.key, "a": pair.a, "b": pair.b, "unit": unit_of(pair.key)}


def _pair(pair: Pair) -> dict[str, Any]:
    return {
        "key": pair.key,
        "a": pair.a,
        "b": pair.b,
        "change": pair.change,
        "same": pair.is_same,
        "unit": number_unit(pair.key),
    }


def number_unit(key: str) -> str:
    """The unit of a number of a report."""
    return "K" if key.startswith(RISES) else unit_of(key)


def _findings(findings: Iterable[FindingText]) -> list[dict[str, str]]:
    return [dict(zip(("level", "code", "message"), finding, strict=True)) for finding in findings]


def positions_record(movement: Movement | str) -> dict[str, Any]:
    """How far the commanded positions moved, or why it is not known."""
    if isinstance(movement, str):
        return {"matched": None, "reason": movement}
    worst = int(movement.distance.argmax())
    record = {
        "matched": movement.matched,
        "count": len(movement.distance),
        "moved": movement.moved,
        "largest_um": nine_digits(movement.distance[worst] / UM),
        "largest_at": int(movement.number[worst]),
        "rms_um": nine_digits(rms(movement.distance) / UM),
        "in_joints": movement.in_joints,
        "in_joints_moved": movement.in_joints_moved,
        "same_within_um": nine_digits(movement.same_within / UM),
    }
    if movement.angle is not None:
        record |= {
            "largest_mdeg": nine_digits(movement.angle.max() / MDEG),
            "rms_mdeg": nine_digits(rms(movement.angle) / MDEG),
        }
    if movement.back is not None:
        record |= {
            "largest_of_b_um": nine_digits(movement.back.max() / UM),
            "rms_of_b_um": nine_digits(rms(movement.back) / UM),
        }
    return record


def _scenarios(scenarios: MatchedScenarios) -> dict[str, Any]:
    changes = {
        side: {"largest_um": nine_digits(np.abs(change).max() / UM), "at": dict(scenarios.worst[side])}
        for side, change in scenarios.changes.items()
    }
    return {"both": scenarios.both, "only_a": scenarios.only_a, "only_b": scenarios.only_b, "changes": changes}


def printed_unit(key: str) -> str:
    """The unit that ``cell`` writes a value in."""
    return "%" if key.endswith(".at_feed") else number_unit(key)


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


def cell(value: Any, key: str, *, signed: bool = False) -> str:
    """A value for a table, with so many digits as its unit deserves."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "true" if value else "false"
    sign = "+" if signed else ""
    if isinstance(value, float) and number_unit(key) in ("µm", "mdeg", "s", "K"):
        return f"{value:{sign}.2f}"
    if key.endswith(".at_feed"):
        return f"{100 * value:{sign}.2f}"
    if isinstance(value, int | float):
        return f"{value:{sign}{'d' if isinstance(value, int) else '.4g' if signed else '.6g'}}"
    return value if isinstance(value, str) and value.isprintable() else json.dumps(value)


def input_cells(pair: Pair) -> tuple[str, str]:
    """Both values of an input as a file spells them, no digit left out; of long lists the entries that differ, of a
    hash its first characters."""
    a, b = pair.a, pair.b
    if pair.key.endswith("sha256"):
        one, other = ("–" if value is None else str(value)[:SHORT] for value in (a, b))
        return one, other
    if isinstance(a, list) and isinstance(b, list) and len(a) == len(b) > SHORT_LIST:
        rows = [n for n, (x, y) in enumerate(zip(a, b, strict=True)) if x != y]
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


def ranked(pairs: Iterable[Pair]) -> list[Pair]:
    """What changed first: words, then numbers unit by unit, the largest change above; what is the same as it was."""
    pairs = list(pairs)
    units = list(dict.fromkeys(number_unit(p.key) for p in pairs if not p.is_same and p.change is not None))
    changed = [p for p in pairs if not p.is_same]
    changed.sort(key=lambda p: (-1, 0.0) if p.change is None else (units.index(number_unit(p.key)), -abs(p.change)))
    return [*changed, *(p for p in pairs if p.is_same)]


def file_of(key: str, kind: Command) -> str:
    """Where an input of a command stands."""
    if key.startswith("robot."):
        return "robot file"
    return "command line" if kind == Command.CORRECT else "path file"


def what_changed(comparison: Comparison) -> str:
    """What changed, in one sentence."""
    if comparison.is_equal:
        if not isinstance(comparison.movement, str):
            return "the two are equal: inputs, errors, times, positions and findings"
        writes = comparison.kind in (Command.GENERATE, Command.CORRECT)
        unknown = f"; {positions_sentence(comparison)}" if writes else ""
        return f"the two are equal: inputs, errors, times and findings{unknown}"
    positions = [] if comparison.kind in UNCORRECTED else [positions_sentence(comparison)]
    return "; ".join([_inputs_sentence(comparison.inputs), error_sentence(comparison), *positions])


def _inputs_sentence(inputs: tuple[Pair, ...] | None) -> str:
    if inputs is None:
        return NOT_KNOWN
    if not inputs:
        return "no input changed"
    a, b = input_cells(inputs[0])
    if len(inputs) > 1 or max(len(a), len(b)) > LONG:
        return f"{counted(len(inputs), 'input', 'inputs')} changed"
    key = inputs[0].key
    return f"{words_of(key)} went from {a} to {b} {ascii_units(unit_of(key))}".replace("–", "none").rstrip()


def error_sentence(comparison: Comparison) -> str:
    """The largest error that is left, of both, and their verdicts where they differ."""
    pairs = {pair.key: pair for pair in comparison.error}
    known = [key for key in FINAL if key in pairs and pairs[key].change is not None]
    if not known:
        return "no error of both is known"
    pair, words = pairs[known[0]], FINAL[known[0]]
    verdict = pairs.get("verdict")
    turned = "" if verdict is None or verdict.is_same else f", and the verdict from {verdict.a!r} to {verdict.b!r}"
    if pair.is_same:
        return f"{words} stayed at {pair.b:.2f} um{turned.replace('and the verdict', 'and the verdict went')}"
    return f"{words} went from {pair.a:.2f} to {pair.b:.2f} um ({pair.change:+.2f}){turned}"


def positions_sentence(comparison: Comparison) -> str:
    """How far the commanded positions moved."""
    movement = comparison.movement
    if isinstance(movement, str):
        if comparison.scenarios is not None:
            return _scenarios_sentence(comparison.scenarios)
        return f"positions are not compared: {movement}"
    record = positions_record(movement)
    if movement.is_same:
        digit = f" within the last digit of the texts, {record['same_within_um']:.2g} um"
        within = "" if movement.matched == "number" else f"{digit}, matched by {_MATCHED[movement.matched]}"
        return f"all {record['count'] + movement.in_joints} commanded positions are the same{within}"
    largest, rms = _length(record["largest_um"]), _length(record["rms_um"])
    if movement.matched == "nearest":
        back = _length(record["largest_of_b_um"])
        there = f"A's positions are up to {largest} ({rms} rms) off the path of B"
        return f"at the nearest places {there}, B's up to {back} off that of A"
    turned = ""
    if movement.angle is not None and movement.angle.max() > movement.same_angle:
        turned = f" and turned, by up to {record['largest_mdeg']:.3g} mdeg"
    by = "" if movement.matched == "number" else f", matched by {_MATCHED[movement.matched]}"
    if movement.in_joints:
        by = f"; {movement.in_joints_moved} of {movement.in_joints} in joint angles read otherwise"
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
