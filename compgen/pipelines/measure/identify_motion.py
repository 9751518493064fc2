"""How a log becomes the robot file's ``[motion]``: laid along its program, fitted, judged, written into a copy."""

import tomllib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from hashlib import sha256
from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError
from compgen.core.files import read_regular
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.units import MS, PERCENT, UM
from compgen.identification.identified_robot_file import text_with_table
from compgen.identification.motion.beginnings import identify_runs
from compgen.identification.motion.identify import NO_MORE, IdentifiedMotion
from compgen.identification.motion.speed_curves import shown_speeds
from compgen.identification.motion.timed_windows import timed_windows
from compgen.identification.motion.windows import Window, fitted
from compgen.pipelines.executed.executed import ProgramText, Situation, judge_and_fit
from compgen.robot.motion import SAME_OVERRIDE
from compgen.robot.robot import Robot
from compgen.verification.executed.course import ProgramCourse
from compgen.verification.executed.judgement import ExecutedRun
from compgen.verification.executed.position_log import PositionLog

LASTING = 1.5  # times as long as the motion that is fitted to it: no run that it explains, slowed down or not
LEAST_CNT = 0.5  # n / 100 of CNT n in the logs by which its wait is known (docs/motion.md)


def identify_motion(
    text: ProgramText,
    course: ProgramCourse,
    log: PositionLog,
    situation: Situation,
    progress: Callable[[float], None] = lambda share: None,
) -> tuple[ExecutedRun, IdentifiedMotion]:
    """The run of a log, and the controller that it shows.

    Args:
        text: The program that was run.
        course: Of that text.
        log: Of its positions.
        situation: Robot, frames, and what the program calls.
        progress: Called with the share done.

    Raises:
        InputError: Not a program, a log that is not of it or of a part of it, or one of a run with no steady motion.
    """
    run, first = judge_and_fit(text, course, log, situation)
    another = (Code.EXECUTED_ANOTHER, Code.EXECUTED_OLDER, Code.EXECUTED_OFFSET)
    wrong = next((f for f in run.findings if f.code in another), None)
    if wrong is not None:
        raise InputError(f"{log.table.source}: {wrong.message}")
    if any(f.code is Code.EXECUTED_PART for f in run.findings):
        raise InputError(f"{log.table.source}: it has a part of the program's path only; log a whole run of it")
    timed = timed_windows(run, situation.robot, first)
    windows = timed.windows
    if not windows:
        raise InputError(f"{log.table.source}: too few rows on lines that the program surely drives; log a whole run")
    robot, tool = situation.robot, run.course.tool
    identified = identify_runs(timed, robot, tool, run.deviation.noise, progress)
    speeds = shown_speeds(run.course, windows, robot, tool, identified.motion)
    passed = [fitted(window, robot, tool, identified.motion)[1] for window in windows]
    findings = (*_unlike_a_job(run, windows), *_another_time([w.shown for w in windows], passed), *identified.findings)
    return run, replace(identified, speeds=speeds, findings=findings)


def _unlike_a_job(run: ExecutedRun, windows: Sequence[Window]) -> Iterator[Finding]:
    """What a run has, by which no program may be commanded: another override, corners whose wait nobody measured."""
    unlike = []
    if run.clock.main is not None and abs(run.clock.main.override - 1) > SAME_OVERRIDE:
        unlike.append(
            f"it was run at {run.clock.main.override / PERCENT:.0f} % override, and programs are made for 100"
        )
    if any((window.kept < LEAST_CNT).any() for window in windows):
        unlike.append(f"it has corners below CNT{LEAST_CNT / PERCENT:.0f}, and how long these wait no log has shown")
    if held := run.held:
        places = ", ".join(run.course.point_name(stand.arc) for stand in held[:3])
        message = f"the robot was held near {places}: from the stop before it to the next one nothing is fitted"
        yield Finding(Level.NOTE, Code.EXECUTED_HELD, f"{message}; log a run that nobody holds")
    for what in unlike:
        yield Finding.of(Code.MOTION_UNSURE, f"{what}: it is {NO_MORE}; log a run at 100 % with corners at CNT100")


def _another_time(shown: Sequence[Array], passed: Sequence[Array]) -> Iterator[Finding]:
    """That runs last otherwise than the motion that is fitted: what its corners wait is none of its smoothing.

    Args:
        shown: Log's clock at the rows of each window [s].
        passed: When the motion is there [s].
    """
    lasts, takes = (sum(float(np.ptp(times)) for times in of) for of in (shown, passed))
    if not 1 / LASTING < lasts / takes < LASTING:
        yield Finding.of(
            Code.MOTION_PARTS,
            f"the run lasted {lasts:.1f} s, with this smoothing it takes {takes:.1f}: how long its corners wait, or "
            "its override, is not known; log a run at 100 % override with corners at CNT100",
        )


def _left_of_bends(identified: IdentifiedMotion) -> dict[str, float]:
    """What is left on stretches held out, as a robot file has it: a row of the band."""
    return {"held_out_um": round(identified.largest / UM, 3), "held_out_rms_um": round(identified.held_out / UM, 3)}


def motion_text(text: str, robot: Robot, run: ExecutedRun, program: ProgramText, identified: IdentifiedMotion) -> str:
    """A robot file's text with the identified ``[motion]``; whether programs are pre-distorted by it stays as it was.

    ``controller.rounds_up_to_period`` becomes true where the log shows whole periods, false where it decides against.

    Raises:
        InputError: The file's tables are laid out in a way that cannot be updated.
    """
    tables: dict[str, Any] = tomllib.loads(text)
    before = tables.get("motion", {})
    motion, main = identified.motion, run.clock.main
    if run.clock.rounded or (run.course.counted and run.clock.stretches):
        text = text_with_table(text, "controller", {**tables["controller"], "rounds_up_to_period": run.clock.rounded})
    began = "both" if len(identified.runs_began) > 1 else "".join(identified.runs_began)
    values = {
        "enabled": bool(before.get("enabled", False)),
        "space": motion.space,
        "moving_average_ms": [round(t / MS, 2) for t in motion.moving_averages],
        **({"after_long_ms": [round(t / MS, 2) for t in motion.after_long]} if motion.after_long else {}),
        **({"reach_percent_m2": round(motion.reach / PERCENT, 3)} if motion.reach else {}),
        **({"reach_at_m2": round(motion.reach_at, 3)} if motion.reach else {}),
        "first_order_ms": [round(t / MS, 2) for t in motion.first_orders],
        "lag_ms": before.get("lag_ms", 0.0),
        "identified": {
            "robot": robot.name,
            "verdict": identified.verdict.value,
            "log_sha256": sha256(read_regular(run.followed.log.table.source)).hexdigest(),
            "program": program.name,
            "override_percent": 100.0 if main is None else main.override / PERCENT,
            **(_left_of_bends(identified) if identified.plain > identified.seen else {}),
            **({"runs_began": began} if began else {}),
        },
    }
    return text_with_table(text, "motion", values)
