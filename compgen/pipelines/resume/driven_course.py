"""The robot's warmth by its heat model alone, driven as the pages of a job have really run."""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, own
from compgen.pipelines.resume.page_times import PageTimes
from compgen.pipelines.resume.whole import Whole
from compgen.thermal import Ambient, JointMotion, state_after, states_at
from compgen.thermal.rise_filter import STEP


@dataclass(frozen=True, eq=False, slots=True)
class Course:
    """Thermal states by the model, driven as the pages ran: at the end of steps first to last."""

    first: int
    states: Array  # (T, S)
    air: Ambient  # on the log's clock

    def __post_init__(self) -> None:
        own(self, states=("T", "S"))


def model_course(whole: Whole, times: PageTimes, air: Ambient, now: float) -> Course:
    """Thermal states by the model at the end of each step from the planned start to now."""
    job, heat = whole.job, whole.job.heat
    first, last = int(np.ceil(times.planned / STEP)), max(int(np.ceil(now / STEP)), int(np.ceil(times.planned / STEP)))
    moments = np.arange(first, last + 1) * STEP
    z, states = job.state(), np.empty((len(moments), len(heat.rate)))
    states[moments <= times.planned] = z
    for begin, end, page, into in times.stretches(moments[-1] + STEP):
        inside = (moments > begin) & (moments <= end)
        if page:
            motion, _ = page_motion(whole, page, times)
            at = np.append(moments[inside] - begin, end - begin) + into
            rows = np.searchsorted(motion.time, np.concatenate([[into], at]) + 1e-9, side="right") - 1
            run = motion_from(motion, int(rows[0]))
            course = states_at(heat, z, run, np.asarray(rows - rows[0])) if len(rows) else np.zeros((0, len(z)))
            states[inside], z = course[1:-1], course[-1]
        else:
            standing = [replace(job.history.standing, duration=float(t - begin)) for t in moments[inside]]
            states[inside] = np.array([state_after(heat, [s], z) for s in standing]).reshape(-1, len(z))
            z = state_after(heat, [replace(job.history.standing, duration=end - begin)], z)
    response = air.response(heat.rate, times.planned, np.maximum(moments, times.planned))
    return Course(first, states + heat.ambient * response, air)


def page_motion(whole: Whole, page: int, times: PageTimes) -> tuple[JointMotion, int]:
    """The motion of a page, from its own beginning on, and the waypoint that it starts at."""
    edges = np.concatenate([[0.0], np.cumsum(times.duration)])
    first, last = (int(np.argmin(np.abs(whole.time - edges[k]))) for k in (page - 1, page))
    time = whole.time[first : last + 1]
    return JointMotion(time - time[0], whole.theta[first : last + 1], whole.trajectory.driven_speed[first:last]), first


def motion_from(motion: JointMotion, row: int) -> JointMotion:
    """A motion from one of its waypoints on."""
    return JointMotion(motion.time[row:] - motion.time[row], motion.theta[row:], motion.driven[row:])
