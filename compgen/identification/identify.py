r"""Identification on one page: check, fit the ladder of models, choose by held-out error, judge, hand out sources."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from compgen.core.arrays import Array, BoolArray
from compgen.core.findings import Finding, Level, Progress
from compgen.core.rotations import rotation_vector
from compgen.core.units import DEG, MM, UM
from compgen.error_model.uncertainty import UncertainSource
from compgen.identification.cross_validation import HeldOut, better, held_out
from compgen.identification.fit import Fit, fit
from compgen.identification.identifiability import Identifiability, identifiable
from compgen.identification.measurements import Measurements
from compgen.identification.model import Model, Part, build_model, chosen
from compgen.identification.parameters import Candidate, ladder, parts_of, warm_states
from compgen.identification.plausibility import check_enough, check_plausible
from compgen.identification.pose_files import STILL
from compgen.robot.robot import Robot

ILL = 1e4  # condition of the frames' columns beyond which poses cannot tell instrument and reflector apart
NARROW = 30 * DEG  # a joint that moves less leaves much of its gear unseen


@dataclass(frozen=True, eq=False, slots=True)
class Step:
    """One model of the ladder, and how well it predicts."""

    candidate: Candidate
    fit: Fit
    held_out: HeldOut


@dataclass(frozen=True, eq=False, slots=True)
class Identified:
    """Everything that came out."""

    robot: Robot
    model: Model
    data: Measurements
    steps: tuple[Step, ...]  # the ladder, plainest first; the first knows frames only
    best: int
    sight: Identifiability
    findings: tuple[Finding, ...]
    known: tuple[UncertainSource, ...]  # sources with fitted values and sigmas
    box: Array  # (6, 2) [rad] theta that the poses cover

    @property
    def chosen(self) -> Step:
        """The model that predicts best."""
        return self.steps[self.best]

    def record(self) -> dict[str, Any]:
        """The robot file's own table of what was found beside the sources."""
        frames, held = self.chosen.fit.frames, self.chosen.held_out
        i = int(np.argmin(self.data.aligned))  # the first instrument whose frame is its own
        numbers = {k: [float(f"{v:.9g}") for v in row] for k, row in (
            ("held_out_um", [held.mean / UM, *(x / UM for x in held.interval())]),
            ("instrument_mm", (frames.origin[i] / MM).tolist()),
            ("instrument_deg", (rotation_vector(frames.rotation[i]) / DEG).tolist()),
        )}  # fmt: skip
        return {
            "model": self.chosen.candidate.name,
            "noise_um": float(f"{self.chosen.fit.noise / UM:.9g}"),
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
) -> Identified:
    """Fit the error sources of a robot to measurements.

    Args:
        robot: The nominal arm.
        known: Its sources as the robot file has them: facts, priors, and values of what is not fitted.
        data: All measurements.
        nodes: How many nodes the heat model has.
        temperatures: Whether the rises in ``data`` were measured; otherwise a warm-up's are unknown states.
        progress: Called with a stage and a share.

    Raises:
        InputError: Too few numbers, or measurements that cannot be of this arm.
    """
    progress("model", 0.0)
    check_enough(data)
    moved = np.asarray(np.ptp(data.theta, axis=0) > STILL)
    warm = bool((data.warm > 0).any())
    states = warm_states(known, nodes) if warm and not temperatures else ()
    parts = parts_of(robot, known, moved, warm, temperatures)
    model = build_model(robot, parts, nodes, states)
    check_plausible(robot, model, data)
    names, _ = model.groups()
    levels = ladder(names)
    steps: list[Step] = []
    for i, level in enumerate(levels):
        progress(f"fit {level.name}", i / len(levels))
        found = fit(model, data, chosen(model, level.groups))
        steps.append(Step(level, found, held_out(model, data, found)))
    errors = [s.held_out.mean for s in steps]
    best = int(np.nanargmin(errors))
    progress("judge", 0.95)
    sight = identifiable(model, data, steps[best].fit)
    told = judge(robot, model, data, steps, best, sight, moved)
    fitted = fitted_sources(known, parts, model, steps[best].fit)
    box = np.column_stack([data.theta.min(axis=0), data.theta.max(axis=0)])
    return Identified(robot, model, data, tuple(steps), best, sight, tuple(told), fitted, box)


def judge(
    robot: Robot, model: Model, data: Measurements, steps: Sequence[Step], best: int, sight: Identifiability,
    moved: BoolArray,
) -> list[Finding]:  # fmt: skip
    """The verdict's reasons."""
    nominal, chosen_ = steps[0], steps[best]
    found: list[Finding] = []
    if sight.frames_condition > ILL:
        found.append(
            Finding(
                Level.REFUSED, "frames",
                "not identifiable: the poses hardly turn the tool, so the places of instrument and reflector cannot be "
                "told apart; measure poses with other orientations (J4, J5, J6 by 40 deg or more), or a "
                "second reflector",
            )
        )  # fmt: skip
    gain = better(chosen_.held_out, nominal.held_out)
    if best == 0 or gain[0] <= 0:
        found.append(
            Finding(
                Level.REFUSED, "no_gain",
                f"on held-out poses no model beats the nominal arm ({nominal.held_out.mean / UM:.1f} um "
                f"with frames fitted"
                f"; best gain {gain[0] / UM:.1f} to {gain[1] / UM:.1f} um at 95 %); {_missing(robot, data, moved)}",
            )
        )  # fmt: skip
    span = np.ptp(data.theta, axis=0)
    found += [
        Finding(Level.WARNING, "still", f"joint {k + 1} never moves: its zero, gears and backlash stay at nominal; "
                f"measure poses that move J{k + 1}")
        for k in np.flatnonzero(~moved).tolist()
    ]  # fmt: skip
    found += [
        Finding(Level.WARNING, "narrow", f"joint {k + 1} moves over {span[k] / DEG:.1f} deg only: its gears are "
        f"known there "
                "and nowhere else; the robot file says so (sources.box)")
        for k in np.flatnonzero(moved & (span < NARROW)).tolist()
    ]  # fmt: skip
    wild = np.flatnonzero(chosen_.fit.wild).tolist()
    for n in wild[:20]:
        miss = np.linalg.norm(chosen_.fit.residual[n]) / UM
        usual = chosen_.fit.noise * np.sqrt(3) / UM
        found.append(
            Finding(Level.WARNING, "outlier", f"{data.label[n]}: set aside: {miss:.0f} um from what the other rows "
                    f"say, where {usual:.0f} um is usual")
        )  # fmt: skip
    if len(wild) > 20:
        found.append(Finding(Level.WARNING, "outlier", f"{len(wild) - 20} more rows were set aside"))
    if sight.held:
        some = ", ".join(model.terms[k].name for k in sight.held[:6])
        more = f" and {len(sight.held) - 6} more" if len(sight.held) > 6 else ""
        found.append(
            Finding(Level.NOTE, "held", f"the data says little of {some}{more}: their priors hold them near nominal")
        )
    return found


def _missing(robot: Robot, data: Measurements, moved: BoolArray) -> str:
    """What measurement would help most."""
    span = np.ptp(data.theta, axis=0)
    share = span / (robot.upper - robot.lower)
    k = int(np.argmin(np.where(moved, share, 0.0)))
    poses = len(data.theta)
    if poses < 20:
        return f"{poses} poses are few: measure 20 or more, as 'cgen plan-poses' says"
    return f"measure poses that move J{k + 1} further than {span[k] / DEG:.0f} deg, as 'cgen plan-poses' says"


def fitted_sources(
    known: Sequence[UncertainSource], parts: Sequence[Part], model: Model, found: Fit
) -> tuple[UncertainSource, ...]:
    """The sources with what was found in them; those that were not fitted stay as they are."""
    have = {k.source.NAME: k for k in known}
    value = dict(zip(model.terms, zip(found.p, found.sigma, found.active)))
    result: list[UncertainSource] = []
    for part in parts:
        old = have.get(part.before.NAME)
        own = [(t, *value[t]) for t in part.terms if value[t][2]]
        if not own:
            if old is not None:
                result.append(old)
            continue
        values = {f: v.copy() for f, v in part.numbers.items()}
        sigmas: dict[str, Array] = {}
        for term, number, sigma, _ in own:
            values[term.field][term.index] = number
            sigmas.setdefault(term.field, np.zeros(values[term.field].shape))[term.index] = sigma
        prior = dict(old.prior) if old is not None else {}
        told = f"identified from {len(found.wild)} measured places"
        result.append(UncertainSource(replace(part.before, **values), prior, sigmas, told))  # type: ignore[type-var]
    names = {part.before.NAME for part in parts}
    return (*result, *(k for k in known if k.source.NAME not in names))
