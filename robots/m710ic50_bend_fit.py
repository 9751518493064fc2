r"""Tries what could explain the study's six measured hot-minus-cold curves (m710ic50_hot_minus_cold.csv).

    python robots/m710ic50_bend_fit.py

The study prints no curve as numbers, only its size m_i. What is compared is what an interferometer reads at its eleven
stations: along the line the difference to the first station, across it the range about the best straight line,

    size_i(x) = size_i(curve_i + sum_t x_t slope_it)
    least sum_i ((size_i(x) - m_i) / sigma_i)^2 + sum_t (x_t / w_t)^2

with the slopes of each cause t from the error model itself. One sigma is half of the repeatabilities hot and cold
together (error bars as twice it); w_t is what a cause may be: Heisel's 2.4 arcsec/K (study line 266), a length's own
growth as steel, a fifth of the coefficient of expansion. A cause has earned a place when the curve left out is foretold
better with it than without. There is one thermal state, so a rate per kelvin cannot be told from its node.
"""

import csv
import itertools
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from compgen.core.arrays import Array, BoolArray
from compgen.core.pose import Pose
from compgen.core.units import MM, UM
from compgen.error_model.model import build_error_model
from compgen.pipelines.files.path_file import load_job
from compgen.robot import inverse_kinematics

HERE = Path(__file__).parent
STATIONS = {"x": (700, 2000, 11), "y": (-680, 620, 11)}  # [mm] study line 530
CENTRE = {"x": 1350.0, "y": -30.0, "z": 203.0}  # [mm]
CURVES = (("x", "x"), ("x", "y"), ("x", "z"), ("y", "y"), ("y", "x"), ("y", "z"))  # line, error
HOT_K = 13.0  # of j3, which the causes follow here
HEISEL, STEEL, SHARE = 2.4, 11.5e-3, 0.2  # arcsec/K; um/mm/K; of cte

#: cause: (robot file keys for a size of one, width of its prior): arcsec of turn, um of length, share of cte
BENDS = {
    f"{link} {plane}": (
        f"thermal_bend={{link=['{link}'],plane=['{plane}'],node=['j3'],rate_arcsec_K=[{1 / HOT_K!r}]}}",
        HEISEL * HOT_K,
    )
    for link in ("column", "a1", "a2", "a3", "d4")
    for plane in (("x", "y", "twist") if link == "column" else ("arm", "side", "twist"))
}
SHIFTS = {
    of: (f"thermal_shift={{of=['{of}'],node=['j3'],rate_um_K=[{1 / HOT_K!r}]}}", STEEL * length * HOT_K)
    for of, length in (("d1", 565), ("base x", 565), ("base y", 565), ("tool", 175), ("a1", 150), ("a3", 170))
}
SOURCES = BENDS | SHIFTS
RIGID = ("column x", "column y", "column twist", "d1", "base x", "base y", "tool")
CAUSES = ("cte", *(name for name in SOURCES if name not in RIGID))


def measured() -> list[dict[str, str]]:
    with (HERE / "m710ic50_hot_minus_cold.csv").open() as file:
        return list(csv.DictReader(file))


def sigma() -> Array:
    """(6,) [um]"""
    pairs = [(float(row["cold_repeatability_um"]), float(row["hot_repeatability_um"])) for row in measured()]
    return np.hypot(*np.array(pairs).T) / 2


def station_errors(line: str, overrides: Sequence[str] = ()) -> Array:
    """Thermal error at the stations of a line after six hours on the circle, (11, 3) [um], before an interferometer."""
    job = load_job(str(HERE.parent / "paths" / f"line_{line}.toml"), overrides=overrides)
    places = np.tile([CENTRE[axis] for axis in "xyz"], (STATIONS[line][2], 1))
    places[:, "xyz".index(line)] = np.linspace(*STATIONS[line])
    down = np.broadcast_to(np.diag([1.0, -1.0, -1.0]), (len(places), 3, 3))
    target = Pose(places * MM, down)
    model = build_error_model(job.robot, job.sources, len(job.heat.names), job.tool.pose)
    flange = inverse_kinematics.flange_from_tool(target, job.tool.pose)
    theta, _ = inverse_kinematics.solve_flange(job.robot, flange, job.posture)
    return model.error(theta, job.start_rise()[None], target)[:, :3] / UM


def curves(*overrides: str) -> Array:
    """What an interferometer reads at the stations of the six curves, (6, 11) [um]."""
    errors, rows = {line: station_errors(line, overrides) for line in STATIONS}, []
    for line, error in CURVES:
        place, e = np.linspace(*STATIONS[line]), errors[line][:, "xyz".index(error)]
        rows.append(e - e[0] if line == error else e - np.polyval(np.polyfit(place, e, 1), place))
    return np.array(rows)


def sizes(six: Array) -> Array:
    """One number for each curve, (6, 11) to (6,) [um]: its end along the line, its range across."""
    return np.array([y[-1] if line == error else np.ptp(y) for (line, error), y in zip(CURVES, six, strict=False)])


@cache
def slope(cause: str) -> Array:
    """Change of the six curves by one arcsec, one micrometre, or the whole coefficient of expansion, (6, 11)."""
    if cause == "cte":  # growth is all that the shipped robot has, and proportional to it
        return curves()
    return 0.1 * (curves(f"robot.sources.{SOURCES[cause][0].replace(repr(1 / HOT_K), repr(10 / HOT_K))}") - curves())


def width(cause: str) -> float:
    return SHARE if cause == "cte" else SOURCES[cause][1]


def goal(turned: bool) -> Array:
    """The measured sizes, (6,) [um]; with the sign of Y positioning as printed, or turned."""
    sign = np.where([turned and curve == ("y", "y") for curve in CURVES], -1.0, 1.0)
    return sign * [float(row["measured_um"]) for row in measured()]


def fit(causes: Sequence[str], goal_um: Array, kept: BoolArray) -> tuple[Array, Array]:
    """Sizes of causes from some of the curves, and how far all six are off then, in sigmas: (T,) and (6,)."""
    slopes, widths = np.array([slope(c) for c in causes]), np.array([width(c) for c in causes])

    def off(u: Array) -> Array:
        return (sizes(curves() + np.tensordot(u * widths, slopes, 1)) - goal_um) / sigma()

    starts = itertools.product((-0.5, 0.5), repeat=min(len(causes), 3))  # ranges have no sign, so there are two valleys
    tries = [np.append(start, np.full(len(causes) - len(start), 0.2)) for start in starts]
    fits = [least_squares(lambda u: np.append(off(u)[kept], u), start) for start in tries]
    best = min(fits, key=lambda result: result.cost).x
    return best * widths, off(best)


def left_out(causes: Sequence[str], turned: bool) -> Array:
    """How far each curve is off when the causes come from the other five, in sigmas, (6,)."""
    return np.array([fit(causes, goal(turned), np.arange(6) != i)[1][i] for i in range(6)])


@cache
def scores(causes: tuple[str, ...], turned: bool) -> tuple[Array, float, float]:
    """Sizes of the causes, chi-square of the six curves with them, and with each curve left out."""
    if not causes:
        chi2 = float((((sizes(curves()) - goal(turned)) / sigma()) ** 2).sum())
        return np.zeros(0), chi2, chi2
    size, off = fit(causes, goal(turned), np.ones(6, dtype=bool))
    return size, float((off**2).sum()), float((left_out(causes, turned) ** 2).sum())


def best_pair(turned: bool) -> tuple[str, str]:
    """The two causes that explain the six curves best."""
    every = np.ones(6, dtype=bool)
    pairs = list(itertools.combinations(CAUSES, 2))
    left = [(fit(pair, goal(turned), every)[1] ** 2).sum() for pair in pairs]
    return pairs[int(np.argmin(left))]


def main() -> None:
    print("moved by a size of one, at most [um]: " + ", ".join(f"{c} {np.abs(slope(c)).max():.4f}" for c in RIGID))
    for turned in (False, True):
        print(f"\nY positioning {goal(turned)[3]:g} um; six curves: chi-square, with each left out, sizes")
        for causes in ((), *((c,) for c in CAUSES), best_pair(turned), CAUSES):
            size, chi2, out = scores(causes, turned)
            named = ", ".join(f"{c} {s:.3g}" for c, s in zip(causes, size, strict=False))
            print(f"{chi2:6.2f} {out:6.1f}  {named or 'the shipped robot'}")


curves = cache(curves)

if __name__ == "__main__":
    main()
