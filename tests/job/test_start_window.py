"""How long the robot may wait: many places side by side as each by itself."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from shipped import path_file, quiet

from compgen.compensation.optimise import Solution, Status
from compgen.job import start_window
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.thermal import JointMotion, rises_during, states_at

AIR = 'ambient={kind="wave",value_degC=21,amplitude_K=2,period_h=24,peak_h=15}'


def asked(*overrides):
    """A path of sweeps, as if nothing were corrected."""
    planned = generate.predict(load_job(path_file("raster_1300"), overrides=list(overrides)), quiet)
    solution = Solution(
        correction=np.zeros((len(planned.theta), 6)),
        theta=planned.theta,
        residual=planned.error(),
        status=Status.CONVERGED,
        iterations=1,
        last_step=0.0,
        active_limits=(),
    )
    return planned, solution


def one_by_one(planned, solution, first):
    """Doubling and halving at one place after the other, with the state by driving there from the start."""
    job, time = planned.job, planned.trajectory.time
    some = np.unique(np.linspace(first, len(time) - 1, start_window.SAMPLES).astype(int))
    theta, rise, motion = solution.theta[some], planned.rise[some], planned.motion.at(some)
    driven = JointMotion(time[: first + 1], planned.theta[: first + 1], planned.trajectory.driven_speed[:first])
    state = rises_during(job.heat, job.state(), driven, job.history.air, job.history.clock)[1] if first else job.state()

    def drift(delay):
        late = start_window.late_rise(job, delay, time[some] - time[first], state, job.history.clock + time[first])
        moved = planned.model.actual_pose(theta, rise + late, motion).position
        return np.linalg.norm(moved - planned.model.actual_pose(theta, rise, motion).position, axis=1).max()

    low, high = 0.0, 60.0
    while drift(high) <= job.start_drift:
        low, high = high, 2 * high
        if low >= start_window.LONGEST:
            return start_window.LONGEST
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if drift(middle) <= job.start_drift else (low, middle)
    return low


@pytest.mark.parametrize(
    "overrides",
    [
        (),
        (AIR,),
        ("robot.thermal.model=network",),
        ("compensation.start_drift_um=90",),
        ("compensation.start_drift_um=400",),
    ],
)
def test_side_by_side_is_as_one_by_one(overrides):
    planned, solution = asked(*overrides)
    N = len(planned.theta)
    first = np.array([0, 1, N // 5, N // 3, N // 2, N - 300, N - 2])
    found = generate.start_windows(planned, solution.theta, first)
    # the network samples a program's torques: those of its beginning differ from those of the whole, by some 0.1 s here
    rtol = 1e-4 if "robot.thermal.model=network" in overrides else 1e-8
    assert_allclose(found, [one_by_one(planned, solution, n) for n in first], rtol=rtol)
    assert generate.start_window(planned, solution.theta) == found[0]
    course = start_window.PromptMotion(planned.trajectory.time, solution.theta, planned.rise, planned.motion)
    driven = JointMotion(planned.trajectory.time, planned.theta, planned.trajectory.driven_speed)
    state = states_at(
        planned.job.heat, planned.job.state(), driven, first, planned.job.history.air, planned.job.history.clock
    )
    turned = start_window.longest_waits(planned.job, planned.model, course, first[::-1], state[::-1])
    assert_allclose(turned[::-1], found, rtol=1e-8)
    if "400" in "".join(overrides):
        assert set(found) == {start_window.LONGEST}
    else:
        assert len(set(found)) > 1


SWINGS = 'ambient={kind="wave",amplitude_K=8,period_h=1.3,peak_h=12}'


def test_in_air_that_swings_every_start_within_the_window_adds_no_more_than_allowed():
    """What a delay adds comes and goes: at twice the delay it may be little again, and between them more."""
    planned, solution = asked(SWINGS, "before.0.duration_h=1", "compensation.start_drift_um=5")
    job, time = planned.job, planned.trajectory.time
    window = generate.start_window(planned, solution.theta)
    some = np.linspace(0, len(time) - 1, 50).astype(int)
    theta, rise, motion = solution.theta[some], planned.rise[some], planned.motion.at(some)
    prompt = planned.model.actual_pose(theta, rise, motion).position
    assert window > 600
    for delay in np.linspace(0, window, 60):
        late = start_window.late_rise(job, delay, time[some], job.state(), job.history.clock)
        moved = planned.model.actual_pose(theta, rise + late, motion).position
        assert np.linalg.norm(moved - prompt, axis=1).max() <= job.start_drift * 1.0001


@pytest.mark.parametrize("overrides", [(), (AIR,), ("robot.thermal.model=network",)])
def test_states_on_the_way_give_the_rises_there(overrides):
    planned, _ = asked(*overrides)
    job, trajectory = planned.job, planned.trajectory
    driven = JointMotion(trajectory.time, planned.theta, trajectory.driven_speed)
    which = np.array([0, 3, 1023, 1024, 1025, 2000, len(planned.theta) - 1])
    states = states_at(job.heat, job.state(), driven, which, job.history.air, job.history.clock)
    assert_allclose(states @ job.heat.outputs.T, planned.rise[which], rtol=1e-12)
    assert np.ptp(planned.rise[which], axis=0).min() > 0.01


@pytest.mark.parametrize("overrides", [(), (AIR,)])
def test_what_a_late_start_adds_is_what_the_day_with_an_idle_stretch_more_has(overrides):
    """Rises over a program of two hours behind work alone, and behind work and so long a wait."""
    moving = '{state="moving", feed_mm_s=200, duration_h=2}'
    time = np.linspace(0, 7200.0, 25)
    driven = JointMotion(time, np.zeros((25, 6)), np.full(24, 0.1))

    def day(*stretches):
        return load_job(path_file("raster_1300"), overrides=[*overrides, f"before=[{', '.join(stretches)}]"])

    def rises(job):
        return rises_during(job.heat, job.state(), driven, job.history.air, job.history.clock)[0]

    prompt = day(moving)
    delay = np.array([600.0, 5400.0])
    clock, state = np.full(2, prompt.history.clock), np.tile(prompt.state(), (2, 1))
    added = start_window.late_rise(prompt, delay, np.tile(time, (2, 1)), state, clock)
    for late, wait in zip(added, delay.tolist(), strict=True):
        expected = rises(day(moving, f'{{state="idle", duration_h={wait / 3600}}}')) - rises(prompt)
        assert np.abs(expected).max() > 0.1
        assert_allclose(late, expected, atol=1e-9)
    assert_allclose(start_window.late_rise(prompt, 600.0, time, prompt.state(), prompt.history.clock), added[0])
