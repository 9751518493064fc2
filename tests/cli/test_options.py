"""What the options have by default."""

from compgen.cli.options import DEFAULT_DATE
from compgen.pipelines.program_text import DATE


def test_the_date_of_the_help_is_the_date_of_the_programs():
    assert DEFAULT_DATE == DATE
