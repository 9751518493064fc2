r"""The scales of the groups are learnt from few numbers: how much wider that makes the posterior.

With n numbers that tell a scale, what a parameter is about nominal follows Student's t with n degrees of freedom, whose
variance is that of the Gaussian with the scale learnt, times n / (n - 2):

    lambda_g -> lambda_g n_g / (n_g - 2),    n_g = nu + sum_g gamma,    at most WIDEST times, and not above its ceiling

Values stay. It matters where a scale is all that holds a combination: what a gear does about the middle of a joint's
range turns World as its zero would, and no pose tells them apart.
"""

from dataclasses import replace

import numpy as np

from compgen.identification.evidence import NU, posterior
from compgen.identification.fit import Fit, frame_prior
from compgen.identification.linearisation import channel_equations
from compgen.identification.measurements import Measurements
from compgen.identification.model import ArmModel

WIDEST = 2.0


def with_unsure_scales(model: ArmModel, data: Measurements, fitted: Fit) -> Fit:
    """A fit whose covariance counts that its scales are known from few numbers.

    Args:
        model: The arm with symbols.
        data: What was measured.
        fitted: The fit; its values stay.
    """
    K, D = int(fitted.active.sum()), fitted.linear.A.shape[2]
    if not K:
        return fitted
    names, group_of = model.groups()
    group, scales = group_of[fitted.active], fitted.posterior.scales
    n = NU + np.bincount(group, fitted.posterior.gamma, len(names))
    factor = np.where(n > 2, np.minimum(n / np.maximum(n - 2, 1e-9), WIDEST), WIDEST)
    wider = np.minimum(scales.group * factor, np.maximum(model.ceiling, scales.group))
    u = np.concatenate([(fitted.p / model.prior)[fitted.active], np.zeros(D - K)])
    precision, target = frame_prior(data, fitted.frames, D - K)
    equations = channel_equations(fitted.linear, (~fitted.outlier) / data.sigma**2, u, data, scales.rho)
    solution = posterior(
        equations, group, precision, target, replace(scales, group=wider), learn_groups=False, learn_noise=False
    )
    sigma, gamma = fitted.sigma.copy(), fitted.gamma.copy()
    sigma[fitted.active] = model.prior[fitted.active] * np.sqrt(np.diag(solution.covariance)[:K])
    gamma[fitted.active] = solution.gamma
    return replace(fitted, posterior=replace(solution, x=fitted.posterior.x), sigma=sigma, gamma=gamma)
