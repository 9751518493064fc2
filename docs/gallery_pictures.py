"""Draws the pictures of the gallery from the files that its commands leave, and takes the numbers of their captions."""

import json
import math
import re
from pathlib import Path
from typing import Any

from tutorial_pictures import GREY, INK, LEVELS, LINE, chart, colour, rows, stretches, svg, text, ticks

#: an SVG and the numbers of its caption, as they are printed
Drawn = tuple[str, dict[str, str]]
TEAL, ORANGE, BLUE = "#0f766e", "#c2410c", "#1d4ed8"


def number(value: float, places: int = 1) -> str:
    """As the caption prints it."""
    return f"{value:.{places}f}"


def size(row: dict[str, str], side: str) -> float:
    """How far the tool is off at a waypoint [um]."""
    return math.hypot(*(float(row[f"{side}_d{axis}_um"]) for axis in "xyz"))


def on_part(file: Path) -> list[dict[str, str]]:
    """The waypoints on the part."""
    return [row for row in rows(file) if row["contact"] == "1"]


def way(points: list[tuple[float, float]], shares: list[float], width: float = 2.5) -> list[str]:
    """A path coloured by shares of the ramp."""
    lines = [f'<g fill="none" stroke-width="{width}" stroke-linecap="round">']
    for shade, part in stretches(points, [round(LEVELS * share) for share in shares]):
        line = " ".join(f"{x:.1f},{y:.1f}" for x, y in part)
        lines.append(f'<polyline points="{line}" stroke="{colour(shade / LEVELS)}"/>')
    return [*lines, "</g>"]


def bar_of_colours(x: float, top: float, bottom: float, most: float) -> list[str]:
    """What the ramp's colours mean, in µm."""
    height = (bottom - top) / 40
    body = [
        f'<rect x="{x:.1f}" y="{bottom - (k + 1) * height:.1f}" width="14" height="{height + 0.5:.1f}" '
        f'fill="{colour(k / 39)}"/>'
        for k in range(40)
    ]
    values = ticks(0, most, 4)
    words = [text(x + 20, bottom - (bottom - top) * value / most + 5, f"{value:g}") for value in values]
    return [*body, *words, text(x, top - 10, "µm")]


def spiral(folder: Path) -> Drawn:
    """Before and after on one scale, and both over time."""
    points = on_part(folder / "outputs/spiral_1300/waypoints.csv")
    report = json.loads((folder / "outputs/spiral_1300/report.json").read_text())
    most = {side: report[side]["total"]["max_um"] for side in ("before", "after")}
    body, top = [], 1.02 * most["before"]
    for centre, side, places in ((215, "before", 1), (610, "after", 2)):
        flat = [(centre + (float(p["x_mm"]) - 1350) * 0.27, 225 - (float(p["y_mm"]) + 30) * 0.27) for p in points]
        title = f"{side}: up to {number(most[side], places)} µm"
        body.append(text(centre, 28, title, anchor="middle", colour=INK, size=20))
        body += way(flat, [size(p, side) / top for p in points], 3)
    body += bar_of_colours(830, 100, 340, top)
    time = [float(p["time_s"]) for p in points]
    left, right, base, height = 60.0, 800.0, 575.0, 140.0
    for value in ticks(0, top, 3):
        y = base - height * value / top
        body.append(f'<line x1="{left}" x2="{right}" y1="{y:.1f}" y2="{y:.1f}" stroke="{LINE}"/>')
        body.append(text(left - 8, y + 5, f"{value:g}", anchor="end", size=16))
    for side, tint in (("before", ORANGE), ("after", TEAL)):
        kept = range(0, len(points), 12)
        line = " ".join(
            f"{left + (right - left) * time[k] / time[-1]:.1f},{base - height * size(points[k], side) / top:.1f}"
            for k in kept
        )
        body.append(f'<polyline points="{line}" fill="none" stroke="{tint}" stroke-width="2.5"/>')
        last = base - height * size(points[-1], side) / top
        body.append(text(right + 8, last + 5, side, colour=tint, size=16))
    for value in ticks(0, time[-1], 5):
        x = left + (right - left) * value / time[-1]
        body.append(text(x, base + 22, f"{value:g} s", anchor="middle", size=16))
    body.append(text(left, base - height - 14, "error of the tool centre point [µm]", colour=INK, size=16))
    picture = svg(900, 605, "Error of the tool on the study's spiral, before and after", body)
    return picture, {"before": number(most["before"]), "after": number(most["after"], 2)}


def raster(folder: Path) -> Drawn:
    """The raster on the optic in space, coloured by the error before, as predicted."""
    points = on_part(folder / "outputs/optic_raster_predict/waypoints.csv")
    sizes = [size(p, "before") for p in points]
    place = [tuple(float(p[f"{axis}_mm"]) for axis in "xyz") for p in points]
    low = [min(p[k] for p in place) for k in range(3)]
    span = [max(p[k] for p in place) - low[k] for k in range(3)]
    # from the front above: World y to the right, x away from the eye, z five times as high
    flat = [
        (60 + 560 * (p[1] - low[1]) / span[1] + 170 * (p[0] - low[0]) / span[0],
         380 - 300 * (p[0] - low[0]) / span[0] - 5 * 0.35 * (p[2] - low[2]))
        for p in place
    ]  # fmt: skip
    top = max(sizes)
    body = [
        text(30, 34, f"predicted error, up to {number(top)} µm; depth five times as large", colour=INK, size=18),
        *way(flat, [value / top for value in sizes]),
        *bar_of_colours(830, 90, 350, top),
        text(60, 412, "World y to the right, x away from the eye"),
    ]
    return svg(900, 430, "The raster on the optic in space, coloured by the predicted error", body), {
        "least": number(min(sizes)), "most": number(top),
    }  # fmt: skip


def day(folder: Path) -> Drawn:
    """Rises of four nodes over a day with one shift and two breaks."""
    table = rows(folder / "day/heat.csv")
    kept = table[:: max(1, len(table) // 400)]
    hours = [float(row["time_s"]) / 3600 for row in kept]
    nodes = ("j3", "j2", "link1", "wrist")
    curves = [(node, hours, [float(row[f"rise_{node}_K"]) for row in kept]) for node in nodes]
    peak = max(float(row["rise_j3_K"]) for row in table)
    runs = rows(folder / "day/runs.csv")
    picture = chart(curves, "Rises of four nodes over a day", across="hour of the day", up="rise [K]")
    return picture, {"peak": number(peak), "error": number(max(float(run["error_um"]) for run in runs), 0)}


def budget(folder: Path) -> Drawn:
    """What the robot file leaves open, source by source, as bars."""
    band = json.loads((folder / "outputs/spiral_1300/report.json").read_text())["band"]
    parts = sorted(((value, source) for source, value in band["budget_um"].items()), reverse=True)[:8]
    whole = band["p95_um"]
    body = [text(30, 34, f"of what the file knows, 95 %: {number(whole, 0)} µm", colour=INK, size=18)]
    for k, (value, source) in enumerate([(whole, "all"), *parts]):
        y, tint = 58 + 34 * k, TEAL if k else ORANGE
        body += [
            text(240, y + 17, source, anchor="end", colour=INK),
            f'<rect x="250" y="{y}" width="{560 * value / whole:.1f}" height="24" fill="{tint}"/>',
            text(258 + 560 * value / whole, y + 17, number(value)),
        ]
    return svg(900, 70 + 34 * (len(parts) + 1), "What the robot file leaves open, source by source", body), {
        "whole": number(whole, 0), "largest": number(parts[0][0], 0), "source": parts[0][1],
    }  # fmt: skip


def whatif(folder: Path) -> Drawn:
    """The largest error without correction over the feed and the hours of warming up."""
    table = rows(folder / "outputs/spiral_1300_whatif/whatif.csv")
    value = {
        (float(row["before.0.feed_mm_s"]), float(row["before.0.duration_h"])): float(row["before_max_um"])
        for row in table
    }
    feeds, hours = (sorted({key[k] for key in value}) for k in (0, 1))
    top, wide, high = max(value.values()), 690 / len(feeds), 320 / len(hours)
    body = [text(30, 34, "largest error on the spiral without correction [µm]", colour=INK, size=18)]
    for i, feed in enumerate(feeds):
        body.append(text(110 + (i + 0.5) * wide, 402, f"{feed:g}", anchor="middle"))
        for j, hour in enumerate(hours):
            x, y = 110 + i * wide, 378 - (j + 1) * high
            share = value[feed, hour] / top
            body.append(
                f'<rect x="{x:.1f}" y="{y:.1f}" width="{wide:.1f}" height="{high:.1f}" fill="{colour(share)}"/>'
            )
            ink = "white" if not 0.15 < share < 0.75 else INK
            words = f"{value[feed, hour]:.0f}"
            body.append(text(x + wide / 2, y + high / 2 + 5, words, anchor="middle", colour=ink, size=16))
    body += [text(100, 378 - (j + 0.5) * high + 5, f"{hour:g} h", anchor="end") for j, hour in enumerate(hours)]
    body += [
        text(455, 430, "feed while warming up [mm/s]", anchor="middle", colour=INK),
        text(30, 50, "warmed up for", colour=INK),
    ]
    return svg(900, 446, "Largest error over feed and hours of warming up", body), {
        "slow": number(value[feeds[0], hours[-1]], 0), "hot": number(top, 0), "count": str(len(value)),
    }  # fmt: skip


def arcs(folder: Path) -> Drawn:
    """A sixth of the circle, in lines and in arcs: the positions of both programs."""
    body, counts, largest = [], {}, {}
    for row, kind in ((0, "lines"), (1, "arcs")):
        points = on_part(folder / kind / "waypoints.csv")
        report = json.loads((folder / kind / "report.json").read_text())
        counts[kind], largest[kind] = report["program"]["positions"], report["after"]["total"]["max_um"]
        centre, top = 450, 58 + 175 * row
        body.append(text(30, top - 12, f"{kind}: {counts[kind]} positions", colour=INK, size=18))
        dots = []
        for p in points:
            x, y = float(p["x_mm"]) - 1350, float(p["y_mm"]) + 30
            if y > 0.86 * 650:
                dots.append((centre + 1.27 * x, top + 125 - 1.27 * (y - 0.86 * 650)))
        (x, y), (x_end, y_end), radius = min(dots), max(dots), 1.27 * 650
        circle = f"M{x:.1f},{y:.1f} A{radius},{radius} 0 0 1 {x_end:.1f},{y_end:.1f}"
        body.append(f'<path d="{circle}" fill="none" stroke="{GREY}" stroke-width="1"/>')
        width = 1.6 if kind == "lines" else 5
        body += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{width}" fill="{(ORANGE, TEAL)[row]}"/>' for x, y in dots]
    return svg(900, 380, "Positions of the same circle in lines and in arcs", body), {
        "lines": str(counts["lines"]), "arcs": str(counts["arcs"]),
        "after_lines": number(largest["lines"], 2), "after_arcs": number(largest["arcs"], 2),
    }  # fmt: skip


def periods(folder: Path) -> Drawn:
    """How many interpolation periods each line of the spiral's text lasts, over the distance from its centre."""
    program = (folder / "outputs/spiral_1300/SPIRAL_1300.LS").read_text()
    speeds = {
        int(n): float(value) * {"mm/sec": 1.0, "cm/min": 10 / 60, "inch/min": 25.4 / 60}[unit]
        for n, value, unit in re.findall(r"L P\[(\d+)\] ([\d.]+)(mm/sec|cm/min|inch/min)", program)
    }
    places = {
        int(n): tuple(map(float, xyz))
        for n, *xyz in re.findall(
            r"P\[(\d+)\]\{.*?X = +(\S+) +mm,\s*Y = +(\S+) +mm,\s*Z = +(\S+) +mm", program, re.DOTALL
        )
    }
    lasts = {n: math.dist(places[n - 1], places[n]) / speeds[n] / 0.008 for n in speeds if n - 1 in places}
    part = sorted((math.hypot(places[n][0] - 1350, places[n][1] + 30), t) for n, t in lasts.items() if t < 5)
    body = [text(30, 34, "how long each line of the program lasts, in periods of 8 ms", colour=INK, size=18)]
    left, right, base, height = 60.0, 860.0, 330.0, 270.0
    for value in (0, 1, 2):
        y = base - height * value / 2.4
        body.append(f'<line x1="{left}" x2="{right}" y1="{y:.1f}" y2="{y:.1f}" stroke="{LINE}" stroke-width="2"/>')
        body.append(text(left - 8, y + 5, str(value), anchor="end"))
    for distance, t in part[:: max(1, len(part) // 1200)]:
        x, y = left + (right - left) * distance / 655, base - height * t / 2.4
        body.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="1.8" fill="{TEAL}"/>')
    body += [text(left + (right - left) * r / 655, base + 22, f"{r}", anchor="middle") for r in range(0, 700, 100)]
    body.append(
        text((left + right) / 2, base + 48, "distance from the spiral's centre [mm]", anchor="middle", colour=INK)
    )
    timing = json.loads((folder / "outputs/spiral_1300/report.json").read_text())["timing"]
    return svg(900, 390, "Periods that each line of the spiral lasts", body), {
        "feed": number(100 * timing["at_feed"]), "written": number(timing["as_written_s"]),
        "rounded": number(timing["rounded_up_s"]),
    }  # fmt: skip


def offsets(folder: Path) -> Drawn:
    """What is left by nothing, by one offset typed in, and by the full correction."""
    ways = json.loads((folder / "offsets.json").read_text())["ways"]
    names = {
        "nothing": "nothing",
        "PR offset X Y Z": "one offset, typed in",
        "full correction": "the corrected program",
    }
    shown = [(names[way["kind"]], way["leaves"]["rms_um"]) for way in ways if way["kind"] in names]
    body = [text(30, 34, "left on the part, rms [µm]", colour=INK, size=18)]
    for k, (name, value) in enumerate(shown):
        y = 58 + 44 * k
        body += [
            text(220, y + 22, name, anchor="end", colour=INK, size=16),
            f'<rect x="230" y="{y}" width="{590 * value / shown[0][1]:.1f}" height="32" '
            f'fill="{(ORANGE, BLUE, TEAL)[k]}"/>',
            text(238 + 590 * value / shown[0][1], y + 22, number(value), size=16),
        ]
    keys = ("nothing", "offset", "full")
    return svg(900, 200, "What one offset leaves", body), {
        key: number(value) for key, (_, value) in zip(keys, shown, strict=False)
    }  # fmt: skip


def touches(folder: Path) -> Drawn:
    """What is left open of the path's place after each touch."""
    plan = json.loads((folder / "touches/plan.json").read_text())
    left = [plan["before"]["rms_um"], *(touch["rms_um"] for touch in plan["touches"])]
    body = [text(30, 34, "how well the path's place is known after each touch, rms [µm]", colour=INK, size=18)]
    for k, value in enumerate(left):
        x, height = 60 + 90 * k, 230 * value / left[0]
        target = plan["touches"][k - 1]["target"] if k else "none"
        body += [
            f'<rect x="{x}" y="{300 - height:.1f}" width="62" height="{height:.1f}" fill="{TEAL if k else ORANGE}"/>',
            text(x + 31, 292 - height, number(value), anchor="middle", size=16),
            text(x + 31, 322, f"{k}", anchor="middle", size=16),
            text(x + 31, 342, target, anchor="middle"),
        ]
    return svg(900, 356, "What is left open after each touch", body), {
        "none": number(left[0]), "eight": number(left[-1]),
    }  # fmt: skip


def anchor(folder: Path) -> Drawn:
    """How far the tool's place is foretold wrong along the path, by the plan and by the touches."""
    ways = {name: on_part(folder / name / "waypoints.csv") for name in ("planned", "anchored", "truth")}
    place = {
        name: [[float(p[f"before_d{axis}_um"]) for axis in "xyz"] for p in points] for name, points in ways.items()
    }
    time = [float(p["time_s"]) for p in ways["truth"]][::20]
    off = {
        name: [math.dist(x, y) for x, y in zip(place[name], place["truth"], strict=False)]
        for name in ("planned", "anchored")
    }
    curves = [("by the plan", time, off["planned"][::20]), ("by eight touches", time, off["anchored"][::20])]
    rms = {name: math.sqrt(sum(x * x for x in values) / len(values)) for name, values in off.items()}
    picture = chart(curves, "How far off the forecast is", across="time [s]", up="forecast against the true arm [µm]")
    return picture, {name: number(value) for name, value in rms.items()}


def resume(folder: Path) -> Drawn:
    """The pages of a job that starts again 35 min late: as they were, and anew."""
    pages: list[dict[str, Any]] = json.loads((folder / "pages/resume.json").read_text())["pages"]
    body = [
        text(30, 34, "largest error on the part of each page, 35 min late [µm]", colour=INK, size=18),
        text(560, 34, "as written", colour=ORANGE, size=18),
        text(680, 34, "written anew", colour=TEAL, size=18),
    ]
    values = [(page["before"]["max_um"], page["after"]["max_um"]) for page in pages]
    top = max(before for before, _ in values)
    for k, pair in enumerate(values):
        for side, value in enumerate(pair):
            x, height, tint = 70 + 160 * k + 62 * side, 230 * value / top, (ORANGE, TEAL)[side]
            body += [
                f'<rect x="{x}" y="{300 - height:.1f}" width="54" height="{height:.1f}" fill="{tint}"/>',
                text(x + 27, 292 - height, number(value), anchor="middle", size=16),
            ]
        body.append(text(128 + 160 * k, 324, f"page {3 + k}", anchor="middle", size=16))
    return svg(900, 340, "Pages of a job as written and written anew", body), {
        "before": number(values[0][0]), "after": number(max(after for _, after in values)),
    }  # fmt: skip
