"""Writes docs/gallery.md and its pictures, by running the commands that stand beside them.

    python docs/gallery.py [NAME]

Every picture has the commands that make its numbers, run in an empty folder after `cgen init`, and a caption whose
numbers come from the files that they leave.
"""

import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import tomllib
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))
import gallery_pictures  # noqa: E402

FOLDER = HERE / "gallery"
INTRODUCTION = """\
# Gallery

What compgen does, in pictures, each with its commands, run in an empty folder after `cgen init`.
`python docs/gallery.py` draws them.
"""
#: laid beside the paths, for those who touch spheres
BESIDE = ("artefact.toml", "touches.csv")


@dataclass(frozen=True)
class Picture:
    """A picture with the commands that make it."""

    name: str
    title: str
    caption: str  # the numbers of the drawing in braces
    commands: list[str]
    more: str  # page of docs/
    output: str = ""  # file that the last command's output goes to


PICTURES = [Picture(**entry) for entry in tomllib.loads((FOLDER / "pictures.toml").read_text())["picture"]]


def prepare(folder: Path) -> None:
    """Lay down what the commands begin with."""
    run("cgen init", folder)
    for name in BESIDE:
        shutil.copy(FOLDER / name, folder / name)


def run(command: str, folder: Path, output: str = "") -> None:
    """Run a command as it stands in the gallery, with the package of this checkout."""
    arguments = [sys.executable, "-m", "compgen", *shlex.split(command)[1:]]
    environment = {**os.environ, "PYTHONPATH": str(HERE.parent)}
    done = subprocess.run(arguments, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"{command}: exit {done.returncode}: {done.stderr}")
    if output:
        (folder / output).write_text(done.stdout)


def make(picture: Picture, folder: Path, ran: set[str]) -> tuple[str, dict[str, str]]:
    """Run a picture's commands, but for those that ran in this folder, and draw it."""
    for command in picture.commands:
        if command not in ran:
            run(command, folder, picture.output)
            ran.add(command)
    return getattr(gallery_pictures, picture.name)(folder)


def section(picture: Picture, numbers: dict[str, str]) -> str:
    """A picture's part of the page."""
    commands = "\n".join(command + (f" > {picture.output}" if picture.output else "") for command in picture.commands)
    caption = picture.caption.format(**numbers)
    title = (HERE / picture.more.partition("#")[0]).read_text().partition("\n")[0].lstrip("# ")
    return (
        f"## {picture.title}\n\n![{picture.title}](gallery/{picture.name}.svg)\n\n{caption}\n\n"
        f"```sh\n{commands}\n```\n\n[{title}]({picture.more})\n"
    )


def page(sections: list[str]) -> str:
    """The text of docs/gallery.md."""
    return "\n".join([INTRODUCTION, *sections])


def main() -> None:
    """Draw all pictures, or the one that is named."""
    names = sys.argv[1:] or [picture.name for picture in PICTURES]
    sections = []
    with tempfile.TemporaryDirectory() as temporary:
        folder, ran = Path(temporary), set[str]()
        prepare(folder)
        for picture in PICTURES:
            if picture.name in names:
                svg, numbers = make(picture, folder, ran)
                (FOLDER / f"{picture.name}.svg").write_text(svg)
                sections.append(section(picture, numbers))
    if len(sections) == len(PICTURES):
        (HERE / "gallery.md").write_text(page(sections))


if __name__ == "__main__":
    main()
