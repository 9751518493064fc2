r"""Identification: check the measurements, fit the candidate models, select one by cross-validation, judge it."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from compgen.core import stages
from compgen.core.arrays import Array, column_extremes, nine_digits
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.rotations import rotation_vector
from compgen.core.stages import Progress, RunStage
from compgen.core.units import DEG, MM, UM
from compgen.error_model.direction_memory import reversal_widths
from compgen.error_model.source import ArmFacts, Extensible
from compgen.error_model.uncertain_sources import UncertainSource
from compgen.identification.cross_validation import cross_validate, richest_of_the_best
from compgen.identification.evidence import USUAL_NOISE
from compgen.identification.fit import Fit, fit
from compgen.identification.fit_limits import (
    assess_fit_limits,
    fit_limits_record,
    forecast_findings,
    with_uncertain_scales,
)
from compgen.identification.identifiability import (
    Identifiability,
    assess_identifiability,
    taught_sigma,
    unobservable,
)
from compgen.identification.instrument_frames import InstrumentFrames
from compgen.identification.log_readings import log_findings
from compgen.identification.measured_poses import STILL
from compgen.identification.measured_turns import check_fitted_turns
from compgen.identification.measurement_checks import check_plausible, check_row_count, check_scale
from compgen.identification.measurements import WORLD, Measurements
from compgen.identification.model import ArmModel, SymbolicSource, active_in_groups, build_model
from compgen.identification.outliers import explained_by_play, reach_of_play, unknown_sides_finding
from compgen.identification.parameters import candidate_models, symbolic_sources, warm_up_states
from compgen.identification.reversals import (
    LostMotion,
    fit_lost_motion,
    lost_motion_findings,
    with_lost_motion,
    with_runs_as_poses,
)
from compgen.identification.shared_setup import (
    FileNoise,
    differ,
    noises_of_files,
    weighed_by_noise,
    with_shared_setups,
)
from compgen.identification.thermal_terms import nodes_to_offer, with_needed_warmth
from compgen.identification.verdict import FittedCandidate, known_here_only, left_findings, verdict_findings
from compgen.job.tables import FitLimits
from compgen.robot.robot import Robot

ROUNDS = 5  # of weighing files by their own noise
UNLIKE = 2.0  # times apart: noises of files that differ
SETTLED = 1.1  # times apart: factors of noises that stand still
LARGEST_NOISE = 5 * np.array(USUAL_NOISE)  # of a file whose instrument may be so bad
EACH_WEIGHED = "each is weighed by that; if both instruments should be alike, look for what moved"
PLAIN_WARMTH = "warmth"  # the state that an arm without a heat model has


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Identification:
    """The fitted models, the one selected, and the verdict."""

    robot: Robot
    model: ArmModel
    data: Measurements
    candidates: tuple[FittedCandidate, ...]  # from the plainest; the first fits frames only
    best: int  # index of the selected one
    identifiability: Identifiability
    findings: tuple[Finding, ...]
    known: tuple[UncertainSource, ...]  # sources with fitted values and sigmas
    box: Array  # (6, 2) [rad] pendant angles that the poses cover
    taught_sigma: tuple[float, float]  # [m] of a coordinate, frame taught: with theta in that box, and with any
    lost_motion: LostMotion | None = None  # what reversal runs told
    limits: FitLimits = field(default_factory=FitLimits)  # what the fit leaves beside its parameters' covariance

    @property
    def selected(self) -> FittedCandidate:
        """The model that predicts best."""
        return self.candidates[self.best]

    def record(self) -> dict[str, Any]:
        """The robot file's table ``identified``: frames, noise and held-out error."""
        frames, validation = self.selected.fit.frames, self.selected.cross_validation
        held_out = np.array([validation.mean, *validation.interval()])
        places = _millimetres(self.data.fixed.names, frames.place)
        return {
            "model": self.selected.candidate.name,
            "noise_um": nine_digits(self.selected.fit.noise / UM),
            "held_out_um": _as_written(held_out[np.isfinite(held_out)] / UM),
            **fit_limits_record(self.limits),
            **self._frames(frames),
            "reflector_mm": _millimetres(self.data.reflectors, frames.reflector),
            **({"place_mm": places} if places else {}),
        }

    def _frames(self, frames: InstrumentFrames) -> dict[str, Any]:
        """Where World is in the frame of the first instrument, and in those of artefacts; axis tests have none."""
        record: dict[str, Any] = {}
        artefacts = set(self.data.fixed.frame.tolist())
        origin, turn = frames.origin / MM, rotation_vector(frames.rotation) / DEG
        instruments = [i for i in np.flatnonzero(~self.data.aligned).tolist() if i not in artefacts]
        if instruments:
            i = instruments[0]
            name = self.data.named_instrument(i)
            record |= {"instrument": name} if name else {}
            record |= {"instrument_mm": _as_written(origin[i]), "instrument_deg": _as_written(turn[i])}
        framed = [i for i in sorted(artefacts) if i != WORLD]
        if framed:
            record["artefact_mm"] = {self.data.instruments[i]: _as_written(origin[i]) for i in framed}
            record["artefact_deg"] = {self.data.instruments[i]: _as_written(turn[i]) for i in framed}
        return record

    @property
    def refused(self) -> bool:
        """Whether the verdict is no."""
        return any(f.level is Level.REFUSED for f in self.findings)


def identify(
    robot: Robot,
    known: Sequence[UncertainSource],
    data: Measurements,
    nodes: int,
    progress: Progress,
    facts: ArmFacts | None = None,
    *,
    temperatures: bool,
) -> Identification:
    """Fit the error sources of a robot to measurements.

    Args:
        robot: The nominal arm.
        known: Its sources as the robot file has them: facts, priors, and values of what is not fitted.
        data: All measurements.
        nodes: How many nodes the heat model has.
        progress: Called with a stage and a share.
        facts: What else the robot file says of the arm: what it carries, its nodes, its growth.
        temperatures: Whether the rises in ``data`` were measured; otherwise a warm-up's are unknown states.

    Raises:
        InputError: Too few numbers, or measurements that cannot be of this arm.
    """
    progress(stages.MODEL, 0.0)
    check_row_count(data)
    check_scale(data)
    moved = np.asarray(np.ptp(data.theta, axis=0) > STILL)
    warm = bool((data.warm > 0).any())
    facts = facts if nodes or facts is None else _of_one_warmth(facts)
    states = warm_up_states(known) if warm and not temperatures else ()
    offered = nodes_to_offer(facts, states, data.modelled) if warm and facts is not None else ()
    sources = symbolic_sources(robot, known, moved, warm=warm, log=temperatures, facts=facts, offered=offered)
    sources, lost_motion = _with_measured_widths(sources, data)
    model = build_model(robot, sources, nodes, states, data.modelled)
    check_plausible(robot, model, data)
    data, candidates, of_sides = _fitted_of_known_sides(model, data, lost_motion, progress)
    best = _best_of(candidates, data)
    progress(stages.WARMTH, 0.9)
    misread = log_findings(model, data, candidates[best].fit, facts.nodes) if facts is not None else []
    data, selected, of_warmth = _with_needed_warmth(model, data, candidates[best], temperatures=temperatures)
    candidates[best] = selected
    progress(stages.JUDGE, 0.95)
    identifiability = assess_identifiability(model, data, selected.fit)
    chosen = [source for source in sources if is_fitted(source, selected)]
    limits = assess_fit_limits(model, data, selected.fit, temperatures=temperatures)
    measured, whole = np.column_stack(column_extremes(data.theta)), np.column_stack([robot.lower, robot.upper])
    here, anywhere = (taught_sigma(model, selected.fit, nodes, joints) for joints in (measured, whole))
    findings = [
        *verdict_findings(robot, model, data, candidates[0], selected, identifiability, moved),
        *known_here_only(here, anywhere),
        *_left(data, selected, limits, chosen),
        *lost_motion_findings(robot, lost_motion, chosen),
        *of_sides,
        *unobservable(model, data, selected.fit),
        *forecast_findings(limits, warm=warm),
        *misread,
        *of_warmth,
        *(_unwritten_warmth(nodes) if states else ()),
    ]
    return Identification(
        robot=robot,
        model=model,
        data=data,
        candidates=tuple(candidates),
        best=best,
        identifiability=identifiability,
        findings=tuple(findings),
        known=fitted_sources(known, sources, model, selected.fit, temperatures=temperatures),
        box=np.column_stack(column_extremes(robot.to_pendant(data.theta))),
        taught_sigma=(here, anywhere),
        lost_motion=lost_motion,
        limits=limits,
    )


def identify_by_files(identify_rows: Callable[[Measurements], Identification], data: Measurements) -> Identification:
    """An identification in which files that say no sigma weigh by their own noise, where that differs.

    Args:
        identify_rows: Identifies from measurements.
        data: All measurements.
    """
    pooled = identify_rows(data)
    noises = noises_of_files(pooled.data, pooled.selected.fit)
    if not differ(noises, UNLIKE):
        return pooled
    for _ in range(ROUNDS):
        weighed = identify_rows(data := weighed_by_noise(data, noises))
        noises = noises_of_files(weighed.data, weighed.selected.fit)
        factors = [noise.factor for noise in noises]
        if not noises or max(factors) < SETTLED * min(factors):
            break
    apart = [(best, worst, _noise_by_itself(weighed, worst)) for best, worst in differ(noises, UNLIKE)]
    doubtful = [_doubt(best, worst, own) for best, worst, own in apart if _is_no_instrument(worst, own)]
    messages = doubtful or [f"{_noise_words(best, worst)}: {EACH_WEIGHED}" for best, worst, _ in apart]
    taken = pooled if doubtful else weighed
    return replace(taken, findings=(*taken.findings, *(Finding.of(Code.NOISES, message) for message in messages)))


def _noise_by_itself(weighed: Identification, noise: FileNoise) -> float:
    """What a fit to a file's rows alone leaves of a coordinate [m]."""
    fitted, alone = weighed.selected.fit, weighed.data.subset(noise.rows)
    alone = replace(alone, sigma=alone.sigma / np.median(alone.sigma))
    return float(fit(weighed.model, alone, fitted.active, start=fitted).noise_of_row[0])


def _is_no_instrument(worst: FileNoise, by_itself: float) -> bool:
    """Whether a file's noise is no instrument's: too large for one, or most of it gone where the file is alone."""
    return bool(worst.noise >= min(LARGEST_NOISE[worst.kind], UNLIKE * by_itself))


def _noise_words(best: FileNoise, worst: FileNoise) -> str:
    """What the noises of two files are."""
    return f"{worst.name} is {worst.noise / UM:.0f} um off (rms of a coordinate), {best.name} {best.noise / UM:.1f}"


def _doubt(best: FileNoise, worst: FileNoise, by_itself: float) -> str:
    """What is asked of a file that gets no noise of its own."""
    return (
        f"{_noise_words(best, worst)}, and {by_itself / UM:.0f} by itself: is it of another arm, state or setup, or "
        "did something move? both weigh alike; a column sigma_um in both files says how well each instrument is known"
    )


def _best_of(candidates: Sequence[FittedCandidate], data: Measurements) -> int:
    """Which candidate to go by; raises InputError where it leaves orientations that are not the arm's."""
    best = richest_of_the_best([c.cross_validation for c in candidates])
    check_fitted_turns(data, candidates[best].fit)
    return best


def _of_one_warmth(facts: ArmFacts) -> ArmFacts:
    """Of an arm whose file has no heat model: one node, whose rise moves no length."""
    return replace(facts, nodes=(PLAIN_WARMTH,), growth=(np.zeros((6, 1)), np.zeros((6, 1))))


def _with_measured_widths(
    sources: list[SymbolicSource], data: Measurements
) -> tuple[list[SymbolicSource], LostMotion | None]:
    """The sources with what reversal runs say of lost motion, and that; as they are where there is no run."""
    lost_motion = fit_lost_motion(data, reversal_widths([s.source for s in sources]))
    return (sources if lost_motion is None else with_lost_motion(sources, lost_motion)), lost_motion


def _left(
    data: Measurements, selected: FittedCandidate, limits: FitLimits, chosen: Sequence[SymbolicSource]
) -> Iterator[Finding]:
    """What the selected model leaves at places that it has not seen."""
    distance, originals = selected.cross_validation.distance, [source.original for source in chosen]
    return left_findings(data, distance, selected.fit.outlier, limits.repeatability, originals)


def _with_needed_warmth(
    model: ArmModel, data: Measurements, selected: FittedCandidate, *, temperatures: bool
) -> tuple[Measurements, FittedCandidate, list[Finding]]:
    """Measurements of one setup taken as such, the model with the warmth that they need, and what is said of both."""
    data, shared = with_shared_setups(data, selected.fit)
    fitted, held = with_needed_warmth(model, data, selected.fit, temperatures=temperatures, anew=bool(shared))
    validated = cross_validate(model, data, fitted)
    fitted = with_uncertain_scales(model, data, fitted)
    return data, FittedCandidate(selected.candidate, fitted, validated), [*shared, *held]


def _fitted_of_known_sides(
    model: ArmModel, data: Measurements, lost_motion: LostMotion | None, progress: Progress
) -> tuple[Measurements, list[FittedCandidate], list[Finding]]:
    """All models, fitted without rows that are far off by play from an unknown side, the rows left, and a finding."""
    data = data if lost_motion is None else with_runs_as_poses(data, lost_motion)
    candidates = _fitted_candidates(model, data, progress)
    best = candidates[_best_of(candidates, data)].fit
    distance = np.linalg.norm(best.residual, axis=1)
    left_out = explained_by_play(data, best.outlier, distance, reach_of_play(model, data, best.p, best.frames))
    if not left_out.any():
        return data, candidates, []
    finding = unknown_sides_finding(data, np.flatnonzero(left_out), distance)
    data = data.subset(~left_out)
    return data, _fitted_candidates(model, data, progress), [finding]


def _fitted_candidates(model: ArmModel, data: Measurements, progress: Progress) -> list[FittedCandidate]:
    """All models that there are parameters for, from the plainest."""
    models, candidates = candidate_models(model.groups()[0]), list[FittedCandidate]()
    for i, candidate in enumerate(models):
        progress(RunStage(stages.FIT, candidate.name), i / len(models))
        fitted = fit(model, data, active_in_groups(model, candidate.groups))
        candidates.append(FittedCandidate(candidate, fitted, cross_validate(model, data, fitted)))
    return candidates


def _millimetres(names: Sequence[str], place: Array) -> dict[str, list[float]]:
    """Places (n, 3) [m] by their names, as the robot file has them."""
    return {name: _as_written(row / MM) for name, row in zip(names, place, strict=True)}


def _as_written(values: Array) -> list[float]:
    """Numbers as the robot file has them."""
    return [nine_digits(v) for v in values.tolist()]


def is_fitted(source: SymbolicSource, chosen: FittedCandidate) -> bool:
    """Whether a model has any of a source's parameters."""
    return any(parameter.group in chosen.candidate.groups for parameter in source.parameters)


def _unwritten_warmth(nodes: int) -> list[Finding]:
    """What a user must know of a warm-up whose temperatures nobody measured."""
    mend = "--temperatures" if nodes else "a [thermal] table with nodes, and their log with --temperatures"
    message = f"the warm-up was fitted along without temperatures, and nothing of its warmth is written; give {mend}"
    return [Finding.of(Code.WARM_UP, message)]


def fitted_sources(
    known: Sequence[UncertainSource],
    symbolic: Sequence[SymbolicSource],
    model: ArmModel,
    fitted: Fit,
    *,
    temperatures: bool = True,
) -> tuple[UncertainSource, ...]:
    """The sources with fitted values and sigmas; those that were not fitted stay as they are.

    Thermal terms that were offered and not needed are left out; without temperatures none is known.
    """
    of_file = {k.source.NAME: k for k in known}
    fit_of = dict(zip(model.parameters, zip(fitted.p, fitted.sigma, fitted.active, strict=True), strict=True))
    sources: list[UncertainSource] = []
    for source in symbolic:
        old = of_file.get(source.original.NAME)
        free = [(t, *fit_of[t]) for t in source.parameters if fit_of[t][2] and (temperatures or not t.thermal)]
        if not free:
            if old is not None:
                sources.append(old)
            continue
        values = {f: v.copy() for f, v in source.values.items()}
        for parameter in source.parameters:
            if not fit_of[parameter][2]:  # at zero in the fit, whatever the file said
                values[parameter.field][parameter.index] = 0.0
        sigmas: dict[str, Array] = {}
        for parameter, value, sigma, _ in free:
            values[parameter.field][parameter.index] = value
            sigmas.setdefault(parameter.field, np.zeros(values[parameter.field].shape))[parameter.index] = sigma
        provenance = f"identified from {len(fitted.outlier)} measured places"
        identified = replace(source.original, **values)  # type: ignore[type-var]
        prior = dict(source.prior)
        if isinstance(identified, Extensible):
            terms = np.zeros(len(next(iter(sigmas.values()))), dtype=bool)
            terms[: len(next(iter(old.prior.values()))) if old is not None else 0] = True
            terms[[parameter.index[0] for parameter, *_ in free]] = True
            identified = identified.only(terms)
            prior, sigmas = ({field: v[terms] for field, v in rows.items()} for rows in (prior, sigmas))
        sources.append(UncertainSource(identified, prior, sigmas, provenance))
    names = {source.original.NAME for source in symbolic}
    return (*sources, *(k for k in known if k.source.NAME not in names))
