"""The positions that the programs of an output command, as their texts print them, and how far points are from them."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from compgen.core.arcs import Arcs, arcs_through
from compgen.core.arrays import Array, BoolArray, IntArray, dot, step_lengths
from compgen.core.commands import Command
from compgen.core.exceptions import InputError
from compgen.core.files import PROVENANCE, read_named, read_regular
from compgen.core.rotations import from_wpr
from compgen.core.units import DEG, MM
from compgen.pipelines.comparison.outputs import Output, naming_damage
from compgen.pipelines.files.program_course import listing_of
from compgen.program.pages import MANIFEST_SUFFIX

SPACING = 1e-3  # [m] of the marks by which segments of a path are looked up
MOST_MARKS = 2_000_000
SLACK = 1e-9  # [m] of rounding
BLOCK = 10_000  # points at a time
CHORD = 1e-7  # [m] that a chord leaves of an arc
MOST_CHORDS = 4096  # of one arc
_POSE = slice(0, 6)  # X Y Z W P R in the columns of a text's positions


@dataclass(frozen=True, eq=False, slots=True)
class TextPositions:
    """Positions of a program, or of all its pages together."""

    number: IntArray  # (N,) of the undivided program
    position: Array  # (N, 3) [m] in the program's user frame; NaN for joint angles
    rotation: Array  # (N, 3, 3)
    via: BoolArray  # (N,) middle of a circular motion
    joints: Array  # (N, 6) [deg] as they are printed; NaN of Cartesian positions


def commanded_positions(output: Output) -> TextPositions | None:
    """The positions of an output's program; None where it is not there: not written, or taken elsewhere.

    Raises:
        InputError: A text is damaged, or another than the one that the report is of.
    """
    with naming_damage(output):
        files = _files(output)
    texts = []
    for name, first, checksum in files:
        file = output.folder / name
        if not file.is_file():
            return None
        texts.append((listing_of(_read(file, checksum, output.file.name), str(file)), first))
    if not texts:
        return None
    parts = [(program.positions, first) for program, first in texts]
    number = np.concatenate([p.number + first - 1 for p, first in parts])
    value = np.concatenate([p.value[:, _POSE] for p, _ in parts])
    joints = np.concatenate([p.joints for p, _ in parts])
    _, rows = np.unique(number, return_index=True)  # pages share the position at which one ends and the next begins
    w, p, r = value[rows, 3:].T * DEG
    motions = [(program.motions, first - 1) for program, first in texts]
    vias = [p[0] + n for m, n in motions for letter, p in zip(m.letter, m.position, strict=True) if letter == "C"]
    via = np.isin(number[rows], vias)
    return TextPositions(number[rows], value[rows, :3] * MM, from_wpr(w, p, r), via, joints[rows])


def drawn(program: TextPositions) -> Array:
    """The path through a program's positions as a polyline, its arcs in chords that leave at most ``CHORD``."""
    middle = np.flatnonzero(program.via)
    middle = middle[(middle > 0) & (middle < len(program.via) - 1)]
    at = program.position
    arcs = arcs_through(at[middle - 1], at[middle], at[middle + 1])
    bent = np.isfinite(arcs.angle).all(axis=1)
    middle, arcs = middle[bent], Arcs(*(part[bent] for part in arcs))
    if not len(middle):
        return at
    chord = np.sqrt(8 * CHORD / arcs.radius.max())  # [rad]
    count = min(int(np.ceil(arcs.angle[:, 1].max() / chord)) + 1, MOST_CHORDS)
    bows = arcs.at(arcs.angle[:, 1:] * np.linspace(0.0, 1.0, count))
    straight = [at[first:last] for first, last in zip([0, *middle + 1], [*middle, len(at)], strict=True)]
    return np.concatenate(
        [straight[0], *(x for bow, part in zip(bows, straight[1:], strict=False) for x in (bow, part))]
    )


def distance_to_path(points: Array, path: Array) -> Array:
    """Distances of points (N, 3) to a polyline through others (M, 3) [m], (N,).

    A mark lies on the path, and the nearest place no farther than half the spacing from a mark of its segment: so the
    segments of all marks that are up to half a spacing farther than the nearest mark have it among them.
    """
    if len(path) == 1:
        return np.asarray(np.linalg.norm(points - path[0], axis=1))
    lengths = step_lengths(path)
    spacing = max(SPACING, float(lengths.sum()) / MOST_MARKS)
    parts = np.maximum(1, np.ceil(lengths / spacing)).astype(np.int64)
    segment = np.repeat(np.arange(len(parts)), parts)
    share = (np.arange(len(segment)) - np.repeat(np.cumsum(parts) - parts, parts) + 0.5) / parts[segment]
    step = np.diff(path, axis=0)
    tree = cKDTree(path[segment] + share[:, None] * step[segment])
    squared = np.maximum(dot(step, step), np.finfo(float).tiny)
    distance = np.empty(len(points))
    for begin in range(0, len(points), BLOCK):
        block = points[begin : begin + BLOCK]
        reach = tree.query(block)[0] + spacing / 2 + SLACK
        marks = tree.query_ball_point(block, reach)
        counts = np.array([len(near) for near in marks])
        k = segment[np.concatenate(marks).astype(np.int64)]
        point = np.repeat(block, counts, axis=0)
        along = np.clip(dot(point - path[k], step[k]) / squared[k], 0.0, 1.0)
        off = point - (path[k] + along[:, None] * step[k])
        distance[begin : begin + BLOCK] = np.sqrt(np.minimum.reduceat(dot(off, off), np.cumsum(counts) - counts))
    return distance


def _files(output: Output) -> list[tuple[str, int, str | None]]:
    """Name of each text with positions, the number that its P[1] has in the undivided program, and its sha256."""
    record = output.record
    if output.kind == Command.CORRECT:
        checksum = str(record["provenance"]["corrected_sha256"])
        return [(name, 1, checksum) for name in _corrected_file(output.folder, checksum)]
    program = record.get("program")
    if program is None:
        return []
    checksums: Mapping[str, Any] = program.get("sha256", {})
    if not program["pages"]:
        return [(str(program["file"]), 1, checksums.get(program["file"]))]
    pages = _manifest(output).get("pages", [])
    return [(str(page["file"]), int(page["first_position"]), str(page["sha256"])) for page in pages]


def _manifest(output: Output) -> Mapping[str, Any]:
    """Of a job's pages, as it is now; empty where there is none."""
    program = output.record.get("program")
    if output.kind != Command.GENERATE or not program or not program["pages"]:
        return {}
    manifest = output.folder / f"{Path(program['file']).stem}{MANIFEST_SUFFIX}"
    return dict(json.loads(read_regular(manifest))) if manifest.is_file() else {}


def first_page_anew(output: Output) -> int | None:
    """The first page that ``cgen resume`` has written since the report; None where there is none."""
    with naming_damage(output):
        return min((int(entry["from_page"]) for entry in _manifest(output).get("resumed", [])), default=None)


def _corrected_file(folder: Path, checksum: str) -> list[str]:
    """The program beside a correction's report: it has the source's file name, and its provenance beside it."""
    named = [f for f in sorted(folder.iterdir()) if f.suffix.lower() == ".ls" and f.with_suffix(PROVENANCE).is_file()]
    same = [f for f in named if sha256(read_regular(f)).hexdigest() == checksum]
    return [file.name for file in (same or named)[:1]]


def _read(file: Path, checksum: str | None, report: str) -> bytes:
    content = read_named(file, "put it back")
    if checksum is not None and sha256(content).hexdigest() != checksum:
        raise InputError(f"{file}: it is not the program that {report} is of: edited since; run its command anew")
    return content
