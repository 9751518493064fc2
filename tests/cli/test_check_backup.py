"""``cgen check-backup``: files and folders, pages with their main program, and what is refused."""

import json
import re
import shutil

import pytest
from command_line import refused, run
from shipped import path_file

FEW = ["--set", "robot.controller.max_lines=60", "--set", "process.page_stops=anywhere"]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A folder with one program, and one with pages."""
    folder = tmp_path_factory.mktemp("written")
    one = run("generate", path_file("line_y"), "-o", folder / "one", "-q")
    assert one.returncode == 0, one.stderr
    paged = run("generate", path_file("line_y"), "-o", folder / "paged", "-q", *FEW)
    assert (folder / "paged" / "LINE_Y.pages.json").exists(), paged.stderr
    return folder


def saved(source, target):
    """What a controller would save of the programs of a folder, among others."""
    target.mkdir()
    for path in source.glob("*.LS"):
        text = re.sub(rb"DATE \S+  TIME \S+;", b"DATE 26-11-22  TIME 10:00:01;", path.read_bytes())
        (target / path.name.lower()).write_bytes(text.replace(b"PROG_SIZE\t= 0", b"PROG_SIZE\t= 1234"))
    (target / "errall.ls").write_text("ERRALL.LS  Robot Name ROBOT\n")
    (target / "other.tp").write_bytes(b"\0\1\2")
    return target


def test_a_program_and_its_backup_are_the_same(written, tmp_path):
    back = saved(written / "one", tmp_path / "md")
    for pair in ((written / "one" / "LINE_Y.LS", back / "line_y.ls"), (written / "one", back)):
        done = run("check-backup", *pair)
        assert done.returncode == 0, done.stderr
        assert re.search(r"LINE_Y: the same: \d+ statements, \d+ positions, to 0.001", done.stdout)
    assert run("check-backup", written / "one", back, "-q").stdout == ""


def test_pages_are_compared_with_their_main_program(written, tmp_path):
    back = saved(written / "paged", tmp_path / "md")
    pages = sorted(p.stem for p in (written / "paged").glob("*.LS"))
    for given in (written / "paged", written / "paged" / "LINE_Y.LS"):
        done = run("check-backup", given, back, "--json")
        assert done.returncode == 0, done.stdout
        assert sorted(program["name"] for program in json.loads(done.stdout)["programs"]) == pages
    stale = back / f"{pages[2].lower()}.ls"
    stale.write_bytes(re.sub(rb"(X = +-?\d+\.\d\d)\d", rb"\g<1>9", stale.read_bytes()))
    (back / f"{pages[1].lower()}.ls").unlink()
    done = run("check-backup", written / "paged", back, "--first", "1")
    refused(done, 1, f"{pages[1]}: {pages[1]}: program: written there, backup -", "in all")
    assert f"{pages[0]}: the same" in done.stdout
    assert re.search(
        rf"{pages[2]}: \d+ differences\n  P\[1\]: X: written \S+, backup \S+9\n  and \d+ more", done.stdout
    )
    refused(
        run("check-backup", written / "paged" / "LINE_Y.LS", back / "line_y.ls"), 2, "programs were written", "folder"
    )


def test_two_backups_of_one_program_are_refused(written, tmp_path):
    """Names that differ by capitals: which of them runs is not known, and one may be as written."""
    back = saved(written / "one", tmp_path / "md")
    if (back / "LINE_Y.LS").exists():
        pytest.skip("a file system that does not tell capitals")
    (back / "LINE_Y.LS").write_bytes((back / "line_y.ls").read_bytes().replace(b"UTOOL_NUM=0", b"UTOOL_NUM=1"))
    refused(run("check-backup", written / "one", back), 2, "line_y.ls", "LINE_Y.LS", "saved last")


def test_a_difference_is_exit_1_and_each_is_in_the_json(written, tmp_path):
    back = saved(written / "one", tmp_path / "md") / "line_y.ls"
    back.write_bytes(back.read_bytes().replace(b"RUN AT 100%", b"RUN AT 50%").replace(b"CNT100", b"CNT50"))
    done = run("check-backup", written / "one" / "LINE_Y.LS", back, "--json")
    assert done.returncode == 1
    record = json.loads(done.stdout)
    differences = record["programs"][0]["differences"]
    assert not record["same"]
    assert {d["what"] for d in differences} == {"remark", "termination"}
    assert len(differences) == 1 + (written / "one" / "LINE_Y.LS").read_bytes().count(b"CNT100")
    refused(run("check-backup", written / "one" / "LINE_Y.LS", back), 1, "the backup differs", "RUN AT 50%")


def test_what_cannot_be_compared_is_refused(written, tmp_path):
    program = written / "one" / "LINE_Y.LS"
    back = saved(written / "one", tmp_path / "md")
    binary = tmp_path / "LINE_Y.TP"
    binary.write_bytes(b"\0\1\2")
    refused(run("check-backup", program, binary), 2, "LINE_Y.TP", "binary", "ASCII")
    refused(run("check-backup", binary, back), 2, "LINE_Y.TP", "binary")
    renamed = tmp_path / "renamed.ls"
    renamed.write_bytes(b"\0\1\2" * 100)
    refused(run("check-backup", program, renamed), 2, "renamed.ls", "binary")
    (back / "line_y.ls").rename(back / "line_y.tp")
    refused(run("check-backup", program, back), 2, "line_y.tp", "binary")
    (back / "line_y.tp").unlink()
    refused(run("check-backup", program, back), 2, "LINE_Y.LS is not in it")
    refused(run("check-backup", program, tmp_path / "nowhere"), 2, "nowhere", "cannot be read")
    refused(run("check-backup", tmp_path / "nowhere.LS", back), 2, "nowhere.LS")
    refused(run("check-backup", program, program), 2, "it is the file that was written")
    (tmp_path / "empty").mkdir()
    refused(run("check-backup", tmp_path / "empty", back), 2, "no .LS")
    half = tmp_path / "half.ls"
    half.write_bytes(program.read_bytes()[:2000])
    refused(run("check-backup", program, half), 2, "half.ls", "/END is missing")
    spanish = tmp_path / "spanish.ls"
    spanish.write_bytes(program.read_bytes().replace(b"COMMENT", b"COMENTARIO"))
    refused(run("check-backup", program, spanish), 2, "spanish.ls", "another language")
    shutil.copy(written / "paged" / "LINE_Y.LS", tmp_path / "LINE_Y.LS")
    (tmp_path / "LINE_Y.pages.json").write_text("{}")
    refused(run("check-backup", tmp_path / "LINE_Y.LS", back), 2, "LINE_Y.pages.json", "no manifest")
    (tmp_path / "LINE_Y.pages.json").write_text('{"pages": [{"file": ""}]}')
    refused(run("check-backup", tmp_path / "LINE_Y.LS", back), 2, "LINE_Y.pages.json", "no manifest")
