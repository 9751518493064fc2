r"""What was measured of an arm, and the joints at which it was measured, in SI.

A row compares a reflector (or the probe), carried by the flange at a pose and moved by a shift, with its far end:

    delta = y - [F (P + R t + v) + c]     y: a place measured, or a fixed place, in the frame (F, c) of an instrument
    delta = (P' + R' t') - (P + R t)      another reflector, or the same one at another pose

All coordinates of delta are a row's residual, or its length alone against a measured distance l: l - |delta|.

Fixed places stand in the cell: spheres of an artefact, sockets of a ballbar; unknown, and fitted along. What is known
of them beforehand are rows of their own, each with its own sigma,

    z = (s_0 - s) / sigma              a sphere's place s in the artefact's frame, near s_0
    z = (l - |s_a - s_b|) / sigma      a certified length l between two

A place that is known exactly is no unknown: what touches it is a row as of an instrument whose frame is the artefact's.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, Final

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, own, owns

#: kinds of rows, each with a noise of its own: places by an instrument, orientations, touches, distances, and what
#: is known beforehand, whose noise is known too
PLACE, ORIENTATION, TOUCH, DISTANCE, KNOWN = range(5)
KINDS: Final = ("places", "orientations", "touches", "distances", "known")
NONE = -1  # no fixed place, no other pose
WORLD = -1  # in place of an instrument: no frame of its own
EXACT = 1e-7  # [m] smallest sigma: nothing is known better


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(frame=("S",), place=("S", 3), sigma=("S",), between=("L", 2), length=("L",), length_sigma=("L",))
class FixedPlaces:
    """S places that are fitted along, and what is known of them."""

    names: tuple[str, ...] = ()
    frame: IntArray = field(default_factory=lambda: np.zeros(0, dtype=int))  # (S,) of an instrument, or WORLD
    place: Array = field(default_factory=lambda: np.zeros((0, 3)))  # (S, 3) [m]; NaN: unknown
    sigma: Array = field(default_factory=lambda: np.zeros(0))  # (S,) [m] of a coordinate of the places known
    between: IntArray = field(default_factory=lambda: np.zeros((0, 2), dtype=int))  # (L, 2) with a certified length
    length: Array = field(default_factory=lambda: np.zeros(0))  # (L,) [m]
    length_sigma: Array = field(default_factory=lambda: np.zeros(0))  # (L,) [m]
    certified: bool = False  # whether a certificate tells the scale: of places, or of a length

    def prior_rows(self, current: Array) -> tuple[Array, Array]:
        """What is known beforehand, at some places (S, 3) [m]: z (H,), and -dz by the places' coordinates (H, 3 S)."""
        unit = np.eye(len(self.names))
        known = np.flatnonzero(np.isfinite(self.place[:, 0]))
        sigma = np.maximum(self.sigma[known], EXACT)
        z = ((self.place[known] - current[known]) / sigma[:, None]).ravel()
        of_places = np.kron(unit[known] / sigma[:, None], np.eye(3))
        a, b = self.between.T
        difference = current[a] - current[b]
        distance = np.linalg.norm(difference, axis=1)
        length_sigma = np.maximum(self.length_sigma, EXACT)
        toward = difference / np.maximum(distance, EXACT)[:, None] / length_sigma[:, None]
        of_lengths = ((unit[a] - unit[b])[:, :, None] * toward[:, None]).reshape(len(toward), 3 * len(unit))
        return np.concatenate([z, (self.length - distance) / length_sigma]), np.vstack([of_places, of_lengths])


NO_PLACES = FixedPlaces()


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(kind=("N",), shift=("N", 3), place=("N",), pose=("N",), reflector=("N",), distance=("N",), toward=("N", 3))
class FarEnds:
    """What the reflector of each row is compared with, beyond places that an instrument measured."""

    kind: IntArray  # (N,) PLACE, TOUCH or DISTANCE
    shift: Array  # (N, 3) [m] World, of the near end
    place: IntArray  # (N,) fixed place; NONE: the position given
    pose: IntArray  # (N,) at which another reflector is compared; NONE: no other
    reflector: IntArray  # (N,) that one
    distance: Array  # (N,) [m] measured; NaN: all coordinates count
    toward: Array  # (N, 3) unit vector in World, roughly from the near end to the far one; NaN: not known


def plain_ends(count: int) -> FarEnds:
    """Of rows that an instrument measured."""
    none = np.full(count, NONE)
    return FarEnds(
        kind=np.full(count, PLACE),
        shift=np.zeros((count, 3)),
        place=none,
        pose=none,
        reflector=np.zeros(count, dtype=int),
        distance=np.full(count, np.nan),
        toward=np.full((count, 3), np.nan),
    )


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Measurements:
    """Poses of the arm, and rows measured at them; several rows (reflectors) may share a pose, and one may have two."""

    theta: Array  # (M, 6) [rad] commanded, DH
    rise: Array  # (M, K) [K] of the heat model's nodes; zeros when cold
    lag: Array  # (M, K) [K] d rise / d log tau of the modelled nodes; zeros of others
    direction: Array  # (M, 6) [-1, 1] of the motion each joint came with; 0 where unknown
    time: Array  # (M,) [s]
    warm: Array  # (M,) [s] since the warm-up's start; 0 at cold poses
    pose: IntArray  # (N,) of each row
    instrument: IntArray  # (N,) which frame it was measured in; WORLD: none
    reflector: IntArray  # (N,)
    ends: FarEnds
    position: Array  # (N, 3) [m] of the far end in the instrument's frame; NaN: not measured, or fitted along
    rotation: Array  # (N, 3, 3) in the instrument's frame; NaN: not measured
    sigma: Array  # (N,) standard deviation relative to the other rows of its kind, median 1
    label: tuple[str, ...]  # of each row: file and line
    reflectors: tuple[str, ...]
    instruments: tuple[str, ...]
    aligned: BoolArray  # (I,) the instrument's frame is World, but for small errors (axis tests)
    modelled: tuple[int, ...] = ()  # nodes without a sensor, whose rise at warm poses a model says
    fixed: FixedPlaces = NO_PLACES
    timed: bool = True  # whether the file gives the times of its poses
    guess: Array | None = None  # (R, 3) [m] where the reflectors roughly are, NaN: anywhere; None: all anywhere
    guess_sigma: Array | None = None  # (R,) [m] how well that is known; None: it says where a fit begins, and no more
    shifted: Array | None = None  # (S, M, K) [K] rises by the log with its clock moved; None: no log
    half_width: Array | None = None  # (6, 2) [rad] of each joint's play, and its sigma; NaN: no run; None: no runs
    stated_sigma: Array | None = None  # (N,) [m] as the row's file says it; NaN, None: it says none
    notes: tuple[str, ...] = ()  # how files of another writer's form were understood

    def __post_init__(self) -> None:
        own(
            self,
            theta=("M", 6),
            rise=("M", "K"),
            lag=("M", "K"),
            direction=("M", 6),
            time=("M",),
            warm=("M",),
            pose=("N",),
            instrument=("N",),
            reflector=("N",),
            position=("N", 3),
            rotation=("N", 3, 3),
            sigma=("N",),
            aligned=("I",),
        )
        if self.shifted is not None:
            own(self, shifted=("S", "M", "K"))

    @property
    def kind(self) -> IntArray:
        """Of each row, (N,)."""
        return self.ends.kind

    @property
    def numbers(self) -> IntArray:
        """How many numbers each row has at most: three coordinates, or one distance, (N,)."""
        return np.where(np.isfinite(self.ends.distance), 1, 3)

    def row_of(self, pose: int) -> int:
        """The first row measured at a pose."""
        return int(np.flatnonzero((self.pose == pose) | (self.ends.pose == pose))[0])

    def file(self, row: int = 0) -> str:
        """The file that a row is from."""
        return self.label[row].rsplit(": line", 1)[0]

    def named_instrument(self, i: int) -> str:
        """The name that the files give an instrument or artefact; "" where it is known by its file alone."""
        files = {self.file(n) for n in np.flatnonzero(self.instrument == i).tolist()}
        return "" if self.instruments[i] in files else self.instruments[i]

    def subset(self, rows: BoolArray) -> "Measurements":
        """Measurements of some rows; all poses, reflectors and instruments stay."""
        per_row = ("pose", "instrument", "reflector", "position", "rotation", "sigma")
        values: dict[str, Any] = {name: getattr(self, name)[rows] for name in per_row}
        values["stated_sigma"] = None if self.stated_sigma is None else self.stated_sigma[rows]
        label = tuple(label for label, keep in zip(self.label, rows.tolist(), strict=True) if keep)
        ends = FarEnds(**{f.name: getattr(self.ends, f.name)[rows] for f in fields(self.ends)})
        return replace(self, label=label, ends=ends, **values)


def blank_rows(theta: Array, pose: IntArray, label: Sequence[str], nodes: int) -> Measurements:
    """Rows at the poses of a cold arm, one after the other, by which nothing is measured yet.

    Args:
        theta: (M, 6) [rad].
        pose: Of each row, (N,).
        label: Of each row.
        nodes: How many nodes the heat model has.
    """
    M, N = len(theta), len(pose)
    return Measurements(
        theta=theta,
        rise=np.zeros((M, nodes)),
        lag=np.zeros((M, nodes)),
        direction=np.zeros((M, 6)),
        time=np.arange(M, dtype=float),
        warm=np.zeros(M),
        pose=pose,
        instrument=np.zeros(N, dtype=int),
        reflector=np.zeros(N, dtype=int),
        ends=plain_ends(N),
        position=np.full((N, 3), np.nan),
        rotation=np.full((N, 3, 3), np.nan),
        sigma=np.ones(N),
        label=tuple(label),
        reflectors=(),
        instruments=(),
        aligned=np.zeros(0, dtype=bool),
    )


def concatenate(files: list[Measurements]) -> Measurements:
    """Measurements of several files as one; reflectors are told apart by name, each file has its own instruments."""
    names = list(dict.fromkeys(r for p in files for r in p.reflectors))
    frames = np.cumsum([0, *(len(p.instruments) for p in files)])
    poses = np.cumsum([0, *(len(p.theta) for p in files)])

    reflector = [np.array([names.index(r) for r in p.reflectors], dtype=int) for p in files]
    fixed, place = merged_places([p.fixed for p in files], frames.tolist())
    stated = np.concatenate([np.full(len(p.pose), np.nan) if p.stated_sigma is None else p.stated_sigma for p in files])

    def stack(name: str) -> Array:
        return np.concatenate([getattr(p, name) for p in files])

    return Measurements(
        theta=stack("theta"),
        rise=stack("rise"),
        lag=stack("lag"),
        direction=stack("direction"),
        time=stack("time"),
        warm=stack("warm"),
        pose=np.concatenate([p.pose + n for p, n in zip(files, poses.tolist(), strict=False)]),
        instrument=np.concatenate([_numbered(p.instrument, n) for p, n in zip(files, frames.tolist(), strict=False)]),
        reflector=np.concatenate([number[p.reflector] for p, number in zip(files, reflector, strict=True)]),
        position=stack("position"),
        rotation=stack("rotation"),
        sigma=_stacked_sigmas(files, stated),
        stated_sigma=stated,
        label=tuple(label for p in files for label in p.label),
        reflectors=tuple(names),
        instruments=tuple(i for p in files for i in p.instruments),
        aligned=np.concatenate([p.aligned for p in files]),
        modelled=tuple(sorted({k for p in files for k in p.modelled})),
        ends=_stacked_ends(files, reflector, place, poses.tolist()),
        fixed=fixed,
        shifted=_stack_shifted(files),
        guess=_stacked_guesses(files, reflector, len(names)),
        notes=tuple(note for p in files for note in p.notes),
    )


def _stacked_sigmas(files: list[Measurements], stated: Array) -> Array:
    """Sigmas of all rows relative to those of their kind; where a file of a kind says none, each by its own file's."""
    sigma, kind = (np.concatenate([getattr(p, name) for p in files]) for name in ("sigma", "kind"))
    for rows in (kind == k for k in np.unique(kind)):
        if np.isfinite(stated[rows]).all():
            sigma[rows] = stated[rows] / np.median(stated[rows])
    return sigma


def _stacked_guesses(files: list[Measurements], reflector: list[IntArray], count: int) -> Array | None:
    """Where all reflectors roughly are, by what any file says."""
    given = [(number, p.guess) for p, number in zip(files, reflector, strict=True) if p.guess is not None]
    guess = np.full((count, 3), np.nan)
    for number, place in given:
        guess[number] = place
    return guess if given else None


def _stack_shifted(files: list[Measurements]) -> Array | None:
    """Rises by moved logs of all files; those of a file without a log do not move."""
    moved = [p.shifted for p in files if p.shifted is not None]
    if not moved:
        return None
    S = len(moved[0])
    return np.concatenate(
        [np.repeat(p.rise[None], S, axis=0) if p.shifted is None else p.shifted for p in files], axis=1
    )


def _stacked_ends(
    files: list[Measurements], reflector: list[IntArray], place: list[IntArray], poses: list[int]
) -> FarEnds:
    """The far ends of all rows, numbered anew."""
    parts = [
        replace(
            p.ends,
            pose=_numbered(p.ends.pose, first),
            reflector=reflectors[p.ends.reflector],
            place=np.append(places, NONE)[p.ends.place],
        )
        for p, reflectors, places, first in zip(files, reflector, place, poses, strict=False)
    ]
    return FarEnds(**{f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(FarEnds)})


def _numbered(indices: IntArray, first: int) -> IntArray:
    """Indices counted on from the first of their file; -1 stays."""
    return np.where(indices < 0, indices, indices + first)


def with_one_frame_a_name(data: Measurements) -> Measurements:
    """Measurements whose instruments of one name have one frame: it stood in one place for all its files."""
    names = list(dict.fromkeys(data.instruments))
    number = np.array([names.index(name) for name in data.instruments], dtype=int)
    first = [data.instruments.index(name) for name in names]
    number = np.append(number, WORLD)
    fixed = replace(data.fixed, frame=number[data.fixed.frame])
    return replace(
        data, instrument=number[data.instrument], instruments=tuple(names), aligned=data.aligned[first], fixed=fixed
    )


def merged_places(parts: Sequence[FixedPlaces], first_frame: Sequence[int]) -> tuple[FixedPlaces, list[IntArray]]:
    """Places of several files as one, told apart by name, and the number that each place of each file has there.

    Args:
        parts: Of each file.
        first_frame: The number that each file's first instrument has among all.
    """
    names = list(dict.fromkeys(name for part in parts for name in part.names))
    numbers = [np.array([names.index(name) for name in part.names], dtype=int) for part in parts]
    frame, place, sigma = np.full(len(names), WORLD), np.full((len(names), 3), np.nan), np.zeros(len(names))
    lengths: dict[tuple[int, int], tuple[float, float]] = {}
    for part, number, first in zip(parts, numbers, first_frame, strict=False):
        frame[number] = np.where(part.frame == WORLD, WORLD, part.frame + first)
        place[number], sigma[number] = part.place, part.sigma
        for (a, b), length, of_length in zip(
            part.between.tolist(), part.length.tolist(), part.length_sigma.tolist(), strict=True
        ):
            lengths[int(number[a]), int(number[b])] = (length, of_length)
    values = np.array(list(lengths.values())).reshape(-1, 2)
    between = np.array(list(lengths), dtype=int).reshape(-1, 2)
    certified = any(part.certified for part in parts)
    merged = FixedPlaces(
        names=tuple(names),
        frame=frame,
        place=place,
        sigma=sigma,
        between=between,
        length=values[:, 0],
        length_sigma=values[:, 1],
        certified=certified,
    )
    return merged, numbers
