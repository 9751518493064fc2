"""What a cell does around the runs of a program, and how warm that leaves the robot."""

from dataclasses import dataclass, field

from compgen.core.arrays import Array
from compgen.thermal.ambient import Ambient, still_air
from compgen.thermal.duty import Duty
from compgen.thermal.integration import state_after
from compgen.thermal.model import ThermalModel

STANDING = Duty("idle", 0.0, 1.0)


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class History:
    """Duties before a program, between its runs and after them; without any it starts cold and runs once."""

    before: tuple[Duty, ...] = ()
    cycle: tuple[Duty, ...] = ()  # the program's own runs and what is between them; empty: one run
    after: tuple[Duty, ...] = ()
    runs: tuple[float, ...] = (0.0,)  # [s] when each run of the program begins, counted from the first
    standing: Duty = STANDING  # one second of servo on before the program
    air: Ambient = field(default_factory=still_air)  # from the first duty of ``before`` on

    @property
    def clock(self) -> float:
        """When the program starts, counted from the first duty of ``before`` [s]."""
        return sum(d.duration for d in self.before)

    def state(self, heat: ThermalModel) -> Array:
        """Thermal state when the program starts, (S,)."""
        return state_after(heat, self.before, air=self.air)
