"""Nodes and places of schedules: calls of programs, and the lists of blocks that they read and write.

A place is a block in a list of blocks: `body[k-1]` is the block of the body below body k, `rim[j]` that of surface j,
which lies between bodies j and j+1. `base` and `top` are the indices of the lowest and of the highest body.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

from .program import Block, Program


class Over(Enum):
    """The bodies or surfaces over which a pass runs."""

    BASE = "base"
    BODIES = "moving bodies k"
    SURFACES = "surfaces j"
    DOWNWARD = "surfaces j, from the top down"
    TOGETHER = "all surfaces j at once"
    TOP = "top"


class When(Enum):
    """A condition of the state of an evaluation under which a program acts."""

    RIM_PUSHES = "the rim of surface j pushes"
    RIM_CLOSED = "surface j is beyond its capacity"
    ON_FACE = "the slider of surface j stands on its face"
    ON_EDGE = "the slider of surface j stands on its edge"


class Values(Enum):
    """Where the program of an `If` is evaluated."""

    HERE = "here, where it acts; what it writes is zero elsewhere"
    LATER = "where the next call needs it; here its derivatives alone"
    RUNTIME = "in the runtime, which sets to zero what it writes where it does not act"
    RUNTIME_WITH_SLOPES = "in the runtime, which also gives the fast tangent what it needs"


@dataclass(frozen=True)
class If:
    """Whether a program acts, or which of several does. Where none does, the derivatives are zero.

    Attributes:
        acts: program -> the condition under which it acts.
        values: where it is evaluated.
    """

    acts: Mapping[str, When]
    values: Values = Values.LATER


@dataclass(frozen=True)
class Solve:
    """A program that the runtime evaluates and differentiates itself, because it solves for what the program needs.

    Attributes:
        forms: the forms of derivatives (`drivers.py`) that exist: "tangents", "directions", "by_ends".
        emitted: the forms of which the derivatives are a program, which is emitted.
        gives_results: whether the runtime gives the results too where the derivatives are asked for.
        fails: whether it may find no solution, with a status at which the evaluation ends.
    """

    forms: frozenset[str]
    emitted: frozenset[str] = frozenset()
    gives_results: bool = False
    fails: bool = False


@dataclass(frozen=True)
class Call:
    """One program with the places that it reads, in the order of its inputs, and those that it writes.

    A program that writes several places writes their blocks one after the other.
    """

    program: str
    reads: tuple[str, ...]
    writes: tuple[str, ...]
    by: If | Solve | None = None
    """Whether it acts, or that the runtime solves it; None: the program is called, and so are its derivatives."""
    adds: bool = False
    """Whether what it writes is added to a block, which is zero at the start of the part."""

    @property
    def programs(self) -> tuple[str, ...]:
        """The programs of which one acts: with conditions those that have one, otherwise the one of the call."""
        return tuple(self.by.acts) if isinstance(self.by, If) else (self.program,)


@dataclass(frozen=True)
class Pass:
    """Programs that run one after the other for every body or surface."""

    over: Over
    calls: tuple[Call, ...]


Schedule = Mapping[str, tuple[Pass, ...]]
"""Part of an evaluation -> its passes. Each part becomes functions of its own."""

Place = tuple[str, int]
"""A list and the number of a block in it."""


class ListStorage(Enum):
    """The record in which a list is kept, which decides where its derivatives are."""

    PARAMETERS = "parameters"
    WORK = "work area"
    HERE = "blocks of the schedules"


class Per(Enum):
    """Of what a list has one block each."""

    STACK = "the stack"
    SURFACE = "a surface"
    BODY = "a body"


@dataclass(frozen=True)
class List:
    """A list of blocks of one kind, or a single one.

    Attributes:
        kind: name of the block in `Blocks`.
        name: name in the record that keeps it.
        storage: the parameters, the work area of an evaluation, or the blocks of the schedules alone.
        per: of what it has one block each.
        is_input: whether an evaluation is given it, so that no program needs to have written it.
        tangents: whether the work area keeps derivatives by the variables of a step, which the steppers read.
        directions: whether the work area keeps derivatives by parameters, likewise.
    """

    kind: str
    name: str
    storage: ListStorage = ListStorage.HERE
    per: Per = Per.STACK
    is_input: bool = False
    tangents: bool = False
    directions: bool = False


LISTS: Mapping[str, List] = {
    "body_parameters": List("body_parameters", "body", ListStorage.PARAMETERS, Per.BODY, is_input=True),
    "surface_parameters": List("surface_parameters", "surface", ListStorage.PARAMETERS, Per.SURFACE, is_input=True),
    "top_parameters": List("top_parameters", "top", ListStorage.PARAMETERS, is_input=True),
    "coefficient": List("coefficient", "coefficient", ListStorage.WORK, Per.SURFACE, is_input=True),
    "foot_stage": List("foot_stage", "foot_stage", is_input=True),
    "upright": List("upright", "upright", is_input=True),
    "foot": List("foot", "foot", ListStorage.WORK, directions=True),
    "frame": List("body", "frame", is_input=True),
    "x": List("coordinates", "x", ListStorage.WORK, Per.BODY, is_input=True, tangents=True, directions=True),
    "body": List("body", "body", ListStorage.WORK, Per.BODY, tangents=True, directions=True),
    "load_force": List("force", "load_force", is_input=True),
    "load_moment": List("moment", "load_moment", is_input=True),
    "force": List("force", "force", ListStorage.WORK, Per.BODY, tangents=True, directions=True),
    "moment": List("moment", "moment", ListStorage.WORK, Per.BODY, tangents=True, directions=True),
    "unknowns": List("unknowns", "unknowns", per=Per.SURFACE, is_input=True),
    "friction": List("friction", "friction", per=Per.SURFACE, is_input=True),
    "rim_coordinates": List("rim_coordinates", "rim_coordinates", per=Per.SURFACE),
    "rim": List("rim", "rim", ListStorage.WORK, Per.SURFACE, directions=True),
    "relative": List("relative", "relative", per=Per.SURFACE),
    "report_contact": List("report_contact", "report_contact", per=Per.SURFACE),
    "linear": List("linear", "linear", per=Per.BODY),
    "angular": List("angular", "angular", per=Per.BODY),
    "balances": List("balances", "balances", per=Per.BODY),
    "report_rates": List("friction_rates", "report_rates", per=Per.SURFACE),
    "contact_frame": List("contact_frame", "contact_frame", ListStorage.WORK, Per.SURFACE, directions=True),
    "friction_previous": List("friction_previous", "friction_previous", per=Per.SURFACE, is_input=True),
    "friction_stage": List("friction_stage", "friction_stage", ListStorage.WORK, Per.SURFACE, directions=True),
    "friction_force": List("friction_force", "friction_force", per=Per.SURFACE, is_input=True),
    "contact": List("contact", "contact", ListStorage.WORK, Per.SURFACE, directions=True),
    "surface_results": List("surface_results", "surface_results", per=Per.SURFACE),
    "local_moment": List("moment", "local_moment", per=Per.SURFACE),
    "unilateral": List("unilateral", "unilateral", ListStorage.WORK, Per.SURFACE, directions=True),
    "rim_wrench": List("rim_wrench", "rim_wrench", ListStorage.WORK, Per.SURFACE),
    "carried": List("force", "carried", per=Per.BODY),
    "excess": List("linear", "excess", per=Per.SURFACE),
    "joint_moment": List("moment", "joint_moment", per=Per.SURFACE),
    "below": List("moment", "below", ListStorage.WORK, Per.BODY),
    "base_motion": List("base_motion", "base_motion", is_input=True),
    "energy": List("energy", "energy"),
    "rim_motion": List("rim_motion", "rim_motion", per=Per.SURFACE),
    "lock": List("lock", "lock", ListStorage.WORK, Per.SURFACE, is_input=True, directions=True),
    "restraint": List("restraint", "restraint"),
    "rim_energy": List("rim_energy", "rim_energy"),
    "unilateral_energy": List("unilateral_energy", "unilateral_energy"),
    "top_power": List("top_power", "top_power"),
    "base_power": List("power", "base_power"),
    "lock_power": List("power", "lock_power"),
    "friction_power": List("friction_power", "friction_power"),
    "works": List("works", "works"),
    "tilt": List("tilt", "tilt"),
    "load_end": List("load_end", "load_end", is_input=True),
    "load_work": List("load_work", "load_work"),
    "compliance": List("compliance", "compliance"),
    "pair": List("pair", "pair", is_input=True),
    "length": List("length", "length"),
    "memory_part": List("memory_part", "memory_part", ListStorage.PARAMETERS, is_input=True),
    "memory": List("memory", "memory", is_input=True),
    "diagonal": List("diagonal", "diagonal", is_input=True),
    "memory_past": List("memory_past", "memory_past"),
    "memory_gain": List("memory_gain", "memory_gain"),
    "memory_end": List("memory_end", "memory_end"),
    "far_end": List("far_end", "far_end", is_input=True),
    "support": List("support", "support", is_input=True),
    "held": List("moment", "held"),
    "lower": List("end_wrench", "lower"),
    "upper": List("end_wrench", "upper"),
    "contact_angles": List("contact_angles", "contact_angles", per=Per.SURFACE),
    "gap": List("gap", "gap", per=Per.SURFACE),
    "resting_foot": List("resting_foot", "resting_foot"),
    "friction_end": List("friction_end", "friction_end", per=Per.SURFACE),
    "slip": List("slip", "slip", per=Per.SURFACE, is_input=True),
    "slip_end": List("slip_end", "slip_end", per=Per.SURFACE, is_input=True),
    "slip_work": List("slip_work", "slip_work", per=Per.SURFACE),
    "foot_previous": List("foot_previous", "foot_previous", is_input=True),
    "body_values": List("body_values", "body_values", ListStorage.PARAMETERS, Per.BODY, is_input=True),
    "surface_values": List("surface_values", "surface_values", ListStorage.PARAMETERS, Per.SURFACE, is_input=True),
    "top_values": List("top_values", "top_values", ListStorage.PARAMETERS, is_input=True),
    "sides": List("sides", "sides", ListStorage.PARAMETERS, Per.BODY, is_input=True),
    "side": List("side", "side", ListStorage.PARAMETERS, Per.SURFACE, is_input=True),
    "around": List("around", "around", ListStorage.PARAMETERS, is_input=True),
}
"""All lists of blocks."""


def list_name(place: str) -> str:
    """The name of the list of a place."""
    return place.partition("[")[0]


def list_of(place: str) -> List:
    """The list of a place."""
    return LISTS[list_name(place)]


def output_is_stored(call: Call) -> bool:
    """Whether the work area holds the results of a call while it is differentiated."""
    if isinstance(call.by, Solve):
        return call.by.gives_results
    return (
        call.by is None
        and not call.adds
        and len(call.writes) == 1
        and list_of(call.writes[0]).storage is ListStorage.WORK
    )


def index_of(place: str) -> str:
    """The index of a place in its list; empty for a single block."""
    return place.partition("[")[2].removesuffix("]")


def calls_of(passes: Iterable[Pass]) -> Iterator[Call]:
    """All calls in order."""
    for one in passes:
        yield from one.calls


def passes_of(schedule: Schedule) -> Iterator[Pass]:
    """All passes of an evaluation in order."""
    for passes in schedule.values():
        yield from passes


def unrolled(passes: Iterable[Pass], signs: Sequence[int]) -> Iterator[tuple[Call, list[Place], list[Place]]]:
    """The calls of a stack one by one, each with the places that it reads and writes.

    signs: +1 or -1 for each surface, concave up or down.
    """
    surfaces = len(signs)
    numbers = {
        Over.BASE: range(1),
        Over.BODIES: range(1, surfaces + 1),
        Over.SURFACES: range(surfaces),
        Over.DOWNWARD: range(surfaces - 1, -1, -1),
        Over.TOGETHER: range(surfaces),
        Over.TOP: range(surfaces, surfaces + 1),
    }

    def numbered(place: str, number: int) -> Place:
        index = {"": 0, "base": 0, "top": surfaces}.get(index_of(place))
        if index_of(place) == "slider":
            index = number + (signs[number] > 0)
        if index is None:
            index = number + int(index_of(place)[1:] or 0)
        return place.partition("[")[0], index

    for one in passes:
        for number in numbers[one.over]:
            for call in one.calls:
                reads, writes = ([numbered(place, number) for place in places] for places in (call.reads, call.writes))
                yield call, reads, writes


def check(passes: Iterable[Pass], programs: Mapping[str, Program], *records: object) -> None:
    """Raise AssertionError where a place does not fit its program, or nothing has written what a program reads.

    records: those whose fields are the blocks of the places, `Blocks` and `ValueBlocks`.
    """
    known = {name for name, one in LISTS.items() if one.is_input}
    every = ((call, programs[name]) for call in calls_of(passes) for name in call.programs)
    for call, program in every:
        assert program.output is not None
        assert len(call.reads) == len(program.inputs), call
        for place, use in zip(call.reads, program.inputs, strict=True):
            assert block_of(place, *records) == use.block, (call, place)
            assert list_name(place) in known, (call, place)
        fields = [field for place in call.writes for field in block_of(place, *records).fields]
        assert len(fields) == len(program.output.block.fields), call
        known |= {list_name(place) for place in call.writes}


def block_of(place: str, *records: object) -> Block:
    """The block of a place, in the first of the records that has it."""
    kind = list_of(place).kind
    block: Block = next(vars(one)[kind] for one in records if kind in vars(one))
    return block
