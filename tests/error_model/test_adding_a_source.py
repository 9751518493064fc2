"""An error source is added in three places: its own file, its table and the twin. All others follow from these."""

import ast
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import pytest
from numpy.testing import assert_allclose
from test_architecture import FILES, label

from compgen.core.exceptions import InputError
from compgen.core.pose import IDENTITY
from compgen.core.toml import check
from compgen.core.units import MDEG
from compgen.error_model import schema, uncertain_sources
from compgen.error_model.expressions import entries, plus
from compgen.error_model.loads import loads_of
from compgen.error_model.model import build_error_model
from compgen.error_model.source import ArmFacts, Entry, Fact, Fitting, Parameter, Visibility, freeze_parameters
from compgen.error_model.sources import ORDER
from compgen.error_model.sources.thermal_growth import ThermalGrowth
from compgen.error_model.uncertain_sources import source_table
from compgen.identification import parameters
from compgen.pipelines.files.robot_file import load_cell
from compgen.pipelines.files.twin_of_job import faults_of
from compgen.robot.kinematics import is_zero

PLACES = ("error_model/sources/", "error_model/schema.py", "pipelines/files/twin_of_job.py")
#: modules that treat one source in a way of its own, which no other source asks for
SPECIAL = {
    "compensation/refinement.py": {"ThermalGrowth"},  # smooth along straight lines: nothing to refine
    "error_model/parameter_slopes.py": {"BaseFrame", "ToolFrame"},  # where the part stands is where the base does
    "error_model/beyond_measured.py": {"AxisMap"},  # it alone has a hull to leave
    "identification/validation.py": {"AxisMap", "BaseFrame", "ToolFrame"},  # of the cell, not of the arm
    "pipelines/study/questions.py": {"ThermalGrowth"},  # contributions of single lengths
    "pipelines/uncertainty/not_known.py": {"JointZeros", "LinkOffsets"},  # the cold geometry
}


def names_in(path):
    """Classes and functions that a file imports or uses."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.Attribute):
            yield node.attr


@pytest.mark.parametrize("path", [p for p in FILES if not label(p).startswith(PLACES)], ids=label)
def test_no_other_module_names_a_source_or_its_table(path):
    sources = {kind.__name__ for kind in ORDER}
    tables = {name for name in vars(schema) if name.endswith("Table")} - {"SourceTable", "SourcesTable", "LoadsTable"}
    tables -= {"Table"}
    assert set(names_in(path)) & sources == SPECIAL.get(label(path), set())
    if label(path).startswith(("error_model", "identification", "verification")):
        assert not set(names_in(path)) & tables


class SagTable(schema.SourceTable):
    """What a robot file would say of the source below."""

    amplitude_mdeg: schema.SixAngles = 6 * [0.0]
    phase_deg: float = 0.0


@dataclass(frozen=True, eq=False, slots=True)
class Sag:
    """theta_i -> theta_i + s_i cos(phi): made up, and in no module of the package."""

    amplitude: Any  # (6,) [rad]
    phase: Any  # () [rad]

    NAME: ClassVar[str] = "sag"
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            field="amplitude", key="amplitude_mdeg", shape=(6,), unit=MDEG, prior=5 * MDEG, meaning="of each joint"
        ),
    )
    FACTS: ClassVar[tuple[Fact, ...]] = (Fact("phase", "phase_deg", 1000 * MDEG),)
    FITTING: ClassVar[Fitting | None] = Fitting("joints", SagTable())
    BUDGET: ClassVar[str] = "geometry"

    def __post_init__(self):
        freeze_parameters(self)

    @staticmethod
    def derive(table, arm, key):
        if table.phase_deg > 90:
            raise InputError(f"{key}.phase_deg: {table.phase_deg:g} is above 90; turn it back")
        return {}

    def entries_to_fit(self, visible: Visibility):
        return [Entry("amplitude", (i,)) for i in visible.joints]

    def distort(self, chain, state):
        sizes = entries(self.amplitude, 6)
        theta = [q if is_zero(s) else plus(q, s * np.cos(self.phase)) for q, s in zip(chain.theta, sizes, strict=True)]
        return replace(chain, theta=tuple(theta))


class SourcesWithSag(schema.SourcesTable):
    """The second place: one more table."""

    sag: SagTable | None = None


@pytest.fixture
def arm(monkeypatch):
    """A robot whose package knows one more source."""
    cell = load_cell("m710ic50")
    for module in (uncertain_sources, parameters):
        monkeypatch.setattr(module, "ORDER", (*ORDER, Sag))
    growth = cell.sources[0]
    assert isinstance(growth, ThermalGrowth)
    return ArmFacts(cell.robot, cell.heat.names, (growth.a, growth.d), loads_of(schema.LoadsTable(), cell.robot))


def read(arm, **sag):
    tables = check(SourcesWithSag, {"sag": sag}, "robots/x.toml")
    return uncertain_sources.read_sources(tables, arm, "robots/x.toml")


def test_a_new_source_is_read_folded_and_written(arm):
    table = {"amplitude_mdeg": [7, 0, 0, 0, 0, 0], "phase_deg": 60.0, "provenance": "made up"}
    known = read(arm, **table, sigma={"amplitude_mdeg": 0.5})
    sag = known[-1]
    assert isinstance(sag.source, Sag)
    assert_allclose(sag.sigma["amplitude"], 0.5 * MDEG)
    model = build_error_model(arm.robot, [k.source for k in known], len(arm.nodes), IDENTITY)
    theta = arm.robot.pendant_zero[None]
    nominal = model.nominal_pose(theta)
    error = model.error(theta, np.zeros((1, len(arm.nodes))), nominal)[0]
    assert_allclose(error[:3], [0, nominal.position[0, 0] * 7 * MDEG / 2, 0], atol=1e-8)  # about joint 1, by half of it
    written = source_table(sag)
    assert written["phase_deg"] == pytest.approx(60)
    assert written["amplitude_mdeg"] == [7, 0, 0, 0, 0, 0]
    assert written["sigma"] == {"amplitude_mdeg": 6 * [0.5]}


def test_a_new_source_names_what_is_wrong_in_its_table(arm):
    with pytest.raises(InputError, match=r"x.toml: sources.sag.phase_deg: 100 is above 90"):
        read(arm, phase_deg=100.0)
    with pytest.raises(InputError, match=r"sources.sag.sigma.amplitude_deg: unknown key; did you mean"):
        read(arm, sigma={"amplitude_deg": 1.0})


def test_a_new_source_is_identified_at_its_step_of_the_ladder(arm):
    parts = parameters.symbolic_sources(
        arm.robot, read(arm), np.array([True, True, False, True, True, True]), warm=False
    )
    terms = [t for p in parts for t in p.parameters if t.source == "sag"]
    assert [t.index for t in terms] == [(0,), (1,), (3,), (4,), (5,)]
    assert terms[0].name == "sag.amplitude_mdeg[1]"
    groups = list(dict.fromkeys(t.group for p in parts for t in p.parameters))
    steps = {c.name: c.groups for c in parameters.candidate_models(groups)}
    assert "sag.amplitude" in steps["joints"]
    assert "sag.amplitude" not in steps["geometry"]


def test_the_twin_refuses_a_source_that_it_does_not_know(arm):
    with pytest.raises(TypeError, match="Sag: the twin does not know this source"):
        faults_of([read(arm)[-1].source])
