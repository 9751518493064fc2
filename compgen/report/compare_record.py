"""Two outputs side by side as data; docs/compare.md has the keys."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from compgen.core.arrays import rms
from compgen.core.commands import Command
from compgen.core.units import MDEG, UM
from compgen.pipelines.comparison.comparison import RISES, Comparison, FindingText, MatchedScenarios, Pair
from compgen.pipelines.comparison.outputs import Output
from compgen.pipelines.comparison.positions import Movement
from compgen.report.key_words import unit_of

SCHEMA = 1


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
        "inputs_sha256": made.get("inputs_sha256") or made.get("robot_sha256") or output.record.get("study_sha256"),
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
