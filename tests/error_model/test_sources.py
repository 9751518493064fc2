"""Each error source: exact zeros leave no trace, hand formulas, derivatives against differences."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from flawed import COUNT, flawed_file
from numpy.testing import assert_allclose
from scipy.interpolate import CubicSpline

from compgen.core.pose import IDENTITY, Pose
from compgen.core.rotations import rotation_matrix
from compgen.core.units import DEG, MDEG, MM, UM
from compgen.error_model.direction_memory import (
    NO_DIRECTION,
    DirectionState,
    command_directions,
    direction_states,
    first_order_lag,
    play_operator,
    reversal_widths,
    unknown_share,
)
from compgen.error_model.expressions import rotation_expr
from compgen.error_model.loads import Loads
from compgen.error_model.model import build_error_model
from compgen.error_model.source import ReversalWidths, State
from compgen.error_model.sources import ORDER
from compgen.error_model.sources.compliance import JointCompliance
from compgen.error_model.sources.frames import BaseFrame, ToolFrame
from compgen.error_model.sources.hysteresis import Hysteresis
from compgen.error_model.sources.joint_coupling import JointCoupling
from compgen.error_model.sources.joint_waves import GearHarmonics
from compgen.error_model.sources.joint_zeros import JointZeros
from compgen.error_model.sources.link_offsets import LinkOffsets, parallel_axes
from compgen.error_model.sources.measured_map import AxisMap, basis_expr
from compgen.error_model.sources.thermal_bend import ThermalBend
from compgen.error_model.sources.thermal_growth import ThermalGrowth
from compgen.pipelines.files.robot_file import load_cell
from compgen.robot.kinematics import Chain, Frame, frames_at_zero, nominal_chain

TOOL = Pose(np.array([0.03, -0.02, 0.2]), rotation_matrix(np.array([0.1, 0.2, 0.3])))
FLANGE = IDENTITY
ARCSEC = DEG / 3600
NUMBERS = range(COUNT)


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    return load_cell(flawed_file(tmp_path_factory.mktemp("robot")))


def symbols(cell, tool=TOOL):
    theta, rise = ca.SX.sym("theta", 6), ca.SX.sym("rise", 5)
    direction, travel = ca.SX.sym("u", 6), ca.SX.sym("t", 3)
    chain = nominal_chain(cell.robot, theta, tool)
    return chain, State(chain, rise, direction, travel), ca.vertcat(theta, rise, direction, travel)


def outputs(chain):
    position, rotation = chain.tcp_expr()
    return ca.vertcat(position, ca.vec(rotation))


def moments(cell, count=20):
    """Random joints in limits, rises, directions and travels, (N, 20)."""
    rng = np.random.default_rng(11)
    theta = cell.robot.pendant_zero + rng.uniform(-1, 1, (count, 6))
    return np.hstack([theta, rng.uniform(-5, 14, (count, 5)), rng.uniform(-1, 1, (count, 9))])


def emptied(source):
    """The same source with all its parameters zero."""
    return replace(source, **{p.field: np.zeros(np.shape(getattr(source, p.field))) for p in source.PARAMETERS})


def error(cell, sources, theta, rise=None, direction=None, travel=None, tool=FLANGE):
    """Position error of one pose [m], and how far the tool turned [rad] in World axes."""
    model = build_error_model(cell.robot, sources, 5, tool)
    motion = DirectionState(
        np.zeros((1, 6)) if direction is None else np.array([direction]),
        np.zeros((1, 3)) if travel is None else np.array([travel]),
    )
    believed = model.nominal_pose(theta[None])
    e = model.error(theta[None], np.zeros((1, 5)) if rise is None else np.array([rise]), believed, motion)[0]
    return e[:3], believed.rotation[0] @ e[3:]


@pytest.mark.parametrize("number", NUMBERS)
def test_parameters_that_are_zero_add_nothing_to_the_graph(cell, number):
    chain, state, x = symbols(cell)
    source = emptied(cell.sources[number])
    if isinstance(source, ThermalGrowth):
        source = replace(source, a=np.zeros((6, 5)), d=np.zeros((6, 5)))
    plain = ca.Function("plain", [x], [outputs(chain)])
    with_it = ca.Function("with", [x], [outputs(source.distort(chain, state))])
    assert with_it.n_instructions() == plain.n_instructions()
    point = moments(cell, 1)[0]
    assert np.array_equal(np.asarray(plain(point)), np.asarray(with_it(point)))


@pytest.mark.parametrize("number", NUMBERS)
def test_derivatives_by_parameters_agree_with_differences(cell, number):
    """With symbols for its parameters a source is the same function, and differentiates exactly."""
    source = cell.sources[number]
    shapes = {p.field: np.shape(getattr(source, p.field)) for p in source.PARAMETERS}
    names = {f: ca.SX.sym(f, *s) for f, s in shapes.items()}
    values = {f: np.asarray(getattr(source, f)) for f in shapes}
    chain, state, x = symbols(cell)
    p = ca.vertcat(*(ca.vec(s) for s in names.values()))
    y = outputs(replace(source, **names).distort(chain, state))
    f = ca.Function("f", [x, p], [y, ca.densify(ca.jacobian(y, p))])
    numeric = ca.Function("n", [x], [outputs(source.distort(chain, state))])
    flat = np.concatenate([v.ravel(order="F") for v in values.values()])
    steps = np.concatenate([np.full(values[q.field].size, q.prior / 10) for q in source.PARAMETERS])
    biggest = 0.0
    for row in moments(cell, 5):
        value, J = (np.asarray(v) for v in f(row, flat))
        assert_allclose(value, np.asarray(numeric(row)), atol=1e-13)
        for k, h in enumerate(steps):
            ends = [np.asarray(f(row, flat + s * h * np.eye(len(flat))[k])[0]) for s in (1, -1)]
            biggest = max(biggest, float(np.abs(J[:3, k] * h).max()))
            assert_allclose(J[:, [k]] * h, (ends[0] - ends[1]) / 2, atol=2e-11)  # m: what the step moves
    assert biggest > 1e-7  # the set-up bites


@pytest.mark.parametrize("number", NUMBERS)
def test_derivatives_by_joints_agree_with_differences(cell, number):
    chain, state, x = symbols(cell)
    y = outputs(cell.sources[number].distort(chain, state))
    f = ca.Function("f", [x], [y, ca.densify(ca.jacobian(y, x))])
    for row in moments(cell, 5):
        J = np.asarray(f(row)[1])
        for k in range(20):
            h = 1e-6 if k < 6 else 1e-3
            ends = [np.asarray(f(row + s * h * np.eye(20)[k])[0]) for s in (1, -1)]
            assert_allclose(J[:, [k]], (ends[0] - ends[1]) / (2 * h), atol=2e-9)


def test_every_source_states_its_parameters(cell):
    for source in cell.sources:
        for p in source.PARAMETERS:
            assert hasattr(source, p.field)
            assert p.prior > 0
            assert p.unit > 0
            assert p.meaning
    assert [s.NAME for s in ORDER] == list(dict.fromkeys(s.NAME for s in cell.sources))


def test_wrong_shapes_are_refused(cell):
    with pytest.raises(ValueError, match=r"JointZeros.offset: shape \(5,\)"):
        JointZeros(np.zeros(5))
    with pytest.raises(ValueError, match=r"AxisMap\.reverse"):
        AxisMap(
            forward=np.zeros((3, 3)),
            reverse=np.zeros((4, 3)),
            axis=0,
            station=np.arange(3.0),
            place=np.zeros(3),
            width=0.01,
        )


# pendant zero: upper arm up, forearm forward; J1, J2 at (150, 0, 0), J3 at (150, 0, 870), flange at (1341, 0, 1040) mm
HOME = np.array([1.341, 0, 1.040])
ELBOW = np.array([0.15, 0, 0.87])


@pytest.mark.parametrize(
    ("field", "row", "turn", "move"),
    [
        ("d", 0, None, [0, 0, 1]),  # column up
        ("d", 1, None, [0, 1, 0]),  # along joint 2's axis
        ("d", 5, None, [-1, 0, 0]),  # d6 is negative: more of it is a shorter wrist
        ("a", 0, None, [1, 0, 0]),
        ("a", 1, None, [0, 0, 1]),
        ("alpha", 1, 0, None),
        ("alpha", 2, 0, None),
        ("beta", 1, 1, None),
    ],
)
def test_link_offsets_move_and_turn_what_follows(cell, field, row, turn, move):
    size = 1e-5
    zero = {k: np.zeros(6) for k in ("d", "a", "alpha", "beta")}
    zero[field][row] = size
    e, w = error(cell, [LinkOffsets(**zero)], cell.robot.pendant_zero)
    if move is not None:
        assert_allclose(e, size * np.array(move), atol=1e-15)
        return
    frames = frames_at_zero(cell.robot)
    place, axes = frames.position, frames.rotation
    axis = axes[row + 1][:, turn]
    assert_allclose(e, size * np.cross(axis, HOME - place[row + 1]), atol=2e-10)  # second order
    assert_allclose(w, size * axis, atol=1e-10)


def test_an_excess_lets_a_length_grow_by_that_share_more():
    """At the pendant's zero a2 stands upright, d4 and d6 point ahead."""
    rise = np.full((1, 5), 8.0)

    def grown(*overrides):
        own = load_cell("m710ic50", overrides)
        (growth,) = (s for s in own.sources if isinstance(s, ThermalGrowth))
        model = build_error_model(own.robot, [growth], 5, FLANGE)
        zero = own.robot.pendant_zero[None]
        return model.actual_pose(zero, rise).position[0] - model.nominal_pose(zero).position[0]

    plain, own_a2 = grown(), grown("sources.thermal_growth.excess_a=[0,0.1,0,0,0,0]")
    assert_allclose(own_a2, plain * [1, 1, 1.1], atol=1e-12)
    assert_allclose(grown("sources.thermal_growth.excess_d=[0,0,0,0.2,0,0.2]"), plain * [1.2, 1, 1], atol=1e-12)
    assert plain[[0, 2]].min() > 10e-6


def test_growth_names_the_nodes_that_it_hangs_on():
    a, d = np.zeros((6, 5)), np.zeros((6, 5))
    a[1, 3], d[3, 0] = 1e-5, -1e-5
    assert ThermalGrowth(a, d).nodes() == {0, 3}
    assert ThermalGrowth(a, 0 * d).nodes() == {3}


def test_hayati_angles_belong_to_parallel_axes(cell):
    assert parallel_axes(cell.robot.alpha).tolist() == [False, True, False, False, False, False]


def test_joint_zeros_turn_about_the_joints_axis(cell):
    offset = np.zeros(6)
    offset[0] = 1e-5
    e, w = error(cell, [JointZeros(offset)], cell.robot.pendant_zero)
    assert_allclose(e, [0, 1.341e-5, 0], atol=1e-10)
    assert_allclose(w, [0, 0, 1e-5], atol=1e-15)


def test_coupling_turns_a_joint_by_the_ratio_of_anothers_way(cell):
    ratio = np.zeros((6, 6))
    ratio[2, 1] = 1e-4
    coupling = JointCoupling(ratio, cell.robot.pendant_zero)
    theta = cell.robot.pendant_zero.copy()
    assert not error(cell, [coupling], theta)[0].any()  # mastered
    theta[1] += 0.3
    _, w = error(cell, [coupling], theta)
    assert_allclose(w, [0, -0.3e-4, 0], atol=1e-12)  # theta 3 lifts the forearm: about -y


def loads(payload=0.0, force=(0, 0, 0), mass=0.0):
    return Loads(
        mass=np.array([0, mass, 0, 0, 0, 0]),
        centre=np.array([[0, 0, 0], [-0.435, 0, 0], *4 * [[0, 0, 0]]]),
        payload=payload,
        payload_centre=np.zeros(3),
        gravity=np.array([0, 0, -10.0]),
        force=np.array(force),
    )


def test_a_payload_bends_joint_two_by_its_moment(cell):
    k = np.array([0, 1e-6, 0, 0, 0, 0])
    e, w = error(cell, [JointCompliance(k, np.zeros(6), loads(payload=50))], cell.robot.pendant_zero)
    phi = 1e-6 * 50 * 10 * 1.191  # 500 N on 1.191 m from joint 2: forward and down
    assert_allclose(w, [0, phi, 0], atol=1e-15)
    assert_allclose(e, np.cross([0, phi, 0], HOME - [0.15, 0, 0]), atol=phi**2)
    assert phi / UM > 500


def test_a_link_bends_joint_two_by_its_own_moment(cell):
    k = np.array([0, 1e-6, 0, 0, 0, 0])
    theta = cell.robot.to_theta(np.array([[0, 90, 0, 0, 0, 0]]) * DEG)[0]  # upper arm along x, its centre halfway
    _, w = error(cell, [JointCompliance(k, np.zeros(6), loads(mass=100))], theta)
    assert_allclose(w, [0, 1e-6 * 100 * 10 * 0.435, 0], atol=1e-15)


def test_a_joint_that_grows_stiffer_gives_less_under_more_load(cell):
    """Two payloads by hand: joint 2 carries 595.5 and 1191 N m, and turns by (k - |h| M) M of each."""
    k, h = np.array([0, 1e-6, 0, 0, 0, 0]), np.array([0, -2e-10, 0, 0, 0, 0])
    for payload, phi in ((50, 524.6e-6), (100, 907.3e-6)):
        _, w = error(cell, [JointCompliance(k, h, loads(payload=payload))], cell.robot.pendant_zero)
        assert_allclose(w, [0, phi, 0], atol=0.1e-6)


def test_a_force_of_the_other_sense_gives_as_much_the_other_way(cell):
    """100 N of either sense on 1.341 m from joint 1; a joint whose give is known by its hardening alone."""
    h = np.array([-2e-9, 0, 0, 0, 0, 0])
    turns = [
        error(cell, [JointCompliance(np.zeros(6), h, loads(force=(0, f, 0)))], cell.robot.pendant_zero)[1][2]
        for f in (100, -100)
    ]
    assert_allclose(turns, np.array([1, -1]) * 2e-9 * 134.1**2, rtol=1e-4)


def test_a_force_on_the_tool_turns_joint_one(cell):
    """At home the tool's z is World x, its y World -y: 100 N along -y of World turn joint 1 clockwise."""
    k = np.array([2e-7, 0, 0, 0, 0, 0])
    _, w = error(cell, [JointCompliance(k, np.zeros(6), loads(force=(0, 100, 0)))], cell.robot.pendant_zero)
    assert_allclose(w, [0, 0, -2e-7 * 100 * 1.341], atol=1e-15)


def test_harmonics_are_a_sine_and_a_cosine_of_the_commanded_joint(cell):
    sine, cosine = np.zeros((6, 2)), np.zeros((6, 2))
    sine[0], cosine[0] = (1e-5, -2e-5), (3e-5, 4e-5)
    theta = cell.robot.pendant_zero.copy()
    theta[0] = 0.7
    _, w = error(cell, [GearHarmonics(sine, cosine, np.full(6, 2.0))], theta)
    expected = 1e-5 * np.sin(1.4) - 2e-5 * np.sin(2.8) + 3e-5 * np.cos(1.4) + 4e-5 * np.cos(2.8)
    assert_allclose(w, [0, 0, expected], atol=1e-15)


def test_hysteresis_is_a_half_width_on_either_side(cell):
    lash, wind = np.zeros(6), np.zeros(6)
    lash[1], wind[1] = 1e-5, 1e-8
    source = Hysteresis(lash, wind, np.full(6, 0.01), loads(payload=50))
    half = 1e-5 + 1e-8 * np.hypot(50 * 10 * 1.191, 1)
    for u in (1, -1, 0.25):
        _, w = error(cell, [source], cell.robot.pendant_zero, direction=[0, u, 0, 0, 0, 0])
        assert_allclose(w, [0, -u * half, 0], atol=1e-15)


def test_frames_move_the_arm_and_the_tool(cell):
    turn = np.array([0, 0, 2e-5])
    e, w = error(cell, [BaseFrame(np.array([1e-4, 0, 0]), turn)], cell.robot.pendant_zero)
    assert_allclose(e, [1e-4, 1.341 * 2e-5, 0], atol=1e-9)
    assert_allclose(w, turn, atol=1e-15)
    # at home the flange's z is World x, its x World z, its y World -y
    tool = Pose(np.array([0, 0, 0.25]), np.eye(3))
    e, w = error(cell, [ToolFrame(np.array([1e-4, 0, 0]), np.array([0, 2e-5, 0]))], cell.robot.pendant_zero, tool=tool)
    assert_allclose(e - np.cross([0, -2e-5, 0], [0.25, 0, 0]), [0, 0, 1e-4], atol=1e-9)
    assert_allclose(w, [0, -2e-5, 0], atol=1e-15)


def test_large_turns_of_a_frame_are_exact():
    rng = np.random.default_rng(3)
    for size in (0.0, 1e-8, 0.1, 3.0):
        w = rng.normal(size=3)
        w *= size / np.linalg.norm(w)
        x = ca.SX.sym("w", 3)
        rotation = np.asarray(ca.Function("r", [x], [ca.densify(rotation_expr(x))])(w))
        assert_allclose(rotation, rotation_matrix(w), atol=1e-11)


def test_an_upper_arm_bends_to_a_circle(cell):
    """12 K at the study's 2.4 arcsec/K: 28.8 arcsec, the elbow moves by half of that over the arm's length."""
    theta, rise = cell.robot.pendant_zero, [0, 12.0, 0, 0, 0]
    source = next(s for s in cell.sources if isinstance(s, ThermalBend))
    alone = np.where((source.row == 2) & (np.abs(source.axis[:, 2]) > 0.5), 2.4 * ARCSEC, 0.0)
    assert np.count_nonzero(alone) == 1
    e, w = error(cell, [replace(source, rate=alone)], theta, rise)
    phi = 28.8 * ARCSEC
    assert_allclose(w, [0, phi, 0], atol=1e-12)  # forward, as joint 2 turns
    expected = np.cross([0, phi, 0], HOME - ELBOW) + np.array([phi * 0.87 / 2, 0, 0])
    assert_allclose(e, expected, atol=1e-7)
    assert np.linalg.norm(e) > 100 * UM


def test_a_bent_forearm_ends_at_the_circles_end(cell):
    theta, rise = cell.robot.pendant_zero, [0, 0, 10.0, 0, 0]
    source = next(s for s in cell.sources if isinstance(s, ThermalBend))
    alone = np.where((source.row == 3) & (source.node == 2), 1.0 * ARCSEC, 0.0)
    assert np.count_nonzero(alone) == 1
    e, w = error(cell, [replace(source, rate=alone)], theta, rise)
    phi = 10 * ARCSEC
    wrist = np.array([1.166, 0, 1.04])
    assert_allclose(w, [0, phi, 0], atol=1e-12)
    assert_allclose(e, np.array([0, 0, -phi * 1.016 / 2]) + np.cross([0, phi, 0], HOME - wrist), atol=1e-8)


def test_a_column_bends_about_its_foot(cell):
    theta, rise = cell.robot.pendant_zero, [10.0, 0, 0, 0, 0]
    source = next(s for s in cell.sources if isinstance(s, ThermalBend))
    alone = np.where((source.row == 0) & (source.axis[:, 1] == 1), 1.0 * ARCSEC, 0.0)
    e, w = error(cell, [replace(source, rate=alone)], theta, rise)
    phi = 10 * ARCSEC
    assert_allclose(w, [0, phi, 0], atol=1e-12)
    assert_allclose(e - np.cross([0, phi, 0], HOME), [phi * 0.565 / 2, 0, 0], atol=1e-8)


def test_an_own_cte_scales_one_length(cell, job):
    growth = job.sources[0]
    more = replace(growth, excess_a=np.array([0, 0.1, 0, 0, 0, 0]))
    rise = [11, 3.9, 13, 3, 2.3]
    theta = cell.robot.pendant_zero
    (e0, _), (e1, _) = (error(cell, [s], theta, rise) for s in (growth, more))
    assert_allclose(e1 - e0, [0, 0, 0.1 * growth.a[1] @ np.array(rise)], atol=1e-15)


def test_the_column_lifts_the_arm(cell):
    e, _ = error(cell, [cell.sources[0]], cell.robot.pendant_zero, [10.0, 0, 0, 0, 0])
    (base,) = [p for p in cell.profiles if p.length == "d1"]
    upper = cell.sources[0].a[1, 0] * 10 * (1 + cell.sources[0].excess_a[1])
    assert_allclose(e[2], base.cte * 0.565 * 10 * 1.1 + upper, atol=1e-15)


def line(values, reverse=None):
    station = np.array([1.0, 1.1, 1.25, 1.4, 1.5])
    forward = np.column_stack([values, np.zeros(5), np.zeros(5)])
    other = forward if reverse is None else np.column_stack([reverse, np.zeros(5), np.zeros(5)])
    return AxisMap(forward=forward, reverse=other, axis=0, station=station, place=np.zeros(3), width=0.01)


def test_a_map_is_its_stations_for_each_direction_and_a_spline_between():
    forward, reverse = np.array([10, -20, 30, 0, 5]) * UM, np.array([-10, 0, 10, 20, 40]) * UM
    source = line(forward, reverse)
    s, t = ca.SX.sym("s"), ca.SX.sym("t", 3)
    none = 6 * (0.0,)
    chain = Chain(
        theta=none, d=none, a=none, alpha=none, tool=Frame(ca.vertcat(s, 0, 0), np.eye(3))
    )  # nothing but a TCP at s
    shift = source.distort(chain, State(chain, ca.SX.zeros(1), ca.SX.zeros(6), t)).shift
    f = ca.Function("f", [s, t], [shift])
    for k, at in enumerate(source.station):
        assert_allclose(np.asarray(f(at, [1, 0, 0])).ravel(), [forward[k], 0, 0], atol=1e-17)
        assert_allclose(np.asarray(f(at, [-1, 0, 0])).ravel(), [reverse[k], 0, 0], atol=1e-17)
    spline = CubicSpline(source.station, forward, bc_type="natural")
    for at in np.linspace(1.0, 1.5, 101):
        assert_allclose(np.asarray(f(at, [1, 0, 0]))[0, 0], spline(at), atol=1e-16)
    for at, value in ((0.5, forward[0]), (2.0, forward[-1])):  # beyond the hull the edge's value stays
        assert_allclose(np.asarray(f(at, [1, 0, 0]))[0, 0], value, atol=1e-17)


def test_a_map_of_two_stations_is_a_line():
    basis = np.asarray(ca.Function("b", [], [basis_expr(np.array([0.0, 1.0]), ca.SX(0.25))])()["o0"]).ravel()
    assert_allclose(basis, [0.75, 0.25])


def test_the_memory_of_a_direction_is_the_widths(cell):
    memory = reversal_widths(cell.sources)
    assert memory is not None
    assert_allclose(memory.joint, 600 * MDEG)
    assert_allclose(memory.travel, 40 * MM)
    assert reversal_widths([cell.sources[0]]) is None
    assert direction_states(None, np.zeros((5, 6)), np.zeros((5, 3))) is NO_DIRECTION


def test_direction_does_not_depend_on_how_a_way_is_cut(cell):
    memory = reversal_widths(cell.sources)
    coarse = np.array([0, 0.02, 0.03, 0.01, -0.02])[:, None] * np.ones(6)
    fine = np.interp(np.linspace(0, 4, 41), range(5), coarse[:, 0])[:, None] * np.ones(6)
    places = [np.column_stack([t[:, 0], t[:, 0], 0 * t[:, 0]]) for t in (coarse, fine)]
    states = [direction_states(memory, t, p) for t, p in zip((coarse, fine), places, strict=True)]
    assert_allclose(states[0].direction, states[1].direction[::10], atol=1e-13)
    assert_allclose(states[0].travel, states[1].travel[::10], atol=1e-13)
    left = np.exp(-0.02 / (600 * MDEG))
    assert_allclose(states[0].direction[1], 1 - left, atol=1e-15)  # Dahl, from nothing known


def test_a_way_driven_in_parts_is_remembered_as_the_whole(cell):
    memory = reversal_widths(cell.sources)
    rng = np.random.default_rng(1)
    theta, place = 0.01 * rng.normal(size=(50, 6)).cumsum(axis=0), 0.01 * rng.normal(size=(50, 3)).cumsum(axis=0)
    whole = direction_states(memory, theta, place)
    first = direction_states(memory, theta[:21], place[:21])
    second = direction_states(memory, theta[20:], place[20:], first)
    for name in ("direction", "travel"):
        assert_allclose(getattr(second, name), getattr(whole, name)[20:], atol=1e-14)
        assert np.abs(getattr(first, name)[-1]).max() > 0.1  # the set-up bites


@pytest.mark.parametrize("steps", [0, 1, 2, 3, 37, 100])
def test_relaxed_is_the_recursion(steps):
    rng = np.random.default_rng(0)
    goal, keep = rng.uniform(-1, 1, (steps, 3)), rng.uniform(0, 1, (steps, 3))
    x = rng.uniform(-1, 1, 3)
    result = first_order_lag(goal, keep, x)
    assert result.shape == (steps + 1, 3)
    assert np.array_equal(result[0], x)
    for n, row in enumerate(result[1:]):
        x = goal[n] + keep[n] * (x - goal[n])
        assert_allclose(row, x, atol=1e-14)


@pytest.mark.parametrize("steps", [0, 1, 2, 3, 37, 100])
def test_play_is_the_recursion(steps):
    rng = np.random.default_rng(2)
    step, x = rng.normal(size=(steps, 3)), rng.uniform(-1, 1, 3)
    result = play_operator(step, x)
    assert result.shape == (steps + 1, 3)
    for n, row in enumerate(result[1:]):
        x = np.clip(x + step[n], -1, 1)
        assert_allclose(row, x, atol=1e-14)


def test_play_changes_over_two_widths_and_then_not_at_all():
    widths = ReversalWidths(np.full(6, 0.2 * DEG), np.full(3, np.inf), "play")
    turn = np.array([0, 1.0, 0.9, 0.8, 0.6, 0.4])[:, None] * np.ones(6) * DEG
    states = direction_states(widths, turn, np.zeros((6, 3)))
    assert_allclose(states.direction[:, 0], [0, 1, 0.5, 0, -1, -1], atol=1e-12)
    left = unknown_share(widths, turn, np.zeros((6, 3))).direction[:, 0]
    assert_allclose(left, [1, 0, 0, 0, 0, 0], atol=1e-12)
    small = np.array([0, 0.1, 0.0, 0.1, 0.0])[:, None] * np.ones(6) * DEG
    assert_allclose(unknown_share(widths, small, np.zeros((5, 3))).direction[:, 0], [1, 0.75, 0.75, 0.75, 0.75])


def test_what_is_unknown_of_the_start_fades_with_motion(cell):
    theta = np.array([[0.0], [0.01], [0.0], [0.0]]) * np.ones(6)
    place = np.array([[0, 0, 0], [0.03, 0, 0.04], [0, 0, 0], [0, 0, 0]])
    left = unknown_share(reversal_widths(cell.sources), theta, place)
    assert_allclose(left.direction[:, 0], np.exp(-np.array([0, 0.01, 0.02, 0.02]) / (600 * MDEG)))
    assert_allclose(left.travel[:, 0], np.exp(-np.array([0, 0.05, 0.1, 0.1]) / 0.04))


def test_link_centres_are_read_from_each_joint_in_world_axes(cell):
    """As the file has them: link 2 from joint 2 at (150, 0, 0), link 4 from joint 4's origin at (150, 0, 1040) mm."""
    carried = next(s.loads for s in cell.sources if isinstance(s, JointCompliance))
    frames = frames_at_zero(cell.robot)
    place, axes = frames.position, frames.rotation
    in_world = place[1:] + np.einsum("kij,kj->ki", axes[1:], carried.centre)
    assert_allclose(in_world[1], [0.17, 0.01, 0.4], atol=1e-12)
    assert_allclose(in_world[3], [0.45, 0, 1.04], atol=1e-12)
    assert_allclose(carried.mass, [120, 70, 80, 25, 15, 5])
    assert carried.payload == 34
    assert_allclose(carried.payload_centre, [0.01, 0, 0.15])
    assert_allclose(carried.force, [20, 0, -150])


@pytest.mark.parametrize("law", ["play", "dahl"])
@pytest.mark.parametrize("half", [-24.0, -12.0, -3.0, 0.0, 4.0])
def test_directions_of_a_command_that_makes_up_for_play_are_those_that_it_has(half, law):
    """The command walked in small steps, each by bisection: c - b u(c) = a, with the law's u of c itself."""
    rng = np.random.default_rng(3)
    width, half = 11.0 * MDEG, half * MDEG
    wanted = np.cumsum(np.concatenate([[0.0], np.repeat(rng.normal(0, 1, 40), 12) / 12])) * 12 * MDEG

    def after(u, c):
        if law == "play":
            return min(max(u + c / width, -1.0), 1.0)
        return np.sign(c) + np.exp(-abs(c) / width) * (u - np.sign(c))

    u, sides = 0.0, [0.0]
    for step in np.diff(wanted):
        low, high = -80 * MDEG, 80 * MDEG
        for _ in range(60):
            c = (low + high) / 2
            moved = c - half * (after(u, c) - u)
            low, high = (c, high) if moved < step else (low, c)
        u = after(u, c)
        sides.append(u)
    source = Hysteresis(
        backlash=np.full(6, half), windup=np.zeros(6), width=np.full(6, width), loads=loads(payload=0), law=law
    )
    N = len(wanted)
    theta, sides_before = np.repeat(wanted[:, None], 6, axis=1), rng.uniform(-1, 1, (N, 6))
    made_up = DirectionState(sides_before, np.zeros((N, 3)))
    state = command_directions([source], theta + half * sides_before, np.zeros((N, 3)), made_up, NO_DIRECTION)
    assert_allclose(state.direction[:, 3], sides, atol=1e-9 if law == "play" else 0.02)
    own = direction_states(source.reversal_widths(), theta, np.zeros((N, 3))).direction[:, 3]
    assert abs(half) < 3 * MDEG or np.abs(own - sides).max() > 0.1  # the set-up bites
