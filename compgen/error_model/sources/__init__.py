"""Error sources: each a function from a symbolic chain to a symbolic chain.

To add one, touch three places:

1. ``error_model/sources/<name>.py``: a frozen dataclass that fulfils ``error_model.source.Source``. It declares its
   parameters with units and priors, how its other fields come from its table (``DeclaredSource``: there are none),
   what measurements can tell of it, and what it does to the chain. ``ORDER`` below says when it acts.
2. Its table in ``error_model/schema.py``, each key described below its field, and the table's name in ``SourcesTable``.
3. The twin: its numbers in ``pipelines/files/twin_of_job.py``, its physics, written again, in
   ``verification/twin/``. Until then every proof of a robot that has it is refused.

Reading, writing, identification, findings and reports follow from what it declares. A test holds this
(``tests/error_model/test_adding_a_source.py``); its own tests are: zero leaves no trace, a hand formula, derivatives
against differences (``tests/error_model/test_sources.py`` does the first and the last for every source).

Sources are folded over the nominal chain in the order of ``ORDER``; each sees the nominal chain in its ``State``, so
that what it does depends on the commanded pose and not on those before it.
"""

from compgen.error_model.source import Source
from compgen.error_model.sources.compliance import JointCompliance
from compgen.error_model.sources.frames import BaseFrame, ToolFrame
from compgen.error_model.sources.hysteresis import Hysteresis
from compgen.error_model.sources.joint_coupling import JointCoupling
from compgen.error_model.sources.joint_waves import GearHarmonics, JointRipple
from compgen.error_model.sources.joint_zeros import JointZeros
from compgen.error_model.sources.link_offsets import LinkOffsets
from compgen.error_model.sources.measured_map import AxisMap
from compgen.error_model.sources.thermal_bend import ThermalBend
from compgen.error_model.sources.thermal_growth import ThermalGrowth
from compgen.error_model.sources.thermal_shift import ThermalShift

ORDER: tuple[type[Source], ...] = (
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
