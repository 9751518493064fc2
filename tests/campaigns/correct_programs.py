"""Programs whose every statement is known, at the correction: judged by what each statement means, told here once more.

python tests/campaigns/correct_programs.py --seeds 0:2000            draws, judges and adds to a journal; again goes on
python tests/campaigns/correct_programs.py --seeds 0:2000 --table    only the table of what is in the journal

A seed draws a program of motions (J, L, C; Cartesian and joint form, frames, FINE and CNT, twin places, options)
between other statements. The judge knows of each motion whether its place may be corrected. It reads both texts with
the second reader and drives the second arm: a corrected place is where it was planned, a held one is as it was, and
nothing but numbers of positions has changed.
"""

import random
import re
import sys
import traceback
from collections import Counter
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[n]) for n in (2, 1, 0)]

import naive_ls  # noqa: E402
import numpy as np  # noqa: E402
import seed_journal  # noqa: E402
from corrected import MANY, corrected, missed_um  # noqa: E402
from ls_text import at, joint_form  # noqa: E402
from shipped import ROOT  # noqa: E402
from shrinking import shrunk  # noqa: E402

from compgen.core.exceptions import CompgenError  # noqa: E402
from compgen.pipelines.files.robot_file import load_cell  # noqa: E402

MISSED_UM = 1.2  # 0.87 of rounding to 0.001 mm, and what the arm cools in a minute of a slow program
HOME = (10.0, 20.0, -15.0, 30.0, -60.0, 45.0)
#: Statements that neither move the arm nor change where a position is.
STILL = (
    "!a remark", "//J P[1] 100% FINE", "--eg: a note", "WAIT    .10(sec)", "WAIT DI[3]=ON", "DO[1]=ON", "R[1]=R[1]+1",
    "F[2]=(OFF)", "OVERRIDE=100%", "TIMER[1]=START", "MESSAGE[part]", "PAYLOAD[1]", "GO[1]=3", "AO[1]=1.5",
    "LBL[7:here]", "IF R[2]=1,JMP LBL[99]", "UALM[1]", "PR[5]=LPOS", "", "COL DETECT ON",
)  # fmt: skip
#: Options that leave the place where the position is.
SAFE = ("", "", "", "ACC80", "TB    .10sec,DO[1]=ON", "Wjnt", "DB   5.0mm,DO[2]=OFF")
#: Options with which the arm goes elsewhere, or nobody knows where.
ELSEWHERE = (
    "Offset,PR[3]",
    "Tool_Offset,PR[4]",
    "INC",
    "Skip,LBL[9]",
    "SkipJump,LBL[9]",
    "VOFFSET,VR[1]",
    "UNKNOWN_WORD",
)
#: Pairs between which no place is what it says.
DIVERSIONS = (("Weave Sine[1]", "Weave End"), ("Touch Offset SR[1],PR[5],PR[6]", "Touch Offset End"))

Line = tuple[str, tuple[tuple[int, bool], ...]]  # a statement, and of each position it names whether it may move


def drawn(seed: int) -> tuple[list[Line], dict[int, tuple[str, tuple[float, ...]]]]:
    """Statements, and each position's text and pendant angles."""
    rng = random.Random(seed)
    frame, tool = rng.randint(0, 9), rng.randint(0, 9)
    positions: dict[int, tuple[str, tuple[float, ...]]] = {}
    q = np.array(HOME)

    def position() -> int:
        nonlocal q
        if positions and rng.random() < 0.1:
            return rng.choice(list(positions))
        q = np.clip(q + [rng.uniform(-4, 4) for _ in range(6)], np.array(HOME) - 15, np.array(HOME) + 15)
        n = len(positions) + 1
        form = joint_form(n, q, frame, tool) if rng.random() < 0.2 else at(n, q, numbered=(frame, tool))
        positions[n] = form, tuple(q)
        return n

    lines: list[Line] = [(f"UFRAME_NUM={frame}", ()), (f"UTOOL_NUM={tool}", ())]
    diverted = ""
    first = True
    for _ in range(rng.randint(3, 25)):
        draw = rng.random()
        if draw < 0.35 and not first:
            lines.append((rng.choice(STILL), ()))
        elif draw < 0.38 and not first and not diverted:
            begin, diverted = rng.choice(DIVERSIONS)
            lines.append((begin, ()))
        elif draw < 0.45 and diverted:
            lines.append((diverted, ()))
            diverted = ""
        else:
            lines.append(motion(rng, position, first, bool(diverted)))
            first = False
    if diverted:
        lines.append((diverted, ()))
    return [*lines, ("LBL[9]", ()), ("LBL[99]", ())], positions


def motion(rng: random.Random, position, first: bool, diverted: bool) -> Line:
    """A motion, and whether its places may be corrected."""
    letter = "J" if first else rng.choices("JLC", (3, 6, 1))[0]
    option = "" if first else rng.choice(SAFE) if rng.random() < 0.85 else rng.choice(ELSEWHERE)
    speed = rng.choice(("100%", "30%")) if letter == "J" else rng.choice(("250mm/sec", "900cm/min", "100.5mm/sec"))
    end = rng.choice(("FINE", "CNT0", "CNT50", "CNT100"))
    may = not diverted and option not in ELSEWHERE
    n = position()
    if letter == "C":
        last = position()
        return f"C P[{n}]\n    :  P[{last}] {speed} {end} {option}".rstrip(), ((n, may), (last, may))
    return f"{letter} P[{n}] {speed} {end} {option}".rstrip(), ((n, may),)


def text_of(lines: list[Line], positions: dict) -> bytes:
    """The file of some statements, with the positions that they name."""
    body = "".join(
        f"{k:4d}:{s if s[:2] in ('J ', 'L ', 'C ') else '  ' + s}    ;\n" for k, (s, _) in enumerate(lines, 1)
    )
    named = sorted({n for _, places in lines for n, _ in places})
    return f"/PROG  T\n/ATTR\n/MN\n{body}/POS\n{''.join(positions[n][0] for n in named)}/END\n".encode()


def judged(lines: list[Line], positions: dict, cell: object) -> tuple[str, str]:
    """``corrected``, ``passed through``, ``refused`` or ``wrong``, and why."""
    planned = text_of(lines, positions)
    try:
        result = corrected(planned, cell, MANY)
    except CompgenError as refusal:
        return "refused", str(refusal)
    except Exception:
        return "wrong", traceback.format_exc()
    text = result.text
    before, after = naive_ls.read(planned), naive_ls.read(text)
    if before[1] != after[1]:
        return "wrong", "a motion has changed"
    if without_numbers(planned) != without_numbers(text):
        return "wrong", "more than numbers of positions has changed"
    may: dict[int, bool] = {}
    for _, places in lines:
        for n, is_free in places:
            may[n] = may.get(n, True) and is_free
    moved = 0
    for n, is_free in may.items():
        same = before[0][n] == after[0][n]
        if not is_free and not same:
            return "wrong", f"P[{n}] is held, and has moved"
        if is_free:
            missed = missed_um(planned, text, n, positions[n][1])
            if same and missed > 50:
                return "wrong", f"P[{n}] may be corrected, and is not: {missed:.0f} um"
            if not same and missed > allowed(positions[n][0]):
                return "wrong", f"P[{n}] is missed by {missed:.2f} um"
            moved += not same
    return ("corrected" if moved else "passed through"), f"{moved} of {len(may)} positions"


def allowed(form: str) -> float:
    """How far a corrected place may be missed [um]: 0.001 deg on a joint moves the tool by up to 26 um."""
    return 40.0 if "J1" in form else MISSED_UM


def without_numbers(text: bytes) -> bytes:
    """A program without the numbers of its positions."""
    head, tag, positions = text.partition(b"/POS")
    return head + tag + re.sub(rb"[-\d.]+(?= *(?:mm|deg))", b"#", re.sub(rb"= +", b"= ", positions))


def tried(seed: int, cell: object) -> dict:
    """A row of the journal."""
    lines, positions = drawn(seed)
    result, reason = judged(lines, positions, cell)
    row = {"seed": seed, "result": result, "reason": reason}
    if result == "wrong":
        kind = re.sub(r"[\d.]+", "", reason)

        def fails(fewer: list[Line]) -> bool:
            other, why = judged(fewer, positions, cell)
            return other == "wrong" and re.sub(r"[\d.]+", "", why) == kind

        row["program"] = text_of(shrunk(lines, fails), positions).decode()
    return row


def table(rows: list[dict]) -> str:
    """Counts, and whatever is wrong."""
    counts = Counter(row["result"] for row in rows)
    kinds = ("corrected", "passed through", "refused", "wrong")
    head = f"seeds {seed_journal.ranges_of(row['seed'] for row in rows)}: tried {len(rows)}, "
    head += ", ".join(f"{kind} {counts[kind]}" for kind in kinds)
    return "\n".join([head, *(f"  {row['seed']}: {row['reason']}" for row in rows if row["result"] == "wrong")])


def main() -> int:
    """Try the seeds that the journal has not, and print the table of all."""
    given = seed_journal.parser("correct_programs", __doc__, "0:50").parse_args()
    cell = load_cell(str(ROOT / "robots" / "m710ic50.toml"))
    for seed in () if given.table else given.journal.left(given.seeds, given.budget):
        row = tried(seed, cell)
        given.journal.add(row)
        if row["result"] == "wrong":
            print(seed, row["reason"], row["program"], sep="\n", flush=True)
    rows = given.journal.rows(given.seeds)
    return seed_journal.conclude("correct_programs.py", rows, table(rows), lambda row: row["result"] == "wrong")


if __name__ == "__main__":
    sys.exit(main())
