"""Every number of docs/validation.md is what the tool computes today."""

import re
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose
from shipped import ROOT

sys.path.insert(0, str(ROOT / "docs"))
sys.path.insert(0, str(ROOT / "robots"))
import m710ic50_fit as node_fit
import validation

NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def test_the_page_is_what_its_script_writes(monkeypatch):
    """Words to the letter, numbers to one in their last digit (processors round differently)."""
    monkeypatch.setattr(validation, "plot", lambda *_: None)
    shown, computed = (ROOT / "docs" / "validation.md").read_text(), validation.page()
    assert NUMBER.sub("#", shown) == NUMBER.sub("#", computed)
    pairs = list(zip(NUMBER.findall(shown), NUMBER.findall(computed), strict=True))
    assert len(pairs) > 300
    for old, new in pairs:
        digits = len(old.partition(".")[2])
        assert float(new) == pytest.approx(float(old), abs=1.01 * 10.0**-digits), (old, new)


def test_the_z_line_runs_over_the_stations_that_the_study_names():
    """303 to 1103 mm at X = 1350, Y = -30 (study lines 1045, 1167, 1173)."""
    position, _ = validation.errors("line_z")
    assert_allclose(position[[0, -1]], [[1350, -30, 303], [1350, -30, 1103]], atol=1e-9)  # mm


def test_the_studys_z_line_is_that_of_the_arm_over_back():
    """77 to 7 um (line 1083) against 77.0 to 9.3 at X = 1050 from 1003 down to 103 mm; X 80 to 90."""
    _, error = validation.over_back(np.array([[1050.0, -30.0, z] for z in (103, 303, 1003, 1103)]))
    assert_allclose(error[:, 2], [9.3, 24.7, 77.0, 84.2], atol=0.06)  # um
    assert_allclose(error[[0, 2], 0], [89.4, 80.5], atol=0.06)  # um


def test_the_page_of_limits_says_what_a_kelvin_moves():
    limits = " ".join((ROOT / "docs/limits.md").read_text().split())
    quoted = re.search(
        r"by ([\d.]+) um \(parts three and six\), ([\d.]+) um \(link 1\) or ([\d.]+) um \(wrist\)", limits
    )
    nodes = (("j2", "j3"), ("link1",), ("wrist",))
    assert quoted is not None
    assert list(quoted.groups()) == [f"{validation.per_kelvin(*n):.1f}" for n in nodes]


def test_the_page_of_limits_says_how_the_temperatures_are_met_in_and_out_of_sample():
    limits = " ".join((ROOT / "docs/limits.md").read_text().split())
    fit = node_fit
    inside = fit.misses(fit.shipped())
    outside = fit.left_out(fit.misses_without, fit.GROUPS["one by one"])
    for off in (inside, outside):
        assert f"{np.sqrt(np.mean(off**2)):.2f} K" in limits
        assert f"worst {np.abs(off).max():.2f} K" in limits
    assert np.sqrt(np.mean(outside**2)) > np.sqrt(np.mean(inside**2))
