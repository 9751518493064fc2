r"""Constant errors of the DH parameters: lengths and twists of the links.

    d -> d + delta d,   a -> a + delta a,   alpha -> alpha + delta alpha,   beta -> delta beta

Each row is then Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta). beta is Hayati's angle: where two neighbouring axes are
(nearly) parallel, a small tilt between them about y would need an unbounded d and theta in plain DH; there beta takes
its place and delta d of that row is left at zero (it does what d of the next row does). Source: Hayati and Mirmirani
(1985); Mooring, Roth and Driels, Fundamentals of Manipulator Calibration (1991). For errors far below the lengths.
"""

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from compgen.core.arrays import Array, BoolArray
from compgen.core.units import MDEG, UM
from compgen.error_model.expressions import entries, plus
from compgen.error_model.schema import LinkOffsetsTable
from compgen.error_model.source import DeclaredSource, Entry, Fitting, Parameter, State, Visibility
from compgen.robot.kinematics import Chain

PARALLEL = 1e-3  # rad: twists nearer to 0 or 180 deg than this make their axes parallel


@dataclass(frozen=True, eq=False, slots=True)
class LinkOffsets(DeclaredSource):
    """Constant errors of the six DH rows."""

    d: Any  # (6,) [m]
    a: Any  # (6,) [m]
    alpha: Any  # (6,) [rad]
    beta: Any  # (6,) [rad]

    NAME: ClassVar[str] = "link_offsets"
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = (
        Parameter(field="d", key="d_um", shape=(6,), unit=UM, prior=500 * UM, meaning="along each joint axis"),
        Parameter(field="a", key="a_um", shape=(6,), unit=UM, prior=500 * UM, meaning="along each link"),
        Parameter(
            field="alpha", key="alpha_mdeg", shape=(6,), unit=MDEG, prior=50 * MDEG, meaning="twist of each link"
        ),
        Parameter(
            field="beta",
            key="beta_mdeg",
            shape=(6,),
            unit=MDEG,
            prior=50 * MDEG,
            meaning="Hayati angle, where axes are parallel",
        ),
    )
    FITTING: ClassVar[Fitting | None] = Fitting("geometry", LinkOffsetsTable())

    def entries_to_fit(self, visible: Visibility) -> list[Entry]:
        """Of each row d, or beta where axes are parallel, a and alpha.

        The frames of instrument and reflectors hold the first d and the last row.
        """
        hayati = parallel_axes(visible.robot.alpha)
        return [
            *(Entry("d", (i,)) for i in range(1, 5) if not hayati[i]),
            *(Entry("a", (i,)) for i in range(5)),
            *(Entry("alpha", (i,)) for i in range(5)),
            *(Entry("beta", (i,)) for i in range(6) if hayati[i]),
        ]

    def distort(self, chain: Chain, state: State) -> Chain:
        """The chain with constants added to its DH rows."""
        offset: dict[str, Any] = {}
        for name in ("d", "a", "alpha", "beta"):
            pairs = zip(getattr(chain, name), entries(getattr(self, name), 6), strict=True)
            offset[name] = tuple(plus(value, change) for value, change in pairs)
        return replace(chain, **offset)


def parallel_axes(alpha: Array) -> BoolArray:
    """Rows whose twist leaves the next axis parallel, where beta takes the place of d, (6,); never the last."""
    rows = np.abs(np.sin(alpha)) < PARALLEL
    rows[5] = False
    return np.asarray(rows)
