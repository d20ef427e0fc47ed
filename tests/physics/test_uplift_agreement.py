"""Models with and without uplift agree where both are valid, and a run says where one is not (docs/uplift.md)."""

from dataclasses import replace

import numpy as np
import pytest
from support.flights import shaken

from msfp_gen import (
    Auto,
    Effects,
    InputError,
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
    offset = contact_offsets(narrow.bearing, tipping.history)
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
