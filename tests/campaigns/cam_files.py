"""CAM files through ``generate``, each written program judged by a reader that knows lines and arcs only.

python tests/campaigns/cam_files.py --seeds 0:300            draws, judges and adds to cam_files.jsonl; again goes on
python tests/campaigns/cam_files.py --seeds 0:300 --table    only the table of what is in cam_files.jsonl

A seed draws a way (polygons, fillets, arcs, helices, plunges, there and back, thousands of short blocks) and writes it
as G-code, APT or CSV points in a drawn manner; one file in four has a word that may be refused, but not passed over.
The judge (``naive_cam.py``) reads the user's file, the second reader the program; the second arm, warm as the path file
says, drives it. Every place of the tool is near the user's lines and arcs, in their order, and every corner of the user
near the tool's way: within tolerance, chord, the format's rounding and what the report says is left. A program whose
file the judge cannot read has no independent reading: it is wrong, too. One job in twenty goes through the command
line in a process as well and must give the same bytes. Batches run in forked processes.
"""

import os
import subprocess
import sys
import tempfile
import time
import traceback
from collections import Counter
from dataclasses import replace
from itertools import islice
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[n]) for n in (2, 1, 0)]

import cam_draws  # noqa: E402
import cam_judge  # noqa: E402
import naive_cam  # noqa: E402
import naive_ls  # noqa: E402
import seed_journal  # noqa: E402
from shipped import ROOT  # noqa: E402

import compgen  # noqa: E402
from compgen.core.exceptions import CompgenError  # noqa: E402

IN_A_PROCESS = 20  # every so many seeds
AT_ONCE = 25  # seeds in one forked process
RESULTS = ("inside", "outside", "refused", "refused, may be", "wrong")


# Judging ---------------------------------------------------------------------------------------------------------


def judged(case: cam_draws.Case, written=lambda texts: None) -> tuple[str, str]:
    """One of the results, and why; the texts that were written are handed on."""
    try:
        read, unread = naive_cam.READERS[case.pattern](case.text), ""
    except naive_cam.Unreadable as exception:
        read, unread = None, str(exception)
    with tempfile.TemporaryDirectory() as folder:
        path = laid_down(case, Path(folder))
        try:
            result = compgen.generate(compgen.load_job(str(path)))
        except CompgenError as exception:
            return refusal(case, exception, folder, unread)
        except Exception:
            return "wrong", f"crash: {traceback.format_exc().strip().splitlines()[-1]} {where()}"
    if read is None or not read.moves:
        return "wrong", f"no independent reading: {unread or 'nothing to drive'}"
    texts = [text for text in result.programs.values() if naive_ls.read(text)[1]] if result.programs else [result.text]
    texts = texts or [result.text]
    written(texts)
    left = result.report["after"]["total"]["max_um"]
    drive = cam_judge.flown(texts, case.keys)
    want = cam_judge.wanted(read, case.keys, left)
    share, why = cam_judge.contradiction(want, drive)
    if why and read.stands:  # from where the tool stands to its first place is no part of the program
        want = cam_judge.wanted(replace(read, moves=read.moves[1:], normal=read.moves[0].normal), case.keys, left)
        share, why = cam_judge.contradiction(want, drive)
    if not why and read.points:
        why = below(want, drive, [f.message for f in result.findings])
    if why and not result.inside:  # it says so itself, and writes no program
        return "outside", why
    if why:
        return "wrong", f"{why} ({case.trap or 'plain'})"
    return (
        "inside" if result.inside else "outside"
    ), f"share {share:.2f}, after {left:.2f} um, {len(want.corner)} places"


def below(want: cam_judge.Wanted, drive: cam_judge.Flown, findings: list[str]) -> str:
    """Words, when a curve goes below the lowest place of the user and no finding says so."""
    deep = want.corner[:, 2].min() - want.near.max() - drive.pose[:, 2, 3].min()
    if deep > 0 and not any(word in f for f in findings for word in ("lowest", "below the points", "deeper")):
        return f"below the lowest place by {1000 * deep:.1f} um, and nobody says so"
    return ""


def refusal(case: cam_draws.Case, exception: CompgenError, folder: str, unread: str) -> tuple[str, str]:
    """A refusal is one line; a plain file's is counted apart."""
    message = str(exception).replace(folder + "/", "")
    if (
        "\n" in message
        or len(message) > 300
        or (exception.exit_code == 2 and not {case.file, "part.toml"} & set(message.replace(":", " ").split()))
    ):
        return "wrong", f"a refusal that is no line, or without the file: {message[:400]}"
    return ("refused, may be" if case.trap or unread else "refused"), f"{type(exception).__name__}: {message}"


def where() -> str:
    """The innermost place of the package in the exception that is handled."""
    places = [f for f in traceback.extract_tb(sys.exc_info()[2]) if "/compgen/" in f.filename]
    return f"{places[-1].filename.rpartition('/compgen/')[2]}:{places[-1].lineno}" if places else ""


def laid_down(case: cam_draws.Case, folder: Path) -> Path:
    """The files of a case in a folder; the path file."""
    (folder / case.file).write_bytes(case.text.encode())
    path = folder / "part.toml"
    path.write_text(case.path)
    return path


def in_a_process(case: cam_draws.Case) -> tuple[int, str, list[bytes]]:
    """Exit code, the error stream and the programs of the same case through the command line."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "compgen", "generate", str(laid_down(case, Path(folder))), "-q", "--force"]
        run = subprocess.run([*command, "-o", f"{folder}/out"], cwd=ROOT, capture_output=True, text=True, check=False)
        texts = [p.read_bytes() for p in sorted(Path(folder).glob("out/*.LS"))]
        return run.returncode, run.stderr, texts


# Telling ---------------------------------------------------------------------------------------------------------


def tried(seed: int) -> dict:
    """A row of the journal."""
    case, start = cam_draws.drawn(seed), time.process_time()
    texts: list[bytes] = []
    try:
        result, reason = judged(case, texts.extend)
    except Exception:  # a program that the judge cannot drive is not proven
        result, reason = "wrong", f"the judge cannot: {traceback.format_exc().strip().splitlines()[-1]}"
    seconds = round(time.process_time() - start, 2)
    row = {"seed": seed, "pattern": case.pattern, "shape": case.shape, "trap": case.trap, "result": result}
    row |= {"reason": reason, "seconds": seconds, "process": seed % IN_A_PROCESS == 0}
    if row["process"] and result != "wrong":
        code, said, programs = in_a_process(case)
        codes = {"inside": (0,), "outside": (1,)}.get(result, (2, 3))
        if code not in codes or sorted(p for p in programs if naive_ls.read(p)[1]) != sorted(texts):
            row |= {"result": "wrong", "reason": f"in a process: exit {code}, {len(programs)} programs: {said[:300]}"}
    return row


def table(rows: list[dict]) -> str:
    """Counts by pattern, the refusals of plain files, and whatever is wrong."""
    lines = [f"seeds {seed_journal.ranges_of(row['seed'] for row in rows)}, "
             f"{sum(row['process'] for row in rows)} of them in a process too, "
             f"{sum(row['seconds'] for row in rows) / max(len(rows), 1):.2f} s of a processor each"]  # fmt: skip
    for pattern in (*cam_judge.TABLES, None):
        counts = Counter(row["result"] for row in rows if pattern in (None, row["pattern"]))
        lines.append(
            f"{pattern or 'all':<8} tried {counts.total():5}, " + ", ".join(f"{k} {counts[k]}" for k in RESULTS)
        )
    for kind, title in (("wrong", "wrong"), ("refused", "plain files that were refused")):
        those = [row for row in rows if row["result"] == kind]
        lines += [f"{title}:"] if those else []
        lines += [f"  {r['seed']} {r['pattern']} {r['shape']}: {r['reason']}" for r in those]
    return "\n".join(lines)


def in_a_fork(seeds: list[int], journal: seed_journal.Journal, keep: Path | None) -> None:
    """Try seeds in a process of their own: the memory that libraries keep goes with it."""
    child = os.fork()
    if not child:
        try:
            for seed in seeds:
                row = tried(seed)
                journal.add(row)
                if row["result"] == "wrong":
                    print(seed, row["pattern"], row["shape"], row["reason"], flush=True)
                    if keep:
                        (keep / str(seed)).mkdir(parents=True, exist_ok=True)
                        laid_down(cam_draws.drawn(seed), keep / str(seed))
        finally:
            os._exit(0)
    os.waitpid(child, 0)


def main() -> int:
    """Try the seeds that the journal has not, and print the table of all."""
    given = seed_journal.parser("cam_files", __doc__, "0:100").parse_args()
    if not given.table:
        left = given.journal.left(given.seeds, given.budget)
        while seeds := list(islice(left, AT_ONCE)):
            in_a_fork(seeds, given.journal, given.keep)
    rows = given.journal.rows(given.seeds)
    return seed_journal.conclude("cam_files.py", rows, table(rows), lambda row: row["result"] == "wrong")


if __name__ == "__main__":
    sys.exit(main())
