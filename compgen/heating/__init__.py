"""The heat of a path file and a robot file, turned into the domain's words."""

from compgen.heating.air import ambient, log
from compgen.heating.duty import files_read, find_program, shifts, steps
from compgen.heating.model import growth, network, node_model, profiles

__all__ = [
    "ambient",
    "files_read",
    "find_program",
    "growth",
    "log",
    "network",
    "node_model",
    "profiles",
    "shifts",
    "steps",
]
