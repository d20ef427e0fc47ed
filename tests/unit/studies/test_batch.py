"""Many scenes at once: every number is that of `simulate`, in threads and in processes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from dataclasses import fields, replace
from functools import cache, partial
from typing import Any

import numpy as np
import pytest
from plain import plain_scene
from support import ROOT, endless, scene_of

from msfp_gen import (
    Auto,
    Bearing,
    Body,
    Effects,
    InputError,
    Layout,
    Load,
    Motion,
    RunError,
    Scene,
    Surface,
    Top,
    load_scene,
    presets,
    simulate,
    simulate_batch,
)
from msfp_gen.cli import main
from msfp_gen.common.cores import usable_cores
from msfp_gen.model import model as models
from msfp_gen.motions.piecewise import ORDER
from msfp_gen.motions.prescribed import Rotation
from msfp_gen.results.result import Result
from msfp_gen.scene.effect_selection import EffectSelection
from msfp_gen.scene.file.source import changed_scene
from msfp_gen.scene.scene import InitialState
from msfp_gen.studies import batch
from msfp_gen.studies.sweep import variations, varied_field
from msfp_gen.studies.workers import Workers, worker_count

STILL = Motion(np.array([0.0, 4.0]), np.zeros((1, 6, ORDER)))


def alone(scene: Scene) -> Result:
    """What `simulate` makes of a scene, also where it fails."""
    try:
        return simulate(scene)
    except RunError as error:
        assert isinstance(error.result, Result)
        return error.result


def assert_same(one: Result, other: Result) -> None:
    """Two results, bit by bit, but for the seconds that they took."""
    assert one.scene == other.scene
    for name in (field.name for field in fields(one.history)):
        x, y = getattr(one.history, name), getattr(other.history, name)
        parts = x if isinstance(x, dict) else {name: x}
        others = y if isinstance(y, dict) else {name: y}
        assert parts.keys() == others.keys()
        for key, values in parts.items():
            assert (values is None) == (others[key] is None), key
            assert values is None or values.tobytes() == others[key].tobytes(), (one.scene.name, key)
    assert (one.status, one.message, one.notes) == (other.status, other.message, other.notes)
    assert replace(one.counters, wall_time=0.0) == replace(other.counters, wall_time=0.0)
    assert len(one.events) == len(other.events)
    for event, its in zip(one.events, other.events, strict=True):
        assert (event.time, event.surface, event.kind) == (its.time, its.surface, its.kind)
        assert np.array_equal(event.displacement, its.displacement) and np.array_equal(event.top_force, its.top_force)
    assert {**one.provenance, "build_seconds": ""} == {**other.provenance, "build_seconds": ""}


@cache
def usual() -> tuple[Scene, ...]:
    """Cyclic tests, orbits and a record of unlike lengths and tolerances; with rims met; all of one model."""
    names = ("fenz-test1", "becker-circle-50", "fenz-test2", "fenz-test5", "fenz-monotonic")
    scenes = [load_scene(name) for name in names]
    scenes += [scene_of("fenz-test2", solver={"rtol": rtol}, output_step=0.5) for rtol in (1e-2, 1e-3, 1e-5)]
    scenes += [replace(plain_scene("ridgecrest-clc"), duration=seconds) for seconds in (2.0, 5.0, 8.0)]
    scenes.append(scene_of("becker-eight-125", solver={"method": "esdirk4"}))
    return tuple(scenes)


def failing() -> list[Scene]:
    """Runs that end too early: without steps, and where a bearing would part."""
    strong = changed_scene("ridgecrest-clc", {"motion.scale": 8.0}).motion
    return [scene_of("fenz-test3", solver={"max_steps": 40}), replace(plain_scene("ridgecrest-clc"), motion=strong)]


def flying() -> Scene:
    """A bearing that a jerk unloads for a fifth of a second, begun with a model that keeps all surfaces closed."""
    load = Load.from_arrays([0, 1, 1.05, 1.15, 1.2, 4], np.outer([0, 0, 1, 1, 0, 0], [0.0, 0.0, 1.6e5]))
    top = Top.mass(11e3, 4e3, 0.3, rotational_stiffness=1e7, rotational_damping=1e4)
    scene = Scene(presets.bearing("fenz-tfp"), STILL, top, load=load, output_step=0.005, duration=1.5, effects=Auto())
    scene.__dict__["effect_selection"] = EffectSelection(replace(scene.modelled, uplift=False, sliders="massless"))
    return scene


@cache
def of_every_kind() -> tuple[Scene, ...]:
    """Models that differ in every effect, methods, runs that go on with wider models, plates out of level, failures."""
    test2 = load_scene("fenz-test2")
    heats = replace(
        test2,
        bearing=presets.bearing("fenz-tfp").replace(reference_pressure=15e6),
        effects=Auto(),
        motion=Motion.harmonic(0.08, 0.5, cycles=8),
        duration=None,
    )
    tilted = replace(
        test2,
        motion=Motion.harmonic(0.05, 0.5, cycles=1).rocking(Rotation.constant(theta=0.01)),
        effects=Auto(),
        duration=None,
    )
    return (
        scene_of("fenz-test2", {"dimension": "planar"}),
        scene_of("fenz-test2", {"dimension": "planar", "sliders": "massless", "rims": False}),
        scene_of("fenz-test1", {"uplift": True}),
        scene_of("fenz-test1", {"spin": "patch"}, duration=2.0),
        scene_of("fenz-test1", solver={"method": "dopri5", "rtol": 1e-3}, duration=0.01),
        replace(heats, effects=Effects(friction="pvt", dimension="planar")),
        heats,
        tilted,
        flying(),
        replace(plain_scene("ridgecrest-clc"), effects=Auto(), duration=5.0),
        scene_of("fenz-test1", {"bouc_wen": "isotropic"}, duration=2.0),
        *failing(),
    )


def test_every_number_is_that_of_simulate() -> None:
    results = simulate_batch(usual(), workers=3)
    for scene, result in zip(usual(), results, strict=True):
        assert result.scene is scene and result.succeeded and result.counters.wall_time > 0
        assert_same(result, alone(scene))


@pytest.mark.slow
def test_every_number_is_that_of_simulate_for_effects_laws_and_methods() -> None:
    results = simulate_batch(of_every_kind(), workers=2)
    for scene, result in zip(of_every_kind(), results, strict=True):
        assert_same(result, alone(scene))
    widened = [note.kind for result in results for note in result.notes if note.action]
    assert {"heat", "uplift"} <= set(widened)
    assert [result.status for result in results[-2:]] == ["steps", "uplift"]
    assert "give effects.uplift = true" in results[-1].message


def test_every_number_is_that_of_simulate_in_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Workers, "in_process", lambda *_: True)
    scenes = [usual()[0], of_every_kind()[7], *failing(), flying()]
    told: list[tuple[int, int]] = []
    results = simulate_batch(scenes, workers=2, progress=lambda done, count: told.append((done, count)))
    assert told == [(done, len(scenes)) for done in range(1, len(scenes) + 1)]
    for scene, result in zip(scenes, results, strict=True):
        assert result.scene is scene
        assert isinstance(vars(result)["history"], partial), "rows travel, and make no history on their way"
        assert_same(result, alone(scene))


def test_strict_is_refused_where_runs_have_no_such_option() -> None:
    with pytest.raises(InputError, match="strict: only runs of one bearing"):
        simulate_batch([usual()[0], load_scene("hospital-clc")], strict=True)


def test_strict_stops_where_something_left_out_would_matter() -> None:
    (result,) = simulate_batch([flying()], strict=True)
    with pytest.raises(RunError) as caught:
        simulate(flying(), strict=True)
    assert isinstance(caught.value.result, Result) and result.status == "monitor"
    assert_same(result, caught.value.result)


def test_results_come_in_the_order_of_the_scenes() -> None:
    rtols = np.geomspace(1e-2, 1e-4, 40)
    scenes = [scene_of("fenz-test1", solver={"rtol": float(rtol)}) for rtol in rtols]
    told: list[tuple[int, int]] = []
    results = simulate_batch(iter(scenes), progress=lambda done, count: told.append((done, count)))
    assert [result.scene.solver.rtol for result in results] == list(rtols)
    assert told == [(done, 40) for done in range(1, 41)]
    assert results[0].counters.steps < results[-1].counters.steps
    assert simulate_batch([]) == []


def test_models_are_built_once_and_before_any_run(monkeypatch: pytest.MonkeyPatch) -> None:
    happened: list[str] = []
    load, run = models.load, batch._run
    monkeypatch.setattr(models, "_models", {})
    monkeypatch.setattr(models, "load", lambda spec, say: happened.append(spec.key) or load(spec, say))
    monkeypatch.setattr(batch, "_run", lambda *call: happened.append("run") or run(*call))
    other = scene_of("fenz-test1", {"dimension": "planar"})
    simulate_batch([load_scene("fenz-test1"), other] * 4, workers=4)
    assert happened == [load_scene("fenz-test1").spec.key, other.spec.key, *["run"] * 8]


@pytest.mark.parametrize("processes", [False, True])
def test_an_error_of_the_caller_ends_all_runs(processes: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Workers, "in_process", lambda *_: processes)

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    before = threading.active_count()
    begin = time.perf_counter()
    with pytest.raises(KeyboardInterrupt):
        simulate_batch([*endless(1), load_scene("fenz-test1")], workers=2, progress=interrupted)
    while threading.active_count() > before and time.perf_counter() - begin < 20.0:
        time.sleep(0.01)  # the thread with which loky watches its processes ends after them
    assert threading.active_count() == before and time.perf_counter() - begin < 20.0


PROGRAM = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # background jobs of a shell are started ignoring it
sys.path.insert(0, "{tests}")
from support import endless
from msfp_gen import build_model, simulate_batch
from msfp_gen.studies.workers import Workers
Workers.in_process = lambda *_: {processes}
scenes = endless(6)
build_model(scenes[0].bearing.layout, scenes[0].modelled)
print("ready", flush=True)
simulate_batch(scenes, workers=2)
"""


@pytest.mark.parametrize("processes", [pytest.param(False, marks=pytest.mark.slow), True])
def test_ctrl_c_ends_a_batch(processes: bool, tmp_path: Any) -> None:
    script = tmp_path / "script.py"
    script.write_text(PROGRAM.format(tests=ROOT / "tests", processes=processes), encoding="utf-8")
    with subprocess.Popen(
        [sys.executable, script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as run:
        try:
            assert run.stdout is not None and run.stdout.readline() == "ready\n"
            time.sleep(1.5)
            begin = time.perf_counter()
            os.killpg(run.pid, signal.SIGINT)  # as a terminal does: to every process of the group
            _, errors = run.communicate(timeout=60)
            assert time.perf_counter() - begin < 10.0
        finally:
            with suppress(ProcessLookupError):
                os.killpg(run.pid, signal.SIGKILL)
    assert run.returncode != 0 and "KeyboardInterrupt" in errors


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda scene: simulate_batch(scene), "scenes: this is one scene; give a list"),
        (lambda scene: simulate_batch([scene, "fenz-test2"]), "scenes[1]: a str is no scene; give what load_scene"),
        (lambda scene: simulate_batch([scene], workers=0), "workers = 0: give a whole number of runs at the same time"),
        (
            lambda scene: simulate_batch(
                [
                    scene,
                    replace(scene, effects=Effects(sliders="massless"), solver=replace(scene.solver, method="dopri5")),
                ]
            ),
            "scenes[1]: solver.method = 'dopri5': massless sliders",
        ),
    ],
)
def test_bad_input_is_refused_before_anything_runs(call: Any, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("msfp_gen.studies.batch.build_model", None)
    with pytest.raises(InputError) as caught:
        call(load_scene("fenz-test1"))
    assert words in str(caught.value)


def test_a_run_that_fails_at_its_start_has_the_state_there(monkeypatch: pytest.MonkeyPatch) -> None:
    surface = Surface(radius=0.1, friction=0.5, yield_displacement=1e-4, capacity=0.14, rim_stiffness=1e8)
    body = Body(mass=1.0, height=0.09, centroid=0.08, inertia=(1e-4, 1e-4), rim_radius=0.01)
    bearing = Bearing(
        layout=Layout(2, 1, 0), base_height=0.02, base_rim_radius=0.01, gravity=9.8, surfaces=[surface], bodies=[body]
    )
    start = InitialState([[0.0, -0.3, 0.0]], [[0.0] * 3], [[1.0, 0.0]])
    effects = Effects(dimension="planar")
    stuck = Scene(bearing, STILL, Top.prescribed((0.0, 0.0, 0.0)), effects, initial_state=start)
    with pytest.raises(RunError) as caught:
        simulate(stuck)
    ended, failed = simulate_batch([load_scene("fenz-test1"), stuck])
    assert ended.succeeded and caught.value.result is None
    assert failed.status == caught.value.status and failed.message.startswith(str(caught.value))
    assert failed.status in ("irregular", "newton") and failed.history.time.tolist() == [0.0]
    # As of a state that is not finite.
    monkeypatch.setattr("msfp_gen.simulation.bearing_run.finite_rows", lambda rows: rows[: len(rows) - 1])
    with pytest.raises(RunError, match=r"^scenes\[1\]: stopped at t = 0 s") as caught:
        simulate_batch([load_scene("fenz-test1"), stuck])
    assert caught.value.status == failed.status


def test_the_number_of_workers_is_that_of_the_cores_or_as_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 3, 5}, raising=False)
    assert usable_cores() == worker_count(None) == 3 and worker_count(2) == 2
    monkeypatch.delattr(os, "sched_getaffinity")
    monkeypatch.setattr(os, "cpu_count", lambda: 7)
    assert worker_count(None) == 7


def test_fields_take_several_values() -> None:
    fields = [varied_field("solver.rtol=1e-3, 1e-4"), varied_field("bearing.gravity = 9.81, 9.8")]
    found = variations("fenz-test2", fields)
    assert found[1].source == "fenz-test2" and found[1].varied == {"solver.rtol": 1e-3, "bearing.gravity": 9.8}
    scenes = [variation.scene for variation in found]
    values = [(scene.solver.rtol, scene.bearing.gravity) for scene in scenes]
    assert values == [(1e-3, 9.81), (1e-3, 9.8), (1e-4, 9.81), (1e-4, 9.8)]
    assert scenes[1].name == "fenz-test2, solver.rtol = 0.001, bearing.gravity = 9.8"
    assert [variation.scene for variation in variations("fenz-test2", [])] == [load_scene("fenz-test2")]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("motion.scale", "--vary = 'motion.scale': give a field of the scene and its values"),
        ("motion.scale=1,,2", "the values are no TOML"),
        ("motion.scale=", "there are no values"),
        (".=1", "give a field of the scene"),
        ("solver.rtool=1e-3", "solver.rtool: unknown key"),
        ("name.x=1", "name.x = 1: name is 'fenz-test1' here, which has no fields to change"),
        ("solver.rtol=2", "solver.rtol"),
    ],
)
def test_fields_that_are_none(text: str, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["batch", "fenz-test1", "--vary", text]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("error: ") and err.count("\n") == 1 and words in err
