"""The stages of a long run, and the callback that hears of them."""

from collections.abc import Callable
from typing import Self


class RunStage(str):
    """What a run is at: text for whoever prints it, with its parts as data.

    Attributes:
        name: The stage's own, without what it is at.
        detail: What it is at; empty where it has no parts with names.
        waypoints: How many waypoints the run has, once that is known; else 0.
        is_even: Whether its share grows as time does.
    """

    name: str
    detail: str
    waypoints: int
    is_even: bool

    def __new__(cls, name: str, detail: str = "", waypoints: int = 0, *, is_even: bool = True) -> Self:
        """A stage by its name; those of compgen stand below."""
        words = f"{waypoints} waypoints" if waypoints else detail
        stage = super().__new__(cls, f"{name}: {words}" if words else name)
        stage.name, stage.detail, stage.waypoints, stage.is_even = name, detail, waypoints, is_even
        return stage


#: Called with the stage that runs and the share of it that is done, 0 to 1.
Progress = Callable[[RunStage, float], None]

# a job
PATH = RunStage("path")
TIMING = RunStage("timing")
TWIN_BEFORE = RunStage("twin before")
CORRECTION = RunStage("correction")
THINNING = RunStage("thinning")
DIRECTIONS = RunStage("correction of the text's directions")
ARCS = RunStage("arcs")
FINAL_TIMING = RunStage("final timing")
TEXT = RunStage("text")
TWIN_AFTER = RunStage("twin after")
CROSS_FLIGHT = RunStage("cross flight")
DRAWS = RunStage("draws")
REPORT = RunStage("report")
# a program that exists
READING = RunStage("reading")
OFFSETS = RunStage("offsets")
# a study
SCENARIOS = RunStage("scenarios")
# measurements, planned and used
TOUCHES_IN_REACH = RunStage("touches in reach")
TOUCHES_THAT_TELL = RunStage("touches that tell most")
CANDIDATES = RunStage("candidates")
SLOPES = RunStage("slopes")
EXCHANGE = RunStage("exchange")
MODEL = RunStage("model")
FIT = RunStage("fit")
WARMTH = RunStage("warmth")
JUDGE = RunStage("judge")
MOTION = RunStage("motion")
