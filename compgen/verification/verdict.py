"""The verdict: a deviation against the bounds that a path file promises."""

from dataclasses import dataclass

from compgen.core.findings import Finding, Level
from compgen.core.units import MDEG, UM
from compgen.verification.deviation import COMPONENTS, Deviation


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
    """One finding for each bound that is broken, naming where it is worst."""
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
    for key, extent, value, bound in checks:
        if bound is not None and not value <= bound:
            unit = key.split("_")[1]
            factor = MDEG if unit == "mdeg" else UM
            message = f"{value / factor:.3f} {unit} after correction is above bounds.{key} = {bound / factor:g}"
            message += f"; worst {extent.where:.3f} m along the path"
            findings.append(Finding(Level.OUTSIDE, f"bounds.{key}", message))
    return findings
