"""The notes of a run: what their numbers are measured by, and what a switch of effects says of them."""

from __future__ import annotations

from dataclasses import replace

import auto_scenes
import numpy as np
import pytest
from support import preset_run

from msfp_gen import Effects, Load, Solver, simulate
from msfp_gen.results.history import History
from msfp_gen.scene.effect_selection import load_at_rest
from msfp_gen.scene.scene import Scene
from msfp_gen.simulation.outcome import energy_notes, tolerance_notes

SLID, NORMAL, WORK = 0.05, 2e5, 700.0


def given(error: float, work: float = WORK, slid: float = SLID) -> tuple[Scene, History]:
    """A run of which only the energies, the normal forces and the sliding displacements count."""
    result = preset_run("fenz-test2")
    history = result.history
    energy = {name: np.zeros_like(values) for name, values in history.energy.items()}
    energy["friction_dissipated"][-1], energy["numerical"][len(history.time) // 2] = work, -error
    sliding = np.zeros_like(history.sliding)
    sliding[3] = slid
    normal = np.full_like(history.normal_force, NORMAL)
    return result.scene, replace(history, energy=energy, sliding=sliding, normal_force=normal)


@pytest.mark.parametrize(("work", "slid"), [(WORK, SLID), (1e5, SLID), (WORK, 0.0)])
def test_the_energy_that_is_missing_is_measured_by_the_largest_term(work: float, slid: float) -> None:
    """Work of the load along the spheres, s^2/2R for each surface, is a term; what no tolerance resolves is added."""
    scene, _ = given(0.0)
    surfaces = scene.bearing.surfaces
    along = NORMAL * sum(slid**2 / (2 * surface.radius) for surface in surfaces)
    friction = max(surface.friction * surface.radius for surface in surfaces)
    scale = max(work, along) + NORMAL * 3 * scene.solver.angle_tolerance * friction / 0.02
    (note,) = energy_notes(*given(0.021 * scale, work, slid))
    assert note.value == pytest.approx(0.021, rel=1e-12) and note.text.startswith(
        "the energy closure has an error of 2.1%"
    )
    _, history = given(0.0)
    assert note.time == history.time[len(history.time) // 2]
    assert energy_notes(*given(0.019 * scale, work, slid)) == ()


def test_a_tolerance_above_the_force_of_a_stiff_spring_is_noted() -> None:
    """A pulse of 10 kN into a rig of 1 GN/m gives 650 N, of which a run at rtol = 1e-4 shows a tenth (esdirk4)."""
    result = preset_run("fenz-test2")
    load = Load.from_arrays([0, 1], [[0, 0, 0], [1e3, 0, 0]])
    scene = replace(result.scene, load=load, solver=Solver(rtol=1e-4))
    radius = max(surface.radius for surface in scene.bearing.surfaces)
    force = scene.top.stiffness * 1e-6 * radius  # type: ignore[attr-defined]
    peak = np.hypot(*result.history.top_force[:, :2].T).max()

    def noted(share: float, scene: Scene = scene, sliders: str = "inertial") -> tuple[float, ...]:
        history = replace(result.history, top_force=result.history.top_force * force / (share * peak))
        return tuple(note.value for note in tolerance_notes(scene, Effects(sliders=sliders), history))

    assert noted(0.051) == (pytest.approx(force),) and noted(0.049) == ()
    vertical = Load.constant((0.0, 0.0, 1e3), (1e3, 0.0, 0.0))
    for other in ({"load": None}, {"load": vertical}, {"solver": Solver(method="dopri5")}):
        assert noted(0.5, replace(scene, **other)) == ()
    assert noted(0.5, sliders="massless") == ()


@pytest.mark.slow
def test_rows_whose_peak_force_is_above_that_of_the_steps_are_noted() -> None:
    """A plate of 271 kg on a rig of 0.6 GN/m: of 0.94 % of friction by which its peak is off, steps have 0.21 %."""
    scene = auto_scenes.campaign(21, 24)
    exact = simulate(replace(scene, solver=Solver(method="esdirk4", rtol=1e-8))).extremes.top_force[3]
    run, tight = (
        simulate(replace(scene, output_step=scene.end / 2000, solver=Solver(rtol=rtol))) for rtol in (1e-4, 1e-6)
    )
    (note,) = (note for note in run.notes if note.kind == "rows")
    friction = max(surface.friction for surface in scene.bearing.surfaces) * load_at_rest(scene)
    off = float(run.extremes.top_force[3]) - exact
    assert 0.5 * off < note.value < 1.2 * off and off > 0.005 * friction
    assert f"{note.value / friction:.1%} of friction" in note.text
    steps = simulate(scene)
    assert abs(steps.extremes.top_force[3] - exact) < 0.003 * friction
    assert not [note for other in (steps, tight) for note in other.notes if note.kind == "rows"]
