r"""Whether a temperature log read another way explains the poses much better: its clock moved, two sensors exchanged.

The rises r of the log as it stands, moved by a time s, r(t + s), or with two of its columns exchanged, each give the
linear problem of the fit other slopes; its log evidence with the noise learnt anew says how well.

Warming by one exponential, r(t + s) = a + b r(t): rates take up b, and the frame of the warm poses takes up a where it
is their own. So files whose frames lie within a millimetre are taken as measured from one setup here."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations

from compgen.core.arrays import Array, exchanged
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.units import MINUTE
from compgen.identification.fit import Fit, fit
from compgen.identification.linearisation import linearise
from compgen.identification.measurements import Measurements
from compgen.identification.model import ArmModel
from compgen.identification.shared_setup import as_one_setup
from compgen.identification.warm_up import CLOCK_SHIFTS

GAIN = 10.0  # of log evidence, from which another reading of the log is the right one; a log as it is gains below 2
ROUNDS = 4  # of learning the noise


def log_findings(model: ArmModel, data: Measurements, fitted: Fit, nodes: Sequence[str]) -> list[Finding]:
    """A refusal or a warning where the poses ask for another reading of their temperature log.

    Args:
        model: The arm with symbols.
        data: What was measured, with rises as the log stands.
        fitted: With all thermal terms.
        nodes: Names of the rises, (K,).
    """
    if data.shifted is None or not (fitted.active & model.thermal).any():
        return []
    merged = as_one_setup(data, fitted)
    if len(merged.instruments) < len(data.instruments):
        data, fitted = merged, fit(model, merged, fitted.active)
    as_it_stands = log_evidence(model, data, fitted)
    for readings, level in ((moved_clocks(data), Level.REFUSED), (exchanged_sensors(data, nodes), Level.WARNING)):
        gains = [
            (log_evidence(model, replace(data, rise=rise), fitted) - as_it_stands, words) for rise, words in readings
        ]
        gain, words = max(gains, default=(0.0, ""))
        if gain >= GAIN:
            message = f"the poses fit the temperature log far better (log evidence + {gain:.0f}) {words}"
            return [Finding(level, Code.LOG_CLOCK if level is Level.REFUSED else Code.LOG_SWAPPED, message)]
    return []


def moved_clocks(data: Measurements) -> Iterator[tuple[Array, str]]:
    """Rises (M, K) [K] by the log with its clock moved, and each in words."""
    for shift, rise in zip(CLOCK_SHIFTS.tolist(), () if data.shifted is None else data.shifted, strict=False):
        minutes, seconds = f"{abs(shift) / MINUTE:.0f} min", f"{abs(shift):.0f} s"
        side, mend = ("ahead of", f"take {seconds} from") if shift > 0 else ("behind", f"add {seconds} to")
        yield rise, f"where its clock is {minutes} {side} theirs; give both one clock: {mend} its time_s"


def exchanged_sensors(data: Measurements, nodes: Sequence[str]) -> Iterator[tuple[Array, str]]:
    """Rises (M, K) [K] by the log with two of its columns exchanged, and each in words."""
    for i, j in combinations([k for k in range(len(nodes)) if k not in data.modelled], 2):
        rise = data.rise[:, exchanged(len(nodes), i, j)]
        yield rise, f"with {nodes[i]}_degC and {nodes[j]}_degC exchanged: are the two sensors swapped?"


def log_evidence(model: ArmModel, data: Measurements, fitted: Fit) -> float:
    """Of all rows that were kept, at the fit's linearisation with other rises."""
    linear = linearise(
        model,
        data,
        fitted.active,
        fitted.p,
        fitted.frames,
        fitted.reflector_rotation,
    )
    return fitted.problem(model, data, linear).solve(learn_noise=True, rounds=ROUNDS).log_evidence
