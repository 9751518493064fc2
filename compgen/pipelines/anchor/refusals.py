"""Touches that fit another reading of their files much better than the one that was given: refused, with what mends."""

from dataclasses import replace

import numpy as np

from compgen.core.arrays import rms
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.units import MINUTE, UM
from compgen.identification.touches import Artefact, Touches
from compgen.job.job import Cell
from compgen.pipelines.anchor.forecast import Forecast
from compgen.pipelines.anchor.hypotheses import AS_FORECAST, Innovation, Judged, Prior, judge
from compgen.pipelines.anchor.touching import innovation_of, touched
from compgen.pipelines.anchor.unknowns import Unknowns
from compgen.pipelines.anchor.verdict import probability

MUCH = 10.0  # difference of the logarithms of two evidences
STEP = 15 * MINUTE  # of the hours that are tried
WILD = 4.0  # times what the forecast leaves open: with a base that moved as well, it is the geometry
PLAUSIBLE = 0.01  # of a chi^2


def refuse_taught(
    artefact: Artefact, touches: Touches, frame: Pose, forecast: Forecast, unknowns: Unknowns, best: Judged
) -> None:
    """Raises InputError where the touches say that the robot itself taught the places, and the artefact does not."""
    if best.hypothesis == AS_FORECAST or artefact.taught is not None:
        return
    seen = touched(replace(artefact, taught={}), touches, frame, forecast)
    other = judge(innovation_of(seen, forecast, unknowns), unknowns.prior)[0]
    if other.evidence > best.evidence + MUCH and probability(other.chi2, len(seen.y)) > PLAUSIBLE:
        raise InputError(
            f"{artefact.source}: artefact.taught: missing: the touches fit places that this robot taught itself "
            f"when it "
            "was cold, not places by an instrument; add taught = {} to [artefact], or mend the places"
        )


def refuse_other_hour(forecast: Forecast, touches: Touches, innovation: Innovation, prior: Prior, best: Judged) -> None:
    """Raises InputError where the touches fit the log at another hour, and not at theirs."""
    if best.hypothesis == AS_FORECAST or forecast.course is None or not touches.timed:
        return
    time, course = forecast.course
    K, when = course.shape[1], touches.time
    rates = innovation.H[:, :K]

    def rises(shift: float) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        return np.column_stack([np.interp(when + shift, time, column) for column in course.T])[innovation.touch]

    now, tried = rises(0.0), np.arange(time[0] - when.min(), time[-1] - when.max(), STEP)
    for shift in tried[np.abs(tried) >= 2 * STEP].tolist():
        other = replace(innovation, y=innovation.y - (rates * (rises(shift) - now)).sum(axis=1))
        as_said = next(j for j in judge(other, prior) if j.hypothesis == AS_FORECAST)
        if as_said.evidence > best.evidence + MUCH and probability(as_said.chi2, len(other.y)) > PLAUSIBLE:
            raise InputError(
                f"{touches.file}: column time_s: of another hour: the touches fit the log "
                f"{abs(shift) / MINUTE:.0f} min {'later' if shift > 0 else 'earlier'}, not at their times; mend "
                f"the times"
            )


def refuse_unidentified(cell: Cell, artefact: Artefact, touches: Touches, best: Judged, innovation: Innovation) -> None:
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
