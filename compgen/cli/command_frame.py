"""What all commands have in common: how their options are grouped, where their result goes, how they end.

A command is a function of its options that returns an ``Outcome``. A parameter that is a record stands for a group of
options: each of its fields is one. ``screen`` is one of them that every command has; ``cores`` is one that a command
leaves to the frame.
"""

import inspect
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, is_dataclass
from functools import wraps
from typing import Any

import typer

from compgen.cli.options.options import CompiledCores
from compgen.cli.screen.messages import print_error, print_lines, print_record, print_shown
from compgen.cli.this_machine import use_cores, use_machine
from compgen.core.exit_codes import ExitCode


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What a command has come to; its files are written."""

    record: object = None  # what --json prints; None: it is printed already
    shown: Iterable[object] = ()  # what a reader sees: sentences and tables, as wide as the terminal
    lines: Iterable[str] = ()  # what else a reader sees: sentences, a line each, as long as they are
    errors: Sequence[str] = ()  # why it is not inside; empty ones are none
    code: int = ExitCode.OUTSIDE  # that it ends with where there are errors


def framed(run: Callable[..., Outcome]) -> Callable[..., None]:
    """A command as the parser calls it: all options one by one, the result printed, the exit code set."""
    own = inspect.signature(run).parameters.values()
    groups: dict[str, Any] = {each.name: each.annotation for each in own if is_dataclass(each.annotation)}
    fields = {name: inspect.signature(group).parameters for name, group in groups.items()}
    options = [option for each in own for option in fields.get(each.name, {each.name: each}).values()]

    @wraps(run)
    def command(**given: Any) -> None:
        records = {name: groups[name](**{key: given.pop(key) for key in keys}) for name, keys in fields.items()}
        screen, cores = records["screen"], records.get("cores")
        if isinstance(cores, CompiledCores):
            use_machine(cores.workers)
        elif cores is not None:
            use_cores(cores.workers)
        outcome = run(**given, **records)
        if not screen.is_silent:
            print_shown(outcome.shown)
            print_lines(outcome.lines)
        if screen.as_json and outcome.record is not None:
            print_record(outcome.record)
        errors = [error for error in outcome.errors if error]
        for error in errors:
            print_error(error, outcome.code)
        if errors:
            raise typer.Exit(outcome.code)

    parameters = [option.replace(kind=inspect.Parameter.KEYWORD_ONLY) for option in options]
    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    return command
