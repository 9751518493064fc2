"""Files as loggers write them, drawn at random, and a plain reader that is told how each is written.

The reader knows nothing of what it is not told: code page, delimiter, how many lines stand above the readings, which
column is which, unit, decimal sign, the format of the times. It shares nothing with the package.
"""

import csv
import datetime
import io
from dataclasses import dataclass, field

import numpy as np

GAPS = ["", "--", "OL", "NaN", "BURNOUT", "n/a", "+++++", "9.9E37"]
#: how a date is written, how a clock is, and what the package is told of the order where days cannot tell
DATES = ["%Y-%m-%d", "%d.%m.%Y", "%d.%m.%y", "%Y/%m/%d", "%d/%m/%Y", "%m/%d/%Y", "%d-%b-%Y", "%m-%d-%y"]
CLOCKS = ["%H:%M:%S", "%H:%M:%S.%f", "%I:%M:%S %p", "%H:%M"]
#: a unit's name in a file, and from degC
UNITS = {
    "°C": lambda c: c, "degC": lambda c: c, "C": lambda c: c, "°F": lambda c: c * 1.8 + 32, "F": lambda c: c * 1.8 + 32,
    "K": lambda c: c + 273.15, "Kelvin": lambda c: c + 273.15,
}  # fmt: skip
BACK = {"C": lambda v: v, "F": lambda v: (v - 32) / 1.8, "K": lambda v: v - 273.15}


@dataclass
class Form:
    """What the plain reader is told of a file."""

    encoding: str
    delimiter: str
    above: int
    column: dict
    unit: str
    comma: bool
    grouped: str
    time_columns: list
    time_format: str
    dialect: dict = field(default_factory=dict)


def draw(seed):
    """A file's bytes, and what there is to say of it: to the plain reader, and to the package as a user would."""
    rng = np.random.default_rng(seed)
    pick = lambda some: some[int(rng.integers(len(some)))]  # noqa: E731
    rows, nodes = int(rng.integers(3, 40)), ["j2", "j3", "link1", "wrist"][: int(rng.integers(1, 5))]
    comma = bool(rng.integers(2))
    delimiter = pick([";", "\t", "|"] if comma else [",", ";", "\t", "|"])
    encoding = pick(["utf-8", "utf-8-sig", "cp1252", "utf-16"])
    unit = pick(list(UNITS))
    where = pick(["header", "row", "said"])
    date, clock = pick(DATES), pick(CLOCKS)
    start = datetime.datetime(2026, int(rng.integers(1, 13)), int(rng.integers(1, 29)), 0, 0, 0)
    step = datetime.timedelta(seconds=int(rng.integers(60, 7000)) if "%S" in clock else 60 * int(rng.integers(1, 90)))
    times = [start + n * step for n in range(rows)]
    apart = bool(rng.integers(2))
    names = {node: pick(["TC {:02}", "CH{}", "Kanal {}", "Temp. {} Ave"]).format(n + 1) for n, node in enumerate(nodes)}
    named = {node: f"{name} [{unit}]" if where == "header" else name for node, name in names.items()}
    head = ["No."] + (["Date", "Clock"] if apart else ["Zeitpunkt"]) + [named[n] for n in nodes] + ["Alarm", ""]
    form = Form(encoding, delimiter, 0, {}, unit, comma, "", [1, 2] if apart else [1], f"{date} {clock}")
    above = [[pick(["Serial", "Gerät", "Model"]), "SN-2"], ["Start", "12"], []]
    lines = [*above[: int(rng.integers(0, 4))], head]
    if where == "row":
        lines.append(["", *[""] * len(form.time_columns), *[unit] * len(nodes), "", ""])
    form.above = len(lines)
    form.column = {node: 1 + len(form.time_columns) + n for n, node in enumerate(nodes)}
    for n, moment in enumerate(times):
        stamp = moment.strftime(date), moment.strftime(clock)
        cells = [f"{UNITS[unit](rng.uniform(15, 60)):.{2}f}" for _ in nodes]
        cells = [pick(GAPS) if rng.random() < 0.1 and n else cell for cell in cells]
        cells = [cell.replace(".", "," if comma else ".") for cell in cells]
        lines.append([str(n + 1), *(stamp if apart else [" ".join(stamp)]), *cells, "off", ""])
    out = io.StringIO()
    csv.writer(out, delimiter=delimiter, lineterminator=pick(["\n", "\r\n"])).writerows(lines)
    form.dialect = {"columns": {node: names[node] for node in nodes}}
    if where == "said":
        form.dialect["unit"] = {"C": "degC", "F": "degF", "K": "K"}[kind(unit)]
    orders = {"%d/%m/%Y": "dmy", "%m/%d/%Y": "mdy", "%m-%d-%y": "mdy"}
    if date in orders:
        form.dialect["dates"] = orders[date]
    return out.getvalue().encode(encoding), form


def kind(unit):
    return unit.replace("deg", "").replace("°", "")[0]


def read(data, form):
    """Seconds from the first reading, and the readings of each node in degC."""
    rows = list(csv.reader(io.StringIO(data.decode(form.encoding)), delimiter=form.delimiter))
    body = [row for row in rows[form.above :] if row]
    moments = [
        datetime.datetime.strptime(" ".join(row[k] for k in form.time_columns), form.time_format) for row in body
    ]
    seconds = [(moment - moments[0]).total_seconds() for moment in moments]
    readings = {}
    for node, k in form.column.items():
        texts = [row[k] for row in body]
        points = [t.replace(",", ".") if form.comma else t for t in texts]
        values = [np.nan if t in GAPS else float(t) for t in points]
        readings[node] = BACK[kind(form.unit)](np.array(values))
    return np.array(seconds), readings
