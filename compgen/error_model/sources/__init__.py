"""Error sources: each a function from a symbolic chain to a symbolic chain.

Adding one: a file with the source, a line here, its table in ``schema_sources``, its physics in ``twin.real_arm``,
a test (zero, hand formula, differences). Sources are folded over the nominal chain in the order of ``ORDER``; each sees
the nominal chain in its ``State``, so that what it does depends on the commanded pose and not on those before it.
"""

from compgen.error_model.sources.compliance import JointCompliance
from compgen.error_model.sources.direction_memory import (
    NO_DIRECTION,
    DirectionState,
    ReversalWidths,
    direction_states,
    reversal_widths,
    unknown_share,
)
from compgen.error_model.sources.frames import BaseFrame, ToolFrame
from compgen.error_model.sources.gear_harmonics import GearHarmonics
from compgen.error_model.sources.hysteresis import Hysteresis
from compgen.error_model.sources.joint_coupling import JointCoupling
from compgen.error_model.sources.joint_ripple import JointRipple
from compgen.error_model.sources.joint_zeros import JointZeros
from compgen.error_model.sources.link_offsets import LinkOffsets, parallel
from compgen.error_model.sources.loads import Loads
from compgen.error_model.sources.measured_map import AxisMap
from compgen.error_model.sources.source import Parameter, Source, State
from compgen.error_model.sources.thermal_bend import ThermalBend
from compgen.error_model.sources.thermal_growth import ThermalGrowth
from compgen.error_model.sources.thermal_shift import ThermalShift
from compgen.error_model.sources.uncertainty import Known, prior_of, table_of

ORDER = (
    ThermalGrowth,
    LinkOffsets,
    JointZeros,
    JointCoupling,
    JointCompliance,
    GearHarmonics,
    JointRipple,
    Hysteresis,
    BaseFrame,
    ThermalBend,
    ThermalShift,
    ToolFrame,
    AxisMap,
)

__all__ = [
    "NO_DIRECTION",
    "ORDER",
    "AxisMap",
    "BaseFrame",
    "DirectionState",
    "GearHarmonics",
    "Hysteresis",
    "JointCompliance",
    "JointCoupling",
    "JointRipple",
    "JointZeros",
    "Known",
    "LinkOffsets",
    "Loads",
    "Parameter",
    "ReversalWidths",
    "Source",
    "State",
    "ThermalBend",
    "ThermalGrowth",
    "ThermalShift",
    "ToolFrame",
    "direction_states",
    "parallel",
    "prior_of",
    "reversal_widths",
    "table_of",
    "unknown_share",
]
