"""An identified controller's motion as data and as one page."""

import re
from typing import Any

import numpy as np

from compgen.core.commands import Command
from compgen.core.units import MM, MS, PERCENT, UM
from compgen.core.version import __version__
from compgen.identification.motion.fit import times_of, variance_of
from compgen.identification.motion.identify import NO_MORE, IdentifiedMotion
from compgen.identification.motion.speed_curves import SpeedStretch
from compgen.pipelines.executed.executed import ProgramText
from compgen.report.curves import sentence
from compgen.report.figure import COOL, GREY, LIMIT, WARM, Figure, axis, figure, trace, vertical_line
from compgen.report.inputs import Inputs
from compgen.report.page import PageOptions, fixed, page
from compgen.robot.motion import MotionVerdict
from compgen.robot.robot import Robot
from compgen.verification.executed.judgement import ExecutedRun

REMARK = "Of the motion that the log shows: how the controller smooths what it is told, not where the tool was."

VERDICTS = {  # in words
    MotionVerdict.FORETELLS: NO_MORE,
    MotionVerdict.COMMANDABLE: "used to predict, and to correct",
    MotionVerdict.REJECTED: "nothing of it is used",
}
TICKS = [step * 10.0**power for power in range(-2, 5) for step in (1, 2, 5)]  # of an axis of logarithms


def motion_summary(run: ExecutedRun, text: ProgramText, identified: IdentifiedMotion, robot: Robot) -> dict[str, Any]:
    """What a log tells of the controller's motion, in plain types; docs/executed.md has the keys."""
    motion, main = identified.motion, run.clock.main
    return {
        "schema": 1,
        "command": Command.IDENTIFY_MOTION,
        "name": robot.name,
        "verdict": identified.verdict.value,
        "findings": [f.record() for f in (*identified.findings, *run.findings)],
        "motion": {
            "kind": identified.chosen.kind.words,
            "space": motion.space,
            "moving_average_ms": [t / MS for t in motion.moving_averages],
            "first_order_ms": [t / MS for t in motion.first_orders],
            "after_long_ms": [t / MS for t in motion.after_long],
            "reach_percent_m2": motion.reach / PERCENT,
            "reach_at_m2": motion.reach_at,
            "runs_began": sorted(identified.runs_began),
            "interval_ms": (identified.intervals / MS).tolist(),
            "sigma_ms": (identified.sigma / MS).tolist(),
            "whole_periods": run.clock.rounded,
        },
        "held_out": _held_out(identified),
        "tried": [
            {
                "kind": fit.kind.words,
                "times_ms": [t / MS for t in times_of(fit.kind, fit.numbers)],
                "sigma_ms": float(np.sqrt(variance_of(fit.kind, fit.numbers)) / MS),
                "held_out_um": fit.rms / UM,
                "as_well": fit.kind in identified.alike,
            }
            for fit in identified.tried
        ],
        "speeds": [_speeds(stretch) for stretch in identified.speeds],
        "program": {"file": text.file, "name": text.name, "sha256": text.sha256},
        "log": {"file": run.followed.log.table.source, "rows": len(run.followed.time)},
        "override_percent": None if main is None else main.override / PERCENT,
        "provenance": {"compgen": __version__},
    }


def _held_out(identified: IdentifiedMotion) -> dict[str, Any]:
    """What stretches that were not fitted to say."""
    return {
        "rms_um": identified.held_out / UM,
        "limit_um": identified.limit / UM,
        "noise_um": identified.noise / UM,
        "plain_um": identified.plain / UM,
        "p99_um": identified.p99 / UM,
        "along_um": identified.ramps[1] / UM,
        "plain_along_um": identified.ramps[0] / UM,
        "slowed_share": identified.slowed,
        "max_um": identified.largest / UM,
        "blocks": identified.blocks,
    }


def _speeds(stretch: SpeedStretch) -> dict[str, Any]:
    """Speed over time at one place."""
    return {
        "what": stretch.what,
        "at": stretch.at,
        "off_um": stretch.off / UM,
        "time_s": np.round(stretch.time, 4).tolist(),
        "logged_mm_s": np.round(stretch.logged / MM, 2).tolist(),
        "modelled_mm_s": np.round(stretch.modelled / MM, 2).tolist(),
    }


def motion_sentences(summary: dict[str, Any]) -> list[str]:
    """The result in a few sentences."""
    motion, held = summary["motion"], summary["held_out"]
    times = [*motion["moving_average_ms"], *motion["first_order_ms"], *motion["after_long_ms"]]
    words = ", ".join(
        f"{time:.1f} ms ({low:.1f} to {high:.1f})"
        for time, (low, high) in zip(times, motion["interval_ms"], strict=False)
    )
    low, high = motion["sigma_ms"]
    return [
        f"{motion['kind']}{f': {words}' if words else ''}"
        f"{' (the last two in runs that begin with a long line)' if motion['after_long_ms'] else ''}; "
        f"sigma, how far it spreads a command in time, {low:.2f} to {high:.2f} ms (95 %)",
        f"off the path, on stretches that it was not fitted to, it leaves {held['rms_um']:.2f} um rms, 99 % below "
        f"{held['p99_um']:.1f} um, at most {held['max_um']:.1f} um; without smoothing {held['plain_um']:.2f} um rms; "
        f"to be used to correct it may leave {held['limit_um']:.2f} um rms",
        f"known for runs that begin with a {' and with a '.join(f'{began} line' for began in motion['runs_began'])}"
        if motion["runs_began"]
        else "no run with bends shows it: log the program of cgen plan-motion-log",
        f"verdict: {summary['verdict']} ({VERDICTS[MotionVerdict(summary['verdict'])]})",
    ]


def motion_html(summary: dict[str, Any], inputs: Inputs, options: PageOptions) -> bytes:
    """One page, the same bytes for the same inputs."""
    kind, held_out, *_ = motion_sentences(summary)
    return page(
        "motion.html",
        f"{summary['name']}: the controller's motion",
        inputs=inputs,
        remark=REMARK,
        options=options,
        data=summary,
        kind=kind,
        held_out=held_out,
        tried=[
            [
                fit["kind"],
                ", ".join(f"{t:.1f}" for t in fit["times_ms"]),
                fixed(fit["sigma_ms"]),
                fixed(fit["held_out_um"]),
                "yes" if fit["as_well"] else "no",
            ]
            for fit in summary["tried"]
        ],
        drawn=kinds_figure(summary),
        speeds=[(_lost(stretch), _speed(stretch)) for stretch in summary["speeds"]],
    )


def _lost(stretch: dict[str, Any]) -> str:
    """What the program loses there, in words."""
    logged, modelled = (min(stretch[key]) for key in ("logged_mm_s", "modelled_mm_s"))
    if stretch["what"] == "stop":
        return f"Speed before the stop at {stretch['at']}"
    return (
        f"Speed about the corner at {stretch['at']}: down to {logged:.0f} mm/s (by the fit {modelled:.0f}), up to "
        f"{stretch['off_um']:.0f} µm off the programmed path"
    )


def _speed(stretch: dict[str, Any]) -> Figure:
    """Speed over time as logged, and as the fit has it."""
    time, logged, modelled = (np.array(stretch[key]) for key in ("time_s", "logged_mm_s", "modelled_mm_s"))
    traces = [
        trace("scatter", time, logged, name="logged", mode="lines", line={"color": WARM, "width": 1.6}),
        trace(
            "scatter", time, modelled, name="by the fit", mode="lines", line={"color": COOL, "width": 2, "dash": "dash"}
        ),
    ]
    words = (
        f"logged {logged.min():.0f} to {logged.max():.0f} mm/s, by the fit {modelled.min():.0f} to {modelled.max():.0f}"
    )
    alt = sentence(f"Speed over time at the {stretch['what']} at {stretch['at']}", [words])
    return figure(
        traces, 260, alt, yaxis=axis("speed [mm/s]", rangemode="tozero"), xaxis=axis(f"from {stretch['at']} on [s]")
    )


def kinds_figure(summary: dict[str, Any]) -> Figure:
    """A mark for each kind that was tried, what it leaves on an axis of logarithms, and what is accepted."""
    limit = summary["held_out"]["limit_um"]
    traces, words = [], []
    for name, as_well, colour, symbol in (
        ("foretells as well", True, COOL, "diamond"),
        ("worse", False, GREY, "circle"),
    ):
        fits = [fit for fit in summary["tried"] if fit["as_well"] is as_well]
        left = [round(fit["held_out_um"], 3) for fit in fits]
        marker = {"color": colour, "symbol": symbol, "size": 11}
        traces.append(trace("scatter", left, [fit["kind"] for fit in fits], mode="markers", name=name, marker=marker))
        words += [f"{fit['kind']} {size:.3g} µm" for fit, size in zip(fits, left, strict=False)]
    alt = sentence(
        "What each kind leaves on stretches held out, rms", [*words, f"up to {limit:.3g} µm is commanded against"]
    )
    kinds = [str(fit["kind"]) for fit in summary["tried"]][::-1]
    order = {"categoryorder": "array", "categoryarray": kinds}
    in_lines = {"tickvals": kinds, "ticktext": [re.sub("(,|;)? (in|where|shorter) ", r"\1<br>\2 ", k) for k in kinds]}
    short = {"title": {"text": "left, rms [µm]"}, "tickvals": TICKS[::3], "tickangle": 0}
    label = {"text": f"limit {limit:.2f} µm", "x": float(np.log10(limit)), "y": 1, "yref": "paper"}
    look = {"showarrow": False, "xanchor": "left", "yanchor": "top", "font": {"color": LIMIT, "size": 11}}
    return figure(
        traces,
        90 + 34 * len(summary["tried"]),
        alt,
        {"yaxis": in_lines, "xaxis": short, "height": 150 + 45 * len(kinds)},
        xaxis=axis("left on stretches held out, rms [µm]", type="log", tickvals=TICKS),
        yaxis={**order, "automargin": True},
        shapes=[vertical_line(limit, LIMIT)],
        annotations=[{**label, **look}],
    )
