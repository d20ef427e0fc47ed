"""Directional derivatives of a schedule: what moves along a set of directions, and what is read of its derivatives.

There is one form of them, in which every input may move. Sets of directions differ in what they move before an
evaluation, and in their number: with parameters everything moves, with the ends of a two-port what `ENDS` names. What
follows from it in an evaluation, and which derivatives anything reads, is found by going through the schedule.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import sympy as sp

from .blocks import Blocks
from .lower import directional, moving_symbols, symbol_of, symbols_read
from .program import Program, Use, fields_of
from .schedule import LISTS, Call, Kept, Schedule, Solve, at_hand, block_of, calls_of, list_name, passes_of

Entry = tuple[str, str]
"""A list and a field of its block."""

ENDS: Mapping[str, tuple[str, ...]] = {
    "frame": (),
    "x": (),
    "load_force": (),
    "load_moment": (),
    "support": (),
    "lock": (),
    "friction_force": (),
    "coefficient": (),
    "far_end": ("u", "v"),
    "foot_stage": ("y", "y1"),
    "friction_previous": ("Y", "Z", "past"),
}
"""What the motion of the ends moves before an evaluation: list -> quantities, all where there are none.

A step has a given length, so the constants of its formulas stay. Friction is solved for, and moves with what it follows
from.
"""


@dataclass(frozen=True)
class Directions:
    """A set of directions.

    Attributes:
        name: of the drivers that differentiate along them.
        suffix: of the kernels.
        columns: C constant with their number.
        moves: what they move before an evaluation, as `ENDS`; None: everything, and every derivative is wanted.
    """

    name: str
    suffix: str
    columns: str
    moves: Mapping[str, tuple[str, ...]] | None


BY_PARAMETERS = Directions("directions", "direction", "MSFP_COLUMNS", None)
BY_ENDS = Directions("by_ends", "by_ends", "MSFP_PORT_FREEDOMS", ENDS)


def directed(
    along: Directions, schedule: Schedule, programs: Mapping[str, Program], blocks: Blocks
) -> dict[str, Program]:
    """The derivatives of the programs of a schedule along a set of directions, by the name of the program."""
    calls = [
        call
        for call in calls_of(passes_of(schedule))
        if not isinstance(call.by, Solve) or along.name in call.by.emitted
    ]
    every = [(call, programs[name]) for call in calls for name in call.programs]
    moving = None if along.moves is None else _moving(every, blocks, along.moves)
    read = None if moving is None else _read(every, blocks, moving)
    found: dict[str, Program] = {}
    for call, program in every:
        places = [one.reads for one, other in every if other is program]
        inputs = [
            _input(use, {list_name(reads[i]) for reads in places}, moving) for i, use in enumerate(program.inputs)
        ]
        results = _written(call, program, blocks)
        wanted = frozenset(name for name, entry in results.items() if read is None or entry in read)
        found[program.name] = directional(program, along.suffix, along.columns, inputs, wanted, at_hand(call))
    return found


def _written(call: Call, program: Program, blocks: Blocks) -> dict[str, Entry]:
    """The results of a program and what they become; several places follow one another."""
    assert program.output is not None
    entries = [(list_name(place), field.name) for place in call.writes for field in block_of(place, blocks).fields]
    return {field.name: entry for field, entry in zip(program.output.block.fields, entries, strict=True)}


def _input(use: Use, lists: set[str], moving: set[Entry] | None) -> Use:
    """An input with what moves as active; lists: those from which it is read."""
    names = (field.name for field in use.block.fields)
    active = frozenset(name for name in names if moving is None or any((one, name) in moving for one in lists))
    return replace(
        use, active=active, moving=moving is None or any(LISTS[one].kept is not Kept.PARAMETERS for one in lists)
    )


def _sources(call: Call, program: Program, moving: set[Entry]) -> dict[sp.Symbol, Entry]:
    """The inputs of a call that move."""
    found = {}
    for place, use in zip(call.reads, program.inputs, strict=True):
        for field in use.block.fields:
            if (entry := (list_name(place), field.name)) in moving:
                found[symbol_of(use, field.name)] = entry
    return found


def _moving(every: list[tuple[Call, Program]], blocks: Blocks, moves: Mapping[str, tuple[str, ...]]) -> set[Entry]:
    """All that moves in an evaluation."""
    moving: set[Entry] = set()
    for name, quantities in moves.items():
        if name != "coefficient" or blocks.coefficient is not None:
            block = block_of(name, blocks)
            given = [one for one in quantities if one in block.quantities] or list(block.quantities)
            moving |= {(name, field) for field in fields_of(block, given)}
    size = -1
    while size != len(moving):  # bodies follow from bodies
        size = len(moving)
        for call, program in every:
            symbols = moving_symbols(program, set(_sources(call, program, moving)))
            for name, entry in _written(call, program, blocks).items():
                if program.results[name].free_symbols & symbols:
                    moving.add(entry)
    return moving


def _read(every: list[tuple[Call, Program]], blocks: Blocks, moving: set[Entry]) -> set[Entry]:
    """The moving entries of which something reads the derivatives: a result, another program or the runtime."""
    lists = {list_name(place) for call, _ in every for place in call.reads}
    read: set[Entry] = set()
    for call, program in every:
        for name, entry in _written(call, program, blocks).items():
            solved = isinstance(call.by, Solve) and name in call.by.reads
            if entry in moving and (entry[0] not in lists or solved):
                read.add(entry)
    size = -1
    while size != len(read):
        size = len(read)
        for call, program in reversed(every):
            sources = _sources(call, program, moving)
            results = {name for name, entry in _written(call, program, blocks).items() if entry in read}
            read |= {sources[symbol] for symbol in symbols_read(program, results, set(sources))}
    return read
