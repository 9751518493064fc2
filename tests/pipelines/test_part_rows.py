"""Which samples and waypoints count as on the part where pages, many starts and living pages are judged: by hand."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from shipped import path_file

from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import many_starts
from compgen.pipelines.resume import resume
from compgen.pipelines.resume.paged_run import on_part_rows
from compgen.pipelines.study.geometry import plan_geometry
from compgen.pipelines.study.live_places import fly_planned

ON_PART = np.array([False, True, True, False, False, True, False])  # segments of a path of eight waypoints


def stub(**values: Any) -> Any:
    return SimpleNamespace(**values)


def test_waypoints_touch_where_a_segment_to_either_side_does():
    whole = stub(path=stub(segments_on_part=lambda: ON_PART))
    assert_array_equal(on_part_rows(whole), [0, 1, 1, 1, 0, 1, 1, 0])
    whole = stub(path=stub(segments_on_part=lambda: ~ON_PART))  # both ends of the path touch
    assert_array_equal(on_part_rows(whole), [1, 1, 0, 1, 1, 1, 1, 1])


def test_pages_are_judged_on_the_part_before_and_after_whatever_their_samples():
    """Largest errors lie off the part, and beside them on its edges; the old text has a sample each 0.25 m."""
    waypoint = np.arange(8.0)
    old, new = np.arange(0, 7.01, 0.25), np.arange(0, 7.01, 0.5)

    def errors(arc, edge, inside):
        """9 um off the part, ``edge`` at its ends (1, 3, 5 and 6 m), ``inside`` beyond."""
        on = ((arc >= 1) & (arc <= 3)) | ((arc >= 5) & (arc <= 6))
        size = np.where(on, inside, 9.0)
        size[np.isin(arc, [1.0, 6.0])] = edge
        return np.column_stack([np.zeros_like(size), size, np.zeros_like(size)]) * 1e-6

    touches = np.isin(new, [*np.arange(1, 3.01, 0.5), 5.0, 5.5, 6.0])
    path = stub(arc=waypoint, segments_on_part=lambda: ON_PART)
    planned = stub(deviation=lambda: stub(arc=old, error=errors(old, 4.0, 2.0)), path=path)
    after = stub(arc=new, error=errors(new, 3.0, 1.0))
    prepared = stub(first_samples=lambda: np.arange(8) * 2, touching_samples=lambda on: touches)
    pages = [stub(first=10 + first, number=n, name=f"P{n}", file=f"P{n}.LS", data=b"") for n, first in ((3, 0), (4, 4))]
    files = {"P3.LS": b"x", "P4.LS": b"x"}
    results = resume.judged_pages(stub(pages=[None, None, *pages]), 3, planned, files, after, prepared)
    assert_allclose([(page.before.max, page.after.max) for page in results], [(4e-6, 3e-6)] * 2)
    means = [(np.sqrt((16 + 8 * 4) / 9), np.sqrt((9 + 4) / 5)), (np.sqrt((16 + 4 * 4) / 5), np.sqrt((9 + 2) / 3))]
    assert_allclose([(page.before.rms, page.after.rms) for page in results], np.array(means) * 1e-6)


def test_the_largest_error_after_a_start_is_the_largest_of_all_samples_on_the_part():
    """Against every sample one by one; more lies off the part, and where the displacement is added the other way."""
    rng = np.random.default_rng(5)
    arc = np.linspace(0, 7, 71)
    on = ((arc > 0.99) & (arc < 3.01)) | ((arc > 4.99) & (arc < 6.01))
    waypoints = np.arange(0, 71, 10)
    for _ in range(20):
        error = np.zeros((71, 3))
        error[:, 1] = rng.normal(size=71) * np.where(on, 10.0, 40.0)
        moved = np.zeros((4, 8, 3))
        moved[:, :, 1] = rng.normal(size=(4, 1)) * 8 + rng.normal(size=(4, 8)) * 0.01
        moved[:, 4, 1] += 200.0  # about a waypoint that is off the part to either side
        file = stub(
            program=stub(path=stub(touching_segments=lambda: ON_PART)),
            prepared=stub(touching_samples=lambda touching, on=on: on),
        )
        at_mean = stub(arc=arc, error=error)
        largest = many_starts.largest_after_each(file, at_mean, moved, waypoints)
        between = np.array([np.interp(arc, arc[waypoints], row) for row in moved[:, :, 1]])
        truth = np.abs(error[on, 1] + between[:, on]).max(axis=1)
        assert_allclose(largest, truth, atol=0.05)
        assert (np.abs(between[:, ~on]).max(axis=1) > truth + 1).all()


def test_an_error_across_counts_beside_the_extremes_of_each_axis():
    """One sample, of no axis's ends at the waypoints: with a quarter of the displacement sqrt(4^2 + 3.5^2)."""
    arc, error = np.array([0.0, 0.5, 2.0]), np.array([[0, 0, 0], [4.0, 3.0, 0], [0, 0, 0]])
    moved = np.array([[[0, 0, 0], [0, 2.0, 0]]])
    every = np.ones(3, dtype=bool)
    file = stub(
        program=stub(path=stub(touching_segments=lambda: every[:1])),
        prepared=stub(touching_samples=lambda touching: every),
    )
    largest = many_starts.largest_after_each(file, stub(arc=arc, error=error), moved, np.array([0, 2]))
    assert_allclose(largest, [np.hypot(4, 3.5)])


@pytest.mark.parametrize("name", ["line_y", "spiral_1300"])
def test_samples_at_the_seams_of_the_part_are_on_it_in_a_living_page(name):
    """By the fraction of each sample on its segment: what begins behind a segment on the part ends it."""
    job = load_job(path_file(name))
    geometry = plan_geometry(job)
    flown = fly_planned(job, geometry, geometry.rises_as_planned(job))
    on = geometry.path.segments_on_part()
    expected = [
        on[s] or (f == 0 and s > 0 and on[s - 1])
        for s, f in zip(geometry.segment.tolist(), geometry.fraction.tolist(), strict=True)
    ]
    assert_array_equal(flown.on_part, expected)
    plainly = on[geometry.segment]
    assert plainly.sum() < flown.on_part.sum() < len(on) + len(flown.on_part)  # seams there are
    assert not flown.on_part.all()
