"""How warm the second arm is, and how long then: the law of the nodes by hand, at what a robot file says of them."""

import math
import tomllib
from pathlib import Path

import numpy as np
from audit import study
from naive_arm import NOMINAL, growth_of_rises

ROBOT = tomllib.loads((Path(__file__).resolve().parents[1] / "robots" / "m710ic50.toml").read_text())
THERMAL = ROBOT["thermal"]
NODES = {n["name"]: n for n in THERMAL["node"]}
#: rises after 6 h at 200 mm/s, by definition of the model
WARM = {name: node["rise_K"] for name, node in NODES.items()}


def warm_lengths(rise=WARM, cte=THERMAL["cte_um_m_K"]):
    """Lengths [mm] at rises of the nodes (each one number, or (N,))."""
    growth = growth_of_rises(np.stack([np.asarray(rise[node], dtype=float) for node in study.NODES], axis=-1))
    share = cte * 1e-6 / study.CTE_1_K
    return {name: NOMINAL[name] + share * growth[..., k] for k, name in enumerate(NOMINAL)}


def steady_rise(node, state, feed):
    """What a node's rise would end in, standing, moving at feeds [mm/s] (one, or (N,)), or off."""
    full = node["rise_K"] / (1 - math.exp(-THERMAL["reference_h"] / node["tau_h"]))
    idle = THERMAL["idle_fraction"]
    moving = (feed / THERMAL["reference_feed_mm_s"]) ** node["exponent"] if state == "moving" else 0.0
    return 0.0 if state == "off" else full * (idle + (1 - idle) * moving)


def rises(duties):
    """Rises after (state, feed [mm/s], hours) in turn."""
    rise_of = {}
    for name, node in NODES.items():
        rise = 0.0
        for state, feed, hours in duties:
            steady = steady_rise(node, state, feed)
            rise = steady + (rise - steady) * math.exp(-hours / node["tau_h"])
        rise_of[name] = rise
    return rise_of


def rises_along(before, seconds, speed):
    """Rises [K] of each node at the moments between stretches of time at speeds, behind the duties before."""
    start, out = rises(before), {}
    for name, node in NODES.items():
        rise = [start[name]]
        for steady, keep in zip(
            steady_rise(node, "moving", speed), np.exp(-seconds / 3600 / node["tau_h"]), strict=True
        ):
            rise.append(steady + (rise[-1] - steady) * keep)
        out[name] = np.array(rise)
    return out
