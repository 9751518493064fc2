"""The proof of one corrected file at each of the starts that it serves."""

from collections.abc import Callable
from dataclasses import dataclass

from compgen.core.arrays import Array, BoolArray, rms
from compgen.core.pose import Pose
from compgen.pipelines.correct.proof import ProgramExecution, pose_errors
from compgen.pipelines.correct.starts import Residue, ServedStarts
from compgen.thermal.ensemble import Ensemble
from compgen.thermal.ensemble_starts import starts_to_fly, weighted_starts


@dataclass(frozen=True, eq=False, slots=True)
class ServedProof:
    """What flights of a text are judged by."""

    fly: Callable[..., ProgramExecution]  # with the keyword starts
    target: Pose  # M
    judged: BoolArray  # (M,) samples at or between corrected stations
    length: Array  # (M,) [m] of path that each stands for

    def worst_of(self, ensemble: Ensemble) -> tuple[ProgramExecution, ServedStarts]:
        """The flight with the largest error of corners and middle, and what stays at each of them and at the mean.

        Raises:
            TwinError: The controller's inverse and pinocchio disagree.
        """
        starts, weights = weighted_starts(ensemble)
        weighted = [(weight, start) for weight, start in zip(weights.tolist(), starts, strict=True) if weight > 0]
        at_mean = self._residue(self.fly(starts=weighted))
        flights = [(start, self.fly(starts=((1.0, start),))) for start in starts_to_fly(ensemble)]
        served = ServedStarts(ensemble, at_mean, tuple((start, self._residue(flight)) for start, flight in flights))
        return dict(flights)[served.worst[0]], served

    def _residue(self, flight: ProgramExecution) -> Residue:
        distance = pose_errors(flight, self.target).distance[self.judged]
        if not len(distance):
            return Residue(0.0, 0.0)
        return Residue(float(distance.max()), rms(distance, self.length[self.judged]))
