"""A still picture's lines stay near the path that they stand for."""

import re

import numpy as np

from compgen.report import still_picture
from compgen.report.still_picture import CHORD, still_svg
from compgen.report.view import view_of

LINE = re.compile(r'<path d="M([^"]*)" stroke="#[0-9a-f]{6}" stroke-width="2.2"')
ROUNDED = 0.05 * np.sqrt(2) + 1e-9  # px: a written corner has one decimal


def distance_to_line(point, line):
    """Of a point (2,) from a polyline (K, 2)."""
    start, step = line[:-1], np.diff(line, axis=0)
    along = np.clip(((point - start) * step).sum(axis=1) / np.maximum((step**2).sum(axis=1), 1e-12), 0, 1)
    return np.hypot(*(point - start - along[:, None] * step).T).min()


def drawn(places, values):
    svg = still_svg(["", ""], view_of(places, np.ones(len(places), dtype=bool)), places, values, 1.0, COLOURS)
    return [np.array([corner.split() for corner in line.split("L")], dtype=float) for line in LINE.findall(svg)]


COLOURS = ("#000000", "#ffffff")


def test_lines_leave_the_path_by_no_more_than_a_quarter_of_a_pixel(monkeypatch):
    turn = np.linspace(0, 12 * np.pi, 4000)
    places = np.column_stack([turn * np.cos(turn), turn * np.sin(turn), np.zeros_like(turn)])
    values = (np.sin(5 * turn) > 0).astype(float)  # colours change, and each line begins where the last one ended
    lines = drawn(places, values)
    monkeypatch.setattr(still_picture, "CHORD", 0.0)
    every = np.vstack(drawn(places, values))
    assert len(lines) > 50
    assert sum(len(line) for line in lines) < len(every) / 3
    way = np.vstack(lines)
    assert max(distance_to_line(point, way) for point in every) < CHORD + 2 * ROUNDED


def test_a_gap_in_the_path_is_no_line():
    places = np.array([[0.0, 0, 0], [100, 0, 0], [np.nan] * 3, [100, 100, 0], [0, 100, 0]])
    view = view_of(places[[0, 1, 3, 4]], np.ones(4, dtype=bool))
    svg = still_svg(["", ""], view, places, np.zeros(5), 1.0, COLOURS)
    assert [line.count("L") for line in LINE.findall(svg)] == [1, 1]
