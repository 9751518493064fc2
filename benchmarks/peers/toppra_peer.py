"""Time-optimal timing of the joint path on a grid; answers seconds a grid point."""

import json
import sys

import numpy as np
import toppra as ta
import toppra.algorithm as algo
import toppra.constraint as constraint
from clock import median

ta.setup_logging("ERROR")
question = json.load(sys.stdin)
s, q = np.array(question["arc"]), np.array(question["path"])
speed, acceleration = np.array(question["speed"]), np.array(question["acceleration"])


def timed():
    """The squared path speed at the grid."""
    path = ta.SplineInterpolator(s, q)
    limits = [
        constraint.JointVelocityConstraint(np.column_stack([-speed, speed])),
        constraint.JointAccelerationConstraint(np.column_stack([-acceleration, acceleration])),
    ]
    return algo.TOPPRA(limits, path, gridpoints=s).compute_parameterization(0, 0)


if timed() is None:
    raise SystemExit("found no timing")
print(json.dumps({"timing": median(timed) / len(s)}))
