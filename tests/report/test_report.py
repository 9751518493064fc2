"""Reports of long runs: text in blocks, and curves no longer than a screen shows."""

import numpy as np
import pytest
from shipped import path_file, quiet

from compgen.core.decimals import short_columns
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.report import figure, job_page, waypoints_csv


@pytest.mark.parametrize("places", [4, 5, 6])
@pytest.mark.parametrize("sign", [1.0, -1.0, 0.0])  # of all; both
def test_numbers_at_every_length_are_as_formatting_each_gives(places, sign):
    step = 10.0**-places
    ends = np.array([10.0**k + d * step for k in range(-places, 6) for d in (-1.0, -0.5, -0.49, 0.0, 0.49, 1.0)])
    ends = ends[ends < 99_999.5]
    values = np.concatenate([[0.0, 99_999.9], ends, np.random.default_rng(2).uniform(0, 1000, 500)])
    values = values * sign if sign else values * np.where(np.arange(len(values)) % 2, 1, -1)
    table = np.column_stack([values, values[::-1], np.roll(values, 7)])
    number = np.arange(99_990, 99_990 + len(values))
    for rows in (slice(None), slice(0, 1), slice(40, 60)):  # each block has its own widths
        few = [(table[rows], places), (None, 4), (table[rows] / 1e3, 4)]
        first, last = int(number[rows][0]), int(number[rows][-1]) + 1
        assert short_columns(table[rows], places) is not None
        assert waypoints_csv.csv_lines(first, last, few) == waypoints_csv.long_csv_lines(first, last, few)
    for odd in (1e5, -1e5, np.nan, np.inf):  # no room
        assert short_columns(np.array([[1.0, odd]]), places) is None


def test_rows_to_draw_are_the_first_largest_and_smallest_of_each_bin_and_both_ends():
    rng = np.random.default_rng(6)
    for values in (rng.random(50_001), rng.integers(0, 3, 9_000).astype(float), np.zeros(4_001), np.arange(10_000.0)):
        edges = np.linspace(0, len(values), figure.POINTS // 2 + 1).astype(int).tolist()
        bins = list(zip(edges, edges[1:], strict=False))
        extremes = {a + int(of(values[a:b])) for a, b in bins for of in (np.argmax, np.argmin)}
        assert figure.rows_to_draw(values).tolist() == sorted({0, *extremes, len(values) - 1})
    assert figure.rows_to_draw(values[: figure.POINTS]).tolist() == list(range(figure.POINTS))


def test_places_of_a_few_samples_are_those_between_all_waypoints():
    path = generate.predict(load_job(path_file("line_y")), quiet).path
    arc = np.concatenate([path.arc[[0, 3, -1]], np.random.default_rng(8).uniform(0, path.arc[-1], 50)])
    for coordinates, column in zip(job_page.positions_at(path, arc), path.target.position.T, strict=True):
        assert np.array_equal(coordinates, np.round(1e3 * np.interp(arc, path.arc, column), 2))
