"""What planner and twin believe together, changed: does ``cgen generate`` notice, and does the audit?

    python tests/campaigns/audit_mutants.py [words]

Each change is made in a copy of the package with its robot and path files, where both sides read it; a process of its
own generates and ``tests.audit`` judges what it left. Words choose the changes whose names hold one of them; those of
``taught:`` are on a taught frame (``tests/audited_case.py``): of an identified robot on a part that it taught, of the
shipped robot on one, and of an identified robot on a part that another one taught.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))

import audited_case  # noqa: E402

IDENTIFIED = ("taught", "elsewhere")  # paths of the case whose robot was identified
ROBOT = "robots/m710ic50.toml"
NODES, ROTATIONS, SURFACES = "thermal/node_model", "core/rotations", "planning/surfaces"


class Change(NamedTuple):
    """One belief, changed in one or more places: file, text as it is, text instead."""

    what: str
    edits: tuple[tuple[str, str, str], ...]
    path: str = "everything"  # on which it shows


def in_robot_file(what, *edits, path="everything"):
    """A change of texts in the robot file."""
    return Change(what, tuple((ROBOT, *edit) for edit in edits), path)


def in_code(what, file, *edits, path="everything"):
    """A change of texts in one module."""
    return Change(what, tuple((f"compgen/{file}.py", *edit) for edit in edits), path)


#: what an audit must see at least, on a shipped path
ASKED = (
    in_robot_file("cte doubled", ("cte_um_m_K = 11.25", "cte_um_m_K = 22.5"), path="line_x"),
    in_robot_file("rise of j3 doubled", ("rise_K = 13", "rise_K = 26"), path="line_x"),
    in_code("exponent's sign", NODES, ("** self.exponent", "** -self.exponent"), path="line_x"),
    in_robot_file(
        "J2/J3 coupling removed",
        ("[0, 1, 1, 0, 0, 0]", "[0, 0, 1, 0, 0, 0]"),
        ("j2_plus_j3_deg", "j3_deg"),
        path="line_x",
    ),
    in_code(
        "sign of P in reader and writer",
        ROTATIONS,
        ("(cr, sr) = pairs\n", "(cr, sr) = pairs\n    sp = -sp\n"),
        ("ca.atan2(-rows[6], cosine)", "ca.atan2(rows[6], cosine)"),
        path="optic_raster",
    ),
    in_code(
        "band halved",
        "verification/band",
        ("COVERAGE = 2.0", "COVERAGE = 1.0"),
        ("    radius = radius_of(moment)\n", "    radius = radius_of(moment) / 2\n"),
        path="line_y",
    ),
    in_code(
        "cte left out of the band",
        "job/uncertainty",
        ('yield Quantity("cte", "cte", together, warmth.expansion)', "pass"),
        path="line_y",
    ),
    in_code(
        "not known emptied",
        "pipelines/uncertainty/not_known",
        ("return tuple(row for row in rows if known.isdisjoint(row.until))", "return ()"),
        path="line_y",
    ),
)
#: what an audit must see of a taught frame and of an identified robot
SHARE = "job/taught_frame"
TAUGHT = (
    in_code(
        "taught: band halved",
        "verification/band",
        ("COVERAGE = 2.0", "COVERAGE = 1.0"),
        ("    radius = radius_of(moment)\n", "    radius = radius_of(moment) / 2\n"),
        path="taught",
    ),
    in_code(
        "taught: a column of the frame left out",
        SHARE,
        ("        if change.any()\n", "        if change.any() and name != OPEN[-1]\n"),
        path="taught",
    ),
    in_code("taught: the probe left out", SHARE, ("[float(with_tool)] * 3", "[0.0] * 3"), path="taught"),
    in_code(
        "taught: nothing cancels",
        SHARE,
        ("parameters=change + rows @ _about_origin(u, share.middle))", "parameters=change)"),
        path="taught",
    ),
    in_code(
        "taught: nothing cancels, shipped robot",
        SHARE,
        ("parameters=change + rows @ _about_origin(u, share.middle))", "parameters=change)"),
        path="shipped",
    ),
    in_code(
        "taught: not known emptied",
        "pipelines/uncertainty/not_known",
        ("return tuple(row for row in rows if known.isdisjoint(row.until))", "return ()"),
        path="taught",
    ),
    in_code(
        "taught: the touches' noise left out",
        SHARE,
        ("noise[share.touch] ** 2", "noise[share.touch] * 0"),
        path="taught",
    ),
    in_code(
        "taught: sigma of another's frame left out",
        SHARE,
        ("np.array(taught.sigma_um) * UM", "0 * np.array(taught.sigma_um) * UM"),
        path="elsewhere",
    ),
    in_code(
        "taught: turns of another's frame left out",
        SHARE,
        ("np.array(taught.sigma_mdeg) * MDEG", "0 * np.array(taught.sigma_mdeg) * MDEG"),
        path="elsewhere",
    ),
    in_code("taught: sensors right that day", SHARE, ("(rise.max(initial=0.0) > WARM)", "0.0"), path="taught"),
    in_code("taught: warmth does not cancel", SHARE, ("rows.any(axis=0) * _about", "0 * _about"), path="taught"),
    in_code(
        "taught: correlations left out",
        "error_model/posterior",
        ("correlation * np.outer(deviations, deviations)", "np.diag(deviations**2)"),
        path="taught",
    ),
    in_code(
        "taught: forecast_scale left out", "job/tables", ("scale=table.forecast_scale,", "scale=1.0,"), path="taught"
    ),
    in_code(
        "taught: fit noise left out", "job/tables", ("noise=table.fit_noise_um * UM,", "noise=0.0,"), path="taught"
    ),
    in_code(
        "taught: a width of reversals taken for known",
        "job/uncertainty",
        ("width[:, parameter.index[0]] = row / value", "width[:, parameter.index[0]] = 0 * row"),
        path="taught",
    ),
)
CHANGES = (
    *ASKED,
    *TAUGHT,
    in_code(
        "W and R exchanged in reader and writer",
        ROTATIONS,
        ("(cw, sw), (cp, sp), (cr, sr) = pairs", "(cr, sr), (cp, sp), (cw, sw) = pairs"),
        ("wpr = ca.vertcat(", "wpr = ca.DM([[0, 0, 1], [0, 1, 0], [1, 0, 0]]) @ ca.vertcat("),
        path="optic_raster",
    ),
    in_code(
        "U and D exchanged in reader and writer",
        "robot/configuration",
        ('elbow == "U"', 'elbow == "D"'),
        ("'U' if posture.up else 'D'", "'D' if posture.up else 'U'"),
    ),
    in_robot_file(  # alone it is refused everywhere, by the limits of J5
        "alpha6 as in the study's Table 2, J5 wider",
        ("90, -90, 180]", "90, -90, 0]"),
        ("j5_deg = [-125, 125]", "j5_deg = [-170, 170]"),
    ),
    in_robot_file(
        "a1 with its digits exchanged",
        ("a_mm = [150", "a_mm = [105"),
        ('"a1", material = "cast iron", length_mm = 150', '"a1", material = "cast iron", length_mm = 105'),
    ),
    in_robot_file("plateau of a2 to 550 mm", ("to_mm = 750", "to_mm = 550")),
    in_robot_file("d4 linear", ('to = "wrist", shape = "exponential"', 'to = "wrist", shape = "linear"')),
    in_code(
        "time constants in minutes",
        "thermal/tables/model",
        ("n.tau_h for n in table.node]) * HOUR", "n.tau_h / 60 for n in table.node]) * HOUR"),
    ),
    in_robot_file("reference of 3 h", ("reference_h = 6", "reference_h = 3")),
    in_robot_file("reference at 100 mm/s", ("reference_feed_mm_s = 200", "reference_feed_mm_s = 100")),
    in_robot_file("no heat of standing", ("idle_fraction = 0.05", "idle_fraction = 0")),
    in_code("off taken for idle", NODES, ('if state == "off":', 'if state == "never":')),
    in_code("duty left out", NODES, ("rises *= share if", "rises *= 1.0 if")),
    in_code(
        "duties in the other order",
        "job/day_before",
        ("return History(before=before, cycle", "return History(before=before[::-1], cycle"),
    ),
    in_code("durations halved", "thermal/tables/day", ("row.duration_h * HOUR", "row.duration_h * HOUR / 2")),
    in_code(
        "tool's offset of the other sign",
        "robot/tables",
        ("turn[:, 2]) * MM, turn)", "turn[:, 2]) * -MM, turn)"),
    ),
    in_code(
        "frame the wrong way",
        "job/part_frame",
        ("    return PartFrame(number, place,", "    place = place.inverse()\n    return PartFrame(number, place,"),
    ),
    in_code(
        "approach from inside the part", SURFACES, ("surface[:3] + p + height * n", "surface[:3] + p - height * n")
    ),
    in_code("convex for concave", SURFACES, ("parent_A = -np.diag", "parent_A = np.diag")),
    in_code("off axis to the other side", SURFACES, ("p0 = np.array([rho,", "p0 = np.array([-rho,")),
    in_code(
        "hexagon turned the other way",
        "planning/boundaries",
        ("angles = rotation + np.pi / 6", "angles = -rotation + np.pi / 6"),
    ),
    in_code(
        "spin the other way",
        "planning/exact_path",
        ("along_x = ca.vertcat(axis, 0)", "along_x = ca.vertcat(axis[0], -axis[1], 0)"),
    ),
    in_code(
        "circle the other way",
        "planning/patterns/spiral_circle_line",
        ("(0.0, 2 * pi), stop", "(0.0, -2 * pi), stop"),
        path="circle_1300",
    ),
    in_code(
        "radius for diameter",
        "planning/patterns/spiral_circle_line",
        ("(diameter / 2, diameter / 2)", "(diameter / 4, diameter / 4)"),
        path="circle_1300",
    ),
    in_code(
        "spiral the other way",
        "planning/patterns/spiral_circle_line",
        ("(0.0, 2 * pi * turns)", "(0.0, -2 * pi * turns)"),
        path="spiral_1300",
    ),
    in_code("cm/min for mm/min", "program/speeds", ("10 * MM / MINUTE", "MM / MINUTE")),
    in_robot_file(
        "jerks doubled",
        ("jerk_deg_s3 = [1625, 1865, 2305", "jerk_deg_s3 = [3250, 3730, 4610"),
        path="circle_1300",
    ),
    in_code("micrometre of ten", "core/units", ("UM = 1e-6", "UM = 1e-5")),
)


class Copy:
    """A copy of the project, changed and changed back."""

    def __init__(self, folder):
        """Copies package, robots and paths into a folder."""
        self.folder = Path(folder)
        for name in ("compgen", "robots", "paths"):
            shutil.copytree(ROOT / name, self.folder / name, ignore=shutil.ignore_patterns("data"))
        shutil.copy(ROOT / "tests" / "audit" / "everything.toml", self.folder / "paths")
        audited_case.write(self.folder / "paths", (self.folder / ROBOT).read_text())

    def run(self, change):
        """Exit codes of generate and of the audit, and the audit's words; None where there was nothing to audit."""
        before = {self.folder / name: (self.folder / name).read_bytes() for name, _, _ in change.edits}
        for name, old, new in change.edits:
            file = self.folder / name
            text = file.read_text()
            if text.count(old) != 1:
                raise SystemExit(f"{change.what}: {name} holds {text.count(old)} times {old!r}")
            file.write_text(text.replace(old, new))
            for compiled in (file.parent / "__pycache__").glob(f"{file.stem}.*"):
                compiled.unlink()
        out = self.folder / "out"
        shutil.rmtree(out, ignore_errors=True)
        path = self.folder / "paths" / f"{change.path}.toml"
        own = [path.with_name("own.toml")] if change.path in IDENTIFIED else []
        robot = ["--robot", *own] if own else []
        try:
            made = self._python("compgen", "generate", path, *robot, "-o", out, "--force", at=self.folder)
            if not (out / "report.json").is_file():
                return made.returncode, None, made.stderr.strip()
            judged = self._python("tests.audit", out, path, *own, at=ROOT)
            return made.returncode, judged.returncode, judged.stdout + judged.stderr
        finally:
            for file, content in before.items():
                file.write_bytes(content)

    def _python(self, module, *arguments, at):
        environment = {**os.environ, "PYTHONPATH": str(at), "PYTHONDONTWRITEBYTECODE": "1"}
        command = [sys.executable, "-m", module, *map(str, arguments)]
        return subprocess.run(command, cwd=at, env=environment, capture_output=True, text=True, check=False)


def rows_outside(words):
    """What the audit found, in a line."""
    rows = [line.split("  ")[0].split(",")[0] for line in words.splitlines() if line.endswith("OUTSIDE")]
    return ", ".join(rows) or words.strip().splitlines()[-1]


def main(words):
    """A row a change; how many the audit let pass."""
    chosen = [c for c in CHANGES if not words or any(word in c.what for word in words)]
    passed = 0
    with tempfile.TemporaryDirectory() as folder:
        copy = Copy(folder)
        for change in (*(Change("nothing", (), path) for path in dict.fromkeys(c.path for c in chosen)), *chosen):
            made, judged, text = copy.run(change)
            if change.what == "nothing" and (made, judged) != (0, 0):
                raise SystemExit(f"nothing changed in {change.path}: generate {made}, audit {judged}: {text[-300:]}")
            passed += judged == 0 and change.what != "nothing"
            codes = f"generate {made}  audit {'-' if judged is None else judged}"
            print(f"{change.what:40s} {codes}  {rows_outside(text)[:160]}", flush=True)
    print(f"{len(chosen)} tried, {passed} not seen by the audit")
    return passed


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]) > 0)
