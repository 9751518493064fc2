r"""Which reading of the joint columns explains measured places: a sign, the convention of J3, an order, an offset.

The pendant's angles p become theta = M p + theta_0 by the robot file. A file of another convention is read as

    p' = C p + c,     C: the sign of one joint, J3 against link 2 or against the horizontal (J3 -/+ J2), two joints
                      exchanged;  c: a quarter turn or a half of one joint

and each is judged by how near the nominal arm then comes to the places, with the frames that fit it best. What is 5
times nearer than the reading as it stands is what is wrong; two such readings together are found one after the other.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array
from compgen.core.units import DEG

SUSPECT = 4e-3  # [m] mean distance above which readings are tried; no arm is so far off its nominal figures
BETTER = 5.0  # times nearer that a reading must come
HELPS = 1.5  # times nearer that the first of two must come
ALIKE, EXACT = 1.1, 1e-6  # times, and [m], by which readings are equally near
KEPT = 0.95  # share of rows, the nearest, whose mean distance counts


@dataclass(frozen=True, eq=False, slots=True)
class Reading:
    """A way to read the columns of joints."""

    words: str  # what fits
    matrix: Array  # (6, 6) C
    offset: Array  # (6,) [rad] c

    def of(self, pendant: Array) -> Array:
        """The angles that the pendant would show, (N, 6) [rad]."""
        return np.asarray(pendant @ self.matrix.T + self.offset)


def readings(has_coupling: bool) -> list[Reading]:
    """All that are tried.

    Args:
        has_coupling: Whether the robot file counts J3 against the horizontal.
    """
    still, unit = np.zeros(6), np.eye(6)
    signs = [Reading(f"J{k + 1} fits with the opposite sign", unit - 2 * np.diag(unit[k]), still) for k in range(6)]
    horizontal = "J3 fits the pendant's convention of the horizontal (theta_3 = J2 + J3)"
    link = "J3 fits the convention of the angle against link 2 (theta_3 = J3), not of the horizontal"
    to_link, to_horizontal = unit.copy(), unit.copy()
    to_link[2, 1], to_horizontal[2, 1] = -1.0, 1.0
    coupling = [Reading(link if has_coupling else f"{link}, with J2 of the opposite sign", to_link, still)]
    coupling.append(
        Reading(f"{horizontal}, which the robot file has already" if has_coupling else horizontal, to_horizontal, still)
    )
    turned = [
        Reading(f"J{k + 1} fits with its zero turned by {turn:+d} deg", unit, unit[k] * turn * DEG)
        for k in range(6)
        for turn in (-90, 90, 180)
    ]
    if has_coupling:  # the sign of theta_2 alone: theta_3 = J2 + J3 keeps its own
        alone = unit - 2 * np.diag(unit[1])
        alone[2, 1] = 2.0
        signs.insert(2, Reading(f"{signs[1].words}, and J3 as it is against the horizontal", alone, still))
    exchanged = []
    for i, j in ((0, 1), (1, 2), (3, 4), (4, 5), (3, 5)):
        order = list(range(6))
        order[i], order[j] = j, i
        exchanged.append(Reading(f"J{i + 1} and J{j + 1} fit exchanged", unit[order], still))
    return [*signs, *coupling, *turned, *exchanged]


def better_reading(
    pendant: Array, has_coupling: bool, distance_of: Callable[[Array], Array]
) -> tuple[str, float, float] | None:
    """What explains measured places much better than the angles as they stand.

    Args:
        pendant: Angles of the poses, (M, 6) [rad].
        has_coupling: Whether the robot file counts J3 against the horizontal.
        distance_of: Distances of the rows from the nominal arm at pendant angles, (M, 6) [rad] to (N,) [m].

    Returns:
        In words, the mean distance as it stands and as it then is [m]; None where nothing is much better.
    """
    as_given = _mean(distance_of(pendant))
    if as_given <= SUSPECT:
        return None
    words: list[str] = []
    best, angles = as_given, pendant
    for _ in range(2):
        tried = [(_mean(distance_of(reading.of(angles))), reading) for reading in readings(has_coupling)]
        least = min(mean for mean, _ in tried)
        # J5 reversed is J4 turned by 180 deg as well: the sign is named, which stands first
        nearest, reading = next(pair for pair in tried if pair[0] <= least * ALIKE + EXACT)
        if nearest * HELPS > best:
            break
        words.append(reading.words)
        best, angles = nearest, reading.of(angles)
        if best * BETTER < as_given and best < 2 * SUSPECT:
            break
    return ("; ".join(words), as_given, best) if words and best * BETTER < as_given else None


def _mean(distance: Array) -> float:
    """Of the nearest rows: a few that were misread say nothing of the columns [m]."""
    nearest = np.sort(distance)[: max(1, int(KEPT * len(distance)))]
    return float(nearest.mean())
