"""The command that lays down the shipped robots and paths."""

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from compgen.cli.publish import check_writable, write_file
from compgen.core.exceptions import InputError

KINDS = ("robots", "paths")


def init(folder: Annotated[str, typer.Argument(help="Where to; default here.")] = ".") -> None:
    """Lay down the robots, paths and schemas that come with compgen."""
    from compgen.core.toml import shipped

    for kind in KINDS:
        check_writable((Path(folder) / kind).absolute())
    count = 0
    for kind in KINDS:
        target = Path(folder) / kind
        try:
            target.mkdir(parents=True, exist_ok=True)
            folder_files = (f for suffix in ("*.toml", "*.schema.json") for f in (shipped() / kind).glob(suffix))
            for source in sorted(folder_files):
                if not os.path.lexists(target / source.name):
                    write_file(target / source.name, source.read_bytes())
                    count += 1
        except OSError as failure:
            raise InputError(f"{target}: cannot be written: {failure.strerror}; give another folder") from failure
    robots, paths = (Path(folder) / kind for kind in KINDS)
    sys.stdout.write(f"{count} files laid down in {robots} and {paths}; files already there are kept\n")
