"""A page of every command that writes one, made once for all tests that look at pages."""

from dataclasses import replace
from pathlib import Path

import executed_logs as logs
import numpy as np
from command_line import run
from shipped import ROOT, path_file
from simulated_days import drawn_day
from synthetic import made_up, measured, random_theta

from compgen.core.units import DEG, MM
from compgen.pipelines.files.program_course import course_of_text
from compgen.pipelines.files.robot_file import load_robot
from compgen.program.frames import default_frames

LINE = path_file("line_y")
COMMANDS = (
    "generate", "predict", "heat", "whatif", "correct", "executed", "identify-motion", "anchor", "identify", "compare",
)  # fmt: skip


def write_pages(folder: Path) -> dict[str, Path]:
    """Every page by its command, in folders of their own beneath one."""
    out = folder / "outputs"
    commands: dict[str, tuple[str, list[object]]] = {
        "generate": ("report.html", [LINE]),
        "predict": ("report.html", [LINE]),
        "heat": ("heat.html", [LINE, "--set", 'cycle=[{state="moving",repeat=3}]']),
        "whatif": ("whatif.html", [LINE, "--vary", "before.0.duty=0.5,1", "--ask", "contributions"]),
        "correct": ("report.html", [out / "generate" / "LINE_Y.LS", "--again", "--before", "moving 200mm/s 5h"]),
        "executed": ("executed.html", [*_logged(folder), "--robot", "m710ic50"]),
        "identify-motion": ("m710ic50.html", [*_logged(folder), "--robot", "m710ic50"]),
        "anchor": ("anchor.html", _touched(folder)),
        "identify": ("made.html", _measured(folder)),
        "compare": ("compare.html", [out / "predict", out / "slower"]),
    }
    single = {"identify-motion": "m710ic50.toml", "identify": "made.toml"}
    run("predict", LINE, "--set", "process.feed_mm_s=100", "-o", out / "slower", cwd=folder)
    pages = {}
    for command in COMMANDS:
        page, arguments = commands[command]
        target = out / command / single.get(command, "")
        option = "--html" if command == "anchor" else "-o"
        result = run(command, *arguments, option, target, cwd=folder)
        pages[command] = out / command / page
        assert pages[command].exists(), (command, result.stderr)
    return pages


def _logged(folder: Path) -> list[object]:
    """A program, and a log of its run by a controller that smooths."""
    program, text = folder / "PART.LS", logs.part()
    if not program.exists():
        program.write_bytes(text)
        course = course_of_text(text, load_robot("m710ic50"), default_frames())
        whole_periods = replace(course, cruise=course.counted_clock())
        time, places, turn, _ = logs.log_rows(
            whole_periods, logs.Run(ramp=0, means=(0.2, 0.16)), logs.Logger(noise=2e-6, offset=50.0, jitter=1e-3)
        )
        (folder / "log.csv").write_text(logs.csv(time, places, turn))
    return [program.name, "--log", "log.csv"]


def _touched(folder: Path) -> list[object]:
    """A path, a day of its robot, and touches at its end."""
    day = drawn_day(0, folder)
    given = ["--touches", day.files["touches"], "--artefact", day.files["artefact"]]
    return [day.job.source, *given, *(word for o in day.job.overrides for word in ("--set", o))]


def _measured(folder: Path) -> list[object]:
    """A robot file, and places that a tracker saw of another arm."""
    truth, rng = made_up(str(ROOT / "robots" / "ur5.toml"), 7), np.random.default_rng(70)
    data = measured(truth, random_theta(truth.arm.robot, rng, 30), rng)
    pendant = truth.arm.robot.to_pendant(data.theta)[data.pose] / DEG
    rows = ["order,target,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm"]
    places = data.position / MM
    places[7, 2] += 5.0  # a slip of the tracker
    for pose, reflector, joints, place in zip(data.pose, data.reflector, pendant, places, strict=True):
        rows.append(",".join([str(pose), data.reflectors[reflector], *(f"{v:.6f}" for v in (*joints, *place))]))
    (folder / "poses.csv").write_text("\n".join(rows) + "\n")
    return [truth.arm.source, "--poses", "poses.csv", "--force"]
