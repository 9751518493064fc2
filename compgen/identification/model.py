r"""The arm with symbols for the parameters of its error sources: the pose of the flange, and its Jacobian.

    P(theta, state, p), R(theta, state, p)      dP/dp (3, K)   dR/dp (9, K)

A parameter p_k has a Gaussian prior N(0, sigma_k^2): how far from nominal such robots are before any measurement.
Those of one kind form a group; their common scale may be learnt from the data (``fit``), never the sign or a single
value. Without temperatures the rise of a node during a warm-up is a first-order state, A_k (1 - exp(-t / tau)),
A_k a typical rise times 1 + x. A node without a sensor in a log of others is known to a factor and to its lag
(``thermal/filled_rises.py``).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, frozen
from compgen.core.evaluation import evaluate, kept_with
from compgen.core.units import HOUR
from compgen.error_model.source import Source, State
from compgen.identification.measurements import Measurements
from compgen.robot.kinematics import nominal_chain
from compgen.robot.robot import Robot
from compgen.thermal.filled_rises import HEIGHT, LAG

#: of the scale of a group of cold parameters, a hundred times its sigma: no prior is that wrong. What warmth does is
#: known better, by expansion and by what others measured, and rests on fewer poses: there the prior is the ceiling
CEILING = 1e4
WARM_RISE = 8.0  # K: typical of a node in a warm-up without temperatures; what a fit has of it has a prior of 1
WARM_TAU = 2 * HOUR  # s: typical; its logarithm has a prior of 1


@dataclass(frozen=True, slots=True, kw_only=True)
class FreeParameter:
    """A parameter that can be fitted."""

    source: str  # its table in the robot file
    field: str
    index: tuple[int, ...]
    key: str  # in the robot file, with its unit
    unit: float  # SI of one unit of the key
    prior: float  # [SI]
    group: str  # the parameters of a group share one scale
    thermal: bool = False  # the arm's warmth has it, cold poses say nothing of it
    label: str = ""  # in place of the index

    @property
    def name(self) -> str:
        """Table, key and index from 1 or term, as in ``joint_zeros.offset_mdeg[2]``."""
        return f"{self.source}.{self.key}[{self.label or ','.join(str(i + 1) for i in self.index)}]"


@dataclass(frozen=True, eq=False, slots=True, weakref_slot=True)
class ArmModel:
    """CasADi functions of (theta 6, rise K, its lag K, direction 6, time since warm-up 1, p)."""

    parameters: tuple[FreeParameter, ...]
    flange: Any  # -> P (3), R (9)
    expressions: tuple[Any, ...]  # SX: the inputs as a list, P, R (9), d(P, R)/dp (12, K)

    def pose(self, data: Measurements, p: Array) -> tuple[Array, Array]:
        """The flange at each pose, (M, 3) [m] and (M, 3, 3)."""
        position, rotation = evaluate(self.flange, *_model_inputs(data, p))
        return position, np.swapaxes(rotation.reshape(-1, 3, 3), 1, 2)

    def derivatives(self, active: BoolArray, data: Measurements, p: Array) -> tuple[Array, Array, Array, Array]:
        """The flange and its derivatives by the active parameters, (M, 3), (M, 3, 3), (M, 3, K'), (M, 3, 3, K')."""
        if not active.any():
            P, R = self.pose(data, p)
            return P, R, np.zeros((len(P), 3, 0)), np.zeros((len(P), 3, 3, 0))
        position, rotation, dP, dR = evaluate(_jacobian_function(self, active.tobytes()), *_model_inputs(data, p))
        M, K = len(position), dP.shape[1] // 3
        matrices = np.swapaxes(rotation.reshape(M, 3, 3), 1, 2)
        dP = np.swapaxes(dP.reshape(M, K, 3), 1, 2)
        return position, matrices, dP, dR.reshape(M, K, 3, 3).transpose(0, 3, 2, 1)

    def __reduce__(self) -> tuple[Any, ...]:
        """Expressions do not pickle, functions of them do."""
        inputs, *outputs = self.expressions
        return _from_functions, (self.parameters, self.flange, ca.Function("expressions", inputs, outputs))

    @property
    def prior(self) -> Array:
        """Standard deviations before any measurement, (K,) [SI]."""
        return np.array([t.prior for t in self.parameters])

    @property
    def thermal(self) -> BoolArray:
        """Parameters that the arm's warmth has, (K,)."""
        return np.array([t.thermal for t in self.parameters], dtype=bool)

    @property
    def ceiling(self) -> Array:
        """How far the scale of each group may rise over its prior's variance, (G,)."""
        names, group = self.groups()
        warm = np.bincount(group, self.thermal, len(names)) > 0 if len(group) else np.zeros(0, dtype=bool)
        return np.where(warm, 1.0, CEILING)

    def groups(self) -> tuple[tuple[str, ...], IntArray]:
        """Names of the groups, and the group of each parameter, (K,)."""
        return _groups(self)


def _from_functions(parameters: tuple[FreeParameter, ...], flange: Any, expressions: Any) -> ArmModel:
    inputs = expressions.sx_in()
    return ArmModel(parameters, flange, (inputs, *expressions(*inputs)))


@kept_with("model")
def _groups(model: ArmModel) -> tuple[tuple[str, ...], IntArray]:
    names = tuple(dict.fromkeys(t.group for t in model.parameters))
    return names, frozen(np.array([names.index(t.group) for t in model.parameters], dtype=int))


@kept_with("model")
def _jacobian_function(model: ArmModel, active: bytes) -> Any:
    """P, R, dP (3 K') and dR (9 K'); kept with the model, as several of its fits have the same active parameters."""
    inputs, position, rotation, jacobian = model.expressions
    columns = jacobian[:, np.flatnonzero(np.frombuffer(active, dtype=bool)).tolist()]
    return ca.Function("jacobian", inputs, ca.cse([position, rotation, columns[:3, :], columns[3:, :]]))


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class SymbolicSource:
    """A source with symbols in the fields that shall be fitted."""

    source: Source  # with symbols
    original: Source  # as the robot file has it
    symbols: Any  # SX column of the parameters in it
    parameters: tuple[FreeParameter, ...]
    values: Mapping[str, Array]  # of the original, by field
    prior: Mapping[str, Array]  # standard deviations before measurements, by field


def fixed_source(source: Source) -> SymbolicSource:
    """A source as it is, with nothing to fit."""
    return SymbolicSource(source=source, original=source, symbols=ca.SX.zeros(0, 1), parameters=(), values={}, prior={})


def build_model(
    robot: Robot,
    sources: Sequence[SymbolicSource],
    nodes: int,
    states: Sequence[int] = (),
    modelled: Sequence[int] = (),
) -> ArmModel:
    """Apply the sources to the nominal chain, and differentiate.

    Args:
        robot: The nominal arm.
        sources: What is applied, with symbols.
        nodes: Of the heat model.
        states: Nodes of unknown rise in a warm-up without temperatures.
        modelled: Nodes without a sensor in a log, whose given rise is known to a factor and a lag.
    """
    theta, rise, lag = ca.SX.sym("theta", 6), ca.SX.sym("rise", max(nodes, 1)), ca.SX.sym("lag", max(nodes, 1))
    direction, warm = ca.SX.sym("direction", 6), ca.SX.sym("warm")
    warm_up_symbols, warm_up_parameters, rise_with_states = _warm_up_expr(states, rise, warm)
    for k in modelled:
        height, log_tau = ca.SX.sym(f"height_{k}"), ca.SX.sym(f"log_tau_{k}")
        rise_with_states[k] = (1 + height) * (rise[k] + log_tau * lag[k])
        warm_up_symbols += [height, log_tau]
        warm_up_parameters += [
            _of_warm_up("height", k, "height_over_model", HEIGHT, "height"),
            _of_warm_up("lag", k, "log_tau_over_model", LAG, "lag"),
        ]
    chain = nominal_chain(robot, theta)
    state = State(chain, rise_with_states, direction, ca.SX.zeros(3))
    for source in sources:
        chain = source.source.distort(chain, state)
    p = (
        ca.vertcat(*(source.symbols for source in sources), *warm_up_symbols)
        if sources or warm_up_symbols
        else ca.SX.sym("none", 0)
    )
    position, rotation = chain.pose_expr()
    position, rotation = ca.densify(position), ca.densify(rotation)
    columns = ca.reshape(rotation, 9, 1)
    pose = ca.vertcat(position, columns)
    jacobian = ca.densify(ca.jacobian(pose, p)) if p.numel() else ca.SX.zeros(12, 0)
    inputs = [theta, rise, lag, direction, warm, p]
    return ArmModel(
        tuple(t for source in sources for t in source.parameters) + tuple(warm_up_parameters),
        ca.Function("flange", inputs, ca.cse([position, columns])),
        (inputs, position, columns, jacobian),
    )


def _of_warm_up(field: str, index: int, key: str, prior: float, group: str) -> FreeParameter:
    """A parameter of the warm-up, a pure number."""
    return FreeParameter(
        source="warm_up", field=field, index=(index,), key=key, unit=1.0, prior=prior, group=f"warm_up.{group}"
    )


def _warm_up_expr(states: Sequence[int], rise: Any, warm: Any) -> tuple[list[Any], list[FreeParameter], Any]:
    """Symbols and parameters of nodes of unknown rise, and all rises with them: A (1 + y) (1 - exp(-t / tau)) of each.

    tau = typical exp(x). The fit begins at the typical rise and not at none, where the derivative by the rate of a bend
    would be zero.
    """
    symbols, parameters, rises = [], [], [rise[k] for k in range(rise.numel())]
    for n, k in enumerate(states):
        x, y = ca.SX.sym(f"log_tau_{k}"), ca.SX.sym(f"rise_{k}")
        symbols += [x, y]
        parameters += [
            _of_warm_up("log_tau", n, "log_tau", 1.0, "tau"),
            _of_warm_up("rise", k, "rise_over_typical", 1.0, "rise"),
        ]
        rises[k] = rises[k] + WARM_RISE * (1 + y) * (1 - ca.exp(-warm / (WARM_TAU * ca.exp(x))))
    return symbols, parameters, ca.vertcat(*rises)


def _model_inputs(data: Measurements, p: Array) -> tuple[Array, ...]:
    rise = data.rise if data.rise.shape[1] else np.zeros((len(data.theta), 1))
    lag = data.lag if data.lag.shape[1] else np.zeros_like(rise)
    return data.theta, rise, lag, data.direction, data.warm[:, None], p[None, :]


def active_in_groups(model: ArmModel, groups: Sequence[str]) -> BoolArray:
    """Which parameters belong to the groups named, (K,)."""
    return np.array([t.group in groups for t in model.parameters], dtype=bool)
