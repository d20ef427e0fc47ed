"""The explorer in headless Chromium, from a file and offline: numbers equal to Python's, nothing loaded."""

from __future__ import annotations

import base64
import importlib.util
import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from msfp_gen import build_model, changed_scene, simulate
from msfp_gen.report.explore import (
    EXPLORED,
    Problem,
    explored_scene,
    fixed_scene,
    problem_of,
    write_explorer,
)
from msfp_gen.results.loops import REVERSAL, closed_cycles, effective_properties, turning_points
from msfp_gen.simulation.start import first_arguments
from tests.support.explorer_page import CHROMIUM, DRIVER, SLIDE, act, choose_preset, explorer_in_browser

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="no Chromium with its driver"),
    pytest.mark.skipif(
        importlib.util.find_spec("ziglang") is None, reason="the extra 'compiler' (ziglang) is not installed"
    ),
]
READ = """
const { problem, numbers, found } = state.last;
return { name: problem.name, status: found.status, force: numbers.peakForce, displacement: numbers.peakDisplacement,
  sliding: numbers.sliding, cycle: numbers.cycle, path: numbers.path, loop: numbers.force,
  time: numbers.u.map((_, row) => numbers.at.read("time", row)[0]), times: state.times };
"""
# The numbers that the worker gives to the compiled run, and the rows that come back.
EXCHANGED = """
const source = find("worker").textContent;
const solver = source.slice(0, source.indexOf("onmessage ="));
const { decoded, inputOf } = new Function(solver + "return { decoded, inputOf };")();
const packed = (values) => {
  let text = "";
  const bytes = new Uint8Array(values.buffer, values.byteOffset, values.byteLength);
  for (const byte of bytes) text += String.fromCharCode(byte);
  return btoa(text);
};
const { problem, settings, found } = state.last;
return [packed(inputOf(decoded(problem), settings)), packed(found.rows)];
"""


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    return write_explorer(tmp_path_factory.mktemp("explorer") / "page.html")


@pytest.fixture(scope="module")
def browser(page, tmp_path_factory):
    with explorer_in_browser(page, tmp_path_factory.mktemp("profile")) as opened:
        yield opened


def choose(browser, name):
    choose_preset(browser, name)
    return browser.execute_script(READ)


def expected(scene):
    """The numbers of the page, from a run in Python."""
    result = simulate(scene)
    history = result.history
    u, force = history.displacement[:, 0], history.top_force[:, 0]
    cycles = list(closed_cycles(u, turning_points(u, REVERSAL * np.ptp(u))))
    start, middle, end = cycles[-1] if cycles else (0, 0, 0)
    loop = effective_properties(u[start : end + 1], force[start : end + 1], middle - start) if cycles else None
    return result, loop


def check(found, scene, within=1e-9):
    """Compare the numbers of a page with a run in Python."""
    result, loop = expected(scene)
    summary = result.summary
    assert found["status"] == result.status
    assert found["force"][3] == pytest.approx(summary["peak_force"]["radial"], rel=within)
    assert found["displacement"][3] == pytest.approx(summary["peak_displacement"]["radial"], rel=within)
    loop = None if scene.motion.sampled else loop
    assert (found["cycle"] is None) == (loop is None)
    if loop is not None and within <= 1e-9:
        assert found["cycle"]["stiffness"] == pytest.approx(loop.effective_stiffness, rel=within)
        assert found["cycle"]["energy"] == pytest.approx(loop.energy_dissipated, rel=within)
        assert found["cycle"]["damping"] == pytest.approx(loop.effective_damping, rel=within)


def exchanged(browser):
    """The input of the last run of the page, and its rows."""
    return [np.frombuffer(base64.b64decode(text), dtype="<f8") for text in browser.execute_script(EXCHANGED)]


def run_in_python(numbers, problem: Problem) -> Any:
    """The compiled run of Python with the input of a page, in the order of explorer.c."""
    given, _ = first_arguments(problem.scene, problem.spec)
    extension = build_model(problem.spec.layout, problem.spec.effects).extension
    at = 0

    def take(count, shape=(-1,)):
        nonlocal at
        at += count
        return np.ascontiguousarray(numbers[at - count : at]).reshape(shape)

    gravity, method, *options = take(12)
    pieces, loads, jumps, stops, spans = map(int, take(5))
    tables = [take(np.size(table), np.shape(table)) for table in given.stack[1:4]]
    state = [take(np.size(value), np.shape(value)) for value in given.arrays[5:8]]
    motion = take(pieces + 1), take(36 * pieces, (-1, 6, 6))
    load = take(loads + 1), take(36 * loads, (-1, 6, 6))
    names = ("rtol", "atol_angle", "first_step", "max_steps", "duration", "output_step", "stop_displacement",
             "stop_all_rims", "sampled", "quasistatic")  # fmt: skip
    named = dict(zip(names, options, strict=True))
    named |= {name: bool(named[name]) for name in names[-3:]}
    times = {"jumps": take(jumps), "stops": take(stops), "span_ends": take(spans), "span_steps": take(spans)}
    assert at == len(numbers) and int(method) == extension.METHODS[given.options["method"]]
    run = extension.Run(
        extension.Stack(gravity, *tables), *motion, *load, times.pop("jumps"), *state,
        method=given.options["method"], **named, **times,
    )  # fmt: skip
    while run.advance():
        pass
    return run


def check_rows(browser, name):
    """The rows of the page are those of Python with the same input, bit by bit. Returns the input."""
    numbers, rows = exchanged(browser)
    np.testing.assert_array_equal(
        rows, run_in_python(numbers, problem_of(explored_scene(name), name)).rows.ravel(), strict=True
    )
    return numbers


def test_it_loads_offline_without_a_word_in_the_console(browser, page):
    assert [entry for entry in browser.get_log("browser") if entry["source"] != "rendering"] == []
    sent = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    urls = [m["params"]["request"]["url"] for m in sent if m["method"] == "Network.requestWillBeSent"]
    asked = {url for url in urls if not url.startswith(("data:", "blob:", "chrome:", "chrome-extension:", "devtools:"))}
    assert asked == {page.as_uri()}


@pytest.mark.parametrize("name", EXPLORED)
def test_numbers_are_those_of_python(browser, name):
    found = choose(browser, name)
    scene = fixed_scene(explored_scene(name))
    assert found["name"] == scene.name
    check_rows(browser, name)
    check(found, scene)


@pytest.mark.parametrize("name", EXPLORED)
def test_rows_are_those_of_python_wherever_the_sliders_stand(browser, name):
    """Bit by bit, at random places of all sliders together."""
    choose(browser, name)
    sliders = browser.execute_script(
        "const inputs = [...find('controls').querySelectorAll('input[type=range]')];"
        "return inputs.map((input) => [input.dataset.name, Number(input.min), Number(input.max)])"
    )
    assert len(sliders) >= 6
    rng = np.random.default_rng(len(name))
    seen = set()
    for _ in range(3):
        for slider, low, high in sliders:
            act(browser, SLIDE, slider, low + (high - low) * rng.uniform(0.2, 0.7))
        check_rows(browser, name)
        seen.add(browser.execute_script("return state.last.found.status"))
    assert "ok" in seen or "stopped" in seen


def test_a_number_may_be_typed_beside_its_slider(browser):
    """In the unit of the page; beyond the slider it becomes its end."""
    choose(browser, "becker-circle-88")
    typed = SLIDE.replace("data-name", "data-number").replace('"input"', '"change"')
    read = "const of = (key) => document.querySelector(`[data-${key}='direction']`); return [of('name'), of('number')]"
    for given, shown in (("-30", -30.0), ("400", 90.0), ("", 90.0)):
        act(browser, typed, "direction", given)
        slider, number = browser.execute_script(f"{read}.map((input) => Number(input.value))")
        assert slider == number == shown
    act(browser, typed, "friction of surface 1", "7.5")
    assert browser.execute_script("return state.settings.friction[0]") == 0.075


@pytest.mark.parametrize("name", EXPLORED)
def test_sliding_regimes_are_those_of_motions_in_one_direction(browser, name):
    """A record and an orbit have no sequence of them."""
    choose(browser, name)
    hidden = browser.execute_script("return find('regime-table').hidden")
    assert hidden == name.startswith(("ridgecrest", "becker"))
    assert hidden or browser.execute_script("return find('regimes').children.length") > 0


def test_a_run_reports_its_progress(browser):
    """The worker tells shares of the time that rise; here after every chunk of steps."""
    shares = browser.execute_script(
        "const source = find('worker').textContent;"
        "const { decoded, solve } = new Function(source.slice(0, source.indexOf('onmessage =')) "
        "+ 'return { decoded, solve };')();"
        "const index = arguments[0], problem = problemAt(index), bytes = explorer.modules[problem.module];"
        "const code = Uint8Array.from(atob(bytes), (c) => c.charCodeAt(0));"
        "const made = new WebAssembly.Instance(new WebAssembly.Module(code), {});"
        "made.exports._initialize();"
        "const shares = [];"
        "solve(made, decoded(problem), nominalSettings(problem), (share) => shares.push(share));"
        "return shares",
        EXPLORED.index("ridgecrest-clc"),
    )
    assert len(shares) > 2 and shares == sorted(shares) and shares[0] > 0 and shares[-1] < 1


@pytest.mark.parametrize("width", [400, 1900])
def test_the_page_uses_its_window_and_no_more(browser, width):
    browser.set_window_size(width, 1000)
    try:
        choose(browser, "becker-eight-88")
        inner, wide = browser.execute_script("return [window.innerWidth, document.documentElement.scrollWidth]")
        assert wide <= inner
        used = browser.execute_script("return document.querySelector('main').getBoundingClientRect().width")
        assert used > 0.85 * inner
    finally:
        browser.set_window_size(1400, 1000)


def test_the_loop_stays_in_view_beside_the_sliders_at_700_pixels(browser):
    """With the last slider in the middle of the window, the whole loop is inside it, and nothing covers the slider."""
    browser.set_window_size(700, 900)
    try:
        choose(browser, "fenz-test2")
        loop, slider, height, top = browser.execute_script(
            "const all = document.querySelectorAll('.control'); const last = all[all.length - 1];"
            "last.scrollIntoView({ block: 'center' });"
            "const box = (one) => { const b = one.getBoundingClientRect(); return [b.top, b.bottom]; };"
            "const middle = last.getBoundingClientRect();"
            "const at = document.elementFromPoint(middle.left + 20, (middle.top + middle.bottom) / 2);"
            "return [box(find('loop')), box(last), window.innerHeight, last.contains(at)]"
        )
        assert 0 <= loop[0] < loop[1] <= height and loop[1] - loop[0] > 150
        assert loop[1] <= slider[0] < slider[1] <= height and top
    finally:
        browser.set_window_size(1400, 1000)


def test_the_start_reports_its_progress(browser):
    """The worker tells each model that it has prepared; the page shows it."""
    told = browser.execute_async_script(
        "const done = arguments[arguments.length - 1], told = [];"
        "const source = new Blob([find('worker').textContent], { type: 'text/javascript' });"
        "const other = new Worker(URL.createObjectURL(source));"
        "other.onmessage = ({ data }) => { told.push(data); if (data.ready) { other.terminate(); done(told); } };"
        "const bytes = explorer.modules.map((text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)));"
        "other.postMessage({ problems: explorer.problems, modules: bytes });"
    )
    count = browser.execute_script("return explorer.modules.length")
    assert told == [*({"prepared": number} for number in range(1, count + 1)), {"ready": True}]
    shown = browser.execute_script(
        "answered({ data: { prepared: 1 } }); return [find('status').textContent, find('progress').value]"
    )
    assert shown == [f"starting: model 1 of {count} is ready", pytest.approx(1 / count)]


def test_friction_at_the_pivot_is_shown_and_stays_there(browser):
    """Sliders of a scene that gives it there: nominal numbers, after a change of friction, and of a radius."""
    nominal = explored_scene("fenz-test2").bearing
    sheet = nominal.friction_at_pivot
    given = nominal.replace(friction=list(sheet), friction_at="pivot")
    pivot = problem_of(replace(explored_scene("fenz-test2"), bearing=given), "a title").data["pivot"]
    assert problem_of(explored_scene("fenz-test2"), "a title").data["pivot"] is None
    index = EXPLORED.index("fenz-test2")
    browser.execute_script("explorer.problems[arguments[0]].pivot = arguments[1]", index, pivot)
    try:
        choose(browser, "fenz-test2")
        read = "return [...document.querySelectorAll('[data-number^=friction]')].map((one) => Number(one.value))"
        assert browser.execute_script(read) == pytest.approx([100 * value for value in sheet], abs=0.006)
        settings = "return state.settings.friction"
        assert browser.execute_script(settings) == [surface.friction for surface in nominal.surfaces]
        act(browser, SLIDE, "friction 1 at the pivot", 1.2 * sheet[0])
        act(browser, SLIDE, "radius of surface 4", 1.1 * nominal.surfaces[3].radius)
        radii = [surface.radius for surface in nominal.surfaces[:3]] + [1.1 * nominal.surfaces[3].radius]
        wanted = nominal.replace(radius=radii).replace(friction=[1.2 * sheet[0], *sheet[1:]], friction_at="pivot")
        assert browser.execute_script(settings) == pytest.approx([s.friction for s in wanted.surfaces], rel=1e-9)
        assert browser.execute_script(read) == pytest.approx([120 * sheet[0], *(100 * v for v in sheet[1:])], abs=0.006)
    finally:
        browser.execute_script("explorer.problems[arguments[0]].pivot = null", index)


def slide(browser, name, **settings):
    """Move sliders of a preset, which are named with underscores here, and read the page."""
    choose(browser, name)
    for slider, value in settings.items():
        act(browser, SLIDE, slider.replace("_", " "), value)
    return browser.execute_script(READ)


def test_sliders_of_a_push_change_what_they_say(browser):
    scene = explored_scene("double-push")
    radius, friction = ([getattr(s, name) for s in scene.bearing.surfaces] for name in ("radius", "friction"))
    found = slide(
        browser, "double-push", friction_of_surface_1=0.07, radius_of_surface_2=1.1 * radius[1], axial_load=1.5,
        amplitude=1.1, speed=2.0,
    )  # fmt: skip
    changed = replace(
        scene,
        bearing=scene.bearing.replace(friction=[0.07, friction[1]], radius=[radius[0], 1.1 * radius[1]]),
        motion=changed_scene("double-push", {"motion.acceleration": 0.0088, "motion.duration": 11.0}).motion,
        motion_table=None,
        output_step=0.025,
        top=replace(scene.top, axial_load=1.5 * scene.top.axial_load),
    )
    check(found, fixed_scene(changed))


def test_sliders_of_a_cyclic_test_change_what_they_say(browser):
    """The motion of the page differs in the last digit, and a step that is refused there only changes what follows."""
    scene = explored_scene("fenz-test2")
    found = slide(browser, "fenz-test2", amplitude=1.2, frequency=2.0)
    motion = changed_scene("fenz-test2", {"motion.amplitude": 0.03, "motion.frequency": 0.08}).motion
    check(found, fixed_scene(replace(scene, motion=motion, motion_table=None)), within=0.1 * scene.solver.rtol)


def test_direction_turns_the_motion(browser):
    plain = choose(browser, "becker-circle-88")
    act(browser, SLIDE, "direction", 30.0)
    turned = browser.execute_script(READ)
    assert turned["force"][3] == pytest.approx(plain["force"][3], rel=0.02) and turned["force"][0] != plain["force"][0]


def test_everything_is_drawn(browser):
    choose(browser, "fenz-test2")
    for place in ("loop", "section"):
        assert browser.execute_script("return document.querySelectorAll(`#${arguments[0]} svg *`).length", place) > 10
    shown = browser.find_element("id", "numbers").text
    assert "effective damping" in shown and "NaN" not in browser.find_element("tag name", "body").text
    browser.execute_script("const r = find('row'); r.value = 0; r.dispatchEvent(new Event('input'));")
    assert "t = 0.000 s" in browser.find_element("id", "instant").text
