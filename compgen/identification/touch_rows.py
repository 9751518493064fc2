r"""Touches of an artefact as rows of an identification.

The probe's centre c_n = P + R t - v n is compared with its sphere s in the artefact's frame (F, c),

    s - (F c_n + c) = 0                     where the touch located the sphere's centre: three rows
    |s - (F c_n + c)| = (D + d) / 2         where it came from one side along n: one row

The frame is fitted where three spheres of given places that do not lie on a line are touched. Where fewer are, spheres
stand anywhere in World, and what the places say of them is how far apart they are.
"""

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.exceptions import InputError
from compgen.core.units import DEG, MM, UM
from compgen.identification.measured_poses import check_moving, motion_directions
from compgen.identification.measurements import TOUCH, WORLD, FixedPlaces, Measurements, blank_rows, plain_ends
from compgen.identification.touches import Artefact, Touches, probing_directions
from compgen.robot.robot import Robot

UNCERTIFIED = 1 * MM  # sigma of what an artefact's file says without a certificate and without a sigma
NOISE = 20 * UM  # of a touch that does not say its own
ON_A_LINE = 0.02  # of the spheres' spread: nearer to a line, they do not fix a frame


def touch_rows(
    touches: Touches, artefact: Artefact, robot: Robot, nodes: int, *, force: bool = False, frames_known: bool = False
) -> Measurements:
    """The touches as measurements: one reflector, the probe; the spheres as fixed places.

    Args:
        touches: N of them.
        artefact: What was touched.
        robot: Whose joints they are.
        nodes: How many nodes its heat model has.
        force: Go on with a joint that never moves.
        frames_known: Whether it is known where spheres stand and the probe sits.

    Raises:
        InputError: A joint never moves, or a sphere that stands anywhere is touched too little to be located.
    """
    check_moving(touches.file, robot.to_pendant(touches.theta) / DEG, force=force)
    sided: BoolArray = np.isfinite(touches.normal[:, 0])
    order = np.argsort(touches.time, kind="stable")
    direction = np.empty(touches.theta.shape)
    direction[order] = motion_directions(touches.theta[order])
    direction[sided] = probing_directions(robot, touches.theta[sided], touches.normal[sided])
    touched = np.unique(touches.target)
    framed = _fixes_a_frame(artefact.place[touched])
    frame, name = (0 if framed else WORLD), Path(artefact.source).name
    if not framed and not frames_known:
        _check_located(touches, artefact, touched, sided)
    at_place = np.searchsorted(touched, touches.target)
    return replace(
        touched_poses(artefact, touches, direction, sigma_of(touches), at_place, nodes),
        instrument=np.full(len(sided), frame),
        reflectors=(f"probe of {name}",),
        instruments=(name,) if framed else (),
        aligned=np.zeros(int(framed), dtype=bool),
        fixed=_spheres(artefact, touched, name, frame),
    )


def sigma_of(touches: Touches, usual: float = NOISE) -> Array:
    """Standard deviation of one coordinate of each touch, the usual one where it says none, (N,) [m]."""
    return np.where(np.isfinite(touches.sigma), touches.sigma, usual)


def touched_poses(
    artefact: Artefact, touches: Touches, direction: Array, sigma: Array, place: IntArray, nodes: int
) -> Measurements:
    """Touches as rows of a cold arm, by one reflector, the probe; their frame and their places are still open.

    Args:
        artefact: What was touched.
        touches: N of them.
        direction: That each joint came with, (N, 6) [-1, 1].
        sigma: How uncertain each is beside the others, (N,).
        place: The fixed place of each, NONE for one that is known exactly, (N,).
        nodes: Of the heat model.
    """
    N, at = len(touches.target), touches.target
    radius = (artefact.diameter[at] + artefact.probe_diameter) / 2
    return replace(
        blank_rows(touches.theta, np.arange(N), touches.label, nodes),
        direction=direction,
        time=touches.time,
        sigma=sigma / np.median(sigma),
        stated_sigma=touches.sigma,
        ends=replace(
            plain_ends(N),
            kind=np.full(N, TOUCH),
            place=place,
            shift=-touches.deflection[:, None] * np.nan_to_num(touches.normal),
            distance=np.where(np.isfinite(touches.normal[:, 0]), radius, np.nan),
            toward=touches.normal,
        ),
        timed=touches.timed,
        notes=touches.notes,
        guess=artefact.probe[None],
    )


def _fixes_a_frame(place: Array) -> bool:
    """Whether three of some places, (S, 3) [m], NaN where unknown, do not lie on a line."""
    known = place[np.isfinite(place[:, 0])]
    if len(known) < 3:
        return False
    spread = np.linalg.svd(known - known.mean(axis=0), compute_uv=False)
    return bool(spread[1] > ON_A_LINE * spread[0])


def _check_located(touches: Touches, artefact: Artefact, touched: IntArray, sided: BoolArray) -> None:
    for s in touched.tolist():
        rows = touches.target == s
        if sided[rows].all() and rows.sum() <= 3:
            raise InputError(
                f"{touches.file}: sphere '{artefact.names[s]}' stands anywhere and is touched from {int(rows.sum())} "
                "side(s), which hardly locate it; touch it from four or more"
            )


def _spheres(artefact: Artefact, touched: IntArray, name: str, frame: int) -> FixedPlaces:
    """The touched spheres as places to be fitted, with what the artefact's file says of them."""
    index = {s: n for n, s in enumerate(touched.tolist())}
    given = [s for s in index if np.isfinite(artefact.place[s, 0])]
    by_places, by_lengths = artefact.certified is True, artefact.certified is not False
    place_sigma = _sigma(artefact.sigma, certified=by_places)
    lengths = {
        (index[int(a)], index[int(b)]): (length, sigma)
        for (a, b), length, sigma in zip(
            artefact.between, artefact.length, _sigma(artefact.length_sigma, certified=by_lengths), strict=True
        )
        if int(a) in index and int(b) in index
    }
    certified = (by_lengths and bool(lengths)) or (by_places and len(given) > 1)
    place = artefact.place[touched]
    if frame == WORLD:
        for a, b in combinations(given, 2):
            apart = float(np.linalg.norm(artefact.place[a] - artefact.place[b]))
            lengths.setdefault((index[a], index[b]), (apart, float(np.hypot(place_sigma[a], place_sigma[b]))))
        place = np.full(place.shape, np.nan)
    values = np.array(list(lengths.values())).reshape(-1, 2)
    return FixedPlaces(
        names=tuple(f"{name}: {artefact.names[s]}" for s in touched.tolist()),
        frame=np.full(len(touched), frame),
        place=place,
        sigma=place_sigma[touched],
        between=np.array(list(lengths), dtype=int).reshape(-1, 2),
        length=values[:, 0],
        length_sigma=values[:, 1],
        certified=certified,
    )


def _sigma(given: Array, *, certified: bool) -> Array:
    """Standard deviations as given; where none is, those of what nobody certified [m]."""
    return given if certified else np.where(given > 0, given, UNCERTIFIED)
