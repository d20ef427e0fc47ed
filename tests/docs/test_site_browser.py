"""The documentation site in headless Chromium, from files: its first screen, widths, code and search."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.docs.test_site import MISSING, build
from tests.support.explorer_page import CHROMIUM, DRIVER, FLAGS

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(MISSING), reason="the extra 'docs' is not installed"),
    pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="no Chromium with its driver"),
]
WIDTHS = (500, 700, 1400)
FOUND = {  # what an engineer types -> the page that the search lists first
    "effective stiffness": "docs/results.html#characterisation",
    "damping ratio": "docs/results.html#characterisation",
    "effective period": "docs/results.html#characterisation",
    "displacement capacity": "docs/results.html#the-verdict-of-a-run",
    "uplift": "docs/uplift.html",
    "rim": "docs/bearing.html#how-stiff-is-a-rim",
    "data sheet": "docs/bearing.html",
    "triple pendulum": "docs/bearing.html",
    "base shear": "docs/buildings.html#results",
    "floor spectrum": "docs/buildings.html#results",
    "floor acceleration": "docs/buildings.html#results",
    "torsion": "docs/buildings.html#results",
    "hospital": "docs/hospital.html",
    "property modification": "docs/properties.html#bounds-of-the-properties",
    "bounds": "docs/properties.html#bounds-of-the-properties",
    "OpenSees": "docs/other-programs.html#bearings-in-opensees",
    "FMU": "docs/other-programs.html#bearings-as-fmus",
    "record scaling": "docs/motion.html#scaling",
    "spectrum": "docs/motion.html#response-spectrum",
    "temperature": "docs/friction.html#heat",
    "friction coefficient": "docs/friction.html",
    "accuracy": "docs/accuracy.html",
    "fragility": "docs/studies.html#evaluation",
    "gradient": "docs/gradients.html",
    "equations of motion": "docs/model.html#the-equations-as-the-code-has-them",
    "two-port": "docs/embedding.html#two-moving-ends-the-two-port",
}
FIRST = "const link = document.querySelector('#search-results li a'); return link && link.href;"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site") / "html"
    build(folder)
    return folder


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    from selenium import webdriver
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service

    options = Options()
    options.binary_location = CHROMIUM
    for flag in (*FLAGS, f"--user-data-dir={tmp_path_factory.mktemp('profile')}"):
        options.add_argument(flag)
    opened = webdriver.Chrome(options=options, service=Service(DRIVER))
    yield opened
    opened.quit()


def show(browser: Any, page: Path, width: int, query: str = "") -> None:
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    browser.get(page.as_uri() + query)


def test_the_first_page_is_one_screen(site: Path, browser: Any) -> None:
    show(browser, site / "index.html", 1400)
    bottoms = "return [...document.querySelectorAll(arguments[0])].map((e) => e.getBoundingClientRect().bottom);"
    cards = browser.execute_script(bottoms, ".cards > ul > li")
    movies = browser.execute_script(bottoms, ".movies img")
    assert len(cards) == 5 and max(cards) <= 900
    assert len(movies) == 2 and max(movies) < min(cards)
    assert browser.execute_script("return [...document.querySelectorAll('.movies img')].every((e) => e.naturalWidth)")


@pytest.mark.parametrize("width", WIDTHS)
def test_no_page_scrolls_sideways(site: Path, browser: Any, width: int) -> None:
    wide, explorer = [], site / "_static" / "explorer.html"  # which stands in a frame of the page of the bearing
    for page in sorted(site.rglob("*.html")):
        if "_static" not in page.parts or page == explorer:
            show(browser, page, width)
            if browser.execute_script("const e = document.documentElement; return e.scrollWidth > e.clientWidth;"):
                wide.append(page.relative_to(site).as_posix())
    assert not wide


def test_code_is_as_wide_as_its_page(site: Path, browser: Any) -> None:
    show(browser, site / "docs" / "bearing.html", 1400)
    widths = browser.execute_script(
        "return ['.bd-article > section', '.bd-article > section > div.highlight-toml'].map("
        "(what) => document.querySelector(what).getBoundingClientRect().width);"
    )
    assert widths[1] == pytest.approx(widths[0], abs=1) and widths[0] > 900


def test_the_search_finds_the_page_of_a_term(site: Path, browser: Any) -> None:
    from selenium.webdriver.support.ui import WebDriverWait

    found = {}
    for term in FOUND:
        show(browser, site / "search.html", 1400, f"?q={term.replace(' ', '+')}")
        link = WebDriverWait(browser, 30).until(lambda opened: opened.execute_script(FIRST))
        found[term] = link.partition(site.as_uri() + "/")[2]
    assert {term: link if "#" in FOUND[term] else link.partition("#")[0] for term, link in found.items()} == FOUND
