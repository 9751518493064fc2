"""The posterior of an identification by the names that the robot file has: what is written beside that file.

Instruments and reflectors are integrated out, and so is what was fitted along and is not written. Rows of the width of
lost motion, which reversal runs tell before the fit, stand alone.
"""

from collections.abc import Mapping

import numpy as np

from compgen.error_model.posterior import KnownParameter, ParameterPosterior
from compgen.error_model.source import DirectionDependent, Extensible, Source, Visibility
from compgen.identification.identify import Identification
from compgen.identification.model import FreeParameter
from compgen.identification.reversals import SPREAD
from compgen.robot.robot import Robot


def posterior_of(
    identification: Identification, numbers: Mapping[str, tuple[KnownParameter, float]], nodes: frozenset[int]
) -> ParameterPosterior:
    """What the fit knows of the parameters that a robot file carries.

    Args:
        identification: Whose values are in the file.
        numbers: Of that file, by name, as ``error_model.posterior.numbers_of`` gives them.
        nodes: Without a sensor, whose rise and time constant are written as fitted.
    """
    fit, free = identification.selected.fit, identification.model.parameters
    written = {k.source.NAME: k.source for k in identification.known if k.sigma}
    rows, names, scale = [], [], []
    for row, k in enumerate(np.flatnonzero(fit.active).tolist()):
        name = _name(free[k], written.get(free[k].source), identification.robot, nodes)
        if name not in numbers:
            continue
        rows.append(row)
        names.append(name)
        scale.append(identification.model.prior[k] * _per_unit(free[k], numbers[name][1], float(fit.p[k])))
    of_fit = np.array(scale)[:, None] * fit.posterior.covariance[np.ix_(rows, rows)] * np.array(scale)
    widths = _width_sigmas(identification, numbers)
    covariance = np.zeros((len(rows) + len(widths), len(rows) + len(widths)))
    covariance[: len(rows), : len(rows)] = of_fit
    covariance[len(rows) :, len(rows) :] = np.diag(np.square(list(widths.values())))
    known = [numbers[name] for name in (*names, *widths)]
    return ParameterPosterior(tuple(p for p, _ in known), np.array([value for _, value in known]), covariance)


def _name(parameter: FreeParameter, source: Source | None, robot: Robot, nodes: frozenset[int]) -> str:
    """A fitted parameter's name in the robot file; none where it is not written."""
    key, index = parameter.key, parameter.index
    if parameter.source == "warm_up" and parameter.field in ("height", "lag") and index[0] in nodes:
        return f"thermal.node.{'rise_K' if parameter.field == 'height' else 'tau_h'}[{index[0] + 1}]"
    if source is None:
        return ""
    if isinstance(source, Extensible):  # terms that were not needed are gone, the others have moved up
        terms = source.entries_to_fit(Visibility(robot, tuple(range(6)), warm_up=True, temperatures=True))
        index = next((term.index for term in terms if term.label == parameter.label), ())
    return f"{parameter.source}.{key}[{','.join(str(i + 1) for i in index)}]"


def _per_unit(parameter: FreeParameter, value: float, p: float) -> float:
    """How much a number of the file changes with its parameter: factors act on a node's rise and time constant."""
    if parameter.source != "warm_up":
        return 1.0
    return value / (1 + p) if parameter.field == "height" else value


def _width_sigmas(
    identification: Identification, numbers: Mapping[str, tuple[KnownParameter, float]]
) -> dict[str, float]:
    """Standard deviations of the widths of joints that play [rad], by name: from runs, else what is assumed of any."""
    motion = identification.lost_motion
    sigmas = {}
    for known in identification.known:
        if not (isinstance(known.source, DirectionDependent) and "backlash" in known.sigma):
            continue
        for i in np.flatnonzero(known.sigma["backlash"]).tolist():
            name = f"{known.source.NAME}.width_mdeg[{i + 1}]"
            of_log = SPREAD if motion is None else min(float(motion.width_sigma[i]), SPREAD)
            sigmas[name] = numbers[name][1] * of_log
    return sigmas
