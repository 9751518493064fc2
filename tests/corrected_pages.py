"""Pages of a program that existed and was corrected, as the command line makes them."""

from command_line import run
from ls_text import cartesian, program

SHIFT = ("--before", "moving 200mm/s 5h")
PAGES = ("--robot", "m710ic50", "--set", "controller.max_lines=40", "-q")


def pages_of(folder, name, *given, motion="", history=SHIFT, speed="100mm/sec", parted=(), between=(), ends_with=0):
    """A program of 99 points, 1 mm apart, corrected for a history and parted into three pages."""
    points = [cartesian(n, (1300 + n, 20, 200, 180, 0, 0)) for n in range(1, 100)]
    folder.mkdir(exist_ok=True)
    source = folder / "LONG.LS"
    motions = [f"L P[{n}] {speed} FINE{motion}" for n in range(1, 100)]
    motions[50:50] = between
    source.write_bytes(program(motions, points, name="LONG"))
    made, out = folder / f"{name}_made", folder / name
    arguments = ("correct", source, "--robot", "m710ic50", *history, *given, "--max-um", "5", "-q", "-o", made)
    assert run(*arguments).returncode == ends_with
    assert run("pages", made / "LONG.LS", *PAGES, *parted, "-o", out).returncode == 0
    return out
