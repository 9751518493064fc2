"""A table on a page, for eyes, paper and screen readers: on a phone the rows of a wide one become blocks.

What is wider than the screen all the same scrolls in its own box.
"""

import re
from collections.abc import Collection, Iterable, Sequence

WIDE = 4  # columns of numbers beside the first, a column of words counted twice: more than a phone has room for


def table(head: Sequence[str], rows: Iterable[Sequence[str]], words: Collection[int] = (), stacks: bool = True) -> str:
    """A table whose first column names its rows.

    Args:
        head: Of each column, as HTML; one that begins with ``before`` or ``after`` is underlined as curves of it are.
        rows: Cells as HTML, as many as the head has.
        words: Columns of words, from 0; the others are numbers.
        stacks: Whether rows become blocks on a phone where they are wide; a long list is compared down its columns.
    """
    is_wide = stacks and len(head) - 1 + len([n for n in words if n]) >= WIDE
    labels = [_label(name) if is_wide else "" for name in head]
    columns = "".join(f'<th scope="col"{_classes(_side(name), n in words)}>{name}</th>' for n, name in enumerate(head))
    lines = "".join(
        f'<tr><th scope="row">{first}</th>'
        + "".join(f"<td{_classes('', n in words)}{labels[n]}>{cell}</td>" for n, cell in enumerate(rest, 1))
        + "</tr>"
        for first, *rest in rows
    )
    content = (
        f"<table{_classes('stacks' if is_wide else '')}><thead><tr>{columns}</tr></thead><tbody>{lines}</tbody></table>"
    )
    return f'<div class="scroll" tabindex="0">{content}</div>'


def _label(head: str) -> str:
    """A column's heading as what its cells carry with them where rows are blocks."""
    return f' data-head="{re.sub("<[^>]*>", "", head).replace(chr(34), "&quot;")}"'


def _side(name: str) -> str:
    first = name.split(" ", 1)[0]
    return first if first in ("before", "after") else ""


def _classes(*names: str | bool) -> str:
    words = [name if isinstance(name, str) else "text" for name in names if name]
    return f' class="{" ".join(words)}"' if words else ""
