"""Draws docs/spiral_1300.svg from the results of `cgen generate paths/spiral_1300.toml`.

    python docs/picture.py

Left the path coloured by the size of the error before, right after, on the same scale; below, both over time.
"""

import csv
import json
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
RESULTS = HERE.parent / "outputs" / "spiral_1300"
RAMP = [(0, "#0f766e"), (0.25, "#65a30d"), (0.5, "#facc15"), (0.75, "#f97316"), (1, "#b91c1c")]


def colour(share: float) -> str:
    """Between the ramp's colours."""
    for (a, low), (b, high) in zip(RAMP, RAMP[1:]):
        if share <= b:
            u = (max(share, 0) - a) / (b - a)
            mix = [round(int(low[i : i + 2], 16) * (1 - u) + int(high[i : i + 2], 16) * u) for i in (1, 3, 5)]
            return "#{:02x}{:02x}{:02x}".format(*mix)
    return RAMP[-1][1]


def main() -> None:
    """Read the CSV, write the SVG."""
    with (RESULTS / "waypoints.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["contact"] == "1"]
    data = json.loads((RESULTS / "report.json").read_text())
    xy = np.array([[float(r["x_mm"]) - 1350, float(r["y_mm"]) + 30] for r in rows])
    time = np.array([float(r["time_s"]) for r in rows])
    sizes = {
        side: np.array([np.hypot.reduce([float(r[f"{side}_d{a}_um"]) for a in "xyz"]) for r in rows])
        for side in ("before", "after")
    }
    top = 125.0
    out = [
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 900 600" font-family="sans-serif" font-size="14">',
        '<rect width="900" height="600" fill="white"/>',
    ]
    for centre, side in ((225, "before"), (640, "after")):
        largest = data[side]["total"]["max_um"]
        title = f"{side}: up to {largest:.1f} µm" if side == "before" else f"{side}: up to {largest:.2f} µm"
        out.append(f'<text x="{centre}" y="24" text-anchor="middle" font-size="17" fill="#1e293b">{title}</text>')
        for i in range(0, len(rows) - 12, 12):
            part = xy[i : i + 13] * 0.26
            points = " ".join(f"{centre + x:.1f},{212 - y:.1f}" for x, y in part)
            tint = colour(float(sizes[side][i]) / top)
            out.append(f'<polyline points="{points}" fill="none" stroke="{tint}" stroke-width="3"/>')
    out += [f'<rect x="838" y="{330 - i * 4}" width="14" height="5" fill="{colour(i / 59)}"/>' for i in range(60)]
    for value in (0, 60, 120):
        out.append(f'<text x="858" y="{338 - value / top * 240:.0f}" fill="#475569">{value}</text>')
    out.append('<text x="838" y="84" fill="#475569">µm</text>')

    left, right, base, height = 60, 830, 560, 140
    for value in (0, 40, 80, 120):
        y = base - value / top * height
        out.append(f'<line x1="{left}" x2="{right}" y1="{y:.1f}" y2="{y:.1f}" stroke="#e2e8f0"/>')
        out.append(f'<text x="{left - 8}" y="{y + 5:.1f}" text-anchor="end" fill="#475569">{value}</text>')
    for side, tint in (("before", "#c2410c"), ("after", "#0f766e")):
        keep = np.unique(np.linspace(0, len(rows) - 1, 900).astype(int))
        points = " ".join(
            f"{left + (right - left) * time[i] / time[-1]:.1f},{base - sizes[side][i] / top * height:.1f}" for i in keep
        )
        out.append(f'<polyline points="{points}" fill="none" stroke="{tint}" stroke-width="2"/>')
    for value in range(0, int(time[-1]) + 1, 20):
        x = left + (right - left) * value / time[-1]
        out.append(f'<text x="{x:.1f}" y="{base + 20}" text-anchor="middle" fill="#475569">{value} s</text>')
    out.append(f'<text x="{left}" y="{base - height - 12}" fill="#1e293b">error of the tool centre point [µm]</text>')
    out.append("</svg>")
    (HERE / "spiral_1300.svg").write_text("\n".join(out) + "\n")


if __name__ == "__main__":
    main()
