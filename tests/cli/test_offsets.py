"""``cgen offsets`` as a user meets it."""

import json

import pytest
from command_line import refused, run
from ls_text import cartesian, program

PLACES = [(1200, 0, 200), (1400, 30, 210), (1350, 250, 190), (1150, 180, 230)]


@pytest.fixture
def planned(tmp_path):
    file = tmp_path / "PART.LS"
    moves = ["UFRAME_NUM=0", "UTOOL_NUM=0", "J P[1] 10% FINE", *(f"L P[{n}] 50mm/sec FINE" for n in range(2, 5))]
    file.write_bytes(program(moves, [cartesian(n, (*p, 180, 0, 15)) for n, p in enumerate(PLACES, 1)], "PART"))
    return file


WARM = ("--robot", "m710ic50", "--before", "moving 200mm/s 5h")


def test_the_table_says_what_the_record_says(planned):
    shown, printed = run("offsets", planned, *WARM), run("offsets", planned, *WARM, "--json")
    assert shown.returncode == printed.returncode == 0, shown.stderr + printed.stderr
    record = json.loads(printed.stdout)
    kinds = [way["kind"] for way in record["ways"]]
    assert kinds == ["nothing", "PR offset X Y Z", "PR offset X Y Z W P R", "user frame", "full correction"]
    leaves = [way["leaves"]["rms_um"] for way in record["ways"]]
    assert leaves[0] > 2 * leaves[1]
    assert leaves[1] > leaves[3] * (1 - 1e-9)  # typed digits may make both the same
    assert leaves[3] > 10 * leaves[4]
    for way in record["ways"]:
        rows = [line.split("│") for line in shown.stdout.splitlines() if line.startswith("│")]
        row = next(row for row in rows if row[1].strip() == way["kind"])
        numbers = [*(way["type_in"] or {}).values()]
        assert [f"{v:.3f}" for v in numbers] + [f"{way['leaves']['rms_um']:.1f}"] == [
            cell.strip() for cell in row[2:-3] if cell.strip()
        ]
    assert "takes no numbers" in " ".join(shown.stdout.split())


def test_a_planned_path_s_offsets_come_with_its_history(tmp_path):
    printed = run("offsets", "paths/circle_1300.toml", "--json")
    record = json.loads(printed.stdout)
    assert record["ways"][0]["leaves"]["max_um"] == pytest.approx(123.4, abs=0.2)
    assert record["ways"][1]["type_in"]["x_mm"] < -0.05  # the warm arm reaches too far


def test_a_corrected_program_is_refused(planned, tmp_path):
    options = ("--max-um", "5", "--mark", "remark", "-q")
    assert run("correct", planned, *WARM, *options, "-o", tmp_path / "o").returncode == 0
    corrected = tmp_path / "o" / "PART.LS"
    refused(run("offsets", corrected, *WARM), 2, "corrected already", "--restore")
    alone = tmp_path / "ALONE.LS"
    alone.write_bytes(corrected.read_bytes())
    refused(run("offsets", alone, *WARM), 2, "corrected already", "its remark or its digits")
    assert run("generate", "paths/line_x.toml", "-o", tmp_path / "g", "-q").returncode == 0
    written = tmp_path / "g" / "LINE_X.LS"
    refused(run("offsets", written, "--robot", "m710ic50"), 2, "corrected already", "predict PATH --program")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("paths/circle_1300.toml", "--before", "moving 200mm/s 5h"), ("--before", "leave it out")),
        (("paths/circle_1300.toml", "--frames", "f.toml"), ("--frames", "leave it out")),
        (("nowhere.LS", *WARM), ("nowhere.LS", "cannot be read")),
        (("paths/circle_1300.toml", "--state", "nowhere.toml"), ("nowhere.toml",)),
        (("paths/circle_1300.toml", "--state-age", "20min"), ("--state-age", "--state")),
    ],
)
def test_what_does_not_go_together_is_refused_in_a_line(arguments, words):
    refused(run("offsets", *arguments), 2, *words)
