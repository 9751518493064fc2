"""Programs of a controller set to German: read in English words at the same places, written in their own.

The words are the vocabulary's. Each line keeps its length in bytes: what an English word saves stands as blanks before
the line's semicolon, what it needs more is taken from the line's blanks. So a place in what is read is a place in the
file, and an edit changes the file's own bytes.
"""

import re
from collections.abc import Collection, Mapping
from itertools import count

from compgen.core.exceptions import InputError
from compgen.fanuc.vocabulary import GERMAN, GERMAN_HEAD, GERMAN_REGISTERS

_STATEMENTS = r"AUFRUF|WARTE|WENN|SPRUNG|LABEL\[|BENUTZER_NUM|WKZ_NUM|TRAGLST"
#: Where a program says that it is German: a key of its head, a statement behind the end of another, the speed of a
#: motion, the posture of a position. Remarks of an English program may be German, and wrap to lines of their own.
_SIGNS = re.compile(
    rb"(?:\A|(?<=[\r\n]))(?:(?:EIGN\.|" + "|".join(GERMAN_HEAD).encode() + rb")[ \t]*="
    rb"|[ \t]*UF[ \t]*:[^'\r\n]*\bKONFIG[ \t]*:[ \t]*'"
    rb"|[ \t]*\d*[ \t]*:[ \t]*[JLCAS][ \t]+P[^;!\r\n]*[\d\]][ \t]*(?:mm/|deg/|m)?sek\b)"
    rb"|(?:;|/MN)[ \t]*[\r\n]+[ \t]*\d*[ \t]*:[ \t]*(?:" + _STATEMENTS.encode() + rb")"
)
#: One of them is in what has a sign; they are sought much faster than a pattern.
_HINTS = [word.replace("\\", "").encode() for word in ("EIGN.", "KONFIG", "sek", *GERMAN_HEAD, *_STATEMENTS.split("|"))]
LOOKED_AT = 50_000  # bytes: some hundred statements, or positions
_REMARK = re.compile(rb"[ \t]*\d*[ \t]*:[ \t]*(?://)?[ \t]*(?:!|--)")
_POS, _POSTURE = re.compile(rb"(?<=[\r\n])/POS\b"), re.compile(rb"\bKONFIG(?=[ \t]*:)")  # as long in English
_BLANK = re.compile(rb"[ \t]")
#: Texts of the user's, that no word is in: names in brackets, quotes and messages, and of programs.
_TEXTS = (
    r"\[[ \t]*\d+[ \t]*:[^\]\r\n]*|'[^'\r\n]*'|\"[^\"\r\n]*\"|(?<=MELDUNG|MESSAGE)\[[^\]\r\n]*"
    r"|(?<=/PROG)[ \t]+\S+|(?<=AUFRUF )[^\s(;]+|(?<=CALL )[^\s(;]+"
)


def _either(words: Collection[str]) -> str:
    return "|".join(re.escape(word) for word in sorted(words, key=len, reverse=True))


def _pattern(words: Collection[str], registers: Collection[str], second: str) -> re.Pattern[bytes]:
    begin = r"(?<![\w$.])(?<!\w/)"
    return re.compile(
        rf"{_TEXTS}|(?P<word>{begin}(?:{_either(words)})(?![\w.])|{begin}(?:{_either(registers)})(?=\[)"
        rf"|(?<![A-Za-z])m?{second}\b)".encode()
    )


_TO_ENGLISH = _pattern(GERMAN, GERMAN_REGISTERS, "sek")
_TO_GERMAN = _pattern(GERMAN.values(), GERMAN_REGISTERS.values(), "sec")
_ENGLISH_WORDS = {**GERMAN, **GERMAN_REGISTERS, "sek": "sec", "msek": "msec"}
_GERMAN_WORDS = {english: german for german, english in _ENGLISH_WORDS.items()}


def is_german(source: bytes) -> bool:
    """Whether a program says that it is of a controller set to German; looked for where it begins and where it ends."""
    ends = source if len(source) <= 2 * LOOKED_AT else source[:LOOKED_AT] + b"\n" + source[-LOOKED_AT:]
    return any(hint in ends for hint in _HINTS) and _SIGNS.search(ends) is not None


def in_english(source: bytes) -> bytes:
    """A German program in English words, each line as long as it was.

    Raises:
        InputError: A line has no room for its words; names it.
    """
    positions = tag.start() if (tag := _POS.search(source)) else len(source)
    lines = source[:positions].splitlines(keepends=True)
    return b"".join(map(_english_line, lines, count(1))) + _POSTURE.sub(GERMAN["KONFIG"].encode(), source[positions:])


def _english_line(line: bytes, number: int) -> bytes:
    text = _replaced(line, _TO_ENGLISH, _ENGLISH_WORDS)
    if len(text) > len(line):
        text = _BLANK.sub(b"", text, count=len(text) - len(line))
    if len(text) > len(line):
        raise InputError(f"program: line {number}: its German words cannot be read without blanks; put some in")
    end = text.find(b";")
    end = end if end >= 0 else len(text.rstrip(b"\r\n"))
    return text[:end] + b" " * (len(line) - len(text)) + text[end:]


def in_german(text: bytes) -> bytes:
    """A statement of ours in German words."""
    return _replaced(text, _TO_GERMAN, _GERMAN_WORDS)


def _replaced(text: bytes, pattern: re.Pattern[bytes], words: Mapping[str, str]) -> bytes:
    if _REMARK.match(text):
        return text
    return pattern.sub(lambda m: words[m["word"].decode()].encode() if m["word"] else m[0], text)
