"""The marker of an output folder: which run wrote which of its files."""

import json
from hashlib import sha256

import pytest

from compgen import __version__
from compgen.cli.output_files.marker import NAME, Run, owners_in
from compgen.cli.output_files.ownership import check_folder
from compgen.cli.output_files.publish import publish
from compgen.cli.output_files.replace_together import replace_together
from compgen.core.commands import Command
from compgen.core.exceptions import InputError

HEAT, GENERATE = Run(Command.HEAT, "a"), Run(Command.GENERATE, "a")
HEATED, GENERATED = {"heat.json": b"{}", "heat.csv": b"1"}, {"report.json": b"{}", "P_01.LS": b"2"}
ALL = {*HEATED, *GENERATED, "resume.json"}


def digest(content):
    return sha256(content).hexdigest()


def test_it_says_the_command_its_version_and_the_hash_of_each_file(tmp_path):
    publish(tmp_path / "o", {}, HEATED, run=HEAT)
    record = json.loads((tmp_path / "o" / NAME).read_text())
    files = {name: digest(content) for name, content in HEATED.items()}
    assert record == {
        "schema": 1,
        "runs": [{"command": "heat", "about": "a", "version": __version__, "files": files}],
    }


def test_the_same_files_leave_the_same_bytes_in_any_order_of_runs(tmp_path):
    for folder, runs in (("one", (0, 1)), ("other", (1, 0, 1, 0))):
        for n in runs:
            publish(tmp_path / folder, {}, (HEATED, GENERATED)[n], run=(HEAT, GENERATE)[n])
    assert (tmp_path / "one" / NAME).read_bytes() == (tmp_path / "other" / NAME).read_bytes()
    assert owners_in(tmp_path / "one", ALL) == dict.fromkeys(HEATED, HEAT) | dict.fromkeys(GENERATED, GENERATE)


def test_a_file_belongs_to_the_run_that_wrote_it_last(tmp_path):
    publish(tmp_path, {}, GENERATED, run=GENERATE)
    replace_together(tmp_path, {"P_01.LS": b"anew", "resume.json": b"{}"}, Run(Command.RESUME))
    resumed = dict.fromkeys(("P_01.LS", "resume.json"), Run(Command.RESUME))
    assert owners_in(tmp_path, ALL) == {"report.json": GENERATE, **resumed}
    publish(tmp_path, {}, GENERATED, ("resume.json",), run=GENERATE)
    assert owners_in(tmp_path, ALL) == dict.fromkeys(GENERATED, GENERATE)


def test_a_file_that_was_changed_since_is_nobodys(tmp_path):
    publish(tmp_path, {}, HEATED, run=HEAT)
    check_folder(tmp_path, HEAT, others=list(HEATED))  # no record vouches for them: the marker does
    (tmp_path / "heat.csv").write_bytes(b"mine")
    with pytest.raises(InputError, match=r"heat\.csv in it is not what cgen heat wrote"):
        check_folder(tmp_path, HEAT, others=list(HEATED))


@pytest.mark.parametrize("other", [Run(Command.HEAT, "b"), Run(Command.EXECUTED, "a")])
def test_what_another_run_wrote_is_kept(tmp_path, other):
    publish(tmp_path, {}, HEATED, run=HEAT)
    with pytest.raises(InputError, match="it holds what cgen heat wrote about a;"):
        check_folder(tmp_path, other, others=list(HEATED))


@pytest.mark.parametrize("content", ["", "mine", "[]", '{"runs": 3}', '{"runs": [{"command": "heat"}]}'])
def test_a_file_of_its_name_that_is_none_is_kept(tmp_path, content):
    (tmp_path / NAME).write_text(content)
    for refused in (lambda: check_folder(tmp_path, HEAT), lambda: publish(tmp_path, {}, HEATED, run=HEAT)):
        with pytest.raises(InputError, match=f"{NAME} in it is not what cgen wrote"):
            refused()
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {NAME: content}
