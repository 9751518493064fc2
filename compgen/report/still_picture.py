"""A path in space as a picture that needs no script: for paper, for browsers without WebGL, and as a file.

The same view, the same colours and the same ranges as plotly's figure beside it has.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from html import escape, unescape

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, column_extremes, cumulated, dot, numbered, row_norms
from compgen.report.view import View, middle_tick, ticks

Pixels = Callable[[Array], Array]  # places (N, 3) to their pixels (N, 2)
WORD = re.compile(r'<text x="([-0-9.]+)" y="([-0-9.]+)" text-anchor="(start|middle|end)"[^>]*>([^<]*)<')

WIDTH, HEIGHT = 340, 340  # [px]
TOP, EDGE = 70, 6  # for the scale of colours, and around the box with its words [px]
LETTER, LINE = 7.0, 12.0  # of a word: what a letter takes at most, and the height [px]
PIECES = 400  # of the path, each in one colour
CHORD = 0.25  # how far a drawn line is from the path at most [px]
BAR_LEFT, BAR_WIDTH = 60, WIDTH - 120


def still_svg(
    titles: Sequence[str], view: View, places: Array, values: Array, largest: float, colours: Sequence[str]
) -> str:
    """One scene: the scale of its colours, the box with its axes, and the path.

    Args:
        titles: Lines above the scale of colours.
        view: The box, and from where it is seen.
        places: (N, 3) [mm]; a row of NaN interrupts the path.
        values: What colours it, (N,).
        largest: Of the scale, which starts from zero.
        colours: From zero to the largest.
    """
    pixels = _fitted(view)
    share = np.nan_to_num(values) / max(largest, 1e-12)
    level: IntArray = np.clip(share * len(colours), 0, len(colours) - 1).astype(int)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" '
        'font-family="system-ui,sans-serif" font-size="11" fill="currentColor">',
        *_colour_bar(titles, largest, colours),
        *_box(view, pixels),
        *_path(pixels(places), level, colours),
        *_largest(pixels(places), values),
        "</svg>",
    ]
    return "".join(parts)


def side_by_side(panels: Sequence[str], note: str) -> str:
    """Several scenes as one picture on white, for a file."""
    width, height = WIDTH * len(panels), HEIGHT + (20 if note else 0)
    inner = "".join(panel.replace("<svg ", f'<svg x="{k * WIDTH}" ', 1) for k, panel in enumerate(panels))
    words = f'<text x="10" y="{HEIGHT + 10}" font-family="system-ui,sans-serif" font-size="11">{escape(note)}</text>'
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
        f'color="#1e293b" fill="#1e293b"><rect width="{width}" height="{height}" fill="#ffffff"/>{inner}'
        f"{words if note else ''}</svg>\n"
    )


def _fitted(view: View) -> Pixels:
    """Where places lie in the picture: as large as the box and the words at its axes allow, and in the middle."""
    scale, middle = WIDTH / (4 * max(view.extent)), np.array([WIDTH, HEIGHT + TOP]) / 2
    room = np.array([WIDTH, HEIGHT - TOP]) - 2 * EDGE

    def at(scale: float, middle: Array) -> Pixels:
        return lambda points: middle + scale * view.project(points) * [1, -1]

    for _ in range(4):  # words keep their size: what they take does not grow with the box
        low, high = _reach(view, at(scale, middle))
        box = 2 * scale * np.array(view.extent)
        scale *= float(((room - (high - low) + box) / box).min())
        low, high = _reach(view, at(scale, middle))
        middle = middle + np.array([WIDTH, HEIGHT + TOP]) / 2 - (low + high) / 2
    return at(scale, middle)


def _reach(view: View, pixels: Pixels) -> tuple[Array, Array]:
    """Corners of what the box and its words take, (2,) each [px]."""
    ends = np.array([view.low, view.high])
    corners = [pixels(np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)]))]
    for x, y, anchor, text in WORD.findall("".join(_box(view, pixels))):
        length = LETTER * len(unescape(text))
        left = float(x) - {"start": 0.0, "middle": length / 2, "end": length}[anchor]
        corners.append(np.array([[left, float(y) - LINE + 3], [left + length, float(y) + 3]]))
    return column_extremes(np.vstack(corners))


def _largest(flat: Array, values: Array) -> list[str]:
    """A mark where the largest value is; nothing where none is above zero."""
    if not np.isfinite(values).any() or np.nanmax(values) <= 0:
        return []
    x, y = flat[int(np.nanargmax(values))]
    return [f'<path d="M{x:.1f} {y - 6:.1f}l6 6l-6 6l-6 -6z" fill="none" stroke="currentColor" stroke-width="1.5"/>']


def _colour_bar(titles: Sequence[str], largest: float, colours: Sequence[str]) -> Iterator[str]:
    step = BAR_WIDTH / len(colours)
    yield from (
        f'<text x="{WIDTH / 2:g}" y="{13 + 15 * k}" text-anchor="middle" font-size="12">{escape(title)}</text>'
        for k, title in enumerate(titles)
    )
    yield from (
        f'<rect x="{BAR_LEFT + k * step:.1f}" y="36" width="{step + 0.5:.1f}" height="10" fill="{colour}"/>'
        for k, colour in enumerate(colours)
    )
    for value in ticks(0.0, largest, 5):
        x = BAR_LEFT + (BAR_WIDTH * value / largest if largest > 0 else 0.0)
        yield f'<path d="M{x:.1f} 46v4" stroke="currentColor"/>'
        yield f'<text x="{x:.1f}" y="61" text-anchor="middle">{value:g}</text>'


def _box(view: View, pixels: Pixels) -> Iterator[str]:
    """The floor and the far edges of the box, its three axes with numbers, and their names."""
    corner = np.array([view.low, view.high])
    near = (view.eye > 0).astype(int)  # which side of each axis is nearer to the eye
    floor = np.array([[corner[i, 0], corner[j, 1], view.low[2]] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))])
    roof = floor + np.array([0.0, 0.0, view.size[2]])
    outline, top = pixels(floor), pixels(roof)
    grey = 'stroke="currentColor" stroke-opacity="0.35" fill="none"'
    yield f'<path d="{_line(np.vstack([outline, outline[:1]]))}" {grey}/>'
    hidden = np.array([corner[1 - near[0], 0], corner[1 - near[1], 1]])
    for foot, head, place in zip(outline, top, floor, strict=True):
        if (place[:2] == hidden).any():
            yield f'<path d="{_line(np.array([foot, head]))}" {grey}/>'
    back = [k for k in np.argsort(-(floor @ view.eye)) if (floor[k, :2] == hidden).any()]
    order = sorted(back, key=lambda k: top[k, 0])
    yield f'<path d="{_line(top[order])}" {grey}/>'
    left = floor[np.argmin(outline[:, 0])]
    middle = pixels((view.low + view.high)[None] / 2)[0]
    for k in range(3):
        start = left.copy() if k == 2 else np.array([corner[near[0], 0], corner[near[1], 1], view.low[2]])
        start[k] = view.low[k]
        end = start.copy()
        end[k] = view.high[k]
        yield from _axis(view, start, end, k, pixels, middle)


def _axis(view: View, start: Array, end: Array, k: int, pixels: Pixels, middle: Array) -> Iterator[str]:
    name, short = "XYZ"[k], bool(view.short[k])
    ends = pixels(np.array([start, end]))
    length = float(np.linalg.norm(ends[1] - ends[0]))
    direction = (ends[1] - ends[0]) / max(length, 1e-9)
    outward = np.array([direction[1], -direction[0]])
    if outward @ (ends.mean(axis=0) - middle) < 0:
        outward = -outward
    anchor = "middle" if abs(outward[0]) < 0.3 else "start" if outward[0] > 0 else "end"
    yield f'<path d="{_line(ends)}" stroke="currentColor" fill="none"/>'
    numbers = [middle_tick(start[k], end[k])] if short else ticks(start[k], end[k], max(1, int(length / 42)))
    for value in numbers:
        place = start.copy()
        place[k] = value
        x, y = pixels(place[None])[0]
        words = f"{name} {value:g} mm" if short else f"{value:g}"
        (dx, dy), (tx, ty) = 4 * outward, 7 * outward
        yield f'<path d="M{x:.1f} {y:.1f}l{dx:.1f} {dy:.1f}" stroke="currentColor"/>'
        yield f'<text x="{x + tx:.1f}" y="{y + ty + 4:.1f}" text-anchor="{anchor}">{words}</text>'
    if short:
        return
    x, y = ends.mean(axis=0) + (30 if k < 2 else 26) * outward
    if k == 2:
        x, y, anchor = ends[1, 0], ends[1, 1] - 7, "middle"
    yield f'<text x="{x:.1f}" y="{y + 4:.1f}" text-anchor="{anchor}" font-weight="600">{name} [mm]</text>'


def _path(flat: Array, level: IntArray, colours: Sequence[str]) -> Iterator[str]:
    """Lines of one colour each: that of the largest value on the piece."""
    drawn: BoolArray = np.isfinite(flat[:, 0])
    step = np.where(drawn[1:] & drawn[:-1], np.linalg.norm(np.diff(flat, axis=0), axis=1), 0.0)
    way = cumulated(step)
    piece = np.minimum((PIECES * way / max(way[-1], 1e-9)).astype(int), PIECES - 1)
    highest = np.zeros(PIECES, dtype=int)
    np.maximum.at(highest, piece[drawn], level[drawn])
    colour = highest[piece]
    starts = np.flatnonzero(np.concatenate([[True], (np.diff(colour) != 0) | (drawn[1:] != drawn[:-1])]))
    last = np.append(starts[1:], len(flat))
    last -= ~np.append(drawn, False)[last]  # up to the next piece
    starts, last = starts[drawn[starts]], last[drawn[starts]]
    keep = _simplified(flat, starts, last)
    for first, end in zip(starts, last + 1, strict=True):
        points = flat[first:end]
        shade = colours[colour[first]]
        if len(points) == 1:
            yield f'<circle cx="{points[0, 0]:.1f}" cy="{points[0, 1]:.1f}" r="3" fill="{shade}"/>'
        else:
            line = _line(points[keep[first:end]])
            yield f'<path d="{line}" stroke="{shade}" stroke-width="2.2" stroke-linecap="round" fill="none"/>'


def _simplified(points: Array, first: IntArray, last: IntArray) -> BoolArray:
    """Which points (N,) lines from first to last rows (L,) cannot do without, by Douglas and Peucker, all at once."""
    keep = np.zeros(len(points), dtype=bool)
    keep[first] = keep[last] = True
    while True:
        is_open = last - first >= 2
        first, last = first[is_open], last[is_open]
        if not len(first):
            return keep
        way, number = numbered(last - first - 1)
        row = first[way] + 1 + number
        chord, inner = points[last] - points[first], points[row] - points[first[way]]
        square = dot(chord, chord)
        along = np.clip(dot(inner, chord[way]) / np.where(square > 0, square, 1.0)[way], 0.0, 1.0)
        distance = row_norms(inner - along[:, None] * chord[way])
        farthest = np.maximum.reduceat(distance, np.flatnonzero(number == 0))
        largest = np.flatnonzero(distance == farthest[way])
        middle = row[largest[np.unique(way[largest], return_index=True)[1]]]
        far = farthest > CHORD
        keep[middle[far]] = True
        first, last = np.concatenate([first[far], middle[far]]), np.concatenate([middle[far], last[far]])


def _line(points: Array) -> str:
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
