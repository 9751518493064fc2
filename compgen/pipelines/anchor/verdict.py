r"""What to do with a state: *anchored*, *leave it*, *cannot tell*, *something moved*.

The best hypothesis is believed where the touches speak for it, and the state is taken where it makes the path better:

    cannot tell       no hypothesis explains the touches (chi^2), two do whose paths differ, or too much stays open
    something moved   the best one has a base that moved, or a target that was knocked, by more than touches are off
    leave it          little is expected to be gained and the touches would move the path by no more than stays open,
                      or they speak for a forecast that is as good as exact
    anchored          otherwise

Touches that fit another reading of their files much better than the one that was given are refused, with what mends.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from compgen.core.arrays import Array, rms
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.units import MM, UM
from compgen.error_model.anchored_state import AnchorVerdict
from compgen.identification.touches import Artefact, Touches
from compgen.job.job import Cell
from compgen.pipelines.anchor.forecast import Forecast
from compgen.pipelines.anchor.hypotheses import AS_FORECAST, Hypothesis, Innovation, Weighed, weigh
from compgen.pipelines.anchor.touching import innovation_of, touched
from compgen.pipelines.anchor.unknowns import Unknowns

UNLIKELY = 1e-4  # of a chi^2, below which nothing explains the touches
COARSE = 1.25  # times the touches' noise left open: too few touches to mend a forecast that they see nothing wrong with
GAIN = 0.9  # of the path's rms: with more left, nothing is gained
OPEN = 40 * UM  # rms of the path that may stay open after a day that went otherwise
RIVAL = 2.0  # difference of two evidences' logarithms, below which both may hold
APART = 25 * UM  # rms by which two rivals' paths may differ
SURE = 3.0  # standard deviations of what moved
LEAST_MOVED = 50 * UM
MUCH = 10.0  # difference of the logarithms of two evidences
WILD = 4.0  # times what the forecast leaves open: with a base that moved as well, it is the geometry
PLAUSIBLE = 0.01  # of a chi^2


@dataclass(frozen=True, eq=False, slots=True)
class Moved:
    """What has moved, and by how much."""

    what: str  # "base", or a target's name
    shift: Array  # (3,) [m] World; of the base at the middle of the part
    sigma: Array  # (3,) [m]

    @property
    def distance(self) -> float:
        """[m]."""
        return float(np.linalg.norm(self.shift))

    @property
    def is_sure(self) -> bool:
        """Whether it is more than touches can be off."""
        ratio = np.abs(self.shift) / np.maximum(self.sigma, 1e-9)
        return self.distance > LEAST_MOVED and bool(ratio.max() > SURE)


def probability(chi2: float, freedom: int) -> float:
    """Of a chi^2 as large or larger."""
    return float(chdtrc(freedom, chi2))


def anchor_verdict(
    best: Weighed,
    coordinates: int,
    rms: tuple[float, float, float],
    forecast_error: Array,
    moved: Sequence[Moved],
    rival: tuple[Hypothesis, float] | None,
    noise: float,
) -> tuple[AnchorVerdict, str]:
    """The verdict, and why.

    Args:
        best: The hypothesis that is believed.
        coordinates: How many touches gave.
        rms: Of the path, before and after, and of what the state moves it by [m].
        forecast_error: Of the forecast at each touch [m].
        moved: What has moved.
        rival: Another hypothesis that may hold as well, and by how much its path differs [m].
        noise: Standard deviation of a coordinate of a touch [m].
    """
    before, after, change = rms
    if probability(best.chi2, coordinates) < UNLIKELY:
        off = np.sqrt(best.chi2 / coordinates)
        return "cannot tell", f"no state explains the touches: the best leaves them {off:.1f} times too far off"
    if rival is not None:
        return (
            "cannot tell",
            f"{_words(best.hypothesis)}, or {_words(rival[0])}: on the path they differ by {rival[1] / UM:.0f} um",
        )
    if best.hypothesis.day > 1 and after > OPEN and after > 0.5 * before:
        return "cannot tell", f"{after / UM:.0f} um rms of the path stay open"
    if any(m.is_sure for m in moved):
        return "something moved", " and ".join(f"{m.distance / MM:.2g} mm at {m.what}" for m in moved if m.is_sure)
    is_left = change <= after
    if is_left and after > GAIN * before:
        return "leave it", "the touches would leave about as much of the path open as the forecast does"
    without = float(np.sqrt(np.mean(forecast_error**2)))
    is_fine = best.hypothesis == AS_FORECAST and 3 * without**2 < after**2 + 3 * noise**2
    if is_left and is_fine and after > COARSE * noise:
        return "leave it", "the touches see nothing wrong with the forecast, and know too little to make it better"
    if best.hypothesis.day == 0:
        return "leave it", f"the forecast predicts the touches to {without / UM:.0f} um, as well as they can tell"
    return "anchored", path_known_words(before, after)


def path_known_words(before: float, after: float, *, base_moved: bool = False) -> str:
    """How well the path is known without the touches and with them, rms [m], in words.

    Where the base has moved, what was known before counts a base that may be anywhere, and is left out.
    """
    if base_moved:
        return f"with the touches the path is known to {after / UM:.0f} um rms"
    return f"the path was known to {before / UM:.0f} um rms, with the touches to {after / UM:.0f}"


def _words(h: Hypothesis) -> str:
    parts = [f"the day went otherwise ({h.day:g} times)"] if h.day > 1 else []
    parts += ["the base moved"] if h.base else []
    parts += ["a target was knocked"] if h.target >= 0 else []
    parts += ["a touch went wrong"] if h.touch >= 0 else []
    parts += [f"touches are {h.noise:g} times as noisy"] if h.noise > 1 else []
    return ", ".join(parts) or "the forecast holds"


def refuse_taught(
    artefact: Artefact, touches: Touches, frame: Pose, forecast: Forecast, unknowns: Unknowns, best: Weighed
) -> None:
    """Raises InputError where the touches say that the robot itself taught the places, and the artefact does not."""
    if best.hypothesis == AS_FORECAST or artefact.taught is not None:
        return
    seen = touched(replace(artefact, taught={}), touches, frame, forecast)
    other = weigh(innovation_of(seen, forecast, unknowns), unknowns.prior)[0]
    if other.evidence > best.evidence + MUCH and probability(other.chi2, len(seen.y)) > PLAUSIBLE:
        raise InputError(
            f"{artefact.source}: artefact.taught: missing: the touches fit places that this robot taught itself "
            f"when it "
            "was cold, not places by an instrument; add taught = {} to [artefact], or mend the places"
        )


def refuse_unidentified(
    cell: Cell, artefact: Artefact, touches: Touches, best: Weighed, innovation: Innovation
) -> None:
    """Raises InputError where nothing explains touches of an arm that nobody identified."""
    is_known = cell.posterior is not None or cell.held_out is not None or any(k.sigma for k in cell.known)
    h = best.hypothesis
    is_explained = probability(best.chi2, len(innovation.y)) > PLAUSIBLE and not (h.base and h.day >= WILD)
    if is_known or artefact.taught is not None or is_explained:
        return
    off = rms(innovation.y)
    raise InputError(
        f"{touches.file}: touches are {off / UM:.0f} um off (rms), and no likely drift explains it: {cell.robot_file} "
        f"was never "
        "identified; cgen identify first, or let this robot teach the places cold ([artefact] taught = {})"
    )
