"""What a terminal shows of a long run: the stage at work, the share of the whole, waypoints a second, the time left."""

import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, ProgressColumn, Task, TextColumn
from rich.progress import Progress as Bar
from rich.text import Text

from compgen.core import interrupts, stages
from compgen.core.stages import Progress, RunStage

#: the stages of a run in their order, and what each takes of its time; what takes none has its name shown
GENERATE = {
    stages.PATH: 8, stages.TIMING: 15, stages.TWIN_BEFORE: 20, stages.CORRECTION: 3, stages.THINNING: 1,
    stages.FINAL_TIMING: 5, stages.TEXT: 22, stages.TWIN_AFTER: 7, stages.CROSS_FLIGHT: 2, stages.DRAWS: 20,
    stages.REPORT: 19,
}  # fmt: skip
PREDICT = {stages.PATH: 15, stages.TIMING: 35, stages.TWIN_BEFORE: 30, stages.REPORT: 20}
CHECK = {**GENERATE, stages.REPORT: 0}
CORRECT = {
    stages.READING: 25, stages.CORRECTION: 35, stages.TWIN_BEFORE: 10, stages.TWIN_AFTER: 10, stages.DRAWS: 20,
    stages.REPORT: 20,
}  # fmt: skip
RESUME = {
    stages.PATH: 20, stages.TIMING: 25, stages.CORRECTION: 10, stages.FINAL_TIMING: 10, stages.TEXT: 15,
    stages.TWIN_AFTER: 10, stages.REPORT: 10,
}  # fmt: skip

DELAY = 0.5  # s: a run that takes no longer shows no bar
LEAST_SHARE = 0.03  # from which on the time left is more than a guess


@contextmanager
def show_progress(
    weights: Mapping[RunStage, float] | None = None, delay: float = DELAY, *, quiet: bool
) -> Iterator[Progress]:
    """A bar for the whole run, on a terminal only; errors come after it has gone.

    Args:
        weights: The stages in their order and what each takes of the whole; None where shares are of the whole run.
        delay: Before it is shown [s].
        quiet: No bar at all.
    """
    interrupts.raise_on_signal()
    console = Console(stderr=True, force_terminal=sys.stderr.isatty())
    if quiet or not console.is_terminal:
        yield lambda stage, share: interrupts.raise_if_interrupted()
        return
    bar = _StageBar(console, weights, delay)
    try:
        yield bar.update
    finally:
        bar.stop()


class _StageBar:
    """One bar over all stages, shown after a delay [s]; its share never falls."""

    def __init__(self, console: Console, weights: Mapping[RunStage, float] | None, delay: float) -> None:
        self._weights, self._delay = weights, delay
        self._start = time.monotonic()
        self._share = 0.0
        self._waypoints = 0
        self._bar = Bar(
            TextColumn("{task.description:<12}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"),
            TextColumn("{task.fields[rate]}"), _TimeLeftColumn(), console=console, transient=True,
        )  # fmt: skip

    def update(self, stage: RunStage, share: float) -> None:
        """Show a stage and how much of it is done."""
        interrupts.raise_if_interrupted()
        self._waypoints = stage.waypoints or self._waypoints
        self._share = max(self._share, overall_share(self._weights, stage, share))
        now = time.monotonic()
        elapsed = now - self._start
        if elapsed < self._delay:
            return
        if not self._bar.task_ids:
            self._bar.add_task(stage.name, total=1.0, rate="", left=None, updated=now)
            self._bar.start()
        per_second = self._waypoints * self._share / elapsed
        self._bar.update(
            self._bar.task_ids[0],
            description=f"{stage.name}: {stage.detail}" if stage.detail else stage.name,
            completed=self._share,
            rate=f"{int(float(f'{per_second:.2g}')):,d} waypoints/s" if per_second else "",  # more would only flicker
            left=elapsed * (1 / self._share - 1) if self._share > LEAST_SHARE and stage.is_even else None,
            updated=now,
        )

    def stop(self) -> None:
        """Take the bar off the terminal, if it was shown."""
        if self._bar.task_ids:
            self._bar.stop()


class _TimeLeftColumn(ProgressColumn):
    """Counts down between two updates."""

    def render(self, task: Task) -> Text:
        return Text(time_left_text(task.fields["left"], time.monotonic() - task.fields["updated"]))


def overall_share(weights: Mapping[RunStage, float] | None, stage: RunStage, share: float) -> float:
    """The share of the whole run that is done when so much of a stage is."""
    if weights is None:
        return share
    names = [each.name for each in weights]
    if stage.name not in names:
        return 0.0
    taken, at = list(weights.values()), names.index(stage.name)
    return (sum(taken[:at]) + taken[at] * min(1.0, share)) / sum(taken)


def time_left_text(left: float | None, age: float) -> str:
    """Time left in words, so long after it was worked out [s]."""
    if left is None:
        return "time left: ?"
    seconds = max(1, round(left - age))
    if seconds < 100:
        return f"{seconds} s left"
    return f"{seconds // 3600}:{seconds // 60 % 60:02d}:{seconds % 60:02d} left"
