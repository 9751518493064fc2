"""Two outputs side by side, in a notebook."""

from dataclasses import dataclass
from typing import Any

from compgen.core.exceptions import RESULT, refuse_changes
from compgen.pipelines.comparison.comparison import Comparison
from compgen.pipelines.comparison.comparison import compare as pipeline
from compgen.report.compare_page import comparison_files, courses_figure
from compgen.report.compare_words import comparison_record, what_changed
from compgen.report.notebook.arguments import File, file_name
from compgen.report.notebook.machine import numpy_alone, plotly_figure

OUTPUT = "the folder of an output, as 'outputs/spiral_1300', or its JSON report"


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class ComparedOutputs:
    """What differs between outputs A and B."""

    result: Comparison  # the whole result, for who needs more
    report: dict[str, Any]  # as compare.json has it

    @property
    def equal(self) -> bool:
        """Whether inputs, numbers, positions and findings are the same."""
        return self.result.is_equal

    @property
    def inputs(self) -> dict[str, tuple[Any, Any]]:
        """Keys whose values differ, with the value in A and in B; None where one has none."""
        return {pair.key: (pair.a, pair.b) for pair in self.result.inputs or ()}

    def plot(self) -> Any:
        """A plotly Figure: the errors of both over the path.

        Raises:
            InputError: Neither has a table of them: reports were given alone.
        """
        drawn = courses_figure(self.result)
        figures = {} if drawn is None else {"courses": drawn}
        return plotly_figure(figures, {"courses": "Both errors"}, "courses")

    def files(self) -> dict[str, bytes]:
        """Name to content of what ``cgen compare -o`` writes, byte for byte; nothing is written."""
        return comparison_files(self.result)

    def __repr__(self) -> str:
        return f"<ComparedOutputs: {what_changed(self.result)}>"


refuse_changes(ComparedOutputs, *RESULT)


def compare(first: File, second: File) -> ComparedOutputs:
    """Set two outputs of one command side by side; the same as ``cgen compare``.

    Args:
        first: Folder of an output of generate, predict, correct, whatif or heat, or its JSON report: A.
        second: Another one: B.

    Returns:
        What differs.

    Raises:
        InputError: One is no output, damaged, edited since, of another command or schema; or both are one.
    """
    names = file_name(first, "first", OUTPUT), file_name(second, "second", OUTPUT)
    with numpy_alone():
        result = pipeline(*names)
    return ComparedOutputs(result, comparison_record(result))
