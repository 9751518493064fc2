"""Distances and touches from files to a robot file: read, identified, judged, validated, refused."""

import json
import re
import tomllib

import numpy as np
import pytest
from campaign import robot_file as heated_robot
from command_line import run
from numpy.testing import assert_allclose
from shipped import quiet
from synthetic import random_theta

from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.rotations import rotation_matrix
from compgen.core.units import DEG, MM, UM
from compgen.identification.distances import read_distances
from compgen.identification.fit import fit
from compgen.identification.identifiability import taught_sigma, unobservable, unseen_directions
from compgen.identification.identify import identify
from compgen.identification.measurement_checks import check_plausible, check_row_count, check_scale
from compgen.identification.measurements import DISTANCE, TOUCH, blank_rows
from compgen.identification.model import build_model
from compgen.identification.parameters import symbolic_sources
from compgen.pipelines.files.robot_file import load_arm
from compgen.pipelines.measure.identification_files import MeasurementFiles, read_measurements
from compgen.robot.inverse_kinematics import Posture, solve_tool
from compgen.robot.kinematics import flange_pose

PRISM = np.array([[60, 10, 120], [-50, 40, 150]]) * 1e-3
PROBE = np.array([10, -20, 180]) * 1e-3
SOCKET = np.array([1.25, 0.2, 0.0])
SPHERES = np.array([[1.0, -0.6, -0.2], [1.5, 0.6, 0.1], [0.9, 0.5, 0.3], [1.3, -0.3, 0.4], [1.6, 0.0, -0.3]])
NAMES = "abcde"
RADIUS = 15 * MM
NOISE = 20 * UM
DISTANCE_HEAD = ["a_target", *(f"a_j{k}_deg" for k in range(1, 7)), "b_target", *(f"b_j{k}_deg" for k in range(1, 7))]
TOUCH_HEAD = ["target", *(f"j{k}_deg" for k in range(1, 7))]
ERROR = np.array([0, 0.03, -0.04, 0.05, -0.06, 0]) * DEG  # of the true arm's zeros


@pytest.fixture(scope="module")
def arm():
    return load_arm("m710ic50")


def degrees(arm, theta):
    return [f"{v:.6f}" for v in arm.robot.to_pendant(theta) / DEG]


def carried(arm, theta, points, error=ERROR):
    """Points of the flange in World, of an arm whose zeros are off."""
    flange = flange_pose(arm.robot, theta + error)
    return flange.position + np.einsum("nij,nj->ni", flange.rotation, np.broadcast_to(points, (len(theta), 3)))


def text(head, rows):
    return "\n".join([",".join(head), *(",".join(map(str, r)) for r in rows)]) + "\n"


def distance_rows(arm, rng, count=60, socket=0, noise=NOISE, error=ERROR):
    """Between two prisms at two poses; the last some to a socket."""
    theta = random_theta(arm.robot, rng, 2 * count)
    near, far = rng.integers(0, 2, (2, count))
    a, b = carried(arm, theta[::2], PRISM[near], error), carried(arm, theta[1::2], PRISM[far], error)
    rows = []
    for n in range(count):
        to_socket = n >= count - socket
        end = SOCKET if to_socket else b[n]
        mm = (np.linalg.norm(a[n] - end) + rng.normal(0, noise)) / MM
        second = ["ball", *[""] * 6] if to_socket else [f"r{far[n] + 1}", *degrees(arm, theta[2 * n + 1])]
        rows.append([f"r{near[n] + 1}", *degrees(arm, theta[2 * n]), *second, f"{mm:.5f}"])
    return rows


def touch_rows(arm, rng, count=60, sided=False, noise=NOISE, places=SPHERES, error=ERROR):
    """Of spheres, with J1 to J6 of an arm that really is where it touches."""
    target = np.arange(count) % len(places)
    normal = rng.normal(size=(count, 3)) - [0, 0, 0.7]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    down = np.diag([1.0, -1.0, -1.0]) @ rotation_matrix(rng.uniform(-0.6, 0.6, (count, 3)))
    where = places[target] - sided * RADIUS * normal + rng.normal(0, noise, (count, 3))
    theta = solve_tool(arm.robot, Pose(where, down), Pose(PROBE, np.eye(3)), Posture())[0] - error
    rows = [[NAMES[t], *degrees(arm, q)] for t, q in zip(target, theta, strict=True)]
    return [[*r, *(f"{v:.9f}" for v in n)] for r, n in zip(rows, normal, strict=True)] if sided else rows


def artefact(certified="true", length=(0, 1), known=(), places=SPHERES, mm=None, sigma=0.0, probe=True):
    """An artefact's file: some spheres of known places in axes of its own."""
    lines = ["[artefact]"] + ([f"certified = {certified}"] if certified else []) + ["[probe]", "diameter_mm = 5"]
    lines += [f"{k}_mm = {v}" for k, v in zip("xyz", PROBE / MM, strict=True)] if probe else []
    turn = rotation_matrix(np.array([[0.1, -0.2, 0.7]]))[0]
    for k, place in enumerate(places @ turn.T / MM):
        lines += ["[[sphere]]", f'name = "{NAMES[k]}"', "diameter_mm = 25"]
        lines += [f"{c}_mm = {v:.6f}" for c, v in zip("xyz", place, strict=True)] if k in known else []
        lines += [f"sigma_um = {sigma}"] if sigma else []
    if length:
        mm = np.linalg.norm(places[length[0]] - places[length[1]]) / MM if mm is None else mm
        lines += ["[[length]]", f'between = ["{NAMES[length[0]]}", "{NAMES[length[1]]}"]', f"mm = {mm:.6f}"]
    return "\n".join(lines) + "\n"


def read(arm, tmp_path, distances=None, touches=None, of=None, force=False):
    """All rows, with every check before the fit."""
    files = MeasurementFiles(
        distances=[str(tmp_path / "distances.csv")] if distances is not None else [],
        touches=[str(tmp_path / "touches.csv")] if touches is not None else [],
    )
    (tmp_path / "distances.csv").write_text(distances or "")
    (tmp_path / "touches.csv").write_text(touches or "")
    (tmp_path / "artefact.toml").write_text(of or artefact())
    data, _ = read_measurements(arm, files, force=force)
    check_row_count(data)
    check_scale(data)
    check_plausible(arm.robot, build_model(arm.robot, [], 0), data)
    return data


@pytest.fixture(scope="module")
def distances(arm):
    return distance_rows(arm, np.random.default_rng(1), 60, socket=20)


@pytest.fixture(scope="module")
def centres(arm):
    return touch_rows(arm, np.random.default_rng(2), 60)


@pytest.fixture(scope="module")
def sides(arm):
    return touch_rows(arm, np.random.default_rng(3), 100, sided=True)


HEAD = [*DISTANCE_HEAD, "distance_mm"]
SIDED_HEAD = [*TOUCH_HEAD, "nx", "ny", "nz"]


def test_distances_are_read_as_driven(arm, tmp_path, distances):
    data = read(arm, tmp_path, text(HEAD, distances))
    assert len(data.pose) == 60
    assert len(data.theta) == 40 * 2 + 20
    assert data.fixed.names == ("ball",)
    assert (data.kind == DISTANCE).all()
    assert data.reflectors == ("r1", "r2") or data.reflectors == ("r2", "r1")
    step = np.sign(data.theta[1:] - data.theta[:-1])
    assert (data.direction[1:] == step).all()  # each pose is come to from the one before, a then b


@pytest.mark.parametrize("missing", [(), (9, 31)])
def test_a_place_that_an_arm_comes_to_again_is_another_visit_also_without_times(arm, tmp_path, missing):
    """Each place from below and from above, a ballbar to two sockets; the same distance is read by chance at times."""
    theta, way = random_theta(arm.robot, np.random.default_rng(4), 8), 2 * DEG
    driven = [q + step * way for q in theta for step in (-1, 0, 1, 0)]
    rows = []
    for n, q in enumerate(driven):
        for k, (name, ball) in enumerate((name, ball) for name in ("r1", "r2") for ball in ("s1", "s2")):
            mm = 900 + 10 * n + k if n % 4 != 3 or k else 900 + 10 * (n - 2)
            rows.append([name, *degrees(arm, q), ball, *[""] * 6, f"{mm}", f"{60 * n}"])
    rows = [r for n, r in enumerate(rows) if n not in missing]
    (tmp_path / "timed.csv").write_text(text([*HEAD, "time_s"], rows))
    (tmp_path / "untimed.csv").write_text(text(HEAD, [r[:-1] for r in rows]))
    timed, untimed = (read_distances(str(tmp_path / f"{name}.csv"), arm.robot, 0) for name in ("timed", "untimed"))
    assert len(timed.theta) == 32
    for name in ("theta", "pose", "direction"):
        assert np.array_equal(getattr(untimed, name), getattr(timed, name))


def test_all_distances_between_a_few_poses_are_of_these_poses(arm, tmp_path):
    theta = random_theta(arm.robot, np.random.default_rng(9), 6)
    where = carried(arm, theta, PRISM[0])
    rows = [
        [
            "r1",
            *degrees(arm, theta[i]),
            "r1",
            *degrees(arm, theta[j]),
            f"{np.linalg.norm(where[i] - where[j]) / MM:.5f}",
        ]
        for i in range(6)
        for j in range(i)
    ]
    assert len(read(arm, tmp_path, text(HEAD, rows)).theta) == 6


def changed(rows, n, column, value, head=HEAD):
    new = [list(r) for r in rows]
    new[n][head.index(column)] = value
    return new


def scaled(rows, columns, factor, head=HEAD):
    at = [head.index(c) for c in columns]
    return [[f"{float(v) * factor:.9f}" if k in at and v else v for k, v in enumerate(r)] for r in rows]


def exchanged(rows, one, other, head):
    i, j = head.index(one), head.index(other)
    return [[r[j] if k == i else r[i] if k == j else v for k, v in enumerate(r)] for r in rows]


BAD_DISTANCES = {
    "metres": (lambda r: text(HEAD, scaled(r, ["distance_mm"], 1e-3)), ("distance_mm", "metres", "by 1000")),
    "micrometres": (lambda r: text(HEAD, scaled(r, ["distance_mm"], 1e3)), ("distance_mm", "um instead", "by 0.001")),
    "inches": (lambda r: text(HEAD, scaled(r, ["distance_mm"], 1 / 25.4)), ("distance_mm", "inches", "by 25.4")),
    "a sign": (
        lambda r: text(HEAD, scaled(r, ["a_j4_deg", "b_j4_deg"], -1)),
        ("misses the distances", "J4 fits with the opposite sign"),
    ),
    "exchanged joints": (
        lambda r: text(HEAD, exchanged(exchanged(r, "a_j4_deg", "a_j5_deg", HEAD), "b_j4_deg", "b_j5_deg", HEAD)),
        ("J4 and J5 fit exchanged",),
    ),
    "nothing": (lambda r: "", ("empty",)),
    "no distance": (lambda r: text(HEAD[:-1], [x[:-1] for x in r]), ("column distance_mm", "missing")),
    "zero": (lambda r: text(HEAD, changed(r, 2, "distance_mm", "0")), ("line 4", "distance_mm", "above 0")),
    "negative": (lambda r: text(HEAD, changed(r, 2, "distance_mm", "-12")), ("line 4", "above 0")),
    "NaN": (lambda r: text(HEAD, changed(r, 2, "distance_mm", "nan")), ("line 4", "distance_mm")),
    "infinite": (lambda r: text(HEAD, changed(r, 2, "distance_mm", "inf")), ("line 4", "distance_mm")),
    "a joint empty": (lambda r: text(HEAD, changed(r, 1, "b_j3_deg", "")), ("line 3", "b_j3_deg", "all six")),
    "half a second end": (
        lambda r: text(HEAD[:-2] + HEAD[-1:], [[*x[:-2], x[-1]] for x in r]),
        ("column b_j6_deg", "missing"),
    ),
    "outside a limit": (lambda r: text(HEAD, changed(r, 1, "b_j3_deg", "999")), ("line 3", "b_j3_deg", "limits")),
    "twice": (lambda r: text(HEAD, [*r, r[5]]), ("line 62", "duplicate of line 7")),
    "one end": (lambda r: text(HEAD, [*r, [*r[0][:7], *r[0][:7], "100"]]), ("line 62", "both ends are the same")),
    "no joints of a reflector": (
        lambda r: text(HEAD, [*r, [*r[0][:7], "r1", *[""] * 6, "100"]]),
        ("line 62", "'r1' is on the flange in other rows"),
    ),
    "a socket seen thrice": (
        lambda r: text(HEAD, [*r, *([*x[:7], "other", *[""] * 6, "700"] for x in r[:3])]),
        ("'other'", "3 distances"),
    ),
    "a reflector seen once": (lambda r: text(HEAD, changed(r, 0, "a_target", "r9")), ("'r9'", "1 distances")),
    "a still joint": (
        lambda r: text(HEAD, [[v if HEAD[k][2:] != "j6_deg" or not v else "1" for k, v in enumerate(x)] for x in r]),
        ("j6_deg", "constant"),
    ),
    "another clock": (lambda r: text([*HEAD, "clock_h"], [[*x, "1"] for x in r]), ("column clock_h", "unknown")),
    "too few": (lambda r: text(HEAD, [x for x in r if x[7] != "ball"][:6]), ("measured numbers", "more rows more")),
}


@pytest.mark.parametrize("case", BAD_DISTANCES)
def test_wrong_distances_are_refused_in_a_line(arm, tmp_path, distances, case):
    spoil, words = BAD_DISTANCES[case]
    with pytest.raises(InputError) as refused:
        read(arm, tmp_path, spoil(distances))
    message = str(refused.value)
    assert all(word in message for word in words), message
    assert len(message) <= 300 + len(str(tmp_path))
    assert "\n" not in message


METRES = [(k, v) for k, v in enumerate(SPHERES)]
LENGTH_MM = float(np.linalg.norm(SPHERES[0] - SPHERES[1])) / MM
BAD_TOUCHES = {
    "no length": (lambda: artefact(length=()), ("tells the scale", "[[length]]", "--distances")),
    "no certificate": (lambda: artefact("false"), ("tells the scale",)),
    "places that nobody certified": (lambda: artefact("", (), range(5)), ("tells the scale", "certified = true")),
    "a length to a sphere never touched": (
        lambda: artefact(length=()) + '[[sphere]]\nname = "z"\n[[length]]\nbetween = ["a", "z"]\nmm = 500\n',
        ("tells the scale",),
    ),
    "a length in metres": (lambda: artefact(mm=np.linalg.norm(SPHERES[0] - SPHERES[1])), ("length", "is it metres")),
    "a length in inches": (lambda: artefact(mm=LENGTH_MM / 25.4), ("length", "is it inches instead of mm?")),
    "another length": (lambda: artefact(mm=700.0), ("length of 700 mm", "apart")),
    "a length with itself": (lambda: artefact().replace('["a", "b"]', '["a", "a"]'), ("'a' twice",)),
    "a length that places deny": (lambda: artefact(known=range(5), mm=700.0), ("length.0.mm", "places are")),
    "places in metres": (lambda: artefact(places=SPHERES * 1e-3, length=(), known=range(5)), ("metres",)),
    "two names exchanged": (
        lambda: artefact(length=(), known=range(5)).replace('"a"', '"x"').replace('"b"', '"a"').replace('"x"', '"b"'),
        ("are exchanged",),
    ),
}


@pytest.mark.parametrize("case", BAD_TOUCHES)
def test_wrong_artefacts_are_refused_in_a_line(arm, tmp_path, centres, case):
    of, words = BAD_TOUCHES[case]
    with pytest.raises(InputError) as refused:
        read(arm, tmp_path, touches=text(TOUCH_HEAD, centres), of=of())
    message = str(refused.value)
    assert all(word in message for word in words), message
    assert len(message) <= 300 + len(str(tmp_path))


@pytest.mark.parametrize("off_mm", [-9.0, -7.0, 7.0, 9.0])
def test_a_certified_length_may_be_8_mm_off_what_the_arm_has_and_of_more_no_unit_is_blamed(
    arm, tmp_path, centres, off_mm
):
    of = artefact(mm=LENGTH_MM + off_mm)
    if abs(off_mm) < 8:
        assert len(read(arm, tmp_path, touches=text(TOUCH_HEAD, centres), of=of).fixed.length) == 1
    else:
        with pytest.raises(InputError, match=r"which the arm has 133\d mm apart; mend"):
            read(arm, tmp_path, touches=text(TOUCH_HEAD, centres), of=of)


def test_a_length_to_a_sphere_that_nobody_touches_denies_nothing(arm, tmp_path, centres):
    of = artefact() + '[[sphere]]\nname = "z"\n[[length]]\nbetween = ["a", "z"]\nmm = 5000\n'
    assert read(arm, tmp_path, touches=text(TOUCH_HEAD, centres), of=of).fixed.certified


def test_a_wrong_sign_of_touches_is_named(arm, tmp_path, centres):
    wrong = scaled(centres, ["j4_deg"], -1, TOUCH_HEAD)
    with pytest.raises(InputError, match="J4 fits with the opposite sign"):
        read(arm, tmp_path, touches=text(TOUCH_HEAD, wrong))


def test_a_sphere_anywhere_wants_four_sides(arm, tmp_path, sides):
    few = [r for n, r in enumerate(sides) if r[0] != "c" or n < 15]
    assert sum(r[0] == "c" for r in few) == 3
    with pytest.raises(InputError, match=r"'c' stands anywhere and is touched from 3 side"):
        read(arm, tmp_path, touches=text(SIDED_HEAD, few))


@pytest.mark.parametrize(
    ("of", "frames", "lengths"),
    [
        (artefact(), 0, 1),
        (artefact(length=(), known=range(5)), 1, 0),
        (artefact(length=(), known=(0, 1)), 0, 1),  # two places are a length
        (artefact("", (0, 1), range(5), sigma=50.0), 1, 1),
    ],
)
def test_what_an_artefact_says_of_its_spheres(arm, tmp_path, centres, of, frames, lengths):
    data = read(arm, tmp_path, touches=text(TOUCH_HEAD, centres), of=of)
    assert (len(data.instruments), len(data.fixed.length), len(data.fixed.names)) == (frames, lengths, 5)
    assert data.fixed.certified
    assert (data.kind == TOUCH).all()


def test_a_touch_that_says_its_noise_weighs_beside_others_that_do_not(arm, tmp_path, centres):
    """One alone that said so took the whole weight, which ended in a fault: the others counted as known to 0.5 m."""
    rows = [[*row, "400" if n == 7 else ""] for n, row in enumerate(centres)]
    data = read(arm, tmp_path, touches=text([*TOUCH_HEAD, "sigma_um"], rows))
    assert_allclose(data.sigma, np.where(np.arange(len(rows)) == 7, 20.0, 1.0))


def test_touches_without_a_scale_may_go_with_distances(arm, tmp_path, centres, distances):
    data = read(arm, tmp_path, text(HEAD, distances), text(TOUCH_HEAD, centres), artefact(length=()))
    assert {TOUCH, DISTANCE} == set(data.kind.tolist())


def test_one_sided_touches_lean_on_the_direction(arm, tmp_path, sides):
    """A joint's play is where the probing direction has brought it."""
    data = read(arm, tmp_path, touches=text(SIDED_HEAD, sides))
    assert (data.numbers == 1).all()
    J = [
        carried(arm, data.theta + 1e-6 * np.eye(6)[k], PROBE, 0) - carried(arm, data.theta, PROBE, 0) for k in range(6)
    ]
    moving = np.einsum("kni,nk->ni", np.array(J), data.direction)
    normal = np.array([[float(v) for v in r[-3:]] for r in sides])
    assert ((moving * normal).sum(axis=1) > 0).mean() > 0.9


@pytest.fixture(scope="module")
def identified(arm, tmp_path_factory):
    """An arm identified by distances and touches from one side, with the command."""
    folder = tmp_path_factory.mktemp("identified")
    rng = np.random.default_rng(5)
    (folder / "distances.csv").write_text(text(HEAD, distance_rows(arm, rng, 150, socket=30)))
    (folder / "touches.csv").write_text(text(SIDED_HEAD, touch_rows(arm, rng, 100, sided=True)))
    (folder / "artefact.toml").write_text(artefact(length=()))
    files = ["--distances", folder / "distances.csv", "--touches", folder / "touches.csv"]
    result = run("identify", "m710ic50", *files, "-o", folder / "mine.toml", "--json")
    return folder, files, result


def test_an_arm_is_identified_by_distances_and_touches(identified):
    folder, _, result = identified
    assert result.returncode == 0, result.stderr
    summary = json.loads(result.stdout)
    assert summary["verdict"] == "accepted"
    assert summary["kinds"]["distances"]["rows"] == 150
    assert summary["kinds"]["touches"]["rows"] == 100
    assert summary["kinds"]["distances"]["noise_um"] == pytest.approx(NOISE / UM, rel=0.4)
    codes = [f["code"] for f in summary["findings"]]
    assert "unobservable" in codes
    base = next(f["message"] for f in summary["findings"] if f["code"] == "unobservable")
    assert all(word in base for word in ("base_frame", "zero of J1", "d1"))
    written = tomllib.loads((folder / "mine.toml").read_text())
    zeros = written["sources"]["joint_zeros"]["offset_mdeg"]
    assert np.abs(np.array(zeros[1:5]) - ERROR[1:5] / DEG * 1e3).max() < 5
    assert "instrument_mm" not in written["identified"]
    assert set(written["identified"]["place_mm"]) == {"ball", *(f"artefact.toml: {n}" for n in NAMES)}
    assert np.linalg.norm(np.array(written["identified"]["place_mm"]["ball"]) - SOCKET / MM) < 5
    provenance = written["sources"]["joint_zeros"]["provenance"]
    assert all(name in provenance for name in ("distances.csv (", "touches.csv (", "artefact.toml ("))
    assert (folder / "mine.html").read_text().count("<h2") > 4


def test_the_same_files_validate_what_they_identified(identified, arm):
    folder, files, _ = identified
    result = run("check-robot", folder / "mine.toml", *files, "--json")
    assert result.returncode == 0, result.stderr
    overall = json.loads(result.stdout)["overall"]
    assert overall["identified"]["rms"] < 2 * NOISE / MM < 0.1 * overall["nominal"]["rms"]
    refit = run("check-robot", folder / "mine.toml", *files, "--refit-frames", "--max-um", "20", "--json")
    assert refit.returncode == 1
    assert "exceeds --max-um" in refit.stderr
    fresh = distance_rows(arm, np.random.default_rng(77), 3)
    (folder / "fresh.csv").write_text(text(HEAD, fresh))
    few = run("check-robot", folder / "mine.toml", "--distances", folder / "fresh.csv", "--json")  # three are enough
    assert few.returncode == 0, few.stderr
    assert json.loads(few.stdout)["overall"]["identified"]["max"] < 5 * NOISE / MM
    (folder / "other.csv").write_text(text(HEAD, [[*r[:7], "else", *r[8:]] for r in fresh]))
    other = run("check-robot", folder / "mine.toml", "--distances", folder / "other.csv")
    assert other.returncode == 2
    assert "'else' is not in" in other.stderr


def test_options_that_nothing_uses_are_refused(tmp_path, arm, distances):
    (tmp_path / "distances.csv").write_text(text(HEAD, distances))
    for option in ("--artefact", "--frames"):
        result = run("identify", "m710ic50", "--distances", tmp_path / "distances.csv", option, "part.toml")
        assert result.returncode == 2
        assert result.stderr.count("\n") == 1
        assert option in result.stderr
    nothing = run("identify", "m710ic50")
    assert nothing.returncode == 2
    assert "--distances" in nothing.stderr


def test_a_single_sphere_alone_never_tells_the_scale(arm, tmp_path):
    """Not even of a certified place: an arm twice as large would touch it twice as far away."""
    rows = touch_rows(arm, np.random.default_rng(21), 40, places=SPHERES[:1])
    with pytest.raises(InputError, match="tells the scale"):
        read(arm, tmp_path, touches=text(TOUCH_HEAD, rows), of=artefact(length=(), known=(0,), places=SPHERES[:1]))


def test_what_a_small_sweep_cannot_see_is_named(arm, tmp_path):
    """A ballbar whose wrist stands: J4 to J6 stay where they are."""
    rng = np.random.default_rng(22)
    theta = random_theta(arm.robot, rng, 80)
    theta[:, 3:] = theta[0, 3:]
    where = carried(arm, theta, PRISM[0])
    rows = [
        ["r1", *degrees(arm, q), "ball", f"{np.linalg.norm(p - SOCKET) / MM:.5f}"]
        for q, p in zip(theta, where, strict=True)
    ]
    data = read(arm, tmp_path, text([*DISTANCE_HEAD[:8], "distance_mm"], rows), force=True)
    parts = symbolic_sources(arm.robot, arm.known, np.ones(6, dtype=bool), warm=False, facts=arm.facts)
    model = build_model(arm.robot, [s for s in parts if s.original.NAME in ("joint_zeros", "link_offsets")], 0)
    fitted = fit(model, data, np.ones(len(model.parameters), dtype=bool))
    findings = [f.message for f in unobservable(model, data, fitted)]
    assert "base_frame" in findings[0]
    named = " ".join(unseen_directions(model, data, fitted))
    seen = [p.name for p in model.parameters if p.name not in named]
    # beyond J3 all stands, and the reflector's place takes it up; so it does the zero of J3
    assert all(f"joint_zeros.offset_mdeg[{k}]" in named for k in (3, 4, 5))
    assert "link_offsets.alpha_mdeg[5]" in named
    assert {"joint_zeros.offset_mdeg[2]", "link_offsets.a_um[2]"} <= set(seen)
    assert findings[1].startswith("no row sees ")


def test_a_warm_arm_measured_by_distances_alone(tmp_path):
    """Its log goes with the distances' times; rises come to the poses of both ends."""
    heated = load_arm(heated_robot(tmp_path))
    rng = np.random.default_rng(23)
    rows = [[*r, f"{60.0 * n:.0f}"] for n, r in enumerate(distance_rows(heated, rng, 60))]
    (tmp_path / "warm.csv").write_text(text([*HEAD, "time_s"], rows))
    log = ["time_s," + ",".join(f"{name}_degC" for name in heated.nodes)]
    nodes = range(1, len(heated.nodes) + 1)
    log += [",".join([str(t), *(f"{20 + t / 600 * k:.2f}" for k in nodes)]) for t in range(0, 3660, 60)]
    (tmp_path / "log.csv").write_text("\n".join(log) + "\n")
    files = MeasurementFiles(distances=[str(tmp_path / "warm.csv")], log=str(tmp_path / "log.csv"))
    data, _ = read_measurements(heated, files, force=False)
    assert_allclose(data.rise[data.pose[30]], 30 * 60 / 600 * np.arange(1, len(heated.nodes) + 1), atol=0.15)
    assert data.ends is not None
    assert_allclose(data.rise[data.ends.pose[30]], data.rise[data.pose[30]])
    assert (data.warm[data.pose[-10:]] > 0).all()
    (tmp_path / "cold.csv").write_text(text(HEAD, [r[:-1] for r in rows]))
    with pytest.raises(InputError, match="no measurements have times"):
        read_measurements(heated, MeasurementFiles(distances=[str(tmp_path / "cold.csv")], log=files.log), force=False)


def test_a_certified_artefact_is_the_frame_that_validate_knows(arm, tmp_path):
    """World stands in the artefact's axes; another touch of it is judged without any fit."""
    rng = np.random.default_rng(24)
    (tmp_path / "touches.csv").write_text(text(TOUCH_HEAD, touch_rows(arm, rng, 150)))
    (tmp_path / "artefact.toml").write_text(artefact(length=(), known=range(5)))
    made = run("identify", "m710ic50", "--touches", tmp_path / "touches.csv", "-o", tmp_path / "mine.toml", "--json")
    assert made.returncode == 0, made.stderr
    record = tomllib.loads((tmp_path / "mine.toml").read_text())["identified"]
    assert set(record["artefact_mm"]) == {"artefact.toml"}
    assert "instrument_mm" not in record
    (tmp_path / "touches.csv").write_text(text(TOUCH_HEAD, touch_rows(arm, rng, 10)))
    result = run("check-robot", tmp_path / "mine.toml", "--touches", tmp_path / "touches.csv", "--json")
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout)["overall"]["identified"]["rms"] < 3 * NOISE / MM
    unknown = run("check-robot", "m710ic50", "--touches", tmp_path / "touches.csv")
    assert unknown.returncode == 2
    assert "--refit-frames" in unknown.stderr


def test_a_probe_whose_ball_is_forgotten_is_refused(arm, tmp_path, sides):
    """1 mm where the ball has 5: lengths and zeros took it up, 2.3 mm off elsewhere, and the file was accepted."""
    of = artefact().replace("[probe]\ndiameter_mm = 5", "[probe]\ndiameter_mm = 1")
    refusals = []
    for artefact_text in (artefact(), of):
        data = read(arm, tmp_path, touches=text(SIDED_HEAD, sides), of=artefact_text)
        identification = identify(arm.robot, arm.known, data, len(arm.nodes), quiet, temperatures=False)
        refusals.append([f.message for f in identification.findings if f.code == "unexplained"])
    assert refusals[0] == []
    (message,) = refusals[1]
    assert "does diameter_mm of [probe] or of a sphere say the radius" in message
    assert len(message) <= 300


def test_touches_that_never_tilt_the_probe_are_refused(arm, tmp_path):
    """Its place and those of the spheres are then one."""
    rng = np.random.default_rng(31)
    target = np.arange(80) % 5
    level = np.tile(np.diag([1.0, -1.0, -1.0]), (80, 1, 1))
    where = SPHERES[target] + rng.normal(0, NOISE, (80, 3))
    theta = solve_tool(arm.robot, Pose(where, level), Pose(PROBE, np.eye(3)), Posture())[0] - ERROR
    rows = [[NAMES[t], *degrees(arm, q)] for t, q in zip(target, theta, strict=True)]
    (tmp_path / "touches.csv").write_text(text(TOUCH_HEAD, rows))
    (tmp_path / "artefact.toml").write_text(artefact())
    made = run(
        "identify", "m710ic50", "--touches", tmp_path / "touches.csv", "-o", tmp_path / "mine.toml", "--force", "--json"
    )
    assert made.stdout, made.stderr
    findings = {f["code"]: f for f in json.loads(made.stdout)["findings"]}
    assert findings["frames"]["level"] == "refused"
    assert "spheres or sockets" in findings["frames"]["message"]
    assert made.returncode == 1


def shape_left(moved, place):
    """Moves (M, 3) of places less the best shift and small turn of all, by least squares."""
    x, y, z = (place - place.mean(axis=0)).T
    turns = [np.stack(c, axis=1) for c in ((0 * x, -z, y), (z, 0 * x, -x), (-y, x, 0 * x))]
    D = np.column_stack([*(np.tile(e, len(place)) for e in np.eye(3)), *(t.ravel() for t in turns)])
    return moved - (D @ np.linalg.lstsq(D, moved.ravel(), rcond=None)[0]).reshape(-1, 3)


def test_how_well_the_flange_is_known_is_what_drawn_arms_of_the_posterior_differ_by(arm, centres, tmp_path):
    data = read(arm, tmp_path, touches=text(TOUCH_HEAD, centres))
    parts = symbolic_sources(arm.robot, arm.known, np.ones(6, dtype=bool), warm=False, facts=arm.facts)
    model = build_model(arm.robot, [s for s in parts if s.original.NAME in ("joint_zeros", "link_offsets")], 0)
    fitted = fit(model, data, np.ones(len(model.parameters), dtype=bool))
    limits = np.column_stack([data.theta.min(axis=0), data.theta.max(axis=0)])
    rng = np.random.default_rng(41)
    theta = rng.uniform(limits[:, 0], limits[:, 1], (300, 6))
    rows = blank_rows(theta, np.arange(300), [""] * 300, 0)
    place, _ = model.pose(rows, fitted.p)
    K = len(fitted.p)
    drawn = rng.multivariate_normal(np.zeros(K), fitted.posterior.covariance[:K, :K], 200) * model.prior
    left = [shape_left(model.pose(rows, fitted.p + p)[0] - place, place) for p in drawn]
    assert taught_sigma(model, fitted, 0, limits) == pytest.approx(np.sqrt(np.mean(np.square(left))), rel=0.1)


def test_two_spheres_alone_are_said_to_tell_little_of_the_rest(arm, tmp_path):
    """And an arm measured everywhere has no such warning."""
    said = {}
    for count, places in (("two", SPHERES[:2]), ("five", SPHERES)):
        rows = touch_rows(arm, np.random.default_rng(42), 60 if count == "two" else 150, places=places)
        (tmp_path / "touches.csv").write_text(text(TOUCH_HEAD, rows))
        (tmp_path / "artefact.toml").write_text(artefact(places=places))
        made = run(
            "identify", "m710ic50", "--touches", tmp_path / "touches.csv", "-o", tmp_path / f"{count}.toml", "--json"
        )
        assert made.returncode == 0, made.stderr
        said[count] = json.loads(made.stdout)
    here, anywhere = (said["two"]["known_um"][k] for k in ("measured", "anywhere"))
    assert anywhere > 4 * here
    warned = [f for f in said["two"]["findings"] if f["code"] == "narrow" and "beyond those measured" in f["message"]]
    assert [f["level"] for f in warned] == ["warning"]
    assert f"+- {anywhere:.0f} um only" in warned[0]["message"]
    assert said["five"]["known_um"]["measured"] < here
    boxes = {}
    for count in said:
        page = (tmp_path / f"{count}.html").read_text()
        (boxes[count],) = re.findall(r'<div class="big (\w+)">(.*?)</div>', page, re.S)
    assert {count: kind for count, (kind, _) in boxes.items()} == {"two": "warning", "five": "inside"}
    assert all("Accepted." in words for _, words in boxes.values())
    assert f"&plusmn;{anywhere:.0f} &micro;m</b> with any: it tells little of the arm" in boxes["two"][1]
    assert "tells little" not in boxes["five"][1]
