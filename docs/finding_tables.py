"""Writes docs/findings.md: every code of a finding, from their registry.

python docs/finding_tables.py
"""

from collections.abc import Iterator
from pathlib import Path

from compgen.cli.commands.explain import ROOMS
from compgen.core.finding_codes import Code

PAGE = Path(__file__).parent / "findings.md"
INTRODUCTION = """\
# Findings

A finding is what you must know of a result. Screen, page, JSON (`findings`) and JUnit name it by its code; its message
has the place and the numbers. `cgen explain CODE` says what its row here
says, `cgen explain FOLDER` that of each finding of a report. Its level says how much it weighs:

| level | what it does |
|---|---|
| `outside` | a bound is broken: the verdict is not "inside", the exit code is 1 |
| `refused` | what was identified may not be used, the exit code is 1 |
| `warning` | nothing is decided by it; read it before you load the program |
| `note` | good to know |

The screen and the page have findings of safety and of what was not done first, the rest by micrometres. Notes that
every job has are counted on the screen; `--verbose` prints them. Report, JSON and `--strict` keep all.

Made by `python docs/finding_tables.py` from `compgen/core/finding_codes.py`. The tables go by the [room](rooms.md) of
the package that finds it first.
"""


def page() -> str:
    """The text of docs/findings.md."""
    return "\n".join([INTRODUCTION, *(line for room, title in ROOMS.items() for line in _table(room, title))])


def _table(room: str, title: str) -> Iterator[str]:
    yield from (f"## {title}", "", f"Of `{room}/`.", "")
    yield from ("| code | level | what it means | what to do |", "|---|---|---|---|")
    for code in sorted(code for code in Code if code.room == room):
        levels = ", ".join(f"`{level}`" for level in code.levels)
        yield f'| <a id="{code}"></a>`{code}` | {levels} | {code.meaning} | {code.remedy} |'
    yield ""


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
