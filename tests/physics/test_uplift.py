"""Bodies that part, fly and land (docs/uplift.md)."""

from dataclasses import replace

import numpy as np
import pytest
from support.flights import UPLIFT, G, shaken

from msfp_gen import Effects, Load, Motion, RunError, Scene, Top, build_model, load_scene, presets, simulate
from msfp_gen.common.errors import InputError
from msfp_gen.scene.standing import seat_stiffness


@pytest.fixture(scope="module")
def flight():
    """Bouncing is chaotic: a while later rounding decides how far the bodies drift apart."""
    return simulate(shaken(1.4, sideways=0.03, duration=1.2))


def state_of(stack, extension, q):
    """Residual and tangent at coordinates q with everything else at rest, as a function of the rates of a step."""
    free = [1, 3, 5]
    beta, load = 1e-4, np.array([0, 0, -1e5, 0, 0, 0.0])

    def residual(rates):
        v = np.zeros_like(q)
        v[:, free] = rates.reshape(-1, 3)
        out = stack.condensed(
            q + beta * v, v, v / beta, np.zeros((len(q), 2)), np.zeros((3, 6)), load, beta, 1.0, 1 / beta, beta
        )
        assert out[0] == "ok"
        return out[1], out[2]

    return residual


@pytest.mark.parametrize(
    ("name", "separation"),
    [
        ("closed", (3e-6, 0.0, -2e-5)),
        ("tipped", (1e-4, 0.0, -2e-6)),
        ("open", (2e-5, 0.0, 4e-5)),
    ],
)
@pytest.mark.parametrize("at_rims", [False, True])
def test_tangent_agrees_with_differences(name, separation, at_rims):
    model = build_model(presets.bearing("prototype-tfp").layout, UPLIFT)
    scene = shaken(0.0)
    q = np.zeros((4, 6))
    q[:, 1] = (0.139, 0.285, -0.284, -0.138) if at_rims else (0.02, -0.03, 0.015, -0.01)
    q[:, 3:] = (0, 0, -2e-5)
    q[1, 3:] = separation
    residual = state_of(model.stack(scene.bearing, scene.top), model.extension, q)
    rates = np.full(12, 1e-3)
    _, tangent = residual(rates)
    steps = 1e-6 * np.eye(12)
    differences = np.column_stack([(residual(rates + s)[0] - residual(rates - s)[0]) / 2e-6 for s in steps])
    size = np.abs(tangent).max(axis=1, keepdims=True)
    assert (np.abs(differences - tangent) / size).max() < 1e-6


def test_moment_on_the_edge():
    """s x P about the slider's centre, P along the edge of its footprint: by hand, for surface 1 tipped."""
    model = build_model(presets.bearing("prototype-tfp").layout, UPLIFT)
    scene = shaken(0.0)
    bearing = scene.bearing
    first = bearing.surfaces[0]
    q = np.zeros((4, 6))
    q[:, 5] = -2e-5
    q[0, 3:] = (-1e-4, 0.0, -2e-6)
    stack = model.stack(bearing, scene.top)
    rest = (np.zeros((4, 6)), np.zeros((4, 6)), np.zeros((4, 2)), np.zeros((3, 6)), np.zeros(6))
    row, *_ = stack.observe(q, *rest)
    force = model.unpack(row)["force"][0]
    alpha = np.arcsin(bearing.bodies[0].rim_radius / first.radius) + np.arctan(first.friction)
    s = -q[0, 3:]
    depth = np.cos(alpha) * s[2] + np.sin(alpha) * s[0]
    assert depth > 0 and np.arctan2(s[0], s[2]) > alpha  # on the edge
    expected = seat_stiffness(bearing, scene.top)[0] * depth * np.array([np.sin(alpha), 0, np.cos(alpha)])
    assert force == pytest.approx(expected, rel=1e-9)

    # The balance of body 2 changes by s x P when the separation is turned off but its force kept: seen by differences
    # of the elastic energy with the tilt of the slider.
    def stored(tilt):
        turned = q.copy()
        turned[0, 1] = tilt
        turned[1, 1] = -tilt
        return float(model.unpack(stack.observe(turned, *rest)[0])["seat_stored"])

    slope = (stored(1e-6) - stored(-1e-6)) / 2e-6
    assert -slope == pytest.approx(np.cross(s, expected)[1], rel=1e-4)


def test_a_closed_stack_moves_as_one_without_uplift():
    scene = load_scene("fenz-test2")
    planar = replace(scene.effects, dimension="planar")
    rigid = simulate(replace(scene, effects=planar))
    seated = simulate(replace(scene, effects=replace(planar, uplift=True)))
    assert not seated.events and seated.history.lift.max() == 0
    assert seated.summary["peak_force_ratio"] == pytest.approx(rigid.summary["peak_force_ratio"], rel=5e-4)
    stiffness = seat_stiffness(scene.bearing, scene.top).max()
    assert np.abs(seated.history.separation).max() == pytest.approx(112e3 / stiffness, rel=0.01)


def test_lift_off_where_the_load_is_gone(flight):
    """Downward acceleration of the base beyond g: nothing presses any more."""
    first = next(event for event in flight.events if event.kind == "lift_off")
    t = np.linspace(0, first.time, 2001)
    acceleration = flight.scene.motion.acceleration(t)[:, 2]
    passed = t[np.argmax(acceleration < -G)]
    assert first.time == pytest.approx(passed, abs=3e-3)
    assert {event.kind for event in flight.events} >= {"lift_off", "landing"}


def test_a_parted_load_falls_freely(flight):
    history = flight.history
    aloft = (history.lift > 1e-4).any(axis=1) & (history.normal_force.min(axis=1) < 1e-3)
    spells = np.split(np.arange(len(aloft)), np.flatnonzero(np.diff(aloft)) + 1)
    longest = max(spells, key=lambda rows: aloft[rows[0]] * np.ptp(history.time[rows]))
    t, height = history.time[longest], history.top_displacement[longest, 2]
    assert t[-1] - t[0] > 0.03
    fall = np.polynomial.Polynomial.fit(t, height, 2).convert().coef[2]
    assert 2 * fall == pytest.approx(-G, rel=0.02)


def test_energy_through_landings(flight):
    energy = flight.history.energy
    peak = np.abs(energy["input"]).max()
    assert flight.status == "ok"
    assert np.abs(energy["numerical"]).max() < 2e-3 * peak
    assert np.diff(energy["seat_dissipated"]).min() > -1e-6 * peak and energy["seat_dissipated"][-1] > 0.01 * peak
    assert np.diff(energy["friction_dissipated"]).min() > -1e-5 * peak


def test_without_the_effect_such_a_run_is_refused_by_name():
    from msfp_gen.common.errors import RunError

    with pytest.raises(RunError) as caught:
        simulate(shaken(1.4, effects=replace(UPLIFT, uplift=False)))
    assert caught.value.status in ("uplift", "newton")


def test_what_does_not_go_with_uplift():
    with pytest.raises(InputError, match=r"effects\.uplift.*inertial"):
        Effects(uplift=True, sliders="massless")
    scene = shaken(0.5)
    with pytest.raises(InputError, match=r"solver\.method.*implicit"):
        simulate(replace(scene, solver=replace(scene.solver, method="dopri5")))


def test_a_stack_that_comes_apart_is_named():
    """Thrown up and pushed aside a top plate does not come down on its slider: nothing after that is a bearing."""
    still = Motion(np.array([0.0, 3.0]), np.zeros((1, 6, 6)))
    weight = 11e3 * 9.80665
    time, shape = [0.0, 0.05, 0.15, 0.2, 3.0], np.array([0.0, 1.0, 1.0, 0.0, 0.0])
    load = Load.from_arrays(time, np.outer(shape, [4.0 * weight, 0.0, 6.0 * weight]))
    top = Top.mass(11e3, 4e3, 0.3, rotational_stiffness=1e7, rotational_damping=1e4)
    scene = Scene(presets.bearing("prototype-tfp"), still, top, UPLIFT, load=load)
    with pytest.raises(RunError, match=r"surface \d, aside \[m\] = 0\.\d+: .*come apart") as error:
        simulate(scene)
    assert error.value.status == "separated" and error.value.result.history.lift.max() > 0.01


@pytest.mark.parametrize("method", ["implicit", "esdirk4"])
def test_no_row_between_steps_shows_a_surface_that_pulls(method):
    scene = shaken(1.4, sideways=0.03, duration=0.9)
    scene = replace(scene, output_step=1e-3, solver=replace(scene.solver, method=method, rtol=1e-3))
    history = simulate(scene).history
    assert history.lift.max() > 0 and history.normal_force.min() >= 0
    assert not history.interface_force[history.normal_force == 0].any()
    assert min(history.energy[name].min() for name in ("rim_stored", "seat_dissipated", "friction_dissipated")) > -1e-3


@pytest.mark.slow
def test_a_plate_that_flips_in_flight_has_its_remedy() -> None:
    """A single pendulum is lifted and turned at once; the spring that the message names holds its plate level."""
    weight, thrown = 2e6, np.array([0.0, 0.0, 1.0, 1.0, 0.0, 0.0])
    times = [0.0, 0.5, 0.5, 0.7, 0.7, 1.5]
    load = Load.from_arrays(times, np.outer(thrown, [0, 0, 1.3 * weight]), np.outer(thrown, [0, 3e5, 0]))
    motion = Motion.harmonic(0.01, 1.0, cycles=1.0)

    def scene(stiffness: float) -> Scene:
        spring = {"rotational_stiffness": stiffness, "rotational_damping": stiffness / 100}
        top = Top.mass(weight / 9.81, 1e5, 0.5, vertical_stiffness=1e9, vertical_damping=3e6, **spring)
        effects = Effects(uplift=True, dimension="planar")
        return Scene(presets.bearing("single-fp"), motion, top, effects, load=load)

    with pytest.raises(RunError, match=r"give the top a rotational_stiffness .* such as \(3, 1, 1\)") as caught:
        simulate(scene(0.0))
    assert caught.value.status == "separated"
    level = simulate(scene(1e9))
    assert level.summary["uplift"]["height"] > 0.05 and np.abs(level.history.tilt_angles).max() < 0.01
