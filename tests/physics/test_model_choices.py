"""Choices that the report leaves open, and where the model ends: what docs/model.md says of them, on real runs."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from plain import plain_scene

from msfp_gen import (
    Effects,
    InputError,
    Layout,
    Motion,
    RunError,
    Scene,
    Top,
    build_model,
    load_scene,
    presets,
    simulate,
)
from msfp_gen.scene.scene_fields import InitialState

LOAD = (0.0, 0.0, -112e3)


def orbit(spin, **changes):
    """The report's circle of 50 mm with a spin of 1e-7 rad/s in every body that may turn."""
    rates = np.zeros((4, 3))
    rates[:, 2] = 0.0 if spin == "locked" else 1e-7
    start = InitialState(np.zeros((4, 3)), rates, np.zeros((4, 2)))
    scene = replace(load_scene("becker-circle-50"), effects=Effects(spin=spin), initial_state=start, **changes)
    return simulate(scene).history


def test_free_spin_grows_from_nothing_and_a_patch_holds_it():
    spun = {spin: np.abs(orbit(spin, duration=8.0).tilt_rates[:, :, 2]) for spin in ("free", "patch")}
    assert spun["free"][0].max() == 1e-7 and spun["free"].max() > 1.0
    assert spun["patch"].max() < 0.01


def test_locked_spin_and_patch_give_the_same_loops():
    fine = replace(load_scene("becker-circle-50").solver, rtol=1e-5)
    locked, patch = (orbit(spin, solver=fine, output_step=0.2).top_force[:, :2] for spin in ("locked", "patch"))
    assert np.abs(patch - locked).max() < 2e-3 * np.abs(locked).max()


def test_rig_springs_are_anchored_where_the_run_starts():
    away = np.zeros((1, 6, 6))
    away[0, :2, 0] = 0.3, -0.2
    motion = Motion(knots=[0.0, 0.1], coefficients=away)
    history = simulate(Scene(presets.bearing("fenz-tfp"), motion, Top.rig(112e3, 1e8, 5.0, 1e6), Effects())).history
    assert np.abs(history.top_force[:, :2]).max() < 1e-6 and np.abs(history.displacement).max() < 1e-12


def test_centre_of_mass_of_the_base_never_enters():
    bearing = presets.bearing("fenz-tfp")
    rng = np.random.default_rng(0)
    q, v, h = rng.uniform(-0.1, 0.1, (4, 3)), rng.uniform(-0.1, 0.1, (4, 3)), rng.uniform(-0.5, 0.5, (4, 2))
    model = build_model(Layout.tfp(), Effects())
    rocking = (rng.uniform(-0.1, 0.1, 3), rng.uniform(-1, 1, 3), rng.uniform(-1, 1, 3))
    found = [
        model.evaluate(b, q, v, h, top_force=LOAD, base_rotation=rocking).acceleration
        for b in (bearing, replace(bearing, base_centroid=0.001))
    ]
    assert np.array_equal(*found)


def test_massless_sliders_keep_their_weight():
    bearing, zero = presets.bearing("fenz-tfp"), np.zeros((4, 3))
    model = build_model(bearing.layout, Effects(dimension="planar", sliders="massless"))
    found = model.evaluate(bearing, zero, zero, zero[:, :2], top_force=LOAD).normal_force - 112e3
    weights = 9.8 * np.array([body.mass for body in bearing.bodies])
    assert found == pytest.approx(np.cumsum(weights[::-1])[::-1], abs=1e-6)


def test_pulling_apart_stops_the_run_with_a_name():
    t = np.linspace(0.0, 2.0, 201)
    drop = Motion.from_acceleration(t, np.outer(np.sin(np.pi * t), [0.0, 0.0, -12.0]))
    scene = Scene(presets.bearing("fenz-tfp"), drop, Top.mass(11e3, 300.0, 0.5, 1e7, 1e4), Effects())
    with pytest.raises(RunError, match="uplift is not modelled") as error:
        simulate(scene)
    time = error.value.result.history.time[-1]
    assert error.value.status == "uplift"
    assert -drop.acceleration(time)[2] == pytest.approx(9.8, rel=0.02)  # free fall: the load is gone


def test_planar_model_holds_in_any_vertical_plane():
    scene = load_scene("fenz-test2")
    flat = replace(scene, effects=Effects(dimension="planar"), output_step=0.1)
    straight, turned = (simulate(replace(flat, motion=flat.motion.rotated(a))).history for a in (0.0, 0.7))
    want = straight.top_force[:, 0]
    along = turned.top_force[:, :2] @ [np.cos(0.7), np.sin(0.7)]
    assert along == pytest.approx(want, abs=1e-3 * np.abs(want).max())  # rounding may change the steps
    assert np.abs(turned.top_force[:, :2] @ [-np.sin(0.7), np.cos(0.7)]).max() < 1e-9 * np.abs(want).max()


# ---- where the model ends --------------------------------------------------------------------------------------


def extreme_states():
    """A TFP with its inner surfaces at their capacity and friction fully developed either way, all combinations."""
    for tilt in product((-0.28, 0.28), repeat=2):
        for shares in product((-1.0, 1.0), repeat=4):
            q, h = np.zeros((4, 3)), np.zeros((4, 2))
            q[1:3, 1], h[:, 0] = tilt, shares
            yield q, h


def regular(times):
    """For each extreme state, whether there is an acceleration, with friction `times` the report's."""
    bearing = presets.bearing("fenz-tfp")
    bearing = bearing.replace(friction=[times * surface.friction for surface in bearing.surfaces])
    model = build_model(bearing.layout, Effects(dimension="planar"))
    found = []
    for q, h in extreme_states():
        try:
            found.append(model.evaluate(bearing, q, 0.0 * q, h, top_force=LOAD).determinant > 0)
        except RunError:
            found.append(False)
    return np.array(found)


def test_equations_are_regular_at_the_reports_friction_and_not_at_any():
    assert regular(1.0).all()
    assert not regular(5.0).all()


def test_rigid_mass_makes_the_normal_force_follow_the_sliders():
    """Strongly different friction inside and outside: every change of stage throws the mass."""
    scene = plain_scene("ridgecrest-clc")
    peak = {}
    for name in ("prototype-tfp", "becker-tfp"):
        history = simulate(replace(scene, bearing=presets.bearing(name).replace(contact_damping=0.0))).history
        peak[name] = history.normal_force.max() / 112e3
    assert peak["prototype-tfp"] < 1.5
    assert peak["becker-tfp"] > 3.0


def test_massless_sliders_are_not_for_the_explicit_method():
    scene = load_scene("fenz-test2")
    with pytest.raises(InputError, match="dopri5"):
        simulate(replace(scene, effects=Effects(sliders="massless"), solver=replace(scene.solver, method="dopri5")))
