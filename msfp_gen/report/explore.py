"""The page of the explorer: template, scripts, models as WebAssembly and problems in one file that loads no other.

A problem is one scene as a packed array of numbers, and what the page needs to draw and change it.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, cast

import numpy as np

from msfp_gen.common.aliases import Progress
from msfp_gen.common.arrays import Array, parts
from msfp_gen.common.errors import CompileError, InputError
from msfp_gen.figures.style import colour
from msfp_gen.jit.build import runtime_sources
from msfp_gen.jit.compiler import FLAGS, BuildStep, Log, zig_program
from msfp_gen.report.frames import asset, pieces, render, script_data, write_page
from msfp_gen.results.sign import shown_sign
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.top import RigTop
from msfp_gen.simulation.start import first_arguments, needs_settling
from msfp_gen.specification import contract
from msfp_gen.specification.layout import Effects, ModelSpec


@dataclass(frozen=True, eq=False)
class Problem:
    """A scene for the page.

    Attributes:
        scene: with fixed effects; `simulate` of it gives the numbers of the page.
        spec: its model.
        data: for the scripts, ready for JSON.
    """

    scene: Scene
    spec: ModelSpec
    data: dict[str, Any]


def problem_of(scene: Scene, title: str) -> Problem:
    """The problem of a scene. Its effects are those at the start, with rims, and do not change during a run.

    Raises InputError for a scene whose top rotates, whose friction heats or whose plates are tilted at the start.
    """
    fixed = fixed_scene(scene)
    effects = cast("Effects", fixed.effects)
    spec = ModelSpec(fixed.bearing.layout, effects)
    (stack, run, options), azimuth = first_arguments(fixed, spec)
    motion, load = (
        {"knots": _packed(knots), "coefficients": _columns(coefficients)}
        for knots, coefficients in ((run[0], run[1]), (run[2], run[3]))
    )
    data = {
        "title": title,
        "name": fixed.name,
        "planar": effects.dimension == "planar",
        "azimuth": azimuth,
        "numbers": [
            stack[0],
            contract.names(contract.METHODS).index(options["method"]),
            *(float(options[name]) for name in ("rtol", "atol_angle", "first_step", "max_steps", "duration")),
            *(float(options[name]) for name in ("output_step", "stop_displacement", "stop_all_rims", "sampled")),
            float(options["quasistatic"]),
        ],
        "bodies": np.asarray(stack[1]).tolist(),
        "surfaces": np.asarray(stack[2]).tolist(),
        "top": np.asarray(stack[3]).tolist(),
        "state": [np.asarray(value).ravel().tolist() for value in run[5:8]],
        "motion": motion,
        "load": load,
        "pivot": _pivot(fixed.bearing),
        "sign": shown_sign()._asdict(),
        "jumps": _packed(run[4]),
        "stops": _packed(options["stops"]),
        "spans": [_packed(options["span_ends"]), _packed(options["span_steps"])],
        "row": _offsets(contract.row(effects), fixed.bearing.layout.surfaces),
        "extremes": _offsets(contract.extremes(effects), fixed.bearing.layout.surfaces),
        "statuses": [status.name for status in contract.STATUSES if status.compiled],
        "values": list(contract.surface_values(effects)),
        "heights": [float(height) for height in fixed.bearing.arrays()["height"]],
        "signs": list(fixed.bearing.layout.signs),
        "outlines": [pieces(fixed.bearing, body) for body in range(fixed.bearing.layout.n)],
        "colours": [colour(surface) for surface in range(1, fixed.bearing.layout.surfaces + 1)],
        "axialLoad": fixed.top.axial_load if isinstance(fixed.top, RigTop) and fixed.load is None else None,
        "kind": str(fixed.motion.metadata.get("kind", "")),
        "record": fixed.motion.sampled,
        "amplitude": float(np.abs(fixed.motion.displacement(np.linspace(0.0, fixed.end, 4001))[:, :2]).max()),
        "period": float(str(period)) if (period := fixed.motion.metadata.get("period")) is not None else None,
    }
    return Problem(fixed, spec, data)


def _pivot(bearing: Bearing) -> dict[str, Any] | None:
    """Surfaces on both sides of the pivot, from it outwards, and the distance of each, of friction given there."""
    if bearing.friction_given_at != "pivot" or bearing.friction_at_pivot is None:
        return None
    middle, count = bearing.layout.m, bearing.layout.surfaces
    interfaces = np.cumsum(bearing.arrays()["height"])[:count]
    heights = np.abs(interfaces - (interfaces[middle - 1] + interfaces[middle]) / 2)
    return {"chains": [list(range(middle - 1, -1, -1)), list(range(middle, count))], "heights": heights.tolist()}


def fixed_scene(scene: Scene) -> Scene:
    """The scene with the effects at its start, and rims. Raises InputError where the page cannot run it."""
    selection = scene.effect_selection
    refused = {
        "top_rotation": scene.top_rotation is not None,
        "effects.friction": (law := selection.effects.law) is not None and law.memory is not None,
        "motion": needs_settling(scene),
        "effects.uplift": selection.effects.uplift,
    }
    if names := [name for name, true in refused.items() if true]:
        raise InputError(
            f"{names[0]}: the explorer runs scenes without tilted plates, uplift, and friction that depends on heat or "
            "path; use `msfp-gen report`"
        )
    effects = replace(selection.effects, rims=True)
    if effects.dimension == "planar" and selection.plane_until < scene.end:
        effects = replace(effects, dimension="spatial")
    return replace(scene, effects=effects)


def _offsets(quantities: tuple[contract.Recorded, ...], surfaces: int) -> dict[str, list[int]]:
    """Name -> offset and number of values of every field; "" -> the number of all values."""
    lengths = {
        contract.Extent.SURFACES: surfaces,
        contract.Extent.COORDINATES: 3,
        contract.Extent.WORKS: len(contract.WORKS),
    }
    shapes = [
        (one.name, tuple(lengths[n] if isinstance(n, contract.Extent) else n for n in one.shape)) for one in quantities
    ]
    size = sum(int(np.prod(shape, dtype=int)) for _, shape in shapes)
    places = parts(np.arange(size), shapes)
    return {name: [int(place.flat[0]), place.size] for name, place in places.items()} | {"": [size, 0]}


def _columns(coefficients: Array) -> dict[str, Any]:
    """Coefficients, shape (k, 6, 6), as their columns that are not zero: indices in a piece, and values."""
    flat = np.asarray(coefficients).reshape(len(coefficients), -1)
    kept = np.flatnonzero(flat.any(axis=0))
    return {"pieces": len(flat), "columns": kept.tolist(), "values": _packed(flat[:, kept])}


def _packed(values: Any) -> str:
    """Numbers as little-endian float64 in base64."""
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f8").tobytes()).decode("ascii")


# Presets of a page without a scene of the user's: laboratory tests, orbits, other devices, and a bundled record.
EXPLORED = (
    "fenz-test2", "fenz-test5", "becker-circle-88", "becker-eight-88", "unusual-tfp", "double-push", "quintuple-push",
    "ridgecrest-clc",
)  # fmt: skip
RECORD = 15.0  # of a record [s]: the strong part of the bundled one
WORKER = ("explorer/solver.js", "explorer/worker.js")
# The first two stand in the HTML report too.
SCRIPTS = ("dom.js", "chart.js", "explorer/numbers.js", "explorer/stack.js", "explorer/explorer.js")


def write_explorer(path: str | Path, scene: Scene | None = None, progress: Progress | None = None) -> Path:
    """Write the explorer to `path`; the file appears only when complete. Arguments and errors as in `explorer_html`.

    Raises InputError for a path that does not end in .html or cannot be written.
    """
    return write_page(path, lambda: explorer_html(scene, progress))


def explorer_html(scene: Scene | None = None, progress: Progress | None = None) -> str:
    """The explorer as text: of a scene, with the presets that have its model, or of the presets `EXPLORED`.

    Args:
        scene: the scene that the page shows first; None: presets only.
        progress: called with the number of compiled models and of all models.

    Raises:
        InputError: the page cannot run the scene.
        CompileError: ziglang is missing, or it rejected a file.
    """
    from markupsafe import Markup

    problems = _problems(scene)
    specs = list(dict.fromkeys(problem.spec for problem in problems))
    modules = []
    for done, spec in enumerate(specs, start=1):
        modules.append(base64.b64encode(wasm_module(spec)).decode("ascii"))
        if progress is not None:
            progress(done, len(specs))
    data = {
        "modules": modules,
        "problems": [{**problem.data, "module": specs.index(problem.spec)} for problem in problems],
    }
    return render(
        "explorer/explorer.html.jinja",
        data=script_data(data),
        worker=Markup("".join(map(asset, WORKER))),
        scripts=[Markup(asset(name)) for name in SCRIPTS],
    )


def explored_scene(name: str) -> Scene:
    """The preset of a page, with selected effects. Of a record its first 15 s, at a tolerance and rows for drawing."""
    from msfp_gen.scene.file import presets
    from msfp_gen.specification.layout import Auto

    scene = presets.scene(name)
    scene = replace(scene, effects=Auto(rims=True, bouc_wen=scene.effects.bouc_wen))
    if not scene.motion.sampled:
        return scene
    return replace(scene, duration=RECORD, output_step=0.02, solver=replace(scene.solver, rtol=1e-2))


def _title(name: str, text: str) -> str:
    return f"{name}: {text}" + (f", the first {RECORD:g} s" if name.startswith("ridgecrest") else "")


def _problems(scene: Scene | None) -> Sequence[Problem]:
    """What the page shows, in the order of its list."""
    from msfp_gen.scene.file import presets

    known = presets.names("scene")
    named = [problem_of(explored_scene(name), _title(name, known[name])) for name in EXPLORED]
    if scene is None:
        return named
    first = problem_of(scene, scene.name or "scene")
    return [first, *(problem for problem in named if problem.spec == first.spec and problem.scene.name != scene.name)]


GLUE = "explorer.c"
OUTPUT = "model.wasm"
# A library without a main function; of the processor only the vectors that every browser has.
TARGET = ("-target", "wasm32-wasi", "-mexec-model=reactor", "-msimd128", "-fno-sanitize=undefined", "-w", "-s")
NATIVE = ("-fPIC", "-Wall", "-Wextra")  # flags for the compiled extension alone
STACK = 4 << 20  # [bytes]; the runtime keeps work areas of a step on the stack


def wasm_module(spec: ModelSpec) -> bytes:
    """The WebAssembly module of a model; it imports nothing. Raises CompileError where ziglang is missing or fails."""
    from msfp_gen.generator import generate

    zig = zig_program()
    if zig is None:
        raise CompileError("the explorer needs ziglang, a compiler for WebAssembly: pip install ziglang")
    generated = {name: text for name, text in generate(spec).files.items() if name.endswith((".c", ".h"))}
    sources = {**runtime_sources(spec), **generated, GLUE: asset(f"explorer/{GLUE}")}
    flags = [flag for flag in FLAGS["c"] if flag not in NATIVE]
    units = sorted(name for name in sources if name.endswith(".c"))
    with TemporaryDirectory() as folder:
        for name, text in sources.items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        command = (str(zig), "cc", *TARGET, *flags, f"-Wl,-z,stack-size={STACK}", *units, "-o", OUTPUT)
        Log(Path(folder)).run(BuildStep(OUTPUT, command))
        return (Path(folder) / OUTPUT).read_bytes()
