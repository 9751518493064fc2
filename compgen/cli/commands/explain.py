"""The command that says what the code of a finding means, and what to do."""

import os
from collections.abc import Iterator
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated

import typer

from compgen.cli.command_frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_codes, doc_place
from compgen.cli.output_files.ownership import REPORT
from compgen.core.commands import Command
from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Code
from compgen.core.findings import printable
from compgen.core.json_text import read_record

#: what the rooms of the package find, as a user names it
ROOMS = {
    "core": "Files, as they are read",
    "planning": "The path",
    "error_model": "The error sources",
    "verification": "The verdict, and logs of a run",
    "identification": "Measurements",
    "job": "A cell and its job",
    "pipelines": "A run as a whole",
}
PAGE = "docs/findings.md"
_CLOSE = 0.5  # of the letters


def explain(
    code: Annotated[
        str,
        typer.Argument(
            autocompletion=complete_codes,
            help="A finding's code, or a report (its folder): each of its findings. Default: list all codes.",
        ),
    ] = "",
    *,
    screen: opt.Screen,
) -> Outcome:
    """Say what the code of a finding means, and what to do.

    Examples:
        cgen explain thermal.none
        cgen explain outputs/spiral_1300
        cgen explain
    """
    messages_of = _of_report(code) if os.path.exists(code) else {c: [] for c in _codes(code)}
    record = [
        {
            "code": each.value, "levels": [level.value for level in each.levels], "room": each.room,
            "meaning": each.meaning, "remedy": each.remedy, "page": f"{PAGE}#{each}", "messages": messages,
        }
        for each, messages in messages_of.items()
    ]  # fmt: skip
    lines = [line for each, messages in messages_of.items() for line in _lines(each, messages)] if code else _listed()
    return Outcome(record={"command": Command.EXPLAIN, "codes": record}, lines=lines)


def _codes(word: str) -> list[Code]:
    """The code that is meant, brackets and case aside; all of them by room where there is no word."""
    meant = word.strip(" []()'\"`:,").lower()
    codes = [code for room in ROOMS for code in sorted(Code) if code.room == room and (not word or meant == code)]
    if not codes:
        near = get_close_matches(meant, list(Code), 3, _CLOSE)
        instead = f"near: {', '.join(near)}" if near else "cgen explain lists all"
        raise InputError(f"{word!r:.60}: no finding has this code; {instead}")
    return codes


def _of_report(place: str) -> dict[Code, list[str]]:
    """The codes that a report has, each with its messages."""
    file = Path(place, REPORT) if os.path.isdir(place) else Path(place)
    findings = read_record(file).get("findings")
    from compgen.core.unique_rows import grouped

    messages_of = grouped(
        (Code(finding["code"]), f"{finding['level']}: {finding['message']}")
        for finding in (findings if isinstance(findings, list) else ())
        if isinstance(finding, dict) and {"level", "message"} < finding.keys() and finding.get("code") in list(Code)
    )
    if not messages_of:
        why = "it has no findings" if file.is_file() else "no such file"
        raise InputError(f"{file}: {why}; give a {REPORT}, its folder, or a code")
    return messages_of


def _lines(code: Code, messages: list[str]) -> Iterator[str]:
    """A code's sentences."""
    yield f"{code} ({', '.join(code.levels)}): {code.meaning}"
    yield from (f"  {printable(message)}" for message in messages)
    yield from (f"  What to do: {code.remedy}", f"  {doc_place(Path(PAGE).stem)}#{code}")


def _listed() -> Iterator[str]:
    """All codes by room, a line each."""
    widest = max(map(len, Code))
    for room, title in ROOMS.items():
        yield f"{title} ({room}/):"
        yield from (f"  {code.ljust(widest)}  {code.meaning}" for code in sorted(Code) if code.room == room)
