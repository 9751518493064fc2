"""What is said of a controller's motion: each number with its unit, and names that a phone has room for."""

import re

from compgen.report.motion_report import kinds_figure, motion_sentences

SPREAD = "two moving means in Cartesian, where the arm is spread widest; shorter elsewhere"
SUMMARY = {
    "verdict": "foretells",
    "motion": {
        "kind": SPREAD,
        "moving_average_ms": [324.0, 324.0],
        "first_order_ms": [],
        "after_long_ms": [],
        "interval_ms": [(323.8, 334.5), (313.4, 324.1)],
        "sigma_ms": [132.2, 132.37],
        "runs_began": [],
    },
    "held_out": {"rms_um": 1.05, "p99_um": 3.1, "max_um": 3.2, "plain_um": 1.05, "limit_um": 1.89},
    "tried": [
        {"kind": SPREAD, "held_out_um": 1.08, "as_well": True},
        {"kind": "no smoothing", "held_out_um": 147.5, "as_well": False},
    ],
}


def test_what_is_left_is_said_of_the_path_with_a_unit_at_each_number():
    _, left, *_ = motion_sentences(SUMMARY)
    assert left.startswith("off the path, ")  # the table beside it counts what is along it at stops as well
    assert not re.search(r"\d", re.sub(r"[\d.]+ um|99 %", "", left))


def test_names_of_kinds_have_room_on_a_phone():
    narrow = kinds_figure(SUMMARY)["layout"]["meta"]["narrow"]
    names = narrow["yaxis"]["ticktext"]
    assert [name.replace("<br>", " ") for name in names] == ["no smoothing", SPREAD]
    assert max(len(line) for name in names for line in name.split("<br>")) <= 34
    assert all(value in (0.01, 0.1, 1, 10, 100, 1000, 10000) for value in narrow["xaxis"]["tickvals"])
