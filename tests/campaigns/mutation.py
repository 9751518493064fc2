"""One-line changes of the library, and whether a test notices: what passes every test is a hole in the tests.

python tests/campaigns/calls_of_tests.py                    once: which functions each test calls
python tests/campaigns/mutation.py --seeds 0:300            draws, tries and adds to mutation.jsonl; again goes on
python tests/campaigns/mutation.py --seeds 0:300 --room fanuc   draws in one room; its own journal wants --journal
python tests/campaigns/mutation.py --seeds 0:300 --wide     survivors meet all tests of their room in a changed tree
python tests/campaigns/mutation.py --seeds 0:300 --table    only the table of what is in mutation.jsonl

A seed draws one place of the library (operator, comparison, constant, condition or returned value outside cli, report,
tables and messages). All tests are loaded once; a change inside a function is made in a forked process, by its code
alone, and the tests that call the function run there, the quickest first, until one fails. A change at a module's level
is made in a copy of the tree. equivalent.toml lists the changes that cannot be noticed, each with its reason,
and the files of those that nobody has read yet.
"""

import gc
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import asdict
from itertools import chain
from pathlib import Path
from types import CodeType, FunctionType

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(Path(__file__).parent)]

import calls_of_tests  # noqa: E402
import seed_journal  # noqa: E402
from calls_of_tests import Calls  # noqa: E402
from code_mutants import Mutant, changed, functions_around, library  # noqa: E402
from seed_journal import Journal  # noqa: E402

EQUIVALENT = Path(__file__).with_name("equivalent.toml")
MOST_S = 150.0  # of tests of one change, as they take without it
ALWAYS_S = 60  # beside ten times what the tests take without the change
SLOWER = 10
CLOCK = 10  # how much longer a run may take by the clock: the machine does other things too
QUIET = ["--no-header", "--tb=no", "-p", "no:cacheprovider"]


def mutant_of(seed: int, pool: list[Mutant]) -> Mutant:
    return random.Random(seed).choice(pool)


def tests_of(mutant: Mutant, calls: Calls) -> list[str]:
    """Tests to run, the quickest first, as many as there is time for."""
    around = functions_around(mutant)
    tests = calls.tests_of.get((mutant.file, around[-1]), set()) if around else calls.of_file(mutant.file)
    chosen, total = list[str](), 0.0
    for test in sorted(tests, key=lambda t: (calls.seconds[t], t)):
        total += calls.seconds[test]
        if total > MOST_S and chosen:
            break
        chosen.append(test)
    return chosen


# In a forked process ---------------------------------------------------------------------------------------------


class Forks:
    """A pytest plugin that runs, instead of all tests, those of each change in a process of its own."""

    def __init__(self, seeds: Iterable[int], pool: list[Mutant], calls: Calls, journal: Journal) -> None:
        self._seeds, self._pool, self._calls, self._journal = seeds, pool, calls, journal
        self._pipe = -1

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        items = {item.nodeid: item for item in session.items}
        for seed in self._seeds:
            mutant = mutant_of(seed, self._pool)
            tests = [t for t in tests_of(mutant, self._calls) if t in items]
            function = functions_around(mutant)
            start = time.monotonic()
            result, test = self._tried(mutant, function[0], [items[t] for t in tests]) if function else in_a_tree(
                mutant, tests, self._seconds(tests)
            )  # fmt: skip
            row = {"seed": seed, "wide": False, "result": result, "test": test, "tests": len(tests), **asdict(mutant)}
            self._journal.add(row | {"seconds": round(time.monotonic() - start, 1)})
            print(f"\n{seed} {result} {mutant.file}:{mutant.line} {mutant.before} -> {mutant.after} {test}", flush=True)
        return True

    def _seconds(self, tests: list[str]) -> float:
        return ALWAYS_S + SLOWER * sum(self._calls.seconds[t] for t in tests)

    def _tried(self, mutant: Mutant, first_line: int, items: list[pytest.Item]) -> tuple[str, str]:
        """``caught`` and the test, ``timed out``, or ``survived``."""
        limit = self._seconds([item.nodeid for item in items])
        reading, self._pipe = os.pipe()
        child = os.fork()
        if not child:
            try:
                os.setpgid(0, 0)
                os.close(reading)
                nothing = os.open(os.devnull, os.O_WRONLY)
                os.dup2(nothing, 1)
                os.dup2(nothing, 2)
                resource.setrlimit(resource.RLIMIT_CPU, (int(limit), int(limit) + 5))
                replace_code(mutant, first_line)
                for n, item in enumerate(items):
                    after = items[n + 1] if n + 1 < len(items) else None
                    item.config.hook.pytest_runtest_protocol(item=item, nextitem=after)
                self._leave("survived")
            except BaseException as failure:
                self._leave(f"broken\t{type(failure).__name__}: {failure}"[:200])
        os.close(self._pipe)
        code = waited(child, CLOCK * limit)
        with os.fdopen(reading) as pipe:
            outcome = pipe.read()
        if code is None or (
            not outcome and os.WIFSIGNALED(code) and os.WTERMSIG(code) in (signal.SIGXCPU, signal.SIGKILL)
        ):
            return "timed out", ""
        result, _, test = outcome.partition("\t") if outcome else ("caught", "", "the process ended")
        return result, test

    def _leave(self, outcome: str) -> None:
        os.write(self._pipe, outcome.encode())
        os._exit(0)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            self._leave(f"caught\t{report.nodeid}")


def waited(child: int, seconds: float) -> int | None:
    """Status of a child, None when the time is over; what it has started ends with it."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        done, code = os.waitpid(child, os.WNOHANG)
        if done:
            break
        time.sleep(0.02)
    else:
        code = None
    with suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    if code is None:
        os.waitpid(child, 0)
    return code


def replace_code(mutant: Mutant, first_line: int) -> None:
    """Give every function that was made from the changed one its new code."""
    path = ROOT / mutant.file
    whole = compile(changed(path.read_bytes(), mutant), str(path), "exec", dont_inherit=True)
    new = next(code for code in codes_in(whole) if code.co_firstlineno == first_line and code.co_name != "<lambda>")
    gc.unfreeze()  # what conftest.py has put out of the collector's sight
    old = [
        f for f in gc.get_objects()
        if isinstance(f, FunctionType) and f.__code__.co_filename == str(path)
        and (f.__code__.co_firstlineno, f.__code__.co_name) == (first_line, new.co_name)
    ]  # fmt: skip
    if not old:
        raise LookupError(f"{mutant.file}:{first_line}: no such function is loaded")
    for function in old:
        function.__code__ = new


def codes_in(code: CodeType) -> list[CodeType]:
    return [c for inner in code.co_consts if isinstance(inner, CodeType) for c in (inner, *codes_in(inner))]


# In a copy of the tree -------------------------------------------------------------------------------------------


def in_a_tree(mutant: Mutant, tests: list[str], seconds: float) -> tuple[str, str]:
    """``caught`` and the test, ``timed out``, or ``survived``: with the changed file in a copy of the tree."""
    if not tests:
        return "survived", ""
    ignore = shutil.ignore_patterns(".git", ".venv", "outputs", "__pycache__", ".*_cache", "*.jsonl")
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(shutil.copytree(ROOT, Path(folder) / "tree", ignore=ignore))
        (tree / mutant.file).write_bytes(changed((tree / mutant.file).read_bytes(), mutant))
        (Path(folder) / "tests").write_text("\n".join(tests).replace(str(ROOT), str(tree)))  # names hold paths
        command = [sys.executable, "-m", "pytest", "-x", *QUIET, f"--basetemp={folder}/temporary", f"@{folder}/tests"]
        process = subprocess.Popen(
            command, cwd=tree, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True
        )
        try:
            output, _ = process.communicate(timeout=CLOCK * seconds)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
            return "timed out", ""
    failed = [line.split(" ")[1] for line in output.splitlines() if line.startswith(("FAILED ", "ERROR "))]
    if process.returncode in (0, 5):  # 5: nothing to run
        return "survived", ""
    if process.returncode == 4:  # pytest was asked for what it does not know
        return "broken", output[-200:]
    return "caught", failed[0] if failed else f"exit {process.returncode}"


def wide(seeds: range, journal: Journal, calls: Calls) -> None:
    """Survivors meet what their room's tests do in other processes too."""
    reasons = equivalents()
    passing = set(calls.seconds)
    for row in journal.rows(seeds):
        if is_hole(row, reasons) and not row["wide"]:
            mutant = Mutant(**{name: row[name] for name in Mutant.__dataclass_fields__})
            room = mutant.file.split("/")[1]
            tests = sorted(t for t in passing if t.startswith(f"tests/{room}/")) or sorted(calls.of_file(mutant.file))
            result, test = in_a_tree(mutant, tests, ALWAYS_S + SLOWER * sum(calls.seconds[t] for t in tests))
            journal.add(row | {"wide": True, "result": result, "test": test})
            print(f"{row['seed']} {result} {mutant.file}:{mutant.line} {test}", flush=True)


# Telling ---------------------------------------------------------------------------------------------------------


def key_of(row: dict) -> tuple[str, str, str]:
    return row["file"], row["statement"], row["after"]


def equivalents() -> dict[tuple[str, str, str], str]:
    """Reasons of the changes that cannot be noticed."""
    return {key_of(entry): entry["reason"] for entry in tomllib.loads(EQUIVALENT.read_text()).get("mutant", [])}


def is_hole(row: dict, reasons: dict[tuple[str, str, str], str]) -> bool:
    return row["result"] == "survived" and key_of(row) not in reasons


def table(rows: list[dict]) -> str:
    """Counts and each survivor."""
    reasons = equivalents()
    counts: Counter[str] = Counter()
    lines = []
    for row in rows:
        result = "equivalent" if row["result"] == "survived" and key_of(row) in reasons else row["result"]
        counts[result] += 1
        if result != "caught" and result != "equivalent":
            lines.append(f"  {row['seed']} {result}: {row['file']}:{row['line']}: {row['before']} -> {row['after']}")
            lines.append(f"      {row['statement']}")
    judged = len(rows) - counts["equivalent"]
    noticed = counts["caught"] + counts["timed out"]  # a run that does not end is noticed
    head = f"seeds {seed_journal.ranges_of(row['seed'] for row in rows)}: tried {len(rows)}, "
    head += ", ".join(f"{kind} {counts[kind]}" for kind in ("caught", "timed out", "survived", "equivalent", "broken"))
    return "\n".join([f"{head}: {100 * noticed / max(judged, 1):.1f} % of {judged} noticed", *lines])


def main() -> int:
    parser = seed_journal.parser("mutation", __doc__, "0:10")
    parser.add_argument("--wide", action="store_true", help="try survivors in a changed tree")
    parser.add_argument("--again", action="store_true", help="try survivors again: there are new tests")
    parser.add_argument("--room", default="", help="changes of one room alone; a seed draws from it")
    given = parser.parse_args()
    if not given.table:
        calls, pool = calls_of_tests.read(), library(given.room)
        if given.wide:
            wide(given.seeds, given.journal, calls)
        else:
            seeds = given.journal.left(given.seeds, given.budget)
            if given.again:
                again = [row["seed"] for row in given.journal.rows(given.seeds) if row["result"] != "caught"]
                seeds = chain(again, seeds)
            with tempfile.TemporaryDirectory() as folder:
                os.environ["XDG_CACHE_HOME"] = f"{folder}/cache"
                files = sorted({test.split("::")[0] for test in calls.seconds})
                pytest.main([*QUIET, f"--basetemp={folder}/temporary", *files],
                            plugins=[Forks(seeds, pool, calls, given.journal)])  # fmt: skip
    rows, reasons = given.journal.rows(given.seeds), equivalents()
    return seed_journal.conclude(
        f"mutation.py --room={given.room}", rows, table(rows), lambda row: is_hole(row, reasons)
    )


if __name__ == "__main__":
    sys.exit(main())
