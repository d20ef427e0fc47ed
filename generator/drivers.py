"""The drivers of a schedule as text for the templates: the calls of its programs, for values and for derivatives."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from operator import attrgetter
from typing import Any

from . import two_port as ends
from .derive import Equations
from .lower import Kernel, directional, lower
from .program import Block, Program
from .schedule import (
    COLUMNS,
    LISTS,
    VARIABLES,
    Call,
    Decision,
    InC,
    Kept,
    List,
    Over,
    Pass,
    Schedule,
    calls_of,
    check,
    condensed,
    energies,
    index_of,
    list_of,
    momentum_balances,
    passes_of,
    tangent_of,
    two_port,
    unknowns,
)

LOOPS = {
    Over.BODIES: "for (int k = 1; k <= MSFP_NB; ++k)",
    Over.SURFACES: "for (int j = 0; j < MSFP_NB; ++j)",
    Over.DOWNWARD: "for (int j = MSFP_NB - 1; j >= 0; --j)",
}
INDICES = {"base": "0", "top": "MSFP_NB", "slider": "msfp_slider(j)"}
Programs = Mapping[str, Program]
Lines = Callable[[Call, Programs], Iterator[str]]


def scheduled_kernels(equations: Equations) -> tuple[Kernel, ...]:
    """Tangents that the schedules call and that no program has in this form."""
    effects = equations.spec.effects
    called = _called(momentum_balances(effects)) | _called(condensed(effects))
    tangents = ((program, tangent_of(program)) for program in equations.programs if program.name in called)
    return tuple(lower(tangent) for program, tangent in tangents if tangent is not program)


def directional_kernels(equations: Equations) -> tuple[Kernel, ...]:
    """Directional derivatives of the programs of the condensed equations and of the energies."""
    return _kernels(equations, {**condensed(equations.spec.effects), **energies(equations.spec.effects)}, directional)


def end_kernels(equations: Equations) -> tuple[Kernel, ...]:
    """Derivatives of the programs of the condensed equations and of a two-port by the motion of its ends."""
    effects = equations.spec.effects
    scheduled = _kernels(equations, {**condensed(effects), **two_port(effects)}, ends.by_ends)
    return (*scheduled, *ends.port_kernels(equations.programs))


def _kernels(
    equations: Equations, schedule: Schedule, differentiate: Callable[[Program, bool], Program]
) -> tuple[Kernel, ...]:
    called = _called(schedule)
    return tuple(
        lower(differentiate(program, _at_hand(called[program.name])))
        for program in equations.programs
        if program.name in called
    )


@dataclass(frozen=True)
class Form:
    """Directional derivatives by one set of directions.

    Attributes:
        name: of the member of `InC` with C of the derivatives; that of `List` is the same with `_in_c`.
        kernels: name of a program -> its derivatives.
        read: the lists whose values these contain.
    """

    name: str
    kernels: Mapping[str, Kernel]
    read: set[str]


def _form(name: str, suffix: str, schedule: Schedule, kernels: Iterable[Kernel]) -> Form:
    kernel_of = {kernel.program.name.removesuffix(suffix): kernel for kernel in kernels}
    return Form(name, kernel_of, _read_values(schedule, kernel_of))


def schedule_context(equations: Equations, directional: Iterable[Kernel], by_ends: Iterable[Kernel]) -> dict[str, Any]:
    """Variables of the templates of the schedules. directional, by_ends: the kernels of a model that has these."""
    effects, programs = equations.spec.effects, {program.name: program for program in equations.programs}
    balances, with_directions = momentum_balances(effects), {**condensed(effects), **energies(effects)}
    port = two_port(effects) if effects.permits_moving_ends else {}
    of_ends = {**condensed(effects), **port}
    moving = check(passes_of(balances), programs, equations.blocks)
    moving |= check(passes_of(with_directions), programs, equations.blocks)
    directed = _lists(with_directions)
    used = {name: None for name in LISTS if name in directed or name in _lists(balances) or name in _lists(port)}
    forms = {
        "directions": _form("directions", "_direction", with_directions, directional),
        "by_ends": _form("by_ends", "_by_ends", of_ends, by_ends),
    }
    if forms["by_ends"].kernels:
        check_by_ends(equations, forms["by_ends"].kernels)
    every = {**balances, **with_directions, **port}
    return {
        "parts": [part(name, passes, programs, forms) for name, passes in every.items()],
        "directed": list(with_directions),
        "of_ends": list(of_ends),
        "blocks": [_declared(LISTS[name], equations) for name in used if LISTS[name].kept is Kept.HERE],
        "block_tangents": [
            _declared(LISTS[name], equations) for name in used if name in moving and not LISTS[name].tangents
        ],
        "block_directions": [
            _declared(LISTS[name], equations)
            for name in directed
            if not LISTS[name].directions and LISTS[name].kept is not Kept.PARAMETERS
        ],
        "blocks_by_ends": [
            _declared(LISTS[name], equations) for name in _lists(of_ends) if LISTS[name].kept is not Kept.PARAMETERS
        ],
        "variables": [
            (kind, [one for name, quantities in parts if (one := _entries(name, quantities, equations))["entries"]])
            for kind, parts in VARIABLES.items()
        ],
        "unknowns": unknowns(equations.spec),
    }


def check_by_ends(equations: Equations, kernels: Mapping[str, Kernel]) -> None:
    """As `check`, for the derivatives by the motion of the ends; kernels: by the name of the program."""
    programs = {
        program.name: replace(
            kernels[program.name].program, inputs=kernels[program.name].program.inputs[: len(program.inputs)]
        )
        for program in equations.programs
        if program.name in kernels
    }
    effects = equations.spec.effects
    port = two_port(effects)
    passes = passes_of({"interface": port["interface"], **condensed(effects), **port})
    check(passes, programs, equations.blocks, ends.moving(equations.blocks), "by_ends")


def _called(schedule: Schedule) -> dict[str, Call]:
    """The programs that a schedule calls in emitted C, each with one of its calls."""
    return {name: call for call in _emitted(schedule) for name in call.programs}


def _emitted(schedule: Schedule) -> list[Call]:
    """The calls that are emitted, without those of C alone."""
    return [call for call in calls_of(passes_of(schedule)) if not isinstance(call.by, InC)]


def _lists(schedule: Schedule) -> dict[str, None]:
    """The lists that emitted C reads or writes, in the order of `LISTS`."""
    used = {place.partition("[")[0] for call in _emitted(schedule) for place in (*call.reads, *call.writes)}
    used |= {place.partition("[")[0] for call in calls_of(passes_of(schedule)) for place in call.writes}
    return {name: None for name in LISTS if name in used}


def _read_values(schedule: Schedule, kernels: Mapping[str, Kernel]) -> set[str]:
    """The lists whose values the directional derivatives of a schedule contain. kernels: by the name of the program."""
    read = set[str]()
    for call in _emitted(schedule):
        for kernel in (kernels[name] for name in call.programs if name in kernels):
            symbols = {
                s.name for statement in (*kernel.values, *kernel.partials) for s in statement.expression.free_symbols
            }
            symbols |= {s.name for t in kernel.tangents for partial, _ in t.terms for s in partial.free_symbols}
            for place, use in zip(call.reads, kernel.program.inputs, strict=False):
                if any(f"{use.alias}_{field.name}" in symbols for field in use.block.fields):
                    read.add(place.partition("[")[0])
    return read


def _at_hand(call: Call) -> bool:
    """Whether the work area holds the results of a call while it is differentiated."""
    return call.by is None and not call.adds and len(call.writes) == 1 and list_of(call.writes[0]).kept is Kept.WORK


def part(name: str, passes: Iterable[Pass], programs: Programs, directional: Mapping[str, Form]) -> dict[str, Any]:
    """A part of a schedule for the templates: its passes, each with its lines, for values and for derivatives."""
    calls = list(calls_of(passes))
    forms: dict[str, Lines] = {"values": _values, "tangents": _tangents}
    forms |= {key: partial(_directions, form=form) for key, form in directional.items() if _has(calls, form)}
    lines = {
        form: [(one, [line for call in one.calls for line in of(call, programs)]) for one in passes]
        for form, of in forms.items()
    }
    added = dict.fromkeys(place for call in calls if call.adds for place in call.writes)
    return {
        "name": name,
        "added": {form: [getattr(list_of(place), f"{form}_in_c") for place in added] for form in forms},
        "constant": not any(list_of(place).kept is Kept.WORK for call in calls for place in call.writes),
        "fails": any(isinstance(call.by, InC) and call.by.fails for call in calls),
        "unused": {form: _unused(line for _, many in written for line in many) for form, written in lines.items()},
        "passes": {
            form: [
                {"over": one.over.value, "loop": LOOPS.get(one.over, ""), "lines": many}
                for one, many in written
                if many
            ]
            for form, written in lines.items()
        },
    }


def _has(calls: Iterable[Call], form: Form) -> bool:
    """Whether a form has the derivatives of calls."""
    return all(name in form.kernels for call in calls for name in call.programs if not isinstance(call.by, InC))


def _unused(lines: Iterable[str]) -> list[str]:
    """The arguments of a driver that its statements do not name."""
    words = {word for line in lines for word in re.findall(r"\w+", line)}
    return [name for name in ("p", "dp", "w", "d", "s", "ds") if name not in words]


def _declared(one: List, equations: Equations) -> dict[str, str]:
    block: Block = getattr(equations.blocks, one.kind)
    return {"name": one.name, "block": block.name, "length": one.length}


def _entries(name: str, quantities: Iterable[str], equations: Equations) -> dict[str, Any]:
    """Indices of the fields of a kind of variable in the block of a list; -1: not stored, as E2 in the plane."""
    one = LISTS[name]
    block: Block = getattr(equations.blocks, one.kind)
    index = {field.name: i for i, field in enumerate(block.fields)}
    parts = [part for quantity in quantities for part in block.quantities.get(quantity, ())]
    at = "[v->index]" if one.length else ""
    entries = [index[part] if isinstance(part, str) else -1 for part in parts]
    return {"values": f"{one.values_in_c}{at}", "tangents": f"{one.tangents_in_c}{at}", "entries": entries}


def _in_c(member: str, place: str) -> str:
    index = index_of(place)
    index = INDICES.get(index, index.replace("-", " - ").replace("+", " + "))
    return f"{member}[{index}]" if index else member


def _values(call: Call, programs: Programs) -> Iterator[str]:
    """Statements that evaluate a call."""
    if isinstance(call.by, InC) and call.by.fails:
        yield f"const int status = {call.by.values};"
        yield "if (status)"
        yield "    return status;"
    elif isinstance(call.by, Decision) and call.by.itself:
        writes = [_in_c(list_of(place).values_in_c, place) for place in call.writes]
        many = ((name, list(_evaluated(call, programs[name]))) for name in call.programs)
        yield from _chosen(call, writes, many)
    elif isinstance(call.by, Decision | InC):
        if call.by.values:
            yield f"{call.by.values};"
    else:
        yield from _evaluated(call, programs[call.program])


def _evaluated(call: Call, program: Program) -> Iterator[str]:
    reads = [_in_c(list_of(place).values_in_c, place) for place in call.reads]
    writes = [_in_c(list_of(place).values_in_c, place) for place in call.writes]
    yield from _written(call, f"msfp_{program.name}", reads, writes, _size(program))


def _written(call: Call, function: str, arguments: list[str], writes: list[str], size: str) -> Iterator[str]:
    """Statements that call a function and put its result into one block, into several, or add it to one."""
    if len(writes) == 1 and not call.adds:
        yield f"{function}({', '.join([*arguments, *writes])});"
        return
    yield "{"
    yield f"    double out[{size}];"
    yield f"    {function}({', '.join([*arguments, 'out'])});"
    if call.adds:
        yield f"    for (int i = 0; i < {size}; ++i)"
        yield f"        {writes[0]}[i] += out[i];"
    else:
        yield from _copies(writes)
    yield "}"


def _tangents(call: Call, programs: Programs) -> Iterator[str]:
    """Statements that differentiate a call by the variables of a step. A tangent stores the values once more."""
    if isinstance(call.by, InC):
        if call.by.tangents:
            yield f"{call.by.tangents};"
        return
    if not any(programs[name].tangents for name in call.programs):
        return
    writes = [_in_c(list_of(place).tangents_in_c, place) for place in call.writes]
    yield from _chosen(call, writes, ((name, list(_tangent(call, programs[name], writes))) for name in call.programs))


def _tangent(call: Call, program: Program, writes: list[str]) -> Iterator[str]:
    reads = [_in_c(list_of(place).values_in_c, place) for place in call.reads]
    places = [place for place, use in zip(call.reads, program.inputs, strict=True) if use.moving]
    moving = [_in_c(list_of(place).tangents_in_c, place) for place in places]
    values = [_in_c(list_of(place).values_in_c, place) for place in call.writes]
    name = f"msfp_{tangent_of(program).name}_tangent"
    if len(writes) == 1:
        yield f"{name}({', '.join([*reads, *values, *moving, *writes])});"
        return
    yield "{"
    yield f"    double values[{_size(program)}], out[{_size(program)} * {COLUMNS}];"
    yield f"    {name}({', '.join([*reads, 'values', *moving, 'out'])});"
    yield from _copies(writes)
    yield "}"


def _directions(call: Call, programs: Programs, form: Form) -> Iterator[str]:
    """Statements that differentiate a call along directions, with its values where the work area does not hold them."""
    if isinstance(call.by, InC):
        yield f"{getattr(call.by, form.name)};"
        return
    member = attrgetter(f"{form.name}_in_c")
    writes = [_in_c(member(list_of(place)), place) for place in call.writes]
    names = {place.partition("[")[0] for place in call.writes}
    values = any(LISTS[name].kept is Kept.HERE for name in names & form.read)
    many = ((name, list(_direction(call, programs[name], writes, values, form))) for name in call.programs)
    yield from _chosen(call, writes, many)


def _direction(call: Call, program: Program, writes: list[str], with_values: bool, form: Form) -> Iterator[str]:
    if with_values:
        yield from _evaluated(call, program)
    derivatives, member = form.kernels[program.name].program, attrgetter(f"{form.name}_in_c")
    reads = [_in_c(list_of(place).values_in_c, place) for place in call.reads]
    values = [_in_c(list_of(place).values_in_c, place) for place in call.writes] if _at_hand(call) else []
    places = [place for place, use in zip(call.reads, derivatives.inputs, strict=False) if use.moving]
    moving = [_in_c(member(list_of(place)), place) for place in places]
    size = f"{_size(program)} * {derivatives.columns}"
    yield from _written(call, f"msfp_{derivatives.name}", [*reads, *values, *moving], writes, size)


def _chosen(call: Call, writes: list[str], programs: Iterable[tuple[str, list[str]]]) -> Iterator[str]:
    """Statements of the program that acts; where none does, the derivatives are zero."""
    if not isinstance(call.by, Decision):
        for _, statements in programs:
            yield from statements
        return
    start = ""
    for name, statements in programs:
        yield f"{start}if ({call.by.acts[name]}) {{"
        yield from (f"    {statement}" for statement in statements)
        start = "} else "
    if call.adds:
        yield "}"
        return
    yield "} else"
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
