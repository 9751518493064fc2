"""When the robot is where: jerk-limited motion along the path, exactly on it."""

from compgen.planning.retiming.phases import Phases
from compgen.planning.retiming.trajectory import Trajectory, driven_speed, retime, shorter_than_period

__all__ = ["Phases", "Trajectory", "driven_speed", "retime", "shorter_than_period"]
