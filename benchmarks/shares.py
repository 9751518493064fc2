"""Where a whole run's processor time goes; ``python -m benchmarks.shares`` draws docs/performance_shares.svg.

Of a second run in one process, on one worker, by what its functions and all that they call take (cProfile).
"""

import cProfile
import pstats
import sys
import tempfile
import time
from html import escape
from pathlib import Path

from benchmarks.cases import PATH, job_of, quiet
from compgen.core import evaluation
from compgen.core.json_text import json_text
from compgen.job.job import Job
from compgen.pipelines.planned.generate import generate
from compgen.report import job_html, job_summary, waypoints_blocks

#: parts of a run, by functions that do nothing else (what they share is taken off below); honest additions last
PARTS = {
    "path, joints, timing": [("motion_plan.py", "plan_motion")],
    "heat, correction": [
        ("job_results.py", "planned_rises"), ("generate.py", "find_correction"), ("arc_moves.py", "time_corrected")
    ],
    "text and pages": [
        ("program_text.py", "compose_program"), ("generate.py", "_delivered")
    ],
    "twin": [("twin_of_job.py", "prepared_for"), ("twin_of_job.py", "deviation_of")],
    "waypoints.csv": [("waypoints_csv.py", "block")],
    "page, report.json": [("job_page.py", "job_html"), ("job_summary.py", "job_summary")],
    "cross flight": [("model_form.py", "plan_other_day"), ("model_form.py", "cross_flight")],
    "controller's motion": [("motion_effect.py", "motion_effect")],
    "band": [("band_columns.py", "band_along"), ("band.py", "half_widths")],
    "still pictures": [("still_picture.py", "still_svg")],
}  # fmt: skip
HONEST = ("cross flight", "controller's motion", "band", "still pictures", "page, report.json")
COLOURS = ("#1e3a8a", "#1d4ed8", "#3b82f6", "#60a5fa", "#93c5fd", "#bfdbfe", "#b45309", "#d97706", "#f59e0b", "#fcd34d")
WIDTH, HEIGHT = 760, 34


def whole(job: Job, folder: Path) -> None:
    """From a job to its files."""
    planned, done = generate(job, quiet)
    files = {"json": json_text(job_summary(planned, done)), "html": job_html(planned, done)}
    for name, content in {**files, **dict(done.delivery.files)}.items():
        (folder / name).write_bytes(content)
    with (folder / "csv").open("wb") as table:
        table.writelines(waypoints_blocks(planned, done))


def shares(points: int) -> dict[str, float]:
    """The share of each part in the processor time of a run with about so many waypoints, and of the rest."""
    with tempfile.TemporaryDirectory() as folder:
        whole(job_of(points), Path(folder))
        profile = cProfile.Profile(time.process_time)
        profile.enable()
        whole(job_of(points), Path(folder))
        profile.disable()
    stats = pstats.Stats(profile)
    rows = stats.stats.items()  # type: ignore[attr-defined]
    spent = {(Path(file).name, name): row[3] for (file, _, name), row in rows}
    total = stats.total_tt  # type: ignore[attr-defined]
    part = {name: sum(spent.get(function, 0.0) for function in functions) for name, functions in PARTS.items()}
    part["path, joints, timing"] -= spent.get(("motion_plan.py", "plan_written_motion"), 0.0)
    part["waypoints.csv"] -= spent.get(("band.py", "half_widths"), 0.0)
    part["page, report.json"] -= part["still pictures"]
    part["rest"] = total - sum(part.values())
    return {name: value / total for name, value in part.items()}


def picture(share: dict[str, float], points: int) -> str:
    """One bar and its legend, as SVG."""
    title = f"Processor time of a run of {points} waypoints, {Path(PATH).stem}"
    words = ", ".join(f"{name} {100 * value:.0f} %" for name, value in share.items())
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} 150" font-family="sans-serif" font-size="12" '
        f'role="img" aria-label="{escape(f"{title}: {words}")}"><rect width="{WIDTH}" height="150" fill="#fff"/>',
        f'<text x="10" y="18" font-weight="600">{escape(title)}</text>',
    ]
    x = 10.0
    for k, (name, value) in enumerate(share.items()):
        colour, wide = (*COLOURS, "#d1d5db")[k], (WIDTH - 20) * max(value, 0.0)
        parts.append(f'<rect x="{x:.1f}" y="28" width="{wide:.1f}" height="{HEIGHT}" fill="{colour}"/>')
        left, top = 10 + 187 * (k % 4), 78 + 22 * (k // 4)
        parts.append(f'<rect x="{left}" y="{top}" width="12" height="12" fill="{colour}"/>')
        parts.append(f'<text x="{left + 17}" y="{top + 11}">{escape(name)} {100 * value:.0f} %</text>')
        x += wide
    return "\n".join([*parts, "</svg>"]) + "\n"


if __name__ == "__main__":
    size = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    with tempfile.TemporaryDirectory() as cache:
        evaluation.configure(evaluation.find_compiler(Path(cache)), 1)
        measured = shares(size)
    (Path(__file__).parents[1] / "docs" / "performance_shares.svg").write_text(picture(measured, size))
    for name, value in measured.items():
        sys.stdout.write(f"{name}: {100 * value:.1f} %\n")
