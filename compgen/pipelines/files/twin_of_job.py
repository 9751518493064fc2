"""The twin of a cell and of a job: the real arm that their files describe, and a job's text on it.

From error sources to the twin's faults: plain numbers, which the twin applies by code of its own.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.pose import IDENTITY
from compgen.error_model.loads import Loads
from compgen.error_model.source import Source
from compgen.error_model.sources.compliance import JointCompliance
from compgen.error_model.sources.frames import BaseFrame, ToolFrame
from compgen.error_model.sources.hysteresis import Hysteresis
from compgen.error_model.sources.joint_coupling import JointCoupling
from compgen.error_model.sources.joint_waves import GearHarmonics, JointRipple
from compgen.error_model.sources.joint_zeros import JointZeros
from compgen.error_model.sources.link_offsets import LinkOffsets
from compgen.error_model.sources.measured_map import AxisMap
from compgen.error_model.sources.thermal_bend import ThermalBend
from compgen.error_model.sources.thermal_growth import ThermalGrowth
from compgen.error_model.sources.thermal_shift import ThermalShift
from compgen.job.job import Cell, Job
from compgen.planning.toolpath import ToolPath
from compgen.program.program import Program
from compgen.thermal.ensemble import Start, duties_before
from compgen.verification.deviation import Deviation, deviation_from_path
from compgen.verification.twin import PreparedProgram, Twin, prepare
from compgen.verification.twin.faults import AxisDeviation, Faults, ThermalDistortion


def twin_of_cell(cell: Cell) -> Twin:
    """The real arm of a cell, to its flange: programs that exist name their tools themselves."""
    return Twin(
        robot=cell.robot,
        heat=cell.warming,
        profiles=cell.profiles,
        tool=IDENTITY,
        faults=faults_of(cell.sources),
    )


def twin_of(job: Job) -> Twin:
    """The real arm of a job: its cell's, with its tool, in its part's frame."""
    uframe = None if job.frame is None else job.frame.register
    return replace(twin_of_cell(job.cell), tool=job.tool.pose, uframe=uframe)


def prepared_for(job: Job, program: Program) -> PreparedProgram:
    """A text on the twin, after everything that a job's cell does before it.

    Raises:
        TwinError: The text cannot be followed.
    """
    return prepare(twin_of(job), program, job.history.before, job.history.air)


def at_start(job: Job, prepared: PreparedProgram, start: Start, twin: Twin | None = None) -> PreparedProgram:
    """A text after everything that a job's cell did until a start, by the twin's own heat; default the text's twin."""
    slowed = prepared if start.override == 1 else prepared.at_override(start.override)
    return slowed.reheated(twin or prepared.twin, duties_before(job.history, start), job.history.air)


def deviation_of(
    path: ToolPath, prepared: PreparedProgram, progress: Callable[[float], None] = lambda share: None
) -> Deviation:
    """What the twin does with a text, beside the path that it was written for; ``progress`` gets the share done."""
    return deviation_from_path(path, prepared.chunks(progress), prepared.sample_count)


def faults_of(sources: Sequence[Source]) -> Faults | None:  # noqa: C901 - one case for each kind of source
    """What a twin must know of some sources beside thermal growth; None when there is nothing.

    Raises:
        TypeError: A source that the twin does not know: it could not prove anything.
    """
    fields: dict[str, Any] = {}
    distortions: list[ThermalDistortion] = []
    deviations: list[AxisDeviation] = []
    for source in sources:
        match source:
            case ThermalGrowth():
                rows = (("d", source.excess_d), ("a", source.excess_a))
                excess = {f"{letter}{i + 1}": float(x) for letter, row in rows for i, x in enumerate(row) if x}
                if excess:
                    fields["cte_excess"] = excess
            case LinkOffsets():
                fields["link_offsets"] = np.column_stack([source.d, source.a, source.alpha, source.beta])
            case JointZeros():
                fields["joint_zeros"] = source.offset
            case JointCoupling():
                fields["joint_coupling"] = source.ratio
            case JointCompliance():
                fields |= {"compliance": source.compliance, "hardening": source.hardening}
                fields |= _load_fields(source.loads)
            case GearHarmonics():
                fields |= {"gear_harmonics": _waves(source), "gear_cycles": source.cycles}
            case JointRipple():
                fields |= {"joint_ripple": _waves(source), "ripple_orders": source.order}
            case Hysteresis():
                fields |= {"backlash": source.backlash, "windup": source.windup, "reversal_width": source.width}
                fields |= {"reversal_law": source.law, **_load_fields(source.loads)}
            case BaseFrame() | ToolFrame():
                fields[source.NAME] = np.concatenate([source.position, source.rotation])
            case ThermalBend() | ThermalShift():
                distortions += _distortions(source)
            case AxisMap():
                deviations.append(
                    AxisDeviation(source.axis, source.station, source.forward, source.reverse, source.width)
                )
            case _:
                raise TypeError(f"{type(source).__name__}: the twin does not know this source")
    if not (fields or distortions or deviations):
        return None
    return Faults(**fields, thermal_distortions=tuple(distortions), axis_deviations=tuple(deviations))


def _waves(source: GearHarmonics | JointRipple) -> Array:
    """Sine and cosine of each joint and order, (6, H, 2) [rad]."""
    return np.stack([source.sine, source.cosine], axis=2)


def _distortions(source: ThermalBend | ThermalShift) -> list[ThermalDistortion]:
    """What each rise does to a link: it bends about an axis with a lever, or shifts along it."""
    if isinstance(source, ThermalBend):
        bends = zip(source.rate, source.row, source.axis, source.lever, source.node, strict=True)
        return [ThermalDistortion(bend=float(r), row=int(i), axis=a, lever=v, node=int(k)) for r, i, a, v, k in bends]
    shifts = zip(source.rate, source.row, source.axis, source.node, strict=True)
    return [
        ThermalDistortion(bend=0.0, row=int(i), axis=a, lever=a, node=int(k), shift=float(r)) for r, i, a, k in shifts
    ]


def _load_fields(loads: Loads) -> dict[str, Any]:
    return {
        "mass": np.append(loads.mass, loads.payload),
        "centre": np.vstack([loads.centre, loads.payload_centre]),
        "gravity": loads.gravity,
        "force": loads.force,
    }
