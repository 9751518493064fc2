"""Which columns of the fit's linear problem belong to which unknown."""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import BoolArray
from compgen.identification.measurements import Measurements


@dataclass(frozen=True, slots=True)
class Unknowns:
    """x = (parameters, for each instrument its turn and its origin, reflectors, fixed places, the reflectors' axes)."""

    parameters: int  # K'
    instruments: int
    reflectors: int
    places: int
    oriented: bool  # whether orientations were measured

    @property
    def size(self) -> int:
        """How many there are, D."""
        places_end = self._begin_of_turns
        return places_end + 3 * self.reflectors if self.oriented else places_end

    @property
    def _begin_of_turns(self) -> int:
        return self.parameters + 6 * self.instruments + 3 * (self.reflectors + self.places)

    def frame(self, i: int) -> slice:
        """Turn and origin of an instrument's frame."""
        return slice(self.parameters + 6 * i, self.parameters + 6 * i + 6)

    def reflector(self, r: int) -> slice:
        """A reflector in the flange."""
        begin = self.parameters + 6 * self.instruments + 3 * r
        return slice(begin, begin + 3)

    def place(self, s: int) -> slice:
        """A fixed place in its frame."""
        begin = self.parameters + 6 * self.instruments + 3 * (self.reflectors + s)
        return slice(begin, begin + 3)

    def turn(self, r: int) -> slice:
        """The axes of a reflector."""
        begin = self._begin_of_turns + 3 * r
        return slice(begin, begin + 3)


def unknowns_of(data: Measurements, active: BoolArray) -> Unknowns:
    """The unknowns of a fit of the active parameters, (K,), to some measurements."""
    oriented = bool(np.isfinite(data.rotation[:, 0, 0]).any())
    return Unknowns(
        int(active.sum()), len(data.instruments), len(data.reflectors), len(data.fixed.names), oriented
    )  # fmt: skip
