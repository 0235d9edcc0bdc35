"""A browser, where there is one, and what a page in it shows and says."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

# WebGL by software
FLAGS = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-compositing", "--no-sandbox")


@pytest.fixture(scope="module")  # its driver has an event loop of its own while it runs
def chromium() -> Iterator[Any]:
    """Chromium without a head; skips where it or its driver is not here."""
    api = pytest.importorskip("playwright.sync_api")
    path = next((p for p in map(shutil.which, ("chromium", "chromium-browser", "google-chrome")) if p), None)
    if path is None:
        pytest.skip("needs Chromium (Debian: apt-get install chromium)")
    with api.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=path, args=list(FLAGS))
        yield browser
        browser.close()


class Shown:
    """A page in a tab, and all that it complained of or asked others for."""

    def __init__(self, browser: Any, width: int, height: int, script: str = ""):
        self.tab = browser.new_page(viewport={"width": width, "height": height})
        self.wrong: list[str] = []
        self.asked: list[str] = []
        self.tab.on("console", self._hear)
        self.tab.on("pageerror", lambda e: self.wrong.append(str(e)))
        self.tab.on("request", lambda r: self.asked.append(r.url))
        self.tab.add_init_script(
            "addEventListener('securitypolicyviolation', (e) => console.error('policy: ' + e.violatedDirective));"
            + script
        )

    def _hear(self, message: Any) -> None:
        own = "GL Driver Message" in message.text  # of reading a canvas back, which the tests do
        if message.type in ("error", "warning") and not own:
            self.wrong.append(message.text)

    def open(self, url: str) -> Shown:
        self.tab.goto(url)
        self.tab.wait_for_selector("body[data-ready=yes]", timeout=60_000)
        return self

    def do(self, script: str) -> Any:
        return self.tab.evaluate(script)

    def until(self, condition: str, seconds: float = 30.0) -> None:
        """Playwright's own wait compiles its condition in the page, which the page's policy forbids."""
        end = time.monotonic() + seconds
        while not self.do(condition):
            assert time.monotonic() < end, condition
            self.tab.wait_for_timeout(100)

    def colours(self, canvas: str) -> int:
        """How many different colours a canvas of three.js shows."""
        return int(
            self.do(f"""() => {{
            const from = document.querySelector("{canvas}"), to = document.createElement("canvas");
            to.width = from.width; to.height = from.height;
            const context = to.getContext("2d");
            context.drawImage(from, 0, 0);
            return new Set(new Uint32Array(context.getImageData(0, 0, to.width, to.height).data.buffer)).size;
        }}""")
        )

    def pixels(self, canvas: str) -> str:
        """What a canvas shows, to be compared."""
        self.do("() => new Promise((next) => requestAnimationFrame(() => requestAnimationFrame(next)))")
        return str(self.do(f"document.querySelector('{canvas}').toDataURL()"))

    def slide(self, slider: str, value: int) -> None:
        self.do(f"""() => {{ const s = document.querySelector("{slider}"); s.value = {value};
            s.dispatchEvent(new Event("input")); s.dispatchEvent(new Event("change")); }}""")


@pytest.fixture
def shown(chromium: Any) -> Iterator[Callable[..., Shown]]:
    tabs: list[Shown] = []

    def open_tab(width: int = 1400, height: int = 900, script: str = "") -> Shown:
        tabs.append(Shown(chromium, width, height, script))
        return tabs[-1]

    yield open_tab
    for tab in tabs:
        tab.tab.close()
