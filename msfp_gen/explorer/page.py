"""The page of the explorer: template, scripts, models as WebAssembly and problems in one file that loads no other."""

from __future__ import annotations

import base64
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from msfp_gen.common.output import check_output, write_bytes
from msfp_gen.errors import CompileError
from msfp_gen.explorer.problem import Problem, problem_of
from msfp_gen.jit.build import runtime_sources
from msfp_gen.jit.compiler import FLAGS, Log, Step, zig_program
from msfp_gen.report.template import script_data
from msfp_gen.specification.layout import ModelSpec
from msfp_gen.version import __version__

if TYPE_CHECKING:
    from msfp_gen.scene.scene import Scene

Progress = Callable[[float, float], None]
SUFFIXES = (".html", ".htm")
# Presets of a page without a scene of the user's: laboratory tests, orbits, other devices, and a bundled record.
EXPLORED = (
    "fenz-test2", "fenz-test5", "becker-circle-88", "becker-eight-88", "unusual-tfp", "double-push", "quintuple-push",
    "ridgecrest-clc",
)  # fmt: skip
RECORD = 15.0  # of a record [s]: the strong part of the bundled one
SHARED = ("dom.js", "chart.js")  # scripts of the HTML report
WORKER = ("solver.js", "worker.js")
SCRIPTS = ("numbers.js", "stack.js", "explorer.js")


def write_explorer(path: str | Path, scene: Scene | None = None, progress: Progress | None = None) -> Path:
    """Write the explorer to `path`; the file appears only when complete. Arguments and errors as of `explorer_html`.

    Raises InputError for a path that does not end in .html or cannot be written.
    """
    path = check_output(path, SUFFIXES)
    write_bytes(path, [explorer_html(scene, progress).encode()])
    return path


def explorer_html(scene: Scene | None = None, progress: Progress | None = None) -> str:
    """The explorer as text: of a scene, with the presets that have its model, or of the presets `EXPLORED`.

    Args:
        scene: the scene that the page shows first; None: presets only.
        progress: called with the number of compiled models and of all models.

    Raises:
        InputError: the page cannot run the scene.
        CompileError: ziglang is missing, or it rejected a file.
    """
    from jinja2 import Environment, StrictUndefined
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
    report = files("msfp_gen.report").joinpath("assets")
    environment = Environment(autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True)
    return environment.from_string(_asset("explorer.html.jinja")).render(
        version=__version__,
        style=Markup(report.joinpath("page.css").read_text(encoding="utf-8")),
        data=script_data(data),
        worker=Markup("".join(_asset(name) for name in WORKER)),
        scripts=[
            *(Markup(report.joinpath(name).read_text(encoding="utf-8")) for name in SHARED),
            *(Markup(_asset(name)) for name in SCRIPTS),
        ],
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


def _asset(name: str) -> str:
    return files(__package__).joinpath("assets", name).read_text(encoding="utf-8")


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
        raise CompileError("the explorer needs ziglang, a compiler for WebAssembly: pip install 'msfp-gen[compiler]'")
    generated = {name: text for name, text in generate(spec).files.items() if name.endswith((".c", ".h"))}
    glue = {GLUE: files(__package__).joinpath("assets", GLUE).read_text(encoding="utf-8")}
    sources = {**runtime_sources(), **generated, **glue}
    flags = [flag for flag in FLAGS["c"] if flag not in NATIVE]
    units = sorted(name for name in sources if name.endswith(".c"))
    with TemporaryDirectory() as folder:
        for name, text in sources.items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        command = (str(zig), "cc", *TARGET, *flags, f"-Wl,-z,stack-size={STACK}", *units, "-o", OUTPUT)
        Log(Path(folder)).run(Step(OUTPUT, command))
        return (Path(folder) / OUTPUT).read_bytes()
