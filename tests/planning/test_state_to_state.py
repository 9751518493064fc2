"""Changes of speed are ruckig's own: the closed form is their oracle, and each answer that is no motion is refused."""

from types import SimpleNamespace

import numpy as np
import pytest
import ruckig
from numpy.testing import assert_allclose
from shipped import EXACT, path_file

from compgen.core.exceptions import ImpossibleError
from compgen.pipelines.files.path_file import load_job
from compgen.planning import retiming
from compgen.planning.retiming import state_to_state
from compgen.planning.retiming.blocks import Blocks, reachable_speed
from compgen.planning.retiming.phases import Passage
from compgen.planning.retiming.state_to_state import drive_blocks

RTOL = 1e-9


def random_blocks(seed, count, longest=0.3, shortest=1e-3):
    """Blocks one behind the other that hold their changes of speed, half of them to the last."""
    rng = np.random.default_rng(seed)
    v, a, j = rng.uniform(0.02, 1.5, count), 10 ** rng.uniform(-1, 1.5, count), 10 ** rng.uniform(0, 3, count)
    length = 10 ** rng.uniform(np.log10(shortest), np.log10(longest), count)
    v0 = v * rng.choice([0.0, 0.3, 1.0], count)
    top = np.minimum(v, reachable_speed(v0, length, a, j))
    v1 = np.where(rng.random(count) < 0.5, top * rng.uniform(0, 1, count), top)
    v0 = np.minimum(v0, np.minimum(v, reachable_speed(v1, length, a, j)))
    v1 = np.minimum(v1, reachable_speed(v0, length, a, j))
    start = np.concatenate([[0.0], np.cumsum(length)[:-1]])
    swap = rng.random(count) < 0.5
    return Blocks(start=start, length=length, v0=np.where(swap, v1, v0), v1=np.where(swap, v0, v1), v=v, a=a, j=j)


def fastest_times(b):
    """In closed form: up to the highest speed that leaves room to come down, by bisection, hold it, and down."""

    def change(v, peak):
        dv = peak - v
        time = np.where(dv > b.a**2 / b.j, dv / b.a + b.a / b.j, 2 * np.sqrt(dv / b.j))
        return time, (v + peak) / 2 * time

    low, high = np.maximum(b.v0, b.v1), b.v.copy()
    whole = change(b.v0, high)[1] + change(b.v1, high)[1] <= b.length
    low = np.where(whole, high, low)
    for _ in range(200):
        peak = (low + high) / 2
        fits = change(b.v0, peak)[1] + change(b.v1, peak)[1] <= b.length
        low, high = np.where(fits, peak, low), np.where(fits, high, peak)
    (up, way_up), (down, way_down) = change(b.v0, low), change(b.v1, low)
    return up + down + (b.length - way_up - way_down) / low


def block_of(*values):
    return Blocks(**{name: np.array([float(x)]) for name, x in zip(Blocks.__slots__, values, strict=True)})


@pytest.mark.parametrize("longest", [0.3, 1e-5])
def test_every_block_takes_the_fastest_time_there_is(longest):
    """Also where a block is shorter than the precision that ruckig itself works to."""
    b = random_blocks(4, 5000, longest, longest / 300)
    phases = drive_blocks(b)
    assert_allclose(np.bincount(phases.block, phases.duration), fastest_times(b), rtol=2e-7)
    assert_allclose(np.median(np.bincount(phases.block, phases.duration) / fastest_times(b)), 1, rtol=1e-14)


@pytest.mark.parametrize("longest", [0.3, 1e-3, 1e-6, 1e-8])
def test_motion_goes_through_every_block_from_its_speed_to_the_next(longest):
    b = random_blocks(11, 3000, longest, longest / 300)
    phases = drive_blocks(b)
    first = np.flatnonzero(np.diff(phases.block, prepend=-1))
    assert_allclose(phases.s0[first], b.start, rtol=0, atol=1e-15)
    assert np.array_equal(phases.v0[first], b.v0)
    assert not phases.a0[first].any()
    t, j = phases.duration, phases.j
    ways = t * (phases.v0 + t * (phases.a0 / 2 + t * j / 6))
    assert_allclose(np.bincount(phases.block, ways), b.length, rtol=RTOL)
    last = np.append(first[1:], len(t)) - 1
    end = (phases.v0 + t * (phases.a0 + t * j / 2))[last]
    assert_allclose(end, b.v1, rtol=0, atol=RTOL * b.v.max())
    # nowhere slower than at the slower of its ends, nowhere over a limit
    within = (t[:, None] * np.linspace(0, 1, 21)).ravel()
    motion, owner = phases.motion(Passage(np.repeat(np.arange(len(t)), 21), within)), np.repeat(phases.block, 21)
    assert np.all(motion.v >= np.minimum(b.v0, b.v1)[owner] * (1 - 1e-9) - 1e-12)
    assert np.all(motion.v <= b.v[owner] * (1 + RTOL))
    assert np.all(np.abs(motion.a) <= b.a[owner] * (1 + RTOL))
    assert np.all(np.abs(j) <= b.j[phases.block] * (1 + RTOL))


def test_ruckig_alone_would_drive_backwards_where_there_is_no_room():
    """2 mm from 0.05 to 0.2 m/s: why a block is looked at before ruckig is asked, and its answer afterwards."""
    question, answer = ruckig.InputParameter(1), ruckig.Trajectory(1)
    question.current_position, question.target_position = [0.0], [2e-3]
    question.current_velocity, question.target_velocity = [0.05], [0.2]
    question.max_velocity, question.max_acceleration, question.max_jerk = [0.2], [1.0], [5.0]
    assert ruckig.Ruckig(1).calculate(question, answer) is ruckig.Result.Working
    assert min(answer.profiles[0][0].v) < -0.04
    block = block_of(0.25, 2e-3, 0.05, 0.2, 0.2, 1.0, 5.0)
    with pytest.raises(ImpossibleError, match=r"0\.2500 m along the path.*0\.002 m do not hold .* 0\.05 to 0\.2 m/s"):
        drive_blocks(block)


def test_an_answer_that_drives_backwards_is_refused_even_if_the_block_was_thought_long_enough(monkeypatch):
    monkeypatch.setattr(state_to_state, "check_room", lambda blocks: None)
    block = block_of(0.25, 2e-3, 0.05, 0.2, 0.2, 1.0, 5.0)
    with pytest.raises(ImpossibleError, match=r"0\.2500 m .* drives backwards"):
        drive_blocks(block)


def answers_falsified(monkeypatch, number, falsify):
    """ruckig's answer to one of its questions is another."""
    asked: list[int] = []

    class Falsified:
        def __init__(self, degrees_of_freedom):
            self.ruckig = ruckig.Ruckig(degrees_of_freedom)

        def validate_input(self, *arguments, **options):
            return self.ruckig.validate_input(*arguments, **options)

        def calculate(self, question, answer):
            true = ruckig.Trajectory(1)
            outcome = self.ruckig.calculate(question, true)
            own = true.profiles[0][0]
            profile = SimpleNamespace(
                t=list(own.t), j=list(own.j), brake=SimpleNamespace(duration=0.0), accel=SimpleNamespace(duration=0.0)
            )
            if len(asked) == number:
                outcome = falsify(profile) or outcome
            asked.append(number)
            answer.profiles = [[profile]]
            return outcome

    monkeypatch.setattr(state_to_state, "Ruckig", Falsified)
    monkeypatch.setattr(state_to_state, "Trajectory", lambda count: SimpleNamespace())


def longer(profile):
    profile.t[3] += 1e-6


def cut_short(profile):
    profile.t[int(np.argmax(profile.t))] *= 1 - 1e-5


def still_accelerating(profile):
    profile.j[int(np.argmax(np.abs(np.multiply(profile.j, profile.t))))] *= 0.999


def braking(profile):
    profile.brake.duration = 1e-3


def back_in_time(profile):
    profile.t[3] = -profile.t[3] - 1e-3


def not_a_number(profile):
    profile.t[0] = np.nan


def there_and_back(profile):
    """From rest: backwards at first, and the same way again."""
    profile.t, profile.j = [0.5, 0.0, 0.5, 0.0, 0.5, 0.0, 0.5], [-1.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0]


def out_of_time(profile):
    return ruckig.Result.ErrorExecutionTimeCalculation


@pytest.mark.parametrize("number", [0, 1, 777, 2499])
@pytest.mark.parametrize(
    "falsify",
    [longer, cut_short, still_accelerating, braking, back_in_time, not_a_number, there_and_back, out_of_time],
)
def test_one_wrong_answer_among_thousands_is_refused(monkeypatch, number, falsify):
    b = random_blocks(7, 4000)
    changing = np.flatnonzero((b.v0 != b.v) | (b.v1 != b.v))
    assert len(changing) > 2500
    answers_falsified(monkeypatch, -1, falsify)
    drive_blocks(b)
    answers_falsified(monkeypatch, number, falsify)
    with pytest.raises(ImpossibleError, match=f"{b.start[changing[number]]:.4f} m along the path"):
        drive_blocks(b)


def test_another_answer_that_is_a_motion_too_is_what_the_robot_drives(monkeypatch):
    """ruckig's answer is used, not only compared: asked with less jerk, the same path takes longer."""
    robot = load_job(path_file("circle_1300"), None, [EXACT]).robot
    arc = np.linspace(0, 0.4, 201)
    stop = np.zeros(201, dtype=bool)
    stop[[0, 100, -1]] = True
    theta = np.outer(arc, np.linspace(0.1, 0.5, 6))
    true = retiming.retime(robot, arc, theta, stop, 0.02)

    class Gentle(ruckig.Ruckig):  # type: ignore[misc]  # it has no types
        def calculate(self, question, answer):
            question.max_jerk = [0.9]
            return super().calculate(question, answer)

    monkeypatch.setattr(state_to_state, "Ruckig", Gentle)
    gentle = retiming.retime(robot, arc, theta, stop, 0.02)
    assert gentle.time[-1] > true.time[-1] + 1e-3
    assert np.abs(gentle.phases.j).max() < 0.95 * np.abs(true.phases.j).max()


LIMITS = [((0.15, 9, 9), "fast"), ((9, 0.4, 9), "accelerates"), ((9, 9, 2), "jerk")]


@pytest.mark.parametrize(("limits", "fault"), LIMITS)
def test_an_answer_over_a_limit_is_refused(monkeypatch, limits, fault):
    """From rest to rest in less time than the limit allows: length and end are right."""
    block = block_of(0.25, 0.1, 0, 0, *limits)
    drive_blocks(block)

    def quicker(profile):
        profile.t, profile.j = [0.99 * t for t in profile.t], [j / 0.99**3 for j in profile.j]

    answers_falsified(monkeypatch, 0, quicker)
    with pytest.raises(ImpossibleError, match=fault):
        drive_blocks(block)
    monkeypatch.setattr(state_to_state, "AGREEMENT", 0.1)
    drive_blocks(block)
