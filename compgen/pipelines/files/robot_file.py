"""Robot files to cells: TOML with overrides, checked against ``schema``, turned into SI.

The posterior beside a robot file: found by the name that the file gives, refused where it is not the one meant.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError
from compgen.core.files import read_named
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.other_units import values_in_other_units
from compgen.core.toml import TomlText, check, input_keys, override, read_toml, read_toml_text, shipped, suggest
from compgen.core.units import UM
from compgen.core.version import __version__
from compgen.error_model.loads import loads_of
from compgen.error_model.posterior import ParameterPosterior, known_numbers, posterior_hash, read_posterior
from compgen.error_model.source import ArmFacts
from compgen.error_model.uncertain_sources import UncertainSource, read_joint_box, read_sources, without_effect
from compgen.error_model.unmeasured import OF_WARMTH, unknown_of
from compgen.job.job import Cell
from compgen.job.tables import IdentifiedTable, drifting_of, fit_limits_of
from compgen.pipelines.files.schema import RobotFile
from compgen.robot.inverse_kinematics import check_arm_class
from compgen.robot.motion_tables import expected_motion_of, motion_of
from compgen.robot.robot import Robot
from compgen.robot.tables import robot_from_tables
from compgen.thermal import NodeModel, Profile, cold_arm, tables
from compgen.thermal.model import ArmHeat
from compgen.thermal.uncertainty import ThermalUncertainty, nothing_warms

COLD = Finding(
    Level.WARNING,
    Code.THERMAL_NONE,
    "the robot file has no [thermal]: the arm is taken as cold, and what its warmth does is not known",
)
ROUNDED_UP = Finding.of(
    Code.CONTROLLER_PERIODS,
    "the robot file does not have controller.rounds_up_to_period: each line is counted as a whole number of "
    "interpolation periods, as FANUC's controllers were seen to do; give true or false",
)
MOST_BYTES = 64_000_000
MOST_GRAVITY = 20.0  # [m/s2]
_TOO_WIDE = "the sigmas alone say how well its parameters are known, and without their correlations a band is too wide"


def load_robot(name: str) -> Robot:
    """A robot's nominal facts, by name or file.

    Raises:
        InputError: Unknown, or anything wrong in its file.
    """
    robot = load_any_robot(name)
    check_arm_class(robot, str(find_robot(name)))
    return robot


def load_any_robot(name: str) -> Robot:
    """A robot's nominal facts, also of an arm that has no closed-form inverse kinematics here.

    Raises:
        InputError: Unknown, or anything wrong in its file.
    """
    source = find_robot(name)
    return _nominal(check(RobotFile, read_toml(source, "robots"), str(source)), str(source))


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Arm:
    """A robot file of any serial arm, as far as measuring needs it."""

    source: str
    text: str
    robot: Robot
    nodes: tuple[str, ...]  # of the heat model; none without one
    heat: ArmHeat | None
    warmth: ThermalUncertainty  # how well that is known
    sensors: Mapping[str, str]  # part_<n> of a temperature log to the name of a rise
    known: tuple[UncertainSource, ...]
    identified: IdentifiedTable | None
    input_findings: tuple[Finding, ...]  # values that look like another unit's
    facts: ArmFacts  # what the arm carries, its nodes, and how it grows
    network_masses: bool = False  # what it carries was taken from [thermal.network]

    @property
    def law(self) -> NodeModel | None:
        """Of its nodes; None: it has none."""
        return None if self.heat is None else self.heat.law


def load_arm(name: str) -> Arm:
    """A robot of any arm class, with its error sources.

    Raises:
        InputError: Unknown, or anything wrong in its file.
    """
    source = find_robot(name)
    text = read_toml_text(source, "robots")
    return arm_of(text.tables, text.content.decode("utf-8-sig").replace("\r\n", "\n"), str(source))


def arm_of(data: dict[str, Any], text: str, where: str) -> Arm:
    """The arm that a robot file's tables describe.

    Raises:
        InputError: Anything wrong, naming file and key.
    """
    facts = check(RobotFile, data, where)
    robot = _nominal(facts, where)
    heat, _, growth, warmth = _warmth(facts, robot, where)
    nodes = heat.names if facts.thermal else ()
    arm = ArmFacts(robot, nodes, growth, loads_of(facts.sources.loads, robot))
    return Arm(
        source=where,
        text=text,
        robot=robot,
        nodes=nodes,
        heat=heat if facts.thermal else None,
        warmth=warmth,
        sensors=facts.thermal.sensors if facts.thermal else {},
        known=read_sources(facts.sources, arm, where),
        identified=facts.identified,
        input_findings=values_in_other_units(data, where),
        facts=arm,
    )


def known_robots() -> list[str]:
    """Names of the robots that lie in the current folder's ``robots``, or are shipped."""
    return sorted({p.stem for folder in (Path("robots"), shipped() / "robots") for p in folder.glob("*.toml")})


def load_cell(name: str, overrides: Sequence[str] = ()) -> Cell:
    """A robot with its warmth and its errors, by name or file.

    Args:
        name: Name or file of a robot.
        overrides: ``key=value``, dotted, into the robot file; a leading ``robot.`` may stand before the key.

    Raises:
        InputError: Anything wrong, naming file and key.
    """
    refuse_unprintable(overrides)
    source = find_robot(name)
    text = read_toml_text(source, "robots")
    for item in overrides:
        override(text.tables, item.removeprefix("robot."), item)
    return cell_of(text, source, overrides)


def cell_of(text: TomlText, source: Path, overrides: Sequence[str]) -> Cell:
    """The cell that a robot file's tables, with overrides in them, describe.

    Raises:
        InputError: Anything wrong, naming file and key.
    """
    where, data = str(source), text.tables
    if "path" in data:
        raise InputError(f"{where}: a path file, and a robot file is wanted; give a robot's name, as m710ic50, or file")
    facts = check(RobotFile, data, where)
    _refuse_double(facts, where)
    _refuse_load(facts, where)
    robot = _nominal(facts, where)
    check_arm_class(robot, where)
    heat, profiles, growth, warmth = _warmth(facts, robot, where)
    arm = ArmFacts(robot, heat.names, growth, loads_of(facts.sources.loads, robot))
    known = read_sources(facts.sources, arm, where)
    inputs = json.dumps([__version__, data], sort_keys=True, default=str)
    posterior, of_posterior = posterior_beside(facts.identified, source, known, heat, is_overridden=bool(overrides))
    return Cell(
        robot=robot,
        heat=heat,
        profiles=profiles,
        warmth=warmth,
        unknown=(*unknown_of(facts.unknown, where), *(() if facts.thermal else (OF_WARMTH,))),
        known=known,
        sources=tuple(k.source for k in known),
        joint_box=read_joint_box(facts.sources, where),
        sensors=facts.thermal.sensors if facts.thermal else {},
        overrides=tuple(overrides),
        inputs_hash=sha256(inputs.encode()).hexdigest(),
        robot_file=str(source),
        robot_file_hash=sha256(text.content).hexdigest(),
        held_out=facts.identified.held_out_um[0] * UM if facts.identified and facts.identified.held_out_um else None,
        input_findings=(*values_in_other_units(data, where), *of_posterior, *_silence(facts, known)),
        posterior=posterior,
        fit=fit_limits_of(facts.identified),
        drifting=drifting_of(facts.anchor),
        inputs=input_keys(facts),
    )


def with_other_heat_model(text: TomlText) -> TomlText | None:
    """A robot file's tables with its other heat model chosen: the network for the nodes; None where it has one only."""
    thermal = text.tables.get("thermal")
    if not isinstance(thermal, dict) or not thermal.get("network"):
        return None
    other = "network" if thermal.get("model", "nodes") == "nodes" else "nodes"
    return TomlText({**text.tables, "thermal": {**thermal, "model": other}}, text.content)


def find_robot(name: str, path_file: Path | None = None, named_in: Path | None = None) -> Path:
    """The file of a robot: as named, or from the project it is used in, else shipped; never one by chance.

    The project of a path file is the folder that holds its folder (``p`` for ``p/paths/plate.toml``), links followed;
    without a path file it is the current folder.

    Args:
        name: A robot's name, or its file.
        path_file: That the robot is named for.
        named_in: The file that names it, where it is another.

    Raises:
        InputError: No such robot; or the current folder has another one of that name.
    """
    if name == "":
        raise InputError("--robot: an empty name; give a robot's name or file")
    if name.endswith(".toml"):
        return Path(name)
    if len(name) > 64 or not name.isprintable():
        raise InputError(f"robot '{name}': no robot has such a name; give a robot's name or file")
    current = Path("robots")
    project = current if path_file is None else path_file.resolve().parents[1] / "robots"
    folders = [project, shipped() / "robots"]
    robot_file = next((folder / f"{name}.toml" for folder in folders if (folder / f"{name}.toml").is_file()), None)
    other = current / f"{name}.toml"
    if robot_file is None:
        known = sorted({p.stem for folder in folders for p in folder.glob("*.toml")})
        where = f"{named_in or path_file}: " if path_file is not None else ""
        raise InputError(
            f"{where}robot '{name}' is unknown; known: {', '.join(known)}{suggest(name, known, listed=True)}"
            + (f"; or is {other} meant? name the file" if other.is_file() else "")
        )
    if other.is_file() and not other.samefile(robot_file) and other.read_bytes() != robot_file.read_bytes():
        raise InputError(
            f"{path_file or name}: robot '{name}' is both {_short(robot_file)} and {other}, and they differ; "
            "say which with --robot FILE"
        )
    return _short(robot_file)


def _short(path: Path) -> Path:
    """A file's path from the current folder where it lies below it."""
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path


def refuse_unprintable(overrides: Sequence[str]) -> None:
    """Raises InputError for an override that would garble a message."""
    for item in overrides:
        if not item.isprintable():
            raise InputError(f"--set {item!r}: it holds what is not printable text; mend it")


def _nominal(facts: RobotFile, where: str) -> Robot:
    robot = robot_from_tables(
        facts.name, facts.dh, facts.pendant, facts.limits, facts.singularity, facts.controller, where
    )
    motion, seen = motion_of(facts.motion, facts.name, where), expected_motion_of(facts.expected_motion, where)
    motion = None if motion is None else motion.with_other_beginnings(seen.expected)
    return replace(robot, motion=motion, expected_motion=seen)


def _silence(facts: RobotFile, known: Sequence[UncertainSource]) -> Iterator[Finding]:
    """What a robot file should say and does not, and what it says to no effect."""
    idle, sources = without_effect(facts.sources, known), facts.sources
    cte = facts.thermal.cte_um_m_K if facts.thermal else 1.0
    grows = any(cte.values()) if isinstance(cte, dict) else cte
    if not (grows or sources.thermal_bend or sources.thermal_shift):
        idle.append("[thermal]: cte_um_m_K is zero, so that nothing grows; give it")
    if idle:
        yield Finding(Level.WARNING, Code.SOURCES_LOADS, f"the robot file has errors without effect: {'; '.join(idle)}")
    if "rounds_up_to_period" not in facts.controller.model_fields_set:
        yield ROUNDED_UP
    if not facts.thermal:
        yield COLD


def _refuse_load(facts: RobotFile, where: str) -> None:
    """Raises InputError for a load that no such robot carries, or that falls as nothing does."""
    loads, largest = facts.sources.loads, facts.payload_kg
    if largest is not None and loads.payload_kg > largest:
        raise InputError(
            f"{where}: sources.loads.payload_kg: {loads.payload_kg:g}, and the robot carries payload_kg = {largest:g}; "
            "give the tool's mass in kg, or mend payload_kg"
        )
    if max(map(abs, loads.gravity_m_s2)) > MOST_GRAVITY:
        raise InputError(
            f"{where}: sources.loads.gravity_m_s2: {loads.gravity_m_s2}: more than {MOST_GRAVITY:g} m/s^2; gravity is "
            "9.81 m/s^2"
        )


def _refuse_double(facts: RobotFile, where: str) -> None:
    """Raises InputError when the controller may correct what the file's parameters correct as well."""
    controller = facts.controller
    if controller.compensation == "unknown":
        raise InputError(
            f"{where}: controller.compensation: 'unknown' is refused, a correction could be applied twice; "
            "find out whether the controller corrects its own geometry and set 'none' or 'signature'"
        )
    active = controller.signature if controller.compensation == "signature" else ""
    if controller.compensation == "signature" and not active:
        raise InputError(
            f"{where}: controller.signature: missing; compensation = 'signature' needs the name of the calibration "
            "that is active on the controller"
        )
    if controller.signature and not active:
        raise InputError(
            f"{where}: controller.signature: '{controller.signature}' is active, and compensation = 'none' says that "
            "nothing is; say 'signature', or remove the name"
        )
    if active != controller.identified_with:
        have = f"'{controller.identified_with}'" if controller.identified_with else "no calibration"
        now = f"'{active}'" if active else "none"
        raise InputError(
            f"{where}: controller.identified_with: the errors of this file were identified with {have} active, now "
            f"{now} is: corrections would be applied twice or wrongly; identify again, or mend the entry"
        )


def _warmth(
    facts: RobotFile, robot: Robot, where: str
) -> tuple[ArmHeat, tuple[Profile, ...], tuple[Array, Array], ThermalUncertainty]:
    """The heat model, the profiles along its links, the growth of a and d, (6, K) [m/K], and how well all is known.

    A file without a table of warmth is of an arm that is taken as cold.
    """
    if facts.thermal is None:
        cold = cold_arm()
        return cold, (), (np.zeros((6, 1)), np.zeros((6, 1))), nothing_warms(cold)
    if facts.thermal.network is not None:
        tables.check_materials(facts.thermal.network, where)
    tables.check_sensor_rises(facts.thermal, where)
    profiles = tables.profiles_of(facts.thermal, robot, where)
    nodes = tables.node_model_of(facts.thermal, where)
    heat: ArmHeat = nodes
    if facts.thermal.model == "network":
        gravity = facts.sources.loads.gravity_m_s2
        heat, profiles = tables.network_of(facts.thermal, robot, nodes.box, profiles, gravity, where)
    growth = tables.growth_of(robot, heat.names, heat.reference_rise, profiles)
    return heat, profiles, growth, tables.uncertainty_of(facts.thermal, heat, profiles, where)


def posterior_beside(
    identified: IdentifiedTable | None,
    robot_file: Path,
    known: Sequence[UncertainSource],
    heat: ArmHeat | None,
    *,
    is_overridden: bool = False,
) -> tuple[ParameterPosterior | None, list[Finding]]:
    """The posterior of an identified robot file, None without one, and what the user must know of it.

    Args:
        identified: The file's record of its identification.
        robot_file: Where it was read.
        known: Its sources.
        heat: Its heat model.
        is_overridden: Whether values were given that are not the file's.

    Raises:
        InputError: There is a file of that name, and it is not this robot file's posterior.
    """
    if identified is None:
        return None, []
    if not identified.posterior:
        if not any(k.sigma for k in known):
            return None, []
        message = f"{robot_file}: identified.posterior: no file is named; {_TOO_WIDE}; identify again"
        return None, [Finding.of(Code.POSTERIOR_MISSING, message)]
    beside = [folder / identified.posterior for folder in (robot_file.parent, robot_file.resolve().parent)]
    file = next((f for f in beside if f.exists()), None)
    if file is None:
        message = f"{beside[0]}: not there; {_TOO_WIDE}; copy it along with its robot file"
        return None, [Finding.of(Code.POSTERIOR_MISSING, message)]
    content = read_named(file, f"{robot_file.name} names it: put it back, or identify again", MOST_BYTES)
    if posterior_hash(content) != identified.posterior_sha256:
        raise InputError(
            f"{file}: its sha256 begins with {posterior_hash(content)[:12]}, {robot_file.name} names one that begins "
            f"with {identified.posterior_sha256[:12] or 'nothing'}: of another identification; take the file that "
            "was written with this robot file, or identify again"
        )
    law = None if heat is None else heat.law
    rise, tau = (None, None) if law is None else (law.reference_rise, law.tau)
    try:
        return read_posterior(content, known_numbers(known, rise, tau), str(file)), []
    except InputError:
        if not is_overridden:
            raise
        message = f"{file}: it belongs to the values that the robot file has without overrides; {_TOO_WIDE}"
        return None, [Finding.of(Code.POSTERIOR_OVERRIDDEN, message)]
