r"""Statements of /MN, written and given back: the same where only print differs.

A controller numbers lines anew (or hides the numbers, $LN_DISP), sets blanks as it likes, drops zeros (``.10sec``),
says the names of registers and signals in their brackets (``R[5:COUNT]``, $MNDSP_CMNT) and capitals on some versions.
None of this changes what is run. What is left of a statement without it is compared, one after the other, in order;
remarks too, for they say which version of a program it is.
"""

import re
from difflib import SequenceMatcher

import numpy as np

from compgen.fanuc.comparison import NOTHING, Difference
from compgen.fanuc.listing.listing import LsProgram, statement_texts

LONGEST_ALIGNED = 2000  # statements between the first and the last that differ, that are searched for what was moved
_NAMED = re.compile(r"\[[ \t]*(?:\d+|A?R\[[ \t]*\d+)[ \t]*(?=:)")  # a number with a name behind it, inside brackets
_GROUP = re.compile(r"^(U(?:FRAME|TOOL)_NUM)\[GP1\]", re.IGNORECASE)
_NUMBER = re.compile(r"(?<![\w.])(?:\d+\.\d*|\.\d+|\d+)")
_MOTION_PARTS = re.compile(
    r"([A-Z])((?:P|PR|PAL_\d+)\[.*?\](?:(?:P|PR)\[.*?\])?)([\d.]+[A-Z%/]+|A?R\[.*?\][A-Z%/]+|[A-Z_]+?)(FINE|CNT.*?|C[RD]\d+)(?=[^\d]|$)(.*)"
)
_PARTS = ("letter", "target", "speed", "termination", "options")


def compare_statements(written: LsProgram, backup: LsProgram) -> list[Difference]:
    """What differs in the order they stand, each with the lines of both files."""
    texts = [statement_texts(program) for program in (written, backup)]
    cores = [[core(text) for text in column] for column in texts]
    if cores[0] == cores[1]:
        return []
    first, ends = _changed_part(*cores)
    middle = [column[first:end] for column, end in zip(cores, ends, strict=False)]
    lines = [program.statements.tolist() for program in (written, backup)]
    differences = []
    for a, b in _pairs(*middle):
        i, j = None if a is None else first + a, None if b is None else first + b
        where = "line " + " / ".join(
            "-" if k is None else str(column[k]) for k, column in zip((i, j), lines, strict=False)
        )
        sides = [NOTHING if k is None else column[k] or "blank" for k, column in zip((i, j), texts, strict=False)]
        what = "statement" if i is None or j is None else _part_that_differs(cores[0][i], cores[1][j])
        differences.append(Difference(where, what, sides[0], sides[1]))
    return differences


def core(text: str) -> str:
    """What a statement says, whatever its print."""
    if text.startswith(("!", "--")):
        return " ".join(text.upper().split())
    text = _NUMBER.sub(lambda m: _plain_number(m[0]), _without_names(text))
    return re.sub(r"\s+", "", _GROUP.sub(r"\1", text.strip())).upper()


def _without_names(text: str) -> str:
    """The text without what stands behind a colon in brackets that begin with a number."""
    while (named := _NAMED.search(text)) is not None:
        at, depth = named.end(), 1
        while at < len(text) and depth:
            depth += (text[at] == "[") - (text[at] == "]")
            at += 1
        text = text[: named.end()] + text[at - 1 :] if not depth else text[: named.end()] + text[named.end() + 1 :]
    return text


def _plain_number(number: str) -> str:
    """A number without zeros that say nothing."""
    whole, point, fraction = number.partition(".")
    fraction = fraction.rstrip("0")
    return (whole.lstrip("0") or "0") + (f".{fraction}" if point and fraction else "")


def _changed_part(a: list[str], b: list[str]) -> tuple[int, tuple[int, int]]:
    """Where two lists begin to differ, and behind the last difference in each."""
    shorter = min(len(a), len(b))
    first = next((k for k in range(shorter) if a[k] != b[k]), shorter)
    last = next((k for k in range(shorter - first) if a[-1 - k] != b[-1 - k]), shorter - first)
    return first, (len(a) - last, len(b) - last)


def _pairs(a: list[str], b: list[str]) -> list[tuple[int | None, int | None]]:
    """What stands for what, of statements that are not the same: numbers into both, None for what is missing."""
    if max(len(a), len(b)) > LONGEST_ALIGNED:
        n = min(len(a), len(b))
        unequal = np.flatnonzero([x != y for x, y in zip(a, b, strict=False)]).tolist()
        rest = [(k, None) for k in range(n, len(a))] + [(None, k) for k in range(n, len(b))]
        return [*((k, k) for k in unequal), *rest]
    pairs: list[tuple[int | None, int | None]] = []
    for word, i, i_end, j, j_end in SequenceMatcher(None, a, b, autojunk=False).get_opcodes():
        if word == "equal":
            continue
        n = min(i_end - i, j_end - j)
        pairs += [(i + k, j + k) for k in range(n)]
        pairs += [(k, None) for k in range(i + n, i_end)] + [(None, k) for k in range(j + n, j_end)]
    return pairs


def _part_that_differs(a: str, b: str) -> str:
    """What of a motion differs, or what kind of statement it is."""
    if a.startswith("!") and b.startswith("!"):
        return "remark"
    parts = [_MOTION_PARTS.fullmatch(text) for text in (a, b)]
    if not all(parts):
        return "statement"
    pair = [match.groups() for match in parts if match]
    return ", ".join(name for name, x, y in zip(_PARTS, *pair, strict=True) if x != y)
