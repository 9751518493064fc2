"""What ``pages`` says at its end, for a reader."""

from pathlib import Path

from compgen.core.units import KB
from compgen.fanuc import LsProgram
from compgen.fanuc.paging.capacity import ProgramSize, program_size
from compgen.fanuc.paging.split import PagedProgram


def unparted_text(program: LsProgram) -> str:
    """That a program needs no pages."""
    size = _size_text(program_size(program))
    return f"{program.name}: {size}: the controller holds it in one file; nothing was written\n"


def pages_text(program: LsProgram, paged: PagedProgram, folder: Path) -> str:
    """Each page, its load and what it relies on."""
    loads = f"{len(paged.pages)} pages in {paged.load_count} loads, in {folder}"
    lines = [f"{program.name}: {_size_text(program_size(program))}: {loads}"]
    for page in paged.pages:
        lines.append(f"  {page.name}: load {page.load}, {_size_text(page.size)}")
        lines += [f"    relies on the page before: {note}" for note in page.notes]
    return "\n".join(lines) + "\n"


def _size_text(size: ProgramSize) -> str:
    return f"{size.lines} lines, {size.positions} positions, {size.memory / KB:.1f} kB estimated"
