"""The least of an input that still fails."""

from collections.abc import Callable
from typing import TypeVar

Part = TypeVar("Part")


def shrunk(parts: list[Part], fails: Callable[[list[Part]], bool], tries: int = 400) -> list[Part]:
    """Fewest of the parts with which it still fails: halves are left out, then quarters, down to single ones."""
    size = max(1, len(parts) // 2)
    while tries > 0:
        start, smaller = 0, False
        while start < len(parts) and tries > 0:
            fewer = parts[:start] + parts[start + size :]
            tries -= 1
            if fails(fewer):
                parts, smaller = fewer, True
            else:
                start += size
        if size == 1 and not smaller:
            break
        size = max(1, size // 2)
    return parts
