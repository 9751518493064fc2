"""Commands that measure an arm, as a user starts them: processor seconds of a process from start to end."""

import statistics
import tempfile
from pathlib import Path

import numpy as np

from benchmarks import whole
from benchmarks.identification import problem
from compgen.core.units import DEG, MM
from compgen.pipelines.files.robot_file import load_arm

ROOT = Path(__file__).parent.parent
GALLERY = ROOT / "docs" / "gallery"
PATH = "paths/spiral_1300.toml"
PARAMETERS = 60  # of the arm that is identified


def spent(cache: Path, poses: int, rounds: int) -> dict[str, float]:
    """Median processor seconds by command: measurements planned, an arm identified, touches planned, it is anchored.

    Args:
        cache: Where compiled code is kept.
        poses: That are planned, a third of those that are identified.
        rounds: The first warms, unless it is the only one.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "poses.csv").write_text(measured_poses(3 * poses))
        artefact = ("--artefact", str(GALLERY / "artefact.toml"))
        calls = {
            f"plan-poses -n {poses}": ("plan-poses", "m710ic50", "-n", str(poses), "-o", str(folder / "plan")),
            f"identify, {3 * poses} poses x 3": (
                *("identify", "m710ic50", "--poses", str(folder / "poses.csv")),
                *("-o", str(folder / "robot.toml")),
            ),
            "plan-touches -n 8": ("plan-touches", PATH, *artefact, "-o", str(folder / "touches")),
            "anchor": (
                *("anchor", PATH, "--touches", str(GALLERY / "touches.csv"), *artefact),
                *("-o", str(folder / "state.toml")),
            ),
        }
        return {what: _seconds(cache, call, rounds) for what, call in calls.items()}


def _seconds(cache: Path, call: tuple[str, ...], rounds: int) -> float:
    verdicts = (0, 1)  # no is an answer, too; a refusal is none
    seconds = [whole.spent(cache, "-m", "compgen", *call, "-q", answers=verdicts)[0] for _ in range(rounds)]
    return statistics.median(seconds[1:] or seconds)


def measured_poses(poses: int) -> str:
    """What a tracker says of so many poses of a made-up arm, three reflectors each, as ``--poses`` reads it."""
    _, data = problem(PARAMETERS, poses)
    pendant = load_arm("m710ic50").robot.to_pendant(data.theta) / DEG
    rows = ["order,target,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm"]
    for pose, reflector, place in zip(data.pose.tolist(), data.reflector.tolist(), data.position / MM, strict=True):
        numbers = ",".join(f"{value:.4f}" for value in np.concatenate([pendant[pose], place]))
        rows.append(f"{pose},{data.reflectors[reflector]},{numbers}")
    return "\n".join(rows) + "\n"
