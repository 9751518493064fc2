"""Where a program contradicts itself: a controller would stop there, or run on where nobody meant.

A motion to a position in another user frame or tool than is set, along every way to it; a straight line or an arc
between two configurations; a label that stands twice; a jump to one that stands nowhere.
"""

import re

import numpy as np

from compgen.core.arrays import IntArray
from compgen.fanuc.analysis.called_programs import UNKNOWN_PROGRAMS, CalledPrograms
from compgen.fanuc.analysis.control_flow import Flow, read_flow
from compgen.fanuc.analysis.flow_graph import Node, arrivals, link_nodes, read_nodes
from compgen.fanuc.analysis.unsafe_statements import Unsafe
from compgen.fanuc.listing.listing import LsProgram
from compgen.fanuc.listing.position_parser import NO_NUMBER
from compgen.fanuc.motion_options import ends_elsewhere
from compgen.fanuc.vocabulary import CALL, FRAME_MENTIONED, FRAME_NUMBER, LABEL, LABEL_ALONE, may_move_arm
from compgen.program.driven import NONE, DrivenProgram
from compgen.robot.configuration import config_letters
from compgen.robot.inverse_kinematics import ALL_POSTURES

Active = tuple[int, int]  # numbers of the user frame and the tool that are set; NO_NUMBER where it is not known
_NAMES = ("UFRAME_NUM", "UTOOL_NUM")
_BY_JOINTS = re.compile(r"\bWJNT\b", re.IGNORECASE)  # the wrist's joints are interpolated
STRAIGHT_WRIST = np.sin(np.radians(1.0))  # of J5, about which a position is of both configurations


def contradictions(
    program: LsProgram, traversal: DrivenProgram, called: CalledPrograms = UNKNOWN_PROGRAMS
) -> list[Unsafe]:
    """What contradicts itself, in order of line.

    Args:
        program: Any program.
        traversal: Its stations.
        called: What is known of the programs that it calls.
    """
    flow = read_flow(program)
    unsafe = [*_labels(program, flow), *_frames(program, flow, traversal.motion, called)]
    unsafe += _configurations(program, traversal)
    return sorted(set(unsafe), key=lambda u: (u.line, u.reason))


def _labels(program: LsProgram, flow: Flow) -> list[Unsafe]:
    defined: dict[int, int] = {}  # line of each number
    unsafe = []
    mentions: list[tuple[int, str]] = []
    for s, text in flow.text.items():
        line, alone = int(flow.line[s]), LABEL_ALONE.match(text)
        if alone is None:
            mentions.append((line, text))
        elif alone[1] and (first := defined.setdefault(int(alone[1]), line)) != line:
            reason = f"LBL[{alone[1]}] stands twice, on line {first} too: where a jump leads is not told; remove one"
            unsafe.append(Unsafe(line, text[:60], reason))
    m = program.motions
    mentions += [
        (int(m.line[i]), program.motion_text(i))
        for i, (options, off) in enumerate(zip(m.options, m.disabled.tolist(), strict=True))
        if not off and LABEL.search(options)
    ]
    for line, text in mentions:
        absent = dict.fromkeys(n for n in LABEL.findall(text) if n and int(n) not in defined)
        unsafe += [
            Unsafe(line, text[:60], f"LBL[{n}] stands nowhere: a jump to it stops; add the label") for n in absent
        ]
    return unsafe


def _frames(program: LsProgram, flow: Flow, motion: IntArray, called: CalledPrograms) -> list[Unsafe]:
    def matters(text: str) -> bool:
        return bool(FRAME_MENTIONED.search(text)) or any(n.upper() not in called.in_frames for n in CALL.findall(text))

    nodes = read_nodes(program, flow, motion, called.motionless, matters)
    if not link_nodes(nodes):
        return []
    p, m = program.positions, program.motions
    row_of = p.row_of()
    last = np.append(motion[1:] != motion[:-1], True)  # a C names two positions
    unsafe = []
    states = arrivals(nodes, (NO_NUMBER, NO_NUMBER), _leave, _meet)
    for node, active in zip(nodes, states, strict=True):
        if node.stations is None or active is None or active == (NO_NUMBER, NO_NUMBER):
            continue
        for s in range(node.stations[0], node.stations[1] + 1):
            i = int(motion[s])
            row = row_of.get(m.position[i][-1 if last[s] else 0])
            if row is None:
                continue
            for name, number, of_position in zip(_NAMES, active, (int(p.uframe[row]), int(p.utool[row])), strict=True):
                if NO_NUMBER not in (number, of_position) and number != of_position:
                    reason = (
                        f"P[{p.number[row]}] is told in {name[:-4].lower()} {of_position}, and {name}={number} is set"
                    )
                    text = program.motion_text(i)
                    unsafe.append(Unsafe(int(m.line[i]), text[:60], f"{reason}: a controller stops there"))
    return unsafe


def _configurations(program: LsProgram, drive: DrivenProgram) -> list[Unsafe]:
    """Ways of the tool between two configurations, where both ends are surely known."""
    s = np.flatnonzero(~drive.joint & (drive.pose != NONE) & (drive.origin != NONE))
    ends = drive.pose[np.column_stack([drive.origin[s], s])]
    letters = drive.at.posture[ends]
    straight = (np.abs(np.sin(drive.at.theta[ends][:, :, 4])) < STRAIGHT_WRIST).any(axis=1)
    changes = (letters != NONE).all(axis=1) & (letters[:, 0] != letters[:, 1]) & (ends != NONE).all(axis=1) & ~straight
    unsafe = []
    for station, (begin, end) in zip(s[changes], letters[changes].tolist(), strict=True):
        i = int(drive.motion[station])
        options = program.motions.options[i]
        if _BY_JOINTS.search(options) or ends_elsewhere(options):
            continue
        reason = (
            f"P[{drive.at.number[drive.pose[station]]}] is {config_letters(ALL_POSTURES[end])}, and the arm comes as "
            f"{config_letters(ALL_POSTURES[begin])}: a controller may stop there; write J or Wjnt, or teach it again"
        )
        unsafe.append(Unsafe(int(program.motions.line[i]), program.motion_text(i)[:60], reason))
    return unsafe


def _leave(node: Node, active: Active) -> Active:
    """What is set behind a node."""
    text = node.text or node.options
    if node.moves or CALL.search(text) or (node.text and may_move_arm(text)):
        return NO_NUMBER, NO_NUMBER
    if match := FRAME_NUMBER.match(text):
        number = int(match[2]) if match[2].isdigit() else NO_NUMBER
        return (number, active[1]) if match[1].upper() == _NAMES[0] else (active[0], number)
    return (NO_NUMBER, NO_NUMBER) if FRAME_MENTIONED.search(text) else active


def _meet(a: Active, b: Active) -> Active:
    return a[0] if a[0] == b[0] else NO_NUMBER, a[1] if a[1] == b[1] else NO_NUMBER
