"""What a controller would drive, call after call, by the naive reader: no code of the package."""

import naive_ls


def motions_of(data: bytes):
    """Active motions in order: (letter, targets, speed, termination, rest)."""
    positions, moves = naive_ls.read(data)
    rows = []
    for m in moves:
        if not m.disabled:
            targets = tuple(numbers(positions, t) for t in m.targets)
            rows.append((m.letter, targets, m.speed, m.termination, m.rest))
    return rows


def numbers(positions, target):
    """All numbers of a position, frames and CONFIG; or the target's text when the file does not hold it."""
    inside = target[2:-1].partition(":")[0].strip()
    if target[:2] != "P[" or not inside.isdigit() or int(inside) not in positions:
        return target
    groups = positions[int(inside)].groups
    return tuple((g, v.uf, v.ut, v.config, tuple(sorted(v.axes.items()))) for g, v in sorted(groups.items()))


def calls(main: bytes):
    text = naive_ls.sections(naive_ls.lines_of(main.decode("latin-1")))["MN"]
    statements = [line.partition(":")[2].partition(";")[0].strip() for line in text]
    return [s.split()[1] for s in statements if s.startswith("CALL ")]


def name_of(data: bytes) -> str:
    return data.decode("latin-1").split()[1]
