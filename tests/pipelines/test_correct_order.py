"""Only what is surely driven is judged as a way; a way that cannot be driven stops nothing else."""

import json

import numpy as np
import pytest
from command_line import run
from corrected import MANY, ROUNDED_UM, corrected
from flawed import flawed_file
from ls_text import at, cartesian, program
from shipped import ROOT

from compgen.core.arrays import norm
from compgen.core.finding_codes import Level
from compgen.core.pose import Pose
from compgen.fanuc import loads
from compgen.fanuc.analysis.poses import program_poses
from compgen.fanuc.analysis.traversal import read_traversal
from compgen.pipelines.files.robot_file import load_cell
from compgen.program.ways import REACH_SUBDIVISIONS, interpolate_poses, measure_reach
from compgen.robot.configuration import parse_config
from compgen.robot.inverse_kinematics import ALL_POSTURES, flange_from_tool, solve_flange

DOWN = (180.0, 0.0, 0.0)
ASIDE = [cartesian(n, (*place, *DOWN)) for n, place in enumerate(
    [(150, 1200, -100), (200, 1150, -100), (150, -1200, -100), (200, -1150, -100)], 1)]  # fmt: skip
AHEAD = [cartesian(n, (*place, *DOWN)) for n, place in enumerate(
    [(1200, 0, 300), (1250, 0, 300), (1250, 100, 300)], 5)]  # fmt: skip
BEGIN = [
    "J P[5] 50% FINE",
    "L P[6] 100mm/sec FINE",
    "L P[7] 100mm/sec FINE",
    "J P[1] 50% FINE",
    "L P[2] 100mm/sec FINE",
]
THROUGH = ["L P[3] 100mm/sec FINE", "L P[4] 100mm/sec FINE"]


@pytest.fixture(scope="module")
def hot():
    return load_cell(str(ROOT / "robots" / "m710ic50.toml"))


def findings(result, code):
    return [f for f in result.findings if f.code == code]


def judged_ways(result):
    """P numbers of ends of ways that were judged between their ends."""
    station = result.execution.station[result.judged & (result.execution.fraction < 1)]
    return set(result.plan.poses.number[result.plan.drive.pose[station]].tolist())


def test_a_line_that_a_jump_skips_does_not_stop_the_correction(hot):
    listing = [*BEGIN, "JMP LBL[9]", "LBL[1]", *THROUGH, "LBL[9]", "L P[1] 100mm/sec FINE"]
    result = corrected(program(listing, [*ASIDE, *AHEAD]), hot)
    assert result.is_usable
    assert result.changed == 7
    assert not findings(result, "correction.reach")
    assert judged_ways(result) == {6, 7, 2, 4, 1}  # to P[1] along the jump from P[2], not from P[4]
    assert result.residual.distance[result.judged].max() * 1e6 < ROUNDED_UM


@pytest.mark.parametrize("options", [{}, {"insert": 5e-6}, {"split": True}])
def test_a_line_through_the_arm_itself_is_named_and_its_ends_are_judged_alone(options, hot):
    data = program([*BEGIN, *THROUGH], [*ASIDE, *AHEAD])
    result = corrected(data, hot, **options)
    (finding,) = findings(result, "correction.reach")
    line = next(i for i, text in enumerate(result.text.decode().splitlines(), 1) if "L P[3]" in text)
    assert finding.level is Level.WARNING
    assert finding.message.startswith(f"line {line}: ")
    assert len(finding.message) <= 300
    assert result.is_usable
    assert 3 not in judged_ways(result)
    reached = result.plan.poses.number[result.plan.drive.pose[result.execution.station[result.judged]]]
    assert {1, 2, 3, 4, 5, 6, 7} <= set(reached.tolist())


def test_the_command_writes_such_a_program(tmp_path):
    (tmp_path / "MIDWAY.LS").write_bytes(program([*BEGIN, *THROUGH], [*ASIDE, *AHEAD], name="MIDWAY"))
    robot = str(ROOT / "robots" / "m710ic50.toml")
    done = run("correct", "MIDWAY.LS", "--robot", robot, "--max-um", "5", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "outputs" / "MIDWAY" / "MIDWAY.LS").exists()


@pytest.mark.parametrize(
    ("between", "judged"),
    [
        (["LBL[1]"], False),
        (["CALL QUIET"], True),
        (["CALL GOES"], False),
        (["CALL ABSENT"], False),
        (["OPEN_HAND"], False),
        (["DO[1]=ON"], True),
    ],
)
def test_ways_are_judged_where_the_called_program_stands_still(between, judged, tmp_path):
    moves = ["J P[5] 50% FINE", *between, "L P[6] 100mm/sec FINE", "L P[7] 100mm/sec FINE", "JMP LBL[1]"]
    (tmp_path / "MAIN.LS").write_bytes(program(moves, AHEAD, name="MAIN"))
    (tmp_path / "quiet.ls").write_bytes(program(["DO[1]=ON"], [], name="QUIET"))
    (tmp_path / "GOES.LS").write_bytes(program(["J P[5] 50% FINE"], AHEAD, name="GOES"))
    done = run(
        "correct", "MAIN.LS", "--before", "moving 200mm/s 5h", "--json", "--max-um", "5", "--robot",
        str(ROOT / "robots" / "m710ic50.toml"), cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    named = [f for f in json.loads(done.stdout)["findings"] if f["code"] == "correction.order"]
    assert bool(named) is not judged


def test_no_points_go_into_a_way_that_may_begin_elsewhere(hot):
    far = [*AHEAD[:2], cartesian(7, (1250, 900, 300, *DOWN))]
    moves = ["J P[6] 50% FINE", "OPEN_HAND", "L P[7] 100mm/sec FINE"]
    assert corrected(program(moves, far), hot, insert=0.5e-6).added == 0
    assert corrected(program([moves[0], moves[2]], far), hot, insert=0.5e-6).added > 0


def test_stations_that_are_not_surely_neighbours_are_not_smoothed_together(hot):
    points = [cartesian(n, (1200, 2.0 * n, 300, *DOWN)) for n in range(1, 9)]
    moves = [f"L P[{n}] 50mm/sec CNT100" for n in range(1, 9)]
    alone = corrected(program([*moves[:4], "OPEN_HAND", *moves[4:]], points), hot).plan.stations.correction
    first, second = (corrected(program(part, points), hot) for part in (moves[:4], moves[4:]))
    assert np.abs(alone[:4] - first.plan.stations.correction).max() < 1e-12
    assert np.abs(alone[4:] - second.plan.stations.correction).max() < 1e-7  # warmer by the way between them


def test_an_arm_that_remembers_its_direction_forgets_it_where_the_order_is_not_sure(tmp_path, hot):
    cell = load_cell(flawed_file(tmp_path))
    parts = [AHEAD[0], AHEAD[1], AHEAD[2]]
    whole = program(["J P[5] 50% FINE", "L P[6] 100mm/sec FINE", "OPEN_HAND", "L P[7] 100mm/sec FINE"], parts)
    result = corrected(whole, cell, MANY)
    assert result.is_usable
    motion = result.plan.stations.midway
    known = corrected(whole.replace(b"OPEN_HAND", b"DO[1]=ON "), cell, MANY)
    assert findings(result, "sources.order")
    assert not findings(known, "sources.order")
    assert not findings(corrected(whole, hot, MANY), "sources.order")  # an arm that remembers none
    assert np.abs(known.plan.stations.midway.direction - motion.direction).max() > 0.1
    assert result.residual.distance[result.judged].max() < 5e-6


def test_a_place_that_stays_as_it_is_leads_in_to_the_next(tmp_path):
    """P[5] is read into a register and not corrected: behind the way from it the side of J1 is known."""
    cell, moves = load_cell(flawed_file(tmp_path)), ["J P[5] 50% FINE", "J P[1] 50% FINE"]
    begins = corrected(program(moves[1:], [ASIDE[0]]), cell, MANY)
    led = corrected(program(["PR[2]=P[5]", *moves], [AHEAD[0], ASIDE[0]]), cell, MANY)
    assert led.changed == 1
    assert ["J1 " in f.message for f in findings(begins, "sources.start")] == [True]
    assert not any("J1 " in f.message for f in findings(led, "sources.start"))


def test_a_line_that_only_its_correction_brings_through_the_arm_breaks_a_bound():
    """The base stands 2 mm off, away from it: 291.5 mm beside the axis a line just passes the arm's inner reach."""
    off = ["sources.base_frame.position_um=[2000, 0, 0]", "sources.base_frame.rotation_mdeg=[0, 0, 0]"]
    cell, points, moves = load_cell(str(ROOT / "robots" / "m710ic50.toml"), off), [], []
    for n, x in ((1, 290), (3, 293), (5, 300)):
        points += [cartesian(n, (x, 1150, -100, *DOWN)), cartesian(n + 1, (x, -1150, -100, *DOWN))]
        moves += [f"J P[{n}] 50% FINE", f"L P[{n + 1}] 100mm/sec FINE"]
    result = corrected(program(moves, points), cell, MANY, before=())
    planned, corrected_alone, past_limit = findings(result, "correction.reach")
    assert (planned.level, corrected_alone.level) == (Level.WARNING, Level.OUTSIDE)
    assert planned.message.startswith("line 5: the straight way there leaves the reach")
    assert corrected_alone.message.startswith("line 7: corrected, the straight way there would leave the reach")
    assert past_limit.message.endswith("J2 goes beyond -90 to 135 deg; teach a position between")


SPIKE = [[-90, -100], [135, -100], [135, 40], [27, 40], [25, -40], [23, 40], [-90, 40]]


@pytest.mark.parametrize(("polygon", "ends"), [([], [(-1200, y, 300) for y in (100, -100)]), (SPIKE, None)])
def test_a_line_past_a_limit_between_ends_that_keep_it_is_named(tmp_path, polygon, ends):
    """J1 from 175 to -175 deg, or J2 and J3 through the polygon's edge midway: *inside* was all that was said."""
    stock = (ROOT / "robots" / "m710ic50.toml").read_text().replace("j2_j3_deg = []", f"j2_j3_deg = {polygon}")
    (tmp_path / "m710ic50.toml").write_text(stock)
    cell = load_cell(str(tmp_path / "m710ic50.toml"))
    if ends is None:
        points = [at(n, (0, 10 * n + 10, -10 * n - 10, 0, -80 + 10 * n, 0)) for n in (1, 2)]
    else:
        points = [cartesian(n, (*place, *DOWN)) for n, place in enumerate(ends, 1)]
    moves = ["J P[1] 50% FINE", "L P[2] 100mm/sec FINE"]
    (finding,) = findings(corrected(program(moves, points), cell), "correction.reach")
    assert finding.level is Level.WARNING
    words = "J2 and J3 of m710ic50 leave limits.interference.j2_j3_deg, where the arm hits itself"
    if ends is not None:
        words = "J1 goes beyond -180 to 180 deg"
    assert finding.message == f"line 5: on the way there, between ends that keep it, {words}; teach a position between"


def test_a_correction_that_leads_out_of_reach_holds_its_station(tmp_path):
    shorter = ("sources.link_offsets.a_um=[-500, -900, 90, -70, 40, 30]",)
    cell = load_cell(flawed_file(tmp_path), shorter)
    robot = cell.robot
    posture, _ = parse_config("N U T, 0, 0, 0")
    assert posture is not None
    points = []
    for n, azimuth in enumerate(np.linspace(-1, 1, 12), 1):
        direction = np.array([np.cos(azimuth), np.sin(azimuth), 0.2])
        near, far = 0.8, 3.0
        for _ in range(60):
            middle = (near + far) / 2
            place = Pose(middle * direction[None], np.diag([1.0, -1.0, -1.0])[None])
            margin = solve_flange(robot, place, posture)[1][0]
            near, far = (middle, far) if margin > 1.1e-3 else (near, middle)
        points.append(cartesian(n, (*(near * direction * 1e3), *DOWN)))
    result = corrected(program([f"J P[{n}] 50% FINE" for n in range(1, 13)], points), cell, MANY)
    assert "its correction would lead out of reach" in {reason for _, reason in result.plan.stations.held}


def test_the_quick_way_to_know_that_a_line_stays_in_reach_misses_none(hot):
    rng = np.random.default_rng(3)
    robot, left = hot.robot, 0
    for letters in ("N U T, 0, 0, 0", "F U B, 0, 0, 0", "N D T, 0, 0, 0"):
        places = rng.uniform([-1700, -1700, -900, -180, -180, -180], [1700, 1700, 1500, 180, 180, 180], (400, 6))
        points = [cartesian(n, place, ut=1, letters=letters) for n, place in enumerate(places, 1)]
        loaded = loads(program([f"L P[{n}] 50mm/sec FINE" for n in range(1, 401)], points))
        frames = MANY.__class__(MANY.uframe, {**MANY.utool, 1: Pose(np.array([0.1, 0.05, 0.3]), np.eye(3))})
        poses = program_poses(loaded, robot, frames)
        drive = measure_reach(robot, read_traversal(loaded, poses, robot))
        known = np.asarray(np.isfinite(poses.theta).all(axis=1))
        ways = np.flatnonzero(known[1:] & known[:-1]) + 1
        for k in range(1, REACH_SUBDIVISIONS):
            tcp = interpolate_poses(drive, ways, np.full(len(ways), k / REACH_SUBDIVISIONS))
            posture = ALL_POSTURES[int(poses.posture[0])]
            _, margin = solve_flange(robot, flange_from_tool(tcp, poses.tools[1]), posture)
            assert (drive.beyond[ways] >= -margin - 1e-12).all()
        left += int((drive.beyond[ways] > 0).sum())
        assert (drive.beyond[ways] == 0).any()
    assert left > 20
    assert norm(poses.tcp.position).max() > 0
