"""What ``check`` and ``inspect`` leave for machines that read on.

For a CI server JUnit XML, a case for every outcome, refusals and crashes included; for code hosts and editors SARIF
2.1.0, a result for all that is found.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from compgen.core.exit_codes import ExitCode
from compgen.core.files import read_regular
from compgen.core.finding_codes import Code, Level
from compgen.core.json_text import json_text
from compgen.core.version import __version__

SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"
LEVELS = {Level.OUTSIDE: "error", Level.REFUSED: "error", Level.WARNING: "warning", Level.NOTE: "note"}
_NOT_XML = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")  # no reader takes them, escaped or not


@dataclass(frozen=True, slots=True)
class JudgedPath:
    """What became of one path file."""

    path: str
    code: int | None  # the exit code it would have alone; None: it was not begun
    seconds: float
    summary: dict[str, Any] | None = None  # of a path that was judged
    message: str = ""  # why it is not inside

    @property
    def name(self) -> str:
        """The path's own name."""
        return re.sub(r"^.*[/\\]|\.toml$", "", self.path)

    def broken(self) -> dict[str, str]:
        """Code to message of what puts it outside."""
        findings = self.summary["findings"] if self.summary is not None else []
        return {f["code"]: f["message"] for f in findings if f["level"] == Level.OUTSIDE}


def junit_xml(outcomes: Sequence[JudgedPath]) -> bytes:
    """Of one path a suite with a case for each bound; of several a suite with a case for each path.

    Args:
        outcomes: In the order of the paths.
    """
    if len(outcomes) == 1:
        root = _bounds_suite(outcomes[0])
    else:
        suite = Element("testsuite", name="cgen check")
        for outcome in outcomes:
            _fill(_case(suite, f"compgen.{outcome.name}", outcome.path, outcome.seconds), outcome)
        root = Element("testsuites", name="cgen check")
        root.append(_counted(suite))
        for key in ("tests", "failures", "errors", "skipped", "time"):
            root.set(key, suite.attrib[key])
    ElementTree.indent(root)
    return bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)) + b"\n"


def _bounds_suite(outcome: JudgedPath) -> Element:
    """A case for each bound, failed by its finding; the band as properties and in words."""
    summary, name = outcome.summary, f"compgen.{outcome.name}"
    suite = Element("testsuite", name=_text(name))
    if summary is None:
        _fill(_case(suite, name, "check", outcome.seconds), outcome)
        return _counted(suite)
    from compgen.report.band_words import headline, unknown_words

    broken = outcome.broken()
    keys = [f"bounds.{key}" for key in summary["bounds"]]
    keys += [f"bounds.guaranteed.{key}" for key in (summary.get("guaranteed") or {"bounds": {}})["bounds"]]
    keys += [code for code in broken if code not in keys]
    properties = SubElement(suite, "properties")
    band = {"band.p95_um": f"{summary['band']['p95_um']:g}", "band.not_known": unknown_words(summary["band"])}
    for key, value in band.items():
        SubElement(properties, "property", name=key, value=_text(value))
    for key in keys:
        case = _case(suite, name, key, outcome.seconds / len(keys))
        if key in broken:
            SubElement(case, "failure", type="outside", message=_text(broken[key]))
    SubElement(suite, "system-out").text = _text(headline(summary))
    return _counted(suite)


def _fill(case: Element, outcome: JudgedPath) -> None:
    """What a path's case says."""
    if outcome.code is None:
        SubElement(case, "skipped", message="not begun")
    elif outcome.code == ExitCode.OUTSIDE:
        kind = "outside" if outcome.summary is None else outcome.summary["verdict"]
        failure = SubElement(case, "failure", type=kind, message=_text(outcome.message))
        failure.text = _text("\n".join(f"{code}: {message}" for code, message in outcome.broken().items()))
    elif outcome.code:
        error = SubElement(case, "error", type=ExitCode(outcome.code).kind, message=_text(outcome.message))
        error.text = f"exit code {outcome.code}"
    if outcome.summary is not None:
        from compgen.report.band_words import headline

        SubElement(case, "system-out").text = _text(headline(outcome.summary))


def _case(suite: Element, classname: str, name: str, seconds: float) -> Element:
    return SubElement(suite, "testcase", classname=_text(classname), name=_text(name), time=f"{seconds:.3f}")


def _counted(suite: Element) -> Element:
    """A suite that says how many cases it has, and how they ended."""
    cases = suite.findall("testcase")
    suite.set("tests", str(len(cases)))
    for key, tag in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
        suite.set(key, str(sum(case.find(tag) is not None for case in cases)))
    suite.set("time", f"{sum(float(case.attrib['time']) for case in cases):.3f}")
    return suite


def _text(text: str) -> str:
    """A text that XML can carry."""
    return _NOT_XML.sub(lambda c: c[0].encode("unicode_escape", "surrogatepass").decode(), text)


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
