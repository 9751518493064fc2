"""The robot's warmth by its heat model alone, driven as the pages of a job have really run."""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, owns
from compgen.pipelines.resume.page_times import PageTimes
from compgen.pipelines.resume.paged_run import PagedRun
from compgen.thermal import Ambient, JointMotion, state_after, states_at
from compgen.thermal.rise_filter import STEP


@dataclass(frozen=True, eq=False, slots=True)
@owns(states=("T", "S"))
class Course:
    """Thermal states by the model, driven as the pages ran: at the end of steps first to last."""

    first: int
    states: Array  # (T, S)
    air: Ambient  # on the log's clock


def model_course(run: PagedRun, times: PageTimes, air: Ambient, now: float) -> Course:
    """Thermal states by the model at the end of each step from the planned start to now."""
    heat, one_second = run.heat, run.history.standing
    first, last = int(np.ceil(times.planned / STEP)), max(int(np.ceil(now / STEP)), int(np.ceil(times.planned / STEP)))
    moments = np.arange(first, last + 1) * STEP
    z, states = run.start, np.empty((len(moments), len(heat.rate)))
    states[moments <= times.planned] = z
    for begin, end, page, into in times.stretches(moments[-1] + STEP):
        inside = (moments > begin) & (moments <= end)
        if page:
            motion = run.page_motion(page)
            at = np.append(moments[inside] - begin, end - begin) + into
            rows = np.searchsorted(motion.time, np.concatenate([[into], at]) + 1e-9, side="right") - 1
            rest = motion_from(motion, int(rows[0]))
            course = states_at(heat, z, rest, np.asarray(rows - rows[0])) if len(rows) else np.zeros((0, len(z)))
            states[inside], z = course[1:-1], course[-1]
        else:
            standing = [replace(one_second, duration=float(t - begin)) for t in moments[inside]]
            states[inside] = np.array([state_after(heat, [s], z) for s in standing]).reshape(-1, len(z))
            z = state_after(heat, [replace(one_second, duration=end - begin)], z)
    response = air.response(heat.rate, times.planned, np.maximum(moments, times.planned))
    return Course(first, states + heat.ambient * response, air)


def motion_from(motion: JointMotion, row: int) -> JointMotion:
    """A motion from one of its waypoints on."""
    return JointMotion(motion.time[row:] - motion.time[row], motion.theta[row:], motion.driven[row:])
