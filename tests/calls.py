"""A call of each command that needs no measurement, on shipped paths, and what it needs beside them."""

from command_line import run
from shipped import ROOT

PAGED = ("--set", "robot.controller.max_lines=60", "--set", "process.page_stops=anywhere")
ARTEFACT = """[artefact]
certified = true
[[sphere]]
name = "a"
x_mm = 1000
y_mm = -400
z_mm = 0
diameter_mm = 30
[[sphere]]
name = "b"
x_mm = 1300
y_mm = 500
z_mm = 100
diameter_mm = 30
[[sphere]]
name = "c"
x_mm = 1600
y_mm = 0
z_mm = 0
diameter_mm = 30
[probe]
diameter_mm = 6
z_mm = 150
"""
LINE = "paths/line_y.toml"
CALLS = {
    "generate": ("generate", LINE, "-o", "g"),
    "predict": ("predict", LINE, "--program", "-o", "p"),
    "check": ("check", LINE),
    "check many": ("check", LINE, "paths/line_z.toml"),
    "inspect": ("inspect", "made/LINE_Y.LS"),
    "compare": ("compare", "made", "again"),
    "correct": ("correct", "plan/LINE_Y_PLAN.LS", "--before", "moving 200mm/s 6h", "--max-um", "5", "-o", "c"),
    "pages": ("pages", "plan/LINE_Y_PLAN.LS", "--robot", "m710ic50", "-o", "parted"),
    "verify-backup": ("verify-backup", "made/LINE_Y.LS", "again/LINE_Y.LS"),
    "resume": ("resume", "paged", "--from-page", "2", "--late", "5min", "--date", "2026-01-31"),
    "offsets": ("offsets", LINE),
    "heat": ("heat", LINE, "-o", "h"),
    "whatif": ("whatif", LINE, "--vary", "process.feed_mm_s=100,200", "--workers", "1", "-o", "w"),
    "plan-poses": ("plan-poses", "m710ic50", "-n", "12", "--no-reversals", "-o", "poses"),
    "plan-touches": ("plan-touches", LINE, "--artefact", "artefact.toml", "-n", "4", "-o", "t"),
    "inspect-robot": ("inspect-robot", "m20ia", "-o", "sheet"),
    "export-robot": ("export-robot", "m710ic50", "-o", "arm.urdf"),
    "init": ("init", "cell"),
    "schema": ("schema", "path"),
}


def prepare(folder):
    """A folder in which the calls can be made."""
    for name in ("paths", "robots"):
        (folder / name).symlink_to(ROOT / name)
    (folder / "artefact.toml").write_text(ARTEFACT)
    for words in (
        ("generate", LINE, "-q", "-o", "made"),
        ("generate", LINE, "-q", "-o", "again"),
        ("generate", LINE, "-q", "-o", "paged", *PAGED),
        ("predict", LINE, "--program", "-q", "-o", "plan"),
    ):
        assert run(*words, cwd=folder).returncode == 0, words
    return folder
