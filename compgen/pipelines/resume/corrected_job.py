"""What a corrected program in pages was made from, as its provenance in the manifest has it, whole."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from compgen.core.exceptions import InputError
from compgen.core.units import HOUR, MM
from compgen.error_model.anchored_state import parse_state
from compgen.job.anchored_start import cell_with_state
from compgen.job.job import Cell
from compgen.pipelines.correct.program_file import planned_in, unpacked_program
from compgen.pipelines.correct.program_pages import CORRECTED
from compgen.pipelines.correct.result import Options, options_of
from compgen.pipelines.files.robot_file import load_cell
from compgen.pipelines.resume.written_job import WrittenJob
from compgen.planning.tables import TaughtTable
from compgen.program.extended_axes import ExtendedAxis
from compgen.program.frames import Frames, default_frames
from compgen.program.pose_table import pose_of
from compgen.program.registers import CARTESIAN, JOINT, Register
from compgen.thermal import Duty

ANEW = "correct the program anew with cgen correct"


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class CorrectedJob:
    """What a corrected program in pages was made from."""

    written: WrittenJob
    cell: Cell
    plain: Cell  # as its robot file has it, without the state that the program may begin with
    frames: Frames
    registers: Mapping[int, Register]  # when the program starts, by number
    called: Mapping[str, bytes]  # listings of programs that it calls, by name
    before: tuple[Duty, ...]
    options: Options
    planned: bytes
    corrected_sha256: str


def read_corrected(written: WrittenJob, robot: str | None = None, max_um: float | None = None) -> CorrectedJob:
    """What a folder's pages were made from.

    Args:
        written: The pages, with their program's provenance.
        robot: The robot file; default the one that was used.
        max_um: Largest error allowed after correction [um].

    Raises:
        InputError: Another robot file, or something that the provenance does not hold whole.
    """
    made, where = written.record[CORRECTED], written.manifest_file
    planned = planned_in(made)
    if planned is None:
        raise InputError(f"{where}: {CORRECTED}: the planned program in it is damaged; {ANEW}")
    try:
        overrides = [str(o) for o in made["overrides"]]
        name, checksum = str(made["robot_file"]["path"]), str(made["robot_file"]["sha256"])
        before = tuple(
            Duty(d["state"], round(d["feed_mm_s"] * MM, 12), d["duration_h"] * HOUR, d.get("duty", 1.0))
            for d in made["before"]
        )
        options, frames = _options(made["options"], max_um), _frames(made["frames"])
        called = {name: unpacked_program(text) for name, text in made.get("called_zlib_b85", {}).items()}
        registers = {int(n): _register(values) for n, values in made.get("registers", {}).items()}
        corrected_sum = str(made["corrected_sha256"])
        state_text = made["state_toml"] if "state_sha256" in made else ""
    except (KeyError, TypeError, ValueError, AttributeError):
        raise InputError(f"{where}: {CORRECTED}: not what cgen correct wrote; {ANEW}") from None
    cell = plain = load_cell(robot if robot is not None else name, overrides)
    if cell.robot_file_hash != checksum:
        raise InputError(
            f"{cell.robot_file}: this robot file is another than what made {where} (sha256 "
            f"{cell.robot_file_hash[:8]}, not {checksum[:8]}); put the old back, or {ANEW}"
        )
    if state_text:
        cell = with_state_text(plain, state_text, f"{where}: {CORRECTED}.state_toml")
    return CorrectedJob(
        written=written,
        cell=cell,
        plain=plain,
        frames=frames,
        registers=registers,
        called=called,
        before=before,
        options=options,
        planned=planned,
        corrected_sha256=corrected_sum,
    )


def _options(given: Mapping[str, Any], max_um: float | None) -> Options:
    """The options that a provenance names, with another bound."""
    starts, promise = (
        ", ".join(f"{key} = {values}" for key, values in given.get(table, {}).items()) or None
        for table in ("average_over", "guaranteed")
    )
    typed = options_of(
        split=bool(given["split"]),
        insert_um=given["insert_um"],
        strict=False,
        again=False,
        mark=given["mark"],
        max_um=max_um,
        average_over=starts,
        guaranteed=promise,
    )
    return replace(
        typed, air=float(given.get("air_K", 0.0)), reference=float(given.get("reference_degC", typed.reference))
    )


def _frames(given: Mapping[str, Any]) -> Frames:
    """What UF and UT numbers meant, as a provenance has them."""
    fixed = default_frames()
    uframe, utool = ({int(n): pose_of(row) for n, row in given[kind].items()} for kind in ("uframe", "utool"))
    return Frames(
        {**fixed.uframe, **uframe},
        {**fixed.utool, **utool},
        extended={name: _axis(axis) for name, axis in given.get("extended", {}).items()},
        taught={int(n): TaughtTable(**table) for n, table in given.get("taught", {}).items()},
    )


def with_state_text(plain: Cell, text: str, where: str) -> Cell:
    """A cell as the text of a state has it; ``where`` the text stands, for messages."""
    return cell_with_state(plain, parse_state(text.encode(), where), where)


def _axis(record: Mapping[str, Any]) -> ExtendedAxis:
    return ExtendedAxis(record["kind"], record["unit"], tuple((row[0], pose_of(row[1:])) for row in record["base"]))


def _register(values: Sequence[float | None]) -> Register:
    """As the provenance has it: six numbers that are known or not, or none of a register in joint form."""
    return Register(CARTESIAN if any(v is not None for v in values) else JOINT, tuple(values))
