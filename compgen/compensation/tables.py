"""The path file's table ``[compensation]``, and the settings of the optimiser made from it."""

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from compgen.compensation.problem import Settings, Solver
from compgen.core.toml import Table
from compgen.core.units import DEG, MM, UM
from compgen.thermal.tables.ensemble import AverageOverTable


class CompensationTable(Table):
    """Limits of the correction and how smooth it is along the path."""

    clamp_mm: Annotated[FiniteFloat, Field(ge=0.001, le=100)] | None = None
    """Largest correction of the position; default 3, or 10 for a robot identified from measurements."""
    clamp_deg: Annotated[FiniteFloat, Field(ge=0.001, le=10)] = 0.5
    """Largest correction of the orientation."""
    rate_um_mm: Annotated[FiniteFloat, Field(ge=0.01, le=1000)] | None = None
    """Fastest change of the correction along the path; default 10, or 100 for a robot with play."""
    rate_period_mm: Annotated[FiniteFloat, Field(ge=0, le=100)] = 1.0
    """Period along the path that the weight on the correction's slope halves."""
    curvature_period_mm: Annotated[FiniteFloat, Field(ge=0, le=100)] | None = None
    """Period along the path that the weight on the correction's curvature halves; default 10, or 3 with play."""
    solver: Literal["structured", "ipopt"] = "structured"
    """Who finds the correction: compgen's own solver, or CasADi's ipopt, a thousand times slower, for comparison."""
    start_drift_um: Annotated[FiniteFloat, Field(ge=0.01, le=1e4)] = 5.0
    """How much error a late start may add: it sets the start window."""
    average_over: AverageOverTable | None = None
    margin_sigma: Annotated[FiniteFloat, Field(ge=0, le=10)] = 0.0
    """Standard deviations of what the robot file leaves open that joints keep from their limits."""


CLAMP_MM = 3.0
CLAMP_OF_IDENTIFIED_MM = 10.0  # its zeros and base are measured, and may be millimetres off nominal
RATE_UM_MM = 10.0
CURVATURE_PERIOD_MM = 10.0
CURVATURE_PERIOD_OF_PLAY_MM = 3.0
RATE_OF_PLAY_UM_MM = 100.0  # twice a half-width of 5 mdeg, 1.5 m away, within a fifth of a degree, and some


def settings_of(c: CompensationTable, *, axisymmetric: bool, has_play: bool, is_identified: bool) -> Settings:
    """The settings in SI; the spin of an axisymmetric tool is free.

    Where a joint reverses, play moves the TCP by tens of micrometres within a few millimetres of path: a rate and a
    smoothness that suit every other error would hold the correction back there, and leave on the part what it could
    cancel.
    """
    clamp = c.clamp_mm if c.clamp_mm is not None else CLAMP_OF_IDENTIFIED_MM if is_identified else CLAMP_MM
    curvature_period = CURVATURE_PERIOD_OF_PLAY_MM if has_play else CURVATURE_PERIOD_MM
    rate = c.rate_um_mm if c.rate_um_mm is not None else RATE_OF_PLAY_UM_MM if has_play else RATE_UM_MM
    return Settings(
        clamp_position=clamp * MM,
        clamp_rotation=c.clamp_deg * DEG,
        rate=rate * UM / MM,
        rate_period=c.rate_period_mm * MM,
        curvature_period=(curvature_period if c.curvature_period_mm is None else c.curvature_period_mm) * MM,
        free_spin=axisymmetric,
        margin=c.margin_sigma,
        solver=Solver(c.solver),
    )
