"""The table beside the program, row n for P[n], as columns of numbers."""

import numpy as np

from audit import study
from audit.listing import UnreadableError

COLUMNS = {
    "time": ["time_s"],
    "position": [f"{a}_mm" for a in "xyz"],
    "before": [f"before_d{a}_um" for a in "xyz"],
    "after": [f"after_d{a}_um" for a in "xyz"],
    "rise": [f"rise_{n}_K" for n in study.NODES],
    "band": [f"band_{a}_um" for a in "xyz"],
    "contact": ["contact"],
    "joints": [f"j{i}_deg" for i in range(1, 7)],
}


def read_waypoints(folder, count):
    """Times (N,) [s], contact (N,), and the others (N, columns) in the units of their names."""
    try:
        with (folder / "waypoints.csv").open() as file:
            names = file.readline().strip().split(",")
            rows = np.loadtxt(file, delimiter=",", ndmin=2)
    except (OSError, ValueError) as problem:
        raise UnreadableError(f"waypoints.csv: {problem}") from None
    if missing := {name for wanted in COLUMNS.values() for name in wanted} - set(names):
        raise UnreadableError(f"waypoints.csv: no column {', '.join(sorted(missing))}")
    if rows.shape != (count, len(names)):
        raise UnreadableError(f"waypoints.csv: {rows.shape[0]} rows of {rows.shape[1]} for {count} positions")
    table = {key: rows[:, [names.index(name) for name in wanted]] for key, wanted in COLUMNS.items()}
    return {**table, "time": table["time"][:, 0], "contact": table["contact"][:, 0] > 0}
