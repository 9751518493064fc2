"""The one function of the public face that writes a file."""

from pathlib import Path

from compgen.cli.output_files.publish import write_file
from compgen.core.exceptions import InputError
from compgen.core.toml import brief_value
from compgen.report.notebook.arguments import File, file_name
from compgen.report.notebook.jobs import GeneratedProgram
from compgen.report.notebook.programs import AnyProgram, bytes_of


def write_program(program: AnyProgram | GeneratedProgram, file: File) -> None:
    """Write a program, whole or not at all; a file of that name is replaced.

    Args:
        program: What ``read_program``, ``generate`` or ``correct`` returned, or the bytes of a listing. A generated
            program of several pages is refused: ``files()`` has them all.
        file: Its name.

    Raises:
        InputError: It cannot be written, or is no program of one file.
    """
    name = file_name(file, "file", "a file's name, as 'PART.LS'")
    write_file(Path(name), _text(program))


def _text(program: object) -> bytes:
    """The bytes of a program."""
    if isinstance(program, GeneratedProgram):
        if len(program.programs) > 1:
            raise InputError(f"program: it has {len(program.programs)} files; write each of program.programs instead")
        return program.text
    content = bytes_of(program)
    if content is None:
        raise InputError(f"program: {brief_value(program)} is no program; give what compgen.read_program returns")
    return content
