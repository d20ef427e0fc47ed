"""Extremes of a run over all accepted steps: they do not depend on the times of its rows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support import preset_run, scene_of
from support.flights import shaken
from support.gradients import heated

from msfp_gen import Motion, Scene, simulate
from msfp_gen.results.history import LEAST, Extremes, series
from msfp_gen.results.result import load_result
from msfp_gen.specification import contract

PEAKS = ("peak_displacement", "peak_force", "peak_sliding", "minimum_gap", "minimum_normal_force")


def summary_of(name: str, output_step: float | None, **effects: object) -> dict[str, object]:
    scene = scene_of(name, effects, duration=8.0 if name.startswith("ridgecrest") else None)
    return simulate(replace(scene, output_step=output_step)).summary


@pytest.mark.parametrize(
    ("name", "effects"),
    [("ridgecrest-clc", {}), ("fenz-test4", {}), ("fenz-test4", {"dimension": "planar", "sliders": "massless"})],
    ids=str,
)
def test_peaks_do_not_depend_on_the_rows(name: str, effects: dict[str, object]) -> None:
    """Rows at every step, and rows so far apart that they miss the peaks by per cents."""
    fine, coarse = (summary_of(name, step, **effects) for step in (None, 0.5))
    for key in PEAKS:
        one, two = (np.array(list(s[key].values()) if isinstance(s[key], dict) else s[key]) for s in (fine, coarse))
        if effects.get("sliders") == "massless":  # rows at even times are steps of such a run
            assert one == pytest.approx(two, rel=2e-3, abs=1e-9 * np.abs(one).max())
        else:
            assert one == pytest.approx(two, rel=1e-4, abs=0)  # rows between steps may exceed those at their ends


def test_extremes_hold_for_the_rows_and_the_file(tmp_path: Path) -> None:
    scene = scene_of("ridgecrest-clc", duration=8.0)
    result = simulate(replace(scene, output_step=0.5))
    history, extremes = result.history, result.extremes
    assert extremes.displacement[3] >= np.hypot(*history.displacement[:, :2].T).max()
    assert (extremes.least_normal <= history.normal_force.min(axis=0)).all()
    assert extremes.top_force[3] > 1.02 * np.hypot(*history.top_force[:, :2].T).max()
    again = load_result(result.to_netcdf(tmp_path / "run.nc"))
    assert again.summary == result.summary


def test_parted_surfaces_do_not_slide() -> None:
    history = preset_run("fenz-test2").history
    lift = np.zeros_like(history.lift)
    lift[:, 1] = 1e-4
    lift[100:, 2] = 1e-4
    speed = Extremes.of_rows(replace(history, lift=lift)).slip_speed
    whole = np.linalg.norm(history.slip_velocity, axis=2)
    assert speed.tolist() == pytest.approx([whole[:, 0].max(), 0.0, whole[:100, 2].max(), whole[:, 3].max()])


@pytest.mark.slow
def test_every_extreme_is_that_of_rows_close_together() -> None:
    """A motion in two directions over surfaces that warm up, with rows so far apart that they miss all extremes."""
    scene = replace(heated(0.03), motion=Motion.harmonic(0.05, 0.5, cycles=2.0, direction=0.6))
    rows = Extremes.of_rows(simulate(replace(scene, output_step=1e-3)).history)
    recorded = simulate(replace(scene, output_step=0.45)).recorded_extremes
    assert recorded is not None
    names = [extreme.name for extreme in contract.extremes(scene.modelled)]
    assert {*names} == recorded.arrays.keys() == recorded.times.keys()
    for name in names:
        assert getattr(recorded, name) == pytest.approx(getattr(rows, name), rel=1e-2), name


@pytest.mark.parametrize(
    ("scene", "beyond"),
    [(scene_of("fenz-test5"), "rim_force"), (shaken(1.4, sideways=0.02), "lift")],
    ids=["rims", "flight"],
)
def test_times_of_peaks_are_those_of_all_steps(scene: Scene, beyond: str) -> None:
    """With rows at three instants, and with the rows of all steps, of which the times are taken independently."""
    every, few = (simulate(replace(scene, output_step=step)) for step in (None, scene.end / 2))
    recorded, history = few.recorded_extremes, every.history
    assert len(few.history.time) == 3 and recorded is not None and getattr(recorded, beyond).max() > 0
    for extreme in recorded.arrays:
        values = series(extreme, history)
        assert values is not None
        found = recorded.times[extreme]
        if extreme in ("displacement", "sliding", "gap"):  # they are also sought inside steps
            nearest = np.abs(history.time[:, None] - found).argmin(axis=0)
            reached, columns = getattr(recorded, extreme), np.arange(len(found))
            assert values[nearest, columns] == pytest.approx(reached, rel=1e-5, abs=1e-7), extreme
        else:
            peaks = (values.argmin if extreme in LEAST else values.argmax)(axis=0)
            assert found.tolist() == history.time[peaks].tolist(), extreme
    assert few.summary["times"]["peak_sliding"] == few.extremes.times["sliding"].tolist()


def test_a_turning_point_inside_a_step_counts() -> None:
    """Long steps: the largest displacement is that of rows close together, and the rows of the steps miss it."""
    scene = scene_of("ridgecrest-clc", {}, {"rtol": 3e-2}, duration=14.0)
    steps, rows = (simulate(replace(scene, output_step=step)) for step in (None, 1e-3))
    exact = np.hypot(*rows.history.displacement[:, :2].T).max()
    missed = exact - np.hypot(*steps.history.displacement[:, :2].T).max()
    assert missed > 0
    assert abs(steps.extremes.displacement[3] - exact) < 0.05 * missed


def test_planar_extremes_are_those_of_the_user_in_any_plane() -> None:
    """Where all moves along one line, every law of hysteresis is the isotropic one."""
    scene = scene_of("fenz-test2", {"dimension": "planar"}, output_step=0.5)
    turned = replace(scene, motion=Motion.harmonic(0.025, 0.1, cycles=1.0, direction=0.6))
    flat, spatial = (
        simulate(replace(turned, effects=replace(scene.effects, dimension=dimension, bouc_wen=law))).extremes
        for dimension, law in (("planar", "report"), ("spatial", "isotropic"))
    )
    for name in ("displacement", "top_force"):
        one, two = getattr(flat, name), getattr(spatial, name)
        assert one == pytest.approx(two, rel=5e-3, abs=2e-3 * two.max())
