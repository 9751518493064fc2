"""What if: many scenarios of one path, and the questions people ask of them."""

from compgen.pipelines.study.questions import ASKS, Answer
from compgen.pipelines.study.scenarios import Scenario, Study, build
from compgen.pipelines.study.timeline import Timeline, timeline
from compgen.pipelines.study.workers import Row, evaluate, run

__all__ = ["ASKS", "Answer", "Row", "Scenario", "Study", "Timeline", "build", "evaluate", "run", "timeline"]
