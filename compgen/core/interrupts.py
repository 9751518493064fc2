"""Signals that end a run (Ctrl-C, SIGTERM, SIGHUP): work stops at once, its temporary folders go, one line says so.

Until ``raise_on_signal`` there is nothing to clean up, and a library that is being loaded may swallow an exception: the
process ends where it stands. From there on a signal raises ``Interrupted``, once. After ``block_interrupts`` files are
being put in place, and signals are ignored.
"""

import json
import os
import platform
import secrets
import shutil
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType

_VERBS = {"SIGINT": "interrupted", "SIGTERM": "terminated", "SIGHUP": "hung up"}

_handled_signals: list[int] = []
_end_at_once = _says_record = False
_received = 0  # number of the signal that came, 0 for none
_outcome = "nothing was written"
_raise_later = False
_temporary_folders: set[Path] = set()
_temporary_names: set[str] = set()


class Interrupted(BaseException):
    """A signal asked the run to end. Not a KeyboardInterrupt, which some libraries swallow."""

    def __init__(self, number: int) -> None:
        self.code = 128 + number
        super().__init__(_message(number))


def install_handlers(*, as_json: bool = False) -> None:
    """Handle the signals from here on; those that the caller had ignored stay ignored.

    Args:
        as_json: Whether a process that ends where it stands leaves its refusal as a record on the output, too.
    """
    global _end_at_once, _says_record
    _end_at_once, _says_record = True, as_json
    for name in _VERBS:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _handle)
            _handled_signals.append(number)
    sys.unraisablehook = _say_unraisable


def raise_on_signal() -> None:
    """There is something to clean up: from here on a signal raises ``Interrupted`` instead of ending the process."""
    global _end_at_once
    _end_at_once = False


def raise_if_interrupted() -> None:
    """Raises Interrupted when a signal has come: a library may have swallowed what was raised."""
    if _received:
        raise Interrupted(_received)


def block_interrupts() -> None:
    """Ignore signals from here on; the last moment to stop. Does nothing where no handlers are installed.

    Raises:
        Interrupted: A signal has come already.
    """
    raise_if_interrupted()
    _ignore_signals()
    raise_if_interrupted()


@contextmanager
def raise_later() -> Iterator[None]:
    """A signal that comes in this context waits for ``raise_if_interrupted``, or for the end of the context.

    For a library that says something of its own about an exception that a signal raises inside it.
    """
    global _raise_later
    _raise_later = True
    try:
        yield
    finally:
        _raise_later = False
    raise_if_interrupted()


@contextmanager
def block_sigint_in_children() -> Iterator[None]:
    """Processes started in this context ignore Ctrl-C, which a terminal sends to all: their parent ends them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    previous = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, previous)


def set_outcome(outcome: str) -> None:
    """What the message of an interrupted run says is left of it, ``nothing was written`` unless set."""
    global _outcome
    _outcome = outcome


def pending_interrupt() -> Interrupted | None:
    """The interrupt that has come, if any."""
    return Interrupted(_received) if _received else None


@contextmanager
def temporary_folder(folder: Path) -> Iterator[Path]:
    """Make a folder to work in and remove it afterwards, also when the work is interrupted.

    Raises:
        OSError: The folder exists or cannot be made.
    """
    _temporary_folders.add(folder)
    try:
        folder.mkdir(0o700)
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        _temporary_folders.discard(folder)
        _temporary_names.discard(folder.name)


def remove_temporary_folders() -> None:
    """Remove the folders of threads that are abandoned in the middle of their work."""
    for folder in list(_temporary_folders):
        shutil.rmtree(folder, ignore_errors=True)


def temporary_name(prefix: str) -> str:
    """A name that nobody can foresee, for what this process writes before it gives it its own name."""
    name = f"{prefix}{platform.node()}-{os.getpid()}-{secrets.token_hex(8)}"
    _temporary_names.add(name)
    return name


def is_abandoned(name: str, prefix: str) -> bool:
    """Whether a temporary name was given by a process of this machine that is gone; those of others cannot be known."""
    machine, *numbers = name.removeprefix(prefix).rsplit("-", 2)
    if not name.startswith(prefix) or machine != platform.node() or len(numbers) != 2 or not numbers[0].isdigit():
        return False
    process = int(numbers[0])
    return name not in _temporary_names if process == os.getpid() else not process_exists(process)


def process_exists(process: int) -> bool:
    """Whether a process of this number exists on this machine; what a killed one has left may be removed."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def _ignore_signals() -> None:
    while _handled_signals:
        signal.signal(_handled_signals.pop(), signal.SIG_IGN)


def _handle(number: int, frame: FrameType | None) -> None:
    global _received
    _received = number
    _ignore_signals()
    if _end_at_once:
        record = json.dumps({"error": _message(number), "exit_code": 128 + number})
        with suppress(OSError):  # nobody reads it
            os.write(1, f"{record}\n".encode() if _says_record else b"")
            os.write(2, f"cgen: {_message(number)}\n".encode())
        os._exit(128 + number)
    if not _raise_later:
        raise Interrupted(number)


def _say_unraisable(unraisable: "sys.UnraisableHookArgs") -> None:
    """Python drops what a signal raises inside a ``__del__`` or a callback; ``raise_if_interrupted`` finds it."""
    if unraisable.exc_type is not Interrupted:
        sys.__unraisablehook__(unraisable)


def _message(number: int) -> str:
    return f"{_VERBS[signal.Signals(number).name]}; {_outcome}"
