"""Laws of the friction coefficient: what a law adds to the blocks of a model and to the programs of one surface.

A law makes the coefficient mu of the contact one more local unknown beside Y and Z, because the normal force, the slip
and the temperature that decide it depend on mu in turn: in `contact` its law is one more row to be solved. At given
psi~, theta~ and N, in `report_contact`, mu follows in one line. With constant friction nothing here is called.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import sympy as sp

from msfp_gen.law_text import fold

from .blocks import Blocks
from .friction_laws import NUMBERS, Law
from .functions import Modulus, Step
from .program import Block, Field, Program

Symbols = dict[str, Any]
Sliding = tuple[sp.Expr, sp.Expr, sp.Expr]
EDGE = sp.Rational(1, 10)
"""The patch leaves the centre while (x/reach)^2 goes from 1 - EDGE to 1 + EDGE: 5 % of the way on either side."""

UNKNOWN = [
    Field("mu", "-", "friction coefficient, solved for with Y and Z"),
    Field("rise", "K", "temperature above the start, less what the flux of this stage adds"),
    Field("warming", "s^1/2", "what it adds, per unit of flux; 0 where the temperature is given"),
]
FLUX = Field("flux", "K/s^1/2", "sqrt(D/pi)/k times the heat flux mu p v where the patch covers the centre")


def extended(block: Block, fields: list[Field], before: str | None = None) -> Block:
    """A block with more scalars, at its end or before one of its fields."""
    at = len(block.fields) if before is None else [f.name for f in block.fields].index(before)
    more: dict[str, tuple[str | sp.Expr, ...]] = {f.name: (f.name,) for f in fields}
    return Block(block.name, (*block.fields[:at], *fields, *block.fields[at:]), {**block.quantities, **more})


def with_law(b: Blocks, law: Law | None) -> Blocks:
    """The blocks of a model whose friction coefficient follows a law."""
    if law is None:
        return b
    contact = extended(b.contact, [Field("mu", "-", "friction coefficient by its law")], before="N")
    slopes = [Field(f"law_{f.name}", "-", f"d mu/d{f.name} at constant N and slip") for f in b.friction.fields]
    contact = extended(contact, slopes)
    b = replace(
        b,
        surface_parameters=extended(b.surface_parameters, [Field(name, *NUMBERS[name]) for name in law.columns]),
        coefficient=extended(Block("coefficient", (), {}), UNKNOWN if law.heats else UNKNOWN[:1]),
        contact=contact,
    )
    if not law.heats:
        return b
    heat = [FLUX, Field("T", "degC", "temperature at the centre"), Field("law_mu", "-", "d mu/d mu likewise")]
    return replace(
        b,
        local=extended(b.local, [Field("tilt", "-", "cosine of the angle between the axes of the two bodies")]),
        contact=extended(contact, heat),
        report_contact=extended(b.report_contact, [FLUX]),
    )


def unknown(p: Program, b: Blocks, law: Law | None, par: Symbols) -> Symbols:
    """The parameters of a surface with the unknown mu in the place of the given one; the unknowns under `law`."""
    if law is None:
        return par
    assert b.coefficient is not None
    c: Symbols = p.read(b.coefficient, "c", active=("mu",))
    return {**par, "mu": c["mu"], "law": c}


def lawful(p: Program, law: Law | None, par: Symbols, given: Symbols, loc: Symbols, N: sp.Expr, f: Symbols,
           slip: Symbols) -> Symbols:  # fmt: skip
    """What the law adds to the results of `contact`: its mu, and with heat the flux, the temperature and d mu/d mu."""
    if law is None:
        return {}
    c, motion = given["law"], sliding(p, f, slip)
    feels = surroundings(p, law, par, N, motion)
    more: Symbols = {}
    if law.heats:
        share = heat_share(p, par, feels, loc)
        more["flux"] = p.let(c["mu"] * share, "flux")
        feels["T"] = more["T"] = p.let(par["start_temperature"] + c["rise"] + c["warming"] * more["flux"], "T")
    mu = more["mu"] = coefficient(p, law, par, feels)
    if law.heats:
        more["law_mu"] = p.let(by(p, mu, feels["T"]) * c["warming"] * share)
    slope, (square, along, slides) = by(p, mu, feels["v"]), motion
    for name, velocity in (("Y", slip["u"]), ("Z", slip["v"])):
        if f[name] != 0:
            more[f"law_{name}"] = p.let(slope * slides * (2 * f[name] * along + square * velocity))
    return more


def stated(p: Program, b: Blocks, law: Law | None, par: Symbols, loc: Symbols, N: sp.Expr, f: Symbols,
           slip: Symbols) -> tuple[Symbols, Symbols]:  # fmt: skip
    """The same at given N and slip: the parameters with mu by its law, and what that adds to `report_contact`."""
    if law is None:
        return par, {}
    assert b.coefficient is not None
    c: Symbols = p.read(b.coefficient, "c", active=False)
    feels = surroundings(p, law, par, N, sliding(p, f, slip))
    if not law.heats:
        return {**par, "mu": coefficient(p, law, par, feels)}, {}
    mu = coefficient(p, law, par, {**feels, "T": p.let(par["start_temperature"] + c["rise"], "T")})
    return {**par, "mu": mu}, {"flux": mu * heat_share(p, par, feels, loc)}


def surroundings(p: Program, law: Law, par: Symbols, N: sp.Expr, motion: Sliding) -> Symbols:
    """Sliding velocity, normal force and pressure that a law may depend on."""
    speed = p.let(sp.Mul(*motion), "speed")
    pressure = {"p": p.let(N / par["area"], "pressure")} if "patch_radius" in law.takes else {}
    return {"N": N, "v": speed, **pressure}


def sliding(p: Program, f: Symbols, slip: Symbols) -> Sliding:
    """Y^2 + Z^2, Y u + Z v and whether that is positive. Their product is the sliding velocity: the slip less what Y, Z
    give back, by the isotropic law; in steady sliding |slip| itself.

    With |slip| friction would grow against its own direction where a surface unloads, and push: light sliders would run
    away. So it would with the switches per axis, across the slip.
    """
    along = p.let(f["Y"] * slip["u"] + f["Z"] * slip["v"])
    return p.let(f["Y"] ** 2 + f["Z"] ** 2), along, p.let(Step(along))


def coefficient(p: Program, law: Law, par: Symbols, feels: Symbols) -> sp.Expr:
    """Mu by the formula of the law, every step of it named."""
    return p.let(fold(law.tree, {**par, **feels}, operations(p)), "mu")


def heat_share(p: Program, par: Symbols, feels: Symbols, loc: Symbols) -> sp.Expr:
    """The flux over mu: p v sqrt(D/pi)/k while the patch covers the centre of the surface, which is where the
    temperature is. The distance of its own centre is R sin of the tilt.
    """
    away = p.let((par["R"] / par["reach"]) ** 2 * (1 - loc["tilt"] ** 2))
    z = p.let((1 - away) / EDGE)
    inside, within = p.let(Step(z + 1)), p.let(Step(z - 1))
    cover = p.let(within + (inside - within) * (2 + z * (3 - z**2)) / 4, "cover")
    return p.let(par["heating"] * cover * feels["p"] * feels["v"], "share")


def by(p: Program, value: sp.Expr, symbol: sp.Symbol) -> sp.Expr:
    """Derivative of a named value by one symbol, all else it is made of being constant."""
    kept, p.rates = p.rates, {symbol: sp.Integer(1)}
    slope = p.rate(value)
    p.rates = kept
    return slope


def operations(p: Program) -> dict[str, Callable[..., sp.Expr]]:
    """What the parts of a formula mean for the generator: every result gets a name."""

    def pow_(base: sp.Expr, exponent: sp.Expr) -> sp.Expr:
        return p.let(base ** (sp.Integer(exponent) if exponent == int(exponent) else exponent))

    def least(a: sp.Expr, b: sp.Expr) -> sp.Expr:
        return p.let(b + (a - b) * Step(b - a))

    return {
        "number": lambda value: sp.Float(value), "neg": lambda a: p.let(-a), "pow": pow_,
        "power": lambda base, exponent: p.let(sp.exp(p.let(p.let(sp.log(base)) * exponent))),
        "add": lambda a, b: p.let(a + b), "sub": lambda a, b: p.let(a - b),
        "mul": lambda a, b: p.let(a * b), "div": lambda a, b: p.let(a / b),
        "exp": lambda a: p.let(sp.exp(a)), "log": lambda a: p.let(sp.log(a)), "sqrt": lambda a: p.let(sp.sqrt(a)),
        "tanh": lambda a: p.let(sp.tanh(a)), "Abs": lambda a: p.let(Modulus(a)),
        "Min": least, "Max": lambda a, b: p.let(-least(-a, -b)),
    }  # fmt: skip
