"""The notes of a run: what their numbers are measured by, and what a switch of effects says of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support import preset_run

from msfp_gen.results.history import History
from msfp_gen.scene.scene import Scene
from msfp_gen.simulation.notes import energy_notes

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
