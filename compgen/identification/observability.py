r"""What no row can see: directions of the arm's geometry that all measurements leave as they are.

Distances and touches of spheres that stand anywhere see no frame: where the base stands, the first zero and the first d
move everything together. Of zeros and lengths, a direction v (in units of the priors) is unseen where

    |S v| < UNSEEN,    S = (I - F F^+) A / s

with the rows A over their noise s, freed from what frames, reflectors and places take up (``identifiability``): the
measurements then take less than a hundredth from the prior's variance.
"""

import numpy as np

from compgen.core.arrays import Array
from compgen.core.codes import Code, Level
from compgen.core.findings import Finding
from compgen.identification.fit import Fit
from compgen.identification.fixed_places import WORLD
from compgen.identification.identifiability import scaled_rows
from compgen.identification.measurements import Measurements
from compgen.identification.model import ArmModel

UNSEEN = 0.1
GEOMETRY = ("joint_zeros", "link_offsets")
PART = 0.3  # share of the largest, from which a parameter is part of a direction
NAMED = 4  # directions


def unobservable(model: ArmModel, data: Measurements, fitted: Fit) -> list[Finding]:
    """What distances and touches leave unknown, as findings; nothing where an instrument alone measured."""
    if data.ends is None:
        return []
    findings = []
    if (data.instrument == WORLD).all():
        message = (
            "no row sees the base: where it stands (base_frame), the zero of J1 and d1 stay nominal, and World is the "
            "robot file's; teach the part's frame with the arm (cgen teach-frame)"
        )
        findings.append(Finding(Level.NOTE, Code.UNOBSERVABLE, message))
    directions = unseen_directions(model, data, fitted)
    if directions:
        more = f", and {len(directions) - NAMED} more" if len(directions) > NAMED else ""
        message = f"no row sees {'; '.join(directions[:NAMED])}{more}: held near nominal by the priors"
        findings.append(Finding(Level.NOTE, Code.UNOBSERVABLE, message))
    return findings


def unseen_directions(model: ArmModel, data: Measurements, fitted: Fit) -> list[str]:
    """Directions of zeros and lengths that no row sees, each by the names of its parameters."""
    index = np.flatnonzero(fitted.active)
    columns = [n for n, k in enumerate(index.tolist()) if model.parameters[k].source in GEOMETRY]
    if not columns:
        return []
    K = len(index)
    rows = scaled_rows(data, fitted)
    S = _freed(rows[:, columns], rows[:, K:])
    values, vectors = np.linalg.eigh(S.T @ S)
    unseen = _simplest(vectors[:, values < UNSEEN**2])
    names = [model.parameters[index[n]].name for n in columns]
    return [
        " with ".join(names[n] for n in np.argsort(-np.abs(v), kind="stable") if abs(v[n]) > PART * np.abs(v).max())
        for v in unseen.T
    ]


def _freed(columns: Array, others: Array) -> Array:
    """Columns less what others take up."""
    size = np.linalg.norm(others, axis=0)
    values, vectors = np.linalg.eigh((scaled := others / np.where(size > 0, size, 1.0)).T @ scaled)
    basis = np.linalg.qr(scaled @ vectors[:, values > 1e-10 * max(values[-1], 1e-300)])[0]
    return np.asarray(columns - basis @ (basis.T @ columns))


def _simplest(basis: Array) -> Array:
    """The same space by directions that have few parameters each: Gauss-Jordan on the largest entries, (K, m)."""
    basis = basis.copy()
    for m in range(basis.shape[1]):
        taken = np.abs(basis).copy()
        taken[:, :m] = 0.0
        row, column = divmod(int(np.argmax(taken)), taken.shape[1])
        basis[:, [m, column]] = basis[:, [column, m]]
        basis[:, m] /= basis[row, m]
        for other in range(basis.shape[1]):
            if other != m:
                basis[:, other] -= basis[row, other] * basis[:, m]
    return basis
