r"""What may have happened, and which of it the touches speak for.

R coordinates of touches differ from what the forecast says by

    y = H x + N q + P u + f + e

with x what the state will say (rises, base, drifting numbers), q what else is not known of the robot (unit variance),
u where the targets stand, f what the thermal physics leaves out (a smooth field) and e the touches' noise. All are
normal, so each hypothesis h is a covariance V_h of y, and its evidence

    log p(y | h) = -(y^T V_h^-1 y + log det V_h) / 2

Hypotheses multiply what the forecast leaves open (a day that went otherwise, or one that it knows better than it
may), free the base (it was hit, or remounted), free the place of one target (it was knocked), one touch (it went
wrong), or multiply the noise (of an arm whose warmth is known: else that looks like noise). Each costs as much as it
is unlikely beforehand; the best one is believed. Source: MacKay (1992), Bayesian interpolation.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from compgen.core.arrays import Array, IntArray, owns
from compgen.core.units import MM

EXACT = 0.05  # of what the forecast leaves open: it is as good as that
KNOCKED = 2 * MM  # standard deviation of where a target stands that was knocked
#: how much more than the forecast leaves open, and the logarithm of how likely that is beforehand
DAYS = {0.0: -4.0, 1.0: 0.0, 2.0: -1.5, 4.0: -3.0, 8.0: -4.5}
NOISES = {1.0: 0.0, 2.0: -2.0, 4.0: -4.0}
Base = Literal["", "shifted", "turned"]
BASE_ODDS, TARGET_ODDS, TOUCH_ODDS = -5.0, -6.0, -6.5


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """What may have happened."""

    day: float = 1.0  # times what the forecast leaves open; 0: it is as good as exact
    base: Base = ""  # how it moved
    target: int = -1  # that was knocked; -1: none
    touch: int = -1  # that went wrong; -1: none
    noise: float = 1.0  # times the touches' sigma

    @property
    def cause(self) -> tuple[bool, int, int]:
        """What went otherwise, whatever its size: the base, which target, which touch."""
        return bool(self.base), self.target, self.touch

    @property
    def odds(self) -> float:
        """Logarithm of how likely it is before the touches."""
        moved = BASE_ODDS * bool(self.base) + TARGET_ODDS * (self.target >= 0) + TOUCH_ODDS * (self.touch >= 0)
        return DAYS[self.day] + NOISES[self.noise] + moved


AS_FORECAST = Hypothesis()
BETTER = Hypothesis(day=0.0)


@dataclass(frozen=True, eq=False, slots=True)
class TouchPrior:
    """What is known of x, (X, X) each, and of the rest."""

    forecast: Array  # as the files say
    day: Array  # more, of a day that went otherwise, for each unit of day^2 - 1
    shifted: Array  # more, of a base that was shifted
    turned: Array  # more, of one that was shifted and turned

    def of(self, h: Hypothesis) -> Array:
        """Covariance of x under a hypothesis."""
        moved = {"": 0 * self.forecast, "shifted": self.shifted, "turned": self.turned}[h.base]
        if h.day == 0:
            return moved + EXACT**2 * self.forecast
        return self.forecast + (h.day**2 - 1) * self.day + moved


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(y=("R",), H=("R", "X"), N=("R", "Q"), along=("R", 3), field=("R", "R"), sigma=("R",))
class Innovation:
    """R coordinates of touches against the forecast."""

    y: Array  # (R,) [m]
    H: Array  # (R, X)
    N: Array  # (R, Q) of one standard deviation
    along: Array  # (R, 3) unit vector in World of each coordinate
    target: IntArray  # (R,)
    touch: IntArray  # (R,)
    place: Array  # (T,) [m] standard deviation of where each target stands
    field: Array  # (R, R) [m^2] covariance of f
    sigma: Array  # (R,) [m] of e

    def rows(self, keep: IntArray) -> "Innovation":
        """Some of the coordinates."""
        return Innovation(
            y=self.y[keep],
            H=self.H[keep],
            N=self.N[keep],
            along=self.along[keep],
            target=self.target[keep],
            touch=self.touch[keep],
            place=self.place,
            field=self.field[np.ix_(keep, keep)],
            sigma=self.sigma[keep],
        )

    def covariance(self, prior: TouchPrior, h: Hypothesis) -> Array:
        """V_h, (R, R)."""
        place = self.place.copy()
        if h.target >= 0:
            place[h.target] = np.hypot(place[h.target], KNOCKED)
        same = (self.target[:, None] == self.target) * (place**2)[self.target]
        V = self.H @ prior.of(h) @ self.H.T + self.N @ self.N.T + self.field + same * (self.along @ self.along.T)
        sigma = np.where(self.touch == h.touch, KNOCKED, h.noise * self.sigma)
        return np.asarray(V + np.diag(sigma**2))

    def used(self, h: Hypothesis) -> IntArray:
        """Numbers of the coordinates that a hypothesis leaves standing: without a knocked target, or a wrong touch."""
        return np.flatnonzero((self.target != h.target) & (self.touch != h.touch))


@dataclass(frozen=True, eq=False, slots=True)
class Weighed:
    """A hypothesis and how well the touches speak for it."""

    hypothesis: Hypothesis
    evidence: float  # logarithm, with the odds
    chi2: float  # y^T V^-1 y, of R


def weigh(innovation: Innovation, prior: TouchPrior) -> list[Weighed]:
    """All hypotheses, the best first."""
    judged = []
    noises = list(NOISES) if prior.day.any() else [1.0]  # else it may be warmth, of which nothing is known
    for h in _hypotheses(np.unique(innovation.target).tolist(), np.unique(innovation.touch).tolist(), noises):
        factor = cho_factor(innovation.covariance(prior, h), lower=True)
        chi2 = float(innovation.y @ cho_solve(factor, innovation.y))
        evidence = -chi2 / 2 - float(np.log(np.diag(factor[0])).sum()) + h.odds
        judged.append(Weighed(h, evidence, chi2))
    return sorted(judged, key=lambda j: -j.evidence)


def _hypotheses(targets: list[int], touches: list[int], noises: list[float]) -> Iterator[Hypothesis]:
    for target in [-1, *(targets if len(targets) > 2 else [])]:
        for base in get_args(Base):
            for day in DAYS:
                for noise in noises:
                    yield Hypothesis(day, base, target, noise=noise)
    for touch in touches if len(touches) > 3 else []:
        for day in DAYS:
            yield Hypothesis(day, touch=touch)


@dataclass(frozen=True, eq=False, slots=True)
class LeftOut:
    """Each of N touches predicted by the others."""

    touch: IntArray  # (N,)
    error: Array  # (N,) [m] rms over its coordinates
    E_n: Array  # (N,) largest of them over its expanded uncertainty, k = 2


def left_out(innovation: Innovation, V: Array) -> LeftOut:
    r"""One touch left out at a time, from the whole covariance.

    With K = V^-1 and b the rows of a touch, what the others leave of it is (K_bb)^-1 (K y)_b, of covariance (K_bb)^-1.
    Source: Sundararajan and Keerthi (2001), predictive approaches for Gaussian processes.
    """
    K = np.linalg.inv(V)
    Ky = K @ innovation.y
    touches = np.unique(innovation.touch)
    error, ratio = np.empty(len(touches)), np.empty(len(touches))
    for n, touch in enumerate(touches.tolist()):
        b = np.flatnonzero(innovation.touch == touch)
        C = np.linalg.inv(K[np.ix_(b, b)])
        e = C @ Ky[b]
        error[n], ratio[n] = np.sqrt(np.mean(e**2)), np.max(np.abs(e) / (2 * np.sqrt(np.diag(C))))
    return LeftOut(touches, error, ratio)
