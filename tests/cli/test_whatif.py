"""The questions that the help of whatif lists."""

from compgen.cli.whatif import QUESTIONS
from compgen.pipelines.study import ASKS


def test_the_help_lists_the_questions_that_are_answered():
    assert QUESTIONS == (*ASKS, "passes")
