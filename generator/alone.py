"""The derived equations alone: kinematics, balances and condensed residual with their Jacobians, without the runtime.

The same programs and the same drivers as in a full model, in one file that loops over bodies and surfaces. Everything
that is given is one row of numbers, z; a Jacobian has a column for each of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from math import prod
from time import perf_counter
from typing import Any

from msfp_gen.common.version import __version__
from msfp_gen.specification import contract
from msfp_gen.specification.layout import ModelSpec

from . import Generated
from .derive import Equations, derive
from .directions import BY_VARIABLES, COLUMNS, directed
from .drivers import LENGTHS, DriverPrinter, form_of
from .emit import function
from .interface import effects_text, environment, surface_values
from .lower import lower
from .places import LISTS, Call, List, ListStorage, Over, Pass, Per, passes_of
from .program import Block, Program
from .schedule import condensed, momentum_balances, results, unknowns

WIDTH = 8  # columns of a Jacobian that are computed at once
FILES = ("kernels.h", "equations.h", "equations.c")
AXES = ("x", "y", "z")
ANGLES = ("psi", "theta", "phi")
BY_INPUTS = replace(
    BY_VARIABLES,
    seeds=(*(BY_VARIABLES.seeds or ()), *((name, ("Y", "Z")) for name in ("friction_force", "friction_stage"))),
)
"""What is given moves: the variables of a step, and the force and the state of friction, for which nothing solves."""
MADE = ("body_block", "surface_block", "top_block", "spring_stage", "named_points")  # not part of a schedule


def module_name(spec: ModelSpec) -> str:
    """Name of the Python module."""
    return f"equations_{spec.layout.name}"


def inputs_of(spec: ModelSpec) -> dict[str, tuple[int, ...]]:
    """What z holds: name -> shape."""
    count = spec.layout.surfaces
    shapes = {**dict.fromkeys("qva", (count, 3)), **dict.fromkeys("hg", (count, 2)), "contact": (count, 3)}
    return {**shapes, "base": (3, 6), "load": (6,)}


class _Layout:
    """Where each number lies: all blocks of an evaluation are one array, one list after the other."""

    def __init__(self, equations: Equations, lists: Iterable[List]) -> None:
        self.equations, self.lists, self.starts = equations, list(lists), dict[str, int]()
        count, total = equations.spec.layout.surfaces, 0
        self.lengths = {Per.STACK: 1, Per.SURFACE: count, Per.BODY: count + 1}
        for one in self.lists:
            self.starts[one.name] = total
            total += self.lengths[one.per] * len(self.block(one).fields)
        self.total = total

    def block(self, one: List) -> Block:
        block: Block = getattr(self.equations.blocks, one.kind)
        return block

    def place(self, name: str, index: int, entry: str) -> int:
        """Place of a number; -1 where the model has none, as E2 in the plane."""
        names = [field.name for field in self.block(LISTS[name]).fields]
        return self.starts[name] + index * len(names) + names.index(entry) if entry in names else -1

    def input_places(self) -> Iterator[tuple[int, int]]:
        """Both places of every number of z; the state of friction is read in two lists."""
        surfaces = range(self.equations.spec.layout.surfaces)
        for order in ("", "1", "2"):
            yield from ((self.place("x", j + 1, f"{angle}{order}"), -1) for j in surfaces for angle in ANGLES)
        for name in ("friction", "friction_force"):
            other = "friction_stage" if name == "friction" else ""
            for j in surfaces:
                yield from (
                    (self.place(name, j, entry), self.place(other, j, entry) if other else -1) for entry in ("Y", "Z")
                )
        yield from ((self.place("unknowns", j, entry), -1) for j in surfaces for entry in ("psi", "theta", "N"))
        for letter, order in zip("CVA", ("", "1", "2"), strict=True):
            yield from ((self.place("frame", 0, f"{letter}{axis}"), -1) for axis in AXES)
            yield from ((self.place("x", 0, f"{angle}{order}"), -1) for angle in ANGLES)
        for name, letter in (("load_force", "F"), ("load_moment", "M")):
            yield from ((self.place(name, 0, f"{letter}{axis}"), -1) for axis in AXES)

    def results(self) -> dict[str, list[int]]:
        """Places of the rows of both forms, and of rotations, body by body."""
        layout, blocks = self.equations.spec.layout, self.equations.blocks
        surfaces = range(layout.surfaces)
        rates = [entry.name for entry in blocks.friction.fields]
        rows = [self.place("balances", j + 1, entry.name) for j in surfaces for entry in blocks.balances.fields]
        rows += [self.place("report_rates", j, f"d{name}") for j in surfaces for name in rates]
        moments = [entry.name for entry in blocks.angular.fields][: len(self.equations.unknown_angles)]
        left = [self.place("angular", j + 1, entry) for j in surfaces for entry in moments]
        left += [self.place("surface_results", j, f"d{name}") for j in surfaces for name in rates]
        left += [self.place("surface_results", j, "N") for j in surfaces]
        turning = [
            self.place("body", k, f"{name}{axis}")
            for k in range(layout.n)
            for name in ("w", "wp", "al", "alp", "t1", "t2", "t3")
            for axis in AXES
        ]
        return {"balances": rows, "condensed": left, "rotations": turning}


def _schedules(spec: ModelSpec) -> dict[str, tuple[Pass, ...]]:
    """Passes of both forms. Friction, which the runtime solves for, is given here by its state h and its force g."""

    def alone(passes: Iterable[Pass]) -> Iterator[Pass]:
        for one in passes:
            calls = tuple(
                replace(call, by=None if call.program == "contact" else call.by)
                for call in one.calls
                if call.program not in ("foot", "contact_stage")
            )
            if calls:
                yield Pass(Over.SURFACES if one.over is Over.TOGETHER else one.over, calls)

    effects = spec.effects
    forms = {"balances": momentum_balances(effects), "condensed": {**condensed(effects), **results()}}
    return {name: tuple(alone(passes_of(schedule))) for name, schedule in forms.items()}


def _calls(schedules: Mapping[str, tuple[Pass, ...]]) -> list[Call]:
    return [call for passes in schedules.values() for one in passes for call in one.calls]


def _programs(equations: Equations, called: set[str]) -> list[Program]:
    """The programs without derivatives of their own, surface by surface."""
    return [
        replace(program, tangents=frozenset(), columns="", lanes="")
        for program in equations.programs
        if program.name in called | set(MADE)
    ]


def equations_alone(spec: ModelSpec, example: Any) -> Generated:
    """The files of the equations alone. example: values of a bearing for the README.

    The top has no vertical spring. Models with uplift, a rotating top or a friction law need the runtime.
    """
    begin = perf_counter()
    effects = spec.effects
    assert not (effects.uplift or effects.top_rotation or effects.law), spec
    equations = derive(spec)
    schedules = _schedules(spec)
    calls = _calls(schedules)
    used = {place.partition("[")[0] for call in calls for place in (*call.reads, *call.writes)} | {
        "friction_force",
        "friction_stage",
    }
    lists = [one for name, one in LISTS.items() if name in used and one.storage is not ListStorage.PARAMETERS]
    parts = _Layout(equations, lists)
    programs = _programs(equations, {name for call in calls for name in call.programs})
    by_name = {program.name: program for program in programs}
    kernels = [lower(program) for program in programs]
    derivatives = [lower(program) for program in directed(BY_INPUTS, schedules, by_name, equations.blocks).values()]
    form = form_of(BY_INPUTS, schedules, derivatives)
    blocks = {use.block.name: use.block for program in programs for use in (*program.inputs, program.output) if use}
    drivers = [DriverPrinter(alone=True).part(name, passes, by_name, [form]) for name, passes in schedules.items()]
    names = {kind: i for i, kind in enumerate(inputs_of(spec))}
    sizes = [prod(shape) for shape in inputs_of(spec).values()]
    starts = [sum(sizes[:i]) for i in range(len(sizes))]
    context = {
        "version": __version__,
        "spec": spec,
        "layout": spec.layout,
        "effects": effects_text(spec),
        "module": module_name(spec),
        "blocks": list(blocks.values()),
        "lists": [(one.name, parts.block(one).name, LENGTHS[one.per]) for one in lists],
        "functions": [function(kernel) for kernel in kernels],
        "derivatives": [function(kernel) for kernel in derivatives],
        "drivers": drivers,
        "width": WIDTH,
        "places": list(parts.input_places()),
        "inputs": [(name, shape, starts[names[name]]) for name, shape in inputs_of(spec).items()],
        "total": sum(sizes),
        "results": parts.results(),
        "unknowns": [_in_z(*unknown, dict(zip(names, starts, strict=True))) for unknown in unknowns(spec)],
        "points": _points(equations),
        "rows": {"friction": len(equations.blocks.friction.fields), "moments": len(equations.unknown_angles)},
        "values": {"body": contract.BODY, "surface": surface_values(spec), "top": contract.TOP},
        "example": example,
    }
    templates = environment()
    names_of = {name: f"alone_{name}" for name in (*FILES, "README.md", "setup.py")}
    names_of |= {f"{module_name(spec)}.pyx": "alone.pyx"}
    files = {
        name: _renamed(templates.get_template(f"{template}.jinja").render(context, file=name))
        for name, template in names_of.items()
    }
    kernels += derivatives
    statements = sum(len(k.values) + len(k.partials) + len(k.tangents) for k in kernels)
    operations = sum(k.operations + k.tangent_operations for k in kernels)
    return Generated(files, statements, operations, {"derive and emit": perf_counter() - begin})


def _renamed(text: str) -> str:
    """Without the prefix of a full model."""
    return text.replace(COLUMNS, "COLUMNS").replace("MSFP_NB", "NB")


def _in_z(kind: str, index: int, entry: int, starts: Mapping[str, int]) -> int:
    """Place in z of an unknown (2.119): an acceleration of a body, or an entry of a contact."""
    if kind == "coordinate":
        return starts["a"] + (index - 1) * 3 + entry - 6
    return starts["contact"] + index * 3 + entry


def _points(equations: Equations) -> list[int]:
    """Index in the block of named points of each of (4 points, 3 orders, 3 axes); -1: zero."""
    names = [entry.name for entry in equations.blocks.points.fields]
    wanted = [f"{order}_{point}{axis}" for point in ("lo", "cm", "up", "sc") for order in "rva" for axis in AXES]
    return [names.index(name) if name in names else -1 for name in wanted]
