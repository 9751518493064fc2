"""Writes docs/commands.md: every command with its options and an example, from the application itself.

python docs/command_tables.py
"""

import re
from collections.abc import Iterator
from pathlib import Path

from typer.main import get_command

from compgen.cli.app import PAGES, SECTIONS, app

PAGE = Path(__file__).parent / "commands.md"
INTRODUCTION = """\
# Commands

Made by `python docs/command_tables.py` from the application, which says the same by `cgen COMMAND --help`
or `cgen help COMMAND`. `*` marks what must be given. Options that mean the same
everywhere, exit codes and pipes: [the command line](cli.md).
"""


def page() -> str:
    """The text of docs/commands.md."""
    lines = [INTRODUCTION]
    for section, functions in SECTIONS.items():
        names = [function.__name__.replace("_", "-") for function in functions]
        lines += [f"## {section}", "", *(line for name in names for line in _command(name))]
    return "\n".join(lines)


def _command(name: str) -> Iterator[str]:
    """A command: what it does, where that is explained, an example, its arguments and options."""
    command = get_command(app).commands[name]  # type: ignore[attr-defined]
    context = command.make_context(name, [], resilient_parsing=True)
    pages = [page for page, names in PAGES.items() if name in names]
    links = [
        f"[{(PAGE.parent / f'{page}.md').read_text().split(chr(10))[0].lstrip('# ')}]({page}.md)" for page in pages
    ]
    example = re.split("Examples?:", command.epilog)[1].split("\n")
    yield from (f"### cgen {name}", "", " ".join([_words(command.help), *links]), "")
    yield from ("```sh", *(line.strip() for line in example if line.strip()), "```", "")
    yield from ("| argument, option | meaning |", "|---|---|")
    for parameter in command.params:
        record = parameter.get_help_record(context)
        if record:
            written, must = record[0].strip().replace("|", "/"), "*" if parameter.required else ""
            yield f"| `{written}`{must} | {_words(record[1].replace('[required]', ''))} |"
    yield ""


def _words(text: str) -> str:
    """Plain words as a table's cell has them."""
    words = re.sub(r"\s+", " ", text.replace("\b", "")).strip()
    return words.replace("|", "\\|").replace("<", "&lt;")


if __name__ == "__main__":
    PAGE.write_text(page())
