"""The public face: what the command line gives, number for number, and what it refuses, in the same words."""

import ast
import csv
import dataclasses
import io
import logging
import pickle
import pydoc
import subprocess
import sys
import threading
from importlib import import_module
from operator import attrgetter

import naive_arm
import naive_ls
import numpy as np
import pytest
from changed import changed
from command_line import ENVIRONMENT, run
from numpy.testing import assert_allclose
from shipped import ROOT, path_file
from synthetic import made_up, measured, random_theta

import compgen
from compgen.core.evaluation import parallel_for, run_in_background
from compgen.core.evaluation.threads import MIN_BACKGROUND_ROWS, worker_count
from compgen.core.units import DEG, MM, UM
from compgen.report.notebook.arguments import first_difference, require_unchanged
from compgen.report.notebook.machine import machine

CSV_MM = 1e-4  # of six decimals of a degree, and of the constants of two arms
HALF_A_DIGIT = 0.00501  # of micrometres in a file, which have two decimals
LINE, CIRCLE = path_file("line_y"), path_file("circle_1300")
STRANGER = b"""/PROG  PART
/MN
   1:L P[1] 100mm/sec FINE    ;
   2:L P[2] 100mm/sec FINE    ;
/POS
P[1]{
   GP1:
\tUF : 0, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',
\tX =  1200.000  mm,\tY =   -50.000  mm,\tZ =  -300.000  mm,
\tW =   180.000 deg,\tP =     0.000 deg,\tR =     0.000 deg
};
P[2]{
   GP1:
\tUF : 0, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',
\tX =  1200.000  mm,\tY =    50.000  mm,\tZ =  -300.000  mm,
\tW =   180.000 deg,\tP =     0.000 deg,\tR =     0.000 deg
};
/END
"""
FRAMES = """[utool.1]
x_mm = 0.0
y_mm = 0.0
z_mm = 100.0
w_deg = 0.0
p_deg = 0.0
r_deg = 0.0
"""


def files_in(folder):
    """What a run wrote beside its journal and the folder's marker, which say what happened there."""
    return {p.name: p.read_bytes() for p in folder.iterdir() if p.name not in ("scenarios.jsonl", "compgen.json")}


@pytest.fixture(scope="module")
def prediction():
    return compgen.predict(compgen.load_job(LINE))


@pytest.fixture(scope="module")
def generated():
    return compgen.generate(compgen.load_job(LINE))


@pytest.fixture(scope="module")
def stranger(tmp_path_factory):
    """A program that exists, and its frames."""
    folder = tmp_path_factory.mktemp("stranger")
    (folder / "PART.LS").write_bytes(STRANGER)
    (folder / "frames.toml").write_text(FRAMES)
    return folder


@pytest.fixture(scope="module")
def corrected(stranger):
    return compgen.correct(
        stranger / "PART.LS", "m710ic50", frames=stranger / "frames.toml", before="moving 200mm/s 5h", max_um=50
    )


@pytest.fixture(scope="module")
def grid():
    return compgen.study(LINE, vary={"duty": np.array([0.2, 0.5]), "feed": [50, 100]}, ask="warmup")


@pytest.fixture(scope="module")
def poses(tmp_path_factory):
    folder = tmp_path_factory.mktemp("poses")
    truth, rng = made_up(str(ROOT / "robots" / "m710ic50.toml"), 7), np.random.default_rng(70)
    data = measured(truth, random_theta(truth.arm.robot, rng, 60), rng)
    pendant = truth.arm.robot.to_pendant(data.theta)[data.pose] / DEG
    rows = ["order,target,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm"]
    for n, (q, p) in enumerate(zip(pendant, data.position / MM, strict=True)):
        numbers = [*(f"{v:.6f}" for v in q), *(f"{v:.4f}" for v in p)]
        rows.append(",".join([str(data.pose[n]), data.reflectors[data.reflector[n]], *numbers]))
    file = folder / "poses.csv"
    file.write_text("\n".join(rows) + "\n")
    return file


@pytest.fixture(scope="module")
def identified(poses):
    return compgen.identify("m710ic50", poses=poses)


@pytest.fixture(params=["prediction", "generated", "corrected", "grid", "identified"])
def result(request):
    return request.getfixturevalue(request.param)


@pytest.mark.parametrize("path", [LINE, CIRCLE])
def test_the_files_of_generate_are_those_of_the_command_line(tmp_path, path):
    assert run("generate", path, "-o", tmp_path / "g", "-q", "--set", "process.feed_mm_s=80").returncode == 0
    job = compgen.load_job(path, overrides={"process.feed_mm_s": 80})
    assert compgen.generate(job).files() == files_in(tmp_path / "g")


@pytest.mark.parametrize("date", ["26-05-04", "26-01-01"])
def test_a_date_stands_on_the_page_as_the_command_line_has_it(tmp_path, date):
    assert run("generate", LINE, "-o", tmp_path / "g", "-q", "--date", date).returncode == 0
    files = compgen.generate(compgen.load_job(LINE), date=date).files()
    assert files == files_in(tmp_path / "g")
    assert f"20{date}".encode() in files["report.html"]


def test_the_files_of_predict_are_those_of_the_command_line(tmp_path, prediction):
    assert run("predict", LINE, "-o", tmp_path / "p", "-q").returncode == 0
    assert prediction.files() == files_in(tmp_path / "p")


def test_a_program_outside_its_bounds_is_given_where_the_command_line_writes_it(tmp_path):
    key, value = "bounds.max_um", 0.001
    assert run("generate", LINE, "-o", tmp_path / "g", "-q", "--set", f"{key}={value}").returncode == 1
    outside = compgen.generate(compgen.load_job(LINE, overrides=[f"{key}={value}"]))
    assert outside.verdict is compgen.Verdict.OUTSIDE
    assert not outside.inside
    assert outside.files() == files_in(tmp_path / "g")
    forced = run("generate", LINE, "-o", tmp_path / "f", "-q", "--set", f"{key}={value}", "--force")
    assert forced.returncode == 1
    assert outside.files(force=True) == files_in(tmp_path / "f")
    assert outside.files(force=True).keys() == outside.files().keys() | outside.programs.keys()
    assert outside.programs["LINE_Y.LS"] == outside.text


def test_the_files_of_correct_are_those_of_the_command_line(tmp_path, stranger, corrected):
    options = ("--robot", "m710ic50", "--frames", stranger / "frames.toml", "--before", "moving 200mm/s 5h")
    done = run("correct", stranger / "PART.LS", *options, "--max-um", "50", "-q", "-o", tmp_path / "c")
    assert done.returncode == 0
    assert corrected.inside
    assert corrected.files() == files_in(tmp_path / "c")


def test_the_files_of_a_study_are_those_of_the_command_line(tmp_path, grid):
    options = ("--vary", "duty=0.2,0.5", "--vary", "feed=50,100", "--ask", "warmup", "--workers", "1")
    assert run("whatif", LINE, *options, "--no-live", "-q", "-o", tmp_path / "w").returncode == 0
    assert grid.files() == files_in(tmp_path / "w")


def test_the_files_of_identify_are_those_of_the_command_line(tmp_path, poses, identified):
    done = run("identify", "m710ic50", "--poses", poses, "-q", "-o", tmp_path / "m710ic50.toml", "--force")
    files = files_in(tmp_path)
    assert (done.returncode == 0) == identified.accepted
    assert {name: files[name] for name in identified.files(force=True)} == identified.files(force=True)


def test_processes_give_the_rows_of_this_one(grid):
    again = compgen.study(LINE, vary={"duty": [0.2, 0.5], "feed": [50, 100]}, ask=["warmup"], workers=2)
    assert again.rows == grid.rows


def test_a_result_pickles(result):
    again = pickle.loads(pickle.dumps(result))
    assert type(again) is type(result)
    assert again.files() == result.files()
    assert repr(again) == repr(result)


def test_a_result_pickled_elsewhere_gives_the_same_files(tmp_path, generated):
    (tmp_path / "result.pickle").write_bytes(pickle.dumps(generated))
    script = (
        "import pickle, sys; result = pickle.load(open(sys.argv[1], 'rb')); "
        "sys.stdout.buffer.write(result.files()['report.json'])"
    )
    command = [sys.executable, "-c", script, str(tmp_path / "result.pickle")]
    done = subprocess.run(command, env=ENVIRONMENT, capture_output=True, check=True)
    assert done.stdout == generated.files()["report.json"]


def test_arrays_are_those_of_the_table_of_waypoints(generated):
    rows = list(csv.DictReader(io.StringIO(generated.files()["waypoints.csv"].decode())))
    N = len(rows)

    def column(*names):
        return np.array([[float(row[name]) for name in names] for row in rows])

    assert generated.error.shape == generated.correction.shape == generated.theta.shape == (N, 6)
    assert_allclose(generated.time[:, None], column("time_s"), atol=1e-6)
    assert_allclose(generated.position / MM, column("x_mm", "y_mm", "z_mm"), atol=1e-6)
    before, after = (column(*(f"{side}_d{a}_um" for a in "xyz")) for side in ("before", "after"))
    assert_allclose(generated.error[:, :3] / UM, before, atol=1e-4)
    assert_allclose(generated.error_after / UM, after, atol=1e-4)
    assert_allclose(generated.rise, column(*(f"rise_{node}_K" for node in generated.nodes)), atol=1e-5)
    assert np.array_equal(generated.contact[:, None], column("contact"))
    assert_allclose(generated.correction[:, :3], -generated.error[:, :3], atol=2 * UM)
    assert 0 < generated.start_window < 1e5


@pytest.mark.parametrize("moves", ["lines", "arcs"])
def test_joints_and_correction_are_those_of_the_text_where_lines_stand_off_a_curve(moves):
    """At a chord of 200 um they were those of the target: the arm at j1 to j6 stood 189 um from X, Y, Z of its P[n]."""
    wide = {"process.chord_um": 200, "path.diameter_mm": 60, "bounds.max_um": 300, "bounds.normal_um": 300}
    result = compgen.generate(compgen.load_job(CIRCLE, overrides={**wide, "process.moves": moves}))
    positions = naive_ls.read(result.text)[0]
    text = np.array([[positions[n].groups[1].axes[a] for a in "XYZ"] for n in sorted(positions)])
    rows = csv.DictReader(io.StringIO(result.files()["waypoints.csv"].decode()))
    joints = np.radians([[float(row[f"j{i}_deg"]) for i in range(1, 7)] for row in rows])
    assert_allclose(naive_arm.frames_at(joints)[-1][:, :3, 3], text, atol=CSV_MM)
    assert_allclose(result.job.robot.to_pendant(result.theta), joints, atol=1e-6 * DEG)
    commanded = result.position + result.correction[:, :3]
    assert_allclose(commanded / MM, text, atol=0.000501)
    stands_off = np.linalg.norm(text - result.position / MM, axis=1).max()
    assert stands_off > 0.25 or moves == "arcs"  # 200 um of half a sag beside the error of the warm arm


def test_joints_of_a_prediction_are_those_of_its_text():
    job = compgen.load_job(CIRCLE, overrides={"process.chord_um": 200, "path.diameter_mm": 60})
    prediction = compgen.predict(job)
    places = naive_arm.frames_at(job.robot.to_pendant(prediction.theta))[-1][:, :3, 3]
    off = np.linalg.norm(places - prediction.position / MM, axis=1)
    assert 0.18 < off.max() < 0.21  # mm: half a sag


def test_the_columns_of_a_prediction_are_its_table(prediction):
    rows = list(csv.DictReader(io.StringIO(prediction.files()["waypoints.csv"].decode())))
    assert prediction.error.shape == (len(rows), 6)
    assert_allclose(prediction.error[:, 0] / UM, [float(row["before_dx_um"]) for row in rows], atol=1e-4)
    assert prediction.verdict is compgen.Verdict.PREDICTED
    assert prediction.rise.shape == (len(rows), len(prediction.nodes))
    assert prediction.rotation.shape == (len(rows), 3, 3)


def test_a_column_of_a_study_is_an_array(grid):
    assert np.array_equal(grid.array("before.0.duty"), [0.2, 0.2, 0.5, 0.5])
    assert np.array_equal(grid.array("before_max_um"), [row["before_max_um"] for row in grid.rows])
    with pytest.raises(compgen.InputError, match="'nothing': unknown; known: index"):
        grid.array("nothing")


def test_tables_are_data_frames(result):
    pandas = pytest.importorskip("pandas")
    table = result.to_dataframe()
    assert isinstance(table, pandas.DataFrame)
    assert len(table)


def test_a_data_frame_has_the_columns_of_the_file(generated, corrected, grid):
    pandas = pytest.importorskip("pandas")
    for result, name in ((generated, "waypoints.csv"), (corrected, "positions.csv"), (grid, "whatif.csv")):
        file = pandas.read_csv(io.BytesIO(result.files()[name]))
        table = result.to_dataframe()
        assert list(table.columns) == list(file.columns)
        numbers = [c for c in table.columns if table[c].dtype.kind in "if"]
        assert len(numbers) > 6
        assert_allclose(table[numbers].astype(float), file[numbers].astype(float), atol=HALF_A_DIGIT)


def test_without_pandas_a_message_says_what_to_install(result, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(compgen.InputError, match=r"pip install 'compgen\[pandas\]'"):
        result.to_dataframe()


FIGURES = {
    "prediction": ["time", "space", "heat", "joints"],
    "generated": ["time", "space", "heat", "joints"],
    "corrected": ["time", "space", "heat"],
    "grid": ["before.0.duty", "process.feed_mm_s", "warmup"],
    "identified": ["time", "space", "joints", "correlation"],
}


@pytest.mark.parametrize("name", FIGURES)
def test_figures_are_plotlys(name, request):
    result = request.getfixturevalue(name)
    for figure in [result.plot(), *map(result.plot, FIGURES[name])]:
        assert type(figure).__module__.startswith("plotly.")
        assert len(figure.data)
        assert figure.layout.title.text
        assert figure.to_json()
    with pytest.raises(compgen.InputError, match=f"'nothing': unknown; known: .*{FIGURES[name][0]}"):
        result.plot("nothing")


def test_a_program_is_written_as_it_was_read(stranger, tmp_path, generated, corrected):
    program = compgen.read_program(stranger / "PART.LS")
    assert program.name == "PART"
    assert np.array_equal(program.positions.number, [1, 2])
    assert program.positions.value[:, 0].tolist() == [1200.0, 1200.0]
    written = tmp_path / "OUT.LS"
    for thing, content in ((program, STRANGER), (generated, generated.text), (corrected, corrected.text), (b"x", b"x")):
        compgen.write_program(thing, written)
        assert written.read_bytes() == content
    assert [p.name for p in tmp_path.iterdir()] == ["OUT.LS"]


def test_a_program_is_corrected_from_its_bytes_or_its_listing(stranger, corrected):
    options = {"robot": "m710ic50", "frames": stranger / "frames.toml", "before": ["moving 200mm/s 5h"], "max_um": 50}
    for program in (STRANGER, compgen.read_program(str(stranger / "PART.LS"))):
        assert compgen.correct(program, **options).files() == corrected.files()


JOB = compgen.load_job(LINE)
BAD = [
    (compgen.load_job, (None,), {}, "path: None is no file's name"),
    (compgen.load_job, (np.zeros(3),), {}, "path: array"),
    (compgen.load_job, ("nowhere.toml",), {}, "nowhere.toml: no such file"),
    (compgen.load_job, (LINE, 3), {}, "robot: 3 is no file's name"),
    (compgen.load_job, (LINE, "nobody"), {}, "robot 'nobody' is unknown"),
    (compgen.load_job, (LINE,), {"overrides": 3}, "overrides: 3: give a dict"),
    (compgen.load_job, (LINE,), {"overrides": "a=1"}, "overrides: 'a=1': give a dict"),
    (compgen.load_job, (LINE,), {"overrides": {"title": None}}, "title: None cannot stand in a file"),
    (compgen.load_job, (LINE,), {"overrides": {"title": object()}}, "cannot stand in a file"),
    (compgen.load_job, (LINE,), {"overrides": {3: 1}}, "overrides: 3 is no key"),
    (compgen.load_job, (LINE,), {"overrides": {"a=b": 1}}, "'a=b' is no key"),
    (compgen.load_job, (LINE,), {"overrides": {"proces.feed": 1}}, "unknown key; did you mean 'process'"),
    (compgen.load_job, (LINE,), {"overrides": {"process.feed_mm_s": np.nan}}, "nan is not a number"),
    (compgen.load_robot, (None,), {}, "robot: None is no file's name"),
    (compgen.load_robot, (JOB.robot,), {}, "is no file's name"),
    (compgen.predict, (None,), {}, "predict: None is no Job; give what compgen.load_job returns"),
    (compgen.predict, (LINE,), {}, "is no Job; give what"),
    (compgen.predict, (JOB,), {"progress": 3}, "progress: 3 cannot be called"),
    (compgen.predict, (JOB,), {"workers": 0}, "workers: 0: must be a whole number from 1 to 64"),
    (compgen.predict, (JOB,), {"workers": True}, "workers: True"),
    (compgen.predict, (JOB,), {"workers": 1.5}, "workers: 1.5"),
    (compgen.generate, (JOB.robot,), {}, "is no Job"),
    (compgen.generate, (JOB,), {"date": "2026-13-01"}, "--date 2026-13-01: not a date YY-MM-DD"),
    (compgen.generate, (JOB,), {"date": 260131}, "date: 260131 is no text"),
    (compgen.generate, (JOB,), {"pages": "no"}, "pages: 'no' is no bool"),
    (compgen.read_program, (None,), {}, "file: None is no file's name"),
    (compgen.read_program, ("nowhere.LS",), {}, "nowhere.LS: cannot be read"),
    (compgen.read_program, (LINE,), {}, "line_y.toml: not a program listing (.LS)"),
    (compgen.correct, (None,), {}, "program: None is no file's name"),
    (compgen.correct, ("/PROG X\n",), {}, "a listing as text; give its bytes"),
    (compgen.correct, (b"",), {}, "program: line 1: it does not begin with /PROG"),
    (compgen.correct, (STRANGER,), {}, "which robot is it for"),
    (compgen.correct, (STRANGER, "m710ic50"), {"max_um": "3"}, "max_um: '3' is not a number"),
    (compgen.correct, (STRANGER, "m710ic50"), {"max_um": -1}, "--max-um -1: must be 0.001 to 1000000 um"),
    (compgen.correct, (STRANGER, "m710ic50"), {"insert_um": np.nan}, "--insert nan: must be"),
    (compgen.correct, (STRANGER, "m710ic50"), {"mark": "ink"}, "--mark 'ink': must be digits or remark"),
    (compgen.correct, (STRANGER, "m710ic50"), {"split": 1}, "split: 1 is no bool"),
    (compgen.correct, (STRANGER, "m710ic50"), {"before": 3}, "before: 3"),
    (compgen.correct, (STRANGER, "m710ic50"), {"before": "dancing 3h"}, "'dancing' is not understood"),
    (compgen.correct, (STRANGER, "m710ic50"), {"frames": "nowhere.toml"}, "nowhere.toml: cannot be read"),
    (compgen.identify, ("m710ic50",), {}, "--poses: missing"),
    (compgen.identify, ("m710ic50", np.zeros((3, 6))), {}, "poses: array"),
    (compgen.identify, ("m710ic50", "nowhere.csv"), {}, "nowhere.csv: cannot be read"),
    (compgen.identify, ("m710ic50", "nowhere.csv"), {"force": 1}, "force: 1 is no bool"),
    (compgen.study, (LINE,), {}, "nothing to study"),
    (compgen.study, (JOB,), {"vary": {"duty": [1]}}, "is no file's name; give a path file"),
    (compgen.study, (LINE,), {"vary": {"duty": 0.5}}, "vary: duty: 0.5: give a list of values"),
    (compgen.study, (LINE,), {"vary": {"duty": []}}, "no values: the grid is empty"),
    (compgen.study, (LINE,), {"vary": {"dutty": [1]}}, "unknown key; did you mean 'duty'"),
    (compgen.study, (LINE,), {"vary": "duty=1"}, "vary: 'duty=1': give a dict"),
    (compgen.study, (LINE,), {"ask": "why"}, "--ask why: unknown; known: warmup"),
    (compgen.study, (LINE,), {"ask": "warmup", "within_um": 0}, "--within-um 0: must be above 0"),
    (compgen.study, (LINE,), {"ask": "passes", "feeds_mm_s": 3}, "feeds_mm_s: 3: give a list of numbers"),
    (compgen.study, (LINE,), {"ask": "passes", "feeds_mm_s": [[1], [1, 2]]}, "feeds_mm_s: [1] is not a number"),
    (compgen.study, (LINE,), {"vary": {"duty": [1]}, "workers": -1}, "workers: -1"),
    (compgen.write_program, (3, "x.LS"), {}, "program: 3 is no program"),
    (compgen.write_program, (b"x", None), {}, "file: None"),
    (compgen.write_program, (b"x", "/nowhere/x.LS"), {}, "cannot be written"),
    (dataclasses.replace, (JOB.robot,), {"a": np.zeros(4)}, "Robot.a: shape (4,), expected (6,)"),
    (dataclasses.replace, (JOB.robot,), {"a": "here"}, "Robot.a: no array of numbers"),
]


@pytest.mark.parametrize(("function", "args", "keywords", "words"), BAD)
def test_bad_input_is_refused_in_one_line(function, args, keywords, words):
    with pytest.raises(compgen.InputError) as refusal:
        function(*args, **keywords)
    text = str(refusal.value)
    assert words in text
    assert "\n" not in text
    assert len(text) <= 300


@pytest.mark.parametrize("override", ["process.feed_mm_s=0", "proces.feed=3", "path.radius_mm=1e6", "tool.number=0"])
def test_a_refusal_says_what_the_command_line_says(override):
    done = run("generate", CIRCLE, "--set", override, "--set", "tool.z_mm=10", "-q")
    with pytest.raises(compgen.CompgenError) as refusal:
        compgen.generate(compgen.load_job(CIRCLE, overrides=[override, "tool.z_mm=10"]))
    assert done.stderr == f"cgen: {refusal.value}\n"
    assert done.returncode == refusal.value.exit_code


def test_a_result_does_not_change(result):
    for name in ("report", "anything"):
        with pytest.raises(compgen.FrozenError, match=f"{name}: a result does not change"):
            setattr(result, name, None)
        with pytest.raises(compgen.FrozenError):
            delattr(result, name)


@pytest.mark.parametrize(
    ("part", "key"),
    [
        ("", "bounds"), ("plan", "process"), ("plan.path", "pattern"), ("plan.process", "feed"), ("plan.tool", "pose"),
        ("cell", "sources"), ("history", "before"), ("settings", "rate"), ("bounds", "max"),
    ],
)  # fmt: skip
def test_a_job_does_not_change_nor_does_a_part_of_it(part, key):
    owner = attrgetter(part)(JOB) if part else JOB
    what = "a part of a job" if part else "a job"
    refusal = rf"^{type(owner).__name__}.{key}: {what} does not change; give overrides"
    with pytest.raises(compgen.FrozenError, match=refusal):
        setattr(owner, key, None)
    with pytest.raises(compgen.FrozenError, match=refusal):
        delattr(owner, key)


@pytest.mark.parametrize("path", sorted(p.stem for p in (ROOT / "paths").glob("*.toml") if p.stem != "path.schema"))
def test_a_job_read_twice_is_the_same_and_its_pickle_is_taken(path):
    job, again = compgen.load_job(path_file(path)), compgen.load_job(path_file(path))
    assert first_difference(job, again) is None
    require_unchanged(pickle.loads(pickle.dumps(job)))


@pytest.mark.parametrize(
    ("key", "value"),
    [("plan.process.feed", 0.123), ("plan.tool.number", 9), ("cell.sources", ()), ("start_drift", 1.0)],
)
def test_a_job_that_was_changed_since_it_was_read_is_refused(key, value):
    """Its program would name inputs that it is not made from."""
    other = changed(JOB, key, value)
    for verb in (compgen.predict, compgen.generate):
        with pytest.raises(compgen.InputError, match=rf"job line_y: {key} was changed .*compgen.load_job as overrides"):
            verb(other)


def test_a_job_whose_file_has_changed_meanwhile_is_taken_as_it_is(tmp_path):
    file = tmp_path / "mine.toml"
    content = (ROOT / "paths" / "line_y.toml").read_text()
    file.write_text(content)
    job = pickle.loads(pickle.dumps(compgen.load_job(file, robot="m710ic50")))
    file.write_text(f"{content}\n")
    file.write_text(content.replace("title = ", "title = 'other'  # "))
    require_unchanged(job)
    file.unlink()
    require_unchanged(pickle.loads(pickle.dumps(job)))


@pytest.mark.parametrize(
    ("result", "names"),
    [
        ("prediction", "band contact error position rise rotation theta time"),
        ("generated", "band contact correction error error_after position rise rotation theta time"),
        ("corrected", "error error_after judged time"),
        ("identified", "position residual"),
    ],
)
def test_arrays_of_a_result_cannot_be_written(request, result, names):
    """What is written into one would stand in its files."""
    owner = request.getfixturevalue(result)
    for name in names.split():
        array = owner.band() if name == "band" else getattr(owner, name)
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    public = [getattr(owner, name) for name in dir(owner) if not name.startswith("_")]
    assert sum(isinstance(value, np.ndarray) for value in public) == len(names.replace("band ", "").split())


class Stop(BaseException):
    """What a callback may raise."""


@pytest.mark.parametrize("exception", [Stop, KeyboardInterrupt, ValueError])
@pytest.mark.parametrize("stage", ["path", "twin before", "correction", "twin after", "scenarios"])
def test_what_a_callback_raises_ends_the_run_and_leaves_nothing_behind(exception, stage):
    def progress(name, share):
        if name == stage:
            raise exception

    before, machine_before = threading.enumerate(), worker_count()

    def run_to_the_stage():
        if stage == "scenarios":
            compgen.study(LINE, vary={"duty": [0.1, 0.2], "feed": [50, 60]}, progress=progress, workers=2)
        else:
            compgen.generate(JOB, progress=progress, workers=2)

    with pytest.raises(exception):
        run_to_the_stage()
    assert threading.enumerate() == before
    assert worker_count() == machine_before


def test_an_interrupt_ends_what_runs_in_the_background():
    started, before = threading.Event(), threading.enumerate()

    def endless():
        while True:
            started.set()
            parallel_for(10, lambda start, stop: None)

    def interrupted():
        with machine(2):
            run_in_background(endless, MIN_BACKGROUND_ROWS)
            started.wait()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert threading.enumerate() == before


def test_stages_are_told_as_shares():
    calls = []
    compgen.generate(JOB, progress=lambda stage, share: calls.append((stage, share)))
    assert {"correction", "twin after"} <= {stage for stage, _ in calls}
    assert all(0 <= share <= 1 for _, share in calls)


def test_findings_are_logged_and_nothing_is_printed(caplog, capfd):
    with caplog.at_level(logging.INFO, logger="compgen"):
        outside = compgen.generate(compgen.load_job(LINE, overrides={"bounds.max_um": 0.001}))
    records = [(r.levelno, r.getMessage()) for r in caplog.records if r.name == "compgen"]
    broken = next(f for f in outside.findings if f.code == "bounds.max_um")
    assert (logging.WARNING, f"line_y: bounds.max_um: {broken.message}") in records
    assert any(level == logging.INFO and "LINE_Y" in text for level, text in records)
    assert capfd.readouterr() == ("", "")
    assert any(isinstance(h, logging.NullHandler) for h in logging.getLogger("compgen").handlers)


def test_the_package_loads_nothing_until_it_is_used():
    names = ("numpy", "casadi", "logging", "typing")
    script = f"import sys, compgen; print(compgen.__version__, *(m for m in {names} if m in sys.modules))"
    done = subprocess.run(
        [sys.executable, "-S", "-c", script], env=ENVIRONMENT, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == [compgen.__version__]


def test_type_checkers_see_every_public_name_where_it_lives():
    tree = ast.parse((ROOT / "compgen" / "__init__.py").read_text())
    block = next(node for node in tree.body if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test))
    imports = [node for node in block.body if isinstance(node, ast.ImportFrom)]
    assert len(imports) == len(block.body)
    seen = {alias.asname: node.module or "" for node in imports for alias in node.names if alias.asname == alias.name}
    assert set(seen) == set(dir(compgen)) - {"__all__", "__doc__", "__version__"}
    assert all(getattr(compgen, name) is getattr(import_module(module), name) for name, module in seen.items())
    assert (ROOT / "compgen" / "py.typed").is_file()


def test_every_public_name_is_listed_and_documented():
    assert set(compgen.__all__) < set(dir(compgen))
    for name in compgen.__all__:
        assert getattr(compgen, name).__doc__, name
    text = pydoc.plain(pydoc.render_doc(compgen))
    for name in ("generate", "study", "write_program"):
        assert f"\n    {name}(" in text
    with pytest.raises(AttributeError, match="no attribute 'predikt'"):
        _ = compgen.predikt  # type: ignore[attr-defined]  # which is the fact


def test_a_job_prints_as_one_line():
    job = compgen.load_job(str(ROOT / "paths" / "line_y.toml"))
    assert repr(job) == f"<Job line_y: {job.title}, on m710ic50>"
