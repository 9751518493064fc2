r"""What touches tell of a path, as anchoring takes it: one linear model of robot, places and physics left out.

    s = (x, q, v, u, f)    path  C = (G, N, 0, 0, A),    touch of target s  H = (H, N, D, -I_s, I_s)

with x what a state says, q what else is not known of the robot (unit variance), v what play of no known sense does
alike in all touches, u where S targets stand, and f what no source models there: a smooth field of covariance K, whose
share that the targets tell of a place along the path is A = k^T K^-1; what they do not is left whatever is touched.

Targets are what of an artefact touches can anchor by, in the frame that its places are in.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from compgen.core.arrays import Array, BoolArray, rms
from compgen.core.exceptions import ImpossibleError, InputError
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.pose import IDENTITY, Pose
from compgen.core.units import MM
from compgen.identification.choice_by_exchange import PathDrift, path_weight
from compgen.identification.touch_candidates import Probe, Targets, Ways
from compgen.identification.touches import Artefact, Touches
from compgen.job.job import Job
from compgen.job.part_frame import PartFrame
from compgen.pipelines.anchor.estimate import PathPlaces, TaughtPlaces, compare, estimate, path_columns
from compgen.pipelines.anchor.forecast import Forecast, forecast_now
from compgen.pipelines.anchor.hypotheses import AS_FORECAST
from compgen.pipelines.anchor.touching import ALIKE, reached, taught_rises, thermal_shift
from compgen.pipelines.anchor.unknowns import unknowns_of, with_open_world
from compgen.program.frames import load_frames
from compgen.verification.band import field_correlation

RIDGE = 1e-9  # of the field's variance
TINY = 1e-18  # [m^2] of a field that is none
MOST_TARGETS = 60
LEAST_DIAMETER = 1 * MM


@dataclass(frozen=True, eq=False, slots=True)
class TouchModel:
    """The linear model of K ways to touch and M places of a path."""

    prior: Array  # (Q, Q) covariance of s
    column: Array  # (M, 3, Q) C
    left: Array  # (M,) [m^2] variance that no touch lowers, all directions together
    rows: Array  # (K, 3, Q) H
    play: Array  # (K, 3, 6) of one standard deviation, each touch by itself

    @property
    def drift(self) -> PathDrift:
        """For the choice of touches, every place alike."""
        return PathDrift(self.prior, path_weight(self.column, np.ones(len(self.column))))


def touch_model(
    job: Job, artefact: Artefact, targets: Targets, place_sigma: Array, probe: Probe, ways: Ways, path: PathPlaces
) -> TouchModel:
    """The model of ways to touch and a path.

    Args:
        job: Its robot and its forecast, at the program's start.
        artefact: Whose targets they are.
        targets: S of them.
        place_sigma: Of their places, (S,) [m].
        probe: What touches.
        ways: K of them.
        path: M places.
    """
    touches = _touches(ways)
    forecast = forecast_now(job, touches)
    _, thermal = thermal_shift(forecast, ways.theta[:, 2], probe.centre)
    along, warm = thermal_shift(forecast, path.theta, job.tool.pose)
    unknowns = unknowns_of(job, forecast, path.middle, path.radius, forecast.cell.missing * rms(thermal))
    theta, K = ways.theta[:, 2], len(ways.target)
    rise = np.broadcast_to(forecast.rise, (K, len(forecast.rise)))
    motion = reached(job.robot, forecast.cell.sources, artefact, touches)
    taught = None if artefact.taught is None else taught_rises(artefact, job.cell.heat.names)
    H, N, D = unknowns.columns_of_touches(forecast, theta, probe.centre, rise, motion, taught)
    in_frame = None if taught is None else TaughtPlaces(theta, probe.centre, taught)
    G, N_path = path_columns(job, forecast, unknowns, path, in_frame)
    if taught is None and job.cell.posterior is not None:
        unknowns = with_open_world(unknowns, N_path, path.position)
    shared = forecast.cell.fit.noise if taught is None else 0.0
    share, field, left = _field(forecast, targets, ways, thermal, along, warm, shared)
    S, M = len(targets.name), len(along)
    of_target = np.einsum("ks,ij->kisj", np.eye(S)[ways.target], np.eye(3)).reshape(K, 3, -1)
    on_path = np.einsum("ms,ij->misj", share, np.eye(3)).reshape(M, 3, -1)
    places = np.diag(np.repeat(place_sigma**2, 3))
    return TouchModel(
        block_diag(unknowns.prior.forecast, np.eye(N.shape[2] + 6), places, np.kron(field, np.eye(3))),
        np.concatenate([G, N_path, np.zeros((M, 3, 6 + 3 * S)), on_path], axis=2),
        left,
        np.concatenate([H, N, np.sqrt(ALIKE) * D, -of_target, of_target], axis=2),
        np.sqrt(1 - ALIKE) * D,
    )


def left_by_anchoring(job: Job, artefact: Artefact, frame: Pose, ways: Ways, sigma: float, path: PathPlaces) -> float:
    """The path's rms after anchoring by some ways, as ``cgen anchor`` will expect it [m].

    A state has no word for what touches tell of a robot's geometry, but for what of it the base can carry: it leaves
    a little more than touches tell.

    Args:
        job: Its robot and its forecast.
        artefact: Whose targets they are.
        frame: Place in World of the frame that the artefact's places are in.
        ways: That are touched.
        sigma: Of one coordinate [m].
        path: M places.

    Raises:
        InputError: Too few touches for a state.
    """
    touches = replace(_touches(ways), sigma=np.full(len(ways.target), sigma))
    beside = compare(job, artefact, touches, frame, path)
    return rms(estimate(beside, AS_FORECAST).after)


def _touches(ways: Ways) -> Touches:
    """The ways as touches at the time of the forecast."""
    count = len(ways.target)
    return Touches(
        label=("planned",) * count,
        time=np.zeros(count),
        timed=False,
        target=ways.target,
        theta=ways.theta[:, 2],
        normal=ways.normal,
        deflection=np.zeros(count),
        sigma=np.full(count, np.nan),
    )


def _field(
    forecast: Forecast, targets: Targets, ways: Ways, thermal: Array, along: Array, warm: Array, shared: float
) -> tuple[Array, Array, Array]:
    """A (M, S), K (S, S) [m^2], and what of the field no target tells along the path, (M,) [m^2].

    Of what no source models of the cold arm, touches share ``shared`` [m] with the path: none where the robot taught.
    """
    kappa, noise = forecast.cell.missing, forecast.cell.fit.noise
    count = np.bincount(ways.target, minlength=len(targets.name))
    at_targets = kappa * np.bincount(ways.target, thermal, len(targets.name)) / np.maximum(count, 1)
    alike = field_correlation(targets.place, targets.place)
    K = alike * (np.outer(at_targets, at_targets) + shared**2)
    K += RIDGE * max(float(K.max()), TINY) * np.eye(len(K))
    missed = kappa * warm
    cross = field_correlation(along, targets.place) * (np.outer(missed, at_targets) + shared**2)
    share = np.asarray(np.linalg.solve(K, cross.T).T, dtype=np.float64)
    left = 3 * np.maximum(missed**2 + noise**2 - np.einsum("ms,ms->m", share, cross), 0.0)
    return share, np.asarray(K), np.asarray(left)


def frame_of_artefact(artefact: Artefact, part: PartFrame | None, frames: str | None) -> tuple[int, Pose]:
    """Number of the frame, and where it is in World.

    Args:
        artefact: Says which frame.
        part: Of the path; its user frame is known.
        frames: A frames table or SYSFRAME.VA that says where others are.

    Raises:
        InputError: Nothing says where the user frame is.
    """
    if artefact.frame == "world":
        return 0, IDENTITY
    number = int(artefact.frame.split()[1])
    known = {} if part is None else {part.number: part.register}
    if frames is not None:
        known.update(load_frames(frames).uframe)
    if number not in known:
        raise InputError(
            f"{artefact.source}: artefact.frame: its places are in user frame {number}; say where that is with "
            "--frames FILE, or give the path file its [frame]"
        )
    return number, known[number]


def targets_of(artefact: Artefact, frame: Pose, *, centres: bool) -> tuple[Targets, Array, list[Finding]]:
    """The spheres and planes that can anchor, in World, with the sigma of their places (S,) [m].

    Args:
        artefact: Its file.
        frame: Place in World of the frame that its places are in.
        centres: Whether a touch locates the centre of a sphere; planes are left out then.

    Raises:
        InputError: Nobody vouches for places, none is known, a diameter or the probe's place is missing.
    """
    placed = np.isfinite(artefact.place[:, 0])
    planes = 0 if centres else len(artefact.planes)
    notes = _require_targets(artefact, placed, planes, centres=centres)
    rows = np.flatnonzero(placed)
    return (
        Targets(
            (*(artefact.names[i] for i in rows.tolist()), *artefact.planes[:planes]),
            frame.act(np.vstack([artefact.place[rows], artefact.point[:planes]])),
            np.append(np.nan_to_num(artefact.diameter[rows]) / 2, np.zeros(planes)),
            np.vstack([np.full((len(rows), 3), np.nan), artefact.normal[:planes] @ frame.rotation.T]),
        ),
        np.append(artefact.sigma[rows], artefact.plane_sigma[:planes]),
        notes,
    )


def _require_targets(artefact: Artefact, placed: BoolArray, planes: int, *, centres: bool) -> list[Finding]:
    """Raises InputError unless the placed spheres (S,) and some planes can anchor; what is to be known of them."""
    source, notes = artefact.source, list[Finding]()
    if artefact.certified is False and artefact.taught is None:
        raise InputError(
            f"{source}: artefact.certified: false: places that nobody certified anchor nothing; give certified = true "
            "with what is certified and sigma_um, or [artefact.taught] if this robot taught them"
        )
    if artefact.certified is None and artefact.taught is None:
        message = f"{source}: artefact.certified: not said: places count as an instrument's, known to their sigma_um"
        notes.append(Finding.of(Code.TOUCHES_CERTIFIED, message))
    unplaced = ", ".join(n for n, known in zip(artefact.names, placed.tolist(), strict=True) if not known)
    if not placed.any() and not planes:
        raise InputError(f"{source}: sphere: none has a place; give x_mm, y_mm, z_mm of those to be touched")
    if unplaced:
        message = f"{source}: sphere {unplaced}: no place, so a touch anchors nothing: left out"
        notes.append(Finding.of(Code.TOUCHES_UNKNOWN_PLACE, message))
    if placed.sum() + planes > MOST_TARGETS:
        count = placed.sum() + planes
        raise InputError(f"{source}: {count} targets; at most {MOST_TARGETS} are planned for: leave some out")
    if not artefact.probe.any():
        raise InputError(f"{source}: probe: no place in the flange; give [probe] x_mm, y_mm, z_mm of its ball's centre")
    undefined = placed & np.isnan(artefact.diameter)
    if undefined.any() and not centres:
        name = artefact.names[int(np.argmax(undefined))]
        raise InputError(
            f"{source}: sphere '{name}': diameter_mm: missing; touches from one side need it: give it, or plan with "
            "--centres"
        )
    small = artefact.diameter < LEAST_DIAMETER
    if small.any():
        name, size = artefact.names[int(np.argmax(small))], float(artefact.diameter[small][0]) / MM
        raise InputError(f"{source}: sphere '{name}': diameter_mm: {size:g} is no sphere to touch; give millimetres")
    return notes


def unreached(artefact: Artefact, targets: Targets, ways: Ways) -> Iterator[Finding]:
    """Names the targets that the arm does not reach.

    Raises:
        ImpossibleError: It reaches none.
    """
    missed = [n for s, n in enumerate(targets.name) if not (ways.target == s).any()]
    if len(missed) == len(targets.name):
        x, y, z = (targets.place[0] / MM).tolist()
        raise ImpossibleError(
            f"{artefact.source}: {', '.join(missed)[:60]}: out of the arm's reach in the program's posture "
            f"('{missed[0]}' at World {x:.0f} {y:.0f} {z:.0f} mm); check [artefact] frame and places"
        )
    if missed:
        yield Finding.of(
            Code.TOUCHES_REACH, f"{', '.join(missed)}: no way to touch it in the program's posture: left out"
        )
