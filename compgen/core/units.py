"""The only conversion factors. Multiply by a unit to come in, divide by it to go out."""

from math import pi

MM = 1e-3  # m
UM = 1e-6  # m
DEG = pi / 180  # rad
MDEG = DEG / 1000  # rad
HOUR = 3600.0  # s
DAY = 24 * HOUR  # s
MS = 1e-3  # s
INCH = 25.4e-3  # m
MINUTE = 60.0  # s
KB = 1000.0  # bytes
MB = 1000 * KB  # bytes
URAD = 1e-6  # rad
NRAD = 1e-9  # rad
PPM = 1e-6  # parts per million
PERCENT = 0.01

#: what the end of a key's name says, as the command line writes it
UNIT_AT_END = {
    "um": "um", "nm": "nm", "mm": "mm", "m": "m", "mm_s": "mm/s", "m_s2": "m/s^2", "um_mm": "um/mm", "um_K": "um/K",
    "um_m_K": "um/(m K)", "deg": "deg", "mdeg": "mdeg", "deg_s": "deg/s", "deg_s2": "deg/s^2", "deg_s3": "deg/s^3",
    "arcsec_K": "arcsec/K", "urad_Nm": "urad/(N m)", "nrad_Nm2": "nrad/(N m)^2",
    "ms": "ms", "s": "s", "min": "min", "h": "h", "degC": "degC",
    "K": "K", "W": "W", "W_K": "W/K", "W_mm_K": "W mm/K", "J_kgK": "J/(kg K)", "kg": "kg", "N": "N", "kB": "kB",
    "ppm": "ppm", "percent": "%", "m2": "m^2", "percent_m2": "%/m^2",
}  # fmt: skip
FEW = 10  # hours or minutes, beside which the next unit counts


def parted(name: str) -> tuple[str, str]:
    """A key's name without its unit, and the unit, the longest that it ends with; "" without one."""
    words = name.split("_")
    ends = ((words[:k], UNIT_AT_END.get("_".join(words[k:]), "")) for k in range(1, len(words)))
    return next((("_".join(stem), unit) for stem, unit in ends if unit and any(stem)), (name, ""))


def counted(count: int, one: str, many: str) -> str:
    """So many of a thing: ``1 touch``, ``3 touches``."""
    return f"{count} {one if count == 1 else many}"


def span_words(expected: str, least: str, most: str) -> str:
    """A range beside what is expected, which is not said twice: ``154 to 237``, ``up to 240``, ``from 154``."""
    if least == expected:
        return f"up to {most}"
    return f"from {least}" if most == expected else f"{least} to {most}"


def limit_words(seconds: float) -> str:
    """A time that may not be exceeded, never rounded up: ``17 minutes``, ``2 hours 5 minutes``."""
    whole = int(seconds)
    counts = whole // int(HOUR), whole // int(MINUTE) % 60, whole % 60
    units = list(zip(("hour", "minute", "second"), counts, strict=True))
    first = next((k for k, count in enumerate(counts) if count), 2)
    shown = units[first : first + 1 + (counts[first] < FEW)]  # of many hours nobody wants the minutes
    return " ".join(f"{count} {unit}{'s' * (count != 1)}" for unit, count in shown if count or first == 2)
