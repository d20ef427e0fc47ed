"""The emitted C of models, and what the compiler says about it."""

from __future__ import annotations

import subprocess
from functools import cache
from pathlib import Path

from msfp_gen import Effects, Layout
from msfp_gen.generator import Generated, generate
from msfp_gen.jit.build import runtime_sources
from msfp_gen.jit.compiler import find_compiler
from msfp_gen.specification.layout import ModelSpec


@cache
def emitted(layout: tuple[int, int, int] = (5, 2, 2), **effects: object) -> Generated:
    return generate(ModelSpec(Layout(*layout), Effects(**effects)))  # type: ignore[arg-type]


def text(name: str, layout: tuple[int, int, int] = (5, 2, 2), **effects: object) -> str:
    return emitted(layout, **effects).files[name]


def warnings_of(effects: dict[str, object], folder: Path, *mode: str) -> str:
    """What the compiler has to say about all C of a TFP with these effects; nothing, it is hoped."""
    spec = ModelSpec(Layout.tfp(), Effects(**effects))  # type: ignore[arg-type]
    sources = runtime_sources(spec) | generate(spec).files
    for name, content in sources.items():
        (folder / name).write_text(content, encoding="utf-8")
    units = sorted(name for name in sources if name.endswith(".c"))
    command = [*find_compiler().command, "-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", *mode, *units]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0 or done.stderr
    return done.stdout + done.stderr
