r"""The law of an arm's nodes from the temperature log of a warm-up, whose load nobody knows.

A node's reference rise r_k exp(g_k) and time constant tau_k exp(l_k) stand in place of the file's, with

    g_k ~ N(0, GAIN^2),   l_k = c + e_k,   c ~ N(0, COMMON^2),   e_k ~ N(0, EACH_LAG^2)

so that the medians of the log's stretches are, to first order in p = (g, l) about the last guess,

    y = air + (W + dW) a + J p + noise,    J = (course of node k, d course / d l_k)

W are the responses to work: a mean at the reference feed that is known to ``WORK``, work of its own in each block and
before the log (``BLOCK``), and the proportions of a slower feed (``SLOWER``); the air and the sensors may differ as
``log_prior`` says. What all nodes do alike is thus the load's, and one node alone tells nothing. p is the most
probable, by Gauss-Newton. A node is known to what p leaves open had the load been known, to what the fit leaves of its
readings, and to what another program heats otherwise (``PROGRAM`` of its rise). Sizes are [assumed].
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import median_filter

from compgen.core.arrays import Array, IntArray, owns
from compgen.thermal.ambient import Ambient
from compgen.thermal.log_prior import BLOCKS, DRAUGHT, EACH, NIGHT, UNMEASURED, Medians, medians_of
from compgen.thermal.node_model import NodeModel
from compgen.thermal.state_from_log import TemperatureLog, block_responses
from compgen.thermal.uncertainty import ThermalUncertainty

GAIN = 0.25  # of the logarithm of a node's rise
COMMON, EACH_LAG = 0.7, 0.3  # of the logarithm of the time constants: of all together, and of each
WORK, BLOCK, SLOWER = 0.5, 0.5, 0.5  # of the heat at the reference feed
PROGRAM = 0.05  # of a node's rise
PLAUSIBLE = 3.0  # sigmas of its prior, beyond which a value is not believed
FALLEN = 4.0  # [K] below its beginning: more than the air of a cell does within a log
AROUND = 5  # readings whose median stands for each
SHOWN = 0.5  # share of a rise's prior variance that the log takes away, below which it does not show the node
WORKS = BLOCKS + 5  # amounts of work: the mean, by how much it is off, a slower feed, blocks and what was before
STEP, DAMPING, ROUNDS, CLOSE = 0.05, 0.5, 60, 0.005  # of the logarithms


@dataclass(frozen=True, eq=False, slots=True)
@owns(sigma=("K",), ratio=("K",))
class FittedLaw:
    """Nodes as a warm-up shows them."""

    law: NodeModel  # a node that was not shown rises as before, with the lag that all of them share
    sigma: Array  # (K,) [K] of a node's rise by the law; nan: not shown
    ratio: Array  # (K,) sigmas of their priors that the warm-up asks for, of rise or time constant, whichever is more

    @property
    def is_plausible(self) -> bool:
        """Whether no value is beyond what a node can be."""
        return bool((self.ratio <= PLAUSIBLE).all())

    def rows(self) -> Iterator[tuple[str, float, float, float]]:
        """Of each node: name, reference rise [K], time constant [s], and sigma [K]."""
        law = self.law
        yield from zip(law.names, law.reference_rise.tolist(), law.tau.tolist(), self.sigma.tolist(), strict=True)


@dataclass(frozen=True, eq=False, slots=True)
class _WarmUp:
    """The medians of a log."""

    log: TemperatureLog
    medians: Medians
    node: IntArray  # (n,) that each shows

    def responses(self, law: NodeModel) -> tuple[Array, Array, Array]:
        """What the measured air does (n,), what air and a warm beginning may add (n, 2), and work (n, WORKS) [K]."""
        time, at = self.log.time - self.log.time[0], self.medians.time - self.log.time[0]
        slow, fast = law.steady_rise("moving", np.array([law.box.feed[0], law.reference_feed]))
        goals = np.array([fast, slow * fast.sum() / slow.sum() - fast])
        blocks = block_responses(law.rate, goals, max(time[-1], 1.0), BLOCKS, at)[np.arange(len(at)), self.node]
        mean, slower = blocks[:, 2:].sum(axis=1).T
        decay = np.exp(-at * law.rate[self.node])
        response = Ambient(time, self.log.air).response(law.rate, 0.0, at)
        air = self.log.air[0] * decay + response[np.arange(len(at)), self.node]
        night, draught = (NIGHT, DRAUGHT) if self.log.has_air else (UNMEASURED, UNMEASURED)
        work = np.column_stack([mean, WORK * mean, SLOWER * slower, BLOCK * blocks[:, :, 0]])
        return air, np.column_stack([night * decay, draught * (1 - decay)]), work

    def slopes(self, law: NodeModel, amounts: Array) -> Array:
        """J, by the logarithms of rises and time constants, where work has amounts (WORKS,), (n, 2 K) [K]."""
        course, slower, faster = (
            self.responses(replace(law, tau=law.tau * np.exp(s)))[2] @ amounts for s in (0, STEP, -STEP)
        )
        shown = np.eye(len(law.names))[self.node]
        return np.hstack([shown * course[:, None], shown * ((slower - faster) / (2 * STEP))[:, None]])


def falling_part(log: TemperatureLog) -> tuple[str, float] | None:
    """The part that falls farthest below its first readings, and how far [K]; None: parts rise by half as much, too.

    A warm-up that begins while the arm still cools rises after it, and a day that ends cold has risen before.

    Args:
        log: Rises, of one node at least; what falls with the measured air, or beside it, does not cool.
    """
    fallen, risen = {}, 0.0
    for name, values in log.readings.items():
        courses = [median_filter(rise[np.isfinite(values)], AROUND) for rise in (values, values - log.air)]
        fallen[name] = min(float(course[0] - course.min()) for course in courses)
        risen = max(risen, *(float((course - np.minimum.accumulate(course)).max()) for course in courses))
    worst = max(fallen, key=lambda name: fallen[name])
    return (worst, fallen[worst]) if fallen[worst] > max(2 * risen, FALLEN) else None


def fit_law(log: TemperatureLog, law: NodeModel, warmth: ThermalUncertainty) -> FittedLaw:
    """The law of an arm's nodes.

    Args:
        log: Rises over a warm-up, of one node at least.
        law: Of the robot file.
        warmth: How well that is known.
    """
    K, medians = len(law.names), medians_of(log)
    node = np.array([law.names.index(name) for name in log.readings])[medians.which.astype(int)]
    warm_up = _WarmUp(log, medians, node)
    offsets = warmth.sensors * np.hstack([np.ones((len(node), 1)), EACH * np.eye(K)[node]])
    noise = offsets @ offsets.T + np.diag(medians.sigma**2)
    prior = np.zeros((2 * K, 2 * K))
    prior[:K, :K], prior[K:, K:] = GAIN**2 * np.eye(K), COMMON**2 + EACH_LAG**2 * np.eye(K)
    root, p, amounts = np.linalg.cholesky(prior), np.zeros(2 * K), np.eye(WORKS)[0]
    for _ in range(ROUNDS):
        changed = _changed(law, p)
        air, drift, work = warm_up.responses(changed)
        slopes = warm_up.slopes(changed, amounts)
        spread = np.hstack([work[:, 1:], drift, slopes @ root])
        beyond = medians.value - air - work[:, 0] + slopes @ p
        likeliest = spread.T @ np.linalg.solve(spread @ spread.T + noise, beyond)
        amounts[1:], step = likeliest[: WORKS - 1], root @ likeliest[-2 * K :] - p
        p = p + DAMPING * step
        if np.abs(step).max() < CLOSE:
            break
    left = np.bincount(node, (beyond - spread @ likeliest) ** 2, K) / np.maximum(np.bincount(node, minlength=K), 1)
    open_gain = np.diag(np.linalg.inv(np.linalg.inv(prior) + slopes.T @ np.linalg.solve(noise, slopes)))[:K]
    shown = open_gain < (1 - SHOWN) * GAIN**2
    shown &= shown.sum() > 1  # one node alone says nothing that another load would not
    fitted = _changed(law, p * np.append(shown, np.full(K, shown.any())))
    sigma = np.sqrt(warmth.law**2 + left + fitted.reference_rise**2 * (open_gain + PROGRAM**2))
    ratio = np.abs(p) / np.sqrt(np.diag(prior))
    return FittedLaw(fitted, np.where(shown, sigma, np.nan), ratio.reshape(2, K).max(axis=0))


def _changed(law: NodeModel, p: Array) -> NodeModel:
    """The nodes with other rises and time constants, by logarithms (2 K,)."""
    gain, lag = np.exp(p).reshape(2, len(law.names))
    return replace(law, reference_rise=law.reference_rise * gain, tau=law.tau * lag)
