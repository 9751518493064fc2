"""Bounds with a probability of a program that exists, against what a normal distribution says of one unknown number."""

import json

import naive_ls
import numpy as np
import pytest
from corrected import HOME, WARM, corrected
from ls_text import at, program
from scipy.stats import norm
from shipped import ROOT

import compgen
from compgen.core.exceptions import InputError
from compgen.core.units import UM
from compgen.job.tables import guarantee_of_words, words_of_guarantee
from compgen.pipelines.correct.result import options_of
from compgen.pipelines.files.robot_file import load_cell
from compgen.pipelines.uncertainty.draws import AGREEMENT
from compgen.thermal.ensemble import Ensemble
from compgen.verification.verdict import Verdict

ROBOT = str(ROOT / "robots" / "m710ic50.toml")
JOINTS = (HOME, (-20.0, 25.0, -20.0, 10.0, -70.0, 30.0), (15.0, 10.0, -5.0, 20.0, -50.0, 60.0))
PLANNED = program([f"L P[{n}] 400mm/sec FINE" for n in (1, 2, 3)], [at(n, q) for n, q in enumerate(JOINTS, 1)])
#: a robot of which nothing is open but what a test adds
KNOWN = (
    "thermal.uncertainty={law_K=0, sensors_K=0, air_K=0, feed_percent=0, missing_percent=0, cte_um_m_K=[11.25, 11.25]}"
)
SIGMA = 10e-3  # deg of the first joint's zero
ZERO = f"sources.joint_zeros.sigma.offset_mdeg=[{1e3 * SIGMA}, 0, 0, 0, 0, 0]"


def drawn(words, *overrides, before=(), **options):
    cell = load_cell(ROBOT, [KNOWN, *overrides])
    result = corrected(PLANNED, cell, before=before, guaranteed=guarantee_of_words(words, "--guaranteed"), **options)
    assert result.draws is not None
    return result


def reach_um():
    """What one sigma of the first joint's zero moves the place furthest from its axis by [um], by the second reader."""
    positions = naive_ls.read(PLANNED)[0].values()
    x, y = np.array([[position.groups[1].axes[k] for k in "XY"] for position in positions], float).T
    return 1e3 * np.deg2rad(SIGMA) * np.hypot(x, y).max()


def test_as_many_draws_break_a_bound_as_the_normal_distribution_says():
    """|z| R > bound: R is largest at an end of a line, for it is convex along it."""
    count, bound = 200, 1.5 * reach_um()
    (bound_kept,) = drawn(f"max_um={bound}, share=0.5, draws={count}", ZERO).draws.bounds
    sizes = bound_kept.values / UM / reach_um()
    expected = 2 * norm.sf(1.5)
    assert abs(bound_kept.breaking / count - expected) <= 3 * np.sqrt(expected * (1 - expected) / count)
    assert np.sqrt(np.mean(sizes**2)) == pytest.approx(1, abs=0.15)  # of a normal number
    assert (
        norm.ppf(0.75) < bound_kept.guaranteed / UM / reach_um() < norm.ppf(0.75) + 0.3
    )  # above half of all, and not far


def test_a_bound_far_above_is_kept_and_one_far_below_is_not():
    kept = drawn(f"max_um={6 * reach_um()}", ZERO)
    assert kept.verdict is Verdict.INSIDE  # and needs no bound beside it
    assert kept.draws.linearity < 0.05
    broken = drawn(f"max_um={0.5 * reach_um()}, rms_um={6 * reach_um()}", ZERO)
    assert broken.verdict is Verdict.OUTSIDE
    assert "bounds.guaranteed.max_um" in {f.code for f in broken.findings}
    assert "bounds.guaranteed.rms_um" not in {f.code for f in broken.findings}
    assert broken.text == kept.text == corrected(PLANNED, load_cell(ROBOT, [KNOWN, ZERO]), before=()).text


def test_an_arm_in_warmer_air_grows_as_the_band_says():
    result = drawn("max_um=1000, draws=93", KNOWN.replace("air_K=0", "air_K=2"), before=(WARM,))
    assert result.draws.linearity < 0.01
    assert result.draws.moved.max() > 20 * UM  # grown by two kelvin and more, everywhere


def test_every_quantity_is_flown_as_the_band_has_it():
    flawed = [
        "sources.link_offsets.a_um=[0, 50, 0, 0, 0, 0]",
        "sources.link_offsets.sigma.a_um=[0, 12, 5, 0, 0, 0]",
        "sources.joint_zeros.sigma.offset_mdeg=[0, 1, 1, 0, 2, 0]",
    ]
    cell = load_cell(ROBOT, flawed)
    result = corrected(PLANNED, cell, guaranteed=guarantee_of_words("max_um=1000, seed=3", "--guaranteed"))
    assert 0.001 < result.draws.linearity < AGREEMENT
    assert "band.linear" not in {f.code for f in result.findings}
    assert np.abs(np.ptp(result.draws.total)) > 20 * UM


def test_what_no_quantity_explains_moves_the_tool_too():
    result = drawn("max_um=1000", KNOWN.replace("missing_percent=0", "missing_percent=20"), before=(WARM,))
    thermal = result.error.distance[result.judged].max()
    assert result.draws.moved.max() < 0.01 * UM
    assert 0.2 * thermal < np.median(result.draws.total) < 0.7 * thermal


def test_the_same_seed_draws_the_same_and_another_does_not():
    first, again, other = (drawn(f"max_um=900, share=0.8, seed={seed}", ZERO).draws.total for seed in (5, 5, 6))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 10 * UM


def test_one_file_for_many_starts_is_flown_at_some_of_them():
    result = drawn("max_um=900", "thermal.uncertainty.air_K=0.001", before=(WARM,), ensemble=Ensemble((0.0, 7200.0)))
    total = result.draws.total
    assert np.ptp(total) > 3 * UM  # by the delays alone
    assert total.max() <= result.served.worst[1].largest + 0.2 * UM


def test_command_and_library_take_the_same_promise(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "T.LS").write_bytes(PLANNED)
    asked = {"max_um": 300, "share": 0.9, "confidence": 0.9, "seed": 2}
    result = compgen.correct("T.LS", "m710ic50", before=WARM, guaranteed=asked)
    record, files = result.report["guaranteed"], result.files()
    assert (record["draws"], record["may_break"], record["bounds"]["max_um"]["bound"]) == (22, 0, 300)
    assert result.report["band"]["draws"] == 22
    assert b"guaranteed: 90 % of arms and days stay within max_um" in files["report.html"]
    assert json.loads(files["T.compgen.json"])["options"]["guaranteed"] == {**asked, "draws": 22}
    words = "max_um=300, share=0.9, confidence=0.9, seed=2"
    by_words = compgen.correct("T.LS", "m710ic50", before=WARM, guaranteed=words)
    assert by_words.files() == files
    assert "guaranteed" not in compgen.correct("T.LS", "m710ic50", before=WARM).report


def test_what_is_kept_of_a_promise_makes_it_again():
    promise = guarantee_of_words("max_um=60.5, p99_um=50, rms_um=20, draws=93, seed=4", "--guaranteed")
    words = ", ".join(f"{key} = {value}" for key, value in words_of_guarantee(promise).items())
    assert guarantee_of_words(words, "--guaranteed") == promise


@pytest.mark.parametrize(
    ("words", "why"),
    [
        ("max_um=60, draws=58", "draws: 58: share 0.95 with confidence 0.95 needs 59"),
        ("share=0.9", "it gives no bound; add max_um"),
        ("", "it gives no bound"),
        ("max_um=60, share=1", "less than 1"),
        ("max_um=-1", "greater than 0"),
        ("max_mm=60", "did you mean 'max_um'"),
        ("max_um=60, normal_um=5", "normal_um: a program that exists does not say where its part's surface is"),
        ("sixty", "not understood; write it as in 'max_um=60"),
        ("max_um=60}\ny={", "not understood"),
    ],
)
def test_promises_that_are_none_are_refused_in_one_line(words, why):
    with pytest.raises(InputError) as refusal:
        options_of(split=False, insert_um=None, strict=False, again=False, mark="digits", max_um=None, guaranteed=words)
    assert why in str(refusal.value)
    assert str(refusal.value).startswith("--guaranteed")
    assert len(str(refusal.value)) <= 300


def test_a_robot_that_does_not_say_how_well_it_is_known_promises_nothing():
    with pytest.raises(InputError, match=r"^--guaranteed: .*m710ic50\.toml does not say .* \[thermal\.uncertainty\]"):
        drawn("max_um=60")
