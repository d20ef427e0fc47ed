"""Programs of the rows of a run: sizes of their extremes, and the bound of friction where rows are interpolated."""

from __future__ import annotations

from .blocks import Blocks
from .functions import Hypot, Length
from .program import Program, Symbols


def extreme_length(b: Blocks) -> Program:
    """Length of two numbers of a row; of one number and zero its magnitude."""
    p = Program("extreme_length", "size of a pair of numbers, as extremes have it")
    v: Symbols = p.read(b.pair, "v")
    p.write(b.length, {"value": Length(v["x"], v["y"])})
    return p


def bounded_friction(b: Blocks) -> Program:
    """Y, Z of an interpolated row, which has left the unit disc, scaled to the size in another row."""
    p = Program("bounded_friction", "Y, Z scaled to the size of others, where interpolation has made them larger")
    own: Symbols = p.read(b.friction, "f")
    most: Symbols = p.read(b.friction, "m")
    share = p.let(p.let(Hypot(most["Y"], most["Z"])) / p.let(Hypot(own["Y"], own["Z"])))
    p.write(b.friction, {name: share * own[name] for name in ("Y", "Z")})
    return p


def programs(b: Blocks) -> list[Program]:
    """All of them."""
    return [extreme_length(b), bounded_friction(b)]
