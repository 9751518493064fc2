"""What the audit judges: programs of ``cgen generate`` for the study's arm with its heat law, and nothing wider."""

import json
import tomllib
from pathlib import Path

PATHS = Path(__file__).resolve().parents[2] / "paths"
ROBOT, SOURCES = "m710ic50", ["thermal_growth"]
KNOWN = {
    "": {"robot", "title", "path", "surface", "boundary", "frame", "tool", "process", "posture", "compensation",
         "before", "after", "bounds"},
    "frame": {"number", "x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg"},
    "tool": {"number", "x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg", "spin_deg", "axisymmetric"},
    "process": {"feed_mm_s", "chord_um", "spacing_mm", "lift_mm", "page_stops"},
    "before": {"state", "program", "feed_mm_s", "duration_h", "duty"},
}  # fmt: skip
POSTURE = {"arm": "front", "elbow": "up", "wrist": "no flip"}


class NotJudgedError(Exception):
    """What the audit has no oracle for, in a sentence."""


def load(folder, path_file=None):
    """Report and path file (as plain tables) of an output folder, and the name of the program's file.

    Raises:
        NotJudgedError: Not an output of ``cgen generate`` for the study's arm, or with what only the package knows.
    """
    try:
        report = json.loads((folder / "report.json").read_text())
        name, made_from, file = report["name"], report["provenance"], report["program"]["file"]
        needed = {"after", "before", "timing", "thermal"} <= report.keys()
    except (OSError, ValueError, KeyError, TypeError) as problem:
        raise NotJudgedError(f"{folder}: no report.json of cgen generate ({problem}); give its output folder") from None
    if not needed or not file:
        raise NotJudgedError(f"{folder}: this report has no program; the audit judges outputs of cgen generate")
    if made_from["robot"] != ROBOT or made_from["sources"] != SOURCES:
        what = f"robot {made_from['robot']} with {', '.join(made_from['sources']) or 'no source'}"
        raise NotJudgedError(
            f"{what}: not judged; the audit knows {ROBOT} with {SOURCES[0]} alone, not identified arms"
        )
    if made_from["overrides"]:
        raise NotJudgedError(
            f"overrides {', '.join(map(str, made_from['overrides']))}: not judged; put them in the path file"
        )
    if not (folder / file).is_file():
        raise NotJudgedError(f"{file} was not written ({report['verdict']}): there is nothing to audit")
    file_read = Path(path_file) if path_file else PATHS / f"{name}.toml"
    try:
        path = tomllib.loads(file_read.read_text())
    except (OSError, ValueError) as problem:
        raise NotJudgedError(f"{file_read}: {problem}; name the path file of this output as second argument") from None
    _refuse_unknown(path)
    return report, path


def duties(path):
    """What the cell did before: (state, feed [mm/s], share in motion, [s]) of each [[before]]."""
    out = []
    for step in path.get("before", []):
        feed = step.get("feed_mm_s", path["process"]["feed_mm_s"])
        if "feed_mm_s" not in step and "program" in step:
            feed = tomllib.loads((PATHS / f"{step['program']}.toml").read_text())["process"]["feed_mm_s"]
        out.append((step["state"], feed, step.get("duty", 1.0), step["duration_h"] * 3600))
    return out


def _refuse_unknown(path):
    tables = [("", path), *((key, t) for key in KNOWN if key for t in _tables(path, key))]
    for where, table in tables:
        for key in table:
            if key not in KNOWN[where]:
                raise NotJudgedError(f"{where + '.' if where else ''}{key}: not judged; the audit has no oracle for it")
    if any("duration_h" not in step for step in path.get("before", [])):
        raise NotJudgedError("before: not judged without duration_h; the audit does not count runs")
    if any(table != POSTURE[key] for key, table in path.get("posture", {}).items()):
        raise NotJudgedError("posture: not judged; the audit's inverse is for front, elbow up, no flip")
    if path["path"].get("turn", "square") != "square":
        raise NotJudgedError(f"path.turn = {path['path']['turn']}: not judged; the audit knows square turns")


def _tables(path, key):
    table = path.get(key, [])
    return table if isinstance(table, list) else [table]
