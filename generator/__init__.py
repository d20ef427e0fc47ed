"""The generator: derives the equations of a layout with its effects and emits them as C.

It writes no files, reads none but its templates and the headers of the runtime, whose functions it declares and names,
runs no compiler and contains no values of a bearing. `generate` calls its stages in order: derive -> lower -> emit.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from msfp_gen.specification.layout import ModelSpec


@dataclass(frozen=True)
class Generated:
    """Result of `generate`.

    Attributes:
        files: file name -> text.
        statements: number of statements of all programs, tangents included.
        operations: number of arithmetic operations of all programs, tangents included.
        stages: name of a stage -> its wall time [s].
    """

    files: dict[str, str]
    statements: int
    operations: int
    stages: dict[str, float]


def generate(spec: ModelSpec) -> Generated:
    """Derive, lower and emit one model.

    Statements and operations are counted for one body and one surface, since the C code loops over them.

    Args:
        spec: layout and effects.
    """
    from .derive import derive
    from .drivers import directional_kernels, end_kernels, variable_kernels
    from .emit import emit
    from .lower import lower

    times = [time.perf_counter()]
    equations = derive(spec)
    times.append(time.perf_counter())
    kernels = tuple(lower(program) for program in equations.programs)
    by_variables = variable_kernels(equations)
    directional = directional_kernels(equations) if spec.gradients else ()
    by_ends = end_kernels(equations) if spec.effects.permits_moving_ends else ()
    times.append(time.perf_counter())
    files = emit(equations, kernels, by_variables, directional, by_ends)
    times.append(time.perf_counter())
    stages = {name: b - a for name, a, b in zip(("derive", "lower", "emit"), times, times[1:], strict=False)}
    kernels += by_variables + directional + by_ends
    statements = sum(len(k.values) + len(k.partials) + len(k.tangents) for k in kernels)
    return Generated(files, statements, sum(k.operations + k.tangent_operations for k in kernels), stages)
