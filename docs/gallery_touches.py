"""Writes docs/gallery/touches.csv: what a probe would find at the gallery's spheres on a day that went otherwise.

    python docs/gallery_touches.py

The robot worked for four hours and a half instead of the six that the path file says. Its arm is the robot file's own,
each sphere's centre is located twice, with 12 um of noise a coordinate.
"""

import tomllib
from pathlib import Path

import numpy as np

import compgen
from compgen.core.pose import Pose
from compgen.core.units import MM
from compgen.pipelines.planned import generate
from compgen.robot import inverse_kinematics

HERE = Path(__file__).parent
HOURS, NOISE_UM, SEED = 4.5, 12, 0
HEADER = "target,x_mm,y_mm,z_mm,w_deg,p_deg,r_deg,config"


def touches() -> str:
    """The file's text."""
    artefact = tomllib.loads((HERE / "gallery" / "artefact.toml").read_text())
    probe = {f"tool.{axis}_mm": artefact["probe"][f"{axis}_mm"] for axis in "xyz"}
    job = compgen.load_job(
        str(HERE.parent / "paths" / "spiral_1300.toml"),
        overrides={"before.0.duration_h": HOURS, "path.z_mm": 0, **probe},
    )
    planned = generate.predict(job, lambda stage, share: None)
    centre = np.array([[sphere[f"{axis}_mm"] for axis in "xyz"] for sphere in artefact["sphere"] * 2]) * MM
    target = Pose(centre, np.broadcast_to(planned.path.target.rotation[0], (len(centre), 3, 3)))
    flange = inverse_kinematics.flange_from_tool(target, job.tool.pose)
    theta, _ = inverse_kinematics.solve_flange(job.robot, flange, inverse_kinematics.Posture())
    error = planned.model.error(theta, np.tile(job.start_rise(), (len(centre), 1)), target)[:, :3]
    noise = np.random.default_rng(SEED).normal(0, NOISE_UM * 1e-6, centre.shape)
    rows = [
        f'{sphere["name"]},{x:.3f},{y:.3f},{z:.3f},180.000,0.000,0.000,"N U T, 0, 0, 0"'
        for sphere, (x, y, z) in zip(artefact["sphere"] * 2, (centre - error + noise) / MM, strict=False)
    ]
    words = " ".join((__doc__ or "").split("\n\n")[-1].split())
    return "\n".join([f"# simulated by docs/gallery_touches.py. {words}", HEADER, *rows, ""])


if __name__ == "__main__":
    (HERE / "gallery" / "touches.csv").write_text(touches())
