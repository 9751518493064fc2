"""A working day of a robot that warms in a hundred volumes, every second: by modes, and what a solver is asked."""

from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.measure import seconds
from compgen.core.arrays import Array
from compgen.pipelines.files.path_file import load_job
from compgen.thermal import Duty, rise_history
from compgen.thermal.network import NetworkModel, assemble_volumes, modal_form

HOURS, SOME = 12, 0.5  # of the day, and how much of it the solver does: the rest costs it the same
MOVING, RESTING = (15.0, 60.0, 20.0, 0.5, 4.0, 3.0), (0.0, 25.0, 8.0, 0.0, 0.0, 0.0)  # W of each drive
SPANS = (154.0, 40.0)  # s of motion, s of rest
TOLERANCE = 1e-9
EVERY = 60  # s between the rises that are compared


def network(volumes: int = 100) -> NetworkModel:
    """The shipped robot's network, cut finer; every volume is named."""
    heat = load_job("paths/circle_1300.toml", None, ["robot.thermal.model=network"]).heat
    if not isinstance(heat, NetworkModel):
        raise TypeError("the robot file has no network")
    parts = len(heat.bodies)
    counts = [(volumes - len(heat.housings)) // parts] * parts
    counts[-1] += volumes - len(heat.housings) - sum(counts)
    bodies = [replace(body, volumes=count) for body, count in zip(heat.bodies, counts, strict=False)]
    fine = assemble_volumes(bodies, heat.housings, heat.floor)
    rate, shapes = modal_form(fine)
    return replace(
        heat, volumes=fine, rate=rate, to_volumes=shapes, probe=np.eye(volumes), reference_rise=np.ones(volumes)
    )


def by_modes(heat: NetworkModel) -> tuple[float, Array]:
    """Seconds an hour of the day, and the rises at its beginning, (T, V) [K]."""
    cycle = [Duty("moving", 0.2, SPANS[0], loss=MOVING), Duty("idle", 0.0, SPANS[1], loss=RESTING)]
    duties, times = cycle * int(np.ceil(HOURS * 3600 / sum(SPANS))), np.arange(HOURS * 3600 + 1.0)
    spent = seconds(lambda: rise_history(heat, duties, times)) / HOURS
    return spent, rise_history(heat, duties, times)[: int(SOME * 3600) + 1 : EVERY]


def question(heat: NetworkModel) -> dict[str, Any]:
    """The same for a solver of differential equations."""
    v = heat.volumes
    matrix = -(v.laplacian + np.diag(v.film)) / v.capacity[:, None]
    powers = [v.power @ np.array(power) / v.capacity for power in (MOVING, RESTING)]
    return {
        "matrix": matrix.tolist(), "powers": [p.tolist() for p in powers], "spans": SPANS, "hours": SOME,
        "rate": TOLERANCE, "every": EVERY,
    }  # fmt: skip
