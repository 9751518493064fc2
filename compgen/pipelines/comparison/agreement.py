"""How far two numbers of reports may be apart and still be the same: by less than the last digit that a table shows.

Reports hold all digits of a double. Sums in another order, another machine, another version of a library move the
last of them, which is nothing that anybody changed.
"""

from math import floor, log10

from compgen.core.units import UM

RISES = "rise_K."  # what the keys of rises begin with
#: by what a key ends with, the last digit that is shown: 0.01 um, mdeg, s or K, and 0.01 % of a share
SHOWN = {"_um": 0.01, "_mdeg": 0.01, "_s": 0.01, "at_feed": 1e-4}
DIGITS = 6  # that are shown of every other number that is no count
ERROR = SHOWN["_um"] * UM  # [m]


def tolerance_of(key: str, a: float, b: float) -> float:
    """What the values of a key may differ by, in its own unit; counts are exact."""
    if isinstance(a, int) and isinstance(b, int):
        return 0.0
    if key.startswith(RISES):
        return 0.01
    shown = next((limit for ending, limit in SHOWN.items() if key.endswith(ending)), None)
    if shown is not None:
        return shown
    return 10.0 ** (floor(log10(max(abs(a), abs(b)))) + 1 - DIGITS)
