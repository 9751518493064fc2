"""What a program's text comes to on a controller that takes whole interpolation periods for every line."""

import numpy as np

from compgen.core.codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.units import MS
from compgen.fanuc import Program
from compgen.planning.toolpath import ToolPath
from compgen.robot.robot import SAME_PERIOD, Controller
from compgen.verification.written_motion import WrittenMotion

AT_FEED = 1e-9  # relative
TIMES_APART = 0.005  # relative: from where the two clocks' times are told


def times_apart(controller: Controller, written: WrittenMotion) -> list[Finding]:
    """The duration as written and on a controller that rounds up, where they differ."""
    longer = written.rounded_up / written.as_written - 1
    if longer <= TIMES_APART:
        return []
    message = (
        f"the text takes {written.as_written:.2f} s as written, and {written.rounded_up:.2f} s ({100 * longer:+.1f} %) "
        f"on a controller that rounds every line up to whole periods of {controller.period / MS:g} ms; times and heat "
        f"here are {'the second' if controller.rounds_up_to_period else 'the first'}: controller.rounds_up_to_period"
    )
    return [Finding(Level.NOTE, Code.TIMING_WHOLE_PERIODS, message)]


def over_periods(controller: Controller, path: ToolPath, program: Program, feed: float) -> list[Finding]:
    """Lines of a text that last longer at feed than the whole periods that they were laid out for.

    Args:
        controller: Its period.
        path: As planned, N waypoints.
        program: As its text says it, N positions.
        feed: Wanted along the path [m/s].
    """
    feeds = feed * path.pace
    lines = ~(path.via[:-1] | path.via[1:]) & (program.speed >= feeds * (1 - AT_FEED))
    planned = controller.whole_periods(np.diff(path.arc) / feeds)
    lasts = program.lengths() / program.speed / controller.period
    over = np.flatnonzero(lines & (lasts > planned * (1 + SAME_PERIOD)))
    if not len(over):
        return []
    worst = over[int(np.argmax(lasts[over] - planned[over]))]
    share = program.lengths()[over].sum() / program.lengths().sum()
    message = (
        f"{len(over)} lines at feed ({100 * share:.1f} % of the length) last longer than the whole interpolation "
        f"periods that they were laid out for: that to P[{worst + 2}] {lasts[worst]:.4f}, not {planned[worst]:.0f}; a "
        "controller that rounds up takes one more for each"
    )
    return [Finding(Level.WARNING, Code.TIMING_OVER_PERIODS, message)]
