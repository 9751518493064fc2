"""FANUC TP programs in ASCII (.LS): text <-> records <-> meaning."""

from compgen.dialects.fanuc_ls.program import Program, estimated_memory, program_name
from compgen.dialects.fanuc_ls.read import loads
from compgen.dialects.fanuc_ls.write import dumps, largest_feed_error, writable_speed

__all__ = ["Program", "dumps", "estimated_memory", "largest_feed_error", "loads", "program_name", "writable_speed"]
