"""A resumed job as data: what was written anew, why, and what the pages leave before and after."""

from typing import Any

import numpy as np

from compgen.core.commands import Command
from compgen.core.units import UM
from compgen.core.version import __version__
from compgen.pipelines.findings.motion_findings import with_motion
from compgen.pipelines.resume.result import Resumed
from compgen.pipelines.uncertainty.band import not_known
from compgen.report.band_words import band_record
from compgen.report.inputs import made_from
from compgen.verification.deviation import statistics

SCHEMA = 1


def resume_summary(resumed: Resumed) -> dict[str, Any]:
    """Everything a resumed job found, in plain types."""
    planned, beginning = resumed.planned, resumed.beginning
    job = planned.job
    return {
        "schema": SCHEMA,
        "command": Command.RESUME,
        "name": job.name,
        "verdict": resumed.verdict.value,
        "from_page": resumed.from_page,
        "why": beginning.why,
        **{key: value for key, value in beginning.cause.items() if key != "state_toml"},
        "replaced": list(resumed.replaced),
        "thermal": {
            "start_K": dict(zip(job.heat.names, np.asarray(planned.rise[0]).tolist(), strict=True)),
            "planned_K": dict(zip(job.heat.names, np.asarray(resumed.planned_rise).tolist(), strict=True)),
            "start_window_s": resumed.starts[0].window,
        },
        "join": None if resumed.join is None else resumed.join.record(),
        "before": statistics(planned.deviation()),
        "after": statistics(resumed.deviation),
        "on_part": {
            "before": statistics(planned.deviation(), on_part=True),
            "after": statistics(resumed.deviation, on_part=True),
        },
        "band": band_of_resumed(resumed),
        "pages": [
            {
                "page": page.number,
                "file": page.file,
                "replaced": page.is_new,
                "start_s": start.time,
                "start_window_s": start.window,
                "before": page.before.record(),
                "after": page.after.record(),
            }
            for page, start in zip(resumed.pages, resumed.starts, strict=True)
        ],
        "bounds": {"max_um": None if job.bounds.max is None else round(job.bounds.max / UM, 9)},
        "findings": [finding.record() for finding in resumed.findings],
        "provenance": {
            "compgen": __version__,
            **made_from(job),
            "manifest": resumed.written.manifest_file,
        },
    }


def band_of_resumed(resumed: Resumed) -> dict[str, Any]:
    """What files and log leave open on the new pages."""
    return band_record(resumed.band, with_motion(not_known(resumed.planned.job.cell, resumed.band), None))
