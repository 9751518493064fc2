"""Error sources: each a function from a symbolic chain to a symbolic chain.

Adding one: a file with the source, a line here, its table in ``schema_sources``, its physics in ``twin.real_arm``,
a test (zero, hand formula, differences). Sources are folded over the nominal chain in the order of ``ORDER``; each sees
the nominal chain in its ``State``, so that what it does depends on the commanded pose and not on those before it.
"""

from compgen.sources.compliance import JointCompliance
from compgen.sources.frames import BaseFrame, ToolFrame
from compgen.sources.gear_harmonics import GearHarmonics
from compgen.sources.gravity import Loads
from compgen.sources.hysteresis import Hysteresis
from compgen.sources.joint_coupling import JointCoupling
from compgen.sources.joint_ripple import JointRipple
from compgen.sources.joint_zeros import JointZeros
from compgen.sources.knowledge import Known, prior_of, table_of
from compgen.sources.link_offsets import LinkOffsets, parallel
from compgen.sources.measured_map import AxisMap
from compgen.sources.motion import STILL, Memory, Motion, memory_of, motion_of, strangeness
from compgen.sources.state import Parameter, Source, State
from compgen.sources.thermal_bend import ThermalBend
from compgen.sources.thermal_growth import ThermalGrowth
from compgen.sources.thermal_shift import ThermalShift

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
    "ORDER",
    "STILL",
    "AxisMap",
    "BaseFrame",
    "GearHarmonics",
    "Hysteresis",
    "JointCompliance",
    "JointCoupling",
    "JointRipple",
    "JointZeros",
    "Known",
    "LinkOffsets",
    "Loads",
    "Memory",
    "Motion",
    "Parameter",
    "Source",
    "State",
    "ThermalBend",
    "ThermalGrowth",
    "ThermalShift",
    "ToolFrame",
    "memory_of",
    "motion_of",
    "parallel",
    "prior_of",
    "strangeness",
    "table_of",
]
