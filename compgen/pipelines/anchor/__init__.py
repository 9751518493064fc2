"""What a robot is now: touches and a log against the forecast, to a state with a verdict."""

from compgen.pipelines.anchor.anchor import anchor
from compgen.pipelines.anchor.result import Anchored

__all__ = ["Anchored", "anchor"]
