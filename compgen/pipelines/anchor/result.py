"""What an anchoring comes to: a state, its verdict, and all that a user must know of them."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import rms
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.units import MM, UM
from compgen.error_model.anchored_state import AnchoredState, AnchorVerdict
from compgen.error_model.direction_memory import reversal_widths
from compgen.identification.touches import Artefact
from compgen.pipelines.anchor.estimate import Compared, Estimate, NextTouch
from compgen.pipelines.anchor.hypotheses import LeftOut, Weighed
from compgen.pipelines.anchor.touching import THROUGH
from compgen.pipelines.anchor.verdict import Moved, probability

LIKELY = 0.01  # of a chi^2, below which physics is missing from the forecast
E_N = 1.0


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Anchored(Compared):
    """A state, its verdict, and all that speaks for them, the touches beside their forecast first of all."""

    artefact: Artefact
    state: AnchoredState
    reason: str
    judged: tuple[Weighed, ...]  # the best first
    as_forecast: Weighed
    chosen: Estimate
    left: LeftOut
    moved: tuple[Moved, ...]
    touch_next: tuple[NextTouch, ...]
    findings: tuple[Finding, ...]

    @property
    def verdict(self) -> AnchorVerdict:
        """What to do with the state."""
        return self.state.verdict

    @property
    def rms(self) -> tuple[float, float]:
        """Standard deviation of the path's place, all directions together, before and after: rms along it [m]."""
        return rms(self.chosen.before), rms(self.chosen.after)


def anchor_findings(anchored: Anchored) -> Iterator[Finding]:
    """Physics that is missing, what moved, touches that the others do not predict, and what was assumed."""
    hypothesis, R = anchored.judged[0].hypothesis, len(anchored.innovation.y)
    level = Level.OUTSIDE if anchored.verdict in ("cannot tell", "something moved") else Level.NOTE
    yield Finding(level, Code.ANCHOR_VERDICT, f"{anchored.verdict}: {anchored.reason}{_next(anchored)}")
    for moved in anchored.moved:
        by = ", ".join(f"{a} {v / MM:+.3f}" for a, v in zip("xyz", moved.shift.tolist(), strict=True))
        k2 = ", ".join(f"{2 * s / UM:.0f}" for s in moved.sigma.tolist())
        of_base = " where the part is; a probe that is not where [probe] says looks alike: cgen teach-frame fits it"
        where = of_base if moved.what == "the base" else "; its touches are left out"
        message = f"{moved.what} moved by {moved.distance / MM:.2f} mm ({by} mm, +- {k2} um at 95 %){where}"
        yield Finding.of(Code.ANCHOR_MOVED, message)
    chi2 = anchored.as_forecast.chi2
    # what moved, or one touch, is no physics where it explains the rest
    is_open = max(hypothesis.day, hypothesis.noise) > 1 or probability(anchored.judged[0].chi2, R) < LIKELY
    if probability(chi2, R) < LIKELY and is_open:
        why = (
            f"; the day went {hypothesis.day:g} times as far from the forecast as it may" if hypothesis.day > 1 else ""
        )
        from_it = f"the touches are {np.sqrt(chi2 / R):.1f} times as far from the forecast as expected"
        yield Finding.of(Code.ANCHOR_PHYSICS, f"physics is missing: {from_it}{why}")
    yield from _touch_findings(anchored)
    if anchored.job.log is None and not anchored.job.history.before and anchored.job.cell.state is None:
        yield Finding.of(Code.ANCHOR_COLD, "neither [[before]] nor a log: the forecast is a cold robot")
    yield from anchored.job.input_findings


def _touch_findings(anchored: Anchored) -> Iterator[Finding]:
    """Touches that went wrong or that the others do not predict, how far they scatter, and what they leave open."""
    seen, hypothesis = anchored.seen, anchored.judged[0].hypothesis
    touches = seen.touches
    if hypothesis.touch >= 0:
        off = np.linalg.norm(seen.y[seen.touch == hypothesis.touch])
        label = touches.label[hypothesis.touch]
        yield Finding.of(
            Code.ANCHOR_TOUCH, f"{label}: this touch went wrong: {off / MM:.2f} mm from the forecast; it is left out"
        )
    if hypothesis.noise > 1:
        yield Finding.of(Code.ANCHOR_NOISE, f"touches scatter {hypothesis.noise:g} times as much as their sigma says")
    for n in np.flatnonzero(anchored.left.E_n > E_N).tolist():
        touch = int(anchored.left.touch[n])
        yield Finding.of(
            Code.ANCHOR_LEFT_OUT,
            f"{touches.label[touch]}: '{anchored.artefact.targets[touches.target[touch]]}' is "
            f"{anchored.left.error[n] / UM:.0f} um from where the other touches put it, "
            f"{anchored.left.E_n[n]:.1f} times the limit of 95 %",
        )
    if not np.isfinite(touches.sigma).any():
        message = f"the touches give no sigma_um: each coordinate counts with {np.median(seen.sigma) / UM:.0f} um"
        yield Finding.of(Code.ANCHOR_SIGMA, message)
    still = np.flatnonzero(np.ptp(touches.theta, axis=0) < THROUGH)
    if seen.taught is not None and len(still) and reversal_widths(anchored.job.sources) is not None:
        named = ", ".join(f"J{k + 1}" for k in still.tolist())
        yield Finding.of(
            Code.ANCHOR_PLAY,
            f"{named} did not turn between the touches: if its play was another when the places were taught, the state "
            "is wrong by it; turn it by 2 deg before the first touch, both times",
        )


def _next(anchored: Anchored) -> str:
    """Which targets to touch as well, where the touches do not tell."""
    if anchored.verdict != "cannot tell" or not anchored.touch_next:
        return ""
    words = [f"{n.target} (along {n.axis})" for n in anchored.touch_next]
    return f"; touch these as well: {', '.join(words)}"
