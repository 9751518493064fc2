"""Ways of a tool by seed: lines, arcs and rapids, as a CAM system or a hand makes them."""

import math
import random
from dataclasses import dataclass

DIGITS = 3  # of drawn places


@dataclass
class Step:
    """One motion of a way."""

    kind: str  # rapid, line, cw, ccw
    end: tuple[float, float, float]
    centre: tuple[float, float] | None = None
    feed: float | None = None  # [mm/min], from here on


def rounded(*values: float) -> tuple:
    return tuple(round(v, DIGITS) + 0.0 for v in values)


def polygon(rng: random.Random) -> list[Step]:
    """A star-shaped polygon, sharp to blunt; now and then closed."""
    count = rng.choice([3, 3, 4, 5, 6, 8, 12, 20, 35, 60])
    radius = rng.uniform(8, 90)
    corners = [
        polar(radius * rng.uniform(0.3, 1), 2 * math.pi * (k + rng.uniform(-0.4, 0.4)) / count) for k in range(count)
    ]
    if rng.random() < 0.7:
        corners.append(corners[0])
    return with_ends(rng, [Step("line", rounded(*c, 0)) for c in corners])


def polar(radius: float, angle: float) -> tuple[float, float]:
    return radius * math.cos(angle), radius * math.sin(angle)


def fillets(rng: random.Random) -> list[Step]:
    """A convex polygon whose corners are arcs that meet its sides without a bend."""
    count = rng.randint(3, 12)
    corners = [polar(rng.uniform(45, 60), 2 * math.pi * k / count) for k in range(count)]
    if rng.random() < 0.5:
        corners.reverse()
    steps = []
    for k, corner in enumerate(corners):
        before, after = corners[k - 1], corners[(k + 1) % count]
        a, b = toward(corner, before), toward(corner, after)
        half = math.acos(max(-1.0, min(1.0, a[0] * b[0] + a[1] * b[1]))) / 2
        room = min(math.dist(corner, before), math.dist(corner, after)) * 0.45
        radius = min(rng.uniform(0.5, 15), room * math.tan(half))
        leg = radius / math.tan(half)
        first = rounded(corner[0] + leg * a[0], corner[1] + leg * a[1], 0)
        last = rounded(corner[0] + leg * b[0], corner[1] + leg * b[1], 0)
        middle = toward((0, 0), (a[0] + b[0], a[1] + b[1]))
        far = radius / math.sin(half)
        centre = corner[0] + far * middle[0], corner[1] + far * middle[1]
        left = (-a[0]) * b[1] - (-a[1]) * b[0] > 0
        steps += [Step("line", first), Step("ccw" if left else "cw", last, centre)]
    return with_ends(rng, [*steps, Step("line", steps[0].end)])


def toward(a, b) -> tuple[float, float]:
    far = math.dist(a, b)
    return (b[0] - a[0]) / far, (b[1] - a[1]) / far


def arcs(rng: random.Random) -> list[Step]:
    """Arcs of every size between lines, helices and full circles."""
    steps, at = [Step("line", (0.0, 0.0, 0.0))], (0.0, 0.0, 0.0)
    for _ in range(rng.randint(1, 5)):
        radius, angle = math.exp(rng.uniform(math.log(1), math.log(40))), rng.uniform(-math.pi, math.pi)
        centre = at[0] + radius * math.cos(angle), at[1] + radius * math.sin(angle)
        if math.hypot(*centre) > 80:
            inward = toward(at[:2], (0, 0))
            centre = at[0] + radius * inward[0], at[1] + radius * inward[1]
        turn = 2 * math.pi if rng.random() < 0.25 else rng.uniform(0.05, 6.2)
        way = rng.choice(["cw", "ccw"])
        begin = math.atan2(at[1] - centre[1], at[0] - centre[0])
        x, y = polar(math.dist(at[:2], centre), begin + (turn if way == "ccw" else -turn))
        height = at[2] + (rng.uniform(-3, 3) if rng.random() < 0.4 else 0)
        end = rounded(centre[0] + x, centre[1] + y, height)
        end = (*at[:2], end[2]) if turn == 2 * math.pi else end
        steps.append(Step(way, end, centre))
        at = end
        if rng.random() < 0.6:
            at = rounded(rng.uniform(-60, 60), rng.uniform(-60, 60), height)
            steps.append(Step("line", at))
    return with_ends(rng, steps)


def plunges(rng: random.Random) -> list[Step]:
    """Down, along, up, over to the next: holes and slots."""
    clear, steps = rng.uniform(2, 20), []
    for _ in range(rng.randint(1, 5)):
        x, y, deep = rng.uniform(-70, 70), rng.uniform(-70, 70), -rng.uniform(0, 8)
        steps += [Step("rapid", rounded(x, y, clear)), Step("line", rounded(x, y, deep))]
        for _ in range(rng.randint(0, 3)):
            x, y = x + rng.uniform(-30, 30), y + rng.uniform(-30, 30)
            steps.append(Step("line", rounded(x, y, deep)))
        steps.append(Step(rng.choice(["rapid", "line"]), rounded(x, y, clear)))
    return steps


def there_and_back(rng: random.Random) -> list[Step]:
    """Sweeps that turn on the spot, and lines driven back on themselves."""
    steps = [Step("line", (0.0, 0.0, 0.0))]
    for k in range(rng.randint(1, 6)):
        far = rng.uniform(1, 80)
        angle = rng.choice([0.0, 0.0, rng.uniform(0, 6.28)])
        steps.append(Step("line", rounded(*polar(far, angle), 0)))
        steps.append(Step("line", rounded(0, 0 if rng.random() < 0.5 else k, 0)))
    return with_ends(rng, steps)


def zigzag(rng: random.Random) -> list[Step]:
    wide, over = rng.uniform(10, 100), rng.uniform(0.2, 8)
    places = [(wide * ((k + 1) // 2 % 2), over * (k // 2)) for k in range(rng.randint(4, 16))]
    return with_ends(rng, [Step("line", rounded(x, y, 0)) for x, y in places])


def wandering(rng: random.Random) -> list[Step]:
    """Lines of every length in every direction, in space."""
    steps = [Step("line", (0.0, 0.0, 0.0))]
    for _ in range(rng.randint(2, 25)):
        far = math.exp(rng.uniform(math.log(0.01), math.log(60)))
        x, y = polar(far, rng.uniform(0, 6.28))
        x0, y0, z0 = steps[-1].end
        x, y = (x0 + x, y0 + y) if math.hypot(x0 + x, y0 + y) < 90 else (x0 - x, y0 - y)
        z = z0 + (far * rng.uniform(-0.5, 0.5) if rng.random() < 0.3 else 0)
        steps.append(Step("line", rounded(x, y, max(-10.0, min(20.0, z)))))
    return with_ends(
        rng, [s for s, before in zip(steps, [None, *steps], strict=False) if before is None or s.end != before.end]
    )


def short_blocks(rng: random.Random) -> list[Step]:
    """A smooth curve as a CAM system writes it: many short lines that hardly turn; the last one may turn sharply."""
    count = rng.choice([60, 200, 600, 600, 1200]) if rng.random() < 0.97 else 10_000
    length = rng.choice([0.01, 0.05, 0.2, 0.5]) if count > 60 else rng.choice([0.5, 2])
    bend = rng.uniform(0.2, 1.9) * rng.choice([-1, 1])
    x = y = angle = 0.0
    steps = [Step("line", (-20.0, 0.0, 0.0)), Step("line", (0.0, 0.0, 0.0))]
    for k in range(count):
        angle += math.radians(bend * math.sin(6.28 * k / count))
        x, y = x + length * math.cos(angle), y + length * math.sin(angle)
        if math.hypot(x, y) > 95:
            break
        steps.append(Step("line", rounded(x, y, 0)))
    if rng.random() < 0.3:
        steps.append(Step("line", rounded(x * 0.3, y * 0.3 + 20, 0)))
    return with_ends(rng, [s for s, b in zip(steps, [None, *steps], strict=False) if b is None or s.end != b.end])


def with_ends(rng: random.Random, steps: list[Step]) -> list[Step]:
    """The way from above its first place and back up, or as it is; some feeds and repeated places on it."""
    if rng.random() < 0.6:
        clear = rng.choice([2, 5, 10, 25])
        first, last = steps[0].end, steps[-1].end
        head = [Step("rapid", rounded(*first[:2], first[2] + clear)), Step("line", first)]
        steps = [*head, *steps[1:], Step(rng.choice(["rapid", "line"]), rounded(*last[:2], last[2] + clear))]
    for step in steps:
        if rng.random() < 1 / (2 + len(steps) / 3):
            step.feed = rng.choice([round(rng.uniform(300, 6000)), round(rng.uniform(100, 3000), 1)])
    if rng.random() < 0.03:
        steps[-1].feed = rng.choice([3, 6, 12.5])
    if rng.random() < 0.06:
        k = rng.randrange(len(steps))
        steps.insert(k + 1, Step("line", steps[k].end))
    return steps


def smooth(rng: random.Random) -> list[Step]:
    """Places of a smooth curve in space, near each other or wide apart."""
    radius, turns, count = rng.uniform(20, 90), rng.uniform(0.3, 3), rng.choice([12, 40, 150, 500])
    high, waves = rng.choice([0, 0, 2]), rng.randint(1, 3)
    steps = []
    for k in range(count):
        t = k / (count - 1)
        x, y = polar(radius * (1 - 0.5 * t), 6.28 * turns * t)
        steps.append(Step("line", rounded(x, y, high * math.sin(6.28 * waves * t))))
    steps[0].feed = rng.choice([None, 3000])
    return steps


def turn_of(at, step: Step) -> float:
    """Angle [rad] of an arc, left round positive."""
    assert step.centre is not None
    cx, cy = step.centre
    a, b = math.atan2(at[1] - cy, at[0] - cx), math.atan2(step.end[1] - cy, step.end[0] - cx)
    turn = (b - a) % (2 * math.pi) if step.kind == "ccw" else -((a - b) % (2 * math.pi))
    return turn or (2 * math.pi if step.kind == "ccw" else -2 * math.pi)


WAYS = {
    "polygon": polygon, "fillets": fillets, "arcs": arcs, "plunges": plunges, "there and back": there_and_back,
    "zigzag": zigzag, "wandering": wandering, "short blocks": short_blocks,
}  # fmt: skip
