"""The HTML report without a browser: what it says, what it holds, and that it asks for no other file."""

from __future__ import annotations

import base64
import dataclasses
import json
import re
from html.parser import HTMLParser
from io import BytesIO
from itertools import pairwise

import numpy as np
import pytest
from support import ROOT, preset_run
from support.synthetic import loops, opened

from msfp_gen.cli import main
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.design.sheet import SheetReport
from msfp_gen.figures import plot_sheet
from msfp_gen.figures.style import COLOURS
from msfp_gen.motions.motion import Motion
from msfp_gen.report import TitleBlock, report_html, write_report
from msfp_gen.report.frames import (
    RESOLUTION,
    instants,
    main_direction,
    packed,
    picture,
    pieces,
    selected_rows,
    states,
    view,
)
from msfp_gen.report.page import BEARING, TERMS, provenance_table
from msfp_gen.results.geometry import poses
from msfp_gen.results.note import Note
from msfp_gen.results.result import load_result
from msfp_gen.scene.explain import explain
from msfp_gen.scene.file.loader import load_sheet


@pytest.fixture(scope="module", autouse=True)
def few_figures():
    """One picture a page: drawing them all takes seconds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("msfp_gen.report.page.BEARING", BEARING._replace(figures={"overview": "Loops and sliding"}))
        yield


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A real run with rims met, as a file."""
    return preset_run("fenz-test5").to_netcdf(tmp_path_factory.mktemp("report") / "out.nc")


@pytest.fixture(scope="module")
def page(saved):
    return report_html(load_result(saved))


class Parts(HTMLParser):
    """The script with data, and every attribute that could fetch something."""

    def __init__(self, text):
        super().__init__()
        self.links, self.data, self._open = [], "", None
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.links += [value for name, value in attrs if name in ("src", "href", "srcset", "action", "poster")]
        self._open = given.get("id") if tag == "script" else None

    def handle_data(self, text):
        if self._open == "report-data":
            self.data += text

    def handle_endtag(self, tag):
        self._open = None


def unpacked(array):
    return np.frombuffer(base64.b64decode(array["data"]), "<f4").reshape(array["shape"])


def test_numbers_are_those_of_the_data_file(saved, page):
    """Peaks are over all steps of the run, which the file keeps; they exceed those of its rows by very little."""
    data, summary = opened(saved), load_result(saved).summary
    u, force = data["displacement"].values, data["top_force"].values
    for value, peak in (
        (np.hypot(u[:, 0], u[:, 1]).max(), summary["peak_displacement"]["radial"]),
        (np.abs(force[:, 0]).max(), summary["peak_force"]["E1"]),
        (data["sliding"].values[:, 3].max(), summary["peak_sliding"][3]),
        (data["gap"].values[:, 0].min(), summary["minimum_gap"][0]),
        (data["normal_force"].values[:, 2].max(), summary["maximum_normal_force"][2]),
        (np.abs(data["energy_input"].values).max(), summary["energy"]["peak_input"]),
    ):
        assert peak == pytest.approx(value, rel=1e-5)
    peak, time = (of["peak_displacement"]["radial"] for of in (summary, summary["times"]))
    assert f">{1e3 * peak:.4g} mm at {time:.4g} s, along E1" in page
    assert f"<td>{1e3 * summary['peak_sliding'][3]:.2f}</td>" in page


def test_page_asks_for_no_other_file(page):
    links = Parts(page).links
    assert len(links) == 3 and all(link.startswith(("data:", "#")) for link in links)
    assert not re.search(r"@import|url\((?!#)", page.partition("</style>")[0])
    assert "default-src 'none'" in page and "<script src" not in page


def test_title_block_and_terms(saved, tmp_path):
    result = load_result(saved)
    path = tmp_path / "a.html"
    words = ["--project", "Block <B>", "--date", "2026-03-01", "--revision", "2", "--code", "ASCE 7-22"]
    assert main(["report", str(saved), "-o", str(path), *words]) == 0
    text = path.read_text(encoding="utf-8")
    shown = re.findall(r"<dt>([^<]+)</dt><dd>([^<]+)</dd>", text.partition("</header>")[0])
    assert shown == [
        ("project", "Block &lt;B&gt;"),
        ("device", "triple friction pendulum, 4 sliding surfaces"),
        ("date", "2026-03-01"),
        ("revision", "2"),
        ("code edition", "ASCE 7-22"),
    ]
    assert [name for name, _ in TitleBlock(device="TFP 7").rows(result)] == ["device"]
    assert all(f"<dt>{term}</dt>" in text for term, _ in TERMS)


def test_every_number_of_the_settings_has_its_unit():
    """But for counts, shares of a sum, and numbers inside a sentence."""
    result = preset_run("fenz-test5")
    plain = {"cycles", "fraction", "scale", "rtol"}
    for table in explain(result.scene):
        for row in table.rows:
            if not table.columns and len(row) == 2 and row[0] not in plain:
                assert not re.fullmatch(r"[-+\d.e, ]*\d", row[1]), row
    assert ("amplitude", "0.14 m") in {row[:2] for table in explain(result.scene) for row in table.rows}


def test_page_is_the_same_on_every_machine(page, saved):
    """No wall time, no build time, no folder; and the same file gives the same page."""
    result = load_result(saved)
    slower = dataclasses.replace(
        result,
        counters=dataclasses.replace(result.counters, wall_time=1e3),
        provenance=result.provenance | {"build_seconds": "99"},
    )
    assert report_html(slower) == page
    assert str(saved.parent) not in page and "wall time" not in page
    told = dict(provenance_table(result).rows)
    assert told["model"] == result.scene.spec.key and told["method"] == "implicit" and told["msfp gen"]


def test_every_note_is_in_the_page(page):
    assert "notes, the most important first" not in page
    notes = (Note(2.0, "inertia", 1, 0.1, "light & fast"), Note(3.0, "energy", 0, 0.2, "it leaks"))
    told = report_html(dataclasses.replace(preset_run("fenz-test2"), notes=notes))
    assert told.index("it leaks") < told.index("light &amp; fast") and "t = 3 s" in told


def test_frames_are_rows_of_the_run():
    result = preset_run("ridgecrest-clc")
    rows, history = selected_rows(result, 400), result.history
    assert 400 <= len(rows) <= 420 and np.all(np.diff(rows) > 0) and {0, len(history.time) - 1} <= set(rows)
    assert np.abs(history.displacement[rows]).max() == np.abs(history.displacement).max()
    assert history.sliding[rows].max(axis=0).tolist() == history.sliding.max(axis=0).tolist()
    assert np.diff(history.time[rows]).max() < 2 * history.time[-1] / 400


def test_events_and_few_rows_are_kept_and_filled():
    result = preset_run("fenz-test5")
    shown = instants(result, 100)
    first = {(e.surface, e.kind): e.time for e in reversed(result.events)}
    gap = np.abs(shown[:, None] - np.array(list(first.values()))).min(axis=0)
    assert gap.max() <= np.diff(result.history.time).max()
    assert len(shown) >= 600 and np.diff(shown).max() < 1.01 * shown[-1] / 599


def test_view_holds_the_stack_as_it_stands():
    result = preset_run("becker-eight-125")
    data = view(result, 200)
    frames = {name: unpacked(array) for name, array in data["frames"].items()}
    rows = np.searchsorted(result.history.time, np.float64(frames["time"][-1]) - 1e-3)
    assert rows == len(result.history.time) - 1
    x, y, z, w = np.moveaxis(frames["turn"][-1], -1, 0)
    axis = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=-1)
    where = poses(result)
    assert axis == pytest.approx(where.basis[-1, :, 2], abs=1e-6)
    assert frames["centre"][-1] == pytest.approx(where.centre[-1], abs=1e-6)
    distance = np.linalg.norm(frames["line"] - frames["centre"], axis=-1)
    assert np.all(distance <= 1.01 * frames["circle"]), "no rim is met: every line touches or crosses its circle"
    assert distance[:, 1].max() == pytest.approx(frames["circle"][0, 1], rel=1e-3)


def test_states_tell_sticking_sliding_and_rims():
    history = preset_run("fenz-test5").history
    found = states(history)
    assert set(np.unique(found)) == {0.0, 1.0, 2.0}
    assert np.array_equal(found == 2.0, history.gap <= 0)


def test_outlines_run_from_axis_to_axis_and_name_their_surfaces():
    bearing = preset_run("fenz-test5").scene.bearing
    for body in range(5):
        parts = pieces(bearing, body)
        ends = [(part["points"][0], part["points"][-1]) for part in parts]
        assert ends[0][0][0] == 0 == ends[-1][1][0]
        assert all(before[1] == after[0] for before, after in pairwise(ends))
        assert {part["surface"] for part in parts} - {0} == {s for s in (body, body + 1) if 1 <= s <= 4}


@pytest.mark.parametrize("angle", [0.0, 0.6, -1.1, np.pi / 2])
def test_main_direction(angle):
    t = np.linspace(0, 6, 200)[:, None]
    path = np.sin(t) * [np.cos(angle), np.sin(angle)] + 0.2 * np.cos(t) * [-np.sin(angle), np.cos(angle)]
    assert np.sin(main_direction(path) - angle) == pytest.approx(0, abs=0.02)  # a direction has no sense
    assert main_direction(np.zeros((1, 2))) == main_direction(np.zeros((5, 2))) == 0.0


def test_packed_arrays_read_back():
    values = np.linspace(-1, 1, 12).reshape(2, 3, 2)
    assert unpacked(packed(values)) == pytest.approx(values, abs=1e-7)


def test_data_cannot_end_its_script():
    result = preset_run("fenz-test5")
    name = "</script><script>alert(1)</script>"
    text = report_html(dataclasses.replace(result, scene=dataclasses.replace(result.scene, name=name)), 50)
    assert name not in text and "&lt;/script&gt;" in text
    assert json.loads(Parts(text).data)["states"][1] == "slides"


def test_a_picture_has_every_colour_of_its_figure_in_half_the_bytes():
    """The sheet of the hospital: each pixel as drawn, so that the surfaces keep the palette of all figures."""
    from matplotlib.colors import to_rgb
    from PIL import Image

    report, drawn = SheetReport(*load_sheet(ROOT / "examples/hospital-design/hospital.toml")), BytesIO()
    plot_sheet(report).savefig(drawn, format="png", dpi=RESOLUTION)
    shown = base64.b64decode(picture("sheet", plot_sheet(report))["webp"])
    with Image.open(drawn) as wanted, Image.open(BytesIO(shown)) as found:
        pixels, smaller = np.asarray(found.convert("RGB")), BytesIO()
        assert np.array_equal(pixels, np.asarray(wanted.convert("RGB")))
        wanted.convert("RGB").save(smaller, "png", optimize=True)
    assert len(shown) < 0.6 * len(smaller.getvalue())
    for colour in COLOURS[:4]:  # of the four surfaces
        assert (pixels == np.round(255 * np.array(to_rgb(colour)))).all(axis=-1).sum() > 50, colour


@pytest.mark.slow
def test_size_of_a_long_record_with_all_figures_is_bounded(monkeypatch):
    monkeypatch.setattr("msfp_gen.report.page.BEARING", BEARING)
    text = report_html(preset_run("ridgecrest-clc"))
    assert text.count("data:image/webp") == len(BEARING.figures) == 5 and len(text.encode()) < 10e6


def test_a_bearing_that_rests_and_a_run_that_failed_have_a_report():
    result = loops()
    rows = result.history
    still = dataclasses.replace(rows, displacement=0 * rows.displacement, sliding=0 * rows.sliding)
    assert "Summary" in report_html(dataclasses.replace(result, history=still, events=()))
    failed = report_html(dataclasses.replace(result, status="newton", message="stopped at t = 3 s"))
    assert "The run failed (newton): stopped at t = 3 s" in failed and 'class="status failed"' in failed


@pytest.mark.parametrize("name", ["report.txt", "nowhere/report.html"])
def test_refused_path_writes_nothing(name, tmp_path):
    with pytest.raises(InputError, match="output"):
        write_report(loops(), tmp_path / name)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_motion_from_python_or_a_file_comes_back_without_its_file(tmp_path):
    """A result file needs no other: the record may be gone, and no folder of this machine is in it."""
    t = np.linspace(0, 2, 201)
    table = tmp_path / "shake.csv"
    table.write_text(
        "time [s], u1 [mm]\n"
        + "\n".join(f"{a:.4f}, {b:.8f}" for a, b in zip(t, 10 * np.sin(np.pi * t) ** 3, strict=True))
    )
    motion = Motion.from_csv(table)
    recipe = {"kind": "arrays", "file": str(table)}
    for given in (recipe, None):
        scene = dataclasses.replace(loops().scene, motion=motion, motion_table=given, duration=None)
        path = dataclasses.replace(loops(), scene=scene).to_netcdf(tmp_path / "run.nc")
        table.unlink(missing_ok=True)
        assert load_result(path).scene == scene
        assert str(tmp_path) not in opened(path).attrs["scene"]
    assert opened(path, "motion")["coefficients"].dims == ("piece", "channel", "power")


def test_command_writes_a_page_of_a_file(saved, tmp_path, capsys, monkeypatch, page):
    monkeypatch.chdir(tmp_path)
    assert main(["report", str(saved)]) == 0
    assert (tmp_path / "out.html").read_text(encoding="utf-8") == page
    assert "wrote out.html" in capsys.readouterr().err


def test_command_runs_a_scene_and_reports_one_that_failed(tmp_path, monkeypatch, capsys):
    def simulate(scene, *, progress=None):
        partial = dataclasses.replace(loops(), scene=scene, status="newton", message="stopped")
        raise RunError("stopped at t = 3 s", status="newton", result=partial)

    monkeypatch.setattr("msfp_gen.simulation.simulate.simulate", simulate)
    monkeypatch.setattr("msfp_gen.model.model.build_model", lambda *_, **__: None)
    assert main(["report", "fenz-test5", "-o", str(tmp_path / "a.html")]) == 1
    assert "the report of what was computed until then is in" in capsys.readouterr().err
    assert "The run failed (newton)" in (tmp_path / "a.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere.nc"], ["nowhere.nc"]),
        (["fenz-tset5"], ["fenz-tset5", "fenz-test5"]),
        (["fenz-test5", "-o", "a.pdf"], ["--output", "a.pdf", ".html"]),
        (["fenz-test5", "--frames", "1"], ["--frames = 1", "5000"]),
    ],
)
def test_bad_input_is_one_line(arguments, words, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["report", *arguments]) == 2
    err = capsys.readouterr().err
    assert err.startswith("error: ") and err.count("\n") == 1 and all(word in err for word in words)
    assert not list(tmp_path.iterdir())
