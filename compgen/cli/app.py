"""The application: its commands, in the order of the help.

Commands import what they work with when they are called: the help, the version and shell completion need none of it.
"""

import sys
from typing import Annotated

import typer

from compgen import __version__
from compgen.cli.anchor import anchor
from compgen.cli.correct import correct
from compgen.cli.executed import executed
from compgen.cli.export_robot import export_robot
from compgen.cli.follow import follow
from compgen.cli.heat import heat
from compgen.cli.identify import identify, validate
from compgen.cli.identify_motion import identify_motion
from compgen.cli.init import init
from compgen.cli.inspect import inspect
from compgen.cli.inspect_robot import inspect_robot
from compgen.cli.jobs import check, generate, predict
from compgen.cli.offsets import offsets
from compgen.cli.pages import pages
from compgen.cli.plan_poses import plan_poses
from compgen.cli.plan_touches import plan_touches
from compgen.cli.resume import resume
from compgen.cli.schema import schema
from compgen.cli.teach_frame import teach_frame
from compgen.cli.verify_backup import verify_backup
from compgen.cli.whatif import whatif

app = typer.Typer(
    help="Predict where a warming robot's tool will be, and write the program that cancels the error.",
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


@app.callback(invoke_without_command=True)
def print_version(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    """Answer ``--version``; typer takes the help of the whole application from ``app``."""
    if version:
        sys.stdout.write(f"compgen {__version__}\n")
        raise typer.Exit()


for command in (
    generate,
    predict,
    check,
    inspect,
    correct,
    pages,
    verify_backup,
    executed,
    resume,
    follow,
    heat,
    whatif,
    identify,
    validate,
    identify_motion,
    teach_frame,
    anchor,
    plan_poses,
    plan_touches,
    offsets,
    inspect_robot,
    export_robot,
    init,
    schema,
):
    app.command()(command)
