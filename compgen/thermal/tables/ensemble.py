"""The table ``compensation.average_over``: the starts that one file serves."""

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from compgen.core.exceptions import InputError
from compgen.core.toml import Table, check, table_of_words
from compgen.core.units import MINUTE, MM
from compgen.thermal.ensemble import Ensemble, Start
from compgen.thermal.tables.schema import StartTable

Delay = Annotated[FiniteFloat, Field(ge=0, le=57_600)]  # s, sixteen hours: after that a robot has forgotten its start
Override = Annotated[FiniteFloat, Field(ge=1, le=100)]  # %
Feed = Annotated[FiniteFloat, Field(gt=0, le=1e4)]  # mm/s
RunNumber = Annotated[int, Field(ge=1, le=20_000)]


class AverageOverTable(Table):
    """The starts that one file serves; its correction has the smallest expected squared error over all of them."""

    delay_s: Annotated[list[Delay], Field(min_length=2, max_length=2)] | None = None
    """First and last start, counted from the planned one, servo on; all between are equally likely; default at once."""
    override_percent: Annotated[list[Override], Field(min_length=1, max_length=16)] | None = None
    """Overrides at which the program runs, equally often; default 100."""
    feed_mm_s: Annotated[list[Feed], Field(min_length=1, max_length=16)] | None = None
    """The same by the feeds that they come to, none above process.feed_mm_s; this or override_percent."""
    runs: Literal["all"] | Annotated[list[RunNumber], Field(min_length=2, max_length=2)] | None = None
    """First and last run of [[cycle]], from 1, all between counting alike, or "all"; default the first alone."""


def ensemble_of(table: AverageOverTable, run_count: int, feed: float, where: str) -> Ensemble:
    """The starts in SI.

    Args:
        table: As the file has it.
        run_count: How many runs the cycle has.
        feed: That the program is written with [m/s].
        where: The table's place, for messages.

    Raises:
        InputError: Nothing to average over, an interval that does not rise, a run that there is none of, two ways of
            saying the same.
    """
    if not table.model_fields_set:
        raise InputError(f"{where}: it names nothing to average over; give delay_s, override_percent or runs")
    delay = table.delay_s or [0.0, 0.0]
    if delay[0] > delay[1]:
        raise InputError(f"{where}.delay_s: {delay} must rise; give the earliest start first")
    runs = [1, run_count] if table.runs == "all" else table.runs or [1, 1]
    if runs[0] > runs[1]:
        raise InputError(f"{where}.runs: {runs} must rise; give the first run first")
    if runs[1] > run_count:
        known = f"runs are {_runs(run_count)}; they count from [start]"
        raise InputError(f"{where}.runs: there is no run {runs[1]}; {known}")
    return Ensemble((delay[0], delay[1]), _overrides(table, feed, where), (int(runs[0]) - 1, int(runs[1]) - 1))


def start_of(table: StartTable | None, run_count: int, where: str) -> Start:
    """The start that is meant: the first run's where the file says none.

    Raises:
        InputError: A run that there is none of.
    """
    if table is None:
        return Start()
    if table.run > run_count:
        raise InputError(f"{where}: start.run: there is no run {table.run}; runs are {_runs(run_count)}")
    return Start(table.run - 1, table.delay_min * MINUTE)


def latest_delay(start: StartTable | None, table: AverageOverTable | None) -> float:
    """How long the robot may stand before its program starts [s]."""
    planned = 0.0 if start is None else start.delay_min * MINUTE
    return planned + float(max((table.delay_s or (0.0,)) if table else (0.0,)))


def _runs(count: int) -> str:
    return f"1 to {count}" if count > 1 else "1 alone; [[cycle]] with a repeat gives more"


def ensemble_of_words(words: str, where: str) -> Ensemble:
    """The starts of a program that exists: keys of the table, as in ``delay_s=[0, 1200]``.

    Raises:
        InputError: Not understood, or starts that such a program has none of; says how it is written.
    """
    table = check(AverageOverTable, table_of_words(words, where, "delay_s=[0, 1200]"), where)
    if table.runs is not None:
        raise InputError(f"{where}: runs: a program that exists has no [[cycle]]; say with --before what ran before it")
    if table.feed_mm_s is not None:
        raise InputError(f"{where}: feed_mm_s: its lines have feeds of their own; give override_percent")
    return ensemble_of(table, 1, 1.0, where)


def _overrides(table: AverageOverTable, feed: float, where: str) -> tuple[float, ...]:
    """Shares of the written speed, the slowest first."""
    if table.override_percent is not None and table.feed_mm_s is not None:
        raise InputError(f"{where}.feed_mm_s: conflicts with override_percent, which says the same; remove one")
    key, values, full = "override_percent", table.override_percent or [100.0], 100.0
    if table.feed_mm_s is not None:
        key, values, full = "feed_mm_s", table.feed_mm_s, feed / MM
    if twice := next((value for value in values if values.count(value) > 1), None):
        raise InputError(f"{where}.{key}: {twice:g} stands twice; each counts alike, give it once")
    if max(values) > full * (1 + 1e-9):
        limit = f"process.feed_mm_s = {full:g}, and an override only slows; raise that, or leave {max(values):g} out"
        raise InputError(f"{where}.{key}: {max(values):g} is above {limit}")
    if min(values) < full / 100 * (1 - 1e-9):
        raise InputError(f"{where}.{key}: {min(values):g} is under 1 % of {full:g}; an override goes from 1 to 100 %")
    return tuple(sorted(min(value / full, 1.0) for value in values))
