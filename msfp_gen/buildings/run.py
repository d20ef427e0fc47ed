"""`simulate_building`: the run of a building on its bearings, with steps of one length."""

from __future__ import annotations

import numpy as np

from msfp_gen.buildings.result import BuildingResult, Rows
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.buildings.step import Coupling, State, UnconvergedError
from msfp_gen.errors import RunError

HALVINGS = 8  # of a step at which Newton's method fails


def simulate_building(scene: BuildingScene) -> BuildingResult:
    """The motion of a building and its bearings from rest.

    Raises RunError: a bearing cannot follow, or a step has no solution; its `result` has the rows until then.
    """
    coupling = Coupling(scene)
    count = len(scene.building.mass)
    state = State(0.0, *(np.zeros(count) for _ in range(3)))
    rows = Rows(scene)
    rows.start(coupling, state)
    steps = max(1, round(scene.end / scene.step))
    times = np.linspace(0.0, scene.end, steps + 1)
    try:
        for time in times[1:]:
            state = _advance(coupling, state, float(time))
            rows.add(coupling, state)
    except RunError as error:
        raise RunError(str(error), status=error.status, result=rows.result(coupling)) from None
    return rows.result(coupling)


def _advance(coupling: Coupling, state: State, end: float) -> State:
    """Steps until the time `end` [s]: one, or shorter ones where Newton's method fails."""
    for halving in range(HALVINGS + 1):
        parts = 2**halving
        now = state
        try:
            for part in range(1, parts + 1):
                # Parts of a step are committed one by one, so only the first may fail without loss.
                h = (end - state.time) * part / parts + state.time - now.time
                now = coupling.step(now, h)
                coupling.commit()
        except UnconvergedError:
            if now is not state:
                return _advance(coupling, now, end)
            continue
        return now
    raise RunError(
        f"building: stopped at t = {state.time:.6g} s of {coupling.scene.end:.6g} s: the forces of bearings and "
        "building have no balance that the iteration finds; give a shorter solver.max_step",
        status="newton",
    )
