"""A program that exists, lifted for a dry run: the Z of every position that it drives to, in its own user frame.

Only where the whole program goes along: every motion to a Cartesian position of the file, in one user frame, and no
statement between that may move the arm. Else a part of it would still go where the workpiece is.
"""

import re
from collections.abc import Mapping

import numpy as np

from compgen.core.arrays import IntArray
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.units import DEG
from compgen.fanuc.analysis.called_programs import CalledPrograms
from compgen.fanuc.editing.insertion import insert_remark
from compgen.fanuc.editing.numbers import Edits, format_like
from compgen.fanuc.listing.listing import LsProgram, dumps, edited, loads, other_statements
from compgen.fanuc.listing.position_parser import NO_NUMBER
from compgen.fanuc.motion_options import ends_elsewhere
from compgen.fanuc.vocabulary import may_move_arm, written_frames
from compgen.program.program import dry_name

_NAME = re.compile(rb"(/PROG[ \t]+)(\S+)", re.IGNORECASE)
_Z, _W, _P = 2, 3, 4  # columns of a position's numbers
CLEARS = 0.5  # share of a lift that leads away from the part
FORWARD = 0.1  # share of a lift up that may lead forward along a tool that stands across it


def lifted_program(
    program: LsProgram, height_mm: float, length: int, called: CalledPrograms, uframe: Mapping[int, Pose]
) -> LsProgram:
    """The program with another name, a remark that says it, and Z higher by so much.

    Args:
        program: Any.
        height_mm: By which it goes up.
        length: Characters that a name may have.
        called: What is known of the programs that it calls.
        uframe: User frames, by number.

    Raises:
        InputError: A part of it would not go along; names the line.
    """
    where = f"program {program.name}: --lift-all: line"
    others = other_statements(program)
    for line, text in others:
        if may_move_arm(text, called.motionless):
            raise InputError(f"{where} {line}: '{text:.40}' may move the arm, not lifted; lift a copy without it")
    m, p = program.motions, program.positions
    driven: set[int] = set()
    for i in np.flatnonzero(~m.disabled).tolist():
        if NO_NUMBER in m.position[i] or ends_elsewhere(m.options[i]):
            text = f"'{program.text(m.span[i]):.40}' goes where the file does not say"
            raise InputError(f"{where} {m.line[i]}: {text}; lift a copy without it")
        driven.update(m.position[i])
    if not driven:
        raise InputError(f"program {program.name}: --lift-all: it has no motion that could be lifted; name another")
    rows = np.flatnonzero((p.group <= 1) & np.isin(p.number, sorted(driven)))
    odd = rows[(p.span[rows, _Z, 1] == 0) | ~np.isfinite(p.value[rows, _Z])]
    if len(odd):
        raise InputError(
            f"{where} {p.line[odd[0]]}: P[{p.number[odd[0]]}] is in joint form or untaught: it has no Z to lift; "
            "record it in Cartesian form"
        )
    written = called.frames.union(*(written_frames(text) for _, text in others))  # then none of the table is sure
    _refuse_into_the_part(program, rows, {} if written else uframe)
    edits: Edits = {}
    for row in rows.tolist():
        start, end = p.span[row, _Z].tolist()
        old = program.data[start:end]
        edits[start, end] = format_like(old, float(old) + height_mm, omit_zero=old.lstrip(b"+-")[:1] == b".")
    name = dry_name(program.name, length).encode("latin-1")
    renamed = _NAME.sub(lambda m: m[1] + name, dumps(edited(program, edits)), count=1)
    return insert_remark(loads(renamed), f"DRY RUN +{height_mm:.4g} MM")


def _refuse_into_the_part(program: LsProgram, rows: IntArray, uframe: Mapping[int, Pose]) -> None:
    """Refuse positions whose frame's z leads neither up nor back along the tool."""
    p = program.positions
    frames = np.unique(p.uframe[rows])
    if len(frames) > 1:
        listed = ", ".join("F" if n == NO_NUMBER else str(n) for n in frames.tolist())
        raise InputError(
            f"program {program.name}: --lift-all: positions in several user frames ({listed}), up is not one way; "
            "lift a copy with one"
        )
    leads_up = any(n in uframe and uframe[n].rotation[2, 2] > CLEARS for n in frames.tolist())
    back = -np.cos(p.value[rows, _W] * DEG) * np.cos(p.value[rows, _P] * DEG)  # of the lift along the tool's axis
    wrong = rows[back < (-FORWARD if leads_up else CLEARS)]
    if len(wrong):
        raise InputError(
            f"program {program.name}: --lift-all: line {p.line[wrong[0]]}: z of its user frame leads "
            f"P[{p.number[wrong[0]]}] neither up nor back along the tool: it may drive into the part; lift a copy in a "
            "frame whose z points from the part"
        )
