"""Pages of what was measured: an anchoring and an identification, in words and on scales that can be read."""

import re

import numpy as np
import pytest

from compgen.report.figure import figures_of_page, unpacked
from compgen.report.key_words import parameter_words


def words_of(page):
    """What a page says, without its scripts, its findings, which name keys of files, and its foot of hashes."""
    text = re.sub(r"<(script|style)[ >].*?</\1>|<ul class=\"findings\">.*?</ul>", "", page.read_text(), flags=re.S)
    return re.sub(r"<[^>]+>", " ", text.split("<footer>")[0])


@pytest.mark.parametrize("command", ["anchor", "identify"])
def test_parameters_are_words_and_micrometres_have_their_sign(every_page, command):
    words = words_of(every_page[command])
    assert not re.findall(r"\w+\.\w+\[\d", words)
    assert not re.findall(r"\d um\b", words)


def test_findings_have_the_sign_of_the_micrometre(every_page):
    (findings,) = re.findall(r'<ul class="findings">.*?</ul>', every_page["identify"].read_text(), flags=re.S)
    assert re.search(r"set aside: \d+ &micro;m", findings)


def test_a_parameter_is_named_with_its_unit():
    assert parameter_words("link_offsets.alpha_mdeg[2]") == "link offsets: alpha 2 [mdeg]"
    assert parameter_words("joint_coupling.ratio_ppm[1,3]") == "joint coupling: ratio 1,3 [ppm]"
    assert parameter_words("compliance.compliance_urad_Nm[6]") == "compliance: compliance 6 [µrad/(N m)]"


def test_an_anchored_path_has_before_and_after_on_scales_of_their_own(every_page):
    figure = figures_of_page(every_page["anchor"].read_bytes())["path"]
    assert [t["name"] for t in figure["data"]] == ["before", "after", "moved"]
    assert len({t["yaxis"] for t in figure["data"]}) == 3
    assert [t["line"]["dash"] for t in figure["data"]][:2] == ["dash", "solid"]


def test_what_may_have_happened_is_said_in_words(every_page):
    table = words_of(every_page["anchor"]).split("What may have happened")[1]
    assert re.search(r"the forecast holds|the day went|the forecast is better|went wrong|was knocked|the base", table)
    assert "times the forecast" not in table


def test_residuals_are_drawn_on_the_scale_of_the_rows_that_were_kept(every_page):
    figures = figures_of_page(every_page["identify"].read_bytes())
    before, after, aside = figures["time"]["data"]
    assert aside["name"] == "set aside, beyond this scale"
    assert float(aside["text"][0]) > 4000
    for curve, axis in ((before, "yaxis"), (after, "yaxis2")):
        top = figures["time"]["layout"][axis]["range"][1]
        assert top == pytest.approx(1.15 * unpacked(curve["y"]).max(), rel=1e-3)
        assert np.all(unpacked(aside["y"]) < figures["time"]["layout"]["yaxis2"]["range"][1])


def test_every_joint_has_a_plot_of_its_own_that_paper_shows(every_page):
    figure = figures_of_page(every_page["identify"].read_bytes())["joints"]
    assert len({t["xaxis"] for t in figure["data"]}) == 6
    assert all(t.get("visible", True) is True for t in figure["data"])
    titles = [figure["layout"][f"xaxis{k or ''}"]["title"]["text"] for k in ("", *range(2, 7))]
    assert titles == [f"J{k} [deg]" for k in range(1, 7)]


def test_kinds_of_smoothing_stand_against_what_is_accepted(every_page):
    page = every_page["identify-motion"]
    figure = figures_of_page(page.read_bytes())["kinds"]
    limit = figure["layout"]["shapes"][0]["x0"]
    assert figure["layout"]["annotations"][0]["text"] == f"limit {limit:.2f} µm"
    assert f"up to {limit:.3g} µm is commanded against" in figure["alt"]
    well, worse = figure["data"]
    assert well["marker"]["symbol"] != worse["marker"]["symbol"]
    assert max(well["x"]) < limit < min(worse["x"])
    assert "May be commanded against." in words_of(page)
    assert words_of(page).count("✓") == 1


def test_a_run_without_a_bound_is_not_called_inside(every_page):
    words = words_of(every_page["executed"])
    assert "Judged by no bound, for none is given." in words
    assert "Inside" not in words


def test_kinds_of_motion_are_in_two_lines_on_a_phone_alone(every_page):
    figure = figures_of_page(every_page["identify-motion"].read_bytes())["kinds"]
    assert not [name for curve in figure["data"] for name in curve["y"] if "<br>" in name]  # paper is lower
    on_a_phone = figure["layout"]["meta"]["narrow"]["yaxis"]["ticktext"]
    assert any("<br>" in name for name in on_a_phone)
