"""The table of how a robot's own controller moves, and where its numbers come from.

The table of what controllers of a class of arm do, where a robot file does not know its own motion.
"""

from dataclasses import replace
from math import inf
from typing import Annotated, Final, Literal

from pydantic import Field, FiniteFloat

from compgen.core.exceptions import InputError
from compgen.core.toml import NotNegative, Table
from compgen.core.units import MS, PERCENT, UM
from compgen.robot.motion import ANY_ARM, ControllerMotion, ExpectedMotion, MotionEvidence, MotionVerdict, RunBeginning

LONGEST = 2000.0  # ms
MOST = 2  # moving means, and first-order lags
Time = Annotated[FiniteFloat, Field(json_schema_extra={"minimum": 0, "maximum": LONGEST})]  # ms
Times = Annotated[list[Time], Field(json_schema_extra={"maxItems": MOST})]
OLD: Final = "accepted"  # as older files say that a motion may be commanded against
TwoMeans = Annotated[list[Annotated[FiniteFloat, Field(ge=0, le=LONGEST)]], Field(min_length=2, max_length=2)]  # ms


class MotionIdentifiedTable(Table):
    """Where the numbers of the controller's motion come from, as ``cgen identify-motion`` writes it."""

    robot: Annotated[str, Field(min_length=1, max_length=24)]
    """Name of the robot whose log it was; that of another robot is refused."""
    verdict: Literal["may be commanded against", "foretells", "rejected", "accepted"]
    """What the numbers are good for, by stretches of the log that the fit had not seen; accepted: commanded against."""
    log_sha256: Annotated[str, Field(pattern="^([0-9a-f]{64})?$")] = ""
    """The executed log's sha256."""
    program: Annotated[str, Field(max_length=40)] = ""
    """Program that was executed."""
    override_percent: Annotated[FiniteFloat, Field(gt=0, le=100)] = 100.0
    """Override that it was executed at."""
    held_out_um: NotNegative | None = None
    """Largest deviation from the log left on stretches that the fit had not seen."""
    held_out_rms_um: NotNegative = 0.0
    """The rms left there of one coordinate square to the path: a row of the band."""
    runs_began: Literal["short", "long", "both"] | None = None
    """How the logged runs with bends began: by a line shorter than the means, or as long; else none is commanded."""


class MotionTable(Table):
    """How the controller moves through what it is told; without this table that is not known."""

    enabled: bool = False
    """Whether programs are pre-distorted for it; needs an accepted [motion.identified]."""
    space: Literal["cartesian", "joint"] = "cartesian"
    """In which the commanded motion is smoothed."""
    moving_average_ms: Times = []
    """Windows of up to two moving means, one after the other."""
    after_long_ms: Times = []
    """The same in a run, from a stop to the next, whose first statement lasts at least their sum; default alike."""
    reach_percent_m2: Annotated[FiniteFloat, Field(ge=0, le=100)] = 0.0
    """By how much means grow with the most r1^2 + r2^2 on a line, elbow and wrist from the J1 axis; default alike."""
    reach_at_m2: Annotated[FiniteFloat, Field(ge=0, le=100)] = 0.0
    """The sum at which they are as given."""
    first_order_ms: Times = []
    """Time constants of up to two first-order lags behind them."""
    lag_ms: Time = 0.0
    """By how much the whole motion comes late beside."""
    identified: MotionIdentifiedTable | None = None


def motion_of(table: MotionTable | None, robot: str, where: str) -> ControllerMotion | None:
    """The controller's motion; None where a robot file says nothing of it.

    Args:
        table: As the file has it.
        robot: Name of the file's robot.
        where: The file, for messages.

    Raises:
        InputError: Times that no controller has or too many of them; pre-distortion without numbers from a log, or
            with those of another robot.
    """
    if table is None:
        return None
    _check_times(table, where)
    identified = table.identified
    if identified is not None and identified.robot != robot:
        raise InputError(
            f"{where}: motion.identified.robot: '{identified.robot}', this file is of '{robot}'; the motion of another "
            "robot is not this one's: run cgen identify-motion with a log of this robot"
        )
    if table.enabled and identified is None:
        raise InputError(
            f"{where}: motion.enabled: true needs [motion.identified], numbers from a log of this robot; run "
            "cgen identify-motion, or set it to false: the motion is then predicted and nothing is commanded for it"
        )
    evidence = None
    if identified is not None:
        evidence = MotionEvidence(
            override=identified.override_percent * PERCENT,
            misfit=identified.held_out_rms_um * UM,
            verdict=MotionVerdict.COMMANDABLE if identified.verdict == OLD else MotionVerdict(identified.verdict),
            runs_began=frozenset(each for each in RunBeginning if identified.runs_began in (each.value, "both")),
        )
    return ControllerMotion(
        space=table.space,
        moving_averages=tuple(window * MS for window in table.moving_average_ms),
        after_long=tuple(window * MS for window in table.after_long_ms),
        reach=table.reach_percent_m2 * PERCENT,
        reach_at=table.reach_at_m2,
        first_orders=tuple(constant * MS for constant in table.first_order_ms),
        lag=table.lag_ms * MS,
        enabled=table.enabled,
        evidence=evidence,
    )


def _check_times(table: MotionTable, where: str) -> None:
    """Raises InputError for times below zero or too long, and for more of them than are modelled."""
    for key in ("moving_average_ms", "after_long_ms", "first_order_ms", "lag_ms"):
        times = [table.lag_ms] if key == "lag_ms" else getattr(table, key)
        if len(times) > MOST:
            count = f"{len(times)} times, at most {MOST} are modelled"
            raise InputError(f"{where}: motion.{key}: {count}; give the longest {MOST}: their squares are what counts")
        for time in times:
            if not 0 <= time <= LONGEST:
                limits = f"0 to {LONGEST:g} ms; give it in milliseconds"
                raise InputError(f"{where}: motion.{key}: {time:g} is outside {limits}")


class ExpectedMotionTable(Table):
    """What controllers of this class of arm do, by evidence; predicted without [motion], never commanded against."""

    moving_average_ms: TwoMeans
    """Windows of the two moving means that are expected."""
    after_long_ms: TwoMeans | None = None
    """The same in a run, from a stop to the next, whose first statement lasts at least their sum; default alike."""
    lowest_ms: TwoMeans
    """Windows that smooth least of what was seen."""
    highest_ms: TwoMeans
    """Windows that smooth most of what was seen."""
    evidence: Literal["simulated", "other arms"]
    """The maker's motion code (a virtual controller) of such an arm, or logs and motion code of other arms."""
    source: Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[^\x00-\x1f\x7f]*$")]
    """What was seen where."""


def expected_motion_of(table: ExpectedMotionTable | None, where: str) -> ExpectedMotion:
    """What the controller is expected to do where its motion is not known; of a file without a word, what any arm does.

    Raises:
        InputError: What is expected does not lie between the lowest and the highest.
    """
    if table is None:
        return ANY_ARM
    lowest, expected, highest = (
        ControllerMotion(moving_averages=tuple(window * MS for window in windows))
        for windows in (table.lowest_ms, table.moving_average_ms, table.highest_ms)
    )
    expected = replace(expected, after_long=tuple(window * MS for window in table.after_long_ms or ()))
    for key, means in (("moving_average_ms", expected), ("after_long_ms", expected.in_run(inf))):
        if not lowest.variance <= means.variance <= highest.variance:
            raise InputError(
                f"{where}: expected_motion.{key}: {getattr(table, key)} must lie between lowest_ms {table.lowest_ms} "
                f"and highest_ms {table.highest_ms}, by the sum of their squares"
            )
    return ExpectedMotion(
        expected=expected, lowest=lowest, highest=highest, evidence=table.evidence, source=table.source
    )
