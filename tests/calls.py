"""A call of each command, on shipped paths and small measurements, and what it needs beside them."""

import executed_logs as logs
import numpy as np
from command_line import run
from shipped import ROOT
from synthetic import random_theta

from compgen.core.units import DEG, MM
from compgen.pipelines.files.program_course import course_of_text
from compgen.pipelines.files.robot_file import load_robot
from compgen.program.frames import default_frames
from compgen.robot.kinematics import flange_pose

PAGED = ("--set", "robot.controller.max_lines=60", "--set", "process.page_stops=anywhere")
ARTEFACT = """[artefact]
certified = true
[[sphere]]
name = "a"
x_mm = 1000
y_mm = -400
z_mm = 0
diameter_mm = 30
[[sphere]]
name = "b"
x_mm = 1300
y_mm = 500
z_mm = 100
diameter_mm = 30
[[sphere]]
name = "c"
x_mm = 1600
y_mm = 0
z_mm = 0
diameter_mm = 30
[probe]
diameter_mm = 6
z_mm = 150
"""
LINE = "paths/line_y.toml"
CALLS = {
    "generate": ("generate", LINE, "-o", "g"),
    "predict": ("predict", LINE, "--program", "-o", "p"),
    "check": ("check", LINE),
    "check many": ("check", LINE, "paths/line_z.toml"),
    "inspect": ("inspect", "made/LINE_Y.LS"),
    "compare": ("compare", "made", "again", "-o", "compared"),
    "correct": ("correct", "plan/LINE_Y_PLAN.LS", "--before", "moving 200mm/s 6h", "--max-um", "5", "-o", "c"),
    "pages":
        ("pages", "PART.LS", "--robot", "m710ic50", "--set", "controller.max_lines=130", "-o", "parted"),
    "check-backup": ("check-backup", "made/LINE_Y.LS", "again/LINE_Y.LS"),
    "resume": ("resume", "paged", "--from-page", "2", "--late", "5min", "--date", "2026-01-31"),
    "offsets": ("offsets", LINE),
    "heat": ("heat", LINE, "-o", "h"),
    "whatif": ("whatif", LINE, "--vary", "process.feed_mm_s=100,200", "--workers", "1", "-o", "w"),
    "plan-poses": ("plan-poses", "m710ic50", "-n", "12", "--no-reversals", "-o", "poses"),
    "plan-touches": ("plan-touches", LINE, "--artefact", "artefact.toml", "-n", "4", "-o", "t"),
    "plan-motion-log": ("plan-motion-log", "m710ic50", "-o", "log"),
    "inspect-robot": ("inspect-robot", "m20ia", "-o", "sheet"),
    "export-robot": ("export-robot", "m710ic50", "-o", "arm.urdf"),
    "init": ("init", "cell"),
    "schema": ("schema", "path"),
    "explain": ("explain", "thermal.none"),
    "executed": ("executed", "ROUND.LS", "--log", "round.csv", "--robot", "m710ic50", "-o", "driven"),
    "identify-motion":
        ("identify-motion", "ROUND.LS", "--log", "round.csv", "--robot", "m710ic50", "-o", "motion/smooth.toml"),
    "follow": ("follow", "paged", "--log", "temperatures.csv", "--started", "0s", "--once", "--date", "2026-01-31"),
    "anchor": ("anchor", LINE, "--touches", "touches.csv", "--artefact", "artefact.toml", "-o", "anchored/state.toml"),
    "teach-frame": ("teach-frame", "m710ic50", "--touches", "touches.csv", "-o", "frame/part.toml"),
    "identify": ("identify", "m710ic50", "--poses", "poses.csv", "-o", "identified/mine.toml"),
    "check-robot": ("check-robot", "m710ic50", "--poses", "poses.csv", "--refit-frames"),
}  # fmt: skip
SPHERES = {"a": (1000, -400, 0), "b": (1300, 500, 100), "c": (1600, 0, 0)}  # mm, as the artefact has them
REFLECTORS = [[60, 0, 100], [0, 60, 100], [-60, 0, 100]]  # mm in the flange
ZEROS = [0, 0.1, -0.1, 0.15, 0.1, 0]  # deg that the measured arm's joints are off
RISES = {"part_3": 9.7271, "part_4": 3.4739, "part_6": 11.5768, "part_11": 2.6751}  # K


def prepare(folder):
    """A folder in which the calls can be made."""
    for name in ("paths", "robots"):
        (folder / name).symlink_to(ROOT / name)
    (folder / "artefact.toml").write_text(ARTEFACT)
    measure(folder)
    for words in (
        ("generate", LINE, "-q", "-o", "made"),
        ("generate", LINE, "-q", "-o", "again"),
        ("generate", LINE, "-q", "-o", "paged", *PAGED),
        ("predict", LINE, "--program", "-q", "-o", "plan"),
    ):
        assert run(*words, cwd=folder).returncode == 0, words
    return folder


def measure(folder):
    """The logs, touches and poses that calls are given."""
    robot, rng = load_robot("m710ic50"), np.random.default_rng(1)
    # pages need stops on the way; of one circle whose ramps are the means' own the motion is told the soonest
    (folder / "PART.LS").write_bytes(logs.part())
    text, driven = logs.circle("ROUND"), logs.Run(ramp=0.0, means=(0.2, 0.1))
    (folder / "ROUND.LS").write_bytes(text)
    time, places, turn, _ = logs.log_rows(
        course_of_text(text, robot, default_frames()), driven, logs.Logger(noise=2e-6)
    )
    (folder / "round.csv").write_text(logs.csv(time, places, turn))
    touches = ["target,x_mm,y_mm,z_mm,w_deg,p_deg,r_deg,config"]
    for n in range(9):
        place = ",".join(f"{v:.3f}" for v in SPHERES["abc"[n % 3]] + rng.normal(0, 0.01, 3))
        touches.append(f'{"abc"[n % 3]},{place},{180 - 5 * (n // 3)},{3 * (n // 3)},{10 * n},"N U T, 0, 0, 0"')
    (folder / "touches.csv").write_text("\n".join(touches) + "\n")
    theta = random_theta(robot, rng, 40)
    flange = flange_pose(robot, theta + np.array(ZEROS) * DEG)
    poses = ["order,target,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm"]
    for n, pendant in enumerate(robot.to_pendant(theta) / DEG):
        places = flange.position[n] / MM + np.array(REFLECTORS) @ flange.rotation[n].T + rng.normal(0, 0.03, (3, 3))
        poses += [f"{n},r{r},{','.join(f'{v:.6f}' for v in (*pendant, *place))}" for r, place in enumerate(places, 1)]
    (folder / "poses.csv").write_text("\n".join(poses) + "\n")
    warm = ",".join(f"{20 + rise:.3f}" for rise in RISES.values())
    head = ",".join(["time_s", "ambient_degC", *(f"{node}_degC" for node in RISES)])
    (folder / "temperatures.csv").write_text("\n".join([head, *(f"{t},20,{warm}" for t in (0, 10, 20, 30)), ""]))
