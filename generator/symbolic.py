"""The equations of a whole stack as SymPy expressions: the programs evaluated over the schedule, in named statements.

They are the programs that become C, called in the order of the same schedule, with symbols in place of numbers. Signs,
and what a planar or a small model leaves out, are numbers, so that SymPy drops what they make zero.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import sympy as sp

from msfp_gen.specification.layout import ModelSpec, point_names

from .derive import Equations, derive
from .expressions import Definitions, Expressions, Tape, folded
from .functions import Select
from .latex import SYMBOLS, field_names
from .lower import needed_statements
from .places import LISTS, Place, Solve, passes_of, unrolled
from .program import Block, Program, Statement
from .schedule import momentum_balances

Record = Mapping[str, sp.Expr]
"""Stored field of a block -> its value."""
ANGLES = ("psi", "theta", "phi")
AXES = ("x", "y", "z")
ZERO = sp.Integer(0)

# Value of a scene -> its symbol and LaTeX; @ stands for the number of the body or surface.
BODY = {
    "height": ("ell_@", r"\ell_{@}"),
    "centroid": ("z_@", "z_{@}"),
    "mass": ("m_@", "m_{@}"),
    "inertia_transverse": ("lambda_@", r"\lambda_{1}^{@}"),
    "inertia_axial": ("lambda3_@", r"\lambda_{3}^{@}"),
    "rim_radius": ("r_@", "r_{@}"),
    "rim_offset": ("p_@", "p_{@}"),
}
SURFACE = {
    "radius": ("R_@", "R_{@}"),
    "capacity": ("s_c@", "s_{c@}"),
    "friction": ("mu_@", r"\mu_{@}"),
    "yield_displacement": ("d_@", "d_{@}"),
    "rim_stiffness": ("k_c@", "k_{c@}"),
    "rim_damping": ("c_c@", "c_{c@}"),
    "contact_damping": ("T_@", "T_{@}"),
}
TOP = {
    "stiffness": ("k_T", "k_{T}"),
    "damping": ("c_T", "c_{T}"),
    "rotational_stiffness": ("k_R", "k_{R}"),
    "rotational_damping": ("c_R", "c_{R}"),
    "mass": ("m_T", "m_{T}"),
    "inertia_transverse": ("lambda_T", r"\lambda_{1}^{T}"),
    "inertia_axial": ("lambda3_T", r"\lambda_{3}^{T}"),
    "height": ("h_T", "h_{T}"),
    "anchor_x": ("u_01", "u_{0,x}"),
    "anchor_y": ("u_02", "u_{0,y}"),
}
DOTS = {"": "", "d": r"\dot", "dd": r"\ddot"}
SHORT = ("body", "body_parameters", "surface_parameters")  # lists whose fields have names of their own


@dataclass
class Assembled:
    """A stack in symbols.

    Attributes
    ----------
    parameters, state, unknowns, inputs
        The symbols that are given. Parameters: symbol -> ("body" | "surface" | "top", number, name of the value), with
        ("", 0, "gravity") for gravity. Unknowns in the order of (2.119), state and inputs as of `Model.jacobian`.
    definitions
        All statements in order.
    lists
        Place of a block in the schedule -> its record.
    points, rotations, balances, rates
        Rows of results by name: the named points and their rates, angular velocities and accelerations, the balances,
        the rates of friction.
    latex_names
        Symbol -> its LaTeX.

    """

    spec: ModelSpec
    parameters: dict[sp.Symbol, tuple[str, int, str]] = field(default_factory=dict)
    state: list[sp.Symbol] = field(default_factory=list)
    unknowns: list[sp.Symbol] = field(default_factory=list)
    inputs: list[sp.Symbol] = field(default_factory=list)
    lists: dict[Place, Record] = field(default_factory=dict)
    points: dict[str, list[sp.Expr]] = field(default_factory=dict)
    rotations: dict[str, list[sp.Expr]] = field(default_factory=dict)
    balances: dict[str, list[sp.Expr]] = field(default_factory=dict)
    rates: dict[str, list[sp.Expr]] = field(default_factory=dict)
    latex_names: dict[sp.Symbol, str] = field(default_factory=dict)
    tape: Tape = field(default_factory=Tape)

    @property
    def definitions(self) -> Definitions:
        """All statements in order."""
        return self.tape.definitions

    def symbol(self, name: str, latex: str) -> sp.Symbol:
        """A given symbol."""
        new = sp.Symbol(name, real=True)
        self.latex_names[new] = latex
        return new

    def expressions(self, rows: Mapping[str, Sequence[sp.Expr]]) -> Expressions:
        """Rows of results with the statements that they need."""
        groups = {name: tuple(getattr(self, name)) for name in ("state", "unknowns", "inputs", "parameters")}
        return Expressions.of(rows, self.definitions, arguments=groups, latex_names=self.latex_names)


class _Evaluation:
    """Evaluates programs of a model in symbols, one after the other."""

    def __init__(self, equations: Equations, into: Assembled) -> None:
        self.into, self.programs = into, {program.name: program for program in equations.programs}
        self.equations = equations
        self.bodies: list[Record] = []  # values of each body
        self.sides: list[Record] = []  # and those that it takes from its neighbours
        self._statements: dict[str, tuple[Statement, ...]] = {}

    def call(self, name: str, inputs: Sequence[Record], place: Place | None = None) -> dict[str, sp.Expr]:
        """Results of a program as symbols and numbers. place: where they go, which names them."""
        program = self.programs[name]
        known: dict[sp.Expr, sp.Expr] = {
            sp.Symbol(f"{use.alias}_{field.name}", real=True): values.get(field.name, ZERO)
            for use, values in zip(program.inputs, inputs, strict=True)
            for field in use.block.fields
        }
        names = dict(self._names(program, place))
        for statement in self._needed(program):
            value = folded(statement.expression.xreplace(known))
            text, latex = names.get(statement.target, (None, ""))
            before = len(self.into.definitions)
            known[statement.target] = symbol = self.into.tape.let(value, text)
            if latex and len(self.into.definitions) > before:
                self.into.latex_names[symbol] = latex
        return {field: folded(result.xreplace(known)) for field, result in program.results.items()}

    def _needed(self, program: Program) -> tuple[Statement, ...]:
        if program.name not in self._statements:
            results = {s for e in program.results.values() for s in e.free_symbols}
            self._statements[program.name] = needed_statements(program.statements, results)
        return self._statements[program.name]

    def _names(self, program: Program, place: Place | None) -> Iterator[tuple[sp.Symbol, tuple[str, str]]]:
        """Symbol of a result in a program -> the name that it has in the stack, and its LaTeX."""
        if place is None:
            return
        name, index = place
        block: Block = getattr(self.equations.blocks, LISTS[name].kind)
        kind = name if name in SYMBOLS else block.name
        latex = field_names(block, kind, str(index + 1)) if kind in SYMBOLS else {}
        prefix = "" if name in SHORT else f"{name.removeprefix('report_')}_"
        for entry in block.fields:
            result = program.results.get(entry.name)
            if result is not None and result.is_Symbol:
                yield result, (f"{prefix}{entry.name}_{index + 1}", latex.get(entry.name, ""))


def assemble(spec: ModelSpec) -> Assembled:
    """The stack of a model in symbols: kinematics, the momentum balances (3.26)-(3.29) and the friction rates (3.18).

    There is no vertical spring of the top, and no uplift.
    """
    assert not spec.effects.uplift, spec
    equations = derive(spec)
    out = Assembled(spec)
    work = _Evaluation(equations, out)
    _parameters(out, work)
    _given(out, equations)
    for call, reads, writes in unrolled(passes_of(momentum_balances(spec.effects)), spec.layout.signs):
        if isinstance(call.by, Solve):  # the foot of a vertical spring, on which nothing here depends
            continue
        result = work.call(call.program, [out.lists[place] for place in reads], writes[0])
        if call.program == "rim":
            result = _where_it_pushes(result, out.tape)
        out.lists |= dict.fromkeys(writes, result)  # each list takes the fields that it has
    _points(out, work)
    _results(out, equations)
    used = {s for e in out.definitions.values() for s in e.free_symbols}
    used |= {s for row in (*out.balances.values(), *out.rates.values()) for e in row for s in e.free_symbols}
    out.parameters = {s: value for s, value in out.parameters.items() if s in used}
    return out


def _where_it_pushes(rim: Record, tape: Tape) -> dict[str, sp.Expr]:
    """A rim acts where the gap is closed and its force pushes (docs/model.md, choice 4)."""
    acts = tape.let(Select(-rim["g"], Select(-rim["fc"], 1, 0), 0))
    return {name: tape.let(Select(acts, value, ZERO)) for name, value in rim.items()}


def _parameters(out: Assembled, work: _Evaluation) -> None:
    """The parameters of bodies, surfaces and top, from symbols for the values of a scene."""
    layout, effects = out.spec.layout, out.spec.effects

    def values(kind: str, table: Mapping[str, tuple[str, str]], number: int) -> Record:
        record = {}
        for name, (text, latex) in table.items():
            symbol = out.symbol(text.replace("@", str(number)), latex.replace("@", str(number)))
            out.parameters[symbol] = kind, number, name
            record[name] = symbol
        return record

    numbers = {
        name: (f"{name}_@", rf"\mathrm{{{name}}}_{{@}}".replace("_", r"\_", name.count("_")))
        for name in effects.surface_numbers
    }
    gravity = out.symbol("g", "g")
    bodies = work.bodies = [values("body", BODY, k + 1) for k in range(layout.n)]
    surfaces = [values("surface", SURFACE | numbers, j + 1) for j in range(layout.surfaces)]
    top = values("top", TOP, 0)
    out.parameters[gravity] = "", 0, "gravity"
    radii = [ZERO, *(surface["radius"] for surface in surfaces), ZERO]
    signs = [1, *layout.signs, 1]
    for k, body in enumerate(bodies):
        sides = {
            "sign_lower": sp.Integer(signs[k]),
            "sign_upper": sp.Integer(signs[k + 1]),
            "radius_lower": radii[k],
            "radius_upper": radii[k + 1],
            "gravity": gravity,
        }
        work.sides.append(sides)
        place = "body_parameters", k
        out.lists[place] = work.call("body_block", [body, sides], place)
    for j, surface in enumerate(surfaces):
        sign = sp.Integer(layout.signs[j])
        place = "surface_parameters", j
        inputs = [surface, bodies[j + (layout.signs[j] > 0)], {"sign": sign}]
        out.lists[place] = work.call("surface_block", inputs, place)
    out.lists["top_parameters", 0] = work.call("top_block", [top, {"gravity": gravity}])
    out.lists["foot_stage", 0] = work.call("spring_stage", [out.lists["top_parameters", 0], {}])


def _given(out: Assembled, equations: Equations) -> None:
    """State, unknowns and inputs."""
    layout, blocks = out.spec.layout, equations.blocks
    fields = {entry.name for entry in blocks.coordinates.fields}
    angles = [angle for angle in ANGLES if angle in fields]
    axes = [axis for axis in AXES if f"C{axis}" in {entry.name for entry in blocks.body.fields}]
    turned = [axis for axis in AXES if f"M{axis}" in {entry.name for entry in blocks.moment.fields}]
    coordinates: dict[tuple[int, str], sp.Symbol] = {}
    for k in range(1, layout.n + 1):
        for order, (dots, accent) in enumerate(DOTS.items()):
            for angle in angles:
                latex = rf"{accent}{{\{angle}}}_{{{k}}}" if accent else rf"\{angle}_{{{k}}}"
                coordinates[k, f"{angle}{order or ''}"] = out.symbol(f"{dots}{angle}_{k}", latex)
        out.lists["x", k - 1] = {name: s for (body, name), s in coordinates.items() if body == k}
    moving = range(2, layout.n + 1)
    friction = [entry.name for entry in blocks.friction.fields]
    for suffix in ("", "1"):
        out.state += [coordinates[k, f"{angle}{suffix}"] for k in moving for angle in angles]
    out.unknowns += [coordinates[k, f"{angle}2"] for k in moving for angle in angles]
    contact = {
        "psi": (r"psit_@", r"\tilde{\psi}_{@}"),
        "theta": ("thetat_@", r"\tilde{\theta}_{@}"),
        "N": ("N_@", "N_{@}"),
    }
    for j in range(layout.surfaces):
        number = str(j + 1)
        out.lists["friction", j] = {name: out.symbol(f"{name}_{number}", f"{name}_{{{number}}}") for name in friction}
        out.lists["unknowns", j] = {
            entry.name: out.symbol(*(text.replace("@", number) for text in contact[entry.name]))
            for entry in blocks.unknowns.fields
        }
        out.state += out.lists["friction", j].values()
    places = [out.lists["unknowns", j] for j in range(layout.surfaces)]
    out.unknowns += [s for place in places for name, s in place.items() if name != "N"]
    out.unknowns += [place["N"] for place in places]
    frame: dict[str, sp.Expr] = {"t1x": sp.Integer(1), "t2y": sp.Integer(1), "t3z": sp.Integer(1)}
    for letter, (dots, accent) in zip("CVA", DOTS.items(), strict=True):
        for axis in axes:
            i = AXES.index(axis) + 1
            frame[f"{letter}{axis}"] = out.symbol(
                f"{dots}u_g{i}", rf"{accent}{{u}}_{{g{i}}}" if accent else f"u_{{g{i}}}"
            )
            out.inputs.append(frame[f"{letter}{axis}"])
    out.lists["frame", 0] = frame
    out.inputs += [coordinates[1, f"{angle}{suffix}"] for suffix in ("", "1", "2") for angle in angles]
    for name, letter, parts in (("load_force", "F", axes), ("load_moment", "M", turned)):
        record = {
            f"{letter}{axis}": out.symbol(f"{letter}_{i}", f"{letter}_{{{i}}}")
            for axis in parts
            for i in [AXES.index(axis) + 1]
        }
        out.lists[name, 0] = record
        out.inputs += record.values()


def _points(out: Assembled, work: _Evaluation) -> None:
    """Named points, and rotations, of all bodies."""
    n, points = out.spec.layout.n, []
    for k, (body, sides) in enumerate(zip(work.bodies, work.sides, strict=True)):
        below = out.lists["body", k - 1] if k else out.lists["frame", 0]
        points.append(work.call("named_points", [body, sides, below, out.lists["x", k]]))
    for letter, dots in zip("rva", DOTS.values(), strict=True):
        for k, point, name in point_names(n):
            out.points[f"{letter}_{name}"] = [points[k].get(f"{letter}_{point}{axis}", ZERO) for axis in AXES]
            label = rf"{dots}{{r}}_{{{name}}}" if dots else f"r_{{{name}}}"
            out.latex_names[sp.Symbol(f"{letter}_{name}", real=True)] = label
    for letter, text, latex in (
        ("w", "omega", r"\omega"),
        ("wp", "omega'", r"\omega'"),
        ("al", "alpha", r"\dot{\omega}"),
        ("alp", "alpha'", r"\dot{\omega}'"),
    ):
        for k in range(n):
            out.rotations[f"{text}_{k + 1}"] = [out.lists["body", k].get(f"{letter}{axis}", ZERO) for axis in AXES]
            out.latex_names[sp.Symbol(f"{text}_{k + 1}", real=True)] = f"{latex}_{{{k + 1}}}"


def _results(out: Assembled, equations: Equations) -> None:
    """Rows of the balances, body by body, and of the rates of friction, surface by surface."""
    latex = {"F": ("E", r"\epsilon_{@,#}"), "M": ("t", r"\eta_{@,#}")}
    for k in range(1, out.spec.layout.n):
        for name, value in out.lists["balances", k].items():
            letter, axis = name[0], name[1]
            i = AXES.index(axis) + 1
            row, label = f"{latex[letter][0]}{i}_{k + 1}", latex[letter][1].replace("@", str(k + 1))
            out.balances[row] = [value]
            out.latex_names[sp.Symbol(row, real=True)] = label.replace("#", axis if letter == "F" else str(i))
    for j in range(out.spec.layout.surfaces):
        for entry in equations.blocks.friction.fields:
            row = f"d{entry.name}_{j + 1}"
            out.rates[row] = [out.lists["report_contact", j][f"d{entry.name}"]]
            out.latex_names[sp.Symbol(row, real=True)] = rf"\dot{{{entry.name}}}_{{{j + 1}}}"
