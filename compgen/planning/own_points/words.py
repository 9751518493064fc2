"""Lines of a toolpath file, and points that grow as it is read."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from compgen.core.exceptions import InputError
from compgen.core.files import read_regular
from compgen.core.units import MM
from compgen.planning.own_points.given import GivenArcs, GivenPoints

MAX_BYTES = 500_000_000
MINUTE = 60.0  # s
FEEDS = (0.05, 2000.0)  # mm/s that a program can say
LARGEST = 1e4  # mm
TURNED = 1e-6  # rad, of a tool that stands


def read_lines(source: str | Path, kind: str) -> list[str]:
    """Lines of a text file.

    Args:
        source: The file.
        kind: What it should be, for messages.

    Raises:
        InputError: It cannot be read, or is no text.
    """
    try:
        data = read_regular(str(source), MAX_BYTES)
    except OSError as exception:
        raise InputError(f"{source}: cannot be read: {exception.strerror}; give {kind}") from None
    except ValueError:
        raise InputError(f"{str(source)!r}: cannot be read: no file has such a name; give {kind}") from None
    if b"\0" in data:
        raise InputError(f"{source}: holds zero bytes, so it is no text; give {kind}")
    return data.decode("latin-1").splitlines()


class Arc(NamedTuple):
    """The way to a point in the XY plane; a line where nothing is swept."""

    centre: tuple[float, float]  # mm
    swept: float  # rad, counterclockwise


LINE = Arc((0.0, 0.0), 0.0)


@dataclass(slots=True, kw_only=True)
class PointRows:
    """Points in the order they are read; ``given`` freezes them."""

    source: str
    line: list[int] = field(default_factory=list)
    position: list[tuple[float, float, float]] = field(default_factory=list)  # mm
    normal: list[tuple[float, float, float]] = field(default_factory=list)
    feed: list[float] = field(default_factory=list)  # m/s
    contact: list[bool] = field(default_factory=list)
    stop: list[bool] = field(default_factory=list)
    arc: list[Arc] = field(default_factory=list)

    def add(
        self, line: int, position: tuple[float, float, float], feed: float, contact: bool,
        normal: tuple[float, float, float] | None = None, arc: Arc = LINE,
    ) -> None:  # fmt: skip
        """One more point; one at the very place of the last is the same point.

        Raises:
            InputError: A coordinate beyond any cell, or a tool that turns where it stands.
        """
        if max(map(abs, position)) > LARGEST:
            raise InputError(f"{self.source}: line {line}: a coordinate is beyond {LARGEST:g} mm; mend it")
        if self.position and self.position[-1] == position and arc.swept == 0:
            if normal is not None and np.linalg.norm(np.subtract(normal, self.normal[-1])) > TURNED:
                raise InputError(
                    f"{self.source}: line {line}: the tool turns where it stands (line {self.line[-1]}); let it move "
                    "while it turns"
                )
            return
        self.line.append(line)
        self.position.append(position)
        self.feed.append(feed)
        self.contact.append(contact)
        self.stop.append(False)
        self.arc.append(arc)
        if normal is not None:
            self.normal.append(normal)

    def refuse_another_tool(self, line: int, word: str) -> None:
        """Refuse a change of tool behind a place on the part: the robot has one tool."""
        if any(self.contact):
            raise InputError(
                f"{self.source}: line {line}: {word}: another tool in mid-file; write a file for each tool"
            )

    def given(self, normal: bool, notes: tuple[str, ...] = ()) -> GivenPoints:
        """The points.

        Args:
            normal: Whether each has one; without, the surface says how the tool stands.
            notes: What of the file is not driven.
        """
        swept = np.array([arc.swept for arc in self.arc])
        centre = np.array([arc.centre for arc in self.arc]).reshape(-1, 2) * MM
        return GivenPoints(
            source=self.source,
            line=np.array(self.line, dtype=np.int64),
            position=np.array(self.position, dtype=float).reshape(-1, 3) * MM,
            normal=np.array(self.normal, dtype=float).reshape(-1, 3) if normal else None,
            rotation=None,
            feed=np.array(self.feed, dtype=float),
            contact=np.array(self.contact, dtype=bool),
            stop=np.array(self.stop, dtype=bool),
            arcs=GivenArcs(centre, swept) if swept.any() else None,
            notes=notes,
        )


def not_driven(last: int, word: str, lines: list[int]) -> tuple[str, ...]:
    """In words, which lines behind the end of a program are not driven; none where there are none."""
    if not lines:
        return ()
    where = f"line {lines[0]} behind it is" if len(lines) == 1 else f"lines {lines[0]} to {lines[-1]} behind it are"
    return (f"{word} in line {last} ends the program: {where} not driven",)


def feed_in_m_s(source: str, line: int, mm_min: float) -> float:
    """A feed in SI.

    Raises:
        InputError: No program can say it.
    """
    if not FEEDS[0] * MINUTE <= mm_min <= FEEDS[1] * MINUTE:
        low, high = (f * MINUTE for f in FEEDS)
        raise InputError(f"{source}: line {line}: a feed of {mm_min:g} mm/min is outside {low:g} to {high:g}; mend it")
    return mm_min / MINUTE * MM
