r"""How well identification knows the parameters together: their covariance, as it stands beside a robot file.

    C_ij = r_ij sigma_i sigma_j

Measurements tell of sums of parameters more than of each alone, so the correlations r take most of the band away that
the sigmas alone would give. The file names each parameter as the robot file has it, with the value that the covariance
belongs to: a robot file that is renamed or gets another comment keeps it, one with another value does not.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from itertools import product

import numpy as np

from compgen.core.arrays import Array, nine_digits, owns
from compgen.core.exceptions import InputError
from compgen.core.units import HOUR
from compgen.error_model.uncertain_sources import UncertainSource

DECIMALS = 7  # of correlations
LAW = "thermal.node"  # table of the law by which nodes warm; a network has none
_MEND = "identify again, or take the file that was written with this robot file"


@dataclass(frozen=True, slots=True)
class KnownParameter:
    """A number of a robot file, and where its source has it."""

    table: str  # of the robot file: a source's, or ``LAW``
    field: str
    index: tuple[int, ...]
    key: str  # with its unit
    unit: float  # SI of one unit of the key

    @property
    def name(self) -> str:
        """Table, key and index from 1, as in ``joint_zeros.offset_mdeg[2]``."""
        return f"{self.table}.{self.key}[{','.join(str(i + 1) for i in self.index)}]"


@dataclass(frozen=True, eq=False, slots=True)
@owns(value=("P",), covariance=("P", "P"))
class ParameterPosterior:
    """Values of parameters, and their covariance, after measurements."""

    parameters: tuple[KnownParameter, ...]
    value: Array  # (P,) [SI]
    covariance: Array  # (P, P) [SI]

    @property
    def sigma(self) -> Array:
        """Standard deviations, (P,) [SI]."""
        return np.sqrt(np.diag(self.covariance))


def known_numbers(
    known: Sequence[UncertainSource], rise: Array | None = None, tau: Array | None = None
) -> dict[str, tuple[KnownParameter, float]]:
    """All numbers of a robot file that a posterior may know, by name, with their values [SI].

    Args:
        known: The sources.
        rise: Of the nodes of its heat model at the reference, (K,) [K].
        tau: Their time constants, (K,) [s].
    """
    numbers = {}
    for entry in known:
        source = entry.source
        rows = [(p.field, p.key, p.unit) for p in source.PARAMETERS]
        rows += [(f.field, f.key, f.unit) for f in source.FACTS if f.unit is not None]
        for field, key, unit in rows:
            entries = np.asarray(getattr(source, field), dtype=float)
            for index in product(*map(range, entries.shape)):
                parameter = KnownParameter(source.NAME, field, index, key, unit)
                numbers[parameter.name] = parameter, float(entries[index])
    for key, unit, values in (("rise_K", 1.0, rise), ("tau_h", HOUR, tau)):
        for k, value in enumerate([] if values is None else values.tolist()):
            parameter = KnownParameter(LAW, key, (k,), key, unit)
            numbers[parameter.name] = parameter, value
    return numbers


def posterior_hash(content: bytes) -> str:
    """The sha256 by which a robot file names its posterior; line ends count as LF."""
    return sha256(content.replace(b"\r\n", b"\n")).hexdigest()


def posterior_text(posterior: ParameterPosterior, robot: str) -> str:
    """The file: names, values and sigmas in the robot file's units, and the correlations row by row to the diagonal."""
    rows = [
        json.dumps({"name": p.name, "value": nine_digits(v / p.unit), "sigma": nine_digits(s / p.unit)})
        for p, v, s in zip(posterior.parameters, posterior.value.tolist(), posterior.sigma.tolist(), strict=True)
    ]
    lines = correlation_rows(posterior.covariance)
    return (
        f'{{\n"robot": {json.dumps(robot)},\n"parameters": [\n' + ",\n".join(rows) + "\n],\n"
        '"correlation": [\n' + ",\n".join(lines) + "\n]\n}\n"
    )


def read_posterior(
    content: bytes, numbers: Mapping[str, tuple[KnownParameter, float]], where: str
) -> ParameterPosterior:
    """The posterior of a robot file.

    Args:
        content: Of the file.
        numbers: Of the robot file, as ``known_numbers`` gives them.
        where: The file, for messages.

    Raises:
        InputError: It is no posterior, of other parameters, of other values, or no covariance.
    """
    try:
        record = json.loads(content)
        rows = [(str(e["name"]), float(e["value"]), float(e["sigma"])) for e in record["parameters"]]
        lower = [[float(r) for r in row] for row in record["correlation"]]
    except (ValueError, KeyError, TypeError, RecursionError):
        raise InputError(f"{where}: no posterior of an identification; {_MEND}") from None
    names, lawless = [name for name, *_ in rows], not any(name.startswith(LAW) for name in numbers)
    if twice := next((name for i, name in enumerate(names) if name in names[:i]), None):
        raise InputError(f"{where}: parameters: {twice[:80]} stands there twice; {_MEND}")
    kept = [i for i, name in enumerate(names) if not (lawless and name.startswith(LAW))]
    for name, value, sigma in (rows[i] for i in kept):
        if name not in numbers:
            raise InputError(f"{where}: parameters: {name[:80]} is not in the robot file: of another robot? {_MEND}")
        parameter, own_value = numbers[name]
        if nine_digits(own_value / parameter.unit) != nine_digits(value):
            raise InputError(
                f"{where}: parameters: {name}: {value:.9g}, where the robot file has {own_value / parameter.unit:.9g}: "
                f"it belongs to another identification; {_MEND}"
            )
        if not (np.isfinite(sigma) and sigma >= 0):
            raise InputError(f"{where}: parameters: {name}: sigma {sigma:g}: must be a number from 0 up; {_MEND}")
    known = [numbers[names[i]] for i in kept]
    deviations = np.array([rows[i][2] * parameter.unit for i, (parameter, _) in zip(kept, known, strict=True)])
    correlation = correlation_matrix(lower, names, where, _MEND)[np.ix_(kept, kept)]
    return ParameterPosterior(
        tuple(parameter for parameter, _ in known),
        np.array([value for _, value in known]),
        correlation * np.outer(deviations, deviations),
    )


def correlation_rows(covariance: Array) -> list[str]:
    """The correlations of a covariance (P, P) as text, row by row to the diagonal."""
    sigma = np.sqrt(np.diag(covariance))
    scale = np.where(sigma > 0, sigma, 1.0)
    correlation = covariance / np.outer(scale, scale)
    return [
        "[" + ", ".join([*(_decimals(r) for r in row[:i].tolist()), "1"]) + "]" for i, row in enumerate(correlation)
    ]


def correlation_matrix(lower: Sequence[Sequence[float]], names: Sequence[str], where: str, mend: str) -> Array:
    """A matrix (P, P) from its rows up to the diagonal.

    Raises:
        InputError: It is no matrix of correlations of these names.
    """
    matrix = np.zeros((len(names), len(names)))
    if len(lower) != len(names):
        raise InputError(f"{where}: correlation: {len(lower)} rows of {len(names)} parameters; {mend}")
    for i, row in enumerate(lower):
        if len(row) != i + 1:
            raise InputError(f"{where}: correlation: row {i + 1} has {len(row)} numbers, must be {i + 1}; {mend}")
        matrix[i, : i + 1] = row
    bad = np.argwhere(~(np.abs(matrix) <= 1 + 0.5 * 10.0**-DECIMALS))
    if len(bad):
        i, j = bad[0].tolist()
        raise InputError(
            f"{where}: correlation: of {names[i]} with {names[j]}: {matrix[i, j]:g}, must be -1 to 1; {mend}"
        )
    if (np.diag(matrix) != 1).any():
        raise InputError(f"{where}: correlation: of {names[int(np.argmin(np.diag(matrix)))]} with itself must be 1")
    matrix = matrix + np.tril(matrix, -1).T
    least = float(np.linalg.eigvalsh(matrix)[0]) if len(matrix) else 0.0
    if least < -len(matrix) * 10.0**-DECIMALS:  # what rounding can do
        raise InputError(f"{where}: correlation: not positive (an eigenvalue is {least:.3g}): no covariance; {mend}")
    return matrix


def _decimals(value: float) -> str:
    text = f"{value:.{DECIMALS}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text
