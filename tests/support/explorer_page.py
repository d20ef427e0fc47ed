"""The explorer in headless Chromium: opened from a file, its controls moved, each time waiting for what it draws."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from msfp_gen.report.explore import EXPLORED

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
DRIVER = shutil.which("chromedriver")
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage", "--window-size=1400,1000",
)  # fmt: skip
SHOWN = """
const done = arguments[arguments.length - 1];
const before = state.shown;
{action}
const wait = () => (state.shown > before && !state.busy ? done(true) : setTimeout(wait, 2));
wait();
"""
SLIDE = """
const input = document.querySelector(`[data-name="${arguments[0]}"]`);
input.value = arguments[1];
input.dispatchEvent(new Event("input"));
"""
CHOOSE = "const p = find('preset'); p.value = arguments[0]; p.dispatchEvent(new Event('change'));"


@contextmanager
def explorer_in_browser(page: Path, profile: Path) -> Iterator[Any]:
    """A Chromium driver that shows a page of the explorer, after its first drawing; `profile` is an empty folder."""
    from selenium import webdriver
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service

    options = Options()
    options.binary_location = CHROMIUM
    for flag in (*FLAGS, f"--user-data-dir={profile}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    opened = webdriver.Chrome(options=options, service=Service(DRIVER))
    try:
        opened.get("about:blank")
        opened.get_log("performance")
        opened.set_script_timeout(60)
        opened.get(page.as_uri())
        act(opened, "if (before > 0) { done(true); return; }")
        yield opened
    finally:
        opened.quit()


def act(browser: Any, action: str, *arguments: Any) -> None:
    """Do something in the page and wait for what it draws."""
    browser.execute_async_script(SHOWN.replace("{action}", action), *arguments)


def choose_preset(browser: Any, name: str) -> None:
    """Choose a preset and wait for its drawing."""
    act(browser, CHOOSE, str(EXPLORED.index(name)))
