"""Damaged programs at the correction: it corrects them, passes them through, or refuses them in one line.

python tests/campaigns/fuzz_correct.py --seeds 0:100     100 damaged programs a seed; again goes on
"""

import random
import sys
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import seed_journal
from fuzz_listing import kind_of, mutated, seeds

from compgen.core.json_text import json_text

sys.path.append(str(Path(__file__).resolve().parents[1]))

from ls_text import at, joint_form, program

from compgen.core.exceptions import CompgenError
from compgen.core.pose import IDENTITY
from compgen.fanuc import loads
from compgen.pipelines.correct import Options, correct
from compgen.pipelines.correct.program_file import load_before
from compgen.pipelines.files.robot_file import load_cell
from compgen.program.frames import Frames
from compgen.report.correction import correction_csv, correction_summary
from compgen.report.provenance import provenance_json, restore_planned

A_SEED = 100  # programs
LARGEST = 20_000  # bytes of a program to start from: the correction is not what makes long ones slow
LONGEST_S = 8.0
KNOWN = 12  # frames and tools that are known, all in the same place


def correctable() -> list[bytes]:
    """Programs that are corrected as they are: Cartesian, joint and mixed, with stops, arcs and frames."""
    places = [(2.0 * k, 10 + k, -15 + 2 * k, 3.0 * k, -60 + k, 40 - k) for k in range(12)]
    lines = [f"L P[{n}] 200mm/sec {'FINE' if n % 5 == 0 else 'CNT100'}" for n in range(2, 13)]
    straight = program(["J P[1] 20% FINE", *lines], [at(n, j) for n, j in enumerate(places, 1)])
    joints = program(["J P[1] 20% FINE", *lines], [joint_form(n, j) for n, j in enumerate(places, 1)])
    arc = ["UFRAME_NUM=1", "UTOOL_NUM=2", "J P[1] 20% FINE", "C P[2]\n    :  P[3] 100mm/sec FINE", *lines[2:]]
    framed = program(arc, [at(n, j, numbered=(1, 2)) for n, j in enumerate(places, 1)], end="\r\n")
    return [straight, joints, framed]


def faults(inputs: int, seed: int, counts: Counter[str]) -> Iterator[tuple[str, bytes]]:
    """What went wrong, with the input that did it; what went right is counted."""
    rng = random.Random(seed)
    pool = [data for data in seeds() if len(data) < LARGEST] + 20 * correctable()
    frames = Frames(dict.fromkeys(range(KNOWN), IDENTITY), dict.fromkeys(range(KNOWN), IDENTITY))
    robot = str(Path(__file__).resolve().parents[2] / "robots" / "m710ic50.toml")
    hot, rigid = load_cell(robot), load_cell(robot, ["thermal.cte_um_m_K=0"])
    before = load_before(["moving 200mm/s 6h"]).duties
    choices = (
        (hot, Options()),
        (hot, Options(split=True, insert=5e-6)),
        (hot, Options(split=True)),
        (hot, Options(insert=2e-6, again=True)),
        (rigid, Options(split=True, insert=5e-6)),
    )
    for i in range(inputs):
        data = mutated(rng, pool)
        cell, options = choices[i % len(choices)]
        start = time.process_time()
        try:
            result = correct(data, cell, frames, before, options, lambda stage, share: None)
        except CompgenError as refused:
            counts["refused"] += 1
            counts[f"exit {refused.exit_code}"] += 1
            if "\n" in str(refused) or "\r" in str(refused):
                yield "a refusal of several lines", data
        except Exception as exception:  # any other exception is what is looked for here
            yield f"{type(exception).__name__}: {exception}"[:160], data
        else:
            counts["corrected" if result.changed else "passed through"] += 1
            if cell is rigid and result.text != data:
                yield "no error, and yet another text", data
            if not options.insert and not options.split and len(result.text) - len(data) > 20 * result.changed:
                yield "more than numbers has changed", data
            try:
                loads(result.text)
                json_text(correction_summary(result))
                correction_csv(result)
                if restore_planned(provenance_json(result), result.text, "p") != data:
                    yield "the planned program does not come back", data
            except Exception as exception:  # nothing may go wrong after a correction
                yield f"after: {type(exception).__name__}: {exception}"[:160], data
            counts["outside"] += not result.is_usable
        if time.process_time() - start > LONGEST_S:
            yield f"longer than {LONGEST_S:g} s", data


def tried(seed: int, keep: Path | None) -> dict:
    """A row of the journal: the programs of one seed."""
    counts: Counter[str] = Counter()
    kinds: Counter[str] = Counter()
    for what, data in faults(A_SEED, seed, counts):
        kinds[kind_of(what)] += 1
        print(f"seed {seed}: {what} ({len(data)} bytes)", flush=True)
        if keep:
            keep.mkdir(parents=True, exist_ok=True)
            (keep / f"{seed}_{kinds.total()}.LS").write_bytes(data)
    return {"seed": seed, "inputs": A_SEED, "counts": counts, "faults": kinds}


def table(rows: list[dict]) -> str:
    """What the rows add up to."""
    counts = sum((Counter(row["counts"]) for row in rows), Counter())
    faulty = sum((Counter(row["faults"]) for row in rows), Counter())
    kinds = ", ".join(f"{name} {counts[name]}" for name in ("corrected", "passed through", "refused", "outside"))
    head = f"seeds {seed_journal.ranges_of(row['seed'] for row in rows)}: tried {sum(row['inputs'] for row in rows)}, "
    return "\n".join([f"{head}{kinds}, failed {faulty.total()}", *(f"  {n} x {kind}" for kind, n in faulty.items())])


def main() -> int:
    """Try the seeds that the journal has not, and print the table of all."""
    warnings.simplefilter("error")
    given = seed_journal.parser("fuzz_correct", __doc__, "0:10").parse_args()
    for seed in () if given.table else given.journal.left(given.seeds, given.budget):
        given.journal.add(tried(seed, given.keep))
    rows = given.journal.rows(given.seeds)
    return seed_journal.conclude("fuzz_correct.py", rows, table(rows), lambda row: row["faults"])


if __name__ == "__main__":
    sys.exit(main())
