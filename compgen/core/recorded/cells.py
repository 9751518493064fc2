"""Cells of other people's tables: a name and its unit, a number by its decimal sign, a reading that is missing."""

import re
import unicodedata

from compgen.core.units import DAY, DEG, HOUR, INCH, MINUTE, MM, MS, UM

#: a unit as column names have it: what it measures, its size and its zero (in SI, temperatures in degC), its spellings
_UNITS = {
    "degC": ("temperature", 1.0, 0.0, "c degc celsius degcelsius degreec degreesc degreescelsius gradc gradcelsius"),
    "degF": ("temperature", 5 / 9, 32.0, "f degf fahrenheit degfahrenheit degreef degreesf degreesfahrenheit"),
    "K": ("temperature", 1.0, 273.15, "k degk kelvin"),
    "mm": ("length", MM, 0.0, "mm millimeter millimeters millimetre millimetres"),
    "inch": ("length", INCH, 0.0, 'in inch inches zoll "'),
    "ft": ("length", 12 * INCH, 0.0, "ft foot feet"),
    "m": ("length", 1.0, 0.0, "m meter meters metre metres"),
    "cm": ("length", 0.01, 0.0, "cm centimeter centimeters"),
    "um": ("length", UM, 0.0, "um μm micron microns micrometer micrometers"),
    "deg": ("angle", DEG, 0.0, "deg degree degrees grad"),
    "rad": ("angle", 1.0, 0.0, "rad radian radians"),
    "s": ("time", 1.0, 0.0, "s sec secs second seconds sek sekunden"),
    "ms": ("time", MS, 0.0, "ms msec millisecond milliseconds"),
    "min": ("time", MINUTE, 0.0, "min mins minute minutes minuten"),
    "h": ("time", HOUR, 0.0, "h hr hrs hour hours std stunden"),
    "d": ("time", DAY, 0.0, "d day days tag tage"),
    "mm_s": ("speed", MM, 0.0, "mm/s mm/sec"),
    "m_s": ("speed", 1.0, 0.0, "m/s m/sec"),
    "mm_min": ("speed", MM / MINUTE, 0.0, "mm/min"),
    "m_min": ("speed", 1 / MINUTE, 0.0, "m/min"),
    "in_min": ("speed", INCH / MINUTE, 0.0, "in/min inch/min inches/min ipm"),
}
_SPELT = {spelling: unit for unit, (*_, spellings) in _UNITS.items() for spelling in spellings.split()}
_MARKED = re.compile(r"[\[({<]([^\[\](){}<>]*)[\])}>]")  # TC 03 [degC], 101 (C)
_PARTED = re.compile(r"[\s_/,;:]+")  # TC 03 degC, t/s, x_mm
_MISSING = re.compile(
    r"[-+*#?._=]*|[+-]?(o\.?l\.?|ovl|over|overflow|overrange|over ?load|inf)|nan|n/?a|#n/?a|null|none|open|"
    r"(burn|break) ?-?out|b\.?o\.?|err|error|fault|invalid|bad|no ?data",
    re.IGNORECASE,
)
_OVERLOAD = 9.9e36  # what instruments write for a reading beyond their range, and more
_GROUPS = " \u00a0\u2009\u202f'\u2019"  # what parts thousands, beside the other decimal sign
LONG = 24  # characters of a name
OTHER_SIGN = {".": ",", ",": "."}
_NUMBER = {
    sign: re.compile(
        rf"[+-]? *(?=[{sign}]?\d)(?:[1-9]\d{{0,2}}([{_GROUPS}{other}])\d{{3}}(?:\1\d{{3}})*|\d+)?(?:[{sign}]\d*)?"
        r"(?:[eE][+-]?\d+)?",
        re.ASCII,
    )
    for sign, other in OTHER_SIGN.items()
}


def brief_name(name: str, longest: int = LONG) -> str:
    """A column's name for a message: of a long one both ends, for loggers' names differ at the last."""
    half = longest // 2 - 1
    return name if len(name) <= longest else f"{name[:half].rstrip()}..{name[-half:].lstrip()}"


def unit_named(text: str) -> str:
    """The unit that a text alone names, whatever its spelling; empty where it names none."""
    text = re.sub("Â°|[º˚\ufffd]", "°", text)  # a degree sign read by another code page, or what looks like one
    plain = unicodedata.normalize("NFKC", text).casefold().replace("°", "deg").replace("_", "/")
    return "" if re.search(r"\d", plain) else _SPELT.get(re.sub(r'[^a-zμ"/]', "", plain), "")


def measured_by(unit: str) -> str:
    """What a unit measures; empty for none."""
    return _UNITS[unit][0] if unit else ""


def units_like(unit: str) -> list[str]:
    """The units that measure the same."""
    return [other for other in _UNITS if measured_by(other) == measured_by(unit)]


def plain_name(text: str) -> str:
    """A column's name as it is compared: without case, and with one blank for whatever parts its words."""
    return re.sub(r"[\s_\-]+", " ", unicodedata.normalize("NFKC", text)).strip(" .:").casefold()


def name_and_unit(text: str) -> tuple[str, str]:
    """A column's name to compare, and the unit that stands behind it: ``TC 03 [°C]`` to ``tc 03``, ``degC``."""
    for mark in _MARKED.finditer(text):
        if unit := unit_named(mark[1]):
            return plain_name(text[: mark.start()] + text[mark.end() :]), unit
    for gap in _PARTED.finditer(text):
        name, rest = text[: gap.start()], text[gap.end() :]
        is_letter = rest.isascii() and len(rest) < 2 and (gap[0].isspace() or rest in "dD")  # Channel C is no unit
        if rest[:3].casefold() == "in_":  # time_in_min: no inches
            continue
        if name and (not is_letter or name.endswith(" in")) and (unit := unit_named(rest)):
            return plain_name(name.removesuffix(" in")), unit
    return plain_name(text), ""


def number_text(cell: str, sign: str) -> str | None:
    """A number by a decimal sign, with a point; empty where its reading is missing, None where it is no number."""
    if _MISSING.fullmatch(cell):
        return ""
    if not _NUMBER[sign].fullmatch(cell):
        return None
    plain = re.sub(f"[{_GROUPS}{OTHER_SIGN[sign]}]", "", cell).replace(",", ".")
    return plain if abs(float(plain)) < _OVERLOAD else ""


def is_number(cell: str) -> bool:
    """Whether a cell is a number by either decimal sign, or says that its reading is missing."""
    return any(number_text(cell, sign) is not None for sign in OTHER_SIGN)


def in_unit(number: str, given: str, wanted: str) -> str:
    """A number of one unit as text in another."""
    if not number or given == wanted:
        return number
    (_, size, zero, _), (_, wanted_size, wanted_zero, _) = _UNITS[given], _UNITS[wanted]
    return repr((float(number) - zero) * (size / wanted_size) + wanted_zero)
