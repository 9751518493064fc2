r"""Identification: check the measurements, fit the candidate models, select one by cross-validation, judge it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from compgen.core.arrays import Array, BoolArray
from compgen.core.findings import Finding, Level, Progress
from compgen.core.rotations import rotation_vector
from compgen.core.units import DEG, MM, UM
from compgen.error_model.direction_memory import reversal_widths
from compgen.error_model.source import ArmFacts, Extensible
from compgen.error_model.uncertainty import UncertainSource
from compgen.identification.cross_validation import CrossValidation, cross_validate, improvement_interval
from compgen.identification.fit import Fit, fit
from compgen.identification.identifiability import Identifiability, assess_identifiability
from compgen.identification.measurements import Measurements
from compgen.identification.model import ArmModel, SymbolicSource, WarmUpState, active_in_groups, build_model
from compgen.identification.parameters import CandidateModel, candidate_models, symbolic_sources, warm_up_states
from compgen.identification.plausibility import check_plausible, check_row_count
from compgen.identification.pose_files import STILL
from compgen.identification.reversals import (
    fit_lost_motion,
    lost_motion_findings,
    with_directions,
    with_lost_motion,
    without_run_interiors,
)
from compgen.identification.thermal_terms import needed_terms
from compgen.robot.robot import Robot

ILL = 1e4  # condition of the frames' columns beyond which poses cannot tell instrument and reflector apart
BEYOND = 3.0  # sigmas of its prior, beyond which no thermal parameter is believed
HELD = 8  # at most so many are held
NARROW = 30 * DEG  # a joint that moves less leaves much of its gear unmeasured


@dataclass(frozen=True, eq=False, slots=True)
class FittedCandidate:
    """A candidate model fitted to the measurements, and how well it predicts."""

    candidate: CandidateModel
    fit: Fit
    cross_validation: CrossValidation


@dataclass(frozen=True, eq=False, slots=True)
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
    box: Array  # (6, 2) [rad] theta that the poses cover

    @property
    def selected(self) -> FittedCandidate:
        """The model that predicts best."""
        return self.candidates[self.best]

    def record(self) -> dict[str, Any]:
        """The robot file's table ``identified``: frames, noise and held-out error."""
        frames, validation = self.selected.fit.frames, self.selected.cross_validation
        i = int(np.argmin(self.data.aligned))  # the first instrument whose frame is its own
        numbers = {k: [float(f"{v:.9g}") for v in row] for k, row in (
            ("held_out_um", [validation.mean / UM, *(x / UM for x in validation.interval())]),
            ("instrument_mm", (frames.origin[i] / MM).tolist()),
            ("instrument_deg", (rotation_vector(frames.rotation[i]) / DEG).tolist()),
        )}  # fmt: skip
        name = self.data.named_instrument(i)
        return {
            "model": self.selected.candidate.name,
            "noise_um": float(f"{self.selected.fit.noise / UM:.9g}"),
            **({"instrument": name} if name else {}),
            **numbers,
            "reflector_mm": {
                name: [float(f"{v:.9g}") for v in place / MM]
                for name, place in zip(self.data.reflectors, frames.reflector)
            },
        }

    @property
    def refused(self) -> bool:
        """Whether the verdict is no."""
        return any(f.level is Level.REFUSED for f in self.findings)


def identify(
    robot: Robot,
    known: Sequence[UncertainSource],
    data: Measurements,
    nodes: int,
    temperatures: bool,
    progress: Progress,
    facts: ArmFacts | None = None,
) -> Identification:
    """Fit the error sources of a robot to measurements.

    Args:
        robot: The nominal arm.
        known: Its sources as the robot file has them: facts, priors, and values of what is not fitted.
        data: All measurements.
        nodes: How many nodes the heat model has.
        temperatures: Whether the rises in ``data`` were measured; otherwise a warm-up's are unknown states.
        progress: Called with a stage and a share.
        facts: What else the robot file says of the arm: what it carries, its nodes, its growth.

    Raises:
        InputError: Too few numbers, or measurements that cannot be of this arm.
    """
    progress("model", 0.0)
    check_row_count(data)
    moved = np.asarray(np.ptp(data.theta, axis=0) > STILL)
    warm = bool((data.warm > 0).any())
    states = warm_up_states(known, nodes) if warm and not temperatures else ()
    offered = nodes_to_offer(facts, states, data.modelled) if warm and facts is not None else ()
    sources = symbolic_sources(robot, known, moved, warm, temperatures, facts, offered)
    lost_motion = fit_lost_motion(data, reversal_widths([s.source for s in sources]))
    if lost_motion is not None:
        sources = with_lost_motion(sources, lost_motion)
        data = without_run_interiors(with_directions(data, lost_motion.widths))
    model = build_model(robot, sources, nodes, states, data.modelled)
    check_plausible(robot, model, data)
    names, _ = model.groups()
    models = candidate_models(names)
    candidates: list[FittedCandidate] = []
    for i, candidate in enumerate(models):
        progress(f"fit {candidate.name}", i / len(models))
        fitted = fit(model, data, active_in_groups(model, candidate.groups))
        candidates.append(FittedCandidate(candidate, fitted, cross_validate(model, data, fitted)))
    held_out_errors = [s.cross_validation.mean for s in candidates]
    best = int(np.nanargmin(held_out_errors))
    progress("warmth", 0.9)
    candidates[best], held = _with_needed_warmth(model, data, candidates[best])
    progress("judge", 0.95)
    identifiability = assess_identifiability(model, data, candidates[best].fit)
    findings = [*judge(robot, model, data, candidates[0], candidates[best], identifiability, moved), *held]
    findings += lost_motion_findings(robot, lost_motion, [s for s in sources if is_fitted(s, candidates[best])])
    identified = fitted_sources(known, sources, model, candidates[best].fit, temperatures)
    box = np.column_stack([data.theta.min(axis=0), data.theta.max(axis=0)])
    return Identification(
        robot, model, data, tuple(candidates), best, identifiability, tuple(findings), identified, box
    )


def is_fitted(source: SymbolicSource, chosen: FittedCandidate) -> bool:
    """Whether a model has any of a source's parameters."""
    return any(parameter.group in chosen.candidate.groups for parameter in source.parameters)


def nodes_to_offer(facts: ArmFacts, states: Sequence[WarmUpState], modelled: Sequence[int]) -> tuple[str, ...]:
    """Nodes that anything may follow: those with a sensor; one for all where there are no temperatures."""
    if states:
        return (facts.nodes[states[0].node],)
    return tuple(name for k, name in enumerate(facts.nodes) if k not in modelled)


def _with_needed_warmth(
    model: ArmModel, data: Measurements, full: FittedCandidate
) -> tuple[FittedCandidate, list[Finding]]:
    """A candidate without the thermal terms that the data does not need, and without those beyond any plausible value.

    A parameter beyond three of its prior's sigmas stands for something that no source models: it is held at nominal.
    """
    findings: list[Finding] = []
    if not (full.fit.active & model.thermal).any():
        return full, findings
    active = needed_terms(model, data, full.fit)
    fitted = full.fit
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
                "held",
                f"{parameter.name}: the warm-up asks for {fitted.p[k] / parameter.unit:.3g}, {ratio[k]:.1f} sigmas of "
                f"its prior ({parameter.prior / parameter.unit:.3g}): something else warms; it is held at nominal",
            )
        )
        active = active.copy()
        active[k] = False
    return FittedCandidate(full.candidate, fitted, cross_validate(model, data, fitted)), findings


def judge(
    robot: Robot,
    model: ArmModel,
    data: Measurements,
    nominal: FittedCandidate,
    selected: FittedCandidate,
    identifiability: Identifiability,
    moved: BoolArray,
) -> list[Finding]:
    """The reasons of the verdict: the selected model against the nominal arm, joints, outliers, weak parameters."""
    findings: list[Finding] = []
    if identifiability.frames_condition > ILL:
        findings.append(
            Finding(
                Level.REFUSED, "frames",
                "not identifiable: the poses hardly turn the tool, so the places of instrument and reflector cannot be "
                "told apart; measure poses with other orientations (J4, J5, J6 by 40 deg or more), or a "
                "second reflector",
            )
        )  # fmt: skip
    gain = improvement_interval(selected.cross_validation, nominal.cross_validation)
    if selected is nominal or gain[0] <= 0:
        findings.append(
            Finding(
                Level.REFUSED, "no_gain",
                f"on held-out poses no model beats the nominal arm ({nominal.cross_validation.mean / UM:.1f} um "
                f"with frames fitted; best gain {gain[0] / UM:.1f} to {gain[1] / UM:.1f} um at 95 %); "
                f"{_poses_to_add(robot, data, moved)}",
            )
        )  # fmt: skip
    span = np.ptp(data.theta, axis=0)
    findings += [
        Finding(Level.WARNING, "still", f"joint {k + 1} never moves: its zero, gears and backlash stay at nominal; "
                f"measure poses that move J{k + 1}")
        for k in np.flatnonzero(~moved).tolist()
    ]  # fmt: skip
    findings += [
        Finding(Level.WARNING, "narrow", f"joint {k + 1} moves over {span[k] / DEG:.1f} deg only: its gears are "
                "known there and nowhere else; the robot file says so (sources.box)")
        for k in np.flatnonzero(moved & (span < NARROW)).tolist()
    ]  # fmt: skip
    outliers = np.flatnonzero(selected.fit.outlier).tolist()
    for n in outliers[:20]:
        distance = np.linalg.norm(selected.fit.residual[n]) / UM
        usual = selected.fit.noise * np.sqrt(3) / UM
        findings.append(
            Finding(Level.WARNING, "outlier", f"{data.label[n]}: set aside: {distance:.0f} um from what the other rows "
                    f"say, where {usual:.0f} um is usual")
        )  # fmt: skip
    if len(outliers) > 20:
        findings.append(Finding(Level.WARNING, "outlier", f"{len(outliers) - 20} more rows were set aside"))
    weak = identifiability.held_by_prior
    if weak:
        names = ", ".join(model.parameters[k].name for k in weak[:6])
        more = f" and {len(weak) - 6} more" if len(weak) > 6 else ""
        findings.append(
            Finding(Level.NOTE, "held", f"the data says little of {names}{more}: their priors hold them near nominal")
        )
    return findings


def _poses_to_add(robot: Robot, data: Measurements, moved: BoolArray) -> str:
    """The mend: which poses would help most."""
    span = np.ptp(data.theta, axis=0)
    share = span / (robot.upper - robot.lower)
    k = int(np.argmin(np.where(moved, share, 0.0)))
    poses = len(data.theta)
    if poses < 20:
        return f"{poses} poses are few: measure 20 or more, as 'cgen plan-poses' says"
    return f"measure poses that move J{k + 1} further than {span[k] / DEG:.0f} deg, as 'cgen plan-poses' says"


def fitted_sources(
    known: Sequence[UncertainSource],
    symbolic: Sequence[SymbolicSource],
    model: ArmModel,
    fitted: Fit,
    temperatures: bool = True,
) -> tuple[UncertainSource, ...]:
    """The sources with fitted values and sigmas; those that were not fitted stay as they are.

    Thermal terms that were offered and not needed are left out; without temperatures none is known.
    """
    of_file = {k.source.NAME: k for k in known}
    fit_of = dict(zip(model.parameters, zip(fitted.p, fitted.sigma, fitted.active)))
    sources: list[UncertainSource] = []
    for source in symbolic:
        old = of_file.get(source.original.NAME)
        free = [(t, *fit_of[t]) for t in source.parameters if fit_of[t][2] and (temperatures or not t.thermal)]
        if not free:
            if old is not None:
                sources.append(old)
            continue
        values = {f: v.copy() for f, v in source.values.items()}
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
