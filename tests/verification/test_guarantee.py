"""Bounds with a probability: what the path file may ask, and how draws are judged."""

import numpy as np
import pytest

from compgen.core.exceptions import InputError
from compgen.core.units import MDEG, UM
from compgen.job.bounds import Bounds, Guarantee
from compgen.job.tables import BoundsTable, bounds_of
from compgen.verification.deviation import COMPONENTS, Extent
from compgen.verification.verdict import drawn_bounds, judge_draws


def guarantee_of(**keys: object) -> Guarantee:
    bounds = bounds_of(BoundsTable.model_validate({"guaranteed": keys}), "p.toml")
    assert bounds.guaranteed is not None
    return bounds.guaranteed


def extents(total: float, normal: float = 0.0) -> dict[str, Extent]:
    sizes = {"total": total, "normal": normal}
    return {name: Extent(sizes.get(name, 0.0), sizes.get(name, 0.0), sizes.get(name, 0.0), 0.0) for name in COMPONENTS}


def test_the_fewest_draws_are_flown_where_none_are_given() -> None:
    promised = guarantee_of(max_um=60, normal_um=20, axis_mdeg=5)
    assert (promised.draws, promised.may_break, promised.seed) == (59, 0, 0)
    assert promised.bounds == Bounds(max=60 * UM, normal=20 * UM, axis=5 * MDEG)
    assert (guarantee_of(max_um=1, draws=93).may_break, guarantee_of(max_um=1, share=0.9, confidence=0.9).draws) == (
        1,
        22,
    )


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"max_um": 60, "draws": 58}, "bounds.guaranteed.draws: 58: .* needs 59 to 10000; give such"),
        ({"max_um": 60, "draws": 0}, "bounds.guaranteed.draws: 0: .* needs 59 to 10000; give such"),
        ({"max_um": 60, "draws": 10**9}, "bounds.guaranteed.draws: 1000000000: .* needs 59 to 10000"),
        ({"share": 0.9}, "bounds.guaranteed: it gives no bound; add max_um"),
        ({"max_um": 60, "share": 0.99999}, "bounds.guaranteed.share: 0.99999 .* needs 299572 draws, 10000 can"),
    ],
)
def test_what_cannot_be_verified_is_refused_with_what_to_give(keys: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=f"^p.toml: {words}"):
        guarantee_of(**keys)


def test_the_largest_draw_decides_until_one_may_break() -> None:
    draws = [extents(k * UM) for k in range(1, 94)]
    (strict,) = drawn_bounds(draws[:59], guarantee_of(max_um=59))
    assert (strict.guaranteed, strict.breaking) == (59 * UM, 0)
    promised = guarantee_of(max_um=92, draws=93)
    (one_may,) = drawn_bounds(draws, promised)
    assert (one_may.guaranteed, one_may.breaking) == (92 * UM, 1)
    assert judge_draws([one_may], promised) == []


def test_a_broken_promise_says_what_can_be_kept() -> None:
    promised = guarantee_of(max_um=40)
    (finding,) = judge_draws(drawn_bounds([extents((10 + k) * UM) for k in range(59)], promised), promised)
    assert finding.code == "bounds.guaranteed.max_um"
    assert finding.message.startswith(
        "68.000 um is what 95 % of arms and days stay within (95 % confidence, 59 draws, 28"
    )
    assert finding.message.endswith("above bounds.guaranteed.max_um = 40; 68 can be kept")
    assert len(finding.message) <= 300


def test_bounds_that_different_draws_break_are_not_kept_together() -> None:
    promised = guarantee_of(max_um=10, normal_um=5, draws=93)
    draws = [extents(1 * UM) for _ in range(91)] + [extents(11 * UM), extents(1 * UM, 6 * UM)]
    bounds = drawn_bounds(draws, promised)
    assert [b.breaking for b in bounds] == [1, 1]
    assert [f.code for f in judge_draws(bounds, promised)] == ["bounds.guaranteed.together"]
    assert judge_draws(drawn_bounds([*draws[:92], extents(1 * UM)], promised), promised) == []


def test_a_promise_holds_for_a_share_of_arms_as_often_as_its_confidence() -> None:
    """Of arms with lognormal errors: what 59 draws verify is above their 95 % quantile in 95 of 100 trials."""
    rng, promised, trials = np.random.default_rng(2), guarantee_of(max_um=60), 500
    quantile = np.exp(1.6448536269514722) * 10 * UM
    kept = 0
    for _ in range(trials):
        sizes = 10 * UM * np.exp(rng.standard_normal(promised.draws))
        (bound,) = drawn_bounds([extents(size) for size in sizes.tolist()], promised)
        kept += bound.guaranteed >= quantile
    assert abs(kept / trials - (1 - 0.95**59)) <= 4 * np.sqrt(0.05 * 0.95 / trials)
