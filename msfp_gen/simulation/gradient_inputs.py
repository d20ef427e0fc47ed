"""Derivatives of everything that a compiled run is given, with respect to parameters of its scene."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.model.evaluation import bodies_and_surfaces, settlements, top_values
from msfp_gen.model.plane import motion_in_plane, wrench_in_plane
from msfp_gen.motions.time_grid import snapped
from msfp_gen.scene.friction_parameters import derived_slopes, law_parameters
from msfp_gen.scene.seats import SPRINGS, stiffness_slopes
from msfp_gen.scene.top import load_values
from msfp_gen.simulation.segment import Frame, first_load, state_in_plane, time_grid, wrench_pieces
from msfp_gen.specification import contract

if TYPE_CHECKING:
    from collections.abc import Sequence

    from msfp_gen.model.compiled import Run
    from msfp_gen.model.model import Model
    from msfp_gen.motions.motion import Motion
    from msfp_gen.scene.parameters import Parameter
    from msfp_gen.scene.scene import Scene
    from msfp_gen.simulation.settling import StartSlopes

_STATE = ("q", "v", "h")
_MOMENTS = ("inertia_transverse", "inertia_axial")
_BASE_FIELDS = {"base_height": "height", "base_rim_radius": "rim_radius", "base_rim_offset": "rim_offset"}


def start_gradients(
    run: Run,
    scene: Scene,
    model: Model,
    parameters: Sequence[Parameter],
    steps: Sequence[float] = (),
    energies: bool = False,
    start: StartSlopes | None = None,
) -> None:
    """Begin the derivatives of a run that has taken no step.

    steps: ends of all steps [s], in place of the step control, for differences with the same steps. energies: also of
    the energies that are integrals over the run. start: derivatives of the initial state; None: it is constant. Raises
    InputError where a parameter leads out of the plane of a planar model.
    """
    inputs = [
        _Inputs(scene, model, parameter, None if start is None else (start.q[i], start.h[i])).arrays
        for i, parameter in enumerate(parameters)
    ]
    histories = {
        name: [arrays_of[name] for arrays_of in inputs if arrays_of[name] is not None] for name in ("motion", "load")
    }
    stacked: dict[str, Any] = {
        name: np.array([arrays_of[name] for arrays_of in inputs])
        for name in ("gravity", "bodies", "surfaces", "top", *_STATE)
    }
    for name, arrays in histories.items():
        present = np.array([arrays_of[name] is not None for arrays_of in inputs], dtype=bool)
        stacked[name] = np.where(present, np.cumsum(present) - 1.0, -1.0)
        stacked[f"{name}s"] = np.array(arrays) if arrays else np.zeros(0)
    stacked["f"] = stacked.pop("h")
    contiguous = {name: np.ascontiguousarray(array, float) for name, array in stacked.items()}
    run.start_gradients(**contiguous, steps=steps, energies=energies)


class _Inputs:
    """The derivatives with respect to one parameter, in `arrays`, by the names of `start_gradients` of a run."""

    def __init__(
        self, scene: Scene, model: Model, parameter: Parameter, start: tuple[Array, Array] | None = None
    ) -> None:
        self.scene, self.model, self.parameter = scene, model, parameter
        self.bodies, self.surfaces = contract.names(contract.BODY), contract.surface_values(model.effects)
        self.top = contract.names(contract.TOP)
        self.seat = self.surfaces.index("seat_stiffness") if model.effects.uplift else None
        count = model.layout.surfaces
        self.frame = Frame.of(scene, model, wrench_pieces(scene)[1])
        self.arrays: dict[str, Any] = {
            "gravity": 0.0,
            "bodies": np.zeros((count + 1, len(self.bodies))),
            "surfaces": np.zeros((count, len(self.surfaces))),
            "top": np.zeros(len(self.top)),
            "q": np.zeros((count, 3)),
            "v": np.zeros((count, 3)),
            "h": np.zeros((count, 2)),
            "motion": None,
            "load": None,
        }
        getattr(self, f"_{parameter.part}")()
        if start is not None:
            self.arrays["q"], self.arrays["h"] = start
            self._state_in_plane()
        if model.effects.uplift:
            self._separations()

    def _bearing(self) -> None:
        name = self.parameter.field
        if name == "gravity":
            self.arrays["gravity"] = 1.0
        else:
            self.arrays["bodies"][0, self.bodies.index(_BASE_FIELDS[name])] = 1.0
            if name == "base_rim_radius":
                self._patch_of_slider(0)

    def _bodies(self) -> None:
        row, *component = self.parameter.index
        name = _MOMENTS[component[0]] if component else self.parameter.field
        self.arrays["bodies"][row + 1, self.bodies.index(name)] = 1.0
        if name == "rim_radius":
            self._patch_of_slider(row + 1)

    def _patch_of_slider(self, body: int) -> None:
        """The contact patch of a surface has the radius of its slider's rim unless it is given."""
        bearing = self.scene.bearing
        for index, surface in enumerate(bearing.surfaces):
            if surface.patch_radius is None and bearing.slider(index) == body:
                self._surface_values(index, "patch_radius")

    def _surfaces(self) -> None:
        (row,), name = self.parameter.index, self.parameter.field
        if name in self.surfaces:
            self.arrays["surfaces"][row, self.surfaces.index(name)] = 1.0
        self._surface_values(row, name)

    def _surface_values(self, row: int, name: str) -> None:
        """The values of a surface that a parameter of its friction law determines; none without a law that needs it."""
        law = self.model.effects.law
        values = {} if law is None else law_parameters(law, self.scene.bearing, row)
        for derived, slope in derived_slopes(values, name).items() if name in values else ():
            if derived in self.surfaces:
                self.arrays["surfaces"][row, self.surfaces.index(derived)] = slope

    def _top(self) -> None:
        name, component = self.parameter.field, self.parameter.index
        if name in ("axial_load", "force", "moment"):
            wrench = np.zeros(6)
            wrench[{"axial_load": 2, "force": 0, "moment": 3}[name] + (component[0] if component else 0)] = (
                -1.0 if name == "axial_load" else 1.0
            )
            self._wrench(np.zeros_like(wrench_pieces(self.scene)[1]), wrench)
        else:
            self.arrays["top"][self.top.index(_MOMENTS[component[0]] if component else name)] = 1.0
        if name in SPRINGS and self.seat is not None:
            self.arrays["surfaces"][:, self.seat] = stiffness_slopes(self.scene.bearing, self.scene.top, name)

    def _load(self) -> None:
        load = self.scene.load
        assert load is not None
        self._wrench(load.until(self.scene.end).coefficients / self.parameter.value, np.zeros(6))

    def _wrench(self, pieces: Array, constant: Array) -> None:
        pieces = np.array(pieces)
        pieces[:, :, 0] += constant
        turned = wrench_in_plane(pieces, self.frame.azimuth)
        if self.model.planar and np.any(np.abs(turned[:, [1, 3, 5]]) > 1e-12 * np.abs(turned).max()):
            raise self._leaves_plane()
        knots = wrench_pieces(self.scene)[0]
        self.arrays["load"] = snapped(knots, turned, time_grid(self.scene).stops)[1]

    def _motion(self) -> None:
        motion = self.scene.motion
        if self.parameter.field == "direction":
            if self.model.planar:
                raise self._leaves_plane()
            coefficients = np.zeros_like(motion.coefficients)
            coefficients[:, 0], coefficients[:, 1] = -motion.coefficients[:, 1], motion.coefficients[:, 0]
        else:
            coefficients = motion.coefficients / self.parameter.value
            coefficients[:, 3:] = 0.0
        turned = _in_plane(motion, coefficients, self.frame.azimuth)
        knots, stops = self.frame.motion.knots, time_grid(self.scene).stops
        self.arrays["motion"] = snapped(knots, turned, stops)[1]
        first = self.top.index("anchor_x")  # the springs of a rig are fixed where the base is at the start
        self.arrays["top"][first : first + 2] = turned[0, :2, 0]

    def _initial_state(self) -> None:
        self.arrays[self.parameter.field][self.parameter.index] = 1.0
        self._state_in_plane()

    def _state_in_plane(self) -> None:
        if self.model.planar:
            try:
                q, v, h = (self.arrays[name] for name in _STATE)
                values = state_in_plane(q, v, h, self.frame.azimuth)
            except InputError:
                raise self._leaves_plane() from None
            self.arrays |= dict(zip(_STATE, values, strict=True))

    def _separations(self) -> None:
        """The separations at rest, with which a run starts, by a complex step."""
        bearing, top, step = self.scene.bearing, self.scene.top, 1e-100
        bodies, surfaces = bodies_and_surfaces(bearing, self.model.effects, top)
        mass, on_top, arrays = self.bodies.index("mass"), self.top.index("mass"), self.arrays
        masses = bodies[1:, mass] + 1j * step * arrays["bodies"][1:, mass]
        masses[-1] += top_values(top)[on_top] + 1j * step * arrays["top"][on_top]
        load = first_load(self.scene) - load_values(top)[2]
        load -= 0.0 if arrays["load"] is None else 1j * step * arrays["load"][0, 2, 0]
        stiffness = surfaces[:, self.seat] + 1j * step * arrays["surfaces"][:, self.seat]
        heights = np.zeros_like(arrays["q"])
        gravity = bearing.gravity + 1j * step * arrays["gravity"]
        heights[:, 2] = -settlements(load, gravity, masses, stiffness).imag / step
        arrays["q"], arrays["v"] = np.hstack([arrays["q"], heights]), np.hstack([arrays["v"], np.zeros_like(heights)])

    def _leaves_plane(self) -> InputError:
        return InputError(
            f"gradients = {self.parameter.path!r}: it leads out of the vertical plane of this planar model; give "
            "effects.dimension = 'spatial'"
        )


def _in_plane(motion: Motion, coefficients: Array, azimuth: float) -> Array:
    """Coefficients on the knots of `motion` in the frame of a vertical plane."""
    return motion_in_plane(replace(motion, coefficients=coefficients), azimuth).coefficients
