"""An execution against the true path, by formulas taken sample by sample and by values sorted whole."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.finding_codes import Code, Level
from compgen.core.pose import Pose
from compgen.core.units import UM
from compgen.job.bounds import Bounds
from compgen.planning import curves, surfaces, toolpath
from compgen.planning.boundaries import unbounded
from compgen.planning.exact_path import ExactPath
from compgen.verification.deviation import SUBSAMPLE, deviation_from_path, percentile99, statistics
from compgen.verification.twin import Execution
from compgen.verification.verdict import judge


def executed(path, samples, seed=1):
    """An execution that strays by known amounts, and its path's poses and travel."""
    rng = np.random.default_rng(seed)
    fraction, whole = np.modf(np.sort(rng.uniform(0, len(path.piece), samples)))
    segment = whole.astype(np.int64)
    target, travel = path.at(segment, fraction)
    strayed = np.hstack([rng.normal(size=(samples, 3)) * 100 * UM, rng.normal(size=(samples, 3)) * 1e-4])
    none = np.zeros((samples, 6))
    execution = Execution(
        segment=segment,
        fraction=fraction,
        time=np.arange(float(samples)),
        rise=none,
        theta=none,
        actual=target.moved(strayed),
    )
    return execution, target, travel


@pytest.fixture(scope="module")
def path():
    """Even segments and uneven ones, and a retract along the tool's axis."""
    table = curves.join(
        curves.spiral((0, 0), (0.2, 0.25), (0, 2 * np.pi)), curves.line((0.25, 0.0), (0.4, 0.0)),
        curves.u_turns(np.array([[0.4, 0.0]]), np.array([[0.4, 0.02]]), np.array([[1.0, 0.0]]), 0.032),
        curves.line((0.4, 0.02), (0.25, 0.02)),
    )  # fmt: skip
    surface = surfaces.plane(np.array([1.2, 0.0, 0.2]))
    bare = ExactPath(curve=table, surface=surface, boundary=unbounded(), spin=0.3)
    return toolpath.plan_tool_path(bare, toolpath.LayoutSettings(1.5 * UM), lift=0.02)


def test_a_deviation_is_the_difference_in_the_axes_of_path_and_tool(path):
    execution, target, travel = executed(path, 5000)
    odd = np.isnan(path.slope[execution.segment, 0])
    assert 0.01 < odd.mean() < 0.99
    deviation = deviation_from_path(path, [execution], len(execution.time))
    error = execution.actual.position - target.position
    assert_allclose(deviation.error, error, atol=1e-14)
    assert_allclose(deviation.total(), np.linalg.norm(error, axis=1), atol=1e-14)
    axis = target.rotation[:, :, 2]
    leads = np.linalg.norm(np.cross(travel, axis), axis=1) < 0.5
    assert 10 < leads.sum() < len(leads) / 2
    ahead = np.where(leads[:, None], target.rotation[:, :, 0], travel)
    side = np.cross(ahead, axis)
    values = {
        "total": np.linalg.norm(error, axis=1),
        "feed": np.einsum("ij,ij->i", error, np.cross(axis, side)),
        "cross": np.einsum("ij,ij->i", error, side),
        "normal": -np.einsum("ij,ij->i", error, axis),
        "axis_angle": np.arcsin(np.linalg.norm(np.cross(axis, execution.actual.rotation[:, :, 2]), axis=1)),
    }
    assert_allclose(deviation.normal, values["normal"], atol=1e-14)
    assert_allclose(
        deviation.arc,
        path.arc[execution.segment] + execution.fraction * np.diff(path.arc)[execution.segment],
        atol=1e-14,
    )
    gaps = np.diff(deviation.arc)
    weight = np.r_[gaps, 0] / 2 + np.r_[0, gaps] / 2
    for name, size in values.items():
        size, extent = np.abs(size), deviation.extents[name]
        assert extent.max == pytest.approx(size.max(), abs=1e-13)
        assert extent.where == deviation.arc[np.argmax(size)]
        assert extent.rms == pytest.approx(np.sqrt(np.average(size**2, weights=weight)), rel=1e-9)
        assert extent.p99 == pytest.approx(by_sorting(size, weight), abs=1e-13)


def test_the_last_place_on_the_part_is_judged_as_one_on_it(path):
    """It is where the retract begins, too: of that it was a sample, and along its way."""
    N = len(path.arc)
    segment, fraction = np.append(np.arange(N - 1), N - 2), np.append(np.zeros(N - 1), 1.0)
    last = int(np.flatnonzero(path.contact)[-1])
    assert last < N - 1
    strayed = np.zeros((N, 6))
    strayed[last, :2] = 30 * UM, 40 * UM
    none, target = np.zeros((N, 6)), path.target
    actual = Pose(target.position + strayed[:, :3], target.rotation)
    execution = Execution(
        segment=segment, fraction=fraction, time=np.arange(float(N)), rise=none, theta=none, actual=actual
    )
    on_part = deviation_from_path(path, [execution], N).on_part
    assert on_part["total"].max == pytest.approx(50 * UM)
    assert on_part["feed"].max == pytest.approx(30 * UM)  # the line goes along x there
    assert on_part["cross"].max == pytest.approx(40 * UM)


def test_chunks_of_an_execution_give_what_the_whole_gives(path):
    execution = executed(path, 9000)[0]

    def rows(first, last):
        return Execution(**{name: getattr(execution, name)[first:last] for name in Execution.__slots__})

    whole = deviation_from_path(path, [execution], 9000)
    parts = deviation_from_path(path, [rows(0, 4000), rows(4000, 9000)], 9000)
    assert np.array_equal(whole.error, parts.error)
    assert np.array_equal(whole.arc, parts.arc)
    assert whole.extents == parts.extents


def by_sorting(values, weight):
    order = np.argsort(values, kind="stable")
    passed = np.cumsum(weight[order])
    return values[order[min(np.searchsorted(passed, 0.99 * passed[-1]), len(order) - 1)]]


def test_the_percentile_is_that_of_all_values_sorted():
    rng = np.random.default_rng(9)
    many = rng.random(20_000)
    even = 0.5 + rng.random(len(many))
    for values, weight in (
        (many, even),
        (rng.exponential(size=20_000) ** 3, even),
        (np.r_[np.zeros(19_900), many[:100]], even),
        (np.full(20_000, 0.3), even),
        (many, np.exp(20 * many)),  # nearly all of the length lies with the largest
        (many, np.exp(-20 * many)),
        (np.where(np.arange(20_000) % SUBSAMPLE, many, 0.0), even),  # what is looked at first tells nothing
        (np.where(np.arange(20_000) % SUBSAMPLE, many, 2.0), even),
        (many[:3], even[:3]),
    ):
        assert percentile99(values, weight) == by_sorting(values, weight)


def test_each_broken_bound_is_named_with_its_worst_place(path):
    execution = executed(path, 3000)[0]
    deviation = deviation_from_path(path, [execution], len(execution.time))
    kept = Bounds(max=1.0, p99=1.0, rms=1.0, feed=1.0, cross=1.0, normal=1.0, axis=1.0)
    assert judge(deviation, kept) == []
    broken = judge(deviation, Bounds(max=1e-6, p99=1e-6, rms=1e-6, feed=1e-6, cross=1e-6, normal=1e-6, axis=1e-6))
    assert [f.code.split(".")[1] for f in broken] == [
        "max_um", "p99_um", "rms_um", "feed_um", "cross_um", "normal_um", "axis_mdeg"
    ]  # fmt: skip
    table = statistics(deviation, on_part=True)
    for finding, value in zip(broken, table["total"].values(), strict=False):
        assert f"{value:.3f} um" in finding.message
    where = deviation.arc[np.argmax(np.abs(deviation.normal))]
    assert f"worst {where:.3f} m" in broken[5].message
    assert f"{table['axis_angle']['max_mdeg']:.3f} mdeg" in broken[6].message


def test_a_bound_of_what_the_report_says_is_kept(path):
    """Micrometres to metres and back lose a last digit; a part in 1e14 less is broken."""
    execution = executed(path, 3000)[0]
    for scale in np.linspace(1.0, 2.0, 200):
        moved = Pose(scale * execution.actual.position, execution.actual.rotation)
        deviation = deviation_from_path(path, [replace(execution, actual=moved)], len(execution.time))
        largest = statistics(deviation, on_part=True)["total"]["max_um"]
        for bound, is_broken in ((largest * UM, False), (largest * UM * (1 - 1e-14), True)):
            codes = [finding.code for finding in judge(deviation, Bounds(max=bound))]
            assert (Code.BOUNDS_MAX_UM in codes) == is_broken


def test_what_breaks_a_bound_off_the_part_alone_is_a_note(path):
    execution = executed(path, 3000)[0]
    off = ~(path.contact[:-1] | path.contact[1:])[execution.segment]
    assert 0 < off.sum() < len(off)
    jump = np.where(off[:, None], [0.0, 0.0, 5e-3], 0.0)
    moved = replace(execution, actual=Pose(execution.actual.position + jump, execution.actual.rotation))
    apart = deviation_from_path(path, [moved], len(execution.time))
    bounds = Bounds(max=1.01 * apart.on_part["total"].max, normal=1e-6)
    codes = {f.code: f for f in judge(apart, bounds)}
    assert codes[Code.BOUNDS_OFF_PART].level is Level.NOTE
    assert "bounds.max_um" not in codes
    assert codes[Code.BOUNDS_NORMAL_UM].level is Level.OUTSIDE
    assert [f.code for f in judge(apart, Bounds())] == ["bounds.none"]
