r"""Extended axes of an arm's own group (E1, E2, E3): what each carries, from the table of frames.

    [extended.E1]                           the arm stands on it
    kind = "rail"
    [[extended.E1.base]]                    where its World is, told in the cell's, when E1 is 1500 mm
    at_mm = 1500
    x_mm = 1500
    ...
    r_deg = 0
    [extended.E2]                           it turns or moves a part; the arm stands where it stood
    kind = "positioner"

The robot file's World is the arm's own: it moves along with the rail. Nothing is computed between two listed values.
"""

from dataclasses import dataclass
from typing import Any

from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.toml import brief_value
from compgen.program.pose_table import length_or_angle, pose_of, pose_values

NAMES = ("E1", "E2", "E3")
KINDS = ("rail", "positioner")
SAME_VALUE = 0.005  # [mm] or [deg]: what two prints of a value that has not moved differ by
_UPRIGHT = 1e-6  # [deg]


@dataclass(frozen=True, slots=True)
class ExtendedAxis:
    """What an extended axis carries: the arm, with its base where the axis has some values, or a part."""

    kind: str
    unit: str = ""  # of its values, "mm" or "deg"; "" where none is told
    base: tuple[tuple[float, Pose], ...] = ()  # of a rail: value [mm or deg], and the arm's World in the cell's

    def base_at(self, value: float, unit: str) -> Pose | None:
        """Where the arm's World is when the axis has a value; None where that is not told."""
        if unit != self.unit:
            return None
        return next((pose for at, pose in self.base if abs(at - value) <= SAME_VALUE), None)


def extended_axes(data: Any, path: str) -> dict[str, ExtendedAxis]:
    """The axes of a table of frames, by name.

    Raises:
        InputError: An unknown key, axis or kind, a rail without a base, a base that tilts; names file and key.
    """
    if not isinstance(data, dict):
        raise InputError(f"{path}: extended: must be a table; give [extended.E1]")
    axes = {name: _axis(name, table, path) for name, table in data.items()}
    rails = [name for name, axis in axes.items() if axis.kind == "rail"]
    if len(rails) > 1:
        raise InputError(f"{path}: extended.{rails[1]}: a second rail; one axis at most carries the arm")
    return axes


def _axis(name: str, table: Any, path: str) -> ExtendedAxis:
    key = f"extended.{name:.40}"
    if name not in NAMES:
        raise InputError(f"{path}: {key}: unknown axis; known: {', '.join(NAMES)}")
    if not isinstance(table, dict):
        raise InputError(f"{path}: {key}: must be a table with kind, and for a rail [[{key}.base]]")
    if unknown := sorted(set(table) - {"kind", "base"}):
        raise InputError(f"{path}: {key}.{unknown[0]:.40}: unknown key; known: kind, base")
    kind = table.get("kind")
    if kind not in KINDS:
        given = "missing" if kind is None else f"{brief_value(kind)} is not known"
        raise InputError(f"{path}: {key}.kind: {given}; give one of: {', '.join(KINDS)}")
    bases = table.get("base", [])
    if not isinstance(bases, list):
        raise InputError(f"{path}: {key}.base: must be tables; give [[{key}.base]]")
    if kind == "positioner":
        if bases:
            raise InputError(f"{path}: {key}.base: a positioner does not carry the arm; leave it out")
        return ExtendedAxis(kind)
    if not bases:
        raise InputError(f"{path}: {key}.base: missing; give [[{key}.base]] with at_mm or at_deg and the base's pose")
    return _rail(bases, key, path)


def _rail(bases: list[Any], key: str, path: str) -> ExtendedAxis:
    """An axis that carries the arm, from the bases that were measured along it."""
    placed = [_base(table, f"{key}.base[{i}]", path) for i, table in enumerate(bases, 1)]
    unit = placed[0][0]
    for i, (other, value, _) in enumerate(placed, 1):
        if other != unit:
            raise InputError(f"{path}: {key}.base[{i}]: at_{other} beside at_{unit}; an axis has one unit")
        if any(abs(value - before) <= 2 * SAME_VALUE for _, before, _ in placed[: i - 1]):
            raise InputError(f"{path}: {key}.base[{i}].at_{unit}: {value:g} {unit} is told twice; remove one")
    return ExtendedAxis("rail", unit, tuple((value, pose) for _, value, pose in placed))


def _base(table: Any, key: str, path: str) -> tuple[str, float, Pose]:
    """Unit, value and pose."""
    values = pose_values(table, key, path, ("at_mm", "at_deg"))
    units = [unit for unit in ("mm", "deg") if f"at_{unit}" in table]
    if len(units) != 1:
        raise InputError(f"{path}: {key}: give at_mm or at_deg, one of them: the axis' value there")
    for name, tilt in zip(("w_deg", "p_deg"), values[3:5], strict=True):
        if abs(tilt) > _UPRIGHT:
            raise InputError(f"{path}: {key}.{name}: {tilt:g} deg: the arm must stand upright on its rail; give 0")
    return units[0], length_or_angle(table, f"at_{units[0]}", key, path), pose_of(values)
