"""`simulate_building`: the run of a building on its bearings, with steps of one length."""

from __future__ import annotations

import numpy as np

from msfp_gen.buildings.result import BuildingResult, Rows
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.buildings.step import Coupling, State, UnconvergedError
from msfp_gen.errors import RunError

HALVINGS = 6  # of a step that fails


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
    """Steps until the time `end` [s]: one, or shorter ones where a step fails. Raises RunError."""
    h, shortest = end - state.time, (end - state.time) * 0.6 / 2**HALVINGS
    while True:
        last = state.time + 1.5 * h > end
        try:
            state = coupling.step(state, end - state.time if last else h)
        except UnconvergedError as error:
            if h < shortest:
                raise RunError(str(error), status=error.status) from None
            h /= 2
            continue
        coupling.commit()
        if last:
            return state
