r"""Which thermal terms are taken: by evidence, and by how well earlier, cooler blocks foretell later, hotter ones.

Physics offers many: growth of each length, the base, bends and twist of each link, each with every node. All of them
are fitted at once, each kind with a scale of its own, and then the one that the data needs least is left out, again and
again, until each of those left

    raises the log evidence of all rows by GAIN or more, and
    does not worsen the forecast: the mean distance of each block of warm poses from what the cold poses and the blocks
    before it say, by more than its standard error.

Both are taken at the fit's linearisation, with its scales: terms are small, the arm is linear in them. There the
unknowns are Gaussian, x with covariance C, and holding those of one kind, k, of prior variance lambda, at zero leaves

    x - C_:k C_kk^-1 x_k,   C - C_:k C_kk^-1 C_k:

at a log evidence that is less by the ratio of two densities at zero (Savage's; Dickey 1971, Ann. Math. Stat. 42, 204)

    (log det C_kk - n_k log lambda + x_k' C_kk^-1 x_k) / 2"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.error_model.source import ArmFacts
from compgen.identification.fit import Fit, fit
from compgen.identification.linearisation import LinearProblem
from compgen.identification.measurements import Measurements
from compgen.identification.model import ArmModel

BEYOND = 3.0  # sigmas of its prior, beyond which no thermal parameter is believed
HELD = 8  # at most so many are held
GAIN = 0.1  # of log evidence, that a term must bring
BLOCKS = 6  # of consecutive warm poses; the first is never foretold


@dataclass(frozen=True, eq=False, slots=True)
class Information:
    """What rows say of the unknowns."""

    x: Array  # (D,)
    C: Array  # (D, D) covariance

    def without(self, k: IntArray) -> "Information":
        """The same with unknowns k at zero."""
        lever = np.linalg.solve(self.C[np.ix_(k, k)], self.C[k])
        return Information(self.x - self.x[k] @ lever, self.C - self.C[:, k] @ lever)

    def loss(self, k: IntArray, variance: float) -> float:
        """By how much unknowns k at zero explain the rows worse, in log evidence; their prior has this variance."""
        C, x = self.C[np.ix_(k, k)], self.x[k]
        return float(np.linalg.slogdet(C)[1] - len(k) * np.log(variance) + x @ np.linalg.solve(C, x)) / 2


@dataclass(frozen=True, eq=False, slots=True)
class _Choice:
    """What all rows of a fit say, and what those before each block say of it."""

    problem: LinearProblem
    known: Information
    foretold: list[tuple[Information, BoolArray]]  # what is known before a block, and its rows (N,)

    def without(self, k: IntArray) -> "_Choice":
        """The same with unknowns k at zero."""
        foretold = [(known.without(k), rows) for known, rows in self.foretold]
        return replace(self, known=self.known.without(k), foretold=foretold)

    def forecast(self) -> Array:
        """Distances of the rows of all blocks from what is known before each [m]."""
        left = [self.problem.left(known.x, rows) for known, rows in self.foretold]
        return np.asarray(np.linalg.norm(np.concatenate(left), axis=1))


def nodes_to_offer(facts: ArmFacts, states: Sequence[int], modelled: Sequence[int]) -> tuple[str, ...]:
    """Nodes that anything may follow: those with a sensor; one for all where there are no temperatures."""
    if states:
        return (facts.nodes[states[0]],)
    return tuple(name for k, name in enumerate(facts.nodes) if k not in modelled)


def with_needed_warmth(
    model: ArmModel, data: Measurements, full: Fit, *, temperatures: bool, anew: bool = False
) -> tuple[Fit, list[Finding]]:
    """A fit without the thermal terms that the data does not need, and without those beyond any plausible value.

    A parameter beyond three of its prior's sigmas stands for something that no source models: it is held at nominal.

    Args:
        model: The arm with symbols.
        data: What was measured.
        full: With all terms.
        temperatures: Whether they were measured; else rises are fitted along, nothing thermal is written, all is kept.
        anew: Fit all terms again first: the measurements' frames have changed.
    """
    findings: list[Finding] = []
    fitted = fit(model, data, full.active) if anew else full
    if not (full.active & model.thermal).any() or not temperatures:
        return fitted, findings
    active = needed_terms(model, data, fitted)
    for _ in range(HELD):
        fitted = fit(model, data, active, start=fitted)
        ratio = np.abs(fitted.p) / model.prior
        ratio[~(active & model.thermal)] = 0.0
        k = int(np.argmax(ratio))
        if ratio[k] <= BEYOND:
            break
        parameter = model.parameters[k]
        findings.append(
            Finding(
                Level.WARNING,
                Code.HELD,
                f"{parameter.name}: the warm-up asks for {fitted.p[k] / parameter.unit:.3g}, {ratio[k]:.1f} sigmas of "
                f"its prior ({parameter.prior / parameter.unit:.3g}): something else warms; it is held at nominal",
            )
        )
        active = active.copy()
        active[k] = False
    return fitted, findings


def needed_terms(model: ArmModel, data: Measurements, fitted: Fit) -> BoolArray:
    """The parameters of a fit without the thermal terms that the data does not need, (K,)."""
    _, group_of = model.groups()
    thermal = np.unique(group_of[fitted.active & model.thermal]).tolist()
    optional = {g: np.flatnonzero(group_of[fitted.active] == g) for g in thermal}
    choice = _choice(model, data, fitted)
    if not choice.foretold:
        return fitted.active
    active, forecast = fitted.active.copy(), choice.forecast()
    while optional:
        losses = {g: choice.known.loss(k, choice.problem.scales.group[g]) for g, k in optional.items()}
        for g in sorted(optional, key=lambda g: losses[g]):
            without = choice.without(optional[g])
            foretold = without.forecast()
            gain = foretold - forecast
            worse = gain.mean() < -gain.std() / np.sqrt(len(gain))
            if losses[g] < GAIN or worse:
                break
        else:
            break
        active &= group_of != g
        del optional[g]
        choice, forecast = without, foretold
    return active


def _choice(model: ArmModel, data: Measurements, fitted: Fit) -> _Choice:
    problem, block = fitted.problem(model, data), warm_blocks(data)[data.pose]
    blocks = [(block == b) & ~fitted.outlier for b in range(1, BLOCKS)] if block.max(initial=-1) > 0 else []
    foretold = [(_known(problem, block < b), rows) for b, rows in enumerate(blocks, 1) if rows.any()]
    return _Choice(problem, _known(problem), foretold)


def _known(problem: LinearProblem, rows: BoolArray | None = None) -> Information:
    solution = problem.solve(problem.equations(rows))
    return Information(solution.x, solution.covariance)


def warm_blocks(data: Measurements) -> IntArray:
    """The block of each pose in time, (M,); -1 at cold poses."""
    block = np.full(len(data.theta), -1)
    warm = np.flatnonzero(data.warm > 0)
    block[warm[np.argsort(data.time[warm], kind="stable")]] = np.arange(len(warm)) * BLOCKS // max(len(warm), 1)
    return block
