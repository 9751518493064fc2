"""The audit itself: an output folder against what the audit computes.

Tolerances, each about the smallest that a right program keeps:

- a waypoint is written with 1e-6 mm, so it is on the closed form to 2 nm;
- CONFIG, contact and frames are exact; the tool's axes are written with 0.001 deg: 0.01 mdeg where both sides read the
  same text, 2 mdeg against the target;
- pendant angles in the table are those before that rounding: 0.005 deg, near the wrist's singularity;
- times are written with 1 us: 1 ms, and 1e-6 of the whole;
- written speeds may be 0.5 % over the feed, as docs/conventions.md says; slow ones of a user's file by a speed's
  finest step, where that is more;
- rises: exponents and time constants stand in the robot file with three digits: what that makes of them, and 0.002 K.
  Along the path they are the plan's, which takes ``planned_s`` and not ``duration_s``: three times what that makes of
  them more, as it is not slower everywhere alike;
- errors: a kelvin on every node lengthens the arm by 23 um: 25 um/K of the rises' tolerance, and 0.05 um for rounded
  joints; for the largest before, driven from a text, 0.87 um of rounding to 0.001 mm in three axes;
- a band is written with 0.01 um, and as exact as rises and slopes: 0.1 um, and so the budget and what is not known;
- 99 % and rms are of two or four samples a line here and of one a millimetre there, two at least: 5 % of the largest
  more.
"""

from pathlib import Path

import naive_arm as arm
import numpy as np
from naive_errors import sides

from audit import band, clock, heat, listing, poses, study
from audit.arm import Spots, of_file, of_study
from audit.checks import below, count, equal
from audit.closed_form import ClosedForm
from audit.own_file import OwnFile
from audit.scope import OWN_FILES, NotJudgedError, duties, load
from audit.taught import of_frame
from audit.waypoints import read_waypoints

CURVED_MM = 1e-5  # sag of a line on a curve
TURNED_MDEG, JOINT_DEG = 2.0, 0.005
TIME_S, TIME, FEED, AT_FEED = 1e-3, 1e-6, 0.005, 0.002
SAYABLE_MM_S = listing.STEPS_MM_S[-1]  # the finest step of a speed
UNEVEN = 3.0
SHORT_MM = 2.0  # of lines with two samples
TURNING = [0, 3, 5]  # joints that CONFIG has turns of
DECIMALS = 3  # of a frame on the controller
RISE_K, UM_K, ERROR_UM, ROUNDING_UM, AXIS_MDEG, SAMPLES = 0.002, 25.0, 0.05, 0.87, 0.01, 0.05
BLEND_UM = 0.3  # that an error is more between the two samples of a line on which a joint turns back
LEADING_MDEG = 1.0  # where a lead-in is taken as the tool really stands, which is off by what is left


def audit(folder, path_file=None, robot_file=None):
    """Name of the program, and the checks of its output folder.

    Args:
        folder: Of ``cgen generate``.
        path_file: None: the shipped one of this name.
        robot_file: Of an identified arm; None: the study's.

    Raises:
        NotJudgedError: What the audit has no oracle for.
        UnreadableError: The program or the table is not what the format says.
        OffCurveError: The waypoints are not a walk along the path.
        UnreachableError: The arm does not come to a position.
    """
    report, path, path_folder = load(folder, path_file, is_robot_named=robot_file is not None)
    hashed = report["provenance"]["robot_file"]["sha256"]
    own_arm = of_study() if robot_file is None else of_file(Path(robot_file), hashed)
    program = listing.read(folder, report["program"]["file"])
    table = read_waypoints(folder, len(program.numbers))
    tool = poses.of_table(path.get("tool", {}))
    held = {key: round(n, DECIMALS) for key, n in path.get("frame", {}).items() if key.endswith(("_mm", "_deg"))}
    register = poses.of_table(held)
    commanded = poses.in_world(register, program.numbers[:, :3], arm.rotation(*np.radians(program.numbers[:, 3:]).T))
    pendant = arm.pendant_angles(*poses.flange(commanded, tool))
    # a whole turn of a joint is not in a pose: CONFIG at the first position says it for all
    pendant[:, TURNING] += 2 * np.pi * (program.turns[0] - arm.posture(pendant)[1][0])
    length = np.linalg.norm(np.diff(program.numbers[:, :3], axis=0), axis=1)
    passed = clock.passages(length, program.speed_mm_s, program.stop, arm.dh_angles(pendant))
    law, timing, before_program = own_arm.law, report["timing"], duties(path)
    rise = law.along(law.after(before_program), passed.time, passed.driven)
    driven = along(own_arm, pendant, rise, tool)

    own_file = path["path"]["pattern"] in OWN_FILES
    leads_in = own_arm.width is not None and path["process"].get("lead_in", True)
    if own_file and leads_in:
        raise NotJudgedError("path.file with a lead-in: not judged; say process.lead_in = false")
    form: OwnFile | ClosedForm = (
        OwnFile(path, path_folder, table["position"])
        if own_file
        else ClosedForm(path, table["position"], driven.pose()[1][0] if leads_in else None)
    )
    target, touching = form.at_waypoints(), form.touching()
    checks = [*form.path_checks(table["contact"]), *posture_checks(path, program, table, pendant)]
    checks += clock_checks(path, report, program, table, length, form, passed)

    other = [r.along(r.after(before_program), passed.time, passed.driven) for r in heat.rounded(law)]
    digits = RISE_K + (0.0 if robot_file else sum(np.abs(r - rise).max() for r in other))
    slower = timing["planned_s"] / timing["duration_s"]
    planned = UNEVEN * np.abs(law.along(rise[0], passed.time * slower, passed.driven / slower) - rise).max()
    for moment, row, allowed in (("start", rise[0], digits), ("end", rise[-1], digits + planned)):
        written = [report["thermal"][f"{moment}_K"].get(n, np.nan) for n in study.NODES]
        checks.append(equal(f"rises at the {moment}, K", row, written, allowed))
    checks.append(equal("rises along the path, K", rise, table["rise"], digits + planned))

    halfway, unsure, allowed = form.halfway(), form.unsure_um(), ERROR_UM + UM_K * digits
    own = _joints(target, tool)
    before = along(own_arm, own, rise, tool).pose()[0] - target[0]
    checks.append(equal("errors before, um", before * 1e3, table["before"], allowed + UM_K * planned))
    sag = halfway[0] - (target[0][:-1] + target[0][1:]) / 2
    beside = balance(sag, program.stop)
    chord = (before[:-1] + before[1:] + beside[:-1] + beside[1:]) / 2 - sag
    largest = max(np.linalg.norm(e, axis=1).max() for e in (before + beside, chord)) * 1e3
    allowed_before = allowed + ROUNDING_UM + unsure.max()
    checks.append(equal("largest before, um", largest, report["before"]["total"]["max_um"], allowed_before))

    between = _joints(poses.halfway(commanded), tool, (pendant[:-1] + pendant[1:]) / 2)
    halves = Spots(own_arm, between, (driven.side[:-1] + driven.side[1:]) / 2, (rise[:-1] + rise[1:]) / 2, tool)
    actual = [driven.pose(), halves.pose()]
    checks.append(equal("errors after, um", (actual[0][0] - target[0]) * 1e3, table["after"], allowed))
    may = (allowed + BLEND_UM * (own_arm.width is not None), LEADING_MDEG if leads_in else AXIS_MDEG)
    checks += residual_checks(path, report, actual, (target, halfway), touching, unsure, may)
    on_part = target[0][table["contact"]] if table["contact"].any() else target[0]
    middle = (on_part.min(axis=0) + on_part.max(axis=0)) / 2
    taught = of_frame(path.get("frame", {}).get("taught", {}), own_arm, tool, hashed, middle)
    window = report["thermal"]["start_window_s"]
    unrounded = along(own_arm, np.radians(table["joints"]), rise, tool)  # digits shift a reversal: 0.2 um of a band
    case = band.Case(own_arm, unrounded, taught, before_program, passed, window)
    checks += band.band_checks(report, table, case, np.linalg.norm(target[0][:, :2], axis=1).max() / 1e3)
    checks += form.flown_checks(actual[0][0], actual[1][0], report["after"]["total"]["max_um"] + allowed)
    return report["name"], checks


def posture_checks(path, program, table, pendant):
    """Whether frame, tool, CONFIG and joints are what the positions ask for, inside the arm's limits."""
    moved = any(path.get("tool", {}).get(f"{key}", 0) for key in ("x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg"))
    frame = path["frame"].get("number", 1) if "frame" in path else 0
    numbers = frame, path.get("tool", {}).get("number", int(moved))
    letters, turns = arm.posture(pendant)
    another = (letters != program.letters).any(axis=1) | (turns != program.turns).any(axis=1)
    theta = np.degrees(arm.dh_angles(pendant))
    beyond = np.maximum(np.array(study.LOWER_DEG) - theta, theta - np.array(study.UPPER_DEG)).max()
    return [
        count("frame or tool of another number", numbers != (program.uframe, program.utool)),
        count("positions with another CONFIG", another.sum()),
        equal("pendant angles, deg", np.degrees(pendant), table["joints"], JOINT_DEG),
        below("joint beyond its limit, deg", beyond, 0.0, 0.0),
    ]


def clock_checks(path, report, program, table, length, form, passed):
    """Whether it takes the time and keeps the feed that the output says."""
    process, allowed, touching = path["process"]["feed_mm_s"], TIME_S + TIME * passed.time[-1], form.touching()
    exactly = any(abs(process / step - round(process / step)) < 1e-6 for step in listing.STEPS_MM_S)
    feed = form.feed(process)
    unsaid = SAYABLE_MM_S * (form.has_own_feeds & (feed < SAYABLE_MM_S / FEED))
    # a feed of the user's file counts as kept, or not, where a program cannot say it
    below_by = (FEED, 1e-9) if form.has_own_feeds else (1e-9,) if exactly else (FEED,)
    share = [passed.steady[program.speed_mm_s >= feed * (1 - b)].sum() / length.sum() for b in below_by]
    return [
        equal("times of waypoints, s", passed.time, table["time"], allowed),
        equal("duration, s", passed.time[-1], report["timing"]["duration_s"], allowed),
        below("fastest on the part over the feed", ((program.speed_mm_s - unsaid) / feed)[touching].max(), 1.0, FEED),
        equal("share of the length at feed", share[0], report["timing"]["at_feed"], AT_FEED + share[0] - share[-1]),
    ]


def residual_checks(path, report, actual, wanted, touching, unsure_um, may):
    """Whether what stays is what the report says, and inside the path file's bounds where the verdict says so.

    Between waypoints the path may be ``unsure_um`` (N - 1,) from where it is wanted; errors may be apart by
    ``may`` [um], [mdeg].
    """
    allowed_um, allowed_mdeg = may
    errors = [a[0] - w[0] for a, w in zip(actual, wanted, strict=True)]
    sizes = (
        ("total", "um", "max_um", [np.linalg.norm(e, axis=1) * 1e3 for e in errors]),
        (
            "normal",
            "um",
            "normal_um",
            [np.abs((e * w[1][:, :, 2]).sum(axis=1)) * 1e3 for e, w in zip(errors, wanted, strict=True)],
        ),
        (
            "axis_angle",
            "mdeg",
            "axis_mdeg",
            [np.degrees(poses.angle(a[1], w[1], 2)) * 1e3 for a, w in zip(actual, wanted, strict=True)],
        ),
    )
    checks = []
    for component, unit, bound, (there, between) in sizes:
        allowed, reported = allowed_mdeg if unit == "mdeg" else allowed_um, report["after"][component][f"max_{unit}"]
        unsure, largest = 0.0 if unit == "mdeg" else unsure_um, max(there.max(), between.max())
        least, most = (max(there.max(), (between + u).max()) for u in (-unsure, unsure))
        allowed_here = allowed + max(largest - least, most - largest)
        checks.append(equal(f"largest {component} after, {unit}", largest, reported, allowed_here))
        limit = path.get("bounds", {}).get(bound)
        if limit is not None and report["verdict"] == "inside":
            on_part = max(there[:-1][touching].max(), (between - unsure)[touching].max())
            checks.append(below(f"bounds.{bound} on the part", on_part, limit, allowed))
    reported, allowed = report["after"]["total"], allowed_um + SAMPLES * checks[0].audit
    least, own, most = (_over_length([w[0] for w in wanted], errors, u) for u in (-unsure_um, 0 * unsure_um, unsure_um))
    over = [allowed + max(value - low, high - value) for low, value, high in zip(least, own, most, strict=True)]
    checks.append(equal("99 % of the length after, um", own[0], reported["p99_um"], over[0]))
    checks.append(equal("rms after, um", own[1], reported["rms_um"], over[1]))
    if not path.get("tool", {}).get("axisymmetric", False):
        turned = np.degrees(poses.angle(actual[0][1], wanted[0][1], 0)).max() * 1e3
        checks.append(below("tool turned about its axis, mdeg", turned, 0.0, TURNED_MDEG))
    return checks


def balance(sag, stop):
    """Where lines end beside the path, (N, 3) [mm]: by half the larger sag next to each, but not at curves' corners."""
    none = np.zeros((1, 3))
    pair = np.stack([np.concatenate([none, sag]), np.concatenate([sag, none])])
    size = np.linalg.norm(pair, axis=2)
    corner = stop & (size.min(axis=0) > CURVED_MM) & ((pair[0] * pair[1]).sum(axis=1) < 0.9 * size[0] * size[1])
    return np.where(corner[:, None], 0.0, np.where((size[0] > size[1])[:, None], *pair) / 2)


def _over_length(places, errors, more_um):
    """What 99 % of the path's length stay at or below, and the rms, of errors at waypoints and halfway between.

    Between waypoints they are more by ``more_um`` (N - 1,). A line leaves a curve by a square law: halfway to its
    middle the error is of three points' parabola. Lines under 2 mm have but their ends and middle, as there.
    """
    (there, between), (begin, middle) = errors, places
    ends = there[:-1], there[1:]
    quarter = [(3 * ends[k] + 6 * between - ends[1 - k]) / 8 for k in (0, 1)]
    value, place = np.empty(4 * len(between) + 1), np.empty((4 * len(between) + 1, 3))
    at = [(begin[:-1] + middle) / 2, (middle + begin[1:]) / 2]
    for k, (e, p) in enumerate(((there, begin), (quarter[0], at[0]), (between, middle), (quarter[1], at[1]))):
        value[k::4], place[k::4] = np.linalg.norm(e, axis=1) * 1e3, p
    for k in (1, 2, 3):
        value[k::4] = np.maximum(value[k::4] + more_um, 0.0)
    sampled = np.ones(len(value), dtype=bool)
    sampled[1::4] = sampled[3::4] = np.linalg.norm(np.diff(begin, axis=0), axis=1) > SHORT_MM
    value, place = value[sampled], place[sampled]
    gap = np.linalg.norm(np.diff(place, axis=0), axis=1) / 2
    weight = np.concatenate([gap, [0.0]]) + np.concatenate([[0.0], gap])
    order = np.argsort(value)
    below = np.cumsum(weight[order])
    return value[order][np.searchsorted(below, 0.99 * below[-1])], np.sqrt((value**2 * weight).sum() / weight.sum())


def _joints(pose, tool, start=None):
    """Pendant angles at which the nominal arm has its tool at poses one after the other."""
    position, rotation = poses.flange(pose, tool)
    return arm.pendant_angles(position, rotation, start)


def along(own_arm, pendant, rise, tool):
    """Where an arm stands along a program, its joints coming from the waypoints before."""
    theta, width = arm.dh_angles(pendant), own_arm.width
    if width is None:
        return Spots(own_arm, pendant, np.zeros_like(theta), rise, tool)
    own, off = own_arm.sources["hysteresis"], np.full(6, study.WIDTH_SPREAD)
    for name, sigma in zip(own_arm.names, own_arm.sigma if own_arm.names else (), strict=True):
        if name[1] == "width_mdeg":
            off[name[2][0]] = sigma / own["width_mdeg"][name[2][0]]
    more, less, side = (sides(theta, width * np.exp(k * off), own.get("law", "dahl")) for k in (1, -1, 0))
    return Spots(own_arm, pendant, side, rise, tool, (more - less) / (2 * off))
