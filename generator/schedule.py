"""Schedules: which program runs over which bodies and surfaces, from which blocks to which.

A program (`derive.py`) describes one body or one surface. A schedule states, as data, how the programs of a stack
follow each other in one evaluation. `drivers.py` prints the C that calls them in up to four forms: the values;
derivatives with respect to the variables of a step; derivatives by the motion of the ends of a two-port; and, in models
with gradients, derivatives with respect to parameters (`directions.py`).

A place is a block in a list of blocks: `body[k-1]` is the block of the body below body k, `rim[j]` that of surface j,
which lies between bodies j and j+1. `base` and `top` are the indices of the lowest and of the highest body.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum

from msfp_gen.specification.layout import Effects, ModelSpec

from .blocks import Blocks
from .program import Block, Program


class Over(Enum):
    """The bodies or surfaces over which a pass runs."""

    BASE = "base"
    BODIES = "moving bodies k"
    SURFACES = "surfaces j"
    DOWNWARD = "surfaces j, from the top down"
    TOGETHER = "all surfaces j at once"
    TOP = "top"


class When(Enum):
    """A condition of the state of an evaluation under which a program acts."""

    RIM_PUSHES = "the rim of surface j pushes"
    RIM_CLOSED = "surface j is beyond its capacity"
    ON_FACE = "the slider of surface j stands on its face"
    ON_EDGE = "the slider of surface j stands on its edge"
    OFF_CENTRE = "surface j has slid"
    """At the centre the sliding displacement has a kink, where its derivative counts as zero."""


class Values(Enum):
    """Where the program of an `If` is evaluated."""

    HERE = "here, where it acts; what it writes is zero elsewhere"
    LATER = "where the next call needs it; here its derivatives alone"
    RUNTIME = "in the runtime, which sets to zero what it writes where it does not act"
    RUNTIME_WITH_SLOPES = "in the runtime, which also gives the fast tangent what it needs"


@dataclass(frozen=True)
class If:
    """Whether a program acts, or which of several does. Where none does, the derivatives are zero.

    Attributes:
        acts: program -> the condition under which it acts.
        values: where it is evaluated.
    """

    acts: Mapping[str, When]
    values: Values = Values.LATER


@dataclass(frozen=True)
class Solve:
    """A program that the runtime evaluates and differentiates itself, because it solves for what the program needs.

    Attributes:
        forms: the forms of derivatives (`drivers.py`) that there are: "tangents", "directions", "by_ends".
        emitted: the forms of which the derivatives are a program, which is emitted.
        gives_results: whether it gives the results where it asks for the derivatives.
        fails: whether it may find no solution, with a status at which the evaluation ends.
    """

    forms: frozenset[str]
    emitted: frozenset[str] = frozenset()
    gives_results: bool = False
    fails: bool = False


@dataclass(frozen=True)
class Call:
    """One program with the places that it reads, in the order of its inputs, and those that it writes.

    A program that writes several places writes their blocks one after the other.
    """

    program: str
    reads: tuple[str, ...]
    writes: tuple[str, ...]
    by: If | Solve | None = None
    """Whether it acts, or that the runtime solves it; None: the program is called, and so are its derivatives."""
    adds: bool = False
    """Whether what it writes is added to a block, which is zero at the start of the part."""
    differentiated: tuple[str, ...] = ()
    """Results of which the runtime reads the derivatives, beside those that other programs read."""

    @property
    def programs(self) -> tuple[str, ...]:
        """The programs of which one acts: with conditions those that have one, otherwise the one of the call."""
        return tuple(self.by.acts) if isinstance(self.by, If) else (self.program,)


@dataclass(frozen=True)
class Pass:
    """Programs that run one after the other for every body or surface."""

    over: Over
    calls: tuple[Call, ...]


Schedule = Mapping[str, tuple[Pass, ...]]
"""Part of an evaluation -> its passes. Each part becomes functions of its own."""

Place = tuple[str, int]
"""A list and the number of a block in it."""


class ListStorage(Enum):
    """The record in which a list is kept, which decides where its derivatives are."""

    PARAMETERS = "parameters"
    WORK = "work area"
    HERE = "blocks of the schedules"


class Per(Enum):
    """Of what a list has one block each."""

    STACK = "the stack"
    SURFACE = "a surface"
    BODY = "a body"


@dataclass(frozen=True)
class List:
    """A list of blocks of one kind, or a single one.

    Attributes:
        kind: name of the block in `Blocks`.
        name: name in the record that keeps it.
        storage: the parameters, the work area of an evaluation, or the blocks of the schedules alone.
        per: of what it has one block each.
        is_input: whether an evaluation is given it, so that no program needs to have written it.
        tangents: whether the work area keeps derivatives by the variables of a step, which the steppers read.
        directions: whether the work area keeps derivatives by parameters, likewise.
    """

    kind: str
    name: str
    storage: ListStorage = ListStorage.HERE
    per: Per = Per.STACK
    is_input: bool = False
    tangents: bool = False
    directions: bool = False


LISTS: Mapping[str, List] = {
    "body_parameters": List("body_parameters", "body", ListStorage.PARAMETERS, Per.BODY, is_input=True),
    "surface_parameters": List("surface_parameters", "surface", ListStorage.PARAMETERS, Per.SURFACE, is_input=True),
    "top_parameters": List("top_parameters", "top", ListStorage.PARAMETERS, is_input=True),
    "coefficient": List("coefficient", "coefficient", ListStorage.WORK, Per.SURFACE, is_input=True),
    "foot_stage": List("foot_stage", "foot_stage", is_input=True),
    "upright": List("upright", "upright", is_input=True),
    "foot": List("foot", "foot", ListStorage.WORK, directions=True),
    "frame": List("body", "frame", is_input=True),
    "x": List("coordinates", "x", ListStorage.WORK, Per.BODY, is_input=True, tangents=True, directions=True),
    "body": List("body", "body", ListStorage.WORK, Per.BODY, tangents=True, directions=True),
    "load_force": List("force", "load_force", is_input=True),
    "load_moment": List("moment", "load_moment", is_input=True),
    "force": List("force", "force", ListStorage.WORK, Per.BODY, tangents=True, directions=True),
    "moment": List("moment", "moment", ListStorage.WORK, Per.BODY, tangents=True, directions=True),
    "unknowns": List("unknowns", "unknowns", per=Per.SURFACE, is_input=True),
    "friction": List("friction", "friction", per=Per.SURFACE, is_input=True),
    "rim_coordinates": List("rim_coordinates", "rim_coordinates", per=Per.SURFACE),
    "rim": List("rim", "rim", ListStorage.WORK, Per.SURFACE, directions=True),
    "relative": List("relative", "relative", per=Per.SURFACE),
    "report_contact": List("report_contact", "report_contact", per=Per.SURFACE),
    "linear": List("linear", "linear", per=Per.BODY),
    "angular": List("angular", "angular", per=Per.BODY),
    "balances": List("balances", "balances", per=Per.BODY),
    "contact_frame": List("contact_frame", "contact_frame", ListStorage.WORK, Per.SURFACE, directions=True),
    "friction_previous": List("friction_previous", "friction_previous", per=Per.SURFACE, is_input=True),
    "friction_stage": List("friction_stage", "friction_stage", ListStorage.WORK, Per.SURFACE, directions=True),
    "friction_force": List("friction_force", "friction_force", per=Per.SURFACE, is_input=True),
    "contact": List("contact", "contact", ListStorage.WORK, Per.SURFACE, directions=True),
    "local_moment": List("moment", "local_moment", per=Per.SURFACE),
    "unilateral": List("unilateral", "unilateral", ListStorage.WORK, Per.SURFACE, directions=True),
    "rim_wrench": List("rim_wrench", "rim_wrench", ListStorage.WORK, Per.SURFACE),
    "carried": List("force", "carried", per=Per.BODY),
    "excess": List("linear", "excess", per=Per.SURFACE),
    "joint_moment": List("moment", "joint_moment", per=Per.SURFACE),
    "below": List("moment", "below", ListStorage.WORK, Per.BODY),
    "base_motion": List("base_motion", "base_motion", is_input=True),
    "energy": List("energy", "energy"),
    "rim_motion": List("rim_motion", "rim_motion", per=Per.SURFACE),
    "lock": List("lock", "lock", ListStorage.WORK, Per.SURFACE, is_input=True, directions=True),
    "restraint": List("restraint", "restraint"),
    "rim_energy": List("rim_energy", "rim_energy"),
    "unilateral_energy": List("unilateral_energy", "unilateral_energy"),
    "top_power": List("top_power", "top_power"),
    "base_power": List("power", "base_power"),
    "lock_power": List("power", "lock_power"),
    "friction_power": List("friction_power", "friction_power"),
    "works": List("works", "works"),
    "far_end": List("far_end", "far_end", is_input=True),
    "support": List("support", "support", is_input=True),
    "held": List("moment", "held"),
    "lower": List("end_wrench", "lower"),
    "upper": List("end_wrench", "upper"),
    "contact_angles": List("contact_angles", "contact_angles", per=Per.SURFACE),
    "gap": List("gap", "gap", per=Per.SURFACE),
    "resting_foot": List("resting_foot", "resting_foot"),
    "friction_end": List("friction_end", "friction_end", per=Per.SURFACE),
    "slip_work": List("slip_work", "slip_work", per=Per.SURFACE),
}
"""All lists of blocks."""

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

    With uplift the unilateral contacts give the forces of the surfaces. That the force (3.15)-(3.17) of a contact, at
    given psi~, theta~ and N, is the same are further rows.
    """
    memory, uplift = effects.law is not None and effects.law.memory is not None, effects.uplift
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
                differentiated=("dY", "dZ"),
            ),
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
                        differentiated=("dY", "dZ", "mu", "N", "source"),
                    ),
                ),
            ),
        ),
        "moments": (
            Pass(Over.SURFACES, moments),
            Pass(Over.BODIES, (Call("angular_balance", balance, ("angular[k]",)),)),
        ),
    }


def energies(effects: Effects) -> Schedule:
    """Energies of masses and springs, and the powers whose integrals are the works of a run, after an evaluation."""
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
    return {
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
    sliding = Call("gap", ("surface_parameters[j]", "body[j+1]"), ("gap[j]",), If({"gap": When.OFF_CENTRE}))
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
        "sliding": (Pass(Over.SURFACES, (sliding,)),),
    }


def beside(effects: Effects) -> Schedule:
    """What the runtime calls itself, before, between and after evaluations, and differentiates by parameters."""
    by = Solve(frozenset({"directions"}), frozenset({"directions"}))
    slip = (
        Call("friction_after_slip", ("surface_parameters[j]", "slip[j]", "contact_frame[j]"), ("friction_end[j]",), by),
        Call("slip_work", ("surface_parameters[j]", "slip[j]", "slip_end[j]"), ("slip_work[j]",), by),
    )
    surface = ("surface_values[j]", "body_values[slider]", "side[j]")
    support = (Call("upright", ("support",), ("upright",), by),) if effects.top_rotation else ()
    return {
        "parameters": (
            Pass(Over.BODIES, (Call("body_block", ("body_values[k]", "sides[k]"), ("body_parameters[k]",), by),)),
            Pass(Over.SURFACES, (Call("surface_block", surface, ("surface_parameters[j]",), by),)),
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
            *((Pass(Over.SURFACES, slip),) if effects.permits_quasistatic_steps else ()),
        ),
        "gaps": (
            Pass(
                Over.SURFACES,
                (
                    Call("gap", ("surface_parameters[j]", "body[j+1]"), ("gap[j]",), replace(by, gives_results=True)),
                    Call("gap_at", ("surface_parameters[j]", "x[j+1]"), ("gap[j]",), replace(by, gives_results=True)),
                    Call("contact_angles", ("contact[j]",), ("contact_angles[j]",), by),
                ),
            ),
        ),
    }


def list_name(place: str) -> str:
    """The name of the list of a place."""
    return place.partition("[")[0]


def list_of(place: str) -> List:
    """The list of a place."""
    return LISTS[list_name(place)]


def output_is_stored(call: Call) -> bool:
    """Whether the work area holds the results of a call while it is differentiated."""
    if isinstance(call.by, Solve):
        return call.by.gives_results
    return (
        call.by is None
        and not call.adds
        and len(call.writes) == 1
        and list_of(call.writes[0]).storage is ListStorage.WORK
    )


def index_of(place: str) -> str:
    """The index of a place in its list; empty for a single block."""
    return place.partition("[")[2].removesuffix("]")


def calls_of(passes: Iterable[Pass]) -> Iterator[Call]:
    """All calls in order."""
    for one in passes:
        yield from one.calls


def passes_of(schedule: Schedule) -> Iterator[Pass]:
    """All passes of an evaluation in order."""
    for passes in schedule.values():
        yield from passes


def unrolled(passes: Iterable[Pass], signs: Sequence[int]) -> Iterator[tuple[Call, list[Place], list[Place]]]:
    """The calls of a stack one by one, each with the places that it reads and writes.

    signs: +1 or -1 for each surface, concave up or down.
    """
    surfaces = len(signs)
    numbers = {
        Over.BASE: range(1),
        Over.BODIES: range(1, surfaces + 1),
        Over.SURFACES: range(surfaces),
        Over.DOWNWARD: range(surfaces - 1, -1, -1),
        Over.TOGETHER: range(surfaces),
        Over.TOP: range(surfaces, surfaces + 1),
    }

    def numbered(place: str, number: int) -> Place:
        index = {"": 0, "base": 0, "top": surfaces}.get(index_of(place))
        if index_of(place) == "slider":
            index = number + (signs[number] > 0)
        if index is None:
            index = number + int(index_of(place)[1:] or 0)
        return place.partition("[")[0], index

    for one in passes:
        for number in numbers[one.over]:
            for call in one.calls:
                reads, writes = ([numbered(place, number) for place in places] for places in (call.reads, call.writes))
                yield call, reads, writes


def check(passes: Iterable[Pass], programs: Mapping[str, Program], blocks: Blocks) -> None:
    """Raise AssertionError where a place does not fit its program, or nothing has written what a program reads."""
    known = {name for name, one in LISTS.items() if one.is_input}
    every = ((call, programs[name]) for call in calls_of(passes) for name in call.programs)
    for call, program in every:
        assert program.output is not None
        assert len(call.reads) == len(program.inputs), call
        for place, use in zip(call.reads, program.inputs, strict=True):
            assert block_of(place, blocks) == use.block, (call, place)
            assert list_name(place) in known, (call, place)
        fields = [field for place in call.writes for field in block_of(place, blocks).fields]
        assert len(fields) == len(program.output.block.fields), call
        known |= {list_name(place) for place in call.writes}


def block_of(place: str, blocks: Blocks) -> Block:
    """The block of a place."""
    block: Block = getattr(blocks, list_of(place).kind)
    return block
