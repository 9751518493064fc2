"""FANUC TP programs in ASCII (.LS): text <-> records <-> meaning.

Any program: ``loads`` and ``dumps`` between bytes and records, without loss. compgen's own: ``compose`` and
``interpret`` between meaning and canonical text.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from compgen.dialects.fanuc_ls.feeds import feed_errors, written_feeds
from compgen.dialects.fanuc_ls.program import Program, estimated_memory, program_name
from compgen.dialects.fanuc_ls.read import interpret
from compgen.dialects.fanuc_ls.write import as_written, compose, printed, steps, writable_speed

if TYPE_CHECKING:
    from compgen.dialects.fanuc_ls.listing import LsProgram, dumps, edited, loads

__all__ = [
    "LsProgram",
    "Program",
    "as_written",
    "compose",
    "dumps",
    "edited",
    "estimated_memory",
    "feed_errors",
    "interpret",
    "loads",
    "printed",
    "program_name",
    "steps",
    "writable_speed",
    "written_feeds",
]


def __getattr__(name: str) -> Any:
    """What reads any program is loaded when it is asked for: writing compgen's own needs none of it."""
    if name in ("LsProgram", "dumps", "edited", "loads"):
        return getattr(import_module("compgen.dialects.fanuc_ls.listing"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
