"""Which page runs when: written down by the cell, or one after the other."""

import pytest

from compgen.core.exceptions import InputError
from compgen.pipelines.resume.page_times import PageMoment, PageTimes, planned_times, read_page_times

SPANS = (100.0, 50.0, 80.0)


def test_pages_run_one_after_the_other_from_the_start_on():
    times = planned_times(SPANS, 0.0, 40.0)
    assert [times.running(t)[0] for t in (0, 39, 40, 139, 141, 191, 269, 271)] == [0, 0, 1, 1, 2, 3, 3, 0]
    assert times.running(150)[1] == pytest.approx(10)
    assert times.stretches(300) == [
        (0, 40, 0, 0),
        (40, 140, 1, 0),
        (140, 190, 2, 0),
        (190, 270, 3, 0),
        (270, 300, 0, 0),
    ]
    assert times.stretches(100) == [(0, 40, 0, 0), (40, 100, 1, 0)]
    assert [times.last(t) for t in (0, 50, 145, 999)] == [0, 1, 2, 3]


def test_a_page_that_ends_before_the_next_leaves_the_robot_standing():
    times = PageTimes((PageMoment(10, 1), PageMoment(60, 0), PageMoment(200, 2, 3)), SPANS, 0.0)
    assert times.stretches(400) == [(0, 10, 0, 0), (10, 60, 1, 0), (60, 200, 0, 0), (200, 250, 2, 0), (250, 400, 0, 0)]
    assert times.running(100) == (0, 0.0)
    assert (times.loaded(100), times.loaded(220)) == (1, 3)


def test_a_page_that_began_before_the_planned_start_is_taken_from_there():
    assert planned_times(SPANS, 30.0, 0.0).stretches(120) == [(30, 100, 1, 30), (100, 120, 2, 0)]


def test_the_cells_file_is_read_row_by_row(tmp_path):
    file = tmp_path / "pages.csv"
    assert read_page_times(file, SPANS, 0.0).starts == ()
    file.write_text("time_s,page,loaded\n")
    assert read_page_times(file, SPANS, 0.0).starts == ()
    file.write_text("time_s,page,loaded\n5,1,\n120,0,2\n")
    assert read_page_times(file, SPANS, 0.0).starts == (PageMoment(5, 1), PageMoment(120, 0, 2))
    file.write_text('"time_s", "page","loaded"\n"5","1",""\n120,0,2\n')
    assert read_page_times(file, SPANS, 0.0).starts == (PageMoment(5, 1), PageMoment(120, 0, 2))


def test_rows_of_the_page_that_runs_do_not_begin_it_anew(tmp_path):
    file = tmp_path / "pages.csv"
    file.write_text("time_s,page,loaded\n5,1,\n30,1,\n65,1,2\n66,1,2\n120,0,2\n130,0,2\n140,1,2\n")
    times = read_page_times(file, SPANS, 0.0)
    assert times.running(29) == (1, 24)
    assert times.running(70) == (1, 65)
    assert times.running(150) == (1, 10)  # after a stand it begins anew
    assert times.stretches(140) == [(0, 5, 0, 0), (5, 65, 1, 0), (65, 105, 1, 60), (105, 120, 0, 0), (120, 140, 0, 0)]


def test_a_page_that_was_held_goes_on(tmp_path):
    """40 s and 20 s of its 100 had run before the stands; the last 40 s end at 170 s."""
    file = tmp_path / "pages.csv"
    file.write_text("time_s,page,loaded\n5,1,\n45,0,\n60,0,2\n100,1,\n120,0,\n130,1,\n300,2,\n320,0,\n330,3,\n")
    times = read_page_times(file, SPANS, 0.0)
    assert [times.running(t) for t in (110, 125, 150, 171)] == [(1, 50), (0, 0), (1, 80), (0, 0)]
    assert times.stretches(200)[-4:] == [(100, 120, 1, 40), (120, 130, 0, 0), (130, 170, 1, 60), (170, 200, 0, 0)]
    assert times.running(335) == (3, 5)  # another page begins at its beginning


def test_a_page_that_somebody_says_has_begun_is_loaded_wherever_the_log_ends(tmp_path):
    """A logger that stopped at 90 s: pages 1 and 2 run by its clock, and page 3 was written anew while it ran."""
    file = tmp_path / "pages.csv"
    file.write_text("time_s,page,loaded\n5,1,\n80,2,\n100,3,\n")
    times = read_page_times(file, SPANS, 0.0)
    assert (times.last(90), times.loaded(90)) == (2, 3)
    file.write_text("time_s,page,loaded\n5,1,\n80,2,\n100,2,3\n")
    assert read_page_times(file, SPANS, 0.0).loaded(90) == 3
    assert planned_times(SPANS, 0.0, 5.0).loaded(90) == 1  # where nobody says, by the clock


@pytest.mark.parametrize(
    ("rows", "word"),
    [
        ("0,4", "pages 1 to 3"),
        ("0,1.5", "pages 1 to 3"),
        ("9,1\n3,2", "must rise"),
        ("0,2\n9,1", "later page"),
        ("0,x", "number"),
    ],
)
def test_what_cannot_be_is_refused(tmp_path, rows, word):
    file = tmp_path / "pages.csv"
    file.write_text(f"time_s,page\n{rows}\n")
    with pytest.raises(InputError, match=word):
        read_page_times(file, SPANS, 0.0)
