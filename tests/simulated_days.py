"""Simulated days of a robot, for anchoring: breaks, doors, air, laws and sensors that err, and a probe that touches.

The truth is not drawn from what the job believes of itself: breaks are left out of what it is told, doors open, the
heat has other time constants and rises, links bend that the model has straight, geometry is off by what its sigmas
say, and sensors err each by itself. The arm that is touched and flown is the twin's.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from shipped import path_file

from compgen.core.pose import Pose
from compgen.core.units import DEG, HOUR, MINUTE, MM, UM
from compgen.error_model.model import build_error_model
from compgen.error_model.parameter_slopes import parameters_of
from compgen.error_model.sources.thermal_bend import ARCSEC
from compgen.identification.touches import read_artefact, read_touches
from compgen.job.anchored_start import cell_with_state
from compgen.pipelines.anchor import anchor
from compgen.pipelines.anchor.estimate import path_places
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.twin_of_job import faults_of
from compgen.robot.inverse_kinematics import Posture, solve_tool
from compgen.robot.kinematics import flange_pose
from compgen.thermal import Ambient, Duty, rise_history
from compgen.thermal.node_model import NodeModel
from compgen.verification.twin import Twin

SPHERES = {"a": (800, -700, 250), "b": (800, 640, 250), "c": (1700, -600, 250), "d": (1700, 540, 250)}
PROBE = Pose(np.array([0, 0, 0.15]), np.eye(3))
NOISE = 12 * UM
DOWN = np.diag([1.0, -1.0, -1.0])
AIR = 20.0  # degC at the reference
#: an identified robot: its geometry and expansion are known to what an identification leaves
IDENTIFIED = (
    "robot.thermal.uncertainty.cte_um_m_K=[11, 11.5]",
    "robot.thermal.uncertainty.growth_percent={}",
    "robot.sources.link_offsets.a_um=[0, 150, -80, 0, 0, 0]",
    "robot.sources.link_offsets.sigma.a_um=[0, 10, 10, 0, 0, 0]",
    "robot.sources.joint_zeros.offset_mdeg=[8, -12, 10, 5, 0, 0]",
    "robot.sources.joint_zeros.sigma.offset_mdeg=[0.3, 0.3, 0.3, 0, 0.5, 0]",
    "robot.sources.thermal_bend={link=['a2','d4'],plane=['arm','arm'],node=['link1','j3'],rate_arcsec_K=[0.4,0.2],"
    "sigma={rate_arcsec_K=[0.15,0.15]}}",
)
BEND = 0.15 * ARCSEC  # standard deviation of what each link bends by that the file does not say [rad/K]


@dataclass(frozen=True, eq=False)
class Day:
    """What a job is told, what is true, and what was measured."""

    job: object  # as the shop has it
    twin: Twin  # the true arm with its tool; ``rise`` and ``base`` are true as well
    rise: np.ndarray  # (K,) [K] when the program starts
    base: np.ndarray  # (6,) [m], [rad]
    touches: object
    artefact: object
    files: dict


def artefact_text(places, sigma_um=5.0, more=""):
    spheres = "".join(
        f'[[sphere]]\nname = "{n}"\nx_mm = {x:.4f}\ny_mm = {y:.4f}\nz_mm = {z:.4f}\n'
        f"diameter_mm = 30\nsigma_um = {sigma_um}\n"
        for n, (x, y, z) in places.items()
    )
    return f"[artefact]\ncertified = true\n{more}{spheres}[probe]\nz_mm = 150\ndiameter_mm = 6\n"


def drawn_day(
    seed, folder, count=8, log=None, base=None, knocked=None, path="spiral_1300", overrides=IDENTIFIED, geometry=0.0,
    taught=False, sided=False,
):  # fmt: skip
    """One day, its files in a folder.

    Args:
        seed: Of everything.
        folder: For artefact, touches and log.
        count: Touches.
        log: Whether the shop has a log; None: every second day.
        base: (6,) by which the base has moved.
        knocked: Name of a sphere and (3,) [m] by which it was.
        geometry: How many of the file's sigmas the cold arm is off by.
        sided: Whether each touch is from one side, else it locates the sphere's centre.
        taught: Whether the robot has taught the places itself, cold; else an instrument has measured them.
    """
    folder, rng = Path(folder), np.random.default_rng([seed, 17])
    planned_duties, true, air = _duties(rng)
    has_log = bool(seed % 2) if log is None else log
    before = ",".join(_table(d) for d in planned_duties)
    job = load_job(path_file(path), overrides=[*overrides, f"before=[{before}]"])
    heat = job.cell.heat
    assert isinstance(heat, NodeModel)
    K = len(heat.names)
    real = replace(
        heat,
        reference_rise=heat.reference_rise * (1 + 0.06 * rng.standard_normal(K)),
        tau=heat.tau * np.exp(0.1 * rng.standard_normal(K)),
    )
    end = sum(d.duration for d in true)
    when = end - np.arange(count)[::-1] * 60.0
    law = job.cell.warmth.law * rng.standard_normal(K)  # a rise that no law has
    grid = np.arange(0.0, end + 1, 60.0)
    course = rise_history(real, true, grid, air=air) + law * -np.expm1(-grid / 2 / HOUR)[:, None]
    at = lambda t: np.column_stack([np.interp(t, grid, c) for c in course.T])  # noqa: E731
    twin = _true_arm(job, rng, geometry)
    places = {n: np.array(p) * MM for n, p in SPHERES.items()}
    stand = {n: p + 5 * UM * rng.standard_normal(3) for n, p in places.items()}
    if knocked is not None:
        stand[knocked[0]] = stand[knocked[0]] + knocked[1]
    names = [list(SPHERES)[n % len(SPHERES)] for n in range(count)]
    shift = np.zeros(6) if base is None else base
    way = np.full((count, 3), np.nan)
    met = np.array([stand[n] for n in names])
    if sided:
        sides = np.array([[1, 0, 0], [0, 1, 0], [0, 0, -1], [-1, 0, 0], [0, -1, 0], [0.6, 0, -0.8], [0, 0.6, -0.8]])
        way = sides[(np.arange(count) * 3 + np.arange(count) // 4) % len(sides)]
        met = met - 18 * MM * way  # the ball's centre when it meets the sphere
    theta = _touch(job, replace(twin, tool=PROBE), met, at(when), shift, rng)
    text = artefact_text(SPHERES)
    if taught:
        first = _touch(job, replace(twin, tool=PROBE), np.array([*stand.values()]), np.zeros((4, K)), np.zeros(6), rng)
        told_at = (flange_pose(job.robot, first) @ PROBE).position / MM
        text = artefact_text(dict(zip(stand, told_at.tolist(), strict=True)), 0.0, "taught = {}\n").replace(
            "certified = true\n", ""
        )
    (folder / "artefact.toml").write_text(text)
    pendant = job.robot.to_pendant(theta) / DEG
    rows = ["time_s,target,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,sigma_um" + ",nx,ny,nz" * sided]
    for t, n, j, d in zip(when, names, pendant.tolist(), way.tolist(), strict=True):
        direction = f",{','.join(f'{v:g}' for v in d)}" if sided else ""
        rows.append(f"{t:.0f},{n},{','.join(f'{v:.6f}' for v in j)},{NOISE / UM:g}{direction}")
    (folder / "touches.csv").write_text("\n".join(rows) + "\n")
    if has_log:
        sensed = [n for n in heat.names if n != "face"]
        off = 0.5 * rng.standard_normal() + 0.25 * rng.standard_normal(len(sensed))
        read = AIR + course[:, [heat.names.index(n) for n in sensed]] + off + 0.1 * rng.standard_normal((len(grid), 4))
        table = [",".join(["time_s", "ambient_degC", *(f"{n}_degC" for n in sensed)])]
        table += [
            f"{t:.0f},{AIR + a + 0.1 * rng.standard_normal():.2f},{','.join(f'{v:.2f}' for v in row)}"
            for t, a, row in zip(grid, air.at(grid), read, strict=True)
        ]
        (folder / "log.csv").write_text("\n".join(table) + "\n")
        job = load_job(path_file(path), overrides=[*overrides, "before=[]", f"log.file='{folder / 'log.csv'}'"])
    artefact = read_artefact(str(folder / "artefact.toml"))
    touches = read_touches(str(folder / "touches.csv"), job.robot, artefact, {}, planes=True)
    files = {"artefact": folder / "artefact.toml", "touches": folder / "touches.csv", "log": folder / "log.csv"}
    base = np.zeros(6) if base is None else base
    return Day(job, twin, course[-1], base, touches, artefact, files if has_log else {**files, "log": None})


def left_on_path(day, cell):
    """Drift that a state leaves along the path, (M, 3) [m]: what the true arm has moved since it was cold, less what
    the cell says; and what is left in all."""
    job, path = day.job, path_places(day.job)
    cold = np.zeros((len(path.theta), len(day.rise)))
    moved = _moved_by(day.base, day.twin.actual_pose(path.theta, cold + day.rise, lambda s: None).position)
    still = day.twin.actual_pose(path.theta, cold, lambda s: None).position
    rise = np.asarray(cell.heat.outputs @ cell.heat.start)
    model = build_error_model(job.robot, cell.sources, len(rise), job.tool.pose)
    file = build_error_model(job.robot, job.cell.sources, len(rise), job.tool.pose)
    believed = model.actual_pose(path.theta, cold + rise).position
    return (moved - still) - (believed - file.actual_pose(path.theta, cold).position), moved - believed


def anchored(day, **changes):
    """The anchoring of a day."""
    return anchor(day.job, day.artefact, replace(day.touches, **changes), Pose(np.zeros(3), np.eye(3)))


def outcome(day, result=None):
    """Drift left on the path before and after, rms and 99th percentile, and in all [m]."""
    result = anchored(day) if result is None else result
    sizes = {}
    after = cell_with_state(day.job.cell, result.state, "state")
    for name, cell in (("before", result.forecast.cell), ("after", after)):
        drift, total = (np.linalg.norm(v, axis=1) for v in left_on_path(day, cell))
        sizes[name] = float(np.sqrt(np.mean(drift**2))), float(np.percentile(drift, 99))
        sizes[f"{name} total"] = float(np.sqrt(np.mean(total**2))), float(np.percentile(total, 99))
    return result, sizes


def share_of_shift(day, result):
    """How far the displacement of the part's middle by a base that moved is from the true one [m]."""
    base_shift = next((m.shift for m in result.moved if m.what == "the base"), np.zeros(3))
    middle = result.path.middle
    return float(np.linalg.norm(base_shift - (_moved_by(day.base, middle) - middle)))


def _duties(rng):
    """What the job is told, what the cell did, and the air: hours of motion with breaks, doors and a late start."""
    planned_duties, true = [], []
    feed, speed = 0.2, 1 + 0.01 * rng.standard_normal()
    left = rng.uniform(3, 7) * HOUR
    while left > 0:
        work, pause = rng.uniform(0.7, 1.6) * HOUR, rng.uniform(10, 40) * MINUTE
        both = [Duty("moving", feed, work), Duty("idle", 0.0, pause)]
        planned_duties += both
        true += [replace(both[0], feed=feed * speed), both[1]]
        left -= work + pause
    planned_duties.append(Duty("moving", feed, 40 * MINUTE))
    true.append(Duty("moving", feed * speed, 40 * MINUTE))
    if rng.random() < 0.5:  # a break that nobody has told of, and the work before it was as much shorter
        n = len(true) - 3
        pause = min(rng.uniform(10, 90) * MINUTE, true[n].duration * 0.9)
        true[n] = replace(true[n], duration=true[n].duration - pause)
        true[n + 1] = replace(true[n + 1], duration=true[n + 1].duration + pause)
    end = sum(d.duration for d in true)
    knots = np.linspace(0, end + HOUR, 200)
    air = 1.0 * rng.standard_normal() + 0.8 * np.cos(2 * np.pi * (knots - rng.uniform(0, 24) * HOUR) / (24 * HOUR))
    if rng.random() < 0.3:  # a door
        opened = end - rng.uniform(0.1, 1.5) * HOUR
        air = air - 2 * np.where(knots > opened, np.exp(-np.maximum(knots - opened - 10 * MINUTE, 0) / (0.5 * HOUR)), 0)
    return planned_duties, true, Ambient(knots, air)


def _table(duty):
    feed = f"feed_mm_s={duty.feed / MM:g}," if duty.state == "moving" else ""
    return f"{{state='{duty.state}',{feed}duration_h={duty.duration / HOUR!r}}}"


def _true_arm(job, rng, geometry):
    """The twin of a job whose sources are off by what their sigmas say, and whose links bend."""
    parameters = parameters_of(job.cell.sources)
    change = np.zeros(len(parameters.entries))
    for n, entry in enumerate(parameters.entries):
        source = parameters.sources[entry.source]
        known = next((k for k in job.cell.known if k.source is source), None)
        if source.NAME == "thermal_bend":
            change[n] = BEND * rng.standard_normal()
        elif known is not None and entry.field in known.sigma:
            change[n] = geometry * known.sigma[entry.field][entry.index] * rng.standard_normal()
        elif source.NAME == "thermal_growth":
            change[n] = 0.01 * rng.standard_normal()
    sources = parameters.moved(change)
    return Twin(
        robot=job.robot,
        heat=job.cell.heat,
        profiles=job.cell.profiles,
        tool=job.tool.pose,
        faults=faults_of(sources),
        confirmed=5,
    )


def _touch(job, arm, places, rises, base, rng):
    """Commanded joints at which the probe's centre, on an arm whose base may have moved, is at places, with noise."""
    wanted = places + NOISE * rng.standard_normal(places.shape)
    commanded = wanted.copy()
    for _ in range(4):
        pose = Pose(commanded, np.broadcast_to(DOWN, (len(places), 3, 3)))
        theta, margin = solve_tool(job.robot, pose, PROBE, Posture())
        assert margin.min() > 0
        commanded = commanded + wanted - _moved_by(base, arm.actual_pose(theta, rises, lambda s: None).position)
    return theta


def _moved_by(base, position):
    return position + base[:3] + np.cross(base[3:], position)
