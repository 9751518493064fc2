"""What ``inspect`` prints for a reader."""

from typing import Any

from compgen.cli.screen.messages import stdout_console

#: Where a program says that compgen has corrected it.
MARKS = {
    "remark": "a remark says so",
    "digits": "the last digits of its positions say so",
    "record": "the provenance file beside it says so",
}
MOST_STATEMENTS = 40  # unsafe ones that are printed; a long program may have thousands


def show_program(report: dict[str, Any]) -> None:
    """Print what a program is, and what makes correcting it unsafe."""
    console = stdout_console()
    positions, motions = report["positions"], report["motions"]
    counts = ", ".join(f"{n} {letter}" for letter, n in sorted(motions.items())) or "none"
    console.print(f"{report['name']}  {report['comment']}".rstrip())
    if report["mark"] in MARKS:
        console.print(f"corrected by compgen: {MARKS[report['mark']]}; correct refuses it")
    console.print(f"motions: {counts}; {report['disabled_motions']} disabled")
    console.print(
        f"positions: {positions['defined']} defined, {positions['used']} used, {len(positions['shared'])} shared, "
        f"{positions['joint_form']} in joint form"
    )
    for key in ("unused", "undefined"):
        if positions[key]:
            console.print(
                f"{key}: {', '.join(f'P[{n}]' for n in positions[key][:20])}{' ...' if positions[key][20:] else ''}"
            )
    pairs = [f"UF {f['uframe']} UT {f['utool']} ({f['positions']})".replace("-1", "F") for f in report["frames"]]
    console.print(f"frames: {', '.join(pairs) or 'none'}")
    console.print(f"postures: {', '.join(f'{k} ({n})' for k, n in report['postures'].items()) or 'none'}")
    console.print(
        f"path {report['path_length_mm']:.1f} mm, {report['duration_s']:.1f} s at programmed speeds; "
        f"{report['motions_without_time']} motions without a time of their own"
    )
    for joint, margin in report["limits"].items():
        unit = "mm" if "room_mm" in margin else "deg"
        console.print(f"{joint}: {margin['room_' + unit]:.2f} {unit} from its limit at P[{margin['position']}]")
    if report["robot"] is None:
        console.print("reach and joint limits: not looked at, the program names no robot; say which with --robot")
    if report["out_of_reach"]:
        console.print(f"out of reach of {report['robot']}: {', '.join(f'P[{n}]' for n in report['out_of_reach'][:20])}")
    console.print(f"{len(report['unsafe'])} statements make compensation unsafe" + (":" if report["unsafe"] else ""))
    for statement in report["unsafe"][:MOST_STATEMENTS]:
        console.print(f"  line {statement['line']}: {statement['text']}: {statement['reason']}")
    if len(report["unsafe"]) > MOST_STATEMENTS:
        console.print(f"  ... and {len(report['unsafe']) - MOST_STATEMENTS} more; --json lists them all")
