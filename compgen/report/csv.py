"""One row a waypoint, row n for P[n]."""

import numpy as np

from compgen.arrays import Array, IntArray
from compgen.pipeline import Corrected, Planned
from compgen.units import DEG, MM, UM


def waypoints_csv(planned: Planned, corrected: Corrected | None) -> bytes:
    """Target, error before and after, rises, contact and commanded pendant angles.

    ``before`` is the prediction at the planned joints; ``after`` is what the twin did with the written text. Without a
    correction the ``after`` columns are empty and the joints are the planned ones.
    """
    path, job = planned.path, planned.job
    trajectory = corrected.trajectory if corrected else planned.trajectory
    theta = corrected.solution.theta if corrected else planned.theta
    count = len(path.arc)
    columns: dict[str, tuple[str, Array | IntArray]] = {"n": ("%d", np.arange(1, count + 1))}

    def add(names: list[str], form: str, values: Array) -> None:
        # rounding first, so that nothing prints as a negative zero
        decimals = int(form[2:-1])
        columns.update({n: (form, v) for n, v in zip(names, (np.round(values, decimals) + 0.0).T)})

    add(["time_s"], "%.6f", trajectory.time[:, None])
    add(["x_mm", "y_mm", "z_mm"], "%.6f", path.position / MM)
    add(["before_dx_um", "before_dy_um", "before_dz_um"], "%.4f", planned.error[:, :3] / UM)
    if corrected:
        add(["after_dx_um", "after_dy_um", "after_dz_um"], "%.4f", at_waypoints(corrected, count) / UM)
    else:
        columns.update({f"after_d{a}_um": ("%.0s", np.zeros(count)) for a in "xyz"})
    add([f"rise_{n}_K" for n in job.heat.names], "%.5f", planned.rise)
    columns["contact"] = ("%d", path.contact.astype(int))
    add([f"j{i}_deg" for i in range(1, 7)], "%.6f", job.robot.to_pendant(theta) / DEG)
    form = ",".join(f for f, _ in columns.values()) + "\n"
    rows = zip(*(v.tolist() for _, v in columns.values()))
    return (",".join(columns) + "\n" + "".join(map(form.__mod__, rows))).encode("ascii")


def at_waypoints(corrected: Corrected, count: int) -> Array:
    """The twin's error at each position, (N, 3) [m]."""
    rows = corrected.leg.first_samples()
    if len(rows) != count:
        raise ValueError("the ride does not sample each position once")
    return np.asarray(corrected.deviation.error[rows])
