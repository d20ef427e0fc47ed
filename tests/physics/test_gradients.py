"""Gradients of runs against differences of runs, with the same steps and with free ones, and against closed forms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support import Array, scene_of

from msfp_gen import Effects, Load, Motion, Scene, Top, load_scene, simulate
from msfp_gen.model.model import Model, build_model
from msfp_gen.results.gradient import ENERGIES
from msfp_gen.results.row_unpacking import unpacked
from msfp_gen.scene.effect_selection import quasistatic
from msfp_gen.scene.parameters import Parameter, changed_parameters, parameters_of
from msfp_gen.simulation.gradient_inputs import start_gradients
from msfp_gen.simulation.simulate import RunSequence

DAMPED = {"contact_damping": 1e-3}
STACK = (
    "bearing.surfaces[*].friction", "bearing.surfaces[0].radius", "bearing.surfaces[0].yield_displacement",
    "bearing.surfaces[0].contact_damping", "bearing.surfaces[0].capacity", "bearing.bodies[0].height",
    "bearing.bodies[0].mass", "bearing.bodies[0].centroid", "bearing.bodies[0].inertia[0]",
    "bearing.bodies[0].rim_radius", "bearing.base_height", "bearing.gravity", "motion.scale",
)  # fmt: skip
RIG = ("top.axial_load", "top.stiffness", "top.damping", "top.rotational_stiffness", "top.rotational_damping")
MASS = (
    "top.mass", "top.inertia[0]", "top.height", "top.rotational_stiffness", "top.vertical_stiffness",
    "top.vertical_damping", "load.scale", "bearing.surfaces[1].friction_slow", "bearing.surfaces[1].velocity_rate",
)  # fmt: skip


def single(hysteresis: str = "report") -> Scene:
    """A single pendulum without masses and dampers in the plane, under two cycles: its steps are quasi-static."""
    scene, motion = load_scene("single-push"), Motion.harmonic(0.1, 0.5, cycles=2.0)
    effects = Effects(dimension="planar", sliders="massless", rims=False, bouc_wen=hysteresis)
    bearing = scene.bearing.replace(rim_damping=0.0, mass=1e-3, inertia=1e-3)
    scene = replace(scene, bearing=bearing, top=replace(scene.top, damping=0.0, stiffness=1e9))
    scene = replace(
        scene, motion=motion, duration=None, stop=None, motion_table=None, output_step=None, effects=effects
    )
    assert quasistatic(scene, effects)
    return scene


def double() -> Scene:
    """A double pendulum with friction that depends on velocity below a mass on a vertical spring, under a load."""
    scene = load_scene("double-push")
    bearing = scene.bearing.replace(friction_slow=[0.02, 0.03], velocity_rate=20.0, **DAMPED)
    top = Top.mass(2e4, (3e3, 5e3), 0.7, rotational_stiffness=1e6, vertical_stiffness=5e7, vertical_damping=2e4)
    motion, load = Motion.harmonic(0.05, 0.5, cycles=2.0), Load.harmonic((500, 0, 300), frequency=0.7, cycles=2.0)
    effects = Effects(friction="velocity", rims=False)
    scene = replace(scene, bearing=bearing, top=top, motion=motion, load=load, effects=effects, stop=None)
    return replace(scene, duration=None, motion_table=None, output_step=None)


def triple(duration: float = 6.0, **solver: Any) -> Scene:
    """The triple pendulum of PEER 2017/07 with damped contacts, at the start of test 2."""
    scene = scene_of("fenz-test2", duration=duration)
    scene = replace(scene, bearing=scene.bearing.replace(**DAMPED), output_step=None)
    return replace(scene, solver=replace(scene.solver, **solver))


class FrozenSteps:
    """Runs of a scene with the steps that it takes at its tolerance, and with Newton's method converged further."""

    def __init__(self, scene: Scene) -> None:
        first = simulate(scene)
        self.steps = first.history.time[1:]
        self.scene = replace(scene, solver=replace(scene.solver, rtol=1e-10))
        self.model: Model = build_model(scene.bearing.layout, scene.modelled, gradients=True)

    def run(self, scene: Scene, parameters: Sequence[Parameter]) -> tuple[dict[str, Any], list[dict[str, Any]]]:
        """Rows by field, and their derivatives with respect to each parameter."""
        run, azimuth = RunSequence.of(scene).start_segment(self.model)
        start_gradients(run, scene, self.model, parameters, list(self.steps))
        while run.advance():
            pass
        assert run.status[0] == "ok"
        assert run.counts["steps"] == len(self.steps)
        rows = run.gradient_rows(len(parameters))
        found = [unpacked(self.model, each, azimuth, True) for each in (run.rows, *np.moveaxis(rows, 1, 0))]
        values, *slopes = [fields | fields["energy"] for fields in found]
        return values, slopes[: len(parameters)]

    def differences(self, parameter: Parameter, size: float) -> dict[str, Array]:
        """Richardson-extrapolated central differences."""
        step = size * abs(parameter.value)
        values = [parameter.value + sign * k * step for k in STEPS for sign in (1, -1)]
        runs = [self.run(changed_parameters(self.scene, {parameter: value}), ())[0] for value in values]
        return {name: extrapolated([run[name] for run in runs], step) for name in CHECKED}


STEPS = (1, 2, 4)
CHECKED = ("tilt_angles", "tilt_rates", "friction_state", "normal_force", "top_force", "top_moment", "displacement")
CHECKED += ENERGIES


def extrapolated(values: Sequence[Array], step: float) -> Array:
    """The derivative of sixth order from values at 1, -1, 2, -2, 4, -4 steps (Richardson)."""
    pairs = zip(STEPS, values[::2], values[1::2], strict=True)
    one, two, four = ((above - below) / (2 * k * step) for k, above, below in pairs)
    fine, coarse = one + (one - two) / 3, two + (two - four) / 3
    return fine + (fine - coarse) / 15


def check_frozen(scene: Scene, paths: Sequence[str], size: float = 1e-4) -> None:
    """Every derivative agrees to 1e-6 of its largest value, but for the rounding of the differences.

    Newton's method stops at 1e-10 of the friction, and mostly far below; a difference divides that by its step.
    size: of that step, over the parameter.
    """
    frozen = FrozenSteps(scene)
    parameters = parameters_of(scene, paths)
    values, slopes = frozen.run(frozen.scene, parameters)
    for parameter, slope in zip(parameters, slopes, strict=True):
        if parameter.value == 0:
            continue
        found = frozen.differences(parameter, size)
        for name in CHECKED:
            together = ENERGIES if name in ENERGIES else (name,)  # a term of the energy may be small beside the others
            largest, value = (max(np.abs(each[other]).max() for other in together) for each in (found, values))
            rounding = 1e-11 * value / (size * abs(parameter.value))
            error = np.abs(slope[name] - found[name]).max()
            assert error <= 1e-6 * largest + rounding, (parameter.path, name, error / largest)


@pytest.mark.parametrize("method", ["implicit", "esdirk4"])
def test_differences_with_the_same_steps_in_a_triple_pendulum(method: str) -> None:
    check_frozen(triple(3.0, method=method), [*STACK, *RIG])


def test_the_load_before_a_jump_counts_in_the_step_that_ends_there() -> None:
    """A side load that jumps twice within a run, above a base that starts beside the origin, and its rig with it."""
    load = Load.from_arrays([0.0, 0.2, 0.2, 0.5, 0.5, 0.7], np.outer([1.0, 1.0, -1.0, -1.0, 2.0, 2.0], [4e3, 0.0, 2e3]))
    scene = triple(0.7)
    beside = scene.motion.coefficients.copy()
    beside[:, :2, 0] += 0.02, -0.01
    motion = replace(scene.motion, coefficients=beside)
    check_frozen(replace(scene, motion=motion, motion_table=None, load=load), ["load.scale", "motion.scale"], 1e-3)


@pytest.mark.slow
def test_differences_with_the_same_steps_in_a_double_pendulum_below_a_mass() -> None:
    check_frozen(double(), [*STACK, *MASS], 5e-5)


@pytest.mark.parametrize("hysteresis", ["report", pytest.param("plastic", marks=pytest.mark.slow)])
def test_differences_with_the_same_steps_in_quasi_static_runs(hysteresis: str) -> None:
    without_effect = ("mass", "centroid", "inertia[0]", "rim_radius", "base_height", "damping", "rotational_damping")
    check_frozen(single(hysteresis), [path for path in (*STACK, *RIG) if path.rpartition(".")[2] not in without_effect])


def test_a_single_pendulum_in_closed_form() -> None:
    """While it slides, moments about the sphere centre give F cos - W sin = R mu N/a, N^2 (1 + mu^2) = F^2 + W^2.

    a: from the sphere centre to the top of the plate, R less its height. The displacement is a sin(theta).
    """
    scene = single()
    scene = replace(scene, solver=replace(scene.solver, rtol=1e-9))
    result = simulate(scene, gradients=["bearing.surfaces[0].friction", "bearing.surfaces[0].radius"])
    surface, history = scene.bearing.surfaces[0], result.history
    sliding = (np.abs(history.friction_state[:, 0, 0]) > 1 - 1e-9) & (np.abs(history.tilt_rates[:, 0, 1]) > 1e-3)
    assert np.count_nonzero(sliding) > 20
    force, tilt = history.top_force[sliding, 0], history.tilt_angles[sliding, 0, 1]
    load, normal = -history.top_force[sliding, 2], history.normal_force[sliding, 0]
    mu, radius = surface.friction, surface.radius
    arm = radius - scene.bearing.bodies[0].height
    found = result.gradient
    d_force, d_tilt = found.top_force.values[:, sliding, 0], found.tilt.values[:, sliding, 0, 1]
    # The closed form F(mu, R, theta): its derivatives, and that of theta along the run.
    assert np.allclose(np.abs(force * np.cos(tilt) + load * np.sin(tilt)), radius * mu * normal / arm, rtol=1e-8)
    sign = np.sign(force * np.cos(tilt) + load * np.sin(tilt))
    by_force = np.cos(tilt) - sign * radius * mu / arm * force / normal / (1 + mu**2)
    by_tilt = -force * np.sin(tilt) + load * np.cos(tilt)
    by_friction = -sign * radius / arm * normal * (1 - mu**2 / (1 + mu**2))
    by_radius = -sign * mu * normal * (arm - radius) / arm**2
    for row, direct in enumerate((by_friction, by_radius)):
        expected = -(direct + by_tilt * d_tilt[row]) / by_force
        assert np.abs(d_force[row] - expected).max() <= 1e-6 * np.abs(expected).max()
    assert np.abs(np.abs(d_force[0]) * arm / radius / normal - 1).max() < 0.01, "dF/dmu is N, by the lever arms"


def check_free(scene: Scene, paths: Sequence[str], size: float, limit: float, times: slice) -> None:
    """Force and angles at some times, and peaks, agree with differences of runs that choose their own steps."""
    result = simulate(scene, gradients=paths)
    for index, parameter in enumerate(parameters_of(scene, paths)):
        step = size * parameter.value
        values = [parameter.value + sign * k * step for k in STEPS for sign in (1, -1)]
        runs = [simulate(changed_parameters(scene, {parameter: value})) for value in values]
        for name in ("top_force", "tilt"):
            found = extrapolated([run.dataset[name].values[times] for run in runs], step)
            error = np.abs(result.gradient[name].values[index, times] - found).max()
            assert error <= limit * np.abs(found).max(), (parameter.path, name, error / np.abs(found).max())
        for name in ("peak_displacement", "peak_top_force"):
            found = extrapolated([np.array(list(run.summary[name].values())) for run in runs], step)
            slopes = np.array(list(result.gradient_summary[parameter.path][name].values()))
            assert np.abs(slopes - found).max() <= limit * np.abs(found).max(), (parameter.path, name)


def test_differences_with_free_steps_in_a_triple_pendulum() -> None:
    scene = replace(triple(4.0, rtol=1e-9), output_step=0.1)
    check_free(scene, ["bearing.surfaces[0].radius", "motion.scale"], 4e-3, 1e-5, slice(None))


def through_rims(duration: float, rtol: float) -> Scene:
    """Test 5 of PEER 2017/07 with damped contacts: two sliders meet their rims, and leave them."""
    scene = scene_of("fenz-test5", solver={"rtol": rtol}, duration=duration, output_step=0.5)
    return replace(scene, bearing=scene.bearing.replace(**DAMPED))


@pytest.mark.parametrize(
    ("duration", "rtol", "events"),
    [(26.0, 1e-7, 1), pytest.param(60.0, 3e-9, 4, marks=pytest.mark.slow)],
)
def test_differences_with_free_steps_through_rim_contacts(duration: float, rtol: float, events: int) -> None:
    """Rows within a second of an event are left out: the differences shift the event."""
    sizes = {"bearing.surfaces[0].capacity": 2e-3, "motion.scale": 2e-3}
    scene = through_rims(duration, rtol)
    result = simulate(scene, gradients=list(sizes))
    assert len(result.events) == events
    time = result.history.time
    calm = ~np.any([np.abs(time - e.time) < 1.0 for e in result.events], axis=0)
    for index, parameter in enumerate(parameters_of(scene, list(sizes))):
        step = sizes[parameter.path] * parameter.value
        values = [parameter.value + sign * k * step for k in STEPS for sign in (1, -1)]
        runs = [simulate(changed_parameters(scene, {parameter: value})).dataset for value in values]
        for name, rows in (("top_force", calm), ("tilt", calm), ("event_time", slice(None))):
            found = extrapolated([run[name].values[rows] for run in runs], step)
            error = np.abs(result.gradient[name].values[index][rows] - found).max()
            limit = 2e-2 if name == "event_time" else 1e-4  # rates of an event ring
            assert error <= limit * np.abs(found).max(), (parameter.path, name, error / np.abs(found).max())
