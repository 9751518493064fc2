"""What a terminal shows of a long run: the stage at work, the share of the whole, waypoints a second, the time left."""

import os
import re
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

from compgen.core import interrupts

if TYPE_CHECKING:  # a command that needs no pipeline starts without it, and one that shows no bar without rich
    from rich.progress import Progress

    from compgen.core.findings import Progress as Told

#: what each stage of a long run takes of its time; what takes none has its name shown
GENERATE = {
    "path": 8, "timing": 15, "twin before": 20, "correction": 3, "thinning": 1, "final timing": 5, "text": 22,
    "twin after": 7, "report": 19,
}  # fmt: skip
PREDICT = {"path": 15, "timing": 35, "twin before": 30, "report": 20}
CHECK = {**GENERATE, "report": 0}
CORRECT = {"reading": 25, "correction": 35, "twin before": 10, "twin after": 10, "report": 20}

PATIENCE = 0.5  # s: what takes no longer shows no bar
TELLING = 0.03  # share from which on the time left is more than a guess
#: what makes rich take a file or a pipe for a terminal
_FORCING = ("FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE")


@contextmanager
def stages(quiet: bool, course: Mapping[str, float] | None = None) -> "Iterator[Told]":
    """A bar for the whole run, on a terminal only; errors come after it has gone.

    Args:
        quiet: No bar at all.
        course: The stages in their order and what each takes of the whole; None where the shares told are of the whole.
    """
    if quiet or not (sys.stderr.isatty() or any(os.environ.get(name) for name in _FORCING)):
        yield lambda stage, share: interrupts.raise_if_interrupted()
        return
    began, done, count = time.monotonic(), 0.0, 0
    bar: Progress | None = None

    def show(stage: str, share: float) -> None:
        nonlocal done, count, bar
        interrupts.raise_if_interrupted()
        name = stage.partition(":")[0]
        told = re.search(r"(\d+) waypoints", stage)
        count = int(told[1]) if told else count
        done = max(done, of_whole(course, name, share))
        passed = time.monotonic() - began
        if passed < PATIENCE:
            return
        rate = f"{_round(count * done / passed):,d} waypoints/s" if count and done else ""
        left = passed * (1 / done - 1) if done > TELLING else None
        if bar is None:
            bar = _bar()
            bar.add_task(name, total=1.0, rate="", left=None, at=began)
            bar.start()
        bar.update(bar.task_ids[0], description=name, completed=done, rate=rate, left=left, at=time.monotonic())

    try:
        yield show
    finally:
        if bar is not None:
            bar.stop()


def of_whole(course: Mapping[str, float] | None, stage: str, share: float) -> float:
    """The share of the whole run that is done when so much of a stage is."""
    if course is None:
        return share
    names = list(course)
    if stage not in course:
        return 0.0
    before = sum(course[name] for name in names[: names.index(stage)])
    return (before + course[stage] * min(1.0, share)) / sum(course.values())


def time_left(left: float | None, since: float) -> str:
    """Time left in words, so long after it was last worked out [s]."""
    if left is None:
        return "time left: ?"
    seconds = max(1, round(left - since))
    if seconds < 100:
        return f"{seconds} s left"
    return f"{seconds // 3600}:{seconds // 60 % 60:02d}:{seconds % 60:02d} left"


def _round(rate: float) -> int:
    """Two figures: more would only flicker."""
    return int(float(f"{rate:.2g}"))


def _bar() -> "Progress":
    from rich.console import Console
    from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn
    from rich.text import Text

    class Left(ProgressColumn):
        """Counts down between two tellings."""

        def render(self, task: Task) -> Text:
            """The text at this moment."""
            return Text(time_left(task.fields["left"], time.monotonic() - task.fields["at"]))

    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description:<12}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"),
        TextColumn("{task.fields[rate]}"), Left(),
    )  # fmt: skip
    return Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
