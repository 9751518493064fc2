"""The robot file that is used is the project's own, or the one named; never one found by chance."""

import json
from contextlib import chdir
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from command_line import refused, run
from numpy.testing import assert_array_equal
from shipped import ROOT

from compgen.core import toml
from compgen.core.exceptions import InputError
from compgen.core.files import read_regular
from compgen.core.pose import Pose
from compgen.error_model.direction_memory import DirectionState
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.robot_file import cell_of, find_robot, known_robots, load_arm, load_cell

ROBOT = (ROOT / "robots" / "m710ic50.toml").read_text()
PATH = (ROOT / "paths" / "line_y.toml").read_text()


def project(folder, cte):
    """A folder with a path file and a robot file of its own."""
    for name in ("paths", "robots"):
        (folder / name).mkdir(parents=True)
    (folder / "paths" / "line_y.toml").write_text(PATH)
    (folder / "robots" / "m710ic50.toml").write_text(ROBOT.replace("cte_um_m_K = 11.25", f"cte_um_m_K = {cte}"))
    return folder


def growth(cell):
    return cell.profiles[0].cte


@pytest.mark.parametrize("where", [".", "paths", "robots"])
def test_the_path_files_own_project_has_the_robot_wherever_one_stands(tmp_path, where):
    own = project(tmp_path / "p", 22.5)
    with chdir(own / where):
        name = Path("..") / "paths" / "line_y.toml" if where != "." else Path("paths/line_y.toml")
        job = load_job(str(name) if where != "paths" else "line_y.toml")
    assert growth(job.cell) == pytest.approx(2 * growth(load_job(str(ROOT / "paths" / "line_y.toml")).cell))
    assert job.cell.robot_file_hash == sha256((own / "robots" / "m710ic50.toml").read_bytes()).hexdigest()


def test_a_link_to_a_path_file_leads_to_its_project(tmp_path):
    own = project(tmp_path / "p", 22.5)
    (tmp_path / "elsewhere" / "paths").mkdir(parents=True)
    link = tmp_path / "elsewhere" / "paths" / "line_y.toml"
    link.symlink_to(own / "paths" / "line_y.toml")
    with chdir(tmp_path):
        assert Path(load_job(str(link)).cell.robot_file).samefile(own / "robots" / "m710ic50.toml")


def test_two_robots_of_one_name_that_differ_are_both_named(tmp_path):
    own, other = project(tmp_path / "p", 22.5), project(tmp_path / "q", 5.0)
    with chdir(other), pytest.raises(InputError, match=r"both .*p/robots/m710ic50\.toml and robots/m710ic50\.toml"):
        load_job(str(own / "paths" / "line_y.toml"))
    refused(run("generate", own / "paths" / "line_y.toml", "-q", "-o", tmp_path / "o", cwd=other), 2, "--robot")
    with chdir(other):
        file = str(own / "robots" / "m710ic50.toml")
        assert Path(load_job(str(own / "paths" / "line_y.toml"), file).cell.robot_file).samefile(file)


def test_two_robots_of_one_name_that_are_alike_are_one(tmp_path):
    own, other = project(tmp_path / "p", 5.0), project(tmp_path / "q", 5.0)
    with chdir(other):
        job = load_job(str(own / "paths" / "line_y.toml"))
        assert Path(job.cell.robot_file).samefile(own / "robots" / "m710ic50.toml")


def test_a_robot_of_the_current_folder_alone_is_not_found_by_chance(tmp_path):
    own, other = project(tmp_path / "p", 22.5), project(tmp_path / "q", 5.0)
    (other / "robots" / "mine.toml").write_text(ROBOT)
    with chdir(other), pytest.raises(InputError, match=r"'mine' is unknown.*is robots/mine\.toml meant"):
        load_job(str(own / "paths" / "line_y.toml"), "mine")
    with chdir(other):
        assert find_robot("mine") == Path("robots/mine.toml")
        assert load_cell("mine").robot_file == "robots/mine.toml"


def test_what_no_robot_can_be_called_is_not_looked_for():
    for name in ("x" * 65, "m710ic50\n", "a\x07"):
        with pytest.raises(InputError, match="no robot has such a name; give a robot's name or file"):
            find_robot(name)
    with pytest.raises(InputError, match=f"^robot '{'x' * 64}' is unknown; known: "):
        find_robot("x" * 64)


def test_who_names_an_unknown_robot_is_said(tmp_path):
    file = project(tmp_path / "p", 22.5) / "paths" / "line_y.toml"
    with pytest.raises(InputError, match=r"^/.*/paths/line_y\.toml: robot 'mine' is unknown"):
        find_robot("mine", file)
    with pytest.raises(InputError, match=r"^robot 'mine' is unknown"):
        find_robot("mine")


def test_a_load_up_to_what_the_robot_carries_and_gravity_up_to_20_are_taken():
    load = load_cell("m710ic50", ["sources.loads.payload_kg=50", "sources.loads.gravity_m_s2=[0, 0, -20]"])
    assert load.robot.name == "m710ic50"
    for more, words in (
        ("payload_kg=50.1", "carries payload_kg = 50;"),
        ("gravity_m_s2=[0, 0, -20.1]", "more than 20 "),
    ):
        with pytest.raises(InputError, match=words):
            load_cell("m710ic50", [f"sources.loads.{more}"])


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        (
            ["compliance.compliance_urad_Nm=[0,2,1,0,0,0]"],
            "[sources.compliance]: nothing loads the joints; give a mass",
        ),
        (
            ["compliance.hardening_nrad_Nm2=[0,2,1,0,0,0]", "loads.gravity_m_s2=[0,0,0]", "loads.payload_kg=9"],
            "nothing",
        ),
        (["compliance.compliance_urad_Nm=[0,2,1,0,0,0]", "loads.payload_kg=9"], ""),
        (["compliance.compliance_urad_Nm=[0,2,1,0,0,0]", "loads.force_N=[0,0,5]"], ""),
        (
            ["hysteresis.width_mdeg=[1,1,1,1,1,1]"],
            "[sources.hysteresis]: all its values are zero; give them, or remove",
        ),
        (["hysteresis.width_mdeg=[1,1,1,1,1,1]", "hysteresis.windup_urad_Nm=[0,1,0,0,0,0]"], ""),
        (["hysteresis.width_mdeg=[1,1,1,1,1,1]", "hysteresis.sigma.backlash_mdeg=2"], ""),
        (["base_frame.position_um=[0,0,0]"], "[sources.base_frame]: all its values are zero"),
        (["thermal_growth.excess_a=[0,0,0,0,0,0]"], ""),
    ],
)
def test_errors_that_can_do_nothing_are_warned_of_once(keys, words):
    """A robot file whose compliance had no load, or whose play was zero, was taken without a word."""
    cell = load_cell(str(ROOT / "robots" / "m710ic50.toml"), [f"robot.sources.{key}" for key in keys])
    warnings = [f for f in cell.input_findings if f.code == "sources.loads"]
    assert len(warnings) == bool(words)
    for finding in warnings:
        assert finding.level == "warning"
        assert words in finding.message
    tool, theta = Pose(np.array([0.0, 0.1, 0.3]), np.eye(3)), np.array([[0.1, 0.3, -0.4, 0.5, 0.6, 0.7]])
    rise, come_from = np.zeros((1, len(cell.heat.names))), DirectionState(np.ones((1, 6)), np.ones((1, 3)))
    actual, nominal = (
        each.error_model(tool).actual_pose(theta, rise, come_from).position
        for each in (cell, replace(cell, sources=()))
    )
    if words:  # true of what is said: cold, and wherever the joints come from
        assert_array_equal(actual, nominal)


def test_an_arm_that_cannot_grow_is_warned_of():
    for value, count in ((0, 1), (11.25, 0)):
        cell = load_cell(str(ROOT / "robots" / "m710ic50.toml"), [f"robot.thermal.cte_um_m_K={value}"])
        warnings = [f.message for f in cell.input_findings if f.code == "sources.loads"]
        assert len(warnings) == count
        assert all("[thermal]: cte_um_m_K is zero, so that nothing grows; give it" in words for words in warnings)


def test_without_a_path_file_the_current_folder_comes_first_then_the_shipped(tmp_path):
    own = project(tmp_path / "p", 22.5)
    with chdir(own):
        assert find_robot("m710ic50") == Path("robots/m710ic50.toml")
    with chdir(tmp_path):
        assert find_robot("m710ic50").samefile(ROOT / "robots" / "m710ic50.toml")


def test_the_file_and_its_hash_stand_on_the_screen_in_the_report_and_in_the_program(tmp_path):
    own = project(tmp_path / "p", 22.5)
    done = run("generate", "paths/line_y.toml", "-o", "out", cwd=own)
    assert done.returncode == 0, done.stderr
    expected = sha256((own / "robots" / "m710ic50.toml").read_bytes()).hexdigest()
    made = json.loads((own / "out" / "report.json").read_text())["provenance"]
    assert made["robot_file"] == {"path": "robots/m710ic50.toml", "sha256": expected}
    assert f"robot file robots/m710ic50.toml, sha256 {expected[:16]}" in done.stdout
    assert expected in (own / "out" / "report.html").read_text()
    assert f"robot file {expected[:16]}" in (own / "out" / "LINE_Y.LS").read_text()


def test_a_program_that_warms_the_robot_is_one_of_the_project(tmp_path):
    own, other = project(tmp_path / "p", 11.25), project(tmp_path / "q", 11.25)
    (other / "paths" / "warm.toml").write_text(PATH)
    overrides = ['before=[{state="moving",program="warm",repeat=1}]']
    with chdir(other), pytest.raises(InputError, match="program 'warm' is unknown"):
        load_job(str(own / "paths" / "line_y.toml"), None, overrides)


def test_the_hash_is_of_the_bytes_that_were_read(tmp_path, monkeypatch):
    """Also when the file is replaced just after, as a sync or an editor does."""
    own = project(tmp_path / "p", 22.5)
    path, robot = own / "paths" / "line_y.toml", own / "robots" / "m710ic50.toml"
    known = sha256(robot.read_bytes()).hexdigest()
    first = robot.read_text()

    def read_and_replace(source, most):
        content = read_regular(source, most)
        if Path(source) == robot:
            robot.write_text(ROBOT)
        return content

    monkeypatch.setattr(toml, "read_regular", read_and_replace)
    with chdir(own):
        assert load_job(str(path)).cell.robot_file_hash == known
    robot.write_text(first)
    cell = load_cell(str(robot))
    assert (cell.robot_file_hash, growth(cell)) == (known, pytest.approx(22.5e-6))
    robot.write_text(first)
    assert load_arm(str(robot)).text == first


def test_a_program_of_a_name_that_is_too_long_is_refused(tmp_path):
    step = f'before=[{{state="moving", program="{"x" * 300}", duration_h=1}}]'
    with pytest.raises(InputError, match=r"program 'xxx.*is unknown"):
        load_job(str(ROOT / "paths" / "line_y.toml"), None, [step])


def test_the_order_of_a_robot_files_keys_changes_no_hash():
    def turned(table):
        return {key: turned(table[key]) for key in reversed(table)} if isinstance(table, dict) else table

    text = toml.read_toml_text(ROOT / "robots" / "m710ic50.toml", "robots")
    other = replace(text, tables=turned(text.tables))
    assert list(other.tables) != list(text.tables)
    one, same = (cell_of(read, Path("a.toml"), ()).inputs_hash for read in (text, other))
    assert one == same


def test_a_sensor_of_a_rise_that_no_heat_model_has_is_refused():
    """It was taken, and a log with its column ended in a fault of compgen."""
    with pytest.raises(InputError, match=r"thermal.sensors.part_3: rise 'jay2' is unknown; did you mean 'j2'\?"):
        load_cell("m710ic50", ['robot.thermal.sensors.part_3="jay2"'])
    cell = load_cell("m710ic50", ['robot.thermal.sensors.part_9="base"'])  # of the network, which may be chosen
    assert cell.sensors["part_9"] == "base"


def test_an_arm_has_nodes_a_law_and_sensors_where_its_file_has_warmth():
    warm, cold = load_arm("m710ic50"), load_arm("m710ic45m")
    assert warm.nodes == ("j2", "link1", "j3", "wrist", "face")
    assert warm.heat is not None
    assert warm.law is warm.heat.law
    assert warm.sensors["part_6"] == "j3"
    assert (cold.nodes, cold.heat, cold.law, dict(cold.sensors)) == ((), None, None, {})


def test_known_robots_are_those_of_the_folder_and_the_shipped_ones(tmp_path):
    own = project(tmp_path / "p", 22.5)
    (own / "robots" / "mine.toml").write_text(ROBOT)
    with chdir(own):
        assert {"mine", "m710ic50", "ur5"} <= set(known_robots())
    with chdir(tmp_path):
        known = known_robots()
    assert "mine" not in known
    assert known == sorted(set(known))


def test_what_an_identification_held_out_is_in_micrometres(tmp_path):
    file = tmp_path / "r.toml"
    file.write_text(f"{ROBOT}\n[identified]\nheld_out_um = [37.5, 30.0, 80.0]\nreflector_mm = {{ r1 = [0, 0, 100] }}\n")
    cell = load_cell(str(file))
    assert cell.held_out == pytest.approx(37.5e-6)
    assert not [f for f in cell.input_findings if f.code.startswith("posterior")]  # no sigmas: none is missed
    assert load_cell(str(ROOT / "robots" / "m710ic50.toml")).held_out is None
