r"""Values of position registers PR[n] when a program starts: from a TOML table, or from a controller's POSREG.VA.

    [pr.5]                          [*POSREG*]$POSREG  Storage: ...  ARRAY[1,100] OF Position Reg
    x_mm = 0                            [1,5] =   'shift'
    ...                               Group: 1   Config: N U T, 0, 0, 0
    r_deg = 0                         X:      .000   Y:     0.000   Z:    50.000
                                      W:     0.000   P:     0.000   R:     0.000

A register in joint form is known as such, and no more: it shifts joints, not a place. One that is not initialised is
not known.
"""

import re
from dataclasses import dataclass

from compgen.core.exceptions import InputError
from compgen.core.toml import parse_toml
from compgen.program.pose_table import pose_values, printed_coordinates, read_controller_table, unnamed

CARTESIAN, JOINT, EITHER = "cartesian", "joint", ""  # forms of a register; EITHER where a program leaves it open
_RECORD = re.compile(r"^\[\*POSREG\*\]\$POSREG\b[^\n]*\n((?:(?!\[).*\n?)*)", re.MULTILINE)
_ENTRY = re.compile(r"^\s*\[1,\s*([0-9]{1,4})\]\s*=((?:(?!^\s*\[\d).*\n?)*)", re.MULTILINE)
_JOINT = re.compile(r"\bJ[1-6]\s*=")


@dataclass(frozen=True, slots=True)
class Register:
    """What is known of a position register: X Y Z [mm], W P R [deg]; None for a number that is not known."""

    form: str = EITHER
    values: tuple[float | None, ...] = (None,) * 6


def load_registers(path: str) -> dict[int, Register]:
    """Registers by number, from a TOML table, or from POSREG.VA by its ending.

    Raises:
        InputError: Not readable, an unknown key, a number out of range; names file and key.
    """
    text = read_controller_table(path, "registers", "POSREG.VA")
    return _from_backup(text, path) if path.lower().endswith(".va") else _from_toml(text, path)


def _from_toml(text: str, path: str) -> dict[int, Register]:
    data = parse_toml(text, path)
    for key in data:
        if key != "pr" or not isinstance(data[key], dict):
            raise InputError(f"{path}: {key:.40}: unknown key; give [pr.N] with x_mm to r_deg")
    registers = {}
    for number, table in data.get("pr", {}).items():
        if not re.fullmatch(r"[1-9][0-9]{0,3}", number):
            raise InputError(f"{path}: pr.{number:.40}: a register's number is 1 to 9999")
        registers[int(number)] = Register(CARTESIAN, tuple(pose_values(table, f"pr.{number}", path)))
    return registers


def _from_backup(text: str, path: str) -> dict[int, Register]:
    records = _RECORD.findall(text.replace("\r\n", "\n").replace("\n    [", "\n     ["))
    if not records:
        raise InputError(f"{path}: no $POSREG in it; give POSREG.VA of a backup")
    registers = {}
    for number, entry in _ENTRY.findall(unnamed("".join(records))):
        key = f"$POSREG[1,{number}]"
        values = printed_coordinates(entry, key, path)
        if int(number) in registers:
            raise InputError(f"{path}: {key} is there twice; give one controller's backup")
        if values is not None:
            registers[int(number)] = Register(CARTESIAN, values)
        elif _JOINT.search(entry):
            registers[int(number)] = Register(JOINT)
    return registers
