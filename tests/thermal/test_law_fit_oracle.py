"""The law of an arm's nodes is the most probable: scipy seeks all its unknowns at once, on courses of its own."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from shipped import path_file
from wider_arm import NODES

from compgen.core.units import HOUR
from compgen.pipelines.files.path_file import load_job
from compgen.thermal.law_fit import fit_law
from compgen.thermal.log_prior import medians_of
from compgen.thermal.state_from_log import TemperatureLog

K, BLOCKS, EARLIER = 5, 6, 4 * HOUR
SPREAD = {"gain": 0.25, "common": 0.7, "each": 0.3, "work": 0.5, "block": 0.5, "slower": 0.5, "air": 6.0}


@pytest.fixture(scope="module")
def cell():
    return load_job(path_file("circle_1300")).cell


def goals(heat, tau, rise):
    """What the nodes reach in the end at the reference feed, and at the least of the measured ones."""
    amplitude = rise / (1 - np.exp(-heat.reference_time / tau))
    slow = heat.idle + (1 - heat.idle) * (heat.box.feed[0] / heat.reference_feed) ** heat.exponent
    return amplitude, amplitude * slow


def course(heat, tau, goal_of_blocks, edges, at, node):
    """Nodes that follow a goal in each block, from a balance with the first: block by block, to each time."""
    begin = np.array(goal_of_blocks[0])
    out = np.empty(len(at))
    for goal, since, until in zip(goal_of_blocks[1:], edges[:-1], edges[1:], strict=True):
        for k in np.flatnonzero((at > since) & (at <= until)):
            n = node[k]
            out[k] = goal[n] + (begin[n] - goal[n]) * np.exp(-(at[k] - since) / tau[n])
        begin = goal + (begin - goal) * np.exp(-(until - since) / tau)
    return out


def most_probable(log, heat, sensors):
    """Rises and time constants (K,), by all unknowns at once, each a unit normal."""
    medians = medians_of(log)
    node = medians.which.astype(int)
    at = medians.time - log.time[0]
    edges = np.concatenate([[-EARLIER], np.linspace(0, log.time[-1] - log.time[0], BLOCKS + 1)])

    def law(u):
        tau = heat.tau * np.exp(SPREAD["common"] * u[K] + SPREAD["each"] * u[K + 1 : 2 * K + 1])
        return heat.reference_rise * np.exp(SPREAD["gain"] * u[:K]), tau

    def residual(u):
        rise, tau = law(u)
        mean, slower, *blocks, night, draught, common = u[2 * K + 1 : -K]
        fast, slow = goals(heat, tau, rise)
        all_along = fast * (1 + SPREAD["work"] * mean)
        all_along = all_along + SPREAD["slower"] * slower * (slow * fast.sum() / slow.sum() - fast)
        goal = [SPREAD["block"] * b * fast + (all_along if k > 1 else 0.0) for k, b in enumerate(blocks)]
        decay = np.exp(-at / tau[node])
        drift = SPREAD["air"] * (night * decay + draught * (1 - decay))
        offset = sensors * (common + 0.5 * u[-K:][node])
        shown = course(heat, tau, goal, edges, at, node) + drift + offset
        return np.append((medians.value - shown) / medians.sigma, u)

    return law(least_squares(residual, np.zeros(2 * K + 1 + 2 + 8 + 2 + 1 + K), x_scale="jac").x)


def warm_up(heat, seed):
    """A log of other nodes than the file's, at a feed between the two, with work that differs from hour to hour."""
    draws = np.random.default_rng([seed, 4])
    time = np.arange(0.0, 6 * HOUR + 1, 60.0)
    tau = heat.tau * np.exp(draws.normal(-0.3, 0.3) + draws.normal(0, 0.25, K))
    fast, slow = goals(heat, tau, heat.reference_rise * np.exp(draws.normal(0, 0.15, K)))
    share = draws.uniform(0, 1)
    edges = np.concatenate([[-EARLIER], np.arange(0.0, 6 * HOUR + 1, HOUR)])
    goal = [np.zeros(K), np.zeros(K)]
    goal += [draws.uniform(0.7, 1.2) * (share * fast + (1 - share) * slow * fast.sum() / slow.sum()) for _ in range(6)]
    rises = [course(heat, tau, goal, edges, time, np.full(len(time), n)) for n in range(K)]
    readings = {n: r + draws.normal(0, 0.05, len(time)) for n, r in zip(NODES, rises, strict=True)}
    readings = {n: np.nan_to_num(r) for n, r in readings.items()}
    return TemperatureLog(time, np.zeros(len(time)), readings, np.zeros(len(time), bool))


@pytest.mark.parametrize("seed", range(4))
def test_rises_and_time_constants_are_the_most_probable(cell, seed):
    log = warm_up(cell.heat, seed)
    rise, tau = most_probable(log, cell.heat, cell.warmth.sensors)
    fitted = fit_law(log, cell.heat, cell.warmth).law
    np.testing.assert_allclose(np.log(fitted.reference_rise), np.log(rise), atol=0.01)
    np.testing.assert_allclose(np.log(fitted.tau), np.log(tau), atol=0.03)
