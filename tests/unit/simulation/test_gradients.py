"""Gradients of a run as users get them: dataset, summary, refusals and notes."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from support import scene_of
from support.stacks import a_stack, nested_radii

from msfp_gen import (
    Auto,
    Effects,
    InputError,
    Motion,
    Result,
    Rotation,
    RunError,
    Scene,
    Stop,
    Top,
    load_scene,
    simulate,
    simulate_batch,
)
from msfp_gen.model.compiled import bodies_and_surfaces, separations_at_rest, top_values
from msfp_gen.model.model import build_model
from msfp_gen.results.history import Extremes
from msfp_gen.results.result import load_result
from msfp_gen.scene.effect_selection import load_at_rest, slider_period
from msfp_gen.scene.parameters import changed_parameters, parameters_of
from msfp_gen.simulation.bearing_run import BearingRun
from msfp_gen.simulation.gradients import RESOLVED_SHARE, measured_errors, start_gradients, with_gradient_errors
from msfp_gen.simulation.start import start_slopes, state_at_rest
from msfp_gen.specification.layout import ModelSpec

PATHS = ("bearing.surfaces[*].friction", "top.axial_load", "motion.scale")


def triple(duration: float = 2.0) -> Scene:
    scene = scene_of("fenz-test2", duration=duration, output_step=0.1)
    return replace(scene, bearing=scene.bearing.replace(contact_damping=1e-3))


@cache
def result() -> Result:
    return simulate(triple(), gradients=PATHS)


@cache
def with_energies() -> Result:
    return simulate(triple(), gradients=PATHS, energy_gradients=True)


def test_a_run_with_gradients_is_the_same_run() -> None:
    plain = simulate(triple())
    for name in plain.dataset.data_vars:
        assert np.array_equal(plain.dataset[name].values, result().dataset[name].values), name
    assert plain.summary["counters"] == result().summary["counters"]


def test_a_run_with_gradients_goes_to_no_snapshot() -> None:
    """A snapshot holds no derivatives; the run goes on as if it had been given none."""
    scene = triple(0.2)
    model = build_model(scene.bearing.layout, scene.modelled, gradients=True)
    run, _ = BearingRun.of(scene).start_segment(model)
    parameters = parameters_of(scene, PATHS)
    snapshot = run.snapshot()
    run.restore(snapshot)
    start_gradients(run, scene, model, parameters)
    with pytest.raises(ValueError, match="snapshot"):
        run.restore(snapshot)
    while run.advance():
        pass
    assert run.status[0] == "ok"
    assert run.gradient_rows(len(parameters)).shape[:2] == (3, len(parameters))


def test_the_dataset_has_the_variables_that_vary_by_parameter() -> None:
    gradient, rows = result().gradient, result().dataset
    assert gradient.parameter.values.tolist()[4:] == ["top.axial_load", "motion.scale"]
    assert gradient.parameter_unit.values.tolist() == [""] * 4 + ["N", ""]
    for name, variable in gradient.data_vars.items():
        assert variable.dims == ("parameter", *rows[name].dims)
        assert variable.attrs["units"] == f"{rows[name].attrs['units']}/parameter_unit"
    left_out = set(rows.data_vars) - set(gradient.data_vars)
    works = {"input", "friction_stored", "numerical", "seat_stored"} | {
        f"{name}_dissipated" for name in ("friction", "contact", "rim", "top", "seat")
    }
    assert left_out == {"separation", "lift", "event_surface", "event_kind"} | {f"energy_{name}" for name in works}


def test_energies_are_added_and_change_nothing_else() -> None:
    gradient, rows = with_energies().gradient, result().gradient
    for name in rows.data_vars:
        assert np.array_equal(gradient[name].values, rows[name].values), name
    energies = {f"energy_{name}" for name in with_energies().history.energy if not name.startswith("seat_")}
    assert energies == {name for name in gradient.data_vars if str(name).startswith("energy_")}
    assert set(gradient.data_vars) == set(rows.data_vars) | energies
    for name in energies:
        assert gradient[name].dims == ("parameter", "time")
        assert gradient[name].attrs["units"] == "J/parameter_unit"
    terms = [gradient[name] for name in energies - {"energy_input", "energy_numerical"}]
    assert np.allclose(gradient.energy_numerical, gradient.energy_input - sum(terms), rtol=0, atol=1e-9)
    assert np.abs(gradient.energy_friction_dissipated).max() > 1.0
    plain = simulate(triple())
    assert np.array_equal(plain.dataset.energy_input.values, with_energies().dataset.energy_input.values)


def test_the_summary_has_the_energies_at_the_end() -> None:
    gradient = with_energies().gradient
    for parameter, summary in with_energies().gradient_summary.items():
        last = gradient.sel(parameter=parameter).isel(time=-1)
        assert "seat_stored" not in summary["energy"]
        assert summary["energy"] == {name: float(last[f"energy_{name}"]) for name in summary["energy"]}


def test_the_top_support_carries_the_load() -> None:
    assert np.allclose(result().gradient.top_force.sel(parameter="top.axial_load", axis="E3"), 1.0, rtol=1e-6)


def test_the_summary_has_derivatives_by_parameter() -> None:
    summary = result().gradient_summary
    assert list(summary) == result().gradient.parameter.values.tolist()
    load = summary["top.axial_load"]
    assert set(load) <= set(result().summary)
    force, peak = load["peak_force"]["radial"], result().summary["peak_force"]["radial"]
    weight = result().summary["axial_load"]
    assert load["peak_force_ratio"] == pytest.approx(force / weight - peak / weight**2)
    for key in ("rims_met", "counters", "energy"):
        with pytest.raises(InputError, match=f"gradient_summary: '{key}' has no derivative: .*; give one of peak_"):
            load[key]
    with pytest.raises(InputError, match=r"simulate\(..., energy_gradients=True\)"):
        load["energy"]


@pytest.mark.parametrize("energies", [False, True])
def test_a_file_holds_the_gradients(energies: bool, tmp_path: Path) -> None:
    given = with_energies() if energies else result()
    path = given.to_netcdf(tmp_path / "run.nc")
    read = load_result(path)
    assert read.gradient.identical(given.gradient)
    for parameter, expected in given.gradient_summary.items():
        found = read.gradient_summary[parameter]
        assert list(found) == list(expected)
        for name, value in expected.items():  # of two equal peaks rounding selects one
            pairs = (list(each.values()) if isinstance(each, dict) else each for each in (found[name], value))
            assert np.allclose(*pairs, rtol=1e-12, atol=0.0), (parameter, name)


@pytest.mark.parametrize("parameters", ["[]", "[{}]", "no JSON"])
def test_a_file_with_damaged_parameters_is_refused(parameters: str, tmp_path: Path) -> None:
    path = result().to_netcdf(tmp_path / "run.nc")
    with h5py.File(path, "a") as file:
        file["gradient"].attrs["parameters"] = np.bytes_(parameters)
    with pytest.raises(InputError, match="give a file that `run -o` wrote"):
        load_result(path)


@pytest.mark.parametrize("name", ["gap", "slip_velocity"])
def test_a_file_that_lacks_a_derivative_of_the_summary_is_refused(name: str, tmp_path: Path) -> None:
    path = result().to_netcdf(tmp_path / "run.nc")
    with h5py.File(path, "a") as file:
        del file["gradient"][name]
    with pytest.raises(InputError, match=f"the gradient has no {name}"):
        load_result(path)


def test_a_file_that_lacks_one_of_the_energies_is_refused(tmp_path: Path) -> None:
    path = with_energies().to_netcdf(tmp_path / "run.nc")
    with h5py.File(path, "a") as file:
        del file["gradient"]["energy_numerical"]
    with pytest.raises(InputError, match="energy_numerical is missing"):
        load_result(path)


class Seeds:
    """In place of a compiled run: keeps the derivatives of its inputs that it is given."""

    def start_gradients(self, **arrays: Any) -> None:
        self.arrays = arrays


@pytest.mark.parametrize("uplift", [False, pytest.param(True, marks=pytest.mark.slow)])
@pytest.mark.parametrize("layout", [(2, 0, 1), (3, 1, 1)])
def test_every_value_of_bearing_and_top_is_differentiated(layout: tuple[int, int, int], uplift: bool) -> None:
    """Derivatives of what the compiled run is given, against differences of it."""
    bearing = a_stack(layout, nested_radii(layout), reference_pressure=2e7, velocity_rate=50.0, patch_radius=None)
    bearing = replace(bearing, base_rim_radius=0.012, base_rim_offset=0.003, base_centroid=0.01)
    top = Top.mass(2e4, (3e3, 5e3), 0.7, 1e6, 2e3, vertical_stiffness=5e7, vertical_damping=2e4)
    effects = Effects(friction="pv", uplift=uplift)
    scene = Scene(bearing, Motion.harmonic(0.05, 0.5, cycles=1.0), top, effects)
    fields = ["height", "centroid", "mass", "inertia[*]", "rim_radius", "rim_offset"]
    paths = [f"bearing.bodies[*].{name}" for name in fields]
    fields = ["radius", "friction", "yield_displacement", "capacity", "rim_stiffness", "rim_damping", "contact_damping",
              "reference_pressure", "velocity_rate"]  # fmt: skip
    paths += [f"bearing.surfaces[*].{name}" for name in fields]
    paths += [f"bearing.{name}" for name in ("base_height", "base_rim_radius", "base_rim_offset", "gravity")]
    fields = ["mass", "inertia[*]", "height", "rotational_stiffness", "rotational_damping", "vertical_stiffness",
              "vertical_damping"]  # fmt: skip
    parameters = parameters_of(scene, [*paths, *(f"top.{name}" for name in fields)])
    model: Any = ModelSpec(bearing.layout, effects)
    if uplift:  # its separations at the start follow from its equations
        model = build_model(bearing.layout, effects)
    seeds: Any = Seeds()
    start_gradients(seeds, scene, model, parameters)

    def inputs(values: dict[Any, float]) -> list[Any]:
        other = changed_parameters(scene, values)
        values_of = [*bodies_and_surfaces(other.bearing, effects, other.top), top_values(other.top)]
        apart = [separations_at_rest(other.bearing, other.top)] if uplift else []
        return [*values_of, other.bearing.gravity, *apart]

    for row, parameter in enumerate(parameters):
        step = 1e-5 * (abs(parameter.value) or 1e-3)
        ends = [inputs({parameter: parameter.value + side * step}) for side in (0, 1, 2)]
        names = ("bodies", "surfaces", "top", "gravity", *(["q"] if uplift else []))
        for name, at, plus, further in zip(names, *ends, strict=True):
            slope = (4 * np.asarray(plus) - 3 * np.asarray(at) - np.asarray(further)) / (2 * step)
            found = seeds.arrays[name][row][..., 3:] if name == "q" else seeds.arrays[name][row]
            assert found == pytest.approx(slope, rel=1e-5, abs=1e-9 * np.abs(at).max() / step), (parameter.path, name)


def test_the_start_after_settling_is_differentiated_where_its_friction_is_limited() -> None:
    """The friction state of the last row, on two surfaces larger than 1, against differences of the start."""
    run = result()
    assert run.gradients is not None
    history, slope = run.history, run.gradients.arrays["friction_state"][:, -1]
    h = np.array([[1.1, 0.4], [0.3, -0.2], [0.0, -1.3], [0.7, 0.7]])
    last = replace(history, friction_state=np.concatenate([history.friction_state[:-1], h[None]]))
    dq, dh = start_slopes(last, run.gradients, parameters_of(run.scene, PATHS))
    assert np.array_equal(dq, run.gradients.arrays["tilt_angles"][:, -1]) and np.abs(slope).max() > 0
    for found, along in zip(dh, slope, strict=True):
        step = 1e-6 / np.abs(along).max()
        ends = [state_at_rest(history.tilt_angles[-1], h + side * step * along).h for side in (1, -1)]
        assert found == pytest.approx((np.array(ends[0]) - np.array(ends[1])) / (2 * step), rel=1e-6, abs=1e-9)


def test_without_gradients_there_is_none() -> None:
    plain = simulate(triple(0.5))
    for name in ("gradient", "gradient_summary"):
        with pytest.raises(InputError, match=r"call simulate\(scene, gradients="):
            getattr(plain, name)


def stopping() -> Scene:
    return replace(triple(), stop=Stop(displacement=0.01))


def tilted() -> Scene:
    return replace(triple(), motion=Motion.ramp(0.1, 3.0).rocking(Rotation.constant(0.01)), motion_table=None)


def planar() -> Scene:
    return scene_of("fenz-test2", {"dimension": "planar", "sliders": "massless", "rims": False}, duration=1.0)


@pytest.mark.parametrize(
    ("scene", "paths", "part"),
    [
        (scene_of("fenz-test2", solver={"method": "dopri5"}), PATHS, r"solver.method = 'dopri5': .*give 'implicit'"),
        (stopping(), PATHS, "stop: .*give a duration"),
        (tilted(), ["initial_state.q[0][1]"], "tilted plates start in the state after .*give an initial_state"),
        (triple(), ["bearing.surfaces[7].friction"], r"gradients = 'bearing.surfaces\[7\].friction'"),
    ],
)
def test_runs_without_gradients_are_refused_before_they_start(scene: Scene, paths: Any, part: str) -> None:
    with pytest.raises(InputError, match=part) as error:
        simulate(scene, gradients=paths)
    assert "\n" not in str(error.value)


def test_energy_gradients_need_a_parameter() -> None:
    with pytest.raises(InputError, match=r"energy_gradients = True: gradients names no parameter; give one") as error:
        simulate(triple(), energy_gradients=True)
    assert "\n" not in str(error.value)


@pytest.mark.slow
def test_energies_through_a_rim_contact_in_quasi_static_steps_are_refused() -> None:
    """Steps are as long as rows: the derivative of the error of their input work is larger than that of the work."""
    scene = load_scene("single-push")
    effects = Effects(dimension="planar", sliders="massless")
    bearing, top = scene.bearing.replace(rim_damping=0.0), replace(scene.top, damping=0.0)
    scene = replace(scene, bearing=bearing, top=top, effects=effects, stop=None, motion_table=None, output_step=0.05)
    scene = replace(scene, motion=Motion.harmonic(0.4, 0.5, cycles=2.0), duration=0.5)
    assert simulate(scene, gradients=["motion.scale"]).events[0].kind == "rim_contact"
    message = r"at 0\.4214 s surface 1 meets or leaves its rim .*give solver.method = 'esdirk4'"
    with pytest.raises(InputError, match=message):
        simulate(scene, gradients=["motion.scale"], energy_gradients=True)


def test_a_checkpoint_holds_no_gradients(tmp_path: Any) -> None:
    with pytest.raises(InputError, match=r"checkpoint = .*holds no gradients"):
        simulate(triple(), gradients=PATHS, checkpoint=tmp_path / "run.ck")


@pytest.mark.slow
def test_a_run_that_switches_effects_is_refused_by_name() -> None:
    first, second = (Motion.harmonic(0.01, 1.0, direction=angle, cycles=1.0) for angle in (0.0, np.pi / 2))
    later = Motion(np.append(0.0, 3.0 + second.knots), np.concatenate([np.zeros((1, 6, 6)), second.coefficients]))
    motion = first.held(later.duration - first.duration) + later
    effects = Auto(sliders="massless", rims=False, uplift=False)
    scene = replace(triple(), motion=motion, motion_table=None, duration=None, effects=effects)
    with pytest.raises(InputError, match=r"effects: at .* s the run continues with dimension = spatial, and gradients"):
        simulate(scene, gradients=["motion.scale"])


@pytest.mark.slow
@pytest.mark.parametrize("path", ["motion.direction", "initial_state.q[0][0]", "initial_state.h[0][1]"])
def test_a_parameter_that_leaves_the_plane_is_refused(path: str) -> None:
    with pytest.raises(InputError, match=r"leads out of the vertical plane .*give effects.dimension = 'spatial'"):
        simulate(planar(), gradients=[path])


def test_undamped_ringing_is_noted_and_refused_where_it_is_resolved() -> None:
    scene = scene_of("fenz-test2", duration=0.5)
    (note,) = simulate(scene, gradients=PATHS).notes
    assert note.kind == "ringing"
    assert "give contact_damping = 1e-4" in note.text
    with pytest.raises(InputError, match=r"resolves the undamped ringing .*give contact_damping = 1e-4"):
        simulate(replace(scene, solver=replace(scene.solver, max_step=2e-4)), gradients=PATHS)
    period = slider_period(scene.bearing, load_at_rest(scene))
    above = replace(scene, solver=replace(scene.solver, max_step=1.2 * RESOLVED_SHARE * period))
    assert [note.kind for note in simulate(replace(above, duration=0.05), gradients=PATHS).notes] == ["ringing"]


def contact(damping: float = 1e-3) -> Scene:
    """A slider meets its rim at 0.1 s."""
    scene = scene_of("fenz-test2", duration=0.2, output_step=0.05, stop=None, motion_table=None)
    bearing = scene.bearing.replace(contact_damping=damping)
    return replace(scene, motion=Motion.harmonic(0.12, 1.0), bearing=bearing)


@cache
def after_contact() -> Result:
    return simulate(contact(), gradients=["motion.scale", "bearing.surfaces[0].capacity"])


@cache
def without_errors() -> Result:
    return simulate(contact(), gradients=["motion.scale"], gradient_errors=False)


def test_a_run_with_gradients_through_a_rim_contact_is_the_same_run() -> None:
    plain = simulate(contact())
    for name in plain.dataset.data_vars:
        assert np.array_equal(plain.dataset[name].values, after_contact().dataset[name].values), name
    assert plain.summary["counters"] == after_contact().summary["counters"]


def test_each_derivative_has_its_error_where_a_rim_is_met(tmp_path: Path) -> None:
    gradient = after_contact().gradient
    derivatives = {str(name) for name in gradient.data_vars if not str(name).endswith("_error")}
    assert set(gradient.data_vars) == derivatives | {f"{name}_error" for name in derivatives}
    for name in derivatives:
        error = gradient[f"{name}_error"]
        assert error.dims == gradient[name].dims
        assert error.attrs == {
            "units": gradient[name].attrs["units"],
            "long_name": f"error of the {gradient[name].attrs['long_name']}",
        }
        assert np.all(error >= 0)
    assert 0 < gradient.sliding_error.max() < 0.1 * np.abs(gradient.sliding).max()
    read = load_result(after_contact().to_netcdf(tmp_path / "run.nc"))
    assert read.gradient.identical(gradient)
    for parameter, summary in after_contact().gradient_summary.items():
        assert set(summary["error"]) == set(summary) - {"error"}
        assert summary["error"] == read.gradient_summary[parameter]["error"]
        assert np.all(np.array(summary["error"]["peak_sliding"]) >= 0)


def test_the_largest_rim_force_is_differentiated_where_it_occurs() -> None:
    found = simulate(replace(contact(), output_step=None), gradients=["motion.scale"], gradient_errors=False)
    row = int(found.history.rim_force[:, 0].argmax())
    slope = found.gradient.rim_force.sel(parameter="motion.scale").values[row, 0]
    assert found.summary["peak_rim_force"][0] == found.history.rim_force[row, 0] > 0
    assert found.gradient_summary["motion.scale"]["peak_rim_force"][0] == pytest.approx(slope, rel=1e-9) != 0


def test_without_a_rim_contact_or_on_request_no_error_is_measured() -> None:
    for found in (result(), without_errors()):
        assert not [name for name in found.gradient.data_vars if str(name).endswith("_error")]
        with pytest.raises(InputError, match="'error' has no derivative: errors are measured where a slider meets"):
            found.gradient_summary["motion.scale"]["error"]


def test_an_error_is_three_times_the_difference_until_the_next_event() -> None:
    given = after_contact()
    gradients = given.gradients
    assert gradients is not None
    before = given.history.time < given.events[0].time
    sliding = gradients.arrays["sliding"]
    shifted = sliding + np.where(before, 1.0, -2.0)[:, None] * np.linspace(1.0, 0.0, len(before))[:, None]
    other = replace(gradients, arrays=gradients.arrays | {"sliding": shifted})
    error = measured_errors(given, replace(given, gradients=other)).arrays["sliding"]
    expected = 3 * np.where(before, 1.0, 2.0) * np.linspace(1.0, 0.0, len(before))
    assert np.allclose(error, np.broadcast_to(expected[:, None], error.shape))
    late = replace(
        gradients, arrays=gradients.arrays | {"sliding": sliding + np.linspace(0.0, 1.0, len(before))[:, None]}
    )
    error = measured_errors(given, replace(given, gradients=late)).arrays["sliding"]
    assert np.allclose(error[:, ~before], 3.0)
    assert np.allclose(error[:, before], 3 * np.linspace(0.0, 1.0, len(before))[before][-1])


def test_an_event_that_the_other_run_has_not_is_uncertain_as_a_whole() -> None:
    given = after_contact()
    assert given.gradients is not None
    error = measured_errors(given, replace(given, events=()))
    assert np.array_equal(error.arrays["event_time"], np.abs(given.gradients.arrays["event_time"]))
    assert np.all(measured_errors(given, given).arrays["event_time"] == 0)


def test_a_large_error_is_noted_and_one_that_is_not_known() -> None:
    given = without_errors()
    assert given.gradients is not None
    assert not [note for note in with_gradient_errors(given, lambda scene: given).notes if note.kind == "gradient"]
    changed = [Extremes(**{name: 1.1 * values for name, values in e.arrays.items()}) for e in given.gradients.extremes]
    rows = {name: 1.1 * values for name, values in given.gradients.arrays.items()}
    other = replace(given, gradients=replace(given.gradients, arrays=rows, extremes=tuple(changed)))
    (note,) = [note for note in with_gradient_errors(given, lambda scene: other).notes if note.kind == "gradient"]
    assert note.value == pytest.approx(0.3)
    assert "derivatives of peaks with respect to " in note.text
    assert "30%" in note.text
    assert (note.surface, note.time) == (1, given.events[0].time)

    def failing(scene: Scene) -> Result:
        assert scene.solver.rtol == given.scene.solver.rtol / 10
        raise RunError("stopped at t = 0.1 s", status="step")

    (note,) = [note for note in with_gradient_errors(given, failing).notes if note.kind == "gradient"]
    assert note.text.endswith("since the run at a tenth of the tolerance failed: stopped at t = 0.1 s")

    def interrupted(scene: Scene) -> Result:
        raise RunError("interrupted at t = 0.1 s", status="interrupted")

    with pytest.raises(RunError, match="interrupted at"):
        with_gradient_errors(given, interrupted)


def test_ringing_after_a_rim_contact_is_noted_unless_it_is_damped() -> None:
    """The critical damping of the sliders is 0.64 ms."""
    for damping, noted in ((1e-4, True), (1e-3, False)):
        given = contact(damping)
        result = simulate(given, gradients=["motion.scale"])
        found = [note for note in result.notes if note.kind == "ringing"]
        assert [(note.surface, note.time) for note in found] == [(1, result.events[0].time)] * noted
        assert all("give contact_damping = 0.001" in note.text for note in found)
        assert not any(note.kind == "ringing" for note in simulate(given).notes)


def test_batches_are_as_before() -> None:
    assert simulate_batch([triple(0.2)])[0].gradients is None
