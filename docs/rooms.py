"""Draws docs/rooms.svg from the code: the fourteen rooms in the order of the data flow, and which rooms each imports.

python docs/rooms.py
"""

import ast
from html import escape
from pathlib import Path

HERE = Path(__file__).parent
PACKAGE = HERE.parent / "compgen"
ROOMS = (
    "core", "robot", "planning", "thermal", "error_model", "compensation",
    "program", "fanuc", "job", "verification", "identification", "pipelines", "report", "cli",
)  # fmt: skip
TOP, ROW, LEFT, GRID, CELL = 62, 46, 20, 640, 24
INK, FAINT, LINE, DOT = "#1e293b", "#64748b", "#e2e8f0", "#0f766e"


def rooms_imported(room: str) -> set[str]:
    """The other rooms that a room's files import."""
    names = set()
    for path in (PACKAGE / room).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module == "compgen":
                names |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("compgen."):
                names.add(str(node.module).split(".")[1])
    return (names & set(ROOMS)) - {room}


def sentence(room: str) -> str:
    """The first line of the room's docstring, without its full stop."""
    text = ast.get_docstring(ast.parse((PACKAGE / room / "__init__.py").read_text())) or ""
    return text.splitlines()[0].rstrip(".")


def text(x: float, y: float, words: str, fill: str, size: int = 13, more: str = "") -> str:
    """One line of text."""
    return f'<text x="{x:g}" y="{y:g}" fill="{fill}" font-size="{size}"{more}>{escape(words)}</text>'


def picture() -> str:
    """The text of docs/rooms.svg, from the imports."""
    width, height = GRID + CELL * len(ROOMS) + 10, TOP + ROW * len(ROOMS) + 16
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" role="img" '
        'aria-label="The fourteen rooms of compgen and which rooms each imports">',
        f'<rect width="{width}" height="{height}" fill="white"/>',
        text(LEFT, 30, "The rooms, in the order of the data flow", INK, 17),
        text(GRID, 30, "imports", INK, 15),
    ]
    out += [text(GRID + k * CELL + 7, TOP - 8, str(k + 1), FAINT, 11) for k in range(len(ROOMS))]
    for n, room in enumerate(ROOMS):
        y = TOP + n * ROW
        files = len([p for p in (PACKAGE / room).rglob("*.py") if p.name != "__init__.py"])
        out += [
            f'<rect x="{LEFT}" y="{y}" width="{GRID - LEFT - 20}" height="{ROW - 6}" rx="5" fill="#f8fafc" '
            f'stroke="{LINE}"/>',
            text(LEFT + 10, y + 25, str(n + 1), FAINT, 12),
            text(LEFT + 34, y + 17, f"{room}/", INK, 14, ' font-weight="600"'),
            text(LEFT + 34, y + 33, sentence(room), FAINT, 12),
            text(GRID - 30, y + 17, f"{files} files", FAINT, 11, ' text-anchor="end"'),
        ]
        imported = rooms_imported(room)
        for k, other in enumerate(ROOMS[: n + 1]):
            x = GRID + k * CELL + 10
            if k == n:
                out.append(f'<rect x="{x - 6}" y="{y + 14}" width="12" height="12" rx="2" fill="{LINE}"/>')
            elif other in imported:
                out.append(f'<circle cx="{x}" cy="{y + 20}" r="5" fill="{DOT}"/>')
            else:
                out.append(f'<circle cx="{x}" cy="{y + 20}" r="1.5" fill="{LINE}"/>')
    out.append("</svg>")
    return "\n".join(out) + "\n"


if __name__ == "__main__":
    (HERE / "rooms.svg").write_text(picture())
