"""The path file's table ``[compensation]``, and the settings of the optimiser made from it."""

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from compgen.compensation.problem import Settings, Solver
from compgen.core.toml import Table
from compgen.core.units import DEG, MM, UM


class CompensationTable(Table):
    """Limits of the correction and how smooth it is along the path."""

    clamp_mm: Annotated[FiniteFloat, Field(ge=0.001, le=100)] = 3.0
    """Largest correction of the position."""
    clamp_deg: Annotated[FiniteFloat, Field(ge=0.001, le=10)] = 0.5
    """Largest correction of the orientation."""
    rate_um_mm: Annotated[FiniteFloat, Field(ge=0.01, le=1000)] = 10.0
    """Fastest change of the correction along the path."""
    rate_period_mm: Annotated[FiniteFloat, Field(ge=0, le=100)] = 1.0
    """Period along the path that the weight on the correction's slope halves."""
    curvature_period_mm: Annotated[FiniteFloat, Field(ge=0, le=100)] = 10.0
    """Period along the path that the weight on the correction's curvature halves."""
    solver: Literal["structured", "ipopt"] = "structured"
    """Who finds the correction: compgen's own solver, or CasADi's ipopt, a thousand times slower, for comparison."""
    start_drift_um: Annotated[FiniteFloat, Field(ge=0.01, le=1e4)] = 5.0
    """How much error a late start may add: it sets the start window."""


def settings_of(c: CompensationTable, axisymmetric: bool) -> Settings:
    """The settings in SI; the spin of an axisymmetric tool is free."""
    return Settings(
        clamp_position=c.clamp_mm * MM,
        clamp_rotation=c.clamp_deg * DEG,
        rate=c.rate_um_mm * UM / MM,
        rate_period=c.rate_period_mm * MM,
        curvature_period=c.curvature_period_mm * MM,
        free_spin=axisymmetric,
        solver=Solver(c.solver),
    )
