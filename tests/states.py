"""States of a robot for tests: of a job's own history, moved or not."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from compgen.error_model.anchored_state import BASE, AnchoredState, state_text
from compgen.job.anchored_start import made_from_robot
from compgen.job.job import Job


def state_of(job: Job, **changes) -> AnchoredState:
    """The state that a job's history ends with, known exactly."""
    K = len(job.heat.names)
    state = AnchoredState(
        model="nodes" if len(job.heat.rate) == K else "network",
        nodes=job.heat.names,
        rise=job.start_rise(),
        modal=None if len(job.heat.rate) == K else job.state(),
        base=np.zeros(BASE),
        drifting=(),
        drift=np.zeros(0),
        covariance=np.zeros((K + BASE, K + BASE)),
        air=0.0,
        time=21600.0,
        window=1800.0,
        verdict="anchored",
        made_from=made_from_robot(job.cell),
    )
    return replace(state, **changes)


def written(state: AnchoredState, folder: Path) -> str:
    """The state's file in a folder."""
    file = folder / "state.toml"
    file.write_text(state_text(state), encoding="utf-8")
    return str(file)
