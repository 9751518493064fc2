"""Compiled functions, kept in a folder under the hash of what made them.

A library carries the hash of its own bytes at its end, is built under another name and renamed when it is whole: runs
at the same time may build the same one twice, and none ever loads half of it.
"""

import _ctypes
import ctypes
import hashlib
import os
import shlex
import shutil
import stat
import subprocess
import weakref
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from compgen.core import interrupts
from compgen.core.evaluation.codegen import FUNCTION_NAME
from compgen.core.exceptions import InputError

#: without errno and floating-point traps the compiler takes roots and floors of all lanes at once
FLAGS = ("-O2", "-fno-math-errno", "-fno-trapping-math", "-march=native", "-std=gnu11", "-w", "-fPIC", "-shared")
TIMEOUT = 300.0  # s for one function
_PREFIX = ".build-"
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


@dataclass(frozen=True, slots=True)
class Compiler:
    """A C compiler and the folder where its work is kept."""

    command: tuple[str, ...]
    folder: Path
    fingerprint: str  # what else its output depends on: its own version, this processor


def find_compiler(folder: Path, command: str | None = None) -> Compiler | None:
    """The system's compiler, or None where there is none or the folder cannot be used.

    Args:
        folder: Where compiled functions are kept; made when absent.
        command: The compiler to use; default the first of cc, gcc and clang.

    Raises:
        InputError: Others can write into the folder: what they put there would run.
    """
    words = shlex.split(command) if command is not None else []
    candidates = [words[0]] if words else ["cc", "gcc", "clang"] if command is None else []
    executable = next((path for name in candidates if (path := shutil.which(name))), None)
    if executable is None or not hasattr(os, "getuid"):  # who may write is asked in POSIX words
        return None
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        status = os.stat(os.path.realpath(executable))
    except OSError:
        return None
    if not os.access(folder, os.W_OK | os.X_OK) or folder.stat().st_uid != os.getuid():
        return None
    if folder.stat().st_mode & _OTHERS_WRITE:
        raise InputError(f"{folder}: others can write into it, and what is there is run; chmod go-w {folder}")
    parent = folder.resolve().parent
    if parent.stat().st_mode & (stat.S_IWOTH | stat.S_ISVTX) == stat.S_IWOTH:
        raise InputError(
            f"{parent}: others can put their own {folder.name} there, and what is in it is run; chmod o-w it"
        )
    fingerprint = f"{os.path.realpath(executable)} {status.st_size} {status.st_mtime_ns} {_processor()}"
    return Compiler((executable, *words[1:]), folder, fingerprint)


def _processor() -> str:
    """What code made for this processor depends on: its features."""
    try:
        with Path("/proc/cpuinfo").open() as lines:
            return next((line.split(":", 1)[1].strip() for line in lines if line.startswith(("flags", "Features"))), "")
    except OSError:
        return " ".join(os.uname())


def load_function(compiler: Compiler, identity: str, generate: Callable[[], str | None]) -> Any:
    """A compiled function, from the folder or built now; None where it has no C or the compiler fails.

    Args:
        compiler: The compiler, and where its work is kept.
        identity: All that decides the source: under its hash the function is kept.
        generate: Returns the source; called when the folder does not have the function.

    Raises:
        InputError: The library in the folder is a link, somebody else's, or others can write it.
    """
    key = hashlib.sha256("\0".join([identity, *FLAGS, *compiler.command, compiler.fingerprint]).encode()).hexdigest()
    library = compiler.folder / f"{key}.so"
    _check_library(library)
    if not _is_intact(library) and ((source := generate()) is None or not _build(compiler, source, library)):
        return None
    return _loaded_function(library)


def _loaded_function(library: Path) -> Any:
    """The function that a library exports; with the last reference to it the library is unloaded."""
    try:
        loaded = ctypes.CDLL(str(library))
        function: Any = loaded[FUNCTION_NAME]  # as an attribute the library would keep it, and it the library
    except (OSError, AttributeError):
        return None
    pointer = ctypes.c_void_p
    function.argtypes = [ctypes.c_longlong, ctypes.c_longlong, pointer, pointer, pointer, pointer]
    function.restype = None
    weakref.finalize(function, _ctypes.dlclose, loaded._handle).atexit = False  # a thread may be at work in it then
    return function


def _check_library(library: Path) -> None:
    """Raises InputError for a library that may be somebody else's work."""
    try:
        status = os.lstat(library)
    except OSError:
        return
    if not stat.S_ISREG(status.st_mode) or status.st_uid != os.getuid() or status.st_mode & _OTHERS_WRITE:
        raise InputError(f"{library}: others can write it, and it would be run; remove it, it is built anew")


def _is_intact(library: Path) -> bool:
    """Whether a library is there and ends with the hash of its bytes."""
    try:
        content = library.read_bytes()
    except OSError:
        return False
    return len(content) > 32 and hashlib.sha256(content[:-32]).digest() == content[-32:]


def _build(compiler: Compiler, source: str, library: Path) -> bool:
    """Whether a library could be made of a source; it appears under its name when it is whole."""
    try:
        _remove_abandoned(compiler.folder)
        stage = compiler.folder / interrupts.temporary_name(_PREFIX)
        with interrupts.temporary_folder(stage):
            source_file, staged = stage / "rows.c", stage / "rows.so"
            source_file.write_text(source)
            if not compile_library(compiler, source_file, staged):
                return False
            content = staged.read_bytes()
            staged.write_bytes(content + hashlib.sha256(content).digest())
            staged.chmod(0o700)
            staged.replace(library)
            return True
    except (OSError, subprocess.SubprocessError):
        return False


def compile_library(compiler: Compiler, source_file: Path, library: Path) -> bool:
    """Whether the compiler makes a library of a source, with the flags and libraries that this system has."""
    environment = {**os.environ, "TMPDIR": str(source_file.parent)}  # what a killed compiler leaves goes with the rest
    for flags in (FLAGS, tuple(f for f in FLAGS if f != "-march=native")):
        for libraries in (("-lmvec", "-lm"), ("-lm",)):
            command = [*compiler.command, *flags, str(source_file), "-o", str(library), *libraries]
            completed = subprocess.run(
                command, stdin=subprocess.DEVNULL, capture_output=True, timeout=TIMEOUT, check=False, env=environment
            )
            if completed.returncode == 0:
                return True
    return False


def _remove_abandoned(folder: Path) -> None:
    """Remove what killed runs on this machine have left."""
    for abandoned in folder.iterdir():
        if interrupts.is_abandoned(abandoned.name, _PREFIX):
            shutil.rmtree(abandoned, ignore_errors=True)
