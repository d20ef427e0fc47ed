"""The C interface refuses what Python refuses, whatever it is given, and a snapshot of anything else than its scene."""

from __future__ import annotations

import ctypes
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from support import ROOT, Array, model_of
from support.c_fuzz import KINDS, Bench
from support.c_interface import pointer
from support.ends import port
from support.example import example_bearing

from msfp_gen import Effects, InputError, Layout, Motion, Scene, Solver, Top, build_model
from msfp_gen.embedding import values
from msfp_gen.generator.interface import functions, public_header
from msfp_gen.model.model import Model
from msfp_gen.scene.scene_fields import InitialState, Stop
from msfp_gen.specification import contract
from msfp_gen.specification.layout import ModelSpec

LAW = "mu * (1 - c1 * exp(-c2 * v)) + c3 * tanh(c4 * N)"
SLOW: dict[str, tuple[tuple[int, int, int], dict[str, Any], bool]] = {
    "planar and massless": ((3, 1, 1), {"dimension": "planar", "sliders": "massless"}, False),
    "uplift": ((3, 1, 1), {"uplift": True}, False),
    "heat": ((5, 2, 2), {"friction": "pvt"}, False),
    "uplift between two ends": ((5, 2, 2), {"uplift": True, "top_rotation": True}, False),
    "a custom law without rims": ((4, 2, 1), {"friction": "custom", "friction_law": LAW, "rims": False}, False),
    "gradients": ((3, 1, 1), {}, True),
}


def results(model: Model, kinds: str, seconds: float = 60.0) -> dict[str, tuple[str, str | None]]:
    """Word of the status and message of every case: none crashes, lasts, or gives `ok` with what is not finite."""
    n, m, p = model.layout.n, model.layout.m, model.layout.p
    spec = json.dumps([[n, m, p], {k: v for k, v in asdict(model.effects).items() if v is not None}])
    command = [sys.executable, "-m", "support.c_fuzz", model.extension.__file__, kinds, spec]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "tests")])}
    done = subprocess.run(command, capture_output=True, text=True, timeout=seconds, env=environment, check=False)
    lines = done.stdout.splitlines()
    assert done.returncode == 0, f"{lines[-1:]} {done.stderr[-2000:]}"
    found = [json.loads(line) for line in lines if line.startswith("[")]
    assert 2 * len(found) == len(lines) and len({name for name, *_ in found}) == len(found)
    known = {*contract.names(contract.STATUSES), "argument", "snapshot"}
    for name, word, message, finite in found:
        assert word in known and (finite or word != "ok"), (name, word)
        assert word != "argument" or message is None or "give " in message or "leave " in message, (name, message)
    return {name: (word, message) for name, word, message, _ in found}


@cache
def default_results() -> dict[str, tuple[str, str | None]]:
    return results(model_of((5, 2, 2)), "bearing,scene,inputs,run")


@cache
def port_results() -> dict[str, tuple[str, str | None]]:
    return results(port().model, "port,run")


def test_every_input_ends_in_a_status_or_in_finite_numbers() -> None:
    found = default_results()
    assert len(found) > 1500 and len({word for word, _ in found.values()}) >= 6
    assert found["surface 2 radius = nan"] == (
        "argument",
        "surfaces: radius: give a finite number above 0 [m], 1e-30 to 1e+30",
    )
    assert found["array f[0] = -1.0"][0] == found["body 1 rim_radius = -1.0"][0] == found["scene rtol = 1e+300"][0]


def test_every_input_of_a_two_port_does_too() -> None:
    found = port_results()
    assert len(found) > 400 and found["port axial_load = 1e+31"][0] == found["port ends 0 = nan"][0] == "argument"


@pytest.mark.slow
@pytest.mark.parametrize("name", SLOW)
def test_every_input_of_other_models_does_too(name: str) -> None:
    layout, effects, gradients = SLOW[name]
    model = build_model(Layout(*layout), Effects(**effects), gradients=gradients)
    kinds = {*KINDS} - ({"gradients"} if not gradients else set())
    if not (model.effects.top_rotation and model.effects.dimension == "spatial"):
        kinds -= {"port"}
    assert len(results(model, ",".join(sorted(kinds)), 600.0)) > 900


# ---- Python says the same ------------------------------------------------------------------------------------------

BODY = dict.fromkeys(contract.names(contract.BODY), "") | {"inertia_transverse": "inertia", "inertia_axial": "inertia"}
RIG = ("stiffness", "damping", "rotational_stiffness", "rotational_damping", "vertical_stiffness", "vertical_damping")
MASS = ("mass", "inertia_transverse", "inertia_axial", "height", *RIG[2:])
LENGTH = 1.0  # of the runs [s]


def scene_with(what: str, field: str, x: float) -> Scene:
    """The scene of `Bench` with one number changed, through the classes of Python."""
    bearing, parts = example_bearing(), dict[str, Any](solver=Solver(max_step=0.1, first_step=1e-3))
    top = dict(zip(contract.names(contract.TOP), values.example(ModelSpec(Layout.tfp())).top, strict=True))
    parts["top"] = Top.rig(values.LOAD, **{name: top[name] for name in RIG})
    state = np.zeros((4, 3)), np.zeros((4, 3)), np.full((4, 2), 0.1)
    kind, _, number = what.partition(" ")
    optional = x or None  # 0 in C
    if what == "gravity":
        bearing = replace(bearing, gravity=x)
    elif what == "body 0":
        bearing = replace(bearing, **{f"base_{field}": x})
    elif kind == "body":
        bodies, k = list(bearing.bodies), int(number) - 1
        moments = dict(zip(("inertia_transverse", "inertia_axial"), bodies[k].moments, strict=True))
        change = {"inertia": tuple((moments | {field: x}).values())} if field in moments else {field: x}
        bodies[k] = replace(bodies[k], **change)
        bearing = replace(bearing, bodies=bodies)
    elif kind == "surface":
        surfaces = list(bearing.surfaces)
        surfaces[int(number)] = replace(surfaces[int(number)], **{field: x})
        bearing = replace(bearing, surfaces=surfaces)
    elif what == "top":
        parts["top"] = replace(parts["top"], **{field: x})
    elif what == "mass top":
        given = {"inertia_transverse": 1e4, "inertia_axial": 1e4, field: x}
        inertia = (given.pop("inertia_transverse"), given.pop("inertia_axial"))
        base = {
            "mass": 1e4,
            "height": 1.0,
            "rotational_stiffness": 1e8,
            "vertical_stiffness": 1e9,
            "vertical_damping": 1e6,
        }
        parts["top"] = Top.mass(
            **{**base, "inertia": inertia, **{k: v or None if k == RIG[4] else v for k, v in given.items()}}
        )
    elif field == "stop_displacement":
        parts["stop"] = None if optional is None else Stop(x)
    elif field == "output_step":
        parts["output_step"] = optional
    elif what == "array":
        state[("q[0]", "v[0]", "f[0]").index(field)].flat[0] = x
    else:
        value: Any = optional if field in ("max_step", "first_step") else x
        value = int(x) if field == "max_steps" and np.isfinite(x) and x == int(x) else value
        parts["solver"] = replace(parts["solver"], **{field: value})
    parts["initial_state"] = InitialState(*state)
    return Scene(bearing, Motion.ramp(0.05, 2.0), effects=Effects(bouc_wen="report"), duration=LENGTH, **parts)


def compared(name: str) -> tuple[str, str, float] | None:
    """What, field and number of a case that Python can state too."""
    left, _, number = name.rpartition(" = ")
    what, _, field = left.rpartition(" ")
    if not left or number in ("None", "NULL"):
        return None
    x = float(number)
    in_python = {
        "gravity": left == "gravity ",
        "top": field in RIG,
        # Without a mass the top is another one.
        "mass top": field in MASS and not (field == "mass" and x == 0),
        "scene": field
        in ("rtol", "atol_angle", "max_step", "first_step", "max_steps", "output_step", "stop_displacement"),
        "array": field in ("q[0]", "v[0]", "f[0]"),
        "body 0": field not in ("mass", "inertia_transverse", "inertia_axial"),
    }
    what = what or field if left == "gravity " else what
    known = in_python.get(what, what.startswith(("body ", "surface ")))
    return (what, field, x) if known else None


def test_c_accepts_what_python_accepts() -> None:
    """Every number of a bearing, a top, a solver and an initial state."""
    assert scene_with("gravity", "", 9.8)
    differences, count = [], 0
    for name, (word, message) in default_results().items():
        if (case := compared(name)) is None:
            continue
        count += 1
        try:
            scene_with(*case)
            refused = None
        except InputError as error:
            refused = str(error)
        if (refused is not None) != (word == "argument"):
            differences.append((name, word, message, refused))
    assert not differences
    assert count > 600


def test_c_accepts_the_interfaces_that_python_accepts() -> None:
    names = (
        "stiffness",
        "vertical_stiffness",
        "rotational_stiffness",
        "damping",
        "vertical_damping",
        "rotational_damping",
    )
    sound = dict.fromkeys(names, 1e6)
    checked = 0
    for name, (word, _) in port_results().items():
        what, _, number = name.partition(" = ")
        field = what.removeprefix("interface ")
        if what == field or field not in names:
            continue
        try:
            Top.node(**{**sound, field: float(number)})
            refused = False
        except InputError:
            refused = True
        assert refused == (word == "argument"), name
        checked += 1
    assert checked == 54


# ---- snapshots know what they are of -------------------------------------------------------------------------------


def bench_of(model: Model) -> Bench:
    return Bench(model.extension.__file__, ModelSpec(model.layout, model.effects))


def snapshot(b: Bench, run: int) -> Any:
    buffer = ctypes.create_string_buffer(b.api.snapshot_size(run, -1))
    b.api.snapshot_write(run, -1, ctypes.addressof(buffer))
    return buffer


def read(b: Bench, scene: Any, buffer: Any) -> str:
    """Word of the status of reading a snapshot in a new run of a scene."""
    status, message, run = b.run(scene)
    assert run is not None and status == 0, message
    word = b.api.word(b.api.snapshot_read(run, ctypes.addressof(buffer), len(buffer)))
    b.api.run_free(run)
    return word


def other_values(b: Bench) -> Iterator[tuple[str, Callable[[Any, dict[str, Array]], None]]]:
    """Every member of a scene, and an entry of every array, changed to another that is accepted."""
    other: dict[str, Any] = {
        "method": 2,
        "end_time": 1.5,
        "rtol": 2e-4,
        "monitors": 1,
        "max_step": 0.2,
        "start_time": 1e-3,
    }
    other |= {"jump_count": 1, "stop_count": 1, "span_count": 1, "first_step": 2e-3, "output_step": 0.02}
    structs = b.api.structs
    for field, kind in structs["msfp_scene"]._fields_:
        if kind in (ctypes.c_int, ctypes.c_double):

            def change(scene: Any, _: Any, field: str = field) -> None:
                before = getattr(scene, field)
                setattr(scene, field, other.get(field, 1 - before if isinstance(before, int) else 1.5 * before + 1e-3))

            yield field, change
        elif kind == ctypes.c_double * 2:
            for i in range(2):
                yield f"{field}[{i}]", lambda scene, _, f=field, i=i: getattr(scene, f).__setitem__(i, 300.0 + i)
    for name, array in b.arrays().items():
        near = 1e-6 if name not in ("jumps", "stops", "law_load") else 1e-3

        def nudge(_: Any, arrays: dict[str, Array], name: str = name, near: float = near) -> None:
            arrays[name].flat[0 if "knots" not in name else 1] += near

        assert array.size
        yield name, nudge


def test_a_snapshot_is_read_by_a_run_of_its_scene_alone() -> None:
    """Of every other value of a scene and of its bearing it is refused, and by the same scene it is read."""
    b = bench_of(model_of((5, 2, 2)))
    arrays = b.arrays()
    _, message, run = b.run(b.scene(arrays))
    assert run is not None, message
    b.api.run_advance(run, 20)
    buffer = snapshot(b, run)
    b.api.run_free(run)
    assert read(b, b.scene(b.arrays()), buffer) == "ok"
    seen = set()
    for name, change in other_values(b):
        arrays = b.arrays()
        scene = b.scene(arrays)
        change(scene, arrays)
        assert read(b, scene, buffer) == "snapshot", name
        seen.add(name.partition(".")[0].partition("[")[0])
    structs = {"bearing", "support", "memory"}  # values of a bearing follow; the model has neither of the others
    assert seen | structs == {name for name, _ in b.api.structs["msfp_scene"]._fields_}
    unused = {(k, name) for k in (0, 4) for name in ("rim_radius", "rim_offset")}  # the base and the plate meet no rim
    for table, names in ((b.bodies, contract.names(contract.BODY)), (b.surfaces, contract.names(contract.SURFACE))):
        for k, row in enumerate(table):
            for i, name in enumerate(names):
                if row[i] == 0.0 and (table is b.surfaces or k == 0) and "rim" not in name:
                    continue  # the base has no mass
                factor = 1.001 if name == "inertia_transverse" else 0.999
                before, row[i] = row[i], factor * row[i] + (1e-9 if row[i] == 0 else 0.0)
                _, message, handle = b.bearing()
                row[i] = before
                assert handle is not None, (name, message)
                arrays = b.arrays()
                scene = b.scene(arrays)
                scene.bearing = handle
                same = table is b.bodies and (k, name) in unused
                assert read(b, scene, buffer) == ("ok" if same else "snapshot"), (k, name)
                b.api.bearing_free(handle)


def test_a_sign_that_is_turned_everywhere_is_another_scene() -> None:
    b = bench_of(model_of((5, 2, 2)))
    arrays = b.arrays()
    _, _, run = b.run(b.scene(arrays))
    assert run is not None
    buffer = snapshot(b, run)
    b.api.run_free(run)
    arrays["motion.coefficients"] *= -1.0
    assert read(b, b.scene(arrays), buffer) == "snapshot"


def test_a_snapshot_of_another_two_port_is_refused() -> None:
    """Of another load, bearing, interface or tolerance; not of another start time."""
    b = bench_of(port().model)

    def made(load: float = 1e5, top: Any = None, friction: float = 1.0, **changes: float) -> int:
        own, own_top = b.surfaces.copy(), b.top.copy()
        b.surfaces[:, contract.names(contract.SURFACE).index("friction")] *= friction
        b.top[:] = own_top if top is None else top
        handle = b.bearing()[2]
        b.surfaces[:], b.top[:] = own, own_top
        scene = b.port_scene()
        scene.bearing = handle
        for name, value in changes.items():
            setattr(scene, name, value)
        _, message, made = b.port(scene, load)
        b.api.bearing_free(handle)
        assert made is not None, message
        return made

    first = made()
    size = b.api.port_snapshot_size(first)
    buffer = ctypes.create_string_buffer(size)
    b.api.port_snapshot_write(first, ctypes.addressof(buffer))
    stiffer = b.top * 1.01
    cases: dict[str, dict[str, Any]] = {"same": {}, "start": {"start_time": 3.0}, "load": {"load": 2e5}}
    cases |= {"friction": {"friction": 1.1}, "interface": {"top": stiffer}, "rtol": {"rtol": 1e-5}}
    cases |= {"method": {"method": 2}, "monitor": {"monitor_peak": 1e6}}
    for name, changes in cases.items():
        other = made(**changes)
        word = b.api.word(b.api.port_snapshot_read(other, ctypes.addressof(buffer), size))
        assert word == ("ok" if name in ("same", "start") else "snapshot"), name
        b.api.port_free(other)
    b.api.port_free(first)


def test_a_model_without_two_ports_refuses_them() -> None:
    """Nothing of the two-port is compiled into it: what makes one refuses, and the rest is not there."""
    b = bench_of(model_of((5, 2, 2)))
    scene, handle, message = b.port_scene(), ctypes.c_void_p(1), ctypes.c_char_p()
    refused = "bearing: give one of a model for two-ports; export it with --top-rotation, in space, with locked spin"
    for new, more in ((b.api.port_new, (1e5,)), (b.api.port_new_loaded, ())):
        status = new(ctypes.addressof(scene), *more, ctypes.addressof(handle), ctypes.addressof(message))
        assert b.api.word(status) == "argument" and message.value == refused.encode() and handle.value is None
    b.api.port_free(None)
    names = {name for name in functions(public_header()) if name.startswith("port_")}
    assert {name for name in names if b.api.has(name)} == {"port_new", "port_new_loaded", "port_free", "port_method"}
    assert all(bench_of(port().model).api.has(name) for name in names)


def test_calls_without_a_handle_or_a_place_are_refused() -> None:
    """They end in `argument` and read nothing at no address; the two-port that was asked goes on."""
    b = bench_of(port().model)
    api, scene, text = b.api, b.port_scene(), ctypes.c_char_p()
    _, message, made = b.port(scene, 1e5)
    assert made is not None, message
    at, to = ctypes.addressof(scene), ctypes.addressof(text)
    statuses = {
        "run_new": api.run_new(at, None, to),
        "port_new_loaded": api.port_new_loaded(at, None, to),
        "snapshot_read": api.snapshot_read(None, None, 0),
        "snapshot_open": api.snapshot_open(None, 0, None),
        "port_wrench": api.port_wrench(None, None),
        "port_wrench to no place": api.port_wrench(made, None),
        "port_row": api.port_row(None, None),
        "port_row to no place": api.port_row(made, None),
        "port_snapshot_read": api.port_snapshot_read(None, None, 0),
        "port_method": api.port_method(-1, None),
        "port_jump": api.port_jump(None, None),
    }
    assert {name: api.word(status) for name, status in statuses.items()} == dict.fromkeys(statuses, "argument")
    assert text.value == b"port: give the address of a handle"
    assert ctypes.string_at(api.status_text(statuses["port_row"]))
    ends, counts = np.zeros((2, 3, 6)), np.zeros(api.enums["MSFP_COUNTS"], dtype=np.int64)
    assert api.word(api.port_trial(made, 0.01, pointer(ends), to)) == "ok"
    api.port_counts(made, pointer(counts))
    assert counts[api.enums["MSFP_COUNT_STEPS"]] > 0 and counts.min() >= 0
    api.port_free(made)
