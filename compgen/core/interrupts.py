"""Ctrl-C and other wishes to end a run: what is at work is left at once, tidied up behind, and told in one line.

While the libraries load there is nothing to tidy up: the process ends where it stands. From ``working`` on ``Stopped``
is raised, once; from ``finish`` on files are being put in place, which takes no time, and a wish comes too late.
"""

import os
import shutil
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

_WORDS = {"SIGINT": "interrupted", "SIGTERM": "terminated", "SIGHUP": "hung up"}

_minded: list[int] = []  # signals
_loading = False
_asked = 0  # the signal that came
_left = "nothing was written"
_litter: set[Path] = set()  # folders that someone is at work in


class Stopped(BaseException):
    """Someone asked the run to end. No KeyboardInterrupt, which libraries take for theirs."""

    def __init__(self, number: int) -> None:
        self.code = 128 + number
        super().__init__(_sentence(number))


def listen() -> None:
    """Mind signals from here on; those that the caller had ignored stay ignored."""
    global _loading
    _loading = True
    for name in _WORDS:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _stop)
            _minded.append(number)


def working() -> None:
    """From here on there is something to tidy up."""
    global _loading
    _loading = False


def check() -> None:
    """Raises Stopped when someone has asked: a library may have swallowed what was raised."""
    if _asked:
        raise Stopped(_asked)


def finish() -> None:
    """The last moment to stop; from here on everything is put in place. Does nothing where nobody listens."""
    check()
    _ignore()
    check()


@contextmanager
def for_children() -> Iterator[None]:
    """Processes that begin in here are deaf to Ctrl-C, which a terminal sends to all: who began them ends them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def keeps(told: str) -> None:
    """What is said to be left of a run that is stopped."""
    global _left
    _left = told


def asked() -> Stopped | None:
    """The wish to end that has come, if any."""
    return Stopped(_asked) if _asked else None


@contextmanager
def workplace(folder: Path) -> Iterator[Path]:
    """A folder to work in, made here and gone afterwards, also when the work is left in the middle."""
    _litter.add(folder)
    try:
        folder.mkdir(0o700)
        yield folder
    finally:
        _remove(folder)
        _litter.discard(folder)


def sweep() -> None:
    """Remove what threads that are left in the middle of their work would leave."""
    for folder in list(_litter):
        _remove(folder)


def _remove(folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)


def alive(process: int) -> bool:
    """Whether there is such a process on this machine; what one that was killed has left may go."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def _ignore() -> None:
    while _minded:
        signal.signal(_minded.pop(), signal.SIG_IGN)


def _stop(number: int, frame: FrameType | None) -> None:
    global _asked
    _asked = number
    _ignore()
    if _loading:
        os.write(2, f"cgen: {_sentence(number)}\n".encode())
        os._exit(128 + number)
    raise Stopped(number)


def _sentence(number: int) -> str:
    return f"{_WORDS[signal.Signals(number).name]}; {_left}"
