"""What an anchoring comes to: a state, its verdict, and all that speaks for them."""

from dataclasses import dataclass

from compgen.core.arrays import Array, rms
from compgen.core.findings import Finding
from compgen.error_model.anchored_state import AnchoredState, Verdict
from compgen.identification.touches import Artefact
from compgen.job.job import Job
from compgen.pipelines.anchor.estimate import Estimate
from compgen.pipelines.anchor.forecast import Forecast
from compgen.pipelines.anchor.hypotheses import Innovation, Judged, LeftOut
from compgen.pipelines.anchor.next_touches import NextTouch
from compgen.pipelines.anchor.path_places import PathPlaces
from compgen.pipelines.anchor.touching import Touched
from compgen.pipelines.anchor.unknowns import Unknowns
from compgen.pipelines.anchor.verdict import Moved


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Anchored:
    """A state, its verdict, and all that speaks for them."""

    job: Job
    artefact: Artefact
    state: AnchoredState
    reason: str
    forecast: Forecast
    unknowns: Unknowns
    seen: Touched
    path: PathPlaces
    innovation: Innovation
    judged: tuple[Judged, ...]  # the best first
    as_forecast: Judged
    chosen: Estimate
    left: LeftOut
    forecast_error: Array  # (N,) [m] rms of each touch against the forecast
    moved: tuple[Moved, ...]
    touch_next: tuple[NextTouch, ...]
    findings: tuple[Finding, ...]

    @property
    def verdict(self) -> Verdict:
        """What to do with the state."""
        return self.state.verdict

    @property
    def rms(self) -> tuple[float, float]:
        """Standard deviation of the path's place, all directions together, before and after: rms along it [m]."""
        return rms(self.chosen.before), rms(self.chosen.after)
