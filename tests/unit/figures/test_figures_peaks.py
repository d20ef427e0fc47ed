"""Peaks that figures state are those of the summary, over all steps, also where the rows are coarse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.buildings import pushed_scene

from msfp_gen import load_scene, simulate
from msfp_gen.buildings.figures import plot_axial_forces, plot_building
from msfp_gen.figures import plot_result


def test_the_title_of_a_bearing_states_the_peaks_of_the_summary():
    result = simulate(replace(load_scene("fenz-test2"), output_step=9.0))
    peak, force = (result.summary[name]["radial"] for name in ("peak_displacement", "peak_force"))
    assert result.history.horizontal.max() < 0.99 * peak
    title = plot_result(result).get_suptitle()
    assert f"peak displacement {1e3 * peak:.4g} mm, peak force {1e-3 * force:.4g} kN" in title


def test_figures_of_a_building_state_the_peaks_of_the_summary():
    result = simulate(replace(pushed_scene(), duration=2.0, output_step=0.9))
    summary, weight = result.summary, result.scene.weight
    peak = summary["peak_displacement"]["radial"]
    assert max(one.history.horizontal.max() for one in result.bearings) < 0.99 * peak
    figure = plot_building(result)
    shown = f"bearings move {1e3 * peak:.4g} mm, base shear {summary['peak_force_ratio']:.3f} of the weight"
    assert shown in figure.get_suptitle()
    plan, ranges, *_, shears = figure.get_axes()
    own = [one.summary["peak_displacement"]["radial"] for one in result.bearings]
    assert [text.get_text().split(": ")[1] for text in plan.texts] == [f"{1e3 * each:.0f} mm" for each in own]
    figure.draw_without_rendering()
    assert all(plan.bbox.contains(*text.get_window_extent().p0) for text in plan.texts), "none is cut off"
    crosses = [line.get_xdata()[0] for line in shears.get_lines() if line.get_marker() == "x" and len(line.get_xdata())]
    assert crosses == pytest.approx([summary["peak_force"][axis] / weight for axis in ("E1", "E2")])
    for axes in (ranges, plot_axial_forces(result).get_axes()[1]):
        drawn = np.array([[bar.get_x(), bar.get_x() + bar.get_width()] for bar in axes.patches])
        assert drawn == pytest.approx(1e-3 * result.extremes.axial_force)
