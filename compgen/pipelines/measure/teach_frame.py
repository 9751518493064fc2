"""Teach a part's frame by the identified, warm arm: touches and temperatures to a frame, its uncertainty, its file."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from compgen.core.arrays import Array, nine_digits
from compgen.core.commands import Command
from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.pose import Pose
from compgen.core.recorded.table import read_findings
from compgen.core.rotations import rotation_vector, to_wpr
from compgen.core.units import DEG, MDEG, MM, UM
from compgen.error_model.direction_memory import DirectionState
from compgen.error_model.parameter_slopes import build_slopes, parameters_of
from compgen.error_model.posterior import ParameterPosterior
from compgen.error_model.rigid_share import rigid_share
from compgen.identification.measurements import Measurements
from compgen.identification.model import ArmModel, build_model, fixed_source
from compgen.identification.part_frame_fit import PROBE, FrameFit, fit_frame, measured_lengths, touches_of_part
from compgen.identification.touch_rows import sigma_of
from compgen.identification.touches import Artefact, Touches, probed_motion, read_artefact, read_touches
from compgen.identification.warm_up import read_log, with_temperatures
from compgen.job.part_frame import WARM
from compgen.job.tables import fit_limits_of
from compgen.pipelines.files.robot_file import Arm, posterior_beside
from compgen.thermal.filled_rises import HEIGHT, LAG
from compgen.thermal.log_doubt import refuse_doubtful
from compgen.thermal.tables.schema import AmbientTable
from compgen.thermal.temperature_log import COLD_START, Reference

BEYOND = 4.0  # times what touches and arm explain
PROBE_AWAY = 10  # standard deviations from where the file has it: no probe that was mounted anew
MISSING = 0.05  # of the thermal error, that the model of an arm leaves out whose warm-up nobody measured


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class TaughtFrame:
    """A frame, how it was taught, and what the user must know."""

    number: int
    fit: FrameFit
    through: str  # "model" or "pendant"
    robot_file: str  # name and hash
    rise: Mapping[str, float]  # largest of each node [K]
    touches: Touches
    for_band: dict[str, Any]  # what its file says for the band
    pendant: FrameFit | None  # what the pendant would have taught, by the nominal arm; None: it is not known
    findings: tuple[Finding, ...]


def teach_frame(  # noqa: PLR0913 - what one command names, each of another kind
    arm: Arm,
    touches_file: str,
    artefact_file: str,
    number: int,
    log: str | None,
    reference: Reference,
    uframes: Mapping[int, Pose],
    *,
    nominal: bool,
) -> TaughtFrame:
    """The frame of a part from touches.

    Args:
        arm: The robot file's.
        touches_file: CSV of touches.
        artefact_file: TOML of what was touched.
        number: Of the user frame.
        log: Temperatures on the touches' clock; None: the arm was cold.
        reference: What rises in it count from.
        uframes: Of the controller, where touches are commanded in one.
        nominal: As the pendant would teach it: without the model.

    Raises:
        InputError: Files that are wrong, or touches from which no frame follows.
    """
    artefact = read_artefact(artefact_file)
    touches = read_touches(touches_file, arm.robot, artefact, uframes)
    motion = probed_motion(arm.robot, [k.source for k in arm.known], touches)
    data = touches_of_part(artefact, touches, motion, len(arm.nodes))
    if log is not None and not touches.timed:
        raise InputError(f"{touches_file}: column time_s: missing; the log's temperatures need the touches' times")
    data, findings = (data, []) if log is None else _at_temperatures(arm, data, log, reference)
    model = build_model(arm.robot, [] if nominal else [fixed_source(k.source) for k in arm.known], len(arm.nodes))
    if nominal:
        fitted = fit_frame(artefact, touches, model, data)
    else:
        fitted, of_posterior = _through_model(arm, artefact, touches, model, data)
        findings += of_posterior
    rise = dict(zip(arm.nodes, np.abs(data.rise).max(axis=0, initial=0.0).tolist(), strict=True))
    findings += _findings(arm, touches, fitted, log, nominal=nominal, hottest=max(rise.values(), default=0.0))
    findings += _artefact_findings(artefact, touches, fitted, Pose(*model.pose(data, np.zeros(0))))
    return TaughtFrame(
        number=number,
        fit=fitted,
        through="pendant" if nominal else "model",
        robot_file=f"{arm.robot.name} {sha256(Path(arm.source).read_bytes()).hexdigest()[:16]}",
        rise=rise,
        touches=touches,
        for_band={} if nominal else _for_the_band(arm, artefact, touches, data, fitted),
        pendant=None if nominal else _by_pendant(arm, artefact, touches, data),
        findings=(*findings, *read_findings(touches.notes)),
    )


def _at_temperatures(
    arm: Arm, data: Measurements, log: str, reference: Reference
) -> tuple[Measurements, list[Finding]]:
    """Touches with the rises of a log, and what the user must know of it; a doubtful one is refused."""
    readings, heat = read_log(log, arm.heat, arm.sensors)
    warmed = with_temperatures(data, readings, heat, reference)
    refuse_doubtful(readings, heat, arm.warmth, reference, COLD_START, AmbientTable().reference_degC)
    return warmed


def _through_model(
    arm: Arm, artefact: Artefact, touches: Touches, model: ArmModel, data: Measurements
) -> tuple[FrameFit, list[Finding]]:
    """The frame by the model of the warm arm, with what is open of it, and what is wrong with its posterior's file."""
    fitted = fit_frame(artefact, touches, model, data)
    posterior, findings = posterior_beside(arm.identified, Path(arm.source), arm.known, arm.heat)
    if data.rise.any():
        kept, along = data.subset(~fitted.outlier), touches.normal[~fitted.outlier]
        open_of_warmth = _open_of_warmth(arm, posterior, model, kept, along, fitted)
        fitted = replace(fitted, covariance=fitted.covariance + open_of_warmth)
    return fitted, findings


def _by_pendant(arm: Arm, artefact: Artefact, touches: Touches, data: Measurements) -> FrameFit | None:
    """What the pendant would have taught; None where the nominal arm misses the spheres by too much to say."""
    try:
        return fit_frame(artefact, touches, build_model(arm.robot, [], len(arm.nodes)), data)
    except InputError:
        return None


def _open_of_warmth(
    arm: Arm, posterior: ParameterPosterior | None, model: ArmModel, data: Measurements, along: Array, fit: FrameFit
) -> Array:
    r"""What warmth leaves open of turn, place and probe, (9, 9): no arm repeats it that works colder.

    What moves the tool at the touches by c moves frame and probe by u = G c (``rigid_share``), the place as that probe
    finds it. That is

        (A(rise) - A(0)) p    of parameters that identification left open, p ~ N(0, C)
        B r                   of rises that are off by r (``_open_rises``)
        missing |w|           along any direction, w what all warmth did to the place
    """
    parameters, probe = parameters_of([k.source for k in arm.known]), Pose(fit.probe, np.eye(3))
    at = {(parameters.sources[e.source].NAME, e.field, e.index): n for n, e in enumerate(parameters.entries)}
    named = [] if posterior is None else [(p.table, p.field, p.index) for p in posterior.parameters]
    rows = [i for i, name in enumerate(named) if name in at]  # the others are of the law, or widths
    C = np.zeros((0, 0)) if posterior is None else posterior.covariance[np.ix_(rows, rows)]
    slopes = build_slopes(arm.robot, parameters, tuple(at[named[i]] for i in rows), len(arm.nodes), probe)
    motion, still = DirectionState(data.direction, np.zeros((len(data.theta), 3))), replace(data, rise=0 * data.rise)
    (A, B, _), (cold, *_) = (slopes(d.theta, d.rise, motion) for d in (data, still))
    tool, cold_tool = (Pose(*model.pose(d, np.zeros(0))) @ probe for d in (data, still))
    at_row = tool[data.pose]  # touches that are set aside leave their poses
    share = rigid_share(at_row.position, at_row.rotation, along, fit.noise * data.sigma, PROBE)
    warmth = (tool.position - cold_tool.position)[:, :, None]
    moves = np.concatenate([A - cold, B @ _open_rises(data, arm.warmth.sensors), warmth], axis=2)
    u = share.motion(moves[data.pose])
    moved = np.concatenate([u[3:6], u[:3] - fit.flange @ u[6:], u[6:]])
    of_parameters, of_rises, w = np.split(moved, [len(C), -1], axis=1)
    missing = fit_limits_of(arm.identified).missing
    left_out = (MISSING if missing is None else missing) * np.linalg.norm(w[3:6])
    alike = np.diag(np.repeat([0.0, left_out, 0.0], 3)) ** 2
    return np.asarray(of_parameters @ C @ of_parameters.T + of_rises @ of_rises.T + alike)


def _open_rises(data: Measurements, sensors: float) -> Array:
    """By how much rises may be off, (N, K, S) [K]: what all sensors of a warm arm share, then nodes without a sensor.

    These by their height and by their lag.
    """
    shared = np.full((*data.rise.shape, 1), sensors * (data.rise.max(initial=0.0) > WARM))
    unread = np.eye(data.rise.shape[1])[:, list(data.modelled)]
    return np.concatenate(
        [shared, HEIGHT * data.rise[:, :, None] * unread, LAG * data.lag[:, :, None] * unread], axis=2
    )


def _findings(
    arm: Arm, touches: Touches, fitted: FrameFit, log: str | None, *, nominal: bool, hottest: float
) -> Iterator[Finding]:
    """What the user must know of the teaching."""
    for n in np.flatnonzero(fitted.outlier).tolist():
        off = f"{abs(fitted.residual[n]) / UM:.0f} um from where the other touches have it"
        yield Finding.of(Code.OUTLIER, f"{touches.label[n]}: set aside: {off}")
    if nominal and hottest > WARM:
        yield Finding.of(
            Code.FRAME_HOT,
            f"taught as the pendant does, by an arm {hottest:.1f} K warm: the heat is in the frame and would be "
            "corrected twice; leave --nominal out",
        )
    if log is None:
        yield Finding.of(
            Code.FRAME_COLD, "taken as taught by a cold arm; if it was warm, give its log with --temperatures"
        )
    if nominal:
        return
    if not any(k.sigma for k in arm.known):
        message = f"{arm.source} was never identified: what the arm errs by where it touched is in the frame"
        yield Finding.of(Code.FRAME_MODEL, message)
        return
    limits = fit_limits_of(arm.identified)
    explained = float(np.linalg.norm([np.median(sigma_of(touches)), limits.noise, limits.repeatability or 0.0]))
    if fitted.noise > BEYOND * explained:
        yield Finding.of(
            Code.FRAME_LEFT,
            f"the touches do not fit each other by {fitted.noise / UM:.0f} um (rms of a coordinate), where they and "
            f"the arm explain {explained / UM:.0f}: check the probe's diameter, the spheres' places and the joints; "
            "the frame may be off by more than it says",
        )


def _artefact_findings(artefact: Artefact, touches: Touches, fitted: FrameFit, flange: Pose) -> Iterator[Finding]:
    """Certified lengths that the arm has otherwise, and a probe that is not where the file has it."""
    away = float(np.linalg.norm(fitted.probe - artefact.probe))
    if away > PROBE_AWAY * PROBE:
        x, y, z = (fitted.probe / MM).tolist()
        yield Finding.of(
            Code.FRAME_LEFT,
            f"the touches have the probe at {x:.1f}, {y:.1f}, {z:.1f} mm in the flange, {away / MM:.1f} mm from where "
            f"{artefact.source} has it: commanded with another tool? mend [probe] or the tool; the frame may be off by "
            "more than it says",
        )
    for n, longer in measured_lengths(artefact, touches, fitted, flange):
        a, b = (artefact.names[s] for s in artefact.between[n].tolist())
        yield Finding.of(
            Code.FRAME_LENGTH,
            f"the arm has '{a}' and '{b}' {abs(longer) / UM:.0f} um {'farther apart' if longer > 0 else 'nearer'} than "
            f"their certified {artefact.length[n] / MM:.3f} mm: is the artefact's temperature right? cgen identify "
            "--touches fits the arm's lengths to it",
        )


def frame_record(taught: TaughtFrame, decimals: int) -> dict[str, Any]:
    """The frame as data: what to type in, the place in full, uncertainty, state, and model."""
    fit, touches = taught.fit, taught.touches
    numbers = _place(fit)
    pendant = None
    if taught.pendant is not None:
        there = taught.pendant.frame.act(fit.frame.inverse().act(fit.middle))  # its own middle is of other touches
        difference = there - fit.middle
        turn = rotation_vector((taught.pendant.frame.rotation @ fit.frame.rotation.T)[None])[0]
        pendant = {"place_um": _listed(difference / UM, 1), "turn_mdeg": _listed(turn / MDEG, 2)}
    sigma = fit.sigma
    return {
        "command": Command.TEACH_FRAME,
        "uframe": taught.number,
        "type_in": {key: f"{value:.{decimals}f}" for key, value in numbers.items()},
        "frame": {key: round(value, 9) for key, value in numbers.items()},
        "probe_mm": _listed(fit.probe / MM, 4),
        "probe_sigma_um": _listed(sigma[6:] / UM, 2),
        "sigma_um": _listed(sigma[3:6] / UM, 2),
        "sigma_mdeg": _listed(sigma[:3] / MDEG, 3),
        "middle_mm": _listed(fit.middle / MM, 3),
        "touches": len(touches.target),
        "touches_used": int((~fit.outlier).sum()),
        "noise_um": round(fit.noise / UM, 2),
        "through": taught.through,
        "robot_file": taught.robot_file,
        "rise_K": {name: round(value, 3) for name, value in taught.rise.items()},
        "pendant_would_differ": pendant,
        "set_aside": [touches.label[n] for n in np.flatnonzero(fit.outlier).tolist()],
        "findings": [f.record() for f in taught.findings],
    }


def frame_text(taught: TaughtFrame) -> str:
    """The frame's file, which a path file names in ``frame.file``."""
    sigma, probe = taught.fit.sigma, taught.fit.probe / MM
    rises = tomlkit.inline_table()
    rises.update({name: round(value, 3) for name, value in taught.rise.items()})
    file = tomlkit.document()
    file.add(tomlkit.comment('The frame of a part, as cgen teach-frame wrote it; in a path file: [frame] file = "..."'))
    file["frame"] = {
        "number": taught.number,
        **{key: nine_digits(value) for key, value in _place(taught.fit).items()},
        "taught": {
            "through": taught.through,
            "robot_file": taught.robot_file,
            "rise_K": rises,
            "sigma_um": _listed(sigma[3:6] / UM, 2),
            "sigma_mdeg": _listed(sigma[:3] / MDEG, 4),
            **taught.for_band,
        },
    }
    centre = {key: nine_digits(value) for key, value in zip(("x_mm", "y_mm", "z_mm"), probe, strict=True)}
    tool = tomlkit.item({**centre, "sigma_um": _listed(sigma[6:] / UM, 2)})
    file["tool"] = tool.comment("the probe's centre in the flange, as the touches say")
    return tomlkit.dumps(file)


def _for_the_band(arm: Arm, artefact: Artefact, touches: Touches, data: Measurements, fit: FrameFit) -> dict[str, Any]:
    r"""What tells a band what the frame took up: the probe, and the touches that count.

    What n touches of a sphere share, its place by sigma, counts as n sigma^2 in each: their mean errs by as much. They
    share the arm's fit noise tau [m] as well, a field that the band has already, less what the frame took
    up of it. No touch tells one from the other, so of what touches of a sphere were seen to share, c times their noise
    s^2 in all, only the rest is noise of theirs:

        s^2 + max((c - 1) s^2 - n tau^2, 0) + n sigma^2
    """
    pendant, counted = arm.robot.to_pendant(data.theta) / DEG, np.flatnonzero(~fit.outlier)
    together = np.bincount(touches.target[counted], minlength=len(artefact.sigma))[touches.target]
    own = (fit.noise * data.sigma) ** 2
    alike = np.maximum(own * (fit.shared - 1) - together * fit_limits_of(arm.identified).noise ** 2, 0.0)
    noise = np.sqrt(own + alike + together * artefact.sigma[touches.target] ** 2)
    return {
        "probe_mm": _listed(fit.probe / MM, 4),
        "touches": [
            {
                "joints_deg": _listed(pendant[n], 4),
                "noise_um": round(float(noise[n]) / UM, 2),
                **({"probing": _listed(touches.normal[n], 6)} if np.isfinite(touches.normal[n, 0]) else {}),
                **({"direction": _listed(data.direction[n], 3)} if data.direction[n].any() else {}),
            }
            for n in counted.tolist()
        ],
    }


def _place(fit: FrameFit) -> dict[str, float]:
    """The frame as the controller's six numbers."""
    w, p, r = (float(np.ravel(a)[0]) / DEG for a in to_wpr(fit.frame.rotation[None]))
    x, y, z = (fit.frame.position / MM).tolist()
    return {"x_mm": x, "y_mm": y, "z_mm": z, "w_deg": w, "p_deg": p, "r_deg": r}


def _listed(values: Array, digits: int) -> list[float]:
    return [round(float(v), digits) for v in values]
