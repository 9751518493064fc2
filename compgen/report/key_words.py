"""Keys of files, columns and reports in words, each with the unit that its name carries."""

from compgen.core.units import parted

#: signs of a page, as the command line writes them
SIGNS = (("µm", "um"), ("µrad", "urad"), ("°C", "degC"), ("²", "^2"), ("³", "^3"))
#: names without their units; what is not here is read as it is spelt
WORDS = {
    "ambient.value": "air temperature",
    "path.x": "x of the path",
    "path.y": "y of the path",
    "path.z": "z of the path",
    "bounds.max": "bound of the largest error",
    "bounds.p99": "bound of the 99th percentile",
    "bounds.rms": "bound of the rms error",
    "before_on_part_max": "before max, on the part",
    "after_on_part_max": "after max, on the part",
    "band": "may be off beside that (95 %)",
    "index": "scenario",
    "inside": "inside its bounds",
    "warmup": "warm-up",
    "cte": "coefficient of expansion",
    "acc": "acceleration",
    "thermal.model": "heat model",
    "tau": "time constant",
    "at_feed": "length at feed",
    "lift_all": "lift of a dry run",
    "residual": "one corrected file leaves",
    "residual_max": "one corrected file leaves",
    "error_max": "largest error, uncorrected",
    "p95": "may be off (95 %)",
    "late": "a late start adds",
    "delay": "late by",
    "ambient_K": "air warmer by",
    "ambient_um": "another air adds",
    "to_go": "still to come",
    "of_largest": "of the largest error",
    "own_largest": "its own largest",
    "hours": "time [h]",
    "excess_a": "relative expansion beyond the file's of a",
    "excess_d": "relative expansion beyond the file's of d",
}
#: tables whose keys say enough without them
PLAIN = {"path", "robot", "process", "thermal", "compensation", "sources", "options", "timing", "program", "runs"}
STRETCH = {"before": "warm-up", "cycle": "stretch of the cycle", "after": "stretch after"}
_ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth")


def unit_of(key: str) -> str:
    """The unit that a key's name ends with, as a page has it; empty without one."""
    names = [step for step in _steps(key) if not step.isdigit()]  # an entry of a list has the list's
    return with_signs(parted(names[-1])[1]) if names else ""


def with_signs(unit: str) -> str:
    """A unit of the command line as a page has it."""
    for sign, letters in SIGNS:
        unit = unit.replace(letters, sign)
    return unit


def words_of(key: str) -> str:
    """A key in words, without its unit: ``before.0.duration_h`` is the first warm-up."""
    *tables, last = _steps(key)
    if last.isdigit() and tables:  # an entry of a list
        return f"{words_of('.'.join(tables))} {int(last) + 1}"
    stem, _ = parted(last)
    name = WORDS.get(last) or WORDS.get(stem, stem.replace("_", " "))
    if not tables:
        return name
    if len(tables) > 1 and tables[-2] in STRETCH and tables[-1].isdigit():
        stretch = f"{ordinal(int(tables[-1]))} {STRETCH[tables[-2]]}"
        return stretch if stem == "duration" else f"{name} of the {stretch}"
    if whole := WORDS.get(f"{tables[-1]}.{stem}"):
        return whole
    named = [str(int(t) + 1) if t.isdigit() else t.replace("_", " ") for t in tables if t not in PLAIN]
    return ", ".join([" ".join(named), name] if named else [name])


def title_of(key: str) -> str:
    """A key in words with its unit in brackets, as an axis or a column has it."""
    unit = unit_of(key)
    return f"{words_of(key)} [{unit}]" if unit else words_of(key)


def parameter_words(name: str) -> str:
    """A source's parameter with its unit: ``link_offsets.alpha_mdeg[2]`` is link offsets: alpha 2 [mdeg]."""
    source, _, entry = name.partition(".")
    stem, _, place = entry.rstrip("]").partition("[")
    stem, unit = parted(stem)
    words = f"{source.replace('_', ' ')}: {WORDS.get(stem, stem.replace('_', ' '))} {place}".strip()
    return f"{words} [{with_signs(unit)}]" if unit else words


def ascii_units(text: str) -> str:
    """Units in a text as the command line writes them."""
    for sign, letters in (*SIGNS, ("–", "-")):
        text = text.replace(sign, letters)
    return text


def capital(text: str) -> str:
    """A text that begins a heading."""
    return text[:1].upper() + text[1:]


def ordinal(n: int) -> str:
    """The word for row n of a table, from 0."""
    return _ORDINALS[n] if n < len(_ORDINALS) else f"{n + 1}th"


def _steps(key: str) -> list[str]:
    return key.strip().split(".")
