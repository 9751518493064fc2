"""What ``check`` and ``inspect`` leave for code hosts and editors: SARIF 2.1.0, a result for all that is found."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

from compgen.cli.screen.junit import JudgedPath
from compgen.core.codes import Code, Level
from compgen.core.exit_codes import ExitCode
from compgen.core.files import read_regular
from compgen.core.json_text import json_text
from compgen.core.toml import line_of_key
from compgen.core.version import __version__

SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"
LEVELS = {Level.OUTSIDE: "error", Level.REFUSED: "error", Level.WARNING: "warning", Level.NOTE: "note"}


class _Result(NamedTuple):
    rule: str  # a finding's code; of a file that was refused its exit code in words
    level: str
    message: str
    line: int  # of the file, from 1


def sarif_text(judged: Sequence[JudgedPath]) -> bytes:
    """One run: a result for each finding, unsafe statement and refusal, in the order of the files.

    Args:
        judged: Files, with what became of them.
    """
    found = [(one.path, result) for one in judged for result in _results(one)]
    rules = sorted({result.rule for _, result in found})
    driver = {"name": "compgen", "version": __version__, "rules": [_rule(rule) for rule in rules]}
    ended = all(one.code is not None and one.code < ExitCode.CRASHED for one in judged)
    run = {
        "tool": {"driver": driver},
        "invocations": [{"executionSuccessful": ended}],
        "columnKind": "utf16CodeUnits",
        "results": [_record(path, result, rules) for path, result in found],
    }
    return json_text({"$schema": SCHEMA, "version": "2.1.0", "runs": [run]})


def _results(one: JudgedPath) -> Iterator[_Result]:
    summary = one.summary
    if summary is None:
        if one.code is not None:
            yield _Result(ExitCode(one.code).kind.replace(" ", "-"), "error", one.message, _line_said(one))
        return
    for finding in summary.get("findings", ()):
        level, code = LEVELS[Level(finding["level"])], finding["code"]
        yield _Result(code, level, finding["message"], line_of_key(_content(one.path), code))
    for unsafe in summary.get("unsafe", ()):
        level = LEVELS[Code.CORRECTION_UNSAFE.levels[0]]
        yield _Result(Code.CORRECTION_UNSAFE.value, level, f"{unsafe['text']}: {unsafe['reason']}", unsafe["line"])


def _line_said(one: JudgedPath) -> int:
    """The line that a refusal names, or that has the key which it names."""
    behind = one.message.removeprefix(f"{one.path}: ")
    stated = re.search(r"\bline (\d+)", behind)
    return int(stated[1]) if stated else line_of_key(_content(one.path), behind.partition(":")[0])


def _content(path: str) -> str:
    try:
        return read_regular(path).decode(errors="replace")
    except (OSError, ValueError):
        return ""


def _rule(rule: str) -> dict[str, Any]:
    """What a code means, and what to do."""
    if rule not in list(Code):
        return {"id": rule}
    code = Code(rule)
    return {"id": rule, "shortDescription": {"text": code.meaning}, "help": {"text": code.remedy}}


def _record(path: str, result: _Result, rules: list[str]) -> dict[str, Any]:
    place = Path(path).as_uri() if Path(path).is_absolute() else quote(Path(path).as_posix())
    where = {"artifactLocation": {"uri": place}, "region": {"startLine": max(result.line, 1)}}
    head = {"ruleId": result.rule, "ruleIndex": rules.index(result.rule), "level": result.level}
    return {**head, "message": {"text": result.message}, "locations": [{"physicalLocation": where}]}
