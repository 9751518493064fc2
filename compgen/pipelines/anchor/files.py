"""From files to an anchoring: the path with its history or a log, the touches, and what was touched."""

import os
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path

from compgen.core.exceptions import InputError
from compgen.core.toml import toml_value
from compgen.identification.touches import read_artefact, read_touches
from compgen.pipelines.anchor.anchor import anchor
from compgen.pipelines.anchor.result import Anchored
from compgen.pipelines.anchor.touch_model import frame_of_artefact
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.measure.identification_files import artefact_of_touches


def anchor_files(  # noqa: PLR0913 - the files that one command names
    path: str,
    robot: str | None,
    overrides: Sequence[str],
    touches: str,
    artefact: str | None,
    log: str | None = None,
    reference: str | None = None,
    frames: str | None = None,
) -> Anchored:
    """The state of a path's robot.

    Args:
        path: A path file.
        robot: Name or file; None: what the path file says.
        overrides: ``key=value`` of both files.
        touches: CSV.
        artefact: TOML; None: ``artefact.toml`` beside the touches.
        log: Temperature log on the touches' clock, in place of [[before]].
        reference: What its rises count from: "start", "ambient" or degC; None: as the path file has it.
        frames: Where user frames are.

    Raises:
        InputError: Anything wrong, naming file and line or key.
        ImpossibleError: The robot cannot drive the path.
    """
    job = load_job(path, robot, [*overrides, *log_overrides(path, log, reference)])
    artefact = artefact_of_touches(touches, artefact)
    known = read_artefact(artefact)
    number, frame = frame_of_artefact(known, job.frame, frames)
    seen = read_touches(touches, job.robot, known, {number: frame}, planes=True)
    files = {"path": path, "touches": touches, "artefact": artefact, "log": log}
    made_from = {name: sha256(Path(file).read_bytes()).hexdigest() for name, file in files.items() if file is not None}
    return anchor(job, known, seen, frame, made_from)


def log_overrides(path: str, log: str | None, reference: str | None) -> list[str]:
    """A temperature log in place of a path file's [[before]], as overrides ``key=value``.

    Args:
        path: The path file, whose folder the key counts from.
        log: Its file; None: there is none.
        reference: What its rises count from: "start", "ambient" or degC; None: as the path file has it.

    Raises:
        InputError: A log that is not there, or a reference without a log, or that is none.
    """
    if log is None:
        if reference is not None:
            raise InputError(f"--reference {reference}: is of a log; give it with --log")
        return []
    if not os.path.exists(log):
        raise InputError(f"--log {log}: no such file; give a temperature log")
    file = os.path.relpath(log, Path(path).parent)
    given = ["before=[]", f"log.file={toml_value(file)}"]
    return given if reference is None else [*given, f"log.reference={_reference(reference)}"]


def _reference(text: str) -> str:
    if text in ("start", "ambient"):
        return toml_value(text)
    try:
        return repr(float(text))
    except ValueError:
        raise InputError(f"--reference {text!r:.40}: must be start, ambient or a temperature in degC") from None
