"""Columns of Jacobians: the variable of each derivative as (kind, index, field), the form of the compiled stack."""

from __future__ import annotations

from collections.abc import Callable

from msfp_gen.errors import InputError

Column = tuple[int, int, int]


def columns(wrt: str, count: int, planar: bool) -> list[Column]:
    """The columns of `Model.jacobian` for wrt = "unknowns", "state" or "inputs" of a stack with `count` surfaces.

    Raises InputError for another `wrt`.
    """
    makers: dict[str, Callable[[], list[Column]]] = {
        "unknowns": lambda: unknown_columns(count, planar),
        "state": lambda: state_columns(count),
        "inputs": input_columns,
    }
    if wrt not in makers:
        raise InputError(f"wrt = {wrt!r}: give one of {', '.join(makers)}")
    return makers[wrt]()


def unknown_columns(count: int, planar: bool) -> list[Column]:
    """The unknowns in the order of (2.119): accelerations, contact positions, normal forces."""
    bodies, angles, contact = range(count), (1,) if planar else (0, 1, 2), (1,) if planar else (0, 1)
    return [
        *((0, k + 1, 6 + i) for k in bodies for i in angles),
        *((1, k, i) for k in bodies for i in contact),
        *((1, k, 2) for k in bodies),
    ]


def state_columns(count: int) -> list[Column]:
    """The state q, v and h, each flattened."""
    bodies = range(count)
    return [
        *((0, k + 1, 3 * order + i) for order in (0, 1) for k in bodies for i in range(3)),
        *((2, k, i) for k in bodies for i in range(2)),
    ]


def input_columns() -> list[Column]:
    """Base translations and rotations with first and second derivatives, then the load on the top plate."""
    return [*((3, 0, i) for i in range(9)), *((0, 0, i) for i in range(9)), *((4, 0, i) for i in range(6))]
