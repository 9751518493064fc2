"""What a path promises: the largest error that it may leave on the part."""

from dataclasses import dataclass


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Guarantee:
    """Bounds that a share of all arms and days keeps, verified with a confidence by draws of them."""

    bounds: Bounds
    share: float
    confidence: float
    draws: int
    may_break: int  # of the draws
    seed: int
