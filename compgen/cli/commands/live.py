"""The sliders of a what-if page: made after the study, and checked against the full computation."""

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from compgen.cli.screen.progress_bar import GENERATE, show_progress
from compgen.core.exceptions import CompgenError

if TYPE_CHECKING:
    from compgen.report.live import LiveSection


def sliders(path: str, robot: str | None, overrides: Sequence[str], quiet: bool, alone: bool) -> "LiveSection":
    """The living section of a path's page; where a path has none, what is missing.

    Args:
        path: The path file.
        robot: Robot name or file; None for what the path file says.
        overrides: Of both files.
        quiet: No progress.
        alone: Whether nothing else is on the page.

    Raises:
        CompgenError: The path cannot be read, driven or corrected, and there is nothing else on the page.
    """
    from compgen.pipelines.study.live_build import build_live, check
    from compgen.report.live import live_section, without_sliders

    try:
        with show_progress(quiet, GENERATE) as progress:
            live_job = build_live(path, robot, overrides, progress)
            agreement = check(live_job)
    except CompgenError as failure:
        if alone:
            raise
        return without_sliders(" ".join(str(failure).split()))
    section = live_section(live_job, agreement, path, robot, overrides)
    if section.warning:
        sys.stderr.write(f"warning: {section.warning}\n")
    return section
