"""One segment of a run, computed by one model: initial state, frame and monitors of the compiled run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.model.evaluation import separations_at_rest
from msfp_gen.model.plane import (
    motion_in_plane,
    out_of_plane,
    rotated_pairs,
    tilt_pieces,
    tilts_into_plane,
    wrench_in_plane,
)
from msfp_gen.motions.piecewise import ORDER
from msfp_gen.motions.time_grid import TimeGrid, snapped
from msfp_gen.results.restart_state import RestartState, transferred_heights, transferred_state
from msfp_gen.scene.effect_selection import EffectSelection, quasistatic
from msfp_gen.scene.effect_switching import Ending, monitor_options
from msfp_gen.scene.friction_parameters import law_parameters
from msfp_gen.scene.planarity import scene_plane
from msfp_gen.scene.top import load_values

if TYPE_CHECKING:
    from msfp_gen.model.compiled import Run
    from msfp_gen.model.model import Model
    from msfp_gen.motions.motion import Motion
    from msfp_gen.scene.scene import Scene
    from msfp_gen.simulation.row_file import RowFile


@dataclass(frozen=True, eq=False)
class Segment:
    """A compiled run that has ended, with its model.

    azimuth: of the frame of the model [rad]. status: how the run ended. wall, setup: wall time of the integration, and
    of build and preparation before it [s]. stored: its rows on disk but for the last, where they are streamed.
    """

    model: Model
    run: Run
    azimuth: float
    status: str
    wall: float
    setup: float
    stored: RowFile | None = None

    @property
    def ending(self) -> Ending:
        """How it ended."""
        _, surface, value = self.run.status
        return Ending(self.model.effects, self.status, self.run.time, surface, value, self.run.trips)


@dataclass(frozen=True, eq=False)
class Frame:
    """Base motion, load and top rotation of a scene in the frame of a model.

    azimuth: of the E1 axis of the frame [rad]. wrench, rotation: coefficients of polynomials, shape (k, channels, 6).
    """

    azimuth: float
    motion: Motion
    wrench: Array
    rotation: Array | None

    @classmethod
    def of(cls, scene: Scene, model: Model, wrench: Array) -> Frame:
        """The frame of a model: E1 of a planar model lies in the vertical plane of the scene."""
        rotation = None if scene.top_rotation is None else scene.top_rotation.coefficients
        azimuth = scene_plane(scene)[0] if model.planar else 0.0
        if not azimuth:
            return cls(0.0, scene.motion, wrench, rotation)
        planar_rotation = None if rotation is None else tilt_pieces(rotation, azimuth)
        return cls(azimuth, motion_in_plane(scene.motion, azimuth), wrench_in_plane(wrench, azimuth), planar_rotation)


def start_run(
    scene: Scene, model: Model, selection: EffectSelection, end: float, at: RestartState | None, stops: tuple[str, ...]
) -> tuple[Run, float]:
    """A compiled run before its first step, and the azimuth of its frame [rad].

    end: time at which the run ends [s]. at: state of the segment before; None: the initial state of the scene. stops:
    the monitors that stop the run; the others only write notes.
    """
    solver, stop = scene.solver, scene.stop
    load_knots, wrench = wrench_pieces(scene)
    frame = Frame.of(scene, model, wrench)
    if at is None:
        q, v, f = _initial_state(scene, model, frame.azimuth)
    else:
        q, v, f = transferred_state(scene.bearing, scene.top, model, at)
    stack = model.stack(scene.bearing, scene.top, anchor=frame.motion.displacement(0.0)[:2])
    grid = time_grid(scene)
    options: dict[str, Any] = {}
    if frame.rotation is not None and scene.top_rotation is not None:
        support = snapped(*_support_rotation(scene, frame.rotation), grid.stops)
        options["support_knots"], options["support_coefficients"] = support
    if at is not None:
        becomes_spatial = at.planar and not model.planar
        origin, options["foot"] = transferred_heights(scene.bearing, scene.top, model, at, first_load(scene))
        origin = out_of_plane(origin, at.azimuth, "vector") if becomes_spatial else origin
        options |= {"origin": np.ascontiguousarray(origin), "monitor_heat": at.monitor_heat, "start_time": at.time}
        if (memory := at.memory_of(model.effects.law)) is not None:
            options["memory"] = memory
    run: Run = model.extension.Run(
        stack,
        *snapped(frame.motion.knots, frame.motion.coefficients, grid.stops),
        *snapped(load_knots, frame.wrench, grid.stops),
        grid.jumps,
        q,
        v,
        f,
        method=solver.method,
        rtol=solver.rtol,
        atol_angle=solver.angle_tolerance,
        stops=grid.stops,
        span_ends=grid.ends,
        span_steps=grid.steps,
        first_step=(solver.first_step or 0.0) if at is None else 0.0,
        max_steps=float(solver.max_steps),
        duration=end,
        output_step=scene.output_step or 0.0,
        stop_displacement=(stop.displacement or 0.0) if stop else 0.0,
        stop_all_rims=bool(stop and stop.all_rims),
        sampled=scene.motion.sampled,
        quasistatic=quasistatic(scene, model.effects),
        **monitor_options(scene, model.effects, selection, stops),
        **options,
    )
    return run, frame.azimuth


def start_temperatures(segments: Sequence[Segment], scene: Scene) -> dict[str, Array]:
    """The temperature of every surface at the start as "temperature", shape (n-1,) [degC]; nothing without one.

    It is that of the rows of earlier models without heat, and of the friction law in them.
    """
    law = segments[-1].model.effects.law
    if law is None or not law.depends_on_temperature:
        return {}
    parameters = [law_parameters(law, scene.bearing, index) for index in range(scene.bearing.layout.surfaces)]
    return {"temperature": np.array([of_surface["start_temperature"] for of_surface in parameters])}


def wrench_pieces(scene: Scene) -> tuple[Array, Array]:
    """Knots, shape (k+1,) [s], and polynomials, (k, 6, 6), of force and moment on the top plate [N], [N m].

    Those of the top and of the load history.
    """
    knots, pieces = np.array([0.0, max(scene.end, 1.0)]), np.zeros((1, 6, ORDER))
    if scene.load is not None:
        load = scene.load.until(scene.end)
        knots, pieces = np.array(load.knots), np.array(load.coefficients)
    pieces[:, :, 0] += load_values(scene.top)
    return knots, pieces


def _support_rotation(scene: Scene, coefficients: Array) -> tuple[Array, Array]:
    """Knots and polynomials, shape (k, 6, 6), of psi, theta of the support of the top plate."""
    assert scene.top_rotation is not None
    rotation = replace(scene.top_rotation, coefficients=coefficients).until(scene.end)
    pieces = np.zeros((len(rotation.knots) - 1, 6, ORDER))
    pieces[:, :2] = rotation.coefficients
    return np.array(rotation.knots), pieces


def time_grid(scene: Scene) -> TimeGrid:
    """Times at which steps of a run of `scene` must end, and limits of the step."""
    histories = [history for history in (scene.motion, scene.load, scene.top_rotation) if history is not None]
    return TimeGrid.of_histories(histories, scene.end, (scene.solver.max_step, scene.motion.max_step))


def _initial_state(scene: Scene, model: Model, azimuth: float) -> tuple[Array, Array, Array]:
    """The initial state q, v, f of a scene in the frame of a model."""
    count, state = scene.bearing.layout.surfaces, scene.initial_state
    q, v, f = (
        np.zeros((count, k)) if state is None else np.array(value, dtype=float)
        for k, value in zip((3, 3, 2), (None,) * 3 if state is None else (state.q, state.v, state.h), strict=True)
    )
    if model.planar:
        q, v, f = state_in_plane(q, v, f, azimuth)
    if model.effects.uplift:
        q = np.hstack([q, separations_at_rest(scene.bearing, scene.top, first_load(scene))])
        v = np.hstack([v, np.zeros((count, 3))])
    return q, v, f


def first_load(scene: Scene) -> float:
    """Load at the start beside that of the top, downward positive [N]."""
    return 0.0 if scene.load is None else -float(scene.load.evaluate(0.0)[2])


def state_in_plane(q: Array, v: Array, f: Array, azimuth: float) -> tuple[Array, Array, Array]:
    """An initial state, shapes (n-1, 3), (n-1, 3), (n-1, 2) [rad], [rad/s], [1], in the frame of a planar model.

    Raises InputError where it leaves the plane.
    """
    q, v = (tilts_into_plane(x, azimuth, f"initial_state.{name}") for x, name in ((q, "q"), (v, "v")))
    f = np.ascontiguousarray(rotated_pairs(f, azimuth))
    if np.any(np.abs(f[:, 1]) > 1e-12):
        raise InputError("initial_state.h leaves the vertical plane of the motion: use dimension = 'spatial'")
    return q, v, f
