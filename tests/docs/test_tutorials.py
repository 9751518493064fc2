"""The tutorials, pasted into bash from top to bottom in an empty folder: what comes is what their pages show."""

import json
import re
import sys

import pytest
from shipped import ROOT

sys.path.insert(0, str(ROOT / "docs"))
import tutorial_data
import tutorial_pictures
import tutorials

PAGES = tutorials.pages()
ANEW = "lay it anew: PYTHONPATH=. python docs/tutorials.py"
BLOCK = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
#: a size that the words of a page state, with its unit
SIZE = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?) (?:um|K|s|min|mm|kB|%)(?!\w)")


@pytest.fixture(scope="module")
def outputs(tmp_path_factory):
    """Each tutorial run once, when it is first asked for: its folder and what its steps print."""
    known = {}

    def outputs_of(page):
        if page not in known:
            folder = tmp_path_factory.mktemp(page.stem)
            known[page] = folder, tutorials.run(page.read_text(), folder)
        return known[page]

    return outputs_of


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_tutorial_shows_what_its_commands_print(page, outputs):
    _, came = outputs(page)
    for step, now in zip(tutorials.steps(page.read_text()), came, strict=True):
        if step.output is not None:
            missing = tutorials.differences(step.output, now)
            assert not missing, f"{page.name}: {ANEW}\nafter:\n{step.commands}\nnot so:\n{missing}\ncame:\n{now}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_picture_of_a_tutorial_is_drawn_from_its_own_run(page, outputs):
    folder, _ = outputs(page)
    drawn = tutorial_pictures.pictures(page.stem, folder)
    assert drawn
    for name, now in drawn.items():
        assert f"]({name})" in page.read_text()
        shown = (tutorials.FOLDER / name).read_text()
        assert not tutorials.differences(shown, now), f"{name}: {ANEW}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_size_in_the_words_of_a_tutorial_stands_in_its_commands_or_outputs(page):
    text = page.read_text()
    shown = [float(n) for block in BLOCK.findall(text) for n in re.findall(r"\d+\.?\d*", block)]
    words = BLOCK.sub("", text)
    for size in SIZE.findall(words):
        places = len(size.partition(".")[2])
        assert any(round(n, places) == float(size) for n in shown), f"{page.name}: {size} is in no output"


def test_sizes_in_words_are_seen():
    assert sum(len(SIZE.findall(BLOCK.sub("", page.read_text()))) for page in PAGES) > 10


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_tutorial_has_the_parts_that_a_stranger_looks_for(page):
    text = page.read_text()
    headings = re.findall(r"^## (.*)$", text, re.MULTILINE)
    for wanted in ("What it means on the shop floor", "What can go wrong", "Where next"):
        assert wanted in headings
    assert "**At the end you have**" in text
    assert "**You need**" in text


def test_the_files_that_tutorials_begin_with_are_what_their_script_makes():
    measured = tutorial_data.FOLDER / "identify_my_robot" / "cold.csv"
    made = tutorial_data.files(tutorial_data.poses_of(measured))
    assert {name: (tutorial_data.FOLDER / name).read_text() for name in made} == made
    shipped = {file.relative_to(tutorial_data.FOLDER).as_posix() for file in tutorial_data.FOLDER.glob("*/*")}
    assert shipped == set(made)
    assert {name.partition("/")[0] for name in made} <= {page.stem for page in PAGES}


def test_the_true_arm_of_a_tutorial_is_identified_within_two_sigmas(outputs):
    (page,) = [page for page in PAGES if page.stem == "identify_my_robot"]
    folder, _ = outputs(page)
    known = {p["name"]: p for p in json.loads((folder / "robots" / "mine.json").read_text())["parameters"]}
    true = {
        **{f"joint_zeros.offset_mdeg[{i}]": v for i, v in enumerate(tutorial_data.TRUE_ZERO_MDEG, 1)},
        **{f"link_offsets.d_um[{i}]": v for i, v in enumerate(tutorial_data.TRUE_D_UM, 1)},
        **{f"link_offsets.a_um[{i}]": v for i, v in enumerate(tutorial_data.TRUE_A_UM, 1)},
        **{f"link_offsets.beta_mdeg[{i}]": v for i, v in enumerate(tutorial_data.TRUE_BETA_MDEG, 1)},
    }
    wrong = {name: value for name, value in true.items() if value}
    assert len(wrong) == 6
    for name, value in wrong.items():
        assert abs(known[name]["value"] - value) < 2 * known[name]["sigma"] < abs(value) / 3, name
        assert f"{value:g}" in page.read_text()


def test_lines_left_out_are_the_only_freedom_of_an_output():
    assert tutorials.differences("a 1.00\nb\n", "a 1.01\nb\n") == []
    assert tutorials.differences("a 1.00\nb\n", "a 1.02\nb\n") == ["a 1.00", "b"]
    assert tutorials.differences("a 3 of 4\n", "a 3 of 5\n") == ["a 3 of 4"]
    assert tutorials.differences("a\n", "a\nb\n") == ["a"]
    assert tutorials.differences("a\n[...]\n", "a\nb\n") == []
    assert tutorials.differences("[...]\nb\n[...]\n", "a\nb\nc\n") == []
    assert tutorials.differences("[...]\nc\n[...]\na\n", "a\nb\nc\n") != []
    assert tutorials.shown_anew("x 1\n[...]\nz 3\n", "x 2\ny\nz 4\n") == "x 2\n[...]\nz 4\n"


def test_a_command_that_fails_ends_the_run(tmp_path):
    with pytest.raises(RuntimeError, match="after step 1 of 2"):
        tutorials.run("```sh\ncgen predict nowhere.toml\n```\n\n```sh\ntrue\n```\n", tmp_path)
