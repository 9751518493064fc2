"""Temperature over time: from what the cell did to the rise of each part of the robot."""

from compgen.thermal.ambient import Ambient, still_air
from compgen.thermal.duty import Duty, JointMotion
from compgen.thermal.integration import initial_state, rise_history, rises_during, state_after, states_at
from compgen.thermal.model import ThermalModel
from compgen.thermal.node_model import NodeModel, cold_arm
from compgen.thermal.profiles import Profile, Section, growth_weights

__all__ = [
    "Ambient",
    "Duty",
    "JointMotion",
    "NodeModel",
    "Profile",
    "Section",
    "ThermalModel",
    "cold_arm",
    "growth_weights",
    "initial_state",
    "rise_history",
    "rises_during",
    "state_after",
    "states_at",
    "still_air",
]
