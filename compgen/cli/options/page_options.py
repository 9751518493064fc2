"""What every command that writes a page takes for it: a date, and whether plotly.js lies in it or beside many."""

import os
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compgen.cli.output_files.figure_files import Content, FiguresOption, with_figures
from compgen.cli.output_files.publish import check_writable, write_file
from compgen.core.exceptions import InputError
from compgen.core.files import read_regular

if TYPE_CHECKING:
    from compgen.report.page import PageOptions


class Assets(StrEnum):
    """Where plotly.js lies."""

    INLINE = "inline"
    SHARED = "shared"


AssetsOption = Annotated[
    Assets | None,
    typer.Option("--assets", help="plotly.js inside the page (default), or shared: once, in the folder above it."),
]
PageDate = Annotated[str | None, typer.Option("--date", help="Date on the page, YYYY-MM-DD; none unless given.")]


MOST_LETTERS = 80  # of a label


def _checked_label(param: typer.CallbackParam, value: str | None) -> str | None:
    """A label as typed; raises InputError for one that is no line of a page."""
    if value is not None and not (value.strip() and value.isprintable() and len(value) <= MOST_LETTERS):
        raise InputError(f"{param.opts[0]} {value[:MOST_LETTERS]!r}: must be 1 to {MOST_LETTERS} printable letters")
    return value


@dataclass(frozen=True, slots=True, kw_only=True)
class Labels:
    """What the page and the record of a run are filed under; no program knows of it."""

    part: Annotated[
        str | None, typer.Option("--part", callback=_checked_label, help="Part, on the page and in report.json.")
    ] = None
    order: Annotated[
        str | None, typer.Option("--order", callback=_checked_label, help="Order, on the page and in report.json.")
    ] = None
    operator: Annotated[
        str | None,
        typer.Option("--operator", callback=_checked_label, help="Operator, on the page and in report.json."),
    ] = None

    def named(self) -> tuple[tuple[str, str], ...]:
        """Those that are given, in the order of the page."""
        return tuple((name, words.strip()) for name, words in asdict(self).items() if words is not None)


@dataclass(frozen=True, slots=True, kw_only=True)
class PageChoice:
    """What every command that writes a page takes for it."""

    assets: AssetsOption = None  # as the project of the working folder has it, else inside
    figures: FiguresOption = None


@dataclass(frozen=True, slots=True)
class PagePlace:
    """A folder that a page goes to, and what the page is made with."""

    folder: Path
    choice: PageChoice
    options: "PageOptions"

    def files(self, files: Mapping[str, Content]) -> dict[str, Content]:
        """The files of a run, a page among them, with its figures' files; the script that it shares is put above it."""
        reports = with_figures(self.folder, files, self.choice.figures)
        share_script(self.folder, self.options)
        return reports


def page_place(folder: Path, page: PageChoice, date: str | None = None, labels: Labels | None = None) -> PagePlace:
    """Where a page goes; refused before any work where the script cannot lie above its folder.

    Args:
        folder: Of the page.
        page: Where plotly.js lies.
        date: As typed: YYYY-MM-DD or YY-MM-DD.
        labels: Part, order and operator.

    Raises:
        InputError: No date, or a folder above that cannot hold the script.
    """
    from compgen.pipelines.files.project_file import find_project
    from compgen.report.page import PageOptions

    options = PageOptions("" if date is None else page_date(date), labels=labels.named() if labels else ())
    project = find_project(Path.cwd()) if page.assets is None else None
    assets = project.table.assets if project else page.assets
    if assets != Assets.SHARED:
        return PagePlace(folder, page, options)
    script = _script_above(folder)
    check_writable(script.parent)
    _is_there(script)
    return PagePlace(folder, page, replace(options, script=f"../{script.name}"))


def share_script(folder: Path, options: "PageOptions") -> None:
    """Put plotly.js into the folder above a page's, where the page asks for it there and it is not there yet.

    Several runs may do so at the same moment: the file appears whole, and all of them write the same.

    Raises:
        InputError: The folder cannot be written, or another file of its name is there.
    """
    if not options.script:
        return
    from compgen.report.figure import library

    script = _script_above(folder)
    if not _is_there(script):
        script.parent.mkdir(parents=True, exist_ok=True)
        write_file(script, library())


def page_date(date: str) -> str:
    """A date as a page shows it, YYYY-MM-DD.

    Raises:
        InputError: It is none.
    """
    try:
        return datetime.fromisoformat(f"20{date}" if re.fullmatch("..-..-..", date) else date).date().isoformat()
    except ValueError:
        raise InputError(f"--date {date!r:.40}: not a date; write it as 2026-01-31") from None


def _script_above(folder: Path) -> Path:
    from compgen.report.figure import library_name

    return Path(os.path.abspath(folder)).parent / library_name()  # as a browser reads ../ in the page's address


def _is_there(script: Path) -> bool:
    """Whether the script is there already; raises InputError where a file of its name is another."""
    from compgen.report.figure import library

    try:
        same = read_regular(script) == library()
    except FileNotFoundError:
        if not os.path.lexists(script):
            return False
        if not os.path.islink(script):
            return _is_there(script)  # another run has put it there since
        same = False
    except OSError:
        same = False
    if not same:
        raise InputError(f"{script}: it is there and not the script of figures; move it away, or use --assets inline")
    return True
