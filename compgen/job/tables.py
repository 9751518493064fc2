"""Tables that a cell and a job keep: ``[bounds]`` of a path file, ``[anchor]`` and ``[identified]`` of a robot file."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field, FiniteFloat

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError
from compgen.core.toml import Angle, NotNegative, Number, Point, Positive, Table, check, table_of_words
from compgen.core.units import MDEG, PERCENT, UM
from compgen.job.bounds import Bounds, Guarantee, draws_needed, draws_that_may_break

MOST_DRAWS = 10_000

Probability = Annotated[FiniteFloat, Field(gt=0, lt=1)]
Sigma = Annotated[FiniteFloat, Field(ge=0, le=1e5)]
Three = Annotated[list[Sigma], Field(min_length=3, max_length=3)]


class LargestTable(Table):
    """Largest residual of the written program on the part."""

    max_um: Positive | None = None
    """Largest distance from the target."""
    p99_um: Positive | None = None
    """99th percentile of the distance, over the length of the path."""
    rms_um: Positive | None = None
    """Root mean square of the distance, over the length of the path."""
    feed_um: Positive | None = None
    """Largest residual along the feed, square to the tool."""
    cross_um: Positive | None = None
    """Largest residual across the feed, square to the tool."""
    normal_um: Positive | None = None
    """Largest residual along the tool: the surface's normal, unless the tool leans."""
    axis_mdeg: Positive | None = None
    """Largest tilt of the tool axis."""


class GuaranteedTable(LargestTable):
    """Bounds that a share of all arms and days keeps on the whole path, verified by draws that the twin flies."""

    share: Probability = 0.95
    """Share of arms and days that keep the bounds."""
    confidence: Probability = 0.95
    """With which the draws verify that."""
    draws: Annotated[int, Field(json_schema_extra={"minimum": 1, "maximum": MOST_DRAWS})] | None = None
    """Flights of the whole path; default the fewest that share and confidence need, 59 for 0.95 and 0.95."""
    seed: Annotated[int, Field(ge=0, le=999_999_999)] = 0
    """Of the draws."""


class BoundsTable(LargestTable):
    """Largest residual of the written program on the part; the bounds that are given are verified."""

    guaranteed: GuaranteedTable | None = None


def bounds_of(table: BoundsTable, where: str) -> Bounds:
    """The bounds in SI.

    Raises:
        InputError: A bound with a probability and too few draws for it, or a probability without a bound.
    """
    guaranteed = None if table.guaranteed is None else _guarantee_of(table.guaranteed, f"{where}: bounds.guaranteed")
    return _largest(table, guaranteed)


def guarantee_of_words(words: str, where: str) -> Guarantee:
    """What a program that exists promises: keys of the table, as in ``max_um=60, share=0.95``.

    Raises:
        InputError: Not understood, too few draws, or a bound along a surface, of which such a program says nothing.
    """
    table = check(GuaranteedTable, table_of_words(words, where, "max_um=60, share=0.95"), where)
    for key in ("feed_um", "cross_um", "normal_um", "axis_mdeg"):
        if getattr(table, key) is not None:
            raise InputError(
                f"{where}: {key}: a program that exists does not say where its part's surface is; give max_um, p99_um "
                "or rms_um"
            )
    return _guarantee_of(table, where)


def words_of_guarantee(guarantee: Guarantee) -> dict[str, float]:
    """The keys of a promise that ``guarantee_of_words`` took."""
    sizes = {key: getattr(guarantee.bounds, key) for key in ("max", "p99", "rms")}
    bounds = {f"{key}_um": round(size / UM, 9) for key, size in sizes.items() if size is not None}
    return {**bounds, **{key: getattr(guarantee, key) for key in ("share", "confidence", "draws", "seed")}}


def _guarantee_of(table: GuaranteedTable, key: str) -> Guarantee:
    bounds = _largest(table)
    if bounds == Bounds():
        raise InputError(f"{key}: it gives no bound; add max_um, or remove the table")
    needed = draws_needed(table.share, table.confidence)
    if needed > MOST_DRAWS:
        raise InputError(
            f"{key}.share: {table.share} with confidence {table.confidence} needs {needed} draws, {MOST_DRAWS} can be "
            "flown; lower share or confidence"
        )
    draws = needed if table.draws is None else table.draws
    may_break = draws_that_may_break(draws, table.share, table.confidence) if needed <= draws <= MOST_DRAWS else None
    if may_break is None:
        promise = f"share {table.share} with confidence {table.confidence}"
        raise InputError(f"{key}.draws: {draws}: {promise} needs {needed} to {MOST_DRAWS}; give such, or leave it out")
    return Guarantee(
        bounds=bounds, share=table.share, confidence=table.confidence, draws=draws, may_break=may_break, seed=table.seed
    )


def _largest(table: LargestTable, guaranteed: Guarantee | None = None) -> Bounds:
    def um(value: float | None) -> float | None:
        return None if value is None else value * UM

    axis = None if table.axis_mdeg is None else table.axis_mdeg * MDEG
    return Bounds(
        max=um(table.max_um),
        p99=um(table.p99_um),
        rms=um(table.rms_um),
        feed=um(table.feed_um),
        cross=um(table.cross_um),
        normal=um(table.normal_um),
        axis=axis,
        guaranteed=guaranteed,
    )


class AnchorTable(Table):
    """What may drift from day to day, for cgen anchor: standard deviations before any touch."""

    base_um: Three | None = None
    """Of the base's shift along World x, y, z; left out: 10 um and what the thermal physics may miss."""
    base_mdeg: Three | None = None
    """Of the base's turn about World x, y, z; left out: what moves the part's edge by as much."""
    drifting: Annotated[dict[Annotated[str, Field(max_length=120)], Sigma], Field(max_length=50)] = {}
    """Of numbers of this file, counted from 1 (--set: 0), in their units: { "joint_zeros.offset_mdeg[2]" = 0.5 }."""


@dataclass(frozen=True, eq=False, slots=True)
class Drifting:
    """What may drift."""

    shift: Array | None = None  # (3,) [m] of the base; None: not said
    turn: Array | None = None  # (3,) [rad]
    numbers: tuple[str, ...] = ()
    sigma: tuple[float, ...] = ()  # in the unit of each


def drifting_of(table: AnchorTable | None) -> Drifting:
    """The table in SI."""
    if table is None:
        return Drifting()
    shift = None if table.base_um is None else np.array(table.base_um) * UM
    turn = None if table.base_mdeg is None else np.array(table.base_mdeg) * MDEG
    return Drifting(shift, turn, tuple(table.drifting), tuple(table.drifting.values()))


class IdentifiedTable(Table):
    """Record of the identification: where instrument and reflectors stood, and how well the fit predicts."""

    model: str = ""
    """Which groups of parameters were identified."""
    noise_um: NotNegative = 0.0
    """Standard deviation of one measured coordinate."""
    held_out_um: Annotated[list[Number], Field(max_length=3)] = []
    """Error at poses that the fit did not see: mean and its 95 % interval."""
    posterior: Annotated[str, Field(pattern=r"^([^/\\]{1,120}\.posterior\.json)?$")] = ""
    """File beside this one with the covariance of the identified parameters."""
    posterior_sha256: Annotated[str, Field(pattern="^([0-9a-f]{64})?$")] = ""
    """Its sha256 (line ends as LF): no other file is taken for it."""
    fit_noise_um: NotNegative = 0.0
    """Error of the fit along any direction that is neither the instrument's nor the robot's repeatability."""
    thermal_missing_percent: Annotated[FiniteFloat, Field(ge=0, le=200)] | None = None
    """What the fitted physics leaves out of the thermal error, along any direction; from blocks foretold in time."""
    repeatability_um: NotNegative | None = None
    """Standard deviation of one run from the mean of all, along any direction."""
    forecast_scale: Annotated[FiniteFloat, Field(ge=1, le=100)] = 1.0
    """Factor of the band: rms score of blocks of warm poses that were foretold from those before, at least 1."""
    forecast_blocks: Annotated[int, Field(ge=0, le=10_000)] = 0
    """How many blocks that score is of."""
    instrument: str = ""
    """Name of the instrument, where the measurements name it."""
    instrument_mm: Annotated[list[Number], Field(min_length=3, max_length=3)] | None = None
    """Origin of World in the instrument's frame."""
    instrument_deg: Annotated[list[Angle], Field(min_length=3, max_length=3)] | None = None
    """Rotation vector from World to the instrument's frame."""
    reflector_mm: dict[str, Point]
    """Place of each reflector in the flange, by its name."""
    artefact_mm: dict[str, Point] = {}
    """Origin of World in the frame of each artefact of known places that was touched, by its file's name."""
    artefact_deg: dict[str, Annotated[list[Angle], Field(min_length=3, max_length=3)]] = {}
    """Rotation vector from World to that frame."""
    place_mm: dict[str, Point] = {}
    """Place of each sphere, in its artefact's frame or in World, and of each socket of a ballbar."""


@dataclass(frozen=True, slots=True)
class FitLimits:
    """What an identification says that its fit cannot do."""

    noise: float = 0.0  # [m] tau
    missing: float | None = None  # kappa, of the thermal error; None: the file's own for warmth holds
    repeatability: float | None = None  # [m] of one run; None: not known
    scale: float = 1.0  # lambda, of the whole band
    blocks: int = 0  # that the scale was found from


def fit_limits_of(table: IdentifiedTable | None) -> FitLimits:
    """What a robot file's record of its identification says of its fit."""
    if table is None:
        return FitLimits()
    missing, repeatability = table.thermal_missing_percent, table.repeatability_um
    return FitLimits(
        noise=table.fit_noise_um * UM,
        missing=None if missing is None else missing * PERCENT,
        repeatability=None if repeatability is None else repeatability * UM,
        scale=table.forecast_scale,
        blocks=table.forecast_blocks,
    )
