"""The sources of the optimiser's chain as plain numbers for the twin, which applies them by code of its own."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from compgen.error_model.loads import Loads
from compgen.error_model.source import Source
from compgen.error_model.sources.compliance import JointCompliance
from compgen.error_model.sources.frames import BaseFrame, ToolFrame
from compgen.error_model.sources.gear_harmonics import GearHarmonics
from compgen.error_model.sources.hysteresis import Hysteresis
from compgen.error_model.sources.joint_coupling import JointCoupling
from compgen.error_model.sources.joint_ripple import JointRipple
from compgen.error_model.sources.joint_zeros import JointZeros
from compgen.error_model.sources.link_offsets import LinkOffsets
from compgen.error_model.sources.measured_map import AxisMap
from compgen.error_model.sources.thermal_bend import ThermalBend
from compgen.error_model.sources.thermal_growth import ThermalGrowth
from compgen.error_model.sources.thermal_shift import ThermalShift
from compgen.verification.twin.faulty_arm import Bend, Flaws, Line


def flaws_of(sources: Sequence[Source]) -> Flaws | None:
    """What a twin must know of some sources beside thermal growth; None when there is nothing.

    Raises:
        TypeError: A source that the twin does not know: it could not prove anything.
    """
    found: dict[str, Any] = {}
    bends: list[Bend] = []
    lines: list[Line] = []
    for source in sources:
        match source:
            case ThermalGrowth():
                pairs = (("d", source.excess_d), ("a", source.excess_a))
                excess = {f"{kind}{i + 1}": float(x) for kind, row in pairs for i, x in enumerate(row) if x}
                if excess:
                    found["excess"] = excess
            case LinkOffsets():
                found["link"] = np.column_stack([source.d, source.a, source.alpha, source.beta])
            case JointZeros():
                found["zero"] = source.offset
            case JointCoupling():
                found["ratio"] = source.ratio
            case JointCompliance():
                found |= {"compliance": source.compliance, **_loads(source.loads)}
            case GearHarmonics():
                found |= {"waves": np.stack([source.sine, source.cosine], axis=2), "cycles": source.cycles}
            case JointRipple():
                found |= {"ripple": np.stack([source.sine, source.cosine], axis=2), "order": source.order}
            case Hysteresis():
                lash = {"backlash": source.backlash, "windup": source.windup, "width": source.width}
                found |= {**lash, **_loads(source.loads)}
            case BaseFrame():
                found["base"] = np.concatenate([source.position, source.rotation])
            case ToolFrame():
                found["tool"] = np.concatenate([source.position, source.rotation])
            case ThermalBend():
                rows = zip(source.rate, source.row, source.axis, source.lever, source.node)
                bends += [Bend(float(r), int(i), a, v, int(k)) for r, i, a, v, k in rows]
            case ThermalShift():
                moved = zip(source.rate, source.row, source.axis, source.node)
                bends += [Bend(0.0, int(i), a, a, int(k), float(r)) for r, i, a, k in moved]
            case AxisMap():
                lines.append(Line(source.axis, source.station, source.forward, source.reverse, source.width))
            case _:
                raise TypeError(f"{type(source).__name__}: the twin does not know this source")
    if not (found or bends or lines):
        return None
    return Flaws(**found, bends=tuple(bends), lines=tuple(lines))


def _loads(loads: Loads) -> dict[str, Any]:
    return {
        "mass": np.append(loads.mass, loads.payload),
        "centre": np.vstack([loads.centre, loads.payload_centre]),
        "gravity": loads.gravity,
        "force": loads.force,
    }
