"""Writes docs/validation.md and its pictures: the study's thermal figures and tables, recomputed beside the quoted.

    python docs/validation.py

Quoted values carry the study's line; differences are explained once, in the page. Both thermal models are shown where
both say something: the nodes (the study's own model, its parameters fitted to the tables) and the network.
"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from compgen.core.pose import Pose
from compgen.core.units import HOUR, MM, UM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.robot import inverse_kinematics
from compgen.thermal import Duty, rise_history, state_after

HERE = Path(__file__).parent
ROOT = HERE.parent
sys.path.insert(0, str(ROOT / "robots"))
sys.path.insert(0, str(HERE))
import m710ic50_fit as node_fit  # noqa: E402
import m710ic50_network_fit as network_fit  # noqa: E402
import validation_measured  # noqa: E402
import validation_network  # noqa: E402

NETWORK = "robot.thermal.model=network"
HOT = 'before=[{state="moving", program="circle_1300", feed_mm_s=200, duration_h=6}]'
TINTS = {"nodes": "#c2410c", "network": "#0f766e", "study": "#1e293b", "y": "#ca8a04", "z": "#7c3aed", "x": "#c2410c"}


def job_of(name: str, *overrides: str):
    """A shipped path after six hours on the circle."""
    return load_job(str(ROOT / "paths" / f"{name}.toml"), overrides=[HOT, *overrides])


def errors(name: str, *overrides: str) -> tuple[np.ndarray, np.ndarray]:
    """Positions on the surface [mm] and thermal errors there [um]."""
    planned = generate.predict(job_of(name, *overrides), lambda stage, share: None)
    seen = planned.path.contact if hasattr(planned.path, "contact") else slice(None)
    return planned.path.target.position[seen] / MM, planned.error()[seen, :3] / UM


def over_back(position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same with the arm reaching over backwards, which breaks joint limits here: computed, not driven."""
    job = job_of("line_x")
    planned = generate.predict(job, lambda stage, share: None)
    down = np.broadcast_to(planned.path.target.rotation[0], (len(position), 3, 3))
    target = Pose(position * MM, down)
    flange = inverse_kinematics.flange_from_tool(target, job.tool.pose)
    best, _ = inverse_kinematics.solve_flange(job.robot, flange, inverse_kinematics.Posture(False, False, False))
    return position, planned.model.error(best, job.start_rise()[None], target)[:, :3] / UM


def per_kelvin(*nodes: str) -> float:
    """How far a kelvin of some nodes together moves the tool at full reach, the end of the X line [um]."""
    job = job_of("line_x")
    planned = generate.predict(job, lambda stage, share: None)
    last = int(np.argmax(planned.path.target.position[:, 0]))
    place = Pose(planned.path.target.position[last : last + 1], planned.path.target.rotation[last : last + 1])
    rise = np.array([[float(name in nodes) for name in job.heat.names]])
    return float(np.linalg.norm(planned.model.error(planned.theta[last : last + 1], rise, place)[0, :3])) / UM


def at(position: np.ndarray, error: np.ndarray, axis: int, value: float) -> np.ndarray:
    """Errors where a coordinate [mm] is reached first."""
    return error[int(np.argmin(np.abs(position[:, axis] - value)))]


# pictures


def plot(file: str, title: str, curves: list, points: Sequence[tuple[float, float]], xlabel: str, ylabel: str) -> None:
    """An SVG with curves (x, y, name, tint, dash) and quoted points (x, y)."""
    width, height, left, right, top, base = 760, 340, 62, 740, 46, 290
    every: list[Any] = [*((x, y) for x, y, *_ in curves), *([np.array(points).T] if points else [])]
    xs, ys = np.concatenate([e[0] for e in every]), np.concatenate([e[1] for e in every])
    x0, x1 = float(xs.min()), float(xs.max())
    pad = 0.06 * (ys.max() - ys.min() + 1e-9)
    y0, y1 = float(ys.min() - pad), float(ys.max() + pad)
    if 0 < y0 < 0.4 * y1:
        y0 = 0.0

    def sx(x: float) -> float:
        return left + (x - x0) / (x1 - x0) * (right - left)

    def sy(y: float) -> float:
        return base - (y - y0) / (y1 - y0) * (base - top)

    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" '
        'font-size="13">',
        f'<rect width="{width}" height="{height}" fill="white"/>',
        f'<text x="{left}" y="20" font-size="15" fill="#1e293b">{title}</text>',
    ]
    for value in ticks(y0, y1):
        y = sy(value)
        out.append(f'<line x1="{left}" x2="{right}" y1="{y:.1f}" y2="{y:.1f}" stroke="#e2e8f0"/>')
        out.append(f'<text x="{left - 7}" y="{y + 4:.1f}" text-anchor="end" fill="#475569">{value:g}</text>')
    out += [
        f'<text x="{sx(value):.1f}" y="{base + 18}" text-anchor="middle" fill="#475569">{value:g}</text>'
        for value in ticks(x0, x1)
    ]
    for n, (x, y, name, tint, dash) in enumerate(curves):
        keep = np.unique(np.linspace(0, len(x) - 1, 400).astype(int))
        line = " ".join(f"{sx(x[i]):.1f},{sy(y[i]):.1f}" for i in keep)
        style = f' stroke-dasharray="{dash}"' if dash else ""
        out.append(f'<polyline points="{line}" fill="none" stroke="{tint}" stroke-width="1.8"{style}/>')
        place = left + 10 + 165 * (n % 4)
        out.append(
            f'<line x1="{place}" x2="{place + 22}" y1="{34 + 14 * (n // 4)}" y2="{34 + 14 * (n // 4)}" '
            f'stroke="{tint}" stroke-width="2"{style}/>'
            f'<text x="{place + 27}" y="{38 + 14 * (n // 4)}" fill="#475569">{name}</text>'
        )
    out += [f'<circle cx="{sx(x):.1f}" cy="{sy(y):.1f}" r="4" fill="none" stroke="#1e293b"/>' for x, y in points]
    below = f"{xlabel}; circles: quoted" if points else xlabel
    out.append(f'<text x="{right}" y="{base + 36}" text-anchor="end" fill="#475569">{below}</text>')
    out.append(f'<text x="{left}" y="{base + 36}" fill="#475569">{ylabel}</text></svg>')
    (HERE / file).write_text("\n".join(out) + "\n")


def ticks(low: float, high: float) -> np.ndarray:
    """Round numbers between."""
    step = 10.0 ** np.floor(np.log10((high - low) / 4))
    step *= next(f for f in (1, 2, 2.5, 5, 10) if (high - low) / (step * f) <= 6)
    return np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1) * step + 0.0


def table(head: list[str], rows: list[list]) -> str:
    """Rows as markdown."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *("| " + " | ".join(str(c) for c in row) + " |" for row in rows)]) + "\n"


# figures 64 to 66


def rise_along(job, length: str, x: np.ndarray) -> np.ndarray:
    """Rise along a link at distances from its base end [m], at the start of a path after the reference duty [K]."""
    if job.heat.kind == "network":
        bodies = [body.name for body in job.heat.bodies]
        inside = job.heat.volumes.part == 2 * bodies.index(length)
        return np.interp(x, job.heat.volumes.place[inside], (job.heat.to_volumes @ job.state())[inside])
    rise = dict(zip(job.heat.names, job.state(), strict=True))
    sections = next(profile.sections for profile in job.cell.profiles if profile.length == length)
    along = np.empty(len(x))
    for s in sections:
        inside, a, b = x >= s.start, rise[s.node_a], rise[s.node_b]
        u = (x[inside] - s.start) / (s.end - s.start)
        along[inside] = a + (b - a) * u if s.shape == "linear" else a * (b / a) ** u
    return along


def profiles() -> str:
    """Figures 64 to 66."""
    jobs = {"nodes": job_of("circle_1300"), "network": job_of("circle_1300", NETWORK)}
    quoted: dict[str, list[tuple[float, float, int]]] = {
        "a2": [(0, 11, 1053), (100, 3.9, 1053), (435, 3.9, 1053), (750, 3.9, 1053), (870, 13, 1053)],
        "d4": [(0, 13, 1055), (1016, 3, 1055)],
        "d6": [(0, 3, 1055), (175, 2.3, 1057)],
    }
    rows, names = [], {"a2": "64, link 1", "d4": "65, link 2", "d6": "66, link 3"}
    for length, points in quoted.items():
        end = points[-1][0]
        x = np.linspace(0, end, 600)
        along = {m: rise_along(job, length, x * MM) for m, job in jobs.items()}
        plot(
            f"validation_{length}.svg", f"Figure {names[length]}: rise after 6 h at 200 mm/s",
            [(x, along[m], m, TINTS[m], "") for m in along], [(p[0], p[1]) for p in points],
            "mm from the base end", "K",
        )  # fmt: skip
        places, quotes, study_lines = zip(*points, strict=True)
        rises = [", ".join(f"{np.interp(p, x, along[m]):.2f}" for p in places) for m in along]
        grown = [f"{11.25 * end * MM * along[m].mean():.1f} um" for m in along]
        rows.append([
            names[length], f"at {', '.join(map(str, places))} mm; growth",
            f"{', '.join(f'{q:g}' for q in quotes)} K ({', '.join(map(str, dict.fromkeys(study_lines)))})",
            *(f"{rise} K; {growth}" for rise, growth in zip(rises, grown, strict=True)),
        ])  # fmt: skip
    return table(["figure", "what", "study (line)", "nodes", "network"], rows)


# figures 67 to 71


def lines() -> tuple[str, dict]:
    """Figures 67 to 71; and the ends of the X line."""
    rows, seen = [], {}
    x, e = errors("line_x")
    xn, en = errors("line_x", NETWORK)
    xb, eb = over_back(np.linspace([700, -30, 203], [1610, -30, 203], 92))
    first, last = at(x, e, 0, 700)[0], at(x, e, 0, 2000)[0]
    seen["x"] = (first, last, at(xn, en, 0, 700)[0], at(xn, en, 0, 2000)[0])
    plot(
        "validation_x.svg", "Figure 67: X line, error in X after 6 h at 200 mm/s",
        [(x[:, 0], e[:, 0], "nodes", TINTS["nodes"], ""), (xn[:, 0], en[:, 0], "network", TINTS["network"], ""),
         (xb[:, 0], eb[:, 0], "nodes, arm over back", TINTS["z"], "5 4")],
        [(700, 71), (2000, 122)], "X [mm]", "um",
    )  # fmt: skip
    rows += [
        ["67, X line", "X at 700 mm", "71 um (1609)", f"{first:.1f} um; arm over back {at(xb, eb, 0, 700)[0]:.1f}",
         f"{seen['x'][2]:.1f} um"],
        ["67", "X at 2000 mm", "122 um (1609)", f"{last:.1f} um", f"{seen['x'][3]:.1f} um"],
        ["67", "Y, largest", "-3 um (1071)", f"{e[np.argmax(np.abs(e[:, 1])), 1]:.1f} um",
         f"{en[np.argmax(np.abs(en[:, 1])), 1]:.1f} um"],
        ["67", "Z", "up to 20 um (1071)", f"{e[:, 2].min():.1f} to {e[:, 2].max():.1f} um; arm over back "
         f"{eb[:, 2].min():.1f} to {eb[:, 2].max():.1f}", f"{en[:, 2].min():.1f} to {en[:, 2].max():.1f} um"],
    ]  # fmt: skip
    y, e = errors("line_y")
    yn, en = errors("line_y", NETWORK)
    plot(
        "validation_y.svg", "Figure 68: Y line after 6 h at 200 mm/s",
        [(y[:, 1], e[:, 1], "nodes, Y", TINTS["nodes"], ""), (yn[:, 1], en[:, 1], "network, Y", TINTS["network"], ""),
         (y[:, 1], e[:, 0], "nodes, X", TINTS["nodes"], "5 4"), (y[:, 1], e[:, 2], "nodes, Z", TINTS["z"], "2 3")],
        [(-680, -40), (-30, -2), (620, 38), (-680, 78), (620, 78)], "Y [mm]", "um",
    )  # fmt: skip
    stations = (-680, -30, 620)
    along = [", ".join(f"{at(p, q, 1, place)[1]:.1f}" for place in stations) for p, q in ((y, e), (yn, en))]
    rows += [
        ["68, Y line", "Y at -680, -30, 620 mm", "-40, -2, 38 um (1627)", *(f"{sizes} um" for sizes in along)],
        ["68", "X, whole axis", "78 um +-1 (1629)", f"{e[:, 0].min():.1f} to {e[:, 0].max():.1f} um",
         f"{en[:, 0].min():.1f} to {en[:, 0].max():.1f} um"],
        ["68", "Z at -550 mm", "-5 um (1631)", f"{at(y, e, 1, -550)[2]:.1f} um", f"{at(yn, en, 1, -550)[2]:.1f} um"],
    ]  # fmt: skip
    z, e = errors("line_z")
    zn, en = errors("line_z", NETWORK)
    zb, eb = over_back(np.linspace([1050, -30, 103], [1050, -30, 1103], 101))
    plot(
        "validation_z.svg", "Figure 69: Z line after 6 h at 200 mm/s, error in Z",
        [(z[:, 2], e[:, 2], "nodes", TINTS["nodes"], ""), (zn[:, 2], en[:, 2], "network", TINTS["network"], ""),
         (zb[:, 2], eb[:, 2], "nodes, arm over back", TINTS["z"], "5 4")],
        [(103, 7), (1103, 77)], "Z [mm]", "um",
    )  # fmt: skip
    rows += [
        ["69, Z line", "Z", "77 to 7 um (1083)", f"{e[:, 2].min():.1f} to {e[:, 2].max():.1f} um; arm over back at "
         f"X = 1050: {at(zb, eb, 2, 303)[2]:.1f} to {at(zb, eb, 2, 1103)[2]:.1f}, and {at(zb, eb, 2, 103)[2]:.1f} to "
         f"{at(zb, eb, 2, 1003)[2]:.1f} between 103 and 1003 mm", f"{en[:, 2].min():.1f} to {en[:, 2].max():.1f} um"],
        ["69", "X", "80 to 90 um (1083)", f"{e[:, 0].min():.1f} to {e[:, 0].max():.1f} um; arm over back "
         f"{eb[:, 0].min():.1f} to {eb[:, 0].max():.1f}", f"{en[:, 0].min():.1f} to {en[:, 0].max():.1f} um"],
    ]  # fmt: skip
    c, e = errors("circle_1300")
    cn, en = errors("circle_1300", NETWORK)
    angle, angle_n = (np.degrees(np.unwrap(np.arctan2(p[:, 1] + 30, p[:, 0] - 1350))) for p in (c, cn))
    curves = [(angle, e[:, i], f"nodes, {n.upper()}", TINTS[n], "") for i, n in enumerate("xyz")]
    curves += [(angle_n, en[:, i], f"network, {n.upper()}", TINTS[n], "5 4") for i, n in enumerate("xyz")]
    plot("validation_circle.svg", "Figure 70: the circle after 6 h at 200 mm/s", curves,
         [(0, 122), (180, 45), (90, 36), (270, -39), (0, 5), (130, -7), (180, -5.2)], "angle [deg]", "um")  # fmt: skip
    for what, axis, places, quotes in (
        ("X at 0, 180 deg", 0, (0, 180), "122, 45"), ("Z at 0, 130, 180 deg", 2, (0, 130, 180), "5, -7, -5.2"),
    ):  # fmt: skip
        sizes = [", ".join(f"{np.interp(place, a, q[:, axis]):.1f}" for place in places)
                 for a, q in ((angle, e), (angle_n, en))]  # fmt: skip
        rows.append(["70, circle", what, f"{quotes} um (1654)", *(f"{size} um" for size in sizes)])
    rows.append(["70", "Y peaks", "36, -39 um (1654)", f"{e[:, 1].max():.1f}, {e[:, 1].min():.1f} um",
                 f"{en[:, 1].max():.1f}, {en[:, 1].min():.1f} um"])  # fmt: skip
    s, e = errors("spiral_1300")
    _, en = errors("spiral_1300", NETWORK)
    way = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(s, axis=0), axis=1))]) / 1000
    plot("validation_spiral.svg", "Figure 71: the spiral after 6 h at 200 mm/s",
         [(way, e[:, i], f"nodes, {n.upper()}", TINTS[n], "") for i, n in enumerate("xyz")], [], "along the path [m]",
         "um")  # fmt: skip
    for axis, told in ((0, "50 to 120 um (1093)"), (1, "-30 to 30 um (1095)"), (2, "-6 to 5 um (1654)")):
        found = [f"{q[:, axis].min():.1f} to {q[:, axis].max():.1f} um" for q in (e, en)]
        rows.append(["71, spiral", "XYZ"[axis], told, *found])
    return table(["figure", "what", "study (line)", "nodes", "network"], rows), seen


# tables 3 to 5


def rates() -> str:
    """Tables 3 to 5."""
    heat, network = job_of("circle_1300").heat, network_fit.base()
    parts = {"three": "j2", "four": "link1", "six": "j3", "eleven": "wrist"}
    cases = [
        ("3, lines at 20 mm/s, 120 min", "XY", 0.02, 120, (0.0106, 0.01, 0.0288, 0.0074), {}),
        ("4, spiral at 100 mm/s, 77 min", "spiral", 0.1, 77, (0.0214, 0.0085, 0.0423, 0.0061),
         {"three": "0.214", "eleven": "0.061"}),
        ("5, circle at 100 mm/s, 360 min", "circle", 0.1, 360, (0.0214, 0.0101, None, 0.008), {"three": "0.214"}),
    ]  # fmt: skip
    rows = []
    for name, motion, feed, minutes, quoted, printed in cases:
        spent = minutes * 60.0
        ours = state_after(heat, [Duty("moving", feed, spent)])
        loss = network_fit.loss(network.drives, motion, feed)
        theirs = network.outputs @ state_after(network, [Duty("moving", feed, spent, loss=loss)])
        quotes = ["not linear" if value is None else f"{value:g}" for value in quoted]
        quotes = [q + f" (printed {printed[p]})" if p in printed else q for p, q in zip(parts, quotes, strict=True)]
        computed = [", ".join(f"{r[h.names.index(node)] / minutes:.4f}" for node in parts.values())
                    for r, h in ((ours, heat), (theirs, network))]  # fmt: skip
        rows.append([name, ", ".join(quotes), *computed])
    return table(["table", "study [K/min]", "nodes", "network"], rows)


def warming() -> str:
    """Warming and cooling, and what was asked of both models."""
    nodes, network = job_of("circle_1300").heat, network_fit.base()
    hours = np.linspace(0, 22, 600)
    loss = network_fit.loss(network.drives, "circle", 0.2)
    duties = [Duty("moving", 0.2, 6 * HOUR, loss=loss), Duty("off", 0.0, 16 * HOUR)]
    curves = []
    for name, tint in (("j3", "x"), ("j2", "y")):
        for heat, model, dash in ((nodes, "nodes", ""), (network, "network", "5 4")):
            rise = rise_history(heat, duties, hours * HOUR)[:, heat.names.index(name)]
            curves.append((hours, rise, f"{model}, {name}", TINTS[tint], dash))
    plot("validation_warming.svg", "Six hours at 200 mm/s on the circle, then off", curves,
         [(6, 13), (6, 12), (6, 11), (22, 1)], "hours", "K")  # fmt: skip
    off, noff = node_fit.misses(nodes), network_fit.misses(network)
    left = state_after(nodes, [Duty("moving", 0.2, 6 * HOUR), Duty("off", 0.0, 16 * HOUR)])
    straight = []
    for heat in (nodes, network):
        part = np.linspace(0, 3, 60)
        rise = rise_history(heat, duties[:1], part * HOUR)[
            :, [heat.names.index(n) for n in ("j2", "link1", "j3", "wrist")]
        ]
        straight.append(max(np.abs(r - np.polyval(np.polyfit(part, r, 1), part)).max() for r in rise.T))
    double = network_fit.doubling(network)
    p = dict(zip(nodes.names, nodes.exponent, strict=False))
    rows = [
        ["24 quoted temperatures, rms / worst", "0.55 / 1.15 K asked", f"{np.sqrt(np.mean(off**2)):.2f} / "
         f"{np.abs(off).max():.2f} K", f"{np.sqrt(np.mean(noff**2)):.2f} / {np.abs(noff).max():.2f} K"],
        *validation_network.left_out_rows(),
        ["first 3 h at 200 mm/s off a straight line", "0.4 K asked", *(f"{s:.2f} K" for s in straight)],
        ["left 16 h after stopping, j3 and j2", "1 K (1428); 1.6 asked",
         f"{left[nodes.names.index('j3')]:.2f} and {left[nodes.names.index('j2')]:.2f} K",
         "{1:.2f} and {0:.2f} K".format(*network_fit.left(network))],
        ["steady rise at 200 over 100 mm/s, j3 and j2", "1.5 (Heisel, line 266)",
         f"{2 ** p['j3']:.2f} and {2 ** p['j2']:.2f}", f"{double['j3']:.2f} and {double['j2']:.2f}"],
    ]  # fmt: skip
    return table(["what", "study or asked", "nodes", "network"], rows)


def kelvins() -> str:
    """What a kelvin of each node moves."""
    sets = [("j3",), ("j2",), ("j2", "j3"), ("link1",), ("wrist",), ("face",), ("wrist", "face")]
    parts = {"j2": "three", "link1": "four", "j3": "six", "wrist": "eleven", "face": "the flange's face"}
    rows = [[" and ".join(s), " and ".join(parts[n] for n in s), f"{per_kelvin(*s):.1f} um"] for s in sets]
    return table(["node", "part", "a kelvin moves the tool by"], rows)


def measured() -> dict[str, str]:
    """The six curves that the study measured, and what could explain them."""
    head = ["curve", "measured (line)", "repeatability, cold and hot", "nodes", "network", "nodes off, in sigmas"]
    causes = ["cause", "parameters", "size, sign as printed", "chi-square", "left out", "size, sign turned",
              "chi-square", "left out"]  # fmt: skip
    tables = {
        "curves": table(head, validation_measured.curve_rows()),
        "causes": table(causes, validation_measured.cause_rows()),
    }
    return tables | validation_measured.numbers()


def materials() -> dict[str, str]:
    """What the network is made of."""
    head = ["body", "material", "mass", "diffusivity", "at most"]
    return {"bodies": table(head, validation_network.body_rows()), **validation_network.numbers()}


def page() -> str:
    """The text of docs/validation.md; draws the pictures."""
    quoted, seen = lines()
    first, last, *_ = seen["x"]
    span = last - first
    return (HERE / "validation.md.in").read_text().format(
        profiles=profiles(), figures=quoted, rates=rates(), warming=warming(), kelvins=kelvins(),
        cte=11.25 * 90 / span, more=100 * (90 / span - 1), **measured(), **materials(),
    )  # fmt: skip


if __name__ == "__main__":
    (HERE / "validation_measured.svg").write_text(validation_measured.picture())
    (HERE / "validation.md").write_text(page())
