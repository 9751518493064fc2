"""A table on a page, for eyes, paper and screen readers; what is wider than the screen scrolls in its own box."""

from collections.abc import Collection, Iterable, Sequence


def table(head: Sequence[str], rows: Iterable[Sequence[str]], words: Collection[int] = ()) -> str:
    """A table whose first column names its rows.

    Args:
        head: Of each column, as HTML; one that begins with ``before`` or ``after`` is underlined as curves of it are.
        rows: Cells as HTML, as many as the head has.
        words: Columns of words, from 0; the others are numbers.
    """
    columns = "".join(f'<th scope="col"{_classes(_side(name), n in words)}>{name}</th>' for n, name in enumerate(head))
    lines = "".join(
        f'<tr><th scope="row">{first}</th>'
        + "".join(f"<td{_classes('', n in words)}>{cell}</td>" for n, cell in enumerate(rest, 1))
        + "</tr>"
        for first, *rest in rows
    )
    content = f"<table><thead><tr>{columns}</tr></thead><tbody>{lines}</tbody></table>"
    return f'<div class="scroll" tabindex="0">{content}</div>'


def _side(name: str) -> str:
    first = name.split(" ", 1)[0]
    return first if first in ("before", "after") else ""


def _classes(*names: str | bool) -> str:
    words = [name if isinstance(name, str) else "text" for name in names if name]
    return f' class="{" ".join(words)}"' if words else ""
