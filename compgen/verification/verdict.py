"""The verdict: a deviation against the bounds that a path file promises, and the words for it."""

from dataclasses import dataclass
from enum import StrEnum

from compgen.core.findings import Finding, Level
from compgen.core.units import MDEG, UM
from compgen.verification.deviation import COMPONENTS, Deviation


class Verdict(StrEnum):
    """What a run ends with, in the words of screen, page and JSON."""

    INSIDE = "inside"  # its bounds
    OUTSIDE = "outside"
    NOT_LOADABLE = "not loadable"  # the controller cannot take the program
    NOT_CORRECTED = "nothing corrected"
    NO_BOUNDS = "no bounds"  # corrected and proven; none was given to be judged by
    PREDICTED = "predicted"  # the error of the uncorrected program


@dataclass(frozen=True, slots=True)
class Bounds:
    """The promise of a path: largest allowed values after correction; None asks for nothing."""

    max: float | None = None  # [m]
    p99: float | None = None  # [m]
    rms: float | None = None  # [m]
    feed: float | None = None  # [m] largest along feed
    cross: float | None = None  # [m]
    normal: float | None = None  # [m]
    axis: float | None = None  # [rad]


def judge(deviation: Deviation, bounds: Bounds) -> list[Finding]:
    """One finding for each bound that is broken, naming where it is worst; one where there is no bound at all."""
    total, feed, cross, normal, angle = (deviation.extents[name] for name in COMPONENTS)
    checks = [
        ("max_um", total, total.max, bounds.max),
        ("p99_um", total, total.p99, bounds.p99),
        ("rms_um", total, total.rms, bounds.rms),
        ("feed_um", feed, feed.max, bounds.feed),
        ("cross_um", cross, cross.max, bounds.cross),
        ("normal_um", normal, normal.max, bounds.normal),
        ("axis_mdeg", angle, angle.max, bounds.axis),
    ]
    findings = []
    if all(bound is None for *_, bound in checks):
        message = "[bounds] of the path file gives none: nothing says whether this is good enough; give bounds.max_um"
        findings.append(Finding(Level.OUTSIDE, "bounds.none", message))
    for key, extent, value, bound in checks:
        if bound is not None and not value <= bound:
            unit = key.split("_")[1]
            factor = MDEG if unit == "mdeg" else UM
            message = f"{value / factor:.3f} {unit} after correction is above bounds.{key} = {bound / factor:g}"
            message += f"; worst {extent.where:.3f} m along the path"
            findings.append(Finding(Level.OUTSIDE, f"bounds.{key}", message))
    return findings
