"""The verdict on an identification, with its reasons: what it gains, what it leaves out, what it cannot tell."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.units import DEG, MM, UM
from compgen.error_model.source import LoadDependent, Source
from compgen.identification.cross_validation import CrossValidation, improvement_interval
from compgen.identification.evidence import USUAL_NOISE
from compgen.identification.fit import Fit
from compgen.identification.identifiability import Identifiability
from compgen.identification.measured_poses import STILL
from compgen.identification.measured_turns import wild_turns
from compgen.identification.measurements import DISTANCE, PLACE, TOUCH, Measurements
from compgen.identification.model import ArmModel
from compgen.identification.parameters import CandidateModel
from compgen.robot.robot import Robot

ILL = 1e4  # condition of the frames' columns beyond which poses can hardly tell instrument and reflector apart
FOURFOLD = 4.0  # a held-out error so many times smaller than the nominal arm's
STAYS = 10 * MM  # frames of the nominal and the identified arm: no further apart
NARROW = 30 * DEG  # a joint that moves less leaves much of its gear unmeasured
WIDE = np.pi  # [rad] no pose helps because a joint moves further yet
MOST = 0.05  # share of the rows that may be set aside: of all, of a joint's, of a series'
FEWEST = 3  # rows that may always be wild
FAR = 2e-3  # of the arm's reach: what no calibration leaves
NAMED = 20  # rows set aside that are named one by one
MISSED = 0.5 * MM  # of touches from one side: what no arm leaves
FOREIGN = 5 * MM  # [m] from the file's length: that of another robot
ELSEWHERE = 4.0  # times better known where it was measured: the rest was not
BEYOND = 1.5  # times what instrument and repeatability explain
TURNED = 3  # stations of a line in which joints may be on the way through their play
OVERRUN = (
    "{} are stations of a line just behind where it turned back or began: play is not run through there; drive some mm "
    "beyond each end before you measure, or leave them out"
)
MOVED = "did a reflector or the instrument move, is a joint's sign or coupling not the robot file's?"


@dataclass(frozen=True, eq=False, slots=True)
class FittedCandidate:
    """A candidate model fitted to the measurements, and how well it predicts."""

    candidate: CandidateModel
    fit: Fit
    cross_validation: CrossValidation


def verdict_findings(
    robot: Robot,
    model: ArmModel,
    data: Measurements,
    nominal: FittedCandidate,
    selected: FittedCandidate,
    identifiability: Identifiability,
    moved: BoolArray,
) -> list[Finding]:
    """The reasons of the verdict: the selected model against the nominal arm, joints, outliers, weak parameters."""
    fitted = selected.fit
    usual = fitted.noise_of_row * data.sigma * np.sqrt(data.numbers)
    distance = np.linalg.norm(fitted.residual, axis=1)
    return [
        *_frames_told_apart(data, nominal, selected, identifiability),
        *refuse_set_aside(data, fitted),
        *_refuse_unexplained(robot, selected),
        *_refuse_far_touches(data, selected),
        *refuse_foreign_lengths(robot, model, fitted),
        *_refuse_no_gain(robot, data, nominal, selected, moved),
        *_unmoved_joints(data, moved),
        *set_aside_findings(data.label, np.flatnonzero(fitted.outlier), distance, usual),
        *_overrun_missing(data, fitted),
        *wild_turns(data, fitted),
        *_held_by_prior(model, identifiability.held_by_prior),
    ]


def set_aside_findings(label: Sequence[str], rows: IntArray, distance: Array, usual: Array) -> list[Finding]:
    """A finding for each row that was set aside, those beyond NAMED together.

    Args:
        label: File and line of each of N rows.
        rows: Numbers of those set aside, the first to be named first.
        distance: Of all rows from what the others say, (N,) [m].
        usual: Of a row such as each, (N,) [m].
    """
    messages = [
        f"{label[n]}: set aside: {distance[n] / UM:.0f} um from what the other rows say, where {usual[n] / UM:.0f} um "
        "is usual"
        for n in rows[:NAMED].tolist()
    ]
    messages += [f"{len(rows) - NAMED} more rows were set aside"] if len(rows) > NAMED else []
    return [Finding.of(Code.OUTLIER, message) for message in messages]


def left_findings(
    data: Measurements,
    distance: Array,
    outlier: BoolArray,
    repeatability: float | None,
    sources: Iterable[Source],
    otherwise: str = "",
) -> Iterator[Finding]:
    """What is said where rows that no fit saw are further off than an instrument and repeatability explain.

    Args:
        data: Measurements.
        distance: Of their rows from what is predicted without them, of a row of one number sqrt(3) times, (N,) [m];
            NaN: not predicted.
        outlier: Which of them are wild, (N,).
        repeatability: Of the arm, of a coordinate [m]; None: not measured.
        sources: Those that were fitted.
        otherwise: What else may be the cause where it is no artefact.
    """
    has_masses = any(isinstance(source, LoadDependent) and source.loads.have_weight for source in sources)
    sag = "" if has_masses else "; sag was not fitted: masses are missing, give [sources.loads]"
    for kind, words in ((PLACE, "places"), (TOUCH, "touches"), (DISTANCE, "distances")):
        rows = (data.kind == kind) & ~outlier & np.isfinite(distance)
        if not rows.any():
            continue
        weight = data.sigma[rows] ** -2 / (data.sigma[rows] ** -2.0).sum()
        stated = np.nan if data.stated_sigma is None else data.stated_sigma[rows]
        left = np.sqrt(weight @ distance[rows] ** 2 / 3)
        explained = np.hypot(np.sqrt((weight * np.fmax(USUAL_NOISE[kind], stated) ** 2).sum()), repeatability or 0.0)
        if left > BEYOND * explained:
            cause = "the artefact or its probe is not as its file says, or " if kind == TOUCH else otherwise
            yield Finding.of(
                Code.LEFT,
                f"unseen {words} are {left / UM:.0f} um off (rms of a coordinate), where instrument and repeatability "
                f"explain {explained / UM:.0f}: {cause}the arm does what the model has not{sag}",
            )


def known_here_only(here: float, anywhere: float) -> list[Finding]:
    """What is said where an arm is known at joint angles as measured, and hardly at others.

    Args:
        here: Sigma of a coordinate there, its frame taught [m].
        anywhere: Likewise with any joint angles.
    """
    if anywhere <= ELSEWHERE * here:
        return []
    message = (
        f"joint angles beyond those measured are known to +- {2 * anywhere / UM:.0f} um only (95 %, where the frame is "
        f"taught), those measured to +- {2 * here / UM:.0f}: measure poses over all the robot's use, as "
        "'cgen plan-poses' says, or stay inside"
    )
    return [Finding.of(Code.NARROW, message)]


def _frames_told_apart(
    data: Measurements, nominal: FittedCandidate, selected: FittedCandidate, identifiability: Identifiability
) -> Iterator[Finding]:
    """What is said where poses hardly turn the tool; refused where instrument and reflectors do not stay."""
    if identifiability.frames_condition <= ILL:
        return
    stays = _frames_stay(nominal, selected)
    yield Finding(
        Level.WARNING if stays else Level.REFUSED,
        Code.FRAMES,
        f"{'weak' if stays else 'not identifiable'}: the poses hardly turn the tool, so the places of "
        f"{'instrument' if (data.kind == PLACE).all() else 'spheres or sockets'} and of what the flange carries "
        "can hardly be told apart; measure poses with other orientations (J4, J5, J6 by 40 deg or more), or a "
        "second reflector",
    )


def _refuse_unexplained(robot: Robot, selected: FittedCandidate) -> Iterator[Finding]:
    """Refusal of a fit that leaves more than any calibration does."""
    left, reach = selected.cross_validation.robust_mean, float(np.abs(robot.a).sum() + np.abs(robot.d).sum())
    if left <= FAR * reach:
        return
    yield Finding.of(
        Code.UNEXPLAINED,
        f"at poses it had not seen the best model is {left / MM:.1f} mm off, more than an arm's zeros, lengths "
        f"and gears explain ({FAR * reach / MM:.1f} mm for this reach); are the pendant table (coupled joints, "
        "signs), the DH lengths and the order of the columns this robot's?",
    )


def _refuse_far_touches(data: Measurements, selected: FittedCandidate) -> Iterator[Finding]:
    """Refusal of touches from one side that leave more than any arm does: the radius is as good as an error of it."""
    distance = selected.cross_validation.distance
    rows = (data.kind == TOUCH) & (data.numbers == 1) & np.isfinite(distance) & ~selected.fit.outlier
    stated = 0.0 if data.stated_sigma is None else float(np.nan_to_num(data.stated_sigma[rows]).max(initial=0.0))
    off = float(np.sqrt((distance[rows] ** 2).mean() / 3)) if rows.any() else 0.0
    if off > max(MISSED, 3 * stated):
        yield Finding.of(
            Code.UNEXPLAINED,
            f"touches from one side are {off / UM:.0f} um off at poses not seen (rms), more than any arm leaves "
            f"({MISSED / UM:.0f}): does diameter_mm of [probe] or of a sphere say the radius, or less than the ball, "
            "and is value_mm in mm, along nx ny nz?",
        )


def _refuse_no_gain(
    robot: Robot, data: Measurements, nominal: FittedCandidate, selected: FittedCandidate, moved: BoolArray
) -> Iterator[Finding]:
    """Refusal of a fit that predicts no better than the nominal arm."""
    gain = improvement_interval(selected.cross_validation, nominal.cross_validation)
    if selected is nominal or not gain[0] > 0:
        yield Finding.of(
            Code.NO_GAIN,
            f"on held-out poses no model beats the nominal arm ({nominal.cross_validation.mean / UM:.1f} um "
            f"with frames fitted; best gain {gain[0] / UM:.1f} to {gain[1] / UM:.1f} um at 95 %); "
            f"{poses_to_add(robot, data, moved)}",
        )


def _unmoved_joints(data: Measurements, moved: BoolArray) -> Iterator[Finding]:
    """Joints that never move, or little."""
    span = np.ptp(data.theta, axis=0)
    for k in np.flatnonzero(~moved).tolist():
        yield Finding.of(
            Code.STILL,
            f"joint {k + 1} never moves: its zero, gears and backlash stay at nominal; measure poses that "
            f"move J{k + 1}",
        )
    for k in np.flatnonzero(moved & (span < NARROW)).tolist():
        yield Finding.of(
            Code.NARROW,
            f"joint {k + 1} moves over {span[k] / DEG:.1f} deg only: its gears are known there and nowhere else; the "
            "robot file says so (sources.box)",
        )


def _held_by_prior(model: ArmModel, weak: Sequence[int]) -> Iterator[Finding]:
    """Parameters that the data says little of."""
    if weak:
        names = ", ".join(model.parameters[k].name for k in weak[:6])
        more = f" and {len(weak) - 6} more" if len(weak) > 6 else ""
        yield Finding(
            Level.NOTE, Code.HELD, f"the data says little of {names}{more}: their priors hold them near nominal"
        )


def poses_to_add(robot: Robot, data: Measurements, moved: BoolArray) -> str:
    """The mend: which poses would help most."""
    span = np.ptp(data.theta, axis=0)
    share = span / (robot.upper - robot.lower)
    k = int(np.argmin(np.where(moved, share, 0.0)))
    poses = len(data.theta)
    if poses < 20:
        return f"{poses} poses are few: measure 20 or more, as 'cgen plan-poses' says"
    if span[k] > WIDE:
        return f"{poses} poses move every joint far: measure more of them, as 'cgen plan-poses' says"
    return f"measure poses that move J{k + 1} further than {span[k] / DEG:.0f} deg, as 'cgen plan-poses' says"


def refuse_foreign_lengths(robot: Robot, model: ArmModel, fitted: Fit) -> Iterator[Finding]:
    """Refusal of a fit that needs a length of another robot: rows exchanged, a longer version of the arm."""
    lengths = {"d": robot.d, "a": robot.a}
    far = [
        (
            abs(value),
            f"{t.field}{t.index[0] + 1} fits {(lengths[t.field][t.index[0]] + value) / MM:.1f} mm, where the "
            f"robot file has {lengths[t.field][t.index[0]] / MM:.1f}",
        )
        for t, value in zip(model.parameters, fitted.p.tolist(), strict=True)
        if t.source == "link_offsets" and t.field in lengths and abs(value) > FOREIGN
    ]
    if far:
        words = "; ".join(sentence for _, sentence in sorted(far, reverse=True)[:2])
        yield Finding.of(Code.LENGTHS, f"{words}: is this the arm's file? mend its DH lengths")


def refuse_set_aside(data: Measurements, fitted: Fit) -> list[Finding]:
    """Refusals of a fit that explains the rest by leaving out too much: rows of all, of one joint, of one series.

    The rows of a joint are those where it stands elsewhere than usual; a series is poses in which it alone moves.
    """
    usual = np.median(data.theta, axis=0)
    alone, elsewhere = _moved_alone(data.theta), np.abs(data.theta - usual) > DEG
    limits = [
        *((f"the series in which J{k + 1} alone moves", (alone == k)[data.pose]) for k in range(6)),
        ("all series in which one joint alone moves", (alone >= 0)[data.pose]),
        ("all rows", np.ones(len(data.pose), dtype=bool)),
        *((f"the rows with J{k + 1} off its usual angle", elsewhere[data.pose, k]) for k in range(6)),
    ]
    for name, rows in limits:
        count = int((fitted.outlier & rows).sum())
        if count > FEWEST and count > MOST * rows.sum():
            turned = int((fitted.outlier & rows & turned_back(data)).sum())
            message = (
                f"{count} of {int(rows.sum())} ({100 * count / rows.sum():.0f} %) of {name} do not fit the others, "
                f"and {100 * MOST:.0f} % may be wild: {OVERRUN.format(turned) if 2 * turned > count else MOVED}"
            )
            return [Finding.of(Code.SET_ASIDE, message)]
    return []


def turned_back(data: Measurements) -> BoolArray:
    """Rows of axis tests within TURNED of where the carriage turned back, or the line began, (N,)."""
    line = np.append(data.aligned, False)[data.instrument] * (data.instrument + 1)
    motion = data.direction[data.pose]
    begins = (np.diff(line, prepend=0) != 0) | (np.vstack([motion[:1], motion[1:] * motion[:-1]]).sum(axis=1) < 0)
    since = np.arange(len(line)) - np.maximum.accumulate(np.where(begins, np.arange(len(line)), 0))
    return np.asarray((line > 0) & (since < TURNED))


def _overrun_missing(data: Measurements, fitted: Fit) -> Iterator[Finding]:
    """What is said of rows set aside where an axis test turned back."""
    count = int((fitted.outlier & turned_back(data)).sum())
    if count and 2 * count > fitted.outlier.sum():
        yield Finding.of(Code.OUTLIER, f"of the rows set aside, {OVERRUN.format(count)}")


def _moved_alone(theta: Array) -> Array:
    """Which joint alone moved to each pose, (M,); -1 where several did, or none."""
    moved = np.abs(np.diff(theta, axis=0)) > STILL
    alone = np.where(moved.sum(axis=1) == 1, moved.argmax(axis=1), -1)
    return np.append(-1, alone)


def _frames_stay(nominal: "FittedCandidate", selected: "FittedCandidate") -> bool:
    """Whether a model predicts four times better and leaves instrument and reflectors where they were."""
    gain = nominal.cross_validation.robust_mean / selected.cross_validation.robust_mean
    before, after = nominal.fit.frames, selected.fit.frames
    if before.origin.shape != after.origin.shape:
        return False
    pairs = ((getattr(before, part), getattr(after, part)) for part in ("origin", "reflector", "place"))
    moved = max(float(np.abs(a - b).max(initial=0.0)) for a, b in pairs)
    return bool(gain >= FOURFOLD and moved <= STAYS)
