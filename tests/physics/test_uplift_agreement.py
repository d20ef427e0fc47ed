"""Models with and without uplift agree where both are valid, and a run says where one is not (docs/uplift.md)."""

from dataclasses import replace

import auto_scenes
import numpy as np
import pytest
import seats
from support.flights import shaken

from msfp_gen import (
    Auto,
    Effects,
    InputError,
    Load,
    Motion,
    RunError,
    Scene,
    Solver,
    Top,
    build_model,
    load_scene,
    presets,
    simulate,
)
from msfp_gen.model.compiled import bodies_and_surfaces, top_values
from msfp_gen.results.geometry import contact_offsets
from msfp_gen.scene.effect_switching import all_effects
from msfp_gen.scene.parameters import changed_parameters
from msfp_gen.scene.scene_fields import InitialState


def swayed(effects):
    """A rigid mass on the rigid contacts of a stack, swayed until its sliders meet their rims."""
    time = np.linspace(0.0, 5.0, 1001)
    start = np.clip(time / 2.5, 0.0, 1.0)
    path = np.zeros((len(time), 3))
    path[:, 0] = 0.2 * start**3 * (10 - 15 * start + 6 * start**2) * np.sin(0.8 * np.pi * time)
    top = Top.mass(11428.0, 300.0, 0.5, rotational_stiffness=1e7, rotational_damping=1e4)
    return Scene(presets.bearing("fenz-tfp"), Motion.from_arrays(time, path), top, effects=effects)


def test_at_the_rims_uplift_gives_the_same_loop():
    """The rim carries its own force beside the contact: with a closed stack the two models are one."""
    scene = load_scene("triple-push")
    plain = simulate(replace(scene, effects=replace(scene.modelled, uplift=False, sliders="inertial")))
    seated = simulate(replace(scene, effects=replace(scene.modelled, uplift=True, sliders="inertial")))
    assert plain.history.rim_force.max() > 1e3 and (seated.history.rim_force.max(axis=0) > 0).sum() == 2
    time = np.linspace(0.0, plain.history.time[-1], 2001)
    force = [np.interp(time, r.history.time, r.history.top_force[:, 0]) for r in (plain, seated)]
    assert np.abs(force[1] - force[0]).max() < 3e-3 * np.abs(force[0]).max()


def test_a_contact_outside_the_face_is_noted():
    scene = load_scene("triple-push")
    narrow = replace(scene, bearing=scene.bearing.replace(rim_radius=[0.010, 0.0255, 0.0255, 0.010]))
    whole, tipping = simulate(scene), simulate(narrow)
    assert not [note for note in whole.notes if note.kind == "footprint"]
    note = next(note for note in tipping.notes if note.kind == "footprint")
    offset = contact_offsets(narrow.bearing, tipping.history.contact_angles, tipping.history.tilt_angles)
    assert note.value == pytest.approx(offset[:, note.surface - 1].max()) and 0.010 < note.value < 0.020
    assert "uplift" in note.text


def test_auto_lets_a_slider_tip_where_the_force_leaves_its_face():
    """Uplift is taken in there, with the force of a run that has it from the start; where it is fixed, a note stays."""
    scene = load_scene("triple-push")
    scene = replace(scene, bearing=scene.bearing.replace(rim_radius=[0.010, 0.0255, 0.0255, 0.010]))
    planar = Effects(dimension="planar", uplift=True)
    chosen, whole, rigid = (
        simulate(replace(scene, effects=effects, output_step=0.05))
        for effects in (Auto(dimension="planar"), planar, Auto(dimension="planar", uplift=False))
    )
    notes = [next(note for note in run.notes if note.kind == "footprint") for run in (chosen, rigid)]
    assert "uplift = True" in notes[0].action and not notes[1].action and "effects.uplift" in notes[1].text
    assert notes[0].time == pytest.approx(notes[1].time, abs=0.05)
    rows = slice(int(notes[0].time / 0.05) + 2, len(chosen.history.time) - 1)
    friction = whole.history.normal_force[0].max() * max(surface.friction for surface in scene.bearing.surfaces)
    force = [run.history.top_force[rows, 0] for run in (chosen, whole)]
    assert np.sqrt(np.mean((force[0] - force[1]) ** 2)) < 0.005 * friction


def test_auto_opens_the_contacts_before_a_rigid_mass_jams_them():
    """Taken in at the first peak, uplift gives the forces of a run that has it from the start."""
    chosen = simulate(swayed(Auto(dimension="planar", sliders="inertial")))
    full = simulate(swayed(Effects(dimension="planar", uplift=True)))
    assert [note.action for note in chosen.notes if note.kind == "uplift"] == ["uplift = True"]
    for quantity in ("top_force", "displacement"):
        peaks = [np.abs(getattr(r.history, quantity)[:, 0]).max() for r in (chosen, full)]
        assert peaks[0] == pytest.approx(peaks[1], rel=0.01)
    assert chosen.history.normal_force.max() < 2.0 * full.history.normal_force[0].max()


def test_peaks_of_a_rigid_mass_are_noted_where_the_effects_are_given():
    with pytest.raises(RunError) as caught:
        simulate(swayed(Effects(dimension="planar")))
    note = next(note for note in caught.value.result.notes if note.kind == "peak")
    assert "vertical_stiffness" in note.text and note.value > 1.5 * 11428.0 * 9.8


def test_a_surface_that_rattles_is_noted():
    loose, seated = simulate(shaken(1.4, sideways=0.03, duration=0.9)), simulate(shaken(0.5, duration=0.6))
    notes = [note for note in loose.notes if note.kind == "rattle"]
    landings = [event.surface for event in loose.events if event.kind == "landing"]
    assert notes and all(note.value == landings.count(note.surface) > 20 for note in notes)
    assert not [note for note in seated.notes if note.kind == "rattle"]


def test_a_small_bounce_has_one_answer():
    """To 2e-4 until the sliders rattle at the end of the flight; then rounding decides 1.2 % (docs/uplift.md)."""
    histories = [simulate(shaken(1.05, sideways=0.03, rtol=rtol)).history for rtol in (1e-3, 1e-4, 3e-5, 1e-5)]
    assert all(2e-4 < history.lift.max() < 5e-4 for history in histories)
    peaks = [np.abs(history.displacement[:, 0]).max() for history in histories]
    assert max(peaks) < 1.02 * min(peaks)
    before = [np.interp(0.7, history.time, history.displacement[:, 0]) for history in histories]
    assert np.ptp(before) < 2e-4 * max(peaks)


def differences(scene):
    """Largest differences of N over N at rest, and of the horizontal force over friction at rest, by uplift."""
    runs = [
        simulate(replace(scene, effects=replace(scene.modelled, uplift=uplift))).history for uplift in (False, True)
    ]
    assert runs[1].lift.max() == 0.0 and np.ptp(runs[0].normal_force) > 0.3 * runs[0].normal_force[0, 0]
    normal, force = (np.abs(getattr(runs[1], name) - getattr(runs[0], name)) for name in ("normal_force", "top_force"))
    rest = runs[0].normal_force[0].mean()
    return normal.max() / rest, force[:, :2].max() / (rest * max(s.friction for s in scene.bearing.surfaces))


PLANAR = Effects(dimension="planar")


def heaving(stiffness, sway, effects=PLANAR):
    """A rig that holds its height above a base that sways and heaves, so that N changes by a third or more."""
    time = np.linspace(0.0, 2.0, 1601)
    start = np.clip(time / 0.5, 0.0, 1.0)
    wave = start**3 * (10 - 15 * start + 6 * start**2)
    path = np.zeros((len(time), 3))
    path[:, 0] = sway * wave * np.sin(2 * np.pi * 0.7 * time)
    path[:, 2] = 0.3 * 112e3 / stiffness * wave * np.sin(2 * np.pi * 8.0 * time)
    damping = 0.1 * np.sqrt(stiffness * 11.4e3)
    top = Top.rig(112e3, 1e8, 1e4, 1e7, 1e4, vertical_stiffness=stiffness, vertical_damping=damping)
    solver = Solver(rtol=1e-5)
    return Scene(presets.bearing("fenz-tfp"), Motion.from_arrays(time, path), top, effects, solver, output_step=2e-3)


@pytest.mark.parametrize(("stiffness", "sway"), [(1e8, 0.02), (3e9, 0.004)])
def test_a_rig_that_holds_its_height_has_one_force(stiffness, sway):
    """The given stiffness contains the contacts of models with uplift."""
    normal, force = differences(heaving(stiffness, sway))
    assert normal < 2e-3 and force < 2e-3


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_any_rig_that_holds_its_height_has_one_force(seed):
    draw = np.random.default_rng(seed)
    stiffness = 10 ** draw.uniform(7.5, 9.7)
    scene = heaving(stiffness, np.sqrt(0.2 * draw.uniform(0.3, 1.0) * 112e3 / stiffness), Effects())
    ratio, side, size = draw.uniform(0.0, 0.3), 10 ** draw.uniform(7.0, 9.0), draw.uniform(1.0, 2.0)
    bearing = presets.bearing(draw.choice(["fenz-tfp", "double-fp"])).replace(contact_damping=1e-4)
    bearing = bearing.replace(radius=[size * surface.radius for surface in bearing.surfaces])
    damping = 2 * ratio * np.sqrt(stiffness * 11.4e3)
    top = replace(scene.top, stiffness=side, rotational_stiffness=1e8, vertical_damping=damping)
    normal, force = differences(replace(scene, bearing=bearing, top=top))
    assert normal < 5e-3 and force < 5e-3


def test_contacts_softer_than_the_top_are_refused():
    scene = heaving(1e9, 0.01, replace(PLANAR, uplift=True))
    soft = scene.bearing.replace(seat_stiffness=4e9)
    with pytest.raises(InputError) as error:
        replace(scene, bearing=soft)
    text = "bearing.surfaces[0].seat_stiffness = 4e+09: with it the contacts of all surfaces in series have 1e+09 N/m"
    assert str(error.value).startswith(text) and "vertical_stiffness = 1e+09" in str(error.value)
    with pytest.raises(InputError, match=r"bearing\.surfaces\[0\]\.seat_stiffness"):  # they may open on the way
        replace(scene, bearing=soft, effects=Auto())
    replace(scene, bearing=soft, effects=replace(scene.effects, uplift=False))
    values = bodies_and_surfaces(soft, scene.effects)
    model = build_model(soft.layout, scene.effects)
    with pytest.raises(ValueError, match=r"surfaces: seat_stiffness: .*in series must be stiffer than the top"):
        model.extension.Stack(soft.gravity, *values, top_values(scene.top))


def oblique(tilt, azimuth, effects):
    """A load along the axis of a tilted stack."""
    bearing = presets.bearing("double-fp")
    axis = np.array([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
    position = np.zeros((1, 6, 6))
    position[0, 3:5, 0] = np.arctan2(-axis[1], axis[2]), np.arcsin(axis[0])
    state = InitialState(np.zeros((2, 3)).tolist(), np.zeros((2, 3)).tolist(), np.zeros((2, 2)).tolist())
    load, top = Load.constant(tuple(-112e3 * axis)), Top.prescribed((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    motion = Motion(np.array([0.0, 0.01]), position)
    return Scene(bearing, motion, top, effects, load=load, initial_state=state)


@pytest.mark.parametrize("tilt", [0.2, 0.9])
@pytest.mark.parametrize(("dimension", "azimuth"), [("planar", 0.0), ("spatial", 0.6)])
def test_an_oblique_load_starts_with_one_normal_force(tilt, dimension, azimuth):
    starts = [
        simulate(oblique(tilt, azimuth, Effects(dimension=dimension, uplift=uplift))).history.normal_force[0]
        for uplift in (False, True)
    ]
    assert starts[1] == pytest.approx(starts[0], rel=1e-9)


def test_a_mass_pushed_aside_starts_with_one_normal_force():
    """Tilted and moving sliders below a mass on a spring, which a force pushes aside: not a state of rest."""
    top = Top.mass(11e3, 300.0, 0.5, 1e7, 1e4, 1e8, 1e5)
    q, v = [[0.0, 0.06, 0.0], [0.0, -0.06, 0.0]], [[0.0, 0.1, 0.0], [0.0, 0.0, 0.0]]
    state = InitialState(q, v, [[0.0, 0.0], [0.0, 0.0]])
    motion, load = Motion(np.array([0.0, 0.01]), np.zeros((1, 6, 6))), Load.constant((-22e3, 0.0, -1e5))
    scene = Scene(presets.bearing("double-fp"), motion, top, PLANAR, load=load, initial_state=state)
    starts = [
        simulate(replace(scene, effects=replace(PLANAR, uplift=uplift))).history.normal_force[0]
        for uplift in (False, True)
    ]
    assert starts[1] == pytest.approx(starts[0], rel=1e-5)


def stuck(effects):
    """A mass that friction holds on its bearing, after a jolt."""
    top = Top.mass(2.2e5, 6.6e4, 0.4, 2.2e7, 1.1e5, 6.2e8, 1.2e6)
    bearing = presets.bearing("double-fp").replace(yield_displacement=2e-4, friction=0.07, contact_damping=1e-4)
    motion = Motion.harmonic(0.145, 0.15, cycles=0.5)
    return Scene(bearing, motion, top, effects, Solver(rtol=1e-6), output_step=1e-3)


@pytest.mark.slow
def test_a_stuck_mass_has_one_stiffness():
    """The yield displacement contains the contact: without this the frequencies differ, and forces by 15 %."""
    runs = [simulate(stuck(replace(PLANAR, uplift=uplift, bouc_wen="plastic"))).history for uplift in (False, True)]
    assert 0.1 < np.abs(runs[0].friction_state).max() < 0.9
    forces = [run.top_force[:, 0] for run in runs]
    assert np.abs(forces[1] - forces[0]).max() < 0.02 * np.abs(forces[0]).max()


def test_what_the_contacts_take_of_a_stuck_bearing_is_noted():
    """Of two bearings that hardly slide, by the sliding of runs with uplift; nothing is noted where they slide."""
    for number in (16, 18):
        scene = auto_scenes.campaign(21, number)
        (note,) = simulate(scene).notes
        without, with_uplift = (
            simulate(replace(scene, effects=replace(all_effects(scene), uplift=uplift))) for uplift in (False, True)
        )
        slid = without.extremes.sliding
        taken = (slid - with_uplift.extremes.sliding).max() / slid.max()
        assert note.kind == "seats" and note.value == pytest.approx(taken, rel=0.1) and taken > 0.005
        assert not without.notes and not with_uplift.notes
        assert with_uplift.extremes.top_force[3] == pytest.approx(without.extremes.top_force[3], rel=1e-3)
    slides = replace(scene, motion=Motion.harmonic(0.1, 0.3, cycles=1))
    assert not [note for note in simulate(slides).notes if note.kind == "seats"]


def growth(scene, time):
    """Largest growth rate [1/s] of vibrations beyond 100 Hz about the state at `time` of a sliding stack."""
    history = simulate(replace(scene, duration=time)).history
    model = build_model(scene.bearing.layout, scene.effects)
    stack = model.stack(scene.bearing, scene.top)
    angles, rates = (x[-1] for x in (history.tilt_angles, history.tilt_rates))
    base = np.zeros((3, 6))
    for order in range(3):
        base[order] = scene.motion.evaluate(time, order)
    columns = [0, 1, 3, 4, 5]
    count = 5 * len(angles)

    def slopes(y):
        q, v = np.zeros((len(angles), 6)), np.zeros((len(angles), 6))
        q[:, columns], v[:, columns] = y[:count].reshape(-1, 5), y[count : 2 * count].reshape(-1, 5)
        f = np.ascontiguousarray(y[2 * count :].reshape(-1, 2))
        status, a, _, df, *_ = stack.accelerations(q, v, f, base, np.zeros(6))
        assert status == "ok"
        return np.concatenate([v[:, columns].ravel(), a[:, columns].ravel(), df.ravel()])

    q = np.hstack([angles, history.separation[-1]])[:, columns]
    v = np.hstack([rates, np.zeros_like(history.separation[-1])])[:, columns]
    y = np.concatenate([q.ravel(), v.ravel(), history.friction_state[-1].ravel()])
    steps = np.where(np.arange(len(y)) < count, np.where(np.arange(len(y)) % 5 < 2, 1e-7, 1e-10), 1e-6)
    jacobian = [(slopes(y + s * e) - slopes(y - s * e)) / (2 * s) for s, e in zip(steps, np.eye(len(y)), strict=True)]
    modes = np.linalg.eigvals(np.transpose(jacobian))
    vibrations = modes[np.abs(modes.imag) > 200 * np.pi]
    assert len(vibrations)
    return vibrations.real.max()


@pytest.mark.slow
def test_sliders_do_not_vibrate_in_their_seats():
    """With seats that are damped along the compression alone a vibration at 2.6 kHz grows at 18 1/s."""
    bearing = presets.bearing("single-articulated-fp").replace(
        radius=[2.437, 0.1772],
        friction=[0.0693, 0.0579],
        yield_displacement=1.26e-4,
        contact_damping=1e-4,
        mass=[82.0, 181.0],
        inertia=[(0.605, 0.725), (5.07, 9.98)],
        height=[0.188, 0.0665],
        centroid=[0.094, 0.0332],
        rim_radius=[0.133, 0.0],
    )
    top = Top.mass(4.797e4, 1.44e4, 0.4, 4.7e6, 2.35e4, 5.1e8, 4.95e5)
    motion = Motion.figure_eight(0.1038, 1.485, cycles=1.0, lead_in=3.0)
    scene = Scene(bearing, motion, top, Effects(uplift=True, bouc_wen="plastic"), Solver(rtol=1e-5))
    assert max(growth(scene, time) for time in (2.8, 4.1)) < -1.0


@pytest.mark.slow
def test_the_start_under_an_oblique_load_is_differentiated():
    """Derivatives of the separations at the start, against the starts of other scenes."""
    scene = replace(oblique(0.2, 0.6, Effects(uplift=True)), output_step=None)
    paths = ["bearing.surfaces[0].friction", "bearing.bodies[1].mass", "load.scale", "initial_state.v[0][1]"]
    run = simulate(scene, gradients=paths, gradient_errors=False)
    for parameter, slope in zip(run.gradients.parameters, run.gradients.arrays["separation"][:, 0], strict=True):
        step = 1e-4 * (abs(parameter.value) or 1.0)
        ends = [
            simulate(changed_parameters(scene, {parameter: parameter.value + side * step})).history.separation[0]
            for side in (-1, 1)
        ]
        expected = (ends[1] - ends[0]) / (2 * step)
        assert slope == pytest.approx(expected, rel=1e-4, abs=1e-5 * np.abs(expected).max() + 1e-12)  # 1e-12: rounding


@pytest.mark.slow
@pytest.mark.parametrize("number", range(seats.SCENES))
def test_a_closed_bearing_has_one_peak_force(number):
    """Random pendulums below sprung masses: with uplift at tight tolerances as without it."""
    scene = seats.scene(number)
    plain, *forces = (
        seats.peak(scene, *run)[0] for run in ((False, 1e-7), *((True, rtol) for rtol in seats.TOLERANCES))
    )
    assert np.ptp([plain, *forces]) < 2e-3 * plain
