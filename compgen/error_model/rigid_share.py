r"""What touched places and a path share: the rigid motion of an effect, which a frame taught by touches takes up.

An error moves the tool by c_r at touched places p_r and by c(n) on a path. A frame fitted to the touches moves with
it, by d and a turn w about their middle m, and where it was fitted along so does the probe, by t in the flange:

    minimise  sum_r |e_r^T (c_r - D_r u)|^2 / sigma_r^2 + |t|^2 / s_t^2,    D = (I, -[p - m]x, -R),    u = (d, w, t)
    u = G c,        left on the path  c(n) - D(n) u,      cov u = G diag(sigma^2) G^T + what holds t

Without R the probe is known. e_r are the coordinates that a touch tells: all three, or the probing direction.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, IntArray, owns
from compgen.core.rotations import cross_matrix

USUAL = 20e-6  # [m] of a coordinate of a touch
HELD = 1e-9  # of the largest: a motion that touches do not tell is none


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(middle=(3,), touch=("R",), along=("R", 3), gain=("U", "R"))
class RigidShare:
    """How R coordinates of T touches fix a frame, and a probe: U = 6 or 9 numbers."""

    middle: Array  # (3,) [m] of the places, World
    touch: IntArray  # (R,) whose coordinate each is
    along: Array  # (R, 3) its direction, World
    gain: Array  # (U, R) G

    def motion(self, column: Array) -> Array:
        """What the frame and the probe take up of effects at the touches (T, 3, Q), (U, Q)."""
        return np.asarray(self.gain @ np.einsum("ri,riq->rq", self.along, column[self.touch]))

    def left(self, column: Array, motion: Array, place: Array) -> Array:
        """Effects (M, 3, Q) at places less what the frame took up (U, Q), (M, 3, Q); the probe is not the path's tool.

        Args:
            column: On the path.
            motion: As the touches tell it (``motion``).
            place: (M, 3) [m] World.
        """
        return np.asarray(column - self._design(place, None) @ motion)

    def left_of_field(self, along: Array, between: Array, place: Array, rotation: Array | None) -> Array:
        r"""Variance of one coordinate of a smooth field of unit variance, less what the frame took up of it, (M,).

        The field z(p) moves each coordinate by itself, with E[z(p) z(q)] = k(p, q):

            tr(I - 2 D G E^T k_rn + D G E^T k_rr E G^T D^T) / 3

        Args:
            along: k from places on a path to touched ones, (M, T).
            between: k between touched ones, (T, T).
            place: (M, 3) [m] World.
            rotation: Of the flange, (M, 3, 3), where the probe that was fitted along is the tool.
        """
        H, e = self._design(place, rotation) @ self.gain, self.along
        among = between[np.ix_(self.touch, self.touch)] * (e @ e.T)
        shared = np.einsum("mir,mr,ri->m", H, along[:, self.touch], e)
        return np.asarray(1 + (np.einsum("mir,mir->m", H @ among, H) - 2 * shared) / 3)

    def _design(self, place: Array, rotation: Array | None) -> Array:
        """D at places, (M, 3, U); without rotations of the flange the probe moves nothing."""
        probe = None if len(self.gain) == 6 else np.zeros((len(place), 3, 3)) if rotation is None else rotation
        return design_of(place - self.middle, probe)


def design_of(lever: Array, rotation: Array | None) -> Array:
    """D at levers (M, 3) [m] from the middle: what a shift, a turn, and a probe too long in the flange do to c."""
    shift = np.broadcast_to(np.eye(3), (len(lever), 3, 3))
    turn = -cross_matrix(lever)
    return np.concatenate([shift, turn] if rotation is None else [shift, turn, -rotation], axis=2)


def rigid_share(
    place: Array,
    rotation: Array | None = None,
    along: Array | None = None,
    sigma: Array | None = None,
    probe_sigma: float = 0.0,
) -> RigidShare:
    """How touches fix a frame.

    Args:
        place: Of T touches, World, (T, 3) [m].
        rotation: Of the flange, (T, 3, 3), where the probe was fitted along; None: it was known.
        along: Probing directions, (T, 3); NaN, or None: all three coordinates were told.
        sigma: Of one coordinate of each touch, (T,) [m]; None: usual ones, all alike.
        probe_sigma: What is known of the probe beforehand [m]; 0: nothing.
    """
    single = np.zeros(len(place), dtype=bool) if along is None else np.isfinite(along[:, 0])
    touch = np.repeat(np.arange(len(place)), np.where(single, 1, 3))
    e = np.eye(3)[np.arange(len(touch)) - np.searchsorted(touch, touch)]
    if along is not None:
        e = np.where(single[touch][:, None], along[touch], e)
    middle = place.mean(axis=0)
    weight = 1 / (np.full(len(place), USUAL) if sigma is None else sigma)[touch] ** 2
    D = np.einsum("ri,riu->ru", e, design_of(place - middle, rotation)[touch])
    precision = (D.T * weight) @ D
    if rotation is not None and probe_sigma:
        precision[6:, 6:] += np.eye(3) / probe_sigma**2
    gain = np.linalg.pinv(precision, rcond=HELD, hermitian=True) @ (D.T * weight)
    return RigidShare(middle=middle, touch=touch, along=e, gain=gain)
