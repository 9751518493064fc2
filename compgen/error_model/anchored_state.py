r"""What a robot is at a time: how warm, where its base stands, what else has drifted; and how well that is known.

    x = (rises of K nodes [K], shift of the base in World [m], its turn [rad], D numbers of the robot file)

with one covariance. A thermal model with more modes than rises has its modal state beside them. It is text:
``state.toml`` gives values and standard deviations with their units, and the correlations row by row to the diagonal.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tomlkit
from pydantic import Field, FiniteFloat

from compgen.core.arrays import Array, nine_digits, owns
from compgen.core.exceptions import InputError
from compgen.core.toml import Number, Table, check, parse_toml, read_toml_text
from compgen.core.units import MDEG, UM
from compgen.error_model.posterior import correlation_matrix, correlation_rows

AnchorVerdict = Literal["anchored", "leave it", "something moved", "cannot tell", "forecast"]
#: verdicts with which a state may stand in place of history
ACCEPTED = ("anchored", "leave it", "something moved", "forecast")
BASE = 6  # numbers of the base: shift x y z, turn x y z
_MEND = "take the file as cgen anchor wrote it"


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(rise=("K",), base=(BASE,), drift=("D",), covariance=("X", "X"))
class AnchoredState:
    """A robot at a time."""

    model: str  # "nodes" or "network": the heat model that it was found with
    nodes: tuple[str, ...]  # names of the K rises
    rise: Array  # (K,) [K]
    modal: Array | None  # (S,) of a model with more modes than rises
    base: Array  # (6,) [m], [rad]: how far the arm has moved in World from where its robot file has it
    drifting: tuple[str, ...]  # D numbers of the robot file, as in "joint_zeros.offset_mdeg[2]"
    drift: Array  # (D,) what is added to them, in the unit that their name says
    covariance: Array  # (K + 6 + D, K + 6 + D) in the same units
    air: float  # [K] rise of the air
    time: float  # [s] on the clock of touches and log
    window: float  # [s] how long after that it holds, the robot standing
    verdict: AnchorVerdict
    reference: float | None = None  # [degC] that rises and air count from; None: nobody said
    made_from: Mapping[str, str] = field(default_factory=dict)  # sha256 of each file
    digest: str = ""  # sha256 of the state's own file

    def origin(self, since: str = "") -> str:
        """Its verdict and time in brackets, as it stands behind its name; ``since``: how long ago that is."""
        return f"({self.verdict}, at {self.time:.0f} s{since})"

    @property
    def sigma(self) -> Array:
        """Standard deviations, (K + 6 + D,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def factor(self) -> Array:
        """Columns F of the covariance F F^T, (K + 6 + D, R), none of them zero."""
        size = np.where(self.sigma > 0, self.sigma, 1.0)
        values, vectors = np.linalg.eigh(self.covariance / np.outer(size, size))
        columns = size[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
        return np.asarray(columns[:, values > 1e-12])


class _State(Table):
    verdict: AnchorVerdict
    time_s: Annotated[FiniteFloat, Field(ge=0, le=1e11)]
    window_s: Annotated[FiniteFloat, Field(ge=0, le=1e6)]
    air_K: Annotated[FiniteFloat, Field(ge=-80, le=80)]
    heat_model: Literal["nodes", "network"]
    reference_degC: Annotated[FiniteFloat, Field(ge=-20, le=60)] | None = None


class _Warmth(Table):
    node: Annotated[list[str], Field(min_length=1, max_length=200)]
    K: list[Annotated[FiniteFloat, Field(ge=-80, le=80)]]
    sigma_K: list[Number]
    modal: list[FiniteFloat] | None = None


class _Base(Table):
    shift_um: Annotated[list[Number], Field(min_length=3, max_length=3)]
    turn_mdeg: Annotated[list[Number], Field(min_length=3, max_length=3)]
    sigma_um: Annotated[list[Number], Field(min_length=3, max_length=3)]
    sigma_mdeg: Annotated[list[Number], Field(min_length=3, max_length=3)]


class _Drifting(Table):
    parameter: Annotated[str, Field(max_length=120)]
    change: Number
    sigma: Number


class StateFile(Table):
    """The file of a state."""

    state: _State
    rise: _Warmth
    base: _Base
    drifting: Annotated[list[_Drifting], Field(max_length=100)] | None = None
    correlation: list[list[FiniteFloat]]
    made_from: dict[str, Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]]


def read_state(source: str) -> AnchoredState:
    """A state from its file.

    Raises:
        InputError: Not there, or anything wrong in it, naming file and key.
    """
    text = read_toml_text(Path(source), "paths", "--state names what cgen anchor wrote, state.toml")
    return parse_state(text.content, source)


def parse_state(content: bytes, source: str) -> AnchoredState:
    """A state from the text of its file.

    Args:
        content: The text.
        source: Where it is from, for messages.

    Raises:
        InputError: Anything wrong in it, naming the key.
    """
    file = check(StateFile, parse_toml(content.decode("utf-8-sig"), source, _MEND), source)
    warmth, base, drifting = file.rise, file.base, file.drifting or ()
    for key in ("K", "sigma_K"):
        count = len(getattr(warmth, key))
        if count != len(warmth.node):
            raise InputError(f"{source}: rise.{key}: {count} values of {len(warmth.node)} nodes; {_MEND}")
    twice = next((n for n in warmth.node if warmth.node.count(n) > 1), None)
    if twice is not None:
        raise InputError(f"{source}: rise.node: '{twice[:32]}' stands twice; {_MEND}")
    units = np.concatenate([np.ones(len(warmth.node)), np.repeat([UM, MDEG], 3), np.ones(len(drifting))])
    sigma = np.array([*warmth.sigma_K, *base.sigma_um, *base.sigma_mdeg, *(d.sigma for d in drifting)]) * units
    names = [*warmth.node, *"xyzwpr", *(d.parameter for d in drifting)]
    if (sigma < 0).any():
        raise InputError(f"{source}: {names[int(np.argmin(sigma))]}: a standard deviation below zero; {_MEND}")
    correlation = correlation_matrix(file.correlation, names, source, _MEND)
    return AnchoredState(
        model=file.state.heat_model,
        nodes=tuple(warmth.node),
        rise=np.array(warmth.K),
        modal=np.array(warmth.modal) if warmth.modal else None,
        base=np.concatenate([np.array(base.shift_um) * UM, np.array(base.turn_mdeg) * MDEG]),
        drifting=tuple(d.parameter for d in drifting),
        drift=np.array([d.change for d in drifting]),
        covariance=correlation * np.outer(sigma, sigma),
        air=file.state.air_K,
        time=file.state.time_s,
        window=file.state.window_s,
        verdict=file.state.verdict,
        reference=file.state.reference_degC,
        made_from=file.made_from,
        digest=sha256(content).hexdigest(),
    )


def state_text(state: AnchoredState) -> str:
    """The state's file."""
    sigma, K = state.sigma, len(state.nodes)
    file = tomlkit.document()
    file.add(
        tomlkit.comment("What a robot is at a time, as cgen anchor wrote it; for --state of cgen generate and others")
    )
    # a key of the top level stands before any table: TOML reads keys into the table above them
    file.add(tomlkit.comment("of rises, base shift, base turn and drifting numbers, in this order, to the diagonal"))
    correlation = tomlkit.array()
    for row in correlation_rows(state.covariance):
        correlation.add_line(tomlkit.array(row), indent="  ")
    correlation.add_line(indent="")
    values = {
        "verdict": state.verdict,
        "time_s": _remarked(nine_digits(state.time) + 0.0, "on the clock of touches and log"),
        "window_s": _remarked(
            nine_digits(state.window) + 0.0, "how long after that it holds, the robot standing with its servo on"
        ),
        "air_K": nine_digits(state.air) + 0.0,
        **({} if state.reference is None else {"reference_degC": nine_digits(state.reference) + 0.0}),
    }
    rise = {"node": list(state.nodes), "K": _number_list(state.rise), "sigma_K": _number_list(sigma[:K])}
    file["correlation"] = correlation
    file["state"] = {**values, "heat_model": state.model}
    file["rise"] = rise if state.modal is None else {**rise, "modal": state.modal.tolist()}
    base = {
        "shift_um": _number_list(state.base[:3] / UM),
        "turn_mdeg": _number_list(state.base[3:] / MDEG),
        "sigma_um": _number_list(sigma[K : K + 3] / UM),
        "sigma_mdeg": _number_list(sigma[K + 3 : K + BASE] / MDEG),
    }
    file["base"] = _remarked(base, "how far the arm stands in World from where its robot file has it")
    if state.drifting:
        changes = zip(state.drifting, _number_list(state.drift), _number_list(sigma[K + BASE :]), strict=True)
        file["drifting"] = [{"parameter": name, "change": change, "sigma": s} for name, change, s in changes]
    file["made_from"] = _remarked(state.made_from, "sha256")
    return tomlkit.dumps(file)


def _remarked(value: Any, remark: str) -> Any:
    return tomlkit.item(value).comment(remark)


def _number_list(values: Array) -> list[float]:
    return [nine_digits(v) + 0.0 for v in values.tolist()]
