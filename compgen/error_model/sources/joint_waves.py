r"""Periodic transmission errors of the joints: of the gears' first two orders, and of any orders.

    theta_i -> theta_i + sum_h [ s_ih sin(n_ih theta_i) + c_ih cos(n_ih theta_i) ]

at the commanded theta. Of the gears, n is N_i and 2 N_i: once and twice a turn of an eccentric part, with N_i how often
it turns for one turn of the joint: 1 for the joint's own gear wheel and encoder, the gear ratio for the motor's side.
Source: transmission error of harmonic and cycloidal drives (Tuttle and Seering 1996). Errors with periods in the tool's
mid-spatial band (N_i of some hundred) are not corrected: the correction is smooth there.

Of any orders (gears, encoders, motor windings), n is shared by the joints, which one maker builds alike. On a UR5
measured with a laser tracker the orders 7 to 31 hold as much error as the first two (``docs/identify.md``). Source:
Fourier's series of any repeatable transmission error; valid over the measured range of each joint.
"""

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.units import MDEG
from compgen.error_model.schema import GearHarmonicsTable, JointRippleTable
from compgen.error_model.source import (
    DeclaredSource,
    Entry,
    Fact,
    Fitting,
    Parameter,
    Shapes,
    State,
    Visibility,
)
from compgen.robot.kinematics import Chain, is_zero


def _amplitudes(orders: int | str, prior: float, meaning: str) -> tuple[Parameter, ...]:
    return tuple(
        Parameter(field=wave, key=f"{wave}_mdeg", shape=(6, orders), unit=MDEG, prior=prior, meaning=meaning)
        for wave in ("sine", "cosine")
    )


@dataclass(frozen=True, eq=False, slots=True)
class GearHarmonics(DeclaredSource):
    """First and second order of each joint's transmission error."""

    sine: Any  # (6, 2) [rad]
    cosine: Any  # (6, 2) [rad]
    cycles: Array  # (6,) N

    NAME: ClassVar[str] = "gear_harmonics"
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = _amplitudes(2, 5 * MDEG, "first and second order, of each joint")
    FACTS: ClassVar[tuple[Fact, ...]] = (Fact("cycles", "cycles", 1.0),)
    FITTING: ClassVar[Fitting | None] = Fitting("joints", GearHarmonicsTable())
    ARRAYS: ClassVar[Shapes] = {"cycles": (6,)}

    def entries_to_fit(self, visible: Visibility) -> list[Entry]:
        """Both orders of the joints that move; each order has a scale of its own."""
        return [
            Entry(field, (i, n), group=str(n + 1))
            for field in ("sine", "cosine")
            for i in visible.joints
            for n in range(2)
        ]

    def distort(self, chain: Chain, state: State) -> Chain:
        """The chain with first and second orders added to its joints."""
        return _with_waves(chain, state, self.sine, self.cosine, np.outer(self.cycles, (1, 2)))


#: what identification begins with: orders above the gears' first two
USUAL = JointRippleTable(order=list(range(3, 33)), sine_mdeg=6 * [30 * [0.0]], cosine_mdeg=6 * [30 * [0.0]])


@dataclass(frozen=True, eq=False, slots=True)
class JointRipple(DeclaredSource):
    """Waves of any orders on each joint."""

    sine: Any  # (6, H) [rad]
    cosine: Any  # (6, H) [rad]
    order: IntArray  # (H,) waves a turn of the joint

    NAME: ClassVar[str] = "joint_ripple"
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = _amplitudes("H", 0.2 * MDEG, "of each joint and order")
    FACTS: ClassVar[tuple[Fact, ...]] = (Fact("order", "order", 1),)
    FITTING: ClassVar[Fitting | None] = Fitting("ripple", USUAL, replaces=True)
    ARRAYS: ClassVar[Shapes] = {"order": ("H",)}

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
        return _with_waves(chain, state, self.sine, self.cosine, np.tile(self.order, (6, 1)))


def _with_waves(chain: Chain, state: State, sine: Any, cosine: Any, order: Array | IntArray) -> Chain:
    """The chain with waves of some orders on each joint, (6, H) each."""
    theta = []
    for i, (q, commanded) in enumerate(zip(chain.theta, state.nominal.theta, strict=True)):
        for h, n in enumerate(order[i].tolist()):
            angle = n * commanded
            for size, wave in ((sine[i, h], ca.sin), (cosine[i, h], ca.cos)):
                if not is_zero(size):
                    q = q + size * wave(angle)
        theta.append(q)
    return replace(chain, theta=tuple(theta))
