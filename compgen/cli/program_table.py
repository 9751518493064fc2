"""What ``inspect`` says, for a reader."""

import sys
from typing import Any

from rich.console import Console

SHOWN = 40  # findings; a long program may have thousands


def show_program(found: dict[str, Any]) -> None:
    """What ``inspect`` found, for a reader."""
    console = Console(width=None if sys.stdout.isatty() else 100, highlight=False, markup=False)
    places, moves = found["positions"], found["motions"]
    told = ", ".join(f"{n} {letter}" for letter, n in sorted(moves.items())) or "none"
    console.print(f"{found['name']}  {found['comment']}".rstrip())
    console.print(f"motions: {told}; {found['disabled_motions']} disabled")
    console.print(
        f"positions: {places['defined']} defined, {places['used']} used, {len(places['shared'])} shared, "
        f"{places['joint_form']} in joint form"
    )
    for key in ("unused", "undefined"):
        if places[key]:
            console.print(
                f"{key}: {', '.join(f'P[{n}]' for n in places[key][:20])}{' ...' if places[key][20:] else ''}"
            )
    pairs = [f"UF {f['uframe']} UT {f['utool']} ({f['positions']})".replace("-1", "F") for f in found["frames"]]
    console.print(f"frames: {', '.join(pairs) or 'none'}")
    console.print(f"postures: {', '.join(f'{k} ({n})' for k, n in found['postures'].items()) or 'none'}")
    console.print(
        f"path {found['path_length_mm']:.1f} mm, {found['duration_s']:.1f} s at programmed speeds; "
        f"{found['motions_without_time']} motions without a time of their own"
    )
    for joint, room in found["limits"].items():
        unit = "mm" if "room_mm" in room else "deg"
        console.print(f"{joint}: {room['room_' + unit]:.2f} {unit} from its limit at P[{room['position']}]")
    if found["out_of_reach"]:
        console.print(f"out of reach of {found['robot']}: {', '.join(f'P[{n}]' for n in found['out_of_reach'][:20])}")
    console.print(f"{len(found['unsafe'])} statements make compensation unsafe" + (":" if found["unsafe"] else ""))
    for item in found["unsafe"][:SHOWN]:
        console.print(f"  line {item['line']}: {item['text']}: {item['reason']}")
    if len(found["unsafe"]) > SHOWN:
        console.print(f"  ... and {len(found['unsafe']) - SHOWN} more; --json lists them all")
