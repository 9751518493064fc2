"""What the frames can do is taken from the parameters, and what they can do only in rounding is not."""

from types import SimpleNamespace
from typing import cast

import numpy as np
from numpy.testing import assert_allclose

from compgen.identification.fit import Fit
from compgen.identification.identifiability import (
    assess_identifiability,
    largest_moves,
    unobservable,
    unseen_directions,
)
from compgen.identification.measurements import PLACE, TOUCH, WORLD, Measurements
from compgen.identification.model import ArmModel


def stand_in(frames, parameters, *, sigma=None, noise=None, outlier=(), group=None, covariance=None, names=None):
    """Model, data and fit of parameters and frames that move the rows along some columns, three to a row."""
    parameters = np.asarray(parameters).reshape(len(frames), -1)
    rows, K = len(frames) // 3, parameters.shape[1]
    A = np.column_stack([parameters, frames]).reshape(rows, 3, -1)
    posterior = SimpleNamespace(
        covariance=np.eye(A.shape[2]) if covariance is None else covariance,
        scales=SimpleNamespace(group=np.ones(K) if group is None else np.array(group)),
    )
    fitted = SimpleNamespace(
        active=np.ones(K, dtype=bool), outlier=np.isin(np.arange(rows), outlier), noise=1.0, posterior=posterior,
        noise_of_row=np.ones(rows) if noise is None else np.array(noise),
        p=np.ones(K), linear=SimpleNamespace(A=A, C=np.zeros((0, A.shape[2]))),
    )  # fmt: skip
    data = SimpleNamespace(
        sigma=np.ones(rows) if sigma is None else np.array(sigma), aligned=np.array([False]),
        instrument=np.zeros(rows, dtype=int), kind=np.full(rows, TOUCH),
    )  # fmt: skip
    model = SimpleNamespace(
        groups=lambda: ((), np.arange(K)),
        prior=np.ones(K),
        parameters=[SimpleNamespace(source="joint_zeros", name=name) for name in names or map(str, range(K))],
    )
    # what stands in for them has what is asked of them
    return cast(ArmModel, model), cast(Measurements, data), cast(Fit, fitted)


def assessed(frames, parameters, **more):
    return assess_identifiability(*stand_in(frames, parameters, **more))


def test_columns_that_differ_by_rounding_are_one_direction():
    """Eigenvalues of the frames below 1e-10 of the largest, 4 here, are nothing that a frame can do.

    Four unit columns a, a, a, a + d b have the eigenvalue 3/4 d^2 along b.
    """
    a, b = np.eye(6)[0], np.eye(6)[1]
    for eigenvalue, left in ((1e-10, 5.0), (1.6e-9, 0.0)):  # 4e-10 is between
        columns = np.column_stack([a, a, a, a + np.sqrt(4 / 3 * eigenvalue) * b])
        fit_of_b = assessed(columns, 5 * b)
        assert_allclose(fit_of_b.singular_values, [left], atol=1e-3)


def test_a_parameter_that_does_what_a_frame_does_is_not_seen():
    a, b, c = np.eye(6)[:3]
    assert_allclose(assessed(np.column_stack([a, b]), 3 * a + 4 * c).singular_values, [4.0], atol=1e-12)


def test_a_row_weighs_by_its_own_sigma_and_the_noise_of_its_kind_and_an_outlier_not_at_all():
    """3 over 1, 32 over 2 x 4, and one that was set aside: by Pythagoras 5."""
    moves = np.zeros(9)
    moves[[0, 3, 6]] = 3.0, 32.0, 100.0
    found = assessed(np.eye(9)[:, [1]], moves, sigma=[1.0, 2.0, 1.0], noise=[1.0, 4.0, 1.0], outlier=[2])
    assert_allclose(found.singular_values, [5.0], atol=1e-12)


def test_where_nothing_is_free_the_frames_alone_are_judged():
    """Two columns at 60 degrees, of any length: singular values sqrt(1 +- 1/2); one that moves nothing is left out."""
    columns = np.column_stack([5 * np.eye(9)[0], np.eye(9)[0] + np.eye(9)[1] * np.sqrt(3), 0 * np.eye(9)[0]])
    columns[6:, 0] = 1e3  # in a row that was set aside
    nothing = np.zeros((9, 0))
    found = assessed(columns, nothing, outlier=[2])
    assert (len(found.singular_values), found.held_by_prior, found.correlated, found.condition) == (0, (), (), 1.0)
    assert_allclose(found.frames_condition, np.sqrt(3))
    model, data, fitted = stand_in(columns, nothing, outlier=[2])
    assert len(largest_moves(model, fitted)) == 0
    data.instrument[:] = WORLD
    assert_allclose(assess_identifiability(model, data, fitted).frames_condition, np.sqrt(3))
    data.instrument[:], data.aligned[:] = 0, True  # of axis tests, which stand as World does
    assert assess_identifiability(model, data, fitted).frames_condition == 1


def test_what_is_known_of_a_frame_beforehand_counts_as_much_as_its_noise_says():
    """A place seen along x alone, at a noise of 0.5, and known to 0.25 along x and y: columns (1, 2) and 2."""
    model, data, fitted = stand_in(np.eye(6)[:, [0, 1]] * [1.0, 0.0], np.zeros((6, 0)))
    fitted.linear.C, fitted.noise = np.array([[4.0, 0.0], [4.0, 4.0]]), 0.5
    rows = np.array([[1.0, 0], [2, 0], [2, 2]]) / np.array([3.0, 2])
    assert_allclose(assess_identifiability(model, data, fitted).frames_condition, np.linalg.cond(rows))


def test_what_the_data_takes_from_the_priors_is_what_is_said_of_each_parameter():
    """Of a scale of 9 times its prior a variance of 4.4 is less than half, of 4.6 more; 0.96 is told, -0.94 is not."""
    C = np.diag([4.4, 4.6, 0.25, 0.01])
    C[0, 1] = C[1, 0] = 0.96 * np.sqrt(4.4 * 4.6)
    C[1, 2] = C[2, 1] = -0.94 * np.sqrt(4.6 * 0.25)
    moves = np.eye(6)[:, :4] * [4.0, 0.5, 0.9, 0.1]
    found = assessed(np.eye(6)[:, [4, 5]], moves, covariance=np.pad(C, (0, 2)), group=[9.0, 9.0, 1.0, 1.0])
    assert found.held_by_prior == (1,)
    ((a, b, correlation),) = found.correlated
    assert (a, b) == (0, 1)
    assert_allclose(correlation, 0.96)
    assert_allclose(found.singular_values, [12.0, 1.5, 0.9, 0.1])
    assert_allclose(found.condition, 8.0)  # of those above one


def test_a_move_of_a_parameter_is_the_largest_of_a_row_beside_what_the_frames_do():
    moves = np.zeros(9)
    moves[[0, 3, 4, 8]] = 9.0, 3.0, 4.0, 2.0
    model, _, fitted = stand_in(np.eye(9)[:, [0]], moves)
    model.prior[:], fitted.p[:] = 0.5, -1.5  # a row moves by what its column says for each prior
    assert_allclose(largest_moves(model, fitted), [15.0])


def test_what_no_row_sees_is_named_by_its_parameters_the_largest_first():
    """b + a / 2, e - 0.2 a and f - 0.4 a move nothing, c does what a faint column of a frame does, d is seen.

    What is less than 0.3 of the largest is not named.
    """
    a, c, d = np.eye(6)[0], np.eye(6)[1], np.eye(6)[2]
    names = ["a", "b", "c", "d", "e", "f"]
    parts = np.column_stack([2 * a, -a, c, d, 0.4 * a, 0.8 * a])
    fit_of = stand_in(np.column_stack([1e-7 * c, np.eye(6)[5], 0 * a]), parts, names=names)
    assert sorted(unseen_directions(*fit_of)) == ["b with a", "c", "e", "f with a"]
    assert not unseen_directions(*stand_in(np.eye(6)[:, [5]], np.column_stack([a, c, d]), names=names))
    assert unseen_directions(*stand_in(np.eye(6)[:, [5]], np.zeros((6, 0)))) == []


def test_what_takes_less_than_a_hundredth_from_a_priors_variance_is_not_seen():
    parts = np.column_stack([0.09 * np.eye(6)[0], 0.11 * np.eye(6)[1]])
    assert unseen_directions(*stand_in(np.eye(6)[:, [5]], parts)) == ["0"]


def test_of_many_unseen_directions_four_are_named_and_the_rest_counted():
    assert not list(unobservable(*stand_in(np.eye(6)[:, [5]], np.eye(6)[:, :3])))
    for count, words in ((1, "no row sees 0: held"), (4, "0; 1; 2; 3: held"), (6, "0; 1; 2; 3, and 2 more: held")):
        (finding,) = unobservable(*stand_in(np.eye(9)[:, [5]], np.zeros((9, count))))
        assert words in finding.message


def test_places_of_an_instrument_leave_nothing_unsaid_and_touches_of_world_not_the_base():
    model, data, fitted = stand_in(np.eye(6)[:, [5]], np.zeros((6, 1)))
    data.kind[:] = PLACE
    assert not list(unobservable(model, data, fitted))
    data.kind[1] = TOUCH
    data.instrument[:] = WORLD
    assert ["base" in f.message for f in unobservable(model, data, fitted)] == [True, False]
