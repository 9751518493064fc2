"""A program that exists, in a notebook: read, corrected in place, written."""

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from compgen.core.arrays import Array, BoolArray, frozen
from compgen.core.exceptions import RESULT, InputError, naming_file, refuse_changes
from compgen.core.findings import Finding
from compgen.core.stages import Progress
from compgen.core.toml import brief_value
from compgen.fanuc import LsProgram
from compgen.pipelines import correct as pipeline
from compgen.pipelines.correct import Correction
from compgen.pipelines.correct.program_file import (
    cell_of_program,
    programs_beside,
    read_frames,
    read_registers,
    refuse_corrected,
)
from compgen.pipelines.correct.program_file import read_program as read_bytes
from compgen.pipelines.correct.result import options_of
from compgen.pipelines.files.program_course import listing_of
from compgen.report.correction import (
    FIGURES,
    correction_columns,
    correction_figures,
    correction_files,
    correction_summary,
)
from compgen.report.notebook.arguments import (
    STATE,
    File,
    Overrides,
    assignments,
    file_name,
    file_names,
    instance,
    number,
    optional_name,
    progress_of,
    text_of,
    value_of,
)
from compgen.report.notebook.machine import data_frame, log_result, numpy_alone, plotly_figure
from compgen.verification.verdict import Verdict

PROGRAM = "a program listing, as 'PART.LS'"


def read_program(file: File) -> LsProgram:
    """Read a FANUC program listing, anyone's, without loss.

    Args:
        file: An .LS file.

    Returns:
        The program: ``name``, ``attributes``, ``motions``, ``positions.number`` (G,) and ``positions.value`` (G, 18)
        as the file has them, in mm and degrees; ``data`` are its bytes.

    Raises:
        InputError: It cannot be read, or is no program listing.
    """
    name = file_name(file, "file", PROGRAM)
    return listing_of(read_bytes(name), name)


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class CorrectedProgram:
    """A program that existed, corrected in place, with its proof: M places at which the twin rode its text."""

    file: str  # the program's
    result: Correction  # the whole result, for who needs more
    report: dict[str, Any]  # as report.json has it

    @property
    def text(self) -> bytes:
        """The corrected program."""
        return self.result.text

    @property
    def verdict(self) -> Verdict:
        """What the findings come to."""
        return self.result.verdict

    @property
    def inside(self) -> bool:
        """Whether a bound was given and is kept, and the controller can load the program."""
        return self.result.inside

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What a user must know."""
        return self.result.findings

    @property
    def time(self) -> Array:
        """When the corrected text is at each place, (M,) [s]."""
        return frozen(self.result.execution.time)

    @property
    def error(self) -> Array:
        """Distance of the TCP from its target without correction, (M,) [m]."""
        return frozen(self.result.error.distance)

    @property
    def error_after(self) -> Array:
        """Distance of the TCP from its target with the corrected text, (M,) [m]."""
        return frozen(self.result.residual.distance)

    @property
    def judged(self) -> BoolArray:
        """Whether a place lies at or between corrected positions, (M,)."""
        return frozen(self.result.judged)

    def to_dataframe(self) -> Any:
        """The table of ``positions.csv`` with all digits, as a pandas DataFrame: a row a station.

        Raises:
            InputError: pandas is not installed.
        """
        return data_frame(correction_columns(self.result))

    def plot(self, which: str = "time") -> Any:
        """A plotly Figure: the error over ``time``, the program in ``space``, or the ``heat``.

        Raises:
            InputError: No such figure, or the program has no motion to show.
        """
        figures = correction_figures(self.result) if len(self.time) else {}
        return plotly_figure(figures, FIGURES, which)

    def files(self, *, force: bool = False) -> dict[str, bytes]:
        """Name to content of what ``cgen correct`` writes, byte for byte; nothing is written.

        Args:
            force: Give the program also outside its bounds.
        """
        return correction_files(self.result, Path(self.file).name, with_program=self.result.is_usable or force)

    def __repr__(self) -> str:
        return f"<CorrectedProgram {self.result.name}: {self.result.changed} positions corrected, {self.verdict}>"


refuse_changes(CorrectedProgram, *RESULT)
AnyProgram = LsProgram | CorrectedProgram | bytes


def correct(
    program: File | bytes | LsProgram,
    robot: File | None = None,
    frames: File | None = None,
    registers: File | None = None,
    before: str | Sequence[str] = (),
    max_um: float | None = None,
    *,
    split: bool = False,
    insert_um: float | None = None,
    strict: bool = False,
    again: bool = False,
    mark: str = "digits",
    overrides: Overrides | None = None,
    progress: Progress | None = None,
    average_over: Mapping[str, Any] | str | None = None,
    guaranteed: Mapping[str, Any] | str | None = None,
    state: File | None = None,
    state_age: str | None = None,
) -> CorrectedProgram:
    """Correct a program that exists: only the numbers of its positions change; the same as ``cgen correct``.

    Args:
        program: Its file, its bytes, or what ``read_program`` returns. Programs that it calls are looked for beside
            its file.
        robot: Name or file of a robot; needed unless the program names its robot.
        frames: A frames table (.toml) or SYSFRAME.VA.
        registers: Position registers at the start: a table (.toml) or POSREG.VA.
        before: What the cell did before, as ``"moving 200mm/s 5h"``, ``"idle 30min"`` or a .toml file; one or several.
        max_um: Largest error allowed after correction [um].
        split: Whether positions whose uses need different corrections are parted.
        insert_um: Points go into straight lines that deviate by more [um].
        strict: Whether a program with unsafe statements is refused.
        again: Whether a program that is corrected already is taken.
        mark: ``digits``, or ``remark``: a remark line where the digits cannot carry the mark.
        overrides: Keys of the robot file and their values.
        progress: Called with the stage and the share of it that is done, 0 to 1; what it raises ends the run.
        average_over: One file for many starts, as ``{"delay_s": [0, 1200], "override_percent": [50, 100]}``.
        guaranteed: Bounds with a probability, as ``{"max_um": 60, "share": 0.95}``.
        state: What ``cgen anchor`` wrote, in place of ``before``.
        state_age: How long before the start that was, as ``"20min"``.

    Raises:
        InputError: An argument is wrong, a frame is not known, the program carries compgen's mark.
        TwinError: The proof cannot be made.
    """
    for flag, value in (("split", split), ("strict", strict), ("again", again)):
        instance(value, bool, flag, "give True or False")
    options = options_of(
        split=split,
        insert_um=None if insert_um is None else number(insert_um, "insert_um"),
        strict=strict,
        again=again,
        mark=text_of(mark, "mark", "give digits or remark"),
        max_um=None if max_um is None else number(max_um, "max_um"),
        average_over=_typed(average_over, "average_over", "give a dict, as {'delay_s': [0, 1200]}"),
        guaranteed=_typed(guaranteed, "guaranteed", "give a dict, as {'max_um': 60}"),
    )
    report_progress = progress_of(progress)
    file, content = _listing(program)
    robot_name = optional_name(robot, "robot", "a robot's name, as 'm710ic50', or its file")
    frames_file = optional_name(frames, "frames", "a frames table (.toml) or SYSFRAME.VA")
    register_file = optional_name(registers, "registers", "a table of position registers (.toml) or POSREG.VA")
    history_words = file_names(before, "before", "a history, as 'moving 200mm/s 5h', or a .toml file")
    if file is not None and not again:
        refuse_corrected(Path(file), content)
    of_state = optional_name(state, "state", STATE), optional_name(state_age, "state_age", "a time, as '20min'")
    cell, history, air, reference = cell_of_program(
        content, file, robot_name, assignments(overrides), history_words, *of_state
    )
    with nullcontext() if file is None else naming_file(file), numpy_alone():
        result = pipeline.correct(
            content,
            cell,
            read_frames(frames_file),
            before=history,
            options=replace(options, air=air, reference=reference),
            progress=report_progress,
            find_program=programs_beside(Path(file)) if file is not None else lambda name: None,
            registers=read_registers(register_file),
        )
    corrected = CorrectedProgram(file or f"{result.name}.LS", result, correction_summary(result))
    log_result(result.name, corrected)
    return corrected


def _typed(table: object, key: str, mend: str) -> str | None:
    """The keys of a table as the command line takes them; None where there is none."""
    if table is None:
        return None
    return value_of(table, key) if isinstance(table, Mapping) else text_of(table, key, mend)


def _listing(program: object) -> tuple[str | None, bytes]:
    """The file of a program, if it has one, and its bytes."""
    content = bytes_of(program)
    if content is not None:
        return None, content
    if isinstance(program, str) and "\n" in program:
        raise InputError(f"program: {brief_value(program)}: a listing as text; give its bytes, or its file's name")
    name = file_name(program, "program", PROGRAM)
    return name, read_bytes(name)


def bytes_of(program: object) -> bytes | None:
    """The bytes of a program that has been read or corrected; None for a file's name, or what is none."""
    if isinstance(program, LsProgram):
        return program.source
    if isinstance(program, CorrectedProgram):
        return program.text
    return program if isinstance(program, bytes) else None
