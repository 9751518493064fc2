"""The error sources of a robot file: tables to sources in SI, each with how well it is known."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError
from compgen.core.toml import suggest
from compgen.core.units import DEG, MDEG, MM
from compgen.error_model import schema as ss
from compgen.error_model.sources import (  # fmt: skip
    AxisMap,
    BaseFrame,
    GearHarmonics,
    Hysteresis,
    JointCompliance,
    JointCoupling,
    JointRipple,
    JointZeros,
    Known,
    LinkOffsets,
    Loads,
    Parameter,
    Source,
    ThermalBend,
    ThermalGrowth,
    ThermalShift,
    ToolFrame,
    prior_of,
)
from compgen.robot.robot import Robot


def read_sources(
    table: ss.SourcesTable, growth: ThermalGrowth, robot: Robot, nodes: Sequence[str], where: str
) -> tuple[Known, ...]:
    """The sources of a robot file in the order in which they are folded.

    Args:
        table: The file's ``sources``.
        growth: What the file's thermal profiles say.
        robot: Nominal facts.
        nodes: Names of the rise columns.
        where: The file, for messages.

    Raises:
        InputError: A shape, node or key does not fit, named.
    """
    loads = _loads(table.loads, robot)
    found = [_known(ThermalGrowth, table.thermal_growth, where, a=growth.a, d=growth.d)]
    for kind, rows, facts in (
        (LinkOffsets, table.link_offsets, {}),
        (JointZeros, table.joint_zeros, {}),
        (JointCoupling, table.joint_coupling, {"zero": robot.pendant_zero}),
        (JointCompliance, table.compliance, {"loads": loads}),
        (GearHarmonics, table.gear_harmonics, {}),
        (JointRipple, table.joint_ripple, {}),
        (Hysteresis, table.hysteresis, {"loads": loads}),
        (BaseFrame, table.base_frame, {}),
    ):
        if rows is not None:
            found.append(_known(kind, rows, where, **facts, **_facts(rows)))
    if table.thermal_bend is not None:
        found.append(_known(ThermalBend, table.thermal_bend, where, **_bends(table.thermal_bend, robot, nodes, where)))
    if table.thermal_shift is not None:
        shifts = _shifts(table.thermal_shift, np.array([0.0, 0.0, 1.0]), nodes, where)
        found.append(_known(ThermalShift, table.thermal_shift, where, **shifts))
    if table.tool_frame is not None:
        found.append(_known(ToolFrame, table.tool_frame, where))
    axes = [row.axis for row in table.map]
    if twice := next((a for a in axes if axes.count(a) > 1), None):
        raise InputError(f"{where}: sources.map: two lines along {twice}; their contributions would add, keep one")
    found += [_line(row, i, where) for i, row in enumerate(table.map)]
    return tuple(found)


def read_box(table: ss.SourcesTable, where: str) -> Array | None:
    """Pendant angles that the parameters hold in, (6, 2) [rad]."""
    if table.box is None:
        return None
    box = np.array([table.box.low_deg, table.box.high_deg]).T * DEG
    if not (box[:, 0] < box[:, 1]).all():
        i = int(np.argmin(box[:, 1] - box[:, 0]))
        raise InputError(f"{where}: sources.box.high_deg.{i}: {table.box.high_deg[i]:g} must be above low_deg")
    return box


def _known(kind: Any, rows: ss.SourceTable | None, where: str, /, key: str = "", **facts: Any) -> Known:
    name = f"sources.{key or kind.NAME}"
    try:
        values = {} if rows is None else {p.field: np.array(getattr(rows, p.key)) * p.unit for p in kind.PARAMETERS}
        source: Source = kind(**values, **facts)
    except ValueError as failure:  # rows of unequal length, or not as many columns as orders
        raise InputError(f"{where}: {name}: {failure}; give each row an entry for each order") from None
    prior = prior_of(source)
    if rows is None:
        return Known(source, prior, {}, "")
    prior.update(_spread(rows.prior, source, f"{where}: {name}.prior"))
    return Known(source, prior, _spread(rows.sigma, source, f"{where}: {name}.sigma"), rows.provenance)


def _spread(rows: dict[str, Any], source: Source, where: str) -> dict[str, Array]:
    """Standard deviations by field; one number serves all entries."""
    keys: dict[str, Parameter] = {p.key: p for p in source.PARAMETERS}
    found = {}
    for key, value in rows.items():
        if key not in keys:
            raise InputError(f"{where}.{key}: unknown key{suggest(key, list(keys))}")
        shape = np.shape(getattr(source, keys[key].field))
        try:
            spread = np.broadcast_to(np.array(value, dtype=float), shape)
        except (ValueError, TypeError):
            told = " x ".join(map(str, shape))
            raise InputError(f"{where}.{key}: must be one number, or {told} as the values are") from None
        if not (np.isfinite(spread).all() and (spread >= 0).all()) or isinstance(value, (bool, str)):
            raise InputError(f"{where}.{key}: a standard deviation is a number from 0 up")
        found[keys[key].field] = np.array(spread) * keys[key].unit
    return found


def _facts(rows: ss.SourceTable) -> dict[str, Any]:
    """What a source is told beside its parameters."""
    match rows:
        case ss.GearHarmonicsTable():
            return {"cycles": np.array(rows.cycles)}
        case ss.JointRippleTable():
            return {"order": np.array(rows.order, dtype=int)}
        case ss.HysteresisTable():
            return {"width": np.array(rows.width_mdeg) * MDEG}
    return {}


def _line(row: ss.MapTable, number: int, where: str) -> Known:
    key = f"map.{number}"
    station = np.array(row.station_mm) * MM
    if not (np.diff(station) > 0).all():
        raise InputError(f"{where}: sources.{key}.station_mm: stations must rise; sort the rows, each place once")
    for name in ("forward_um", "reverse_um"):
        have = len(getattr(row, name))
        if have != len(station):
            raise InputError(f"{where}: sources.{key}.{name}: {have} rows for {len(station)} stations; give one each")
    return _known(
        AxisMap, row, where, key=key, axis="xyz".index(row.axis), station=station,
        place=np.array(row.at_mm) * MM, width=row.width_mm * MM,
    )  # fmt: skip


def rows_at_zero(robot: Robot) -> tuple[Array, Array]:
    """Places (7, 3) [m] and axes (7, 3, 3) of the frames behind the DH rows at pendant zero; the first is World's."""
    position, rotation = [np.zeros(3)], [np.eye(3)]
    for q, d, a, alpha in zip(robot.pendant_zero, robot.d, robot.a, robot.alpha):
        c, s, ca, sa = np.cos(q), np.sin(q), np.cos(alpha), np.sin(alpha)
        position.append(position[-1] + rotation[-1] @ [a * c, a * s, d])
        rotation.append(rotation[-1] @ [[c, -s * ca, s * sa], [s, c * ca, -c * sa], [0, sa, ca]])
    return np.array(position), np.array(rotation)


def _loads(table: ss.LoadsTable, robot: Robot) -> Loads:
    place, axes = rows_at_zero(robot)
    from_joint = np.array(table.link_centre_mm) * MM
    centre = np.einsum("kji,kj->ki", axes[1:], place[:-1] + from_joint - place[1:])
    return Loads(
        mass=np.array(table.link_kg),
        centre=centre,
        payload=table.payload_kg,
        payload_centre=np.array(table.payload_centre_mm) * MM,
        gravity=np.array(table.gravity_m_s2),
        force=np.array(table.force_N),
    )


def _bends(table: ss.ThermalBendTable, robot: Robot, nodes: Sequence[str], where: str) -> dict[str, Any]:
    """Row, axis, lever and node of each bend; positive rates turn as joint 2 does, or about World x and y."""
    key = f"{where}: sources.thermal_bend"
    count = len(table.link)
    for name in ("plane", "node", "rate_arcsec_K"):
        if len(getattr(table, name)) != count:
            raise InputError(f"{key}.{name}: {len(getattr(table, name))} entries for {count} links; give one each")
    row: list[int] = []
    axis: list[Array] = []
    lever: list[Array] = []
    node: list[int] = []
    for i, (link, plane, name) in enumerate(zip(table.link, table.plane, table.node)):
        if name not in nodes:
            raise InputError(f"{key}.node.{i}: '{name}' is unknown{suggest(name, list(nodes))}")
        if plane != "twist" and (link == "column") != (plane in "xy"):
            fit = "'x' or 'y'" if link == "column" else "'arm' or 'side'"
            raise InputError(f"{key}.plane.{i}: '{plane}' does not fit the link '{link}'; say {fit}")
        if link != "column" and not (robot.d[3] if link == "d4" else robot.a[int(link[1]) - 1]):
            raise InputError(f"{key}.link.{i}: {link} has no length in this arm; name one that has")
        node.append(nodes.index(name))
        place = _bend_of(link, plane, robot, table.column_mm * MM)
        row.append(place[0])
        axis.append(place[1])
        lever.append(place[2])
    return {
        "row": np.array(row, dtype=int),
        "axis": np.array(axis).reshape(count, 3),
        "lever": np.array(lever).reshape(count, 3),
        "node": np.array(node, dtype=int),
    }


def _shifts(table: ss.ThermalShiftTable, flange_axis: Array, nodes: Sequence[str], where: str) -> dict[str, Any]:
    """Row, axis and node of each shift; a fixture that moves takes the part away, so the tool is off the other way."""
    key = f"{where}: sources.thermal_shift"
    for name in ("node", "rate_um_K"):
        if len(getattr(table, name)) != len(table.of):
            raise InputError(f"{key}.{name}: {len(getattr(table, name))} entries for {len(table.of)}; give one each")
    for i, name in enumerate(table.node):
        if name not in nodes:
            raise InputError(f"{key}.node.{i}: '{name}' is unknown{suggest(name, list(nodes))}")
    tools = [of == "tool" for of in table.of]
    axes = [flange_axis if of == "tool" else -np.eye(3)["xyz".index(of[-1])] for of in table.of]
    return {
        "row": np.where(tools, 6, 0).astype(int),
        "axis": np.array(axes).reshape(-1, 3),
        "node": np.array([nodes.index(n) for n in table.node], dtype=int),
    }


def _bend_of(link: str, plane: str, robot: Robot, column: float) -> tuple[int, Array, Array]:
    """Row, axis and lever of a link's bend in the frame it is put into."""
    if link == "column":
        if plane == "twist":
            return 0, np.eye(3)[2], np.zeros(3)
        return 0, np.eye(3)["xy".index(plane)], np.array([0.0, 0.0, column / 2])
    _, axes = rows_at_zero(robot)
    index = int(link[1])
    if link == "d4":  # begins at frame 3, before joint 4 turns it
        row, vector, lever = 3, np.array([0.0, 0.0, robot.d[3]]), -0.5
    else:  # ends at its own frame
        row, vector, lever = index, np.array([robot.a[index - 1], 0.0, 0.0]), 0.5
    if plane == "twist":
        return row, vector / np.linalg.norm(vector), np.zeros(3)
    joint = axes[1 if link == "a1" else row - 1][:, 2]
    sense = -1.0 if joint @ axes[1][:, 2] < 0 else 1.0
    turn = axes[row].T @ joint * sense
    if plane == "side":
        turn = np.cross(vector / np.linalg.norm(vector), turn)
    return row, np.round(turn, 15), lever * vector
