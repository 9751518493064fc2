r"""What a robot's warmth is beside its model's forecast, from readings as they come: a Kalman filter.

The model with what the robot has done gives a forecast z(t). Of the K rises it misses m, because its law is off by b
(towards which m tends with the node's lag, as in ``uncertainty``) and b itself changes from duty to duty; the sensors
are all off by s:

    dm_k/dt = (b_k - m_k) / lag_k,    db_k/dt = -b_k / T + w_k,    var b_k = L_k^2,    ds/dt = 0
    reading_k - (outputs z)_k = m_k + s + noise

With x = (m, b, s) this is linear with normal noise, so that the filter's mean and covariance are those of the batch
least squares over all readings (Kalman 1960). Step by step, F and Q exact for the step (Van Loan 1978):

    x <- F x,  P <- F P F^T + Q;       S = H P H^T + R,  x <- x + P H^T S^-1 (y - H x),  P <- (I - P H^T S^-1 H) P
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.linalg import expm

from compgen.core.arrays import Array, IntArray, owns
from compgen.core.units import HOUR
from compgen.thermal.uncertainty import ThermalUncertainty, steady_miss

STEP = 30.0  # [s] in which readings are taken together
MEMORY = 2 * HOUR  # T: how long a law stays as wrong as it is; a duty lasts about so long [assumed]
NOISE = 0.1  # [K] of one reading [assumed]
FLOOR = 0.03  # [K] that no number of readings within a step goes below [assumed]
JUMP = 3.0  # [K] from a sensor's last reading, beyond which a contact is loose
FORGET = 600.0  # [s] after which a reading is compared with none before


@dataclass(frozen=True, eq=False, slots=True)
@owns(mean=("X",), covariance=("X", "X"))
class Miss:
    """What the forecast misses, with covariance."""

    mean: Array  # (2K + 1,) [K]: m, b, s
    covariance: Array  # (2K + 1, 2K + 1) [K^2]

    @property
    def rise(self) -> Array:
        """m, (K,) [K]."""
        return self.mean[: len(self.mean) // 2]

    @property
    def offset(self) -> float:
        """s [K]."""
        return float(self.mean[-1])

    @property
    def sigma(self) -> Array:
        """Standard deviations of m, (K,) [K]."""
        return np.sqrt(np.diag(self.covariance)[: len(self.mean) // 2])


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(lag=("K",), law=("K",), start=("K",))
class RiseFilter:
    """The law of what a forecast misses."""

    lag: Array  # (K,) [s]
    law: Array  # (K,) [K] L
    start: Array  # (K,) [K] standard deviation of m at the beginning
    sensors: float  # [K] standard deviation of s
    night: float = 0.0  # [K] standard deviation of what all m have in common at the beginning
    air: float = 0.0  # [K] the same of all b

    def begin(self) -> Miss:
        """Before any reading."""
        sigma = np.concatenate([self.start, self.law, [self.sensors]])
        covariance = np.diag(sigma**2)
        K = len(self.start)
        covariance[:K, :K] += self.night**2
        covariance[K:-1, K:-1] += self.air**2
        return Miss(np.zeros(len(sigma)), covariance)

    def ahead(self, miss: Miss, time: float) -> Miss:
        """So much later [s], without a reading."""
        F, Q = transition(tuple(self.lag.tolist()), tuple(self.law.tolist()), float(time))
        return Miss(F @ miss.mean, F @ miss.covariance @ F.T + Q)

    def taken(self, miss: Miss, which: IntArray, readings: Array, sigma: Array) -> Miss:
        """With readings beside the forecast.

        Args:
            miss: Before them.
            which: Numbers of the rises that they show, (R,).
            readings: Less the forecast, (R,) [K].
            sigma: Standard deviations of their noise, (R,) [K].
        """
        H = np.zeros((len(which), len(miss.mean)))
        H[np.arange(len(which)), which] = 1.0
        H[:, -1] = 1.0
        P = miss.covariance
        S = H @ P @ H.T + np.diag(sigma**2)
        gain = np.linalg.solve(S, H @ P).T
        rest = np.eye(len(miss.mean)) - gain @ H
        covariance = rest @ P @ rest.T + (gain * sigma**2) @ gain.T  # Joseph's form: stays positive
        return Miss(miss.mean + gain @ (readings - H @ miss.mean), covariance)


def filter_of(
    warmth: ThermalUncertainty, start: float, sensors: float, night: float = 0.0, air: float = 0.0
) -> RiseFilter:
    """The filter of a robot file.

    Args:
        warmth: How well it knows its warmth.
        start: Standard deviation of the rises at the beginning, beside the law's [K].
        sensors: Of the offset that all sensors share [K].
        night: By which the whole arm may be warmer than planned, as its air is [K].
        air: By which the air may be warmer than planned from then on [K].
    """
    known_to = warmth.of_nodes(warmth.law)
    law = steady_miss(warmth, known_to)
    return RiseFilter(lag=warmth.lag, law=law, start=np.hypot(known_to, start), sensors=sensors, night=night, air=air)


@dataclass(frozen=True, eq=False, slots=True)
class Readings:
    """Readings of a step of time, those of loose contacts left out."""

    step: int  # that ends at step STEP
    which: IntArray  # (R,)
    value: Array  # (R,) [K] rise
    sigma: Array  # (R,) [K]


@dataclass(frozen=True, eq=False, slots=True)
class Anchor:
    """Rises that were found otherwise, at the end of a step: they stand in place of what readings said before."""

    step: int
    which: IntArray  # (R,) numbers of the rises
    rise: Array  # (R,) [K]
    covariance: Array  # (R, R) [K^2]


def misses(
    rises: RiseFilter, readings: Sequence[Readings], forecast: Array, first: int, anchors: Sequence[Anchor] = ()
) -> list[Miss]:
    """What the forecast misses at the end of each step.

    Args:
        rises: The law.
        readings: By rising steps, none before ``first``.
        forecast: Rises at the end of the steps from ``first`` on, (T, K) [K].
        first: The first step.
        anchors: None before the first step.

    Returns:
        T of them.
    """
    by_step, anchored = {r.step: r for r in readings}, {a.step: a for a in anchors}
    miss, course = rises.begin(), []
    for step in range(first, first + len(forecast)):
        miss = rises.ahead(miss, STEP) if step > first else miss
        if step in by_step:
            r = by_step[step]
            miss = rises.taken(miss, r.which, r.value - forecast[step - first][r.which], r.sigma)
        if step in anchored:
            miss = _anchored(miss, anchored[step], forecast[step - first])
        course.append(miss)
    return course


def _anchored(miss: Miss, anchor: Anchor, forecast: Array) -> Miss:
    """With rises that are known otherwise: m is theirs, and no longer bound to b and s."""
    mean, covariance = miss.mean.copy(), miss.covariance.copy()
    mean[anchor.which] = anchor.rise - forecast[anchor.which]
    covariance[anchor.which], covariance[:, anchor.which] = 0.0, 0.0
    covariance[np.ix_(anchor.which, anchor.which)] = anchor.covariance
    return Miss(mean, covariance)


def steadied(readings: Sequence[Readings]) -> list[Readings]:
    """Readings without those that jump from the sensor's last one, as a loose contact does."""
    last: dict[int, tuple[int, float]] = {}
    kept = []
    for r in readings:
        good = np.ones(len(r.which), dtype=bool)
        for k, (sensor, value) in enumerate(zip(r.which.tolist(), r.value.tolist(), strict=True)):
            before = last.get(sensor)
            if before is not None and (r.step - before[0]) * STEP <= FORGET and abs(value - before[1]) > JUMP:
                good[k] = False
            else:
                last[sensor] = (r.step, value)
        kept.append(replace(r, which=r.which[good], value=r.value[good], sigma=r.sigma[good]))
    return [r for r in kept if len(r.which)]


@lru_cache(maxsize=64)
def transition(lag: tuple[float, ...], law: tuple[float, ...], time: float) -> tuple[Array, Array]:
    """F and Q of (m, b, s) over a time [s]."""
    if time > min(lag):  # two halves: the exponential of what grows stays a number
        F, Q = transition(lag, law, time / 2)
        return F @ F, F @ Q @ F.T + Q
    K = len(lag)
    F, Q = np.eye(2 * K + 1), np.zeros((2 * K + 1, 2 * K + 1))
    for k in range(K):
        A = np.array([[-1 / lag[k], 1 / lag[k]], [0.0, -1 / MEMORY]])
        G = np.diag([0.0, 2 * law[k] ** 2 / MEMORY])
        exponential = expm(np.block([[-A, G], [np.zeros((2, 2)), A.T]]) * time)
        f = exponential[2:, 2:].T
        rows = np.ix_([k, K + k], [k, K + k])
        F[rows], Q[rows] = f, f @ exponential[:2, 2:]
    return F, (Q + Q.T) / 2
