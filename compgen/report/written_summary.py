"""A written program in another state as data: the report of the job, with what the text leaves as ``after``."""

from typing import Any

from compgen.core.commands import Command
from compgen.pipelines.planned.written_program import WrittenFlight
from compgen.report.band_words import DRAWN
from compgen.report.guaranteed import guaranteed_record
from compgen.report.job_summary import job_summary
from compgen.verification.deviation import statistics
from compgen.verification.verdict import verdict_of


def written_summary(flight: WrittenFlight, file: str) -> dict[str, Any]:
    """The report of ``cgen check --written``: ``before`` is the planned program, ``after`` the text.

    Args:
        flight: Of the text.
        file: Its name.
    """
    summary = job_summary(flight.planned, None)
    before, after = summary["before"], statistics(flight.deviation)
    promised = None if flight.draws is None else flight.draws.guarantee
    flown = {} if promised is None else {key: getattr(promised, key) for key in DRAWN}
    return {
        **summary,
        "command": Command.CHECK,
        "band": {**summary["band"], **flown},
        "verdict": verdict_of(flight.findings).value,
        "after": after,
        "on_part": {"before": summary["on_part"]["before"], "after": statistics(flight.deviation, on_part=True)},
        "ratio": before["total"]["max_um"] / after["total"]["max_um"],
        "guaranteed": guaranteed_record(flight.draws),
        "findings": [finding.record() for finding in flight.findings],
        "written": {
            "file": file,
            "name": flight.program.name,
            "positions": len(flight.program.position),
            "made_as": list(flight.program.remarks),
            "run": flight.start.run + 1,
            "delay_s": flight.start.delay,
            "override_percent": 100 * flight.start.override,
        },
    }
