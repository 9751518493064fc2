"""Makes the files that the tutorials begin with: docs/tutorials/data/, laid down by `cgen init --tutorial NAME`.

python docs/tutorial_data.py
"""

from pathlib import Path

HERE = Path(__file__).parent
FOLDER = HERE / "tutorials" / "data"

HEADER = """\
/PROG  PASSES
/ATTR
OWNER\t\t= MNEDITOR;
COMMENT\t\t= "RoboDK sequence";
PROG_SIZE\t= 0;
CREATE\t\t= DATE 26-01-12  TIME 08:30:00;
MODIFIED\t= DATE 26-01-12  TIME 08:30:00;
FILE_NAME\t= PASSES;
VERSION\t\t= 0;
LINE_COUNT\t= {lines};
MEMORY_SIZE\t= 0;
PROTECT\t\t= READ_WRITE;
TCD:  STACK_SIZE\t= 0,
      TASK_PRIORITY\t= 50,
      TIME_SLICE\t= 0,
      BUSY_LAMP_OFF\t= 0,
      ABORT_REQUEST\t= 0,
      PAUSE_REQUEST\t= 0;
DEFAULT_GROUP\t= 1,*,*,*,*;
CONTROL_CODE\t= 00000000 00000000;
/MN
"""


def passes() -> str:
    """A program in the style of RoboDK's FANUC post: eight passes over a plate, seven points on each.

    Home is a position register, the spindle is switched by digital outputs, and each pass is 20 mm beside the last.
    """
    places = [(x, y) for row, y in enumerate(range(-70, 71, 20)) for x in _along(row % 2)]
    ends = (2, len(places) + 1)  # P[1] and the last are above the part
    statements = [
        *("UFRAME_NUM=1 ;", "UTOOL_NUM=1 ;", "J PR[1:HOME] 20% FINE ;", "J P[1] 20% FINE ;"),
        *("DO[1:SPINDLE]=ON ;", "WAIT    .50(sec) ;"),
        *(f"L P[{n}] 80mm/sec {'FINE' if n in ends else 'CNT100'} ;" for n in range(ends[0], ends[1] + 1)),
        *("DO[1:SPINDLE]=OFF ;", f"L P[{ends[1] + 1}] 200mm/sec FINE ;", "J PR[1:HOME] 20% FINE ;"),
    ]
    body = "".join(f"{n:4}:{'' if line[1] == ' ' else '  '}{line}\n" for n, line in enumerate(statements, 1))
    (first, last) = places[0], places[-1]
    points = [(*first, 60.0), *((x, y, 0.0) for x, y in places), (*last, 60.0)]
    positions = "".join(_position(n, point) for n, point in enumerate(points, 1))
    return HEADER.format(lines=len(statements)) + body + "/POS\n" + positions + "/END\n"


def _along(back: bool) -> list[int]:
    """Where the points of a pass are along it [mm]."""
    forth = list(range(-360, 361, 120))
    return forth[::-1] if back else forth


def _position(n: int, point: tuple[float, float, float]) -> str:
    x, y, z = (f"{value:9.3f}" for value in point)
    return (
        f"P[{n}]{{\n   GP1:\n    UF : 1, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n"
        f"    X ={x}  mm,\tY ={y}  mm,\tZ ={z}  mm,\n"
        "    W =  180.000 deg,\tP =    0.000 deg,\tR =    0.000 deg\n};\n"
    )


FRAMES = """\
# The frames of the cell, as the pendant shows them: MENU, SETUP, Frames.
[uframe.1]
x_mm = 1250
y_mm = -50
z_mm = 150
w_deg = 0
p_deg = 0
r_deg = 90

[utool.1]
x_mm = 0
y_mm = 0
z_mm = 120
w_deg = 0
p_deg = 0
r_deg = 0
"""


def files() -> dict[str, str]:
    """Each file by its path in docs/tutorials/data/."""
    return {"robodk/PASSES.LS": passes(), "robodk/frames.toml": FRAMES}


def main() -> None:
    """Write them."""
    for name, text in files().items():
        (FOLDER / name).parent.mkdir(parents=True, exist_ok=True)
        (FOLDER / name).write_text(text)


if __name__ == "__main__":
    main()
