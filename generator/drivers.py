"""The drivers of a schedule as text for the templates: the calls of its programs, for values and for derivatives."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from msfp_gen.specification.layout import Effects

from .derive import Equations
from .directions import BY_ENDS, BY_PARAMETERS, BY_VARIABLES, Directions, directed
from .lower import Kernel, by_inputs, lower
from .places import (
    LISTS,
    Call,
    If,
    List,
    ListStorage,
    Over,
    Pass,
    Per,
    Schedule,
    Solve,
    Values,
    When,
    calls_of,
    check,
    index_of,
    list_name,
    list_of,
    output_is_stored,
    passes_of,
)
from .program import Block, Program
from .schedule import VARIABLES, beside, condensed, energies, memories, momentum_balances, remembers, two_port, unknowns
from .two_port import eliminated, end_angles

LOOPS = {
    Over.BODIES: "for (int k = 1; k <= MSFP_NB; ++k)",
    Over.SURFACES: "for (int j = 0; j < MSFP_NB; ++j)",
    Over.DOWNWARD: "for (int j = MSFP_NB - 1; j >= 0; --j)",
}
LENGTHS = {Per.STACK: "", Per.SURFACE: "MSFP_NB", Per.BODY: "MSFP_NB + 1"}
INDICES = {"base": "0", "top": "MSFP_NB", "slider": "msfp_slider(j)"}
CONDITIONS = {  # C; w: the argument of the driver that is the work area
    When.RIM_PUSHES: "{w}->rim_active[j]",
    When.RIM_CLOSED: "{w}->rim_gap[j] < 0.0",
    When.ON_FACE: "{w}->standing[j] == MSFP_ON_FACE",
    When.ON_EDGE: "{w}->standing[j] == MSFP_ON_EDGE",
}
RUNTIME: Mapping[tuple[str, str], tuple[str, tuple[str, ...]]] = {
    ("foot", "values"): ("msfp_move_foot", ("p", "s->foot_stage", "w")),
    ("foot", "directions"): ("msfp_foot_columns", ("p", "dp", "s->at", "ds->point", "w", "d")),
    ("contact", "values"): ("msfp_contacts", ("p", "w", "s->weights", "s->g", "s->jacobians->contact")),
    ("contact", "tangents"): ("msfp_contact_tangents", ("w", "ds->contact_frame", "ds->contact")),
    ("contact", "directions"): (
        "msfp_contact_columns",
        ("p", "dp", "w", "ds->point", "ds->slopes", "s->weights", "ds->all", "d"),
    ),
    ("rim_motion", "values"): ("msfp_gap_of_rim", ("w", "j", "s->rim_motion[j]")),
    ("rim_motion", "directions"): (
        "msfp_rim_motion_columns",
        ("p", "dp", "w", "d", "j", "s->rim_motion[j]", "ds->rim_motion[j]"),
    ),
    ("rim", "values"): ("msfp_rim_force", ("p", "w", "j", "s->jacobians->rim[j]")),
    ("unilateral_inside", "values"): ("msfp_unilateral_force", ("p", "w", "j")),
}
"""What the runtime does itself: program and form -> its function and what this is given; of `jacobians` where these are
wanted."""
ALONE = {("rim", "values"): ("rim_force", ("p", "s", "j"))}
"""The same of the equations without the runtime."""
WHERE = {"foot": "if (msfp_top_is_sprung(p)) ", "contact": LOOPS[Over.SURFACES] + " "}
"""What the runtime solves, of which the derivatives by the motion of the ends are a program: where this runs."""
Programs = Mapping[str, Program]


@dataclass(frozen=True)
class Line:
    """A statement in C, and the arguments of its driver that it names."""

    text: str
    names: frozenset[str] = frozenset()

    def inside(self, before: str) -> Line:
        """The same statement after some text."""
        return replace(self, text=before + self.text)


def _line(text: str, *places: str) -> Line:
    """A statement that names places in C, each an argument or what it points to: `w`, `w->body[j]`."""
    return Line(text, frozenset(place.partition("->")[0] for place in places))


def _run(function: str, given: Iterable[str]) -> Line:
    """The call of a function."""
    places = list(given)
    return _line(f"{function}({', '.join(map(_or_null, places))})", *places)


def _or_null(place: str) -> str:
    return f"s->jacobians ? {place} : NULL" if place.startswith("s->jacobians->") else place


Lines = Callable[[Call, Programs], Iterator[Line]]


def variable_kernels(equations: Equations) -> tuple[Kernel, ...]:
    """Derivatives of the programs of both forms of the equations by the variables of a step."""
    return _kernels(equations, with_variables(equations.spec.effects), BY_VARIABLES)


def with_variables(effects: Effects) -> Schedule:
    """The momentum balances and the condensed equations, which share their programs."""
    return {**momentum_balances(effects), **condensed(effects)}


def directional_kernels(equations: Equations) -> tuple[Kernel, ...]:
    """Derivatives by parameters: of the condensed equations, the energies, and the programs that C calls one by one."""
    effects = equations.spec.effects
    contacts = (lower(by_inputs(program)) for program in equations.programs if program.name == "contact")
    return (
        *_kernels(equations, {**condensed(effects), **energies(effects), **beside(effects)}, BY_PARAMETERS),
        *contacts,
    )


def end_kernels(equations: Equations) -> tuple[Kernel, ...]:
    """Derivatives of the programs of the condensed equations and of a two-port by the motion of its ends."""
    return (
        *_kernels(equations, with_ends(equations.spec.effects), BY_ENDS),
        *end_angles(equations.programs, equations.blocks, BY_ENDS),
    )


def with_ends(effects: Effects) -> Schedule:
    """The condensed equations after the load of the interface, and the wrenches of the ends."""
    port = two_port(effects)
    remembered = memories("by_ends") if remembers(effects) else {}
    return {"interface": port["interface"], **condensed(effects), **port, **remembered}


def _kernels(equations: Equations, schedule: Schedule, along: Directions) -> tuple[Kernel, ...]:
    programs = {program.name: program for program in equations.programs}
    found = directed(along, schedule, programs, equations.blocks)
    return tuple(
        eliminated(found[name]) if name == "contact" else lower(found[name]) for name in programs if name in found
    )


@dataclass(frozen=True)
class Form:
    """Directional derivatives of a schedule along one set of directions.

    Attributes:
        along: the set.
        kernels: name of a program -> its derivatives.
        parts: of the schedule.
        read: the lists whose values these contain.
    """

    along: Directions
    kernels: Mapping[str, Kernel]
    parts: tuple[str, ...]
    read: set[str]


def form_of(along: Directions, schedule: Schedule, kernels: Iterable[Kernel]) -> Form:
    """The form of some kernels."""
    kernel_of = {kernel.program.name.removesuffix(f"_{along.suffix}"): kernel for kernel in kernels}
    return Form(along, kernel_of, tuple(schedule), _read_values(schedule, kernel_of))


def schedule_context(
    equations: Equations, by_variables: Iterable[Kernel], directional: Iterable[Kernel], by_ends: Iterable[Kernel]
) -> dict[str, Any]:
    """Variables of the templates of the schedules. directional, by_ends: the kernels of a model that has these."""
    effects, programs = equations.spec.effects, {program.name: program for program in equations.programs}
    balances, with_directions = momentum_balances(effects), {**condensed(effects), **energies(effects)}
    port = two_port(effects) if effects.permits_moving_ends else {}
    of_ends, of_variables = {**condensed(effects), **port}, with_variables(effects)
    # The parts that C calls itself read what evaluations leave: their schedules are checked after these.
    after = {**with_directions, **port, **beside(effects)}
    for schedule in (balances, of_ends, after):
        check(passes_of(schedule), programs, equations.blocks, equations.value_blocks)
    directed = _lists(with_directions)
    used = {name: None for name in LISTS if name in directed or name in _lists(balances) or name in _lists(port)}
    tangents = form_of(BY_VARIABLES, of_variables, by_variables)
    forms = [tangents]
    forms += [form_of(BY_PARAMETERS, with_directions, kernels) for kernels in (directional,) if kernels]
    forms += [form_of(BY_ENDS, of_ends, kernels) for kernels in (by_ends,) if kernels]
    every = {**balances, **with_directions, **port}
    moving, printer = _moving_lists(tangents, of_variables), DriverPrinter()
    return {
        "parts": [printer.part(name, passes, programs, forms) for name, passes in every.items()],
        "directed": list(with_directions),
        "of_ends": list(of_ends),
        "of_variables": list(of_variables),
        "blocks": [_declared(LISTS[name], equations) for name in used if LISTS[name].storage is ListStorage.HERE],
        "block_tangents": [
            _declared(LISTS[name], equations) for name in used if name in moving and not LISTS[name].tangents
        ],
        "block_directions": [
            _declared(LISTS[name], equations)
            for name in directed
            if not LISTS[name].directions and LISTS[name].storage is not ListStorage.PARAMETERS
        ],
        "blocks_by_ends": [
            _declared(LISTS[name], equations)
            for name in _lists(of_ends)
            if LISTS[name].storage is not ListStorage.PARAMETERS
        ],
        "variables": [
            (
                kind,
                [one for name, quantities in parts if (one := printer.entries(name, quantities, equations))["entries"]],
            )
            for kind, parts in VARIABLES.items()
        ],
        "unknowns": unknowns(equations.spec),
    }


def _moving_lists(form: Form, schedule: Schedule) -> set[str]:
    """The lists that have derivatives: those of the variables, and what programs with derivatives write."""
    return {name for name, _ in form.along.seeds or ()} | {
        list_name(place) for call in calls_of(passes_of(schedule)) if _has(call, form) for place in call.writes
    }


PLACES = {Over.BASE: "base", Over.BODIES: "body", Over.TOP: "top"}


def operations(equations: Equations) -> dict[str, dict[str, int]]:
    """Arithmetic operations of one evaluation without derivatives: form -> (base, body, surface, top) -> number.

    Of programs of which one acts the longest counts, of what the runtime solves one iteration.
    """
    effects, programs = equations.spec.effects, {program.name: program for program in equations.programs}
    counts: dict[str, dict[str, int]] = {}
    for form, schedule in (("momentum balances", momentum_balances(effects)), ("condensed", condensed(effects))):
        of = counts[form] = dict.fromkeys(("base", "body", "surface", "top"), 0)
        for one in passes_of(schedule):
            for call in one.calls:
                longest = max(lower(programs[name]).operations for name in call.programs)
                of[PLACES.get(one.over, "surface")] += longest
    return counts


def _emitted(schedule: Schedule) -> list[Call]:
    """The calls that are emitted, without those of the runtime."""
    return [call for call in calls_of(passes_of(schedule)) if not isinstance(call.by, Solve)]


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


RECORDS = {ListStorage.PARAMETERS: "p", ListStorage.WORK: "w", ListStorage.HERE: "s"}
"""The argument of a driver that is the record."""


@dataclass(frozen=True)
class DriverPrinter:
    """C of the drivers of a schedule.

    alone: without the runtime, where all blocks are one record and their derivatives another, and nothing is solved.
    """

    alone: bool = False

    @property
    def runtime(self) -> Mapping[tuple[str, str], tuple[str, tuple[str, ...]]]:
        """What the C around the drivers does itself."""
        return ALONE if self.alone else RUNTIME

    def _record(self, storage: ListStorage) -> str:
        """The argument of a driver that is a record."""
        return "s" if self.alone and storage is ListStorage.WORK else RECORDS[storage]

    def part(self, name: str, passes: Iterable[Pass], programs: Programs, along: Iterable[Form]) -> dict[str, Any]:
        """A part of a schedule for the templates: its passes, each with its lines, for values and for derivatives."""
        calls = list(calls_of(passes))
        forms: dict[str, Lines] = {"values": self._values}
        forms |= {form.along.name: partial(self._directions, form=form) for form in along if name in form.parts}
        lines = {
            form: [(one, [line for call in one.calls for line in of(call, programs)]) for one in passes]
            for form, of in forms.items()
        }
        added = dict.fromkeys(place for call in calls if call.adds for place in call.writes)
        return {
            "name": name,
            "added": {form: [self.member(list_of(place), form) for place in added] for form in forms},
            "constant": not any(list_of(place).storage is ListStorage.WORK for call in calls for place in call.writes),
            "fails": any(isinstance(call.by, Solve) and call.by.fails for call in calls),
            "unused": {form: _unused(line for _, many in written for line in many) for form, written in lines.items()},
            "passes": {
                form: [
                    {"over": one.over.value, "loop": LOOPS.get(one.over, ""), "lines": [line.text for line in many]}
                    for one, many in written
                    if many
                ]
                for form, written in lines.items()
            },
        }

    def member(self, one: List, form: str) -> str:
        """C of the blocks of a list, or of their derivatives; empty for parameters where they are constant."""
        if form == "values":
            return f"{self._record(one.storage)}->{one.name}"
        if one.storage is ListStorage.PARAMETERS:
            return f"dp->{one.name}" if form == "directions" else ""
        if form == "tangents":
            return f"w->d{one.name}" if one.tangents and not self.alone else f"ds->{one.name}"
        return f"d->{one.name}" if form == "by_ends" or one.directions else f"ds->{one.name}"

    def entries(self, name: str, quantities: Iterable[str], equations: Equations) -> dict[str, Any]:
        """Indices of the fields of a kind of variable in the block of a list; -1: not stored, as E2 in the plane."""
        one = LISTS[name]
        block: Block = getattr(equations.blocks, one.kind)
        index = {field.name: i for i, field in enumerate(block.fields)}
        parts = [part for quantity in quantities for part in block.quantities.get(quantity, ())]
        at = "" if one.per is Per.STACK else "[v->index]"
        entries = [index[part] if isinstance(part, str) else -1 for part in parts]
        return {**{form: f"{self.member(one, form)}{at}" for form in ("values", "tangents")}, "entries": entries}

    def _in_c(self, place: str, form: str) -> str:
        """C of a place, or of its derivatives."""
        index = index_of(place)
        index = INDICES.get(index, index.replace("-", " - ").replace("+", " + "))
        return self.member(list_of(place), form) + (f"[{index}]" if index else "")

    def _all_in_c(self, places: Iterable[str], form: str) -> list[str]:
        return [self._in_c(place, form) for place in places]

    def _values(self, call: Call, programs: Programs) -> Iterator[Line]:
        """Statements that evaluate a call."""
        if call.by is None:
            yield from self._evaluated(call, programs[call.program])
        elif isinstance(call.by, Solve) or call.by.values in (Values.RUNTIME, Values.RUNTIME_WITH_SLOPES):
            function, given = self.runtime[call.program, "values"]
            if isinstance(call.by, If) and call.by.values is Values.RUNTIME:
                given = tuple("NULL" if place.startswith("s->jacobians") else place for place in given)
            solved = _run(function, given)
            if isinstance(call.by, Solve) and call.by.fails:
                yield Line(f"const int status = {solved.text};", solved.names)
                yield Line("if (status)")
                yield Line("    return status;")
            else:
                yield Line(f"{solved.text};", solved.names)
        elif call.by.values is Values.HERE:
            many = ((name, list(self._evaluated(call, programs[name]))) for name in call.programs)
            yield from self._chosen(call, self._all_in_c(call.writes, "values"), many)

    def _evaluated(self, call: Call, program: Program) -> Iterator[Line]:
        reads, writes = self._all_in_c(call.reads, "values"), self._all_in_c(call.writes, "values")
        yield from _written(call, f"msfp_{program.name}", reads, writes, _size(program))

    def _moving(self, call: Call, program: Program, form: str) -> list[str]:
        """C of the derivatives that a program reads."""
        return [self._in_c(place, form) for place, use in zip(call.reads, program.inputs, strict=False) if use.moving]

    def _directions(self, call: Call, programs: Programs, form: Form) -> Iterator[Line]:
        """Statements that differentiate a call, with its values where the work area does not hold them."""
        if not _has(call, form):
            return
        if isinstance(call.by, Solve):
            yield from self._of_solved(call, form)
            return
        writes = self._all_in_c(call.writes, form.along.name)
        names = {list_name(place) for place in call.writes}
        values = any(LISTS[name].storage is ListStorage.HERE for name in names & form.read)
        many = ((name, list(self._direction(call, programs[name], writes, values, form))) for name in call.programs)
        yield from self._chosen(call, writes, many)

    def _of_solved(self, call: Call, form: Form) -> Iterator[Line]:
        """The same of what the runtime solves: it differentiates this itself, or the derivatives are a program."""
        name = form.along.name
        if (call.program, name) in self.runtime:
            yield _statement(*self.runtime[call.program, name])
        elif call.program in form.kernels:
            derivatives = form.kernels[call.program].program
            # The friction force of the surfaces, for which the runtime solves, is not in a list.
            reads = ["s->g[j]" if place == "friction_force[j]" else self._in_c(place, "values") for place in call.reads]
            given = [*reads, *self._all_in_c(call.writes, "values"), *self._moving(call, derivatives, name)]
            called = _statement(f"msfp_{derivatives.name}", [*given, *self._all_in_c(call.writes, name)])
            when = _line(WHERE[call.program], "p") if call.program == "foot" else Line(WHERE[call.program])
            yield Line(when.text + called.text, when.names | called.names)

    def _direction(
        self, call: Call, program: Program, writes: list[str], with_values: bool, form: Form
    ) -> Iterator[Line]:
        if with_values:
            yield from self._evaluated(call, program)
        derivatives = form.kernels[program.name].program
        values = self._all_in_c(call.writes, "values") if output_is_stored(call) and not form.along.again else []
        given = [*self._all_in_c(call.reads, "values"), *values, *self._moving(call, derivatives, form.along.name)]
        size = f"{_size(program)} * {derivatives.columns}"
        yield from _written(call, f"msfp_{derivatives.name}", given, writes, size)

    def _chosen(self, call: Call, writes: list[str], programs: Iterable[tuple[str, list[Line]]]) -> Iterator[Line]:
        """Statements of the program that acts; where none does, the derivatives are zero."""
        if not isinstance(call.by, If):
            for _, statements in programs:
                yield from statements
            return
        start = ""
        for name, statements in programs:
            argument = self._record(ListStorage.WORK)
            condition = CONDITIONS[call.by.acts[name]].format(w=argument)
            yield _line(f"{start}if ({condition}) {{", argument)
            yield from (statement.inside("    ") for statement in statements)
            start = "} else "
        if call.adds:
            yield Line("}")
            return
        yield Line("} else")
        yield _line(f"    memset({writes[0]}, 0, sizeof {writes[0]});", writes[0])


def _has(call: Call, form: Form) -> bool:
    """Whether a call has derivatives of a form."""
    if isinstance(call.by, Solve):
        return form.along.name in call.by.forms
    return any(name in form.kernels for name in call.programs)


def _unused(lines: Iterable[Line]) -> list[str]:
    """The arguments of a driver that its statements do not name."""
    named = {name for line in lines for name in line.names}
    return [name for name in ("p", "dp", "w", "d", "s", "ds") if name not in named]


def _declared(one: List, equations: Equations) -> dict[str, str]:
    block: Block = getattr(equations.blocks, one.kind)
    return {"name": one.name, "block": block.name, "length": LENGTHS[one.per]}


def _written(call: Call, function: str, arguments: list[str], writes: list[str], size: str) -> Iterator[Line]:
    """Statements that call a function and put its result into one block, into several, or add it to one."""
    if len(writes) == 1 and not call.adds:
        yield _statement(function, [*arguments, *writes])
        return
    yield Line("{")
    yield Line(f"    double out[{size}];")
    yield _statement(function, [*arguments, "out"]).inside("    ")
    if call.adds:
        yield Line(f"    for (int i = 0; i < {size}; ++i)")
        yield _line(f"        {writes[0]}[i] += out[i];", writes[0])
    else:
        yield from _copies(writes)
    yield Line("}")


def _statement(function: str, given: Iterable[str]) -> Line:
    called = _run(function, given)
    return replace(called, text=f"{called.text};")


def _size(program: Program) -> str:
    assert program.output is not None
    return f"MSFP_{program.output.block.name.upper()}_SIZE"


def _copies(writes: Iterable[str]) -> Iterator[Line]:
    """Statements that copy `out` to several places, one after the other."""
    start = "out"
    for write in writes:
        yield _line(f"    memcpy({write}, {start}, sizeof {write});", write)
        start += f" + sizeof {write} / sizeof *out"
