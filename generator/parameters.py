"""The parameters of bodies, surfaces and top, from the values of a scene as they cross to C (`contract.py`)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import sympy as sp

from msfp_gen.specification import contract
from msfp_gen.specification.layout import Effects
from msfp_gen.specification.values import Value

from .blocks import Blocks
from .functions import Select
from .program import Block, Field, Program, Symbols

WIDEST = sp.Float("1.5")
"""Largest half-angle of a footprint [rad]."""


def _block(name: str, fields: Iterable[Field]) -> Block:
    fields = tuple(fields)
    return Block(name, fields, {field.name: (field.name,) for field in fields})


def _values(kind: str, values: Iterable[Value], more: Iterable[Field] = ()) -> Block:
    return _block(f"{kind}_values", (*(Field(v.name, v.unit, v.meaning) for v in values), *more))


@dataclass(frozen=True)
class ValueBlocks:
    """The values of a scene as C receives them, and those that bodies, surfaces and top take from their neighbours.

    Attributes:
        body_values, surface_values, top_values: of a scene.
        sides: of a body, from the surfaces below and above it.
        side: of a surface.
        around: of the top.
    """

    body_values: Block
    surface_values: Block
    top_values: Block
    sides: Block
    side: Block
    around: Block


def number_fields(effects: Effects) -> list[Field]:
    """The fields of a surface for the numbers of its friction law and drilling moment."""
    values = map(contract.NUMBERS.__getitem__, effects.surface_numbers)
    return [Field(value.name, value.unit, value.meaning) for value in values]


def value_blocks(effects: Effects) -> ValueBlocks:
    """The values of a model; those of a surface end with the numbers of friction law and drilling moment."""
    gravity = Field("gravity", "m/s^2", "gravitational acceleration")
    sides = (
        Field("sign_lower", "-", "+1: the surface below is concave up, -1: concave down; 1 under the base"),
        Field("sign_upper", "-", "of the surface above likewise; 1 on the top plate"),
        Field("radius_lower", "m", "R of the surface below; 0 under the base"),
        Field("radius_upper", "m", "R of the surface above; 0 on the top plate"),
        gravity,
    )
    compliance = Field("compliance", "m/N", "of all unilateral contacts in series; 0 without uplift")
    return ValueBlocks(
        body_values=_values("body", contract.BODY),
        surface_values=_values("surface", contract.surface_of(effects), number_fields(effects)),
        top_values=_values("top", contract.TOP),
        sides=_block("sides", sides),
        side=_block("side", (Field("sign", "-", "+1 concave up, -1 concave down"),)),
        around=_block("around", (gravity, compliance)),
    )


def places(v: Symbols, s: Symbols) -> Symbols:
    """Distances along t3 from the sphere centre below a body, r_01 for the base, to its named points (3.2)-(3.11)."""
    up = (1 + s["sign_lower"]) / 2
    bottom = -s["sign_lower"] * s["radius_lower"]  # (3.5), (3.9)
    centroid = up * v["centroid"] + (1 - up) * (v["height"] - v["centroid"])  # (3.2), (3.6), (3.10)
    top = bottom + v["height"]  # (3.3), (3.7), (3.11)
    centre = top + s["sign_upper"] * s["radius_upper"]  # (3.4), (3.8)
    return {"lo": bottom, "cm": bottom + centroid, "up": top, "sc": centre}


def body_block(b: Blocks, scene_values: ValueBlocks) -> Program:
    """Parameters of a body: distances along t3 from the positions (3.2)-(3.11), mass and moments of inertia."""
    p = Program("body_block", "parameters of a body, from (3.2)-(3.11)")
    v: Symbols = p.read(scene_values.body_values, "b")
    s: Symbols = p.read(scene_values.sides, "s")
    points = places(v, s)
    p.write(
        b.body_parameters,
        {
            "c": points["cm"],
            "e": points["sc"],
            "m": v["mass"],
            "jt": v["inertia_transverse"],
            "ja": v["inertia_axial"],
            "g": s["gravity"],
        },
    )
    return p


def surface_block(b: Blocks, scene_values: ValueBlocks, effects: Effects) -> Program:
    """Parameters of a surface; those of the edge that meets the rim are values of its slider."""
    p = Program("surface_block", "parameters of a surface; with uplift the half-angle of its footprint")
    v: Symbols = p.read(scene_values.surface_values, "v")
    slider: Symbols = p.read(scene_values.body_values, "s")
    side: Symbols = p.read(scene_values.side, "side")
    values = {
        "sign": side["sign"],
        "R": v["radius"],
        "sc": v["capacity"],
        "mu": v["friction"],
        "dy": v["yield_displacement"],
        "td": v["contact_damping"],
        "kc": v["rim_stiffness"],
        "cc": v["rim_damping"],
        "rs": slider["rim_radius"],
        "pr": slider["rim_offset"],
        **dict.fromkeys(("ks", "cs", "ca", "sa"), sp.Integer(0)),
    }
    if effects.uplift:
        # The footprint bounds the contact position; friction inclines the resultant further by its angle.
        friction = p.let(sp.atan(v["friction"]))
        half = p.let(sp.asin(p.let(slider["rim_radius"] / v["radius"])) + friction)
        half = p.let(Select(WIDEST - half, half, WIDEST))
        values |= {"ks": v["seat_stiffness"], "cs": v["seat_damping"], "ca": sp.cos(half), "sa": sp.sin(half)}
    values |= {name: v[name] for name in effects.surface_numbers}
    p.write(b.surface_parameters, values)
    return p


def top_block(b: Blocks, scene_values: ValueBlocks, effects: Effects) -> Program:
    """Parameters of the top.

    With uplift the given stiffnesses are those of springs and unilateral contacts in series (docs/uplift.md). The
    damper then dissipates as much in slow motion as the given one.
    """
    p = Program("top_block", "parameters of the top; with uplift its springs less the compliance of the contacts")
    v: Symbols = p.read(scene_values.top_values, "v")
    around: Symbols = p.read(scene_values.around, "a")
    sprung = p.let(Select(v["vertical_stiffness"], 1, Select(v["vertical_damping"], 1, 0)))
    anchor = (v["anchor_x"], v["anchor_y"], sp.Integer(0))
    parts = b.top_parameters.quantities["x0"]
    results = {
        "kr": v["rotational_stiffness"],
        "cr": v["rotational_damping"],
        "m": v["mass"],
        "jt": v["inertia_transverse"],
        "ja": v["inertia_axial"],
        "h": v["height"],
        "g": around["gravity"],
        "mz": Select(sprung, 0, v["mass"]),
        "x0": tuple(x if isinstance(part, str) else part for x, part in zip(anchor, parts, strict=True)),
    }
    share = sp.Integer(1)
    for prefix, names in (("", ("k", "c")), ("vertical_", ("kv", "cv"))):
        stiffness, damping = v[f"{prefix}stiffness"], v[f"{prefix}damping"]
        if effects.uplift:
            share = p.let(1 - stiffness * around["compliance"])
        results |= dict(zip(names, (stiffness / share, damping / share**2), strict=True))
    p.write(b.top_parameters, {**results, "sr": 1 / share})
    return p


def seat_compliance(b: Blocks, scene_values: ValueBlocks) -> Program:
    """Compliance of a unilateral contact; the contacts of a stack act in series (docs/uplift.md)."""
    p = Program("seat_compliance", "compliance of a unilateral contact")
    v: Symbols = p.read(scene_values.surface_values, "v")
    p.write(b.compliance, {"compliance": 1 / v["seat_stiffness"]})
    return p


def rim_bound(b: Blocks, scene_values: ValueBlocks) -> Program:
    """Cosine of the tilt at which a rim is met, and the derivative of the gap (3.21) by it, which bounds wide gaps."""
    p = Program("rim_bound", "tilt at which a rim is met, (3.20) and (3.21): its cosine, and d gap/d cosine")
    v: Symbols = p.read(scene_values.surface_values, "v")
    tilt, met = sp.Symbol("tilt"), p.let(v["capacity"] / v["radius"])
    gap = v["radius"] * (met - tilt)
    slope = sp.diff(gap, tilt) / sp.diff(sp.cos(tilt), tilt)
    p.write(b.rim_bound, {"cosine": sp.cos(met), "slope": slope.subs(tilt, met)})
    return p


def programs(b: Blocks, scene_values: ValueBlocks, effects: Effects) -> list[Program]:
    """The programs that make the parameters of a stack from the values of a scene."""
    return [
        body_block(b, scene_values),
        surface_block(b, scene_values, effects),
        rim_bound(b, scene_values),
        *([seat_compliance(b, scene_values)] if effects.uplift else []),
        top_block(b, scene_values, effects),
    ]
