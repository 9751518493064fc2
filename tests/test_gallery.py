"""The gallery is what its commands give: captions, words of pictures. To renew it: python docs/gallery.py."""

import re
import shlex
import sys

import pytest
from command_line import run
from shipped import ROOT

sys.path.insert(0, str(ROOT / "docs"))
import gallery
import gallery_touches
import rooms
import tutorial_pictures


def run_here(command, folder, output=""):
    """What ``gallery.run`` does, without starting Python."""
    done = run(*shlex.split(command)[1:], cwd=folder)
    assert done.returncode == 0, done.stderr
    if output:
        (folder / output).write_text(done.stdout)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("gallery")
    gallery.prepare(place)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gallery, "run", run_here)
        yield place, set()


def words_of(svg):
    return re.findall(r">([^<>\n]+)</text>", svg)


@pytest.mark.parametrize("picture", gallery.PICTURES, ids=lambda picture: picture.name)
def test_a_picture_is_what_its_commands_give(picture, folder):
    svg, numbers = gallery.make(picture, *folder)
    assert gallery.section(picture, numbers) in (ROOT / "docs" / "gallery.md").read_text()
    shown = (ROOT / "docs" / "gallery" / f"{picture.name}.svg").read_text()
    assert words_of(svg) == words_of(shown)
    assert words_of(svg)
    assert abs(len(svg) - len(shown)) < 0.05 * len(shown)


def test_the_pictures_are_small_and_each_is_on_the_page():
    files = sorted((ROOT / "docs" / "gallery").glob("*.svg"))
    assert sorted(picture.name for picture in gallery.PICTURES) == [file.stem for file in files]
    assert sum(file.stat().st_size for file in files) < 500_000


def test_the_touches_are_those_of_their_script():
    written = (ROOT / "docs" / "gallery" / "touches.csv").read_text()
    cells = [[line.split(",") for line in text.splitlines()[2:]] for text in (written, gallery_touches.touches())]
    for row, anew in zip(*cells, strict=True):
        assert row[0] == anew[0]
        assert [float(x) for x in row[1:4]] == pytest.approx([float(x) for x in anew[1:4]], abs=0.0011)


def test_names_beside_a_chart_stand_in_the_order_of_their_curves():
    """Of link 1 and the wrist, 0.2 K apart, the cooler stood above the warmer."""
    ends = {"j3": 2.84, "j2": 2.95, "link1": 0.85, "wrist": 0.63}
    curves = [(name, [0, 14, 24], [0, 13.3, end]) for name, end in ends.items()]
    drawn = tutorial_pictures.chart(curves, "rises", across="h", up="K")
    height = {name: float(y) for y, name in re.findall(r'y="([\d.]+)"[^<]*>(\w+)</text>', drawn) if name in ends}
    assert sorted(ends, key=ends.__getitem__) == sorted(height, key=height.__getitem__, reverse=True)


def test_the_picture_of_the_rooms_is_that_of_the_code():
    """A row still had a dot for a room that it imported no more. To renew it: python docs/rooms.py."""
    assert (ROOT / "docs" / "rooms.svg").read_text() == rooms.picture()


def test_what_is_said_of_a_room_fits_its_box():
    assert max(len(rooms.sentence(room)) for room in rooms.ROOMS) <= 92
