"""One look at a running job, in a line and as data."""

from typing import Any

from compgen.core.commands import Command
from compgen.core.units import UM
from compgen.pipelines.resume.follow import Look
from compgen.pipelines.resume.result import Resumed


def look_record(look: Look | None, resumed: Resumed | None, within: float, force: bool) -> dict[str, Any]:
    """A look in plain types.

    Args:
        look: None where the log has no reading yet.
        resumed: The pages that it led to.
        within: Largest error that a page may leave [um].
        force: Whether pages outside the job's bounds are written.
    """
    if look is None:
        return {"command": Command.FOLLOW, "time_s": None}
    return {
        "command": Command.FOLLOW,
        "time_s": look.time,
        "page": look.running,
        "share": round(look.share, 4),
        "loaded": look.loaded,
        "over": look.over,
        "rise_K": [round(x, 3) for x in look.rise.tolist()],
        "sigma_K": [round(x, 3) for x in look.sigma.tolist()],
        "missed_K": [round(x, 3) for x in look.missed.tolist()],
        "within_um": within,
        "forecast": [
            {
                "page": f.page,
                "start_s": round(f.start, 1),
                "max_um": round(f.max / UM, 3),
                "rms_um": round(f.rms / UM, 3),
            }
            for f in look.forecasts
        ],
        "due": look.due,
        "written": list(resumed.replaced) if resumed is not None and (resumed.inside or force) else [],
        "after_um": None if resumed is None else max(round(p.after.max / UM, 3) for p in resumed.pages),
        "band_um": None if resumed is None else round(resumed.band.largest / UM, 3),
        "verdict": None if resumed is None else resumed.verdict.value,
        "notes": list(look.notes),
        "doubt": look.doubt,
    }


def look_words(look: Look | None, resumed: Resumed | None, within: float, force: bool) -> str:
    """A look in one line; see ``look_record``."""
    if look is None:
        return "no reading yet"
    if look.doubt:
        return "; ".join([f"{look.time:.0f} s: {look.doubt}; the pages stay as they are", *look.notes])
    where = f"page {look.running} runs ({100 * look.share:.0f} %)" if look.running else "the robot stands"
    if look.over:
        where = "the last page has ended"
    rises = " ".join(f"{r:.2f}" for r in look.rise.tolist())
    parts = [f"{look.time:.0f} s: {where}; rises {rises} K, known to {look.sigma.max():.2f} K"]
    parts += [f"page {f.page} forecast {f.max / UM:.1f} um (rms {f.rms / UM:.1f})" for f in look.forecasts]
    if resumed is not None:
        pages = f"pages {resumed.from_page} to {resumed.pages[-1].number}"
        left = f"{max(p.after.max for p in resumed.pages) / UM:.2f} um +- {resumed.band.largest / UM:.0f} (95 %)"
        if resumed.inside or force:
            parts.append(f"over {within:g}: {pages} written anew, {left} left")
        else:
            parts.append(f"over {within:g}: {pages} not written: {resumed.verdict}, {left} (--force)")
    elif any(f.max > within * UM for f in look.forecasts):
        parts.append(f"over {within:g}, and the controller has it")
    return "; ".join([*parts, *look.notes])
