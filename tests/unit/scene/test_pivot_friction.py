"""Friction coefficients at the pivot, as data sheets give them, and values that are hardly meant."""

from __future__ import annotations

from dataclasses import replace

import pytest
from support import scene_of

from msfp_gen import Bearing, InputError, load_scene, presets, simulate
from msfp_gen.scene.explain import explain
from msfp_gen.scene.plausibility import doubtful_values

TFP = presets.bearing("fenz-tfp")
PUBLISHED = [0.03, 0.017, 0.017, 0.107]


def test_coefficients_at_the_pivot_are_those_of_the_formula() -> None:
    """Lever arms of Table A.1 by hand: R_eff = R - h, the pivot 23 mm above surface 2 and 38 mm above surface 1."""
    arms = {1: 0.473 - 0.038, 2: 0.076 - 0.023}
    inner = 0.017 * arms[2] / 0.076
    outer = [(mu * (arms[1] - arms[2]) + inner * 0.076) / 0.473 for mu in (0.03, 0.107)]
    converted = TFP.replace(friction=PUBLISHED, friction_at="pivot")
    expected = [outer[0], inner, inner, outer[1]]
    assert [s.friction for s in converted.surfaces] == pytest.approx(expected, rel=1e-12)


def test_a_loop_crosses_zero_at_the_published_force() -> None:
    """With coefficients at the pivot the last regimes slide at the published F/W: half the height of the loop."""
    scene = scene_of("fenz-test4", {"sliders": "massless", "dimension": "planar"}, output_step=0.02)
    published = [0.05, 0.02, 0.02, 0.05]
    arms = {"outer": 0.473 - 0.038, "inner": 0.076 - 0.023}
    ratio = (0.05 * (arms["outer"] - arms["inner"]) + 0.02 * arms["inner"]) / arms["outer"]
    zero = {}
    for word in ("pivot", "surface"):
        bearing = scene.bearing.replace(friction=published, friction_at=word)
        history = simulate(replace(scene, bearing=bearing)).history
        u, force = history.displacement[:, 0], history.top_force[:, 0]
        rows = (abs(u) < 2e-3) & (history.time > history.time[-1] / 2)
        zero[word] = abs(force[rows]).mean() / 112e3
    assert zero["pivot"] == pytest.approx(ratio, rel=0.02)
    assert zero["surface"] > 1.05 * zero["pivot"]


def test_scene_files_take_coefficients_at_the_pivot(tmp_path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(
        'bearing = { preset = "fenz-tfp", friction = [0.03, 0.017, 0.017, 0.107], friction_at = "pivot" }\n'
        '[motion]\nkind = "harmonic"\namplitude = 0.05\nfrequency = 0.1\n'
        '[top]\nkind = "rig"\naxial_load = 112e3\nstiffness = 1e8\n'
    )
    assert load_scene(path).bearing == TFP.replace(friction=PUBLISHED, friction_at="pivot")


def test_a_bearing_takes_coefficients_at_the_pivot() -> None:
    """As files and `replace` do; the bearing keeps those at the surfaces, and copies do not convert them again."""
    sheet = [replace(surface, friction=mu) for surface, mu in zip(TFP.surfaces, PUBLISHED, strict=True)]
    bearing = Bearing(TFP.layout, TFP.base_height, sheet, TFP.bodies, friction_at="pivot")
    want = TFP.replace(friction=PUBLISHED, friction_at="pivot")
    assert bearing.surfaces == want.surfaces == TFP.replace(surfaces=sheet, friction_at="pivot").surfaces
    assert replace(bearing, gravity=9.81).surfaces == bearing.replace(gravity=9.81).surfaces == want.surfaces
    with pytest.raises(InputError, match=r"bearing\.friction_at = 'top': give 'surface' or 'pivot'"):
        Bearing(TFP.layout, TFP.base_height, sheet, TFP.bodies, friction_at="top")
    single = presets.bearing("single-fp")
    with pytest.raises(
        InputError, match=r"bearing\.friction_at = 'pivot': layout .* give the coefficients at the surf"
    ):
        Bearing(single.layout, single.base_height, single.surfaces, single.bodies, friction_at="pivot")


@pytest.mark.parametrize("name", ["fenz-tfp", "double-fp", "quintuple-fp"])
def test_what_was_given_at_the_pivot_is_shown_again(name: str) -> None:
    """Also after factors of bounds, which multiply both."""
    bearing = presets.bearing(name)
    given = [0.05 + 0.01 * index for index in range(bearing.layout.surfaces)][::-1]
    converted = bearing.replace(friction=given, friction_at="pivot")
    assert converted.friction_at_pivot == pytest.approx(given, rel=1e-12)
    doubled = converted.replace(friction=[2 * surface.friction for surface in converted.surfaces])
    assert doubled.friction_at_pivot == pytest.approx([2 * mu for mu in given], rel=1e-12)


@pytest.mark.parametrize("name", ["single-fp", "single-articulated-fp", "double-articulated-fp"])
def test_bearings_without_such_a_pivot_have_no_such_coefficients(name: str) -> None:
    bearing = presets.bearing(name)
    expected = None if bearing.layout.m != bearing.layout.p else len(bearing.surfaces)
    assert (bearing.friction_at_pivot and len(bearing.friction_at_pivot)) == expected


def test_explain_which_the_report_shows_and_summary_have_both() -> None:
    scene = scene_of("fenz-test1")
    scene = replace(scene, bearing=scene.bearing.replace(friction=PUBLISHED, friction_at="pivot"))
    table, result = explain(scene)[0], simulate(scene)
    at_surface, at_pivot = (
        [row[table.columns.index(name)] for row in table.rows] for name in ("friction [-]", "at pivot [-]")
    )
    assert list(map(float, at_pivot)) == PUBLISHED
    assert list(map(float, at_surface)) == pytest.approx(result.summary["friction"], rel=1e-3)
    assert result.summary["friction_at_pivot"] == pytest.approx(PUBLISHED, rel=1e-12)


BAD = {
    "'surface' or 'pivot'": {"friction": 0.05, "friction_at": "rim"},
    "give friction with it": {"friction_at": "pivot"},
}


@pytest.mark.parametrize("remedy", BAD)
def test_bad_words_are_refused(remedy: str) -> None:
    with pytest.raises(InputError, match=remedy):
        TFP.replace(**BAD[remedy])


def test_a_pivot_that_is_no_slider_is_refused() -> None:
    with pytest.raises(InputError, match="give the coefficients at the surfaces"):
        presets.bearing("single-fp").replace(friction=0.05, friction_at="pivot")


@pytest.mark.parametrize(
    ("change", "slip"),
    [
        ({"friction": [3.0, 0.02, 0.02, 0.1]}, "not per cent"),
        ({"radius": [473.0, 0.076, 0.076, 0.473]}, "in metres"),
        ({"capacity": [0.3, 0.0215, 0.0215, 0.065]}, "tilts the slider"),
        ({"yield_displacement": [0.05, 1e-4, 1e-4, 1e-4]}, "0.1 to 1 mm"),
    ],
)
def test_values_that_are_hardly_meant_are_named(change: dict[str, list[float]], slip: str) -> None:
    bearing = TFP.replace(**change)
    ((surface, _, text),) = doubtful_values(bearing)
    assert surface == 1
    assert slip in text
    tables = explain(replace(load_scene("fenz-test1"), bearing=bearing))
    assert any(slip in " ".join(row) for table in tables for row in table.rows)


def test_a_doubtful_value_is_a_note_of_the_run() -> None:
    scene = scene_of("fenz-test1", {"sliders": "massless", "dimension": "planar"})
    (note,) = simulate(replace(scene, bearing=TFP.replace(friction=[0.4, 0.017, 0.017, 0.4]))).notes[:1]
    assert (note.kind, note.surface, note.value) == ("value", 1, 0.4)
    assert list(doubtful_values(TFP)) == []
