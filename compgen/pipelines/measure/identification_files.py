"""What the measuring commands read and write: measurements, the instrument's frames, the identified robot file."""

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from compgen.core.arrays import Array
from compgen.core.csv_table import quote_cell
from compgen.core.exceptions import InputError
from compgen.core.files import file_hash
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.json_text import json_text
from compgen.core.recorded.table import read_findings
from compgen.core.rotations import rotation_matrix
from compgen.core.stages import Progress
from compgen.core.units import DEG, HOUR, MM
from compgen.error_model.posterior import known_numbers, posterior_hash, posterior_text
from compgen.error_model.source import Doubtful
from compgen.error_model.uncertain_sources import UncertainSource
from compgen.identification.axis_tests import read_axis_tests
from compgen.identification.distances import read_distances
from compgen.identification.identified_robot_file import (
    SensorlessNode,
    posterior_of,
    robot_text,
    sensorless_findings,
    sensorless_nodes,
    text_with_sources,
    with_sensorless_nodes,
)
from compgen.identification.identify import Identification, identify, identify_by_files
from compgen.identification.instrument_frames import InstrumentFrames
from compgen.identification.measured_poses import read_poses
from compgen.identification.measurement_checks import check_copies
from compgen.identification.measurements import Measurements, concatenate, with_one_frame_a_name
from compgen.identification.touch_rows import touch_rows
from compgen.identification.touches import read_artefact, read_touches
from compgen.identification.warm_up import as_warm_up, check_warms, read_log, with_temperatures
from compgen.job.tables import IdentifiedTable
from compgen.pipelines.files.robot_file import Arm, arm_of, load_arm
from compgen.pipelines.files.schema import SCHEMA_FILES, robot_schema
from compgen.pipelines.measure.fitted_law import rise_reference, with_law_of
from compgen.program.frames import default_frames, load_frames

#: of an arm whose robot file gives no masses
WITHOUT_LOADS = (
    "sag is not fitted: the robot file has no masses; give [sources.loads] with link_kg, link_centre_mm and "
    "payload_kg; a real IRB 120 was 240 um rms off without and 120 um with them"
)
#: of one whose thermal network gives them; with the payload [kg]
NETWORK_LOADS = (
    "for sag the masses of [thermal.network] count, and its payload of {:g} kg; where the arm carried something "
    "else when it was measured, give [sources.loads] with all masses, link_kg and link_centre_mm too"
)


MASSES = ("link_kg", "link_centre_mm", "payload_kg", "payload_centre_mm")


def arm_to_identify(name: str, log: str | None = None, reference: str = "start") -> Arm:
    """A robot with the masses by which it sags, and the law by which it warms, written out in its text.

    Its masses are its own, else those of its thermal network; its law is fitted to the log of its warm-up.

    Args:
        name: Of the robot, or its file.
        log: Temperatures.
        reference: What rises in it count from.

    Raises:
        InputError: Unknown, or anything wrong in a file.
    """
    arm = _arm_with_masses(name)
    return arm if log is None else with_law_of(arm, log, reference)


def _arm_with_masses(name: str) -> Arm:
    arm = load_arm(name)
    network = tomllib.loads(arm.text).get("thermal", {}).get("network")
    if arm.facts.loads.have_weight or not network:
        return arm
    own = tomllib.loads(arm.text).get("sources", {}).get("loads", {})  # gravity of an arm on a ceiling, a force
    text = text_with_sources(arm.text, {"loads": {**own, **{key: network[key] for key in MASSES}}})
    return replace(arm_of(tomllib.loads(text), text, arm.source), network_masses=True)


def artefact_of_touches(touches: str, artefact: str | None) -> str:
    """The artefact that a file's touches are of: the one that is named, or ``artefact.toml`` beside the touches.

    Raises:
        InputError: None is named, and the touches or the file beside them are not there.
    """
    if artefact is not None:
        return artefact
    beside = Path(touches).with_name("artefact.toml")
    if not Path(touches).exists():
        raise InputError(f"{touches}: cannot be read: no such file; give the CSV of touches")
    if not beside.exists():
        raise InputError(
            f"--artefact: missing, and no {beside.name} is beside {touches}; give the TOML of what was touched"
        )
    return str(beside)


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasurementFiles:
    """Names of files with what was measured of an arm, by kind."""

    poses: Sequence[str] = ()
    lines: Sequence[str] = ()
    warm_up: Sequence[str] = ()  # poses of the warming, or warm, arm
    distances: Sequence[str] = ()
    touches: Sequence[str] = ()
    artefact: str | None = None  # what was touched; None: artefact.toml beside each file of touches
    frames: str | None = None  # user frames in which touches were commanded
    log: str | None = None  # temperatures

    def artefact_of(self, touches: str) -> str:
        """The artefact that a file's touches are of."""
        return artefact_of_touches(touches, self.artefact)

    @property
    def names(self) -> list[str]:
        """All files."""
        artefacts = list(dict.fromkeys(map(self.artefact_of, self.touches)))
        single = [name for name in (self.frames if self.touches else None, self.log) if name is not None]
        return [*self.poses, *self.lines, *self.warm_up, *self.distances, *self.touches, *artefacts, *single]


def read_measurements(
    arm: Arm, files: MeasurementFiles, *, force: bool, reference: str = "start", frames_known: bool = False
) -> tuple[Measurements, list[Finding]]:
    """All measurements as one, and what the user must know of the log.

    A temperature log goes with the poses of a warm-up, or else with all poses, and with the distances and touches that
    have times.
    """
    nodes, findings, counted_from = len(arm.nodes), list[Finding](), rise_reference(reference)
    lenient = force or len([*files.poses, *files.warm_up, *files.distances, *files.touches]) > 1
    timed = bool(files.log and not files.warm_up)
    cold = [read_poses(f, arm.robot, nodes, force=lenient, timed=timed, frames_known=frames_known) for f in files.poses]
    warm = [read_poses(f, arm.robot, nodes, force=True, timed=True, frames_known=frames_known) for f in files.warm_up]
    distances = [read_distances(f, arm.robot, nodes, force=lenient, frames_known=frames_known) for f in files.distances]
    touches = list(_read_touches(arm, files, lenient=lenient, frames_known=frames_known))
    if files.log is not None:
        on_clock = [*(warm or cold), *(part for part in (*distances, *touches) if part.timed)]
        if not on_clock:
            raise InputError(
                f"{files.log}: no measurements have times, so temperatures have no use; give column time_s, or leave "
                "the log out"
            )
        log, heat = read_log(files.log, arm.heat, arm.sensors)
        logged = {}
        for part in on_clock:
            logged[id(part)], of_part = with_temperatures(part, log, heat, counted_from)
            findings += [finding for finding in of_part if finding not in findings]
        cold, warm, distances, touches = (
            [logged.get(id(part), part) for part in parts] for parts in (cold, warm, distances, touches)
        )
        check_warms(warm, log)
    elif warm:
        warm = [as_warm_up(part) for part in warm]
    lines = [read_axis_tests(file, arm.robot, nodes) for file in files.lines]
    measurements = with_one_frame_a_name(concatenate([*cold, *warm, *distances, *touches, *lines]))
    if not force:
        check_copies(measurements)
    return measurements, [*findings, *read_findings(measurements.notes)]


def _read_touches(arm: Arm, files: MeasurementFiles, *, lenient: bool, frames_known: bool) -> Iterator[Measurements]:
    """The touches of each file, as rows."""
    if not files.touches:
        return
    uframes = (load_frames(files.frames) if files.frames else default_frames()).uframe
    artefacts = {source: read_artefact(source) for source in map(files.artefact_of, files.touches)}
    by_name = {Path(source).name: source for source in artefacts}
    other = next((source for source in artefacts if by_name[Path(source).name] != source), None)
    if other is not None:
        raise InputError(
            f"--touches: {other} and {by_name[Path(other).name]}: two artefacts of one name; rename one, as the robot "
            "file tells their spheres apart by it"
        )
    for file in files.touches:
        artefact = artefacts[files.artefact_of(file)]
        rows = read_touches(file, arm.robot, artefact, uframes)
        yield touch_rows(rows, artefact, arm.robot, len(arm.nodes), force=lenient, frames_known=frames_known)


def identified_frames(arm: Arm, measurements: Measurements) -> InstrumentFrames:
    """Where the robot file says that instruments, artefacts, reflectors and fixed places are."""
    identified = arm.identified
    if identified is None:
        raise InputError(
            f"{arm.source}: identified: missing, it says where instrument and reflectors are; --refit-frames fits them"
        )
    frames = [_identified_frame(arm.source, identified, measurements, i) for i in range(len(measurements.instruments))]
    return InstrumentFrames(
        rotation_matrix(np.array([turn for _, turn in frames]).reshape(-1, 3) * DEG),
        np.array([origin for origin, _ in frames]).reshape(-1, 3) * MM,
        _identified_places(arm.source, identified.reflector_mm, measurements.reflectors, measurements, "target"),
        _identified_places(arm.source, identified.place_mm, measurements.fixed.names, measurements, "place"),
    )


def _identified_frame(
    source: str, identified: IdentifiedTable, measurements: Measurements, i: int
) -> tuple[Sequence[float], Sequence[float]]:
    """Where World is in the frame of an instrument or artefact: origin [mm], rotation vector [deg]."""
    name = measurements.instruments[i]
    if name in identified.artefact_mm and name in identified.artefact_deg:
        return identified.artefact_mm[name], identified.artefact_deg[name]
    name = measurements.named_instrument(i)
    file = measurements.file(int(np.flatnonzero(measurements.instrument == i)[0]))
    if identified.instrument_mm is None or identified.instrument_deg is None or i in measurements.fixed.frame:
        raise InputError(
            f"{file}: {source} does not know where {quote_cell(name, 'its instrument')} stood; --refit-frames fits its "
            "frame"
        )
    if name and identified.instrument and name != identified.instrument:
        raise InputError(
            f"{file}: instrument {quote_cell(name, 'of the file')}: {source} knows where "
            f"{quote_cell(identified.instrument, 'another')} stood; --refit-frames fits its frame"
        )
    return identified.instrument_mm, identified.instrument_deg


def _identified_places(
    source: str, known: Mapping[str, Sequence[float]], names: Sequence[str], measurements: Measurements, word: str
) -> Array:
    """Places by their names, (n, 3) [m]."""
    unknown = next((name for name in names if name not in known), None)
    if unknown is not None:
        raise InputError(
            f"{measurements.file()}: {word} {quote_cell(unknown, 'of a row')} is not in {source} "
            f"(known: {', '.join(known)}); --refit-frames fits its place"
        )
    return np.array([known[name] for name in names]).reshape(-1, 3) * MM


def identified_robot_text(
    arm: Arm, identified: Identification, files: Sequence[str], posterior: Mapping[str, str] = MappingProxyType({})
) -> str:
    """The robot file with the error sources that were identified, the files that they are from, and its posterior."""
    checksums = ", ".join(f"{Path(f).name} ({file_hash(f)[:12]})" for f in files)
    model = identified.selected.candidate.name
    provenance = f"{len(identified.data.theta)} poses, model '{model}', from {checksums}"
    known = [replace(k, provenance=provenance) if k.sigma else k for k in identified.known]
    record = identified.record() | dict(posterior)
    text = robot_text(arm.text, known, identified.box, provenance[:380], record)
    if arm.law is not None:
        text = with_sensorless_nodes(text, _sensorless(arm, identified))
    # a file that would not load is refused here: by what the measurements ask for, the file they began with is right
    arm_of(tomllib.loads(text), text, f"what was fitted to {Path(files[0]).name}")
    return text


def identified_texts(arm: Arm, identified: Identification, files: Sequence[str], name: str) -> tuple[str, str]:
    """The robot file, and what stands beside it: the covariance of its identified parameters.

    Args:
        arm: The robot file that was identified.
        identified: What was found.
        files: Measurements.
        name: Of the posterior's file.
    """
    written = identified.known, *_nodes_as_written(arm, identified)
    fitted = frozenset(arm.nodes.index(node.name) for node in _written_nodes(arm, identified))
    posterior = posterior_text(posterior_of(identified, known_numbers(*written), fitted), arm.robot.name)
    named = {"posterior": name, "posterior_sha256": posterior_hash(posterior.encode())}
    return identified_robot_text(arm, identified, files, named), posterior


def _written_nodes(arm: Arm, identified: Identification) -> list[SensorlessNode]:
    """Nodes whose rise and time constant the robot file has as they were fitted."""
    if arm.law is None:
        return []
    return [node for node in _sensorless(arm, identified) if node.is_known]


def _nodes_as_written(arm: Arm, identified: Identification) -> tuple[Array | None, Array | None]:
    """Rises (K,) [K] and time constants (K,) [s] of the nodes, as the robot file has them after identification."""
    if arm.law is None:
        return None, None
    rise, tau = arm.law.reference_rise.copy(), arm.law.tau.copy()
    for node in _written_nodes(arm, identified):
        k = arm.nodes.index(node.name)
        rise[k], tau_h = node.written(float(rise[k]), float(tau[k]) / HOUR)
        tau[k] = tau_h * HOUR
    return rise, tau


def _sensorless(arm: Arm, identified: Identification) -> list[SensorlessNode]:
    return sensorless_nodes(identified.model, identified.selected.fit, arm.nodes)


def identify_files(
    arm: Arm, files: MeasurementFiles, reference: str, progress: Progress, *, force: bool
) -> Identification:
    """An identification from its files, with what must be known of its log and of the robot file.

    Args:
        arm: To identify.
        files: Of its measurements.
        reference: What rises in the log count from.
        progress: Called with the stage and the share done.
        force: Take also measurements that are refused for being too few.

    Raises:
        InputError: A file or what it holds is wrong.
    """
    measurements, of_log = read_measurements(arm, files, force=force, reference=reference)

    def identify_rows(rows: Measurements) -> Identification:
        logged, facts = files.log is not None, arm.facts
        return identify(arm.robot, arm.known, rows, len(arm.nodes), progress, temperatures=logged, facts=facts)

    identified = identify_by_files(identify_rows, measurements)
    of_nodes = sensorless_findings(_sensorless(arm, identified), is_written=arm.law is not None)
    return replace(
        identified,
        findings=(
            *identified.findings,
            *of_log,
            *of_nodes,
            *_load_findings(arm, identified.known),
            *arm.input_findings,
        ),
    )


def _load_findings(arm: Arm, known: Sequence[UncertainSource]) -> Iterator[Finding]:
    """Which masses sag is fitted with, where [sources.loads] has none, and joints that none of them can turn so."""
    doubts = [of.source.doubt(of.sigma) for of in known if isinstance(of.source, Doubtful)]
    yield from [Finding(Level.WARNING, Code.SOURCES_LOADS, doubt) for doubt in doubts if doubt]
    if not arm.facts.loads.have_weight or arm.network_masses:
        message = NETWORK_LOADS.format(arm.facts.loads.payload) if arm.network_masses else WITHOUT_LOADS
        yield Finding(Level.NOTE, Code.SOURCES_LOADS, message)


def robot_files_of(target: Path, text: str) -> dict[str, bytes]:
    """A robot file, and the schema that its first line names where there is none beside it, by their names."""
    schema = target.parent / Path(SCHEMA_FILES["robot"]).name
    if text.startswith(f"#:schema ./{schema.name}\n") and not schema.exists():
        return {schema.name: json_text(robot_schema()), target.name: text.encode()}
    return {target.name: text.encode()}
