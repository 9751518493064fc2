"""The band at the samples of a geometry: for a scenario, a run of the day, a question."""

from itertools import product

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.error_model.direction_memory import direction_states, reversal_widths
from compgen.job.job import Job
from compgen.job.uncertainty import quantities_of
from compgen.pipelines.study.geometry import Geometry, model_of
from compgen.pipelines.uncertainty.band import Places, columns_at
from compgen.thermal.history import History
from compgen.verification.band import Band, band_of

SAMPLES = 200  # evenly
DIRECTIONS = np.array([d for d in product((-1, 0, 1), repeat=3) if any(d)], dtype=float)


def band_at_samples(job: Job, geometry: Geometry, history: History | None = None, rise: Array | None = None) -> Band:
    """What a job's files leave open at some samples of its path, wherever it touches.

    Args:
        job: Its warmth may be another than the geometry's.
        geometry: The path, executed.
        history: What went before, where it is not the job's.
        rise: Then, (K,) or at the samples (n, K) [K]; None: as the job's rises run.
    """
    some = some_samples(geometry)
    thin, model = geometry.at(some), model_of(job)
    position = model.nominal_pose(geometry.theta).position
    motion = direction_states(reversal_widths(job.sources), geometry.theta, position).at(some)
    rises = thin.rises(job) if rise is None else np.broadcast_to(rise, (len(some), rise.shape[-1]))
    low, high = position.min(axis=0), position.max(axis=0)
    uncertainty = quantities_of(job, middle=(low + high) / 2)
    places = Places(theta=thin.theta, time=thin.now, rise=rises, motion=motion, tool=job.tool.pose)
    columns = columns_at(job.cell, history or job.history, job.feed, uncertainty, places, model)
    return band_of([columns], np.arange(len(some)), part_weight(geometry, thin), job.cell.fit.scale)


def some_samples(geometry: Geometry) -> IntArray:
    """Which samples of a geometry stand for its band: evenly where the tool touches, and what lies farthest out there.

    What is open is smooth along the part and largest at its rim: the farthest in each direction are among them, for
    either way that the tool goes, because play and friction follow it.
    """
    position = model_of(geometry.job).nominal_pose(geometry.theta).position
    touching = np.flatnonzero(part_weight(geometry, geometry))
    rows = touching if len(touching) else np.arange(len(geometry.now))
    along = np.gradient(position, axis=0)[rows] if len(rows) > 1 else np.zeros((1, 3))
    evenly = rows[np.linspace(0, len(rows) - 1, min(SAMPLES, len(rows))).astype(int)]
    ways = [rows[sign * along[:, axis] >= 0] for axis in range(3) for sign in (-1, 1)]
    rim = [way[np.argmax(position[way] @ DIRECTIONS.T, axis=0)] for way in ways if len(way)]
    return np.asarray(np.unique(np.concatenate([evenly, *rim])))


def part_weight(geometry: Geometry, thin: Geometry) -> Array:
    """One between waypoints that both touch, zero elsewhere, at the samples of a thinned geometry.

    A job's band is of its touching waypoints: beyond the last of them it would be a little larger.
    """
    contact = geometry.path.contact
    both = contact[:-1] & contact[1:]
    return np.asarray((both if both.any() else contact[:-1] | contact[1:])[thin.segment].astype(float))
