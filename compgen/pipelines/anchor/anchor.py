"""The story of one anchoring, on one page: forecast, touches, hypotheses, state, what it leaves, verdict.

From files to an anchoring: the path with its history or a log, the touches, and what was touched.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np

from compgen.core.arrays import Array, rms
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.recorded.table import read_findings
from compgen.core.toml import toml_value
from compgen.core.units import HOUR, MINUTE
from compgen.error_model.anchored_state import AnchoredState, AnchorVerdict
from compgen.error_model.direction_memory import NO_DIRECTION
from compgen.identification.touches import Artefact, Touches, read_artefact, read_touches
from compgen.job.anchored_start import made_from_robot
from compgen.job.job import Job
from compgen.job.start_window import PromptMotion, longest_waits
from compgen.pipelines.anchor.estimate import (
    Compared,
    Estimate,
    birge_ratio,
    compare,
    estimate,
    moved_target,
    next_touches,
    path_places,
    widened,
)
from compgen.pipelines.anchor.hypotheses import (
    AS_FORECAST,
    KNOCKED,
    Hypothesis,
    Weighed,
    left_out,
    weigh,
)
from compgen.pipelines.anchor.result import Anchored, anchor_findings
from compgen.pipelines.anchor.touch_model import frame_of_artefact
from compgen.pipelines.anchor.verdict import (
    APART,
    RIVAL,
    Moved,
    anchor_verdict,
    refuse_taught,
    refuse_unidentified,
)
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.measure.fitted_law import rise_reference
from compgen.pipelines.measure.identification_files import artefact_of_touches
from compgen.thermal.model import state_with_rises

TRUSTED = 2.0  # times the drift that a start may add: so much standing is modelled well enough
SHORTEST, LONGEST = 1 * MINUTE, 4 * HOUR  # of a state's window


def anchor(
    job: Job, artefact: Artefact, touches: Touches, frame: Pose, made_from: Mapping[str, str] | None = None
) -> Anchored:
    """The state of a job's robot, by touches against its forecast.

    Args:
        job: Its history or its log, its path, and its robot.
        artefact: What was touched.
        touches: On the clock of the log, else from the first duty of [[before]] on.
        frame: Place in World of the frame that the artefact's places are in.
        made_from: sha256 of each file that went in.

    Raises:
        InputError: Touches of another hour, of other targets, in other units, too few; or of a robot whose geometry
            nobody has identified.
        ImpossibleError: The robot cannot drive the path.
    """
    beside = compare(job, artefact, touches, frame, path_places(job))
    forecast, seen, innovation, prior = beside.forecast, beside.seen, beside.innovation, beside.prior
    judged = weigh(innovation, prior)
    best, as_forecast = judged[0], next(j for j in judged if j.hypothesis == AS_FORECAST)
    refuse_taught(artefact, touches, frame, forecast, beside.unknowns, best)
    used = innovation.rows(innovation.used(best.hypothesis))
    chosen = widened(estimate(beside, best.hypothesis), used.y)
    left = left_out(used, chosen.V)
    error = np.array([rms(used.y[used.touch == n]) for n in left.touch.tolist()])
    moved = _moved(artefact, best.hypothesis, chosen, beside)
    rival = _rival(judged, beside, chosen)
    sizes = rms(chosen.before), rms(chosen.after), rms(np.linalg.norm(chosen.correction, axis=1))
    verdict, reason = anchor_verdict(best, len(innovation.y), sizes, error, moved, rival, float(np.median(seen.sigma)))
    refuse_unidentified(forecast.cell, artefact, touches, best, innovation)
    state = _state(beside, chosen, verdict, as_forecast, made_from or {})
    anchored = Anchored(
        job=job,
        artefact=artefact,
        state=state,
        reason=reason,
        forecast=forecast,
        unknowns=beside.unknowns,
        seen=seen,
        path=beside.path,
        innovation=innovation,
        columns=beside.columns,
        judged=tuple(judged),
        as_forecast=as_forecast,
        chosen=chosen,
        left=left,
        moved=moved,
        touch_next=tuple(next_touches(beside, artefact, frame, chosen)),
        findings=(),
    )
    return replace(anchored, findings=(*anchor_findings(anchored), *read_findings(touches.notes)))


def _moved(artefact: Artefact, h: Hypothesis, chosen: Estimate, beside: Compared) -> tuple[Moved, ...]:
    """What the best hypothesis says has moved."""
    moved, innovation, prior, K = [], beside.innovation, beside.prior, beside.nodes
    if h.base:
        x, y, z = beside.path.middle.tolist()
        J = np.hstack([np.eye(3), [[0, z, -y], [-z, 0, x], [y, -x, 0]]])  # d + w x c
        base = slice(K, K + 6)
        sigma = np.sqrt(np.diag(J @ chosen.covariance[base, base] @ J.T))
        moved.append(Moved("the base", J @ chosen.x[base], sigma))
    if h.target >= 0:
        of_target = innovation.target == h.target
        V = innovation.covariance(prior, replace(h, target=-1))
        a, b = np.flatnonzero(of_target), np.flatnonzero(~of_target)
        gain = V[np.ix_(a, b)] @ np.linalg.inv(V[np.ix_(b, b)])
        left = innovation.y[a] - gain @ innovation.y[b]
        weight = np.asarray(np.linalg.inv(V[np.ix_(a, a)] - gain @ V[np.ix_(b, a)]))
        shift, sigma = moved_target(left, weight, innovation.along[a], KNOCKED)
        kind = "sphere" if h.target < len(artefact.names) else "plane"
        moved.append(Moved(f"{kind} {artefact.targets[h.target]}", shift, sigma))
    return tuple(moved)


def _rival(judged: list[Weighed], beside: Compared, chosen: Estimate) -> tuple[Hypothesis, float] | None:
    """Another cause that may hold as well, and by how much its path differs [m]; None where that does not matter."""
    best = judged[0]
    for other in judged[1:]:
        if other.evidence < best.evidence - RIVAL:
            return None
        h = other.hypothesis
        if h.cause == best.hypothesis.cause:
            continue
        apart = rms(np.linalg.norm(estimate(beside, h).correction - chosen.correction, axis=1))
        if apart > max(APART, rms(chosen.after)):
            return h, apart
    return None


def _state(
    beside: Compared, chosen: Estimate, verdict: AnchorVerdict, as_forecast: Weighed, made_from: Mapping[str, str]
) -> AnchoredState:
    """The state to be written: with *leave it* the forecast's own."""
    forecast, unknowns, K = beside.forecast, beside.unknowns, beside.nodes
    cell, x, covariance = forecast.cell, chosen.x, chosen.covariance
    if verdict == "leave it":
        larger = birge_ratio(as_forecast.chi2, len(beside.innovation.y))
        x, covariance = np.zeros_like(x), larger * beside.prior.forecast
    base, drift, earlier = x[K : K + 6], x[K + 6 :] / unknowns.unit, cell.state
    if earlier is not None:
        base = base + earlier.base
        before = dict(zip(earlier.drifting, earlier.drift.tolist(), strict=True))
        drift = drift + np.array([before.get(name, 0.0) for name in unknowns.named])
    unit = np.concatenate([np.ones(K + 6), 1 / unknowns.unit])
    rise, heat = forecast.rise + x[:K], cell.heat
    state = state_with_rises(heat, np.arange(K), rise, forecast.state)
    return AnchoredState(
        model=heat.kind,
        nodes=heat.names,
        rise=rise,
        modal=None if heat.law is not None else state,
        base=base,
        drifting=unknowns.named,
        drift=drift,
        covariance=covariance * np.outer(unit, unit),
        air=forecast.air,
        time=forecast.time,
        window=_window(beside, rise, state),
        verdict=verdict,
        reference=_counts_from(beside.job),
        made_from={**made_from_robot(cell), **made_from},
    )


def _counts_from(job: Job) -> float | None:
    """What rises and air of a job count from [degC]; None where it is the air, or the cold start, of a log."""
    path, earlier = job.inputs["path"], job.cell.state
    if earlier is not None and earlier.reference is not None:
        return earlier.reference
    of_log = None if path["log"] is None or earlier is not None else path["log"]["reference"]
    if isinstance(of_log, str):
        return None
    return float(path["ambient"]["reference_degC"] if of_log is None else of_log)


def _window(beside: Compared, rise: Array, state: Array) -> float:
    """How long the robot may stand as it is before the path has moved by more than is modelled well enough [s]."""
    job, forecast, path = beside.job, beside.forecast, beside.path
    cell = forecast.cell
    begun = replace(job, cell=cell, history=forecast.history, start_drift=TRUSTED * job.start_drift, ensemble=None)
    model = cell.error_model(job.tool.pose)
    course = PromptMotion(path.time, path.theta, np.broadcast_to(rise, (len(path.theta), len(rise))), NO_DIRECTION)
    window = float(longest_waits(begun, model, course, np.zeros(1, dtype=np.int64), state[None])[0])
    return round(min(max(window, SHORTEST), LONGEST))


def anchor_files(  # noqa: PLR0913 - the files that one command names
    path: str,
    robot: str | None,
    overrides: Sequence[str],
    touches: str,
    artefact: str | None,
    log: str | None = None,
    reference: str | None = None,
    frames: str | None = None,
) -> Anchored:
    """The state of a path's robot.

    Args:
        path: A path file.
        robot: Name or file; None: what the path file says.
        overrides: ``key=value`` of both files.
        touches: CSV.
        artefact: TOML; None: ``artefact.toml`` beside the touches.
        log: Temperature log on the touches' clock, in place of [[before]].
        reference: What its rises count from: "start", "ambient" or degC; None: as the path file has it.
        frames: Where user frames are.

    Raises:
        InputError: Anything wrong, naming file and line or key.
        ImpossibleError: The robot cannot drive the path.
    """
    job = load_with_log(path, robot, overrides, log, reference)
    artefact = artefact_of_touches(touches, artefact)
    known = read_artefact(artefact)
    number, frame = frame_of_artefact(known, job.frame, frames)
    seen = read_touches(touches, job.robot, known, {number: frame}, planes=True)
    files = {"path": path, "touches": touches, "artefact": artefact, "log": log}
    made_from = {name: sha256(Path(file).read_bytes()).hexdigest() for name, file in files.items() if file is not None}
    return anchor(job, known, seen, frame, made_from)


def load_with_log(
    path: str, robot: str | None, overrides: Sequence[str], log: str | None, reference: str | None
) -> Job:
    """The job of a path file, with a temperature log in place of its [[before]].

    Args:
        path: The path file.
        robot: Name or file; None: what the path file says.
        overrides: ``key=value`` of both files.
        log: Its file; None: there is none.
        reference: What its rises count from: "start", "ambient" or degC; None: as the path file has it.

    Raises:
        InputError: Anything wrong; a log that is not there, or beside a state, or a reference without a log.
    """
    if log is None:
        if reference is not None:
            raise InputError(f"--reference {reference}: is of a log; give it with --log")
        return load_job(path, robot, overrides)
    if not os.path.exists(log):
        raise InputError(f"--log {log}: no such file; give a temperature log")
    file = os.path.relpath(log, Path(path).parent)
    given = [*overrides, "before=[]", f"log.file={toml_value(file)}"]
    zero = [] if reference is None else [f"log.reference={toml_value(rise_reference(reference))}"]
    job = load_job(path, robot, [*given, *zero])
    if job.cell.state is not None:
        raise InputError(f"--log {log}: a state stands in place of history and log; leave --log or [state] out")
    return job
