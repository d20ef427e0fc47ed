"""Friction: the coefficient by a friction law, and the state by a hysteresis law, its rates and a closed form.

With a friction law, the coefficient mu is a local unknown of the contact, besides Y and Z: it depends on normal force,
slip and what the surface remembers, such as its temperature, which depend on mu in turn. The program `contact`
therefore has one more equation to solve. In `report_contact` psi~, theta~ and N are given, and mu follows directly. A
model of constant friction uses none of this. A law adds fields to blocks and statements to the contact programs.

Hysteresis is Bouc-Wen (3.18) or elastic-perfectly plastic. The closed form over a slip is for planar models without
masses (docs/effects.md). s is the slip over d_y. By (3.18) dY/ds = 1 - Y^2 while friction opposes the slip, so Y is a
hyperbolic tangent of s; while friction unloads, dY/ds = 1. By the plastic law Y is Y + s, between -1 and 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import sympy as sp

from msfp_gen.specification.formula import Operations, fold
from msfp_gen.specification.friction_laws import HYSTERESIS, Law, Memory, Spin, is_plastic

from .blocks import Blocks
from .functions import Clamp, Decay, Modulus, Select, Step
from .program import Block, Field, Program, Symbols

ON_THE_EDGE = sp.Float("1e-9")
"""A friction state is on the edge of the unit disc if 1 less its square is at most this."""


@dataclass(frozen=True)
class Shear:
    """Friction state of a contact, and the data from which its rates follow.

    Attributes:
        Y, Z: friction state.
        before: Y and Z that the earlier stages of a step give.
        tau: sum of the diagonal entry of the stage formula and the damping time T; T outside of a step [s].
    """

    Y: sp.Expr
    Z: sp.Expr
    before: tuple[sp.Expr, sp.Expr]
    tau: sp.Expr


def friction_rates(p: Program, law: str, shear: Shear, u: sp.Expr, v: sp.Expr, dy: sp.Expr) -> Symbols:
    """dY/dt and dZ/dt of a hysteresis law at the slip velocity u, v; `dy` is the yield displacement.

    `plastic` is the velocity of plastic slip.
    """
    return (plastic_rates if is_plastic(law) else partial(bouc_wen_rates, law))(p, shear, u, v, dy)


def yield_displacement(p: Program, seated: bool, par: Symbols, N: sp.Expr) -> sp.Expr:
    """d_y of a surface at the normal force N; with uplift less mu N/k, by which its unilateral contact yields.

    The given d_y is that of surface and contact in series. At least half of it is left to friction.
    """
    if not seated:
        dy: sp.Expr = par["dy"]
        return dy
    half, contact = p.let(par["dy"] / 2), p.let(par["mu"] * N / par["ks"])
    return p.let(par["dy"] - p.let(Select(half - contact, contact, half)), "dy")


def bouc_wen_rates(law: str, p: Program, shear: Shear, u: sp.Expr, v: sp.Expr, dy: sp.Expr) -> Symbols:
    """dY/dt and dZ/dt (3.18) with 1/d_y for R/R_0, and the switches of the hysteresis law.

    The plastic slip is that of the isotropic law for every law, Y^2 + Z^2 times Y u + Z v where the latter is positive:
    it is zero where friction unloads elastically and equals the slip velocity in steady sliding. The magnitude of the
    slip velocity is not used: a friction coefficient that increases with it would increase friction during elastic
    unloading, where friction acts along the slip and does work on the sliders, so that light sliders accelerate without
    bound. The plastic part by the switches per axis has the same defect across the slip.
    """
    Y, Z = shear.Y, shear.Z
    yu, zv = p.let(Y * u), p.let(Z * v)
    switches = HYSTERESIS[law].switches
    assert switches is not None
    a, b = switches(yu, zv, lambda x: p.let(Step(p.let(x))))
    drive = p.let(a * yu + b * zv)
    square, along = p.let(Y**2 + Z**2), p.let(yu + zv)
    return {
        "dY": p.let((u - Y * drive) / dy, "dY"),
        "dZ": p.let((v - Z * drive) / dy, "dZ"),
        "plastic": p.let(square * along * p.let(Step(along))),
    }


def plastic_rates(p: Program, shear: Shear, u: sp.Expr, v: sp.Expr, dy: sp.Expr) -> Symbols:
    """dY/dt and dZ/dt of the elastic-perfectly plastic law by radial return; keys as of `friction_rates`.

    The friction force over -mu N, g = (Y, Z) + T d(Y, Z)/dt, is bounded by 1: g is the projection onto the unit disc of
    `before` + tau (u, v)/d_y, the force of an elastic slip, and d(Y, Z)/dt = (g - before)/tau. With tau = 0 it is the
    limit: elastic inside the disc, and without the outward component on its edge.
    """
    before = shear.before
    trial = tuple(p.let(f + shear.tau * w / dy) for f, w in zip(before, (u, v), strict=True))
    square = p.let(trial[0] ** 2 + trial[1] ** 2)
    root = p.let(sp.sqrt(p.let(1 + Step(p.let(square - 1)) * (square - 1))))
    along = p.let(before[0] * u + before[1] * v)
    timed = p.let(Step(shear.tau))
    returned, limit = p.let(timed * dy / (shear.tau + 1 - timed)), p.let(1 - timed)
    outward = p.let(limit * Step(p.let(square - 1 + ON_THE_EDGE)) * Step(along))
    slipping = p.let(returned * (root - 1) + outward * along, "slipping")
    return {
        "dY": p.let((u - p.let(trial[0] / root) * slipping) / dy, "dY"),
        "dZ": p.let((v - p.let(trial[1] / root) * slipping) / dy, "dZ"),
        "plastic": slipping,
    }


def _after_slip(p: Program, plastic: bool, Y: sp.Expr, slip: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Y after a slip over d_y, and the work that friction dissipates over it, divided by mu N d_y."""
    # By (3.18) the slip has two parts. While Y u < 0, friction unloads to zero along a straight line. Then Y grows as
    # a hyperbolic tangent, and the work is the integral of Y^3 ds. Where the slip ends in the first part, the
    # exponential is not used: Y stays exact, and its slope is 1 also at rest. By the plastic law the work is the slip
    # beyond the edge of the unit disc.
    # In the code y is Y times the direction of the slip, and `left` the slip of the second part.
    if plastic:
        trial = p.let(Y + slip)
        end = p.let(Clamp(trial))
        beyond = p.let(trial - end)
        return end, beyond * (Step(beyond) - Step(-beyond))
    direction = p.let(1 - 2 * Step(-slip))
    y, length = p.let(direction * Y), p.let(direction * slip)
    unloading = p.let(y * Step(-y))  # y where it is negative, less the slip of the first part
    start, left = p.let(y - unloading), p.let(length + unloading)
    above = p.let(1 + start)
    below = p.let((1 - start) * p.let(Decay(p.let(2 * left))))  # 0 at y = 1: saturated friction stays so
    total = p.let(above + below)
    end = p.let(Select(left, p.let((above - below) / total), p.let(y + length)))
    growth = p.let(left + p.let(Select(left, sp.log(total / 2), 0)))
    lost = p.let(growth - p.let(end**2 - start**2) / 2)
    return p.let(direction * end), Select(left, lost, 0)


def friction_after_slip(b: Blocks, law: str) -> Program:
    """Friction at the end of a step: Y, and the force over -mu N, Y + T dY/dt, of the sheared contact."""
    p = Program("friction_after_slip", "friction after the slip of a step, (3.18) integrated in closed form")
    par: Symbols = p.read(b.surface_parameters, "par")
    step: Symbols = p.read(b.slip, "s")
    local: Symbols = p.read(b.contact_frame, "loc", active=("dw",))
    per_turn = p.let(-par["sign"] * par["R"] / par["dy"])  # (3.19); in the plane the contact position does not enter
    rate = p.let(per_turn * local["dw"][1])
    Y, _ = _after_slip(p, is_plastic(law), step["Y"], p.let(step["beta"] * rate + per_turn * step["turn"]))
    sheared = p.let(par["td"] * rate)
    if is_plastic(law):
        g = Clamp(p.let(Y + sheared))
    else:
        g = Y + sheared * p.let(1 - Step(p.let(Y * rate)) * p.let(Y**2))  # (3.18)
    p.write(b.friction_end, {"Y": Y, "g": g}, tangents=True, columns="1")
    return p


def slip_work(b: Blocks, law: str) -> Program:
    """Work of friction over a step, with the mean normal force."""
    p = Program("slip_work", "work that friction stores and dissipates over the slip of a step")
    par: Symbols = p.read(b.surface_parameters, "par")
    step: Symbols = p.read(b.slip, "s")
    end: Symbols = p.read(b.slip_end, "e")
    per_turn = p.let(-par["sign"] * par["R"] / par["dy"])
    _, lost = _after_slip(p, is_plastic(law), step["Y"], p.let(per_turn * step["turn"]))
    size = p.let(p.let(end["N"] * par["mu"]) * par["dy"])
    stored = p.let(end["Y"] ** 2 - step["Y"] ** 2) / 2
    p.write(b.slip_work, {"stored": size * stored, "lost": size * p.let(lost)})
    return p


COVER_TRANSITION = sp.Rational(1, 10)
"""Half-width of the transition, in (x/reach)^2 about 1, over which the patch uncovers the centre of the surface: x is
within 5 % of `reach`."""

TILT_FIELD = Field("tilt", "-", "cosine of the angle between the axes of the two bodies")


def with_fields(block: Block, fields: list[Field], before: str | None = None) -> Block:
    """The block with more scalar fields, at its end or before the field named `before`."""
    at = len(block.fields) if before is None else [f.name for f in block.fields].index(before)
    more: dict[str, tuple[str | sp.Expr, ...]] = {f.name: (f.name,) for f in fields}
    return Block(block.name, (*block.fields[:at], *fields, *block.fields[at:]), {**block.quantities, **more})


def add_law_fields(b: Blocks, law: Law | None) -> Blocks:
    """The blocks with the fields that a friction law needs; unchanged for constant friction (None)."""
    if law is None:
        return b
    contact = with_fields(b.contact, [Field("mu", "-", "friction coefficient by its law")], before="N")
    slopes = [Field(f"law_{f.name}", "-", f"d mu/d{f.name} at constant N and slip") for f in b.friction.fields]
    contact = with_fields(contact, slopes)
    b = replace(
        b,
        coefficient=with_fields(
            Block("coefficient", (), {}), [Field("mu", "-", "friction coefficient, solved for with Y and Z")]
        ),
        contact=contact,
    )
    return b if law.memory is None else _add_memory_fields(b, law.memory)


def _add_memory_fields(b: Blocks, memory: Memory) -> Blocks:
    """The blocks with the fields of what a surface remembers."""
    gain = f"({memory.unit})/({memory.source_unit})"
    fields = [
        Field("past", memory.unit, f"{memory.meaning}: less its start and what the source of this stage contributes"),
        Field("gain", gain, "what it contributes, per unit; 0 where it is given", fixed=True),
    ]
    source = Field("source", memory.source_unit, f"{memory.source}: source of the {memory.meaning}")
    results = [source, Field("memory", memory.unit, memory.meaning), Field("law_mu", "-", "d mu/d mu likewise")]
    if memory.where_covered:
        b = replace(
            b, contact_frame=with_fields(b.contact_frame, [TILT_FIELD]), relative=with_fields(b.relative, [TILT_FIELD])
        )
    part = Field("m", memory.unit, f"a part of the {memory.meaning}")
    own = {
        "memory_part": [Field("rate", "1/s", "of a part"), Field("weight", "-", "of the source in a part")],
        "memory": [part],
        "memory_end": [part, Field("d", f"{memory.unit}/s", "its rate")],
        "memory_past": fields[:1],
        "memory_gain": fields[1:],
        "diagonal": [Field("beta", "s", "diagonal entry of the stage formula; 0 outside of a step", fixed=True)],
    }
    return replace(
        b,
        **{name: with_fields(Block(name, (), {}), of) for name, of in own.items()},
        friction_previous=with_fields(b.friction_previous, fields),
        friction_stage=with_fields(b.friction_stage, fields),
        contact=with_fields(b.contact, results),
        report_contact=with_fields(b.report_contact, [source]),
    )


@dataclass(frozen=True)
class _Part:
    """A part of a memory in its stage formula: rate, weight, diagonal entry beta, and 1 + beta rate."""

    rate: sp.Expr
    weight: sp.Expr
    beta: sp.Expr
    divisor: sp.Expr


def _part(p: Program, b: Blocks, memory: Memory) -> _Part:
    """Inputs of the programs of a part."""
    assert b.memory_part is not None and b.diagonal is not None
    part: Symbols = p.read(b.memory_part, "k")
    par: Symbols = p.read(b.surface_parameters, "par")
    beta = p.read(b.diagonal, "h")["beta"]
    rate = p.let(par[memory.pace] * part["rate"]) if memory.pace else part["rate"]
    return _Part(rate, part["weight"], beta, p.let(1 + p.let(beta * rate)))


def memory_past(b: Blocks, memory: Memory) -> Program:
    """What the earlier stages contribute to a memory by one of its parts, by the formula of `memory_stage`."""
    p = Program("memory_past", f"{memory.meaning}: what the earlier stages contribute by a part")
    part = _part(p, b, memory)
    assert b.memory is not None and b.memory_past is not None
    before: Symbols = p.read(b.memory, "m")
    p.write(b.memory_past, {"past": before["m"] / part.divisor})
    return p


def memory_gain(b: Blocks, memory: Memory) -> Program:
    """What the source of a stage contributes to a memory by one of its parts, per unit."""
    p = Program("memory_gain", f"{memory.meaning}: what the source of a stage contributes by a part, per unit")
    part = _part(p, b, memory)
    assert b.memory_gain is not None
    p.write(b.memory_gain, {"gain": p.let(part.beta * part.weight) / part.divisor})
    return p


def memory_stage(b: Blocks, memory: Memory) -> Program:
    """A part of a memory at the end of a stage, and its rate, d(part)/dt = weight source - rate part.

    The stage formula, part = before + beta d(part)/dt, is linear in the part and is solved for it (docs/friction.md).
    """
    p = Program("memory_stage", f"{memory.meaning}: a part at the end of a stage, and its rate")
    part = _part(p, b, memory)
    assert b.memory is not None and b.memory_end is not None
    before: Symbols = p.read(b.memory, "m")
    contact: Symbols = p.read(b.contact, "c")
    supplied = p.let(p.let(part.beta * part.weight) * contact["source"])
    m = p.let(p.let(before["m"] + supplied) / part.divisor)
    p.write(b.memory_end, {"m": m, "d": p.let(part.weight * contact["source"]) - p.let(part.rate * m)})
    return p


def memory_programs(b: Blocks, memory: Memory) -> list[Program]:
    """The programs of what a surface remembers."""
    return [memory_past(b, memory), memory_gain(b, memory), memory_stage(b, memory)]


def read_unknown_coefficient(p: Program, b: Blocks, law: Law | None, par: Symbols) -> Symbols:
    """Parameters of a surface for `contact`: with a law, mu is the unknown coefficient instead of the given one.

    The symbols of the block `coefficient` are added under the key "law".
    """
    if law is None:
        return par
    assert b.coefficient is not None
    c: Symbols = p.read(b.coefficient, "c", active=("mu",))
    return {**par, "mu": c["mu"], "law": c}


def law_results(
    p: Program,
    law: Law | None,
    par: Symbols,
    unknown: Symbols,
    stage: Symbols,
    loc: Symbols,
    N: sp.Expr,
    f: Symbols,
    g: Symbols,
    slip: Symbols,
) -> tuple[Symbols, Symbols]:
    """Results that a law adds to `contact`, and derivatives among them; empty for constant friction.

    They are mu by the law, with a memory its source and its value; and the derivatives of mu with respect to the
    friction force over -mu N at constant N and slip velocity, with a memory to the unknown mu too.

    Args:
        p: program of the contact.
        law: friction law.
        par: symbols of the surface parameters.
        unknown: the result of `read_unknown_coefficient`.
        stage: symbols of the block `friction_stage`.
        loc: symbols of the block `contact_frame`.
        N: normal force.
        f: friction state, which follows from g.
        g: symbols of the friction force over -mu N.
        slip: slip velocity with the velocity of plastic slip, of `contact.slip`.
    """
    if law is None:
        return {}, {}
    c = unknown["law"]
    variables = law_variables(p, law, par, N, slip["plastic"])
    results: Symbols = {}
    slopes: Symbols = {}
    memory = law.memory
    if memory:
        share = source_of(p, memory, par, variables, loc)
        results["source"] = p.let(c["mu"] * share, "source") if memory.by_friction else share
        value = start_of(memory, par) + stage["past"] + stage["gain"] * results["source"]
        variables[memory.variable] = results["memory"] = p.let(value, memory.variable)
    mu = results["mu"] = coefficient(p, law, par, variables)
    if memory:
        slopes["law_mu"] = p.partial(mu, c["mu"], dict.fromkeys((N, slip["u"], slip["v"]), sp.Integer(0)))
    slope = p.let(p.partial(mu, slip["plastic"]) * p.partial(f["Y"], g["Y"]))
    slopes |= {f"law_{name}": p.let(slope * p.partial(slip["plastic"], f[name])) for name in ("Y", "Z")}
    return results, slopes


def evaluate_law(
    p: Program, b: Blocks, law: Law | None, par: Symbols, loc: Symbols, N: sp.Expr, slip: Symbols
) -> tuple[Symbols, Symbols]:
    """The law at given N and slip velocity, for `report_contact`; arguments as of `law_results`.

    Returns the surface parameters with mu by the law, and the results that the law adds.
    """
    if law is None:
        return par, {}
    variables = law_variables(p, law, par, N, slip["plastic"])
    memory = law.memory
    if memory is None:
        return {**par, "mu": coefficient(p, law, par, variables)}, {}
    stage: Symbols = p.read(b.friction_stage, "h")
    value = p.let(start_of(memory, par) + stage["past"], memory.variable)
    mu = coefficient(p, law, par, {**variables, memory.variable: value})
    source = source_of(p, memory, par, variables, loc)
    return {**par, "mu": mu}, {"source": mu * source if memory.by_friction else source}


def law_variables(p: Program, law: Law, par: Symbols, N: sp.Expr, velocity: sp.Expr) -> Symbols:
    """Variables of a friction law but its memory: normal force, sliding velocity and, if needed, pressure."""
    pressure = {"p": p.let(N / par["area"], "pressure")} if law.needs_pressure else {}
    return {"N": N, "v": velocity, **pressure}


def coefficient(p: Program, law: Law, par: Symbols, variables: Symbols) -> sp.Expr:
    """Friction coefficient by the formula of the law; every operation becomes a statement."""
    return p.let(fold(law.tree, {**par, **variables}, operations(p)), "mu")


def drilling_moment(p: Program, resistance: Spin, par: Symbols, N: sp.Expr, rate: sp.Expr) -> sp.Expr:
    """Moment that resists spin at this rate, about the contact normal [N m]."""
    return p.let(fold(resistance.tree, {**par, "r": par["rs"], "N": N, "w": rate}, operations(p)), "drilling")


def start_of(memory: Memory, par: Symbols) -> sp.Expr:
    """Value of a memory at the start [unit of the memory]."""
    return par[memory.start] if memory.start else sp.Integer(0)


def source_of(p: Program, memory: Memory, par: Symbols, variables: Symbols, loc: Symbols) -> sp.Expr:
    """Source of a memory, over the friction coefficient where it is proportional to that too."""
    products: Operations = {**operations(p), "mul": lambda a, b: a * b}
    source = fold(memory.tree, {**par, **variables}, products)
    return p.let(source * cover(p, par, loc) if memory.where_covered else source, "share")


def cover(p: Program, par: Symbols, loc: Symbols) -> sp.Expr:
    """1 where the contact patch covers the centre of the surface, 0 elsewhere.

    The temperature of a surface is that at its centre. The patch is R sin(tilt) away from there; the transition between
    covered and uncovered is a cubic over `COVER_TRANSITION`.
    """
    distance = p.let((par["R"] / par["reach"]) ** 2 * (1 - loc["tilt"] ** 2))  # squared, over the square of the reach
    z = p.let((1 - distance) / COVER_TRANSITION)
    partly, fully = p.let(Step(z + 1)), p.let(Step(z - 1))
    return p.let(fully + (partly - fully) * (2 + z * (3 - z**2)) / 4, "cover")


def operations(p: Program) -> dict[str, Callable[..., sp.Expr]]:
    """Operations for `fold` that write every result as a statement of the program."""

    def pow_(base: sp.Expr, exponent: sp.Expr) -> sp.Expr:
        return p.let(base ** (sp.Integer(exponent) if exponent == int(exponent) else exponent))

    def minimum(a: sp.Expr, b: sp.Expr) -> sp.Expr:
        return p.let(b + (a - b) * Step(b - a))

    return {
        "number": lambda value: sp.Float(value),
        "neg": lambda a: p.let(-a),
        "pow": pow_,
        "power": lambda base, exponent: p.let(sp.exp(p.let(p.let(sp.log(base)) * exponent))),
        "add": lambda a, b: p.let(a + b),
        "sub": lambda a, b: p.let(a - b),
        "mul": lambda a, b: p.let(a * b),
        "div": lambda a, b: p.let(a / b),
        "exp": lambda a: p.let(sp.exp(a)),
        "log": lambda a: p.let(sp.log(a)),
        "sqrt": lambda a: p.let(sp.sqrt(a)),
        "tanh": lambda a: p.let(sp.tanh(a)),
        "Abs": lambda a: p.let(Modulus(a)),
        "Min": minimum,
        "Max": lambda a, b: p.let(-minimum(-a, -b)),
    }
