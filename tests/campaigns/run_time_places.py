"""Programs that write registers and frames at run time, executed: what is free stands where each run really leads.

python tests/campaigns/run_time_places.py --seeds 0:2000

Each seed is a random program of assignments, conditions, jumps, loops, calls and offsets. A second interpreter runs its
text line by line with random inputs, registers and called programs, several times. Wherever the analysis calls a
station free, every run that drives there must lead to the pose that it has, with the tool that it has.
"""

import argparse
import random
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[2]), str(Path(__file__).resolve().parents[1])]

import naive_arm as arm  # noqa: E402
import naive_heat  # noqa: E402
import numpy as np  # noqa: E402
from ls_text import cartesian  # noqa: E402

from compgen.core.units import MM  # noqa: E402
from compgen.fanuc import loads  # noqa: E402
from compgen.fanuc.analysis.called_programs import called_programs  # noqa: E402
from compgen.fanuc.analysis.correctable import read_scope  # noqa: E402
from compgen.fanuc.analysis.program_context import ProgramContext  # noqa: E402
from compgen.fanuc.analysis.traversal import read_traversal  # noqa: E402
from compgen.pipelines.correct import Options, correct  # noqa: E402
from compgen.pipelines.correct.program_file import load_before  # noqa: E402
from compgen.pipelines.files.robot_file import load_cell, load_robot  # noqa: E402
from compgen.program.frames import Frames  # noqa: E402
from compgen.program.pose_table import pose_of  # noqa: E402
from compgen.program.registers import CARTESIAN, Register  # noqa: E402

FRAMES = {0: (0.0,) * 6, 1: (100.0, 50.0, -30.0, 0.0, 0.0, 30.0), 2: (-50.0, 20.0, 10.0, 2.0, -3.0, 0.0)}
TOOLS = {0: (0.0,) * 6, 1: (0.0, 0.0, 120.0, 0.0, 5.0, 0.0)}
POINTS, REGISTERS = 8, 4
RUNS, STEPS = 12, 400
QUIET = "/PROG  QUIET\n/ATTR\n/MN\n   1:  R[1]=5 ;\n   2:  DO[1]=ON ;\n/POS\n/END\n"
FRAMER = "/PROG  FRAMER\n/ATTR\n/MN\n   1:  IF DI[4]=ON,UFRAME[1]=PR[2] ;\n   2:  UTOOL[1]=PR[3] ;\n/POS\n/END\n"
WRITER = "/PROG  WRITER\n/ATTR\n/MN\n   1:  PR[1]=PR[2] ;\n/POS\n/END\n"

BESIDE = {"QUIET": QUIET.encode(), "WRITER": WRITER.encode(), "FRAMER": FRAMER.encode()}


# Programs ----------------------------------------------------------------------------------------------------------


def number(rng):
    value = rng.choice([0, 10, 25, 60, -15, -40])
    return f"{value}" if value >= 0 else f"({value})"


def assignment(rng):
    i, j, k = (rng.randint(1, REGISTERS) for _ in range(3))
    return rng.choice(
        [
            f"PR[{i}]=PR[{j}]", f"PR[{i}]=PR[{j}]+PR[{k}]", f"PR[{i}]=PR[{j}]-PR[{k}]", f"PR[{i}]=PR[{i}]-PR[{i}]",
            f"PR[{i}]=LPOS", f"PR[{i}]=JPOS", f"PR[{i}]=P[{POINTS}]", f"PR[{i}]=UFRAME[{rng.randint(1, 2)}]",
            *(f"PR[{i},{rng.randint(1, 3)}:x]={number(rng)}" for _ in range(4)),
            f"PR[{i},{rng.randint(1, 6)}]=R[{rng.randint(1, 2)}]", f"PR[{i},1]=PR[{j},2]+5", f"PR[{i},3]=GI[1]",
            f"R[{rng.randint(1, 2)}]={rng.randint(0, 30)}", "R[1]=R[2]+1", "R[2]=GI[2]", f"PR[R[1]]=PR[{i}]",
            f"PR[{i},2]=(R[1]+2*{rng.randint(1, 5)})",
        ]
    )  # fmt: skip


def known(rng):
    """Statements after which PR[i] is known."""
    i = rng.randint(1, REGISTERS)
    if rng.random() < 0.5:
        return [f"PR[{i},{c}]={number(rng) if c < 4 else 0}" for c in range(1, 7)]
    return [f"PR[{i}]=PR[{i}]-PR[{i}]", f"PR[{i},{rng.randint(1, 3)}]={number(rng)}"]


def motion(rng):
    i = rng.randint(1, REGISTERS)
    option = rng.choice(
        ["", "", f" Offset,PR[{i}]", f" Offset,PR[{i}:up]", f" Tool_Offset,PR[{i}]", " Offset", " Tool_Offset",
         f" Skip,LBL[{rng.randint(1, 3)}],PR[{i}]=LPOS"]
    )  # fmt: skip
    return f"L P[{rng.randint(1, POINTS - 1)}] 50mm/sec FINE{option}"


def block(rng, depth=0):
    lines = []
    for _ in range(rng.randint(2, 6 if depth else 14)):
        what = rng.random()
        if what < 0.34:
            lines.append(motion(rng))
        elif what < 0.50:
            lines += known(rng)
        elif what < 0.66:
            lines.append(assignment(rng))
        elif what < 0.74:
            frame = rng.choice([f"UFRAME[{rng.randint(1, 2)}]", "UTOOL[1]"])
            lines.append(f"{frame}=PR[{rng.randint(1, REGISTERS)}]")
        elif what < 0.79:
            lines.append(f"{rng.choice(['OFFSET', 'TOOL_OFFSET'])} CONDITION PR[{rng.randint(1, REGISTERS)}]")
        elif what < 0.84:
            lines.append(
                rng.choice(["CALL QUIET", "CALL QUIET", "CALL WRITER", "CALL FRAMER", "CALL OTHER", "MY MACRO"])
            )
        elif what < 0.88:
            lines.append(f"IF DI[1]=ON,{rng.choice([assignment(rng), f'JMP LBL[{rng.randint(1, 3)}]', 'CALL OTHER'])}")
        elif what < 0.91:
            lines.append(rng.choice([f"JMP LBL[{rng.randint(1, 3)}]", "IF DI[2]=ON,UFRAME[1]=PR[1]"]))
        elif depth < 2:
            inner = block(rng, depth + 1)
            if rng.random() < 0.5:
                lines += [f"FOR R[9]=1 TO {rng.randint(0, 3)}", *inner, "ENDFOR"]
            else:
                lines += [
                    "IF (DI[3]) THEN",
                    *inner,
                    *(["ELSE", *block(rng, depth + 1)] if rng.random() < 0.5 else []),
                    "ENDIF",
                ]
    return lines


def program(rng):
    lines = block(rng)
    for label in (1, 2, 3):
        lines.insert(rng.randint(0, len(lines)), f"LBL[{label}]")
    points = []
    for n in range(1, POINTS + 1):
        x, y, z = rng.uniform(900, 1250), rng.uniform(-250, 250), rng.uniform(-150, 250)
        values = (x, y, z, 180 + rng.uniform(-8, 8), rng.uniform(-8, 8), rng.uniform(-20, 20))
        points.append(cartesian(n, values, uf=rng.randint(0, 2), ut=rng.randint(0, 1)))
    body = "".join(f"{i:4d}:{m if m[:2] in ('J ', 'L ') else '  ' + m} ;\n" for i, m in enumerate(lines, 1))
    return f"/PROG  T\n/ATTR\n/MN\n{body}/POS\n{''.join(points)}/END\n"


# The second interpreter ----------------------------------------------------------------------------------------------


class Stopped(Exception):
    """The controller would stop with an alarm."""


def brackets(text):
    """Number, and component or None, of X[n,c:name]."""
    inside = text[text.index("[") + 1 : text.rindex("]")].split(":")[0].split(",")
    return [part.strip() for part in inside]


class Run:
    """One run of a program's text: every register has some value, every input is drawn."""

    def __init__(self, lines, points, rng, start):
        self.lines, self.points, self.rng = lines, points, rng
        self.pr = {i: ("cartesian", self.anything()) for i in range(1, REGISTERS + 1)} | {
            i: ("cartesian", np.array(v)) for i, v in start.items()
        }
        self.r = {i: rng.uniform(1, 4) for i in range(0, 10)}
        self.uframe, self.utool = (dict(d) for d in (FRAMES, TOOLS))
        self.condition = {}
        self.live = rng.random() < 0.5  # does a condition take the register when it is said, or when it is used?
        self.driven = []

    def anything(self):
        return np.array([self.rng.uniform(-300, 300) for _ in range(3)] + [self.rng.uniform(-90, 90) for _ in range(3)])

    def value(self, text):
        """A number."""
        text = text.strip()
        if text.startswith("(") and text.endswith(")"):
            return self.value(text[1:-1])
        for sign in "+-":
            depth = 0
            for k in range(len(text) - 1, 0, -1):
                depth += (text[k] in "])") - (text[k] in "[(")
                if text[k] == sign and depth == 0 and text[k - 1] not in "*(":
                    a, b = self.value(text[:k]), self.value(text[k + 1 :])
                    return a + b if sign == "+" else a - b
        if "*" in text:
            a, b = text.split("*")
            return self.value(a) * self.value(b)
        if text.startswith("PR["):
            n, c = brackets(text)
            return float(self.pr[int(n)][1][int(c) - 1])
        if text.startswith("R["):
            return self.r[int(brackets(text)[0])]
        if text.startswith("GI["):
            return self.rng.uniform(-50, 50)
        return float(text)

    def register(self, text):
        text = text.strip()
        for sign in "+-":
            if f"]{sign}PR" in text:
                left, right = text.split(f"]{sign}PR", 1)
                a, b = self.register(f"{left}]"), self.register(f"PR{right}")
                if a[0] != b[0]:
                    raise Stopped
                return a[0], a[1] + b[1] if sign == "+" else a[1] - b[1]
        if text == "LPOS":
            return "cartesian", self.anything()
        if text == "JPOS":
            return "joint", self.anything()
        n = int(brackets(text)[0])
        if text.startswith("PR["):
            return self.pr[n]
        if text.startswith("P["):
            return "cartesian", np.array(self.points[n][2])
        return "cartesian", np.array(self.uframe[n])

    def assign(self, text):
        left, _, right = text.partition("=")
        where = brackets(left)
        if left.startswith("R["):
            self.r[int(where[0])] = self.value(right)
        elif left.startswith("PR["):
            n = round(self.r[1]) if where[0].startswith("R[") else int(where[0])
            if n not in self.pr:
                raise Stopped
            if len(where) == 2:
                form, values = self.pr[n]
                values = values.copy()
                values[int(where[1]) - 1] = self.value(right)
                self.pr[n] = form, values
            else:
                self.pr[n] = self.register(right)
        else:
            form, values = self.register(right)
            if form == "joint":
                raise Stopped
            (self.uframe if left.startswith("UF") else self.utool)[int(where[0])] = tuple(values)

    def call(self, name):
        if name == "QUIET":
            self.r[1] = 5.0
        elif name == "WRITER":
            self.pr[1] = self.pr[2]
        elif name == "FRAMER":
            self.assign("UTOOL[1]=PR[3]")
            if self.rng.random() < 0.5:
                self.assign("UFRAME[1]=PR[2]")
        else:  # a program, or a macro, that nobody knows
            for i in list(self.pr):
                if self.rng.random() < 0.5:
                    self.pr[i] = "cartesian", self.anything()  # six numbers written are taken for Cartesian ones
            for i in self.r:
                self.r[i] = self.rng.uniform(1, 4)

    def label(self, text):
        wanted = f"LBL[{brackets(text[text.index('LBL') :].split(']')[0] + ']')[0]}]"
        return self.lines.index(wanted)

    def drive(self, at, text):
        words = text.split(" FINE")[1].strip()
        n = int(brackets(text.split()[1])[0])
        uf, ut, values = self.points[n]
        values, after = np.array(values), np.eye(4)
        for word in [words] if words else []:
            kind = word.split(",")[0]
            if kind == "Skip":
                if self.rng.random() < 0.5:
                    self.pr[int(brackets(word.split(",")[2].split("=")[0])[0])] = "cartesian", self.anything()
                self.driven.append((at, None, None))
                return self.label(word) if self.rng.random() < 0.5 else at + 1
            if "," in word:
                given = self.pr[int(brackets(word.split(",", 1)[1])[0])]
            elif kind in self.condition:
                i, then = self.condition[kind]
                given = self.pr[i] if self.live else then
            else:
                given = ("joint", None)
            if given[0] == "joint":
                self.driven.append((at, "joint", None))
                return at + 1
            if kind == "Offset":
                values = values + given[1]
            else:
                after = arm.frame(*given[1])
        pose = arm.frame(*self.uframe[uf]) @ arm.frame(*values) @ after
        self.driven.append((at, pose, arm.frame(*self.utool[ut])))
        return at + 1

    def jump_over(self, at, openers, closer, middle=()):
        depth = 0
        for k in range(at + 1, len(self.lines)):
            text = self.lines[k]
            if depth == 0 and (text == closer or text in middle):
                return k
            depth += any(text.startswith(o) and (o != "IF" or text.endswith("THEN")) for o in openers)
            depth -= text == closer
        raise Stopped

    def go(self):
        at, loops = 0, dict[int, int]()
        try:
            for _ in range(STEPS):
                if at >= len(self.lines):
                    return self.driven
                at = self.step(at, self.lines[at], loops)
        except Stopped:
            pass
        return self.driven

    def step(self, at, text, loops):
        chance = self.rng.random() < 0.5
        if text[:2] in ("J ", "L "):
            return self.drive(at, text)
        if text.startswith("IF (") and text.endswith("THEN"):
            return at + 1 if chance else self.jump_over(at, ("IF",), "ENDIF", ("ELSE",)) + 1
        if text == "ELSE":
            return self.jump_over(at, ("IF",), "ENDIF") + 1
        if text.startswith("FOR"):
            first, last = 1, int(text.split(" TO ")[1])
            if at not in loops:
                loops[at] = first
            if loops[at] > last:
                del loops[at]
                return self.jump_over(at, ("FOR",), "ENDFOR") + 1
            return at + 1
        if text == "ENDFOR":
            depth = 0
            for k in range(at - 1, -1, -1):
                if self.lines[k] == "ENDFOR":
                    depth += 1
                elif self.lines[k].startswith("FOR"):
                    if depth == 0:
                        loops[k] = loops.get(k, 1) + 1
                        return k
                    depth -= 1
            raise Stopped
        if text.startswith("IF "):
            if not chance:
                return at + 1
            text = text.split(",", 1)[1]
        if text.startswith("JMP"):
            return self.label(text)
        if text.startswith("CALL"):
            self.call(text.split()[1])
        elif text == "MY MACRO":
            self.call("")
        elif "CONDITION" in text:
            i = int(brackets(text)[0])
            self.condition["Offset" if text.startswith("OFFSET") else "Tool_Offset"] = i, self.pr[i]
        elif "=" in text:
            self.assign(text)
        return at + 1


def read_text(text):
    """Statements and positions of a program's text."""
    head, _, tail = text.partition("/POS\n")
    lines = [line.split(":", 1)[1].rsplit(";", 1)[0].strip() for line in head.split("/MN\n")[1].splitlines()]
    points = {}
    for part in tail.split("P[")[1:]:
        numbers = [w.split("=")[1].split()[0] for w in part.replace(",\t", "\n").splitlines() if "=" in w]
        uf, ut = (int(part.split(f"{k} :")[1].split(",")[0]) for k in ("UF", "UT"))
        points[int(part.split("]")[0])] = uf, ut, [float(v) for v in numbers]
    return lines, points


# Judged --------------------------------------------------------------------------------------------------------------


def frames_of_cell():
    """The frames and tools of every program."""
    uframes, utools = ({n: pose_of(v) for n, v in table.items()} for table in (FRAMES, TOOLS))
    return Frames(uframes, utools)


def judge(seed, robot):
    """What is wrong with a seed, and how many driven stations were compared."""
    rng = random.Random(seed)
    text = program(rng)
    start = {1: (10.0, -20.0, 30.0, 0.0, 0.0, 0.0)} if rng.random() < 0.5 else {}
    read = loads(text.encode("ascii"))
    frames = frames_of_cell()
    registers = {n: Register(CARTESIAN, v) for n, v in start.items()}
    around = ProgramContext(frames, registers, called_programs(read, BESIDE.get))
    poses = around.poses(read, robot)
    drive = read_traversal(read, poses, robot, around.called.motionless)
    scope = read_scope(read, poses, drive, robot)
    first = int(read.statements[0])
    station_of = {int(read.motions.line[i]) - first: s for s, i in enumerate(drive.motion.tolist())}
    lines, points = read_text(text)
    compared = shifted = 0
    for _ in range(RUNS):
        for at, pose, tool in Run(lines, points, rng, start).go():
            s = station_of[at]
            if not scope.free[s]:
                continue
            if pose is None or isinstance(pose, str):
                return f"seed {seed}: line {at + 1}: {lines[at]}: free, and it ends elsewhere", text, compared, shifted
            k = drive.pose[s]
            there = np.allclose(poses.tcp.position[k], pose[:3, 3] * MM, atol=1e-9)
            there &= np.allclose(poses.tcp.rotation[k], pose[:3, :3], atol=1e-9)
            with_tool = np.allclose(poses.tools.position[poses.tool[k]], tool[:3, 3] * MM, atol=1e-9)
            if not (there and with_tool):
                return (
                    f"seed {seed}: line {at + 1}: {lines[at]}: free, and a run leads elsewhere",
                    text,
                    compared,
                    shifted,
                )
            compared += 1
            shifted += int(poses.placement[k] > 0)
    return "", text, compared, shifted


def run_of(text, rng):
    """The motions of one run of a text, all registers drawn."""
    lines, points = read_text(text)
    return Run(lines, points, rng, {}).go()


def corrected(seed, cell):
    """um by which the warm arm misses the places of corrected stations: of positions driven to in one way, and of all.

    The written text is run as the planned one was, with the same draws.
    """
    rng = random.Random(seed)
    text = program(rng)
    frames = frames_of_cell()
    before = load_before(("moving 200mm/s 6h",)).duties
    result = correct(text.encode("ascii"), cell, frames, before, Options(), lambda stage, share: None, BESIDE.get)
    plan, first = result.plan, int(result.plan.program.statements[0])
    if not result.changed:
        return [], []
    motion = plan.drive.motion.tolist()
    station_of = {int(plan.program.motions.line[i]) - first: s for s, i in enumerate(motion)}
    moved = plan.free & result.shared.changed[plan.poses.first[plan.drive.pose]]
    ways = np.bincount(plan.poses.first[np.unique(plan.drive.pose[moved])], minlength=len(plan.poses.row))
    single, every = [], []
    for run in range(3):
        both = [run_of(t, random.Random(1000 * seed + run)) for t in (text, result.text.decode())]
        for (at, meant, tool), (again, written, _) in zip(*both, strict=False):
            s = station_of[at]
            assert at == again
            if not moved[s]:
                assert meant is None or isinstance(meant, str) or not plan.free[s] or np.array_equal(meant, written)
                continue
            k = int(plan.drive.pose[s])
            guess = np.degrees(cell.robot.to_pendant(plan.poses.theta[k : k + 1])[0])
            misses = []
            for place in (meant, written):
                q = arm.joints_at(place @ np.linalg.inv(tool), guess)
                real = arm.flange(q, naive_heat.warm_lengths()) @ tool
                misses.append(1e3 * float(np.linalg.norm(real[:3, 3] - meant[:3, 3])))
            every.append(misses)
            if ways[plan.poses.first[k]] == 1:
                single.append(misses[1])
    return single, every


def drive_corrected(seeds):
    """Correct the programs of some seeds, and say how far the warm arm misses; 1 where one becomes worse."""
    cell = load_cell(str(Path(__file__).resolve().parents[2] / "robots" / "m710ic50.toml"))
    worst, worse, stations = 0.0, 0, 0
    for seed in seeds:
        single, every = corrected(seed, cell)
        stations += len(every)
        if any(after > max(before, 1.0) + 3.0 for before, after in every) or max(single, default=0.0) > 1.5:
            worse += 1
            print(f"seed {seed}: {max(single, default=0.0):.2f} um, {max(every, key=lambda e: e[1])}", flush=True)
        worst = max(worst, *single, 0.0)
    print(
        f"{stations} corrected stations driven, at most {worst:.2f} um where driven to in one way, {worse} seeds worse"
    )
    return 1 if worse else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="0:1000", help="first:end, the end not included")
    parser.add_argument("--correct", action="store_true", help="correct each program, and drive the written text")
    given = parser.parse_args()
    first, end = map(int, given.seeds.split(":"))
    if given.correct:
        return drive_corrected(range(first, end))
    robot = load_robot("m710ic50")
    wrong = compared = shifted = 0
    for seed in range(first, end):
        why, text, stations, placed = judge(seed, robot)
        compared, shifted = compared + stations, shifted + placed
        if why:
            wrong += 1
            if wrong < 4:
                print(why, text.split("/POS")[0].split("/MN")[1], sep="\n", flush=True)
    print(
        f"seeds {first}:{end}: {compared} driven stations compared, {shifted} of them placed at run time, {wrong} wrong"
    )
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
