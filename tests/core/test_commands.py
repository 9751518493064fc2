"""Which command a record is of: it says so; of 0.1.0 its keys tell."""

import pytest
from command_line import typed_commands

from compgen.core.commands import Command, command_of

OF_0_1_0: dict[str, tuple[str, dict[str, object]]] = {
    "generate": ("schema name title verdict before after ratio band findings path timing provenance", {"after": {}}),
    "predict": ("schema name title verdict before after ratio band findings path timing provenance", {"after": None}),
    "correct": ("schema name verdict before after findings unsafe positions duration_s provenance", {}),
    "heat": ("schema name title start_s duration_s findings rise_K runs provenance", {}),
    "whatif": ("schema path study_sha256 keys overrides answers scenarios provenance", {}),
    "executed": ("schema name verdict findings program log covered override clock path", {}),
    "resume": ("schema name verdict from_page why replaced thermal pages", {}),
    "compare": ("schema kind a b equal notes inputs error time program positions", {}),
    "anchor": ("schema name anchored_state verdict reason state path", {}),
    "identify": ("compgen robot verdict model poses held_out_um ladder coverage findings", {}),
    "identify-motion": ("schema name verdict findings motion program log held_out tried", {}),
    "check-robot": ("unit verdict count targets overall set_aside findings", {}),
    "plan-touches": ("planned_touches path robot artefact before after touches", {}),
    "inspect-robot": ("inspected_robot file wrist_reach_mm pendant_J3", {}),
    "teach-frame": ("uframe type_in sigma_um sigma_mdeg rise_K set_aside findings", {}),
    "export-robot": ("robot source rise_K frames pendant joints flange left_out", {}),
}


@pytest.mark.parametrize("name", OF_0_1_0)
def test_a_record_says_its_command_and_one_without_is_known_by_its_keys(name):
    keys, values = OF_0_1_0[name]
    record = {**dict.fromkeys(keys.split(), 1), **values}
    assert command_of(record) is Command(name)
    for command in Command:
        assert command_of({**record, "command": command.value}) is command


@pytest.mark.parametrize(("old", "new"), [("validate", "check-robot"), ("verify-backup", "check-backup")])
def test_a_record_of_a_command_s_earlier_name_is_of_that_command(old, new):
    assert command_of({"command": old}) is Command(new)


def test_what_is_no_command_is_none():
    for record in ({}, {"name": "x"}, {"command": "made up"}, {"command": ["generate"]}, {"command": None}):
        assert command_of(record) is None
    assert command_of({**dict.fromkeys(("path", "timing", "before", "after"), 1), "command": "other"}) is None


def test_each_command_is_one_that_can_be_typed():
    assert set(Command) == set(typed_commands()) - {"schema"}  # whose record is a JSON Schema
