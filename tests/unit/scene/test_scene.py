import pickle
import tomllib
from dataclasses import replace
from math import pi

import numpy as np
import pytest

from msfp_gen import presets
from msfp_gen.motions.motion import Motion
from msfp_gen.motions.records import bundled
from msfp_gen.scene.file.loader import dumps, scene_from_table, scene_text
from msfp_gen.scene.file.source import load_scene
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.scene_fields import InitialState, Stop
from msfp_gen.scene.solver import Solver
from msfp_gen.scene.top import Top
from msfp_gen.specification.layout import Auto, Effects, ModelSpec

MOTION = Motion.harmonic(0.025, 0.5)
RIG = Top.rig(112e3, 1e8, 5.0, 1e6, 5.0)

FULL = """
name = "all there is"
duration = "4 s"
output_step = "10 ms"

[bearing]
preset = "fenz-tfp"
friction = [0.064, "16.8 %", 0.168, 0.064]
rim_stiffness = "10 kN/mm"
inertia = [[3e-4, 5e-4], 1e-4, "3 kg cm^2", [3e-2, 6e-2]]
gravity = "1 g"

[motion]
kind = "harmonic"
amplitude = "25 mm"
frequency = "0.5 Hz"
direction = "90 deg"
cycles = 1
hold = "2 s"

[top]
kind = "mass"
mass = "11 t"
inertia = [300, 280]
height = "50 cm"
rotational_stiffness = "10 MN m/rad"

[effects]
spin = "patch"
rims = false

[solver]
method = "dopri5"
rtol = 1e-6
max_step = "1 ms"

[stop]
displacement = "140 mm"

[initial_state]
q = [[0.01, 0, 0], [0, 0, 0], [0, 0, 0], [-0.01, 0, 0]]
v = [[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]]
h = [[0, 0], [0, 0], [0, 0], [0, 1]]
"""


def scene(**changes):
    return Scene(**{"bearing": presets.bearing("fenz-tfp"), "motion": MOTION, "top": RIG} | changes)


def reread(one):
    return scene_from_table(tomllib.loads(scene_text(one)))


def test_every_part_of_a_file_arrives_in_si(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(FULL, encoding="utf-8")
    found = load_scene(path)
    assert found.name == "all there is"
    assert (found.duration, found.output_step, found.end) == (4.0, 0.01, 4.0)
    assert [s.friction for s in found.bearing.surfaces] == pytest.approx([0.064, 0.168, 0.168, 0.064])
    assert [s.rim_stiffness for s in found.bearing.surfaces] == pytest.approx([1e7] * 4)
    assert [b.inertia[0] for b in found.bearing.bodies] == pytest.approx([3e-4, 1e-4, 3e-4, 3e-2])
    assert found.bearing.gravity == 9.80665
    assert found.motion == Motion.harmonic(0.025, 0.5, direction=pi / 2, cycles=1.0).held(2.0)
    assert found.top == Top.mass(11e3, (300, 280), 0.5, 1e7)
    assert found.effects == Auto(spin="patch", rims=False)
    assert found.solver == Solver("dopri5", rtol=1e-6, max_step=1e-3)
    assert found.stop == Stop(displacement=0.14)
    assert found.initial_state.q[3] == (-0.01, 0.0, 0.0) and found.initial_state.h[3] == (0.0, 1.0)


def test_a_file_round_trips(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(FULL, encoding="utf-8")
    first = load_scene(path)
    path.write_text(scene_text(first), encoding="utf-8")
    assert load_scene(path) == first
    assert 'kind = "harmonic"' in path.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"motion": Motion.circle(0.02, 0.5).rotated(0.3), "name": 'a "b" \\ é \x7f \n'},
        {"top": Top.prescribed((0, 0, -1e5), (1.0, 2.0, 3.0)), "duration": 1.0 / 3.0},
        {"motion": Motion.from_arrays(np.arange(5) / 7, np.random.default_rng(1).normal(size=(5, 3)) ** 3)},
        {"initial_state": InitialState(np.full((4, 3), 1e-3), np.zeros((4, 3)), np.zeros((4, 2)))},
        {"motion": Motion.from_record(bundled("ridgecrest-2019-ci-clc"), duration=30.0)},
        {"stop": Stop(0.14, all_rims=True), "solver": Solver(first_step=1e-5), "output_step": 0.1},
    ],
)
def test_scenes_made_in_python_round_trip_exactly(changes):
    first = scene(**changes)
    assert reread(first) == first


def test_a_changed_motion_is_written_as_it_is_and_not_as_it_was():
    first = replace(presets.scene("fenz-test1"), motion=MOTION)
    assert reread(first).motion == MOTION


def test_scene_is_a_value():
    one = scene(name="x")
    assert one == scene(name="x") and one != scene(name="y") and hash(one) == hash(scene(name="x"))
    assert pickle.loads(pickle.dumps(presets.scene("fenz-test1"))) == presets.scene("fenz-test1")
    assert one.effects == Auto() and one.spec == ModelSpec(one.bearing.layout, one.modelled)
    assert scene(effects=Effects()).spec == ModelSpec(one.bearing.layout, Effects())
    assert one.end == MOTION.duration and scene(duration=1.5).end == 1.5


def test_a_full_bearing_and_a_csv_beside_the_file(tmp_path):
    time = np.linspace(0, 1, 11)
    rows = "\n".join(f"{t:.3f},{t**2 * 10:.6f},0,0" for t in time)
    (tmp_path / "motion.csv").write_text(f"time [s], u1 [mm], u2 [mm], u3 [mm]\n{rows}\n", encoding="utf-8")
    plain = tomllib.loads(scene_text(scene()))
    plain["motion"] = {"kind": "arrays", "file": "motion.csv"}
    (tmp_path / "scene.toml").write_text(dumps(plain), encoding="utf-8")
    found = load_scene(str(tmp_path / "scene.toml"))
    assert found.bearing == presets.bearing("fenz-tfp")
    assert found.motion.displacement(1.0)[0] == pytest.approx(0.010)
    assert reread(found) == found


def test_planar_scenes_may_lie_in_any_vertical_plane():
    motion = Motion.harmonic(0.02, 0.5, direction=0.7)
    force, moment = (np.cos(0.7), np.sin(0.7), -1e5), (-np.sin(0.7), np.cos(0.7), 0.0)
    planar = Effects(dimension="planar")
    assert scene(motion=motion, effects=planar, top=Top.prescribed(force, moment)).effects == planar


def test_rims_need_no_numbers_where_they_are_not_modelled():
    bare = presets.bearing("fenz-tfp").replace(rim_radius=0.0, rim_stiffness=0.0)
    assert scene(bearing=bare, effects=Effects(rims=False)).bearing == bare


def test_toml_text_reads_back_exactly():
    table = {
        "a": 0.1 + 0.2,
        "b": np.float64(1e-300),
        "i": np.int64(3),
        "c": True,
        "d": [1, [2.5, -0.0]],
        "odd key.": 'x"\\\t\x00\x7f€',
        "none": None,
        "t": {"u": {"v": 1}, "rows": [{"k": 1, "deep": {"z": 2}}, {"k": 2}], "last": 5},
        "empty": [],
        "nothing": {},
    }
    expected = {key: value for key, value in table.items() if key != "none"}
    assert tomllib.loads(dumps(table)) == expected
    with pytest.raises(TypeError):
        dumps({"x": object()})
