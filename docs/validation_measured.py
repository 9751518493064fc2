"""The section of docs/validation.md on the six measured hot-minus-cold curves: tables and picture.

Predicted numbers are robots/m710ic50_bend_fit.py's, by the error model of the shipped robot at the study's stations.
"""

import sys
from functools import cache
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "robots"))
import m710ic50_bend_fit as bend_fit  # noqa: E402

NETWORK = "robot.thermal.model=network"
NAMES = {
    ("x", "x"): "X positioning", ("x", "y"): "X straightness in Y", ("x", "z"): "X straightness in Z",
    ("y", "y"): "Y positioning", ("y", "x"): "Y straightness in X", ("y", "z"): "Y straightness in Z",
}  # fmt: skip
FIGURES = {("x", "x"): 112, ("x", "y"): 114, ("x", "z"): 113, ("y", "y"): 115, ("y", "x"): 117, ("y", "z"): 116}


def curve_rows() -> list[list[str]]:
    """Measured beside predicted, curve by curve."""
    nodes, network = bend_fit.sizes(bend_fit.curves()), bend_fit.sizes(bend_fit.curves(NETWORK))
    rows = []
    for curve, row, a, b, sigma in zip(
        bend_fit.CURVES, bend_fit.measured(), nodes, network, bend_fit.sigma(), strict=False
    ):
        lines = row["source"].removeprefix("study lines ")
        goal = float(row["measured_um"])
        off = (a - goal) / sigma
        rows.append([
            f"{NAMES[curve]} (figure {FIGURES[curve]})", f"{row['measured']} um ({lines})",
            f"{row['cold_repeatability_um']} and {row['hot_repeatability_um']} um",
            f"{a:.2f} um" if abs(a) < 10 else f"{a:.1f} um", f"{b:.2f} um" if abs(b) < 10 else f"{b:.1f} um",
            f"{off:+.1f}",
        ])  # fmt: skip
    return rows


#: causes alone that the page shows: the likeliest for either sign of Y positioning
LIKELIEST = ("cte", "a1 arm", "d4 arm", "a2 side", "a2 twist")


@cache
def tried() -> tuple[tuple[str, ...], ...]:
    """No cause, each alone, the best pair for either sign, all."""
    pairs = {bend_fit.best_pair(turned): None for turned in (False, True)}
    return ((), *((c,) for c in bend_fit.CAUSES), *pairs, bend_fit.CAUSES)


def cause_rows() -> list[list[str]]:
    """What each cause explains, and how well it foretells the curve left out, for both signs of Y positioning."""
    rows = []
    for causes in tried():
        if len(causes) == 1 and causes[0] not in LIKELIEST:
            continue
        cells = []
        for turned in (False, True):
            size, chi2, out = bend_fit.scores(causes, turned)
            cells += [_sizes(causes, size), f"{chi2:.1f}", f"{out:.1f}"]
        name = "all of them" if len(causes) > 2 else " and ".join(causes) or "none: the shipped robot"
        rows.append([name, str(len(causes)), *cells])
    return rows


def _sizes(causes: tuple[str, ...], size: np.ndarray) -> str:
    if not causes or len(causes) > 2:
        return ""
    units = {"cte": (100.0, " %"), "a1": (1.0, " um"), "a3": (1.0, " um")}
    shown = (
        (s * units.get(c, (1.0, ""))[0], units.get(c, (1.0, " arcsec"))[1]) for c, s in zip(causes, size, strict=False)
    )
    return ", ".join(f"{value:+.1f}{unit}" for value, unit in shown)


def numbers() -> dict[str, str]:
    """What the text quotes."""
    along = bend_fit.station_errors("y")[:, 1]
    six = bend_fit.sizes(bend_fit.curves())
    (bend,), _, _ = bend_fit.scores(("d4 arm",), turned=False)
    return {
        "best_out": f"{min(bend_fit.scores(causes, turned=False)[2] for causes in tried()):.0f}",
        "printed": f"{bend_fit.scores((), turned=False)[1]:.0f}",
        "x_bent": f"{bend_fit.sizes(bend_fit.curves() + bend * bend_fit.slope('d4 arm'))[0]:.0f}",
        "y_low": f"{along[0]:.1f}", "y_high": f"{along[-1]:.1f}", "y_span": f"{six[3]:.1f}",
        "x_share": f"{100 * six[0] / 90:.0f}", "y_share": f"{100 * six[3] / 90:.0f}",
        "rigid_um": f"{max(np.abs(10 * bend_fit.slope(c)).max() for c in bend_fit.RIGID):.3f}",
    }  # fmt: skip


def picture() -> str:
    """Bars: measured with its repeatability, nodes, network; an SVG."""
    series = [
        ("measured, with its repeatability", "#94a3b8", bend_fit.goal(turned=False)),
        ("nodes", "#c2410c", bend_fit.sizes(bend_fit.curves())),
        ("network", "#0f766e", bend_fit.sizes(bend_fit.curves(NETWORK))),
    ]
    low, high, left, base, top = -130.0, 170.0, 62, 300, 52

    def sy(value: float) -> float:
        return base - (value - low) / (high - low) * (base - top)

    out = [
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 760 360" font-family="sans-serif" font-size="13">',
        '<rect width="760" height="360" fill="white"/>',
        f'<text x="{left}" y="20" font-size="15" fill="#1e293b">Hot minus cold, as an interferometer reads it</text>',
    ]
    for level in range(-100, 151, 50):
        colour = "#475569" if level == 0 else "#e2e8f0"
        out.append(f'<line x1="{left}" x2="740" y1="{sy(level):.1f}" y2="{sy(level):.1f}" stroke="{colour}"/>')
        out.append(f'<text x="{left - 7}" y="{sy(level) + 4:.1f}" text-anchor="end" fill="#475569">{level}</text>')
    for n, (name, tint, _) in enumerate(series):
        out.append(f'<rect x="{left + 10 + 240 * n}" y="30" width="14" height="10" fill="{tint}"/>')
        out.append(f'<text x="{left + 30 + 240 * n}" y="40" fill="#475569">{name}</text>')
    for i, curve in enumerate(bend_fit.CURVES):
        middle = left + (i + 0.5) * 113
        for n, (_, tint, values) in enumerate(series):
            value, x = float(values[i]), middle - 42 + 28 * n
            y, height = min(sy(value), sy(0)), max(abs(sy(value) - sy(0)), 1.0)
            out.append(f'<rect x="{x:.0f}" y="{y:.1f}" width="26" height="{height:.1f}" fill="{tint}"/>')
        goal, spread = float(series[0][2][i]), 2 * float(bend_fit.sigma()[i])
        out.append(
            f'<line x1="{middle - 29:.0f}" x2="{middle - 29:.0f}" y1="{sy(goal - spread):.1f}" '
            f'y2="{sy(goal + spread):.1f}" stroke="#1e293b" stroke-width="1.6"/>'
        )
        first, _, second = NAMES[curve].partition(" in ")
        for k, words in enumerate((first, f"in {second}" if second else "")):
            out.append(
                f'<text x="{middle:.0f}" y="{base + 20 + 16 * k}" text-anchor="middle" fill="#475569">{words}</text>'
            )
    out.append(f'<text x="{left}" y="{base + 54}" fill="#475569">um, six hours on the circle at 200 mm/s</text></svg>')
    return "\n".join(out) + "\n"
