"""Second readers of the files that a user gives, from what each format says, to check the package's against.

Plain Python, mm and deg as the files have them, nothing of the package. A reader raises ``ValueError`` for what its
format does not allow; it knows nothing of what is likely. ``naive_ls`` reads programs, ``naive_arm`` is the arm.
"""

import json
import math
import struct
import tomllib
import xml.etree.ElementTree as ElementTree
from hashlib import sha256

import numpy as np
from naive_arm import frame

PENDANT = [f"j{n}_deg" for n in range(1, 7)]
POSE = ["x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg"]


# a table of an instrument: the reader is told all that there is to tell, and looks for nothing


def told(data, encoding, delimiter, above, count, columns, comma):
    """Numbers of some columns, from 0, of ``count`` rows below ``above`` lines."""
    lines = data.decode(encoding).split("\n")[above : above + count]
    rows = [line.strip("\r").split(delimiter) for line in lines]
    plain = [
        [row[k].replace(".", "").replace(",", ".") if comma else row[k].replace(",", "") for k in columns]
        for row in rows
    ]
    return [[float(cell) for cell in row] for row in plain]


# STL: 80 bytes, a count, and 50 bytes a facet, little-endian; or words between solid and endsolid


def stl(data):
    """The facets, (normal, three corners), in the file's order. A file is text when all its words are those of text."""
    try:
        words = data.decode("ascii").split()
    except UnicodeDecodeError:
        return stl_binary(data)
    return stl_words(words) if words[:1] and words[0].lower() == "solid" else stl_binary(data)


def stl_binary(data):
    if len(data) < 84:
        raise ValueError("no count")
    (count,) = struct.unpack_from("<I", data, 80)
    if len(data) != 84 + 50 * count:
        raise ValueError("another number of facets than the count")
    return [triangle(struct.unpack_from("<12f", data, 84 + 50 * n)) for n in range(count)]


def stl_words(words):
    facets, at = [], 0

    def take(*expected):
        nonlocal at
        for word in expected:
            if at >= len(words) or words[at].lower() != word:
                raise ValueError(f"word {at + 1} is not {word}")
            at += 1

    def three():
        nonlocal at
        values = [float(word) for word in words[at : at + 3]]
        if len(values) != 3:
            raise ValueError("fewer than three numbers")
        at += 3
        return values

    while at < len(words):
        take("solid")
        while at < len(words) and words[at].lower() not in ("facet", "endsolid"):
            at += 1  # a name
        while at < len(words) and words[at].lower() == "facet":
            take("facet", "normal")
            numbers = three()
            take("outer", "loop")
            for _ in range(3):
                take("vertex")
                numbers += three()
            take("endloop", "endfacet")
            facets.append(triangle(numbers))
        take("endsolid")
        while at < len(words) and words[at].lower() != "solid":
            at += 1
    return facets


def triangle(numbers):
    if not all(map(math.isfinite, numbers)):
        raise ValueError("not a number")
    return tuple(numbers[:3]), (tuple(numbers[3:6]), tuple(numbers[6:9]), tuple(numbers[9:12]))


def stl_top(facets, x, y):
    """The height of the highest facet over a place, whichever way it faces, and its normal's z by the winding."""
    best = (-math.inf, 0.0)
    for _, (a, b, c) in facets:
        whole = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
        if whole == 0 or not min(a[0], b[0], c[0]) <= x <= max(a[0], b[0], c[0]):
            continue
        u = ((x - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y - a[1])) / whole
        v = ((b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1])) / whole
        if u >= 0 and v >= 0 and u + v <= 1:
            best = max(best, (a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2]), whole))
    return best


# URDF: metres and radians; origin = xyz, then fixed-axis roll, pitch, yaw; a tree of links


def urdf(text):
    """Joints by name, and the one chain of six that turn, to tool0 or flange where a link is so named.

    A joint that mimics another is none of its own, whatever else the file says of it.
    """
    root = ElementTree.fromstring(text)
    joints = [urdf_joint(element) for element in root if element.tag == "joint"]
    of_child = {}
    for joint in joints:
        if joint["child"] in of_child:
            raise ValueError(f"{joint['child']} has two parents")
        of_child[joint["child"]] = joint
    ways = {}
    for link in of_child:
        way, name = list[dict](), link
        while name in of_child:
            way.insert(0, of_child[name])
            name = of_child[name]["parent"]
            if len(way) > len(joints):
                raise ValueError("a ring of links")
        ways[link] = way
    moving = {link: [j for j in way if j["type"] != "fixed"] for link, way in ways.items()}
    if max(map(len, moving.values())) != 6:
        raise ValueError("no six joints in a row")
    ends = {way[-1]["name"]: way for link, way in moving.items() if len(way) == 6}
    if len(ends) != 1:
        raise ValueError("several arms")
    (chain,) = ends.values()
    if any(j["type"] not in ("revolute", "continuous") or j["mimic"] for j in chain):
        raise ValueError("a joint that does not turn by itself")
    tips = [link for link in ("tool0", "flange") if moving.get(link) == chain]
    last = chain[-1]["child"]
    if not tips and any(j["parent"] == last for j in joints):
        raise ValueError("which link is the flange?")
    return ways[tips[0] if tips else last], chain


def urdf_joint(element):
    def numbers(tag, key, default):
        inner = element.find(tag)
        text = default if inner is None else inner.get(key, default)
        values = [float(word) for word in text.split()]
        if not all(map(math.isfinite, values)):
            raise ValueError(f"{tag} {key}")
        return values

    axis = np.array(numbers("axis", "xyz", "1 0 0"))
    if not np.linalg.norm(axis) > 0:
        raise ValueError("an axis without a direction")
    limit = element.find("limit")
    return {
        "name": element.get("name"),
        "type": element.get("type"),
        "parent": element.find("parent").get("link"),
        "child": element.find("child").get("link"),
        "place": frame(*numbers("origin", "xyz", "0 0 0"), *np.degrees(numbers("origin", "rpy", "0 0 0"))),
        "axis": axis / np.linalg.norm(axis),
        "mimic": element.find("mimic") is not None,
        "limits": [float(limit.get(k, "nan")) for k in ("lower", "upper", "velocity")] if limit is not None else None,
    }


def urdf_pose(way, angles):
    """The end of a way at angles of its moving joints [rad], a 4 x 4 in its base [m]."""
    pose, angles = np.eye(4), list(angles)
    for joint in way:
        pose = pose @ joint["place"]
        if joint["type"] != "fixed":
            x, y, z = joint["axis"]
            K, q = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]), angles.pop(0)
            pose[:3, :3] = pose[:3, :3] @ (np.eye(3) + math.sin(q) * K + (1 - math.cos(q)) * K @ K)
    return pose


# CSV: a header, then a cell for each of its names; lines that begin with # are remarks


def table(text):
    """Rows as name to cell."""
    lines = [line for line in text.replace("\r\n", "\n").split("\n") if line.strip() and not line.startswith("#")]
    cut = [[cell.strip() for cell in cells(line)] for line in lines]
    head = cut[0]
    if len(set(head)) != len(head) or any(len(row) != len(head) for row in cut):
        raise ValueError("cells are not those of the header")
    return [dict(zip(head, row, strict=True)) for row in cut[1:]]


def cells(line):
    """The cells of a line: a comma between quotes parts none."""
    parts = line.split('"')
    parts[::2] = [part.replace(",", "\0") for part in parts[::2]]
    return "".join(parts).split("\0")


def numbers_of(row, names):
    values = [float(row[name]) for name in names]
    if not all(map(math.isfinite, values)):
        raise ValueError("not a number")
    return values


def is_whole(row, names):
    """Whether a row gives all of some columns; ValueError where it gives some of them only."""
    given = [row.get(name, "") != "" for name in names]
    if any(given) != all(given):
        raise ValueError(f"{names}: some only")
    return all(given)


def rotation(vector_deg):
    """The matrix of a rotation vector."""
    angle = math.radians(math.sqrt(sum(v * v for v in vector_deg)))
    joint = {"place": np.eye(4), "type": "turns", "axis": np.array(vector_deg) / (np.linalg.norm(vector_deg) or 1)}
    return urdf_pose([joint], [angle])[:3, :3]


def log(text):
    """A log of a run: (time, six numbers as they stand) of the rows that have a position; Cartesian ones first."""
    rows = table(text)
    names = POSE if all(name in rows[0] for name in POSE) else PENDANT
    return names, [(float(r["time_s"]), numbers_of(r, names)) for r in rows if is_whole(r, names)]


# touches.csv and artefact.toml, as docs/anchor.md and docs/identify.md say them


def artefact(text):
    """Spheres and planes by name: place [mm] at its temperature, diameter [mm]; and the probe."""
    file = tomllib.loads(text)
    head = file.get("artefact", {})
    grown = 1 + head.get("cte_um_m_K", 0.0) * 1e-6 * (head.get("temperature_degC", 20.0) - 20.0)
    targets = {}
    for kind in ("sphere", "plane"):
        for entry in file.get(kind, []):
            place = [grown * entry[axis] for axis in ("x_mm", "y_mm", "z_mm")] if "x_mm" in entry else None
            targets[entry["name"]] = {
                "kind": kind,
                "place": place,
                **{k: entry.get(k) for k in ("diameter_mm", "normal")},
            }
    probe = {"x_mm": 0.0, "y_mm": 0.0, "z_mm": 0.0, "diameter_mm": 0.0, **file.get("probe", {})}
    return head.get("frame", "world"), targets, probe


def gap(row, known, probe, centre, uframe):
    """How far a touch is from its target [mm]: the controller's belief of the probe's centre against the file's place.

    Args:
        row: Of touches.csv.
        known: The target.
        probe: Of the artefact.
        centre: In World [mm].
        uframe: Where the frame of the artefact's places is, a 4 x 4 [mm].
    """
    place = (uframe @ [*known["place"], 1.0])[:3]
    if row.get("nx", "") == "":
        return float(np.linalg.norm(place - centre))
    way = np.array(numbers_of(row, ["nx", "ny", "nz"]))
    ball = centre - way * float(row.get("value_mm") or 0.0)  # it was pushed back by the surface
    if known["kind"] == "plane":
        return float(uframe[:3, :3] @ known["normal"] @ (ball - place)) - probe["diameter_mm"] / 2
    if way @ (place - ball) < 0:
        raise ValueError("the probe moved away from what it touched")
    return float(np.linalg.norm(place - ball)) - (known["diameter_mm"] + probe["diameter_mm"]) / 2


# covariances: values and sigmas by name, correlations row by row to the diagonal


def covariance(sigma, rows):
    C = np.zeros((len(sigma), len(sigma)))
    for i, row in enumerate(rows):
        if len(row) != i + 1 or row[i] != 1:
            raise ValueError(f"row {i + 1}")
        for j, r in enumerate(row):
            C[i, j] = C[j, i] = r * sigma[i] * sigma[j]
    if len(rows) != len(sigma):
        raise ValueError("other rows than names")
    return C


def posterior(data):
    """Names, values and covariance in the units that the names say."""
    file = json.loads(data)
    rows = file["parameters"]
    return (
        [r["name"] for r in rows],
        [r["value"] for r in rows],
        covariance([r["sigma"] for r in rows], file["correlation"]),
    )


def state(text):
    """Names, values and covariance in K, um and mdeg (rotation vector), and the units of what drifts."""
    file = tomllib.loads(text)
    rise, base, drifting = file["rise"], file["base"], file.get("drifting", [])
    names = [
        *rise["node"],
        *(f"shift {a}" for a in "xyz"),
        *(f"turn {a}" for a in "xyz"),
        *(d["parameter"] for d in drifting),
    ]
    if len(set(names)) != len(names):
        raise ValueError("a name twice")
    values = [*rise["K"], *base["shift_um"], *base["turn_mdeg"], *(d["change"] for d in drifting)]
    sigma = [*rise["sigma_K"], *base["sigma_um"], *base["sigma_mdeg"], *(d["sigma"] for d in drifting)]
    if len(values) != len(names) or min(sigma) < 0:
        raise ValueError("other values than names, or a sigma below zero")
    return names, values, covariance(sigma, file["correlation"])


def manifest(data, files):
    """What a manifest says beside its own checksum; ValueError where it, or a file that it names, is another."""
    record = json.loads(data)
    checksum = record.pop("record_sha256")
    text = json.dumps(record, indent=2, allow_nan=False) + "\n"
    if sha256(text.encode()).hexdigest() != checksum:
        raise ValueError("edited")
    for entry in (record["main"], *record["pages"]):
        if sha256(files[entry["file"]]).hexdigest() != entry["sha256"]:
            raise ValueError(entry["file"])
    return record
