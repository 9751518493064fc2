"""What if: many scenarios of one path, and the questions people ask of them."""

from compgen.study.answers import ASKS, Answer, ask
from compgen.study.evaluate import Row, evaluate
from compgen.study.pool import run
from compgen.study.scenarios import Scenario, Study, build
from compgen.study.timeline import Timeline, timeline

__all__ = ["ASKS", "Answer", "Row", "Scenario", "Study", "Timeline", "ask", "build", "evaluate", "run", "timeline"]
