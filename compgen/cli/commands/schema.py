"""The command that prints the JSON Schema of a path or robot file."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from compgen.cli.frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.output_files.ownership import check_own_file
from compgen.cli.output_files.publish import write_file
from compgen.cli.screen.messages import print_record
from compgen.core.json_text import json_text


def schema(
    kind: Annotated[Literal["path", "robot"], typer.Argument(help="Which kind of file.", show_default=False)],
    *,
    output: Annotated[str | None, typer.Option("-o", "--output", help="A file to write it to.")] = None,
    screen: opt.Screen,
) -> Outcome:
    """Print the JSON Schema of path or robot files.

    Examples:
        cgen schema path -o path.schema.json
        cgen schema robot
    """
    from compgen.pipelines.files.schema import path_schema, robot_schema

    if output is not None:
        check_own_file("-o", output, '"$schema"', "schema")
    record = path_schema() if kind == "path" else robot_schema()
    if output is None:
        print_record(record)
        return Outcome()
    write_file(Path(output), json_text(record))
    return Outcome(record=record)
