"""An identification as data and as one page, and the validation of an identified robot as data."""

from typing import Any

import numpy as np

from compgen.core.arrays import Array, BoolArray, nine_digits
from compgen.core.commands import Command
from compgen.core.finding_codes import Level
from compgen.core.units import DEG, HOUR, MM, UM
from compgen.core.version import __version__
from compgen.identification.cross_validation import CrossValidation
from compgen.identification.fit_limits import fit_limits_record
from compgen.identification.identifiability import correlations, largest_moves
from compgen.identification.identify import Identification
from compgen.identification.measurements import KINDS, Measurements
from compgen.identification.validation import Validation, distance_statistics
from compgen.identification.verdict import known_here_only
from compgen.report.curves import CurveRow, course, curves_in_words, figure_in_rows
from compgen.report.figure import COOL, GREY, RED_TO_BLUE, WARM, Figure, Trace, axis, figure, rows_to_draw, spans, trace
from compgen.report.figure_in_space import Coloured, figure_in_space
from compgen.report.inputs import Inputs
from compgen.report.key_words import parameter_words
from compgen.report.page import PLAIN, PageOptions, fixed, page

HOT = 0.5  # [K] from which a pose counts as hot
FIGURES = {
    "space": "Residual vectors in space",
    "time": "Residual over time, before and after",
    "joints": "Residual over each joint, after",
    "correlation": "Correlation of the parameters that the data knows best",
}
REMARK = "What the measurements do not excite stays at the robot file's value, and is known no better than it says."
SIGNED = 0.3  # from which on a correlation has its sign written on it
MAX_PARAMETERS = 60  # that a figure of correlations can show
MOST_PARAMETERS = 40  # in the table, those first that move the tool most
LONG = 2 * HOUR  # of measurements, from which their time is in hours
MOST_PAIRS, ALIKE = 12, 0.8  # in the table of parameters that are hard to tell apart; correlation from which they are


def identification_summary(identification: Identification) -> dict[str, Any]:
    """Everything an identification found, in plain types; units as the keys name them."""
    best, data = identification.selected, identification.data
    known = identification.identifiability
    terms = identification.model.parameters
    return {
        "command": Command.IDENTIFY,
        "compgen": __version__,
        "robot": identification.robot.name,
        "verdict": "refused" if identification.refused else "accepted",
        "model": best.candidate.name,
        "poses": len(data.theta),
        "places": len(data.pose),
        "kinds": _kinds(identification),
        "reflectors": list(data.reflectors),
        "noise_um": _um(best.fit.noise),
        "held_out_um": _held_out(best.cross_validation),
        "known_um": _known_um(identification),
        "fit": fit_limits_record(identification.limits),
        "ladder": [
            {
                "model": s.candidate.name,
                "parameters": int(s.fit.active.sum()),
                "effective": round(float(s.fit.gamma.sum()), 2),
                "held_out_um": _held_out(s.cross_validation),
                "noise_um": _um(s.fit.noise),
            }
            for s in identification.candidates
        ],
        "condition": _finite_or_none(known.condition),
        "frames_condition": _finite_or_none(known.frames_condition),
        "coverage": _coverage(identification),
        "parameters": _parameters(identification),
        "alike": [[terms[i].name, terms[j].name, round(r, 4)] for i, j, r in known.correlated],
        "outliers": [
            {"row": data.label[n], "distance_um": _um(float(np.linalg.norm(best.fit.residual[n])))}
            for n in np.flatnonzero(best.fit.outlier).tolist()
        ],
        "findings": [f.record() for f in identification.findings],
    }


def _known_um(identification: Identification) -> dict[str, float] | None:
    """How well the flange is known in a frame that it teaches (k = 2); None where nothing of the arm was fitted."""
    if not identification.selected.fit.active.any():
        return None
    here, anywhere = identification.taught_sigma
    return {"measured": _um(2 * here), "anywhere": _um(2 * anywhere)}


def _held_out(validated: CrossValidation) -> dict[str, float]:
    """The error on poses that were left out, and where its mean lies in 95 of 100 cases."""
    low, high = validated.interval()
    return {"mean": _um(validated.mean), "low": _um(low), "high": _um(high), "robust": _um(validated.robust_mean)}


def _coverage(identification: Identification) -> dict[str, Any]:
    """How far each joint was moved, and what share of its range that is."""
    span = np.ptp(identification.data.theta, axis=0) / DEG
    share = span / ((identification.robot.upper - identification.robot.lower) / DEG)
    return {f"j{k + 1}": {"span_deg": round(float(span[k]), 3), "share": round(float(share[k]), 4)} for k in range(6)}


def _parameters(identification: Identification) -> list[dict[str, Any]]:
    """What was fitted: value and sigma in the unit of the name, and how far the value moves the tool."""
    fit = identification.selected.fit
    rows, moves = np.flatnonzero(fit.active).tolist(), largest_moves(identification.model, fit).tolist()
    terms = identification.model.parameters
    return [
        {
            "name": terms[k].name,
            "value": nine_digits(fit.p[k] / terms[k].unit),
            "sigma": nine_digits(fit.sigma[k] / terms[k].unit),
            "moves_um": _um(moved),
            "told": round(float(fit.gamma[k]), 4),
            "held_by_prior": k in identification.identifiability.held_by_prior,
        }
        for k, moved in zip(rows, moves, strict=True)
    ]


def ladder_cells(step: dict[str, Any]) -> list[str]:
    """Of one of the models that were tried: parameters that count, held-out error and its interval, noise."""
    held_out = step["held_out_um"]
    interval = f"{held_out['low']:.1f} to {held_out['high']:.1f}"
    return [f"{step['effective']:.1f}", f"{held_out['mean']:.1f}", interval, f"{step['noise_um']:.1f}"]


def _kinds(identification: Identification) -> dict[str, Any]:
    """Of places, touches and distances: how many rows, their noise, and how well they are predicted unseen [um]."""
    best, kind = identification.selected, identification.data.kind
    return {
        KINDS[k]: {
            "rows": int((kind == k).sum()),
            "noise_um": _um(best.fit.noise_of_row[kind == k][0]),
            "held_out_um": _um(np.nanmean(best.cross_validation.distance[kind == k])),
        }
        for k in np.unique(kind).tolist()
    }


def limits_sentence(summary: dict[str, Any]) -> str:
    """How well the flange is known, and what the fit leaves beside its parameters' covariance, in words."""
    beside, known = _beside(summary), summary["known_um"]
    if known is None:
        return beside
    return (
        f"in a frame that it teaches, the flange is known to +- {known['measured']:.0f} um (95 %) with joint angles as "
        f"measured, +- {known['anywhere']:.0f} um with any; {beside}"
    )


def _beside(summary: dict[str, Any]) -> str:
    """What the fit leaves beside its parameters' covariance, and how well the whole foretells, in words."""
    fit = summary["fit"]
    repeats, missing = fit.get("repeatability_um"), fit.get("thermal_missing_percent")
    parts = [
        f"fit noise {fit['fit_noise_um']:.1f} um a coordinate" + (" (repeatability in it)" if repeats is None else ""),
        *([] if repeats is None else [f"repeatability {repeats:.1f} um"]),
        *([] if missing is None else [f"thermal physics misses {missing:.0f} % of what warmth does"]),
    ]
    blocks, scale = fit["forecast_blocks"], fit["forecast_scale"]
    parts.append(
        (
            f"{blocks} stretches of poses, each foretold from those before, "
            if blocks
            else "no poses could be foretold, "
        )
        + (f"make the band {scale:.2f} times as wide" if round(scale, 2) > 1 else "leave the band as it is")
    )
    return f"beside the parameters: {'; '.join(parts)}"


def validation_summary(validation: Validation) -> dict[str, Any]:
    """Errors of each target, of cold and warm poses and overall [mm], less the rows set aside; then with them."""
    data, kept = validation.data, ~validation.outlier

    def sides(rows: BoolArray) -> dict[str, Any]:
        distances = {"nominal": validation.nominal[rows], "identified": validation.identified[rows]}
        return {
            side: {k: (v if k == "count" else round(v / MM, 6)) for k, v in distance_statistics(distance).items()}
            for side, distance in distances.items()
        }

    warm = data.rise.max(axis=1, initial=0.0)[data.pose] > HOT
    states = {"cold": kept & ~warm, "hot": kept & warm} if warm.any() else {}
    is_outside = any(f.level is Level.OUTSIDE for f in validation.findings)
    return {
        "command": Command.CHECK_ROBOT,
        "unit": "mm",
        "verdict": "outside" if is_outside else "inside",
        "overall": sides(kept),
        "states": {name: sides(rows) for name, rows in states.items()},
        "targets": {name: sides(kept & (data.reflector == r)) for r, name in enumerate(data.reflectors)},
        "set_aside": [
            {"row": data.label[n], "distance_um": _um(float(validation.identified[n]))}
            for n in np.flatnonzero(validation.outlier).tolist()
        ],
        "all_rows": sides(np.ones(len(kept), dtype=bool)),
        "findings": [f.record() for f in validation.findings],
    }


def _um(value: float) -> float:
    return round(float(value) / UM, 4)


def _finite_or_none(value: float) -> float | None:
    return round(value, 3) if np.isfinite(value) else None


def identification_html(identification: Identification, inputs: Inputs, options: PageOptions = PLAIN) -> bytes:
    """One page: the verdict, the ladder, residuals before and after, parameters, correlations."""
    data = identification_summary(identification)
    ranked, pairs = sorted(data["parameters"], key=lambda p: -p["moves_um"]), _alike(identification)
    is_known_here_only = bool(known_here_only(*identification.taught_sigma))
    return page(
        "identification.html",
        f"Identification of {identification.robot.name}",
        inputs=inputs,
        remark=REMARK,
        options=options,
        data=data,
        kind="outside" if identification.refused else "warning" if is_known_here_only else "inside",
        kinds=", ".join(f"{rows['rows']} {kind}" for kind, rows in data["kinds"].items()),
        limits=_beside(data),
        findings=identification.findings,
        ladder=[[s["model"], s["parameters"], *ladder_cells(s)] for s in data["ladder"]],
        kind_rows=[
            [kind, k["rows"], fixed(k["noise_um"], 1), fixed(k["held_out_um"], 1)] for kind, k in data["kinds"].items()
        ],
        figures=identification_figures(identification),
        titles=FIGURES,
        parameters=[
            [
                parameter_words(p["name"]),
                f"{p['value']:.4g} ± {p['sigma']:.2g}",
                fixed(p["moves_um"], 0),
                f"{100 * p['told']:.0f} %",
            ]
            for p in ranked[:MOST_PARAMETERS]
        ],
        rest=len(ranked) - MOST_PARAMETERS,
        alike=[[one, other, fixed(value)] for one, other, value in pairs[:MOST_PAIRS]],
        alike_from=f"{ALIKE:g}",
        count=len(pairs),
    )


def identification_figures(identification: Identification) -> dict[str, Figure]:
    """Figures by the keys of ``FIGURES``; none in space where no row is a place.

    Correlations are for a wide screen: the page has the largest of them as a table.
    """
    has_places = bool(_is_place(identification.data).any())
    return {
        **({"space": _residuals_in_space(identification)} if has_places else {}),
        "time": _residuals_over_time(identification),
        "joints": _residuals_over_joints(identification),
        "correlation": _correlation_map(identification),
    }


def _is_place(data: Measurements) -> BoolArray:
    """Which rows can be drawn: a distance has no place, and a line may lack a coordinate."""
    return np.asarray((data.numbers == 3) & np.isfinite(data.position).all(axis=1))


def _alike(identification: Identification) -> list[tuple[str, str, float]]:
    """Pairs of parameters whose effects the data can hardly tell apart, and how they correlate, the worst first."""
    fit = identification.selected.fit
    names = [parameter_words(identification.model.parameters[k].name) for k in np.flatnonzero(fit.active)]
    values = np.triu(correlations(fit), 1)
    pairs = [(names[i], names[j], float(values[i, j])) for i, j in np.argwhere(np.abs(values) > ALIKE).tolist()]
    return sorted(pairs, key=lambda pair: -abs(pair[2]))


def _residuals_in_space(identification: Identification) -> Figure:
    """Residuals as lines from where they were measured, before and after, each as long as can be seen."""
    data, fit = identification.data, identification.selected.fit
    located = np.flatnonzero(_is_place(data) & ~fit.outlier)
    rows = located[rows_to_draw(np.linalg.norm(fit.residual[located], axis=1))]
    places = fit.frames.far_ends(data, *identification.model.pose(data, fit.p))[rows]
    paths, ends = [], [places]
    for name, step in (("before", identification.candidates[0]), ("after", identification.selected)):
        residual = step.fit.residual[rows]
        size = np.linalg.norm(residual, axis=1)
        times = magnification(places, size)
        tips = places + times * residual
        gap = np.full_like(places, np.nan)
        line = np.stack([places, tips, gap], axis=1).reshape(-1, 3)
        paths.append(Coloured(f"{name}, {times:,} times larger", line / MM, np.repeat(np.round(size / UM, 2), 3)))
        ends.append(tips)
    everywhere = np.vstack(ends) / MM
    return figure_in_space("Residuals in space", paths, everywhere, np.ones(len(everywhere), dtype=bool))


def magnification(places: Array, size: Array) -> int:
    """A round number by which residuals of these sizes can be seen among places, the largest about a tenth of them."""
    largest = float(size.max(initial=0.0))
    if largest == 0:
        return 1
    spread = max(float(np.ptp(places, axis=0).max()), 0.1)
    wanted = max(0.12 * spread / largest, 1.0)
    power = 10 ** int(np.floor(np.log10(wanted)))
    return int(max(step * power for step in (1, 2, 5) if step * power <= wanted))


def _residuals_over_time(identification: Identification) -> Figure:
    """Each row on the scale of what was kept; rows that were set aside stand at the upper edge."""
    data, set_aside = identification.data, identification.selected.fit.outlier
    is_long = np.ptp(data.time) > LONG
    time = data.time[data.pose] / (HOUR if is_long else 1.0)
    kept, outliers = np.flatnonzero(~set_aside), np.flatnonzero(set_aside)
    rows = []
    for step, colour, name, symbol in (
        (identification.candidates[0], WARM, "before", "circle"),
        (identification.selected, COOL, "after", "diamond"),
    ):
        size = np.linalg.norm(step.fit.residual, axis=1) / UM
        shown = kept[rows_to_draw(size[kept])]
        drawn = np.round(size[shown], 2)
        marker = {"color": colour, "size": 5, "symbol": symbol}
        traces = [trace("scatter", time[shown], drawn, showlegend=True, mode="markers", name=name, marker=marker)]
        words = [course(name, drawn, "µm")]
        top = 1.15 * float(size[kept].max(initial=0.0)) or 1.0
        if name == "after" and len(outliers):
            traces.append(_set_aside(time[outliers], size[outliers], 0.96 * top))
            words.append(f"{len(outliers)} set aside")
        rows.append(CurveRow(f"{name} [µm]", traces, "; ".join(words), options={"range": [0, top]}))
    return figure_in_rows(rows, "time [h]" if is_long else "time [s], or order", "Residual over time")


def _set_aside(time: Array, size: Array, height: float) -> Trace:
    """Crosses at a height for what is beyond the scale."""
    text = [f"{value:.0f}" for value in size]
    cross = {"color": GREY, "symbol": "x", "size": 9}
    look = {"mode": "markers", "marker": cross, "hovertemplate": "%{text} µm<extra></extra>"}
    name = "set aside, beyond this scale"
    return trace("scatter", time, np.full(len(time), height), name=name, text=text, **look)


def _residuals_over_joints(identification: Identification) -> Figure:
    """A plot for each joint, all on one scale."""
    data, fit = identification.data, identification.selected.fit
    size = np.round(np.where(fit.outlier, np.nan, np.linalg.norm(fit.residual, axis=1)) / UM, 2)
    pendant = np.round(identification.robot.to_pendant(data.theta)[data.pose] / DEG, 3)
    traces: list[Trace] = []
    axes: dict[str, Any] = {}
    narrow: dict[str, Any] = {}
    for k in range(6):
        which = str(k + 1) if k else ""
        look = {"mode": "markers", "name": f"J{k + 1}", "marker": {"color": COOL, "size": 4, "symbol": "diamond"}}
        traces.append(trace("scatter", pendant[:, k], size, xaxis=f"x{which}", yaxis=f"y{which}", **look))
        for layout, columns, gaps in ((axes, 3, (0.07, 0.34)), (narrow, 2, (0.1, 0.18))):
            across, up = spans(columns, gaps[0]), spans(6 // columns, gaps[1])[::-1]
            of_y = {"showticklabels": k % columns == 0, "domain": up[k // columns]}
            of_y["title"] = {"text": "residual [µm]" if k % columns == 0 else ""}
            layout |= {f"xaxis{which}": {"domain": across[k % columns]}, f"yaxis{which}": of_y}
        axes[f"xaxis{which}"] |= axis(f"J{k + 1} [deg]", anchor=f"y{which}", nticks=4, tickangle=0)
        axes[f"yaxis{which}"] |= {"anchor": f"x{which}", "rangemode": "tozero", **({"matches": "y"} if k else {})}
    alt = curves_in_words("Residual over each joint's angle", traces, "µm")
    return figure(traces, 420, alt, {**narrow, "height": 540}, showlegend=False, **axes)


def _correlation_map(identification: Identification) -> Figure:
    fit = identification.selected.fit
    index = np.flatnonzero(fit.active)
    best = np.sort(np.argsort(-fit.gamma[index], kind="stable")[:MAX_PARAMETERS])
    names = [identification.model.parameters[k].name for k in index[best]]
    values = np.round(correlations(fit)[np.ix_(best, best)], 3)
    small = {"tickfont": {"size": 8}}
    pairs = np.abs(np.triu(values, 1))
    alt = f"Correlation of {len(names)} parameters"
    if len(names) > 1:
        one, other = np.unravel_index(int(np.argmax(pairs)), pairs.shape)
        alt += (
            f": largest {values[one, other]:.2f}, of {names[one]} and {names[other]}; {(pairs > 0.9).sum()} above 0.9"
        )
    signs = [["" if abs(v) < SIGNED else "+" if v > 0 else "\N{MINUS SIGN}" for v in row] for row in values.tolist()]
    unnamed = {"showticklabels": False}
    narrow = {"height": 420, "margin": {"l": 10, "b": 20}, "xaxis": unnamed, "yaxis": unnamed}
    look = {"colorscale": RED_TO_BLUE, "zmin": -1, "zmax": 1, "colorbar": {"title": {"text": "correlation"}}}
    look |= {"text": signs, "texttemplate": "%{text}"}  # by more than hue
    return figure(
        [trace("heatmap", names, names, values, **look)],
        760,
        f"{alt}.",
        narrow,
        yaxis={**small, "autorange": "reversed"},
        xaxis=small,
        margin={"l": 190, "r": 20, "t": 40, "b": 190},
    )
