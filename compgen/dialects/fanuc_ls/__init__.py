"""FANUC TP programs in ASCII (.LS): text <-> records <-> meaning.

Any program: ``loads`` and ``dumps`` between bytes and records, without loss. compgen's own: ``compose`` and
``interpret`` between meaning and canonical text.
"""

from compgen.dialects.fanuc_ls.feeds import feed_errors, written_feeds
from compgen.dialects.fanuc_ls.listing import LsProgram, dumps, edited, loads
from compgen.dialects.fanuc_ls.program import Program, estimated_memory, program_name
from compgen.dialects.fanuc_ls.read import interpret
from compgen.dialects.fanuc_ls.write import as_written, compose, printed, steps, writable_speed

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
