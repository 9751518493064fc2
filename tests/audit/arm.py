"""The arm that is audited: the study's, whose constants are typed, or one that a robot file says was identified.

Of a robot file it takes what was measured: error sources, heat law, how well both are known together, and what is not
known. What the arm is otherwise stays typed (``study``), and a file of another arm is not judged.
"""

import json
import tomllib
from copy import deepcopy
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from re import fullmatch
from typing import Any

import numpy as np
from naive_arm import dh_angles, growth_of_rises
from naive_errors import SIX, flange_poses, torques, turned_joints

from audit import heat, poses, study
from audit.scope import NotJudgedError

JOINT_TABLES = ("joint_zeros", "joint_coupling", "compliance", "gear_harmonics", "joint_ripple", "hysteresis")
CHAIN_TABLES = ("thermal_growth", "link_offsets", "thermal_bend", "thermal_shift")
BEYOND = ("base_frame", "tool_frame", "map")  # sources without an oracle in the band
TURN = 1e-6  # [rad] over which slopes with joints are differenced


@dataclass(frozen=True, kw_only=True)
class Arm:
    """What makes an arm err, how it warms, and how well that is known; K nodes, P identified numbers."""

    law: heat.Heat
    law_K: np.ndarray  # (K,) of nodes' rises
    sensors_K: float = study.SENSORS_K
    air_K: float = study.AIR_K
    feed: float = study.FEED
    missing: float = study.MISSING
    cte_open: tuple | None = study.CTE_OPEN_1_K  # None: a warm-up was measured
    sources: dict  # tables of the robot file
    names: tuple = ()  # (P,) table, key, index
    sigma: np.ndarray | None = None  # (P,) in the keys' units
    correlation: np.ndarray | None = None  # (P, P)
    noise_mm: float = 0.0  # of the fit, along any direction
    repeatability_mm: float = 0.0
    scale: float = 1.0
    unknown: dict  # of the file: what, its size [um]

    @property
    def width(self):
        """How far joints turn to be on the other side, (6,) [rad]; None without play."""
        lash = self.sources.get("hysteresis")
        return None if lash is None else np.radians(np.array(lash["width_mdeg"]) / 1e3)


def of_study():
    """The study's arm, which warms and has no other error."""
    return Arm(law=heat.fitted(), law_K=np.full(5, study.LAW_K), sources={}, unknown=study.UNKNOWN_UM)


def of_file(file, hashed):
    """The arm of a robot file that identification wrote.

    Args:
        file: The robot file.
        hashed: Its sha256, as the output has it.

    Raises:
        NotJudgedError: Not that file, not this arm, or with what the audit has no oracle for.
    """
    try:
        content = file.read_bytes()
        table = tomllib.loads(content.decode())
    except (OSError, ValueError) as problem:
        raise NotJudgedError(f"{file}: {problem}; give the robot file of this output as third argument") from None
    if sha256(content).hexdigest() != hashed:
        raise NotJudgedError(f"{file}: not the robot file that this output was made with (another sha256)")
    thermal, found, sources = table["thermal"], table.get("identified", {}), table.get("sources", {})
    _refuse(file, table, sources)
    names, sigma, correlation = _posterior(file, found)
    if loose := {t for t in sources if "sigma" in sources[t]} - {n[0] for n in names}:
        raise NotJudgedError(f"{file}: sources.{min(loose)}: not judged; its sigma stands in no posterior")
    if silent := set(sources) & {*JOINT_TABLES, *CHAIN_TABLES[1:]} - {n[0] for n in names}:
        raise NotJudgedError(f"{file}: sources.{min(silent)}: not judged without sigma; the audit knows no priors")
    open_, nodes = thermal.get("uncertainty", {}), {n["name"]: n for n in thermal["node"]}
    each = [nodes[name] for name in study.NODES]
    missing, is_warm = found.get("thermal_missing_percent"), any(n[0] == "thermal_growth" for n in names)
    law = heat.Heat(
        np.array([n["tau_h"] for n in each]) * 3600.0,
        np.array([n["exponent"] for n in each]),
        tuple(float(n["rise_K"]) for n in each),
    )
    return Arm(
        law=law,
        law_K=np.array([n.get("law_K", open_["law_K"]) for n in each]),
        sensors_K=open_["sensors_K"],
        air_K=open_["air_K"],
        feed=open_["feed_percent"] / 100,
        missing=(open_["missing_percent"] if missing is None else missing) / 100,
        cte_open=study.CTE_OPEN_1_K if missing is None and not is_warm else None,
        sources=sources,
        names=names,
        sigma=sigma,
        correlation=correlation,
        noise_mm=found.get("fit_noise_um", 0.0) / 1e3,
        repeatability_mm=found.get("repeatability_um", 0.0) / 1e3,
        scale=found.get("forecast_scale", 1.0),
        unknown=_unknown(table, names),
    )


def _refuse(file, table, sources):
    thermal, dh = table["thermal"], table["dh"]
    as_typed: dict[str, tuple[Any, Any]] = {
        "dh.d_mm": (dh["d_mm"], study.D_MM),
        "dh.a_mm": (dh["a_mm"], study.A_MM),
        "thermal.cte_um_m_K": (thermal["cte_um_m_K"], study.CTE_1_K * 1e6),
        "thermal.reference_h": (thermal["reference_h"], study.REFERENCE_S / 3600),
        "thermal.reference_feed_mm_s": (thermal["reference_feed_mm_s"], study.REFERENCE_FEED_MM_S),
        "thermal.idle_fraction": (thermal["idle_fraction"], study.IDLE),
    }
    for key, (own, typed) in as_typed.items():
        if not np.array_equal(own, typed):
            raise NotJudgedError(f"{file}: {key}: not judged; the audit knows the study's arm, {typed}")
    if "motion" in table or "anchor" in table or thermal.get("model", "nodes") != "nodes":
        raise NotJudgedError(f"{file}: not judged with [motion], [anchor] or another heat model than nodes")
    for name in BEYOND:
        if name in sources:
            raise NotJudgedError(f"{file}: sources.{name}: not judged; the audit has no oracle for it")
    if "gravity_m_s2" in sources.get("loads", {}):
        raise NotJudgedError(f"{file}: sources.loads.gravity_m_s2: not judged; the audit's arm stands upright")


def _posterior(file, found):
    """What identification knows together: names (P,), sigma (P,) in the units of the keys, and correlation (P, P)."""
    if not found.get("posterior"):
        raise NotJudgedError(f"{file}: not judged without identified.posterior; the audit takes sigmas from it alone")
    content = (file.parent / found["posterior"]).read_bytes().replace(b"\r\n", b"\n")
    if sha256(content).hexdigest() != found["posterior_sha256"]:
        raise NotJudgedError(f"{found['posterior']}: not the posterior that {file} names (another sha256)")
    record, names = json.loads(content), []
    for row in record["parameters"]:
        name = fullmatch(r"(\w+)\.(\w+)\[(\d+)(?:,(\d+))?\]", row["name"])
        if name is None or name[1] not in (*JOINT_TABLES, *CHAIN_TABLES):
            raise NotJudgedError(f"{row['name']}: not judged; the audit has no oracle for it")
        names.append((name[1], name[2], tuple(int(n) - 1 for n in name.groups()[2:] if n)))
    sigma, P = np.array([row["sigma"] for row in record["parameters"]]), len(names)
    lower = np.zeros((P, P))
    lower[np.tril_indices(P)] = np.concatenate(record["correlation"])
    return tuple(names), sigma, lower + np.tril(lower, -1).T


def _unknown(table, names):
    """Rows of the file, but for those that its identification ended."""
    tables = {name[0] for name in names}
    ended = {"geometry"} if tables & {"link_offsets", "joint_zeros"} else set()
    ended |= {"lost motion"} if "hysteresis" in tables else set()
    ended |= {"repeatability"} if "repeatability_um" in table["identified"] else set()
    rows = [row for row in table.get("unknown", []) if row.get("until") not in ended]
    return {row["what"]: tuple(row["size_um"]) if "size_um" in row else None for row in rows}


@dataclass(frozen=True)
class Spots:
    """M places where an arm stands with a tool."""

    arm: Arm
    pendant: np.ndarray  # (M, 6) [rad] commanded
    side: np.ndarray  # (M, 6) from which joints have come
    rise: np.ndarray  # (M, K) [K]
    tool: tuple  # position (3,) [mm] and rotation of the TCP in the flange
    turned: np.ndarray | None = None  # (M, 6) what joints' own widths do to the sides, relative

    def pose(self, rise=None, **more):
        """Where the tool centre point is, as things are or at other rises or with other sources or turned joints."""
        return poses.tool_centre(self.flange(rise, **more), self.tool)

    def flange(self, rise=None, sources=None, turn=0.0, without=None):
        """Where the flange is; ``turn`` (6,) [rad] is added to joints, the length ``without`` does not grow."""
        sources, rise = self.arm.sources if sources is None else sources, self.rise if rise is None else rise
        growth = growth_of_rises(rise, self.arm.law.reference)
        if without is not None:
            growth[:, without] = 0.0
        real = dh_angles(self.pendant) + self.joints_off(sources) + turn
        by_node = dict(zip(study.NODES, rise.T, strict=True))
        return poses.of_matrices(flange_poses(real, by_node, growth, sources))

    def joints_off(self, sources, side=None):
        """By how much joints are off, (M, 6) [rad]."""
        return turned_joints(dh_angles(self.pendant), self.load, self.side if side is None else side, sources)

    @cached_property
    def load(self):
        """Torque about each joint, (M, 6) [N m]."""
        tool = np.eye(4)
        tool[:3, :3], tool[:3, 3] = self.tool[1], self.tool[0]
        return torques(dh_angles(self.pendant), self.arm.sources.get("loads", {}), tool)

    def warmed(self):
        """What a kelvin of each node does, (M, 3, K) [mm/K]."""
        here = self.pose()[0]
        return np.stack([self.pose(self.rise + k)[0] - here for k in np.eye(len(study.NODES))], axis=2)

    def identified(self):
        """What one unit of each identified number does, (M, 3, P) [mm], in the units of the keys."""
        off, out = self.joints_off(self.arm.sources), np.zeros((len(self.pendant), 3, len(self.arm.names)))
        by_joint = self.by_joint()
        assert self.arm.sigma is not None
        for n, (name, step) in enumerate(zip(self.arm.names, self.arm.sigma, strict=True)):
            if step == 0:
                continue
            changed = self._changed(name, step)
            if name[1] == "width_mdeg":
                i = name[2][0]
                width = self.arm.sources["hysteresis"]["width_mdeg"][i]
                out[:, :, n] = self.of_widths(by_joint)[:, :, i] / width
            elif name[0] in JOINT_TABLES:
                out[:, :, n] = np.einsum("mij,mj->mi", by_joint, (self.joints_off(changed) - off) / step)
            else:
                other = self._changed(name, -step)
                out[:, :, n] = (self.pose(sources=changed)[0] - self.pose(sources=other)[0]) / (2 * step)
        return out

    def by_joint(self):
        """What a radian of each joint does, (M, 3, 6) [mm/rad]."""
        ends = [[self.pose(turn=s * TURN * e)[0] for s in (1, -1)] for e in np.eye(6)]
        return np.stack([(high - low) / (2 * TURN) for high, low in ends], axis=2)

    def of_widths(self, by_joint):
        """What a longer width of each joint does, relative, (M, 3, 6) [mm]."""
        if self.turned is None:
            return np.zeros_like(by_joint)
        sources = self.arm.sources
        off = self.joints_off(sources)
        per_side = self.joints_off(sources, self.side + 1.0) - off  # of each joint by its own side
        return by_joint * (per_side * self.turned)[:, None, :]

    def _changed(self, name, step):
        """The sources with one number changed."""
        table, key, index = name
        own = deepcopy(self.arm.sources[table])
        values = own.setdefault(key, list(SIX))
        for i in index[:-1]:
            values = values[i]
        values[index[-1]] += step
        return {**self.arm.sources, table: own}
