r"""Any .LS file, without loss: the bytes as they are, and where in them motions and positions stand.

Text is kept whole; a record is a place in it. So reading and writing unchanged gives the same bytes, and an edit
replaces the bytes of one number and nothing else. A German program is read in English words at the same places. What
is neither motion nor position is opaque: it is never looked into and never changed. Tables are columns (numpy), so that
a million positions are a few arrays.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from heapq import merge

import numpy as np

from compgen.core.arrays import IntArray
from compgen.core.exceptions import InputError
from compgen.fanuc.listing.languages import in_english, in_german, is_german
from compgen.fanuc.listing.lines import end_of_line, letters, line_of
from compgen.fanuc.listing.motions import Motions, read_motions
from compgen.fanuc.listing.position_parser import skip_blanks
from compgen.fanuc.listing.positions import ListedPositions, read_positions
from compgen.fanuc.listing.templates import FEW_TEXTS
from compgen.fanuc.vocabulary import CONTINUATION, GERMAN_HEAD, REMARKS

_BEGIN = rb"(?:\A|(?<=[\r\n]))"  # of a line: ^ knows no lone CR
_TRANSLATED = re.compile(
    _BEGIN + rb"/?(?:PROPRIETAIRE|COMMENTAIRE|COMENTARIO|PROPIETARIO)[ \t]*(?=[=\r\n])", re.IGNORECASE
)
_SECTION = re.compile(rb"/(PROG|ATTR|APPL|MN|POS|END)\b[^\r\n]*", re.IGNORECASE)
_SECOND = re.compile(rb"(?<=[\r\n])/PROG\b", re.IGNORECASE)
_BEHIND_END = b" \t\r\n\f\v\x1a"  # what may follow: blank lines, and the mark at which old editors end a file
_NAME = re.compile(rb"/PROG[ \t]+([^\s]+)[ \t]*([^\r\n]*)", re.IGNORECASE)
_LINE_NUMBER, _FOLLOWING = re.compile(r"[ \t]*\d*[ \t]*:"), re.compile(rb"[\r\n]*[ \t]*:")
_ATTRIBUTE = re.compile(_BEGIN + rb"([A-Z_]+)[ \t]*=([^\r\n]*)", re.IGNORECASE)


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class LsProgram:
    """A program file: its bytes, and what stands where."""

    source: bytes  # the file's
    data: bytes  # the same in English words, byte for byte as long; what is read
    name: str
    subtype: str
    attributes: tuple[tuple[str, str], ...]
    remarks: tuple[str, ...]
    statements: IntArray  # (S,) physical line at which each statement of /MN begins
    motions: Motions
    positions: ListedPositions
    place: IntArray  # (S,) byte at which each of those lines begins

    @property
    def is_german(self) -> bool:
        """Whether its words are those of a controller set to German."""
        return self.data is not self.source

    def own_words(self, text: bytes) -> bytes:
        """A statement of ours in the words of this program's language."""
        return in_german(text) if self.is_german else text

    def motion_text(self, motion: int) -> str:
        """A motion as it is written, in one line."""
        return " ".join(self.text(self.motions.span[motion]).split())

    def text(self, span: Iterable[int]) -> str:
        """The text at a place."""
        start, end = span
        return letters(self.data[start:end].decode("latin-1"))


def loads(source: bytes, few_texts: int = FEW_TEXTS) -> LsProgram:
    """Read a program file.

    Args:
        source: The file's bytes, any line ends, any single-byte code page.
        few_texts: Lines or positions up to which they are read one by one; more are read by columns, to the same.

    Returns:
        The program; ``dumps`` gives the same bytes back.

    Raises:
        InputError: Not a program, truncated, in another language, or a position that cannot be read; names the line.
    """
    data = in_english(source) if is_german(source) else source
    sections = _sections(data)
    head = data[: sections["MN"][0]]
    name_line = _NAME.search(head)
    attributes = tuple(
        (
            GERMAN_HEAD.get(k.decode("latin-1"), k.decode("latin-1")),
            v.decode("latin-1").strip().removesuffix(";").rstrip(),
        )
        for k, v in _ATTRIBUTE.findall(head)
    )
    motions, statements, place, remarks = read_motions(data, *sections["MN"], few_texts)
    positions = read_positions(data, *sections["POS"], few_texts)
    name = name_line.group(1).decode("latin-1") if name_line else ""
    if not name.isprintable() or "/" in name:
        raise InputError(f"program: line 1: its name {name[:40]!r} is none; it has letters, digits, - and _; mend it")
    return LsProgram(
        source=source,
        data=data,
        name=name,
        subtype=name_line.group(2).decode("latin-1").strip() if name_line else "",
        attributes=attributes,
        remarks=remarks,
        statements=statements,
        motions=motions,
        positions=positions,
        place=place,
    )


def dumps(program: LsProgram) -> bytes:
    """The program's bytes."""
    return program.source


def head_text(program: LsProgram) -> str:
    """The text before /MN; a byte of it is a character."""
    return program.data[: _sections(program.data)["MN"][0]].decode("latin-1")


def edited(program: LsProgram, edits: dict[tuple[int, int], bytes]) -> LsProgram:
    """The program with the bytes at some places replaced, read anew.

    Raises:
        InputError: Two places overlap, or the result is no program.
    """
    parts, at = [], 0
    for (start, end), text in sorted(edits.items()):
        if start < at or end < start:
            raise InputError(f"program {program.name}: two edits overlap, or one runs backwards, at byte {start}")
        parts += [program.source[at:start], text]
        at = end
    return loads(b"".join([*parts, program.source[at:]]))


def other_statements(program: LsProgram) -> list[tuple[int, str]]:
    """Line and text of each statement that is neither motion nor remark, wrapped ones as one; comments left out."""
    data, place = program.data, program.place
    other = np.flatnonzero(~np.isin(program.statements, program.motions.line))
    statements = []
    for line, at, k in zip(program.statements[other].tolist(), place[other].tolist(), other.tolist(), strict=True):
        stop = end_of_line(data, at)
        text = letters(data[at:stop].decode("latin-1")).partition(":")[2].strip()
        if text.startswith(REMARKS):
            continue
        if ";" not in text:
            text += _continuation(data, stop, int(place[k + 1]) if k + 1 < len(place) else len(data))
        statements.append((line, text))
    return statements


def statement_texts(program: LsProgram, rows: IntArray | None = None) -> list[str]:
    """Some statements of /MN, or all, each in one line, without its number and what stands behind its end."""
    data = program.data
    ends = np.append(program.place[1:], _end_of_statements(program))
    rows, texts = np.arange(len(program.place)) if rows is None else rows, []
    for start, stop in zip(program.place[rows].tolist(), np.minimum(ends, ends[-1])[rows].tolist(), strict=True):
        lines = data[start:stop].decode("latin-1").splitlines()
        text = " ".join(part for line in lines if (part := _LINE_NUMBER.sub("", line, count=1).strip()))
        head, semicolon, tail = text.rpartition(";")
        if semicolon and tail.strip() and not text.startswith("!"):  # a remark may hold others
            head = text.partition(";")[0]
        texts.append((head if semicolon else text).rstrip())
    return texts


def _end_of_statements(program: LsProgram) -> int:
    """Byte at which the line after the last statement begins, its continuations read."""
    if not len(program.place):
        return 0
    at = end_of_line(program.data, int(program.place[-1]))
    while following := _FOLLOWING.match(program.data, at):
        at = end_of_line(program.data, following.end())
    return at


def _continuation(data: bytes, at: int, limit: int) -> str:
    """The lines that go on with a statement, joined, up to its semicolon."""
    parts = []
    while at < limit and (match := CONTINUATION.match(data, at, limit)):
        parts.append(letters(match[1].decode("latin-1")).strip())
        at = match.end()
        if parts[-1].endswith(";"):
            break
    return " ".join(["", *parts]) if parts else ""


def _sections(data: bytes) -> dict[str, tuple[int, int]]:
    """Bytes of /MN and /POS, after their tags."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise InputError("program: line 1: it is UTF-16 text; save it with one byte a character (ASCII, Latin-1)")
    if data.startswith(b"\xef\xbb\xbf"):
        raise InputError("program: line 1: a byte order mark (BOM) stands before /PROG; save it without one, as ASCII")
    start = data.lstrip()[:5]
    if start[:5].upper() != b"/PROG":
        if b"\0" in data[:4096]:
            raise InputError("program: this is a binary file; convert the .TP to .LS on the controller first")
        raise InputError("program: line 1: it does not begin with /PROG; give a program listing (.LS)")
    tags_found = _tags(data)
    tags = [tag for tag, _, _ in tags_found]
    if _TRANSLATED.search(data, 0, tags_found[tags.index("MN")][1] if "MN" in tags else len(data)):
        raise InputError("program: its keywords are in another language; export it from one set to English (or German)")
    if "MN" not in tags:
        raise InputError("program: /MN is missing; is this a complete .LS file?")
    mn = tags.index("MN")
    after = [t for t in tags_found[mn + 1 :] if t[0] in ("POS", "END")]
    if not any(t[0] == "END" for t in after):
        raise InputError(f"program: line {line_of(data, len(data))}: /END is missing; the file is cut off")
    end = next(t for t in after if t[0] == "END")
    if second := _SECOND.search(data, end[2]):
        line = line_of(data, second.start())
        raise InputError(f"program: line {line}: a second program begins after /END; give it its own file")
    behind = end[1] + len("/END")
    behind += data[behind : behind + 1] == b"."  # generated files close with /END.
    if (behind := skip_blanks(data, behind, len(data), _BEHIND_END)) < len(data):
        raise InputError(f"program: line {line_of(data, behind)}: text stands behind /END; remove it")
    pos = next((t for t in after if t[0] == "POS" and t[1] < end[1]), None)
    stop = pos[1] if pos else end[1]
    return {"MN": (tags_found[mn][2], stop), "POS": (pos[2], end[1]) if pos else (end[1], end[1])}


def _tags(data: bytes) -> list[tuple[str, int, int]]:
    """Section tags at the beginning of a line up to the program's /END, and where each stands; of /MN the first."""
    tags: list[tuple[str, int, int]] = []
    has_statements = False
    for at in merge([0], *((m.start() + 1 for m in re.finditer(mark, data)) for mark in (rb"\n/", rb"\r/"))):
        if match := _SECTION.match(data, at):
            tag = match[1].decode().upper()
            if tag == "MN" and has_statements:
                continue
            tags.append((tag, match.start(), match.end()))
            has_statements |= tag == "MN"
            if tag == "END" and has_statements:
                break
    return tags
