"""What to measure next: which measurements take most off a band for the work they cost, and what uses them."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import Any

from compgen.verification.band import ONE_SIDED

MOST = 3  # steps that are named
LEAST_TAKEN = 0.02  # of a band, that a step must take off
DOUBLED = sqrt(1 / 2)  # of a standard deviation, that twice as many measurements leave
STANDS = "where the part stands"  # what a taught frame takes up
LAW, LOGGED = "temperature law", "temperature log"  # the second where a log is given: it says no more of the law


@dataclass(frozen=True, slots=True)
class NextMeasurement:
    """A measurement, and the sources of a budget that it ends or makes smaller."""

    what: str
    ends: tuple[str, ...]
    hours: float  # of work; assumed
    command: str  # that uses it
    leaves: float = 0.0  # of each source


STEPS = (
    NextMeasurement(
        "one hot length", ("cte", ONE_SIDED), 1.0,
        "cgen generate PATH --set robot.thermal.cte_um_m_K=12 --set 'robot.thermal.uncertainty.cte_um_m_K=[11.5,12.5]' "
        "--set 'robot.thermal.uncertainty.growth_percent.d4=[-9,9]'",
    ),
    NextMeasurement(
        "sensors in one bath", ("thermocouples",), 1.0,
        "cgen generate PATH --set robot.thermal.uncertainty.sensors_K=0.1",
    ),
    NextMeasurement(
        "a temperature log of the day", (LAW, "air", "feed"), 1.0,
        "cgen generate PATH --set log.file=log.csv",
    ),
    NextMeasurement("a sensor on every node", (LOGGED,), 2.0, "cgen generate PATH --set log.file=log.csv"),
    NextMeasurement(
        "twice as many touches of the spheres", ("anchored state",), 1.0, "cgen plan-touches PATH, then cgen anchor",
        DOUBLED,
    ),
    NextMeasurement(
        "the part's frame, taught", (STANDS,), 0.5,
        "cgen teach-frame ROBOT --touches touches.csv --artefact artefact.toml",
    ),
    NextMeasurement("twice as many touches of the part's frame", ("part's frame",), 0.5, "cgen teach-frame", DOUBLED),
    NextMeasurement("the tool against a gauge", ("tool",), 0.5, "cgen generate PATH --set 'tool.sigma_um=[5,5,5]'"),
    NextMeasurement("reversals of each joint", ("lost motion",), 2.0, "cgen plan-poses ROBOT, then cgen identify"),
    NextMeasurement(
        "twice as many poses, at best", ("identified parameters", "geometry", "fit noise"), 4.0,
        "cgen plan-poses ROBOT, then cgen identify", DOUBLED,
    ),
    NextMeasurement("a warm-up", ("bends and drift", "profile shape"), 6.0, "cgen identify ROBOT --warm-up warm.csv"),
)  # fmt: skip
#: for a program that exists: a key of its robot file is given to its own command, and it has no path file's keys
STEPS_OF_PROGRAM = tuple(
    replace(step, command=step.command.replace("generate PATH", "correct PROGRAM").replace("robot.thermal", "thermal"))
    for step in STEPS
    if not re.search(r"--set '?(?!'|robot)", step.command)
)


def next_steps(
    p95_um: float,
    budget_um: dict[str, float],
    steps: Sequence[NextMeasurement] = STEPS,
    *,
    taught_um: float | None = None,
) -> list[dict[str, Any]]:
    """The steps that take most off a band an hour, and what is left with those before; sources add as squares.

    Args:
        p95_um: The band.
        budget_um: Its sources; where the part's frame may be taught, those of what is left then.
        steps: That may be taken.
        taught_um: What is left then; None: no frame would take anything up.
    """
    rest = p95_um if taught_um is None else min(taught_um, p95_um)
    unit = rest / (sqrt(sum(size**2 for size in budget_um.values())) or 1.0)
    sources = {name: unit * size for name, size in budget_um.items()} | {STANDS: sqrt(p95_um**2 - rest**2)}

    def left(steps: Sequence[NextMeasurement]) -> float:
        leaves = {name: step.leaves for step in steps for name in step.ends}
        return sqrt(sum((size * leaves.get(name, 1.0)) ** 2 for name, size in sources.items()))

    gains = [(p95_um - left([step]), step) for step in steps if not (LAW in step.ends and LOGGED in budget_um)]
    best = sorted((g for g in gains if g[0] >= LEAST_TAKEN * p95_um > 0), key=lambda g: -g[0] / g[1].hours)[:MOST]
    return [
        {
            "what": step.what,
            "takes_um": float(f"{gain:.6g}"),
            "left_um": float(f"{left([done for _, done in best[: k + 1]]):.6g}"),
            "hours": step.hours,
            "command": step.command,
        }
        for k, (gain, step) in enumerate(best)
    ]
