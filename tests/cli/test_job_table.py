"""The table that a job prints at its end."""

from io import StringIO

from rich.console import Console
from shipped import path_file, quiet

from compgen.cli.screen.ci_reports import JudgedPath
from compgen.cli.screen.job_table import ROWS, job_shown, name_list, outcomes_shown
from compgen.core.finding_codes import Code
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.report import job_page, job_summary, resume


def test_many_pages_are_listed_by_their_ends():
    names = ["A.LS", "A.pages.json", *(f"A_{k:03d}.LS" for k in range(1, 107)), "report.html"]
    assert name_list(names) == "A.LS, A.pages.json, A_001.LS to A_106.LS, report.html"
    assert name_list(names[:4]) == "A.LS, A.pages.json, A_001.LS, A_002.LS"


def test_what_a_project_gives_to_several_paths_is_said_once():
    of_project = {"level": "note", "code": Code.PROJECT_FILE, "message": "cgen.toml gives bounds.max_um = 15"}
    sizes = {side: {"total": {"max_um": 1.0}} for side in ("before", "after")}
    other = of_project | {"code": Code.FILE_READ_AS, "message": "log.csv: read as: comma"}
    report = {"verdict": "inside", "bounds": {}, "on_part": sizes, "findings": [of_project, other]}
    judged = [JudgedPath(path, 0, 1.0, report) for path in ("a.toml", "b.toml")]
    shown = outcomes_shown([*judged, JudgedPath("c.toml", 2, 1.0)])
    assert shown.count("note: cgen.toml gives bounds.max_um = 15") == 1
    assert not any("read as" in str(line) for line in shown)


def test_the_error_along_the_tool_is_called_that_on_the_screen_and_on_pages():
    labels = {row: label for row, label, _ in ROWS}
    assert labels["normal"] == "along tool, um"
    assert resume.PARTS["normal"] == job_page.PARTS["normal"] == "along the tool [µm]"


def test_the_error_beside_a_bound_is_of_the_part_which_it_judges():
    """A line that is touched in the middle alone: on its way there and back the tool errs more."""
    job = load_job(path_file("line_y"), overrides=["process.lift_mm=200", "process.feed_mm_s=100"])
    planned = generate.predict(job, quiet)
    report = job_summary(planned, None)
    whole, part = (sizes["before"]["total"]["max_um"] for sizes in (report, report["on_part"]))
    assert whole > part + 0.1
    screen = StringIO()
    console = Console(width=200, file=screen)
    for shown in job_shown(planned, None, None, (), verbose=False):
        console.print(shown)
    table = screen.getvalue()
    assert f"{part:.2f}" in table
    assert f"{whole:.2f}" not in table
    both = {"verdict": "inside", "bounds": {"max_um": 0.0}, "findings": []}
    both |= {"before": report["before"], "after": report["before"]}
    both["on_part"] = {side: report["on_part"]["before"] for side in ("before", "after")}
    console.print(outcomes_shown([JudgedPath("a.toml", 0, 1.0, both)] * 2)[0])
    assert screen.getvalue().count(f"{part:.2f}") >= 5
    assert f"{whole:.2f}" not in screen.getvalue()
