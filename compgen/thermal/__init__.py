"""Temperature over time: what the cell did, and how warm that left each node."""

from compgen.thermal.duty import Duty
from compgen.thermal.nodes import NodeModel
from compgen.thermal.profiles import Profile, Section, growth_weights

__all__ = ["Duty", "NodeModel", "Profile", "Section", "growth_weights"]
