"""The scenarios of a study: computed, kept on disk as they come, shown on a bar."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from compgen.cli.output_files import study_journal
from compgen.core import interrupts
from compgen.core.exceptions import CompgenError
from compgen.pipelines.study import Row, Study, run


def run_scenarios(study: Study, folder: Path, workers: int, cluster: str | None, fresh: bool, quiet: bool) -> list[Row]:
    """The rows of all scenarios; those of an earlier run of the same study are taken as they are, unless ``fresh``."""
    rows = [] if fresh else study_journal.read_finished(folder, study.identity)
    rows = [row for row in rows if row["index"] < len(study.scenarios)]
    if len(rows) < len(study.scenarios):
        interrupts.raise_on_signal()
        journal = study_journal.Journal(folder, study.identity, rows)
        interrupts.set_outcome("finished scenarios are kept")
        try:
            with _scenario_bar(len(study.scenarios), len(rows), quiet) as advance:

                def keep(new: list[Row]) -> None:
                    journal.add(new)
                    rows.extend(new)
                    advance(len(new))

                run(study, {row["index"] for row in rows}, keep, workers, cluster)
        except CompgenError:
            journal.discard_empty()
            raise
        finally:
            journal.close()
    return sorted(rows, key=lambda row: row["index"])


@contextmanager
def _scenario_bar(total: int, done: int, quiet: bool) -> Iterator[Callable[[int], None]]:
    """Scenarios done and the time left, on a terminal only."""
    console = Console(stderr=True, force_terminal=sys.stderr.isatty())
    if quiet or not console.is_terminal:  # a bar that is disabled still ends its line before rich 14.3
        yield lambda count: None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("scenarios", total=total, completed=done)
        yield lambda count: bar.advance(task, count)
