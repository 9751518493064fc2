"""The table that a job prints at its end."""

from compgen.cli.screen.job_table import name_list


def test_many_pages_are_listed_by_their_ends():
    names = ["A.LS", "A.pages.json", *(f"A_{k:03d}.LS" for k in range(1, 107)), "report.html"]
    assert name_list(names) == "A.LS, A.pages.json, A_001.LS to A_106.LS, report.html"
    assert name_list(names[:4]) == "A.LS, A.pages.json, A_001.LS, A_002.LS"
