"""What the measuring commands read and write: measurements, the instrument's frames, the identified robot file."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType

import numpy as np

from compgen.core.arrays import Array
from compgen.core.csv_table import quote_cell
from compgen.core.exceptions import InputError
from compgen.core.files import read_regular
from compgen.core.findings import Finding
from compgen.core.rotations import rotation_matrix
from compgen.core.units import DEG, HOUR, MM
from compgen.error_model.posterior import numbers_of, posterior_hash, posterior_text
from compgen.identification.axis_tests import read_lines
from compgen.identification.frames import InstrumentFrames
from compgen.identification.identified_robot_file import robot_text
from compgen.identification.identify import Identification
from compgen.identification.measurements import Measurements, concatenate, with_one_frame_a_name
from compgen.identification.parameter_posterior import posterior_of
from compgen.identification.pose_files import read_poses
from compgen.identification.sensorless_nodes import (
    SensorlessNode,
    sensorless_findings,
    sensorless_nodes,
    with_sensorless_nodes,
)
from compgen.identification.warm_up import as_warm_up, with_temperatures
from compgen.pipelines.json_schema import SCHEMA_FILES, robot_schema, schema_text
from compgen.pipelines.robot_file import Arm, arm_of
from compgen.thermal import NodeModel
from compgen.thermal.temperature_log import COLDEST, HOTTEST, Reference


def read_measurements(
    arm: Arm,
    poses: Sequence[str],
    lines: Sequence[str],
    warm_up: Sequence[str],
    log: str | None,
    force: bool,
    reference: str = "start",
    frames_known: bool = False,
) -> tuple[Measurements, list[Finding]]:
    """All measurements as one, and what the user must know of the log.

    A temperature log goes with the poses of a warm-up, or else with all poses.
    """
    nodes, findings = len(arm.nodes), list[Finding]()
    lenient = force or len(poses) + len(warm_up) > 1
    cold = [read_poses(f, arm.robot, nodes, lenient, bool(log and not warm_up), frames_known) for f in poses]
    warm = [read_poses(f, arm.robot, nodes, True, True, frames_known) for f in warm_up]
    if log is not None:
        logged = []
        for part in warm or cold:
            part, of_part = with_temperatures(part, log, arm.heat, arm.sensors, rise_reference(reference))
            logged.append(part)
            findings += [finding for finding in of_part if finding not in findings]
        cold, warm = (cold, logged) if warm else (logged, [])
    elif warm:
        warm = [as_warm_up(part) for part in warm]
    measured = [*cold, *warm, *(read_lines(file, arm.robot, nodes) for file in lines)]
    return with_one_frame_a_name(concatenate(measured)), findings


def rise_reference(text: str) -> Reference:
    """What rises count from, as an option says it."""
    if text in ("start", "ambient"):
        return "start" if text == "start" else "ambient"
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not COLDEST <= value <= HOTTEST:
        raise InputError(
            f"--reference {quote_cell(text, 'as given')}: must be start, ambient, or {COLDEST:g} to {HOTTEST:g} degC"
        )
    return value


def identified_frames(arm: Arm, measurements: Measurements) -> InstrumentFrames:
    """Where the robot file says that instruments and reflectors are."""
    identified = arm.identified
    if identified is None:
        raise InputError(
            f"{arm.source}: identified: missing, it says where instrument and reflectors are; --refit-frames fits them"
        )
    named = [measurements.named_instrument(i) for i in range(len(measurements.instruments))]
    other = next((name for name in named if name and identified.instrument and name != identified.instrument), None)
    if other is not None:
        raise InputError(
            f"{measurements.file()}: instrument {quote_cell(other, 'of the file')}: {arm.source} knows where "
            f"{quote_cell(identified.instrument, 'another')} stood; --refit-frames fits its frame"
        )
    unknown = next((r for r in measurements.reflectors if r not in identified.reflector_mm), None)
    if unknown is not None:
        known = ", ".join(identified.reflector_mm)
        raise InputError(
            f"{measurements.file()}: target {quote_cell(unknown, 'of a row')} is not in {arm.source} "
            f"(known: {known}); --refit-frames fits its place"
        )
    count = len(measurements.instruments)
    rotation = rotation_matrix(np.array([identified.instrument_deg]) * DEG)
    return InstrumentFrames(
        np.repeat(rotation, count, axis=0),
        np.tile(np.array(identified.instrument_mm) * MM, (count, 1)),
        np.array([identified.reflector_mm[r] for r in measurements.reflectors]) * MM,
    )


def identified_robot_text(
    arm: Arm, identified: Identification, files: Sequence[str], posterior: Mapping[str, str] = MappingProxyType({})
) -> str:
    """The robot file with the error sources that were identified, the files that they are from, and its posterior."""
    checksums = ", ".join(f"{Path(f).name} ({sha256(read_regular(f)).hexdigest()[:12]})" for f in files)
    model = identified.selected.candidate.name
    provenance = f"{len(identified.data.theta)} poses, model '{model}', from {checksums}"
    known = [replace(k, provenance=provenance) if k.sigma else k for k in identified.known]
    record = identified.record() | dict(posterior)
    text = robot_text(arm.text, arm.robot, known, identified.box, provenance[:380], record)
    if isinstance(arm.heat, NodeModel):
        text = with_sensorless_nodes(text, _sensorless(arm, identified))
    arm_of(tomllib.loads(text), text, arm.source)  # a file that would not load is refused here
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
    posterior = posterior_text(posterior_of(identified, numbers_of(*written), fitted), arm.robot.name)
    named = {"posterior": name, "posterior_sha256": posterior_hash(posterior.encode())}
    return identified_robot_text(arm, identified, files, named), posterior


def _written_nodes(arm: Arm, identified: Identification) -> list[SensorlessNode]:
    """Nodes whose rise and time constant the robot file has as they were fitted."""
    if not isinstance(arm.heat, NodeModel):
        return []
    return [node for node in _sensorless(arm, identified) if node.is_known]


def _nodes_as_written(arm: Arm, identified: Identification) -> tuple[Array | None, Array | None]:
    """Rises (K,) [K] and time constants (K,) [s] of the nodes, as the robot file has them after identification."""
    if not isinstance(arm.heat, NodeModel):
        return None, None
    rise, tau = arm.heat.reference_rise.copy(), arm.heat.tau.copy()
    for node in _written_nodes(arm, identified):
        k = arm.nodes.index(node.name)
        rise[k], tau_h = node.written(float(rise[k]), float(tau[k]) / HOUR)
        tau[k] = tau_h * HOUR
    return rise, tau


def _sensorless(arm: Arm, identified: Identification) -> list[SensorlessNode]:
    return sensorless_nodes(identified.model, identified.selected.fit, arm.nodes)


def log_findings(arm: Arm, identified: Identification) -> list[Finding]:
    """What was fitted of nodes without a sensor in the log."""
    return sensorless_findings(_sensorless(arm, identified), isinstance(arm.heat, NodeModel))


def robot_files_of(target: Path, text: str) -> dict[str, bytes]:
    """A robot file, and the schema that its first line names where there is none beside it, by their names."""
    schema = target.parent / Path(SCHEMA_FILES["robot"]).name
    if text.startswith(f"#:schema ./{schema.name}\n") and not schema.exists():
        return {schema.name: schema_text(robot_schema()).encode(), target.name: text.encode()}
    return {target.name: text.encode()}
