"""What to measure next: which measurements take most off a band for the work they cost, and what uses them."""

from dataclasses import dataclass
from math import sqrt
from typing import Any

from compgen.verification.band import ONE_SIDED

MOST = 3  # steps that are named
LEAST = 0.02  # of a band, that a step must take off


@dataclass(frozen=True, slots=True)
class Step:
    """A measurement, and the sources of a budget that it ends."""

    what: str
    ends: tuple[str, ...]
    hours: float  # of work; assumed
    command: str  # that uses it


STEPS = (
    Step(
        "one hot length", ("cte", ONE_SIDED), 1.0,
        "cgen identify ROBOT --touches hot.csv --artefact two_spheres.toml --temperatures log.csv",
    ),
    Step(
        "sensors in one bath", ("thermocouples",), 1.0,
        "cgen generate PATH --set robot.thermal.uncertainty.sensors_K=0.1",
    ),
    Step(
        "a temperature log of the day", ("temperature law", "air", "feed"), 1.0,
        "cgen generate PATH --set log.file=log.csv",
    ),
    Step("a sensor on every node", ("temperature log",), 2.0, "cgen generate PATH --set log.file=log.csv"),
    Step("more touches of the spheres", ("anchored state",), 1.0, "cgen plan-touches PATH, then cgen anchor"),
    Step("more touches of the part's frame", ("part's frame",), 0.5, "cgen teach-frame"),
    Step("the tool against a gauge", ("tool",), 0.5, "cgen generate PATH --set tool.sigma_um=[5,5,5]"),
    Step("reversals of each joint", ("lost motion",), 2.0, "cgen plan-poses ROBOT, then cgen identify"),
    Step(
        "more poses", ("identified parameters", "geometry", "fit noise"), 4.0,
        "cgen plan-poses ROBOT, then cgen identify",
    ),
    Step("a warm-up", ("bends and drift", "profile shape"), 6.0, "cgen identify ROBOT --warm-up warm.csv"),
)  # fmt: skip


def next_steps(p95_um: float, budget_um: dict[str, float]) -> list[dict[str, Any]]:
    """The steps that take most off a band an hour, and what is left with those before; sources add as squares.

    Args:
        p95_um: The band.
        budget_um: Its sources.
    """
    whole = sum(size**2 for size in budget_um.values()) or 1.0

    def left(ended: set[str]) -> float:
        return p95_um * sqrt(sum(size**2 for name, size in budget_um.items() if name not in ended) / whole)

    gains = [(p95_um - left(set(step.ends)), step) for step in STEPS]
    best = sorted((g for g in gains if g[0] >= LEAST * p95_um > 0), key=lambda g: -g[0] / g[1].hours)[:MOST]
    return [
        {
            "what": step.what,
            "takes_um": float(f"{gain:.6g}"),
            "left_um": float(f"{left({name for _, done in best[: k + 1] for name in done.ends}):.6g}"),
            "hours": step.hours,
            "command": step.command,
        }
        for k, (gain, step) in enumerate(best)
    ]
