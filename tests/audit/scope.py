"""What the audit judges: programs of ``cgen generate`` for the study's arm with its heat law, and nothing wider."""

import json
import tomllib
from pathlib import Path

from audit import study

CHORD_UM = 1.5  # process.chord_um, where the path file says none
PATHS = Path(__file__).resolve().parents[2] / "paths"
ROBOT, SOURCES = "m710ic50", ["thermal_growth"]
KNOWN = {
    "": {"robot", "title", "path", "surface", "boundary", "frame", "tool", "process", "posture", "compensation",
         "before", "after", "bounds"},
    "path": {"pattern", "x_mm", "y_mm", "z_mm", "axis", "length_mm", "diameter_mm", "turns", "stepover_mm", "lead_mm",
             "turn", "size_mm", "file", "through", "tolerance_um", "tolerance_mdeg", "corner_deg", "bulge_um",
             "jump_mm"},
    "surface": {"kind", "radius_of_curvature_m", "conic_constant", "off_axis_m"},
    "boundary": {"shape", "diameter_mm", "corner_to_corner_mm", "size_mm", "rotation_deg"},
    "frame": {"number", "file", "taught", "x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg"},
    "tool": {"number", "x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg", "spin_deg", "axisymmetric"},
    "compensation": {"clamp_mm", "clamp_deg", "rate_um_mm", "rate_period_mm", "curvature_period_mm", "solver",
                     "start_drift_um"},
    "process": {"feed_mm_s", "chord_um", "spacing_mm", "thin_um", "lift_mm", "page_stops", "lead_in"},
    "before": {"state", "program", "feed_mm_s", "duration_h", "duty"},
}  # fmt: skip
OF_TAUGHT = {"through", "robot_file", "rise_K", "sigma_um", "sigma_mdeg", "probe_mm", "touches"}
OF_GENERATE = {"name", "title", "after", "timing", "thermal", "program", "provenance"}
OWN_FILES = {"gcode", "apt", "points"}
PATTERNS = {"line", "circle", "spiral", "raster", "iso9283"}
SHAPES = {"circle", "hexagon", "rectangle"}
POSTURE = {"arm": "front", "elbow": "up", "wrist": "no flip"}


class NotJudgedError(Exception):
    """What the audit has no oracle for, in a sentence."""


def load(folder, path_file=None, *, is_robot_named=False):
    """Report and path file (as plain tables) of an output folder, and the folder of the path file.

    The frame's own file stands in the path file's table; ``is_robot_named`` lets other sources pass.

    Raises:
        NotJudgedError: Not an output of ``cgen generate`` for the study's arm, or with what only the package knows.
    """
    try:
        report = json.loads((folder / "report.json").read_text())
    except (OSError, ValueError) as problem:
        raise NotJudgedError(f"{folder}: no report.json of cgen generate ({problem}); give its output folder") from None
    if not isinstance(report, dict) or not report.keys() >= OF_GENERATE:
        raise NotJudgedError(
            f"{folder}: not judged; the audit is for cgen generate, not for predict, correct or others"
        )
    made_from, file = report["provenance"], report["program"]["file"]
    if made_from["robot"] != ROBOT or not (is_robot_named or made_from["sources"] == SOURCES):
        what = f"robot {made_from['robot']} with {', '.join(made_from['sources']) or 'no source'}"
        raise NotJudgedError(
            f"{what}: not judged; the audit knows {ROBOT} with {SOURCES[0]} alone, and with an identified "
            "robot file as third argument"
        )
    if report["thermal"]["start_K"].keys() != set(study.NODES):
        raise NotJudgedError("another heat model than the study's nodes: not judged; the audit has no second one")
    if made_from["overrides"]:
        given = ", ".join(map(str, made_from["overrides"]))
        raise NotJudgedError(f"overrides {given}: not judged; the audit reads the path file as it is")
    if not (folder / file).is_file():
        raise NotJudgedError(f"{file} was not written ({report['verdict']}): there is nothing to audit")
    path_file = Path(path_file) if path_file else PATHS / f"{report['name']}.toml"
    return report, _path_file(path_file, report["title"]), path_file.parent


def _path_file(file, title):
    """Its tables, where they are those of an output with this title."""
    try:
        path = tomllib.loads(file.read_text())
    except (OSError, ValueError) as problem:
        raise NotJudgedError(f"{file}: {problem}; name the path file of this output as second argument") from None
    if not path.keys() >= {"path", "process"} or path.get("title", title) != title:
        raise NotJudgedError(f"{file}: not the path file of '{title}'; name it as second argument")
    if (frame := path.get("frame", {})) and "file" in frame:
        try:
            path["frame"] = {**tomllib.loads((file.parent / frame["file"]).read_text())["frame"], **frame}
        except (OSError, ValueError, KeyError) as problem:
            raise NotJudgedError(
                f"{file}: frame.file: {problem!r}; the audit reads frames of cgen teach-frame"
            ) from None
    _refuse_unknown(path)
    return path


def duties(path):
    """What the cell did before: (state, feed [mm/s], share in motion, [s]) of each [[before]]."""
    own = path["process"]["feed_mm_s"]
    return [
        (step["state"], step.get("feed_mm_s", own), step.get("duty", 1.0), step["duration_h"] * 3600)
        for step in path.get("before", [])
    ]


def _refuse_unknown(path):
    if (pattern := path["path"].get("pattern")) not in PATTERNS | OWN_FILES:
        raise NotJudgedError(f"path.pattern = {pattern}: not judged; the audit has a closed form of {sorted(PATTERNS)}")
    if pattern in OWN_FILES and "boundary" in path:
        raise NotJudgedError("boundary: not judged; the audit takes from a file itself what is on the part")
    if pattern in OWN_FILES and (kind := path.get("surface", {}).get("kind", "plane")) != "plane":
        raise NotJudgedError(f"surface.kind = {kind}: not judged; on a file's lines the audit's tool stands upright")
    tables = [("", path), *((key, t) for key in KNOWN if key for t in _tables(path, key))]
    for where, table in tables:
        for key in table:
            if key not in KNOWN[where]:
                raise NotJudgedError(f"{where + '.' if where else ''}{key}: not judged; the audit has no oracle for it")
    if unknown := path.get("frame", {}).get("taught", {}).keys() - OF_TAUGHT:
        raise NotJudgedError(f"frame.taught.{min(unknown)}: not judged; the audit has no oracle for it")
    if any("duration_h" not in step for step in path.get("before", [])):
        raise NotJudgedError("before: not judged without duration_h; the audit does not count runs")
    if any("program" in step and "feed_mm_s" not in step for step in path.get("before", [])):
        raise NotJudgedError("before: not judged with a program and no feed_mm_s; the audit reads no other path file")
    if any(table != POSTURE[key] for key, table in path.get("posture", {}).items()):
        raise NotJudgedError("posture: not judged; the audit's inverse is for front, elbow up, no flip")
    if (shape := path.get("boundary", {}).get("shape", "circle")) not in SHAPES:
        raise NotJudgedError(f"boundary.shape = {shape}: not judged; the audit knows {sorted(SHAPES)}")
    if path["path"].get("turn", "square") != "square":
        raise NotJudgedError(f"path.turn = {path['path']['turn']}: not judged; the audit knows square turns")


def _tables(path, key):
    table = path.get(key, [])
    return table if isinstance(table, list) else [table]
