"""The commands that leave a record, and which of them a record is of."""

from collections.abc import Mapping
from enum import StrEnum
from typing import Any


class Command(StrEnum):
    """What is typed after ``cgen``, and ``command`` in the record that it leaves."""

    GENERATE = "generate"
    PREDICT = "predict"
    CHECK = "check"
    CORRECT = "correct"
    HEAT = "heat"
    WHATIF = "whatif"
    COMPARE = "compare"
    RESUME = "resume"
    FOLLOW = "follow"
    EXECUTED = "executed"
    ANCHOR = "anchor"
    OFFSETS = "offsets"
    PAGES = "pages"
    IDENTIFY = "identify"
    IDENTIFY_MOTION = "identify-motion"
    CHECK_ROBOT = "check-robot"
    PLAN_POSES = "plan-poses"
    PLAN_TOUCHES = "plan-touches"
    PLAN_MOTION_LOG = "plan-motion-log"
    TEACH_FRAME = "teach-frame"
    INSPECT = "inspect"
    INSPECT_ROBOT = "inspect-robot"
    EXPORT_ROBOT = "export-robot"
    CHECK_BACKUP = "check-backup"
    INIT = "init"
    EXPLAIN = "explain"


#: what a command was called before, on the command line and in its record, and what it is called now
RENAMED = {"validate": Command.CHECK_ROBOT, "verify-backup": Command.CHECK_BACKUP}
#: records of 0.1.0 do not say it: a command by the keys that only its record has; ``predict`` has those of ``generate``
_KEYS = {
    Command.IDENTIFY: {"ladder", "coverage"},
    Command.IDENTIFY_MOTION: {"motion", "tried"},
    Command.CHECK_ROBOT: {"overall", "targets", "set_aside"},
    Command.EXECUTED: {"covered", "override", "log"},
    Command.ANCHOR: {"anchored_state"},
    Command.RESUME: {"from_page", "replaced"},
    Command.COMPARE: {"a", "b", "equal"},
    Command.PLAN_TOUCHES: {"planned_touches"},
    Command.INSPECT_ROBOT: {"inspected_robot"},
    Command.TEACH_FRAME: {"uframe", "type_in"},
    Command.EXPORT_ROBOT: {"robot", "rise_K", "frames"},
    Command.CORRECT: {"unsafe", "positions", "provenance"},
    Command.WHATIF: {"scenarios", "keys"},
    Command.HEAT: {"runs", "rise_K"},
    Command.GENERATE: {"path", "timing", "before", "after"},
}


def command_of(record: Mapping[str, Any]) -> Command | None:
    """The command that left a record; None where it is of no command that is known here."""
    if "command" in record:
        names = {**{command.value: command for command in Command}, **RENAMED}
        return next((command for name, command in names.items() if name == record["command"]), None)
    command = next((command for command, keys in _KEYS.items() if keys <= set(record)), None)
    return Command.PREDICT if command is Command.GENERATE and record["after"] is None else command
