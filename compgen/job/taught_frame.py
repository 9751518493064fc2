r"""A part's frame and how it was taught: what of it is open, and what of the robot's errors it has taken up.

A quantity that moves the tool by c_r at the touches and by c(n) on the path moves the frame, and the probe that was
fitted along, by u = G c (``rigid_share``). On the part c(n) - D(n) u is left: the base is off by w x m - d and -w too,
and the tool by t where it is that probe, so these are added to what the quantity changes. Rises that sensors show
wrongly were shown so too when a warm arm taught. What is open of an anchored state is open now, and was not then.

What is open of the frame itself is the touches' noise: G diag(sigma^2) G^T of place, turn and probe together.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array
from compgen.core.pose import Pose
from compgen.core.units import DEG, MDEG, MM, UM
from compgen.error_model.direction_memory import DirectionState
from compgen.error_model.parameter_slopes import SourceParameters, build_slopes
from compgen.error_model.rigid_share import RigidShare, rigid_share
from compgen.error_model.uncertain_sources import DrawnCause, Quantity
from compgen.job.job import Cell
from compgen.job.part_frame import WARM
from compgen.planning.tables import TaughtTable

NOW = "anchored state"  # in the budget: of now, and not of when the frame was taught
PROBE = 500 * UM  # standard deviation with which teaching begins to fit the probe
SAME_TOOL = 10 * UM  # between the probe that taught and the tool: one and the same
OPEN = tuple(f"part's {what} {axis}" for what in ("place", "turn", "probe") for axis in "xyz")


@dataclass(frozen=True, eq=False, slots=True)
class TakenUp:
    """What a taught frame has taken up of the errors that are no quantity."""

    warm: Array  # (9,) of the thermal error: base shift, base turn and tool [m], [rad]
    share: RigidShare
    touched: Array  # (T, 3) [m] places, World
    with_tool: bool  # whether the probe that was fitted along is the tool


def is_own_teaching(cell: Cell, taught: TaughtTable | None) -> bool:
    """Whether a part's frame was taught through this very robot file's model and says its touches."""
    if taught is None or taught.through != "model" or not taught.touches:
        return False
    return taught.robot_file.endswith(cell.robot_file_hash[:16])


def is_probe(tool: Pose, taught: TaughtTable) -> bool:
    """Whether a tool is the probe that taught the frame."""
    return float(np.abs(tool.position - np.array(taught.probe_mm) * MM).max()) < SAME_TOOL


def open_of_frame(taught: TaughtTable, rows: Array, middle: Array, nothing: DrawnCause) -> list[Quantity]:
    """What is open of a frame that does not say its touches: place and turn by their sigmas.

    Args:
        taught: How it was taught.
        rows: Where base and tool stand among the parameters (``frame_rows``).
        middle: What it may be turned about, World, (3,) [m].
        nothing: The cause that changes nothing.
    """
    sigma = np.concatenate([np.array(taught.sigma_um) * UM, np.array(taught.sigma_mdeg) * MDEG, np.zeros(3)])
    return _of_factor(np.diag(sigma), rows, middle, nothing)


def _of_factor(factor: Array, rows: Array, middle: Array, nothing: DrawnCause) -> list[Quantity]:
    """The columns of a factor (9, 9) of the covariance of place, turn and probe, each a quantity."""
    changes = [rows @ _about_origin(u, middle) for u in factor.T]
    return [
        Quantity(name, "part's frame", replace(nothing, parameters=change))
        for name, change in zip(OPEN, changes, strict=True)
        if change.any()
    ]


def taken_up(
    cell: Cell,
    taught: TaughtTable,
    parameters: SourceParameters,
    quantities: Sequence[Quantity],
    rows: Array,
    nothing: DrawnCause,
) -> tuple[list[Quantity], TakenUp]:
    """The quantities with what the frame has taken up of each, and what is open of the frame itself.

    Args:
        cell: That taught the frame.
        taught: How.
        parameters: That the quantities change.
        quantities: Of the cell.
        rows: Where base and tool stand among the parameters (``frame_rows``).
        nothing: The cause that changes nothing.

    Returns:
        The quantities, and what the frame has taken up of the rest.
    """
    touches, names, probe = taught.touches, cell.heat.names, Pose(np.array(taught.probe_mm) * MM, np.eye(3))
    theta = cell.robot.to_theta(np.array([t.joints_deg for t in touches]) * DEG)
    rise = np.tile([taught.rise_K.get(name, 0.0) for name in names], (len(touches), 1))
    motion = DirectionState(np.array([t.direction for t in touches]), np.zeros((len(touches), 3)))
    model = cell.error_model(probe)
    at, cold = (model.actual_pose(theta, r, motion) for r in (rise, 0 * rise))
    noise, along = np.array([t.noise_um for t in touches]) * UM, np.array([t.probing or [np.nan] * 3 for t in touches])
    share = rigid_share(at.position, at.rotation, along, noise, PROBE)
    changes = np.array([q.cause.parameters for q in quantities]).reshape(-1, len(parameters.entries))
    which = tuple(np.flatnonzero(changes.any(axis=0)).tolist())
    A, B, _ = build_slopes(cell.robot, parameters, which, len(names), probe)(theta, rise, motion)
    shown = np.array([q.cause.heat.start for q in quantities]).reshape(-1, len(names)) * (rise.max(initial=0.0) > WARM)
    moved = share.motion(A @ changes[:, which].T + B @ shown.T)
    budgets, shared = parameters.budgets(), list[Quantity]()
    for quantity, change, u in zip(quantities, changes, moved.T, strict=True):
        if quantity.source == NOW or not u.any():
            shared.append(quantity)
            continue
        named = quantity.source or budgets[int(np.flatnonzero(change)[0])]
        cause = replace(quantity.cause, parameters=change + rows @ _about_origin(u, share.middle))
        shared.append(replace(quantity, cause=cause, source=named))
    warm = share.motion((at.position - cold.position)[:, :, None])[:, 0]
    values, vectors = np.linalg.eigh((share.gain * noise[share.touch] ** 2) @ share.gain.T)
    of_frame = _of_factor((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T, rows, share.middle, nothing)
    with_base = rows.any(axis=0) * _about_origin(warm, share.middle)
    return [*shared, *of_frame], TakenUp(with_base, share, at.position, bool(rows[:, 6:].any()))


def frame_rows(parameters: SourceParameters, *, with_tool: bool) -> Array:
    """Where base shift, base turn and, where it is the probe, the tool stand among the parameters, (P, 9)."""
    position, rotation = parameters.base()
    rows = np.zeros((len(parameters.entries), 9))
    rows[[*position, *rotation, *parameters.tool()], np.arange(9)] = [1.0] * 6 + [float(with_tool)] * 3
    return rows


def _about_origin(u: Array, middle: Array) -> Array:
    """Base shift, base turn and tool of a part that stands shifted by d, turned by w about its middle, (9,)."""
    d, w, t = u[:3], u[3:6], u[6:]
    return np.concatenate([np.cross(w, middle) - d, -w, t])
