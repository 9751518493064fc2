"""Damaged programs at the reader: it takes them whole or refuses them in one way, quickly and within its memory.

python tests/fuzz/fuzz_listing.py --inputs 100000 --seed 1
"""

import argparse
import random
import sys
import time
import tracemalloc
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from compgen.dialects.fanuc_ls.listing import dumps, loads
from compgen.exceptions import CompgenError

TESTS = Path(__file__).resolve().parents[1]
SAMPLES = TESTS.parents[1] / "shared" / "fanuc" / "samples"
LONGEST_S = 1.0
BYTES_PER_BYTE = 50
BYTES_ALWAYS = 1_000_000
MEMORY_EVERY = 50  # measuring memory is slow


def seeds() -> list[bytes]:
    """Good programs to start from: the golden ones, and real ones where there are any."""
    golden = sorted((TESTS / "golden").glob("*.LS"))
    real = sorted(p for p in SAMPLES.rglob("*") if p.is_file() and p.suffix.lower() == ".ls")
    return [p.read_bytes() for p in (*golden, *real)]


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


def faults(inputs: int, seed: int, counts: Counter[str]) -> Iterator[tuple[str, bytes]]:
    """What went wrong, with the input that did it; what went right is counted."""
    rng = random.Random(seed)
    pool = seeds()
    for i in range(inputs):
        data = mutated(rng, pool)
        measured = i % MEMORY_EVERY == 0
        if measured:
            tracemalloc.start()
        start = time.perf_counter()
        try:
            program = loads(data)
        except CompgenError as refused:
            counts["refused"] += 1
            if "\n" in str(refused) or "\r" in str(refused):
                yield "a refusal of several lines", data
        except Exception as exception:  # any other exception is what is looked for here
            counts["broken"] += 1
            yield f"{type(exception).__name__}: {exception}"[:160], data
        else:
            counts["accepted"] += 1
            if dumps(program) != data:
                yield "written bytes differ from those read", data
        took = time.perf_counter() - start
        if measured:
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
            counts["measured"] += 1
            if peak > BYTES_PER_BYTE * len(data) + BYTES_ALWAYS:
                yield f"{peak} bytes of memory for {len(data)} bytes", data
        elif took > LONGEST_S:  # tracing itself takes time
            yield f"{took:.1f} s", data
        counts["slowest_us"] = max(counts["slowest_us"], 0 if measured else int(took * 1e6))


def main() -> int:
    """Run, print each kind of fault once, and a closing line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--inputs", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="folder for the first input of each kind of fault")
    given = parser.parse_args()
    counts: Counter[str] = Counter()
    kinds: Counter[str] = Counter()
    for what, data in faults(given.inputs, given.seed, counts):
        kinds[what] += 1
        if kinds[what] == 1:
            print(f"fault: {what} ({len(data)} bytes)", flush=True)
            if given.keep:
                given.keep.mkdir(parents=True, exist_ok=True)
                (given.keep / f"{len(kinds):03d}.LS").write_bytes(data)
    print(
        f"{given.inputs} inputs, seed {given.seed}: {counts['accepted']} accepted, {counts['refused']} refused, "
        f"{sum(kinds.values())} faults of {len(kinds)} kinds, {counts['measured']} measured for memory, "
        f"slowest {counts['slowest_us'] / 1e6:.3f} s"
    )
    return 1 if kinds else 0


if __name__ == "__main__":
    sys.exit(main())
