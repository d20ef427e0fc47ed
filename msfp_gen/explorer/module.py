"""A model as WebAssembly: its generated C, the runtime and `assets/explorer.c`, compiled by the package ziglang."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory

from msfp_gen.errors import CompileError
from msfp_gen.jit.build import runtime_sources
from msfp_gen.jit.compiler import FLAGS, Log, Step, zig_program
from msfp_gen.specification.layout import ModelSpec

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
