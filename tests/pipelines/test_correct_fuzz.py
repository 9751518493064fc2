"""A short run of the fuzzer of corrections; tests/campaigns/fuzz_correct.py has the long one."""

import sys
from collections import Counter

from shipped import ROOT

sys.path.append(str(ROOT / "tests" / "campaigns"))

import fuzz_correct

INPUTS = 300


def test_damaged_programs_are_corrected_passed_through_or_refused():
    counts: Counter[str] = Counter()
    assert list(fuzz_correct.faults(INPUTS, seed=5, counts=counts)) == []
    assert counts["refused"] == counts["exit 2"] > INPUTS // 10
    assert counts["corrected"] > INPUTS // 50
    assert counts["passed through"] > INPUTS // 20
