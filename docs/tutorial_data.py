"""Makes the files that the tutorials begin with: docs/tutorials/data/, laid down by `cgen init --tutorial NAME`.

python docs/tutorial_data.py
"""

import csv
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import compgen

HERE = Path(__file__).parent
FOLDER = HERE / "tutorials" / "data"

HEADER = """\
/PROG  PASSES
/ATTR
OWNER\t\t= MNEDITOR;
COMMENT\t\t= "RoboDK sequence";
PROG_SIZE\t= 0;
CREATE\t\t= DATE 26-01-12  TIME 08:30:00;
MODIFIED\t= DATE 26-01-12  TIME 08:30:00;
FILE_NAME\t= PASSES;
VERSION\t\t= 0;
LINE_COUNT\t= {lines};
MEMORY_SIZE\t= 0;
PROTECT\t\t= READ_WRITE;
TCD:  STACK_SIZE\t= 0,
      TASK_PRIORITY\t= 50,
      TIME_SLICE\t= 0,
      BUSY_LAMP_OFF\t= 0,
      ABORT_REQUEST\t= 0,
      PAUSE_REQUEST\t= 0;
DEFAULT_GROUP\t= 1,*,*,*,*;
CONTROL_CODE\t= 00000000 00000000;
/MN
"""


def passes() -> str:
    """A program in the style of RoboDK's FANUC post: eight passes over a plate, seven points on each.

    Home is a position register, the spindle is switched by digital outputs, and each pass is 20 mm beside the last.
    """
    places = [(x, y) for row, y in enumerate(range(-70, 71, 20)) for x in _along(row % 2 == 1)]
    ends = (2, len(places) + 1)  # P[1] and the last are above the part
    statements = [
        *("UFRAME_NUM=1 ;", "UTOOL_NUM=1 ;", "J PR[1:HOME] 20% FINE ;", "J P[1] 20% FINE ;"),
        *("DO[1:SPINDLE]=ON ;", "WAIT    .50(sec) ;"),
        *(f"L P[{n}] 80mm/sec {'FINE' if n in ends else 'CNT100'} ;" for n in range(ends[0], ends[1] + 1)),
        *("DO[1:SPINDLE]=OFF ;", f"L P[{ends[1] + 1}] 200mm/sec FINE ;", "J PR[1:HOME] 20% FINE ;"),
    ]
    body = "".join(f"{n:4}:{'' if line[1] == ' ' else '  '}{line}\n" for n, line in enumerate(statements, 1))
    (first, last) = places[0], places[-1]
    points = [(*first, 60.0), *((x, y, 0.0) for x, y in places), (*last, 60.0)]
    positions = "".join(_position(n, point) for n, point in enumerate(points, 1))
    return HEADER.format(lines=len(statements)) + body + "/POS\n" + positions + "/END\n"


def _along(back: bool) -> list[int]:
    """Where the points of a pass are along it [mm]."""
    forth = list(range(-360, 361, 120))
    return forth[::-1] if back else forth


def _position(n: int, point: tuple[float, float, float]) -> str:
    x, y, z = (f"{value:9.3f}" for value in point)
    return (
        f"P[{n}]{{\n   GP1:\n    UF : 1, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n"
        f"    X ={x}  mm,\tY ={y}  mm,\tZ ={z}  mm,\n"
        "    W =  180.000 deg,\tP =    0.000 deg,\tR =    0.000 deg\n};\n"
    )


FRAMES = """\
# The frames of the cell, as the pendant shows them: MENU, SETUP, Frames.
[uframe.1]
x_mm = 1250
y_mm = -50
z_mm = 150
w_deg = 0
p_deg = 0
r_deg = 90

[utool.1]
x_mm = 0
y_mm = 0
z_mm = 120
w_deg = 0
p_deg = 0
r_deg = 0
"""


#: the arm that was "measured": what it has other than the robot file, by joint or DH row
TRUE_ZERO_MDEG = (0, 18, -24, 30, 0, 0)
TRUE_D_UM = (0, 0, 0, -300, 0, 0)
TRUE_A_UM = (0, 400, 0, 0, 0, 0)
TRUE_BETA_MDEG = (0, -12, 0, 0, 0, 0)  # J3's axis against J2's
REFLECTORS_MM = {"r1": (60, 0, 120), "r2": (-60, 50, 120)}
#: where the tracker stands: turned by 0.4 rad about z, and moved
TRACKER_TURN, TRACKER_MM = 0.4, (2500.0, -1800.0, -400.0)
NOISE_UM = 25.0
WILD_ROW, WILD_UM = 33, 800.0  # a reflector that was bumped, and set back


PLAN = (
    *("plan-poses", "m710ic50", "-n", "50", "--box", "900 -700 -100 1700 700 500"),
    *("--reflector", "60 0 120", "--reflector", "-60 50 120", "--range", "0.7", "--no-reversals"),
)


def measurements(poses: Sequence[Sequence[float]], seed: int, wild: bool) -> str:
    """What a tracker says of poses (pendant, deg) of an arm other than the robot file: places of two reflectors.

    In numpy of its own, T = prod Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta), with the robot file's facts alone.
    """
    robot, rng = compgen.load_robot("m710ic50"), np.random.default_rng(seed)
    rows = ["order,target,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm"]
    tracker = _turn("z", TRACKER_TURN)
    for n, pendant in enumerate(poses):
        flange = _true_flange(robot, robot.to_theta(np.radians([pendant]))[0])
        for name, place in REFLECTORS_MM.items():
            seen = tracker.T @ (flange[:3, 3] * 1000 + flange[:3, :3] @ np.array(place) - TRACKER_MM)
            seen += rng.normal(scale=NOISE_UM / 1000, size=3)
            if wild and len(rows) == WILD_ROW:
                seen[2] += WILD_UM / 1000
            angles = ",".join(f"{angle:.3f}" for angle in pendant)
            rows.append(f"{n},{name},{angles},{','.join(f'{value:.4f}' for value in seen)}")
    return "\n".join(rows) + "\n"


def planned_poses() -> list[list[float]]:
    """The poses that `cgen plan-poses` chooses in the tutorial (pendant, deg)."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, "-m", "compgen", *PLAN, "-q", "-o", folder], check=True)
        return poses_of(Path(folder) / "poses.csv")


def poses_of(file: Path) -> list[list[float]]:
    """The poses of a file of measurements (pendant, deg), each once."""
    with file.open() as lines:
        rows = [row for row in csv.DictReader(lines) if row["target"] == "r1"]
    return [[float(row[f"j{i}_deg"]) for i in range(1, 7)] for row in rows]


def other_poses(count: int) -> list[list[float]]:
    """Poses over the place of work that nobody planned (pendant, deg)."""
    rng = np.random.default_rng(3)
    low, high = np.array([-40, -30, -50, -120, 30, -150]), np.array([40, 35, 5, 120, 105, 150])
    poses = np.round(rng.uniform(low, high, (count, 6)), 3)
    poses[:, 4] *= rng.choice([-1, 1], count)
    return poses.tolist()


def _true_flange(robot: Any, theta: np.ndarray) -> np.ndarray:
    """The flange of the true arm in World, (4, 4), lengths in m."""
    theta = theta + np.radians(np.array(TRUE_ZERO_MDEG) / 1000)
    d, a = robot.d + np.array(TRUE_D_UM) * 1e-6, robot.a + np.array(TRUE_A_UM) * 1e-6
    pose = np.eye(4)
    for i in range(6):
        row = np.eye(4)
        turn = _turn("z", theta[i])
        row[:3, 3] = turn @ [a[i], 0, d[i]]
        row[:3, :3] = turn @ _turn("x", robot.alpha[i]) @ _turn("y", np.radians(TRUE_BETA_MDEG[i] / 1000))
        pose = pose @ row
    return pose


def _turn(axis: str, angle: float) -> np.ndarray:
    """The rotation about an axis."""
    c, s = np.cos(angle), np.sin(angle)
    if axis == "x":
        return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    if axis == "y":
        return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def files(planned: list[list[float]]) -> dict[str, str]:
    """Each file by its path in docs/tutorials/data/, measured at the planned poses."""
    return {
        "robodk/PASSES.LS": passes(),
        "robodk/frames.toml": FRAMES,
        "identify_my_robot/cold.csv": measurements(planned, seed=1, wild=True),
        "identify_my_robot/fresh.csv": measurements(other_poses(15), seed=2, wild=False),
    }


def main() -> None:
    """Write them."""
    for name, text in files(planned_poses()).items():
        (FOLDER / name).parent.mkdir(parents=True, exist_ok=True)
        (FOLDER / name).write_text(text)


if __name__ == "__main__":
    main()
