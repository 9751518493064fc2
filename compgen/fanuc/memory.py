"""What programs take of the controller's program store, fitted over real exports."""

from compgen.program.program import Program

#: Bytes of a program, of a single-group position and of a motion line.
MEMORY_PROGRAM, MEMORY_POSITION, MEMORY_MOTION = 400, 35, 28
MEMORY_REMARK = 40.0  # bytes that a remark at a page's head takes at most
MEMORY_CALL = 50.0  # bytes of a call in the main program besides the name, its message and its pause included


def estimated_memory(program: Program) -> float:
    """Bytes of a program of compgen's own."""
    return MEMORY_PROGRAM + len(program.position) * (MEMORY_POSITION + MEMORY_MOTION)
