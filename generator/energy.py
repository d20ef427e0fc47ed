"""Programs of the energy balance: energies of springs, and the powers whose integrals are the works of a run.

Energies are relative to the frame that translates with the base (docs/model.md, choice 9).
"""

from __future__ import annotations

import sympy as sp

from .blocks import Blocks
from .functions import Step
from .laws import yield_displacement
from .program import Program, Symbols, cross, dot, subtract


def friction_power(b: Blocks, uplift: bool) -> Program:
    """Powers of friction at one surface.

    Friction stores mu N d_y |f|^2/2; a sheared contact with the damping time T dissipates mu N d_y T |df/dt|^2; plastic
    slip and the drilling moment dissipate the rest. f: (Y, Z).
    """
    p = Program("friction_power", "powers of friction at one surface")
    par: Symbols = p.read(b.surface_parameters, "par")
    c: Symbols = p.read(b.contact, "c")
    limit = p.let((c if "mu" in c else par)["mu"] * c["N"], "limit")  # a friction law gives mu with the contact
    depth, T = p.let(limit * yield_displacement(p, uplift, par, c["N"]), "depth"), par["td"]
    stored, damped, all_work = sp.Integer(0), sp.Integer(0), sp.Integer(0)
    for f, rate, slip in ((c["Y"], c["dY"], c["u"]), (c["Z"], c["dZ"], c["v"])):
        stored += p.let(depth * f * rate)
        damped += p.let(depth * T * rate**2)
        all_work += p.let(limit * (f + T * rate) * slip)
    stored, damped = p.let(stored), p.let(damped)
    p.write(
        b.friction_power,
        {"stored": stored, "damped": damped, "lost": all_work - stored - damped - c["drill"]},
    )
    return p


def rim_energy(b: Blocks) -> Program:
    """Energy of the spring of a closed rim, and power that its damper dissipates.

    The gap is measured at R (3.20), the force acts at R - p from the sphere centre (3.25), hence the ratio of lever
    arms. Where the damper would pull, the rim exerts no force and the damper dissipates what the spring releases.
    """
    p = Program("rim_energy", "energy stored in a closed rim, and power dissipated there")
    par: Symbols = p.read(b.surface_parameters, "par")
    rim: Symbols = p.read(b.rim_motion, "rim")
    lever = p.let(1 - par["pr"] / par["R"], "lever")
    spring, damper = p.let(par["kc"] * rim["g"], "spring"), p.let(par["cc"] * rim["dg"], "damper")
    pushes = p.let(Step(-spring - damper), "pushes")  # (3.23) clamped: docs/model.md, choice 4
    lost = (pushes * damper - (1 - pushes) * spring) * rim["dg"] * lever
    p.write(b.rim_energy, {"stored": spring * rim["g"] * lever / 2, "lost": lost})
    return p


def _read_top(p: Program, b: Blocks, rotating_support: bool) -> tuple[Symbols, Symbols, Symbols, Symbols]:
    """Inputs of the programs of the top: parameters, plate, foot, and axis and angular velocity of the support."""
    par: Symbols = p.read(b.top_parameters, "par")
    body: Symbols = p.read(b.body, "b")
    foot: Symbols = p.read(b.foot, "f")
    zero = sp.Integer(0)
    fixed: Symbols = {"e": (zero, zero, sp.Integer(1)), "w": (zero, zero, zero)}
    support: Symbols = p.read(b.upright, "u") if rotating_support else fixed
    return par, body, foot, support


def restraint(b: Blocks, rotating_support: bool) -> Program:
    """Energy of the springs of the top, and the compression of the vertical one."""
    p = Program("restraint", "energy of the springs of the top; compression of the vertical spring")
    par, body, foot, support = _read_top(p, b, rotating_support)
    x, y, _ = subtract(body["C"], par["x0"])
    settlement = p.let(body["C"][2] - foot["y"])
    tilted = subtract(body["t3"], support["e"])
    lean = p.let(dot(tilted, tilted) / 2)  # 1 - t_3 . e, without cancellation at small tilt
    stored = par["k"] * (x**2 + y**2) / 2 + par["kr"] * lean + par["kv"] * settlement**2 / 2
    p.write(b.restraint, {"stored": stored, "settlement": par["sr"] * settlement})
    return p


def top_power(b: Blocks, rotating_support: bool) -> Program:
    """Powers of the load on the top plate, of its supports, and of its dampers."""
    p = Program("top_power", "powers of load, moving supports, spin and dampers at the top plate")
    par, body, foot, support = _read_top(p, b, rotating_support)
    coordinates: Symbols = p.read(b.coordinates, "x")
    base: Symbols = p.read(b.base_motion, "base")
    force: Symbols = p.read(b.force, "fe")
    moment: Symbols = p.read(b.moment, "me")
    C, V, U, wp = body["C"], body["V"], base["U"], body["wp"]
    load = p.let(dot(force["F"], subtract(V, U)) + dot(moment["M"], wp))
    rig = sum(((par["k"] * (C[i] - par["x0"][i]) + par["c"] * V[i]) * U[i] for i in (0, 1)), sp.Integer(0))
    sinking = p.let(V[2] - foot["y1"])
    vertical = p.let(par["kv"] * (C[2] - foot["y"]) + par["cv"] * sinking)
    fixed = p.let(1 - Step(par["m"] - par["mz"]))  # the vertical spring of a rig has a fixed end, that below a mass not
    turning = p.let_vector(subtract(wp, support["w"]), "turning")
    spin = p.let(-par["kr"] * coordinates["phi"] * dot(body["t3"], wp))
    tilting = cross(support["e"], body["t3"])
    held = [par["kr"] * tilting[i] + par["cr"] * turning[i] for i in range(3)]
    damped = par["c"] * (V[0] ** 2 + V[1] ** 2) + par["cr"] * dot(turning, turning) + par["cv"] * sinking**2
    p.write(
        b.top_power,
        {
            "load": load,
            "prescribed": p.let(rig) + fixed * vertical * U[2],
            "support": spin - p.let(dot((held[0], held[1], held[2]), support["w"])),
            "damped": damped,
        },
    )
    return p


def base_power(b: Blocks) -> Program:
    """Power of a rotating base, relative to the frame that translates with it."""
    p = Program("base_power", "power of a rotating base")
    body: Symbols = p.read(b.body, "b")
    base: Symbols = p.read(b.base_motion, "base")
    force: Symbols = p.read(b.force, "f")
    moment: Symbols = p.read(b.moment, "m")
    power = dot(force["F"], subtract(body["V"], base["U"])) + dot(moment["M"], body["wp"])
    p.write(b.power, {"power": power})
    return p


def lock_power(b: Blocks) -> Program:
    """Power of the moment that locks the spin of a body.

    With locked spin a body still rotates about its axis, by psi' sin(theta): the moment does work of the order of the
    tilt squared.
    """
    p = Program("lock_power", "power of the moment that locks the spin of a body")
    body: Symbols = p.read(b.body, "b")
    lock: Symbols = p.read(b.lock, "l")
    p.write(b.power, {"power": lock["moment"] * dot(body["t3"], body["wp"])})
    return p


def rim_motion(b: Blocks) -> Program:
    """Gap of a rim and its rate, whether it pushes or not."""
    p = Program("rim_motion", "gap of a rim and its rate")
    rim: Symbols = p.read(b.rim, "rim")
    p.write(b.rim_motion, {"g": rim["g"], "dg": rim["dg"]})
    return p


def unilateral_energy(b: Blocks) -> Program:
    """Elastic energy of a unilateral contact, and power that it dissipates."""
    p = Program("unilateral_energy", "energy of a unilateral contact, and power dissipated there")
    contact: Symbols = p.read(b.unilateral, "c")
    p.write(b.unilateral_energy, {"stored": contact["stored"], "lost": contact["lost"]})
    return p


def works(b: Blocks, rims: bool, uplift: bool) -> Program:
    """The powers whose integrals are the works of a run, from those of bodies, surfaces and top."""
    p = Program("works", "powers whose integrals are the works of a run")
    energy: Symbols = p.read(b.energy, "e")
    top: Symbols = p.read(b.top_power, "t")
    base: Symbols = p.read(b.power, "base")
    lock: Symbols = p.read(b.power, "lock")
    friction: Symbols = p.read(b.friction_power, "f")
    rim: Symbols = p.read(b.rim_energy, "rim") if rims else {"lost": sp.Integer(0)}
    unilateral: Symbols = p.read(b.unilateral_energy, "unilateral") if uplift else {"lost": sp.Integer(0)}
    prescribed = p.let(top["prescribed"] + base["power"])
    p.write(
        b.works,
        {
            "input": p.let(energy["power"] + top["load"]) + top["support"] + prescribed + lock["power"],
            "friction_stored": friction["stored"],
            "friction_dissipated": friction["lost"],
            "contact_dissipated": friction["damped"],
            "rim_dissipated": rim["lost"],
            "top_dissipated": top["damped"],
            "seat_dissipated": unilateral["lost"],
            "prescribed": prescribed,
            "load": top["load"],
        },
    )
    return p


def tilt(b: Blocks) -> Program:
    """Tilt of a body relative to the body below, in the plane; their sum is the tilt of the top plate."""
    p = Program("tilt", "tilt of a body relative to the body below")
    x: Symbols = p.read(b.coordinates, "x")
    p.write(b.tilt, {"theta": x["theta"]})
    return p


def load_end(b: Blocks) -> Program:
    """Load on the top plate, and its displacement and tilt, at one end of a quasi-static step."""
    p = Program("load_end", "load on the top plate, with displacement and tilt, at one end of a step")
    force: Symbols = p.read(b.force, "fe")
    moment: Symbols = p.read(b.moment, "me")
    body: Symbols = p.read(b.body, "b")
    base: Symbols = p.read(b.base_motion, "base")
    turned: Symbols = p.read(b.tilt, "t")
    d = subtract(body["C"], base["O"])
    p.write(b.load_end, {"F": force["F"], "M": moment["M"], "d": d, "tilt": turned["theta"]})
    return p


def load_work(b: Blocks) -> Program:
    """Work of the load over a quasi-static step, from its displacement: by the trapezoidal rule, in the plane."""
    p = Program("load_work", "work of the load over a step")
    a: Symbols = p.read(b.load_end, "a")
    e: Symbols = p.read(b.load_end, "e")
    pairs = [(a["F"][i] + e["F"][i], e["d"][i] - a["d"][i]) for i in (0, 2)]
    work = sp.Integer(0)
    for load, way in (*pairs, (a["M"][1] + e["M"][1], e["tilt"] - a["tilt"])):
        work = p.let(work + p.let(p.let(load) * p.let(way) / 2))
    p.write(b.load_work, {"work": work})
    return p


def programs(b: Blocks, rims: bool, uplift: bool, rotating_support: bool) -> list[Program]:
    """All programs of the energy balance but the energies of masses."""
    return [
        friction_power(b, uplift),
        *([rim_motion(b), rim_energy(b)] if rims else []),
        *([unilateral_energy(b)] if uplift else []),
        works(b, rims, uplift),
        restraint(b, rotating_support),
        top_power(b, rotating_support),
        base_power(b),
        lock_power(b),
    ]
