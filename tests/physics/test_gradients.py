"""Gradients of runs against differences of runs with the same steps, and against closed forms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from support import Array, scene_of
from support.gradients import DAMPED, derivative, double, heated, lifting, single, step_of, triple, values_around

from msfp_gen import Effects, Load, Motion, Rotation, Scene, simulate
from msfp_gen.model.model import Model, build_model
from msfp_gen.results.gradients import ENERGIES
from msfp_gen.results.history import ENERGY
from msfp_gen.scene.effect_selection import quasistatic
from msfp_gen.scene.parameters import Parameter, changed_parameters, parameters_of
from msfp_gen.simulation.bearing_run import BearingRun
from msfp_gen.simulation.gradients import start_gradients
from msfp_gen.simulation.rows import unpacked

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
HEAT = (
    "bearing.surfaces[0].reference_pressure", "bearing.surfaces[0].velocity_rate",
    "bearing.surfaces[0].start_temperature", "bearing.surfaces[0].conductivity", "bearing.surfaces[0].diffusivity",
    "bearing.surfaces[0].patch_radius",
)  # fmt: skip
PLATES = ("bearing.surfaces[0].plate_thickness", "bearing.surfaces[1].plate_thickness")
PLATE_HEAT = (
    "bearing.surfaces[0].diffusivity", "bearing.surfaces[1].diffusivity", "bearing.surfaces[0].conductivity",
)  # fmt: skip
STATE = ("initial_state.q[0][0]", "initial_state.q[1][1]", "initial_state.v[1][1]", "initial_state.h[0][0]")
WEAK = ("contact_damping", "mass", "centroid", "gravity", "stiffness", "damping", "rotational_stiffness",
        "rotational_damping")  # fmt: skip
CHECKED = ("tilt_angles", "tilt_rates", "friction_state", "normal_force", "top_force", "top_moment", "displacement",
           "square_of_sliding", *ENERGY)  # fmt: skip
# A term may be small beside the others: the energies of a state, and the closing error, which all of them determine.
TOGETHER = dict.fromkeys(ENERGIES, ENERGIES) | {"numerical": tuple(ENERGY)}
ROUNDING = {"top_dissipated": 4e-10}
"""Over the quantity, where it is more than 1e-11: velocities across a stiff spring are differences of larger ones."""


class FrozenSteps:
    """Runs of a scene with the steps that it takes at its tolerance, and with Newton's method converged further.

    steps: ends of other steps [s]. output_step: of rows at even times, which are interpolated [s]; None: at the steps.
    """

    def __init__(self, scene: Scene, steps: Array | None = None, output_step: float | None = None) -> None:
        self.steps = simulate(scene).history.time[1:] if steps is None else steps
        self.scene = replace(scene, solver=replace(scene.solver, rtol=1e-10), output_step=output_step)
        self.model: Model = build_model(scene.bearing.layout, scene.modelled, gradients=True)

    def run(self, scene: Scene, parameters: Sequence[Parameter]) -> tuple[dict[str, Any], list[dict[str, Any]]]:
        """Rows by field, and their derivatives with respect to each parameter."""
        run, azimuth = BearingRun.of(scene).start_segment(self.model)
        start_gradients(run, scene, self.model, parameters, list(self.steps), energies=True)
        while run.advance():
            pass
        assert run.status[0] == "ok"
        assert run.counts["steps"] == len(self.steps)
        rows = run.gradient_rows(len(parameters))
        found = [unpacked(self.model, each, azimuth, True) for each in (run.rows, *np.moveaxis(rows, 1, 0))]
        values, *slopes = [fields | fields["energy"] for fields in found]
        for slope in slopes:  # sliding has a kink at the centre
            slope["square_of_sliding"] = 2 * values["sliding"] * slope["sliding"]
        values["square_of_sliding"] = values["sliding"] ** 2
        return values, slopes[: len(parameters)]

    def differences(self, parameter: Parameter, step: float) -> dict[str, Array]:
        """Richardson-extrapolated central differences."""
        changed = [changed_parameters(self.scene, {parameter: value}) for value in values_around(parameter, step)]
        runs = [self.run(scene, ())[0] for scene in changed]
        return {name: derivative([run[name] for run in runs], step)[0] for name in checked_of(runs[0])}


def checked_of(values: dict[str, Any]) -> tuple[str, ...]:
    """Names of the rows whose derivatives are checked."""
    return (*CHECKED, "temperature") if values.get("temperature") is not None else CHECKED


def check_frozen(
    scene: Scene,
    paths: Sequence[str],
    size: float = 1e-4,
    weak: float = 100.0,
    steps: Array | None = None,
    rounding: float = 1e-11,
    output_step: float | None = None,
) -> dict[str, Any]:
    """Every derivative agrees to 1e-6 of its largest value, but for the rounding of the differences; returns the rows.

    Newton's method stops at 1e-10 of the friction, and mostly far below; a difference divides that by its step.
    size: of that step, over the parameter; `weak` times that of parameters on which the run depends weakly. steps,
    output_step: of `FrozenSteps`. rounding: of the runs, over the quantity.
    """
    frozen = FrozenSteps(scene, steps, output_step)
    parameters = parameters_of(scene, paths)
    values, slopes = frozen.run(frozen.scene, parameters)
    for parameter, slope in zip(parameters, slopes, strict=True):
        if parameter.value == 0 and parameter.least is not None:
            continue  # at its bound, which a difference crosses
        step = step_of(parameter, weak * size if parameter.field in WEAK else size)
        found = frozen.differences(parameter, step)
        for name in checked_of(values):
            together = TOGETHER.get(name, (name,))
            largest, value = (max(np.abs(each[other]).max() for other in together) for each in (found, values))
            noise = max(ROUNDING.get(name, 0.0), rounding) * value / step
            error = np.abs(slope[name] - found[name]).max()
            assert error <= 1e-6 * largest + noise, (parameter.path, name, error / largest)
    return values


def test_differences_with_the_same_steps_in_a_triple_pendulum() -> None:
    check_frozen(triple(3.0), [*STACK, *RIG, *STATE, "motion.direction"])


def test_differences_with_the_same_steps_of_fourth_order() -> None:
    """With small changes only: steps that are prescribed do not become shorter where a larger change asks for it."""
    scene = triple(3.0, method="esdirk4")
    check_frozen(scene, [*STACK, *RIG], weak=1.0)
    check_frozen(scene, [*STATE[:3], "motion.direction"], 1e-5)
    check_frozen(scene, STATE[3:], 1e-7)


def test_differences_with_the_same_steps_of_interpolated_rows() -> None:
    """Large steps, whose friction state exceeds 1: it bounds that of the rows between them, which exceed it."""
    scene = triple(3.0, rtol=1e-2)
    values = check_frozen(scene, ["bearing.surfaces[*].friction", *RIG[:2], "motion.scale"], output_step=0.05)
    size = np.linalg.norm(values["friction_state"][:, 0], axis=1)
    most = size.max()
    assert most > 1.0 + 1e-4 and (size > most - 1e-12).sum() > 1


def test_the_load_before_a_jump_counts_in_the_step_that_ends_there() -> None:
    """A side load that jumps twice within a run, above a base that starts beside the origin, and its rig with it."""
    load = Load.from_arrays([0.0, 0.2, 0.2, 0.5, 0.5, 0.7], np.outer([1.0, 1.0, -1.0, -1.0, 2.0, 2.0], [4e3, 0.0, 2e3]))
    scene = triple(0.7)
    beside = scene.motion.coefficients.copy()
    beside[:, :2, 0] += 0.02, -0.01
    motion = replace(scene.motion, coefficients=beside)
    # By smaller differences, what Newton's method leaves is 1e-6 of the moments and more.
    check_frozen(replace(scene, motion=motion, motion_table=None, load=load), ["load.scale", "motion.scale"], 2e-3)


@pytest.mark.slow
def test_differences_with_the_same_steps_in_a_double_pendulum_below_a_mass() -> None:
    check_frozen(double(), [*STACK, *MASS, *STATE, "motion.direction"], 5e-5, weak=1.0)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["implicit", "esdirk4"])
def test_differences_with_the_same_steps_through_frictional_heating(method: str) -> None:
    scene = heated(patch_radius=0.15)
    values = check_frozen(replace(scene, solver=replace(scene.solver, method=method)), [*STACK, *HEAT], 1e-5, weak=1.0)
    assert values["temperature"].max() > 40.0


def test_differences_with_the_same_steps_through_plates_of_a_thickness() -> None:
    """One plate is thin enough that its back face matters within the run, the other a half-space."""
    scene, (thin, thick) = heated(patch_radius=0.03), PLATES
    bearing = scene.bearing.replace(plate_thickness=[2e-3, 0.3])
    effects = replace(scene.effects, friction="pvtd", dimension="planar")
    scene = replace(scene, bearing=bearing, effects=effects, output_step=None)
    values = check_frozen(scene, [thin, thick, *PLATE_HEAT], 1e-5, weak=1.0)
    assert values["temperature"].max() > 40.0
    parameters = parameters_of(scene, PLATES)
    frozen = FrozenSteps(scene)
    _, (of_thin, of_thick) = frozen.run(frozen.scene, parameters)
    assert np.abs(of_thin["top_force"]).max() > 0 and np.abs(of_thick["top_force"]).max() == 0


@pytest.mark.slow
def test_extremes_of_a_friction_law_that_heats_are_those_of_the_steps() -> None:
    """With a row at every step their derivatives are those of the rows."""
    scene = heated(patch_radius=0.15)
    scene = replace(scene, output_step=None, effects=replace(scene.effects, dimension="planar"))
    result = simulate(scene, gradients=["bearing.surfaces[0].conductivity"], gradient_errors=False)
    mu, temperature = result.history.friction_coefficient, result.history.temperature
    assert mu is not None and temperature is not None and temperature.max() > 40.0
    summary, slopes = result.gradient_summary["bearing.surfaces[0].conductivity"], result.gradient
    for key, name, rows in (
        ("least_friction", "friction_coefficient", mu.argmin(axis=0)),
        ("most_friction", "friction_coefficient", mu.argmax(axis=0)),
        ("peak_temperature", "temperature", temperature.argmax(axis=0)),
    ):
        expected = slopes[name].values[0][rows, np.arange(rows.size)]
        assert np.abs(expected).max() > 0
        np.testing.assert_allclose(summary[key], expected, rtol=1e-9, err_msg=key)


def test_the_largest_force_along_each_axis_is_differentiated_where_it_occurs() -> None:
    scene = triple(3.0)
    scene = replace(scene, motion=scene.motion.rotated(0.6), motion_table=None)
    result = simulate(scene, gradients=["bearing.surfaces[0].friction"], gradient_errors=False)
    force, slope = result.history.top_force, result.gradient["top_force"].values[0]
    radial = np.hypot(force[:, 0], force[:, 1])
    rows = [*np.abs(force).argmax(axis=0), radial.argmax()]
    along = [np.sign(force[rows[axis], axis]) * slope[rows[axis], axis] for axis in range(3)]
    expected = [*along, force[rows[3], :2] @ slope[rows[3], :2] / radial[rows[3]]]
    assert np.abs(expected[:2]).min() > 0
    summary = result.gradient_summary["bearing.surfaces[0].friction"]["peak_force"]
    np.testing.assert_allclose([*summary.values()], expected, rtol=1e-9)


@pytest.mark.slow
def test_differences_with_the_same_steps_through_friction_that_falls_with_the_path() -> None:
    scene = double()
    bearing = scene.bearing.replace(friction_slow=None, velocity_rate=None, c1=0.3, c2=0.02)
    effects = Effects(friction="custom", friction_law="mu * (1 - c1 * (1 - exp(-s / c2)))", rims=False)
    paths = ["bearing.surfaces[*].friction", "bearing.surfaces[0].radius", "bearing.surfaces[0].c1", "motion.scale"]
    check_frozen(replace(scene, bearing=bearing, effects=effects), paths, 1e-5, weak=1.0)


@pytest.mark.slow
def test_differences_with_the_same_steps_where_a_patch_uncovers_the_centre() -> None:
    """With small changes: the second derivative of the heat flux jumps where the patch begins to leave the centre."""
    check_frozen(heated(patch_radius=0.03), ["bearing.surfaces[0].patch_radius", "bearing.surfaces[0].radius"], 1e-6)


@pytest.mark.slow
def test_differences_with_the_same_steps_between_plates_that_rotate() -> None:
    """Base and support of the top plate rock about different axes."""
    scene = triple(3.0)
    motion = scene.motion.rocking(Rotation.harmonic(psi=0.004, theta=-0.002, frequency=0.6, cycles=1.75))
    support = Rotation.harmonic(psi=-0.003, theta=0.005, frequency=0.5, cycles=1.5)
    effects = replace(scene.effects, top_rotation=True)
    scene = replace(scene, motion=motion, motion_table=None, top_rotation=support, effects=effects)
    check_frozen(scene, [*STACK, *RIG], 1e-5, weak=10.0)


@pytest.mark.slow
@pytest.mark.parametrize("hysteresis", ["report", "plastic"])
def test_differences_with_the_same_steps_in_quasi_static_runs(hysteresis: str) -> None:
    without_effect = ("mass", "centroid", "inertia[0]", "rim_radius", "base_height", "damping", "rotational_damping")
    paths = [path for path in (*STACK, *RIG) if path.rpartition(".")[2] not in without_effect]
    check_frozen(single(hysteresis), [*paths, "initial_state.h[0][0]"], weak=10.0)


@pytest.mark.slow
def test_works_where_no_rate_rings() -> None:
    """Third-order weights integrate the works where the error is below the tolerance.

    Here it is in most steps, although the tolerance of Newton's method is small: the slider slides, so that Y has
    hardly an error, and that of angles does not count.
    """
    scene = single()
    solver = replace(scene.solver, atol_angle=1e3)
    scene = replace(scene, motion=Motion.harmonic(0.1, 0.5, cycles=1.0), duration=0.45, solver=solver)
    scene = replace(scene, top=replace(scene.top, damping=1e6))
    assert not quasistatic(scene, scene.modelled)
    times = simulate(replace(scene, solver=replace(solver, atol_angle=None, rtol=1e-6))).history.time
    steps = np.concatenate([times[(times > 0) & (times < 0.1)], np.linspace(0.1, 0.45, 46)])
    paths = ["bearing.surfaces[0].friction", "bearing.surfaces[0].radius", "top.axial_load", "motion.scale"]
    check_frozen(scene, paths, steps=steps)


@pytest.mark.parametrize("spin", ["locked", pytest.param("patch", marks=pytest.mark.slow)])
def test_works_of_spin_under_a_motion_in_two_directions(spin: str) -> None:
    """Of the moments that lock it, and of the drilling moment of contact patches."""
    time = np.linspace(0.0, 2.0, 401)
    wave = np.sin(np.pi * time)
    motion = Motion.from_arrays(time, np.column_stack([0.05 * wave, 0.035 * wave**2, 0.0 * wave]))
    scene = replace(triple(0.6), motion=motion, motion_table=None)
    scene = replace(scene, effects=replace(scene.modelled, spin=spin))
    check_frozen(scene, ["bearing.surfaces[0].friction", "bearing.surfaces[0].radius", "motion.scale"], 1e-5)


@pytest.mark.parametrize(
    ("method", "damping", "count", "sizes"),
    [("implicit", 8000.0, 640, (2e-7, 2e-7)), ("esdirk4", 2000.0, 900, (2e-7, 1e-6))],
)
def test_works_through_a_rim_contact_with_the_same_steps(
    method: str, damping: float, count: int, sizes: tuple[float, float]
) -> None:
    """Even steps, of which no stage meets or leaves a rim because of a difference; after some the damper would pull."""
    scene = scene_of("fenz-test2", solver={"method": method}, duration=0.3, stop=None, motion_table=None)
    scene = replace(scene, motion=Motion.harmonic(0.12, 2.0))
    scene = replace(scene, bearing=scene.bearing.replace(rim_damping=damping, **DAMPED))
    paths, steps = ["rim_stiffness", "rim_damping", "radius"], np.linspace(0.0, 0.3, count + 1)[1:]
    check_frozen(scene, ["bearing.surfaces[0].capacity"], sizes[0], steps=steps)
    values = check_frozen(
        scene, [*(f"bearing.surfaces[0].{name}" for name in paths), "motion.scale"], sizes[1], 1.0, steps
    )
    gap, force = values["gap"][:, 0], values["rim_force"][:, 0]
    assert np.any((gap < 0) & (force == 0))
    assert values["rim_dissipated"][-1] > 0.3


def test_the_closing_error_of_the_energy_balance_hardly_depends_on_parameters() -> None:
    """Input less all other terms is the error of the integration, and so is its derivative."""
    paths = ["bearing.surfaces[*].friction", "bearing.surfaces[0].radius", "top.axial_load", "motion.scale"]
    for rtol, limit in ((1e-6, 1e-4), (1e-8, 1e-6)):
        scene = replace(triple(rtol=rtol, method="esdirk4"), output_step=0.1)
        found = simulate(scene, gradients=paths, energy_gradients=True).gradient
        for index in range(len(found.parameter)):
            largest = np.abs(found.energy_input.values[index]).max()
            assert np.abs(found.energy_numerical.values[index]).max() <= limit * largest


UNILATERAL = (
    "bearing.surfaces[*].friction", "bearing.surfaces[0].radius", "bearing.bodies[0].mass",
    "bearing.bodies[0].rim_radius", "bearing.gravity", "top.mass", "top.vertical_stiffness", "motion.scale",
    "bearing.surfaces[0].seat_stiffness", "bearing.surfaces[1].seat_damping",
)  # fmt: skip


def check_beside_noise(
    scene: Scene, sizes: Sequence[float], names: Sequence[str], most: float, unconverged: float = 1e-9
) -> None:
    """Every derivative agrees as exactly as differences know it: stiff contacts magnify the last digit of the runs.

    sizes: of steps over the parameter; of each quantity the median of the three differences that are known best
    counts, with the largest uncertainty of these. Small steps suffer from rounding, where one uncertainty may be small
    by chance, and large ones cross the opening or closing of a contact at another step. most: of the uncertainty, over
    the largest derivative. unconverged: what Newton's method leaves of a quantity, over it.
    """
    frozen = FrozenSteps(scene)
    for parameter in parameters_of(frozen.scene, UNILATERAL):
        values, (slope,) = frozen.run(frozen.scene, [parameter])
        found: dict[str, list[tuple[float, Array]]] = {name: [] for name in names}
        for step in (step_of(parameter, size) for size in sizes):
            changed = (changed_parameters(frozen.scene, {parameter: value}) for value in values_around(parameter, step))
            runs = [frozen.run(other, ())[0] for other in changed]
            for name in names:
                difference, noise = derivative([run[name] for run in runs], step)
                found[name].append((noise.max(), difference))
        best: dict[str, tuple[float, Array]] = {}
        for name, differences in found.items():
            noises, known = zip(*sorted(differences, key=lambda each: each[0])[:3], strict=True)
            best[name] = (max(noises), np.median(known, axis=0))
        for name, (noise, difference) in best.items():
            together = TOGETHER.get(name, (name,))
            largest = max(np.abs(best[other][1]).max() for other in together)
            error = np.abs(slope[name] - difference).max()
            left = unconverged * max(np.abs(values[other]).max() for other in together)
            about = (parameter.path, name, error, noise, largest)
            assert noise <= most * largest + left / abs(parameter.value), about
            # Both the uncertainty and the error are a few rounding errors of runs over the step.
            assert error <= 1e-6 * largest + 4.0 * noise + left / abs(parameter.value), about


@pytest.mark.slow
@pytest.mark.parametrize("effects", [{}, {"rims": True}, {"dimension": "planar"}, {"spin": "free"}])
def test_differences_with_the_same_steps_of_unilateral_contacts(effects: dict[str, Any]) -> None:
    """That stay closed. The settlement at the start, stiffness in series and footprint depend on parameters too.

    Moments of a free spin are small beside those that Newton's method balances to 1e-9.
    """
    scene = lifting(0.1, 0.12, **effects)
    assert not simulate(scene).events
    names = (*CHECKED, "separation")
    sizes = (1e-2, 7e-3, 5e-3, 1e-3, 7e-4, 5e-4, 1e-4, 7e-5, 5e-5, 1e-5)
    check_beside_noise(scene, sizes, names, 1e-4, 3e-7 if "spin" in effects else 1e-9)


@pytest.mark.slow
def test_differences_with_the_same_steps_through_lift_off_and_landing() -> None:
    scene = lifting(0.2, 0.112)
    assert [event.kind for event in simulate(scene).events] == ["lift_off", "landing"]
    names = ("tilt_angles", "tilt_rates", "friction_state", "normal_force", "top_force", "separation")
    sizes = (1.4e-5, 1e-5, 7e-6, 1e-6, 3e-7, 1e-7, 1.4e-8, 1e-8, 7e-9)
    check_beside_noise(scene, sizes, names, 1e-3)


@pytest.mark.slow
def test_a_flight_in_closed_form() -> None:
    """A mass on closed contacts lifts off where the base falls with the acceleration -g, and then flies freely.

    The contacts are so stiff that their compliance does not count.
    """
    heave = 1.0
    scene = lifting(heave, 0.12, dimension="planar")
    top = replace(scene.top, vertical_stiffness=0.0, vertical_damping=0.0)
    bearing, solver = scene.bearing.replace(seat_stiffness=5e11), replace(scene.solver, rtol=1e-7)
    scene = replace(scene, top=top, bearing=bearing, solver=solver, output_step=5e-4)
    result = simulate(scene, gradients=["motion.scale", "bearing.gravity"], gradient_errors=False)
    event = result.events[0]
    assert event.kind == "lift_off"
    rate, gravity = 8 * np.pi, scene.bearing.gravity
    sine = np.sin(rate * event.time)
    share = 3 * (2 * sine - 3 * sine**3)  # of the amplitude times the squared rate
    assert heave * share == pytest.approx(-1.0, rel=0.02)
    jerk = heave * gravity * rate * 3 * (2 - 9 * sine**2) * np.cos(rate * event.time)
    found = result.gradient.event_time.sel(event=0).values
    assert found == pytest.approx([gravity / jerk, -1.0 / jerk], rel=0.03)
    time = result.history.time
    rows = time > event.time
    base, at = (heave * gravity / rate**2 * np.sin(rate * t) ** 3 for t in (time[rows], event.time))
    speed = heave * gravity / rate * 3 * sine**2 * np.cos(rate * event.time)
    slopes = [at + speed * (time[rows] - event.time) - base, -0.5 * (time[rows] - event.time) ** 2]
    lift = result.gradient.lift.values.sum(axis=2)[:, rows]
    assert lift == pytest.approx(np.array(slopes), abs=0.05 * np.abs(slopes[0]).max())


def normal_force(load: float, tilt: float, mu: float, arms: float) -> float:
    """N of `test_a_single_pendulum_in_closed_form`, by iteration. arms: R/a with the sign of the slip."""
    normal = load
    for _ in range(50):
        force = (load * np.sin(tilt) + arms * mu * normal) / np.cos(tilt)
        normal = np.sqrt((force**2 + load**2) / (1 + mu**2))
    return normal


def dissipated(tilts: Array, load: float, mu: float, radius: float, arm: float, depth: float) -> float:
    """mu N times the path of a single pendulum between tilts, less what friction does not dissipate after a reversal.

    Friction then goes from -Y to zero over the slip d_y, without loss, and by dY/ds = 1 - Y^2 to 1, which dissipates
    less than at Y = 1 by the slip d_y (1/2 + ln 2); at the start only that.
    """
    points, weights = np.polynomial.legendre.leggauss(20)
    total = 0.0
    for index, (begin, end) in enumerate(pairwise(tilts)):
        middle, half, sign = (begin + end) / 2, abs(end - begin) / 2, np.sign(end - begin)
        forces = [normal_force(load, middle + half * x, mu, sign * radius / arm) for x in points]
        missing = depth * ((1.5 if index else 0.5) + np.log(2)) * normal_force(load, begin, mu, 0.0)
        total += mu * (radius * half * float(weights @ forces) - missing)
    return total


@pytest.mark.slow
def test_energy_dissipated_by_a_single_pendulum_in_closed_form() -> None:
    """Two cycles at constant friction: mu N times the path, and its derivative."""
    scene = single()
    solver = replace(scene.solver, rtol=1e-9, max_step=5e-3)
    scene = replace(scene, top=replace(scene.top, stiffness=1e12), solver=solver)
    result = simulate(scene, gradients=["bearing.surfaces[0].friction"], energy_gradients=True)
    surface, tilt, load = scene.bearing.surfaces[0], result.history.tilt_angles[:, 0, 1], scene.top.axial_load
    direction = np.sign(np.diff(tilt))
    turns = [0, *(1 + np.flatnonzero(direction[1:] * direction[:-1] < 0)), len(tilt) - 1]
    rest = (surface.radius, surface.radius - scene.bearing.bodies[0].height, surface.yield_displacement)
    mu, step = surface.friction, 1e-4
    below, at, above = (dissipated(tilt[turns], load, mu + shift, *rest) for shift in (-step, 0.0, step))
    assert result.history.energy["friction_dissipated"][-1] == pytest.approx(at, rel=2e-5)
    found = float(result.gradient.energy_friction_dissipated.values[0, -1])
    assert found == pytest.approx((above - below) / (2 * step), rel=2e-5)


@pytest.mark.slow
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
