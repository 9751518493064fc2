"""The starts of a program that exists: what was before each, how it is driven then, and what its one file leaves there.

As for a planned program (``pipelines.averaging``) the best file for all starts is that of the mean of their rises. An
override stretches the ways; what a program waits for, it waits for as long.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from compgen.fanuc.analysis.traversal import Traversal
from compgen.thermal import Duty
from compgen.thermal.ensemble import Ensemble, Start
from compgen.thermal.history import STANDING

#: starts, and how much each counts in the mean of the rises
Weighted = Sequence[tuple[float, Start]]
PLANNED: Weighted = ((1.0, Start()),)


@dataclass(frozen=True, slots=True)
class Residue:
    """What the twin found at and between corrected stations."""

    largest: float  # [m]
    rms: float  # [m] over the path


@dataclass(frozen=True, slots=True)
class ServedStarts:
    """What one corrected file leaves over its starts."""

    ensemble: Ensemble
    at_mean: Residue  # with the mean of the rises
    flown: tuple[tuple[Start, Residue], ...]

    @property
    def worst(self) -> tuple[Start, Residue]:
        """The start with the largest error."""
        return max(self.flown, key=lambda one: one[1].largest)


def slowed(drive: Traversal, share: float) -> Traversal:
    """A program's ways at an override."""
    return drive if share == 1 else replace(drive, duration=drive.duration / share)


def duties_until(before: Sequence[Duty], start: Start) -> tuple[Duty, ...]:
    """What the cell did before, and that it stands until a start."""
    return (*before, replace(STANDING, duration=start.delay)) if start.delay > 0 else tuple(before)
