"""``cgen plan-touches`` as a user meets it."""

import csv
import json

import numpy as np
import pytest
from command_line import refused, run
from shipped import path_file

from compgen.core.pose import Pose
from compgen.error_model.anchored_state import read_state
from compgen.error_model.direction_memory import NO_DIRECTION
from compgen.error_model.model import build_error_model
from compgen.error_model.sources.frames import BaseFrame
from compgen.job.anchored_start import cell_with_state
from compgen.pipelines.anchor.estimate import path_places
from compgen.pipelines.files.path_file import load_job

SPHERE = '[[sphere]]\nname = "{}"\nx_mm = {}\ny_mm = {}\nz_mm = 203\n'
PROBE = "[probe]\ndiameter_mm = 6\nz_mm = 150\n"
PLACES = (("a", 700, -680), ("b", 2000, -680), ("c", 700, 620), ("d", 1900, 500))


def artefact(
    tmp_path, head="certified = true\n", places=PLACES, sphere="diameter_mm = 30\nsigma_um = 2\n", probe=PROBE
):
    file = tmp_path / "artefact.toml"
    file.write_text(f"[artefact]\n{head}" + "".join(SPHERE.format(*p) + sphere for p in places) + probe)
    return file


def plan(file, folder, *options):
    return run("plan-touches", "paths/circle_1300.toml", "--artefact", file, "-o", folder, *options)


def test_a_plan_says_before_after_and_the_gain_of_each_touch(tmp_path):
    result = plan(artefact(tmp_path), tmp_path / "o", "-n", "5")
    assert result.returncode == 0, result.stderr
    record = json.loads((tmp_path / "o" / "plan.json").read_text())
    leaves = [record["before"]["rms_um"], *(t["rms_um"] for t in record["touches"])]
    assert leaves == sorted(leaves, reverse=True)
    assert leaves[-1] == record["after"]["rms_um"]
    assert f"{leaves[0]:.1f} um rms" in result.stdout
    assert f"one more gains {100 * record['one_more']['gain']:.0f} %" in result.stdout
    assert "after 5 touches " in result.stdout
    assert "after 1 touch " in plan(artefact(tmp_path), tmp_path / "one", "-n", "1").stdout
    assert record["touches"][2]["gain"] == pytest.approx(1 - leaves[3] / leaves[2])
    again = {p.name: p.read_bytes() for p in (tmp_path / "o").iterdir()}
    assert set(again) == {"compgen.json", "CIRCLE_1300_TOUCHES.LS", "plan.json", "touches.csv"}
    assert json.loads(plan(artefact(tmp_path), tmp_path / "o", "-n", "5", "--json").stdout) == record
    assert {p.name: p.read_bytes() for p in (tmp_path / "o").iterdir()} == again


@pytest.mark.parametrize(("cells", "typed"), [("\n,", "\n12.5,"), (",,,,", ",1300.1,2.5,180.2,")])
def test_a_table_that_was_filled_in_is_not_planned_anew(tmp_path, cells, typed):
    """Its times, or its places alone: those were taken for unfilled and written over."""
    file, table = artefact(tmp_path), tmp_path / "o" / "touches.csv"
    assert plan(file, tmp_path / "o", "-n", "2", "-q").returncode == 0
    filled = table.read_text().replace(cells, typed, 1)
    assert filled != table.read_text()
    table.write_text(filled)
    refused(plan(file, tmp_path / "o", "-n", "2"), 2, "touches.csv", "touches that were made", "-o")
    assert table.read_text() == filled


BAD: list[tuple[dict[str, object], int, tuple[str, ...]]] = [
    ({"head": "certified = false\n"}, 2, ("artefact.certified", "nobody certified")),
    ({"places": (("a", 3500, 0), ("b", 3600, 0))}, 3, ("a, b", "out of the arm's reach", "3500")),
    ({"sphere": ""}, 2, ("'a'", "diameter_mm", "--centres")),
    ({"sphere": "diameter_mm = 0.03\n"}, 2, ("'a'", "0.03", "give millimetres")),
    ({"probe": ""}, 2, ("probe", "x_mm")),
    ({"head": 'certified = true\nframe = "uframe 2"\n'}, 2, ("user frame 2", "--frames")),
]


@pytest.mark.parametrize(("parts", "code", "words"), BAD, ids=[words[0] + str(code) for _, code, words in BAD])
def test_an_artefact_that_anchors_nothing_is_refused_in_a_line(parts, code, words, tmp_path):
    refused(plan(artefact(tmp_path, **parts), tmp_path / "o"), code, "artefact.toml", *words)
    assert not (tmp_path / "o").exists()


def test_places_of_which_nobody_says_whether_they_are_certified_are_an_instrument_s(tmp_path):
    result = plan(artefact(tmp_path, head=""), tmp_path / "o", "-n", "6")
    assert result.returncode == 0, result.stderr
    assert "artefact.certified: not said" in " ".join(result.stdout.split())


def test_spheres_without_a_place_are_left_out_by_name_and_alone_refused(tmp_path):
    file = artefact(tmp_path, places=PLACES[:3])
    unknown = '[[sphere]]\nname = "far"\ndiameter_mm = 30\n'
    file.write_text(file.read_text() + unknown)
    result = plan(file, tmp_path / "o", "-n", "3")
    assert result.returncode == 0, result.stderr
    assert "sphere far: no place" in " ".join(result.stdout.split())
    assert "far" not in (tmp_path / "o" / "touches.csv").read_text()
    file.write_text(f"[artefact]\ncertified = true\n{unknown}{PROBE}")
    refused(plan(file, tmp_path / "p"), 2, "artefact.toml", "none has a place", "x_mm")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("-n", "0"), ("-n 0", "1 to 100")),
        (("-n", "101"), ("-n 101", "1 to 100")),
        (("--skip", "DI[1]=MAYBE"), ("--skip", "DI[1]=ON")),
        (("--sigma", "0"), ("--sigma 0", "0.1 to 10000")),
        (("--clearance", "nan"), ("--clearance nan", "1 to 500")),
        (("--utool", "0"), ("--utool 0",)),
    ],
)
def test_numbers_out_of_range_are_refused_in_a_line(options, words, tmp_path):
    refused(plan(artefact(tmp_path), tmp_path / "o", *options), 2, *words)
    assert not (tmp_path / "o").exists()


def test_without_an_artefact_the_option_is_named(tmp_path):
    refused(run("plan-touches", "paths/circle_1300.toml", "-o", tmp_path / "o"), 2, "--artefact")


def test_centres_are_planned_for_spheres_of_unknown_diameter_with_stops(tmp_path):
    result = plan(artefact(tmp_path, sphere=""), tmp_path / "o", "--centres", "-n", "4", "-q")
    assert result.returncode == 0, result.stderr
    text = (tmp_path / "o" / "CIRCLE_1300_TOUCHES.LS").read_text()
    assert "PAUSE" in text
    assert "deflection" not in text  # a centre has none, and the CSV no column for it: X Y Z are asked for
    head, first, *_ = (tmp_path / "o" / "touches.csv").read_text().splitlines()
    assert head == "time_s,target,x_mm,y_mm,z_mm,w_deg,p_deg,r_deg,config,sigma_um"
    assert first.startswith((",a,,,", ",b,,,", ",c,,,", ",d,,,"))
    assert first.endswith(",12")


def test_touches_beyond_what_is_useful_are_named(tmp_path):
    result = plan(artefact(tmp_path), tmp_path / "o", "-n", "60")
    assert result.returncode == 0, result.stderr
    assert "gains less than 1%" in " ".join(result.stdout.split())


def test_planes_are_planned_for_as_well_and_places_that_the_robot_taught(tmp_path):
    file = artefact(tmp_path, head="[artefact.taught]\n", places=PLACES[:2])
    file.write_text(
        file.read_text() + '[[plane]]\nname = "top"\nx_mm = 1400\ny_mm = 0\nz_mm = 180\nnormal = [0, 0, 1]\n'
    )
    result = plan(file, tmp_path / "o", "-n", "10", "-q")
    assert result.returncode == 0, result.stderr
    touches = json.loads((tmp_path / "o" / "plan.json").read_text())["touches"]
    of_plane = [t for t in touches if t["target"] == "top"]
    assert {t["target"] for t in touches} == {"a", "b", "top"}
    assert all(t["normal"] == [0, 0, -1] and t["position"]["z_mm"] == 183 for t in of_plane)
    assert (
        run(
            "plan-touches", "paths/circle_1300.toml", "--artefact", file, "-o", tmp_path / "c", "--centres", "-q"
        ).returncode
        == 0
    )
    assert "top" not in (tmp_path / "c" / "touches.csv").read_text()


def test_a_log_says_how_warm_the_arm_is(tmp_path):
    """An arm that works harder than [[before]] says: each node by its lag, to 1.4 times its rise."""
    log = tmp_path / "log.csv"
    rises = [(15.4, 1.0), (5.5, 2.5), (18.2, 1.2), (4.2, 2.0)]  # K and h
    rows = [
        ",".join([f"{60 * n},20", *(f"{20 + k * (1 - np.exp(-n / 60 / h)):.2f}" for k, h in rises)]) for n in range(360)
    ]
    log.write_text("\n".join(["time_s,ambient_degC,part_3_degC,part_4_degC,part_6_degC,part_11_degC", *rows]) + "\n")
    file = artefact(tmp_path)
    with_log = plan(file, tmp_path / "l", "--log", log, "--reference", "20", "-q")
    assert with_log.returncode == 0, with_log.stderr
    assert plan(file, tmp_path / "o", "-q").returncode == 0
    before = [json.loads((tmp_path / f / "plan.json").read_text())["before"]["rms_um"] for f in "lo"]
    assert before[0] != pytest.approx(before[1], rel=0.01)
    refused(plan(file, tmp_path / "l", "--log", log, "--state", "s.toml"), 2, "--log", "--state")
    refused(plan(file, tmp_path / "l", "--reference", "20"), 2, "--reference", "--log")
    printed = run("offsets", "paths/circle_1300.toml", "--json", "--log", log, "--reference", "20")
    assert printed.returncode == 0, printed.stderr
    assert json.loads(printed.stdout)["ways"][0]["leaves"]["max_um"] > 150  # by [[before]] it is 122
    refused(run("offsets", "P.LS", "--log", log), 2, "--log", "--state")


@pytest.mark.parametrize("options", [(), ("--stops",)], ids=["skip", "stops"])
def test_the_table_filled_in_anchors_the_arm(options, tmp_path):
    """An arm 2 K warmer on a base 40 um away is touched without noise; the shop types in what it reads."""
    folder = tmp_path / "o"
    file = artefact(tmp_path)
    assert plan(file, folder, "-q", *options).returncode == 0
    job, record = load_job(path_file("circle_1300")), json.loads((folder / "plan.json").read_text())
    warm, base = job.start_rise() * 1.15, BaseFrame(np.array([40e-6, 0, 0]), np.zeros(3))
    arm = build_error_model(job.robot, (base, *job.sources), len(warm), Pose(np.array([0, 0, 0.15]), np.eye(3)))
    rows = list(csv.reader((folder / "touches.csv").read_text().splitlines()))
    column = {name: n for n, name in enumerate(rows[0])}
    places = {name: np.array([x, y, 203.0]) for name, x, y in PLACES}
    for row, touch in zip(rows[1:], record["touches"], strict=False):
        theta = job.robot.to_theta(np.radians([touch["joints_deg"]]))
        way, place = np.array(touch["normal"]), arm.actual_pose(theta, warm[None], NO_DIRECTION).position[0] * 1e3
        beyond = (place - (places[touch["target"]] - 18 * way)) @ way  # mm by which the planned pose is too far
        row[column["time_s"]] = "21600"
        if options:
            row[column["value_mm"]] = f"{beyond:.4f}"
        else:
            for axis, w in zip(("x_mm", "y_mm", "z_mm"), way, strict=True):
                row[column[axis]] = f"{touch['position'][axis] - beyond * w:.3f}"
    filled = tmp_path / "filled.csv"
    with filled.open("w", newline="") as text:
        csv.writer(text).writerows(rows)
    state = tmp_path / "state.toml"
    result = run("anchor", "paths/circle_1300.toml", "--touches", filled, "--artefact", file, "-o", state)
    assert result.returncode == 0, result.stderr
    assert result.stdout.startswith("anchored")
    believed_state = read_state(str(state))
    believed = cell_with_state(job.cell, believed_state, "state.toml").sources
    there = path_places(job).theta
    truth, by_state, cold = (
        build_error_model(job.robot, sources, len(warm), job.tool.pose)
        .actual_pose(there, np.tile(rise, (len(there), 1)), NO_DIRECTION)
        .position
        for sources, rise in (
            ((base, *job.sources), warm),
            (believed, believed_state.rise),
            (job.sources, job.start_rise()),
        )
    )
    off, left = (np.sqrt(np.mean((truth - place) ** 2) * 3) for place in (cold, by_state))
    assert off > 40e-6
    assert left < off / 3  # a day much warmer than the forecast thinks likely is not believed whole
