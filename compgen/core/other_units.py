"""Values that are plausible in another unit only: what a key was probably meant to say.

A rule holds keys whose values cannot sensibly be so small, or so large, and why:

- tools, arms, frames, parts and patterns are centimetres to metres: one all of whose lengths are below 3 mm is in
  metres;
- a tool of less than 25 mm is in inches; a length of a spindle below 3 mm is in metres, and so is a hole below 1 mm;
- a pattern lies around no place within 100 mm of the J1 axis: a coordinate below 3 mm there is in metres;
- a tool lifts by millimetres: 0.02 is metres;
- materials grow by 0.5 (invar) to 30 um/m/K: 12e-6 is 1/K, 0.012 mm/m/K;
- tools travel at 1 mm/s or more: 0.2 is m/s; robots turn at 12 deg/s or more at their fastest: 3 is rad/s; their joints
  turn by more than 7 deg to one side: 3.14 is radians;
- a controller smooths over an interpolation period at least: 0.2 ms is seconds;
- masses lie centimetres and more from their joint; joints give 0.01 urad/(N m) and more: 3e-7 is rad/(N m);
- mirrors have radii of up to 1 km and lie up to 100 m off the parent's axis: 84000 is mm;
- a tool leads or leans by half a degree or more: 0.14 is radians;
- an angle of a tool, a frame, an arm or a pattern that is a multiple of pi/4 to three digits is in radians, and so is
  one of pi/12 to four.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import hypot, inf, pi
from typing import Any

from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.unique_rows import grouped
from compgen.core.units import DEG, MM


@dataclass(frozen=True, slots=True, kw_only=True)
class _Rule:
    keys: str  # regular expression of dotted keys, places in lists left out
    together: bool  # whether the values of a table or a list are judged by their largest
    least: float = 0.0  # what is below it, and not zero, was meant in another unit
    most: float = inf  # and what is above it
    factor: float = 1e3  # from that unit
    unit: str = "metres"
    expected: str = "mm"


_SHORT = 3  # mm: of no arm, tool, frame or pattern
_IN_THE_BASE = 100.0  # mm from World's origin, where no instrument stands, and metres from it any does
_SHORTEST_TOOL = 25  # mm from the flange
_EXPANSION = r"thermal\.(uncertainty\.)?cte_um_m_K(\.\w+)?"
_RULES = (
    _Rule(keys=r"(tool|u(frame|tool)\.\d+)\.([xyz]|length)_mm|boundary\.corners_mm", together=True, least=_SHORT),
    _Rule(
        keys=r"(tool|utool\.\d+)\.([xyz]|length)_mm",
        together=True,
        least=_SHORTEST_TOOL,
        factor=25.4,
        unit="inches",
        expected="mm",
    ),
    _Rule(
        keys=r"(dh\.[ad]|identified\.(reflector|instrument)|sources\.loads\.(link|payload)_centre)_mm(\.\w+)?",
        together=True,
        least=_SHORT,
    ),
    _Rule(keys=r"tool\.length_mm", together=False, least=_SHORT),
    _Rule(keys=r"boundary\.holes\.(diameter|length|width|size|corners)_mm", together=True, least=1),
    _Rule(keys=r"process\.(lead|lean)_deg", together=True, least=0.5, factor=1 / DEG, unit="radians", expected="deg"),
    _Rule(keys=r"process\.lift_mm", together=False, least=0.1),
    _Rule(keys=r"surface\.radius_of_curvature_m", together=False, most=1000, factor=1e-3, unit="mm", expected="m"),
    _Rule(keys=r"surface\.off_axis_m", together=False, most=100, factor=1e-3, unit="mm", expected="m"),
    _Rule(keys=r"path\.(length|diameter|size)_mm|boundary\.(?!corners)\w+_mm", together=False, least=_SHORT),
    _Rule(keys=_EXPANSION, together=False, least=1e-3, factor=1e6, unit="1/K", expected="um/m/K"),
    _Rule(keys=_EXPANSION, together=False, least=0.1, factor=1e3, unit="mm/m/K", expected="um/m/K"),
    _Rule(
        keys=r"(process|before|cycle|after)\.feed_mm_s",
        together=False,
        least=1,
        factor=1e3,
        unit="m/s",
        expected="mm/s",
    ),
    _Rule(
        keys=r"motion\.(moving_average|first_order)_ms",
        together=True,
        least=1,
        factor=1e3,
        unit="seconds",
        expected="ms",
    ),
    _Rule(
        keys=r"sources\.compliance\.compliance_urad_Nm",
        together=True,
        least=1e-3,
        factor=1e6,
        unit="rad/(N m)",
        expected="urad/(N m)",
    ),
    _Rule(keys=r"limits\.j\w+_deg", together=True, least=7, factor=1 / DEG, unit="radians", expected="deg"),
    _Rule(keys=r"limits\.speed_deg_s", together=True, least=12, factor=1 / DEG, unit="rad/s", expected="deg/s"),
)
_ANGLES = (
    r"(tool|frame|u(frame|tool)\.\d+)\.([wpr]|spin|tilt|tilt_towards)_deg|dh\.alpha_deg|pendant\.offset_deg|"
    r"path\.angle_deg|boundary\.(holes\.)?rotation_deg|process\.(lead|lean)_deg"
)
_AT_AXIS = 100  # mm from the J1 axis: no pattern has its centre there
_PART = pi / 12
_RIGHT, _FOUR_DIGITS = 2e-3, 5e-4  # rad: how near to a multiple of pi/4 three digits come, and to one of pi/12 four


def values_in_other_units(data: Mapping[str, Any], file: str) -> tuple[Finding, ...]:
    """A warning for each value of a file's tables that was probably given in another unit."""
    values = list(_numbers_in(data, "", ""))
    findings: dict[str, Finding] = {}
    for rule in _RULES:
        groups = grouped(
            (re.sub(r"(\.\d+)+$|\.\w+$", "", key) if rule.together else key, (key, value))  # its table or list
            for key, plain, value in values
            if re.fullmatch(rule.keys, plain)
        )
        for group in groups.values():
            key, value = max(group, key=lambda pair: abs(pair[1]))
            if 0 < abs(value) < rule.least or abs(value) > rule.most:
                findings.setdefault(key, _finding(file, key, value, rule.factor, rule.unit, rule.expected))
    centre = {key: value for key, _, value in values if key in ("path.x_mm", "path.y_mm")}
    small = {key: value for key, value in centre.items() if 0 < abs(value) < _SHORT}
    if small and hypot(*centre.values()) < _AT_AXIS:
        key = max(small, key=lambda key: abs(small[key]))
        findings.setdefault(key, _finding(file, key, small[key], 1e3, "metres", "mm"))
    for key, plain, value in values:
        multiple = round(value / _PART)
        near = _FOUR_DIGITS if multiple % 3 else _RIGHT
        if re.fullmatch(_ANGLES, plain) and 1 <= abs(multiple) <= 24 and abs(value - multiple * _PART) < near:
            findings.setdefault(key, _finding(file, key, value, 1 / DEG, "radians", "deg"))
    return tuple(findings.values())


def lengths_in_other_units(option: str, text: str, lengths: Sequence[float]) -> tuple[Finding, ...]:
    """A warning where the lengths of an option [mm] were probably given in metres."""
    if not 0 < max(map(abs, lengths)) < (_IN_THE_BASE if option == "--instrument" else _SHORT):
        return ()
    meant = " ".join(f"{length / MM:.4g}" for length in lengths)
    message = f"{option} '{text}': did you mean '{meant}'? it looks like metres, it is in mm"
    return (Finding.of(Code.UNITS_UNLIKELY, message),)


def _finding(file: str, key: str, value: float, factor: float, unit: str, expected: str) -> Finding:
    message = f"{key} = {value:g}: did you mean {value * factor:.4g}? it looks like {unit}, the key is in {expected}"
    return Finding.of(Code.UNITS_UNLIKELY, f"{file}: {message}")


def _numbers_in(data: Any, key: str, plain: str) -> Iterator[tuple[str, str, float]]:
    """Numbers in nested tables and lists, with their dotted key, with and without the places in lists."""
    if isinstance(data, Mapping):
        for name, value in data.items():
            yield from _numbers_in(value, f"{key}.{name}".lstrip("."), f"{plain}.{name}".lstrip("."))
    elif isinstance(data, list):
        for n, value in enumerate(data):
            yield from _numbers_in(value, f"{key}.{n}", plain)
    elif isinstance(data, int | float) and not isinstance(data, bool):
        yield key, plain, float(data)
