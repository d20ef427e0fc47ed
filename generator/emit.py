"""The generated files of a model: kernels, blocks and drivers as text, by the Jinja2 templates of `templates/`."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields

import sympy as sp

from msfp_gen.common.version import __version__
from msfp_gen.specification import contract
from msfp_gen.specification.friction_laws import HEAT_KERNEL
from msfp_gen.specification.layout import ModelSpec

from .derive import Equations
from .drivers import schedule_context
from .functions import to_c
from .interface import checks_context, environment, interface_context, model_name, public_header, word_enums
from .lower import GRADIENT_COLUMNS, Kernel, contact_lists, jacobian_column, ordered_active_inputs
from .program import Block, Use

# Each is made from the template of its name.
GRADIENT_FILES = ("msfp_gradient_kernels.h", "msfp_directions.h")  # of models with gradients
TWO_PORT_FILES = ("msfp_by_ends.h",)  # of models that can be a two-port
FILES = (
    "msfp.h",
    "msfp_symbols.h",
    "msfp_model.h",
    "msfp_kernels.h",
    "msfp_schedule.h",
    "msfp_fields.h",
    "msfp_checks.h",
    "msfp_module.pyx",
)


@dataclass(frozen=True)
class Argument:
    """One array argument of an emitted function."""

    name: str
    block: Block
    loads: tuple[tuple[str, int], ...]
    """C name and index of each stored field that is used."""
    tangent_loads: tuple[tuple[str, int], ...]
    tangent: bool


@dataclass(frozen=True)
class Function:
    """One kernel as the template needs it: nothing but text."""

    name: str
    summary: str
    output: Block
    columns: str
    operations: int
    arguments: tuple[Argument, ...]
    values: tuple[str, ...]
    partials: tuple[str, ...]
    tangents: tuple[str, ...]
    stores: tuple[tuple[int, str, str], ...]
    """Index in the output, its text, and the field's name."""
    tangent_stores: tuple[tuple[int, str], ...]
    lanes: str
    """As in `Program`."""
    jacobian: tuple[tuple[str, ...], tuple[tuple[int, str], ...]]
    """Of a program that runs in lanes: statements, and (row * inputs + input, text)."""


def jacobian(kernel: Kernel) -> tuple[tuple[str, ...], tuple[tuple[int, str], ...]]:
    """Text of the derivatives of a program's results with respect to its own inputs, row by row of what is wanted."""
    sources = ordered_active_inputs(kernel.program)
    assert kernel.program.output is not None
    rows = [f.name for f in kernel.program.output.block.fields if f.name in kernel.program.tangents]
    lines: list[str] = []
    stores: list[tuple[int, str]] = []
    for i, source in enumerate(sources):
        statements, results = jacobian_column(kernel, source)
        lines += [f"{s.target} = {to_c(s.expression)}" for s in statements]
        stores += [(row * len(sources) + i, to_c(sp.sympify(results[name]))) for row, name in enumerate(rows)]
    return tuple(lines), tuple(stores)


def arguments(kernel: Kernel) -> Iterator[Argument]:
    """The input arrays of a kernel, with what is loaded from each."""
    used = {s.name for st in (*kernel.values, *kernel.partials) for s in st.expression.free_symbols}
    used |= {s.name for t in kernel.tangents for partial, _ in t.terms for s in partial.free_symbols}
    if kernel.program.stored:
        used |= {s.name for e in kernel.program.results.values() for s in e.free_symbols}
    sources = {s.name for t in kernel.tangents for _, s in t.terms}
    sources |= {s.name for n in kernel.program.tangents for s in kernel.program.results[n].free_symbols}
    for use in kernel.program.inputs:
        names = [f"{use.alias}_{f.name}" for f in use.block.fields]
        loads = tuple((name, i) for i, name in enumerate(names) if name in used)
        moving = tuple(
            (f"d_{name}", i)
            for i, name in enumerate(names)
            if name in sources and use.block.fields[i].name in use.active
        )
        yield Argument(use.alias, use.block, loads, moving, use.moving)


def tangent_sum(terms: tuple[tuple[sp.Expr, sp.Symbol], ...]) -> str:
    """C text of sum(partial * d source)."""
    parts = []
    for partial, source in terms:
        if partial == 1:
            parts.append(f"d_{source}")
        elif partial == -1:
            parts.append(f"-d_{source}")
        else:
            parts.append(f"{to_c(partial)}*d_{source}")
    return " + ".join(parts).replace("+ -", "- ")


def linear(expression: sp.Expr, moving: set[str]) -> str:
    """C text of the tangent of a stored result: a symbol, its negative, or a constant."""
    symbols = [s for s in expression.free_symbols if s.name in moving]
    if not symbols:
        return "0.0"
    return f"d_{expression}" if expression.is_Symbol else f"-d_{-expression}"


def function(kernel: Kernel) -> Function:
    """Text of one kernel."""
    program = kernel.program
    assert program.output is not None
    output: Use = program.output
    index = {f.name: i for i, f in enumerate(output.block.fields)}
    moving = {t.target.name for t in kernel.tangents} | {f"{u.alias}_{n}" for u in program.inputs for n in u.active}
    return Function(
        name=program.name,
        summary=program.summary,
        output=output.block,
        columns=program.columns,
        operations=kernel.operations,
        arguments=tuple(arguments(kernel)),
        values=tuple(f"{s.target} = {to_c(s.expression)}" for s in kernel.values),
        partials=tuple(f"{s.target} = {to_c(s.expression)}" for s in kernel.partials),
        tangents=tuple(f"d_{t.target} = {tangent_sum(t.terms)}" for t in kernel.tangents),
        stores=tuple((index[name], to_c(e), name) for name, e in program.results.items() if program.stored),
        tangent_stores=tuple(
            (index[n], linear(program.results[n], moving)) for n in program.results if n in program.tangents
        ),
        lanes=program.lanes,
        jacobian=jacobian(kernel) if program.lanes else ((), ()),
    )


def vector_quantities(block: Block) -> list[tuple[str, list[tuple[int, int | None, str]]]]:
    """For each vector of a block: axis, index (None: constant) and constant value."""
    index = {f.name: i for i, f in enumerate(block.fields)}
    return [
        (
            name,
            [
                (
                    axis,
                    index.get(part) if isinstance(part, str) else None,
                    "0.0" if isinstance(part, str) else to_c(sp.Float(part)),
                )
                for axis, part in enumerate(parts)
            ],
        )
        for name, parts in block.quantities.items()
        if len(parts) == 3
    ]


def scalar_quantities(block: Block) -> list[tuple[str, int | None, str]]:
    """For each scalar of a block: index (None: constant) and constant value."""
    index = {f.name: i for i, f in enumerate(block.fields)}
    return [
        (
            name,
            index.get(parts[0]) if isinstance(parts[0], str) else None,
            "0.0" if isinstance(parts[0], str) else to_c(sp.Float(parts[0])),
        )
        for name, parts in block.quantities.items()
        if len(parts) == 1
    ]


def shape_of(spec: ModelSpec) -> Callable[[contract.Recorded], tuple[int, ...]]:
    """Shapes of the fields of a row in numbers, for the wrapper."""
    lengths = {
        contract.Extent.SURFACES: spec.layout.surfaces,
        contract.Extent.COORDINATES: 6 if spec.effects.uplift else 3,
        contract.Extent.WORKS: len(contract.WORKS),
    }
    return lambda quantity: tuple(lengths[n] if isinstance(n, contract.Extent) else n for n in quantity.shape)


def lanes(surfaces: int) -> int:
    """Surfaces that C evaluates in one vector: their number rounded up so that vectors of two or four are full."""
    return surfaces if surfaces < 2 else 2 if surfaces == 2 else -(-surfaces // 4) * 4


def description(spec: ModelSpec) -> str:
    """Description of a model for the wrapper, as JSON. The wrapper itself is the same text for every model."""
    shape = shape_of(spec)
    return json.dumps(
        {
            "spec": spec.key,
            "layout": (spec.layout.n, spec.layout.m, spec.layout.p),
            "effects": {f.name: getattr(spec.effects, f.name) for f in fields(spec.effects)},
            "surface_values": contract.surface_values(spec.effects),
            "row": [(q.name, shape(q)) for q in contract.row(spec.effects)],
            "extremes": [(q.name, shape(q)) for q in contract.extremes(spec.effects)],
        }
    )


def extreme_entries(spec: ModelSpec) -> Iterator[str]:
    """Entries of the table of extremes in C, one for each field of `contract.extremes`."""
    fields_of = {field.name: field for field in contract.row(spec.effects)}
    for extreme in contract.extremes(spec.effects):
        vector = extreme.shape == (4,)
        field = None if extreme.of == contract.ACROSS else fields_of[extreme.of]
        pair = field is not None and field.shape[1:] == (2,)
        one = "OPENING" if extreme.opening else "LENGTH" if pair else "NUMBER"
        count, how = ("4", "VECTOR") if vector else ("MSFP_NB", one)
        of = "MSFP_ACROSS" if field is None else f"MSFP_ROW_{extreme.of.upper()}"
        flags = ", ".join(str(int(flag)) for flag in (extreme.least, extreme.positions, extreme.loaded))
        yield f"{count}, {of}, MSFP_{how}, {flags}"


def emit(
    equations: Equations,
    kernels: tuple[Kernel, ...],
    by_variables: tuple[Kernel, ...],
    directional: tuple[Kernel, ...] = (),
    by_ends: tuple[Kernel, ...] = (),
) -> dict[str, str]:
    """Render all generated files: {file name: text}.

    directional: kernels of a model with gradients; by_ends: of one that can be a two-port.
    """
    spec = equations.spec
    every = (equations.blocks, equations.value_blocks, equations.column_blocks)
    groups = [group for group in every if group is not None]
    blocks = [b for group in groups for f in fields(group) if (b := getattr(group, f.name)) is not None]
    law = spec.effects.law
    context = {
        "version": __version__,
        "spec": spec,
        "layout": spec.layout,
        "effects": spec.effects,
        "blocks": blocks,
        "functions": [function(k) for k in kernels],
        "directional": [function(k) for k in directional],
        "by_ends": [function(k) for k in by_ends],
        "gradient": {"columns": GRADIENT_COLUMNS} | contact_lists(k.program for k in directional),
        "nb": spec.layout.surfaces,
        "lanes": lanes(spec.layout.surfaces),
        "description": json.dumps(description(spec)),
        "unknown_angles": equations.unknown_angles,
        "separations": equations.separations,
        "vectors": vector_quantities,
        "scalars": scalar_quantities,
        "frame_inputs": len(equations.blocks.contact_frame.fields)
        + len(equations.blocks.friction_force.fields)
        + (law is not None),
        "law": law,
        "closed_form": spec.effects.permits_quasistatic_steps,
        "heat": HEAT_KERNEL,
        "words": word_enums(),
        "row": contract.row(spec.effects),
        "extremes": contract.extremes(spec.effects),
        "extreme_entries": list(extreme_entries(spec)),
        "columns": {"body": contract.names(contract.BODY), "top": contract.names(contract.TOP)},
        "names": {kind: tuple(name for name, *_ in entries) for kind, *_, entries in word_enums()},
        "rim_inputs": len(equations.blocks.rim_coordinates.fields),
        **interface_context(spec, shape_of(spec), public_header()),
        "checks": checks_context(spec),
        "by_variables": [function(k) for k in by_variables],
        "schedule": schedule_context(equations, by_variables, directional, by_ends),
    }
    names = {name: name for name in FILES} | {f"{model_name(spec)}.h": "msfp_layout.h"}
    names |= {name: name for name in GRADIENT_FILES if spec.gradients}
    names |= {name: name for name in TWO_PORT_FILES if spec.effects.permits_moving_ends}
    templates = environment()
    return {
        file: templates.get_template(f"{template}.jinja").render(context, file=file) for file, template in names.items()
    }
