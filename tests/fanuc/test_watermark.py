"""Never correct twice: the mark in the numbers, the provenance beside the program, and the way back."""

import base64
import json
import re
import zlib

import numpy as np
import pytest
from corrected import HOME, MANY, REAL, corrected
from ls_text import at, joint_form, program
from shipped import ROOT, quiet

from compgen.core.exceptions import CompgenError, InputError
from compgen.core.pose import IDENTITY, Pose
from compgen.core.rotations import from_wpr
from compgen.fanuc import compose, loads
from compgen.fanuc.analysis import watermark
from compgen.fanuc.analysis.inspection import inspect
from compgen.fanuc.analysis.watermark import Mark
from compgen.pipelines.correct import Options, correct
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.robot_file import load_cell
from compgen.pipelines.planned import generate
from compgen.pipelines.planned.program_text import planned_program
from compgen.program.frames import Frames, default_frames
from compgen.report.provenance import provenance_json, restore_planned


@pytest.fixture(scope="module")
def hot():
    return load_cell(str(ROOT / "robots" / "m710ic50.toml"))


def many(count=12, form="{:.3f}", joint=False):
    rng = np.random.default_rng(3)
    q = np.array(HOME) + rng.uniform(-15, 15, (count, 6))
    points = [joint_form(n, row) if joint else at(n, row, form=form) for n, row in enumerate(q, 1)]
    return program([f"J P[{n}] 10% FINE" for n in range(1, count + 1)], points)


REFUSED = "carries compgen's mark.*--restore.*--again"


@pytest.mark.parametrize("how", [{}, {"form": "{:.6f}"}, {"form": "{:.2f}"}, {"joint": True, "count": 24}])
def test_a_corrected_program_is_refused_and_again_takes_it(how, hot):
    once = corrected(many(**how), hot)
    assert once.mark is Mark.DIGITS
    assert not any(f.code == "correction.mark" for f in once.findings)
    with pytest.raises(InputError, match=REFUSED):
        corrected(once.text, hot)
    assert corrected(once.text, hot, again=True).text != once.text


def renumbered(text):
    """Every P[n] is another: 10 n + 5, in statements and positions."""
    return re.sub(rb"P\[(\d+)", lambda m: b"P[%d5" % int(m[1]), text)


EDITS = {
    "renamed": lambda t: t.replace(b"/PROG  T", b"/PROG  OTHER"),
    "header": lambda t: t.replace(b"/ATTR\n", b'/ATTR\nOWNER = MNEDITOR;\nCOMMENT = "new";\n'),
    "line ends": lambda t: t.replace(b"\n", b"\r\n"),
    "renumbered": renumbered,
    "remarks": lambda t: t.replace(b"   1:J", b"   1:  !a remark ;\n   2:J"),
    "speeds": lambda t: t.replace(b"10%", b"35%"),
    "leading zeros": lambda t: re.sub(rb" (-?)0\.", rb" \1.", t),
    "blanks": lambda t: t.replace(b"= ", b"=     "),
    "one touched up": lambda t: re.sub(rb"(P\[4\]\{(?:\n.*){2}\n\tX = )[-\d.]+", rb"\g<1>1400.123", t),
    "one less": lambda t: re.sub(rb"P\[4\]\{\n(?:.*\n)*?\};\n", b"", t).replace(b"J P[4]", b"!J P[4]"),
    "one disabled": lambda t: t.replace(b":J P[3]", b":  //J P[3]"),
    "other order": lambda t: (
        t.replace(b"P[1] 10%", b"P[99] 10%").replace(b"P[9] 10%", b"P[1] 10%").replace(b"P[99]", b"P[9]")
    ),
}


@pytest.mark.parametrize("edit", EDITS)
def test_the_mark_survives_what_people_do_to_programs(edit, hot):
    text = EDITS[edit](corrected(many(), hot).text)
    assert text != corrected(many(), hot).text
    with pytest.raises(InputError, match=REFUSED):
        corrected(text, hot)


def test_the_mark_costs_one_unit_of_tilt_and_no_place(hot, monkeypatch):
    """With the mark and without it: X, Y and Z are the same, W P R differ by one in the last place at most."""
    marked = corrected(many(), hot).text
    monkeypatch.setattr(watermark, "nudges", lambda units: np.zeros((len(units), 3), dtype=np.int64))
    bare = corrected(many(), hot).text
    assert marked != bare
    numbers = re.compile(rb"([XYZWPR]) = ([-\d.]+)")
    for a, b in zip(numbers.findall(marked), numbers.findall(bare), strict=True):
        assert abs(float(a[1]) - float(b[1])) <= (0.0010001 if a[0] in b"WPR" else 0)


def test_few_joint_positions_are_not_led_from_their_nearest_digits_by_a_mark_that_they_cannot_carry(hot):
    """Some of six have other digits than the mark would take: they are the nearest."""
    few = corrected(many(6, joint=True), hot)
    assert few.mark is Mark.NONE
    digits = re.findall(rb"J[1-6]= *([-\d.]+)", few.text)
    units = np.rint(1000 * np.array(digits, dtype=float)).astype(np.int64).reshape(6, 6)
    assert watermark.joint_remainder(units).any()


def test_few_positions_cannot_carry_it_and_say_so(hot):
    few = corrected(many(3), hot)
    assert few.mark is Mark.NONE
    assert any(f.code == "correction.mark" and "--mark remark" in f.message for f in few.findings)
    assert corrected(few.text, hot).changed


def twins(places=3, joint=False):
    """Each place is two positions, there and back."""
    q = np.array(HOME) + np.random.default_rng(8).uniform(-15, 15, (places, 6))
    points = [joint_form(n, row) if joint else at(n, row) for n, row in enumerate([*q, *q[::-1]], 1)]
    return program([f"J P[{n}] 10% FINE" for n in range(1, 2 * places + 1)], points)


def test_places_that_repeat_carry_the_mark_once_and_the_writer_knows(hot):
    """Six positions at three places: they counted six times when written, and three times when read."""
    once = corrected(twins(), hot)
    assert once.mark is Mark.NONE
    assert any(f.code == "correction.mark" for f in once.findings)


@pytest.mark.parametrize("joint", [False, True])
def test_repeated_places_do_not_hide_the_mark(joint, hot):
    """Thirty places, each driven to twice: those that are read are those that were written."""
    once = corrected(twins(30, joint), hot)
    assert once.mark is Mark.DIGITS
    with pytest.raises(InputError, match=REFUSED):
        corrected(once.text, hot)


def test_joint_positions_that_differ_in_the_wrist_alone_are_places_of_their_own(hot):
    q = np.array(HOME) + np.random.default_rng(8).uniform(-15, 15, (16, 6)) * [0, 0, 0, 1, 1, 1]
    data = program([f"J P[{n}] 10% FINE" for n in range(1, 17)], [joint_form(n, row) for n, row in enumerate(q, 1)])
    once = corrected(data, hot)
    assert once.mark is Mark.DIGITS
    with pytest.raises(InputError, match=REFUSED):
        corrected(once.text, hot)


def test_positions_that_must_stay_do_not_hide_the_mark(hot):
    """Ten of the first places are also used where nothing may change: they stay as they are, without the mark."""
    q = np.array(HOME) + np.random.default_rng(8).uniform(-15, 15, (30, 6))
    moves = [f"J P[{n}] 10% FINE" for n in range(1, 31)] + [f"J P[{n}] 10% FINE Offset,PR[1]" for n in range(1, 11)]
    once = corrected(program(moves, [at(n, row) for n, row in enumerate(q, 1)]), hot)
    assert once.changed == 20
    assert once.mark is Mark.DIGITS
    with pytest.raises(InputError, match=REFUSED):
        corrected(once.text, hot)


@pytest.mark.parametrize("data", [many(2), many(2).replace(b"\n", b"\r\n"), many(2, joint=True)])
def test_a_remark_carries_the_mark_where_the_digits_cannot(data, hot):
    once = corrected(data, hot, remark=True)
    assert once.mark is Mark.REMARK
    assert not any(f.code == "correction.mark" for f in once.findings)
    bare = corrected(data, hot).text
    line = next(line for line in once.text.splitlines(keepends=True) if b"!compgen" in line)
    assert once.text.replace(line, b"") == bare  # one line more, and nothing else
    assert once.text.index(line) == bare.index(b"   1:")
    assert loads(once.text).motions.target == loads(bare).motions.target
    with pytest.raises(InputError, match=r"its remark says 'compgen .* corrected'.*--again"):
        corrected(once.text, hot)
    assert restore_planned(provenance_json(once), once.text, "p") == data


def test_a_remark_is_not_written_where_the_digits_carry_the_mark(hot):
    assert corrected(many(), hot, remark=True).text == corrected(many(), hot).text
    rigid = load_cell(str(ROOT / "robots" / "m710ic50.toml"), ["thermal.cte_um_m_K=0"])
    assert corrected(many(2), rigid, remark=True).text == many(2)


@pytest.mark.parametrize("data", [twins(), many(), many(3), many(16, joint=True)])
def test_what_is_written_and_what_is_read_agree(data, hot):
    """The report of a correction, the next correction and ``inspect`` say the same of a program."""
    arm = hot.robot
    assert inspect(loads(data), arm, default_frames())["mark"] == "none"
    for remark in (False, True):
        once = corrected(data, hot, remark=remark)
        assert inspect(loads(once.text), arm, default_frames())["mark"] == once.mark
        if once.mark is Mark.NONE:
            assert corrected(once.text, hot).changed
        else:
            with pytest.raises(InputError, match=REFUSED):
                corrected(once.text, hot)


MARKED = sorted((ROOT / "tests" / "fanuc" / "marked").glob("*.LS"))


@pytest.mark.parametrize("path", MARKED, ids=lambda p: p.stem)
def test_programs_that_version_0_1_0_has_marked_stay_refused(path, hot):
    """As written by the first version that marks programs: few places, many, joint form, both forms, repeated ones."""
    assert len(MARKED) == 5
    assert not loads(path.read_bytes()).remarks
    with pytest.raises(InputError, match=REFUSED):
        corrected(path.read_bytes(), hot)
    assert inspect(loads(path.read_bytes()), hot.robot, default_frames())["mark"] == "digits"


def test_the_mark_of_the_first_version_is_read_whatever_else_the_program_holds():
    """Marked as version 0.1.0 did, the first 24 positions: all that its reader took for marked is taken for marked."""

    def first_reader(units, joint_form):
        _, first = np.unique(units[:, :3], axis=0, return_index=True)
        rows = np.sort(first)[:24]
        fits = np.where(
            joint_form[rows], watermark.joint_remainder(units[rows]), watermark.remainder(units[rows])
        ) == 0  # fmt: skip
        odds = np.asarray(np.where(joint_form[rows][fits], np.log(3), np.log(27))).sum()
        return odds >= np.log(1e6) and fits.mean() >= 0.75

    rng = np.random.default_rng(4)
    seen = 0
    for _ in range(3000):
        n = int(rng.integers(4, 50))
        units = rng.integers(-180_000, 180_000, (n, 6))
        joint_form = rng.random(n) < rng.choice([0.0, 0.5, 1.0])
        copies = rng.integers(0, n, int(rng.integers(0, n)))
        units[copies], joint_form[copies] = units[rng.integers(0, n)], joint_form[rng.integers(0, n)]
        for row in range(min(24, n)):
            if joint_form[row]:
                while watermark.joint_remainder(units[row : row + 1]):
                    units[row, 5] += 1
        wpr = watermark.nudges(units) * ~joint_form[:, None]
        marked = np.arange(n) < 24
        marked &= rng.random(n) > rng.choice([0.0, 0.1, 0.3])  # some touched up since
        units[:, 3:] += wpr * marked[:, None]
        if first_reader(units, joint_form):
            seen += 1
            assert watermark.is_marked(units, joint_form)
    assert seen > 1000


def test_random_programs_are_not_taken_for_marked():
    """20,000 programs of 5 to 40 positions nobody has corrected: none carries the mark by chance."""
    rng = np.random.default_rng(11)
    taken = 0
    for _ in range(20_000):
        n = int(rng.integers(5, 40))
        units = rng.integers(-180_000, 180_000, (n, 6))
        taken += watermark.is_marked(units, rng.random(n) < rng.choice([0.0, 0.5, 1.0]))
    assert taken == 0


def test_programs_on_a_grid_are_not_taken_for_marked():
    """Round numbers, as people type them: lattices and rows with one posture, in thousandths."""
    for pitch in (1000, 5000, 10_000, 50_000, 100_000):
        for tilt in ((0, 0, 0), (180_000, 0, 0), (-180_000, 0, 90_000), (0, 90_000, 0)):
            grid = np.array([(x * pitch, y * pitch, 500_000, *tilt) for x in range(8) for y in range(8)])
            assert not watermark.is_marked(grid, np.zeros(len(grid), dtype=bool)), (pitch, tilt)
        rng = np.random.default_rng(pitch)
        for _ in range(200):
            rows = np.hstack([rng.integers(-20, 20, (30, 3)) * pitch, rng.integers(-2, 3, (30, 3)) * 90_000])
            assert not watermark.is_marked(rows, np.zeros(30, dtype=bool))
    still = np.tile([1_000_000, 0, 500_000, 180_000, 0, 0], (50, 1))
    assert not watermark.is_marked(still, np.zeros(50, dtype=bool))


@pytest.mark.skipif(not REAL, reason="no programs of other people here")
def test_no_real_program_is_taken_for_marked(hot):
    refused = []
    for path in REAL:
        try:
            corrected(path.read_bytes(), hot, MANY)
        except CompgenError as failure:
            refused.append((path.name, str(failure)))
    assert refused == []


def test_what_generate_writes_is_refused_and_its_planned_program_is_not():
    job = load_job(str(ROOT / "paths" / "line_y.toml"))
    planned, done = generate.generate(job, quiet)
    frames = Frames({0: IDENTITY}, {0: IDENTITY, 1: job.tool.pose})
    cell = load_cell(str(ROOT / "robots" / "m710ic50.toml"))
    with pytest.raises(InputError, match=r"its remark says 'compgen .*predict PATH --program writes it.*--again"):
        correct(done.text, cell, frames, job.history.before, Options(), quiet)
    assert correct(done.text, cell, frames, job.history.before, Options(again=True), quiet).changed
    text = compose(planned_program(job, planned.path, planned.theta, planned.trajectory))
    assert correct(text, cell, frames, job.history.before, Options(), quiet).changed


# The way back ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("options", [{}, {"split": True, "insert": 1e-6}])
def test_the_planned_program_comes_back_to_the_byte(options, hot):
    for data in (
        many(),
        many(2),
        many().replace(b"\n", b"\r"),
        many().replace(b"/ATTR\n", b"/ATTR\nnotes \xff\x00 here\n"),
    ):
        result = corrected(data, hot, **options)
        assert result.text != data
        assert restore_planned(provenance_json(result), result.text, "p") == data


def test_damaged_missing_or_foreign_provenance_is_refused(hot):
    result, other = corrected(many(), hot), corrected(many(5), hot)
    good = provenance_json(result)
    packed = json.loads(good)["planned_zlib_b85"]
    wrong = base64.b85encode(zlib.compress(b"/PROG  OTHER")).decode()
    bad = {
        b"": "not what compgen wrote",
        b"{}": "not what compgen wrote",
        b"[1]": "not what compgen wrote",
        b"[" * 100_000: "not what compgen wrote",
        b"\xff\xfe": "not what compgen wrote",
        good[: len(good) // 2]: "not what compgen wrote",
        good.replace(b"compgen correction", b"another tool"): "not what compgen wrote",
        good.replace(packed.encode(), packed[:50].encode()): "damaged",
        good.replace(packed.encode(), b"\xc3\xa9"): "damaged",
        good.replace(b'"' + packed.encode() + b'"', b"17"): "damaged|not what",
        good.replace(packed.encode(), wrong.encode()): "damaged",
        provenance_json(other): "another program",
    }
    for provenance, message in bad.items():
        with pytest.raises(InputError, match=message):
            restore_planned(provenance, result.text, "beside")
    with pytest.raises(InputError, match="edited since"):
        restore_planned(good, result.text + b" ", "beside")


def test_the_provenance_says_what_is_needed_to_do_it_again(hot, monkeypatch):
    made = json.loads(provenance_json(corrected(many(), hot, split=True, insert=5e-6)))
    assert made["robot_sha256"] == hot.inputs_hash
    assert made["options"] == {"split": True, "insert_um": 5.0, "mark": "digits"}
    assert made["before"] == [{"state": "moving", "feed_mm_s": 200.0, "duration_h": 6.0}]
    assert made["frames"] == {"uframe": {}, "utool": {}, "extended": {}}
    assert made["registers"] == {}
    monkeypatch.chdir(ROOT)
    here = json.loads(provenance_json(corrected(many(), load_cell("m710ic50"))))
    assert here["robot_file"]["path"] == "robots/m710ic50.toml", "from the project's own folder, not the machine's root"


def test_the_provenance_has_the_frames_that_positions_were_read_in(hot):
    tool = Pose(np.array([0.0, 0.01, 0.1]), from_wpr(*(np.array([a]) for a in (0.1, -0.2, 0.3)))[0])
    frames = Frames({0: IDENTITY}, {0: IDENTITY, 2: tool})
    made = json.loads(provenance_json(corrected(many(), hot, frames)))
    assert made["frames"]["utool"]["2"] == pytest.approx([0, 10, 100, *np.degrees([0.1, -0.2, 0.3])], abs=1e-9)


def test_joint_and_cartesian_positions_together_carry_one_mark(hot):
    rng = np.random.default_rng(5)
    q = np.array(HOME) + rng.uniform(-10, 10, (10, 6))
    points = [at(n, row) if n % 2 else joint_form(n, row) for n, row in enumerate(q, 1)]
    data = program([f"J P[{n}] 10% FINE" for n in range(1, 11)], points)
    once = corrected(data, hot)
    assert once.mark is Mark.DIGITS
    with pytest.raises(InputError, match=REFUSED):
        corrected(once.text, hot)


def test_a_corrected_program_in_other_frames_is_still_refused(hot):
    """Copied with its positions, but told of another tool: the numbers carry the mark, not their meaning."""
    once = corrected(many(), hot).text.replace(b"UT : 0", b"UT : 2")
    with pytest.raises(InputError, match=REFUSED):
        corrected(once, hot, Frames({0: IDENTITY}, {0: IDENTITY, 2: Pose(np.array([0, 0, 0.1]), np.eye(3))}))
