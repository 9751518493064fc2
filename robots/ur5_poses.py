"""Turn the published UR5 data set (see docs/identify.md) into pose files that ``cgen identify`` reads.

    python robots/ur5_poses.py FOLDER [N]

writes ``ur5_train.csv`` (N poses of the grid, those that ``default_rng(3).permutation(1000)[:N]`` draws; all without N)
and ``ur5_test.csv`` (the 20 random poses). The data set's measured place is its target plus its difference; joints are
the commanded ones.
"""

import sys
from pathlib import Path

import numpy as np

HEADER = "order,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm"
GRID, RANDOM = "3D_UR5_uncalibrated_grid_cleaned.csv", "3D_UR5_uncalibrated_random_cleaned.csv"


def converted(source: Path, count: int | None = None) -> str:
    """One of the published files as a pose file."""
    rows = np.genfromtxt(source, delimiter=",", skip_header=1)
    if count is not None:
        rows = rows[np.sort(np.random.default_rng(3).permutation(len(rows))[:count])]
    lines = [HEADER]
    for row in rows:
        joints, place = row[7:13], row[1:4] + row[4:7]
        lines.append(",".join([f"{row[0]:.0f}", *(f"{v:.6f}" for v in joints), *(f"{v:.4f}" for v in place)]))
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    Path("ur5_train.csv").write_text(converted(folder / GRID, int(sys.argv[2]) if len(sys.argv) > 2 else None))
    Path("ur5_test.csv").write_text(converted(folder / RANDOM))
