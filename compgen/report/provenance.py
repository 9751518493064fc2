"""What a corrected program was made from, and the way back to the planned program."""

import json
from hashlib import sha256
from typing import Any

from compgen.core.commands import Command
from compgen.core.exceptions import InputError
from compgen.core.json_text import json_text
from compgen.core.pose import Pose
from compgen.core.rotations import to_wpr
from compgen.core.units import DEG, HOUR, MM, UM
from compgen.core.version import __version__
from compgen.error_model.anchored_state import AnchoredState, state_text
from compgen.job.tables import words_of_guarantee
from compgen.pipelines.correct import Correction, Options
from compgen.pipelines.correct.program_file import packed_program, planned_in
from compgen.report.many_starts import starts_record
from compgen.thermal import Duty

SCHEMA = 1
KIND = "compgen correction"
FRAMES = ("uframe", "utool")


def provenance(result: Correction) -> dict[str, Any]:
    """Program, robot, history, options and checksums of a correction, in plain types."""
    options = result.options
    return {
        "compgen": __version__,
        "program": result.name,
        "robot": result.cell.robot.name,
        "robot_sha256": result.cell.inputs_hash,
        "robot_file": {"path": result.cell.robot_file, "sha256": result.cell.robot_file_hash},
        "overrides": list(result.cell.overrides),
        **_context(result),
        "before": [stretch_record(duty) for duty in result.before],
        **_state(result.cell.state),
        "start_K": dict(zip(result.cell.heat.names, result.plan.stations.start.tolist(), strict=True)),
        "options": {
            "split": options.split,
            "insert_um": None if options.insert is None else round(options.insert / UM, 9),
            "mark": "remark" if options.remark else "digits",
            **({} if options.ensemble is None else {"average_over": starts_record(options.ensemble)}),
            **({} if not options.air else {"air_K": options.air}),
            **({} if options.reference == Options().reference else {"reference_degC": options.reference}),
            **({} if options.guaranteed is None else {"guaranteed": words_of_guarantee(options.guaranteed)}),
        },
        "planned_sha256": sha256(result.planned).hexdigest(),
        "corrected_sha256": sha256(result.text).hexdigest(),
    }


def inputs_record(result: Correction) -> dict[str, Any]:
    """Every key of the robot file that a correction used, and all that was given beside it."""
    made, options = provenance(result), result.options
    given = {key: made[key] for key in ("frames", "registers", "called", "before", "options")}
    if options.bound is not None:
        given["options"]["max_um"] = round(options.bound / UM, 9)
    if options.raised:
        given["options"]["lift_all_mm"] = round(options.raised / MM, 9)
    state = {} if result.cell.state is None else {"state": {"sha256": made["state_sha256"]}}
    program = {"file": result.name, "sha256": made["planned_sha256"]}
    return {"program": program, **given, **state, "robot": dict(result.cell.inputs)}


def _state(state: AnchoredState | None) -> dict[str, str]:
    """The state that the robot began with, whole: the pages of the program are resumed from it."""
    return {} if state is None else {"state_sha256": state.digest, "state_toml": state_text(state)}


def _context(result: Correction) -> dict[str, Any]:
    """Frames, registers and called programs that were given, by number and name."""
    frames, registers, called = result.around.frames, result.around.registers, result.around.called
    taught = {str(n): table.model_dump() for n, table in frames.taught.items()}
    written = [f"{kind}[{'R' if n is None else n}]" for kind, n in called.frames]
    known = {"motionless": called.motionless, "settled": called.settled, "writes": written}
    return {
        "frames": {
            **{kind: {str(n): _xyzwpr(pose) for n, pose in getattr(frames, kind).items() if n} for kind in FRAMES},
            "extended": {
                name: {
                    "kind": axis.kind,
                    "unit": axis.unit,
                    "base": [[at, *_xyzwpr(pose)] for at, pose in axis.base],
                }
                for name, axis in frames.extended.items()
            },
            **({"taught": taught} if taught else {}),
        },
        "registers": {str(n): list(register.values) for n, register in registers.items()},
        "called": {key: sorted(names) for key, names in known.items()},
    }


def stretch_record(duty: Duty) -> dict[str, Any]:
    """What went before, as a path file says it."""
    rest = {"duty": duty.share} if duty.share != 1 else {}
    return {
        "state": duty.state,
        "feed_mm_s": round(duty.feed / MM, 9),
        "duration_h": round(duty.duration / HOUR, 9),
        **rest,
    }


def _xyzwpr(pose: Pose) -> list[float]:
    """X, Y, Z [mm] and W, P, R [deg]."""
    angles = (float(a) / DEG for a in to_wpr(pose.rotation))
    return [round(v, 9) for v in (*(pose.position / MM).tolist(), *angles)]


def provenance_json(result: Correction) -> bytes:
    """What a corrected program was made from, with the planned program, which ``restore_planned`` gives back."""
    data = {
        "kind": KIND,
        "schema": SCHEMA,
        "command": Command.CORRECT,
        **provenance(result),
        "planned_zlib_b85": packed_program(result.planned),
        "called_zlib_b85": {name: packed_program(listing) for name, listing in result.around.called.listings},
    }
    return json_text(data)


def restore_planned(content: bytes, corrected: bytes, file: str) -> bytes:
    """The planned program that a corrected one was made from.

    Args:
        content: The file that ``provenance_json`` wrote.
        corrected: The corrected program.
        file: The provenance file's name, for messages.

    Raises:
        InputError: Not a provenance file, not this program's, or damaged.
    """
    try:
        data = json.loads(content)
        corrected_sum = data["corrected_sha256"]
        if data["kind"] != KIND or not {"planned_zlib_b85", "planned_sha256"} <= data.keys():
            raise KeyError("kind")
    except (ValueError, KeyError, TypeError, RecursionError):
        raise InputError(f"{file}: not what compgen wrote beside a corrected program") from None
    if sha256(corrected).hexdigest() != corrected_sum:
        raise InputError(
            f"{file}: it belongs to another program, or the program was edited since; give the one written"
        )
    planned = planned_in(data)
    if planned is None:
        raise InputError(f"{file}: the planned program in it is damaged; take it from a backup")
    return planned
