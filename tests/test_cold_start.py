"""What a command loads: time is not measured here, but the libraries that would cost it are named."""

import subprocess
import sys
from pathlib import Path

import pytest
from conftest import path_file

HERE = Path(__file__).parents[1]
#: libraries that take longer to load than a short job to compute, and parts that only other commands need
HEAVY = ("scipy", "numpy.ma", "pydantic", "plotly", "rich", "urllib.request", "compgen.correction", "compgen.identify")
OTHERS = ("compgen.study", "compgen.dialects.fanuc_ls.pages", "compgen.dialects.fanuc_ls.listing")
SHOWN = tuple(name for name in HEAVY if name != "rich")  # a table at the end


def loaded(*words):
    """Modules after a command, which must succeed."""
    code = (
        f"import sys; sys.argv = ['compgen', *{list(words)!r}]\n"
        "from compgen.cli import main\n"
        "try: main()\n"
        "except SystemExit as left: assert not left.code, left.code\n"
        "sys.stderr.write(' '.join(['loaded', *sys.modules]))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=HERE)
    last = done.stderr.splitlines()[-1].split()
    assert last[0] == "loaded"
    return set(last[1:])


@pytest.mark.parametrize(
    ("words", "never"),
    [
        (["generate", "-q", "-o", "{out}"], HEAVY + OTHERS),
        (["generate", "-o", "{out}", "--set", "process.feed_mm_s=100"], SHOWN + OTHERS),
        (["predict", "-q", "-o", "{out}"], HEAVY + OTHERS),
        (["check", "-q"], HEAVY + OTHERS),
        (["heat", "-q", "-o", "{out}"], HEAVY),
    ],
    ids=["generate", "generate with a table", "predict", "check", "heat"],
)
def test_a_job_starts_without_what_it_does_not_use(tmp_path, words, never):
    command, *options = (w.format(out=tmp_path / "out") for w in words)
    modules = loaded(command, path_file("line_y"), *options)
    assert "compgen.config" in modules  # the names are those of modules
    assert modules & set(never) == set()


def test_help_starts_without_plotly_and_pydantic():
    assert loaded("--help") & {"plotly", "pydantic"} == set()


def test_looking_at_a_program_starts_without_the_libraries_of_a_job():
    never = {"scipy", "pydantic", "plotly", "pinocchio", "ruckig"}
    assert loaded("inspect", "tests/golden/MOVES.LS", "--json") & never == set()
