"""The living what-if page as the command line makes it; what it does in a browser is in test_live_browser.py."""

import json

import numpy as np
import pytest
from command_line import refused, run
from shipped import ROOT, path_file, quiet

from compgen.core.units import UM
from compgen.pipelines.study.live_build import Agreement, build_live
from compgen.pipelines.study.live_day import planned_setting
from compgen.report.live import live_section

LINE = ROOT / "paths" / "line_y.toml"


def whatif(folder, *arguments, path=LINE):
    result = run("whatif", path, *arguments, "-o", folder / "w", cwd=folder)
    assert result.returncode == 0, result.stderr
    return result, (folder / "w" / "whatif.html").read_text(), json.loads((folder / "w" / "whatif.json").read_text())


@pytest.fixture(scope="module")
def bare(tmp_path_factory):
    return whatif(tmp_path_factory.mktemp("bare"))


def test_the_bare_command_gives_the_sliders(bare):
    result, page, record = bare
    assert "sliders: largest error on the part" in result.stdout
    assert record["live"]["sliders"] == [
        "before.0.duration_h", "before.0.feed_mm_s", "before.0.duty", "ambient.value_degC", "start.delay_min",
        "robot.thermal.cte_um_m_K",
    ]  # fmt: skip
    assert record["live"]["settings_checked"] == 20
    assert record["live"]["is_close"]
    assert record["live"]["largest_difference_um"] < 0.2
    for kind in ("duration", "feed", "duty", "air", "delay", "cte"):
        assert f'data-kind="{kind}"' in page
    assert "the path has no [[cycle]]" in page


def test_the_page_asks_nothing_of_another_host_and_is_the_same_every_time(bare, tmp_path):
    _, page, _ = bare
    assert "http://" not in page.replace("http://www.w3.org/2000/svg", "")
    assert "https://" not in page
    assert whatif(tmp_path)[1] == page


def test_the_page_says_the_planned_numbers_without_its_script(bare):
    _, page, record = bare
    before = page.split('id="live-before-largest">')[1].split("<")[0]
    assert float(before) == pytest.approx(record["live"]["before_max_um"], abs=0.006)


def test_a_study_has_the_sliders_beside_its_curves_and_none_on_request(tmp_path):
    grid = ("--vary", "duty=0.5,1", "--workers", "1")
    _, page, record = whatif(tmp_path, *grid)
    assert len(record["scenarios"]) == 2
    assert "live-data" in page
    assert "plotly" in page
    (tmp_path / "other").mkdir()
    _, page, record = whatif(tmp_path / "other", *grid, "--no-live")
    assert "live-data" not in page
    assert "live" not in record


def test_a_path_that_cannot_be_corrected_says_so_and_its_study_goes_on(tmp_path):
    far = ("--set", "path.x_mm=9000")
    result, page, record = whatif(tmp_path, *far, "--vary", "path.x_mm=1200,1300", "--workers", "1")
    assert [row["state"] for row in record["scenarios"]] == ["done", "done"]
    assert "reach" in record["live"]["missing"]
    assert "No sliders: " in page
    assert "live-data" not in page
    assert "No sliders: " in result.stdout
    refused(run("whatif", LINE, *far, "-o", tmp_path / "alone", cwd=tmp_path), 3, "reach")
    assert not (tmp_path / "alone").exists()


@pytest.mark.parametrize(("apart_um", "is_close"), [(0.19, True), (0.21, False)])
def test_a_page_too_far_from_the_full_computation_says_so(apart_um, is_close):
    live_job = build_live(path_file("line_y"), None, (), quiet)
    off = np.full((1, 3), apart_um * UM)
    agreement = Agreement((planned_setting(live_job.live.day),), off, 0 * off, np.zeros(1))
    section = live_section(live_job, agreement, "paths/line_y.toml", None, ())
    assert ("take the commands" in section.warning) is not is_close
    assert ("That is more than" in section.html) is not is_close
    assert section.record is not None
    assert section.record["is_close"] is is_close
    assert f'<b id="live-agreement">{apart_um:.3f}</b>' in section.html
