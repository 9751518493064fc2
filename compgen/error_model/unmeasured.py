"""What no number of a robot file says: named beside every band, with the size that others found where there is one."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from compgen.core.exceptions import InputError
from compgen.core.toml import NotNegative, Table
from compgen.core.units import UM


class UnknownTable(Table):
    """Something that the file does not know, and that a part will see."""

    what: Annotated[str, Field(min_length=1, max_length=60, pattern=r"^[^\x00-\x1f\x7f]*$")]
    """What it is, in words."""
    size_um: Annotated[list[NotNegative], Field(min_length=2, max_length=2)] | None = None
    """Least and most that it was found to be."""
    from_: Annotated[str, Field(alias="from", max_length=200)] = ""
    """Where that was found."""
    until: Annotated[str, Field(max_length=40)] = ""
    """Source of the budget that ends it: once the file's values of that source are identified, it is known."""


@dataclass(frozen=True, slots=True)
class Unknown:
    """Something that a file does not know."""

    what: str
    size: tuple[float, float] | None  # [m]
    origin: str
    until: tuple[str, ...] = ()  # sources of the budget, and of the file, any of which ends it
    expected: float | None = None  # [m] within the size, where others let it be expected


NOT_LOOKED_AT = "not looked at here"  # where a size would be from

#: of a file that says nothing of what it does not know
NOT_KNOWN = (
    Unknown("cold geometry", None, "", ("geometry",)),
    Unknown("play", None, "", ("lost motion",)),
    Unknown("repeatability", None, "", ("repeatability",)),
    Unknown("the controller's motion", None, ""),
)

#: of a file without a table of warmth
OF_WARMTH = Unknown("warmth", None, "")


def unknown_of(tables: Sequence[UnknownTable], where: str) -> tuple[Unknown, ...]:
    """What a robot file says that it does not know.

    Raises:
        InputError: A size that does not rise.
    """
    rows = []
    for i, row in enumerate(tables):
        if row.size_um is not None and row.size_um[0] > row.size_um[1]:
            raise InputError(f"{where}: unknown.{i}.size_um: {row.size_um} must rise; give the least first")
        size = None if row.size_um is None else (row.size_um[0] * UM, row.size_um[1] * UM)
        rows.append(Unknown(row.what, size, row.from_, (row.until,)))
    return tuple(rows) or NOT_KNOWN
