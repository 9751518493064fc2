"""The real arm, independently: what a program's text makes it do."""

from compgen.verification.twin.execution import Execution, PreparedProgram, execute, owning_segments, prepare
from compgen.verification.twin.faulty_arm import TwinError
from compgen.verification.twin.real_arm import Twin

__all__ = ["Execution", "PreparedProgram", "Twin", "TwinError", "execute", "owning_segments", "prepare"]
