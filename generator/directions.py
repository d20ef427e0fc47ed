"""Directional derivatives of a schedule: what moves along a set of directions, and what is read of its derivatives.

There is one form of them, in which every input may move. Sets of directions differ in what they move before an
evaluation, and in their number: parameters move everything, the ends of a two-port every input of an evaluation but
parameters and what is fixed, the variables of a step those that `VARIABLES` names. What follows from it in an
evaluation, and which derivatives anything reads, is found by going through the schedule.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import sympy as sp

from .blocks import Blocks
from .lower import directional, moving_symbols, symbol_of, symbols_read
from .places import (
    LISTS,
    Call,
    ListStorage,
    Schedule,
    Solve,
    block_of,
    calls_of,
    list_name,
    output_is_stored,
    passes_of,
)
from .program import Program, Use, fields_of
from .schedule import VARIABLES

COLUMNS = "MSFP_DOF"
"""C constant with the number of variables of a step whose derivatives one call carries."""

Entry = tuple[str, str]
"""A list and a field of its block."""
Seeds = tuple[tuple[str, tuple[str, ...]], ...]
"""Lists, each with quantities of its block; those that a model does not have are left out."""


@dataclass(frozen=True)
class Directions:
    """A set of directions.

    Attributes:
        name: of the drivers that differentiate along them.
        suffix: of the kernels.
        columns: C constant with their number.
        parameters: whether parameters move, and with them everything; then every derivative is wanted.
        seeds: what they move before an evaluation; None: every input that is neither a parameter nor fixed.
        again: whether kernels compute the results of an evaluation again, where they need them, in the order in which
            the program adds terms, instead of reading them in the work area.
    """

    name: str
    suffix: str
    columns: str
    parameters: bool = False
    seeds: Seeds | None = None
    again: bool = False


BY_PARAMETERS = Directions("directions", "direction", "MSFP_COLUMNS", parameters=True)
BY_ENDS = Directions("by_ends", "by_ends", "MSFP_PORT_FREEDOMS")
BY_VARIABLES = Directions(
    "tangents", "by_variables", COLUMNS, seeds=tuple(part for parts in VARIABLES.values() for part in parts), again=True
)


def directed(
    along: Directions, schedule: Schedule, programs: Mapping[str, Program], blocks: Blocks
) -> dict[str, Program]:
    """The derivatives of the programs of a schedule along a set of directions, by the name of the program.

    Programs without such derivatives are left out, and those that the runtime differentiates itself.
    """
    calls = [
        call for call in calls_of(passes_of(schedule)) if not isinstance(call.by, Solve) or along.name in call.by.forms
    ]
    every = [(call, programs[name]) for call in calls for name in call.programs]
    moving = None if along.parameters else _moving(every, blocks, along.seeds)
    read = None if moving is None else _read(every, blocks, moving, along)
    found: dict[str, Program] = {}
    for call, program in every:
        if isinstance(call.by, Solve) and along.name not in call.by.emitted:
            continue
        places = [one.reads for one, other in every if other is program]
        inputs = [
            _input(use, {list_name(reads[i]) for reads in places}, moving) for i, use in enumerate(program.inputs)
        ]
        results = _written(call, program, blocks)
        wanted = frozenset(name for name, entry in results.items() if read is None or entry in read)
        stored = output_is_stored(call) and not along.again
        if any(use.active for use in inputs):
            found[program.name] = directional(program, along.suffix, along.columns, inputs, wanted, stored)
    return found


def _written(call: Call, program: Program, blocks: Blocks) -> dict[str, Entry]:
    """The results of a program and what they become; several places follow one another."""
    assert program.output is not None
    entries = [(list_name(place), field.name) for place in call.writes for field in block_of(place, blocks).fields]
    return {field.name: entry for field, entry in zip(program.output.block.fields, entries, strict=True)}


def _solved(call: Call, program: Program, along: Directions) -> set[str]:
    """The results in the equations of a call that the runtime solves, whose derivatives its solution needs."""
    if not isinstance(call.by, Solve):
        return set()
    if along.name not in call.by.emitted:  # the runtime differentiates it by all inputs
        return set(program.results)
    read = {s for equal in program.unknowns.values() for s in equal.free_symbols}
    return {name for name, value in program.results.items() if value in read}


def _input(use: Use, lists: set[str], moving: set[Entry] | None) -> Use:
    """An input with what moves as active; lists: those from which it is read."""
    names = (field.name for field in use.block.fields)
    active = frozenset(name for name in names if moving is None or any((one, name) in moving for one in lists))
    return replace(use, active=active, moving=bool(active))


def _sources(call: Call, program: Program, moving: set[Entry]) -> dict[sp.Symbol, Entry]:
    """The inputs of a call that move."""
    found = {}
    for place, use in zip(call.reads, program.inputs, strict=True):
        for field in use.block.fields:
            if (entry := (list_name(place), field.name)) in moving:
                found[symbol_of(use, field.name)] = entry
    return found


def _inputs(every: list[tuple[Call, Program]], blocks: Blocks) -> Iterable[Entry]:
    """The inputs of an evaluation that are neither parameters nor fixed."""
    written = {list_name(place) for call, _ in every for place in call.writes}
    for name in dict.fromkeys(list_name(place) for call, _ in every for place in call.reads):
        if name not in written and LISTS[name].storage is not ListStorage.PARAMETERS:
            yield from ((name, field.name) for field in block_of(name, blocks).fields if not field.fixed)


def _moving(every: list[tuple[Call, Program]], blocks: Blocks, seeds: Seeds | None) -> set[Entry]:
    """All that moves in an evaluation."""
    if seeds is None:
        moving = set(_inputs(every, blocks))
    else:
        moving = set()
        for name, quantities in seeds:
            block = block_of(name, blocks)
            moving |= {(name, part) for part in fields_of(block, (q for q in quantities if q in block.quantities))}
    size = -1
    while size != len(moving):  # bodies follow from bodies
        size = len(moving)
        for call, program in every:
            symbols = moving_symbols(program, set(_sources(call, program, moving)))
            for name, entry in _written(call, program, blocks).items():
                if program.results[name].free_symbols & symbols:
                    moving.add(entry)
    return moving


def _read(every: list[tuple[Call, Program]], blocks: Blocks, moving: set[Entry], along: Directions) -> set[Entry]:
    """The entries whose derivatives something reads: a result, another program, or the solution of a call."""
    lists = {list_name(place) for call, _ in every for place in call.reads}
    read: set[Entry] = set()
    for call, program in every:
        for name, entry in _written(call, program, blocks).items():
            if entry[0] not in lists or name in _solved(call, program, along):
                read.add(entry)
    size = -1
    while size != len(read):
        size = len(read)
        for call, program in reversed(every):
            sources = _sources(call, program, moving)
            results = {name for name, entry in _written(call, program, blocks).items() if entry in read}
            read |= {sources[symbol] for symbol in symbols_read(program, results, set(sources))}
    return read
