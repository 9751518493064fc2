"""Run the command line: every refusal is one line and an exit code, a wrong call one that names what is near."""

import sys
from collections.abc import Sequence
from contextlib import suppress
from difflib import get_close_matches
from typing import Any

import typer

import compgen.cli.blas_threads  # noqa: F401  (before numpy is loaded)
from compgen.cli.app import command_group, options_of_commands
from compgen.cli.screen.messages import UNWRAPPED, print_error, print_refusal, reason_of
from compgen.cli.screen.streams import let_readers_leave
from compgen.core import interrupts
from compgen.core.exit_codes import ExitCode

CLOSE = 0.7  # of the letters
PATH_COMMAND, PROGRAM_COMMAND = "check", "inspect"  # what to do with a file that stands alone
#: a wrong call, as typer and click name it; typer has a name of its own for it only from 0.28 on
WrongCall: type[Any] = typer.BadParameter.__bases__[0]


def main() -> None:
    """Run what the arguments ask for, and exit."""
    let_readers_leave()
    try:
        code = _exit_code()
        interrupts.block_interrupts()
    except BaseException:  # also what a lock says that was left half way
        stop = interrupts.pending_interrupt()
        if stop is None:
            raise
        # within the clause: its frames, and the arrays that threads still write to, live until the end
        _exit(print_refusal(str(stop), stop.code))
    _exit(code)


def _exit_code() -> int:
    """What the command asked for ends with."""
    try:
        width = None if sys.stdout.isatty() else UNWRAPPED
        arguments = sys.argv[1:] or ["--help"]
        if arguments[0] == "help":  # help COMMAND
            arguments = [*arguments[1:2], "--help"]
        code = command_group()(arguments, prog_name="cgen", standalone_mode=False, terminal_width=width) or 0
        sys.stdout.flush()
        return int(code)
    except (KeyboardInterrupt, typer.Abort):
        return print_refusal("interrupted; nothing was written", ExitCode.INTERRUPTED)
    except WrongCall as failure:
        return print_refusal(usage_words(failure, sys.argv[1:], options_of_commands()), ExitCode.BAD_INPUT)
    except OSError as failure:
        return print_error(f"output: cannot be written: {failure.strerror}; see where it goes", ExitCode.BAD_INPUT)
    except Exception as failure:  # noqa: BLE001  a fault of compgen must not end with the code of a verdict
        code, message = reason_of(failure)
        return print_refusal(message, code)


def _exit(code: int) -> None:
    """Exit with all written, also where the output is gone."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError):
            stream.flush()
    sys.exit(code)


def usage_words(failure: Exception, arguments: Sequence[str], options: dict[str, set[str]]) -> str:
    """What a wrong call is answered with.

    Args:
        failure: What the parser says.
        arguments: As typed.
        options: Of each command by its name.
    """
    context = getattr(failure, "ctx", None)
    place = getattr(context, "command_path", "") or "cgen"
    if place == "cgen" and arguments and arguments[0] in options:  # the parser forgets where an argument was missing
        place = f"cgen {arguments[0]}"
    command = place.removeprefix("cgen").strip()
    message = str(getattr(failure, "message", "")) or str(failure)
    option = str(getattr(failure, "option_name", ""))
    if message.startswith("No such option"):
        message = f"No such option: {option}{_about_option(option, command, arguments, options)}"
    elif message.startswith("No such command") and not command:
        message = f"{message.rstrip('.')}{_about_file(arguments, options)}"
    else:
        message = getattr(failure, "format_message", failure.__str__)().rstrip(".")
        message = message.replace("Value error, ", "").replace(*_about_value(failure))
        if message.startswith("Missing"):
            message += f": {getattr(getattr(failure, 'param', None), 'help', None) or 'give it'}"
    return f"{message.rstrip('.')}; see {place} --help"


def _about_value(failure: Exception) -> tuple[str, str]:
    """What the parser says of a value, and the same with the value."""
    from pydantic import ValidationError

    from compgen.core.toml import brief_value

    if not isinstance(failure.__cause__, ValidationError):
        return "", ""
    error = failure.__cause__.errors()[0]
    reason = error["msg"].replace("Input should ", "must ").partition(", unable")[0]
    return error["msg"], f"{brief_value(error['input'])}: {reason}"


def _about_option(option: str, command: str, arguments: Sequence[str], options: dict[str, set[str]]) -> str:
    """What was meant by an option that a command does not have."""
    others = [name for name, known in options.items() if option in known]
    if not command and others:
        called = next((word for word in arguments if word in others), others[0])
        return f" before the command; it goes behind it: cgen {called} ... {option}"
    near = get_close_matches(option, sorted(options.get(command, set())), 1, CLOSE)
    if near and not others:
        return f"; did you mean {near[0]}?"
    have = "has" if len(others) == 1 else "have"
    return f"; cgen {', '.join(others[:4])}{' and others' * (len(others) > 4)} {have} it" if others else ""


def _about_file(arguments: Sequence[str], options: dict[str, set[str]]) -> str:
    """That the command comes before the file."""
    file = arguments[0] if arguments else ""
    kinds = {".toml": PATH_COMMAND, ".ls": PROGRAM_COMMAND}
    wanted = next((name for ending, name in kinds.items() if file.lower().endswith(ending)), None)
    if wanted is None:
        return ""
    called = next((word for word in arguments[1:] if word in options), wanted)
    return f"; the command comes first: cgen {called} {file}"
