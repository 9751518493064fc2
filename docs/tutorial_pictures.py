"""Draws the pictures of the tutorials from the files that their commands leave.

Two kinds: the path seen from above, coloured by the size of the error before and after, each on a scale of its own; and
curves over an axis. Plain SVG, three decimals at most, so that the same files give the same picture.
"""

import csv
import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path

Row = dict[str, str]
Point = tuple[float, float]
Curve = tuple[str, Sequence[float], Sequence[float]]

RAMP = [(0.0, "#0f766e"), (0.25, "#65a30d"), (0.5, "#facc15"), (0.75, "#f97316"), (1.0, "#b91c1c")]
CURVES = [("#c2410c", ""), ("#0f766e", ""), ("#1d4ed8", "7 4"), ("#64748b", "2 3")]
LEVELS = 10  # shades of a map
INK, GREY, LINE = "#1e293b", "#475569", "#e2e8f0"


def pictures(name: str, folder: Path) -> dict[str, str]:
    """File name and SVG text of each picture of a tutorial, drawn from what its commands left in ``folder``."""
    draw = DRAWN.get(name)
    return {} if draw is None else {f"{name}.svg": draw(folder)}


def rows(file: Path) -> list[Row]:
    """A CSV file with a header."""
    with file.open() as lines:
        return list(csv.DictReader(lines))


def svg(width: int, height: int, alt: str, body: list[str]) -> str:
    """A whole picture."""
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img" aria-label="{alt}" '
        f'font-family="sans-serif" font-size="14">'
    )
    return "\n".join([head, f'<rect width="{width}" height="{height}" fill="white"/>', *body, "</svg>", ""])


def text(x: float, y: float, words: str, *, anchor: str = "start", colour: str = GREY, size: int = 14) -> str:
    """A line of text."""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{colour}" font-size="{size}">{words}</text>'


def colour(share: float) -> str:
    """Between the ramp's colours."""
    for (a, low), (b, high) in zip(RAMP, RAMP[1:], strict=False):
        if share <= b:
            u = (max(share, 0.0) - a) / (b - a)
            mix = [round(int(low[i : i + 2], 16) * (1 - u) + int(high[i : i + 2], 16) * u) for i in (1, 3, 5)]
            return "#{:02x}{:02x}{:02x}".format(*mix)
    return RAMP[-1][1]


def ticks(least: float, most: float, count: int = 5) -> list[float]:
    """Round numbers from least to most."""
    raw = (most - least) / count
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(step * power for step in (1, 2, 5, 10) if step * power >= raw * 0.999)
    return [k * step for k in range(math.ceil(least / step - 1e-9), math.floor(most / step + 1e-9) + 1)]


def stretches(points: list[Point], shades: list[int]) -> list[tuple[int, list[Point]]]:
    """The path in stretches of one shade, without the points that lie on a straight line between their neighbours."""
    out: list[tuple[int, list[Point]]] = []
    for k, (here, ahead) in enumerate(zip(points, points[1:], strict=False)):
        if k and shades[k] == out[-1][0]:
            before = out[-1][1][-2]
            turn = (here[0] - before[0]) * (ahead[1] - here[1]) - (here[1] - before[1]) * (ahead[0] - here[0])
            if abs(turn) < 0.05:
                out[-1][1].pop()
            out[-1][1].append(ahead)
        else:
            out.append((shades[k], [here, ahead]))
    return out


def maps(x: list[float], y: list[float], sizes: dict[str, list[float]], alt: str, width: int = 2) -> str:
    """A path [mm] seen from above, the robot at the top, twice beside each other, by the sizes of its error [um]."""
    x, y = y, [-value for value in x]
    scale = min(330 / (max(x) - min(x)), 250 / (max(y) - min(y)))
    body, bottom = [], 60 + scale * (max(y) - min(y))
    for left, (side, size) in zip((30, 470), sizes.items(), strict=False):
        top = max(size)
        places = 1 if top >= 10 else 2
        body.append(text(left, 28, f"{side}: up to {top:.{places}f} µm", colour=INK, size=17))
        body.append(f'<g fill="none" stroke-width="{width}">')
        flat = [(left + (a - min(x)) * scale, bottom - (b - min(y)) * scale) for a, b in zip(x, y, strict=False)]
        shades = [round(LEVELS * value / top) for value in size]
        for shade, way in stretches(flat, shades):
            line = " ".join(f"{a:.1f},{b:.1f}" for a, b in way)
            body.append(f'<polyline points="{line}" stroke="{colour(shade / LEVELS)}"/>')
        body.append("</g>")
        bar = left + (max(x) - min(x)) * scale + 18
        steps = 40
        for k in range(steps):
            h = (bottom - 60) / steps
            body.append(
                f'<rect x="{bar:.1f}" y="{bottom - (k + 1) * h:.1f}" width="12" height="{h + 0.5:.1f}" '
                f'fill="{colour(k / (steps - 1))}"/>'
            )
        body += [
            text(bar + 17, bottom, "0"),
            text(bar + 17, 70, f"{top:.{places}f}"),
            text(bar + 17, (bottom + 70) / 2, f"{top / 2:.{places}f}"),
        ]
    body.append(
        text(
            30,
            bottom + 28,
            "on the part, seen from above, the robot at the top, World y to the right; each side on a scale of its own",
        )
    )
    return svg(900, round(bottom + 44), alt, body)


def chart(curves: Sequence[Curve], alt: str, *, across: str, up: str, limit: tuple[str, float] | None = None) -> str:
    """Curves over an axis, told apart by their dashes too, with a limit as a line where there is one."""
    least, most = min(min(x) for _, x, _ in curves), max(max(x) for _, x, _ in curves)
    top = 1.08 * max([max(y) for _, _, y in curves] + ([limit[1]] if limit else []))
    left, right, base, height = 64.0, 680.0, 330.0, 270.0

    def place(x: float, y: float) -> tuple[float, float]:
        return left + (right - left) * (x - least) / (most - least), base - height * y / top

    body = [
        text(left - 44, 34, up, colour=INK),
        text((left + right) / 2, base + 46, across, anchor="middle", colour=INK),
    ]
    for value in ticks(0.0, top):
        _, level = place(least, value)
        body.append(f'<line x1="{left}" x2="{right}" y1="{level:.1f}" y2="{level:.1f}" stroke="{LINE}"/>')
        body.append(text(left - 8, level + 5, f"{value:g}", anchor="end"))
    body += [text(place(value, 0)[0], base + 21, f"{value:g}", anchor="middle") for value in ticks(least, most, 8)]
    if limit:
        _, level = place(least, limit[1])
        line = f'<line x1="{left}" x2="{right}" y1="{level:.1f}" y2="{level:.1f}" stroke="{INK}"'
        body.append(f'{line} stroke-dasharray="1 4"/>')
        body.append(text(right + 8, level + 5, limit[0], colour=INK))
    ends: dict[str, float] = {}
    for name, x, y in sorted(curves, key=lambda curve: curve[2][-1]):
        ends[name] = place(x[-1], y[-1])[1] + 5
        while any(abs(ends[name] - other) < 17 for at, other in ends.items() if at != name):
            ends[name] -= 4
    for (name, x, y), (tint, dashes) in zip(curves, CURVES, strict=False):
        line = " ".join("{:.1f},{:.1f}".format(*place(a, b)) for a, b in zip(x, y, strict=False))
        body.append(
            f'<polyline points="{line}" fill="none" stroke="{tint}" stroke-width="2.5" stroke-dasharray="{dashes}"/>'
        )
        body.append(text(right + 8, ends[name], name, colour=tint))
    return svg(900, 390, alt, body)


def bars(heights: Sequence[tuple[str, float, float, float]], alt: str, up: str) -> str:
    """A bar for each name, with its interval: name, height, low, high."""
    top = 1.08 * max(high for *_, high in heights)
    left, base, height, step = 64.0, 330.0, 270.0, 150.0
    body = [text(left - 44, 34, up, colour=INK)]
    for value in ticks(0.0, top):
        y = base - height * value / top
        body.append(f'<line x1="{left}" x2="830" y1="{y:.1f}" y2="{y:.1f}" stroke="{LINE}"/>')
        body.append(text(left - 8, y + 5, f"{value:g}", anchor="end"))
    for n, (name, size, low, high) in enumerate(heights):
        x = left + step * (n + 0.5)
        y, y_low, y_high = (base - height * value / top for value in (size, low, high))
        body += [
            f'<rect x="{x - 36:.1f}" y="{y:.1f}" width="72" height="{base - y:.1f}" fill="{CURVES[1][0]}"/>',
            f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{y_low:.1f}" y2="{y_high:.1f}" stroke="{INK}" stroke-width="2"/>',
            text(x + 8, y - 6, f"{size:.0f}", colour=INK),
            text(x, base + 22, name, anchor="middle"),
        ]
    return svg(900, 366, alt, body)


def my_raster(folder: Path) -> str:
    """The plate, before and after."""
    points = [row for row in rows(folder / "outputs/plate/waypoints.csv") if row["contact"] == "1"]
    x, y = ([float(row[f"{axis}_mm"]) for row in points] for axis in "xy")
    sizes = {
        side: [math.hypot(*(float(row[f"{side}_d{axis}_um"]) for axis in "xyz")) for row in points]
        for side in ("before", "after")
    }
    return maps(x, y, sizes, "Error of the tool on the plate, before and after")


def robodk(folder: Path) -> str:
    """The eight passes, before and after."""
    points = rows(folder / "outputs/PASSES/positions.csv")[1:-1]  # above the part at both ends
    x, y = ([float(row[f"{axis}_mm"]) for row in points] for axis in "xy")
    sizes = {side: [float(row[f"{side}_um"]) for row in points] for side in ("before", "after")}
    return maps(x, y, sizes, "Error of the tool on the passes, before and after", width=5)


def identify_my_robot(folder: Path) -> str:
    """The ladder of models by their error at poses left out."""
    ladder = json.loads((folder / "robots/mine.json").read_text())["ladder"]
    heights = [(step["model"], *(step["held_out_um"][key] for key in ("mean", "low", "high"))) for step in ladder]
    return bars(heights, "Error at poses left out, model by model", "held-out error [µm]")


def ci_gate(folder: Path) -> str:
    """What is left along the circle, as agreed and as changed."""
    curves = []
    for name in ("changed", "agreed"):
        points = [row for row in rows(folder / name / "waypoints.csv") if row["contact"] == "1"]
        size = [math.hypot(*(float(row[f"after_d{axis}_um"]) for axis in "xyz")) for row in points]
        curves.append((name, [float(row["time_s"]) for row in points], size))
    return chart(
        curves,
        "Error after correction at the waypoints of the circle, as agreed and as changed",
        across="time [s]",
        up="error after [µm]",
        limit=("max_um", 2.5),
    )


def day_with_breaks(folder: Path) -> str:
    """The error of each run: uncorrected, with a file for the first run, with one for all."""
    first, one = (rows(folder / day / "runs.csv") for day in ("outputs/plate_heat", "day_with_one_file"))
    hours = [float(row["start_s"]) / 3600 for row in first]
    curves = [
        (name, hours, [float(row[f"{key}_um"]) for row in runs])
        for name, runs, key in (
            ("uncorrected", first, "error"),
            ("file for the first run", first, "residual"),
            ("one file for all runs", one, "residual"),
        )
    ]
    return chart(curves, "Error of each run over the day", across="start of the run [h]", up="largest error [µm]")


DRAWN: dict[str, Callable[[Path], str]] = {
    "my_raster": my_raster,
    "robodk": robodk,
    "identify_my_robot": identify_my_robot,
    "ci_gate": ci_gate,
    "day_with_breaks": day_with_breaks,
}
