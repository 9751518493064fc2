"""Time-optimal timing of the joint path on a grid; answers seconds a grid point and the cycle time."""

import json
import sys
import time

import numpy as np
import toppra as ta
import toppra.algorithm as algo
import toppra.constraint as constraint

ta.setup_logging("ERROR")
question = json.load(sys.stdin)
s, q = np.array(question["arc"]), np.array(question["path"])
speed, acceleration = np.array(question["speed"]), np.array(question["acceleration"])
found = []
for _ in range(6):
    begin = time.process_time()
    path = ta.SplineInterpolator(s, q)
    limits = [
        constraint.JointVelocityConstraint(np.column_stack([-speed, speed])),
        constraint.JointAccelerationConstraint(np.column_stack([-acceleration, acceleration])),
    ]
    instance = algo.TOPPRA(limits, path, gridpoints=s)
    instance.compute_parameterization(0, 0)
    found.append((time.process_time() - begin) / len(s))
print(json.dumps({"timing": float(np.median(found[1:]))}))
