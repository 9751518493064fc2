"""Circular motions of programs that exist: both positions corrected, and the proof flies the arc."""

import naive_arm as arm
import naive_heat
import naive_ls
import numpy as np
import pytest
from corrected import corrected, pose
from ls_text import cartesian, program
from numpy.testing import assert_allclose
from shipped import ROOT

from compgen.pipelines.files.robot_file import load_cell
from compgen.program.driven import NONE

PLACE = np.array([1300.0, 60.0, 210.0])
GUESS = (0.0, 20.0, -30.0, 0.0, -60.0, 0.0)


@pytest.fixture(scope="module")
def hot():
    return load_cell(str(ROOT / "robots" / "m710ic50.toml"))


def of_arcs(radius=200.0, angles=(0, 50, 110, 150, 200), normal=(0.2, -0.1, 1.0), aside=(0.0, 1.0, 0.3)):
    """A start, and arcs through places on a tilted circle, the tool down."""
    z = np.array(normal) / np.linalg.norm(normal)
    x = np.cross(z, aside)
    x /= np.linalg.norm(x)
    at = np.radians(angles)[:, None]
    places = PLACE + radius * (np.sin(at) * x + (1 - np.cos(at)) * np.cross(z, x))
    points = [cartesian(n, (*p, 180.0, 0.0, 5.0 * n)) for n, p in enumerate(places, 1)]
    pairs = [f"C P[{n}]    \n    :  P[{n + 1}] 100mm/sec CNT100" for n in range(2, len(places), 2)]
    pairs[-1] = pairs[-1].replace("CNT100", "FINE")
    return program(["UFRAME_NUM=0", "UTOOL_NUM=0", "L P[1] 100mm/sec FINE", *pairs], points)


def on_circle(a, b, c, share, second):
    """The place at a share of one half of the arc: its centre by linear equations."""
    normal = np.cross(b - a, c - a)
    centre = np.linalg.solve([b - a, c - a, normal], [(b - a) @ (b + a) / 2, (c - a) @ (c + a) / 2, normal @ a])
    start, end = (b, c) if second else (a, b)
    r, s = start - centre, end - centre
    y = np.cross(normal, r) / np.linalg.norm(normal)
    angle = share * (np.arctan2(s @ y, s @ r) % (2 * np.pi))
    return centre + np.cos(angle) * r + np.sin(angle) * y


def test_both_positions_of_an_arc_are_corrected_and_the_proof_flies_between_them(hot):
    """Every sample on an arc against a reader, a circle and a warm arm of our own."""
    data = of_arcs()
    result = corrected(data, hot)
    assert result.changed == 5
    meant, written = (naive_ls.read(text)[0] for text in (data, result.text))
    inner = np.flatnonzero(result.execution.fraction < 1)
    assert len(inner) == 4 * 3  # three on each half of two arcs
    for m in inner:
        station, share = int(result.execution.station[m]), float(result.execution.fraction[m])
        end = station + 1  # number of the position it leads to
        second = end % 2 == 1
        first = end - 2 if second else end - 1
        places = []
        for text in (meant, written):
            ends = [pose(text[first + k]) for k in range(3)]
            a, b, c = (e[:3, 3] for e in ends)
            p = on_circle(a, b, c, share, second)
            turned = pose(text[end - 1])[:3, :3]
            whole = np.radians(5.0) if share else 0.0
            frame = np.eye(4)
            c, s = np.cos(share * whole), np.sin(share * whole)
            frame[:3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ turned
            frame[:3, 3] = p
            places.append(frame)
        q = arm.joints_at(places[1], GUESS)
        off = arm.flange(q, naive_heat.warm_lengths())[:3, 3] - places[0][:3, 3]
        assert 1e3 * np.linalg.norm(off) == pytest.approx(1e6 * result.residual.distance[m], abs=0.4)
    assert result.error.distance.max() > 50e-6
    assert result.residual.distance.max() < 5e-6


def test_what_a_wide_arc_leaves_between_its_positions_is_told(hot):
    """Over half a turn of 450 mm the correction is no circle: the proof says by how much."""
    result = corrected(of_arcs(450.0, (0, 89, 178), (0, 0, 1)), hot)
    inner = result.execution.fraction < 1
    at_places = result.residual.distance[~inner].max()
    assert at_places < 1e-6
    assert 1.1 * at_places < result.residual.distance[inner].max() < 2e-6


def test_lengths_on_an_arc_are_those_of_its_parts(hot):
    result = corrected(of_arcs(), hot)
    assert_allclose(result.plan.drive.length[1:], 0.2 * np.radians([50, 60, 40, 50]), rtol=1e-5)
    assert result.length.sum() == pytest.approx(0.2 * np.radians(200), rel=1e-3)


def test_an_arc_of_three_places_in_line_is_judged_at_its_positions_only(hot):
    text = of_arcs(1e9, (0, 5e-6, 1e-5), (0, 0, 1))
    result = corrected(text, hot)
    assert result.changed == 3
    assert result.plan.drive.origin[1] != NONE


def in_line(aside_um):
    """An arc whose via lies on the line of its ends, or beside it."""
    moves = ["L P[1] 100mm/sec FINE", "C P[2]    \n    :  P[3] 100mm/sec FINE"]
    places = ((1360.0, 100.0, 420.0), (1400.0, 200.0, 425.0 + 1e-3 * aside_um), (1440.0, 300.0, 430.0))
    return program(moves, [cartesian(n, (*p, 180.0, 0.0, 0.0)) for n, p in enumerate(places, 1)])


@pytest.mark.parametrize(("aside_um", "flat"), [(0, True), (1, True), (20, False)])
def test_a_circle_motion_through_three_places_in_line_is_told_and_its_places_are_right(aside_um, flat, hot):
    """Rounding alone told the plane of such a circle: 13,637 um of it were taken for an error."""
    result = corrected(in_line(aside_um), hot)
    assert result.changed == 3
    assert result.residual.distance.max() < 2e-6
    assert [f.code for f in result.findings if f.code == "correction.flat_arc"] == ["correction.flat_arc"] * flat
    assert bool((result.execution.fraction < 1).any()) is not flat
    assert result.plan.drive.length[1:].sum() == pytest.approx(np.hypot(np.hypot(0.08, 0.2), 0.01), abs=1e-6)


def test_half_a_circle_that_a_correction_widens_is_told():
    """Where it moves the via farther out than the ends: along x or along y, as the arm errs."""
    longer = load_cell(str(ROOT / "robots" / "m710ic50.toml"), ["sources.link_offsets.a_um=[0, 1500, 0, 0, 0, 0]"])

    def warnings_of(angles):
        texts = (of_arcs(300.0, angles, (0, 0, 1), aside) for aside in ((0.0, 1.0, 0.0), (1.0, 0.0, 0.0)))
        findings = (corrected(text, longer, before=()).findings for text in texts)
        return [f.message for some in findings for f in some if f.code == "correction.arc"]

    (message,) = warnings_of((0, 90, 180))
    assert "by P[2] 180." in message
    assert warnings_of((0, 90, 179)) == []


@pytest.mark.parametrize("letter", ["A", "S", "L"])
def test_a_chain_of_arcs_is_named_for_its_ends_alone_are_judged(letter, hot):
    points = [cartesian(n, (1200 + 10 * n, 40.0 * n, 300, 180.0, 0.0, 0.0)) for n in range(1, 5)]
    moves = ["L P[1] 100mm/sec FINE", *(f"{letter} P[{n}] 100mm/sec CNT100" for n in (2, 3, 4))]
    unsure = [f.message for f in corrected(program(moves, points), hot).findings if f.code == "correction.order"]
    named = "lines 5, 6, 7: a chain of A or S: its ends are judged, not the curve between them"
    assert unsure == ([] if letter == "L" else [named])
