"""A robot file with the law by which its nodes warm, as the temperature log of a warm-up shows it."""

import tomllib
from dataclasses import replace

import numpy as np

from compgen.core.csv_table import quote_cell
from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.units import HOUR
from compgen.identification.identified_robot_file import text_with_nodes
from compgen.identification.warm_up import swapped_sensors
from compgen.pipelines.files.robot_file import Arm, arm_of
from compgen.thermal.law_fit import FittedLaw, falling_part, fit_law
from compgen.thermal.temperature_log import (
    COLD_START,
    COLDEST,
    HOTTEST,
    Reference,
    check_live,
    check_sensors,
    read_temperature_log,
)


def with_law_of(arm: Arm, source: str, reference: str) -> Arm:
    """An arm with the law of its nodes as a log shows it; its own where parts cool, or sensors are exchanged.

    Raises:
        InputError: A bad log.
    """
    if arm.law is None or not arm.law.reference_rise.any():
        return arm
    log = read_temperature_log(source, arm.nodes, arm.sensors)
    check_sensors(log, [f"{name}_degC" for name in (*arm.nodes, *arm.sensors)])
    check_live(log)
    rises = log.rises(rise_reference(reference), COLD_START)
    if any(swapped_sensors(log, rises, arm.law)):  # which is said with the measurements
        return arm
    if falling := falling_part(rises):
        message = (
            f"{source}: {falling[0]} falls by {falling[1]:.1f} K, and no part rises by half as much: that is no "
            "warm-up, and rise_K and tau_h of all nodes stay; give a log that begins with the cold arm"
        )
        return replace(arm, input_findings=(*arm.input_findings, Finding(Level.WARNING, Code.HELD, message)))
    fitted = fit_law(rises, arm.law, arm.warmth)
    values = _values(fitted) if fitted.is_plausible else {}
    text = text_with_nodes(arm.text, values)
    findings = (*arm.input_findings, law_finding(source, fitted))
    return replace(
        arm_of(tomllib.loads(text), text, arm.source), network_masses=arm.network_masses, input_findings=findings
    )


def _values(fitted: FittedLaw) -> dict[str, dict[str, float]]:
    """What a robot file gets of each node; none where no node was shown."""
    values = {}
    for name, rise, tau, sigma in fitted.rows() if np.isfinite(fitted.sigma).any() else ():
        shown = {"rise_K": float(f"{rise:.4g}"), "law_K": float(f"{sigma:.2g}")} if np.isfinite(sigma) else {}
        values[name] = shown | {"tau_h": float(f"{tau / HOUR:.4g}")}
    return values


def law_finding(source: str, fitted: FittedLaw) -> Finding:
    """What a log says of the law of an arm's nodes, in words."""
    if not fitted.is_plausible:
        name = fitted.law.names[int(np.argmax(fitted.ratio))]
        return Finding(
            Level.WARNING,
            Code.HELD,
            f"{source}: {name} warms otherwise than any arm, by {fitted.ratio.max():.1f} sigmas of what a node can be: "
            "rise_K and tau_h of all nodes stay; look whether its sensor is on another part",
        )
    seen = [f"{n} {rise:.1f} +- {s:.1f} K in {tau / HOUR:.1f} h" for n, rise, tau, s in fitted.rows() if np.isfinite(s)]
    unseen = ", ".join(n for n, _, _, s in fitted.rows() if np.isnan(s))
    words = [f"rise_K and tau_h are fitted to the log: {', '.join(seen)}"] if seen else []
    words += [f"the log does not show {unseen}: rise_K and law_K stay"] if unseen else []
    return Finding.of(Code.LOG_FITTED, f"{source}: {'; '.join(words)}")


def rise_reference(text: str) -> Reference:
    """What rises count from, as an option says it."""
    if text in ("start", "ambient"):
        return "start" if text == "start" else "ambient"
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not COLDEST <= value <= HOTTEST:
        raise InputError(
            f"--reference {quote_cell(text, 'as given')}: must be start, ambient, or {COLDEST:g} to {HOTTEST:g} degC"
        )
    return value
