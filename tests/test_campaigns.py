"""What the campaigns share: journals that resume and add up, the least that fails, and changes of the library."""

import ast
import re
import tomllib

import code_mutants
import mutation
import seed_journal
from seed_journal import Journal
from shipped import ROOT
from shrinking import shrunk

from compgen.fanuc.listing import lines


def test_a_journal_resumes_adds_up_and_says_its_seeds(tmp_path):
    journal = Journal(tmp_path / "x.jsonl")
    for seed in (0, 1, 5):
        journal.add({"seed": seed, "result": "passed"})
    assert list(journal.left(range(4))) == [2, 3]
    journal.add({"seed": 1, "result": "failed"})
    assert [(row["seed"], row["result"]) for row in journal.rows(range(5))] == [(0, "passed"), (1, "failed")]
    assert seed_journal.ranges_of(row["seed"] for row in journal.rows(range(9))) == "0 to 1, 5"
    assert list(journal.left(range(2, 9), budget=1e-9)) == []


def test_a_find_says_the_command_that_tries_it_again(capsys):
    rows = [{"seed": seed, "wrong": [seed] * (seed == 7)} for seed in range(9)]
    assert seed_journal.conclude("x.py", rows, "9 tried", lambda row: row["wrong"]) == 1
    again = 'again: python tests/campaigns/x.py --seeds 7:8 --journal "$(mktemp)"'
    assert capsys.readouterr().out == f"9 tried\n{again}\n"
    assert seed_journal.conclude("x.py", rows[:7], "7 tried", lambda row: row["wrong"]) == 0


def test_the_night_runs_campaigns_that_tell_how_to_try_a_find_again():
    script = (ROOT / ".ci" / "nightly").read_text()
    campaigns, rooms = (re.search(rf"{what}=\(([^)]+)\)", script) for what in ("campaigns", "rooms"))
    assert campaigns
    assert rooms
    for campaign in campaigns[1].split():
        text = (ROOT / "tests" / "campaigns" / f"{campaign}.py").read_text()
        assert f'seed_journal.parser("{campaign}"' in text
        assert "seed_journal.conclude(" in text
        assert "given.budget" in text or "options.budget" in text
    for room in rooms[1].split():
        assert code_mutants.library(room)
        assert list((ROOT / "tests" / room).glob("test_*.py"))


def test_what_is_left_after_shrinking_is_what_fails():
    tried: list[list[int]] = []

    def fails(parts):
        tried.append(parts)
        return {3, 29} <= set(parts)

    assert shrunk(list(range(40)), fails) == [3, 29]
    assert len(tried) < 60


def test_changes_stand_in_what_calculates_and_leave_valid_python():
    pool = code_mutants.library()
    assert len(pool) > 10_000
    assert not {part for m in pool for part in m.file.split("/")} & set(code_mutants.LEFT_OUT)
    for mutant in pool[::500]:
        text = (code_mutants.ROOT / mutant.file).read_bytes()
        assert text[mutant.start : mutant.end].decode() == mutant.before
        ast.parse(code_mutants.changed(text, mutant))


def test_a_change_is_made_in_the_functions_that_are_loaded():
    mutant = next(
        m for m in code_mutants.library()
        if m.file == "compgen/fanuc/listing/lines.py" and m.before == "1" and "line_ends(data" in m.statement
    )  # fmt: skip
    (first_line,) = code_mutants.functions_around(mutant)
    before = lines.line_of.__code__
    try:
        assert lines.line_of(b"a\nb", 2) == 2
        mutation.replace_code(mutant, first_line)
        assert lines.line_of(b"a\nb", 2) == 3
    finally:
        lines.line_of.__code__ = before


def test_a_change_in_a_copy_of_the_tree_meets_tests_whose_names_hold_its_path(tmp_path, monkeypatch):
    """Asked for by the path of the first tree there was no such test, which counted as one that noticed."""
    (tmp_path / "answer.py").write_text("ANSWER = 42\n")
    (tmp_path / "test_answer.py").write_text(
        "import answer, pathlib, pytest\n"
        "@pytest.mark.parametrize('here', [str(pathlib.Path(__file__).parent)])\n"
        "def test_it(here): assert answer.ANSWER == 42\n"
    )
    monkeypatch.setattr(mutation, "ROOT", tmp_path)
    mutant = code_mutants.Mutant("answer.py", 1, 9, 11, "42", "43", "ANSWER = 42")
    result, test = mutation.in_a_tree(mutant, [f"test_answer.py::test_it[{tmp_path}]"], 60)
    assert (result, test.partition("[")[0]) == ("caught", "test_answer.py::test_it")
    assert mutation.in_a_tree(mutant, ["test_answer.py::test_that_is_not_there"], 60)[0] == "broken"


def test_the_page_names_files_that_are_there():
    """Of changes that no test notices, and of who judges what: by name in the package, the tests or beside them."""
    page = (ROOT / "docs" / "reliability.md").read_text()
    changes = (ROOT / "tests" / "campaigns" / "equivalent.toml").read_text()
    places = [ROOT, ROOT / "compgen", ROOT / "tests", ROOT / "tests" / "campaigns"]
    files = {p.name for folder in ("compgen", "tests") for p in (ROOT / folder).rglob("*.py")}
    names = set(re.findall(r"`([\w/]+\.py)`", page)) | set(re.findall(r"[\w/]+\.py", changes))
    assert len(names) > 50
    assert not [n for n in names if not (any((p / n).is_file() for p in places) or ("/" not in n and n in files))]


def test_what_is_explained_of_changes_stands_in_the_library_and_once():
    """An explanation of a line that is gone would hide a change of another that is like it."""
    explained = tomllib.loads(mutation.EQUIVALENT.read_text())["mutant"]
    assert len({mutation.key_of(entry) for entry in explained}) == len(explained)
    lines_of = {file: (ROOT / file).read_text().splitlines() for file in {entry["file"] for entry in explained}}
    there = {(file, line.strip()) for file, its in lines_of.items() for line in its}
    assert [e for e in explained if (e["file"], e["statement"]) not in there] == []
