"""The table that a job prints at its end."""

from compgen.cli.screen.ci_reports import JudgedPath
from compgen.cli.screen.job_table import ROWS, name_list, outcomes_shown
from compgen.core.finding_codes import Code
from compgen.report import job_page, resume


def test_many_pages_are_listed_by_their_ends():
    names = ["A.LS", "A.pages.json", *(f"A_{k:03d}.LS" for k in range(1, 107)), "report.html"]
    assert name_list(names) == "A.LS, A.pages.json, A_001.LS to A_106.LS, report.html"
    assert name_list(names[:4]) == "A.LS, A.pages.json, A_001.LS, A_002.LS"


def test_what_a_project_gives_to_several_paths_is_said_once():
    said = {"level": "note", "code": Code.PROJECT_FILE, "message": "cgen.toml gives bounds.max_um = 15"}
    sizes = {"total": {"max_um": 1.0}}
    other = said | {"code": Code.FILE_READ_AS, "message": "log.csv: read as: comma"}
    report = {"verdict": "inside", "bounds": {}, "before": sizes, "after": sizes, "findings": [said, other]}
    judged = [JudgedPath(path, 0, 1.0, report) for path in ("a.toml", "b.toml")]
    shown = outcomes_shown([*judged, JudgedPath("c.toml", 2, 1.0)])
    assert shown.count("note: cgen.toml gives bounds.max_um = 15") == 1
    assert not any("read as" in str(line) for line in shown)


def test_the_error_along_the_tool_is_called_that_on_the_screen_and_on_pages():
    labels = {row: label for row, label, _ in ROWS}
    assert labels["normal"] == "along tool, um"
    assert resume.PARTS["normal"] == job_page.PARTS["normal"] == "along the tool [µm]"
