"""What a controller would drive, call after call, by the naive reader: no code of the package."""

import naive_ls


def way(main: bytes, files: dict[str, bytes]):
    """Motions in the order of the calls: (page, letter, places, speed, termination, rest)."""
    rows = []
    for name in calls(main):
        rows += [(name, *row) for row in drive(files[name])]
    return rows


def drive(data: bytes):
    places, moves = naive_ls.read(data)
    rows = []
    for m in moves:
        if not m.disabled:
            goals = tuple(numbers(places, t) for t in m.targets)
            rows.append((m.letter, goals, m.speed, m.termination, m.rest))
    return rows


def numbers(places, target):
    """All numbers of a position, frames and CONFIG; or the target's text when the file does not hold it."""
    inside = target[2:-1].partition(":")[0].strip()
    if target[:2] != "P[" or not inside.isdigit() or int(inside) not in places:
        return target
    groups = places[int(inside)].groups
    return tuple((g, v.uf, v.ut, v.config, tuple(sorted(v.axes.items()))) for g, v in sorted(groups.items()))


def calls(main: bytes):
    text = naive_ls.sections(naive_ls.lines_of(main.decode("latin-1")))["MN"]
    statements = [line.partition(":")[2].partition(";")[0].strip() for line in text]
    return [s.split()[1] for s in statements if s.startswith("CALL ")]


def name_of(data: bytes) -> str:
    return data.decode("latin-1").split()[1]
