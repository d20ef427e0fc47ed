"""Directional derivatives: the programs of a model differentiated with respect to all of their inputs, parameters too.

A gradient differentiates a run with respect to parameters. Where the tangent of a step keeps the parameters constant,
the programs here carry the derivative of every input: radii, masses and friction as well as angles and rates. They are
the programs of `derive.py`, with other inputs active; nothing is derived again. Only models with `gradients` have them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import sympy as sp

from .program import Program, Statement, Use

COLUMNS = 4
"""Parameters whose derivatives one call carries: as many numbers as the vectors of most processors hold."""
CONTACT = ("dY", "dZ", "N", "Y", "Z", "sp", "cp", "st", "ct", "u", "v", "drill", "mu", "source", "memory")
"""Results of `contact`, beside its moment, whose derivatives are used."""
CONTACT_INPUTS = ("par", "h", "loc", "g", "c")
"""Inputs of `contact`: parameters, stage formula, force and slip rotation; and what its local equations determine,
friction and the coefficient of a friction law."""
DIFFERENTIATED = {
    "body_block": False,
    "surface_block": False,
    "top_block": False,
    "upright": False,
    "spring_stage": False,
    "resting_foot": False,
    "foot": True,
    "gap": True,
    "slid_friction": False,
    "slip_work": False,
}
"""Programs outside of the schedules (`drivers.py`) that are differentiated, and whether the block of their results is
at hand where this is done."""


def _with_all_inputs(use: Use) -> Use:
    return replace(use, active=frozenset(field.name for field in use.block.fields), moving=True)


def directional(program: Program, at_hand: bool) -> Program:
    """The program with all inputs active and every result differentiated; at_hand: as of `differentiated`."""
    inputs = [_with_all_inputs(use) for use in program.inputs]
    return differentiated(program, "direction", inputs, frozenset(program.results), "MSFP_COLUMNS", at_hand)


def differentiated(
    program: Program, name: str, inputs: list[Use], tangents: frozenset[str], columns: str, at_hand: bool
) -> Program:
    """The derivatives of a program, as one of another name, with other inputs active and other results differentiated.

    at_hand: the results themselves are read, as a block `out`, where the derivatives contain them.
    """
    assert program.output is not None
    names: dict[sp.Expr, sp.Expr] = {}
    if at_hand:
        inputs = [*inputs, program.output]
        computed = {statement.target for statement in program.statements}
        for field, result in program.results.items():
            if result in computed:
                names.setdefault(result, sp.Symbol(f"{program.output.alias}_{field}", real=True))
    return replace(
        program,
        name=f"{program.name}_{name}",
        inputs=inputs,
        statements=[Statement(s.target.xreplace(names), s.expression.xreplace(names)) for s in program.statements],
        results={field: result.xreplace(names) for field, result in program.results.items()},
        tangents=tangents,
        columns=columns,
        lanes="",
        stored=False,
    )


def by_inputs(program: Program) -> Program:
    """The program of a contact with all inputs active that it uses, for its Jacobian at all surfaces at once."""
    symbols = {s.name for statement in program.statements for s in statement.expression.free_symbols}

    def used(use: Use) -> Use:
        names = {f.name for f in use.block.fields if use.alias in ("h", "loc") or f"{use.alias}_{f.name}" in symbols}
        if use.alias == "c":
            names &= {"mu"}
        return replace(use, active=frozenset(names - {"sign"}), moving=True)

    assert tuple(use.alias for use in program.inputs) in (CONTACT_INPUTS[:4], (*CONTACT_INPUTS[:4], "c"))
    results = frozenset(name for name in program.results if name in CONTACT or name.startswith("M"))
    return replace(program, name="contact_by_inputs", inputs=[used(use) for use in program.inputs], tangents=results)


def contact_lists(programs: Iterable[Program]) -> dict[str, object]:
    """Inputs of `by_inputs` in order, as (position of the block, index in the block), and indices of its results."""
    for program in programs:
        if not program.lanes or program.output is None:
            continue
        uses = [(CONTACT_INPUTS.index(use.alias), use) for use in program.inputs]
        return {
            "inputs": [(i, j) for i, use in uses for j, f in enumerate(use.block.fields) if f.name in use.active],
            "results": [j for j, f in enumerate(program.output.block.fields) if f.name in program.tangents],
        }
    return {}


def directional_programs(programs: tuple[Program, ...]) -> Iterator[Program]:
    """The directional derivatives that a model with gradients uses beside those of its schedules."""
    for program in programs:
        if program.name in DIFFERENTIATED:
            yield directional(program, DIFFERENTIATED[program.name])
        if program.name == "contact":
            yield by_inputs(program)
