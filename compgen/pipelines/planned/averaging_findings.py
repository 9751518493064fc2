"""What a user must know of a file that serves many starts."""

from compgen.core.codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.units import UM
from compgen.pipelines.planned.averaging import Averaged
from compgen.thermal.ensemble import Ensemble, Start

WIDE = 2.0  # times better from which files for each start are worth a warning
APART = 0.1  # of the spread, by which twin and error model may differ
SAME = 0.1 * UM  # below which they agree


def averaging_findings(averaged: Averaged) -> list[Finding]:
    """The spread over the starts, whether several files would be much better, and whether the twin saw the same."""
    worst = averaged.worst_flown
    message = (
        f"one file for {ensemble_words(averaged.ensemble)}: at most {averaged.at_mean.max / UM:.2f} um with the mean "
        f"of the rises, {averaged.rms / UM:.2f} rms and {worst.total.max / UM:.2f} at most over the starts "
        f"({start_words(worst.start)})"
    )
    findings = [Finding(Level.NOTE, Code.AVERAGE_SPREAD, message)]
    remade = averaged.remade
    if remade and worst.total.max / remade >= WIDE and averaged.added.max() > averaged.tolerance:
        message = (
            f"a file re-made for each start would be {worst.total.max / remade:.1f} times better: {remade / UM:.2f} um "
            f"instead of {worst.total.max / UM:.2f}; {averaged.files} files keep each start within "
            f"{averaged.tolerance / UM:g} um of its own (compensation.start_drift_um)"
        )
        findings.append(Finding(Level.WARNING, Code.AVERAGE_WIDE, message))
    if averaged.disagreement > max(APART * averaged.spread, SAME):
        message = (
            f"over the starts the twin differs from the error model by {averaged.disagreement / UM:.2f} um rms, the "
            f"starts from their mean by {averaged.spread / UM:.2f}: trust what was flown, not what lies between"
        )
        findings.append(Finding(Level.WARNING, Code.AVERAGE_MODEL, message))
    return findings


def ensemble_words(ensemble: Ensemble) -> str:
    """The starts in words."""
    low, high = ensemble.delay
    words = [f"starts {low:g} to {high:g} s late"] if high > low else []
    if not words and high > 0:
        words = [f"a start {high:g} s late"]
    first, last = (run + 1 for run in ensemble.runs)
    words += [f"runs {first} to {last}"] if last > first else [f"run {first}"] if first > 1 else []
    if ensemble.overrides != (1.0,):
        words.append(f"overrides {', '.join(f'{100 * share:.4g}' for share in ensemble.overrides)} %")
    return ", ".join(words) or "the planned start"


def start_words(start: Start) -> str:
    """One start in words."""
    late = f"{start.delay:.0f} s late" if start.delay else "at once"
    speed = f", override {100 * start.override:.4g} %" if start.override != 1 else ""
    return f"run {start.run + 1}, {late}{speed}"
