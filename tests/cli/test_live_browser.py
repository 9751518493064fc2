"""The living page in real Chromium: a slider is moved, and the number it shows is that of the command it prints."""

import json
import shlex

import pytest
from browser import BEYOND
from command_line import run
from shipped import ROOT, path_file, quiet

from compgen.core.exceptions import InputError
from compgen.core.units import UM
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.study.live_band import band_at
from compgen.pipelines.study.live_build import build_live
from compgen.pipelines.study.live_day import drawn_settings, overrides_of, planned_setting
from compgen.pipelines.study.live_places import at

BROWSER_AND_PYTHON = 1e-6  # [um] that the script may be from the same formula in Python
PAGE_AND_COMMAND = 0.2  # [um] that a page may be from the full computation
LONGEST = 2000.0  # [ms] of an update on a machine that does other things: it takes some 10, and 100 are promised
SCHEDULE = (
    'before=[{state="moving",program="line_x",repeat=40,dwell_s=30,dwell="off"},{state="idle",duration_h=0.5}]',
    'cycle=[{state="moving",repeat=12,dwell_s=120},{state="off",duration_h=20},{state="moving",repeat=3}]',
    'ambient={kind="wave",amplitude_K=3,value_degC=22}',
)
IN_SHIFTS = (
    "shift=[{from_h=6,to_h=14,breaks_h=[[9,9.25],[12,12.5]]},{from_h=22,to_h=30}]",
    'before=[{state="off",duration_h=1},{state="moving",program="line_x",repeat=60,dwell_s=120,shifts=true},'
    '{state="moving",feed_mm_s=60,duration_h=29,duty=0.7,shifts=true}]',
    'ambient={kind="wave",amplitude_K=3,clock_h=5}',
)
#: what a hand on a slider, or on the number beside it, does
MOVE = """
const [n, value, stops] = arguments, range = document.getElementById(`live-${n}`);
const typed = document.getElementById(`live-number-${n}`);
if (stops.length || typed.tagName === 'OUTPUT') {
  range.value = stops.indexOf(value);
  range.dispatchEvent(new Event('input', {bubbles: true}));
} else {
  typed.value = value;
  typed.dispatchEvent(new Event('change', {bubbles: true}));
}
"""
#: the numbers after the next picture: a move is carried out before it is painted
READ = """
const done = arguments[0], of = id => +document.getElementById(id).dataset.um;
requestAnimationFrame(() => requestAnimationFrame(() => done({
  before: ['largest', 'p99', 'rms'].map(part => of(`live-before-${part}`)),
  after: ['largest', 'p99', 'rms'].map(part => of(`live-after-${part}`)),
  band: of('live-band'), ms: +document.getElementById('live').dataset.ms,
  sentence: document.getElementById('live-sentence').textContent,
  predict: document.getElementById('live-command-before').textContent,
  check: document.getElementById('live-command-after').textContent,
  notes: [...document.querySelectorAll('.live-note')].map(note => note.textContent),
})));
"""
CASES = {
    "nodes": ("spiral_1300", ("start.delay_min=40",)),
    "network": ("circle_1300", ("robot.thermal.model=network",)),
    "schedule": ("line_y", (*SCHEDULE, "robot.thermal.model=network")),
    "schedule by nodes": ("line_y", SCHEDULE),
    "shifts": ("line_y", IN_SHIFTS),
}


class Page:
    """A page that was made, its numbers in Python, and the browser that shows it."""

    def __init__(self, browser, folder, name, overrides):
        sets = [word for item in overrides for word in ("--set", item)]
        self.path, self.folder = ROOT / "paths" / f"{name}.toml", folder
        self.browser, self.window = browser, browser.driver
        for command in ("whatif", "generate"):
            done = run(command, self.path, *sets, "-q", cwd=folder)
            assert done.returncode == 0, done.stderr
        self.live_job = build_live(path_file(name), None, overrides, quiet)
        self.sliders = self.live_job.live.day.sliders
        self.file = folder / "outputs" / f"{name}_whatif" / "whatif.html"
        self.window.get_log("browser")
        browser.open(self.file)

    def moved(self, setting):
        """What the page shows with its sliders at a setting."""
        for n, (slider, value) in enumerate(zip(self.sliders, setting, strict=True)):
            self.window.execute_script(MOVE, n, value, list(slider.stops))
        return self.window.execute_async_script(READ)

    def settings_that_files_take(self, count, seed):
        """Drawn ones, without those at which runs or hours do not fall into the shifts."""
        taken = []
        for setting in drawn_settings(self.sliders, 10 * count, seed):
            moved = overrides_of(self.live_job.live.day, setting)
            try:
                load_job(str(self.path), overrides=[*self.live_job.overrides, *moved])
            except InputError:
                continue
            taken.append(setting)
            if len(taken) == count:
                return taken
        raise AssertionError(f"{len(taken)} settings in {10 * count}")

    def report(self, command):
        """The record of a command that the page prints, run in the folder where the page was made."""
        name, *words = shlex.split(command)
        assert name == "cgen"
        done = run(*words, cwd=self.folder)
        assert done.returncode in (0, 1), done.stderr
        return json.loads(done.stdout)


@pytest.fixture(scope="module", params=CASES)
def page(request, browser, tmp_path_factory):
    name, overrides = CASES[request.param]
    return Page(browser, tmp_path_factory.mktemp("page"), name, overrides)


def test_the_script_computes_what_python_does(page):
    live, worst = page.live_job.live, 0.0
    for setting in (planned_setting(live.day), *drawn_settings(page.sliders, 6, seed=5)):
        shown = page.moved(setting)
        for side, places in (("before", live.before), ("after", live.after)):
            expected = at(live, setting, places)
            largest, p99, rms = shown[side]
            worst = max(worst, abs(largest - expected.max / UM), abs(rms - expected.rms / UM))
            assert p99 == pytest.approx(expected.p99 / UM, abs=0.02)  # of equal lengths either of two neighbours counts
        expected_band = band_at(live, page.live_job.band, setting).largest / UM
        assert shown["band"] == pytest.approx(expected_band, abs=BROWSER_AND_PYTHON)
        assert shown["ms"] < LONGEST
    assert worst < BROWSER_AND_PYTHON
    assert page.window.get_log("browser") == []


def test_before_is_what_predict_says_by_the_command_on_the_page(page):
    for setting in page.settings_that_files_take(2, seed=11):
        shown = page.moved(setting)
        record = page.report(shown["predict"])
        assert "--set" in shown["predict"]
        expected = record["on_part"]["before"]["total"]
        for value, key in zip(shown["before"], ("max_um", "p99_um", "rms_um"), strict=True):
            assert value == pytest.approx(expected[key], abs=PAGE_AND_COMMAND)
        assert shown["band"] == pytest.approx(record["band"]["p95_um"], abs=0.02 * shown["band"])


def test_after_is_what_the_written_program_does_by_the_command_on_the_page(page):
    for setting in page.settings_that_files_take(2, seed=12):
        shown = page.moved(setting)
        record = page.report(shown["check"])
        expected = record["on_part"]["after"]["total"]
        for value, key in zip(shown["after"], ("max_um", "p99_um", "rms_um"), strict=True):
            assert value == pytest.approx(expected[key], abs=PAGE_AND_COMMAND)
        assert record["written"]["file"].endswith(".LS")


def test_the_commands_say_what_python_would_set(page):
    for setting in drawn_settings(page.sliders, 3, seed=13):
        words = shlex.split(page.moved(setting)["predict"])
        overrides = [item for flag, item in zip(words, words[1:], strict=False) if flag == "--set"]
        wanted = [*page.live_job.overrides, *overrides_of(page.live_job.live.day, setting)]

        def numbers(items):
            return [item.replace(".0]", "]").replace(".0,", ",").removesuffix(".0") for item in items]

        assert numbers(overrides) == numbers(wanted)


def test_the_reset_button_leads_back_to_the_planned_state(page):
    planned = page.moved(planned_setting(page.live_job.live.day))
    page.moved(drawn_settings(page.sliders, 1, seed=14)[0])
    page.window.execute_script("document.getElementById('live-reset').click()")
    again = page.window.execute_async_script(READ)
    assert {k: v for k, v in again.items() if k != "ms"} == {k: v for k, v in planned.items() if k != "ms"}
    assert "as planned" in again["sentence"]
    assert not page.live_job.overrides or "--set" in again["predict"]


def test_what_lies_beyond_the_model_is_said_beside_the_slider(page):
    sliders, setting = page.sliders, list(planned_setting(page.live_job.live.day))
    feed = next(n for n, slider in enumerate(sliders) if slider.kind == "feed")
    setting[feed] = sliders[feed].stops[-1] if sliders[feed].stops else 250.0
    assert "beyond 20 to 200 mm/s" in page.moved(setting)["notes"][feed]
    setting[feed] = sliders[feed].value
    air = next(n for n, slider in enumerate(sliders) if slider.kind == "air")
    setting[air] = sliders[air].high
    notes = page.moved(setting)["notes"]
    assert notes[feed] == ""
    long = [n for n, slider in enumerate(sliders) if slider.kind == "duration" and slider.value > 5]
    if long:
        assert "above the 14 K that were measured" in notes[air]
        setting[long[0]] = sliders[long[0]].high
        assert "h of motion by the program's end" in page.moved(setting)["notes"][long[0]]


def test_late_is_said_beyond_the_window_of_the_start_that_the_program_is_made_for(page):
    """The program's window counts from its planned start, which may be late itself; the slider from the first run."""
    setting = list(planned_setting(page.live_job.live.day))
    n, window = [s.kind for s in page.sliders].index("delay"), page.live_job.corrected.start_window
    for seconds, is_late in ((0.0, False), (window - 60.0, False), (window + 60.0, True)):
        moved = [*setting[:n], setting[n] + seconds / 60, *setting[n + 1 :]]
        if moved[n] <= page.sliders[n].high:
            assert ("later than the" in page.moved(moved)["notes"][n]) == is_late


def test_a_key_moves_a_slider_and_the_number_is_said(page):
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys

    page.moved(planned_setting(page.live_job.live.day))
    slider = page.window.find_element(By.CSS_SELECTOR, "#live input[data-kind=air]")
    before = page.window.execute_async_script(READ)["before"][0]
    slider.send_keys(Keys.ARROW_RIGHT * 5)
    assert page.window.execute_async_script(READ)["before"][0] != before
    assert slider.get_attribute("aria-valuetext").endswith("degrees Celsius")
    sentence = page.browser.text("#live-sentence")
    page.browser.wait_for(lambda: page.browser.text("#live-announcement[aria-live=polite]") == sentence != "")


def test_what_is_typed_beyond_a_slider_or_is_no_number_is_said(page):
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys

    n = next(n for n, slider in enumerate(page.sliders) if slider.kind == "air")
    slider = page.sliders[n]
    box = page.window.find_element(By.ID, f"live-number-{n}")
    half = f"{slider.value + 0.5:g}"
    for typed, shown, words in (
        ("1e9", slider.high, f"1e9 is beyond this slider: {slider.low:g} to {slider.high:g} °C"),
        (half.replace(".", ","), slider.value + 0.5, ""), ("nan", slider.value + 0.5, '"nan" is not a number'),
        ("", slider.value + 0.5, "no number was typed"), ("-1e400", slider.low, "-1e400 is beyond"),
    ):  # fmt: skip
        box.click()
        box.send_keys(Keys.CONTROL, "a")
        box.send_keys(Keys.DELETE, typed, Keys.TAB)
        notes = page.window.execute_async_script(READ)["notes"]
        assert float(box.get_attribute("value")) == pytest.approx(shown)
        assert words in notes[n]
        assert words or "typed" not in notes[n]
    page.window.execute_script("document.getElementById('live-reset').click()")
    assert page.window.execute_async_script(READ)["notes"][n] == ""


@pytest.mark.parametrize("width", [400, 800])
def test_nothing_is_wider_than_the_screen(page, width):
    try:
        page.browser.open(page.file, width, dark=width == 400)
        page.moved(drawn_settings(page.sliders, 1, seed=15)[0])
        assert page.browser.run(BEYOND) == []
    finally:
        page.browser.open(page.file)


def test_on_paper_stands_the_setting_that_was_shown(page):
    setting = drawn_settings(page.sliders, 1, seed=16)[0]
    shown = page.moved(setting)
    try:
        with page.browser.print_media():
            hidden = "return getComputedStyle(document.querySelector('#live input[type=range]')).display"
            assert page.browser.run(hidden) == "none"
            values = "return [...document.querySelectorAll('[id^=live-number-]')].map(e => +(e.value || e.textContent))"
            assert page.browser.run(values) == pytest.approx(list(setting))
            assert shown["sentence"] in page.browser.text("#live-sentence")
    finally:
        page.browser.open(page.file)


def test_a_link_opens_the_page_with_its_sliders_where_they_were(page):
    """The fragment of the address, after the half second in which it is written, and of another window."""
    (setting,) = drawn_settings(page.sliders, 1, seed=29)
    shown = page.moved(setting)
    address = page.window.execute_async_script("setTimeout(() => arguments[0](location.href), 700)")
    moved = [s for s, value in zip(page.sliders, setting, strict=True) if value != s.value]
    assert address.count("=") == len(moved) > 1
    page.window.get("about:blank")
    page.window.get(address)
    again = page.window.execute_async_script(READ)
    same = ("before", "after", "band", "sentence", "predict", "check")
    assert [again[key] for key in same] == [shown[key] for key in same]
    page.browser.open(page.file)
    planned = page.window.execute_async_script(READ)
    assert planned["sentence"] != shown["sentence"]
    key, low, high = page.sliders[0].key, page.sliders[0].low, page.sliders[0].high
    whole = address.partition("#")[2]
    for bad in (
        "no.such_key=1",
        f"{key}={high + 1}",
        f"{key}={low}x",
        f"{key}=",
        "%E0%A4%A",
        f"{key}=0x1",
        f"{whole}&{key}",
    ):
        page.window.get("about:blank")
        page.window.get(f"{page.file.as_uri()}#{bad}")
        assert page.window.execute_async_script(READ)["sentence"] == planned["sentence"], bad
    page.window.execute_script("location.hash = arguments[0]", whole)  # a link that is followed on the open page
    assert page.window.execute_async_script(READ)["sentence"] == shown["sentence"]
    page.window.execute_script("document.getElementById('live-reset').click()")
    assert page.window.execute_async_script("setTimeout(() => arguments[0](location.hash), 900)") == ""
    assert page.window.get_log("browser") == []
