"""The generator: layout and effects in, C out. Pure: no disk, no compiler, no numbers.

`generate` reads as the list of its stages: derive -> lower -> emit.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from msfp_gen.layout import ModelSpec


@dataclass(frozen=True)
class Generated:
    """The emitted files and what they hold."""

    files: dict[str, str]
    statements: int
    operations: int
    stages: dict[str, float]


def generate(spec: ModelSpec, module: str, batch: bool = False) -> Generated:
    """Derive, lower and emit one model; `module` names the extension, `batch` asks for kernels of many runs at once.

    Returns the text of every generated file, the number of statements and of arithmetic operations of
    the programs (of one body and one surface: C loops over them), and the seconds of each stage.
    """
    from .derive import derive
    from .emit import emit
    from .lower import lower

    marks = [time.perf_counter()]

    def done() -> None:
        marks.append(time.perf_counter())

    equations = derive(spec)
    done()
    kernels = tuple(lower(program) for program in equations.programs)
    done()
    files = emit(equations, kernels, module, batch)
    done()
    stages = {name: b - a for name, a, b in zip(("derive", "lower", "emit"), marks, marks[1:], strict=False)}
    statements = sum(len(k.values) + len(k.partials) + len(k.tangents) for k in kernels)
    return Generated(files, statements, sum(k.operations + k.tangent_operations for k in kernels), stages)
