"""Pictures: what is drawn, where it lies on the page, and what is written."""

from __future__ import annotations

import dataclasses
from itertools import combinations

import numpy as np
import pytest
from support.synthetic import LOAD, loops, ramp

from msfp_gen.common.errors import InputError
from msfp_gen.figures import plot_result
from msfp_gen.scene.top import Top

MAGIC = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}


def panels(figure):
    return {axes.get_title(loc="left"): axes for axes in figure.get_axes()}


@pytest.mark.parametrize("suffix", MAGIC)
def test_writes_the_kind_the_suffix_asks_for(suffix, tmp_path):
    path = tmp_path / f"run{suffix}"
    plot_result(loops(), path)
    assert path.read_bytes().startswith(MAGIC[suffix])
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", ["run.gif", "run", "nowhere/run.png"])
def test_refuses_a_path_and_writes_nothing(name, tmp_path):
    with pytest.raises(InputError, match="plot"):
        plot_result(loops(), tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_one_direction_gives_one_loop_in_mm_and_kn():
    run = loops()
    titles = panels(plot_result(run))
    assert (
        "Force and displacement along E₁" in titles
        and "Force and displacement along E₂" not in titles
        and "Orbit" not in titles
    )
    axes = titles["Force and displacement along E₁"]
    x, y = axes.get_lines()[0].get_data()
    np.testing.assert_allclose(x, 1e3 * run.history.displacement[:, 0])
    np.testing.assert_allclose(y, 1e-3 * run.history.top_force[:, 0])
    assert "[mm]" in axes.get_xlabel() and "[kN]" in axes.get_ylabel()


def test_second_axis_is_force_over_load():
    axes = panels(plot_result(loops()))["Force and displacement along E₁"]
    (second,) = axes.child_axes
    assert "F₁ / N" in second.get_ylabel() and "112 kN" in second.get_ylabel()
    low, high = axes.get_ylim()
    axes.figure.figure.draw_without_rendering()
    assert second.get_ylim() == pytest.approx((low * 1e3 / LOAD, high * 1e3 / LOAD))


def test_no_second_axis_without_a_load():
    run = loops()
    unloaded = dataclasses.replace(run.scene, top=Top.prescribed(force=(0.0, 0.0, 0.0)))
    run = dataclasses.replace(run, scene=unloaded)
    assert not panels(plot_result(run))["Force and displacement along E₁"].child_axes


def test_two_directions_give_two_loops_and_the_orbit():
    assert {"Force and displacement along E₁", "Force and displacement along E₂", "Orbit"} <= set(
        panels(plot_result(loops(both=True)))
    )


def test_every_surface_has_a_strip_with_its_capacity_and_rims():
    run = loops()
    strips = [axes for axes in plot_result(run).get_axes() if axes.get_ylabel().startswith("s")]
    assert [axes.get_ylabel() for axes in strips] == ["s₄ [mm]", "s₃ [mm]", "s₂ [mm]", "s₁ [mm]"]
    for axes, index in zip(strips, (3, 2, 1, 0), strict=True):
        capacity, curve, *marks = axes.get_lines()
        assert set(capacity.get_ydata()) == {1e3 * run.scene.bearing.surfaces[index].capacity}
        np.testing.assert_allclose(curve.get_ydata(), 1e3 * run.history.sliding[:, index])
        assert len(marks) == sum(event.surface == index + 1 for event in run.events)


def test_title_has_the_name_and_says_that_a_run_failed():
    assert plot_result(loops()).get_suptitle().startswith("fenz-test5")
    failed = dataclasses.replace(loops(), status="newton_failed")
    assert "run failed (newton_failed)" in plot_result(failed).get_suptitle()


@pytest.mark.parametrize("run", [loops(), loops(both=True), ramp()], ids=["one", "both", "ramp"])
def test_no_text_is_cut_or_lies_on_other_text(run):
    figure = plot_result(run)
    figure.draw_without_rendering()
    page = figure.bbox
    texts = [figure._suptitle]
    for axes in figure.get_axes():
        texts += [axes._left_title, axes.xaxis.label, axes.yaxis.label, *axes.texts]
        texts += [child.yaxis.label for child in axes.child_axes]
    boxes = [(text.get_text(), text.get_window_extent()) for text in texts if text.get_text() and text.get_visible()]
    for text, box in boxes:
        assert page.x0 <= box.x0 and box.x1 <= page.x1 and page.y0 <= box.y0 and box.y1 <= page.y1, text
    for (first, one), (second, other) in combinations(boxes, 2):
        assert not one.overlaps(other), (first, second)


def test_stages_of_a_monotonic_run_are_marked():
    axes = panels(plot_result(ramp()))["Force and displacement along E₁"]
    marks = {text.get_text(): text.xy[0] for text in axes.texts}
    assert marks == pytest.approx(
        {"u* = 2.0 mm": 2.0, "u** = 48.1 mm": 48.1, "u_dr1 = 87.9 mm": 87.9, "u_dr4 = 134.0 mm": 134.0}, abs=0.05
    )
    assert not panels(plot_result(loops()))["Force and displacement along E₁"].texts


def test_global_state_of_matplotlib_is_left_alone():
    import matplotlib

    before = dict(matplotlib.rcParams)
    plot_result(loops())
    assert dict(matplotlib.rcParams) == before
