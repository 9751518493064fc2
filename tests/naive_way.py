"""How far places are from a user's lines and arcs, in order along the way: numpy alone, nothing of the package."""

import numpy as np

SAGITTA_MM = 5e-5  # of the chords on arcs
PIECE_MM = 2.0  # within so much of the user's way the order is not looked at


def cut(move) -> np.ndarray:
    """Places (n, 3) along a line or an arc of ``naive_cam``, so near that lines between them are the motion."""
    if not hasattr(move, "turn"):
        count = max(1, int(np.ceil(np.linalg.norm(np.subtract(move.end, move.start)) / PIECE_MM)))
        return np.linspace(move.start, move.end, count + 1)
    radius = float(np.linalg.norm(np.subtract(move.start, move.centre)))
    step = min(2 * float(np.arccos(max(0.5, 1 - SAGITTA_MM / radius))), PIECE_MM / radius)
    count = max(2, int(np.ceil(abs(move.turn) / step)))
    return np.array([move.at(k / count) for k in range(count + 1)])


def from_pieces(place: np.ndarray, start: np.ndarray, way: np.ndarray, square: np.ndarray) -> np.ndarray:
    """Distance (M,) [mm] of a place from straight pieces."""
    out = place - start
    share = np.clip(np.einsum("ij,ij->i", out, way) / square, 0, 1)
    out -= share[:, None] * way
    return np.sqrt(np.einsum("ij,ij->i", out, out))


def worst_in_order(place: np.ndarray, start: np.ndarray, end: np.ndarray, share_of) -> tuple[float, int]:
    """The least that the largest share is, when places are laid on pieces that never go back; and at which place.

    share[n, m] is how much of what may be place n is from piece m: worst[n, m] = max(share[n, m], least over pieces
    up to m of worst[n - 1]).
    """
    way = end - start
    square = np.maximum(np.einsum("ij,ij->i", way, way), 1e-18)
    reached, least = np.zeros(len(start)), []
    for n, p in enumerate(place):
        share = share_of(from_pieces(p, start, way, square), n)
        reached = np.maximum(share, np.minimum.accumulate(reached))
        least.append(reached.min())
    return float(least[-1]), int(np.argmax(np.array(least) >= least[-1]))
