"""Drawn runs, and how well their logs tell them: override, time, deviation; and the controller that smoothed them.

    python tests/campaigns/executed_runs.py runs 0:60
    python tests/campaigns/executed_runs.py motion 0:60

A run is a program at a drawn speed and override, driven by the twin's controller with drawn smoothing. Its log has
drawn rows, noise, digits, jitter, gaps, offset and rate of the clock, and may miss a beginning and an end. A
controller to be identified is drawn by time steps written out (``executed_logs``), in joints by the twin, and one in
four is of a kind that is not among those tried.
"""

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[2]))

import executed_logs as logs
import numpy as np

from compgen.core.exceptions import InputError
from compgen.identification.motion.fit import times_of
from compgen.pipelines.executed.executed import Situation, judge_log, read_program_text
from compgen.pipelines.executed.simulated_log import Logger, simulated_log
from compgen.pipelines.files.program_course import course_of_text
from compgen.pipelines.files.robot_file import load_robot
from compgen.pipelines.measure.identify_motion import identify_motion
from compgen.program.frames import default_frames
from compgen.robot.motion import ControllerMotion, MotionVerdict
from compgen.verification.executed.position_log import read_position_log

UM = 1e-6


def drawn_text(rng, corners=False):
    """A program at a drawn speed."""
    speed = float(rng.choice([0.02, 0.05, 0.1, 0.15]))
    if corners or rng.random() < 0.6:
        return logs.part(speed=speed), speed
    return logs.circle(radius=float(rng.choice([0.1, 0.2])), speed=speed), speed


def drawn_motion(rng, space="cartesian"):
    """A controller of one of the kinds that are tried."""
    times = tuple(sorted(rng.uniform(0.03, 0.25, rng.integers(1, 3)).tolist(), reverse=True))
    if rng.random() < 0.5:
        return ControllerMotion(space=space, moving_averages=times)
    return ControllerMotion(space=space, first_orders=tuple(t / 3 for t in times))


def judged(text, log, situation):
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "log.csv"
        file.write_bytes(log)
        program = read_program_text(str(file.with_name("PART.LS")), text)
        return judge_log(program, situation.course(text), read_position_log(file), situation)


def is_right(stretch, percent):
    """Whether a stretch has the override, or names it among those that drive its lines alike."""
    low, high = stretch.alike
    return stretch.override == percent / 100 or low <= percent <= high


def one_run(seed, situation):
    """Errors of override [share], time [share], rms and p99 [um], and what was drawn."""
    rng = np.random.default_rng(seed)
    text, speed = drawn_text(rng)
    motion = None if rng.random() < 0.2 else drawn_motion(rng, str(rng.choice(["cartesian", "joint"])))
    override = int(rng.integers(10, 101)) / 100
    step = float(rng.choice([0.002, 0.004, 0.008, 0.016, 0.05, 0.1]))
    noise, digits = float(rng.choice([0, 1e-6, 3e-6, 1e-5])), int(rng.choice([2, 3, 4]))
    logger = Logger(
        step=step, noise=noise, digits=digits, jitter=float(rng.uniform(0, 0.25)) * step,
        dropped=float(rng.uniform(0, 0.1)), offset=float(rng.uniform(-1e4, 1e4)), rate=float(rng.uniform(-5e-4, 5e-4)),
        before=float(rng.choice([2.0, 0.5, -3.0])), after=float(rng.choice([2.0, 0.5, -3.0])), seed=seed,
    )  # fmt: skip
    run = judged(text, simulated_log(text, situation, motion, override, logger), situation)
    dense = Logger(step=0.004, noise=0.0, digits=6, before=logger.before, after=logger.after)
    exact = judged(text, simulated_log(text, situation, motion, override, dense), situation)
    total, true = run.deviation.extents["total"], exact.deviation.extents["total"]
    stretches, settle = run.clock.stretches, 0.0 if motion is None else motion.settling
    spread = np.sqrt(2) * run.deviation.noise
    return {
        "overrides": len(stretches) == 1 and is_right(stretches[0], round(100 * override)),
        "rate": stretches[0].rate * (1 + logger.rate) / stretches[0].override - 1 if stretches else np.nan,
        # a stop waits until the smoothing has come to rest: less than what counts as standing is in the time
        "time": run.clock.took / run.clock.expected / (1 + logger.rate) - 1 if not 0 < settle < 0.3 else np.nan,
        "rms": (np.sqrt(max(total.rms**2 - spread**2, 0)) - true.rms) / UM,
        "p99": (total.p99 - true.p99) / UM,
        "max": (total.max - true.max) / UM,
        "noise": run.deviation.noise / UM,
        "step": step,
        "true": [true.rms / UM, true.p99 / UM, true.max / UM],
        "drawn": f"{speed * 1e3:.0f} mm/s {100 * override:.0f} % {step * 1e3:.0f} ms {digits} digits "
        f"{noise / UM:.0f} um {'bare' if motion is None else motion.space}",
    }


def runs(seeds, situation):
    rows = []
    for seed in seeds:
        try:
            row = one_run(seed, situation)
        except InputError as refusal:
            print(f"{seed}: refused: {refusal}")
            continue
        rows.append(row)
        print(
            f"{seed}: {row['drawn']}: override {'right' if row['overrides'] else 'WRONG'} "
            f"rate {1e6 * row['rate']:.0f} ppm time {1e6 * row['time']:.0f} ppm, "
            f"rms {row['rms']:+.2f} p99 {row['p99']:+.2f} max {row['max']:+.2f} um of "
            f"{', '.join(f'{v:.1f}' for v in row['true'])}, noise {row['noise']:.2f}", flush=True
        )  # fmt: skip
    print(f"{len(rows)} runs of {len(seeds)}: override right in {sum(r['overrides'] for r in rows)}")
    fine = [r for r in rows if r["step"] <= 0.016]
    print(f"of rows up to 16 ms apart, {len(fine)}:")
    rows = fine if len(fine) > 1 else rows
    for key, unit in (("rate", 1e6), ("time", 1e6), ("rms", 1), ("p99", 1), ("max", 1)):
        values = unit * np.abs([r[key] for r in rows if np.isfinite(r[key])])
        print(f"{key}: median {np.median(values):.3g}, 95 % {np.percentile(values, 95):.3g}, worst {values.max():.3g}")


def true_words(means, lags):
    return f"means {[round(1e3 * t, 1) for t in means]} lags {[round(1e3 * t, 1) for t in lags]} ms"


def one_controller(seed, situation, course, text):
    """What was drawn, and what was identified."""
    rng = np.random.default_rng(seed)
    wrong = rng.random() < 0.25
    joint = not wrong and rng.random() < 0.3
    override = float(rng.choice([1.0, 0.7, 0.5]))
    noise = float(rng.choice([1e-6, 3e-6, 1e-5]))
    motion = drawn_motion(rng, "joint" if joint else "cartesian")
    means, lags = motion.moving_averages, motion.first_orders
    if wrong:
        means, lags = [((0.2, 0.15, 0.1), ()), ((0.15,), (0.05,)), ((), (0.06, 0.05, 0.04))][int(rng.integers(0, 3))]
    if joint:
        log = simulated_log(text, situation, motion, override, Logger(noise=noise, digits=4, offset=50.0, seed=seed))
    else:
        run = logs.Run(ramp=0.25, override=override, means=means, lags=lags)
        rows = logs.log_rows(course, run, logs.Logger(noise=noise, offset=50.0, rate=2e-4, drop=0.03, seed=seed))
        log = logs.csv(*rows[:3]).encode()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "log.csv"
        file.write_bytes(log)
        _, identified = identify_motion(
            read_program_text(str(file), text), situation.course(text), read_position_log(file), situation
        )
    kind = identified.chosen.kind
    times, true = times_of(kind, identified.chosen.numbers), (*means, *lags)
    right = not wrong and kind.space == motion.space and kind.filters == ("means" if means else "lags")
    return {
        "wrong": wrong,
        "accepted": identified.verdict is MotionVerdict.COMMANDABLE,
        "right": right and kind.count == len(true),
        "errors": 1e3 * (np.array(times) - true) if right and kind.count == len(true) else np.zeros(0),
        "inside": [a <= t <= b for t, (a, b) in zip(true, identified.intervals, strict=False)] if right else [],
        "excess": identified.held_out / max(identified.noise, 1e-9),
        "words": f"{'wrong kind ' if wrong else ''}{'joint ' if joint else ''}{true_words(means, lags)} -> "
        f"{kind.words} {[round(1e3 * t, 1) for t in times]}, held out {identified.held_out / UM:.2f} "
        f"of {identified.noise / UM:.2f} um",
        "why": next((f.code for f in identified.findings), ""),
    }


def motion(seeds, situation):
    rows = []
    for seed in seeds:
        text, _ = drawn_text(np.random.default_rng(seed + 10**6), corners=True)
        row = one_controller(seed, situation, course_of_text(text, situation.robot, situation.frames), text)
        rows.append(row)
        print(f"{seed}: {row['words']}: {'accepted' if row['accepted'] else 'rejected, ' + row['why']}", flush=True)
    known, wrong = [r for r in rows if not r["wrong"]], [r for r in rows if r["wrong"]]
    accepted = [r for r in known if r["accepted"]]
    right = sum(r["right"] for r in accepted)
    print(f"kinds that are tried: {len(known)}, accepted {len(accepted)}, of these the right kind {right}")
    errors = np.abs(np.concatenate([r["errors"] for r in accepted])) if accepted else np.zeros(1)
    inside = [x for r in accepted for x in r["inside"]]
    middle, most = np.percentile(errors, [50, 95])
    print(f"times: median error {middle:.2f}, 95 % {most:.2f}, at most {errors.max():.2f} ms")
    print(f"times inside of their interval: {np.mean(inside):.2f} of {len(inside)}")
    excess = [r["excess"] for r in accepted]
    print(f"held out over noise: {np.mean(excess):.3f} on average, at most {max(excess):.3f}")
    taken = [r for r in wrong if r["accepted"]]
    print(f"kinds that are not tried: {len(wrong)}, accepted {len(taken)}")


if __name__ == "__main__":
    what, span = sys.argv[1:]
    first, last = (int(n) for n in span.split(":"))
    there = Situation(load_robot("m710ic50"), default_frames(), {}, lambda name: None)
    {"runs": runs, "motion": motion}[what](range(first, last), there)
