"""The report of a suite at bounds in headless Chromium: widths, console, figures with captions, and pages in print."""

from __future__ import annotations

import base64
import re
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from msfp_gen.report import write_analysis
from tests.support.explorer_page import CHROMIUM, DRIVER, FLAGS
from tests.unit.report.test_analysis_report import TITLE, small_suite

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="no Chromium with its driver"),
]
WIDTHS = (500, 700, 1400)
WIDE = "const e = document.documentElement; return e.scrollWidth - e.clientWidth;"
FIGURES = """
return [...document.querySelectorAll("figure")].map((figure) => {
  const [image, caption] = [figure.querySelector("img"), figure.querySelector("figcaption")];
  const [shown, words] = [image.getBoundingClientRect(), caption.getBoundingClientRect()];
  return { text: caption.textContent, natural: image.naturalWidth, width: shown.width, right: shown.right,
    gap: words.top - shown.bottom };
});
"""
BROKEN = """
return [...document.querySelectorAll("table")].filter((table) => {
  const box = table.parentElement;
  return table.getBoundingClientRect().right > innerWidth && box.scrollWidth <= box.clientWidth;
}).map((table) => table.caption.textContent);
"""
PAPER = {"paperWidth": 8.27, "paperHeight": 11.69, "preferCSSPageSize": False, "printBackground": True}


@pytest.fixture(scope="module")
def page(tmp_path_factory: Any) -> Path:
    folder = Path(tmp_path_factory.mktemp("suite"))
    return write_analysis(small_suite(folder), folder / "report.html", TITLE)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: Any) -> Iterator[Any]:
    from selenium import webdriver
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service

    options = Options()
    options.binary_location = CHROMIUM or ""
    for flag in (*FLAGS, f"--user-data-dir={tmp_path_factory.mktemp('profile')}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    opened = webdriver.Chrome(options=options, service=Service(DRIVER))
    yield opened
    opened.quit()


def show(browser: Any, page: Path, width: int) -> None:
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    browser.get(page.as_uri())


@pytest.mark.parametrize("width", WIDTHS)
def test_the_page_fits_its_width(page: Path, browser: Any, width: int) -> None:
    show(browser, page, width)
    assert browser.execute_script(WIDE) == 0
    assert browser.execute_script(BROKEN) == [], "a wide table scrolls by itself"
    assert browser.get_log("browser") == []


@pytest.mark.parametrize("width", WIDTHS)
def test_every_figure_has_its_number_and_its_caption_below_it(page: Path, browser: Any, width: int) -> None:
    show(browser, page, width)
    figures = browser.execute_script(FIGURES)
    numbers = [int(number) for figure in figures for number in re.findall(r"^Figure (\d+)\. \w", figure["text"])]
    assert numbers == list(range(1, len(figures) + 1)) and len(figures) > 5
    for figure in figures:
        assert figure["natural"] > 0 and figure["right"] <= width and 0 <= figure["gap"] < 12, figure["text"]
        assert figure["width"] > 0.85 * min(width, 1100), "a figure uses the width of the page"


def test_printed_pages_have_their_numbers(page: Path, browser: Any) -> None:
    show(browser, page, 1400)
    pages = printed_texts(base64.b64decode(browser.execute_cdp_cmd("Page.printToPDF", PAPER)["data"]))
    count = len(pages)
    assert count > 5
    for number, text in enumerate(pages, start=1):
        assert text.startswith(f"{number} / {count}"), f"page {number}"
    captions = re.findall(r"<figcaption>(Figure \d+\.)", page.read_text(encoding="utf-8"))
    assert "Contents" in pages[0] and all(caption in "".join(pages[1:]) for caption in captions)


def printed_texts(pdf: bytes) -> list[str]:
    """The text of every page of a PDF as Chromium writes it: one object for a page, its content, and each font."""
    parts = re.split(rb"(?:^|\n)(\d+) 0 obj\n", pdf)
    objects = dict(zip(map(int, parts[1::2]), parts[2::2], strict=True))
    texts = []
    for page in (found for found in objects.values() if re.search(rb"/Type /Page\b", found)):
        fonts = {name: letters(objects, int(number)) for name, number in re.findall(rb"/(F\d+) (\d+) 0 R", page)}
        (content,) = re.findall(rb"/Contents (\d+) 0 R", page)
        text, font = "", dict[int, str]()
        for name, codes in re.findall(rb"/(F\d+) [\d.]+ Tf|<([0-9A-F]+)> Tj", stream(objects[int(content)])):
            font = fonts[name] if name else font
            text += "".join(font.get(int(codes[at : at + 4], 16), "") for at in range(0, len(codes), 4))
        texts.append(text)
    return texts


def stream(found: bytes) -> bytes:
    return zlib.decompressobj().decompress(found.partition(b"stream\n")[2])


def letters(objects: dict[int, bytes], font: int) -> dict[int, str]:
    """Code of a glyph -> its letter, by the table of a font."""
    (table,) = re.findall(rb"/ToUnicode (\d+) 0 R", objects[font])
    found: dict[int, str] = {}
    for block in re.findall(rb"beginbf\w+\n(.*?)endbf", stream(objects[int(table)]), re.DOTALL):
        for line in block.splitlines():
            first, *last, letter = (int(code, 16) for code in re.findall(rb"<([0-9A-F]{4})>", line))
            found |= {code: chr(letter + code - first) for code in range(first, (last or [first])[0] + 1)}
    return found
