"""The thermal models of a robot file: nodes with their profiles, the network, and what they make grow."""

from collections.abc import Mapping, Sequence

import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError
from compgen.core.toml import suggest
from compgen.core.units import HOUR, MM, UM
from compgen.robot.robot import DH_LENGTHS, Robot, dh_length
from compgen.thermal import NodeModel, Profile, Section, growth_weights
from compgen.thermal.drive_losses import Drives
from compgen.thermal.network import Body, Housing, NetworkModel, Volumes, assemble_volumes, modal_form
from compgen.thermal.node_model import MeasuredBox
from compgen.thermal.tables import schema as sc


def node_model_of(table: sc.ThermalTable, where: str) -> NodeModel:
    """The study's model.

    Raises:
        InputError: Nodes or box that contradict themselves.
    """
    names = [n.name for n in table.node]
    if twice := next((n for n in names if names.count(n) > 1), None):
        raise InputError(f"{where}: thermal.node: the name '{twice}' stands twice; give each node its own")
    if table.box.feed_mm_s[0] >= table.box.feed_mm_s[1]:
        raise InputError(f"{where}: thermal.box.feed_mm_s: {table.box.feed_mm_s} must rise; give the lower feed first")
    return NodeModel(
        names=tuple(n.name for n in table.node),
        reference_rise=np.array([n.rise_K for n in table.node]),
        exponent=np.array([n.exponent for n in table.node]),
        tau=np.array([n.tau_h for n in table.node]) * HOUR,
        idle=table.idle_fraction,
        reference_feed=table.reference_feed_mm_s * MM,
        reference_time=table.reference_h * HOUR,
        box=MeasuredBox(feed=np.array(table.box.feed_mm_s) * MM, time=table.box.hours * HOUR, rise=table.box.rise_K),
    )


def check_sensor_rises(table: sc.ThermalTable, where: str) -> None:
    """Raises InputError where a sensor shows a rise that neither heat model of the file has."""
    known = [node.name for node in table.node]
    if table.network:
        known += [probe.name for probe in table.network.probe] + [body.name for body in table.network.body]
    for sensor, rise in table.sensors.items():
        if rise not in known:
            raise InputError(f"{where}: thermal.sensors.{sensor}: rise '{rise}' is unknown{suggest(rise, known)}")


def profiles_of(thermal: sc.ThermalTable, robot: Robot, where: str) -> tuple[Profile, ...]:
    """Profiles along the heated lengths.

    Raises:
        InputError: Unknown nodes, sections that do not fit the length.
    """
    rises = {n.name: n.rise_K for n in thermal.node}
    profiles = []
    for i, profile in enumerate(thermal.profile):
        key = f"{where}: thermal.profile.{i}"
        start, sections = 0.0, []
        for s in profile.sections:
            for node in (s.from_, s.to):
                if node not in rises:
                    raise InputError(f"{key}: node '{node}' is unknown{suggest(node, list(rises))}")
            if s.to_mm * MM <= start:
                raise InputError(f"{key}: to_mm {s.to_mm:g} must be above the section before it")
            if s.shape == "exponential" and not (rises[s.from_] > 0 and rises[s.to] > 0):
                raise InputError(f"{key}: an exponential shape needs rises above zero at '{s.from_}' and '{s.to}'")
            sections.append(Section(start, s.to_mm * MM, s.from_, s.to, s.shape))
            start = s.to_mm * MM
        length = abs(dh_length(robot, profile.length)) or start  # World's origin may stand on top of the column
        if abs(start - length) > 1e-9:
            raise InputError(f"{key}: sections end at {start / MM:g} mm, {profile.length} is {length / MM:g} mm long")
        profiles.append(Profile(profile.length, _cte(thermal, profile.length, where) * UM, tuple(sections)))
    return tuple(profiles)


def _cte(thermal: sc.ThermalTable, length: str, where: str) -> float:
    cte = thermal.cte_um_m_K
    if not isinstance(cte, dict):
        return cte
    if unknown := sorted(set(cte) - {p.length for p in thermal.profile}):
        raise InputError(f"{where}: thermal.cte_um_m_K.{unknown[0]}: no profile has this length")
    if length not in cte:
        raise InputError(f"{where}: thermal.cte_um_m_K: {length} is missing; add {length} = 11.5 (steel)")
    return cte[length]


def network_of(
    thermal: sc.ThermalTable,
    robot: Robot,
    box: MeasuredBox,
    profiles: Sequence[Profile],
    gravity: Sequence[float],
    where: str,
) -> tuple[NetworkModel, tuple[Profile, ...]]:
    """The conduction network, and profiles that take each heated length's mean from it.

    Args:
        thermal: The robot file's table.
        robot: The arm.
        box: Where its other heat model was measured.
        profiles: That model's.
        gravity: In World, of any length; by its direction the drives hold the arm.
        where: The file, for messages.

    Raises:
        InputError: The file has none, or its parts contradict each other.
    """
    table = thermal.network
    key = f"{where}: thermal.network"
    if table is None:
        raise InputError(f"{key}: missing; set thermal.model = 'nodes', or see robots/ for a network")
    if len(table.body) != len(table.housing) + 1:
        raise InputError(
            f"{key}.body: {len(table.body)} bodies, {len(table.housing)} housings; a housing stands between two bodies"
        )
    bodies, housings = _bodies(table), _housings(table)
    drives = sorted(d for h in housings for d in h.drives)
    if drives != list(range(6)):
        raise InputError(f"{key}.housing: drives {[d + 1 for d in drives]}; each of 1 to 6 must stand in one housing")
    volumes = assemble_volumes(bodies, housings, table.floor_W_K)
    heated = [p.length for p in thermal.profile]
    rows = {b.name: 2 * k for k, b in enumerate(bodies)} | {h.name: 2 * k + 1 for k, h in enumerate(housings)}
    if len(rows) != len(bodies) + len(housings):
        raise InputError(f"{key}: a name stands twice among bodies and housings; give each its own")
    for length in heated:
        if length not in rows:
            raise InputError(f"{key}.body: no body is named '{length}', which has a profile; add it")
    names, probes = _named_rises(table, volumes, bodies, rows, heated, key)
    rate, shapes = modal_form(volumes)
    model = NetworkModel(
        names=tuple(names),
        robot=robot,
        drives=_drives(table, robot, gravity),
        bodies=bodies,
        housings=housings,
        floor=table.floor_W_K,
        volumes=volumes,
        probe=np.array(probes),
        reference_rise=np.ones(len(names)),
        box=box,
        rate=rate,
        to_volumes=shapes,
    )
    return model, _means(profiles, bodies, key)


def _means(profiles: Sequence[Profile], bodies: Sequence[Body], key: str) -> tuple[Profile, ...]:
    """Profiles that take each heated length's mean.

    Raises:
        InputError: A body is not as long as the arm's part.
    """
    lengths: dict[str, float] = {p.length: p.sections[-1].end for p in profiles}
    for body in bodies:
        if body.name in lengths and abs(lengths[body.name] - body.length) > 1e-9:
            raise InputError(
                f"{key}.body: '{body.name}' is {body.length / MM:g} mm, the arm's is {lengths[body.name] / MM:g} mm"
            )
    return tuple(
        Profile(p.length, p.cte, (Section(0.0, lengths[p.length], p.length, p.length, "linear"),)) for p in profiles
    )


def _bodies(table: sc.NetworkTable) -> tuple[Body, ...]:
    return tuple(
        Body(
            name=b.name,
            length=b.length_mm * MM,
            volumes=b.volumes,
            capacity=b.mass_kg * b.heat_capacity_J_kgK,
            conductance=b.conductance_W_mm_K * MM,
            film=b.film_W_K,
        )
        for b in table.body
    )


def _housings(table: sc.NetworkTable) -> tuple[Housing, ...]:
    return tuple(
        Housing(
            name=h.name,
            capacity=h.mass_kg * h.heat_capacity_J_kgK,
            film=h.film_W_K,
            inward=h.inward_W_K,
            outward=h.outward_W_K,
            drives=tuple(d - 1 for d in h.drives),
        )
        for h in table.housing
    )


def _drives(table: sc.NetworkTable, robot: Robot, gravity: Sequence[float]) -> Drives:
    return Drives(
        rated_power=np.array(table.rated_W),
        rated_speed=robot.speed,
        holding=table.loss.holding,
        coulomb=table.loss.coulomb,
        viscous=table.loss.viscous,
        link_mass=np.array(table.link_kg),
        link_centre=np.array(table.link_centre_mm) * MM,
        payload_mass=table.payload_kg,
        payload_centre=np.array(table.payload_centre_mm) * MM,
        down=np.array(gravity) / (np.linalg.norm(gravity) or 1.0),
    )


def _named_rises(
    table: sc.NetworkTable,
    volumes: Volumes,
    bodies: Sequence[Body],
    rows: Mapping[str, int],
    heated: Sequence[str],
    key: str,
) -> tuple[list[str], list[Array]]:
    """Names of the rises, and what each takes from the volumes (V,): probes, then means of the base and of what grows.

    Raises:
        InputError: A probe of no part, or two rises of one name.
    """
    probes, names = [], []
    for i, probe in enumerate(table.probe):
        if probe.part not in rows:
            raise InputError(f"{key}.probe.{i}.part: '{probe.part}' is unknown{suggest(probe.part, list(rows))}")
        candidates = np.flatnonzero(volumes.part == rows[probe.part])
        weight = np.zeros(len(volumes.part))
        weight[candidates[int(np.argmin(np.abs(volumes.place[candidates] - (probe.at_mm or 0.0) * MM)))]] = 1.0
        probes.append(weight)
        names.append(probe.name)
    for body in bodies:
        if body.name in heated or body.name == "base":
            inside = volumes.part == rows[body.name]
            probes.append(inside / inside.sum())
            names.append(body.name)
    if len(set(names)) < len(names):
        raise InputError(f"{key}.probe: two rises have one name among {', '.join(names)}; rename a probe")
    return names, probes


def growth_of(robot: Robot, names: Sequence[str], reference: Array, profiles: Sequence[Profile]) -> tuple[Array, Array]:
    """Growth of each DH length per kelvin of each named rise, a and d, (6, K) [m/K]; away from zero."""
    rises = dict(zip(names, reference.tolist(), strict=True))
    growth = {"a": np.zeros((6, len(names))), "d": np.zeros((6, len(names)))}
    for profile in profiles:
        parameter, row = DH_LENGTHS[profile.length]
        sign = -1.0 if dh_length(robot, profile.length) < 0 else 1.0
        growth[parameter][row] += sign * growth_weights(profile, rises, list(names))
    return growth["a"], growth["d"]
