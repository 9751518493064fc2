"""Text to meaning, for programs that say what ``compose`` writes; anything else is refused with its line.

Our own text is read by columns; a listing that says the same in other words is read as any listing.
"""

import re
from dataclasses import replace
from itertools import chain
from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, frozen
from compgen.core.decimals import DECIMALS, MOST_DECIMALS, fits_fixed, parse_fixed, word_view
from compgen.core.evaluation import BLOCK, parallel_for
from compgen.core.exceptions import InputError
from compgen.core.rotations import from_wpr
from compgen.core.unique_rows import hash_rows, unique_keys
from compgen.core.units import DEG, MM
from compgen.fanuc.canonical.layout import (
    MARK,
    MARK_BACK,
    SharedFrame,
    motion_tail,
    motions,
    position_config,
    positions,
)
from compgen.fanuc.canonical.writer import acc_text
from compgen.fanuc.circular import check_circles
from compgen.fanuc.listing.listing import LsProgram, loads, statement_texts
from compgen.fanuc.listing.templates import byte_windows
from compgen.fanuc.motion_options import ACC_OR_NOTHING
from compgen.fanuc.vocabulary import FRAME_NUMBER, PAYLOAD_ALONE, PERCENT
from compgen.program.digits import fill_poses
from compgen.program.program import Program
from compgen.program.speeds import parse_speed
from compgen.robot.configuration import CONFIG, config_letters, parse_config
from compgen.robot.inverse_kinematics import Posture

_CONSTANT_SPEED = re.compile(r"(?:\d+\.?\d*|\.\d+)(%|mm/sec|cm/min|inch/min)")
_FINE_OR_FULL = re.compile(r"FINE|CNT\s*0*100", re.IGNORECASE)


def interpret(data: bytes) -> Program:
    """The program that a text means.

    Canonical text is read by columns, and believed only where writing what was read gives the same bytes; any other as
    any listing is.

    Raises:
        InputError: The text is not a program of this form; names the line.
    """
    canonical = read_columns(data)
    return meaning_of(loads(data)) if canonical is None else canonical


def meaning_of(listing: LsProgram) -> Program:
    """The program that a listing means.

    Raises:
        InputError: It says more than ``compose`` writes; names the line.
    """
    m, p = listing.motions, listing.positions
    remarks, uframe, utool, payload = _read_settings(listing)
    acc = _common_acc(listing)
    posture, turns = _read_configs(listing)
    order = list(range(1, len(p.number) + 1))
    if list(chain.from_iterable(m.position)) != order or p.number.tolist() != order:
        raise InputError("program: positions are not driven once each in order P[1], P[2], ...")
    if m.letter[:1] != ("J",) or "J" in m.letter[1:]:
        raise InputError("program: it does not start with one J motion followed by L and C motions")
    if posture is None or set(p.uframe.tolist()) != {uframe} or set(p.utool.tolist()) != {utool}:
        raise InputError("program: positions differ in frame, tool or CONFIG letters")
    motion = np.repeat(np.arange(len(m.line)), [len(numbers) for numbers in m.position])
    via = np.append(motion[1:] == motion[:-1], False)
    speed = np.array([0.0, *map(parse_speed, m.speed[1:])])
    fine = np.array([word.upper() == "FINE" for word in m.termination])
    attributes = dict(listing.attributes)
    program = Program(
        name=listing.name,
        comment=attributes.get("COMMENT", "").removeprefix('"').removesuffix('"'),
        date=attributes.get("CREATE", "").removeprefix("DATE").partition("TIME")[0].strip(),
        remarks=remarks,
        uframe=uframe,
        utool=utool,
        position=p.value[:, :3] * MM,
        rotation=from_wpr(*(p.value[:, 3:6] * DEG).T),
        posture=posture,
        turns=turns,
        speed=speed[motion[1:]],
        fine=fine[motion] & ~via,
        via=via,
        decimals=min(max(len(listing.text(p.span[0, 0]).partition(".")[2]), DECIMALS), MOST_DECIMALS),
        payload=payload,
        acc=acc,
    )
    check_circles(program, lambda n: f"line {m.line[motion[n - 1]]}: ")
    return program


class _Settings(NamedTuple):
    """What statements that are no motions say."""

    remarks: tuple[str, ...]
    uframe: int
    utool: int
    payload: int | None


def _read_settings(listing: LsProgram) -> _Settings:
    """Remarks, frame, tool and payload; raises InputError for any other statement."""
    remarks, payload, frames = [], None, {"UFRAME_NUM": 0, "UTOOL_NUM": 0}
    first_motion = listing.motions.line.min(initial=np.iinfo(np.int64).max)
    rows = np.flatnonzero(~np.isin(listing.statements, listing.motions.line))
    for line, text in zip(listing.statements[rows].tolist(), statement_texts(listing, rows), strict=True):
        if text.startswith("!"):
            remarks.append(text[1:])
        elif (frame := FRAME_NUMBER.match(text)) and frame[2].isdecimal():
            frames[frame[1].upper()] = int(frame[2])
        elif (schedule := PAYLOAD_ALONE.match(text)) and line < first_motion:
            payload = int(schedule[1])
        else:
            raise InputError(f"program: line {line}: '{text:.80}' is not a statement this reader knows")
    return _Settings(tuple(remarks), frames["UFRAME_NUM"], frames["UTOOL_NUM"], payload)


def _common_acc(listing: LsProgram) -> int | None:
    """ACC of all motions; raises InputError where they differ, or for a motion that ``compose`` does not write."""
    m = listing.motions
    accs = set()
    rows = zip(m.letter, m.target, m.disabled.tolist(), m.speed, m.termination, m.options, strict=True)
    for i, (letter, targets, disabled, speed, termination, options) in enumerate(rows):
        unit, acc = _CONSTANT_SPEED.fullmatch(speed), ACC_OR_NOTHING.fullmatch(options)
        plain = _FINE_OR_FULL.fullmatch(termination) and not disabled
        plain = plain and all(target[:2] == "P[" and ":" not in target for target in targets)
        count = {"J": 1, "L": 1, "C": 2}.get(letter)
        if not (unit and acc and plain) or len(targets) != count or (letter == "J") != (unit[1] == PERCENT):
            raise InputError(
                f"program: line {m.line[i]}: '{listing.motion_text(i):.80}' is not a motion this reader knows: C has a "
                "via and an end, J and L an end; a constant speed, FINE or CNT100, and no option but ACC"
            )
        accs.add(acc[1])
    if len(accs) > 1:
        raise InputError("program: motions differ in their ACC")
    return next((int(acc) for acc in accs if acc), None)


def _read_configs(listing: LsProgram) -> tuple[Posture | None, IntArray]:
    """The posture of all positions, None where they differ, and their turns (N, 3).

    Raises:
        InputError: A position that ``compose`` does not write; names its line.
    """
    p = listing.positions
    parsed = {text: parse_config(text or "") for text in set(p.config)}
    turned = {text for text in parsed if (config := CONFIG.match(text or "")) and config[4]}
    known = np.array([text in turned and not name for text, name in zip(p.config, p.name, strict=True)], dtype=np.bool_)
    known &= (p.group == 1) & ~p.remote & np.isfinite(p.value[:, :6]).all(axis=1)
    known &= ~(p.span[:, 6:, 1] > 0).any(axis=1)
    if not len(known):
        raise InputError("program: it has no position: /POS is missing or empty; is this a complete .LS file?")
    if not known.all():
        raise InputError(f"program: line {p.line[np.argmin(known)]}: not a position this reader knows")
    postures = {posture for posture, _ in parsed.values()}
    turns = np.array([parsed[text][1] for text in p.config], dtype=np.int64)
    return postures.pop() if len(postures) == 1 else None, turns


def read_columns(data: bytes) -> Program | None:
    """What canonical text means, a block of rows at a time, or None.

    A guess at where the numbers stand is enough: what is read counts only when the rows written from it are, byte for
    byte, those that were read.
    """
    moves, places, end = data.find(b"/MN\r\n"), data.find(b"\n/POS\r\n") + 1, len(data) - len(b"/END\r\n")
    linear = _FIRST.search(data, moves, places) if 0 <= moves < places else None
    if linear is None or not data.startswith(b"/END\r\n", end):
        return None
    # the head and the first position hold what all rows share
    block = data.find(b"};\r\n", places) + 4
    try:
        sample = meaning_of(loads(data[: linear.start()] + data[places:block] + b"/END\r\n"))
        lines = row_ends(data, linear.start(), places, b"\n", 1)
        blocks = row_ends(data, places + len(b"/POS\r\n"), end, MARK, MARK_BACK)
        if len(lines) + 1 != len(blocks):
            return None
        speed, fine = _motions(data, int(linear.group(1)), lines, acc_text(sample.acc))
        position, rotation, turns = _positions(data, sample, blocks)
    except InputError:
        return None
    return replace(
        sample,
        position=frozen(position),
        rotation=frozen(rotation),
        turns=frozen(turns),
        speed=frozen(speed),
        fine=np.concatenate([sample.fine, fine]),
        via=np.zeros(len(position), dtype=bool),
    )


_FIRST = re.compile(rb"^ *(\d{1,8}):L P\[2\] ", re.MULTILINE)
_TAIL = re.compile(rb"(\d+(?:\.\d+)?(?:mm/sec|cm/min|inch/min)) (FINE|CNT100)( ACC\d{1,3})?    ;\r\n")
_CONFIG = re.compile(rb"([FN] [UD] [TB]), (-?\d{1,9}), (-?\d{1,9}), (-?\d{1,9})")
_LONGEST = 48
_WINDOW = 1 << 16  # bytes that are searched for marks at a time
_AHEAD = 32  # rows of one length that are guessed at first


def _motions(data: bytes, line: int, bounds: IntArray, acc: str) -> tuple[Array, BoolArray]:
    """Speeds [m/s] and stops of linear motions to P[2] and so on, with one ACC; row k is from edge k to the next."""
    speed, fine = np.empty(len(bounds) - 1), np.empty(len(bounds) - 1, dtype=bool)

    def part(start: int, stop: int) -> None:
        for at in range(start, stop, BLOCK):
            rows = slice(at, min(at + BLOCK, stop))
            first, last = rows.start + 2, rows.stop + 2
            begin = bounds[rows] + motion_tail(line + at, first, last)
            tails, which = _unique_texts(data, begin, bounds[at + 1 : rows.stop + 1])
            _require_text(data, int(bounds[at]), motions(line + at, first, last, tails, which))
            parsed = [_full_match(_TAIL, tail) for tail in tails]
            if any((word or b"") != acc.encode() for *_, word in parsed):
                raise InputError("ACC")
            speed[rows] = np.array([parse_speed(number.decode()) for number, *_ in parsed])[which]
            fine[rows] = np.array([end == b"FINE" for _, end, _ in parsed])[which]

    parallel_for(len(speed), part)
    return speed, fine


def _positions(data: bytes, sample: Program, bounds: IntArray) -> tuple[Array, Array, IntArray]:
    """Positions (N, 3) [m], rotations (N, 3, 3) and turns (N, 3); row k is from edge k to the next."""
    N, frame = len(bounds) - 1, SharedFrame(sample.uframe, sample.utool, sample.decimals)
    position, rotation, turns = np.empty((N, 3)), np.empty((N, 3, 3)), np.empty((N, 3), dtype=np.int64)
    posture = config_letters(sample.posture).encode()

    def part(start: int, stop: int) -> None:
        for at in range(start, stop, BLOCK):
            rows = slice(at, min(at + BLOCK, stop))
            begin = bounds[rows] + position_config(frame, at + 1, rows.stop + 1)
            behind = bounds[at + 1 : rows.stop + 1] - frame.tail
            configs, which = _unique_texts(data, begin, behind)
            units = parse_fixed(byte_windows(data, behind, frame.tail), frame.places, frame.decimals)
            if not fits_fixed(units, frame.decimals):
                raise InputError("number")
            _require_text(data, int(bounds[at]), positions(frame, at + 1, units, configs, which))
            parsed = [_full_match(_CONFIG, config) for config in configs]
            if any(own != posture for own, *_ in parsed):
                raise InputError("CONFIG")
            turns[rows] = np.array([[int(n) for n in digits] for _, *digits in parsed])[which]
            fill_poses(units, frame.decimals, position[rows], rotation[rows])

    parallel_for(N, part)
    return position, rotation, turns


def _full_match(form: re.Pattern[bytes], text: bytes) -> tuple[bytes, ...]:
    """What fills a form."""
    match = form.fullmatch(text)
    if match is None:
        raise InputError(text.decode("latin-1"))
    return match.groups()


def _require_text(data: bytes, at: int, text: bytes | memoryview) -> None:
    """Raises InputError unless a text stands at a place."""
    if not data.startswith(text, at):
        raise InputError(f"byte {at}")


def row_ends(data: bytes, start: int, end: int, mark: bytes, back: int, window: int = _WINDOW) -> IntArray:
    """The start, and where each row ends: so far behind its mark. Rows mostly are as long as the one before.

    Raises:
        InputError: The last does not end at the end.
    """
    view = np.frombuffer(data, dtype=np.uint8)
    bounds_parts = [np.array([start])]
    at, width, ahead = start, 0, _AHEAD
    while at < end:
        rows = min(ahead, (end - at) // width) if width else 0
        if rows and (view[at + width - back : at + rows * width : width] == mark[0]).all():
            ends = at + width * np.arange(1, rows + 1)
            ahead *= 2
        else:
            ahead = _AHEAD
            ends = np.flatnonzero(view[at : min(at + window, end)] == mark[0]) + at + back
            width = int(ends[-1] - (ends[-2] if len(ends) > 1 else at)) if len(ends) else 0
        if width == 0:
            break
        bounds_parts.append(ends)
        at = int(ends[-1])
    if at != end:
        raise InputError(f"byte {at}")
    return np.concatenate(bounds_parts)


def _unique_texts(data: bytes, start: IntArray, end: IntArray) -> tuple[list[bytes], IntArray]:
    """The different texts between places and which row has which, by length, first 16 and last 8 characters."""
    length = end - start
    if length.min() < 8 or length.max() > _LONGEST:
        raise InputError("text")
    words = [
        word_view(byte_windows(data, place, 8), 0, np.uint64).copy()
        for place in (start, np.minimum(start + 8, end - 8), end - 8)
    ]
    rows, which = unique_keys(hash_rows([*words, length.view(np.uint64)]))
    return [data[a:b] for a, b in zip(start[rows].tolist(), end[rows].tolist(), strict=True)], which
