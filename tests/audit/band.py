r"""The band again: what each number that is not known does to the tool, the radius of 95 %, and what stands beside.

    S = lambda^2 (sum_q s_q^2 c_q c_q^T + m m^T + (kappa^2 |hot - cold|^2 + ...) I),    m = sum_q m_q c_q
    |x|^2 ~ g chi^2_h,    g = tr S^2 / tr S,    h = (tr S)^2 / tr S^2,    half-width 2 sqrt(S_xx)

A kelvin on each node moves the tool by ``G`` (N, 3, K) [mm/K], a difference. What law and sensors miss builds up with
a node's lag; air is on every node all day; the feed is driven faster all day; a late start stands first. Identified
numbers move it together, by their covariance. Of each c a taught frame has taken up what it shares with the touches.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np

from audit import study
from audit.checks import count, equal

BAND_UM, SIZE_UM = 0.1, 0.1
GRID = np.linspace(1.0, 3.0, 201)  # of degrees of freedom
STEP = 0.005  # of the feed, over which its effect is differenced


class Case(NamedTuple):
    """An arm on a program of N waypoints."""

    arm: object
    spots: object  # (N) where it stands
    taught: object  # what the part's frame took up
    duties: list  # before the program
    passed: object  # the program by the clock
    window_s: float  # how late it may start


class Effects(NamedTuple):
    """What Q numbers do, and how well they are known."""

    source: str
    path: np.ndarray  # (N, 3, Q) [mm]
    touches: np.ndarray  # (T, 3, Q) [mm]; or none
    limits: tuple = ()  # lowest and highest of one number; none: standard deviations


def band_checks(report, table, case, reach_m):
    """Half-widths in World, the budget, and what is not known, against the output.

    Args:
        report: Of the folder.
        table: The waypoints.
        case: The arm on the program.
        reach_m: The farthest place from the axis of J1.
    """
    sources = _sources(case)
    on_part = table["contact"] if table["contact"].any() else np.ones_like(table["contact"])
    whole = sum(sources.values())
    own = {name: _radius(S)[on_part].max() * 1e3 for name, S in sources.items()}
    written, band = report["band"]["budget_um"], report["band"]
    half = 2e3 * np.sqrt(whole[:, [0, 1, 2], [0, 1, 2]])
    checks = [equal(f"band {a}, um", half[:, k], table["band"][:, k], BAND_UM) for k, a in enumerate("xyz")]
    checks.append(equal("band, 95 %, um", _radius(whole)[on_part].max() * 1e3, band["p95_um"], BAND_UM))
    names = sorted(name for name in own.keys() | written.keys() if own.get(name, 1.0) > 1e-9)
    sizes = [np.array([size.get(name, np.nan) for name in names]) for size in (own, written)]
    checks.append(equal("budget, um", sizes[0], sizes[1], BAND_UM))
    known = {name for name in names if own.get(name, 0.0) > 0}
    wrong = _unlisted(band, case, known, reach_m)
    return [*checks, count("not known: rows that are missing or another size", wrong)]


def _sources(case):
    """Second moment of each source of the budget, (N, 3, 3) [mm^2]."""
    arm, spots, taught = case.arm, case.spots, case.taught
    place, flange = spots.pose()[0], spots.flange()[1]
    moments: dict[str, np.ndarray] = {}
    mean = np.zeros((len(place), 3))
    for effects in [*_of_warmth(case), *_of_expansion(case), *_of_identification(case)]:
        left = taught.left(spots, effects.path, effects.touches)
        low, high = effects.limits or (-math.sqrt(3), math.sqrt(3))
        own = left * (high - low) / math.sqrt(12)
        moments[effects.source] = moments.get(effects.source, 0.0) + _outer(own)
        mean = mean + left.sum(axis=2) * (low + high) / 2
    moments["one-sided intervals"] = _outer(mean[:, :, None])
    moments["part's frame"] = _outer(taught.frame(place, flange))
    warm = np.linalg.norm(taught.left(spots, *(_warm(s)[:, :, None] for s in _both(case)))[:, :, 0], axis=1)
    moments["thermal physics missing"] = _round((arm.missing * warm) ** 2)
    moments["fit noise"] = _round(arm.noise_mm**2 * taught.field(place, flange))
    moments["repeatability"] = _round(np.full(len(place), arm.repeatability_mm**2))
    return {name: arm.scale**2 * S for name, S in moments.items() if S.any()}


def _both(case):
    """The path, and the touches: the path's own where there are none."""
    return case.spots, case.taught.spots or case.spots


def _warm(spots):
    """What warmth does, (M, 3) [mm]."""
    return spots.pose()[0] - spots.pose(0 * spots.rise)[0]


def _of_warmth(case):
    """Law, sensors, air, feed and a late start."""
    arm, law, duties, passed = case.arm, case.arm.law, case.duties, case.passed
    path, touches = _both(case)
    G, missed, unit = path.warmed(), _missed(law, duties, passed.time), np.eye(len(study.NODES))
    faster, slower = (_rises(law, duties, passed, 1 + s * STEP) for s in (1, -1))
    late = _rises(law, [*duties, ("idle", 0.0, 1.0, case.window_s)], passed) - path.rise
    none = np.zeros((len(touches.rise), 3, 1))
    shown = arm.sensors_K * touches.warmed().sum(axis=2)[:, :, None] * (touches.rise.max() > study.WARM_K)
    yield from (Effects("temperature law", _moved(G, k * arm.law_K * missed), none) for k in unit)
    yield Effects("thermocouples", _moved(G, arm.sensors_K * missed), shown)
    yield Effects("air", _moved(G, arm.air_K * np.ones_like(path.rise)), none)
    yield Effects("feed", _moved(G, arm.feed * (faster - slower) / (2 * STEP)), none)
    yield Effects("start delay", _moved(G, late), none, (0.0, 1.0))


def _of_expansion(case):
    """The coefficient and the profiles of an arm whose warm-up nobody measured."""
    if case.arm.cte_open is None:
        return
    share = np.array(case.arm.cte_open) / study.CTE_1_K - 1
    here, there = (_warm(spots)[:, :, None] for spots in _both(case))
    yield Effects("cte", here, there, tuple(share))
    for k, ends in enumerate(study.GROWTH_OPEN_PERCENT):
        here, there = ((spots.pose()[0] - spots.pose(without=k)[0])[:, :, None] for spots in _both(case))
        yield Effects("profile shape", here, there, tuple(np.array(ends) / 100))


def _of_identification(case):
    """The identified numbers together, and widths of reversals that nobody measured."""
    path, touches = _both(case)
    if len(case.arm.names):
        C, play = case.arm.correlation, np.array([name[0] == "hysteresis" for name in case.arm.names])
        rest = C[np.ix_(~play, ~play)]
        told = np.eye(len(C))[:, ~play]
        told[play] = C[np.ix_(play, ~play)] @ np.linalg.pinv(rest, 1e-6)
        of_rest = told @ rest @ told.T
        of_play = np.where(np.outer(play, play), C - of_rest, 0.0)
        for source, S in (("identified parameters", of_rest), ("lost motion", of_play)):
            values, vectors = np.linalg.eigh(S)
            factor = case.arm.sigma[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
            yield Effects(source, *(spots.identified() @ factor for spots in (path, touches)))
    seen = [name[2][0] for name in case.arm.names if name[1] == "width_mdeg"]
    if case.arm.width is not None and len(seen) < 6:
        columns = study.WIDTH_SPREAD * np.delete(path.of_widths(path.by_joint()), seen, axis=2)
        yield Effects("lost motion", columns, np.zeros((len(touches.rise), 3, columns.shape[2])))


def _rises(law, duties, passed, faster=1.0):
    """Rises along the program at a multiple of all feeds, the program's heat steady, (N, K) [K]."""
    day = [(state, feed * faster, share, seconds) for state, feed, share, seconds in duties]
    return law.along(law.after(day), passed.time, passed.driven * faster)


def _missed(law, duties, time):
    """Share of what is missed after the reference that each node has reached, (N, K)."""
    goal, x = 1 / (1 - np.exp(-study.REFERENCE_S / law.tau)), np.zeros(len(law.tau))
    for state, _, share, seconds in duties:
        moving = share if state == "moving" else 0.0
        steady = 0.0 if state == "off" else goal * (study.IDLE + (1 - study.IDLE) * moving)
        x = steady + (x - steady) * np.exp(-seconds / law.tau)
    return goal + (x - goal) * np.exp(-time[:, None] / law.tau)


def _moved(G, rise):
    return np.einsum("nik,nk->ni", G, rise)[:, :, None]


def _outer(columns):
    return columns @ np.swapaxes(columns, 1, 2)


def _round(variance):
    return variance[:, None, None] * np.eye(3)


def _radius(S):
    """The radius of 95 % of second moments (N, 3, 3), in their lengths."""
    trace, square = np.trace(S, axis1=1, axis2=2), (S**2).sum(axis=(1, 2))
    freedom = np.clip(trace**2 / np.maximum(square, 1e-300), 1.0, 3.0)
    return np.sqrt(trace / freedom * np.interp(freedom, GRID, _quantiles()))


@cache
def _quantiles():
    return [_quantile(freedom) for freedom in GRID]


def _quantile(freedom):
    """Of chi^2 at 95 %, by halving; its distribution by the series of the incomplete gamma function."""
    low, high, a = 0.0, 20.0, freedom / 2
    for _ in range(50):
        x = (low + high) / 4
        term = total = x**a * math.exp(-x) / math.gamma(a + 1)
        for n in range(1, 80):
            term *= x / (a + n)
            total += term
        low, high = ((low + high) / 2, high) if total < 0.95 else (low, (low + high) / 2)
    return low


def _unlisted(band, case, known, reach_m):
    """How many rows of what is not known are missing or too many, or have another size, or neither a size nor a reason.

    Args:
        band: Of the report.
        case: The arm on the program.
        known: What stands in the budget.
        reach_m: The farthest place from the axis of J1.
    """
    rows, wrong, arm, rise = {row["what"]: row for row in band["unknown"]}, 0, case.arm, case.spots.rise
    tool_m, loads = np.linalg.norm(case.spots.tool[0]) / 1e3, arm.sources.get("loads", {})
    sizes = {
        **arm.unknown,
        "growth of the spindle": (2.0, 5.0 + 11.5 * tool_m * rise[:, -1].max()),
        "growth of fixture and sphere plate": (0.0, 11.5 * reach_m * 2 * arm.air_K),
        "gradient across a link": (0.0, 1e6 * math.radians(study.BEND_ARCSEC_K / 3600) * rise.max() * reach_m),
    }
    ended = {"the controller's motion"}  # by its own size, of which there is no second one here
    ended |= {"gradient across a link"} if "thermal_bend" in arm.sources else set()
    ended |= {"payload and sag"} if "compliance" in arm.sources and loads else set()
    ended |= {"process force"} if any(loads.get("force_N", [])) else set()
    ended |= {"part's frame"} & known
    ended |= {"tool length"} if case.taught.is_tool else set()
    for what in sizes.keys() - ended:
        listed = rows.get(what, {}).get("size_um") or (np.nan, np.nan)
        wrong += not np.allclose(listed, sizes[what], atol=SIZE_UM, rtol=1e-3)
    without_figure = set(study.UNKNOWN_WITHOUT_FIGURE) - ended
    for what in without_figure:
        wrong += what not in rows or not rows[what]["from"].startswith("no figure: ")
    expected = sizes.keys() - ended | without_figure | {"the controller's motion"}
    return wrong + len(rows.keys() - expected) + ("the controller's motion" not in rows)
