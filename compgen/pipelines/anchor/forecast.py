r"""What the thermal model says of the robot while it was touched, and how well it is known.

By a log: the rises are those that explain its readings up to the last touch. By history: those after [[before]], whose
first duty is where the touches' clock begins. What is not known of the K rises is

    P = sum_q s_q^2 r_q r_q^T + diag(o^2)

with r_q what one unit of a quantity q of the robot file's [thermal.uncertainty] adds to them (law, thermocouples,
air, feed), and o what each node has by itself: half of the thermocouples' error where it has a sensor, and where it
has none what its modelled course may be off.
"""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, interpolated
from compgen.core.exceptions import InputError
from compgen.core.units import HOUR, MINUTE
from compgen.error_model.uncertain_sources import Quantity
from compgen.identification.touches import Touches
from compgen.job.job import Cell, Job
from compgen.job.motion_plan import plan_written_motion
from compgen.thermal import JointMotion, rise_history, state_after, still_air
from compgen.thermal.ensemble import duties_until
from compgen.thermal.filled_rises import HEIGHT
from compgen.thermal.log_prior import EACH
from compgen.thermal.schedule import History
from compgen.thermal.state_from_log import TemperatureLog, fit_log
from compgen.thermal.uncertainty import Past, added_rise

AFTER = 10 * MINUTE  # that touches may end after a log's last reading
AROUND = 1 * HOUR  # of the end of [[before]] that touches may be away
LONGEST = 2 * HOUR  # that the touches of one state may take


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Forecast:
    """The robot at the last of N touches."""

    cell: Cell  # whose heat begins then
    history: History  # which begins then
    time: float  # [s] on the touches' clock
    state: Array  # (S,)
    rise: Array  # (K,) [K]
    touch_rise: Array  # (N, K) [K] at each touch
    own: Array  # (K,) [K] standard deviation of what each node has by itself
    past: Past  # that led there, for what quantities add

    @property
    def air(self) -> float:
        """Rise of the air then [K]."""
        return float(self.history.air.at(np.zeros(1))[0])

    def added_rise(self, quantity: Quantity) -> Array:
        """What one unit of a quantity adds to the rises, (K,) [K]."""
        return np.asarray(added_rise(self.cell.warmth, self.past, quantity.cause.heat, np.zeros(1))[0])


def forecast_now(job: Job, touches: Touches) -> Forecast:
    """The robot of a job while it was touched.

    Args:
        job: Its log, or its history.
        touches: On the clock of the log, else from the first duty of [[before]] on.

    Raises:
        InputError: Touches of another hour than the log or the history.
    """
    if touches.timed and np.ptp(touches.time) > LONGEST:
        raise InputError(
            f"{touches.file}: column time_s: touches over {np.ptp(touches.time) / MINUTE:.0f} min; a state is one "
            f"moment: give those of {LONGEST / MINUTE:.0f} min at most"
        )
    if job.log is not None and not job.history.before:
        return _by_log(job, touches, job.log)
    return _by_history(job, touches)


def _by_log(job: Job, touches: Touches, log: TemperatureLog) -> Forecast:
    when = touches.time if touches.timed else np.full(len(touches.time), log.time[-1])
    if when.min() < log.time[0] or when.max() > log.time[-1] + AFTER:
        raise InputError(
            f"{touches.file}: column time_s: touches at {when.min() / MINUTE:.0f} to {when.max() / MINUTE:.0f} min, a "
            f"log from {log.time[0] / MINUTE:.0f} to {log.time[-1] / MINUTE:.0f} min: of another hour; give the log of "
            "the same clock"
        )
    last, heat = float(when.max()), job.cell.heat.starting(None)
    some = log.time <= last
    if some.sum() < 2:
        raise InputError(f"{touches.file}: column time_s: the log has one reading before the touches; begin it earlier")
    cut = log.rows(some)

    def working() -> JointMotion:
        return plan_written_motion(job.plan, job.cell, job.plan.process.feed).joint_motion

    fitted = fit_log(cut, heat, heat.mean_losses(working).moving)
    air, end = still_air(cut.last_air) if log.has_air else job.history.air, float(cut.time[-1])

    def stood(until: float) -> Array:
        return state_after(heat, (replace(job.history.standing, duration=until - end),), fitted.state, air)

    state = stood(max(last, end))
    sensed = np.array([name in log.readings for name in heat.names])
    own = np.where(sensed, EACH * job.cell.warmth.sensors, HEIGHT * np.abs(fitted.rise[-1]))
    rise = interpolated(when, fitted.time, fitted.rise)
    for n in np.flatnonzero(when > end).tolist():
        rise[n] = heat.outputs @ stood(float(when[n]))
    return Forecast(
        cell=replace(job.cell, heat=heat.starting(state)),
        history=replace(job.history, before=(), air=air),
        time=last,
        state=state,
        rise=np.asarray(heat.outputs @ state),
        touch_rise=rise,
        own=own,
        past=Past(heat.starting(state), History(air=air), job.feed),
    )


def _by_history(job: Job, touches: Touches) -> Forecast:
    heat, history = job.cell.heat, job.history
    origin = 0.0 if job.log is None else float(job.log.time[-1])
    end = origin + history.clock
    when = touches.time if touches.timed else np.full(len(touches.time), end)
    if when.min() < max(end - AROUND, origin) or when.max() > end + AROUND:
        raise InputError(
            f"{touches.file}: column time_s: touches at {when.min() / MINUTE:.0f} to {when.max() / MINUTE:.0f} min, "
            f"and [[before]] ends at {end / MINUTE:.0f} min: of another hour; time_s counts from where [[before]] "
            "begins; leave the column out if you touched where it ends"
        )
    last = float(when.max())
    duties = [*history.before, replace(history.standing, duration=10 * AROUND)]
    until = tuple(duties_until(duties, last - origin))
    state = state_after(heat, until, air=history.air)
    order = np.argsort(when, kind="stable")
    rise = np.empty((len(when), len(heat.names)))
    rise[order] = rise_history(heat, duties, when[order] - origin, air=history.air)
    air = history.air.since(last - origin)
    return Forecast(
        cell=replace(job.cell, heat=heat.starting(state)),
        history=replace(history, before=(), air=air),
        time=last,
        state=state,
        rise=np.asarray(heat.outputs @ state),
        touch_rise=rise,
        own=np.zeros(len(heat.names)),
        past=Past(heat, replace(history, before=until), job.feed),
    )
