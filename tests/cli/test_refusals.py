"""What a refusal names: what the user gave or has to give, never a file that he does not know of."""

import json
import re

import pytest
from calls import ARTEFACT
from command_line import refused, run
from shipped import ROOT

import compgen
from compgen.core.exceptions import InputError

LINE = "paths/line_y.toml"
TOUCHING = {"anchor": LINE, "teach-frame": "m710ic50", "identify": "m710ic50"}


@pytest.mark.parametrize("command", TOUCHING)
def test_touches_that_are_not_there_are_named_before_the_artefact_beside_them(tmp_path, command):
    done = run(command, TOUCHING[command], "--touches", tmp_path / "none.csv")
    refused(done, 2, f"{tmp_path / 'none.csv'}: cannot be read: no such file; give the CSV of touches")
    assert "artefact" not in done.stderr


@pytest.mark.parametrize("command", TOUCHING)
def test_an_artefact_that_nobody_named_is_asked_for(tmp_path, command):
    touches = tmp_path / "touches.csv"
    touches.write_text("time_s,target\n")
    done = run(command, TOUCHING[command], "--touches", touches)
    refused(done, 2, "--artefact: missing, and no artefact.toml is beside ", "give the TOML of what was touched")


@pytest.mark.parametrize("command", TOUCHING)
def test_the_file_that_the_command_is_about_comes_first(command):
    done = run(command, "nope.toml", "--touches", "none.csv")
    refused(done, 2, "nope.toml: no such file")


@pytest.mark.parametrize("reference", ["x", "500", "ambientt"])
def test_a_reference_that_is_none_is_refused_without_a_log_too(tmp_path, reference):
    """`identify` and `check-robot` took any word, and wrote a robot file."""
    touches, artefact = tmp_path / "touches.csv", tmp_path / "artefact.toml"
    touches.write_text("time_s,target\n")
    artefact.write_text(ARTEFACT)
    given = ("--touches", touches, "--artefact", artefact, "--reference", reference)
    answers = [run(command, "m710ic50", *given) for command in ("teach-frame", "identify", "check-robot")]
    for done in answers:
        refused(done, 2, "--reference ", "must be start, ambient, or")
    assert len({done.stderr for done in answers}) == 1
    with pytest.raises(InputError, match="must be start, ambient, or"):
        compgen.identify("m710ic50", touches=touches, artefact=artefact, reference=reference)


FAR = ("--set", "path.x_mm=9000")
BEYOND = {
    "generate": (),
    "predict": (),
    "check": (),
    "heat": (),
    "offsets": (),
    "whatif": (),
    "plan-touches": ("--artefact", "artefact.toml"),
    "anchor": ("--touches", "touches.csv", "--artefact", "artefact.toml"),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("cell")
    for name in ("paths", "robots"):
        (place / name).symlink_to(ROOT / name)
    (place / "artefact.toml").write_text(ARTEFACT)
    (place / "touches.csv").write_text(
        "target,x_mm,y_mm,z_mm,w_deg,p_deg,r_deg,config\n"
        + "".join(f'{"abc"[n % 3]},1300,0,0,180,0,0,"N U T, 0, 0, 0"\n' for n in range(6))
    )
    return place


@pytest.mark.parametrize("command", BEYOND)
def test_what_cannot_be_done_names_file_waypoint_joint_distance_and_mend(folder, command):
    done = run(command, LINE, *BEYOND[command], *FAR, cwd=folder)
    words = ("waypoint 1 (flange at X 9000.0 Y", "wrist centre is 69", "of joint 3", "move the path or make it smaller")
    refused(done, 3, f"cgen: {LINE}: ", *words)
    assert done.stderr.count(LINE) == 1


def test_a_joint_s_limit_is_named_with_its_file(folder):
    done = run("check", LINE, "--set", "path.x_mm=100", "--json", cwd=folder)
    refused(done, 3, f"cgen: {LINE}: waypoint ", "joint J2 needs -90.", "beyond its limits", "; move the path, or")
    assert json.loads(done.stdout) == {"error": done.stderr.removeprefix("cgen: ").strip(), "exit_code": 3}


def test_a_program_that_cannot_be_parted_is_named(folder):
    assert run("predict", LINE, "--program", "-q", "-o", "plan", cwd=folder).returncode == 0
    listing = (folder / "plan" / "LINE_Y_PLAN.LS").read_text()
    (folder / "LOCAL.LS").write_text(re.sub(r"(:L P\[9\] +)\w+", r"\1R[AR[1]]", listing))
    done = run("pages", "LOCAL.LS", "--robot", "m710ic50", "--set", "controller.max_lines=60", "-o", "c", cwd=folder)
    refused(done, 3, "cgen: LOCAL.LS: program LINE_Y_PLAN: line ", "AR[] is known to this program only", "; hand it")


def test_a_log_is_named_as_it_was_typed():
    refused(run("anchor", LINE, "--touches", LINE, "--log", "none.csv"), 2, "cgen: --log none.csv: no such file")


def test_a_robot_file_and_a_path_file_that_changed_places_are_named():
    refused(run("generate", "robots/m710ic50.toml"), 2, "robots/m710ic50.toml: a robot file, and a path file is wanted")
    refused(
        run("predict", LINE, "--robot", "paths/line_x.toml"), 2, "line_x.toml: a path file, and a robot file is wanted"
    )
