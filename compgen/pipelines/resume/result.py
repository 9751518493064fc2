"""What a resumed job comes to: the pages that were written anew, why, and what they leave."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from compgen.core.arrays import Array, rms
from compgen.core.units import MM, UM
from compgen.pipelines.planned.delivery import PageStart
from compgen.pipelines.planned.job_results import Planned
from compgen.pipelines.resume.beginning import Begun
from compgen.pipelines.resume.written_job import WrittenJob, WrittenPage
from compgen.program.program import Program
from compgen.verification.band import Band
from compgen.verification.deviation import Deviation, Sizes, percentile99
from compgen.verification.verdict import JudgedResult


@dataclass(frozen=True, slots=True)
class Size(Sizes):
    """Error of the tool's position on the part of one page [m]."""

    def record(self) -> dict[str, float]:
        """In micrometres."""
        return {f"{name}_um": round(getattr(self, name) / UM, 3) for name in ("max", "p99", "rms")}


@dataclass(frozen=True, slots=True, kw_only=True)
class PageResult:
    """One page before and after; off the part altogether where it never touches."""

    number: int
    name: str
    file: str
    before: Size  # had the job gone on with the old page
    after: Size
    is_new: bool  # its bytes are others


@dataclass(frozen=True, slots=True, kw_only=True)
class Join:
    """What the tool does at the stop where the first new page begins."""

    page: str
    gap: float  # [m] between the numbers of both texts, along the axis where it is most
    step: float  # [m] of the real tool, from where the page before holds it to where the new page does
    demanded: float  # [m] from where the page before holds it to the target: what has drifted
    beyond: float  # [m] what the step is off the demanded one
    on_the_part: bool

    def record(self) -> dict[str, Any]:
        """In micrometres, the gap in millimetres as the text has it."""
        sizes = {f"{name}_um": round(getattr(self, name) / UM, 3) for name in ("step", "demanded", "beyond")}
        return {"page": self.page, "gap_mm": round(self.gap / MM, 9), **sizes, "on_the_part": self.on_the_part}

    def words(self, place: str = "") -> str:
        """The step in words for who stands at the cell, and where it is if that is known."""
        return (
            f"from the page before, the tool steps by {self.step / UM:.2f} um{place}: "
            f"{self.demanded / UM:.2f} um follow the drift, {self.beyond / UM:.2f} um do not"
        )


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class PagesAnew(JudgedResult):
    """What was written anew, page by page, of a planned job or a corrected program."""

    written: WrittenJob
    from_page: int
    begun: Begun
    files: dict[str, bytes]  # the new pages and the manifest, by name
    pages: tuple[PageResult, ...]
    join: Join | None  # None: there is no page before

    @property
    def replaced(self) -> tuple[str, ...]:
        """Pages whose bytes are others than those in the folder."""
        return tuple(page.file for page in self.pages if page.is_new)

    @property
    def unchanged(self) -> tuple[str, ...]:
        """Pages that are made anew and come out as they were."""
        return tuple(page.file for page in self.pages if not page.is_new)


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Resumed(PagesAnew):
    """The rest of a job, written anew."""

    planned_rise: Array  # (K,) [K] with which the page would have started if nobody waited
    planned: Planned  # the rest; its ``deviation`` is that of the old pages
    program: Program  # read back from the new pages
    starts: tuple[PageStart, ...]
    deviation: Deviation  # of the new pages
    band: Band  # what the files and the log leave open on them

    @property
    def is_usable(self) -> bool:
        """Whether the pages are written unasked."""
        return self.inside


def size_of(error: Array, length: Array) -> Size:
    """Of errors (M,) [m], each for a length of path (M,) [m]."""
    if not len(error):
        return Size(0.0, 0.0, 0.0)
    return Size(
        float(error.max()), percentile99(error, np.maximum(length, 1e-12)), rms(error, np.maximum(length, 1e-12))
    )


def page_results(
    pages: Sequence[WrittenPage], sizes: Sequence[tuple[Size, Size]], files: Mapping[str, bytes]
) -> tuple[PageResult, ...]:
    """Each page with its size before and after; ``files`` are the new ones by name."""
    return tuple(
        PageResult(
            number=page.number,
            name=page.name,
            file=page.file,
            before=before,
            after=after,
            is_new=files[page.file] != page.data,
        )
        for page, (before, after) in zip(pages, sizes, strict=True)
    )
