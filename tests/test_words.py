"""Words of the command line: converted as typer itself would."""

from typing import Annotated

import typer

from compgen.cli.words import command

app = typer.Typer()
SEEN = []


@app.command()
def take(
    word: str,
    many: Annotated[list[str] | None, typer.Option()] = None,
    count: Annotated[int | None, typer.Option(min=1, max=9)] = None,
    share: float = 0.5,
    on: bool = False,
) -> None:
    """Take everything."""
    SEEN.append((word, many, count, share, on))


@app.command()
def other() -> None:
    """Another, so that commands have names."""


def both(*words):
    """What the command got, or what was said, by our way and by typer's own."""
    found = []
    for one in (command(app), typer.main.get_command(app)):
        SEEN.clear()
        try:
            one(["take", *words], standalone_mode=False)
            found.append(list(SEEN))
        except typer.TyperException as failure:
            found.append((type(failure), failure.format_message()))
    return found


def test_everything_arrives_as_with_typer():
    for words in (
        ["a"], ["a", "--many", "x", "--many", "y=1"], ["a", "--count", "3", "--share", "2"], ["", "--on"], ["3"],
        ["a", "--count", "0"], ["a", "--count", "q"], ["a", "--share", "x"], [], ["a", "b"], ["a", "--nonsense"],
    ):  # fmt: skip
        mine, theirs = both(*words)
        assert mine == theirs, words
    ((word, _, count, share, on),), _ = both("a", "--count", "3", "--on")
    assert (word, count, share, on) == ("a", 3, 0.5, True)
