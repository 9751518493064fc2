"""What an installer reads says the same everywhere."""

import re
import tomllib

import pytest
from shipped import ROOT

yaml = pytest.importorskip("yaml")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
FLOORS = dict(re.findall(r"^([a-z][a-z0-9-]*)>=([\d.]+)$", "\n".join(PROJECT["dependencies"]), re.M))
assert len(FLOORS) == len(PROJECT["dependencies"])


def test_the_environment_of_conda_has_the_floors_of_the_package():
    lines = yaml.safe_load((ROOT / "environment.yml").read_text())["dependencies"]
    from_pip = next(line["pip"] for line in lines if isinstance(line, dict))
    there = dict(
        re.findall(
            r"^([a-z][a-z0-9-]*) *>=([\d.]+)$",
            "\n".join([line for line in lines if isinstance(line, str)] + from_pip),
            re.M,
        )
    )
    assert {"pin" if name == "pinocchio" else name: floor for name, floor in there.items()} == FLOORS


def test_the_page_about_installing_gives_a_reason_for_every_floor():
    page = (ROOT / "docs" / "install.md").read_text()
    assert dict(re.findall(r"^\| `([a-z][a-z0-9-]*)` \| ([\d.]+) \| .+ \|$", page, re.MULTILINE)) == FLOORS


def test_the_classifiers_name_the_pythons_that_the_page_calls_run():
    page = (ROOT / "docs" / "install.md").read_text()
    head = re.search(r"^\| \| Python .*\|$", page, re.MULTILINE)
    row = re.search(r"^\| Linux, x86-64.*\|$", page, re.MULTILINE)
    assert head
    assert row
    pythons = re.findall(r"3\.\d+", head[0])
    run = row[0].strip("| ").split(" | ")[1:]
    named = {c.rsplit(" ", 1)[1] for c in PROJECT["classifiers"] if re.search(r":: 3\.\d+$", c)}
    assert named == {python for python, word in zip(pythons, run, strict=True) if word == "run"}


def test_the_citation_is_of_this_version_and_names_the_study():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert (citation["version"], citation["license"]) == (PROJECT["version"], PROJECT["license"])
    assert citation["references"][0]["title"] == "Thermal Performance of a Multi-Axis Smoothing Cell"
