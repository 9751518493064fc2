"""What a command left in a folder, read again: its report, whose it is, and the tables beside it."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from compgen.core.commands import Command, command_of
from compgen.core.csv_table import CsvTable, read_csv
from compgen.core.exceptions import InputError
from compgen.core.files import read_regular
from compgen.core.json_text import read_json

SCHEMA = 1
RECORDS = ("report.json", "whatif.json", "heat.json")
#: that are compared; `check` says of a path what `generate` says
COMPARED = {
    **{c: c for c in (Command.GENERATE, Command.PREDICT, Command.CORRECT, Command.WHATIF, Command.HEAT)},
    Command.CHECK: Command.GENERATE,
}
_IN_ITS_PLACE = {
    Command.IDENTIFY: (
        "predict one path with each robot file (--robot) and compare those: every key of the files is named"
    ),
}
_MEND = "give the folder that cgen generate, predict, correct, whatif or heat wrote, or the JSON report in it"


@dataclass(frozen=True, eq=False, slots=True)
class Output:
    """A report, and the folder that it lies in."""

    name: str  # as it was typed
    kind: Command  # generate, predict, correct, whatif or heat
    record: Mapping[str, Any]
    file: Path  # the report
    is_alone: bool  # the report was given and not its folder: what is not beside it is not missed

    @property
    def folder(self) -> Path:
        """That has the tables and the program."""
        return self.file.parent

    @property
    def subject(self) -> str:
        """The job, the program or the path that it is about."""
        name = self.record.get("name") or Path(str(self.record.get("path", ""))).stem
        return str(name)[:60] if str(name).isprintable() else repr(name)[:60]

    @property
    def version(self) -> str:
        """The compgen that wrote it."""
        made = self.record.get("provenance")
        version = made.get("compgen") if isinstance(made, dict) else self.record.get("compgen")
        return str(version or "unknown")[:20]

    def table(self, name: str) -> CsvTable | None:
        """A table beside the report; None where the report was given alone and there is none.

        Raises:
            InputError: It is missing in an output's folder, or damaged.
        """
        file = self.folder / name
        if not file.is_file():
            if self.is_alone:
                return None
            raise InputError(
                f"{file}: not there, and {self.file.name} beside it is of a run that wrote it; run it anew"
            )
        return read_csv(file, most_rows=10_000_000)


def read_output(name: str) -> Output:
    """The output that a folder or a report is of.

    Raises:
        InputError: There is none, it is damaged, or of another schema.
    """
    if not name.strip() or "\0" in name:
        raise InputError(f"output {name!r}: an empty name; {_MEND}")
    file = _report_in(Path(name), name)
    try:
        record = read_json(read_regular(file))
    except OSError as failure:
        raise InputError(f"{file}: cannot be read: {failure.strerror}; {_MEND}") from None
    except ValueError as failure:
        raise InputError(f"{file}: damaged: {failure}; {_MEND}, or run the command anew") from None
    command = command_of(record) if isinstance(record, dict) else None
    if command is not None and command not in COMPARED:
        mend = _IN_ITS_PLACE.get(command, "compared are those of generate, predict, correct, whatif and heat")
        raise InputError(f"{file}: of cgen {command}, whose reports are not compared; {mend}")
    if not isinstance(record, dict) or type(record.get("schema")) is not int:
        raise InputError(f"{file}: not a report of compgen; {_MEND}")
    if record["schema"] != SCHEMA:
        raise InputError(
            f"{file}: schema {record['schema']}, and this compgen compares schema {SCHEMA}; run the command anew"
        )
    if not isinstance(record.get("provenance", {}), dict):
        raise InputError(f"{file}: damaged: its provenance is no table; run the command anew")
    if command is None:
        raise InputError(f"{file}: not a report of generate, predict, correct, whatif or heat; {_MEND}")
    return Output(name, COMPARED[command], record, file, file == Path(name))


def _report_in(place: Path, name: str) -> Path:
    """The report of a folder; what was given, where it is none."""
    try:
        is_folder = place.is_dir()
    except OSError:  # a name that no file can have: reading it says why
        is_folder = False
    if not is_folder:
        return place
    reports = [place / report for report in RECORDS if (place / report).is_file()]
    if not reports:
        raise InputError(f"{name}: no {', '.join(RECORDS[:2])} or {RECORDS[2]} in it: not an output; {_MEND}")
    if len(reports) > 1:
        names = ", ".join(report.name for report in reports)
        raise InputError(f"{name}: it holds several outputs ({names}); name the report that is meant")
    return reports[0]


def number(value: Any) -> float:
    """A number of a report; raises TypeError for what is none."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(f"{value!r} is no number")
    return float(value)


@contextmanager
def naming_damage(output: Output) -> Iterator[None]:
    """Let what is not in a report, or is of another type, be an InputError that names it."""
    try:
        yield
    except (KeyError, TypeError, AttributeError, ValueError, IndexError, OverflowError) as failure:
        what = f"no key {failure}" if isinstance(failure, KeyError) else "a value of another type"
        raise InputError(f"{output.file}: damaged: {what[:80]} where its command writes one; run it anew") from None
