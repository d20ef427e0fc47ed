"""The campaign over combinations of constructors: its scenes, its two checks, and what it found."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import fuzz
import fuzz_balance
import fuzz_combined
import numpy as np
import pytest
from support import preset_run, scene_of

from msfp_gen import Auto, Load, Motion, simulate
from msfp_gen.model.compiled import named_vectors
from msfp_gen.simulation.bearing_run import BearingRun
from msfp_gen.simulation.system import finish


@pytest.mark.slow
def test_the_combined_campaign(tmp_path: Path) -> None:
    """Another seed than that of the page; minutes."""
    path = tmp_path / "table.json"
    assert fuzz.main(["--combined", "--scenes", "300", "--seed", "92", "--check", "0", "--output", str(path)]) == 0
    table = json.loads(path.read_text(encoding="utf-8"))
    assert table["faults"] == [] and table["ends"]["ok"] > 200 and table["verdicts"]["agrees"] > 200


@pytest.mark.slow
def test_scenes_are_of_every_kind_and_the_same_again() -> None:
    scenes = [fuzz_combined.case(2, number).scene for number in range(30)]
    assert all(scene == fuzz_combined.case(2, number).scene for number, scene in enumerate(scenes[:3]))
    assert {scene.top.kind for scene in scenes} == {"rig", "mass", "prescribed"}
    assert any(scene.bearing.layout.n > 11 for scene in scenes) and any(isinstance(s.effects, Auto) for s in scenes)
    assert {scene.solver.method for scene in scenes} == {"implicit", "esdirk4"}
    for part in ("load", "top_rotation", "stop", "initial_state", "duration", "output_step"):
        assert any(getattr(scene, part) is not None for scene in scenes), part


def test_the_balances_of_a_row_see_one_force_in_a_thousand() -> None:
    run = preset_run("fenz-test2")
    rows = range(5, len(run.history.time), 200)

    def left(history: object) -> float:
        effects = run.scene.modelled
        return max(fuzz_balance.unbalanced(run.scene, effects, history, row) for row in rows)  # type: ignore[arg-type]

    assert left(run.history) < 1e-7
    for name in ("normal_force", "contact_angles", "friction_state"):
        values = getattr(run.history, name)
        wrong = values * 1.001 if name != "contact_angles" else values + 1e-3
        assert left(replace(run.history, **{name: wrong})) > 1e-6, name


def test_a_slider_on_its_edge_is_balanced_by_the_moment_of_its_separation() -> None:
    """9 % of a moment were left, since the check knew neither this moment nor that the separation leaves the rim."""
    scene = replace(fuzz_balance.turned(fuzz_combined.case(92, 101).scene), output_step=None)
    run = BearingRun.of(scene)
    finish(run, scene.end)
    history = run.result().history
    assert np.abs(history.separation).max() > 1e-3 and run.segments[-1].model.effects.uplift
    assert fuzz_balance.worst_row(scene, run, history) < 2e-4
    wrong = replace(history, contact_angles=history.contact_angles + 1e-3)
    assert fuzz_balance.worst_row(scene, run, wrong) > 2e-4


def test_half_the_longest_step_sees_a_pulse_that_was_stepped_over() -> None:
    """The run without the pulse stands for one that did not see it."""
    scene = scene_of("fenz-test2", motion=Motion.harmonic(0.02, 0.2), output_step=None)
    pulse = Load.from_arrays([0.0, 5.0, 5.05, 5.1], np.outer([0, 0, 1, 0], [0.0, 0.0, -1e5]))
    blind, seen = simulate(scene), replace(scene, load=pulse)
    assert fuzz_balance.halved(seen, simulate(seen))["verdict"] == "agrees"
    assert fuzz_balance.halved(seen, replace(blind, scene=seen))["verdict"] in ("wrong", "noted")


# ---- what the campaign found


def test_a_component_of_a_load_that_is_rounding_does_not_jump() -> None:
    """A pulse in an oblique plane, turned into E1: what is left along E2 was taken for jumps."""
    pulse = Load.from_arrays([0.0, 1.0, 1.1, 1.2], np.outer([0, 0, 1, 0], [1e5, 3e-12, 0.0]))
    jittered = pulse.coefficients.copy()
    jittered[1, 1, 0] += 1e-12
    assert Load.of(pulse.knots, jittered).jumps.size == 0
    jittered[1, 3, 0] = 5.0  # [N m]: moments have a size of their own
    assert Load.of(pulse.knots, jittered).jumps.tolist() == [1.0, 1.1]


@pytest.mark.parametrize("n", [9, 10, 12, 23])
def test_every_point_of_a_tall_stack_has_a_name_of_its_own(n: int) -> None:
    """In stacks of 11 and more bodies the centre of body 11 had the name of a point of body 1."""
    points = np.arange(n * 12 * 3, dtype=float).reshape(n, 4, 3, 3)
    vectors = named_vectors(n, points, np.zeros((n, 4, 3)), np.zeros((n, 3, 3)))
    assert sum(name.startswith("r_") for name in vectors) == 4 * n - 1
    assert vectors["r_1" + ("_1" if n > 9 else "1")] is not vectors["r_11" if n > 10 else "r_1"]
    np.testing.assert_array_equal(vectors[f"r_{n}"], points[n - 1, 1, 0])
