"""How far each fitted parameter moves the tool: what the user may sort and judge parameters of all units by."""

import numpy as np

from compgen.core.arrays import Array
from compgen.identification.fit import Fit
from compgen.identification.model import ArmModel


def largest_moves(model: ArmModel, fitted: Fit) -> Array:
    """The largest move of a measured place by each active parameter's value, (K',) [m].

    Less what the frames of instrument and reflectors take up: dy/dp_k p_k projected off the frames' columns of the
    Jacobian. Valid to first order about the fit.
    """
    K = int(fitted.active.sum())
    if not K:
        return np.zeros(0)
    A = fitted.linear.A.reshape(-1, fitted.linear.A.shape[2])
    columns = A[:, :K] * (fitted.p / model.prior)[fitted.active]
    basis = np.linalg.qr(A[:, K:])[0]
    left = columns - basis @ (basis.T @ columns)
    return np.asarray(np.linalg.norm(left.reshape(-1, 3, K), axis=1).max(axis=0))
