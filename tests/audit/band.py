r"""The band again: what each number that is not known does to the tool, the radius of 95 %, and what stands beside.

    S = sum_q s_q^2 c_q c_q^T + m m^T + (kappa |hot - cold|)^2 I,    m = sum_q m_q c_q,    half-width 2 sqrt(S_xx)
    |x|^2 ~ g chi^2_h,    g = tr S^2 / tr S,    h = (tr S)^2 / tr S^2

A kelvin on each node moves the tool by ``G`` (N, 3, K) [mm/K], a difference. What law and sensors miss builds up with
a node's lag; air is on every node all day; the feed is driven faster all day; a late start stands first.
"""

import math
from functools import cache

import numpy as np

from audit import study
from audit.checks import count, equal

BAND_UM, SIZE_UM = 0.1, 0.1
GRID = np.linspace(1.0, 3.0, 201)  # of degrees of freedom
STEP = 0.005  # of the feed, over which its effect is differenced


def band_checks(report, table, law, duties, passed, actual, reach_m, tool_m):
    """Half-widths in World, the budget, and what is not known, against the output.

    Args:
        report: Of the folder.
        table: The waypoints.
        law: The heat law.
        duties: Before the program.
        passed: The program by the clock.
        actual: A function of rises (N, K) to where the tool is with them, (N, 3) [mm].
        reach_m: The farthest place from the axis of J1.
        tool_m: From the flange to the tool's centre.
    """
    rise = law.along(law.after(duties), passed.time, passed.driven)
    sources = _sources(law, duties, passed, actual, rise, report["thermal"]["start_window_s"])
    on_part = table["contact"]
    whole = sum(sources.values())
    own = {name: _radius(S)[on_part].max() * 1e3 for name, S in sources.items()}
    written, band = report["band"]["budget_um"], report["band"]
    half = 2e3 * np.sqrt(whole[:, [0, 1, 2], [0, 1, 2]])
    checks = [equal(f"band {a}, um", half[:, k], table["band"][:, k], BAND_UM) for k, a in enumerate("xyz")]
    checks.append(equal("band, 95 %, um", _radius(whole)[on_part].max() * 1e3, band["p95_um"], BAND_UM))
    names = sorted(name for name in own.keys() | written.keys() if own.get(name, 1.0) > 1e-9)
    sizes = [np.array([size.get(name, np.nan) for name in names]) for size in (own, written)]
    checks.append(equal("budget, um", sizes[0], sizes[1], BAND_UM))
    return [*checks, count("not known: rows that are missing or another size", _unlisted(band, rise, reach_m, tool_m))]


def _sources(law, duties, passed, actual, rise, window):
    """Second moment of each source of the budget, (N, 3, 3) [mm^2]."""
    hot, cold, unit = actual(rise), actual(0 * rise), np.eye(len(study.NODES))
    G = np.stack([actual(rise + k) - hot for k in unit], axis=2)
    missed = _missed(law, duties, passed.time)
    faster, slower = (_rises(law, duties, passed, 1 + s * STEP) for s in (1, -1))
    late = (_rises(law, [*duties, ("idle", 0.0, 1.0, window)], passed) - rise) / max(window, 1e-9)
    limits = {"cte": [(np.array(study.CTE_OPEN_1_K) / study.CTE_1_K - 1, hot - cold)], "start delay": []}
    limits["profile shape"] = [
        (np.array(ends) / 100, hot - actual(rise, without=k)) for k, ends in enumerate(study.GROWTH_OPEN_PERCENT)
    ]
    if window > 0:
        limits["start delay"] = [(np.array([0.0, window]), _moved(G, late))]
    normal = {
        "temperature law": [_moved(G, study.LAW_K * missed * k) for k in unit],
        "thermocouples": [_moved(G, study.SENSORS_K * missed)],
        "air": [_moved(G, study.AIR_K * np.ones_like(rise))],
        "feed": [_moved(G, study.FEED * (faster - slower) / (2 * STEP))],
    }
    moments = {name: sum(_outer(c) for c in columns) for name, columns in normal.items()}
    none, mean = np.zeros((len(rise), 3, 3)), np.zeros((len(rise), 3))
    for name, rows in limits.items():
        moments[name] = sum((_outer(c * (high - low) / math.sqrt(12)) for (low, high), c in rows), none)
        mean = mean + sum((c * (low + high) / 2 for (low, high), c in rows), 0 * mean)
    missing = (study.MISSING * np.linalg.norm(hot - cold, axis=1)) ** 2
    return {
        **moments,
        "one-sided intervals": _outer(mean),
        "thermal physics missing": missing[:, None, None] * np.eye(3),
    }


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
    return np.einsum("nik,nk->ni", G, rise)


def _outer(column):
    return column[:, :, None] * column[:, None, :]


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


def _unlisted(band, rise, reach_m, tool_m):
    """How many rows of what is not known are missing, or have another size, or neither a size nor a reason."""
    rows, wrong = {row["what"]: row for row in band["unknown"]}, 0
    sizes = {
        **study.UNKNOWN_UM,
        "growth of the spindle": (2.0, 5.0 + 11.5 * tool_m * rise[:, -1].max()),
        "growth of fixture and sphere plate": (0.0, 11.5 * reach_m * 2 * study.AIR_K),
        "gradient across a link": (0.0, 1e6 * math.radians(study.BEND_ARCSEC_K / 3600) * rise.max() * reach_m),
    }
    for what, size in sizes.items():
        listed = rows.get(what, {}).get("size_um") or (np.nan, np.nan)
        wrong += not np.allclose(listed, size, atol=SIZE_UM, rtol=1e-3)
    for what in study.UNKNOWN_WITHOUT_FIGURE:
        wrong += what not in rows or not rows[what]["from"].startswith("no figure: ")
    return wrong + ("the controller's motion" not in rows)
