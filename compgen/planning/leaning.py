r"""A tool that leans on the surface: ahead or back along the feed (lead), and to its sides (lean).

With n the surface's normal out of the part, f the direction of travel, square to it, and c = n x f, to the left of the
way, the tool's axis out of the part is

    u = (n + tan(lead) f + tan(lean) c) / sqrt(1 + tan(lead)^2 + tan(lean)^2)

and the tool is turned there from n on the shortest way. In the axes of a tool that stands on the surface that is the
Gibbs vector g = (a f_y - b f_x, -a f_x - b f_y, 0) / (1 + sqrt(1 + a^2 + b^2)), with a and b the two tangents.

Where the way turns sharply, with a stop or without, the tool would have to turn on the spot: on the part that is
refused. Off it, and along the normal, the tool turns evenly from where one stretch on the part ends to where the next
begins.
"""

from dataclasses import replace

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, row_norms
from compgen.core.exceptions import InputError
from compgen.core.units import DEG, MM
from compgen.planning.curves import PiecewiseCurve
from compgen.planning.exact_path import ExactPath

NODES = np.linspace(0.0, 1.0, 4)  # of a cubic
CUBIC = np.linalg.inv(np.vander(NODES, increasing=True))  # its coefficients from its values there
TURN = 3 * DEG  # of the way in a piece at most: the cubic is then within 4e-9 of g
SAMPLES = np.linspace(0.0, 1.0, 9)  # of a piece, where it is looked at
SAME = 1e-6  # of Gibbs vectors at a corner
ALONG = 1e-6  # of the direction of travel in the surface, below which it is the normal


def leaned(path: ExactPath, lead: float, lean: float) -> PiecewiseCurve:
    """The curve of a path with the tool leaning by two angles [rad].

    Raises:
        InputError: The path goes along the normal, or turns sharply on the part; begins with "process.lead_deg".
    """
    slopes = np.tan([lead, lean])
    g = _gibbs(path, SAMPLES, slopes)
    resting = _off_the_part(path) | np.isnan(g).any(axis=(1, 2))
    if resting.all():
        raise InputError("process.lead_deg: the path goes along the surface's normal; remove it, and process.lean_deg")
    g[resting] = _between(path, g, resting)
    _refuse_turns(path, g)
    size = np.linalg.norm(slopes) / (1 + np.sqrt(1 + slopes @ slopes))  # of every g on the part
    turn = row_norms(np.diff(g, axis=1).reshape(-1, 3)).reshape(len(g), -1).sum(axis=1) / size
    count = np.where(resting, 1, np.ceil(turn / TURN).clip(1)).astype(np.int64)
    whole = np.repeat(np.arange(len(count)), count)
    cut = replace(path, curve=path.curve.cut(count))
    leaning = _gibbs(cut, NODES, slopes)
    leaning[resting[whole]] = g[resting][:, :1] + NODES[:, None] * (g[resting][:, -1:] - g[resting][:, :1])
    upright = np.einsum("nk,pkc->pnc", np.vander(NODES, increasing=True), cut.curve.tilt)
    both = (upright + leaning + np.cross(upright, leaning)) / (1 - (upright * leaning).sum(axis=2, keepdims=True))
    return replace(cut.curve, tilt=np.einsum("kn,pnc->pkc", CUBIC, both))


def _gibbs(path: ExactPath, t: Array, slopes: Array) -> Array:
    """g at parameters (T,) of each piece in the axes of its tool, (K, T, 3); NaN where the path is along the normal."""
    K = len(path.curve.poly)
    poses, travel = path.pose_and_travel(np.repeat(np.arange(K), len(t)), np.tile(t, K))
    feed = np.einsum("mij,mi->mj", poses.rotation, travel)[:, :2]
    length = row_norms(feed)[:, None]
    x, y = np.divide(feed, length, out=np.full_like(feed, np.nan), where=length > ALONG).T
    a, b = slopes
    g = np.column_stack([a * y - b * x, -a * x - b * y, 0 * x]) / (1 + np.sqrt(1 + a * a + b * b))
    return np.asarray(g.reshape(K, len(t), 3))


def _off_the_part(path: ExactPath) -> BoolArray:
    """The pieces of each way from stop to stop that is nowhere on the part, (K,); none where the whole path is not."""
    curve, K = path.curve, len(path.curve.poly)
    piece, t = np.repeat(np.arange(K), len(SAMPLES) - 2), np.tile(SAMPLES[1:-1], K)
    touches = path.boundary.contains(curve.derivatives(piece, t)[0])
    way: IntArray = np.cumsum(np.append(False, curve.stop[:-1]))
    on = np.bincount(way, weights=curve.working & touches.reshape(K, -1).any(axis=1)) > 0
    return np.asarray(~on[way] & on.any())


def _between(path: ExactPath, g: Array, resting: BoolArray) -> Array:
    """g of the pieces off the part: even in length from where the part is left to where it is met, (R, T, 3)."""
    rest, kept = np.flatnonzero(resting), np.flatnonzero(~resting)
    length = np.zeros(len(resting))
    length[rest] = path.length(rest, np.zeros(len(rest)), np.ones(len(rest)))
    behind = np.cumsum(length)  # it does not grow on the part
    following = np.searchsorted(kept, rest)
    before, after = kept[np.maximum(following - 1, 0)], kept[np.minimum(following, len(kept) - 1)]
    start = np.where((following > 0)[:, None], g[before, -1], g[after, 0])
    end = np.where((following < len(kept))[:, None], g[after, 0], g[before, -1])
    left, met = np.where(following > 0, behind[before], 0.0), behind[np.maximum(after - 1, 0)]
    whole = np.where(following < len(kept), met - left, 1.0)
    share = ((behind - length)[rest] - left)[:, None] + np.outer(length[rest], SAMPLES)
    return np.asarray(start[:, None] + (share / np.maximum(whole, 1e-12)[:, None])[..., None] * (end - start)[:, None])


def _refuse_turns(path: ExactPath, g: Array) -> None:
    """Refuse a corner at which the tool would have to turn on the spot."""
    jumps = np.flatnonzero(row_norms(g[1:, 0] - g[:-1, -1]) > SAME)
    if len(jumps):
        x, y = path.curve.place_and_tilt(int(jumps[0]), 1.0)[0][:2] / MM
        raise InputError(
            f"process.lead_deg: the path turns sharply on the part, {x:.4g}, {y:.4g} mm from its middle, where the "
            "tool would turn on the spot; take path.turn = 'smooth', or for points of your own path.through = "
            "'tolerance' and path.corner_deg = 180"
        )
