"""What `print` and a notebook show of a scene, a run and its characterisation."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from support import preset_run

import msfp_gen
from msfp_gen import Load, Result, load_scene, simulate
from msfp_gen.figures import FIGURES, animate, using_sign
from msfp_gen.report import write_report
from msfp_gen.results.note import Note


def test_a_result_prints_its_main_values() -> None:
    result = preset_run("fenz-test2")
    lines = str(result).splitlines()
    assert lines[0] == "Result of fenz-test2" and max(map(len, lines)) < 120
    values = {line[2:20].strip(): line[20:] for line in lines[1:]}
    assert values["peak displacement"].startswith(f"{1e3 * result.summary['peak_displacement']['radial']:.4g} mm")
    at = result.history.time[np.hypot(*result.history.top_force[:, :2].T).argmax()]
    force = f"{1e-3 * result.summary['peak_force']['radial']:.4g} kN at {at:.4g} s, along E1"
    assert values["peak force"].startswith(force)
    assert f"{result.counters.steps} steps" in values["time"] and values["status"] == "ok"
    assert [float(x) for x in values["peak sliding"].partition(" mm")[0].split(",")] == pytest.approx(
        1e3 * result.history.sliding.max(axis=0), rel=1e-3
    )


def test_many_notes_and_a_failure_stay_within_ten_lines() -> None:
    notes = tuple(Note(float(k), "heat", 1, 2.0, "friction may heat surface 1\nby 2 K") for k in range(9))
    result = replace(preset_run("fenz-test2"), notes=notes, status="newton", message="stopped at t = 3 s: jammed")
    text = str(result)
    assert len(text.splitlines()) <= 10 and "6 more in .notes" in text and "newton: stopped at t = 3 s" in text


def test_a_decisive_note_is_never_among_those_that_are_counted() -> None:
    minor = [Note(float(k), "ringing", 1, 2.0, "rings") for k in range(3)]
    values = [Note(0.0, "value", k, 1.0, f"value {k} is hardly meant") for k in range(4)]
    uplift = Note(9.0, "uplift", 1, 0.0, "the bearing may lift off")
    added = Note(1.0, "uplift", 1, 0.0, "opened", action="uplift = True")
    lines, others = replace(preset_run("fenz-test2"), notes=(*minor, *values, added, uplift)).first_notes
    assert lines == [*(note.line for note in values), uplift.line] and others == 4


def test_a_notebook_shows_a_table_and_a_loop() -> None:
    result = replace(preset_run("fenz-test2"), message="<b>&")
    html = result._repr_html_()
    assert "<table>" in html and "&lt;b&gt;&amp;" in html and len(html) < 20_000
    points = np.array([pair.split(",") for pair in re.findall(r'points="([^"]+)"', html)[0].split()], dtype=float)
    assert 200 < len(points) <= 600
    assert points.min() == pytest.approx(8.0) and points[:, 0].max() == pytest.approx(312.0)
    furthest = points[:, 0].argmax()
    assert points[furthest, 1] < 100  # the loop rises to the right, and y is downwards


def test_a_scene_prints_its_parts() -> None:
    scene = replace(load_scene("fenz-test2"), load=Load.constant((0.0, 0.0, -1e3)))
    lines = str(scene).splitlines()
    assert lines[0] == "Scene fenz-test2" and lines[-1].split() == ["also", "load"]
    for words in ("(n, m, p) = 5_2_2", "R = [0.473, 0.076", "axial_load=112000.0", "sliders = inertial", "rtol 0.0001"):
        assert words in "\n".join(lines)


def test_a_building_prints_its_parts() -> None:
    scene = load_scene("hospital-clc")
    lines = repr(scene).splitlines()
    assert len(lines) == 5 and lines[0] == "BuildingScene hospital-clc" and max(map(len, lines)) < 100
    assert "15.09 MN" in lines[1] and "12, (n, m, p) = 5_2_2" in lines[2] and "ridgecrest-2019-ci-clc" in lines[3]


def test_a_superstructure_prints_its_sizes_and_no_matrices() -> None:
    lines = repr(load_scene("hospital-clc").building).splitlines()
    assert lines[0] == "Building" and len(lines) == 5 and max(map(len, lines)) < 100
    assert lines[1].split() == ["mass", "1.54e+06", "kg"] and "floor 3" in lines[2]
    assert [float(word) for word in re.findall(r"\d[\d.]*", lines[4])][:2] == pytest.approx(
        [2.0, 2.2], abs=0.05
    )  # [Hz]


@pytest.mark.parametrize("name", ["fenz-test2", "hospital-clc"])
def test_a_notebook_shows_scenes_bearings_and_buildings_in_ten_rows(name: str) -> None:
    scene = replace(load_scene(name), name="<b>")
    parts = (scene.bearings[0].bearing, scene.building) if name == "hospital-clc" else (scene.bearing,)
    for shown in (scene, *parts):
        html = shown._repr_html_()
        labels = re.findall(r"<th>(.*?)</th>", html)
        assert 4 <= len(labels) <= 9 and len(html) < 2000
        assert [each.split()[0] for each in labels] == [line.split()[0] for line in repr(shown).splitlines()[1:]]
    assert "Scene &lt;b&gt;</b>" in scene._repr_html_()


def test_the_names_of_the_package_are_the_public_ones() -> None:
    assert dir(msfp_gen) == sorted(msfp_gen.__all__) and msfp_gen.BuildingResult.__name__ == "BuildingResult"


def test_a_characterisation_prints_its_main_values() -> None:
    found = preset_run("fenz-test2").characterise()
    lines = str(found).splitlines()
    assert len(lines) <= 10 and "2 closed cycles" in lines[1]
    assert f"{1e-6 * (found.secant_stiffness or 0):.4g} kN/mm" in str(found)


def test_names_that_users_look_for_are_at_the_top() -> None:
    for name in ("Result", "InitialState", "changed_scene", "bound", "characterise"):
        assert name in msfp_gen.__all__ and name in dir(msfp_gen) and callable(getattr(msfp_gen, name))
    scene = msfp_gen.changed_scene("fenz-test2", {"bearing.friction": [0.05, 0.02, 0.02, 0.1], "duration": 1.0})
    result = simulate(scene)
    assert isinstance(result, Result) and scene.bearing.surfaces[0].friction == 0.05


def test_every_figure_of_a_run_and_its_report_are_at_the_top() -> None:
    """By the tables of figures that the command line reads."""
    drawn = {*FIGURES.values(), *load_scene("hospital-clc").figures.values(), animate, using_sign, write_report}
    assert {getattr(msfp_gen, each.__name__) for each in drawn} == drawn
    assert drawn >= {getattr(msfp_gen, name) for name in ("plot_result", "plot_section", "plot_building")}


def test_a_bearing_prints_its_values() -> None:
    lines = str(load_scene("fenz-test2").bearing).splitlines()
    assert lines[0] == "Bearing 5_2_2" and max(map(len, lines)) < 80
    assert lines[3] == "  mu       0.03, 0.017, 0.017, 0.107"


def test_what_is_no_result_is_named_in_one_line() -> None:
    scene = load_scene("fenz-test2")
    with pytest.raises(msfp_gen.InputError, match=r"^result: this is a Scene; give the result of simulate\(scene\)$"):
        msfp_gen.characterise(scene)  # type: ignore[arg-type]
    with pytest.raises(msfp_gen.InputError, match=r"^scene.motion = Scene fenz-test2 bearing .*give a Motion$"):
        replace(scene, motion=scene)  # type: ignore[arg-type]
