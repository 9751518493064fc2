"""What a cell does over a program's day: steps of the path file to stretches of duty, with their heat."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby
from pathlib import Path

from compgen.core.exceptions import InputError
from compgen.core.units import DAY, HOUR
from compgen.job.job import Cell, ProgramPlan
from compgen.job.motion_plan import plan_motion_for_heat, plan_written_motion
from compgen.thermal import Ambient, Duty, JointMotion
from compgen.thermal.duty import MeanLosses
from compgen.thermal.schedule import STANDING, History, Shift, Step, expand_steps

MOST_RUNS = 20_000


class Programs:
    """Motions of the programs that steps name, each planned once."""

    def __init__(
        self, own: ProgramPlan, cell: Cell, load: Callable[[str], ProgramPlan], driven: JointMotion | None = None
    ) -> None:
        """``own`` is the program called "", ``driven`` how it is known to be; ``load`` reads another path by name."""
        self._cell = cell
        self._load = load
        self._plans = {"": own}
        self._motions = {} if driven is None else {("", own.process.feed): driven}
        self._losses: dict[tuple[str, float], MeanLosses] = {}

    def plan(self, name: str) -> ProgramPlan:
        """A program by name; "" is the one whose history is planned, and so is one of the same path file."""
        if name not in self._plans:
            own, named = self._plans[""], self._load(name)
            self._plans[name] = own if Path(named.source).resolve() == Path(own.source).resolve() else named
        return self._plans[name]

    def motion(self, name: str, feed: float) -> JointMotion:
        """A program driven at a feed."""
        if (name, feed) not in self._motions:
            self._motions[name, feed] = plan_written_motion(self.plan(name), self._cell, feed).joint_motion
        return self._motions[name, feed]

    def losses(self, name: str, feed: float) -> MeanLosses:
        """Of the drives over a program at a feed, and standing in its poses."""
        if (name, feed) not in self._losses:
            self._losses[name, feed] = self._cell.heat.mean_losses(
                partial(plan_motion_for_heat, self.plan(name), self._cell, feed)
            )
        return self._losses[name, feed]

    def standing(self) -> Duty:
        """One second of servo on before the own program."""
        return replace(STANDING, loss=self.losses("", self.plan("").process.feed).held)


def plan_history(
    programs: Programs,
    air: Ambient,
    parts: Sequence[Sequence[Step]],
    shifts: Sequence[Shift],
    clock: float,
    *,
    as_given: bool = True,
) -> History:
    """What a cell does around a program, with the heat of each stretch; its ``standing`` is left to who asks for it.

    Args:
        programs: The program and those that steps name.
        air: From the first step on.
        parts: The steps before, in and after the cycle.
        shifts: Of a day.
        clock: When ``before`` begins, [s] of the day.
        as_given: Whether files say the day; one that a slider moves may leave out a shift, or runs.

    Raises:
        InputError: A program that is not there, too many stretches, one in shifts that meets none, or runs that duty
            or shifts leave no time for.
        ImpossibleError: A program that the robot cannot drive.
    """
    parts_with_feeds = [_with_programs_feed(steps, programs) for steps in parts]
    if any(s.shifts for steps in parts_with_feeds for s in steps) and not shifts:
        step = next(s for steps in parts_with_feeds for s in steps if s.shifts)
        raise InputError(f"{step.key}.shifts: there is no [[shift]]; add one, or remove shifts")

    def run_time(step: Step) -> float:
        return float(programs.motion(step.program, step.feed).time[-1])

    own_feed = programs.plan("").process.feed
    spread = []
    for steps in parts_with_feeds:
        pieces = expand_steps(steps, shifts, clock, run_time)
        if as_given:
            _refuse_without_shift(pieces, clock)
            _refuse_left_out_runs(pieces, run_time)
        clock += sum(d.duration for _, d in pieces)
        losses = [programs.losses(step.program, step.feed or own_feed) for step, _ in pieces]
        spread.append([(step, loss.warming(duty)) for (step, duty), loss in zip(pieces, losses, strict=True)])
    before, cycle, after = (tuple(duty for _, duty in pieces) for pieces in spread)
    runs = _runs(spread[1], run_time) if cycle else (0.0,)
    moving = [step for steps in parts_with_feeds for step in steps if step.state == "moving"]
    first = {step.feed: step.key.rpartition(": ")[2] for step in reversed(moving)}  # as a message has it
    return History(before=before, cycle=cycle, after=after, runs=runs, air=air, step_at=first)


def _refuse_without_shift(pieces: Sequence[tuple[Step, Duty]], clock: float) -> None:
    """Refuse a step inside shifts that meets none, of stretches that begin at a time of the day [s]."""
    begin = clock
    for step, stretches in groupby(pieces, key=lambda piece: piece[0]):
        duties = [duty for _, duty in stretches]
        lasts = sum(duty.duration for duty in duties)
        if step.shifts and lasts > 0 and all(duty.state == "off" for duty in duties):
            hours = f"its {lasts / HOUR:.3g} h from {begin % DAY / HOUR:.4g} o'clock on"
            raise InputError(
                f"{step.key}.shifts: no [[shift]] falls into {hours}: nothing moves; say by ambient.clock_h when the "
                "first [[before]] begins, or remove shifts"
            )
        begin += lasts


def _whole_runs(duty: Duty, run_time: float) -> int:
    """How many runs of a program [s] fit whole into a stretch."""
    return int(duty.duration * duty.share / run_time + 1e-6) if duty.state == "moving" else 0


def _refuse_left_out_runs(pieces: Sequence[tuple[Step, Duty]], run_time: Callable[[Step], float]) -> None:
    """Refuse a repeat of which duty or shifts leave fewer runs than it says."""
    count: Counter[Step] = Counter()
    for step, duty in pieces:
        if step.repeat is not None:
            count[step] += _whole_runs(duty, run_time(step))
    for step, runs in count.items():
        if step.repeat is not None and runs < step.repeat:
            within = f"{runs} of {step.repeat} runs fit into its {'shifts' if step.shifts else 'duty'}"
            raise InputError(f"{step.key}.repeat: {within}; give a duration_h instead")


def _with_programs_feed(steps: Sequence[Step], programs: Programs) -> list[Step]:
    """Steps that name a program and no feed run it at its own; one that names the own program is as one without."""
    out, own = [], programs.plan("")
    for step in steps:
        if step.program:
            named = programs.plan(step.program)
            name = "" if named is own else step.program
            step = replace(step, program=name, feed=step.feed if step.feed > 0 else named.process.feed)
        out.append(step)
    return out


def _runs(pieces: Sequence[tuple[Step, Duty]], run_time: Callable[[Step], float]) -> tuple[float, ...]:
    """When each run of the own program begins: all that fit whole into its moving stretches, spread by their duty."""
    starts, begins, now = [], [], 0.0
    for step, duty in pieces:
        if duty.state == "moving" and not step.program:
            one = run_time(step)
            starts += [now + k * one / duty.share for k in range(_whole_runs(duty, one))]
            begins.append(now)
            if len(starts) > MOST_RUNS:
                raise InputError(f"{step.key}: over {MOST_RUNS} runs of the program; make the cycle shorter")
        now += duty.duration
    return tuple(starts or begins[:1]) or (0.0,)
