"""The heat of a path file and a robot file, turned into the domain's words."""

from compgen.thermal.tables.ambient import ambient, log
from compgen.thermal.tables.duty import shifts, steps
from compgen.thermal.tables.model import growth, network, node_model, profiles

__all__ = [
    "ambient",
    "growth",
    "log",
    "network",
    "node_model",
    "profiles",
    "shifts",
    "steps",
]
