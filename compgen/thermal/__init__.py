"""Temperature over time: what the cell did, and how warm that left each part of the robot."""

from compgen.thermal.ambient import Ambient, still
from compgen.thermal.duty import Duty, JointMotion
from compgen.thermal.integration import after, during, history, opening, states_at
from compgen.thermal.model import Heat
from compgen.thermal.node_model import NodeModel
from compgen.thermal.profiles import Profile, Section, growth_weights

__all__ = [
    "Ambient",
    "Duty",
    "Heat",
    "JointMotion",
    "NodeModel",
    "Profile",
    "Section",
    "after",
    "during",
    "growth_weights",
    "history",
    "opening",
    "states_at",
    "still",
]
