"""``cgen correct`` in a frame that the robot taught: the band against numpy's least squares on the second arm."""

import csv
import json
import re
from hashlib import sha256

import numpy as np
import pytest
from command_line import refused, run
from corrected import HOME
from ls_text import at, joint_form, program
from naive_arm import flange, frame
from numpy.testing import assert_allclose
from shipped import ROOT

PLACE = (1200.0, -30.0, 40.0, 0.5, -0.3, 20.0)
PROBE = np.array([3.0, -2.0, 50.0])  # mm, in the flange
NOISE = 9.0  # um, of one coordinate of a touch
HELD = 500.0  # um, standard deviation with which teaching begins to fit the probe
ZEROS = {0: 5.0, 2: 3.0}  # mdeg, standard deviations of J1 and J3
KEYS = ("x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg")


def joints_of(seed, count):
    return np.array(HOME) + np.random.default_rng(seed).uniform(-20, 20, (count, 6))


TOUCHED, STATIONS = joints_of(4, 18), joints_of(5, 6)


def tool_of(z):
    tool = np.eye(4)
    tool[:3, 3] = [*PROBE[:2], z]
    return tool


def write(path, text):
    path.write_text(text)
    return path


@pytest.fixture
def cell(tmp_path):
    """A robot of which two zeros are open, the frame that it taught cold, the frames table, and a program in it."""
    text = (ROOT / "robots" / "m710ic50.toml").read_text()
    known = "[thermal.uncertainty]\nlaw_K = 0\nsensors_K = 0\nair_K = 0\nfeed_percent = 0\nmissing_percent = 0\n"
    text = re.sub(r"\[thermal\.uncertainty\].*?\n\n", f"{known}cte_um_m_K = [11.25, 11.25]\n\n", text, flags=re.DOTALL)
    sigma = [ZEROS.get(i, 0) for i in range(6)]
    text += "\n[sources.joint_zeros]\noffset_mdeg = [1, 0, 1, 0, 0, 0]\n"
    text += f"[sources.joint_zeros.sigma]\noffset_mdeg = {sigma}\n"
    robot = write(tmp_path / "mine.toml", text)
    teach(tmp_path, f"mine {sha256(robot.read_bytes()).hexdigest()[:16]}")
    write_tables(tmp_path)
    write_program(tmp_path)
    return tmp_path


def teach(folder, robot_file):
    touches = "\n".join(
        f"[[frame.taught.touches]]\njoints_deg = {[round(v, 6) for v in q.tolist()]}\nnoise_um = {NOISE}"
        for q in TOUCHED
    )
    place = "\n".join(f"{k} = {v}" for k, v in zip(KEYS, PLACE, strict=True))
    write(
        folder / "frame.toml",
        f'[frame]\nnumber = 1\n{place}\n[frame.taught]\nthrough = "model"\nrobot_file = "{robot_file}"\n'
        f"sigma_um = [3, 3, 3]\nprobe_mm = {PROBE.tolist()}\n{touches}\n",
    )


def write_program(folder, z=50.0):
    """Straight lines to where a tool of that length is at the stations' joints."""
    lines = [f"L P[{n}] 200mm/sec FINE" for n in range(1, 7)]
    uf, ut = frame(*PLACE), tool_of(z)
    places = [at(n, q, uf=uf, ut=ut, numbered=(1, 1)) for n, q in enumerate(STATIONS, 1)]
    (folder / "PART.LS").write_bytes(program(lines, places, name="PART"))


def write_tables(folder, z=50.0, uframe='[uframe.1]\nfile = "frame.toml"\n'):
    numbers = "\n".join(f"{k} = {v}" for k, v in zip(KEYS, (*PROBE[:2], z, 0, 0, 0), strict=True))
    return write(folder / "frames.toml", f"{uframe}[utool.1]\n{numbers}\n")


def by_numbers(number=1):
    return f"[uframe.{number}]\n" + "".join(f"{k} = {v}\n" for k, v in zip(KEYS, PLACE, strict=True))


def correct(folder, *more):
    words = ("--robot", folder / "mine.toml", "--frames", folder / "frames.toml", "--max-um", 500, *more)
    return run("correct", folder / "PART.LS", "-o", folder / "out", *words, "-q")


def corrected(folder):
    result = correct(folder)
    assert result.returncode == 0, result.stderr
    report = json.loads((folder / "out" / "report.json").read_text())
    rows = csv.DictReader((folder / "out" / "positions.csv").read_text().splitlines())
    band = np.array([[float(row[f"band_{axis}_um"]) for axis in "xyz"] for row in rows])
    return band, report, {f["code"] for f in report["findings"]}


def design(tcp, middle):
    """What a shift, a turn and a longer probe do to places, (3 N, 9) in um: shift [um], turn [rad], probe [um]."""
    rows = []
    for T in tcp:
        turned = np.array([np.cross(e, T[:3, 3] - middle) for e in np.eye(3)]).T * 1e3
        rows.append(np.hstack([np.eye(3), turned, -T[:3, :3]]))
    return np.array(rows)


def half_widths(z, *, taught=True):
    """2 sigma along World x, y, z at the stations, (M, 3) [um]: the zeros and the touches' noise, by numpy."""
    touched = np.array([flange(q) @ tool_of(PROBE[2]) for q in TOUCHED]).reshape(-1, 4, 4)
    driven = np.array([flange(q) @ tool_of(z) for q in STATIONS]).reshape(-1, 4, 4)
    middle = touched[:, :3, 3].mean(axis=0)
    D, on_path = design(touched, middle), design(driven, middle)
    if z != PROBE[2]:
        on_path[:, :, 6:] = 0  # the probe stays in the drawer
    held = np.hstack([np.zeros((3, 6)), np.eye(3) * NOISE / HELD])
    gain = np.linalg.pinv(np.vstack([D.reshape(-1, 9), held]))[:, :-3]
    effects = []
    for k, mdeg in ZEROS.items():
        step = 1e-3 * np.eye(6)[k]

        def moved(joints, tool, step=step):
            a, b = ((flange(q) @ tool).reshape(4, 4)[:3, 3] for q in (joints + step, joints - step))
            return (a - b) * 1e3 / 2  # um per mdeg

        away = mdeg * np.array([moved(q, tool_of(z)) for q in STATIONS])
        if taught:
            away = away - on_path @ (gain @ (mdeg * np.array([moved(q, tool_of(PROBE[2])) for q in TOUCHED]).ravel()))
        effects.append(away[:, :, None])
    noise = on_path @ gain * NOISE if taught else np.zeros((len(driven), 3, 1))
    return 2 * np.sqrt((np.concatenate([*effects, noise], axis=2) ** 2).sum(axis=2))


def test_pages_written_anew_keep_what_the_frame_was_taught_with(cell):
    _, report, _ = corrected(cell)
    lines = ("--robot", cell / "mine.toml", "--set", "controller.max_lines=4", "-q")
    assert run("pages", cell / "out" / "PART.LS", *lines, "-o", cell / "parted").returncode == 0
    result = run("resume", cell / "parted", "--from-page", 1, "--late", "0s", "--max-um", 500, "--json")
    assert result.returncode == 0, result.stderr
    resumed = json.loads(result.stdout)
    assert resumed["band"] == report["band"]


@pytest.mark.parametrize("z", [50.0, 120.0])
def test_the_band_is_what_the_taught_frame_leaves(cell, z):
    """With the probe for a tool, and with a tool of its own: then the probe's place is no part of it."""
    write_tables(cell, z)
    write_program(cell, z)
    band, report, codes = corrected(cell)
    assert_allclose(band, half_widths(z), rtol=2e-3, atol=0.06)  # um
    assert "part's frame" in report["band"]["budget_um"]
    assert "part_stands_um" not in report["band"]
    unknown = {row["what"] for row in report["band"]["unknown"]}
    assert "part's frame" not in unknown
    assert ("tool length" in unknown) == (z != PROBE[2])  # the band holds the probe's, as the touches know it
    assert "frame.uncertainty" in codes


def test_the_same_numbers_without_their_teaching_are_open_in_full(cell):
    write_tables(cell, uframe=by_numbers())
    band, report, codes = corrected(cell)
    assert_allclose(band, half_widths(50.0, taught=False), rtol=2e-3, atol=0.06)  # um
    assert {"part's frame", "tool length"} <= {row["what"] for row in report["band"]["unknown"]}
    assert band.max() > 1.5 * half_widths(50.0).max()
    assert report["band"]["part_stands_um"] > report["band"]["when_taught_um"]
    assert not {c for c in codes if c.startswith("frame.")}


def test_a_guaranteed_bound_is_flown_in_the_taught_frame(cell):
    """The draws fly what the band's columns say: the frame's part of it too."""
    largest = []
    for uframe in ('[uframe.1]\nfile = "frame.toml"\n', by_numbers()):
        write_tables(cell, uframe=uframe)
        assert correct(cell, "--guaranteed", "max_um=500").returncode == 0
        drawn = json.loads((cell / "out" / "report.json").read_text())["guaranteed"]
        assert drawn["linearity"] < 0.05
        largest.append(drawn["bounds"]["max_um"]["value"])
    assert 1.5 * largest[0] < largest[1]


@pytest.mark.parametrize("change", ["joint form", "another frame", "another robot file"])
def test_where_the_teaching_does_not_hold_it_is_left_out_and_said(cell, change):
    lines, code = [f"L P[{n}] 200mm/sec FINE" for n in range(1, 8)], "frame.taught"
    uf, ut = frame(*PLACE), tool_of(50.0)
    places = [at(n, q, uf=uf, ut=ut, numbered=(1, 1)) for n, q in enumerate(STATIONS, 1)]
    if change == "joint form":
        places.append(joint_form(7, HOME, uf=1, ut=1))
    elif change == "another frame":
        write_tables(cell, uframe=by_numbers(2) + '[uframe.1]\nfile = "frame.toml"\n')
        places.append(at(7, HOME, uf=uf, ut=ut, numbered=(2, 1)))
    else:
        teach(cell, "mine 0123456789abcdef")
        places.append(at(7, HOME, uf=uf, ut=ut, numbered=(1, 1)))
        code = "frame.model"
    (cell / "PART.LS").write_bytes(program(lines, places, name="PART"))
    _, report, codes = corrected(cell)
    assert code in codes
    assert "part_stands_um" in report["band"]


@pytest.mark.parametrize(
    ("uframe", "words"),
    [
        ('[uframe.2]\nfile = "frame.toml"\n', ("uframe.2.file", "frame 1")),
        ('[uframe.1]\nfile = "none.toml"\n', ("none.toml", "no such file")),
        ('[uframe.1]\nfile = "frames.toml"\n', ("frames.toml", "frame")),
        ('[uframe.1]\nfile = "frame.toml"\nx_mm = 3\n', ("uframe.1.x_mm", "remove")),
        ("[uframe.1]\nfile = 3\n", ("/3", "no such file")),
        (by_numbers(2), ("uframe 1", "--frames")),
    ],
)
def test_wrong_frames_are_refused_in_one_line(cell, uframe, words):
    write_tables(cell, uframe=uframe)
    refused(correct(cell), 2, *words)
    assert not (cell / "out").exists()
