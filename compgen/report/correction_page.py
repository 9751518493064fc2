"""A correction of an existing program as data, as a table, as a page, and where it came from."""

import base64
import json
import zlib
from hashlib import sha256
from html import escape
from typing import Any

import numpy as np

from compgen import __version__
from compgen.core.exceptions import InputError
from compgen.core.units import HOUR, MDEG, MM, UM
from compgen.pipelines.correct import Correction
from compgen.report.figure import TURBO, Figure, axis, div, figure, numbers, trace
from compgen.report.page import COOL, LINES, WARM, findings_list, page, thin

SCHEMA = 1
KIND = "compgen correction"


def correction_summary(result: Correction) -> dict[str, Any]:
    """Everything that ``correct`` found, in plain types; docs/report.md has the schema."""
    plan, heat = result.plan, result.cell.heat
    before, after = _numbers(result, result.error), _numbers(result, result.residual)
    start = result.plan.stations.start
    end = plan.stations.rise[-1] if len(plan.stations.rise) else start
    return {
        "schema": SCHEMA,
        "name": result.name,
        "verdict": "inside" if result.inside else "outside",
        "before": before,
        "after": after,
        "ratio": before["total"]["max_um"] / after["total"]["max_um"] if before and after["total"]["max_um"] else None,
        "bounds": {} if result.options.bound is None else {"max_um": round(result.options.bound / UM, 9)},
        "findings": [f.record() for f in result.findings],
        "unsafe": [{"line": u.line, "text": u.text, "reason": u.reason} for u in plan.scope.unsafe],
        "positions": {
            "corrected": result.changed,
            "new": result.added,
            "unchanged": len(set(plan.poses.number.tolist())) - result.changed,
        },
        "duration_s": float(plan.stations.time[-1]) if len(plan.stations.time) else 0.0,
        "thermal": {
            "start_K": dict(zip(heat.names, start.tolist())),
            "end_K": dict(zip(heat.names, end.tolist())),
        },
        "provenance": _provenance(result),
    }


def correction_json(result: Correction) -> bytes:
    """The summary as a file."""
    return (json.dumps(correction_summary(result), indent=2, allow_nan=False) + "\n").encode()


def provenance_json(result: Correction) -> bytes:
    """What a corrected program was made from, the planned program in it: ``planned_of`` gives it back."""
    packed = base64.b85encode(zlib.compress(result.planned, 9)).decode("ascii")
    data = {"kind": KIND, "schema": SCHEMA, **_provenance(result), "planned_zlib_b85": packed}
    return (json.dumps(data, indent=2) + "\n").encode()


def planned_of(provenance: bytes, corrected: bytes, where: str) -> bytes:
    """The planned program that a corrected one was made from.

    Args:
        provenance: What ``provenance_json`` wrote.
        corrected: The corrected program.
        where: The provenance file's name, for messages.

    Raises:
        InputError: Not a provenance file, not this program's, or damaged.
    """
    try:
        data = json.loads(provenance)
        packed, sums = data["planned_zlib_b85"], (data["planned_sha256"], data["corrected_sha256"])
        if data["kind"] != KIND:
            raise KeyError("kind")
    except (ValueError, KeyError, TypeError, RecursionError):
        raise InputError(f"{where}: not what compgen wrote beside a corrected program") from None
    if sha256(corrected).hexdigest() != sums[1]:
        raise InputError(
            f"{where}: it belongs to another program, or the program was edited since; give the one written"
        )
    try:
        planned = zlib.decompress(base64.b85decode(packed))
    except (ValueError, TypeError, zlib.error):
        planned = b""
    if sha256(planned).hexdigest() != sums[0]:
        raise InputError(f"{where}: the planned program in it is damaged; take it from a backup")
    return planned


def correction_csv(result: Correction) -> bytes:
    """One row for each station: where it stands, when, and its error before and after."""
    plan = result.plan
    head = "station,line,position,time_s,x_mm,y_mm,z_mm,before_um,after_um,corrected," + ",".join(
        f"rise_{n}_K" for n in result.cell.heat.names
    )
    rows = np.flatnonzero(result.ride.fraction == 1)
    station = result.ride.station[rows]
    pose = plan.drive.pose[station]
    line = plan.program.motions.line[plan.drive.motion[station]]
    columns = [
        station + 1,
        line,
        plan.poses.number[pose],
        np.round(plan.stations.time[station], 4) + 0.0,
        *(np.round(plan.poses.position[pose].T / MM, 4) + 0.0),
        np.round(result.error[0][rows] / UM, 3) + 0.0,
        np.round(result.residual[0][rows] / UM, 3) + 0.0,
        result.judged[rows].astype(int),
        *(np.round(plan.stations.rise[station].T, 5) + 0.0),
    ]
    body = "".join(",".join(map(str, row)) + "\n" for row in zip(*(c.tolist() for c in columns)))
    return f"{head}\n{body}".encode("ascii")


def correction_html(result: Correction) -> bytes:
    """The story on one page that opens offline."""
    data = correction_summary(result)
    plan = result.plan
    lead = (
        f'<p class="lead">{escape(data["name"])} on {escape(data["provenance"]["robot"])} &middot; '
        f"{data['positions']['corrected']} positions corrected, {data['positions']['new']} new, "
        f"{data['positions']['unchanged']} unchanged &middot; {data['duration_s']:.1f} s</p>"
    )
    if data["before"]:
        before, after = data["before"]["total"]["max_um"], data["after"]["total"]["max_um"]
        told = f"Largest error <b>{before:.1f} &micro;m</b> before, <b>{after:.2f} &micro;m</b> after, proven from the "
        verdict = f"{told}written text: <b>{data['verdict']}</b> its bounds."
    else:
        verdict = "No position of this program can be corrected: it is unchanged."
    style = data["verdict"] if data["before"] else "predicted"
    body = f'{lead}<p class="big {style}">{verdict}</p>{findings_list(result.findings)}{_table(data)}'
    if len(result.ride.station):
        body += f"<h2>Error over time</h2>{div(_error(result), 'time')}"
        body += f"<h2>The program, coloured by its error before</h2>{div(_space(result), 'space')}"
        body += f"<h2>Temperature while the program runs</h2>{div(_heat(result), 'heat')}"
    if plan.scope.unsafe:
        rows = "".join(
            f"<tr><td>{u.line}</td><td style='text-align:left'><code>{escape(u.text)}</code></td>"
            f"<td style='text-align:left'>{escape(u.reason)}</td></tr>"
            for u in plan.scope.unsafe[:500]
        )
        body += "<h2>Passed through untouched, or casting doubt</h2><table><thead><tr><th>line</th>"
        body += (
            f"<th style='text-align:left'>statement</th><th style='text-align:left'>why</th></tr></thead>{rows}</table>"
        )
    made = data["provenance"]
    body += (
        f"<footer>compgen {made['compgen']}, robot file sha256 {made['robot_sha256']}, planned program sha256 "
        f"{made['planned_sha256']}, corrected {made['corrected_sha256']}. CNT is taken as passing through the points; "
        "jumps and calls are not followed.</footer>"
    )
    return page(f"{data['name']}: correction", body)


def _provenance(result: Correction) -> dict[str, Any]:
    options = result.options
    return {
        "compgen": __version__,
        "program": result.name,
        "robot": result.cell.robot.name,
        "robot_sha256": result.cell.inputs_hash,
        "overrides": list(result.cell.overrides),
        "before": [
            {"state": d.state, "feed_mm_s": round(d.feed / MM, 9), "duration_h": round(d.duration / HOUR, 9)}
            for d in result.before
        ],
        "start_K": dict(zip(result.cell.heat.names, result.plan.stations.start.tolist())),
        "options": {
            "split": options.split,
            "insert_um": None if options.insert is None else round(options.insert / UM, 9),
        },
        "planned_sha256": sha256(result.planned).hexdigest(),
        "corrected_sha256": sha256(result.text).hexdigest(),
    }


def _numbers(result: Correction, error: tuple[Any, Any]) -> dict[str, dict[str, float]]:
    """Statistics over stations and places between them that were corrected; empty when there is none."""
    found = {}
    for name, values, unit, key in (("total", error[0], UM, "um"), ("turn", error[1], MDEG, "mdeg")):
        some = values[result.judged] / unit
        if len(some):
            found[name] = {
                f"max_{key}": float(some.max()),
                f"p99_{key}": float(np.percentile(some, 99)),
                f"rms_{key}": float(np.sqrt(np.mean(some**2))),
            }
    return found


def _table(data: dict[str, Any]) -> str:
    if not data["before"]:
        return ""
    rows = ""
    for key, label in (("total", "position [&micro;m]"), ("turn", "orientation [mdeg]")):
        cells = "".join(f"<td>{v:.2f}</td>" for side in ("before", "after") for v in data[side][key].values())
        rows += f"<tr><td>{label}</td>{cells}</tr>"
    head = "".join(f"<th>{side} {part}</th>" for side in ("before", "after") for part in ("max", "p99", "rms"))
    title = "<h2>Error of the tool centre point</h2><table><thead><tr><th></th>"
    return f"{title}{head}</tr></thead><tbody>{rows}</tbody></table>"


def _error(result: Correction) -> Figure:
    traces = []
    for name, values, colour in (("before", result.error[0], WARM), ("after", result.residual[0], COOL)):
        keep = thin(values)
        look = {"mode": "lines+markers", "marker": {"size": 4}, "line": {"color": colour, "width": 1.4}}
        x, y = np.round(result.ride.time[keep], 3), np.round(values[keep] / UM, 3)
        traces.append(trace("scatter", x, y, name=name, **look))
    return figure(traces, 320, yaxis=axis("error [µm]", rangemode="tozero"), xaxis=axis("time from the start [s]"))


def _space(result: Correction) -> Figure:
    plan = result.plan
    rows = np.flatnonzero(result.ride.fraction == 1)
    rows = rows[thin(result.error[0][rows])]
    pose = plan.drive.pose[result.ride.station[rows]]
    xyz = (np.round(v / MM, 2) for v in plan.poses.position[pose].T)
    marker = {
        "size": 3,
        "color": numbers(np.round(result.error[0][rows] / UM, 3)),
        "colorscale": TURBO,
        "colorbar": {"title": {"text": "µm"}, "thickness": 12},
        "cmin": 0,
        "cmax": max(float(np.max(result.error[0][rows], initial=0.0)) / UM, 1e-3),
    }
    text = [f"P[{n}]" for n in plan.poses.number[pose].tolist()]
    line = {"color": "#cbd5e1", "width": 2}
    points = trace("scatter3d", *xyz, mode="lines+markers", marker=marker, line=line, text=text, showlegend=False)
    scene = {
        "xaxis": axis("X [mm]"), "yaxis": axis("Y [mm]"), "zaxis": axis("Z [mm]"), "aspectmode": "data",
        "camera": {"eye": {"x": 1.3, "y": -1.9, "z": 1.3}},
    }  # fmt: skip
    return figure([points], 480, scene=scene)


def _heat(result: Correction) -> Figure:
    solved = result.plan.stations
    keep = thin(np.arange(len(solved.time), dtype=float))
    time = np.round(solved.time[keep], 3)
    traces = []
    for i, name in enumerate(result.cell.heat.names):
        line = {"color": LINES[i % len(LINES)], "width": 1.6}
        traces.append(trace("scatter", time, np.round(solved.rise[keep, i], 4), name=name, line=line))
    return figure(traces, 320, yaxis=axis("rise [K]", rangemode="tozero"), xaxis=axis("time from the start [s]"))
