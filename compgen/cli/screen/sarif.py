"""What ``check`` and ``inspect`` leave for code hosts and editors: SARIF 2.1.0, a result for all that is found."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

from compgen.cli.screen.junit import JudgedPath
from compgen.core.exit_codes import ExitCode
from compgen.core.files import read_regular
from compgen.core.finding_codes import Code, Level
from compgen.core.json_text import json_text
from compgen.core.version import __version__

SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"
LEVELS = {Level.OUTSIDE: "error", Level.REFUSED: "error", Level.WARNING: "warning", Level.NOTE: "note"}


def sarif_text(judged: Sequence[JudgedPath]) -> bytes:
    """One run: a result for each finding, unsafe statement and refusal, in the order of the files.

    Args:
        judged: Files, with what became of them.
    """
    results = [result for one in judged for result in _results(one)]
    rules = [_rule(rule) for rule in sorted({result["ruleId"] for result in results})]
    run = {
        "tool": {"driver": {"name": "compgen", "version": __version__, "rules": rules}},
        "invocations": [{"executionSuccessful": all((one.code or 0) < ExitCode.CRASHED for one in judged)}],
        "columnKind": "utf16CodeUnits",
        "results": results,
    }
    return json_text({"$schema": SCHEMA, "version": "2.1.0", "runs": [run]})


def _results(one: JudgedPath) -> Iterator[dict[str, Any]]:
    summary = one.summary or {}
    if one.summary is None and one.code is not None:
        behind = one.message.removeprefix(f"{one.path}: ")
        stated = re.search(r"\bline (\d+)", behind)
        line = int(stated[1]) if stated else _line(one.path, behind.partition(":")[0])
        yield _result(one.path, line, ExitCode(one.code).kind.replace(" ", "-"), "error", one.message)
    for finding in summary.get("findings", ()):
        code, level = finding["code"], LEVELS[Level(finding["level"])]
        yield _result(one.path, _line(one.path, code), code, level, finding["message"])
    for unsafe in summary.get("unsafe", ()):
        words = f"{unsafe['text']}: {unsafe['reason']}"
        yield _result(one.path, unsafe["line"], Code.CORRECTION_UNSAFE.value, LEVELS[Level.WARNING], words)


def _line(path: str, key: str) -> int:
    """Where a path file has the key that a code or a refusal names, or its table."""
    from compgen.core.toml import line_of_key  # pydantic is loaded by commands that read a table

    try:
        return line_of_key(read_regular(path).decode(errors="replace"), key)
    except (OSError, ValueError):
        return 1


def _rule(rule: str) -> dict[str, Any]:
    """What a code means and what to do; of a refusal its exit code in words."""
    return {"id": rule} | {
        key: {"text": text}
        for code in Code
        if code == rule
        for key, text in (("shortDescription", code.meaning), ("help", code.remedy))
    }


def _result(path: str, line: int, rule: str, level: str, message: str) -> dict[str, Any]:
    place = Path(path).as_uri() if Path(path).is_absolute() else quote(Path(path).as_posix())
    where = {"artifactLocation": {"uri": place}, "region": {"startLine": max(line, 1)}}
    return dict(ruleId=rule, level=level, message={"text": message}, locations=[{"physicalLocation": where}])
