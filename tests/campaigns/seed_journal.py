"""What a campaign keeps: a line for each seed that was tried, so that it resumes, adds up and says its seeds.

The journal (``<campaign>.jsonl`` beside the campaign, not in the repository) is appended a line at a time: two
processes on different seeds may share it. A seed means the same input only on the same tree.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any


def median_and_worst(values: Sequence[float], rows: Sequence[dict[str, Any]], digits: str = ".0f") -> str:
    """Median and worst of a figure of some rows, with the worst one's seed."""
    k = max(range(len(values)), key=values.__getitem__)
    return f"{median(values):{digits}}, {values[k]:{digits}} ({rows[k]['seed']})"


@dataclass(frozen=True)
class Journal:
    """A file of rows, each an object with a ``seed``."""

    path: Path

    def rows(self, seeds: range) -> list[dict]:
        """What was tried of some seeds, by seed; the last trial of a seed counts."""
        lines = self.path.read_text().splitlines() if self.path.exists() else []
        last = {row["seed"]: row for row in map(json.loads, lines)}
        return [last[seed] for seed in sorted(last) if seed in seeds]

    def add(self, row: dict) -> None:
        with self.path.open("a") as file:
            file.write(json.dumps(row) + "\n")

    def left(self, seeds: range, budget: float = 0.0) -> Iterator[int]:
        """Seeds that are still to be tried, until a budget [s] is spent; 0 is no limit."""
        done, start = {row["seed"] for row in self.rows(seeds)}, time.monotonic()
        for seed in seeds:
            if budget and time.monotonic() - start > budget:
                return
            if seed not in done:
                yield seed

    def keep_trials(self, seeds: range, budget: float, trial: Callable[[int], dict]) -> None:
        """Try what is left and keep each row; one that has something wrong in it is printed at once."""
        for seed in self.left(seeds, budget):
            row = trial(seed)
            self.add(row)
            if row["wrong"]:
                print(json.dumps(row), flush=True)


def ranges_of(seeds: Iterable[int]) -> str:
    """``0 to 9, 12, 20 to 29``."""
    parts: list[list[int]] = []
    for seed in sorted(set(seeds)):
        if parts and seed == parts[-1][1] + 1:
            parts[-1][1] = seed
        else:
            parts.append([seed, seed])
    return ", ".join(str(a) if a == b else f"{a} to {b}" for a, b in parts) or "none"


def conclude(command: str, rows: list[dict], table: str, is_find: Callable[[dict], object]) -> int:
    """Print the table, and for each row that is a find the command that tries it again; the exit code."""
    print(table)
    finds = [row["seed"] for row in rows if is_find(row)]
    for seed in finds:
        print(f'again: python tests/campaigns/{command} --seeds {seed}:{seed + 1} --journal "$(mktemp)"')
    return int(bool(finds))


def parser(campaign: str, doc: str | None, seeds: str) -> argparse.ArgumentParser:
    """The options that every campaign has."""
    options = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--seeds", type=_seeds, default=_seeds(seeds), help="first:end, the end not included")
    options.add_argument("--budget", type=float, default=0.0, help="seconds; 0: none")
    options.add_argument("--table", action="store_true", help="only tell what was tried")
    options.add_argument("--keep", type=Path, default=None, help="folder for the files of failures")
    beside = Path(__file__).with_name(f"{campaign}.jsonl")
    options.add_argument("--journal", type=_journal, default=Journal(beside))
    return options


def _seeds(text: str) -> range:
    first, _, end = text.partition(":")
    return range(int(first), int(end))


def _journal(text: str) -> Journal:
    return Journal(Path(text))
