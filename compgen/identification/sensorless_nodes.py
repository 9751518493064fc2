"""Nodes without a sensor, after the fit: their height and lag against the robot file's, into that file and in words."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import tomlkit

from compgen.core.codes import Code, Level
from compgen.core.findings import Finding
from compgen.identification.fit import Fit
from compgen.identification.model import ArmModel

LEAST = 0.1  # share that the measurements determine, below which the file's value stays


@dataclass(frozen=True, slots=True)
class SensorlessNode:
    """What the fit says of a node's rise: factors on the robot file's rise_K and tau_h."""

    name: str
    height: float
    height_sigma: float
    lag: float
    is_known: bool  # whether the measurements say more than the file

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
    numbers = {
        (p.field, p.index[0]): k
        for k, p in enumerate(model.parameters)
        if p.source == "warm_up" and p.field in ("height", "lag") and fitted.active[k]
    }
    nodes = []
    for field, k in numbers:
        if field == "height":
            at, lag = numbers["height", k], numbers["lag", k]
            factors = 1 + float(fitted.p[at]), float(np.exp(fitted.p[lag]))
            is_known = bool(fitted.gamma[at] > LEAST)
            nodes.append(SensorlessNode(names[k], factors[0], float(fitted.sigma[at]), factors[1], is_known))
    return nodes


def with_sensorless_nodes(text: str, nodes: Sequence[SensorlessNode]) -> str:
    """A robot file with ``rise_K`` and ``tau_h`` of these nodes as fitted; the others stay."""
    document: Any = tomlkit.parse(text)
    known = {node.name: node for node in nodes if node.is_known}
    for table in document.get("thermal", {}).get("node", []):
        node = known.get(str(table["name"]))
        if node is not None:
            table["rise_K"], table["tau_h"] = node.written(float(table["rise_K"]), float(table["tau_h"]))
    return str(tomlkit.dumps(document)) if known else text


def sensorless_findings(nodes: Sequence[SensorlessNode], is_written: bool) -> list[Finding]:
    """What was fitted of nodes without a sensor, in words.

    Args:
        nodes: As fitted.
        is_written: Whether the robot file can carry it: nodes, not a network.
    """
    findings = []
    for node in nodes:
        if node.is_known:
            ending = "rise_K and tau_h are written" if is_written else "a network's file cannot carry it: not written"
            message = (
                f"{node.name} has no sensor: it rose {node.height:.2f} +- {node.height_sigma:.2f} times what the file "
                f"says beside the others, with {node.lag:.2f} times its time constant; {ending}"
            )
            findings.append(Finding(Level.NOTE, Code.LOG_FITTED, message))
    return findings
