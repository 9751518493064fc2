"""What an exit code means is said in one place; the page of the command line says the same."""

import re

from shipped import ROOT

from compgen.core.exceptions import ImpossibleError, InputError
from compgen.core.exit_codes import ExitCode


def test_the_page_has_each_code_with_its_sentence():
    page = (ROOT / "docs" / "cli.md").read_text().partition("## Exit codes")[2].partition("\n## ")[0]
    rows = [row.strip("| ").split(" | ") for row in page.splitlines() if re.match(r"\| \d", row)]
    codes = [int(number) for numbers, _ in rows for number in numbers.split(", ")]
    assert codes == list(ExitCode)
    for numbers, sentence in rows:
        assert sentence == ", ".join(ExitCode(int(number)).sentence for number in numbers.split(", "))


def test_exceptions_end_with_their_code():
    assert InputError.exit_code is ExitCode.BAD_INPUT
    assert ImpossibleError.exit_code is ExitCode.IMPOSSIBLE
    assert f"{ExitCode.CRASHED}" == "70"  # as records and messages have it
