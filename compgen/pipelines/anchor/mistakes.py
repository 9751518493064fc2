"""Touches that cannot be of the artefact as it is named: swapped spheres, other units, another place."""

import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError
from compgen.core.units import DEG, MM
from compgen.identification.touches import Artefact, Touches, unit_of

FAR = 10 * MM  # of a target from where it was touched: not a drift
PROBE = 250 * MM  # no longer than that: a file in metres may have its probe in metres too
LEAST_COORDINATES = 6
RADIANS = 4 * DEG  # that no pendant angle exceeds where radians were typed for degrees


def check_touches(
    artefact: Artefact, touches: Touches, centre: Array, place: Array, radius: Array, coordinates: int, largest: float
) -> None:
    """Raises InputError for touches that are not of the targets that they name.

    Args:
        artefact: What was touched.
        touches: N of them.
        centre: Where the controller believes the probe's centre, World, (N, 3) [m].
        place: Where each target is, World, (T, 3) [m]; NaN: unknown.
        radius: From a sphere's centre to the probe's where it touched from one side, (N,) [m]; else 0.
        coordinates: How many they give.
        largest: Pendant angle of all joints [rad].
    """
    S = len(artefact.names)
    unplaced = [artefact.targets[t] for t in np.unique(touches.target).tolist() if np.isnan(place[t, 0])]
    if unplaced:
        raise InputError(
            f"{artefact.source}: sphere '{unplaced[0]}': no place, so that touching it anchors nothing; give "
            f"x_mm, y_mm, "
            "z_mm, or leave its touches out"
        )
    on = touches.target < S
    spheres = np.flatnonzero(on)
    distance = np.abs(np.linalg.norm(centre[:, None] - place[None, :S], axis=2) - radius[:, None])  # (N, S)
    own = distance[spheres, touches.target[spheres]]
    if not (own > FAR).any():
        if coordinates < LEAST_COORDINATES:
            raise InputError(
                f"{touches.file}: {coordinates} coordinates of touches; a state needs {LEAST_COORDINATES} at least, 24 "
                "(8 located spheres) serve well: touch more"
            )
        return
    nearest = distance.argmin(axis=1)
    met = distance[np.arange(len(distance)), nearest] < FAR
    n = int(spheres[np.argmax(own)])
    named, real = artefact.names[touches.target[n]], artefact.names[nearest[n]]
    if met[n]:
        others = np.flatnonzero(on & (touches.target == nearest[n]))
        swapped = len(others) > 0 and bool((nearest[others] == touches.target[n]).all() and met[others].all())
        words = (
            f"spheres '{named}' and '{real}' are swapped" if swapped else f"it is named '{named}', touched was '{real}'"
        )
        raise InputError(f"{touches.label[n]}: {words}: the probe was at '{real}'; mend column target")
    gap = float(np.linalg.norm(centre[n] - place[touches.target[n]]))
    if unit := unit_of(centre[n], place[:S]):
        raise InputError(f"{touches.label[n]}: x_mm, y_mm, z_mm are {unit}, as the artefact's places say; give mm")
    for name, factor in (("metres", 1e3), ("inches", 25.4)):
        if (np.abs(np.linalg.norm(centre[n] - factor * place[:S], axis=1) - radius[n]) < PROBE).any():
            raise InputError(
                f"{artefact.source}: sphere '{named}': x_mm, y_mm, z_mm are {name}, as the touches say; give mm"
            )
    mend = "joints are in radians, not degrees" if largest < RADIANS else "mend its place, artefact.frame, or the probe"
    raise InputError(f"{touches.label[n]}: touched {gap / MM:.0f} mm from where sphere '{named}' is; {mend}")
