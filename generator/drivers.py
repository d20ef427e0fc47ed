"""The drivers of a schedule as text for the template: the calls of its programs, for values and for derivatives."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from .derive import Equations
from .lower import Kernel, lower
from .program import Block, Program
from .schedule import (
    COLUMNS,
    LISTS,
    VARIABLES,
    Call,
    List,
    Over,
    Pass,
    calls_of,
    check,
    index_of,
    list_of,
    momentum_balances,
    tangent_of,
    unknowns,
)

LOOPS = {
    Over.BODIES: "for (int k = 1; k <= MSFP_NB; ++k)",
    Over.SURFACES: "for (int j = 0; j < MSFP_NB; ++j)",
}
ENDS = {"base": "0", "top": "MSFP_NB"}


def scheduled_kernels(equations: Equations) -> tuple[Kernel, ...]:
    """Tangents that the schedule calls and that no program has in this form."""
    programs = {program.name: program for program in equations.programs}
    called = (programs[call.program] for call in calls_of(momentum_balances(equations.spec.effects)))
    return tuple(lower(tangent_of(program)) for program in called if tangent_of(program) is not program)


def schedule_context(equations: Equations) -> dict[str, Any]:
    """What the template of the schedule needs."""
    programs = {program.name: program for program in equations.programs}
    passes = momentum_balances(equations.spec.effects)
    check(passes, programs, equations.blocks)
    used = {place.partition("[")[0] for call in calls_of(passes) for place in (*call.reads, *call.writes)}
    return {
        "passes": [_pass(one, programs) for one in passes],
        "declared": [_declared(one, equations) for name, one in LISTS.items() if name in used],
        "variables": [
            (kind, [_entries(name, quantities, equations) for name, quantities in parts])
            for kind, parts in VARIABLES.items()
        ],
        "unknowns": unknowns(equations.spec),
    }


def _pass(one: Pass, programs: Mapping[str, Program]) -> dict[str, Any]:
    return {
        "over": one.over.value,
        "loop": LOOPS.get(one.over, ""),
        "values": [line for call in one.calls for line in _values(call, programs[call.program])],
        "columns": [line for call in one.calls for line in _columns(call, programs[call.program])],
    }


def _declared(one: List, equations: Equations) -> dict[str, Any]:
    """Names in the record of the schedule, empty for what lies elsewhere."""
    names = [text.removeprefix("s->") if text.startswith("s->") else "" for text in (one.member, one.columns)]
    block: Block = getattr(equations.blocks, one.kind)
    return {"names": names, "block": block.name, "length": one.length}


def _entries(name: str, quantities: Iterable[str], equations: Equations) -> dict[str, Any]:
    """Where the fields of a kind of variable are in the block of a list; -1: nowhere, as E2 in the plane."""
    one = LISTS[name]
    block: Block = getattr(equations.blocks, one.kind)
    index = {field.name: i for i, field in enumerate(block.fields)}
    parts = [part for quantity in quantities for part in block.quantities[quantity]]
    at = "[v->index]" if one.length else ""
    entries = [index[part] if isinstance(part, str) else -1 for part in parts]
    return {"values": f"{one.member}{at}", "columns": f"{one.columns}{at}", "entries": entries}


def _in_c(member: str, place: str) -> str:
    index = index_of(place)
    index = ENDS.get(index, index).replace("-", " - ").replace("+", " + ")
    return f"{member}[{index}]" if index else member


def _values(call: Call, program: Program) -> Iterator[str]:
    """Statements that evaluate a call."""
    if call.decision is not None:
        yield f"{call.decision.values};"
        return
    reads = [_in_c(list_of(place).member, place) for place in call.reads]
    writes = [_in_c(list_of(place).member, place) for place in call.writes]
    if len(writes) == 1:
        yield f"msfp_{program.name}({', '.join([*reads, *writes])});"
        return
    yield "{"
    yield f"    double out[{_size(program)}];"
    yield f"    msfp_{program.name}({', '.join([*reads, 'out'])});"
    yield from _copies(writes)
    yield "}"


def _columns(call: Call, program: Program) -> Iterator[str]:
    """Statements that differentiate a call whose values are known. A tangent stores these values once more."""
    if not program.tangents:
        return
    reads = [_in_c(list_of(place).member, place) for place in call.reads]
    places = [place for place, use in zip(call.reads, program.inputs, strict=True) if use.moving]
    moving = [_in_c(list_of(place).columns, place) for place in places]
    values = [_in_c(list_of(place).member, place) for place in call.writes]
    writes = [_in_c(list_of(place).columns, place) for place in call.writes]
    name = f"msfp_{tangent_of(program).name}_tangent"
    if len(writes) > 1:
        yield "{"
        yield f"    double values[{_size(program)}], out[{_size(program)} * {COLUMNS}];"
        yield f"    {name}({', '.join([*reads, 'values', *moving, 'out'])});"
        yield from _copies(writes)
        yield "}"
        return
    statement = f"{name}({', '.join([*reads, *values, *moving, *writes])});"
    if call.decision is None:
        yield statement
        return
    yield f"if ({call.decision.acts})"
    yield f"    {statement}"
    yield "else"
    yield f"    memset({writes[0]}, 0, sizeof {writes[0]});"


def _size(program: Program) -> str:
    assert program.output is not None
    return f"MSFP_{program.output.block.name.upper()}_SIZE"


def _copies(writes: Iterable[str]) -> Iterator[str]:
    """Statements that copy `out` to several places, one after the other."""
    start = "out"
    for write in writes:
        yield f"    memcpy({write}, {start}, sizeof {write});"
        start += f" + sizeof {write} / sizeof *out"
