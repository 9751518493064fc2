"""CAM files by seed: G-code, APT and CSV points, wider than what any reader here is written for.

A way is written in a drawn manner. Some files have a word that changes where the tool goes and that a reader may not
know: they may be refused, but not passed over. All others are plain: whoever refuses one of them refuses a user's good
file.
"""

import math
import random
from dataclasses import dataclass, field

from cam_ways import DIGITS, WAYS, Step, smooth, turn_of


@dataclass
class Case:
    """A path file, the file it names, and whether it is plain."""

    seed: int
    pattern: str
    shape: str
    file: str
    text: str
    path: str
    trap: str = ""  # the word that may be refused
    keys: dict = field(default_factory=dict)  # what the path file says, for the judge


# G-code ----------------------------------------------------------------------------------------------------------

#: Words that change where the tool goes, or may; a place behind which they stand is drawn.
G_TRAPS = (
    "G55", "G54\nG56", "G20", "G41 D1", "G42", "G43 H1", "G28 Z0", "G92 X0 Y0", "G92 X5", "G81 X1 Y1 Z-3 R2",
    "G53 G0 Z0", "#1=5", "X[1+2]", "A30", "B5.", "C90", "M98 P100", "M99", "G18", "G19", "G93", "G95", "G51 P2",
    "G68 R30", "G52 X3", "G10 L2 P1 X3", "G5 X1 Y1", "G33 Z-1 K1", "G4 X0.5", "G4 X3.0 P1", "/G1 X30",
    "(an open remark", "G91.1\nG90.1", "M6 T2", "G1 X1 X2", "G0 G1 X3", "U3", "G38.2 Z-4", "G7", "G1 X1e1", "G1 X--3",
    "G1 X1.2.3", "O100 call", "G64 P0.5", "G1 X", "G50", "G1 Z5 Q3", "G1 W-3", "G70", "GOTO 10", "G1 X1,5",
)  # fmt: skip
ARC_TRAPS = ("P2", "P3", "K1.5", "L2")
STILL_WORDS = (
    "M3 S800", "M5", "M8", "M9", "M7", "S1200", "M1", "G40", "G49", "G80", "G94", "G17", "G21", "G90", "G4 P0.5",
)  # fmt: skip
REMARKS = (
    "(a remark)", "(G1 X100 Z-50)", "(M30)", "; to the end G0 Z-9", "(MSG, go on)", "(T1 D=10. CR=0)", "()", "(%)",
    "( 1.5 ) ; two", "; (",
)  # fmt: skip


def gcode_text(rng: random.Random, steps: list[Step], trap: str) -> str:
    """A way as G-code, in a drawn manner."""
    lower, packed, numbered = rng.random() < 0.15, rng.random() < 0.2, rng.random() < 0.3
    plus, bare, modal = rng.random() < 0.1, rng.random() < 0.4, rng.random() < 0.7
    by_radius, mixing, percent = rng.random() < 0.3, rng.random() < 0.25, rng.random() < 0.25
    wide, over_first = rng.random() < 0.1, rng.random() < 0.5
    split = steps[0].kind == "rapid" and rng.random() < 0.15

    def number(value: float) -> str:
        text = f"{value:.{DIGITS + 1}f}".rstrip("0")
        if bare:
            text = text.removesuffix(".")
            text = text.replace("0.", ".", 1) if text.startswith(("0.", "-0.")) else text
        elif rng.random() < 0.5:
            text = f"{value:.{DIGITS + 1}f}"
        text = "0" if text in ("-0", "-", "", ".", "-.") else text
        return "+" + text if plus and value >= 0 else text

    def block(*parts: str) -> str:
        parts = tuple(p for p in parts if p)
        if rng.random() < 0.1:
            parts = tuple(rng.sample(parts, len(parts)))  # the order of words means nothing
        text = ("" if packed else "  " if wide else " ").join(parts)
        return text.lower() if lower else text

    out = ["%"] if percent else []
    if rng.random() < 0.3:
        out.append("O1001" if percent else "(made by hand)")
    head = ["G21", "G90", "G17"]
    if rng.random() < 0.5:
        head.append(f"G{rng.choice([54, 54, 55])}")
    if rng.random() < 0.2:
        out.append("T1 M6")
    rng.shuffle(head)
    out.append(block(*head) if rng.random() < 0.8 else "\n".join(head))
    at: tuple | None = None
    absolute, said, feed_due = True, "", None
    trap_at = rng.randrange(1, len(steps)) if len(steps) > 1 else 0
    for k, step in enumerate(steps):
        if mixing and at is not None and rng.random() < 0.3:
            absolute = not absolute
            mode = "G90" if absolute else "G91"
            if rng.random() < 0.5:
                out.append(block(mode))
                mode = ""
        else:
            mode = ""
        if at is not None and rng.random() < 0.5 / (1 + len(steps) / 8):
            words = [w for w in STILL_WORDS if absolute or w != "G90"]
            out.append(rng.choice([*REMARKS, *words, "", "   "]))
            said = "" if out[-1] == "G80" else said  # which ends G1 as well
        if trap and k == trap_at and trap not in ARC_TRAPS:
            out.append(trap)
        word = {"rapid": "G0", "line": "G1", "cw": "G2", "ccw": "G3"}[step.kind]
        word = word.replace("G", "G0") if rng.random() < 0.2 else word
        shown = "" if modal and said == step.kind else word
        said = step.kind
        values = []
        turning = step.centre is not None
        for axis, value, before in zip("XYZ", step.end, at or (None, None, None), strict=False):
            left_out = before is not None and value == before and modal and rng.random() < 0.9
            if not left_out:
                values.append(axis + number(value if absolute or before is None else value - before))
        if split and at is None:  # what the first of two blocks does not say is not known
            out.append(block("G0", *(values[:2] if over_first else values[2:])))
            values = values[2:] if over_first else values[:2]
        if turning:
            assert at is not None
            assert step.centre is not None
            i, j = step.centre[0] - at[0], step.centre[1] - at[1]
            middle = math.dist(at[:2], step.end[:2])
            swept = turn_of(at, step)
            if by_radius and middle > 0.5 and abs(abs(swept) - math.pi) > 0.2 and abs(swept) < 5.5:
                radius = math.hypot(i, j)
                values.append("R" + number(radius if abs(swept) < math.pi else -radius))
            else:
                values += [
                    letter + number(v)
                    for letter, v in (("I", i), ("J", j))
                    if round(v, DIGITS + 1) or rng.random() < 0.5
                ]
                if not any(v[0] in "IJ" for v in values):
                    values.append("I0")
            if trap in ARC_TRAPS:
                values.append(trap)
        if not values and not step.feed:
            values = ["X" + number(step.end[0] if absolute else 0)]
        feed_due = step.feed or feed_due
        feed = ""
        if feed_due and step.kind != "rapid":
            feed, feed_due = f"F{feed_due:g}", None
        remark = rng.choice(REMARKS) if rng.random() < 0.05 else ""
        text = block(mode, shown, *values, feed)
        out.append(f"{text} {remark}" if remark else text)
        at = step.end
    assert at is not None
    behind = rng.random()
    wild = block("G90", "G1", "X250", "Y-200", "Z-60")
    if behind < 0.1:
        out.append(block("G90", "G1", f"X{number(at[0])}", f"Y{number(at[1])}", f"Z{number(at[2] + 3)}", "M30"))
    elif percent and behind < 0.4:
        pass
    elif behind < 0.9:
        out.append(block(rng.choice(["M30", "M2", "M02"])))
    if percent:
        out.append("%")
    if (percent or behind < 0.9) and rng.random() < 0.3:
        out += rng.choice([[wild], [wild, "M30"], ["(rest)", wild], ["G55", wild], ["Z-60"], ["not G-code at all"]])
    if numbered:
        out = [
            f"N{10 * k} {t}" if t.strip() not in ("%", "") and t[:1] not in "/Oo(" else t for k, t in enumerate(out, 1)
        ]
    return rng.choice(["\n", "\n", "\n", "\r\n"]).join("\n".join(out).split("\n")) + rng.choice(["\n", "\n", ""])


# APT -------------------------------------------------------------------------------------------------------------

APT_TRAPS = (
    "REFSYS/1,0,0,10,0,1,0,20,0,0,1,5", "TLAXIS/0,0,1", "TLAXIS/0.1,0,0.995", "MODE/INCR", "CALL/SUB1", "LOOPST",
    "LOOPND", "INSERT/G92X10", "INSERT G0 Z-5", "OFSTNO/2", "UNITS/INCHES", "TRANS/10,0,0", "ROTABL/45",
    "ROTATE/AAXIS,30", "CYCLE/DRILL,5,100,MMPM", "GOHOME", "COPY/1,TRANSL,10,0,0,2", "TRACUT/M1", "GODLTA/-5",
    "CUTCOM/LEFT", "ORIGIN/5,0,0", "P1=POINT/3,4,5", "A1)GOTO/1,2,3", "GOFWD/L1", "GORGT/C1,PAST,L2", "INDIRV/1,0,0",
    "FEDRAT/10,IPM", "FEDRAT/0.2,MMPR", "GOTO/P1", "GOTO/1,2", "GOTO/1,2,3,4", "LOADTL/2", "PREFUN/92", "MACRO",
    "TERMAC", "SELECT/OFFSET,3", "RETRCT", "CLEARP/XYPLAN,30", "MATRIX/TRANSL,1,2,3", "JUMPTO/A1", "GOTO/1,2,3,0,0,5",
    "POINT/1,2,3", "FROM/40,40,40", "MIRROR/X", "SET/OFSETL,1", "MOTION/INCR", "GOTO/1,2,Z", "COUPLE/1", "SPLINE/1",
)  # fmt: skip
APT_STILL = (
    "COOLNT/ON", "COOLNT/OFF", "SPINDL/1200,RPM,CLW", "SPINDL/OFF", "PPRINT GOTO/1,2,3", "PPRINT/a word",
    "$$ GOTO/500,0,0", "CUTTER/10.,2.", "STOP", "OPSTOP", "", "$$", "REMARK GOTO/100,100,-50",
)  # fmt: skip


def apt_text(rng: random.Random, steps: list[Step], trap: str, normals: bool) -> str:
    """A way as APT."""
    lower, spaced, delta = rng.random() < 0.1, rng.random() < 0.5, rng.random() < 0.2
    tilt = rng.uniform(0, 0.15), rng.uniform(0, 6.28)
    out = ["PARTNO A PART GOTO/9,9,9", "MACHIN/ROBOT,1"] if rng.random() < 0.7 else []
    out += ["UNITS/MM"] if rng.random() < 0.8 else []
    out += ["LOADTL/1"] if rng.random() < 0.3 else []
    out += ["MULTAX"] if normals and rng.random() < 0.7 else []
    if rng.random() < 0.4:
        out.append("CUTTER/ 12.0, $\n  1.5")

    def number(value: float) -> str:
        return f"{value:.{DIGITS}f}" if rng.random() < 0.7 else f"{value:.{DIGITS + 1}f}"

    def numbers(values) -> str:
        return (", " if spaced else ",").join(number(v) for v in values)

    def goto(place) -> str:
        x, y = place[:2]
        n: tuple[float, ...] = ()
        if normals:
            a = tilt[0] * math.sin(x / 60 + tilt[1]), tilt[0] * math.cos(y / 70)
            n = a[0], a[1], math.sqrt(1 - a[0] ** 2 - a[1] ** 2)
        text = numbers(place) + "".join(f",{v:.6f}" for v in n)
        if rng.random() < 0.1:
            first, comma, rest = text.partition(",")
            text = f"{first}{comma}$\n{rest}"
        text = ("GOTO / " if spaced else "GOTO/") + text
        return text.lower() if lower else text

    at: tuple[float, float, float] | None = None
    trap_at = rng.randrange(1, len(steps))
    for k, step in enumerate(steps):
        if at is not None and rng.random() < 0.4 / (1 + len(steps) / 8):
            out.append(rng.choice(APT_STILL))
        if trap and k == trap_at:
            out.append(trap)
        if step.feed:
            out.append(f"FEDRAT/{step.feed:g}" + rng.choice(["", ",MMPM"]))
        if step.kind == "rapid":
            out.append("RAPID")
        if at is None and rng.random() < 0.2 and step.kind != "rapid":
            out.append(goto(step.end).replace("GOTO", "FROM").replace("goto", "FROM"))
        elif step.centre is not None:
            assert at is not None
            radius = math.dist(at[:2], step.centre)
            k_axis = 1 if step.kind == "ccw" else -1
            out.append(f"CIRCLE/{numbers((*step.centre, at[2]))},0,0,{k_axis},{radius:.4f}")
            out.append(goto(step.end))
        elif delta and at is not None and rng.random() < 0.4:
            out.append("GODLTA/" + ",".join(f"{e - a:.{DIGITS}f}" for e, a in zip(step.end, at, strict=False)))
        else:
            out.append(goto(step.end))
        at = step.end
    if rng.random() < 0.8:
        out.append("FINI")
        if rng.random() < 0.3:
            out += [goto((250, -200, -60)), "FINI"][: rng.randint(1, 2)]
    return "\n".join(out) + "\n"


# CSV -------------------------------------------------------------------------------------------------------------

CSV_TRAPS = ("x_in", "gap", "word", "twice", "a_deg", "inf")


def csv_text(rng: random.Random, steps: list[Step], trap: str, normals: bool) -> str:
    """Places of a way as CSV; arcs are not drawn for it."""
    columns = ["x_mm", "y_mm", "z_mm"]
    columns += ["i", "j", "k"] if normals else []
    columns += [c for c in ("feed_mm_s", "contact", "stop") if rng.random() < 0.25]
    rng.shuffle(columns) if rng.random() < 0.3 else None
    rows = []
    for step in steps:
        x, y, _ = step.end
        a = 0.1 * math.sin(x / 60), 0.1 * math.cos(y / 70)
        values = dict(zip("ijk", (f"{v:.7f}" for v in (*a, math.sqrt(1 - a[0] ** 2 - a[1] ** 2))), strict=False))
        values |= {c: f"{v:.{DIGITS}f}" for c, v in zip(("x_mm", "y_mm", "z_mm"), step.end, strict=False)}
        values["feed_mm_s"] = f"{step.feed / 60:.3f}" if step.feed else ""
        values["contact"] = "0" if step.kind == "rapid" else "1"
        values["stop"] = "1" if rng.random() < 0.05 else "0"
        rows.append([values[c] for c in columns])
    if trap == "x_in":
        columns = ["x_in" if c == "x_mm" else c for c in columns]
    elif trap == "a_deg":
        columns, rows = [*columns, "a_deg"], [[*r, "10"] for r in rows]
    elif trap:
        k = rng.randrange(len(rows))
        rows[k] = {
            "gap": rows[k][:-1],
            "word": ["here", *rows[k][1:]],
            "twice": [*rows[k], "1"],
            "inf": ["inf", *rows[k][1:]],
        }[trap]
    blank = rng.choice(["", "", " "])
    lines = [("," + blank).join(r) for r in [columns, *rows]]
    return rng.choice(["\n", "\r\n"]).join(lines) + "\n"


# A case ----------------------------------------------------------------------------------------------------------


def drawn(seed: int) -> Case:
    """A file and the path file that names it."""
    rng = random.Random(f"cam {seed}")
    pattern = rng.choices(["gcode", "apt", "points"], [6, 3, 2])[0]
    shape = rng.choice([w for w in WAYS if pattern != "points" or w not in ("arcs", "fillets")])
    if pattern == "apt" and shape in ("arcs", "fillets") and rng.random() < 0.6:
        shape = "polygon"
    smoothly = pattern == "points" and rng.random() < 0.4
    steps = smooth(rng) if smoothly else WAYS[shape](rng)
    shape = "smooth" if smoothly else shape
    trap = rng.choice({"gcode": G_TRAPS, "apt": APT_TRAPS, "points": CSV_TRAPS}[pattern]) if rng.random() < 0.25 else ""
    if trap and pattern == "gcode" and any(s.centre for s in steps) and rng.random() < 0.5:
        trap = rng.choice(ARC_TRAPS)
    normals = pattern != "gcode" and rng.random() < 0.6
    if pattern == "gcode":
        file, text = "part.nc", gcode_text(rng, steps, trap)
    elif pattern == "apt":
        file, text = "part.apt", apt_text(rng, steps, trap, normals)
        if not trap and any(s.centre for s in steps):
            trap = "CIRCLE"
    else:
        file, text = "part.csv", csv_text(rng, steps, trap, normals)
    keys: dict = {"path": {"pattern": pattern, "file": file}}
    if rng.random() < 0.7:
        keys["path"]["tolerance_um"] = rng.choice([2, 2, 5, 10, 20, 50])
    if pattern == "points":
        keys["path"]["jump_mm"] = 10000
        through = rng.choice(["lines", "lines", "points", "tolerance", ""])
        keys["path"] |= {"through": through} if through else {}
    if rng.random() < 0.2:
        keys["path"] |= {"x_mm": round(rng.uniform(-50, 50), 2), "z_mm": round(rng.uniform(-50, 50), 2)}
    number = rng.uniform
    place = number(950, 1250), number(-250, 250), number(0, 350), number(-2, 2), number(-2, 2), number(-180, 180)
    names = ("x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg")
    keys["frame"] = {k: round(v, 3) for k, v in zip(names, place, strict=False)}
    keys["process"] = {
        "feed_mm_s": round(number(20, 120), 1),
        "lift_mm": rng.choice([0, 5, 20]),
        "chord_um": rng.choice([1.5, 1.5, 3]),
    }
    if rng.random() < 0.12:
        keys["process"] |= {"moves": "arcs", "thin_um": keys["process"]["chord_um"]}
    if rng.random() < 0.4:
        keys["tool"] = {
            "x_mm": round(number(-30, 30), 2),
            "z_mm": round(number(0, 150), 2),
            "spin_deg": round(number(-90, 90), 1),
        }
    keys["bounds"] = {"max_um": 100}
    keys["before"] = [{"state": "moving", "feed_mm_s": 100, "duration_h": rng.choice([0.5, 2])}]
    return Case(seed, pattern, shape, file, text, path_text(keys), trap, keys)


def path_text(keys: dict) -> str:
    """The path file."""

    def value(v) -> str:
        return f'"{v}"' if isinstance(v, str) else str(v)

    out = ['robot = "m710ic50"']
    for table, entries in keys.items():
        for entry in entries if isinstance(entries, list) else [entries]:
            out.append(f"[[{table}]]" if isinstance(entries, list) else f"[{table}]")
            out += [f"{k} = {value(v)}" for k, v in entry.items()]
    return "\n".join(out) + "\n"
