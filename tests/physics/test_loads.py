"""Loads and rotating plates: against statics, closed forms and each other; what scene files say of them."""

from __future__ import annotations

import pickle
import tomllib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support import thinned

from msfp_gen import Auto, Effects, InputError, Load, Motion, Rotation, Scene, Top, build_model, presets, simulate
from msfp_gen.motions.piecewise import ORDER
from msfp_gen.results.result import Result
from msfp_gen.scene.file.loader import scene_from_table, scene_text
from msfp_gen.simulation.bearing_run import settle
from msfp_gen.simulation.start import needs_settling, settling_scene
from msfp_gen.studies.accuracy.methods import run_library
from msfp_gen.studies.accuracy.series import run_opensees, run_series

STILL = Motion(np.array([0.0, 12.0]), np.zeros((1, 6, ORDER)))
PUSH = Motion.harmonic(0.1, 0.1, cycles=2)
WEIGHT = 1e6
RIG = Top.rig(WEIGHT, stiffness=1e9, damping=1e3, rotational_stiffness=1e10, rotational_damping=1e6)


def double(**more: Any) -> Scene:
    """A double pendulum on a stiff rig."""
    given = {"motion": PUSH, "top": RIG, "output_step": 0.05, "effects": Auto(rims=True), **more}
    return Scene(presets.bearing("double-fp"), **given)


def middle(result: Result) -> float:
    """Horizontal force halfway between the branches of the last cycle, over the weight."""
    force = result.history.top_force[result.history.time > PUSH.duration - 10.0, 0] / WEIGHT
    return float(force.max() + force.min()) / 2


def offset(scene: Scene, base: float, top: float) -> float:
    """F/N of a double pendulum without friction at no displacement, plates turned about r_01 and r_nn: the line through
    both sphere centres, which carries the load, leans.
    """
    bearing = scene.bearing
    below = bearing.base_height + bearing.surfaces[0].radius
    above = bearing.bodies[-1].height + bearing.surfaces[1].radius
    height = bearing.base_height + sum(body.height for body in bearing.bodies)
    return (below * base + above * top) / (below + above - height)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("base", "top"),
    thinned([(0.01, 0.0), (0.0, 0.01), (0.01, 0.01), (0.01, -0.01)], lambda base, top: base == -top),
)
def test_a_tilted_plate_shifts_the_loop_by_the_lean_of_the_line_of_force(base: float, top: float) -> None:
    motion = PUSH.rocking(Rotation.constant(theta=base)) if base else PUSH
    scene = double(motion=motion, top_rotation=Rotation.constant(theta=top) if top else None)
    assert middle(simulate(scene)) == pytest.approx(offset(scene, base, top), abs=1e-2 * (abs(base) + abs(top)))


@pytest.mark.slow
def test_tilt_about_e1_is_tilt_about_e2_seen_from_the_side() -> None:
    """A quarter turn takes E1 to E2, and theta, a tilt towards E1, to -psi, the same tilt towards E2."""
    one = simulate(double(motion=PUSH.rocking(Rotation.constant(theta=0.01)), top_rotation=Rotation.constant(0, 0.005)))
    aside = Motion.harmonic(0.1, 0.1, cycles=2, direction=np.pi / 2).rocking(Rotation.constant(psi=-0.01))
    two = simulate(double(motion=aside, top_rotation=Rotation.constant(-0.005, 0)))
    assert two.provenance["model"] == one.provenance["model"] and "planar" in one.provenance["model"]
    np.testing.assert_allclose(two.history.top_force[:, 1], one.history.top_force[:, 0], atol=1e-6 * WEIGHT)


@pytest.mark.slow
def test_a_planar_run_with_turning_plates_is_the_spatial_one() -> None:
    rocking = Rotation.harmonic(theta=0.004, frequency=0.2, cycles=3.75)
    scene = double(motion=PUSH.rocking(Rotation.ramp(theta=0.01, duration=5.0)), top_rotation=rocking)
    flat, full = simulate(scene), simulate(replace(scene, effects=Effects(top_rotation=True)))
    assert "planar" in flat.provenance["model"] and "spatial" in full.provenance["model"]
    difference = np.abs(flat.history.top_force - full.history.top_force).max()
    assert difference < 5e-3 * np.abs(full.history.top_force[:, 0]).max()


@pytest.mark.slow
@pytest.mark.parametrize(
    "effects",
    [Auto(rims=True), Effects(top_rotation=True)],
    ids=["auto", "everything"],
)
def test_energy_closes_with_loads_and_turning_plates(effects: Auto | Effects) -> None:
    load = Load.harmonic((0.0, 0.0, 0.3 * WEIGHT), frequency=0.2, cycles=4)
    scene = double(
        load=load,
        motion=PUSH.rocking(Rotation.ramp(theta=0.01, duration=5.0)),
        top_rotation=Rotation.harmonic(theta=0.004, frequency=0.2, cycles=3.75),
        effects=effects,
    )
    assert simulate(scene).summary["energy"]["closure_error"] < 3e-3


def test_plates_are_settled_where_they_are_tilted_at_the_start() -> None:
    """And not where they are level there and tilted later."""
    from_tilt = Rotation.from_arrays([0.0, 0.5, 1.0, 2.0], np.outer([1.0, 0.5, 0.0, 0.0], [0.01, 0.0]))
    to_tilt = Rotation.from_arrays([0.0, 0.5, 1.0, 2.0], np.outer([0.0, 0.5, 1.0, 1.0], [0.01, 0.0]))
    for rotation, tilted in ((from_tilt, True), (to_tilt, False)):
        assert needs_settling(double(motion=STILL.rocking(rotation))) is tilted


@pytest.mark.slow
def test_a_settled_run_starts_where_the_settling_ended() -> None:
    tilted = double(motion=STILL.rocking(Rotation.constant(theta=0.01)))
    end, state = simulate(settling_scene(tilted)).history, settle(tilted)[0].initial_state
    assert state is not None and (end.tilt_angles[-1] != end.tilt_angles[-2]).any()
    np.testing.assert_array_equal(state.q, end.tilt_angles[-1])
    np.testing.assert_array_equal(state.h, end.friction_state[-1])


@pytest.mark.slow
def test_a_slider_without_friction_finds_the_lowest_point_of_a_tilted_dish() -> None:
    """In statics: with inertia a plate that nothing holds overturns from there."""
    tilted, top = STILL.rocking(Rotation.ramp(theta=0.02, duration=10.0)), Top.prescribed((0.0, 0.0, -WEIGHT))
    scene = double(motion=tilted, top=top, effects=Auto(sliders="massless"))
    result = simulate(replace(scene, bearing=scene.bearing.replace(friction=0.0)))
    assert result.history.sliding[-1, 0] == pytest.approx(scene.bearing.surfaces[0].radius * 0.02, rel=1e-4)


@pytest.mark.slow
def test_a_run_starts_where_slow_turning_of_its_plates_leaves_it() -> None:
    tilted = double(motion=STILL.rocking(Rotation.constant(theta=0.01)))
    turned = double(motion=STILL.rocking(Rotation.ramp(theta=0.01, duration=10.0)))
    from_start, slowly = simulate(tilted), simulate(turned)
    assert from_start.scene is tilted
    force = from_start.history.top_force[:, 0]
    assert np.ptp(force) < 1e-3 * np.abs(force).max()  # nothing moves
    assert force[-1] == pytest.approx(slowly.history.top_force[-1, 0], rel=1e-3)


def test_a_constant_load_is_an_axial_load() -> None:
    whole = simulate(double())
    parts = double(top=replace(RIG, axial_load=0.4 * WEIGHT), load=Load.constant((0.0, 0.0, -0.6 * WEIGHT)))
    np.testing.assert_allclose(simulate(parts).history.top_force, whole.history.top_force, atol=2e-4 * WEIGHT)


@pytest.mark.slow
def test_the_normal_force_follows_a_varying_load_and_its_jumps() -> None:
    load = Load.from_arrays([0, 4, 4, 8, 12], np.outer([0, 0, 1, -1, -1], [0.0, 0.0, 0.3 * WEIGHT]))
    result = simulate(double(motion=STILL, load=load, output_step=None))
    time, pressed = result.history.time, -result.history.interface_force[:, 0, 2]
    weights = pressed[0] - (-WEIGHT)
    assert 4.0 in time
    expected = -WEIGHT + load.evaluate(time)[:, 2] + weights
    away = np.abs(time - 4.0) > 1e-9  # at the jump itself either value is right
    np.testing.assert_allclose(np.abs(pressed[away]), np.abs(expected[away]), rtol=1e-4)
    assert load.jumps.tolist() == [4.0]


def test_overturning_tilts_a_plate_against_its_stiffness() -> None:
    moment = 2e7  # against it the bearing has little: N R, and friction mu N R
    scene = double(motion=STILL, load=Load.ramp((0.0, 0.0, 0.0), (0.0, moment, 0.0), duration=10.0))
    angles = simulate(scene).history.tilt_angles[-1, :, 1].sum()
    assert angles == pytest.approx(moment / RIG.rotational_stiffness, rel=1e-2)


def test_the_top_follows_a_support_that_turns_within_its_stiffness() -> None:
    rotation = Rotation.ramp(psi=0.003, theta=0.006, duration=10.0)
    scene = double(motion=STILL, top_rotation=rotation, effects=Effects(top_rotation=True))
    result = simulate(replace(scene, bearing=presets.bearing("fenz-tfp")))
    psi, theta = result.history.tilt_angles[-1, :, :2].sum(axis=0)
    assert (psi, theta) == pytest.approx((0.003, 0.006), rel=1e-2)


def test_tangent_with_a_turning_support_agrees_with_differences() -> None:
    bearing = presets.bearing("fenz-tfp")
    model = build_model(bearing.layout, Effects(top_rotation=True))
    stack = model.stack(bearing, RIG)
    rng = np.random.default_rng(3)
    q, v, a = (rng.normal(scale=s, size=(4, 3)) * [1, 1, 0] for s in (0.02, 0.1, 1.0))
    f, base = np.full((4, 2), 0.3), np.zeros((3, 6))
    load = np.concatenate([[0, 0, -WEIGHT, 0, 0, 0], [0.01, 0.02, 0, 0, 0, 0], [0.1, -0.2, 0, 0, 0, 0]]).astype(float)
    factors = (0.3, 0.7, 1.0)

    def residual(step: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
        moved = np.zeros((4, 3))
        moved[:, :2] = step.reshape(4, 2)
        states = [np.ascontiguousarray(x + c * moved) for x, c in zip((q, v, a), factors, strict=True)]
        return stack.condensed(*states, f, base, load, *factors, 0.0)[1]  # type: ignore[no-any-return]

    tangent = stack.condensed(q, v, a, f, base, load, *factors, 0.0)[2]
    h = 1e-6
    differences = np.stack([(residual(h * e) - residual(-h * e)) / (2 * h) for e in np.eye(8)], axis=1)
    np.testing.assert_allclose(tangent, differences, atol=1e-6 * np.abs(tangent).max())
    level = stack.condensed(q, v, a, f, base, load[:6], *factors, 0.0)[1]
    assert np.abs(level - residual(np.zeros(8))).max() > 1e-3 * np.abs(level).max()


LOADS = [
    Load.constant((1.0, 2.0, -3e5), (0.0, 4.0, 0.0)),
    Load.ramp((0.0, 0.0, 1e5), duration=3.0) + Load.harmonic((0.0, 0.0, 1e4), frequency=2.0, cycles=3),
    Load.from_arrays([0, 1, 1, 5], np.outer([0, 1, 2, 0], [0.0, 0.0, 1e5]), name="jack"),
]


@pytest.mark.parametrize("load", LOADS, ids=["constant", "sum", "samples"])
def test_scenes_with_loads_and_rotations_round_trip(load: Load) -> None:
    rotation = Rotation.from_arrays([0, 1, 2, 4], [[0, 0], [1e-3, 0], [0, 2e-3], [0, 0]])
    scene = double(load=load, top_rotation=rotation, motion=PUSH.rocking(Rotation.ramp(0.01, 0.0, duration=1.0)))
    assert scene_from_table(tomllib.loads(scene_text(scene))) == scene
    assert pickle.loads(pickle.dumps(scene)) == scene
    assert {load: 1}[pickle.loads(pickle.dumps(load))] == 1


TABLE: dict[str, Any] = {
    "bearing": "double-fp",
    "motion": {
        "kind": "harmonic",
        "amplitude": "50 mm",
        "frequency": 0.5,
        "rotation": {"kind": "constant", "psi": "0.5 deg"},
    },
    "top": {"kind": "rig", "axial_load": "1 MN", "stiffness": 1e9, "rotational_stiffness": 1e8},
    "load": {"kind": "samples", "time": [0, 2], "force": [[0, 0, 0], [0, 0, "100 kN"]]},
    "top_rotation": {"kind": "ramp", "theta": "1 deg", "duration": 1.0},
}


def test_files_give_loads_and_rotations_with_units() -> None:
    scene = scene_from_table(TABLE)
    assert scene.load == Load.from_arrays([0, 2], [[0, 0, 0], [0, 0, 1e5]])
    assert scene.top_rotation == Rotation.ramp(theta=np.radians(1.0), duration=1.0)
    assert scene.motion.rotation(1.0)[0] == pytest.approx(np.radians(0.5))
    assert scene.modelled.top_rotation


def test_a_rotation_that_stops_dead_is_refused() -> None:
    with pytest.raises(InputError, match="velocity of theta_1 jumps"):
        PUSH.rocking(Rotation.harmonic(theta=0.01, frequency=1.0, cycles=1))
    with pytest.raises(InputError, match=r"effects\.top_rotation = True"):
        double(effects=Effects(top_rotation=True))
    with pytest.raises(InputError, match=r"effects\.top_rotation = False"):
        double(effects=Effects(), top_rotation=Rotation.constant(0.01))
    with pytest.raises(InputError, match="angle jumps at t = 1 s"):
        Rotation(np.array([0.0, 1.0, 2.0]), np.arange(24.0).reshape(2, 2, 6) / 1e3)


@pytest.mark.slow
def test_a_load_that_changes_is_no_constant_load() -> None:
    more = Load.constant((0.0, 0.0, -0.5 * WEIGHT))
    still = simulate(double(motion=STILL, load=more))
    assert still.summary["axial_load"] == pytest.approx(1.5 * WEIGHT)
    rising = simulate(double(motion=STILL, load=more + Load.ramp((0, 0, 1e5), duration=2.0)))
    assert rising.summary["axial_load"] is None


@pytest.mark.parametrize("run", [run_series, run_opensees, lambda scene, _: run_library("Radau", scene, 1e-2, 1.0)])
@pytest.mark.parametrize("name", ["load", "top_rotation"])
def test_methods_that_know_the_base_alone_say_so(name: str, run: Any) -> None:
    value = {"load": Load.constant((0.0, 0.0, -1e4)), "top_rotation": Rotation.constant(theta=0.01)}[name]
    with pytest.raises(InputError, match=f"{name}: this method applies the motion of the base only"):
        run(double(**{name: value}), 10)
