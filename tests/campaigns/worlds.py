"""Worlds of 1 to 20 runs at once, in the same folders and with the same cache: each is whole, and none spoils another.

python tests/campaigns/worlds.py --seeds 0:100            draws, judges and adds to worlds.jsonl; again goes on
python tests/campaigns/worlds.py --seeds 0:100 --table    only the table of what is in worlds.jsonl

A seed draws how many runs begin at the same moment, what each is (a command in one of two variations) and into which of
up to three folders: new, with an earlier result, or with files of others. Runs of different commands never share a
folder. Judged are every run's words and exit code, what the folders hold when all have ended, and what lies about.
"""

import json
import os
import random
import sys
import tempfile
from collections import Counter
from dataclasses import dataclass
from functools import partial
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[2]), str(Path(__file__).parent)]

import kills  # noqa: E402
import seed_journal  # noqa: E402
from kills import COMMANDS, FOREIGN, SITUATIONS, Campaign, End, Stop, content, hidden  # noqa: E402
from shipped import load_everything  # noqa: E402
from shrinking import shrunk  # noqa: E402

TAKING_PART = ("generate", "generate pages", "predict", "correct", "pages", "heat", "whatif", "plan-poses")
MOST = 20


@dataclass(frozen=True)
class Run:
    """A command that begins with the others."""

    folder: int
    command: str
    situation: str  # of the folder
    older: bool


def drawn(seed: int) -> list[Run]:
    """The runs of a world."""
    rng = random.Random(seed)
    folders = [(rng.choice(TAKING_PART), rng.choice(SITUATIONS)) for _ in range(rng.randint(1, 3))]
    runs = []
    for _ in range(rng.randint(1, MOST)):
        n = rng.randrange(len(folders))
        runs.append(Run(n, *folders[n], rng.random() < 0.5))
    return runs


def ends_of(campaign: Campaign, runs: list[Run], world: Path) -> list[End]:
    """How the runs end that begin at one moment; their folders are prepared before."""
    for run in runs:
        out = world / f"out{run.folder}"
        for file, data in campaign.files_before(run.command, run.situation).items():
            (out / file).parent.mkdir(parents=True, exist_ok=True)
            (out / file).write_bytes(data)
    waiting, begin = os.pipe()
    children = []
    for n, run in enumerate(runs):
        line = COMMANDS[run.command].line(world / f"out{run.folder}", run.older)
        child = os.fork()
        if not child:
            os.close(begin)
            os.read(waiting, 1)  # until all are there
            kills.be_the_command(line, world, Stop(), str(n))
        children.append(child)
    os.close(waiting)
    os.close(begin)
    codes = [os.waitstatus_to_exitcode(kills.waited(child)) for child in children]
    words = [(world / f"stderr{n}").read_text(errors="replace") for n in range(len(runs))]
    return [End(code, text, [], 0.0) for code, text in zip(codes, words, strict=False)]


def faults(campaign: Campaign, runs: list[Run], ends: list[End], world: Path) -> list[str]:
    """What is wrong with a world when all its runs have ended."""
    wrong = []
    for run, end in zip(runs, ends, strict=False):
        lines = end.error.splitlines()
        usual = campaign.ends[run.command, run.situation].code
        refused = end.code == 2 and len(lines) == 1 and len(lines[0]) <= 300
        if "Traceback" in end.error or (end.code not in (0, 1) and not refused):
            wrong.append(f"{run.command}: exit {end.code}: {end.error[-300:]!r}")
        elif end.code != 2 and end.code != usual:
            wrong.append(f"{run.command}: exit {end.code} instead of {usual}: {end.error[:200]!r}")
    for n in {run.folder for run in runs}:
        here = [(run, end) for run, end in zip(runs, ends, strict=False) if run.folder == n]
        command, situation = here[0][0].command, here[0][0].situation
        before = campaign.files_before(command, situation)
        foreign = FOREIGN if situation == "foreign" else {}
        sets = [campaign.finished[command, run.older] | foreign for run, end in here if end.code != 2]
        out = content(world / f"out{n}")
        if out not in (sets or [before]):
            mixed = {file: [k for k, s in enumerate(sets) if s.get(file) == data] for file, data in out.items()}
            wrong.append(f"{command}, {situation}: the folder holds no run's files: {mixed}")
    return wrong + ([f"left lying about: {left[:3]}"] if (left := hidden(world)) else [])


def tried(campaign: Campaign, seed: int) -> dict:
    """A row of the journal."""

    def wrong_with(runs: list[Run]) -> list[str]:
        world = campaign.world("world")
        return faults(campaign, runs, ends_of(campaign, runs, world), world) if runs else []

    runs = drawn(seed)
    world = campaign.world("world")
    ends = ends_of(campaign, runs, world)
    wrong = faults(campaign, runs, ends, world)
    row = {"seed": seed, "runs": len(runs), "refused": sum(end.code == 2 for end in ends), "wrong": wrong}
    if wrong:
        fewest = shrunk(runs, lambda fewer: any(wrong_with(fewer) for _ in range(3)), 40)
        row["fewest"] = [run.__dict__ for run in fewest]
    return row


def table(rows: list[dict]) -> str:
    """Worlds by how many runs they had."""
    counts: Counter[str] = Counter()
    for row in rows:
        counts[f"{1 + (row['runs'] - 1) // 5 * 5} to {5 + (row['runs'] - 1) // 5 * 5}"] += 1
    seeds = seed_journal.ranges_of(row["seed"] for row in rows)
    runs, refused = (sum(row[name] for row in rows) for name in ("runs", "refused"))
    failed = sum(bool(row["wrong"]) for row in rows)
    sizes = ", ".join(f"{name}: {counts[name]}" for name in sorted(counts, key=lambda n: int(n.split()[0])))
    lines = [
        f"seeds {seeds}: {len(rows)} worlds, {runs} runs, {refused} refused in one line, {failed} failed",
        f"runs at once: {sizes}",
    ]
    return "\n".join([*lines, *(f"  {json.dumps(row)}" for row in rows if row["wrong"])])


def main() -> int:
    """Try the seeds that the journal has not, and print the table of all."""
    given = seed_journal.parser("worlds", __doc__, "0:10").parse_args()
    if not given.table:
        os.environ["CC"] = ""
        with tempfile.TemporaryDirectory() as folder:
            load_everything()
            campaign = Campaign(Path(folder), {name: COMMANDS[name] for name in TAKING_PART})
            given.journal.keep_trials(given.seeds, given.budget, partial(tried, campaign))
    rows = given.journal.rows(given.seeds)
    return seed_journal.conclude("worlds.py", rows, table(rows), lambda row: row["wrong"])


if __name__ == "__main__":
    sys.exit(main())
