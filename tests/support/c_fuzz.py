"""Every number, count and pointer that the C interface takes, spoiled one at a time; run as a program of its own.

`python -m support.c_fuzz LIBRARY KINDS SPEC` prints one line of JSON for each case: what was spoiled, the word of the
status, the message, and whether all numbers that came with the status `ok` are finite. A crash or a case without end
kills this process alone, after the name of the case was printed.
"""

from __future__ import annotations

import ctypes
import json
import signal
import sys
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from msfp_gen import Effects, Layout
from msfp_gen.embedding import values
from msfp_gen.specification import contract
from msfp_gen.specification.layout import ModelSpec
from support.c_interface import Array, Interface, pointer

# Of a number, a count, and an entry of an array.
NUMBERS = (np.nan, np.inf, -np.inf, -1.0, 0.0, 1e300, -1e300, 1e31, 1e-31)
COUNTS = (-1, 2**31 - 1, -(2**31))
STEPS = 60  # of a run that is accepted
SECONDS = 20  # that one case may take, on a machine that does much else
Outcome = tuple[int, bytes | None, bool]  # status, message, and whether the numbers are finite
Case = tuple[str, Callable[[], Outcome]]


class Bench:
    """A model with inputs that it accepts, from which cases deviate. Arrays stay alive with it."""

    def __init__(self, library: str, spec: ModelSpec) -> None:
        self.api = Interface(library, f"msfp_{spec.layout.name}")
        self.spec, self.nb, self.nq = spec, self.api.surfaces, self.api.coordinates
        example = values.example(spec)
        self.bodies, self.surfaces, self.top = (np.array(part) for part in example)
        if self.api.top_rotation:
            self.top = np.array(values.interface())
        self.gravity, self.load = np.array([values.GRAVITY]), values.LOAD
        self.handle = self.bearing()[2]

    def bearing(self) -> tuple[int, bytes | None, int | None]:
        """Status, message and handle of a bearing of the present values."""
        handle, message = ctypes.c_void_p(), ctypes.c_char_p()
        parts = (pointer(array) for array in (self.bodies, self.surfaces, self.top))
        refs = (ctypes.addressof(handle), ctypes.addressof(message))
        return self.api.bearing_new(float(self.gravity[0]), *parts, *refs), message.value, handle.value

    def arrays(self) -> dict[str, Array]:
        """Every array of a scene, by the name of its field, with sound numbers."""
        nb, nq, parts = self.nb, self.nq, self.api.memory_states
        pieces = np.zeros((2, 6, 6))
        motion, load = pieces.copy(), pieces.copy()
        motion[:, 0, 2], motion[1, 0, 1], motion[1, 0, 0] = 0.02, 0.02, 0.005  # one parabola
        load[:, 2, 0] = -self.load
        found = {
            "motion.knots": np.array([0.0, 0.5, 5.0]), "motion.coefficients": motion,
            "load.knots": np.array([0.0, 0.5, 5.0]), "load.coefficients": load,
            "support.knots": np.array([0.0, 0.5, 5.0]), "support.coefficients": pieces,
            "jumps": np.array([0.3, 0.7]), "q": np.full((nb, nq), 1e-5), "v": np.zeros((nb, nq)),
            "f": np.full((nb, 2), 0.1), "foot": np.zeros(2), "origin": np.zeros(3),
            "monitor_heat": np.zeros((nb, self.api.sizes["MSFP_HEAT_STATES"])),
            "stops": np.array([0.2, 0.4]), "span_ends": np.array([0.5, 5.0]), "span_steps": np.array([0.1, 0.2]),
            "monitor_heating": np.full(nb, 1e-6), "monitor_reach": np.full(nb, 0.01),
            "law_load": np.tile([1.0, 1e8], (nb, 1)),
        }  # fmt: skip
        if nq == 6:  # the unilateral contacts carry the load
            found["q"][:, 3:] = 0.0
            found["q"][:, 5] = -1e-4
        if parts:
            found["memory"] = np.zeros((nb, parts))
        if not self.api.top_rotation:
            del found["support.knots"], found["support.coefficients"]
        return found

    def scene(self, arrays: dict[str, Array]) -> Any:
        """A scene of these arrays and sound numbers."""
        s = self.api.new("msfp_scene")
        self.api.scene_default(ctypes.addressof(s))
        s.bearing, s.end_time = self.handle, 1.0
        for name, array in arrays.items():
            part, _, field = name.rpartition(".")
            setattr(getattr(s, part) if part else s, field, pointer(array))
            if field == "knots":
                getattr(s, part).pieces = len(array) - 1
        for name in ("jump", "stop", "span"):
            key = {"jump": "jumps", "stop": "stops", "span": "span_ends"}[name]
            setattr(s, f"{name}_count", len(arrays[key]) if key in arrays else 0)
        s.first_step, s.max_step, s.output_step, s.stop_displacement = 1e-3, 0.1, 0.01, 10.0
        s.monitors = (1 << self.api.enums["MSFP_MONITORS"]) - 1
        s.monitor_normal, s.monitor_peak, s.monitor_inertia, s.monitor_time = 1.0, 1e9, 10.0, 0.1
        s.monitor_rise, s.law_speed, s.law_temperature[1] = 100.0, 10.0, 500.0
        return s

    def run(self, scene: Any) -> tuple[int, bytes | None, int | None]:
        """Status, message and handle of a new run."""
        handle, message = ctypes.c_void_p(), ctypes.c_char_p()
        refs = (ctypes.addressof(handle), ctypes.addressof(message))
        return self.api.run_new(ctypes.addressof(scene), *refs), message.value, handle.value

    def rows(self, run: int) -> Array:
        """The rows of a run, a copy."""
        count = ctypes.c_size_t()
        return self._numbers(self.api.run_rows(run, ctypes.addressof(count)), count.value * self.api.row_size).reshape(
            -1, self.api.row_size
        )

    def progress(self, run: int) -> Any:
        found = self.api.new("msfp_progress")
        self.api.run_progress(run, ctypes.addressof(found))
        return found

    def outcome(self, scene: Any) -> Outcome:
        """How a run of a scene begins and goes on for some steps."""
        status, message, run = self.run(scene)
        if run is None:
            return status, message, True
        self.api.run_advance(run, STEPS)
        status, rows = self.progress(run).status, self.rows(run)
        extremes = np.zeros((2, self.api.extremes_size))  # and their times
        self.api.run_extremes(run, pointer(extremes[0]), pointer(extremes[1]))
        self.api.run_free(run)
        # The first values of extremes without a step are infinite.
        return status, message, bool(np.isfinite(rows).all()) and not bool(np.isnan(extremes).any())

    def port(self, scene: Any, axial_load: float) -> tuple[int, bytes | None, int | None]:
        handle, message = ctypes.c_void_p(), ctypes.c_char_p()
        refs = (ctypes.addressof(handle), ctypes.addressof(message))
        return self.api.port_new(ctypes.addressof(scene), axial_load, *refs), message.value, handle.value

    def port_scene(self) -> Any:
        s = self.api.new("msfp_scene")
        self.api.scene_default(ctypes.addressof(s))
        s.bearing = self.handle
        return s

    @staticmethod
    def _numbers(address: int | None, count: int) -> Array:
        if not count:
            return np.zeros(0)
        return np.ctypeslib.as_array(ctypes.cast(address, ctypes.POINTER(ctypes.c_double)), (count,)).copy()


def changed(array: Array, index: Any, value: float, then: Callable[[], Outcome]) -> Outcome:
    """The outcome with one entry changed, which is put back."""
    before = array[index]
    array[index] = value
    try:
        return then()
    finally:
        array[index] = before


def bearing_cases(b: Bench) -> Iterator[Case]:
    """Gravity, and every value of the bodies, the surfaces and the top."""

    mass = dict.fromkeys(contract.names(contract.TOP), 0.0)
    mass |= {"mass": 1e4, "inertia_transverse": 1e4, "inertia_axial": 1e4, "height": 1.0, "rotational_stiffness": 1e8}
    mass |= {"vertical_stiffness": 1e9, "vertical_damping": 1e6}
    own, mass_top = b.top, np.array(list(mass.values()))

    def outcome(of: str) -> Outcome:
        b.top = mass_top if of == "mass top" else own
        status, message, handle = b.bearing()
        if handle is None:
            return status, message, True
        scene = b.scene(b.arrays())
        scene.bearing = handle
        found = b.outcome(scene)
        b.api.bearing_free(handle)
        return found

    surface = contract.surface_values(b.spec.effects)
    tables: list[tuple[str, Array, tuple[str, ...]]] = [
        ("gravity", b.gravity[None], ("",)),
        *((f"body {k}", b.bodies[k : k + 1], contract.names(contract.BODY)) for k in range(b.nb + 1)),
        *((f"surface {j}", b.surfaces[j : j + 1], surface) for j in range(b.nb)),
        ("top", own[None], contract.names(contract.TOP)),
        ("mass top", mass_top[None], contract.names(contract.TOP)),
    ]
    for what, table, names in tables:
        for i, name in enumerate(names):
            for x in NUMBERS:
                yield (
                    f"{what} {name} = {x}",
                    lambda t=table, i=i, x=x, w=what: changed(t, (0, i), x, lambda: outcome(w)),
                )
    b.top = own


def scene_cases(b: Bench) -> Iterator[Case]:
    """Every member of msfp_scene, and the first and the last entry of every array."""

    def spoiled(field: str, value: Any, part: str = "") -> Outcome:
        arrays = b.arrays()  # they live until the run has ended
        scene = b.scene(arrays)
        target = getattr(scene, part) if part else scene
        if field.endswith("]"):
            target.law_temperature[int(field[-2])] = value
        else:
            setattr(target, field, value)
        return b.outcome(scene)

    def entry(name: str, index: int, value: float) -> Outcome:
        arrays = b.arrays()
        arrays[name].flat[index] = value
        return b.outcome(b.scene(arrays))

    for part, struct in (("", "msfp_scene"), *((h, "msfp_piecewise") for h in ("motion", "load", "support"))):
        for field, kind in b.api.structs[struct]._fields_:
            names = [f"{field}[{i}]" for i in range(2)] if field == "law_temperature" else [field]
            tried = {ctypes.c_int: COUNTS, ctypes.c_void_p: (None,)}.get(kind, NUMBERS)
            if isinstance(kind, type) and issubclass(kind, ctypes.Structure):
                continue  # its own members are spoiled
            for name in names:
                for x in tried:
                    yield (
                        f"scene {part + '.' if part else ''}{name} = {x}",
                        lambda n=name, x=x, p=part: spoiled(n, x, p),
                    )
    for name, array in b.arrays().items():
        for index in dict.fromkeys((0, -1)):
            for x in NUMBERS:
                yield f"array {name}[{index}] = {x}", lambda n=name, i=index % array.size, x=x: entry(n, i, x)


def input_cases(b: Bench) -> Iterator[Case]:
    """Every array of msfp_inputs, and the other arguments, of every kind of evaluation."""
    nb, nq, api = b.nb, b.nq, b.api
    sizes = {"q": nb * nq, "v": nb * nq, "a": nb * nq, "f": nb * 2, "base": 18, "load": 6, "support": 12, "foot": 2}
    sizes["memory"] = nb
    assert set(sizes) == {name for name, _ in api.structs["msfp_inputs"]._fields_}
    dof, unknowns, size = api.dof, api.unknowns, api.row_size
    balance = np.full(unknowns, 0.01)
    variables = np.array([[0, 1, 3], [1, 0, 2], [2, 0, 1], [3, 0, 4], [4, 0, 2]], dtype=np.intc)

    def outcome(call: str, given: dict[str, Array | None], factors: Array, chosen: Array, count: int) -> Outcome:
        at = api.new("msfp_inputs")
        for name, array in given.items():
            setattr(at, name, pointer(array))
        shapes = {
            "accelerations": (nb * nq, size, 2 * nb, unknowns),
            "observe": (size, api.enums["MSFP_WORKS"], 2 * nb),
            "condensed": (dof, dof * dof, 2 * nb),
            "momentum_balances": (unknowns, unknowns * len(chosen), 2 * nb * len(chosen)),
            "named_vectors": ((nb + 1) * 36, (nb + 1) * 12, (nb + 1) * 9),
        }
        out = [np.zeros(n) for n in shapes[call]]
        to, first = [pointer(array) for array in out], (b.handle, ctypes.addressof(at))
        if call == "accelerations":
            found = [api.accelerations(*first, full, *to, None) for full in (0, 1)]
            status = max(found)
        elif call == "condensed":
            status = api.condensed(*first, *factors, *to)
        elif call == "momentum_balances":
            status = api.momentum_balances(*first, pointer(balance), pointer(chosen), count, *to)
        else:
            status = getattr(api, call)(*first, *to, *((None,) if call == "observe" else ()))
        return status, None, all(np.isfinite(array).all() for array in out)

    factors = np.array([1e-3, 1.0, 1e3, 1e-3, 0.0])
    for call in ("accelerations", "observe", "condensed", "momentum_balances", "named_vectors"):
        sound: dict[str, Array | None] = {name: np.full(n, 1e-3) for name, n in sizes.items()}
        sound["load"] = np.array([0.0, 0.0, -b.load, 0.0, 0.0, 0.0])

        def tried(call: str, sound: Any, f: Array = factors, v: Array = variables, count: int = 5) -> Outcome:
            return outcome(call, sound, f, v, count)

        for name in sizes:
            yield f"{call} {name} = NULL", lambda c=call, s={**sound, name: None}: tried(c, s)
            for x in NUMBERS:
                array = sound[name].copy()
                array[-1] = x
                yield f"{call} {name} = {x}", lambda c=call, s={**sound, name: array}: tried(c, s)
        if call == "condensed":
            for i in range(5):
                for x in NUMBERS:
                    f = factors.copy()
                    f[i] = x
                    yield f"{call} factor {i} = {x}", lambda c=call, s=sound, f=f: tried(c, s, f)
        if call == "momentum_balances":
            for i in range(3):
                for x in COUNTS:
                    v = variables.copy()
                    v[0, i] = x
                    yield f"{call} variable {i} = {x}", lambda c=call, s=sound, v=v: tried(c, s, v=v)
            yield f"{call} count = -1", lambda c=call, s=sound: tried(c, s, count=-1)


def run_cases(b: Bench) -> Iterator[Case]:
    """Functions of a run: counts of steps and rows, and snapshots of any size."""
    api = b.api

    def on_run(use: Callable[[int], int]) -> Outcome:
        arrays = b.arrays()
        _, _, run = b.run(b.scene(arrays))
        assert run is not None
        api.run_advance(run, 3)
        status = use(run)
        finite = bool(np.isfinite(b.rows(run)).all())
        api.run_free(run)
        return status, None, finite

    def written(run: int, rows: int) -> int:
        size = api.snapshot_size(run, rows)
        buffer = ctypes.create_string_buffer(size)
        api.snapshot_write(run, rows, ctypes.addressof(buffer))
        return api.snapshot_read(run, ctypes.addressof(buffer), size)

    def cut(run: int, share: float) -> int:
        size = api.snapshot_size(run, -1)
        buffer = ctypes.create_string_buffer(size)
        api.snapshot_write(run, -1, ctypes.addressof(buffer))
        return api.snapshot_read(run, ctypes.addressof(buffer), int(share * size))

    for steps in (-1, 0, -(2**63)):
        yield f"run_advance {steps}", lambda n=steps: on_run(lambda run: api.run_advance(run, n) and 0)
    for rows in (-(2**63), -1, 1, 2**63 - 1):
        yield f"snapshot rows {rows}", lambda n=rows: on_run(lambda run: written(run, n))
    for share in (0.0, 0.01, 0.5, 0.999):
        yield f"snapshot cut {share}", lambda x=share: on_run(lambda run: cut(run, x))
    yield "snapshot NULL", lambda: on_run(lambda run: api.snapshot_read(run, None, 1000))
    yield "hold rows 0", lambda: on_run(lambda run: api.run_hold_rows(run, 2**64 - 1) or 0)
    yield "run_record NULL", lambda: (api.run_record(None), None, True)
    if not api.has("port_commit"):
        return
    for call, count in (
        ("port_commit", 1),
        ("port_wrench", 2),
        ("port_row", 2),
        ("port_derivative", 3),
    ):
        yield f"{call} NULL", lambda c=call, n=count: (getattr(api, c)(*(None,) * n), None, True)
    yield "port_step_begin NULL", lambda: (api.port_step_begin(None, 0.1, None), None, True)
    yield "port_stage NULL", lambda: (api.port_stage(None, 1, None, None), None, True)


def port_cases(b: Bench) -> Iterator[Case]:
    """A two-port: its scene, its load, the motions of its ends, by trials and by stages."""
    api = b.api
    still = np.zeros(36)

    def use(port: int, time: float, ends: Array, direction: Array) -> Outcome:
        status = api.port_trial(port, time, pointer(ends), None)
        wrench, row, matrix = np.zeros(12), np.zeros(api.row_size), np.zeros(144)
        rows = np.zeros((api.row_size + 6, 12))
        if status == 0:
            status = api.port_derivative(port, pointer(direction), pointer(matrix))
        if status == 0:
            status = api.port_row_derivative(port, pointer(direction), pointer(matrix), pointer(rows))
        if status == 0:
            status = api.port_wrench(port, pointer(wrench)) or api.port_row(port, pointer(row)) or api.port_commit(port)
        finite = all(np.isfinite(array).all() for array in (wrench, row, matrix, rows))
        return status, None, bool(finite)

    def outcome(scene: Any = None, load: float = 1e5, time: float = 0.01, ends: Array = still, **other: Any) -> Outcome:
        status, message, port = b.port(b.port_scene() if scene is None else scene, load)
        if port is None:
            return status, message, True
        along = other.get("direction", np.array([1.0, 0.0, 0.0]))
        found = use(port, time, ends, along) if status == 0 else (status, message, True)
        api.port_free(port)
        return found[0], message, found[2]

    def staged(
        step: float = 0.01, expected: float = 0.0, stage: int = 1, end: float = 0.0, time: float = 0.01
    ) -> Outcome:
        _, _, port = b.port(b.port_scene(), 1e5)
        ends, wrench, matrix, e = np.zeros(36), np.zeros(12), np.zeros(36), np.array([expected, 0.0])
        ends[18] = end
        error, share = ctypes.c_double(), ctypes.c_double()
        status = api.port_step_begin(port, step, pointer(e))
        for i in (1, 2) if stage == 1 else (stage,):
            status = status or api.port_stage(port, i, pointer(ends), pointer(wrench))
            status = status or api.port_stage_derivative(port, pointer(matrix))
        status = status or api.port_step_end(port, ctypes.addressof(error), ctypes.addressof(share))
        finite = all(np.isfinite(array).all() for array in (wrench, matrix, [error.value, share.value]))
        if status == 0:  # a step whose error is too large is not committed
            status = min(api.port_step_commit(port, time), 100)
        api.port_free(port)
        return status, None, bool(finite)

    def spoiled(field: str, value: Any) -> Outcome:
        scene = b.port_scene()
        setattr(scene, field, value)
        return outcome(scene)

    def interface() -> Outcome:
        status, message, handle = b.bearing()
        if handle is None:
            return status, message, True
        scene = b.port_scene()
        scene.bearing = handle
        found = outcome(scene)
        b.api.bearing_free(handle)
        return found

    for i, name in enumerate(contract.names(contract.TOP)):
        for x in NUMBERS:
            yield f"interface {name} = {x}", lambda i=i, x=x: changed(b.top, i, x, interface)
    for x in NUMBERS:
        yield f"port axial_load = {x}", lambda x=x: outcome(load=x)
        yield f"port time = {x}", lambda x=x: outcome(time=x)
        yield f"port step = {x}", lambda x=x: staged(step=x)
        yield f"port expected = {x}", lambda x=x: staged(expected=x)
        yield f"port stage end = {x}", lambda x=x: staged(end=x)
        yield f"port commit time = {x}", lambda x=x: staged(time=x)
        for i in range(3):
            direction = np.array([1.0, 0.0, 0.0])
            direction[i] = x
            yield f"port direction {i} = {x}", lambda d=direction: outcome(direction=d)
        for i in (0, 3, 7, 14, 18, 21, 25, 35):
            ends = still.copy()
            ends[i] = x
            yield f"port ends {i} = {x}", lambda e=ends: outcome(ends=e)
    for n in COUNTS:
        yield f"port stage = {n}", lambda n=n: staged(stage=n)
    for field, kind in api.structs["msfp_scene"]._fields_:
        tried: tuple[Any, ...] = {ctypes.c_int: COUNTS, ctypes.c_void_p: (None,), ctypes.c_double: NUMBERS}.get(
            kind, ()
        )
        for x in tried:
            yield f"port scene {field} = {x}", lambda f=field, x=x: spoiled(f, x)


def gradient_cases(b: Bench) -> Iterator[Case]:
    """Every member of msfp_gradient_inputs, and the first and the last entry of its arrays."""
    nb, nq, api, count = b.nb, b.nq, b.api, 2

    def arrays() -> dict[str, Array]:
        sizes = {
            "gravity": 1,
            "bodies": (nb + 1) * api.body_size,
            "surfaces": nb * api.surface_size,
            "top": api.top_size,
        }
        sizes |= {"q": nb * nq, "v": nb * nq, "f": nb * 2, "motion": 1, "load": 1}
        found = {name: np.zeros(count * n) for name, n in sizes.items()}
        found["motion"][:], found["load"][:] = (0.0, -1.0), (-1.0, 0.0)
        return found | {"motions": np.zeros(72), "loads": np.zeros(72), "steps": np.linspace(0.01, 0.3, 10)}

    def outcome(spoil: Callable[[Any, dict[str, Array]], None]) -> Outcome:
        scene_arrays, own = b.arrays(), arrays()
        given = api.new("msfp_gradient_inputs")
        given.count, given.energies, given.step_count = count, 1, len(own["steps"])
        for name, array in own.items():
            setattr(given, name, pointer(array))
        spoil(given, own)
        scene = b.scene(scene_arrays)
        scene.jump_count = scene.stop_count = 0
        _, message, run = b.run(scene)
        assert run is not None, message
        status = api.gradients_start(run, ctypes.addressof(given))
        if status == 0:
            api.run_advance(run, STEPS)
            status = b.progress(run).status
        rows = ctypes.c_size_t()
        address = api.gradient_rows(run, ctypes.addressof(rows))
        finite = (
            bool(np.isfinite(b._numbers(address, rows.value * given.count * api.row_size)).all())
            if status == 0
            else True
        )
        extremes = np.zeros(api.extremes_size)
        for index in (-1, 0, 2**31 - 1):
            api.gradient_extremes(run, index, pointer(extremes))
        api.run_free(run)
        return status, None, finite

    for field, kind in api.structs["msfp_gradient_inputs"]._fields_:
        for x in COUNTS if kind is ctypes.c_int else (None,):
            yield f"gradients {field} = {x}", lambda f=field, x=x: outcome(lambda given, _: setattr(given, f, x))
    for name, array in arrays().items():
        for index in (0, array.size - 1):
            for x in NUMBERS:

                def spoil(_: Any, own: dict[str, Array], name: str = name, index: int = index, x: float = x) -> None:
                    own[name][index] = x

                yield f"gradients {name}[{index}] = {x}", lambda s=spoil: outcome(s)


KINDS = {
    "bearing": bearing_cases,
    "scene": scene_cases,
    "inputs": input_cases,
    "run": run_cases,
    "port": port_cases,
    "gradients": gradient_cases,
}


def main(library: str, kinds: str, spec: str) -> None:
    """Try all cases of some kinds. spec: layout and effects of the model, as JSON."""
    layout, effects = json.loads(spec)
    bench = Bench(library, ModelSpec(Layout(*layout), Effects(**effects)))
    for kind in kinds.split(","):
        for name, case in KINDS[kind](bench):
            print(name, flush=True)
            signal.alarm(SECONDS)
            status, message, finite = case()
            signal.alarm(0)
            text = None if message is None else message.decode()
            print(json.dumps([name, bench.api.word(status), text, finite]), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
