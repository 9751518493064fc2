"""A short run of the campaign of CAM files; tests/campaigns/cam_files.py has the long one."""

import cam_draws
import cam_files
import cam_judge
import cam_ways
import pytest

SEEDS = range(2000, 2012)
PLACE = {"frame": {"x_mm": 1000.0, "z_mm": 200.0}, "process": {"feed_mm_s": 100.0, "lift_mm": 20}}
HEAD = "G21 G90 G17\nG0 X0 Y0 Z10\nG1 Z0 F3000\nG1 X100\n"
APT = "UNITS/MM\nFEDRAT/3000\nGOTO/0,0,0\nGOTO/100,0,0\n"


def judged(pattern, text, **path):
    keys = {"path": {"pattern": pattern, "file": "part.nc", **path}} | PLACE | {"bounds": {"max_um": 50}}
    return cam_files.judged(cam_draws.Case(0, pattern, "by hand", "part.nc", text, cam_draws.path_text(keys), "", keys))


@pytest.mark.parametrize("seed", SEEDS)
def test_no_program_leaves_the_users_lines(seed):
    result, reason = cam_files.judged(cam_draws.drawn(seed))
    assert result != "wrong", reason


@pytest.mark.parametrize(
    ("pattern", "text"),
    [
        ("gcode", HEAD + "G1 X0 Y60\nG1 X0 Y0\nG0 Z10\nM30\n"),  # three long straight lines
        ("gcode", HEAD + "G0 Z10\nM30\nG1 X400 Y300 Z-40\n"),  # words behind the end
        ("gcode", "%\n" + HEAD + "G0 Z10\n%\nG1 X400 Y300 Z-40\n"),
        ("gcode", HEAD + "G0 Z10\nG1 X90 M30\nX400\n"),
        ("apt", APT + "FINI\nGOTO/400,300,0\n"),
        ("gcode", "G1 X0 Y0 Z0 F3\nG1 X50\nG2 X80 Y30 I0 J30\nG1 Y80\nM30\n"),  # the slowest feed there is
        ("points", "x_mm,y_mm,z_mm\n0,0,0\n100,0,0\n0,60,0\n0,0,0\n"),
    ],
)
def test_a_plain_file_is_driven_as_it_says_or_refused_in_a_line(pattern, text):
    result, reason = judged(pattern, text)
    assert result in ("inside", "refused"), reason


@pytest.mark.parametrize(
    ("pattern", "text"),
    [
        ("gcode", HEAD.replace("G17", "G17 G54") + "G55\nG1 X50\nM30\n"),
        ("gcode", HEAD + "G2 X100 Y0 I10 J0 P3\nM30\n"),
        ("apt", APT + "REFSYS/1,0,0,10,0,1,0,20,0,0,1,5\nGOTO/50,50,0\nFINI\n"),
        ("apt", APT + "TLAXIS/0.1,0,0.995\nGOTO/50,50,0\nFINI\n"),
        ("apt", APT + "MODE/INCR\nGOTO/50,50,0\nFINI\n"),
        ("apt", APT + "CALL/SUB\nGOTO/50,50,0\nFINI\n"),
        ("apt", APT + "LOOPST\nGOTO/50,50,0\nFINI\n"),
        ("apt", APT + "INSERT/G92X0\nGOTO/50,50,0\nFINI\n"),
        ("apt", APT + "OFSTNO/2\nGOTO/50,50,0\nFINI\n"),
    ],
)
def test_a_word_that_may_change_where_the_tool_goes_is_refused(pattern, text):
    result, reason = judged(pattern, text)
    assert result == "refused, may be", reason


def test_everything_is_drawn():
    """Each pattern, way and kind of word, plain files for the greater part, and short blocks by the thousand."""
    cases = [cam_draws.drawn(seed) for seed in range(400)]
    assert {c.pattern for c in cases} == set(cam_judge.TABLES)
    assert {c.shape for c in cases} == {*cam_ways.WAYS, "smooth"}
    assert 0.5 < sum(not c.trap for c in cases) / len(cases) < 0.85
    assert max(c.text.count("\n") for c in cases) > 9000
    assert any(c.keys["process"].get("moves") == "arcs" for c in cases)
