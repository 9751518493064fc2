"""FANUC TP programs in ASCII (.LS): text <-> records <-> meaning.

Any program: ``loads`` and ``dumps`` between bytes and records, without loss. compgen's own: ``compose`` and
``interpret`` between meaning and canonical text.
"""

from compgen.fanuc.canonical.reader import interpret
from compgen.fanuc.canonical.writer import compose
from compgen.fanuc.listing.listing import LsProgram, dumps, edited, loads

__all__ = [
    "LsProgram",
    "compose",
    "dumps",
    "edited",
    "interpret",
    "loads",
]
