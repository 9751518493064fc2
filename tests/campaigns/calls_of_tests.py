"""Which functions of the library each test calls, and how long it takes: what a change of one function needs to meet.

python tests/campaigns/calls_of_tests.py [pytest's arguments]     adds to calls_of_tests.jsonl; again goes on

Calls are those in the test's own process. What a test's file calls while it prepares its fixtures counts for each of
its tests.
"""

import json
import os
import sys
import threading
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
JOURNAL = Path(__file__).with_suffix(".jsonl")
A_FILE_S = 40.0  # what the tests of one file may take; the others of it are left out
LIBRARY = str(ROOT / "compgen") + "/"
Function = tuple[str, int]  # file, first line


class Recorder:
    """A pytest plugin that notes the calls of every test that passes."""

    def __init__(self, done: set[str]) -> None:
        self._done = done
        self._seen: dict[int, CodeType] = {}
        self._row: dict[str, Any] = {}
        self._spent: dict[str, float] = defaultdict(float)

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        items[:] = [item for item in items if item.nodeid not in self._done]

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        self._row = {"test": item.nodeid, "passed": True}
        start = cpu_seconds()
        result = yield
        self._spent[item.location[0]] += cpu_seconds() - start
        with JOURNAL.open("a") as file:
            file.write(json.dumps(self._row) + "\n")
        return result

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self._row["passed"] &= report.outcome != "failed"

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_setup(self) -> Iterator[None]:
        return (yield from self._traced("setup"))

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self) -> Iterator[None]:
        return (yield from self._traced("call"))

    def _traced(self, phase: str) -> Iterator[None]:
        if self._spent[self._row["test"].split("::")[0]] > A_FILE_S:
            pytest.skip("its file has had its time")
        self._seen, start = {}, cpu_seconds()
        sys.settrace(self._note)
        threading.settrace(self._note)
        try:
            return (yield)
        finally:
            sys.settrace(None)
            threading.settrace(None)
            codes = [c for c in self._seen.values() if c.co_filename.startswith(LIBRARY)]
            self._row[phase] = sorted({f"{c.co_filename[len(LIBRARY) - 8 :]}:{c.co_firstlineno}" for c in codes})
            self._row[f"{phase}_s"] = round(cpu_seconds() - start, 3)

    def _note(self, frame: FrameType, event: str, argument: object) -> None:
        self._seen.setdefault(id(frame.f_code), frame.f_code)


def cpu_seconds() -> float:
    """Of this process and of those it has waited for."""
    return sum(os.times()[:4])


@dataclass
class Calls:
    """What was recorded."""

    seconds: dict[str, float] = field(default_factory=dict)  # a test alone, with its file's fixtures
    tests_of: dict[Function, set[str]] = field(default_factory=lambda: defaultdict(set))

    def of_file(self, file: str) -> set[str]:
        """Tests that call anything in a file."""
        return {test for (name, _), tests in self.tests_of.items() if name == file for test in tests}


def read() -> Calls:
    """The tests that pass, and what they call."""
    rows = [json.loads(line) for line in JOURNAL.read_text().splitlines()]
    prepared: dict[str, tuple[float, set[str]]] = defaultdict(lambda: (0.0, set()))
    for row in rows:
        file = row["test"].split("::")[0]
        longest, functions = prepared[file]
        prepared[file] = (max(longest, row.get("setup_s", 0.0)), functions | set(row.get("setup", ())))
    calls = Calls()
    for row in rows:
        if row["passed"] and "call" in row:
            longest, functions = prepared[row["test"].split("::")[0]]
            calls.seconds[row["test"]] = row["call_s"] + longest
            for function in functions | set(row["call"]):
                name, _, line = function.rpartition(":")
                calls.tests_of[name, int(line)].add(row["test"])
    return calls


def main() -> int:
    done = {json.loads(line)["test"] for line in JOURNAL.read_text().splitlines()} if JOURNAL.exists() else set()
    return pytest.main(["-p", "no:cacheprovider", "--tb=no", *sys.argv[1:]], plugins=[Recorder(done)])


if __name__ == "__main__":
    sys.exit(main())
