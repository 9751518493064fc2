"""Programs corrected as ``correct`` does it, and how far the second arm then misses the planned places."""

import naive_arm as arm
import naive_heat
import naive_ls
import numpy as np
from ls_text import at, program
from shipped import ROOT, quiet

from compgen.core.pose import IDENTITY
from compgen.pipelines.correct import Options, correct
from compgen.pipelines.correct.program_file import load_before
from compgen.program.frames import Frames, default_frames

SAMPLES = ROOT.parent / "shared" / "fanuc" / "samples"
REAL = sorted(p for p in SAMPLES.rglob("*") if p.is_file() and p.suffix.lower() == ".ls")
GOLDEN = sorted((ROOT / "tests" / "golden").glob("*.LS"))
STILL = IDENTITY
MANY = Frames({n: STILL for n in range(21)}, {n: STILL for n in range(21)})
WARM = "moving 200mm/s 6h"
ROUNDED_UM = 1.0  # three decimals in X, Y, Z: 0.87 um at most; the model itself adds less than 0.1
HOME = (10.0, 20.0, -15.0, 30.0, -60.0, 45.0)


def corrected(data, cell, frames=None, before=(WARM,), **options):
    return correct(data, cell, frames or default_frames(), load_before(before).duties, Options(**options), quiet)


def pose(position, uf=None):
    """A Cartesian position of the second reader as a matrix in World."""
    a = position.groups[1].axes
    return (np.eye(4) if uf is None else uf) @ arm.frame(*(a[k] for k in "XYZWPR"))


def joints(position):
    return [position.groups[1].axes[f"J{i}"] for i in range(1, 7)]


def missed_um(planned, text, n, guess, uf=None, ut=None, lengths=None, other=None):
    """um by which the arm misses the planned place of P[n] when it drives the text, by the second reader and arm."""
    before, after = naive_ls.read(planned)[0][n], naive_ls.read(text)[0][other or n]
    tool = np.eye(4) if ut is None else ut
    if "J1" in before.groups[1].axes:
        meant, q = arm.flange(joints(before)) @ tool, joints(after)
    else:
        meant = pose(before, uf)
        q = arm.joints_at(pose(after, uf) @ np.linalg.inv(tool), guess)
    real = arm.flange(q, lengths or naive_heat.warm_lengths()) @ tool
    return 1e3 * float(np.linalg.norm(real[:3, 3] - meant[:3, 3]))


POLISHED = ("moving", 20.0, 499 * 25 / 3600)  # by ``polishing``: as duties of ``naive_heat``


def polishing(name):
    """A program of 500 lines of 500 mm, each 25 s, at 20 mm/s: 3.5 h."""
    q = arm.joints_at(arm.frame(0, -500, 0, 0, 0, 0) @ arm.flange(HOME), HOME)
    there_and_back = ["L P[2] 20mm/sec FINE", "L P[1] 20mm/sec FINE"]
    return program(there_and_back * 250, [at(1, HOME), at(2, q)], name=name)
