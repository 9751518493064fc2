r"""Changes of speed along the arc: ruckig's own, state to state, and each of them checked. Only this module calls it.

A block of length L is driven from speed v0 to v1 within v, a and j, with zero acceleration at both ends. ruckig's
answer is seven stretches of constant jerk, the fastest there are. It keeps no lowest speed: where L does not hold the
change of speed, it drives backwards first. So a block must hold it before ruckig is asked, and what ruckig answers is
integrated anew: it must go the whole length, end with v1 and no acceleration, stay within the limits and never go
backwards.

ruckig's tolerances are absolute (1e-8 m). It is asked in units of the block, L for length and (L / j)^(1/3) for time,
so that they are relative: length and jerk are 1, whatever the block.
"""

from collections.abc import Callable

import numpy as np
from ruckig import InputParameter, Result, Ruckig, RuckigError, Trajectory

from compgen.core.arrays import Array, IntArray, cumulated, first_true
from compgen.core.exceptions import ImpossibleError
from compgen.planning.retiming.blocks import Blocks, change_duration
from compgen.planning.retiming.phases import Phases

STRETCHES = 7  # of constant jerk in a block
AGREEMENT = 1e-9  # relative: how exactly a block's end and its limits are met
ROUNDING = 1e-12  # relative: what is left of a speed or an acceleration that has come down to zero
REPORTED = 10_000  # blocks between two calls of progress


def drive_blocks(blocks: Blocks, progress: Callable[[float], None] = lambda share: None) -> Phases:
    """The fastest motion through all blocks, each from the speed at its start to that at its end.

    Args:
        blocks: What they allow, and the speeds at their edges.
        progress: Called with the share done.

    Raises:
        ImpossibleError: A block is too short for its change of speed, or ruckig's answer is no motion through it.
    """
    check_room(blocks)
    changes = (blocks.v0 != blocks.v) | (blocks.v1 != blocks.v)
    changing, steady = np.flatnonzero(changes), np.flatnonzero(~changes)
    part, held = blocks.at(changing), blocks.at(steady)
    of_changes, changed = _integrate(part, *_ask_ruckig(part, progress))
    none = np.zeros(len(steady))
    of_steady = np.column_stack([held.length / held.v, held.start, held.v, none, none])
    # in order of the blocks, each with its phases in order
    owner = np.concatenate([changing[changed], steady])
    order = np.argsort(owner, kind="stable")
    duration, s0, v0, a0, j = np.concatenate([of_changes, of_steady])[order].T
    return Phases(
        start=cumulated(duration[:-1]),
        duration=duration,
        s0=s0,
        v0=v0,
        a0=a0,
        j=j,
        block=owner[order],
    )


def check_room(b: Blocks) -> None:
    """Raises ImpossibleError where a block does not hold its change of speed."""
    needed = (b.v0 + b.v1) / 2 * change_duration(np.abs(b.v1 - b.v0), b.a, b.j)
    n = first_true(~(needed <= b.length * (1 + AGREEMENT)))
    if n is not None:
        raise _impossible(b, n, f"{b.length[n]:.3g} m do not hold the change from {b.v0[n]:.3g} to {b.v1[n]:.3g} m/s")


def _ask_ruckig(b: Blocks, progress: Callable[[float], None]) -> tuple[Array, Array]:
    """ruckig's answer for each block: seven stretches, their durations [s] and jerks [m/s3], (B, 7) each.

    Some of them last no time.

    Raises:
        ImpossibleError: It refuses one, or wants to brake before it begins.
    """
    solver, question, answer = Ruckig(1), InputParameter(1), Trajectory(1)
    question.current_position, question.target_position = [0.0], [1.0]
    question.current_acceleration, question.target_acceleration = [0.0], [0.0]
    question.max_jerk = [1.0]
    B, time = len(b.v), np.cbrt(b.length / b.j)
    speeds, acceleration = [v * time / b.length for v in (b.v0, b.v1, b.v)], b.a * time**2 / b.length
    profiles = []
    for n, v0, v1, v, a in zip(range(B), *(x.tolist() for x in (*speeds, acceleration)), strict=True):
        question.current_velocity, question.target_velocity = [v0], [v1]
        question.max_velocity, question.max_acceleration = [v], [a]
        try:
            solver.validate_input(
                question, check_current_state_within_limits=True, check_target_state_within_limits=True
            )
            outcome = solver.calculate(question, answer)
        except RuckigError as refusal:
            raise _impossible(b, n, f"ruckig: {' '.join(str(refusal).split())[:80]}") from refusal
        if outcome not in (Result.Working, Result.Finished):
            raise _impossible(b, n, f"ruckig answers {outcome.name}")
        profile = answer.profiles[0][0]
        if profile.brake.duration or profile.accel.duration:
            raise _impossible(b, n, "ruckig brakes outside the change of speed")
        profiles.append((profile.t, profile.j))
        if n % REPORTED == 0:
            progress(n / B)
    answers = np.array(profiles).reshape(B, 2, STRETCHES)
    return answers[:, 0] * time[:, None], answers[:, 1] * b.j[:, None]


def _integrate(b: Blocks, duration: Array, jerk: Array) -> tuple[Array, IntArray]:
    """The P stretches that last, one after the other: duration, s, v and a at its start, and j; and its block, (P,).

    Raises:
        ImpossibleError: In a block they lead backwards, beyond a limit, or to another end than the block's.
    """
    states = np.empty((*duration.shape, 3))  # s, v, a at the start of each
    s, v, a = np.zeros_like(b.v), b.v0, np.zeros_like(b.v)
    lowest, highest, hardest = v, v, a
    for k in range(STRETCHES):
        t, j = duration[:, k], jerk[:, k]
        states[:, k] = np.column_stack([s, v, a])
        turn = np.clip(np.divide(-a, j, out=np.zeros_like(a), where=j != 0), 0, t)  # where the speed turns, if it does
        v_turn = v + turn * (a + turn * j / 2)
        s, v, a_end = s + t * (v + t * (a / 2 + t * j / 6)), v + t * (a + t * j / 2), a + t * j
        a = np.where(np.abs(a_end) <= ROUNDING * np.abs(a), 0.0, a_end)
        lowest, highest = np.minimum(lowest, np.minimum(v, v_turn)), np.maximum(highest, np.maximum(v, v_turn))
        hardest = np.maximum(hardest, np.abs(a))
    for holds, fault in (
        ((duration >= 0).all(axis=1), "ruckig's answer goes back in time"),
        (lowest >= -ROUNDING * highest, "ruckig's answer drives backwards"),
        (np.abs(s - b.length) <= AGREEMENT * b.length, "ruckig's answer has another length"),
        (np.abs(v - b.v1) <= AGREEMENT * highest, "ruckig's answer ends at another speed"),
        (np.abs(a) <= AGREEMENT * b.a, "ruckig's answer ends in acceleration"),
        (highest <= b.v * (1 + AGREEMENT), "ruckig's answer is too fast"),
        (hardest <= b.a * (1 + AGREEMENT), "ruckig's answer accelerates too much"),
        (np.abs(jerk).max(axis=1) <= b.j * (1 + AGREEMENT), "ruckig's answer jerks too much"),
    ):
        if not holds.all():
            raise _impossible(b, int(np.argmin(holds)), fault)
    states[:, :, 0] += b.start[:, None]
    keep = np.flatnonzero(duration.ravel() > 0)
    columns = np.column_stack([duration.ravel(), states.reshape(-1, 3), jerk.ravel()])
    return columns[keep], keep // STRETCHES


def _impossible(b: Blocks, n: int, reason: str) -> ImpossibleError:
    return ImpossibleError(
        f"timing: no motion at {b.start[n]:.4f} m along the path within the joint limits: {reason}; "
        "lower process.feed_mm_s"
    )
