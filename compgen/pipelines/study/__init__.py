"""What if: many scenarios of one path, and the questions people ask of them."""

from compgen.pipelines.study.questions import ASKS, Answer
from compgen.pipelines.study.scenarios import Scenario, Study, build
from compgen.pipelines.study.timeline import Timeline, timeline
from compgen.pipelines.study.workers import StudyRow, evaluate, run

__all__ = ["ASKS", "Answer", "Scenario", "Study", "StudyRow", "Timeline", "build", "evaluate", "run", "timeline"]
