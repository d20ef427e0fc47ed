"""Schedules: which program runs over which bodies and surfaces, from which blocks to which.

A program (`derive.py`) describes one body or one surface. A schedule states, as data (`places.py`), how the programs of
a stack follow each other in one evaluation. `drivers.py` prints the C that calls them in up to four forms: the values;
derivatives with respect to the variables of a step; derivatives by the motion of the ends of a two-port; and, in models
with gradients, derivatives with respect to parameters (`directions.py`).
"""

from __future__ import annotations

from collections.abc import Mapping

from msfp_gen.specification.layout import Effects, ModelSpec

from .places import Call, If, Over, Pass, Schedule, Solve, Values, When

VARIABLES: Mapping[str, tuple[tuple[str, tuple[str, ...]], ...]] = {
    "coordinate": (
        ("x", tuple(f"{name}{order}" for order in ("", 1, 2) for name in ("psi", "theta", "phi"))),
        ("x", ("d", "d1", "d2")),
    ),
    "contact": (("unknowns", ("psi", "theta", "N")),),
    "friction": (("friction", ("Y", "Z")),),
    "base": (("frame", ("C", "V", "A")),),
    "load": (("load_force", ("F",)), ("load_moment", ("M",))),
}
"""The inputs with respect to which a schedule is differentiated, by their kind in `msfp.h`: list and quantities.

A block without uplift has no separation d.
"""


def unknowns(spec: ModelSpec) -> list[tuple[str, int, int]]:
    """The unknowns (2.119) in order, as (kind, index, field) of `VARIABLES`: accelerations, contact positions, N.

    With uplift the accelerations of a body are followed by those of the separation below it.
    """
    surfaces, planar = range(spec.layout.surfaces), spec.effects.dimension == "planar"
    angles, positions = ((1,), (1,)) if planar else ((0, 1, 2), (0, 1))
    separations = () if not spec.effects.uplift else (0, 2) if planar else (0, 1, 2)
    accelerations = (*(6 + i for i in angles), *(15 + i for i in separations))
    return [
        *(("coordinate", j + 1, field) for j in surfaces for field in accelerations),
        *(("contact", j, i) for j in surfaces for i in positions),
        *(("contact", j, 2) for j in surfaces),
    ]


def _kinematics() -> Schedule:
    """The bodies from the base up."""
    return {
        "base": (Pass(Over.BASE, (Call("forward", ("body_parameters[base]", "frame", "x[base]"), ("body[base]",)),)),),
        "bodies": (Pass(Over.BODIES, (Call("forward", ("body_parameters[k]", "body[k-1]", "x[k]"), ("body[k]",)),)),),
    }


def _top(effects: Effects) -> Pass:
    """Force and moment above the top plate, and the foot of a mass on a vertical spring."""
    support = ("upright",) if effects.top_rotation else ()
    reads = ("top_parameters", "foot_stage", "body[top]", "x[top]", "load_force", "load_moment", *support)
    return Pass(
        Over.TOP,
        (
            Call("top_wrench", reads, ("force[top]", "moment[top]")),
            Call(
                "foot",
                ("top_parameters", "body[top]", "foot_stage"),
                ("foot",),
                Solve(frozenset({"directions", "by_ends"}), frozenset({"directions", "by_ends"}), gives_results=True),
            ),
        ),
    )


def _rim(effects: Effects) -> tuple[Call, ...]:
    """The rim of surface j."""
    if not effects.rims:
        return ()
    coordinates = If({"rim_coordinates": When.RIM_PUSHES})
    rim = If({"rim": When.RIM_PUSHES}, Values.RUNTIME if effects.uplift else Values.RUNTIME_WITH_SLOPES)
    return (
        Call("rim_coordinates", ("body[j]", "x[j+1]"), ("rim_coordinates[j]",), coordinates),
        Call("rim", ("surface_parameters[j]", "rim_coordinates[j]"), ("rim[j]",), rim),
    )


STAGE = Call("contact_stage", ("surface_parameters[j]", "friction_previous[j]"), ("friction_stage[j]",))
"""Constants of the stage formula of friction, and of a memory."""


def momentum_balances(effects: Effects) -> Schedule:
    """The momentum balances (3.26)-(3.29) at given unknowns (2.119), as PEER 2017/07 states them.

    With uplift the unilateral contacts give the forces of the surfaces. Further rows state that the force (3.15)-(3.17)
    of a contact, at given psi~, theta~ and N, is the same.
    """
    memory, uplift = remembers(effects), effects.uplift
    remembered = ("friction_stage[j]",) if memory else ()
    rim = ("rim[j]",) if effects.rims else ()
    above = "below[k]" if uplift else "moment[k]"
    surfaces = Pass(
        Over.SURFACES,
        (
            *_rim(effects),
            *((STAGE,) if memory else ()),
            Call("slip_rotation", ("body[j+1]", "x[j+1]", "x[j]"), ("relative[j]",)),
            Call(
                "report_contact",
                ("surface_parameters[j]", "unknowns[j]", "friction[j]", "relative[j]", *remembered),
                ("report_contact[j]",),
            ),
            Call("report_rates", ("report_contact[j]",), ("report_rates[j]",)),
            Call(
                "report_wrench",
                ("body[j]", "report_contact[j]", *rim),
                ("carried[j]", "joint_moment[j]") if uplift else ("force[j]", "moment[j]"),
            ),
            *(_unilateral(effects.rims) if uplift else ()),
            *((_split(effects.rims), CLOSURE) if uplift else ()),
        ),
    )
    bodies = Pass(
        Over.BODIES,
        (
            Call("linear_balance", ("body_parameters[k]", "body[k]", "force[k-1]", "force[k]"), ("linear[k]",)),
            Call(
                "angular_balance",
                ("body_parameters[k]", "body[k]", "force[k-1]", "moment[k-1]", "force[k]", above),
                ("angular[k]",),
            ),
            Call("balances", ("linear[k]", "angular[k]", "x[k]"), ("balances[k]",)),
        ),
    )
    top = (_top(effects), *((ABOVE,) if uplift else ()))
    return {"balances": (*(one for passes in _kinematics().values() for one in passes), *top, surfaces, bodies)}


ABOVE = Pass(Over.TOP, (Call("wrench_above", ("force[top]", "moment[top]"), ("carried[top]", "below[top]")),))
"""With uplift: what acts above the top plate, which has no separation."""

CLOSURE = Call("contact_excess", ("body[j]", "carried[j]", "force[j]"), ("excess[j]",))
"""With uplift: that both statements of a contact force are one."""


def _split(rims: bool) -> Call:
    """With uplift: the moments of surface j on the bodies above and below."""
    rim = ("rim_wrench[j]",) if rims else ()
    reads = ("surface_parameters[j]", "joint_moment[j]", "unilateral[j]", *rim)
    return Call("split_moment", reads, ("moment[j]", "below[j]"))


def _unilateral(rims: bool) -> tuple[Call, ...]:
    """Force of surface j with uplift, of its unilateral contact and its rim."""
    slider, wrench = "body[slider]", ("rim_wrench[j]",) if rims else ()
    contact = If({"unilateral_edge": When.ON_EDGE, "unilateral_inside": When.ON_FACE}, Values.RUNTIME)
    on_rim = Call("rim_to_world", ("body[j]", "x[j+1]", "rim[j]"), ("rim_wrench[j]",))
    return (
        Call("unilateral_inside", ("surface_parameters[j]", slider, "x[j+1]"), ("unilateral[j]",), contact),
        *((on_rim,) if rims else ()),
        Call("surface_force", ("unilateral[j]", *wrench), ("force[j]",)),
    )


def _uplift(rims: bool) -> tuple[Pass, ...]:
    """Forces of the surfaces with uplift, and the residual of the linear balances."""
    return (
        Pass(Over.SURFACES, _unilateral(rims)),
        ABOVE,
        Pass(
            Over.DOWNWARD,
            (
                Call("interface_force", ("body_parameters[j+1]", "body[j+1]", "carried[j+1]"), ("carried[j]",)),
                Call("excess_force", ("carried[j]", "force[j]"), ("excess[j]",)),
            ),
        ),
    )


def condensed(effects: Effects) -> Schedule:
    """The condensed equations: the angular balances (3.27), (3.29).

    Interface forces (3.26), (3.28) are summed from the top down, and contacts (3.13)-(3.19) are in closed form. With
    uplift the unilateral contacts give the forces; the differences between these and the sums are further rows.
    """
    rim, uplift = ("rim[j]",) if effects.rims else (), effects.uplift
    law = ("coefficient[j]",) if effects.law is not None else ()
    summed = Call("interface_force", ("body_parameters[j+1]", "body[j+1]", "force[j+1]"), ("force[j]",))
    forms, by_ends = frozenset({"tangents", "directions", "by_ends"}), frozenset({"by_ends"})
    contact = Solve(forms, by_ends, gives_results=True, fails=True)
    moments = (
        Call("surface_moment", ("contact[j]", *rim), ("local_moment[j]",)),
        Call("moment_to_world", ("body[j]", "local_moment[j]"), ("joint_moment[j]" if uplift else "moment[j]",)),
        *((_split(effects.rims),) if uplift else ()),
    )
    above = "below[k]" if uplift else "moment[k]"
    balance = ("body_parameters[k]", "body[k]", "force[k-1]", "moment[k-1]", "force[k]", above)
    return {
        **_kinematics(),
        "top": (_top(effects),),
        "forces": (
            *((Pass(Over.SURFACES, _rim(effects)),) if effects.rims else ()),
            *(_uplift(effects.rims) if uplift else (Pass(Over.DOWNWARD, (summed,)),)),
        ),
        "surfaces": (
            Pass(
                Over.SURFACES,
                (
                    Call(
                        "surface_local",
                        ("body[j]", "body[j+1]", "x[j+1]", "x[j]", "force[j]", *rim),
                        ("contact_frame[j]",),
                    ),
                    STAGE,
                ),
            ),
            Pass(
                Over.TOGETHER,
                (
                    Call(
                        "contact",
                        ("surface_parameters[j]", "friction_stage[j]", "contact_frame[j]", "friction_force[j]", *law),
                        ("contact[j]",),
                        contact,
                    ),
                ),
            ),
        ),
        "moments": (
            Pass(Over.SURFACES, moments),
            Pass(Over.BODIES, (Call("angular_balance", balance, ("angular[k]",)),)),
        ),
    }


def results() -> Schedule:
    """What a run takes of the surfaces after an evaluation of the condensed equations."""
    return {"results": (Pass(Over.SURFACES, (Call("surface_results", ("contact[j]",), ("surface_results[j]",)),)),)}


def memories(form: str) -> Schedule:
    """What surfaces remember, part by part: the runtime calls it before and after evaluations, with its derivatives."""
    by = Solve(frozenset({form}), frozenset({form}))
    part = ("memory_part", "surface_parameters[j]", "diagonal")
    calls = (
        Call("memory_past", (*part, "memory"), ("memory_past",), by),
        Call("memory_gain", part, ("memory_gain",), by),
        Call("memory_stage", (*part, "memory", "contact[j]"), ("memory_end",), by),
    )
    return {"memories": (Pass(Over.SURFACES, calls),)}


def remembers(effects: Effects) -> bool:
    """Whether surfaces have a memory."""
    return effects.law is not None and effects.law.memory is not None


def energies(effects: Effects) -> Schedule:
    """Energies of masses and springs, powers whose integrals are the works of a run, ends of quasi-static steps."""
    upright = ("upright",) if effects.top_rotation else ()
    at_rim = (
        Call(
            "rim_motion",
            ("rim[j]",),
            ("rim_motion[j]",),
            Solve(frozenset({"directions"})),
        ),
        Call(
            "rim_energy",
            ("surface_parameters[j]", "rim_motion[j]"),
            ("rim_energy",),
            If({"rim_energy": When.RIM_CLOSED}, Values.HERE),
            adds=True,
        ),
    )
    contacts = (
        *(at_rim if effects.rims else ()),
        *(
            (Call("unilateral_energy", ("unilateral[j]",), ("unilateral_energy",), adds=True),)
            if effects.uplift
            else ()
        ),
    )
    bodies = Call("body_energy", ("body_parameters[k]", "body[k]", "base_motion"), ("energy",), adds=True)
    top = Call("top_energy", ("top_parameters", "body[top]", "base_motion", "foot"), ("energy",), adds=True)
    restraint = Call("restraint", ("top_parameters", "body[top]", "foot", *upright), ("restraint",))
    at_top = ("top_parameters", "body[top]", "foot", *upright, "x[top]", "base_motion", "load_force", "load_moment")
    friction = (
        Call("lock_power", ("body[j+1]", "lock[j]"), ("lock_power",), adds=True),
        Call("friction_power", ("surface_parameters[j]", "contact[j]"), ("friction_power",), adds=True),
    )
    terms = ["energy", "top_power", "base_power", "lock_power", "friction_power"]
    terms += ["rim_energy"] * effects.rims + ["unilateral_energy"] * effects.uplift
    springs = (Pass(Over.SURFACES, contacts),) if contacts else ()
    loaded = (
        Pass(Over.BASE, (Call("tilt", ("x[base]",), ("tilt",), adds=True),)),
        Pass(Over.BODIES, (Call("tilt", ("x[k]",), ("tilt",), adds=True),)),
        Pass(
            Over.TOP,
            (Call("load_end", ("load_force", "load_moment", "body[top]", "base_motion", "tilt"), ("load_end",)),),
        ),
    )
    return {
        **({"loaded": loaded} if effects.permits_quasistatic_steps else {}),
        "mechanical": (Pass(Over.BODIES, (bodies,)), Pass(Over.TOP, (top,))),
        "springs": (Pass(Over.TOP, (restraint,)), *springs),
        "powers": (
            Pass(Over.TOP, (Call("top_power", at_top, ("top_power",)),)),
            Pass(
                Over.BASE,
                (Call("base_power", ("body[base]", "base_motion", "force[base]", "moment[base]"), ("base_power",)),),
            ),
            Pass(Over.SURFACES, (*friction, *contacts)),
            Pass(Over.TOP, (Call("works", tuple(terms), ("works",)),)),
        ),
    }


def two_port(effects: Effects) -> Schedule:
    """The ends of a two-port: load and support of the top plate; after an evaluation the wrenches of the ends."""
    moment = "below[base]" if effects.uplift else "moment[base]"
    support = (Call("upright", ("support",), ("upright",)),) if effects.top_rotation else ()
    return {
        "interface": (
            Pass(Over.TOP, (Call("interface_load", ("top_parameters", "far_end"), ("load_force",)), *support)),
        ),
        "wrenches": (
            Pass(Over.BODIES, (Call("locking_moment", ("body[k]", "lock[k-1]"), ("held",), adds=True),)),
            Pass(
                Over.BASE, (Call("lower_wrench", ("frame", "body[base]", "force[base]", moment, "held"), ("lower",)),)
            ),
            Pass(Over.TOP, (Call("upper_wrench", ("far_end", "body[top]", "force[top]", "moment[top]"), ("upper",)),)),
        ),
        "sliding": (Pass(Over.SURFACES, (Call("gap", ("surface_parameters[j]", "body[j+1]"), ("gap[j]",)),)),),
        **results(),
    }


def beside(effects: Effects) -> Schedule:
    """Programs that C calls one by one, before, between and after evaluations, with their derivatives by parameters."""
    by = Solve(frozenset({"directions"}), frozenset({"directions"}))
    load = Call("load_work", ("load_end", "load_end"), ("load_work",), by)
    slip = (
        Call("friction_after_slip", ("surface_parameters[j]", "slip[j]", "contact_frame[j]"), ("friction_end[j]",), by),
        Call("slip_work", ("surface_parameters[j]", "slip[j]", "slip_end[j]"), ("slip_work[j]",), by),
    )
    surface = ("surface_values[j]", "body_values[slider]", "side[j]")
    compliance = Call("seat_compliance", ("surface_values[j]",), ("compliance",), by)
    support = (Call("upright", ("support",), ("upright",), by),) if effects.top_rotation else ()
    return {
        **(memories("directions") if remembers(effects) else {}),
        "parameters": (
            Pass(Over.BODIES, (Call("body_block", ("body_values[k]", "sides[k]"), ("body_parameters[k]",), by),)),
            Pass(
                Over.SURFACES,
                (
                    Call("surface_block", surface, ("surface_parameters[j]",), by),
                    *((compliance,) if effects.uplift else ()),
                ),
            ),
            Pass(Over.TOP, (Call("top_block", ("top_values", "around"), ("top_parameters",), by),)),
        ),
        "stage": (
            Pass(
                Over.TOP,
                (
                    *support,
                    Call("spring_stage", ("top_parameters", "foot_previous"), ("foot_stage",), by),
                    Call("resting_foot", ("top_parameters", "body[top]"), ("resting_foot",), by),
                ),
            ),
            *((Pass(Over.SURFACES, slip), Pass(Over.TOP, (load,))) if effects.permits_quasistatic_steps else ()),
        ),
        "rows": (
            Pass(
                Over.SURFACES,
                (
                    Call("extreme_length", ("pair",), ("length",), by),
                    Call("bounded_friction", ("friction[j]", "friction[j]"), ("friction[j]",), by),
                    Call("gap", ("surface_parameters[j]", "body[j+1]"), ("gap[j]",), by),
                    Call("gap_at", ("surface_parameters[j]", "x[j+1]"), ("gap[j]",), by),
                    Call("contact_angles", ("contact[j]",), ("contact_angles[j]",), by),
                ),
            ),
        ),
    }
