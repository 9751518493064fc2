"""What a program's text comes to on a controller that takes whole interpolation periods for every line."""

from compgen.core.findings import Finding, Level
from compgen.core.units import MS
from compgen.robot.robot import Controller
from compgen.verification.written_motion import WrittenMotion

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
    return [Finding(Level.NOTE, "timing.whole_periods", message)]
