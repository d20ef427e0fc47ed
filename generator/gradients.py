"""Directional derivatives: the programs of a model differentiated with respect to all of their inputs, parameters too.

A gradient differentiates a run with respect to parameters. Where the tangent of a step keeps the parameters constant,
the programs here carry the derivative of every input: radii, masses and friction as well as angles and rates. They are
the programs of `derive.py`, with other inputs active; nothing is derived again. Only models with `gradients` have them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from .program import Program, Use

COLUMNS = 8
"""Parameters whose derivatives one call carries: as many numbers as the widest vectors hold."""
UNKNOWN_COLUMNS = 4
"""Columns of the local unknowns of a contact (two of friction, its coefficient): a vector of four."""

CONTACT = ("dY", "dZ", "N", "Y", "Z", "sp", "cp", "st", "ct", "u", "v", "drill", "mu")
"""Results of `contact`, beside its moment, whose derivatives are used."""
LOCAL_UNKNOWNS = ("g", "c")
"""Inputs of `contact` that its local equations determine: friction, and the coefficient of a friction law."""
DIFFERENTIATED = (
    "arms",
    "forward",
    "surface_local",
    "contact",
    "moment_to_world",
    "interface_force",
    "angular_balance",
    "body_energy",
    "top_wrench",
    "foot",
    "top_energy",
    "gap",
    "rim",
)


def _with_all_inputs(use: Use) -> Use:
    return replace(use, active=frozenset(field.name for field in use.block.fields), moving=True)


def _constant(use: Use) -> Use:
    return replace(use, active=frozenset(), moving=False)


def directional(program: Program) -> Program:
    """The program with all inputs active; the derivative of every result is emitted."""
    constant = LOCAL_UNKNOWNS if program.name == "contact" else ()
    inputs = [_constant(use) if use.alias in constant else _with_all_inputs(use) for use in program.inputs]
    return _derived(program, "direction", inputs, "MSFP_COLUMNS")


def by_unknowns(program: Program) -> Program:
    """The program of a contact with its local unknowns as active inputs."""
    inputs = [use if use.alias in LOCAL_UNKNOWNS else _constant(use) for use in program.inputs]
    return _derived(program, "by_unknowns", inputs, "MSFP_UNKNOWN_COLUMNS")


def _derived(program: Program, suffix: str, inputs: list[Use], columns: str) -> Program:
    results = frozenset(program.results)
    if program.name == "contact":
        results = frozenset(name for name in results if name in CONTACT or name.startswith("M"))
    name = f"{program.name}_{suffix}"
    return replace(program, name=name, inputs=inputs, tangents=results, columns=columns, lanes=False)


def directional_programs(programs: tuple[Program, ...]) -> Iterator[Program]:
    """The directional derivatives that a model with gradients uses, in the order of its programs."""
    for program in programs:
        if program.name in DIFFERENTIATED:
            yield directional(program)
        if program.name == "contact":
            yield by_unknowns(program)
