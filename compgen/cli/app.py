"""The application: its commands, in the sections of the help.

Commands import what they work with when they are called: the help, the version and shell completion need none of it.
"""

import sys
from collections.abc import Callable
from functools import cache
from inspect import getdoc
from typing import Annotated, Any, cast

import typer
import typer.core

from compgen.cli.command_frame import Outcome, framed
from compgen.cli.commands.check import check
from compgen.cli.commands.compare import compare
from compgen.cli.commands.correct import correct
from compgen.cli.commands.explain import explain
from compgen.cli.commands.follow import follow
from compgen.cli.commands.identify import check_robot, identify
from compgen.cli.commands.init import init, schema
from compgen.cli.commands.inspect import check_backup, inspect
from compgen.cli.commands.jobs import generate, predict
from compgen.cli.commands.offsets import offsets
from compgen.cli.commands.pages import pages
from compgen.cli.commands.plan_poses import plan_poses
from compgen.cli.commands.position_logs import executed, identify_motion, plan_motion_log
from compgen.cli.commands.resume import resume
from compgen.cli.commands.robots import export_robot, inspect_robot
from compgen.cli.commands.touches import anchor, plan_touches, teach_frame
from compgen.cli.commands.whatif import heat, whatif
from compgen.cli.options.completion import doc_place
from compgen.cli.screen.messages import print_note_once
from compgen.core.commands import RENAMED
from compgen.core.version import __version__

#: the help's sections, commands in the order of work
SECTIONS = {
    "Start here": (init, inspect, correct, predict, generate, check),
    "Programs": (pages, check_backup, executed),
    "While a job runs": (resume, follow, anchor, offsets),
    "What if": (heat, whatif, compare),
    "Measurements": (plan_poses, identify, check_robot, plan_touches, teach_frame, plan_motion_log, identify_motion),
    "Files and words": (inspect_robot, export_robot, schema, explain),
}
#: the page of docs/ that explains a command
PAGES = {
    "own_paths": ("generate",),
    "report": ("predict",),
    "ci": ("check",),
    "correct": ("inspect", "correct"),
    "long_programs": ("pages",),
    "loading": ("check-backup",),
    "executed": ("executed", "plan-motion-log", "identify-motion"),
    "resume": ("resume", "follow"),
    "anchor": ("anchor", "offsets", "plan-touches"),
    "heat": ("heat",),
    "whatif": ("whatif",),
    "compare": ("compare",),
    "identify": ("plan-poses", "identify", "check-robot", "teach-frame"),
    "robots": ("inspect-robot", "export-robot", "init"),
    "keys": ("schema",),
    "findings": ("explain",),
}
NAMES = {title: tuple(c.__name__.replace("_", "-") for c in commands) for title, commands in SECTIONS.items()}


class SectionedHelp(typer.core.TyperGroup):
    """An application whose help lists its commands in sections, and that knows those which were called otherwise."""

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command of a name; of one that it had before, too, which says so."""
        name = RENAMED.get(cmd_name, cmd_name)
        if name != cmd_name and not ctx.resilient_parsing:
            print_note_once(f"cgen {cmd_name} is called cgen {name} now")
        return self.commands.get(name)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands, a section after the other."""
        widest = max(map(len, self.commands))
        for title, names in NAMES.items():
            limit = formatter.width - 6 - widest
            rows = [(name.ljust(widest), self.commands[name].get_short_help_str(limit)) for name in names]
            with formatter.section(title):
                formatter.write_dl(rows)


app = typer.Typer(
    cls=SectionedHelp,
    help="Predict where a warming robot's tool will be, and write the program that cancels the error.",
    epilog=f"\b\ncgen help COMMAND, cgen COMMAND --help: its options. All pages: {doc_place('index')}\n\n"
    "\b\nExample:\n  cgen init && cgen generate paths/spiral_1300.toml",
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


@app.callback(invoke_without_command=True)
def print_version(*, version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    """Answer ``--version``; typer takes the help of the whole application from ``app``."""
    if version:
        sys.stdout.write(f"compgen {__version__}\n")
        raise typer.Exit()


def _add(name: str, command: Callable[..., Outcome]) -> None:
    """Give the application a command; the help is its docstring, the examples at its end follow the options."""
    words, _, examples = str(getdoc(command)).partition("\n\nExamples:\n")
    title = "Examples" if "\n" in examples else "Example"
    page = next(page for page, names in PAGES.items() if name in names)
    lines = [f"\b\nExplained in {doc_place(page)}\n\n\b\n{title}:", *(f"  {e.strip()}" for e in examples.splitlines())]
    app.command(name, help=words, epilog="\n".join(lines))(framed(command))


for title, commands in SECTIONS.items():
    for name, command in zip(NAMES[title], commands, strict=True):
        _add(name, command)


@cache
def command_group() -> SectionedHelp:
    """The application with its commands as the parser has them; laying them out takes as long as a small command."""
    return cast(SectionedHelp, typer.main.get_command(app))


def options_of_commands() -> dict[str, set[str]]:
    """The options of each command, by its name."""
    return {
        name: {word for p in command.params for word in (*p.opts, *p.secondary_opts) if word.startswith("-")}
        for name, command in command_group().commands.items()
    }
