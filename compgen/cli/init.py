"""The command that lays down the shipped robots and paths."""

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from compgen.cli import publish
from compgen.cli.app import app, write_file
from compgen.core.exceptions import InputError
from compgen.core.toml import shipped


@app.command()
def init(folder: Annotated[str, typer.Argument(help="Where to; default here.")] = ".") -> None:
    """Lay down the robots, paths and schemas that come with compgen."""
    place = Path(folder)
    kinds = ("robots", "paths")
    for kind in kinds:
        publish.check_writable((place / kind).absolute())
    laid = 0
    for kind in kinds:
        target = place / kind
        try:
            target.mkdir(parents=True, exist_ok=True)
            for source in sorted(f for ending in ("*.toml", "*.schema.json") for f in (shipped() / kind).glob(ending)):
                if not os.path.lexists(target / source.name):
                    write_file(target / source.name, source.read_bytes())
                    laid += 1
        except OSError as failure:
            raise InputError(f"{target}: cannot be written: {failure.strerror}; give another folder") from failure
    sys.stdout.write(
        f"{laid} files laid down in {place / 'robots'} and {place / 'paths'}; files already there are kept\n"
    )
