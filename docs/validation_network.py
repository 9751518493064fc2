"""What docs/validation.md says of both thermal models out of sample, and of what the network is made of."""

import sys
from pathlib import Path

import numpy as np

from compgen.core.toml import read_toml
from compgen.thermal.tables.materials import MATERIALS

ROBOTS = Path(__file__).parents[1] / "robots"
sys.path.insert(0, str(ROBOTS))
import m710ic50_fit as node_fit  # noqa: E402
import m710ic50_network_fit as network_fit  # noqa: E402


def left_out_rows() -> list[list[str]]:
    """Both models on temperatures that their fits have not seen; one by one the network would take a minute."""
    rows = []
    for name, group in node_fit.GROUPS.items():
        fits = (node_fit,) if name == "one by one" else (node_fit, network_fit)
        out = [node_fit.left_out(fit.misses_without, group) for fit in fits]
        cells = [f"{np.sqrt(np.mean(o**2)):.2f} / {np.abs(o).max():.2f} K" for o in out]
        cells += ["printed by its script"] * (2 - len(cells))
        rows.append([f"left out of the fit {name}, rms / worst", "-", *cells])
    return rows


def body_rows() -> list[list[str]]:
    """How far the network's bodies are from what their material allows."""
    rows = []
    for body, entry in zip(network_fit.base().bodies, _network()["body"], strict=False):
        diffusivity, most = body.conductance * body.length / body.capacity, MATERIALS[entry["material"]].diffusivity
        sizes = (f"{1e6 * diffusivity:.1f} mm2/s", f"{1e6 * most:.1f} mm2/s")
        rows.append([body.name, entry["material"], f"{entry['mass_kg']:g} kg", *sizes])
    return rows


def numbers() -> dict[str, str]:
    """What the text quotes."""
    heat, area = network_fit.base(), network_fit.AREA
    films = {body.name: body.film / area[body.name] for body in heat.bodies}
    films |= {housing.name: housing.film / area[housing.name] for housing in heat.housings}
    mass = sum(part["mass_kg"] for part in (*_network()["body"], *_network()["housing"]))
    return {
        "film": f"{films['d4']:.1f}",
        "base_film": f"{films['base']:.1f}",
        "mass": f"{mass:.0f}",
        "parameters": f"{len(network_fit.PRIOR)}",
    }


def _network() -> dict:
    return read_toml(ROBOTS / "m710ic50.toml", "robots")["thermal"]["network"]
