"""Schedules: which program runs over which bodies and surfaces, from which blocks to which.

A program (`derive.py`) describes one body or one surface. A schedule states, as data, how the programs of a stack
follow each other in one evaluation. The C that calls them is emitted from it twice: once for the values, and once for
derivatives with respect to the inputs of the schedule, each program by its own tangent.

A place is a block in a list of blocks: `body[k-1]` is the block of the body below body k, `rim[j]` that of surface j,
which lies between bodies j and j+1. `base` and `top` are the indices of the lowest and of the highest body.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from enum import Enum

from msfp_gen.specification.layout import Effects, ModelSpec

from .blocks import Blocks
from .lower import needed_statements
from .program import Block, Field, Program

COLUMNS = "MSFP_DOF"
"""C constant with the number of variables whose derivatives one call carries."""


class Over(Enum):
    """What a part of a schedule runs over, from the lowest body or surface up."""

    BASE = "base"
    BODIES = "moving bodies k"
    SURFACES = "surfaces j"
    TOP = "top"


@dataclass(frozen=True)
class Decision:
    """C of a program of which the runtime decides whether it acts.

    Attributes:
        values: evaluates it, and sets what it writes to zero where it does not act.
        acts: whether it acts; its derivatives are zero elsewhere. None: nothing that moves depends on it.
    """

    values: str
    acts: str | None = None


@dataclass(frozen=True)
class Call:
    """One program with the places that it reads, in the order of its inputs, and those that it writes.

    A program that writes several places writes their blocks one after the other.
    """

    program: str
    reads: tuple[str, ...]
    writes: tuple[str, ...]
    decision: Decision | None = None


@dataclass(frozen=True)
class Pass:
    """Programs that run one after the other for every body or surface."""

    over: Over
    calls: tuple[Call, ...]


Place = tuple[str, int]
"""A list and the number of a block in it."""


@dataclass(frozen=True)
class List:
    """A list of blocks of one kind, or a single one.

    Attributes:
        kind: name of the block in `Blocks`.
        member: C of the list.
        columns: C of the derivatives; empty for parameters and what is given as a function of time.
        length: C of the number of blocks; empty for a single one.
    """

    kind: str
    member: str
    columns: str = ""
    length: str = ""


def _constant(kind: str, member: str, length: str = "") -> List:
    return List(kind, member, "", length)


def _moving(kind: str, owner: str, name: str, length: str = "") -> List:
    return List(kind, f"{owner}->{name}", f"{owner}->d{name}", length)


LISTS: Mapping[str, List] = {
    "body_parameters": _constant("body_parameters", "p->body", "MSFP_NB + 1"),
    "surface_parameters": _constant("surface_parameters", "p->surface", "MSFP_NB"),
    "top_parameters": _constant("top_parameters", "p->top"),
    "coefficient": _constant("coefficient", "w->coefficient", "MSFP_NB"),
    "foot_stage": _constant("foot_stage", "s->foot_stage"),
    "upright": _constant("upright", "s->upright"),
    "foot": _constant("foot", "w->foot"),
    "frame": _moving("body", "s", "frame"),
    "x": _moving("coordinates", "w", "x", "MSFP_NB + 1"),
    "body": _moving("body", "w", "body", "MSFP_NB + 1"),
    "load_force": _moving("vector", "s", "load_force"),
    "load_moment": _moving("moment", "s", "load_moment"),
    "force": _moving("vector", "w", "force", "MSFP_NB + 1"),
    "moment": _moving("moment", "w", "moment", "MSFP_NB + 1"),
    "unknowns": _moving("unknowns", "s", "unknowns", "MSFP_NB"),
    "friction": _moving("friction", "s", "friction", "MSFP_NB"),
    "rim_coordinates": _moving("rim_coordinates", "s", "rim_coordinates", "MSFP_NB"),
    "rim": List("rim", "w->rim", "s->drim", "MSFP_NB"),
    "relative": _moving("relative", "s", "relative", "MSFP_NB"),
    "report_contact": _moving("report_contact", "s", "report_contact", "MSFP_NB"),
    "linear": _moving("linear", "s", "linear", "MSFP_NB + 1"),
    "angular": _moving("angular", "s", "angular", "MSFP_NB + 1"),
    "balances": _moving("balances", "s", "balances", "MSFP_NB + 1"),
}
"""All lists of blocks. p: parameters, w: work area of an evaluation, s: blocks of the schedule alone."""

VARIABLES: Mapping[str, tuple[tuple[str, tuple[str, ...]], ...]] = {
    "coordinate": (("x", tuple(f"{name}{order}" for order in ("", 1, 2) for name in ("psi", "theta", "phi"))),),
    "contact": (("unknowns", ("psi", "theta", "N")),),
    "friction": (("friction", ("Y", "Z")),),
    "base": (("frame", ("C", "V", "A")),),
    "load": (("load_force", ("F",)), ("load_moment", ("M",))),
}
"""The inputs with respect to which a schedule is differentiated, by their kind in `msfp.h`: list and quantities."""


def unknowns(spec: ModelSpec) -> list[tuple[str, int, int]]:
    """The unknowns (2.119) in order, as (kind, index, field) of `VARIABLES`: accelerations, contact positions, N."""
    surfaces, planar = range(spec.layout.surfaces), spec.effects.dimension == "planar"
    angles, positions = ((1,), (1,)) if planar else ((0, 1, 2), (0, 1))
    return [
        *(("coordinate", j + 1, 6 + i) for j in surfaces for i in angles),
        *(("contact", j, i) for j in surfaces for i in positions),
        *(("contact", j, 2) for j in surfaces),
    ]


def momentum_balances(effects: Effects) -> tuple[Pass, ...]:
    """The momentum balances (3.26)-(3.29) at given unknowns (2.119), as PEER 2017/07 states them."""
    rim = (
        Call("rim_coordinates", ("body[j]", "x[j+1]"), ("rim_coordinates[j]",)),
        Call(
            "rim",
            ("surface_parameters[j]", "rim_coordinates[j]"),
            ("rim[j]",),
            Decision("msfp_rim_force(p, w, j, NULL)", "w->rim_active[j]"),
        ),
    )
    support = ("upright",) if effects.top_rotation else ()
    law = ("coefficient[j]",) if effects.law is not None else ()
    return (
        Pass(Over.BASE, (Call("forward", ("body_parameters[base]", "frame", "x[base]"), ("body[base]",)),)),
        Pass(Over.BODIES, (Call("forward", ("body_parameters[k]", "body[k-1]", "x[k]"), ("body[k]",)),)),
        Pass(
            Over.TOP,
            (
                Call(
                    "top_wrench",
                    ("top_parameters", "foot_stage", "body[top]", "x[top]", "load_force", "load_moment", *support),
                    ("force[top]", "moment[top]"),
                ),
                Call(
                    "foot",
                    ("top_parameters", "body[top]", "foot_stage"),
                    ("foot",),
                    Decision("msfp_move_foot(p, s->foot_stage, w)"),
                ),
            ),
        ),
        Pass(
            Over.SURFACES,
            (
                *(rim if effects.rims else ()),
                Call("slip_rotation", ("body[j+1]", "x[j+1]", "x[j]"), ("relative[j]",)),
                Call(
                    "report_contact",
                    ("surface_parameters[j]", "unknowns[j]", "friction[j]", "relative[j]", *law),
                    ("report_contact[j]",),
                ),
                Call(
                    "report_wrench",
                    ("body[j]", "report_contact[j]", *(("rim[j]",) if effects.rims else ())),
                    ("force[j]", "moment[j]"),
                ),
            ),
        ),
        Pass(
            Over.BODIES,
            (
                Call("linear_balance", ("body_parameters[k]", "body[k]", "force[k-1]", "force[k]"), ("linear[k]",)),
                Call(
                    "angular_balance",
                    ("body_parameters[k]", "body[k]", "force[k-1]", "moment[k-1]", "force[k]", "moment[k]"),
                    ("angular[k]",),
                ),
                Call("balances", ("linear[k]", "angular[k]", "x[k]"), ("balances[k]",)),
            ),
        ),
    )


def list_of(place: str) -> List:
    """The list of a place."""
    return LISTS[place.partition("[")[0]]


def index_of(place: str) -> str:
    """The index of a place in its list; empty for a single block."""
    return place.partition("[")[2].removesuffix("]")


def calls_of(passes: Iterable[Pass]) -> Iterator[Call]:
    """All calls in order."""
    for one in passes:
        yield from one.calls


def unrolled(passes: Iterable[Pass], surfaces: int) -> Iterator[tuple[str, list[Place], list[Place]]]:
    """The programs of a stack one by one, each with the places that it reads and writes."""
    numbers = {
        Over.BASE: range(1),
        Over.BODIES: range(1, surfaces + 1),
        Over.SURFACES: range(surfaces),
        Over.TOP: range(surfaces, surfaces + 1),
    }

    def numbered(place: str, number: int) -> Place:
        index = {"": 0, "base": 0, "top": surfaces}.get(index_of(place))
        if index is None:
            index = number + int(index_of(place)[1:] or 0)
        return place.partition("[")[0], index

    for one in passes:
        for number in numbers[one.over]:
            for call in one.calls:
                reads, writes = ([numbered(place, number) for place in places] for places in (call.reads, call.writes))
                yield call.program, reads, writes


def tangent_of(program: Program) -> Program:
    """The program whose tangent a schedule calls: under another name where its own carries other columns."""
    if program.columns in ("", COLUMNS):
        return program
    return replace(program, name=f"{program.name}_columns", columns=COLUMNS)


def check(passes: Iterable[Pass], programs: Mapping[str, Program], blocks: Blocks) -> None:
    """Raise AssertionError where a place does not fit its program, or a derivative would be lost or is not there.

    Every derivative that a call reads must have been written by an earlier one, or belong to `VARIABLES`; and a call
    must not take for constant what has derivatives.
    """
    moving = {(name, field.name) for parts in VARIABLES.values() for name, _ in parts for field in _block(name, blocks)}
    for call in calls_of(passes):
        program = programs[call.program]
        assert program.output is not None
        assert len(call.reads) == len(program.inputs), call
        assert call.decision is None or call.decision.acts or not program.tangents, call
        needed = _differentiated(program)
        for place, use in zip(call.reads, program.inputs, strict=True):
            assert getattr(blocks, list_of(place).kind) == use.block, (call, place)
            known = {field for name, field in moving if name == place.partition("[")[0]}
            reads = {field.name for field in use.block.fields if f"{use.alias}_{field.name}" in needed}
            lost = reads & known - use.active
            missing = reads & use.active - known
            assert not lost and not missing, (call, place, lost, missing)
        written = [(place.partition("[")[0], field.name) for place in call.writes for field in _block(place, blocks)]
        assert len(written) == len(program.output.block.fields), call
        for entry, field in zip(written, program.output.block.fields, strict=True):
            if field.name in program.tangents and list_of(entry[0]).columns:
                moving.add(entry)


def _block(place: str, blocks: Blocks) -> tuple[Field, ...]:
    block: Block = getattr(blocks, list_of(place).kind)
    return block.fields


def _differentiated(program: Program) -> set[str]:
    """Names of the inputs on which the results of a program depend whose derivatives are emitted."""
    targets = {s for name in program.tangents for s in program.results[name].free_symbols}
    statements = needed_statements(program.statements, targets)
    return {s.name for s in targets} | {s.name for st in statements for s in st.expression.free_symbols}
