"""A robot file as identification leaves it, with some of everything, and a part whose frame that robot taught.

Nothing is fitted: values and covariance are drawn by a fixed seed, touches are laid around the part by the second arm.
"""

import json
from hashlib import sha256
from typing import Any

import naive_arm
import numpy as np

PROBE_MM = (12.0, -8.0, 150.0)
PLACE = (1250.0, -30.0, 40.0, 0.4, -0.3, 2.0)
WARM = {"j2": 8.0, "link1": 2.5, "j3": 9.0, "wrist": 2.0, "face": 1.6}
LOADS = """
[sources.loads]
link_kg = [120, 70, 80, 25, 15, 5]
link_centre_mm = [[75, 0, -150], [20, 10, 400], [100, 0, 120], [300, 0, 0], [60, 0, 0], [20, 0, 0]]
payload_kg = 34
payload_centre_mm = [10, 0, 150]
"""
#: table: facts, and by key the shape of its values, their size, how well they are known
SOURCES: dict[str, tuple[dict[str, Any], dict[str, tuple[Any, Any, Any]]]] = {
    "thermal_growth": ({}, {"excess_a": ((6,), 0.1, 0.05), "excess_d": ((6,), 0.1, 0.05)}),
    "link_offsets": (
        {},
        {"d_um": ((6,), 200, 12), "a_um": ((6,), 200, 12), "alpha_mdeg": ((6,), 20, 2), "beta_mdeg": ((6,), 20, 2)},
    ),
    "joint_zeros": ({}, {"offset_mdeg": ((6,), 20, 2)}),
    "joint_coupling": ({}, {"ratio_ppm": ((6, 6), 50, 10)}),
    "compliance": ({}, {"compliance_urad_Nm": ((6,), 0.3, 0.1), "hardening_nrad_Nm2": ((6,), 0.05, 0.05)}),
    "gear_harmonics": (
        {"cycles": [1, 1, 1, 2, 1, 1]},
        {"sine_mdeg": ((6, 2), 2, 1), "cosine_mdeg": ((6, 2), 2, 1)},
    ),
    "joint_ripple": ({"order": [3, 17]}, {"sine_mdeg": ((6, 2), 0.1, 0.1), "cosine_mdeg": ((6, 2), 0.1, 0.1)}),
    "hysteresis": (
        {"law": "dahl"},
        {"backlash_mdeg": ((6,), 2, 0.4), "windup_urad_Nm": ((6,), 0.003, 0.005), "width_mdeg": ((6,), None, 60)},
    ),
    "thermal_bend": (
        {"link": ["column", "a1", "a2", "a3", "d4", "d4"], "plane": ["x", "arm", "side", "arm", "side", "twist"],
         "node": ["j2", "j2", "link1", "j3", "j3", "wrist"], "column_mm": 400},
        {"rate_arcsec_K": ((6,), 0.8, 0.6)},
    ),
    "thermal_shift": (
        {"of": ["d1", "base y", "a3", "d4"], "node": ["j2", "j2", "j3", "wrist"]},
        {"rate_um_K": ((4,), 2, 1.5)},
    ),
}  # fmt: skip
SHARED = 6  # directions in which the numbers are known together
TOUCHED = [(x, y, z, t) for x, y, z in ((60, 50, 0), (-60, 40, 8), (-50, -60, 0), (55, -50, 12)) for t in (-1, 1)]
PATH = """title = "a circle on a taught part"
robot = "m710ic50"
[path]
pattern = "circle"
diameter_mm = {diameter}
x_mm = 0
y_mm = 0
z_mm = 0
[frame]
file = "{frame}.toml"
[tool]
number = 1
x_mm = {tool[0]}
y_mm = {tool[1]}
z_mm = {tool[2]}
[process]
feed_mm_s = 100
[[before]]
state = "moving"
feed_mm_s = 150
duration_h = 2
[bounds]
max_um = 10
"""


def write(folder, shipped):
    """Path files, frames and a robot file ``own.toml`` in a folder, of the shipped robot file's text."""
    robot = identified(folder, shipped)
    for name, text in (("taught", robot), ("shipped", shipped)):
        hashed = sha256(text.encode()).hexdigest()
        (folder / f"frame_{name}.toml").write_text(frame(hashed))
        (folder / f"{name}.toml").write_text(PATH.format(diameter=40, frame=f"frame_{name}", tool=PROBE_MM))
    elsewhere = frame("0" * 64).replace("[[", "# no touches\n[[", 1)
    (folder / "frame_elsewhere.toml").write_text(elsewhere)
    (folder / "elsewhere.toml").write_text(PATH.format(diameter=40, frame="frame_elsewhere", tool=(0.0, 5.0, 120.0)))


def identified(folder, shipped):
    """The text of ``own.toml``, which stands in the folder with its posterior."""
    rng, rows, tables = np.random.default_rng(28), [], [LOADS]
    for name, (facts, keys) in SOURCES.items():
        lines = [f"{key} = {json.dumps(value)}" for key, value in facts.items()]
        for key, (shape, size, sigma) in keys.items():
            values = np.full(shape, 200.0) if size is None else rng.normal(0, size, shape).round(4)
            if name == "link_offsets" and key in ("beta_mdeg", "d_um"):
                values[[0, 2, 3, 4, 5] if key == "beta_mdeg" else [0, 1, 5]] = 0
            lines.append(f"{key} = {values.tolist()}")
            for index in np.ndindex(shape):
                if values[index]:
                    at = ",".join(str(i + 1) for i in index)
                    rows.append({"name": f"{name}.{key}[{at}]", "value": values[index], "sigma": sigma})
        known = next(key for key in keys)
        tables.append(f"[sources.{name}]\n" + "\n".join(lines) + f"\nsigma = {{ {known} = {keys[known][2]} }}\n")
    together = rng.normal(0, 0.5, (len(rows), SHARED))
    covariance = together @ together.T + np.eye(len(rows))
    scale = 1 / np.sqrt(np.diag(covariance))
    correlation = (covariance * np.outer(scale, scale)).round(7)
    lower = [[*row[:n].tolist(), 1.0] for n, row in enumerate(correlation)]
    posterior = json.dumps({"robot": "m710ic50", "parameters": rows, "correlation": lower})
    (folder / "own.posterior.json").write_text(posterior)
    record = (
        '[identified]\nmodel = "drawn"\nfit_noise_um = 7\nthermal_missing_percent = 4\nforecast_scale = 1.1\n'
        f'repeatability_um = 5\nposterior = "own.posterior.json"\n'
        f'posterior_sha256 = "{sha256(posterior.encode()).hexdigest()}"\nreflector_mm = {{ r1 = [0, 0, 100] }}\n'
    )
    text = shipped + record + "".join(tables)
    (folder / "own.toml").write_text(text)
    return text


def frame(hashed):
    """The file of a frame that a robot file taught, warm, by four spheres."""
    part, probe = naive_arm.frame(*PLACE), naive_arm.frame(*PROBE_MM, 0, 0, 0)
    keys = ("x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg")
    lines = ["[frame]", "number = 1", *(f"{k} = {v}" for k, v in zip(keys, PLACE, strict=True))]
    lines += ["[frame.taught]", 'through = "model"', f'robot_file = "m710ic50 {hashed[:16]}"']
    lines += ["rise_K = {" + ", ".join(f"{k} = {v}" for k, v in WARM.items()) + "}"]
    lines += ["sigma_um = [9, 14, 7]", "sigma_mdeg = [4, 3, 6]", f"probe_mm = {list(PROBE_MM)}"]
    for x, y, z, tilt in TOUCHED:
        flange = part @ naive_arm.frame(x, y, z, 180 + 9 * tilt, 6 * tilt, 12 * tilt) @ np.linalg.inv(probe)
        joints = naive_arm.pendant_angles(flange[None, :3, 3], flange[None, :3, :3])[0]
        lines += ["[[frame.taught.touches]]", f"joints_deg = {np.degrees(joints).round(4).tolist()}", "noise_um = 9"]
        lines += [f"direction = {[float(tilt), 0.0, 0.5, 0.0, -1.0, 0.0]}"]
    return "\n".join(lines) + "\n"
