"""What the measuring commands read and write: measurements, the instrument's frames, the identified robot file."""

import tomllib
from collections.abc import Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np

from compgen.core.csv_table import quote_cell
from compgen.core.exceptions import InputError
from compgen.core.files import read_regular
from compgen.core.rotations import rotation_matrix
from compgen.core.units import DEG, MM
from compgen.identification.axis_tests import read_lines
from compgen.identification.frames import InstrumentFrames
from compgen.identification.identified_robot_file import robot_text
from compgen.identification.identify import Identification
from compgen.identification.measurements import Measurements, concatenate
from compgen.identification.pose_files import read_poses
from compgen.identification.warm_up import as_warm_up, with_temperatures
from compgen.pipelines.json_schema import SCHEMA_FILES, robot_schema, schema_text
from compgen.pipelines.robot_file import Arm, arm_of


def read_measurements(
    arm: Arm, poses: Sequence[str], lines: Sequence[str], warm_up: Sequence[str], log: str | None, force: bool
) -> Measurements:
    """All measurements as one; a temperature log goes with the poses of a warm-up, or else with all poses."""
    nodes = len(arm.nodes)
    parts = [read_poses(file, arm.robot, nodes, force or len(poses) + len(warm_up) > 1) for file in poses]
    warm = [read_poses(file, arm.robot, nodes, True) for file in warm_up]
    if log is not None:
        logged = [with_temperatures(part, log, arm.nodes) for part in warm or parts]
        parts, warm = (parts, logged) if warm else (logged, [])
    elif warm:
        warm = [as_warm_up(part) for part in warm]
    return concatenate([*parts, *warm, *(read_lines(file, arm.robot, nodes) for file in lines)])


def identified_frames(arm: Arm, measurements: Measurements) -> InstrumentFrames:
    """Where the robot file says that instruments and reflectors are."""
    identified = arm.identified
    if identified is None:
        raise InputError(
            f"{arm.source}: identified: missing, it says where instrument and reflectors are; --refit-frames fits them"
        )
    unknown = next((r for r in measurements.reflectors if r not in identified.reflector_mm), None)
    if unknown is not None:
        known = ", ".join(identified.reflector_mm)
        raise InputError(
            f"{measurements.instruments[0]}: target {quote_cell(unknown, 'of a row')} is not in {arm.source} "
            f"(known: {known}); --refit-frames fits its place"
        )
    count = len(measurements.instruments)
    rotation = rotation_matrix(np.array([identified.instrument_deg]) * DEG)
    return InstrumentFrames(
        np.repeat(rotation, count, axis=0),
        np.tile(np.array(identified.instrument_mm) * MM, (count, 1)),
        np.array([identified.reflector_mm[r] for r in measurements.reflectors]) * MM,
    )


def identified_robot_text(arm: Arm, identified: Identification, files: Sequence[str]) -> str:
    """The robot file with the error sources that were identified, and the files that they are from."""
    checksums = ", ".join(f"{Path(f).name} ({sha256(read_regular(f)).hexdigest()[:12]})" for f in files)
    model = identified.selected.candidate.name
    provenance = f"{len(identified.data.theta)} poses, model '{model}', from {checksums}"
    known = [replace(k, provenance=provenance) if k.sigma else k for k in identified.known]
    text = robot_text(arm.text, arm.robot, known, identified.box, provenance[:380], identified.record())
    arm_of(tomllib.loads(text), text, arm.source)  # a file that would not load is refused here
    return text


def robot_files_of(target: Path, text: str) -> dict[str, bytes]:
    """A robot file, and the schema that its first line names where there is none beside it, by their names."""
    schema = target.parent / Path(SCHEMA_FILES["robot"]).name
    if text.startswith(f"#:schema ./{schema.name}\n") and not schema.exists():
        return {schema.name: schema_text(robot_schema()).encode(), target.name: text.encode()}
    return {target.name: text.encode()}
