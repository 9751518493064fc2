"""A headless Chromium in which tests look at pages; where there is none they skip and say why."""

import base64
import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import pytest

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
#: of a page as it is drawn: elements of HTML that reach beyond the screen, other than in a box that scrolls
BEYOND = """
return [...document.querySelectorAll("body *")].filter(element => {
  const box = element.getBoundingClientRect();
  const isInside = element.closest("svg") && element.tagName !== "svg" || element.closest("#js-plotly-tester");
  const scrolls = element.parentElement.closest(".scroll");
  return !isInside && !scrolls && box.width && (box.right > innerWidth + 1 || box.left < -1);
}).map(element => element.tagName + "." + element.className + " " + element.getBoundingClientRect().right)
"""
#: words of figures in the plane that reach beyond their figure
CUT = """
return [...document.querySelectorAll(".chart .main-svg text")].filter(text => {
  const box = text.getBoundingClientRect(), whole = text.closest(".chart").getBoundingClientRect();
  return box.width && text.textContent.trim() &&
    !text.closest(".hoverlayer, #js-plotly-tester") &&
    (box.left < whole.left - 1 || box.right > whole.right + 1 ||
      box.top < whole.top - 1 || box.bottom > whole.bottom + 1);
}).map(text => text.closest(".chart").querySelector(".plotly-graph-div").id + ": " + text.textContent)
"""
#: scrolls on, as a reader does: a figure in space is drawn when it comes near; at last whether all are, and to the top
ALL_DRAWN = """
const open = [...document.querySelectorAll(".chart")].find(chart => !chart.querySelector(".main-svg"));
if (open) open.scrollIntoView(); else scrollTo(0, 0);
return !open;
"""


def missing() -> str:
    """Why no browser can be used; empty where one can."""
    if find_spec("selenium") is None:
        return "selenium is not installed"
    if not any(map(shutil.which, BROWSERS)):
        return f"no browser: none of {', '.join(BROWSERS)} is installed"
    return "" if shutil.which("chromedriver") else "chromedriver is not installed"


@contextmanager
def chromium(logs_requests: bool = False) -> Iterator["Browser"]:
    """A browser that asks nothing of another host; the test skips where there is none."""
    reason = missing()
    if reason:
        pytest.skip(reason)
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = next(path for path in map(shutil.which, BROWSERS) if path)
    for argument in (
        "--headless=new", "--no-sandbox", "--disable-background-networking", "--disable-dev-shm-usage",
        "--hide-scrollbars", "--use-angle=swiftshader-webgl", "--enable-unsafe-swiftshader",
    ):  # fmt: skip
        options.add_argument(argument)
    if logs_requests:
        options.set_capability("goog:loggingPrefs", {"performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))
    try:
        yield Browser(driver)
    finally:
        driver.quit()


class Browser:
    """One window, whose size and colours a test sets."""

    def __init__(self, driver) -> None:
        self.driver = driver

    def open(self, page: Path, width: int = 1400, dark: bool = False, scripts: bool = True) -> None:
        """Load a page from disk in a window of a width [px]."""
        self.driver.get("about:blank")  # one with figures in space would go on drawing while the next one is loaded
        self._do("Emulation.setScriptExecutionDisabled", value=not scripts)
        self._do("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=width < 600)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self._do("Emulation.setEmulatedMedia", media="", features=[scheme])
        self.driver.get(page.as_uri())
        if not scripts:  # the driver does not wait for such a page; only there noscript has elements in it
            self.wait_for(lambda: self._has("noscript *") and self._has("footer"))

    def show(self, page: Path, **how) -> None:
        """Open a page, scroll through it and wait until its figures are drawn."""
        self.open(page, **how)
        self.wait_for(lambda: self.run(ALL_DRAWN))

    def wait_for(self, holds) -> None:
        """Wait until something holds in the page; selenium's TimeoutException when it never does."""
        from selenium.webdriver.support.ui import WebDriverWait

        WebDriverWait(self.driver, 120).until(lambda _: holds())

    def run(self, script: str):
        """What a script in the page returns."""
        return self.driver.execute_script(script)

    def requested(self) -> list[str]:
        """What the pages have asked for since the last call, of a browser that logs it."""
        messages = [json.loads(entry["message"])["message"] for entry in self.driver.get_log("performance")]
        return [m["params"]["request"]["url"] for m in messages if m["method"] == "Network.requestWillBeSent"]

    def printed(self) -> bytes:
        """The page on A4, as PDF."""
        printed = self._do("Page.printToPDF", printBackground=True, paperWidth=8.27, paperHeight=11.69)
        return base64.b64decode(printed["data"])

    @contextmanager
    def print_media(self) -> Iterator[None]:
        """The page as it is printed where the screen is dark; behind it the dark screen."""
        dark = {"name": "prefers-color-scheme", "value": "dark"}
        self._do("Emulation.setEmulatedMedia", media="print", features=[dark])
        try:
            yield
        finally:
            self._do("Emulation.setEmulatedMedia", media="", features=[dark])

    def text(self, selector: str) -> str:
        """All words of the elements that a selector finds."""
        from selenium.webdriver.common.by import By

        return " ".join(e.get_attribute("textContent") for e in self.driver.find_elements(By.CSS_SELECTOR, selector))

    def _has(self, selector: str) -> bool:
        return bool(self.driver.find_elements("css selector", selector))

    def _do(self, command: str, **arguments):
        return self.driver.execute_cdp_cmd(command, arguments)
