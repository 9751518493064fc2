r"""A program as a controller gives it back (an ASCII backup), against what was written.

Sizes, dates, owner, task data and write protection of the head are the controller's own. Its name, its comment and the
motion groups are compared, and what a controller adds under /APPL that may change the path is told.

A controller keeps numbers as IEEE singles and prints them with decimals of its own (three, newer ones six). So a number
a that was written may come back as any b with

    |b - a| <= u / 2 + ulp(a) / 2,     u = 10^-decimals of b,     ulp(a) of a single at a

which for three decimals on both sides and up to 8 m is b = a. One with fewer decimals than were written is another
number: it says less. So is one in another unit. W, P and R that differ by whole turns turn alike. An
extended axis that was not written may come back as zero.

Statements of /MN, written and given back: the same where only print differs.

A controller numbers lines anew (or hides the numbers, $LN_DISP), sets blanks as it likes, drops zeros (``.10sec``),
says the names of registers and signals in their brackets (``R[5:COUNT]``, $MNDSP_CMNT) and capitals on some versions.
None of this changes what is run. What is left of a statement without it is compared, one after the other, in order;
remarks too, for they say which version of a program it is.

A program as it was written and as a controller gives it back, and one thing in which they differ.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from typing import Any

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.fanuc.listing.listing import LsProgram, head_text, statement_texts
from compgen.fanuc.listing.position_parser import AXES, NO_NUMBER
from compgen.fanuc.listing.positions import ListedPositions, decimal_places, units
from compgen.fanuc.vocabulary import UNSAFE_HEADERS

NOTHING = "-"  # where the other one has something
_GROUPS = 64  # more than a controller has: (position, group) as one number
_ANGLES, _EXTENDED = slice(3, 6), slice(15, 18)
_WHOLE_TURN = 360.0
_SLACK = 1e-9  # of decimals as doubles have them
LONGEST_ALIGNED = 2000  # statements between the first and the last that differ, that are searched for what was moved
_NAMED = re.compile(r"\[[ \t]*(?:\d+|A?R\[[ \t]*\d+)[ \t]*(?=:)")  # a number with a name behind it, inside brackets
_GROUP = re.compile(r"^(U(?:FRAME|TOOL)_NUM)\[GP1\]", re.IGNORECASE)
_NUMBER = re.compile(r"(?<![\w.])(?:\d+\.\d*|\.\d+|\d+)")
_MOTION_PARTS = re.compile(
    r"([A-Z])((?:P|PR|PAL_\d+)\[.*?\](?:(?:P|PR)\[.*?\])?)([\d.]+[A-Z%/]+|A?R\[.*?\][A-Z%/]+|[A-Z_]+?)(FINE|CNT.*?|C[RD]\d+)(?=[^\d]|$)(.*)"
)
_PARTS = ("letter", "target", "speed", "termination", "options")


@dataclass(frozen=True, slots=True)
class Difference:
    """What was written and what came back, as texts."""

    where: str  # "P[17]", "line 24", "head"
    what: str  # "X", "speed", "statement", ...
    written: str
    backup: str

    def __str__(self) -> str:
        return f"{self.where}: {self.what}: written {self.written}, backup {self.backup}"

    def record(self) -> dict[str, str]:
        """The difference as a report writes it."""
        return {"where": self.where, "what": self.what, "written": self.written, "backup": self.backup}


@dataclass(frozen=True, eq=False, slots=True)
class ComparedPositions:
    """What came of it."""

    count: int  # positions that both have
    differences: tuple[Difference, ...]
    step: float  # mm or deg: the coarser of the last digits


def compare_positions(written: LsProgram, backup: LsProgram) -> ComparedPositions:
    """Differences of all positions, by number, whatever the order in which they stand."""
    a, b = written.positions, backup.positions
    keys = [p.number * _GROUPS + p.group.clip(min=1) for p in (a, b)]
    _, i, j = np.intersect1d(*keys, return_indices=True)
    differences = _frames(a, b, i, j)
    wanted, given = _Numbers.of(written, i), _Numbers.of(backup, j)
    other_unit = (wanted.unit != given.unit) & (wanted.unit != "") & (given.unit != "")
    same = _same(wanted, given) & ~other_unit
    for k, column in zip(*(~same).nonzero(), strict=True):
        name = f"{'R' if a.remote[i[k]] and column < 6 else ''}{AXES[column]}"
        texts = [n.text(p, k, column, other_unit) for n, p in ((wanted, written), (given, backup))]
        differences.append((int(i[k]), 4 + int(column), Difference(_name(a, int(i[k])), name, *texts)))
    ordered = [difference for _, _, difference in sorted(differences, key=lambda d: d[:2])]
    for p, rows, pair in (
        (a, np.setdiff1d(np.arange(len(a.number)), i), ("there", NOTHING)),
        (b, np.setdiff1d(np.arange(len(b.number)), j), (NOTHING, "there")),
    ):
        ordered += [Difference(_name(p, row), "position", *pair) for row in rows.tolist()]
    steps = [n.step[n.given].max(initial=0.0) for n in (wanted, given)]
    return ComparedPositions(len(np.unique(a.number[i])), tuple(ordered), float(max(steps)))


def _name(p: ListedPositions, row: int) -> str:
    group = int(p.group[row])
    return f"P[{p.number[row]}]" + (f" GP{group}" if group > 1 else "")


def _frames(a: ListedPositions, b: ListedPositions, i: IntArray, j: IntArray) -> list[tuple[int, int, Difference]]:
    """Differences of frame, tool and CONFIG, each with its row and its place in the position."""
    differences = []
    columns: Sequence[tuple[str, IntArray, IntArray]] = (("UF", a.uframe, b.uframe), ("UT", a.utool, b.utool))
    for place, (what, x, y) in enumerate(columns):
        for k in np.flatnonzero(x[i] != y[j]).tolist():
            texts = ["F" if v == NO_NUMBER else str(v) for v in (x[i[k]], y[j[k]])]
            differences.append((int(i[k]), place, Difference(_name(a, int(i[k])), what, *texts)))
    plain: dict[str | None, str] = {}
    for row, other in zip(i.tolist(), j.tolist(), strict=True):
        texts = [a.config[row], b.config[other]]
        if texts[0] == texts[1]:
            continue
        cores = [plain.setdefault(text, "".join((text or "").split()).upper()) for text in texts]
        if cores[0] != cores[1]:
            sides = [NOTHING if text is None else f"'{text}'" for text in texts]
            differences.append((row, 2, Difference(_name(a, row), "CONFIG", *sides)))
    return differences


@dataclass(frozen=True, eq=False, slots=True)
class _Numbers:
    """Numbers of n positions, in the columns of ``AXES``."""

    value: Array  # (n, 18) NaN for ****
    span: IntArray  # (n, 18, 2)
    given: BoolArray  # (n, 18)
    step: Array  # (n, 18) one unit of the last digit
    unit: np.ndarray  # (n, 18) "mm", "deg", or "" where it has none

    @classmethod
    def of(cls, program: LsProgram, rows: IntArray) -> "_Numbers":
        """Those of some rows of a program's table."""
        span = program.positions.span[rows]
        given = span[..., 1] > 0
        step = np.asarray(10.0 ** -decimal_places(program.data, span), dtype=float)
        return cls(program.positions.value[rows], span, given, step, units(program.data, span))

    def text(self, program: LsProgram, row: int, column: int, with_unit: BoolArray) -> str:
        """A number as it stands in the file."""
        if not self.given[row, column]:
            return NOTHING
        number = program.text(self.span[row, column])
        return f"{number} {self.unit[row, column]}".rstrip() if with_unit[row, column] else number


def _same(a: _Numbers, b: _Numbers) -> BoolArray:
    """Which numbers are the same, (n, 18)."""
    apart = np.abs(b.value - a.value)
    turn = apart[:, _ANGLES] % _WHOLE_TURN
    apart[:, _ANGLES] = np.minimum(turn, _WHOLE_TURN - turn)
    ulp = np.spacing(np.abs(np.nan_to_num(a.value)).astype(np.float32)).astype(float)
    # both on one grid: a step off is a step off, however coarse a single is
    same = (apart <= b.step / 2 + ulp / 2 + _SLACK) & (b.step <= a.step * (1 + _SLACK))
    same |= np.isnan(a.value) & np.isnan(b.value) & (a.given == b.given)
    only_zero = ~a.given & b.given & (b.value == 0)
    same[:, _EXTENDED] |= only_zero[:, _EXTENDED]
    return np.asarray(same)


@dataclass(frozen=True, slots=True, kw_only=True)
class ComparedProgram:
    """One program, written and given back."""

    name: str
    statements: int
    positions: int
    step: float  # mm or deg: the coarser of the last digits
    differences: tuple[Difference, ...]
    notes: tuple[str, ...]

    def record(self) -> dict[str, Any]:
        """The comparison as JSON has it, every difference among it."""
        return {
            "name": self.name,
            "same": not self.differences,
            "statements": self.statements,
            "positions": self.positions,
            "compared_to": self.step,
            "differences": [difference.record() for difference in self.differences],
            "notes": list(self.notes),
        }

    def lines(self, first: int) -> list[str]:
        """The comparison in words: that it is the same, or its first differences."""
        how = f"the same: {self.statements} statements, {self.positions} positions, to {self.step:g}"
        ending = "s" if len(self.differences) > 1 else ""
        how = f"{len(self.differences)} difference{ending}" if self.differences else how
        lines = [f"{self.name}: {how}", *(f"  {difference}" for difference in self.differences[:first])]
        if len(self.differences) > first:
            lines.append(f"  and {len(self.differences) - first} more (--first N, or --json)")
        lines += [f"  note: {note}" for note in self.notes]
        return [line.encode("ascii", "backslashreplace").decode() for line in lines]


def compare_programs(written: LsProgram, backup: LsProgram) -> ComparedProgram:
    """What differs between a program and what a controller gives back of it."""
    positions = compare_positions(written, backup)
    notes = []
    if written.data == backup.data:
        notes.append(
            "byte for byte what was written: a controller prints dates and sizes of its own; is it its backup?"
        )
    heads = [head_text(program) for program in (written, backup)]
    notes += [h.reason for h in UNSAFE_HEADERS if h.pattern.search(heads[1]) and not h.pattern.search(heads[0])]
    return ComparedProgram(
        name=written.name,
        statements=len(written.statements),
        positions=positions.count,
        step=positions.step,
        differences=(*_head_differences(written, backup), *compare_statements(written, backup), *positions.differences),
        notes=tuple(notes),
    )


def not_there(name: str) -> ComparedProgram:
    """A program that was written and that the backup has not."""
    return ComparedProgram(
        name=name,
        statements=0,
        positions=0,
        step=0.0,
        differences=(Difference(name, "program", "there", NOTHING),),
        notes=(),
    )


def _head_differences(written: LsProgram, backup: LsProgram) -> list[Difference]:
    """Name, comment and motion groups."""
    facts = []
    for program in (written, backup):
        attributes = dict(program.attributes)
        comment = attributes.get("COMMENT", "").strip().strip('"').strip()
        groups = attributes.get("DEFAULT_GROUP", "").replace(" ", "").rstrip(",*")
        facts.append({"name": program.name, "COMMENT": comment, "DEFAULT_GROUP": groups})
    return [
        Difference("head", key, facts[0][key] or NOTHING, facts[1][key] or NOTHING)
        for key in facts[0]
        if facts[0][key].upper() != facts[1][key].upper()
    ]


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
