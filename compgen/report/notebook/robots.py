"""A robot identified from measurements, in a notebook."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from compgen.core.arrays import Array, frozen
from compgen.core.exceptions import RESULT, InputError, refuse_changes
from compgen.core.files import POSTERIOR, file_hash
from compgen.core.findings import Finding
from compgen.core.json_text import json_text
from compgen.core.stages import Progress
from compgen.identification.identify import Identification
from compgen.pipelines.files.robot_file import Arm
from compgen.pipelines.measure.identification_files import (
    MeasurementFiles,
    arm_to_identify,
    identified_texts,
    identify_files,
)
from compgen.report.identification import FIGURES, identification_figures, identification_html, identification_summary
from compgen.report.inputs import Inputs, measured_inputs
from compgen.report.notebook.arguments import (
    File,
    file_name,
    file_names,
    instance,
    number,
    optional_name,
    progress_of,
)
from compgen.report.notebook.machine import data_frame, log_result, numpy_alone, plotly_figure


@dataclass(frozen=True, eq=False, slots=True, repr=False, kw_only=True)
class IdentifiedRobot:
    """Error sources fitted to N measured places, and the verdict."""

    name: str  # of the robot
    result: Identification  # the whole result, for who needs more
    report: dict[str, Any]  # as the JSON file has it
    robot_file: bytes  # with the sources that were identified; whatever the verdict
    posterior: bytes  # the covariance of their parameters, which the robot file names
    inputs: Inputs  # the files that it was identified from

    @property
    def accepted(self) -> bool:
        """Whether the robot file may be used."""
        return not self.result.refused

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What a user must know."""
        return self.result.findings

    @property
    def residual(self) -> Array:
        """Measured against modelled, (N, 3) [m] in the instrument's frame; NaN: not measured.

        A measured distance has by how much it is longer first, and zeros behind.
        """
        return frozen(self.result.selected.fit.residual)

    @property
    def position(self) -> Array:
        """Measured places, (N, 3) [m] in the instrument's frame."""
        return frozen(self.result.data.position)

    def to_dataframe(self) -> Any:
        """A row for each parameter that was fitted, as a pandas DataFrame: name, value, sigma, how much was told.

        Raises:
            InputError: pandas is not installed.
        """
        rows = self.report["parameters"]
        return data_frame({key: [row[key] for row in rows] for key in (rows[0] if rows else ())})

    def plot(self, which: str = "time") -> Any:
        """A plotly Figure: residuals in ``space``, over ``time`` or the ``joints``; ``correlation`` of the parameters.

        Raises:
            InputError: No such figure.
        """
        return plotly_figure(identification_figures(self.result), FIGURES, which)

    def files(self, *, force: bool = False) -> dict[str, bytes]:
        """Name to content of what ``cgen identify`` writes, byte for byte; nothing is written.

        Args:
            force: Give the robot file also when it was refused.
        """
        reports = {
            f"{self.name}.html": identification_html(self.result, self.inputs),
            f"{self.name}.json": json_text(identification_summary(self.result)),
        }
        of_robot = {f"{self.name}{POSTERIOR}": self.posterior, f"{self.name}.toml": self.robot_file}
        return {**(of_robot if self.accepted or force else {}), **reports}

    def __repr__(self) -> str:
        held_out = self.report["held_out_um"]["mean"]
        return f"<IdentifiedRobot {self.name}: {self.report['verdict']}, {held_out:.1f} um on held-out poses>"


refuse_changes(IdentifiedRobot, *RESULT)


def identify(
    robot: File,
    poses: File | Sequence[File] = (),
    lines: File | Sequence[File] = (),
    warm_up: File | Sequence[File] = (),
    temperatures: File | None = None,
    reference: str | float = "start",
    *,
    force: bool = False,
    progress: Progress | None = None,
    distances: File | Sequence[File] = (),
    touches: File | Sequence[File] = (),
    artefact: File | None = None,
    frames: File | None = None,
) -> IdentifiedRobot:
    """Fit the error sources of a robot to measurements, and judge the fit; the same as ``cgen identify``.

    Args:
        robot: Name or file of a robot.
        poses: CSV files of joints and measured places; one or several.
        lines: CSV files of axis tests.
        warm_up: CSV files of poses measured while warming.
        temperatures: CSV log of the nodes.
        reference: What rises in the log count from: ``start`` (cold), ``ambient``, or a temperature [degC].
        force: Take also measurements that are refused for being too few.
        progress: Called with the stage and the share of it that is done, 0 to 1; what it raises ends the run.
        distances: CSV files of distances between measured places, or to a fixed one.
        touches: CSV files of touched spheres.
        artefact: TOML of spheres and probe; ``artefact.toml`` beside the touches where it is left out.
        frames: Frames table or SYSFRAME.VA, for touches that were commanded in a user frame.

    Raises:
        InputError: An argument, a file or what it holds is wrong.
    """
    instance(force, bool, "force", "give True or False")
    name = file_name(robot, "robot", "a robot's name, as 'm710ic50', or its file")
    log = optional_name(temperatures, "temperatures", "a CSV file")
    files = MeasurementFiles(
        poses=file_names(poses, "poses", "a CSV file"),
        lines=file_names(lines, "lines", "a CSV file"),
        warm_up=file_names(warm_up, "warm_up", "a CSV file"),
        distances=file_names(distances, "distances", "a CSV file"),
        touches=file_names(touches, "touches", "a CSV file"),
        artefact=optional_name(artefact, "artefact", "a TOML file"),
        frames=optional_name(frames, "frames", "a file of frames"),
        log=log,
    )
    if not (files.poses or files.warm_up or files.distances or files.touches):
        raise InputError("--poses: missing; give at least one CSV of measured poses, or --distances, or --touches")
    identified = _identified(
        arm_to_identify(name, log, _reference(reference)),
        files,
        _reference(reference),
        progress_of(progress),
        force=force,
    )
    log_result(identified.name, identified)
    return identified


def _identified(
    arm: Arm, files: MeasurementFiles, reference: str, progress: Progress, *, force: bool
) -> IdentifiedRobot:
    with numpy_alone():
        result = identify_files(arm, files, reference, progress, force=force)
        text, posterior = identified_texts(arm, result, files.names, f"{arm.robot.name}{POSTERIOR}")
    report = identification_summary(result)
    inputs = measured_inputs(
        arm.robot.name,
        (arm.source, file_hash(arm.source)),
        [("measured", file, file_hash(file)) for file in files.names],
    )
    return IdentifiedRobot(
        name=arm.robot.name,
        result=result,
        report=report,
        robot_file=text.encode(),
        posterior=posterior.encode(),
        inputs=inputs,
    )


def _reference(value: object) -> str:
    """What rises count from, as the command line takes it."""
    return value if isinstance(value, str) else repr(number(value, "reference"))
