"""Compiled functions, kept in a folder under the hash of what made them.

A library carries the hash of its own bytes at its end, is built under another name and renamed when it is whole: runs
at the same time may build the same one twice, and none ever loads half of it.
"""

import ctypes
import glob
import hashlib
import os
import secrets
import shlex
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from compgen.core import interrupts
from compgen.core.evaluation.codegen import FUNCTION_NAME

#: nobody reads errno or floating-point traps; told so, the compiler takes roots and floors of all lanes at once
FLAGS = ("-O2", "-fno-math-errno", "-fno-trapping-math", "-march=native", "-std=gnu11", "-w", "-fPIC", "-shared")
TIMEOUT = 300.0  # s for one function


@dataclass(frozen=True, slots=True)
class Compiler:
    """A C compiler and the folder where its work is kept."""

    command: tuple[str, ...]
    folder: Path
    mark: str  # what else its output depends on: its own version, this processor


def find_compiler(folder: Path, command: str | None = None) -> Compiler | None:
    """The system's compiler, or None where there is none or the folder cannot be used.

    Args:
        folder: Where compiled functions are kept; made when absent.
        command: The compiler to use; default the first of cc, gcc and clang.
    """
    words = shlex.split(command) if command is not None else []
    tried = [words[0]] if words else ["cc", "gcc", "clang"] if command is None else []
    found = next((place for name in tried if (place := shutil.which(name))), None)
    if found is None:
        return None
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        facts = os.stat(os.path.realpath(found))
    except OSError:
        return None
    if not os.access(folder, os.W_OK | os.X_OK) or folder.stat().st_uid != os.getuid():
        return None
    mark = f"{os.path.realpath(found)} {facts.st_size} {facts.st_mtime_ns} {_processor()}"
    return Compiler((found, *words[1:]), folder, mark)


def _processor() -> str:
    try:
        with Path("/proc/cpuinfo").open() as lines:
            return next((line.split(":", 1)[1].strip() for line in lines if line.startswith(("flags", "Features"))), "")
    except OSError:
        return " ".join(os.uname())


def load_function(compiler: Compiler, identity: str, write: Callable[[], str | None]) -> Any:
    """A compiled function, from the folder or built now; None where it has no C or the compiler cannot.

    Args:
        compiler: And where its work is kept.
        identity: All that decides the source: under its hash the function is kept.
        write: The source; asked for when the folder does not have the function.
    """
    key = hashlib.sha256("\0".join([identity, *FLAGS, *compiler.command, compiler.mark]).encode()).hexdigest()
    place = compiler.folder / f"{key}.so"
    if not _whole(place) and ((source := write()) is None or not _build(compiler, source, place)):
        return None
    try:
        function = getattr(ctypes.CDLL(str(place)), FUNCTION_NAME)
    except (OSError, AttributeError):
        return None
    pointers = ctypes.c_void_p
    function.argtypes = [ctypes.c_longlong, ctypes.c_longlong, pointers, pointers, pointers, pointers]
    function.restype = None
    return function


def _whole(place: Path) -> bool:
    try:
        content = place.read_bytes()
    except OSError:
        return False
    return len(content) > 32 and hashlib.sha256(content[:-32]).digest() == content[-32:]


def _build(compiler: Compiler, source: str, place: Path) -> bool:
    ours = f".{os.uname().nodename}-"
    try:
        _tidy(compiler.folder, ours)
        with interrupts.temporary_folder(compiler.folder / f"{ours}{os.getpid()}-{secrets.token_hex(4)}") as stage:
            text, made = stage / "rows.c", stage / "rows.so"
            text.write_text(source)
            if not _compiled(compiler, text, made):
                return False
            content = made.read_bytes()
            made.write_bytes(content + hashlib.sha256(content).digest())
            made.replace(place)
            return True
    except (OSError, subprocess.SubprocessError):
        return False


def _compiled(compiler: Compiler, text: Path, made: Path) -> bool:
    """Whether the compiler makes a library of a source, with what this system has."""
    surroundings = {**os.environ, "TMPDIR": str(text.parent)}  # what a killed compiler leaves goes with the rest
    for flags in (FLAGS, tuple(f for f in FLAGS if f != "-march=native")):
        for libraries in (("-lmvec", "-lm"), ("-lm",)):
            call = [*compiler.command, *flags, str(text), "-o", str(made), *libraries]
            done = subprocess.run(
                call, stdin=subprocess.DEVNULL, capture_output=True, timeout=TIMEOUT, check=False, env=surroundings
            )
            if done.returncode == 0:
                return True
    return False


def _tidy(folder: Path, ours: str) -> None:
    """Remove what runs on this machine that were killed have left: their names tell a process that is gone."""
    for left in folder.glob(f"{glob.escape(ours)}*"):
        process = left.name.removeprefix(ours).split("-")[0]
        if process.isdigit() and not interrupts.process_exists(int(process)):
            shutil.rmtree(left, ignore_errors=True)
