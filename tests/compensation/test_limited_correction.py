"""The interior point against the general solver: every kind of limit, and waypoints that stay as they are."""

from dataclasses import replace

import numpy as np
import pytest
from problems import problem_of
from shipped import path_file, quiet

from compgen.compensation import general_solver, limited_correction, optimise
from compgen.compensation.problem import Settings
from compgen.core.units import UM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate


@pytest.mark.parametrize("kind", ["joint", "clamp", "rate", "two stretches"])
def test_the_interior_point_is_the_general_solvers_optimum(kind):
    planned = generate.predict(load_job(path_file("circle_1300")), quiet)
    part, settings = problem_of(planned, slice(3, 103) if kind == "joint" else slice(300, 400)), Settings()
    unlimited = optimise.optimise(part, settings)
    free_rows = np.ones(100, dtype=bool)
    if kind == "clamp":
        settings = Settings(clamp_position=60 * UM)
    elif kind == "two stretches":
        settings = Settings(clamp_position=60 * UM)
        free_rows[[0, 1, 98, 99]] = False
        free_rows[40:52] = False
    elif kind == "rate":
        slope = np.linalg.norm(np.diff(unlimited.correction[:, :3], axis=0), axis=1) / np.diff(part.arc)
        settings = Settings(rate=0.6 * float(slope.max()))
    else:
        lower = part.robot.lower.copy()
        lower[2] = 0.3 * part.theta[:, 2].min() + 0.7 * unlimited.theta[:, 2].min()
        part = replace(part, robot=replace(part.robot, lower=lower))
    start = np.zeros((100, 6))
    fast = limited_correction.solve(part, settings, start, free_rows)
    slow = general_solver.solve(part, settings, start, free_rows)
    assert fast.converged
    fast = fast.correction
    assert slow.converged
    slow = slow.correction
    assert np.abs(fast - slow)[:, :3].max() < 1e-9  # m
    assert np.abs(fast - slow)[:, 3:].max() < 4e-9  # rad
    assert np.array_equal(fast[~free_rows], start[~free_rows])
    assert np.abs(fast - unlimited.correction)[:, :3].max() > 1 * UM  # the limit bites
