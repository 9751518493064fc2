r"""Touches against the forecast: by how much, along which directions, and what each unknown would do to them.

The probe's centre is really at a(theta, x), its target at s. By coordinate:

    located sphere      y = s - a                                      three
    sphere, one side    y = e^T (s - a) - (D + d) / 2                  e from the probe to the sphere
    plane               y = n^T (p - a) + d / 2                        n out of the material

A target that an instrument has placed is where the artefact's file says. One that the robot itself taught is where
the robot really was when it commanded that place: s = c + a(theta, taught) - nominal(theta), so that what was and is
wrong of the cold arm cancels. Valid while both touches have the same posture and about the same orientation.

Touches that cannot be of the artefact as it is named (swapped spheres, other units, another place) are refused.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.toml import suggest
from compgen.core.units import DEG, MM, UM
from compgen.error_model.direction_memory import NO_DIRECTION, DirectionState
from compgen.error_model.source import Source
from compgen.identification.touch_rows import sigma_of
from compgen.identification.touches import Artefact, Touches, check_directions, likely_unit, probed_motion
from compgen.pipelines.anchor.forecast import Forecast
from compgen.pipelines.anchor.hypotheses import Innovation
from compgen.pipelines.anchor.unknowns import Unknowns
from compgen.robot.kinematics import flange_pose
from compgen.robot.robot import Robot
from compgen.verification.band import field_correlation

SIGMA = 15 * UM  # of a coordinate whose touch says none [assumed]
ALIKE = 0.5  # of the variance of play whose sense is not known: alike in all touches (one way down) [assumed]
THROUGH = 1 * DEG  # turned by which a joint is through its play, of any width that was seen
SEARCHED = 0.3  # [rad/m] by which a joint is through play of 0.2 deg to both sides after a search of 20 mm
FAR = 10 * MM  # of a target from where it was touched: not a drift
NEAR = 1 * MM  # of where a touch from one side would be
PROBE = 250 * MM  # no longer than that: a file in metres may have its probe in metres too
LEAST_COORDINATES = 6
RADIANS = 4 * DEG  # that no pendant angle exceeds where radians were typed for degrees


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Touched:
    """N touches as poses of the probe, and their targets in World."""

    touches: Touches
    probe: Pose  # its centre in the flange
    motion: DirectionState
    rise: Array  # (N, K) [K]
    taught: Array | None  # (K,) [K] rises of the robot that taught the targets; None: an instrument placed them
    actual: Array  # (N, 3) [m] where the probe's centre is by the forecast
    thermal: Array  # (N,) [m] by how much the rises move it
    along: Array  # (R, 3) unit vector of each coordinate
    touch: IntArray  # (R,)
    y: Array  # (R,) [m]
    place_sigma: Array  # (T,) [m]
    sigma: Array  # (R,) [m]


def touched(artefact: Artefact, touches: Touches, frame: Pose, forecast: Forecast) -> Touched:
    """Compare touches with a forecast.

    Args:
        artefact: What was touched.
        touches: N of them.
        frame: Place in World of the frame that the artefact's places are in.
        forecast: Of the robot then.

    Raises:
        InputError: Touches that are not of their targets.
    """
    cell, probe, theta = forecast.cell, Pose(artefact.probe, np.eye(3)), touches.theta
    motion = reached(cell.robot, cell.sources, artefact, touches)
    model = cell.error_model(probe)
    rise, pushed = forecast.touch_rise, touches.deflection[:, None] * np.nan_to_num(touches.normal)
    nominal = model.nominal_pose(theta).position - pushed
    actual, cold = (model.actual_pose(theta, r, motion).position - pushed for r in (rise, 0 * rise))
    place = frame.act(np.vstack([artefact.place, artefact.point]))
    target, taught = place[touches.target], None
    outward = _outward(artefact, touches, frame)
    reach = np.where(np.isfinite(touches.normal[:, 0]) & np.isnan(outward[:, 0]), _radius(artefact, touches), 0.0)
    largest = float(np.abs(cell.robot.to_pendant(theta)).max())
    check_touches(artefact, touches, nominal, place, reach, largest)
    check_directions(touches, np.where(np.isnan(outward), target - nominal, -outward))
    if artefact.taught is not None:
        taught = taught_rises(artefact, cell.heat.names)
        then = model.actual_pose(theta, np.broadcast_to(taught, rise.shape), motion).position - pushed
        target = target + then - nominal
    touch, along, y = _coordinates(touches, target - actual, outward, reach, artefact.probe_diameter / 2)
    sigma = sigma_of(touches, cell.fit.repeatability or SIGMA)
    # a place that nobody certified is known no better than one touch tells it
    of_place = np.concatenate([artefact.sigma, artefact.plane_sigma])
    open_places = np.where(of_place > 0, of_place, 0.0 if artefact.certified else float(np.median(sigma)))
    return Touched(
        touches=touches,
        probe=probe,
        motion=motion,
        rise=rise,
        taught=taught,
        actual=actual,
        thermal=np.linalg.norm(actual - cold, axis=1),
        along=along,
        touch=touch,
        y=y,
        place_sigma=open_places,
        sigma=sigma[touch],
    )


def reached(robot: Robot, sources: Sequence[Source], artefact: Artefact, touches: Touches) -> DirectionState:
    """How joints came to N touches: along the probing direction, to a located centre along the probe's stem."""
    stem = flange_pose(robot, touches.theta).rotation[:, :, 2]
    is_centre = np.isnan(touches.normal) & (touches.target < len(artefact.names))[:, None]
    along = replace(touches, normal=np.where(is_centre, stem, touches.normal))
    return DirectionState(probed_motion(robot, sources, along, SEARCHED), np.zeros((len(stem), 3)))


def _outward(artefact: Artefact, touches: Touches, frame: Pose) -> Array:
    """Normal of the plane that each touch is of, in World (N, 3); NaN of a sphere."""
    normals = np.vstack([np.full((len(artefact.names), 3), np.nan), artefact.normal @ frame.rotation.T])
    return np.asarray(normals[touches.target])


def _coordinates(
    touches: Touches, gap: Array, outward: Array, reach: Array, ball: float
) -> tuple[IntArray, Array, Array]:
    """The coordinates that touches give: whose each is (R,), its direction (R, 3), and y (R,) [m].

    Args:
        touches: N of them.
        gap: From the probe's centre to each target, (N, 3) [m].
        outward: Of a plane's material, (N, 3); NaN: a sphere.
        reach: From a sphere's centre to the probe's where it was touched from one side, (N,) [m]; else 0.
        ball: Radius of the probe's ball [m].
    """
    on_plane = np.isfinite(outward[:, 0])
    single = on_plane | np.isfinite(touches.normal[:, 0])
    toward = np.where(on_plane[:, None], outward, gap / np.linalg.norm(gap, axis=1)[:, None])
    touch = np.repeat(np.arange(len(gap)), np.where(single, 1, 3))
    axis = np.arange(len(touch)) - np.searchsorted(touch, touch)
    along = np.where(single[touch][:, None], toward[touch], np.eye(3)[axis])
    off = np.where(on_plane, -ball, reach)
    return touch, along, (along * gap[touch]).sum(axis=1) - off[touch]


def innovation_of(seen: Touched, forecast: Forecast, unknowns: Unknowns) -> Innovation:
    """The touches with what each unknown would do to them."""
    theta, cell = seen.touches.theta, forecast.cell
    H, N, D = unknowns.columns_of_touches(forecast, theta, seen.probe, seen.rise, seen.motion, seen.taught)
    noise = cell.fit.noise if seen.taught is None else 0.0
    e, n = seen.along, seen.touch
    play = np.einsum("ri,rij->rj", e, D[n])
    size = forecast.cell.missing * seen.thermal
    field = field_correlation(seen.actual, seen.actual) * (np.outer(size, size) + noise**2)
    return Innovation(
        y=seen.y,
        H=np.einsum("ri,rix->rx", e, H[n]),
        N=np.einsum("ri,riq->rq", e, N[n]),
        along=e,
        target=seen.touches.target[n],
        touch=n,
        place=seen.place_sigma,
        field=field[np.ix_(n, n)] * (e @ e.T) + np.where(n[:, None] == n, 1.0, ALIKE) * (play @ play.T),
        sigma=seen.sigma,
    )


def thermal_shift(forecast: Forecast, theta: Array, tool: Pose) -> tuple[Array, Array]:
    """Where a tool is at poses (M, 6) [rad], (M, 3) [m], and by how much the forecast's rises move it, (M,) [m]."""
    cell = forecast.cell
    model = cell.error_model(tool)
    rise = np.broadcast_to(forecast.rise, (len(theta), len(forecast.rise)))
    warm, cold = (model.actual_pose(theta, r, NO_DIRECTION).position for r in (rise, 0 * rise))
    return warm, np.linalg.norm(warm - cold, axis=1)


def _radius(artefact: Artefact, touches: Touches) -> Array:
    """From the centre of each touched sphere to the probe's, (N,) [m]."""
    diameter = np.append(np.nan_to_num(artefact.diameter), 0.0)
    return np.asarray((diameter[np.minimum(touches.target, len(diameter) - 1)] + artefact.probe_diameter) / 2)


def taught_rises(artefact: Artefact, nodes: tuple[str, ...]) -> Array:
    """Rises of the robot that taught an artefact's places, (K,) [K].

    Raises:
        InputError: A node that the robot file does not have.
    """
    given = dict(artefact.taught or {})
    unknown = next((n for n in given if n not in nodes), None)
    if unknown is not None:
        raise InputError(
            f"{artefact.source}: artefact.taught.rise_K: no node '{unknown}'"
            f"{suggest(unknown, nodes)}; the robot file has {', '.join(nodes)}"
        )
    return np.array([given.get(n, 0.0) for n in nodes])


def check_touches(
    artefact: Artefact, touches: Touches, centre: Array, place: Array, radius: Array, largest: float
) -> None:
    """Raises InputError for touches that are not of the targets that they name.

    Args:
        artefact: What was touched.
        touches: N of them.
        centre: Where the controller believes the probe's centre, World, (N, 3) [m].
        place: Where each target is, World, (T, 3) [m]; NaN: unknown.
        radius: From a sphere's centre to the probe's where it touched from one side, (N,) [m]; else 0.
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
        _require_coordinates(touches, on)
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
    if unit := likely_unit(centre[n], place[:S]):
        raise InputError(f"{touches.label[n]}: x_mm, y_mm, z_mm are {unit}, as the artefact's places say; give mm")
    for name, factor in (("metres", 1e3), ("inches", 25.4)):
        if (np.abs(np.linalg.norm(centre[n] - factor * place[:S], axis=1) - radius[n]) < PROBE).any():
            raise InputError(
                f"{artefact.source}: sphere '{named}': x_mm, y_mm, z_mm are {name}, as the touches say; give mm"
            )
    mend = _mend_of_far_touch(gap, float(radius[n]), float(_radius(artefact, touches)[n]), largest)
    raise InputError(f"{touches.label[n]}: touched {gap / MM:.0f} mm from where sphere '{named}' is; {mend}")


def _mend_of_far_touch(gap: float, radius: float, from_one_side: float, largest: float) -> str:
    """What to do of a touch so far from its sphere's centre where it shall be ``radius`` away [m]."""
    if radius > 0 and gap < FAR:
        return (
            f"one with a direction stands {radius / MM:.4g} mm off, by both diameters: remove nx, ny, nz if it located "
            "the centre, or mend the diameters"
        )
    if radius == 0 and abs(gap - from_one_side) < NEAR:
        return "as one from one side does: give its direction, nx, ny and nz"
    return "joints are in radians, not degrees" if largest < RADIANS else "mend place, artefact.frame, probe or joints"


def _require_coordinates(touches: Touches, on: BoolArray) -> None:
    """Raises InputError where touches, on a sphere or not (N,), say less than a state needs."""
    coordinates = int(np.where(np.isfinite(touches.normal[:, 0]) | ~on, 1, 3).sum())
    if coordinates < LEAST_COORDINATES:
        raise InputError(
            f"{touches.file}: {coordinates} coordinates of touches; a state needs {LEAST_COORDINATES} at least, 24 "
            "(8 located spheres) serve well: touch more"
        )
