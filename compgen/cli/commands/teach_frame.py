"""Command teach-frame: where a part stands, from spheres that the identified, warm arm has touched."""

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from compgen.cli.commands.identify import ReferenceOption, Temperatures, UserFrames
from compgen.cli.frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.output_files.ownership import check_own_file
from compgen.cli.output_files.publish import check_names, publish
from compgen.cli.screen.messages import finding_lines, print_lines
from compgen.core.commands import Command
from compgen.core.exceptions import InputError
from compgen.core.json_text import json_text


def teach_frame(
    robot: opt.RobotArgument,
    *,
    touches: opt.TouchesFile = None,
    artefact: opt.ArtefactFile = None,
    temperatures: Temperatures = None,
    reference: ReferenceOption = "start",
    number: Annotated[int, typer.Option("--number", help="UFRAME number.", min=1, max=9)] = 1,
    frames: UserFrames = None,
    nominal: Annotated[bool, typer.Option("--nominal", help="As the pendant would: without the model.")] = False,
    output: Annotated[
        str | None,
        typer.Option("-o", "--output", help="The frame's file; default outputs/frames/<robot>_<number>.toml."),
    ] = None,
    screen: opt.Screen,
) -> Outcome:
    """Compute a part's user frame from spheres that the identified, warm arm has touched.

    Examples:
        cgen teach-frame mine.toml --touches touches.csv --artefact artefact.toml
    """
    from compgen.pipelines.files.robot_file import load_arm
    from compgen.pipelines.measure import teach_frame as teaching
    from compgen.pipelines.measure.identification_files import artefact_of_touches, rise_reference
    from compgen.program.frames import default_frames, load_frames

    if touches is None:
        raise InputError("--touches: missing; give the CSV of touches")
    arm = load_arm(robot)
    artefact = artefact_of_touches(touches, artefact)
    target = opt.toml_file(output, Path("outputs") / "frames" / f"{arm.robot.name}_{number}.toml", "frame's")
    report = target.with_suffix(".json")
    check_names(target.parent, [report.name])
    check_own_file("-o", str(target), "as cgen teach-frame wrote it", Command.TEACH_FRAME)
    check_own_file("-o", str(report), None, Command.TEACH_FRAME)
    uframes = (load_frames(frames) if frames else default_frames()).uframe
    taught = teaching.teach_frame(
        arm,
        touches,
        artefact,
        number=number,
        log=temperatures,
        reference=rise_reference(reference),
        uframes=uframes,
        nominal=nominal,
    )
    record = teaching.frame_record(taught, arm.robot.controller.decimals)
    reports = {report.name: json_text(record)}
    publish(target.parent, {target.name: teaching.frame_text(taught).encode()}, reports)
    lines = [*_lines(record), f"wrote {target}, {report}"]
    return Outcome(record=reports[report.name], show=partial(print_lines, lines))


def _lines(record: dict[str, Any]) -> list[str]:
    """What the command prints."""
    figures = "  ".join(f"{key[0].upper()} {value}" for key, value in record["type_in"].items())
    warm = ", ".join(f"{name} {rise:.1f}" for name, rise in record["rise_K"].items()) or "none known"
    k2 = ", ".join(f"{2 * s:.0f}" for s in record["sigma_um"])
    turn = ", ".join(f"{2 * s:.1f}" for s in record["sigma_mdeg"])
    probe, probe_k2 = record["probe_mm"], ", ".join(f"{2 * s:.0f}" for s in record["probe_sigma_um"])
    lines = [
        f"UFRAME[{record['uframe']}]  {figures}   (mm, deg; type these in)",
        f"known to {k2} um and {turn} mdeg (k = 2, World x, y, z) where it was touched",
        f"from {record['touches']} touches with {record['noise_um']:.0f} um noise",
        f"probe in the flange: {probe[0]:.3f}, {probe[1]:.3f}, {probe[2]:.3f} mm, known to {probe_k2} um (k = 2)",
        f"taught through {'the model of ' if record['through'] == 'model' else 'the nominal arm of '}"
        f"{record['robot_file']}, rise K {warm}",
    ]
    differs = record["pendant_would_differ"]
    if differs is not None:
        away = ", ".join(f"{v:.0f}" for v in differs["place_um"])
        lines.append(f"the pendant would have taught it {away} um away")
    return [*lines, *finding_lines(record["findings"])]
