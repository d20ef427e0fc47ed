"""The audit finds what is wrong in spoiled results, and nothing in sound ones (docs/audit.md)."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from external import MAT, mat_on_pendulums
from support import ROOT
from support.audits import (
    KINDS,
    SPACE,
    SPOILED,
    other_radii,
    rows_of,
    run_of,
    shaken,
    straightened,
    with_columns,
    with_force,
)
from support.buildings import BEARING, rocking

from msfp_gen import Effects, RunError, audit, changed_scene, load_scene, simulate
from msfp_gen.auditing import Histories, read_histories
from msfp_gen.auditing.histories import histories_of
from msfp_gen.auditing.momentum import momentum
from msfp_gen.auditing.sliding import Sliding
from msfp_gen.auditing.stated import stated_of
from msfp_gen.studies.accuracy.series import run_opensees

KINDS_OF_STACKS = [pytest.param(kind, marks=[pytest.mark.slow] * (kind == "triple")) for kind in KINDS]
# Named alone; the others are named with what follows from them.
ALONE = {"sign turned", "clipped", "unit wrong", "resampled", "half the bearings", "heat off", "friction at the pivot"}


@cache
def spoiled(kind, name):
    """The audit of a spoiled result, and the check that must name it."""
    data, bearing, check = SPOILED[name](KINDS[kind])
    return audit(data, bearing), check, data


@pytest.mark.parametrize("name", SPOILED)
@pytest.mark.parametrize("kind", KINDS_OF_STACKS)
def test_what_is_spoiled_is_named(kind, name):
    """Of an articulated and a double pendulum in a plane, and of a triple pendulum in space."""
    found, check, data = spoiled(kind, name)
    named = [finding.check for finding in found.inconsistent]
    assert named == [check] if name in ALONE else check in named
    place = found.finding(check)
    assert place.time is None or data.time[0] <= place.time <= data.time[-1]


@pytest.mark.parametrize("kind", KINDS_OF_STACKS)
def test_numbers_of_every_kind(kind):
    """The inertia, the fall by heat, the coupling and the radius that were put in, and friction at the pivot."""
    numbers = {name: spoiled(kind, name)[0].finding(spoiled(kind, name)[1]) for name in SPOILED}
    mass = 2e6 / KINDS[kind].scene().bearing.gravity
    assert numbers["mass doubled"].value == pytest.approx(2 * mass, rel=0.01)
    assert numbers["half the bearings"].value == pytest.approx(0.5, rel=0.01)
    for name in ("heat off", "vertical coupling off"):
        assert numbers[name].value == pytest.approx(0.0, abs=0.05)
    assert "at the pivot" in numbers["friction at the pivot"].sentence
    radius = stated_of(KINDS[kind].scene(radius=other_radii)).radius
    assert numbers["other radius"].value == pytest.approx(radius, rel=0.02)


@pytest.mark.parametrize("kind", KINDS_OF_STACKS)
def test_sound_results_of_every_kind(kind):
    for law in ("constant", "pvt"):
        found = audit(KINDS[kind].run(law=law), KINDS[kind].scene(law=law))
        assert {finding.verdict for finding in found.findings} == {"consistent"}
        assert law == "constant" or found.finding("heat").value == pytest.approx(1.0, abs=0.05)


def test_numbers_are_those_that_were_put_in():
    found = {name: spoiled("single", name)[0].finding(spoiled("single", name)[1]) for name in SPOILED}
    assert "inertia acts twice" in found["mass doubled"].sentence
    assert found["friction at the pivot"].value == pytest.approx(0.928, abs=0.01)
    assert found["unit wrong"].value == 1e3 and "millimetres" in found["unit wrong"].sentence
    assert found["other radius"].value == pytest.approx(2.69, rel=0.01)  # of the dish and the joint


@pytest.mark.parametrize("law", ["constant", "pvt"])
def test_a_sound_result_has_its_own_numbers(law):
    found = audit(run_of(law=law), shaken(law=law))
    assert not found.inconsistent
    assert found.finding("mass").value == pytest.approx(2e6 / shaken().bearing.gravity, rel=5e-3)
    assert found.finding("radius").value == pytest.approx(2.19, rel=0.01)
    assert found.finding("friction").value == pytest.approx(1.0, abs=0.02)
    assert found.finding("lift").value == pytest.approx(1.0, abs=0.1)
    assert found.finding("coupling").value == pytest.approx(1.0, abs=0.02)
    if law == "pvt":
        assert found.finding("heat").value == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("change", ["coarse", "filtered", "small", "resting", "no columns"])
def test_sound_results_stay_sound_when_little_is_known(change):
    scene, data = shaken(), run_of()
    if change == "coarse":
        data = rows_of(data, 5)
    elif change == "filtered":  # the same filter on all columns, as recorders have it
        kernel = np.hanning(9) / np.hanning(9).sum()
        smooth = {n: np.convolve(v, kernel, "valid") for n, v in data.columns.items() if n != "time"}
        data = type(data)(data.name, {"time": data.time[4:-4], **smooth}, data.mass)
    elif change == "small":
        scene, data = shaken(scale=0.2), run_of(scale=0.2)
    elif change == "resting":  # ten seconds without motion before it
        still = {n: np.full(1000, v[0]) for n, v in data.columns.items()} | {"time": np.arange(1000) * 0.01}
        shifted = {**data.columns, "time": data.time + 10.0}
        data = type(data)(data.name, {n: np.append(still[n], shifted[n]) for n in shifted}, data.mass)
    else:
        data = type(data)(data.name, {"time": data.time, "force_1": data.columns["force_1"]})
    found = audit(data, scene)
    assert not found.inconsistent, found.text
    if change == "no columns":
        assert {f.verdict for f in found.findings if f.check not in ("clipped",)} == {"not decidable"}
        assert "displacement" in found.finding("friction").sentence


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"force_1": 1e-3}, "kilonewtons"),
        ({"displacement_1": 39.3701}, "inches"),
        ({"axial": 1e-3}, "axial force"),
        ({"position_1": 1 / 9.80665, "position_2": 1 / 9.80665, "position_3": 1 / 9.80665}, "looks like"),
    ],
)
def test_wrong_units_are_named(columns, words):
    found = audit(run_of().scaled(columns), shaken())
    assert words in found.finding("units").sentence
    assert "units" in [finding.check for finding in found.inconsistent]


def test_other_mistakes_are_named():
    data, scene = run_of(), shaken()
    flipped = audit(data.scaled({"axial": -1.0}), scene)
    assert [f.check for f in flipped.inconsistent] == ["signs"]
    assert "interpolated" in audit(straightened(data, 5), scene).finding("sampling").sentence
    noise = 0.02 * data.at_rest * np.random.default_rng(0).standard_normal((len(data.time), 1))
    assert "chatters" in audit(with_force(data, 1.0, noise), scene).finding("chatter").sentence
    row = int(Sliding(data, stated_of(scene)).rows[40])
    spike = np.zeros((len(data.time), 1))
    spike[row] = 0.04 * data.at_rest
    found = audit(with_force(data, 1.0, spike), scene).finding("chatter")
    assert "spike" in found.sentence and found.time == pytest.approx(data.time[row], abs=0.02)
    no_rise = audit(with_columns(data, rise=0.0 * data.time), scene)
    assert [f.check for f in no_rise.inconsistent] == ["lift"]


def test_a_force_that_pushes_is_named():
    """The friction of some strokes acts along the motion: the bearing makes energy there."""
    data, scene = run_of(), shaken()
    sliding = data.axial[:, None] * np.sign(data.velocity) * 0.0646
    pushed = with_force(data, 1.0, -1.5 * sliding * ((data.time > 8) & (data.time < 11))[:, None])
    found = audit(pushed, scene).finding("energy")
    assert found.verdict == "inconsistent" and 8 < found.time < 11.5


def test_momentum_does_not_differentiate():
    """A mass of 3 kg on a known force, with noise on the position as of a printed column."""
    data = run_of()
    time = np.arange(0.0, 20.0, 0.01)
    force = 3.0 * -((2 * np.pi * 0.7) ** 2) * np.sin(2 * np.pi * 0.7 * time)
    position = np.round(np.sin(2 * np.pi * 0.7 * time), 4)
    found = momentum(type(data)("by hand", {"time": time, "force_1": force, "position_1": position}))
    assert found.mass == pytest.approx(3.0, rel=1e-3) and found.one_mass


@pytest.mark.parametrize("name", ["fenz-test2", "fenz-test3", "fenz-test5", "unusual-tfp", "becker-circle-50"])
def test_presets_are_sound(name):
    scene = load_scene(name)
    found = audit(simulate(scene), scene)
    assert not found.inconsistent, found.text


def even(data, step=0.01):
    """The histories at equal steps, as a recorder has them."""
    time = np.arange(0.0, data.time[-1], step)
    columns = {name: np.interp(time, data.time, values) for name, values in data.columns.items()}
    return replace(data, columns=columns | {"time": time})


@pytest.mark.parametrize(
    "scale", [2.0, pytest.param(3.0, marks=pytest.mark.slow), pytest.param(4.0, marks=pytest.mark.slow)]
)
def test_sound_results_with_strong_lift_off(scale):
    """A bearing that opens and lands up to thirty times; at four times the record its stack comes apart at 10 s.

    The force on the mass has the inertia of the upper plate, which hangs on it while surfaces are open.
    """
    scene = changed_scene("ridgecrest-clc", {"motion.scale": scale, "effects.uplift": True, "duration": 14.0})
    try:
        result = simulate(scene)
    except RunError as failure:
        result = failure.result
        assert scale == 4.0 and failure.status == "separated"
    data = histories_of(result)
    force = result.history.top_force
    on_mass = with_columns(data, axial=force[:, 2], force_1=force[:, 0], force_2=force[:, 1])
    assert data.below(0.02).any() and on_mass.axial.min() < -0.02 * data.at_rest
    for given in (data, on_mass, even(data), even(on_mass)):
        found = audit(given, scene)
        assert not found.inconsistent, found.text
        assert found.finding("weight").verdict == "consistent"
        assert found.finding("weight").value == pytest.approx(1.0, abs=0.01)


def test_rims_that_yield_are_no_missing_rims():
    """A triple pendulum under a load for which it is not made, 60 mm beyond its last rim; and without the rims."""
    scene = shaken(bearing="fenz-tfp", scale=0.5, axes=(1.0, 0.0, 0.0), contact_damping=0.0)
    data = histories_of(simulate(scene))
    found = audit(data, scene)
    assert not found.inconsistent and found.finding("travel").value > 0.2
    sliding = data.axial * (data.displacement[:, 0] / 0.87 + 0.07 * np.sign(data.velocity[:, 0]))
    assert audit(with_columns(data, force_1=sliding), scene).finding("travel").verdict == "inconsistent"


@pytest.mark.slow
@pytest.mark.parametrize("vertical", [5.0, 8.0])
@pytest.mark.parametrize("law", ["constant", "pvt"])
@pytest.mark.parametrize("kind", KINDS)
def test_sound_results_of_stacks_that_lift_off(kind, law, vertical):
    """Base motions of up to 1.1 and 1.8 g along the vertical: surfaces are open for up to two thirds of the time."""
    choices = KINDS[kind].choices | {"axes": (0.6, 0.6 * (kind == "triple"), vertical), "law": law, "uplift": True}
    scene = shaken(**choices)
    try:
        data = histories_of(simulate(scene))
    except RunError as failure:  # a stack that has come apart
        assert failure.status == "separated"
        data = histories_of(failure.result)
    assert data.below(0.02).sum() > 40
    found = audit(data, scene)
    assert not found.inconsistent, [finding.sentence for finding in found.inconsistent]


def test_sound_results_of_a_building_that_rocks():
    """Two of its bearings lift off; rows of a bearing of a building have the force on its upper plate only."""
    result = simulate(rocking(Effects(uplift=True)))
    lifted = 0
    for bearing in result.bearings:
        rows = bearing.history
        columns = {"time": rows.time, "axial": rows.top_force[:, 2], "rise": -rows.displacement[:, 2]}
        for name, values in (("displacement", rows.displacement), ("force", rows.top_force)):
            columns |= {f"{name}_{axis + 1}": values[:, axis] for axis in (0, 1)}
        data = Histories("a bearing", columns)
        found = audit(data, BEARING)
        assert not found.inconsistent, found.text
        lifted += data.below(0.02).any()
    assert lifted == 2


def test_the_bound_of_a_stack_is_reached():
    """In stage III of Fenz and Constantinou both outermost surfaces of a triple pendulum slide."""
    scene = load_scene("fenz-test3")
    found = audit(simulate(scene), scene)
    stated = stated_of(scene)
    surfaces = scene.bearing.surfaces
    outer = [surfaces[0].friction * surfaces[0].radius, surfaces[3].friction * surfaces[3].radius]
    assert stated.radius == pytest.approx(2 * 0.435) and stated.friction == pytest.approx(sum(outer) / 0.87)
    assert found.finding("friction_bound").value == pytest.approx(stated.friction, rel=0.02)
    assert histories_of(simulate(scene)).mass is None


def test_a_published_plant_has_its_inertia_twice():
    """And the mass does not rise on the dish; nothing else is named in 2,801 rows of MASTODON."""
    found = audit(MAT / "case1.csv", MAT / "bearing.toml", MAT / "map.toml")
    assert [finding.check for finding in found.inconsistent] == ["mass", "lift"]
    assert found.finding("mass").value == pytest.approx(152.6e6, rel=0.01)
    assert "7.495e+07" in found.finding("mass").sentence and "inertia acts twice" in found.finding("mass").sentence
    assert found.finding("friction").value == pytest.approx(1.0, abs=0.01)
    assert found.finding("radius").value == pytest.approx(1.0, abs=0.01)
    assert found.finding("friction_bound").value == pytest.approx(0.06, abs=1e-4)


def test_the_plant_has_constant_friction():
    """Its force gives the coefficient 0.0600 at any velocity, and 377 MN/m before it slides."""
    data = read_histories(MAT / "case1.csv", MAT / "map.toml")
    axial, force, u = data.axial[30:], data.force[30:, 0], data.displacement[30:, 0]
    speed = np.abs(data.velocity[30:, 0])
    implied = np.abs(force / axial - u)
    path = np.cumsum(np.abs(np.diff(u, prepend=u[0])))
    turned = np.maximum.accumulate(np.where(np.diff(np.sign(np.gradient(u)), prepend=0) != 0, path, 0.0))
    sliding = (path - turned > 4e-3) & (data.time[30:] > 1.0)
    for low, high in ((0.002, 0.01), (0.01, 0.05), (0.05, 0.3), (0.3, 1.0)):
        rows = sliding & (speed > low) & (speed < high)
        assert rows.sum() > 20 and np.median(implied[rows]) == pytest.approx(0.06, abs=2e-5)
    stiffness = data.force[1, 0] / data.displacement[1, 0]
    assert stiffness == pytest.approx(50e6 * np.pi * 0.2**2 * 0.06 / 1e-3, rel=0.01)
    assert 0.06 * data.at_rest / stiffness == pytest.approx(1.71e-3, rel=0.01)


def test_the_page_of_the_plant_prints_what_it_says(capsys, monkeypatch):
    monkeypatch.chdir(ROOT)
    page = (ROOT / "docs" / "audit.md").read_text(encoding="utf-8").split("\n## A published plant\n")[1]
    exec(re.findall(r"```python\n(.*?)```", page, re.DOTALL)[0], {})
    said = re.search(r"It prints `(.*?)`", page)
    assert said and capsys.readouterr().out.strip() == said[1]
    flux = 0.06 * 10.75e6 / (np.pi * 0.2**2) * 0.3
    assert flux == pytest.approx(1.5e6, rel=0.05)
    assert 2 * flux * np.sqrt(4.4e-6 / np.pi) / 18 == pytest.approx(200, rel=0.05)


@pytest.mark.slow
def test_the_plant_is_followed_with_inertia_twice():
    """RMS difference of the displacement over its largest value: 1.8 % with inertia twice, 24 % with it once."""
    apart = {}
    page = (ROOT / "docs" / "audit.md").read_text(encoding="utf-8").split("\n## A published plant\n")[1]
    for times, word in ((1, "once"), (2, "twice")):
        _, recorded, ours = mat_on_pendulums(times)
        apart[times] = np.sqrt(np.mean((ours - recorded) ** 2)) / np.abs(recorded).max()
        row = re.search(rf"^\| ours, inertia {word} \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) %", page, re.MULTILINE)
        assert row
        stated = [float(text) for text in row.groups()]
        assert stated == pytest.approx([1e3 * ours.max(), -1e3 * ours.min(), 100 * apart[times]], abs=0.1)
    assert apart[2] == pytest.approx(0.018, abs=1e-3) and apart[1] == pytest.approx(0.24, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("law", ["constant", "velocity", "pvt"])
@pytest.mark.parametrize("axes", [(1.0, 0.0, 0.0), SPACE])
@pytest.mark.parametrize("kind", ["single-articulated-fp", "double-fp", "fenz-tfp"])
def test_sound_results_of_stacks(law, axes, kind):
    """Small and strong motions, and coarse rows; a triple pendulum of 150 mm, without rims here, is moved less."""
    changes = {"friction_slow": 0.03, "velocity_rate": 150.0} if law == "velocity" else {}
    share = {"pvt": 0.08}.get(law, 0.15) if kind == "fenz-tfp" else 1.0
    changes |= {"contact_damping": 0.0} if kind == "fenz-tfp" else {}
    for scale, step in ((0.3, 0.01), (1.0, 0.01), (1.0, 0.04)):
        choices = {"law": law, "axes": axes, "bearing": kind, "scale": share * scale, "step": step, **changes}
        found = audit(run_of(**choices), shaken(**choices))
        assert not found.inconsistent, (scale, step, [f.sentence for f in found.inconsistent])


@pytest.mark.slow
@pytest.mark.parametrize("at", ["surface", "pivot"])
@pytest.mark.parametrize(
    "name", [*(f"fenz-test{k}" for k in range(1, 6)), *(f"becker-{k}" for k in ("circle-50", "circle-88", "eight-88"))]
)
def test_sound_results_of_opensees(name, at):
    """Its element on a rig, with 2000 rows; its friction acts at the pivot, and the audit finds that where it can."""
    pytest.importorskip("openseespy.opensees", exc_type=Exception)
    scene = load_scene(name)
    force = run_opensees(scene, 2000).histories["force"][:, 0]
    time = np.linspace(0.0, scene.end, 2001)
    across = scene.motion.displacement(time)[:, :2]
    columns = dict(zip(("displacement_1", "displacement_2"), (across - across[0]).T, strict=True))
    columns |= {"time": time, "axial": np.full(len(time), scene.top.axial_load)}
    data = Histories(name, columns | dict(zip(("force_1", "force_2"), force.T, strict=True)))
    friction = [surface.friction for surface in scene.bearing.surfaces]
    found = audit(data, scene.bearing.replace(friction=friction, friction_at=at))
    assert not found.inconsistent, found.text
    if at == "pivot" and name in ("fenz-test3", "fenz-test4", "fenz-test5", "becker-eight-88"):  # outermost ones slide
        assert found.finding("friction").verdict == "consistent"
        assert found.finding("friction").value == pytest.approx(1.0, abs=0.05)
