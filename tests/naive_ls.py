"""A second reader of .LS files, line by line and character by character, to check the first against.

It is slow, it has no regular expressions, and it shares nothing with the package: two readers that agree on every
number were wrong in the same way or are right.
"""

from dataclasses import dataclass, field

BLANKS = " \t"
UNITS = ("%", "mm/sec", "cm/min", "inch/min", "deg/sec", "msec", "sec")
FIRST_JOINTS = ("J1", "J2", "J3", "J4", "J5", "J6")
AXES = ("X", "Y", "Z", "W", "P", "R", *(f"J{i}" for i in range(1, 10)), "E1", "E2", "E3")


@dataclass
class Group:
    axes: dict[str, float | None] = field(default_factory=dict)
    uf: int | None = None
    ut: int | None = None
    config: str | None = None
    remote: bool = False  # RX to RR, kept as X to R


@dataclass
class Position:
    name: str
    groups: dict[int, Group] = field(default_factory=dict)


@dataclass
class Move:
    letter: str
    targets: tuple[str, ...]
    speed: str
    termination: str
    rest: str
    disabled: bool


def read(data: bytes) -> tuple[dict[int, Position], list[Move]]:
    """Positions by number, and motions in order."""
    parts = sections(lines_of(data.decode("latin-1")))
    if parts.pop("END", []):
        raise ValueError("text behind /END")
    return positions(parts.get("POS", [])), motions(parts.get("MN", []))


def mm_s(speed: str) -> float:
    """A motion's speed in mm/s; ValueError for one that is no such speed."""
    for unit, factor in {"mm/sec": 1.0, "cm/min": 10 / 60, "inch/min": 25.4 / 60}.items():
        if speed.endswith(unit):
            return float(speed[: -len(unit)]) * factor
    raise ValueError(f"not in mm a second: {speed!r}")


def lines_of(text: str) -> list[str]:
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


HEAD, BODY = ("PROG", "ATTR", "APPL", "MN"), ("MN", "POS", "END")


def sections(lines: list[str]) -> dict[str, list[str]]:
    """Lines by section; a title out of order is a line as any other."""
    parts: dict[str, list[str]] = {}
    current: list[str] = []
    expected: tuple[str, ...] = HEAD
    for number, line in enumerate(lines):
        for tag in expected if line[:1] == "/" else ():
            after = line[len(tag) + 1 : len(tag) + 2]
            if line[: len(tag) + 1].upper() == "/" + tag and not (
                after.isascii() and (after.isalnum() or after == "_")
            ):
                current = parts.setdefault(tag, [])
                if tag == "END":
                    parts[tag] = behind_end(line[4:], lines[number + 1 :])
                    return parts
                expected = BODY if "MN" in parts else HEAD
                break
        else:
            current.append(line)
    return parts


def behind_end(rest: str, lines: list[str]) -> list[str]:
    """What says something behind /END, or /END. of generated files."""
    texts = [rest[1:] if rest[:1] == "." else rest, *lines]
    return [text for text in texts if any(c not in " \t\f\v\x1a" for c in text)]


# Motions ---------------------------------------------------------------------------------------------------------


def motions(lines: list[str]) -> list[Move]:
    moves = []
    for statement in statements(lines):
        text = statement.strip(BLANKS)
        disabled = text.startswith("//")
        text = text[2:].strip(BLANKS) if disabled else text
        if text[:1].upper() not in tuple("JLCAS") or text[1:2] not in tuple(BLANKS):
            continue
        if starts_target(text[1:].strip(BLANKS)):
            moves.append(move(text[0].upper(), text[1:].strip(BLANKS), disabled))
    return moves


def statements(lines: list[str]) -> list[str]:
    """Each statement's text up to its semicolon, continuation lines joined by a blank."""
    texts: list[str] = []
    open_text: str | None = None
    for line in lines:
        number, colon, body = line.partition(":")
        label = number.strip(BLANKS)
        if not colon or not all(c in "0123456789" for c in label):
            continue
        if open_text is not None and label:
            texts.append(open_text)
            open_text = None
        elif open_text is not None and open_text.strip(BLANKS + "/").upper() in ("", *"JLCAS"):
            open_text = "a motion names its target on its first line"
        text, semicolon, _ = body.partition(";")
        open_text = text if open_text is None else open_text + " " + text
        if semicolon:
            texts.append(open_text)
            open_text = None
    return texts if open_text is None else [*texts, open_text]


def starts_target(text: str) -> bool:
    if text[:4].upper() == "PAL_":
        digits, bracket, _ = text[4:].partition("[")
        return bool(bracket) and 0 < len(digits) < 10 and all(c in "0123456789" for c in digits)
    return text[:2].upper() == "P[" or text[:3].upper() == "PR["


def move(letter: str, text: str, disabled: bool) -> Move:
    targets = []
    while starts_target(text):
        for i, c in enumerate(text):
            rest = text[i + 1 :]
            if c == "]" and (not rest.strip(BLANKS) or (rest[0] in BLANKS and may_follow(rest.strip(BLANKS)))):
                opened = text.index("[")
                targets.append(text[:opened].upper() + text[opened : i + 1])
                text = rest.strip(BLANKS)
                break
        else:
            break
    speed = speed_of(text)
    text = text[len(speed) :].strip(BLANKS)
    termination = termination_of(text)
    return Move(letter, tuple(targets), speed, termination, text[len(termination) :].strip(BLANKS), disabled)


def may_follow(text: str) -> bool:
    return starts_target(text) or speed_of(text) != ""


def speed_of(text: str) -> str:
    for word in ("WELD_SPEED", "max_speed"):
        if text[: len(word)].lower() == word.lower():
            return text[: len(word)]
    ends = []
    if text[:2].upper() == "R[" or text[:3].upper() == "AR[":
        ends = [i + 1 for i, c in enumerate(text) if c == "]"]
    else:
        number = len(text) - len(text.lstrip(".0123456789"))
        ends = [number] if number else []
    for end in ends:
        unit_at = len(text) - len(text[end:].lstrip(BLANKS))
        for unit in UNITS:
            if text[unit_at : unit_at + len(unit)].lower() == unit:
                return text[: unit_at + len(unit)]
    return ""


def termination_of(text: str) -> str:
    if text[:4].upper() == "FINE":
        return text[:4]
    word = text[:3].upper() if text[:3].upper() == "CNT" else text[:2].upper()
    if word not in ("CNT", "CR", "CD"):
        return ""
    i = len(word)
    while text[i : i + 1] in tuple(BLANKS):
        i += 1
    if word == "CNT" and text[i : i + 2].upper() == "R[":
        return text[: text.index("]", i) + 1]
    digits = i
    while text[digits : digits + 1] in tuple("0123456789"):
        digits += 1
    return text[:digits] if digits > i else ""


# Positions -------------------------------------------------------------------------------------------------------


def positions(lines: list[str]) -> dict[int, Position]:
    by_number: dict[int, Position] = {}
    position, group, inside = Position(""), None, False
    for line in lines:
        text = line
        while text := text.strip(" \t,;\f\v"):
            word = text[:2].upper()
            if not inside:
                number, name, text = opening(text)
                position, inside, group = Position(name), True, None
                by_number[number] = position
            elif text[0] == "}":
                inside, text = False, text[1:]
            elif word == "GP":
                number_text, _, text = text[2:].partition(":")
                group = position.groups.setdefault(int(number_text), Group())
            elif group is None:  # values that no group was named for
                group = position.groups.setdefault(0, Group())
            elif word == "UF":
                value, text = after_mark(text[2:], ":")
                group.uf = None if value.upper() == "F" else int(value)
            elif word == "UT":
                value, text = after_mark(text[2:], ":")
                group.ut = None if value.upper() == "F" else int(value)
            elif word == "CO" and text[:6].upper() == "CONFIG":
                _, group.config, text = text.split("'", 2)
            else:
                axis, _, text = text.partition("=")
                value, text = after_mark("=" + text, "=")
                axis = axis.strip(BLANKS).upper()
                if len(axis) == 2 and axis[0] == "R" and axis[1] in "XYZWPR":
                    axis, group.remote = axis[1], True
                if axis not in AXES:
                    raise ValueError(f"not an axis: {axis!r}")
                group.axes[axis] = None if "*" in value else float(value)
                for unit in ("mm", "deg"):
                    if text[: len(unit)].lower() == unit:
                        turning = axis in "WPR" or (axis in FIRST_JOINTS and is_of_first(position, group))
                        if unit == ("mm" if turning else "deg" if axis in "XYZ" else ""):
                            raise ValueError(f"{axis} in {unit}")
                        text = text[len(unit) :]
                        break
    return by_number


def is_of_first(position: Position, group: Group) -> bool:
    """Whether it is group 1, or values that no group was named for; two may be equal."""
    return any(group is one for number, one in position.groups.items() if number <= 1)


def opening(text: str) -> tuple[int, str, str]:
    """Number, name and what follows the brace of ``P[n:"name"]{``."""
    if text[:2].upper() != "P[":
        raise ValueError(f"not a position: {text!r}")
    for i, c in enumerate(text):
        if c == "]" and text[i + 1 :].strip(BLANKS)[:1] == "{":
            number, _, name = text[2:i].partition(":")
            name = name.strip()
            if name[:1] == '"' and name[-1:] == '"' and len(name) > 1:
                name = name[1:-1]
            return int(number), name, text[i + 1 :].strip(BLANKS)[1:]
    raise ValueError(f"not a position: {text!r}")


def after_mark(text: str, mark: str) -> tuple[str, str]:
    """The word behind a mark, and what follows it."""
    text = text.strip(BLANKS)
    if text[:1] != mark:
        raise ValueError(f"{mark} is missing: {text!r}")
    text = text[1:].strip(BLANKS)
    rest = text.lstrip("F+-.*0123456789")
    return text[: len(text) - len(rest)], rest.strip(BLANKS)


# Driving ---------------------------------------------------------------------------------------------------------


def driven(data: bytes) -> list[tuple]:
    """What a controller would drive, in order: (letter, targets, speed, termination, rest)."""
    by_number, moves = read(data)
    rows = []
    for m in moves:
        if not m.disabled:
            targets = tuple(numbers(by_number, t) for t in m.targets)
            rows.append((m.letter, targets, m.speed, m.termination, m.rest))
    return rows


def numbers(by_number: dict[int, Position], target: str):
    """All numbers of a position, frames and CONFIG; or the target's text when the file does not hold it."""
    inside = target[2:-1].partition(":")[0].strip()
    if target[:2] != "P[" or not inside.isdigit() or int(inside) not in by_number:
        return target
    groups = by_number[int(inside)].groups
    return tuple((g, v.uf, v.ut, v.config, tuple(sorted(v.axes.items()))) for g, v in sorted(groups.items()))


def calls(main: bytes) -> list[str]:
    """Names of the programs that a main program calls, in order."""
    text = sections(lines_of(main.decode("latin-1")))["MN"]
    return [s.split()[1] for s in statements(text) if s.split()[:1] == ["CALL"]]


def name_of(data: bytes) -> str:
    return data.decode("latin-1").split()[1]
