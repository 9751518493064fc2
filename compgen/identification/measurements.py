"""Measured positions of reflectors, and the joints at which they were measured, in SI."""

from dataclasses import dataclass, fields, replace

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, own


@dataclass(frozen=True, eq=False, slots=True)
class Measurements:
    """Poses of the arm, and rows measured at them; several rows (reflectors) may share a pose."""

    theta: Array  # (M, 6) [rad] commanded, DH
    rise: Array  # (M, K) [K] of the heat model's nodes; zeros when cold
    direction: Array  # (M, 6) [-1, 1] of the motion each joint came with; 0 where unknown
    time: Array  # (M,) [s]
    warm: Array  # (M,) [s] since the warm-up's start; 0 at cold poses
    pose: IntArray  # (N,) of each row
    instrument: IntArray  # (N,) which frame it was measured in
    reflector: IntArray  # (N,)
    position: Array  # (N, 3) [m] in the instrument's frame; NaN: not measured
    rotation: Array  # (N, 3, 3) in the instrument's frame; NaN: not measured
    sigma: Array  # (N,) standard deviation relative to the other rows, median 1
    label: tuple[str, ...]  # of each row: file and line
    reflectors: tuple[str, ...]
    instruments: tuple[str, ...]
    aligned: BoolArray  # (I,) the instrument's frame is World, but for small errors (axis tests)
    modelled: tuple[int, ...] = ()  # nodes without a sensor, whose rise at warm poses a model says
    lag: Array | None = None  # (M, K) [K] d rise / d log tau of those nodes; None: all zero

    def __post_init__(self) -> None:
        own(
            self, theta=("M", 6), rise=("M", "K"), direction=("M", 6), time=("M",), warm=("M",), pose=("N",),
            instrument=("N",), reflector=("N",), position=("N", 3), rotation=("N", 3, 3), sigma=("N",), aligned=("I",),
        )  # fmt: skip
        if self.lag is not None:
            own(self, lag=("M", "K"))

    def file(self, row: int = 0) -> str:
        """The file that a row is from."""
        return self.label[row].rsplit(": line", 1)[0]

    def named_instrument(self, i: int) -> str:
        """The name that the files give an instrument; "" where it is known by its file alone."""
        files = {self.file(n) for n in np.flatnonzero(self.instrument == i).tolist()}
        return "" if self.instruments[i] in files else self.instruments[i]

    def subset(self, rows: BoolArray) -> "Measurements":
        """Measurements of some rows; all poses, reflectors and instruments stay."""
        per_row = ("pose", "instrument", "reflector", "position", "rotation", "sigma")
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        values.update({name: values[name][rows] for name in per_row})
        values["label"] = tuple(label for label, keep in zip(self.label, rows.tolist()) if keep)
        return Measurements(**values)


def concatenate(files: list[Measurements]) -> Measurements:
    """Measurements of several files as one; reflectors are told apart by name, each file has its own instruments."""
    names = list(dict.fromkeys(r for p in files for r in p.reflectors))
    frames = np.cumsum([0, *(len(p.instruments) for p in files)])
    poses = np.cumsum([0, *(len(p.theta) for p in files)])

    def stack(name: str) -> Array:
        return np.concatenate([getattr(p, name) for p in files])

    return Measurements(
        theta=stack("theta"),
        rise=stack("rise"),
        direction=stack("direction"),
        time=stack("time"),
        warm=stack("warm"),
        pose=np.concatenate([p.pose + n for p, n in zip(files, poses.tolist())]),
        instrument=np.concatenate([p.instrument + n for p, n in zip(files, frames.tolist())]),
        reflector=np.concatenate([np.array([names.index(r) for r in p.reflectors])[p.reflector] for p in files]),
        position=stack("position"),
        rotation=stack("rotation"),
        sigma=stack("sigma"),
        label=tuple(label for p in files for label in p.label),
        reflectors=tuple(names),
        instruments=tuple(i for p in files for i in p.instruments),
        aligned=np.concatenate([p.aligned for p in files]),
        modelled=tuple(sorted({k for p in files for k in p.modelled})),
        lag=np.concatenate([np.zeros_like(p.rise) if p.lag is None else p.lag for p in files]),
    )


def with_one_frame_a_name(data: Measurements) -> Measurements:
    """Measurements whose instruments of one name have one frame: it stood in one place for all its files."""
    names = list(dict.fromkeys(data.instruments))
    number = np.array([names.index(name) for name in data.instruments])
    first = [data.instruments.index(name) for name in names]
    return replace(data, instrument=number[data.instrument], instruments=tuple(names), aligned=data.aligned[first])
