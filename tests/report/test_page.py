"""Every page: one file that asks nothing of another host, well formed, in order for screen readers, with its inputs."""

import re
from html.parser import HTMLParser

import pytest
from every_page import COMMANDS
from markupsafe import Markup
from shipped import path_file, quiet

import compgen
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.report.inputs import SHORT, Inputs, duties_words, job_inputs
from compgen.report.job_page import job_html
from compgen.report.page import PageOptions, page, page_words, style, templates
from compgen.thermal import Duty

VOID = {"meta", "br", "input", "img", "link", "hr", "wbr"}  # elements without an end
TEXT, LINES = 4.5, 3.0  # least contrast of words, and of lines in figures: WCAG 2.2, AA
#: what is written in which colour on which ground
WORDS = [
    ("text", "ground"), ("text", "panel"), ("muted", "ground"), ("muted", "panel"), ("link", "ground"),
    ("text", "inside-ground"), ("text", "outside-ground"), ("text", "predicted-ground"), ("inside", "inside-ground"),
    ("outside", "outside-ground"), ("predicted", "predicted-ground"), ("outside", "ground"), ("warning", "ground"),
]  # fmt: skip
DRAWN = ("before", "after", "neutral", "limit")


class Reader(HTMLParser):
    """What a page holds, tag by tag; fails where one ends that has not begun."""

    def __init__(self, text):
        super().__init__()
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.feed(text)
        self.close()
        assert not self.open, self.open

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        if (tag not in VOID and not self._in_svg()) or tag == "svg":
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))

    def handle_endtag(self, tag):
        if self._in_svg() and tag != "svg":
            return
        assert self.open, tag
        assert self.open.pop() == tag, tag

    def _in_svg(self):
        return "svg" in self.open

    def named(self, *tags):
        return [(tag, attributes) for tag, attributes in self.tags if tag in tags]


def text_of(file):
    return file.read_text(encoding="utf-8")


def variables(text):
    return dict(re.findall(r"--([a-z-]+):(#[0-9a-f]{6})", text))


def luminance(colour):
    """Relative luminance of an sRGB colour, WCAG 2.2."""
    shares = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in shares]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(a, b):
    high, low = sorted((luminance(a), luminance(b)), reverse=True)
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("command", COMMANDS)
def test_a_page_is_well_formed_and_asks_nothing_of_another_host(every_page, command):
    reader = Reader(text_of(every_page[command]))
    addresses = [a[key] for _, a in reader.tags for key in ("src", "href", "srcset", "data", "action") if a.get(key)]
    beside = every_page[command].parent
    assert all(address.startswith(("#", "data:")) or (beside / address).exists() for address in addresses)
    keys = [a["id"] for _, a in reader.tags if "id" in a]
    assert len(keys) == len(set(keys))
    assert reader.named("html") == [("html", {"lang": "en"})]
    assert ("meta", {"name": "viewport", "content": "width=device-width, initial-scale=1"}) in reader.tags


@pytest.mark.parametrize("command", COMMANDS)
def test_headings_and_tables_are_in_order_for_screen_readers(every_page, command):
    reader = Reader(text_of(every_page[command]))
    levels = [int(tag[1]) for tag, _ in reader.named("h1", "h2", "h3", "h4")]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(b <= a + 1 for a, b in zip(levels, levels[1:], strict=False))
    assert all(a.get("scope") in ("col", "row") for _, a in reader.named("th"))
    pictures = [a for _, a in reader.tags if a.get("role") == "img"]
    assert all(a.get("aria-label") for a in pictures)
    assert len(pictures) >= len(reader.named("figure"))


@pytest.mark.parametrize("command", COMMANDS)
def test_a_page_says_what_it_was_made_from_and_has_a_place_to_sign(every_page, command):
    text = text_of(every_page[command])
    block = text[text.index('<section class="inputs">') :]
    block = block[: block.index("</section>")]
    assert "<h2>Inputs</h2>" in block
    assert f"compgen {compgen.__version__}" in block
    short = re.findall(rf"sha256 ([0-9a-f]{{{SHORT}}})\b", block)
    whole = re.findall(r"[0-9a-f]{64}", text[text.index("<footer>") :])
    assert short
    assert all(any(digest.startswith(s) for digest in whole) for s in short)
    assert "<dt>date</dt>" not in block
    assert text.index('class="sign"') < text.index("<footer>")


def test_a_date_is_on_the_page_where_it_is_asked_for_and_all_else_the_same():
    planned = generate.predict(load_job(path_file("line_y")), quiet)
    plain, dated = (job_html(planned, None, options) for options in (PageOptions(), PageOptions("2026-01-31")))
    assert dated.replace(b"<dt>date</dt><dd>2026-01-31</dd>", b"") == plain
    assert job_html(planned, None) == plain


def test_a_page_without_figures_carries_no_script():
    assert b"<script" not in page("page.html", "t", inputs=Inputs(), body=Markup("<p>b</p>"))


def test_the_inputs_of_a_job_say_tool_frame_feed_and_history():
    overrides = ["frame.number=2", "frame.x_mm=1.5", "tool.z_mm=120.25", 'before=[{state="off",duration_h=0.5}]']
    rows = dict(job_inputs(load_job(path_file("line_y"), None, overrides)).rows)
    assert rows["part frame"].startswith("UFRAME 2: X 1.5 Y 0 Z 0 mm")
    assert "Z 120.25 mm" in rows["tool"]
    assert rows["feed"] == "200 mm/s"
    assert rows["history"] == "off for 30 min"
    assert rows["overrides"] == ", ".join(overrides)


def test_a_long_history_says_how_long_the_robot_was_in_each_state():
    day = (Duty("moving", 0.2, 7200.0, 0.5), Duty("idle", 0.0, 600.0), Duty("off", 0.0, 60.0)) * 2
    assert duties_words(day) == ("6 stretches over 4.37 h: moving 4 h, idle 20 min, off 2 min; at last off for 1 min")
    assert duties_words(day[:1]) == "moving at 200 mm/s at a duty of 50 % for 2 h"
    assert "cold" in duties_words(())


def test_findings_are_told_by_sign_and_word():
    findings = [Finding(level, Code.CONTROLLER_SIZE, "m") for level in (Level.OUTSIDE, Level.WARNING, Level.NOTE)]
    item = r'<li class="(\w+)"><span class="mark" aria-hidden="true">(.)</span>(.*?)</li>'
    items = re.findall(item, vars(templates().get_template("macros.html").module)["findings"](findings))
    assert [(kind, words) for kind, _, words in items] == [(k, f"{k}: m") for k in ("outside", "warning", "note")]
    assert len({sign for _, sign, _ in items}) == 3


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_words_can_be_read_on_their_ground(scheme):
    light, dark = style().split("@media screen and (prefers-color-scheme:dark)")
    colours = variables(light) if scheme == "light" else variables(dark)
    assert {name for pair in WORDS for name in pair} <= set(colours)
    poor = {pair: contrast(*(colours[name] for name in pair)) for pair in WORDS}
    assert not {pair: value for pair, value in poor.items() if value < TEXT}
    assert all(contrast(colours[name], colours["ground"]) >= LINES for name in DRAWN)


def test_paper_is_white_whatever_the_screen_prefers():
    assert "@media screen and (prefers-color-scheme:dark)" in style()
    assert style().count("prefers-color-scheme") == 1


def test_words_of_a_command_stand_on_a_page_with_capital_and_unit():
    assert page_words("5 um off <b>, 3 umbrellas; um") == "5 &micro;m off &lt;b&gt;, 3 umbrellas; um"
    assert page_words("the rest") == "The rest"
