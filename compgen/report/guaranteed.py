"""Bounds with a probability as data and in words."""

from typing import Any

from compgen.pipelines.uncertainty.draws import FlownDraws
from compgen.verification.verdict import unit_of


def guaranteed_record(draws: FlownDraws | None) -> dict[str, Any] | None:
    """Bounds with a probability, and what the draws came to."""
    if draws is None:
        return None
    promised, bounds = draws.guarantee, {}
    for b in draws.bounds:
        factor, _ = unit_of(b.key)
        bounds[b.key] = {"bound": round(b.bound / factor, 9), "value": b.guaranteed / factor, "breaking": b.breaking}
    return {
        "bounds": bounds,
        "share": promised.share,
        "confidence": promised.confidence,
        "draws": promised.draws,
        "may_break": promised.may_break,
        "seed": promised.seed,
        "linearity": draws.linearity,
        "linearity_worst_draw": float(draws.disagreement.max()),
    }


def guaranteed_text(record: dict[str, Any]) -> str:
    """Bounds with a probability in one sentence."""
    values = ", ".join(
        f"{key} = {value['value']:.3g} (bound {value['bound']:g})" for key, value in record["bounds"].items()
    )
    return (
        f"guaranteed: {100 * record['share']:g} % of arms and days stay within {values}; "
        f"{100 * record['confidence']:g} % confidence, {record['draws']} draws, seed {record['seed']}"
    )
