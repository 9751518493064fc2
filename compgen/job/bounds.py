r"""What a path promises, the largest error that it may leave on the part, and the user's file it is held against.

How many draws a bound with a probability needs, and how many of them may break it.

Draws of an arm and a day are independent, and each keeps the bound or breaks it. When more than 1 - p of all arms and
days break it, k or fewer of n draws do so with a probability of at most

    P(Bin(n, 1 - p) <= k) = 1 - I_{1 - p}(k + 1, n - k)

I is the regularised incomplete beta function. Where that is at most 1 - c, k broken draws of n verify with confidence c
that the share p keeps the bound: the (k + 1)-th largest value of the draws is then an upper bound of the share's
quantile, whatever the distribution (Wilks 1941). With k = 0 the largest counts, and n = ln(1 - c) / ln(p): 59 draws for
95 % and 95 %, 93 if one may break it.
"""

from dataclasses import dataclass
from math import ceil, inf, log

from scipy.special import betainc

from compgen.core.arrays import Array, BoolArray, IntArray, owns

ROUNDING = 1e-13  # of an incomplete beta function: a confidence that is met exactly counts as met


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """The promise of a path: largest allowed values after correction; None asks for nothing."""

    max: float | None = None  # [m]
    p99: float | None = None  # [m]
    rms: float | None = None  # [m]
    feed: float | None = None  # [m] largest along feed
    cross: float | None = None  # [m]
    normal: float | None = None  # [m]
    axis: float | None = None  # [rad]
    guaranteed: "Guarantee | None" = None  # beside: what holds with a probability

    @property
    def least(self) -> float:
        """The smallest bound of the whole error [m]; infinite where none is given."""
        return min((bound for bound in (self.max, self.p99, self.rms) if bound is not None), default=inf)


@dataclass(frozen=True, slots=True, kw_only=True)
class Guarantee:
    """Bounds that a share of all arms and days keeps, verified with a confidence by draws of them."""

    bounds: Bounds
    share: float
    confidence: float
    draws: int
    may_break: int  # of the draws
    seed: int


@dataclass(frozen=True, eq=False, slots=True)
@owns(corner=("V", 3), line=("V",), given=("V",))
class OwnFile:
    """A user's own file as the judge has read it: V corners in the order they are driven, in the frame of the part."""

    source: str
    corner: Array  # (V, 3) [m]
    line: IntArray  # (V,) of the file that each belongs to
    given: BoolArray  # (V,) a place that the file names; the others stand on its arcs
    joined: bool  # whether what lies between them is lines; a curve through them is free there


def draws_needed(share: float, confidence: float) -> int:
    """The fewest draws that verify a share with a confidence: none of them may break the bound."""
    n = max(1, ceil(log(1 - confidence) / log(share) - 1e-9))
    return n if _confidence(n, 0, share) >= confidence else n + 1


def draws_that_may_break(draws: int, share: float, confidence: float) -> int | None:
    """How many of some draws may break a bound whose share is verified all the same; None where they are too few."""
    if _confidence(draws, 0, share) < confidence:
        return None
    low, high = 0, draws  # low is allowed, high is not
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if _confidence(draws, middle, share) >= confidence else (low, middle)
    return low


def _confidence(draws: int, broken: int, share: float) -> float:
    """With which confidence the share keeps a bound that so many of the draws break, at most."""
    return float(betainc(broken + 1, draws - broken, 1 - share)) + ROUNDING
