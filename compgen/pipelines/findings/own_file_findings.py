"""How far the flown tool is from the user's own file, as the judge reads it, and whether that is explained."""

import numpy as np

from compgen.core.codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.units import UM
from compgen.job.job import Job
from compgen.planning.toolpath import ToolPath
from compgen.verification.deviation import Deviation
from compgen.verification.own_file.distance import distance_from_file

ALLOWED = 1 * UM  # of the chords that stand for arcs here, and of a program's digits
ROUNDING = 1e-9  # m of arc length


def own_file_findings(job: Job, path: ToolPath, deviation: Deviation) -> list[Finding]:
    """One finding of a path of own points: the distance from its file, and that it is beyond what explains it.

    The tool may leave the file by the path's own tolerance and the error that is left. More says: it is another path.
    """
    file = job.own_file
    if file is None:
        return []
    segment = np.clip(np.searchsorted(path.arc, deviation.arc, side="right") - 1, 0, len(path.piece) - 1)
    fraction = (deviation.arc - path.arc[segment]) / np.diff(path.arc)[segment]
    place = path.exact.in_frame(path.at(segment, np.clip(fraction, 0, 1)).pose).position
    error = deviation.error if path.exact.frame is None else deviation.error @ path.exact.frame.rotation
    # approach and retract, the first and the last piece, are not the file's
    led = 1 if job.plan.process.lift > 0 else 0
    own = np.flatnonzero((path.piece >= led) & (path.piece < len(path.exact.curve.poly) - led))
    begin, end = path.arc[own[0]], path.arc[own[-1] + 1]
    rows = (deviation.arc >= begin - ROUNDING) & (deviation.arc <= end + ROUNDING)
    distance = distance_from_file(file, (place + error)[rows])
    allowed = job.plan.path.tolerance + deviation.extents["total"].max + ALLOWED
    off, line = max((distance.off, distance.off_line), (distance.missed, distance.missed_line))
    lines = f"its lines are kept to {distance.off / UM:.2g} um, " if file.joined else ""
    if off <= allowed:
        message = (
            f"judged by {file.source} itself, read a second time: {lines}its places to {distance.missed / UM:.2g} um"
        )
        return [Finding(Level.NOTE, Code.PATH_FILE, message)]
    message = (
        f"{file.source}: line {line}: read a second time, the tool is {off / UM:.0f} um off it, where the path's "
        f"tolerance and the error that is left explain {allowed / UM:.3g}: the path is not this file's"
    )
    return [Finding(Level.OUTSIDE, Code.PATH_FILE, message)]
