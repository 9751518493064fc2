"""Measured positions of reflectors, and the joints at which they were measured, in SI."""

from dataclasses import dataclass, fields

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

    def __post_init__(self) -> None:
        own(
            self, theta=("M", 6), rise=("M", "K"), direction=("M", 6), time=("M",), warm=("M",), pose=("N",),
            instrument=("N",), reflector=("N",), position=("N", 3), rotation=("N", 3, 3), sigma=("N",), aligned=("I",),
        )  # fmt: skip

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
    poses = np.cumsum([0, *(len(p.theta) for p in files)])
    frames = np.cumsum([0, *(len(p.instruments) for p in files)])

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
    )
