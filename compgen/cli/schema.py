"""The command that prints the JSON Schema of a path or robot file."""

import sys
from pathlib import Path
from typing import Annotated, Literal

import typer

from compgen.cli.options import Json, Quiet
from compgen.cli.ownership import check_own_file
from compgen.cli.publish import write_file


def schema(
    kind: Annotated[Literal["path", "robot"], typer.Argument(help="Which kind of file.", show_default=False)],
    output: Annotated[str | None, typer.Option("-o", "--output", help="A file to write it to.")] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Print the JSON Schema of path or robot files."""
    from compgen.pipelines.json_schema import path_schema, robot_schema, schema_text

    if output is not None:
        check_own_file("-o", output, b'"$schema"', "schema")
    text = schema_text(path_schema() if kind == "path" else robot_schema())
    if output is not None:
        write_file(Path(output), text.encode())
    if output is None or as_json:
        sys.stdout.write(text)
