r"""Periodic transmission error of any orders: gears, encoders and motor windings.

    theta_i -> theta_i + sum_h [ s_ih sin(n_h theta_i) + c_ih cos(n_h theta_i) ]

at the commanded theta, with orders n_h shared by the joints, which one maker builds alike. On a UR5
measured with a laser tracker the orders 7 to 31 hold as much error as the first two (``docs/identify.md``). Source:
Fourier's series of any repeatable transmission error; valid over the measured range of each joint.
"""

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import casadi as ca

from compgen.core.arrays import IntArray, own
from compgen.core.units import MDEG
from compgen.error_model.schema import JointRippleTable
from compgen.error_model.source import (
    Entry,
    Fact,
    Fitting,
    Parameter,
    State,
    TableSource,
    Visibility,
    freeze_parameters,
)
from compgen.robot.kinematics import Chain, is_zero

#: what identification begins with: orders above the gears' first two
USUAL = JointRippleTable(order=list(range(3, 33)), sine_mdeg=6 * [30 * [0.0]], cosine_mdeg=6 * [30 * [0.0]])


@dataclass(frozen=True, eq=False, slots=True)
class JointRipple(TableSource):
    """Waves of any orders on each joint."""

    sine: Any  # (6, H) [rad]
    cosine: Any  # (6, H) [rad]
    order: IntArray  # (H,) waves a turn of the joint

    NAME: ClassVar[str] = "joint_ripple"
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            field="sine",
            key="sine_mdeg",
            shape=(6, "H"),
            unit=MDEG,
            prior=0.2 * MDEG,
            meaning="of each joint and order",
        ),
        Parameter(
            field="cosine",
            key="cosine_mdeg",
            shape=(6, "H"),
            unit=MDEG,
            prior=0.2 * MDEG,
            meaning="of each joint and order",
        ),
    )
    FACTS: ClassVar[tuple[Fact, ...]] = (Fact("order", "order", 1),)
    FITTING: ClassVar[Fitting | None] = Fitting("ripple", USUAL, replaces=True)

    def __post_init__(self) -> None:
        freeze_parameters(self)
        own(self, order=("H",))
        if self.sine.shape[1] != len(self.order):
            raise ValueError(f"JointRipple.sine: {self.sine.shape[1]} columns for {len(self.order)} orders")

    def entries_to_fit(self, visible: Visibility) -> list[Entry]:
        """All orders of the joints that move; each order has a scale of its own."""
        return [
            Entry(field, (i, h), group=str(n))
            for field in ("sine", "cosine")
            for i in visible.joints
            for h, n in enumerate(self.order.tolist())
        ]

    def distort(self, chain: Chain, state: State) -> Chain:
        """The chain with waves added to its joints."""
        theta = []
        for i, (q, commanded) in enumerate(zip(chain.theta, state.nominal.theta, strict=True)):
            for h, n in enumerate(self.order.tolist()):
                for size, wave in ((self.sine[i, h], ca.sin), (self.cosine[i, h], ca.cos)):
                    if not is_zero(size):
                        q = q + size * wave(n * commanded)
            theta.append(q)
        return replace(chain, theta=tuple(theta))
