"""The proof of a correction: what the twin does with the written text, against the planned poses."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from compgen.arrays import Array, BoolArray, IntArray, dot
from compgen.dialects.fanuc_ls.drive import Drive
from compgen.dialects.fanuc_ls.poses import NONE, Poses
from compgen.ik import ALL_POSTURES, flange_of, nearest_turns, solve
from compgen.job import Cell
from compgen.rotations import between, vector_of
from compgen.thermal import Duty
from compgen.twin import Twin

INSIDE = (0.25, 0.5, 0.75)  # of each straight line


@dataclass(frozen=True, eq=False, slots=True)
class Flight:
    """Where the real tool is, at M samples: each station that can be told, and three places on each straight line."""

    station: IntArray  # (M,) the one ahead, or reached
    fraction: Array  # (M,) of the way to it; 1 is the station itself
    time: Array  # (M,) [s]
    rise: Array  # (M, K) [K]
    position: Array  # (M, 3) [m] actual TCP
    rotation: Array  # (M, 3, 3)


def fly(
    cell: Cell,
    poses: Poses,
    drive: Drive,
    before: Sequence[Duty],
    progress: Callable[[float], None] = lambda share: None,
) -> Flight:
    """Ride a program as read from its text on the twin.

    The twin steps its own heat through the program's times, commands the joints that CONFIG or the joint form name,
    and confirms each with pinocchio's nominal arm.

    Raises:
        TwinError: The controller's inverse and pinocchio disagree.
    """
    station, fraction = samples(poses, drive)
    time, rise = _warmth(cell, drive, before, station, fraction)
    position, rotation = on_the_way(poses, drive, station, fraction)
    pose = drive.pose[station]
    theta = poses.theta[pose].copy()
    flange = np.empty((len(station), 3)), np.empty((len(station), 3, 3))
    kinds = np.column_stack([poses.tool[pose], poses.posture[pose]])
    for tool, posture in np.unique(kinds, axis=0).tolist():
        rows = np.flatnonzero((kinds == [tool, posture]).all(axis=1))
        flange[0][rows], flange[1][rows] = flange_of(position[rows], rotation[rows], *poses.tool_of(tool))
        way = rows[fraction[rows] < 1]
        solved, _ = solve(cell.robot, flange[0][way], flange[1][way], ALL_POSTURES[posture])
        theta[way] = nearest_turns(solved, theta[way])
    twin = Twin(cell.robot, cell.heat, cell.profiles, np.zeros(3), np.eye(3))
    twin.confirm(theta, *flange, poses.number[pose] - 1, lambda share: progress(share / 2))
    real = twin.reach(theta, rise, lambda share: progress(0.5 + share / 2))
    tcp = np.array([*(t[0] for t in poses.tools), np.zeros(3)])[poses.tool[pose]]
    turn = np.array([*(t[1] for t in poses.tools), np.eye(3)])[poses.tool[pose]]
    return Flight(station, fraction, time, rise, real[0] + np.einsum("nij,nj->ni", real[1], tcp), real[1] @ turn)


def samples(poses: Poses, drive: Drive) -> tuple[IntArray, Array]:
    """Stations and fractions of the way to them, in order of time."""
    known, lines = _known(poses, drive), straight(poses, drive)
    station = np.concatenate([np.flatnonzero(known), *(np.flatnonzero(lines) for _ in INSIDE)])
    fraction = np.concatenate([np.ones(int(known.sum())), *(np.full(int(lines.sum()), f) for f in INSIDE)])
    order = np.lexsort((fraction, station))
    return station[order], fraction[order]


def straight(poses: Poses, drive: Drive) -> BoolArray:
    """Stations reached by a straight line whose both ends are known, with one tool and one posture, (S,)."""
    found, known = drive.line.copy(), _known(poses, drive)
    if not known.any():
        return known
    tool, posture = poses.tool[drive.pose], poses.posture[drive.pose]
    found &= known
    found[1:] &= known[:-1] & (tool[1:] == tool[:-1]) & (posture[1:] == posture[:-1])
    found[:1] = False
    return np.asarray(found)


def _known(poses: Poses, drive: Drive) -> BoolArray:
    """Stations whose joints can be told, (S,)."""
    known = drive.pose != NONE
    known[known] = np.isfinite(poses.theta[drive.pose[known]]).all(axis=1)
    return np.asarray(known)


def on_the_way(poses: Poses, drive: Drive, station: IntArray, fraction: Array) -> tuple[Array, Array]:
    """Poses that a program means at fractions of the straight ways to stations, (M, 3) [m] and (M, 3, 3)."""
    there = drive.pose[station]
    here = np.where(fraction < 1, drive.pose[np.maximum(station - 1, 0)], there)
    step = poses.position[there] - poses.position[here]
    position = poses.position[there] - (1 - fraction)[:, None] * step
    rotation = poses.rotation[there].copy()
    way = np.flatnonzero(fraction < 1)
    rotation[way] = between(poses.rotation[here[way]], poses.rotation[there[way]], fraction[way])
    return position, rotation


def off(flight: Flight, position: Array, rotation: Array) -> tuple[Array, Array]:
    """Size of the position error (M,) [m] and angle between actual and meant tool (M,) [rad]."""
    error = flight.position - position
    turn = vector_of(np.swapaxes(rotation, 1, 2) @ flight.rotation)
    return np.sqrt(dot(error, error)), np.sqrt(dot(turn, turn))


def _warmth(
    cell: Cell, drive: Drive, before: Sequence[Duty], station: IntArray, fraction: Array
) -> tuple[Array, Array]:
    """Time and rise of samples, stepping each node through every pause and way."""
    tau = cell.heat.tau
    now, rise = 0.0, np.zeros(len(tau))
    for duty in before:
        goal = cell.heat.steady(duty.state, np.array([duty.feed]))[0]
        rise = goal - (goal - rise) * np.exp(-duty.duration / tau)
    still = cell.heat.steady("idle", np.zeros(1))[0]
    with np.errstate(invalid="ignore", divide="ignore"):
        driven = np.nan_to_num(drive.length / drive.duration, nan=0.0, posinf=0.0)
    goals = cell.heat.steady("moving", driven)
    begin, start = np.empty(len(driven)), np.empty((len(driven), len(tau)))
    for s, (pause, way) in enumerate(zip(drive.pause.tolist(), drive.duration.tolist())):
        if pause:
            rise = still + (rise - still) * np.exp(-pause / tau)
        begin[s], start[s] = now + pause, rise
        rise = goals[s] + (rise - goals[s]) * np.exp(-way / tau)
        now += pause + way
    spent = fraction * drive.duration[station]
    fade = np.exp(-spent[:, None] / tau)
    return begin[station] + spent, goals[station] + (start[station] - goals[station]) * fade
