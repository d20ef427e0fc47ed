"""The HTML report in headless Chromium, from a file and offline: errors, requests, cursor, keys, print, no WebGL."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest
from support import preset_run
from support.synthetic import opened

from msfp_gen.report import write_report
from msfp_gen.results.result import load_result

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
DRIVER = shutil.which("chromedriver")
pytestmark = pytest.mark.skipif(
    not (CHROMIUM and DRIVER),
    reason="no Chromium with its driver: install chromium and chromium-driver to test the page in a browser",
)
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--window-size=1300,1000",
)
WATCH = """
window.texts = [];
new MutationObserver(() => texts.push(arguments[0].textContent)).observe(arguments[0], { childList: true });
"""
# What a browser's own start page asks for is none of the report's business.
OWN = ("chrome:", "chrome-extension:", "devtools:")


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    return preset_run("fenz-test5").to_netcdf(tmp_path_factory.mktemp("page") / "out.nc")


@pytest.fixture(scope="module")
def page(saved):
    return write_report(load_result(saved), saved.with_suffix(".html"))


@pytest.fixture(scope="module")
def start(tmp_path_factory):
    """Start a browser of its own, without any data of the user's."""
    from selenium import webdriver
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service

    started = []

    def begin(*extra):
        options = Options()
        options.binary_location = CHROMIUM
        for flag in (*FLAGS, *extra, f"--user-data-dir={tmp_path_factory.mktemp('profile')}"):
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        started.append(webdriver.Chrome(options=options, service=Service(DRIVER)))
        started[-1].get("about:blank")
        started[-1].get_log("performance")
        return started[-1]

    yield begin
    for browser in started:
        browser.quit()


@pytest.fixture(scope="module")
def browser(start, page):
    opened = start()
    show(opened, page)
    return opened


def show(browser, page):
    """Open the page and wait until its scripts have ended: the driver may return before, on a busy machine."""
    from selenium.webdriver.support.ui import WebDriverWait

    browser.get(page.as_uri())
    WebDriverWait(browser, 60).until(lambda opened: js(opened, "return document.documentElement.dataset.ready"))


def js(browser, code, *arguments):
    return browser.execute_script(code, *arguments)


def move(browser, frame):
    """Drag the slider, as a person does."""
    js(
        browser,
        "const f = document.getElementById('frame'); f.value = arguments[0];f.dispatchEvent(new Event('input'));",
        int(frame),
    )


def picture(browser):
    """The pixels of the 3D view, as text."""
    return js(browser, "return document.querySelector('#scene canvas').toDataURL()")


def complaints(browser):
    """Of the console, but for what a software renderer says about its speed."""
    return [entry for entry in browser.get_log("browser") if entry["source"] != "rendering"]


def test_it_loads_offline_without_a_word_in_the_console(browser, page):
    assert complaints(browser) == []
    sent = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    urls = [m["params"]["request"]["url"] for m in sent if m["method"] == "Network.requestWillBeSent"]
    asked = {url for url in urls if not url.startswith(("data:", "blob:", *OWN))}
    assert asked == {page.as_uri()}


def test_it_opens_at_the_peak_and_plays_from_the_start(start, page, saved):
    browser = start()
    show(browser, page)
    u = load_result(saved).history.displacement[:, :2]
    shown = js(browser, "return [...at('displacement', current)].slice(0, 2)")
    assert np.hypot(*shown) == pytest.approx(np.hypot(*u.T).max(), rel=2e-3)
    assert js(browser, "return current") == js(browser, "return report.peak") > 0
    browser.find_element("id", "play").click()
    assert js(browser, "return at('time', current)") < 5


@pytest.mark.parametrize("still", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_the_bearing_stays_inside_the_frame(browser, still):
    """At both ends of the motion and from every side, no drawn pixel of a body touches the edge of the view."""
    last = int(browser.find_element("id", "frame").get_attribute("max"))
    js(browser, "const e = document.getElementById('still'); if (e.checked !== arguments[0]) e.click();", still)
    if js(browser, "return document.getElementById('forces').checked"):
        browser.find_element("id", "forces").click()
    for view in ("oblique", "side", "above"):
        browser.find_element("css selector", f"[data-view={view}]").click()
        for frame in (js(browser, "return report.peak"), last // 2):
            move(browser, frame)
            assert js(browser, EDGE) == 0, (view, frame)
    browser.find_element("id", "forces").click()
    js(browser, "const e = document.getElementById('still'); if (!e.checked) e.click();")
    browser.find_element("css selector", "[data-view=oblique]").click()


# How many pixels on the border of the view are opaque: bodies are, the grid on the floor is not.
EDGE = """
const canvas = document.querySelector("#scene canvas");
const copy = Object.assign(document.createElement("canvas"), { width: canvas.width, height: canvas.height });
const pen = copy.getContext("2d");
pen.drawImage(canvas, 0, 0);
const { width, height } = copy;
const opaque = (...box) => pen.getImageData(...box).data.filter((value, k) => k % 4 === 3 && value === 255).length;
const borders = [[0, 0, width, 1], [0, height - 1, width, 1], [0, 0, 1, height], [width - 1, 0, 1, height]];
return borders.reduce((sum, box) => sum + opaque(...box), 0);
"""


def test_the_slider_moves_every_view(browser):
    last = int(browser.find_element("id", "frame").get_attribute("max"))
    seen = []
    for frame in (0, last // 5, last // 3):
        move(browser, frame)
        seen.append(
            (
                picture(browser),
                *(
                    js(browser, "return document.querySelector(arguments[0]).innerHTML", where)
                    for where in ("#section svg g", "#bearing svg g", "#readout-surfaces", "#now-force")
                ),
                js(
                    browser,
                    "return [...document.querySelectorAll('#charts .dot')].map(d => d.getAttribute('cx')).join()",
                ),
            )
        )
    assert all(len(set(view)) == 3 for view in zip(*seen, strict=True))


def test_the_scene_is_drawn_and_obeys_its_switches(browser):
    move(browser, 40)
    colours = js(
        browser,
        """
        const canvas = document.querySelector('#scene canvas');
        const copy = Object.assign(document.createElement('canvas'), { width: canvas.width, height: canvas.height });
        const pen = copy.getContext('2d');
        pen.drawImage(canvas, 0, 0);
        const data = pen.getImageData(0, 0, copy.width, copy.height).data;
        let solid = 0;
        for (let i = 3; i < data.length; i += 4) solid += data[i] > 200;
        return solid / (data.length / 4);""",
    )
    assert 0.05 < colours < 0.8, "the bearing fills part of the view"
    pictures = [picture(browser)]
    for switch in ("open", "forces"):
        browser.find_element("id", switch).click()
        pictures.append(picture(browser))
    browser.find_element("css selector", "[data-view=above]").click()
    pictures.append(picture(browser))
    assert len(set(pictures)) == 4
    for switch in ("open", "forces"):
        browser.find_element("id", switch).click()


def test_numbers_under_the_cursor_are_those_of_the_file(browser, saved):
    data = opened(saved)
    last = int(browser.find_element("id", "frame").get_attribute("max"))
    for frame in (last // 4, last // 2):
        move(browser, frame)
        t = js(browser, "return at('time', current)")
        row = int(np.abs(data["time"].values - t).argmin())
        between = abs(data["time"].values[row] - t) > 1e-4
        at = data.interp(time=t) if between else data.isel(time=row)
        rows = [r.text.split() for r in browser.find_elements("css selector", "#readout-surfaces tr")]
        assert [float(cells[-4]) for cells in rows] == pytest.approx(at["sliding"].values * 1e3, abs=0.006)
        assert [float(cells[-2]) for cells in rows] == pytest.approx(at["normal_force"].values * 1e-3, abs=0.006)
        force = browser.find_element("id", "now-force").text.replace("\u2212", "-").removesuffix(" kN").split(", ")
        assert [float(x) for x in force] == pytest.approx(at["top_force"].values * 1e-3, abs=0.006)


@pytest.mark.slow
def test_keys_move_the_cursor_and_say_the_time(browser):
    from selenium.webdriver.common.keys import Keys

    slider = browser.find_element("id", "frame")
    move(browser, 10)
    slider.send_keys(Keys.ARROW_RIGHT)
    assert (slider.get_attribute("value"), js(browser, "return current")) == ("11", 11)
    assert slider.get_attribute("aria-valuetext").endswith(" seconds") and slider.accessible_name == "Time in the run"
    slider.send_keys(Keys.END)
    assert js(browser, "return current === frameCount - 1")


@pytest.mark.slow
def test_a_click_on_a_chart_goes_to_that_time(browser):
    from selenium.webdriver.common.action_chains import ActionChains

    charts = browser.find_elements("css selector", "#charts svg")
    timed = next(c for c in charts if c.get_attribute("aria-label") == "Displacement")
    js(browser, "arguments[0].scrollIntoView({ block: 'center' })", timed)
    move(browser, 0)
    ActionChains(browser).move_to_element(timed).click().perform()
    share = js(browser, "return at('time', current) / at('time', frameCount - 1)")
    assert 0.4 < share < 0.5  # the middle of the picture, whose margin on the left is wider


@pytest.mark.slow
def test_play_runs_to_the_end_and_stops(browser):
    from selenium.webdriver.support.ui import Select, WebDriverWait

    js(browser, "show(frameCount - 12)")
    Select(browser.find_element("id", "speed")).select_by_value("10")
    button = browser.find_element("id", "play")
    js(browser, "arguments[0].scrollIntoView({ block: 'center' })", button)
    js(browser, WATCH, button)  # on a busy machine it may have ended before its text can be asked for
    button.click()
    WebDriverWait(browser, 20).until(lambda b: js(b, "return current === frameCount - 1"))
    assert js(browser, "return texts") == ["Pause", "Play"] and complaints(browser) == []


@pytest.mark.slow
def test_it_prints(browser):
    import base64

    pdf = base64.b64decode(browser.print_page())
    assert pdf.startswith(b"%PDF") and len(pdf) > 100_000


@pytest.mark.slow
def test_without_webgl_it_says_so_and_draws_from_the_side(start, page):
    plain = start("--disable-3d-apis")
    show(plain, page)
    assert "no WebGL" in plain.find_element("id", "scene").text
    before = js(plain, "return document.querySelector('#section svg g').innerHTML")
    move(plain, 60)
    assert js(plain, "return document.querySelector('#section svg g').innerHTML") != before
    assert not plain.find_element("id", "scene-settings").is_displayed()
