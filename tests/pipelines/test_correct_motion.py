"""A listing commanded against the controller's motion, flown by plain numpy: nearer to its path, and nowhere farther.

The judge reads the texts by the second reader, drives each statement for whole periods of 8 ms, and averages.
"""

from functools import cache

import naive_ls
import numpy as np
import pytest
from corrected import corrected
from ls_text import cartesian, program
from scipy.spatial import cKDTree
from shipped import ROOT

from compgen.core.finding_codes import Level
from compgen.core.units import UM
from compgen.pipelines.files.robot_file import load_cell
from compgen.pipelines.findings.motion_findings import WHAT
from compgen.report.correction import band_of_correction
from compgen.thermal.ensemble import Ensemble

PERIOD = 8.0  # ms
MEANS = (200, 104)  # ms
STEP, APART = 0.5, 0.25  # ms, mm
WORSE = 1.0 + 0.9  # um: what the command may add at a place, and two roundings of three decimals
STRETCH = 100  # places along the path, of which the worst is compared


@cache
def cell(enabled=True, means=MEANS, began="both", cte=0):
    keys = [
        f"motion.moving_average_ms={list(means)}",
        f'motion.identified={{robot="m710ic50", verdict="accepted", runs_began="{began}"}}',
        f"motion.enabled={str(enabled).lower()}",
    ]
    return load_cell(str(ROOT / "robots" / "m710ic50.toml"), [f"thermal.cte_um_m_K={cte}", *keys] if cte == 0 else keys)


# The judge ---------------------------------------------------------------------------------------------------------


def statements(data):
    """Of each way its points (n, 3) [mm], its speed, and n of CNT, 0 at FINE; a joint motion is a slow line."""
    places, moves = naive_ls.read(data)
    now, ways = None, []
    for move in moves:
        ends = [[float(places[int(t[2:-1])].groups[1].axes[k] or 0) for k in "XYZ"] for t in move.targets]
        if now is not None and not np.allclose(now, ends[-1]):
            speed = 100.0 if move.letter == "J" else naive_ls.mm_s(move.speed)
            line = np.array([now, *ends]) if len(ends) == 1 else through(*np.array([now, *ends]))
            ways.append((line, speed, int(move.termination[3:] or 0) if move.termination != "FINE" else 0))
        now = ends[-1]
    return ways


def through(start, via, end):
    """Points of the arc through three places, (4001, 3) [mm]."""
    u, w = via - start, end - start
    square = np.cross(u, w)
    centre = start + (np.cross(square, u) * (w @ w) + np.cross(w, square) * (u @ u)) / (2 * square @ square)
    x = start - centre
    y = np.cross(square / np.linalg.norm(square), x)
    angle = np.arctan2((end - centre) @ y, (end - centre) @ x) % (2 * np.pi)
    at = np.linspace(0, angle, 4001)[:, None]
    return centre + np.cos(at) * x + np.sin(at) * y


def way_of(line):
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])


def flown(ways, means):
    """Where the tool goes, (M, 3) [mm]: whole periods a statement, waits at FINE and CNT n, and plain means."""
    whole, now, time, places = sum(means), 0.0, [0.0], [ways[0][0][0]]
    for line, speed, n in ways:
        way = way_of(line)
        lasts = PERIOD * np.ceil(1000 * way[-1] / speed / PERIOD - 1e-6)
        time += [*(now + lasts * way[1:] / way[-1])]
        places += [*line[1:]]
        waits = whole if n == 0 else PERIOD * np.floor((whole / PERIOD - 1) * (1 - np.sqrt(n / 100)) + 1e-9)
        now += lasts + waits
        time.append(now)
        places.append(line[-1])
    grid = np.arange(-whole, now + whole, STEP)
    drawn = np.column_stack([np.interp(grid, time, column) for column in np.array(places).T])
    for mean in means:
        n, first = round(mean / STEP), drawn[0]
        total = np.cumsum(np.concatenate([np.repeat(drawn[:1], n + 1, axis=0), drawn]) - first, axis=0)
        total = (total[1:] + total[:-1]) / 2
        drawn = (total[n:] - total[:-n]) / n + first
    return drawn


def off_path(planned, text, means):
    """How far the tool that drives a text is off the planned path at most on each stretch of it, [um]."""
    parts = []
    for line, _, _ in statements(planned):
        way = way_of(line)
        at = np.union1d(way, np.arange(0, way[-1], APART))
        parts.append(np.column_stack([np.interp(at, way, column) for column in line.T]))
    path = np.concatenate(parts)
    path = path[np.append(True, np.linalg.norm(np.diff(path, axis=0), axis=1) > 1e-3)]
    drawn = flown(statements(text), means)
    nearest, off = cKDTree(path).query(drawn)[1], np.full(len(drawn), np.inf)
    for k in (np.maximum(nearest - 1, 0), np.minimum(nearest, len(path) - 2)):
        line = path[k + 1] - path[k]
        share = np.clip(((drawn - path[k]) * line).sum(axis=1) / (line**2).sum(axis=1), 0, 1)
        off = np.minimum(off, np.linalg.norm(drawn - path[k] - share[:, None] * line, axis=1))
    worst = np.zeros(len(path) // STRETCH + 1)
    np.maximum.at(worst, nearest // STRETCH, 1000 * off)
    return worst


def compared(data, result, means=MEANS):
    """What the tool is led off [um] without and with the command; nowhere more."""
    before, after = off_path(data, data, means), off_path(data, result.text, means)
    assert (after - before).max() < WORSE
    return before, after


# Programs ----------------------------------------------------------------------------------------------------------


def listing(points, words, speed=200, first="FINE", via=None):
    """A joint motion to the first point, lines to the others, or arcs by vias of their numbers."""
    statement, places, n = [f"J P[1] 20% {first}"], [cartesian(1, (*points[0], 180.0, 0.0, 0.0))], 1
    for k, (point, word) in enumerate(zip(points[1:], words, strict=True), 1):
        by = [] if via is None else [via[k - 1]]
        for place in (*by, point):
            n += 1
            places.append(cartesian(n, (*np.round(place, 3), 180.0, 0.0, 0.0)))
        target = f"L P[{n}]" if via is None else f"C P[{n - 1}]\n    :  P[{n}]"
        statement.append(f"{target} {speed}mm/sec {word}")
    return program(["UFRAME_NUM=0", "UTOOL_NUM=0", *statement], places, name="RUN")


def circle(chord, radius=300.0, turn=2 * np.pi):
    at = np.linspace(0, turn, round(turn * radius / chord) + 1)
    return np.column_stack([1300 + radius * np.cos(at), radius * np.sin(at), 0 * at])


def to_the_end(points, word="CNT100"):
    return [word] * (len(points) - 2) + ["FINE"]


CORNERS = [(1300.0, 0.0, 0.0), (1300.0, 300.0, 0.0), (1500.0, 300.0, 0.0), (1500.0, 0.0, 100.0)]
RASTER = [(1300.0 + 10 * (k // 2), 100.0 * (-1) ** ((k + 1) // 2), 0.0) for k in range(12)]
HUNDRED = circle(18.85)


# Circles -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("chord", "speed", "led"), [(1.0, 100, 28), (2.0, 200, 112)])
def test_a_circle_of_short_chords_is_flown_within_4_um(chord, speed, led):
    """A chord of 1 mm at 100 mm/s lasts two periods: it is driven at 62."""
    points = circle(chord)
    data = listing(points, to_the_end(points), speed)
    result = corrected(data, cell(), bound=5e-6)
    before, after = compared(data, result)
    assert before.max() == pytest.approx(led, rel=0.03)
    claimed = result.command.left.largest / UM
    assert after.max() < min(1.3 * claimed, 4.0)
    assert claimed < 4.5
    assert result.command.plain.largest / UM == pytest.approx(before.max(), rel=0.01)
    assert result.residual.distance[result.judged].max() < 0.9 * UM
    assert result.verdict == "inside"
    (finding,) = (f for f in result.findings if f.code.startswith("motion."))
    assert finding.code == "motion.predistorted"
    assert f"{claimed:.1f} um" in finding.message
    assert len(finding.message) < 300
    assert b"RUN AT 100% OVERRIDE" in result.text


def test_a_warm_robot_has_both_in_one_text():
    """What its text has beyond that of a robot whose motion is not commanded against, flown by itself."""
    points = circle(2.0)
    data = listing(points, to_the_end(points))
    both, alone = corrected(data, cell(cte=1)), corrected(data, cell(cte=1, enabled=False))
    moved, own = (
        np.array([[p.groups[1].axes[k] for k in "XYZ"] for p in naive_ls.read(r.text)[0].values()])
        for r in (both, alone)
    )
    assert np.abs(own - points).max() > 0.05
    after = off_path(data, listing(points + moved - own, to_the_end(points)), MEANS)
    assert after.max() < 1.3 * both.command.left.largest / UM
    assert both.residual.distance[both.judged].max() < 1.2 * UM
    assert both.command.left.largest < 4.5 * UM


@pytest.mark.parametrize(
    ("how", "is_led"),
    [
        ({}, True),
        ({"ensemble": Ensemble((0.0, 600.0))}, True),
        ({"ensemble": Ensemble(overrides=(0.5,))}, False),
        ({"ensemble": Ensemble(overrides=(0.5, 1.0))}, False),
        ({"raised": 0.05}, False),
    ],
)
def test_the_motion_at_100_percent_is_commanded_against_where_no_other_override_is_served(how, is_led):
    """What leads it there would lead it astray at half the speed; a dry run is driven slowly."""
    points = circle(2.0, turn=0.3)
    result = corrected(listing(points, to_the_end(points)), cell(), **how)
    assert any(f.code == "motion.predistorted" for f in result.findings) == is_led
    assert (result.command is not None) == is_led


# What stays as it is -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (listing(RASTER, ["FINE"] * 11), None),
        (listing(RASTER, to_the_end(RASTER)), None),
        (listing(CORNERS, to_the_end(CORNERS)), None),
        (listing(HUNDRED, to_the_end(HUNDRED)), "too far apart"),
        (listing(circle(1.6), to_the_end(circle(1.6))), "one more interpolation period"),
        (listing(circle(2.0), to_the_end(circle(2.0))).replace(b"UFRAME_NUM=0", b"OVERRIDE=50%"), "at run time"),
        (listing(circle(2.0), to_the_end(circle(2.0)), first="CNT100"), "begin and end at a stop"),
    ],
    ids=[
        "raster FINE",
        "raster CNT100",
        "polygon",
        "hundred corners",
        "just whole periods",
        "another override",
        "from a joint motion",
    ],
)
def test_what_nobody_wants_bent_stays_as_it_is(data, why):
    result = corrected(data, cell())
    assert result.text == data
    assert not result.command.runs
    assert any(why in kept for kept in result.command.kept) if why else not result.command.kept


@pytest.mark.parametrize("keys", [{"enabled": False}, {"began": "long"}])
def test_without_the_conditions_of_generate_no_byte_changes(keys):
    points = circle(2.0)
    data = listing(points, to_the_end(points))
    assert corrected(data, cell(**keys)).text == data


def test_arcs_are_brought_nearer_and_nowhere_farther():
    quarter, between = circle(300 * np.pi / 2), circle(300 * np.pi / 4)[1::2]
    data = listing(quarter, ["CNT100"] * 3 + ["FINE"], via=between)
    result = corrected(data, cell())
    before, after = compared(data, result)
    assert result.command.runs
    assert after.max() < 0.9 * before.max()
    assert after.max() < 1.3 * result.command.left.largest / UM


def test_behind_a_corner_that_waits_a_stretch_stays_as_it_is():
    points = circle(2.0)
    words = to_the_end(points)
    words[len(words) // 2] = "CNT50"
    data = listing(points, words)
    before, after = compared(data, corrected(data, cell()))
    assert np.sqrt((after**2).mean()) < 0.6 * np.sqrt((before**2).mean())


def test_a_position_that_is_a_step_as_well_keeps_its_numbers_and_others_are_bent_around_it():
    """Commanded off its place it would be another step: it stays as a corner does, led off as before."""
    points = circle(1.0)
    run = listing(points, to_the_end(points), 100)
    data = run.replace(b"/POS", b"   0:L P[900] 100mm/sec FINE INC    ;\n/POS")
    result = corrected(data, cell())
    places, planned = (naive_ls.read(text)[0] for text in (result.text, data))
    assert places[900].groups[1].axes == planned[900].groups[1].axes
    assert places[300].groups[1].axes != planned[300].groups[1].axes
    without = b"".join(line for line in result.text.splitlines(keepends=True) if b" INC " not in line)
    before, after = off_path(run, run, MEANS), off_path(run, without, MEANS)
    assert (after - before).max() < WORSE
    assert np.median(after) < 4.0 < 20.0 < np.median(before)
    assert after.max() == pytest.approx(before.max(), rel=0.05)


def test_lines_before_and_behind_a_half_circle_keep_their_ends():
    half = circle(2.0, turn=np.pi)
    points = np.concatenate([[(1600.0, -300.0, 0.0)], half, [(1000.0, -300.0, 0.0)]])
    data = listing(points, to_the_end(points))
    result = corrected(data, cell())
    before, after = compared(data, result)
    assert np.sqrt((after**2).mean()) < 0.8 * np.sqrt((before**2).mean())
    kept = naive_ls.read(result.text)[0]
    for n in (1, 2, len(points) - 1, len(points)):
        assert [kept[n].groups[1].axes[k] for k in "XYZ"] == pytest.approx(points[n - 1], abs=6e-4)


# Any program -------------------------------------------------------------------------------------------------------


def drawn_program(rng):
    """Chains of chords of many sizes and radii, lines, joint motions, arcs, waits, CNT n, and a way back."""
    now, heading, speed = np.array([1250.0, -100.0, 0.0]), rng.uniform(0, 2 * np.pi), rng.choice([50, 150, 200, 300])
    words, points = [f"J P[1] 20% {rng.choice(['FINE', 'FINE', 'CNT100'])}"], [now]

    def line(place, word):
        points.append(place)
        words.append(f"L P[{len(points)}] {speed}mm/sec {word}")

    for _ in range(rng.integers(2, 6)):
        kind = rng.choice(["chords", "chords", "line", "joint", "arc", "wait", "back"])
        ahead = np.array([np.cos(heading), np.sin(heading), 0.0])
        left = np.array([-ahead[1], ahead[0], 0.0])
        if kind in ("chords", "arc"):
            radius, turn, side = rng.choice([8.0, 30.0, 100.0, 300.0]), rng.uniform(0.5, 3.0), rng.choice([-1, 1])
            count = max(int(turn * radius / rng.choice([0.7, 1.0, 2.0, 3.3, 7.0])), 3) if kind == "chords" else 2
            at = turn * np.arange(1, count + 1)[:, None] / count
            bent = now + radius * (np.sin(at) * ahead + side * (1 - np.cos(at)) * left)
            heading, now = heading + side * turn, bent[-1]
            odd = rng.integers(0, 3 * count)
            if kind == "arc":
                points += [*bent]
                words.append(f"C P[{len(points) - 1}]\n    :  P[{len(points)}] {speed}mm/sec CNT100")
            for k, place in enumerate(bent if kind == "chords" else []):
                line(place, rng.choice(["CNT50", "CNT75", "FINE", "CNT100 ACC80"]) if k == odd else "CNT100")
        elif kind == "line":
            now = now + rng.uniform(5, 200) * ahead
            line(now, rng.choice(["CNT100", "CNT50", "FINE"]))
        elif kind == "joint":
            now = now + rng.uniform(-60, 60, 3)
            points.append(now)
            words.append(f"J P[{len(points)}] 20% {rng.choice(['FINE', 'CNT50', 'CNT100'])}")
        elif kind == "wait":
            words.append("WAIT 0.50(sec)")
        elif len(points) > 9:
            back = range(len(points) - 1, len(points) - 9, -1)
            words += [f"L P[{n}] {speed}mm/sec CNT100" for n in back]
            now, heading = points[back[-1] - 1], heading + np.pi
    line(now + 5 * np.array([np.cos(heading), np.sin(heading), 0.0]), "FINE")
    places = [cartesian(n, (*np.round(p, 3), 180.0, 0.0, 0.0)) for n, p in enumerate(points, 1)]
    return program(["UFRAME_NUM=0", "UTOOL_NUM=0", *words], places, name="RUN")


@pytest.mark.parametrize("means", [(104, 104), (200, 104), (216, 208), (320, 320)])
def test_no_drawn_program_is_flown_farther_off_anywhere(means):
    rng, commanded = np.random.default_rng(means[0]), 0
    for _ in range(25):
        data = drawn_program(rng)
        result = corrected(data, cell(means=means))
        if result.command is None or not result.command.runs:
            assert result.text == data
            continue
        commanded += 1
        before, after = compared(data, result, means)
        assert (after**2).sum() < (before**2).sum()
    assert commanded >= 1


def arc_and_lines(letter, corner=0):
    """A half circle of 100 mm at 100 mm/s, of C or of a chain of A, and three lines along its tangent or off it."""
    turn = np.radians([-90, -45, 0, 45, 90])
    places = [*np.column_stack([1200 + 100 * np.cos(turn), 100 * np.sin(turn)]).tolist()]
    places += [[1200 - 30 * k, 100 + corner * (k == 2)] for k in (1, 2, 3)]
    points = [cartesian(n, (x, y, 300, 180, 0, 0)) for n, (x, y) in enumerate(places, 1)]
    chain = [f"A P[{n}] 100mm/sec {'FINE' if n == 5 else 'CNT100'}" for n in (2, 3, 4, 5)]
    arcs = ["C P[2] P[3] 100mm/sec CNT100", "C P[4] P[5] 100mm/sec CNT100"]
    lines = [f"L P[{n}] 100mm/sec {'FINE' if n == 8 else 'CNT100'}" for n in (6, 7, 8)]
    return program(["J P[1] 10% FINE", *(chain if letter == "A" else arcs), *lines], points)


@pytest.mark.parametrize(
    ("keys", "code"), [((), "motion.unknown"), (("motion.moving_average_ms=[200, 104]",), "motion.known")]
)
def test_ways_of_a_chain_are_said_not_to_be_looked_at_and_reassure_nobody(keys, code):
    arm = load_cell(str(ROOT / "robots" / "m710ic50.toml"), keys)
    result, others = (corrected(arc_and_lines(letter), arm, bound=100 * UM) for letter in "AC")
    (finding,), (other,) = ([f for f in r.findings if f.code == code] for r in (result, others))
    assert (finding.level, other.level) == (Level.WARNING, Level.WARNING)
    assert "not looked at along 4 lines with A or S (with C it is; the first: line 5)" in finding.message
    assert "looked at" not in other.message
    record = band_of_correction(result)
    assert record is not None
    (row,) = (u for u in record["unknown"] if u["what"] == WHAT)
    assert row["from"].endswith("; not looked at on lines with A or S (4)")


def test_a_corner_beside_a_chain_is_looked_at():
    """With no bound nothing is a warning; lines that turn are told of as well."""
    arm = load_cell(str(ROOT / "robots" / "m710ic50.toml"))
    found = [f for f in corrected(arc_and_lines("A", corner=10), arm).findings if f.code == "motion.unknown"]
    assert [f.level for f in found] == [Level.NOTE, Level.NOTE]
    assert "not looked at along 4 lines" in found[0].message
    assert "is expected to lead the tool off this path" in found[1].message
