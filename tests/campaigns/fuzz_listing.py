"""Damaged programs at the reader: it takes them whole or refuses them in one way, quickly and within its memory.

python tests/campaigns/fuzz_listing.py --seeds 0:500        500 damaged programs a seed; again goes on
python tests/campaigns/fuzz_listing.py --printed 10000      printed programs, judged by the second reader
python tests/campaigns/fuzz_listing.py --atheris            guided by coverage, until it is stopped

What is taken is written again byte by byte, and the second reader reads the same motions and positions in it.
"""

import random
import sys
import time
import tracemalloc
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS.parent), str(TESTS), str(TESTS / "campaigns")]

import hypothesis  # noqa: E402
import seed_journal  # noqa: E402
from agreement import assert_readers_agree, contradiction, differences  # noqa: E402
from printed import programs  # noqa: E402
from shrinking import shrunk  # noqa: E402

from compgen.core.exceptions import CompgenError  # noqa: E402
from compgen.fanuc.analysis import inspection  # noqa: E402
from compgen.fanuc.listing.listing import LsProgram, dumps, loads  # noqa: E402
from compgen.fanuc.listing.templates import FEW_TEXTS  # noqa: E402
from compgen.pipelines.files.robot_file import load_robot  # noqa: E402
from compgen.program.frames import default_frames  # noqa: E402

SAMPLES = TESTS.parents[1] / "shared" / "fanuc" / "samples"
LONGEST_S = 1.0
BYTES_PER_BYTE = 50
BYTES_ALWAYS = 1_000_000
MEMORY_EVERY = 50  # measuring memory is slow
COLUMNS_EVERY = 25  # so is reading a short program by columns, and inspecting it
PRINTED_SEEDS = 100
A_SEED = 500  # programs
SLOW_TO_JUDGE = 20_000  # bytes: the second reader is slow
AT_ONCE = 250
QUIET = hypothesis.settings(deadline=None, database=None, suppress_health_check=list(hypothesis.HealthCheck))


def golden_programs() -> list[bytes]:
    """The project's own good programs: the same on every machine."""
    return [p.read_bytes() for p in sorted((TESTS / "golden").glob("*.LS"))]


@cache
def seeds() -> list[bytes]:
    """Good programs to start from: the golden ones, real ones where there are any, printed ones.

    What is printed depends on the modules that are loaded: hypothesis takes constants from them.
    """
    real = sorted(p for p in SAMPLES.rglob("*") if p.is_file() and p.suffix.lower() == ".ls")
    drawn: list[bytes] = []

    @hypothesis.settings(QUIET, max_examples=PRINTED_SEEDS, derandomize=True)
    @hypothesis.given(programs())
    def draw(data: bytes) -> None:
        drawn.append(data)

    draw()
    return [*golden_programs(), *(p.read_bytes() for p in real), *drawn]


def mutated(rng: random.Random, pool: list[bytes]) -> bytes:
    """One program with one to six wounds."""
    data = bytearray(rng.choice(pool))
    for _ in range(rng.randint(1, 6)):
        at = rng.randint(0, len(data))
        wound = rng.randrange(7)
        if wound == 0 and data:
            data[at % len(data)] ^= 1 << rng.randrange(8)
        elif wound == 1:
            data[at:at] = rng.randbytes(rng.randint(1, 4))
        elif wound == 2 and data:  # the same byte many times: long numbers, long blanks
            data[at:at] = data[at % len(data) : at % len(data) + 1] * rng.randint(1, 200)
        elif wound == 3:
            del data[at : at + rng.randint(1, 40)]
        elif wound == 4:
            slice_ = data[at : at + rng.randint(1, 200)]
            to = rng.randint(0, len(data))
            data[to:to] = slice_ * rng.randint(1, 3)
        elif wound == 5 and rng.random() < 0.2:
            del data[at:]
        elif wound == 6 and rng.random() < 0.3:
            other = rng.choice(pool)
            data[at:] = other[rng.randint(0, len(other)) :]
    return bytes(data)


def read_or_refused(data: bytes, few: int) -> LsProgram | str:
    """The program, or why there is none."""
    try:
        return loads(data, few)
    except CompgenError as refused:
        return str(refused)


def disagreement(data: bytes) -> str:
    """How reading by columns differs from reading one by one; empty when it does not."""
    quick, careful = read_or_refused(data, 0), read_or_refused(data, sys.maxsize)
    if isinstance(quick, str) or isinstance(careful, str):
        same = isinstance(quick, str) and isinstance(careful, str) and quick == careful
        return "" if same else "columns and the careful reader: one refuses, or for another reason"
    return ", ".join(differences(quick, careful))


def faults(
    inputs: int, seed: int, counts: Counter[str], good: list[bytes] | None = None
) -> Iterator[tuple[str, bytes]]:
    """What went wrong, with the input that did it; what went right is counted. ``good`` are damaged, or ``seeds``."""
    rng = random.Random(seed)
    pool = seeds() if good is None else good
    robot, frames = load_robot("m710ic50"), default_frames()
    for i in range(inputs):
        data = mutated(rng, pool)
        measured = i % MEMORY_EVERY == 0
        if measured:
            tracemalloc.start()
        start = time.process_time()
        try:
            program = loads(data)
            took = time.process_time() - start
        except CompgenError as refused:
            took = time.process_time() - start
            counts["refused"] += 1
            if "\n" in str(refused) or "\r" in str(refused):
                yield "a refusal of several lines", data
        except Exception as exception:  # any other exception is what is looked for here
            took = 0.0
            counts["broken"] += 1
            yield f"{type(exception).__name__}: {exception}"[:160], data
        else:
            counts["accepted"] += 1
            if dumps(program) != data:
                yield "written bytes differ from those read", data
            if len(data) < SLOW_TO_JUDGE:
                other = contradiction(data, program)
                counts["second reader refuses" if other is None else "judged"] += 1
                if other:
                    yield other, data
        if measured:
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
            counts["measured"] += 1
            if peak > BYTES_PER_BYTE * len(data) + BYTES_ALWAYS:
                yield f"{peak} bytes of memory for {len(data)} bytes", data
        elif took > LONGEST_S:  # tracing itself takes time
            yield f"{took:.1f} s", data
        counts["slowest_us"] = max(counts["slowest_us"], 0 if measured else int(took * 1e6))
        if i % COLUMNS_EVERY == 0:
            counts["compared"] += 1
            try:
                if how := disagreement(data):
                    yield how, data
                inspection.inspect(loads(data), robot, frames)
            except CompgenError:
                pass
            except Exception as exception:
                yield f"{type(exception).__name__}: {exception}"[:160], data


def print_programs(count: int, seed: int) -> None:
    """Programs nobody wrote: both readers, and both ways of the first, agree on every number.

    Raises:
        AssertionError: They do not; hypothesis tells the smallest program it found.
    """

    def judge(data: bytes) -> None:
        for few in (FEW_TEXTS, 0):
            assert_readers_agree(data, few)

    for first in range(0, count, AT_ONCE):  # hypothesis keeps what it drew: a few at a time stay small
        settings = hypothesis.settings(QUIET, max_examples=min(AT_ONCE, count - first))
        hypothesis.seed(seed + first)(settings(hypothesis.given(programs())(judge)))()


def guided() -> None:
    """Inputs grown by atheris; it stops at the first exception that is no refusal."""
    import atheris  # type: ignore[import-untyped]  # no stubs, and not in the environment of tests

    def one(data: bytes) -> None:
        for few in (0, sys.maxsize):
            read_or_refused(data, few)

    atheris.instrument_all()
    atheris.Setup([sys.argv[0]], one)
    atheris.Fuzz()


def kind_of(what: str) -> str:
    """A fault without its numbers."""
    return "".join(c for c in what if not c.isdigit())[:60]


def smallest(data: bytes, kind: str) -> bytes:
    """The fewest lines of a program that still show a fault that one reading shows."""

    def fails(lines: list[bytes]) -> bool:
        text = b"".join(lines)
        try:
            return kind_of(contradiction(text, loads(text)) or "") == kind
        except CompgenError:
            return False
        except Exception as exception:
            return kind_of(f"{type(exception).__name__}: {exception}"[:160]) == kind

    fewest = shrunk(data.splitlines(keepends=True), fails)
    return b"".join(fewest)


def tried(seed: int, keep: Path | None) -> dict:
    """A row of the journal: the programs of one seed."""
    counts: Counter[str] = Counter()
    kinds: Counter[str] = Counter()
    for what, data in faults(A_SEED, seed, counts):
        kind = kind_of(what)
        kinds[kind] += 1
        if kinds[kind] == 1:
            print(f"seed {seed}: {what} ({len(data)} bytes)", flush=True)
            if keep:
                keep.mkdir(parents=True, exist_ok=True)
                (keep / f"{seed}_{len(kinds)}.LS").write_bytes(smallest(data, kind))
    return {"seed": seed, "inputs": A_SEED, **counts, "faults": kinds}


def table(rows: list[dict]) -> str:
    """What the rows add up to."""
    names = ("inputs", "accepted", "refused", "judged", "second reader refuses", "measured", "compared")
    total = {name: sum(row.get(name, 0) for row in rows) for name in names}
    faulty = Counter(kind for row in rows for kind, n in row["faults"].items() for _ in range(n))
    slowest = max((row["slowest_us"] for row in rows), default=0) / 1e6
    return "\n".join(
        [
            f"seeds {seed_journal.ranges_of(row['seed'] for row in rows)}: tried {total['inputs']}, accepted "
            f"{total['accepted']}, refused {total['refused']}, failed {faulty.total()}; the second reader judged "
            f"{total['judged']} and refused {total['second reader refuses']}, {total['measured']} measured for memory, "
            f"{total['compared']} read both ways, slowest {slowest:.3f} s",
            *(f"  {n} x {kind}" for kind, n in faulty.items()),
        ]
    )


def main() -> int:
    """Try the seeds that the journal has not, and print the table of all."""
    parser = seed_journal.parser("fuzz_listing", __doc__, "0:10")
    parser.add_argument("--samples", type=Path, default=SAMPLES, help="folder with more programs to start from")
    parser.add_argument("--printed", type=int, default=0)
    parser.add_argument("--atheris", action="store_true")
    given = parser.parse_args()
    globals()["SAMPLES"] = given.samples
    if given.atheris:
        guided()
    if given.printed:
        print_programs(given.printed, given.seeds.start)
        print(f"{given.printed} printed programs from seed {given.seeds.start}: both readers agree on every number")
        return 0
    for seed in () if given.table else given.journal.left(given.seeds, given.budget):
        given.journal.add(tried(seed, given.keep))
    rows = given.journal.rows(given.seeds)
    return seed_journal.conclude("fuzz_listing.py", rows, table(rows), lambda row: row["faults"])


if __name__ == "__main__":
    sys.exit(main())
