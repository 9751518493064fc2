"""FANUC TP programs in ASCII (.LS): text <-> records <-> meaning.

Any program: ``loads`` and ``dumps`` between bytes and records, without loss. compgen's own: ``compose`` and
``interpret`` between meaning and canonical text.
"""

from compgen.fanuc.canonical.reader import interpret
from compgen.fanuc.canonical.speed_rounding import feed_errors, written_feeds
from compgen.fanuc.canonical.writer import as_written, compose, printed_poses, resolution, writable_speed
from compgen.fanuc.listing.listing import LsProgram, dumps, edited, loads

__all__ = [
    "LsProgram",
    "as_written",
    "compose",
    "dumps",
    "edited",
    "feed_errors",
    "interpret",
    "loads",
    "printed_poses",
    "resolution",
    "writable_speed",
    "written_feeds",
]
