"""The contract between Python and the compiled C: what crosses, in which order, unit and range, written once.

The C header and its checks, the rules of the fields of a bearing, a top and a solver, the Cython wrapper, the unpacking
of rows, the messages of failed runs and the table of statuses in docs/glossary.md are made from these tables, or a test
holds them against them. SI units throughout.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, TypeVar

from msfp_gen.common.fields import Quantity
from msfp_gen.specification import friction_laws
from msfp_gen.specification.friction_laws import TEMPERATURES
from msfp_gen.specification.values import Array, Bound, Value

if TYPE_CHECKING:
    from msfp_gen.specification.layout import Effects

_LENGTH, _OFFSET = Quantity("m", above=0.0), Quantity("m", least=0.0)
_INERTIA = Quantity("kg m^2", above=0.0)
_TIME = Quantity("s", above=0.0)
_STIFFNESS, _DAMPING = Quantity("N/m", least=0.0), Quantity("N s/m", least=0.0)

NUMBERS = friction_laws.NUMBERS | friction_laws.SPIN_NUMBERS
"""Every number of a surface that a friction law or a drilling moment may need, and every value derived from them."""
GRAVITY = Value("gravity", Quantity("m/s^2", least=0.0), "gravity")
BODY = (  # of each body, the base first
    Value("height", _LENGTH, "height l"),
    Value(
        "centroid",
        _OFFSET,
        "distance z of the centre of mass from the bottom of a body above a concave-up surface (3.6), from the top of "
        "one above a concave-down surface (3.10); not used for the base",
    ),
    Value("mass", Quantity("kg", above=0.0), "mass m; not used for the base", base=False),
    Value("inertia_transverse", _INERTIA, "moments of inertia lambda_1 = lambda_2; not used for the base", base=False),
    Value("inertia_axial", _INERTIA, "moment of inertia lambda_3; not used for the base", base=False),
    Value("rim_radius", _OFFSET, "radius r of the edge that meets a rim"),
    Value("rim_offset", _OFFSET, "distance p of that edge from the face on that surface, along the axis (3.25)"),
)
BODY_BOUNDS = (
    Bound("centroid", "height", "the height of the body"),
    Bound("rim_offset", "height", "the height of the body"),
    Bound("inertia_axial", "2 * inertia_transverse", "twice its transverse moment for the axial one"),
)
SURFACE = (  # of each surface, the lowest first
    Value("radius", _LENGTH, "radius R"),
    Value("capacity", _LENGTH, "sliding capacity s_c"),
    Value("friction", Quantity("", least=0.0), "friction coefficient mu"),
    Value("yield_displacement", _LENGTH, "yield displacement d_y"),
    Value("rim_stiffness", _STIFFNESS, "stiffness k_c of the rim"),
    Value("rim_damping", _DAMPING, "damping c_c of the rim"),
    Value("contact_damping", Quantity("s", least=0.0), "damping time T of the sheared contact"),
)
SURFACE_OF_EFFECTS: dict[str, tuple[Value, ...]] = {  # after those, in models with the effect
    "uplift": (
        Value(
            "seat_stiffness",
            Quantity("N/m", above=0.0),
            "stiffness of the unilateral contact; the top's contain those of all surfaces in series",
        ),
        Value(
            "seat_damping",
            Quantity("s/m", least=0.0),
            "damping of the unilateral contact, over its stiffness and compression",
        ),
    ),
}
EVERY_SURFACE = (*SURFACE, *(value for values in SURFACE_OF_EFFECTS.values() for value in values))
SURFACE_BOUNDS = (  # of a surface and the rim_radius of its slider, the body that meets its rim
    Bound("capacity", "pi / 2 * radius", "a quarter turn on its sphere", open=True),
    Bound("rim_radius", "radius", "the radius of the surface it slides in", open=True),
    Bound(
        "capacity",
        "radius * (pi / 2 - asin(rim_radius / radius))",
        "that at which the rim of its slider leaves the hemisphere",
        open=True,
    ),
)
TOP = (
    Value("stiffness", _STIFFNESS, "horizontal stiffness of the rig"),
    Value("damping", _DAMPING, "horizontal damping of the rig"),
    Value("rotational_stiffness", Quantity("N m/rad", least=0.0), "rotational stiffness"),
    Value("rotational_damping", Quantity("N m s/rad", least=0.0), "rotational damping"),
    Value("vertical_stiffness", _STIFFNESS, "vertical stiffness of the rig or below the supported mass"),
    Value("vertical_damping", _DAMPING, "vertical damping beside it"),
    Value("mass", Quantity("kg", least=0.0), "supported mass"),
    Value("inertia_transverse", Quantity("kg m^2", least=0.0), "its moment of inertia about a horizontal axis"),
    Value("inertia_axial", Quantity("kg m^2", least=0.0), "its moment of inertia about the vertical axis"),
    Value("height", _OFFSET, "height of its centre above r_nn"),
    Value("anchor_x", Quantity("m"), "anchor of the horizontal springs, along E1"),
    Value("anchor_y", Quantity("m"), "anchor of the horizontal springs, along E2"),
)
TOP_MASS = (  # of a top with a mass, in place of those of these names
    Value("mass", Quantity("kg", above=0.0), "supported mass"),
    Value("inertia_transverse", _INERTIA, "its moment of inertia about a horizontal axis"),
    Value("inertia_axial", _INERTIA, "its moment of inertia about the vertical axis"),
    Value("vertical_stiffness", Quantity("N/m", least=0.0), "vertical stiffness below it", zero="rigid"),
)
INTERFACE = (  # of the interface of a two-port likewise
    Value("stiffness", Quantity("N/m", above=0.0), "horizontal stiffness"),
    Value("vertical_stiffness", Quantity("N/m", above=0.0), "vertical stiffness"),
    Value("rotational_stiffness", Quantity("N m/rad", above=0.0), "rotational stiffness"),
)
AXIAL_LOAD = Value("axial_load", Quantity("N", least=0.0), "compression of a bearing at rest")

# The numbers of msfp_scene in C. Of the monitors some are without limit.
RUN = (
    Value("start_time", Quantity("s"), "time at which the run starts"),
    Value("end_time", Quantity("s"), "time at which it ends"),
    Value("rtol", Quantity("", above=0.0, below=1.0), "bound of the relative error of a step"),
    Value("atol_angle", Quantity("rad", above=0.0), "bound of the absolute error of an angle"),
    Value("max_step", _TIME, "longest step", zero="chosen"),
    Value("first_step", _TIME, "first step", zero="chosen"),
    Value("max_steps", Quantity("", above=0.0), "number of steps after which the run fails"),
    Value("output_step", _TIME, "time between rows", zero="a row at every step"),
    Value("stop_displacement", _LENGTH, "displacement across the bearing at which the run stops", zero="none"),
    Value("monitor_normal", Quantity("N", computed=True), "least normal force"),
    Value("monitor_peak", Quantity("N", least=0.0, computed=True), "largest normal force"),
    Value("monitor_inertia", Quantity("", least=0.0, computed=True), "largest inertial force over normal force"),
    Value("monitor_time", Quantity("s", least=0.0, computed=True), "time over which a change of velocity is averaged"),
    Value("monitor_rise", Quantity("K", least=0.0, computed=True), "largest rise in temperature"),
    Value("law_speed", Quantity("m/s", least=0.0, computed=True), "slip velocity up to which the law was checked"),
    Value("law_temperature[0]", Quantity("degC", computed=True), "lowest temperature for which it was checked"),
    Value("law_temperature[1]", Quantity("degC", computed=True), "highest temperature for which it was checked"),
)


ARRAYS = (
    Array("q", Quantity("rad"), "coordinates", count="MSFP_NB * MSFP_NQ"),
    Array("v", Quantity("rad/s"), "their rates", count="MSFP_NB * MSFP_NQ"),
    Array("f", Quantity(""), "friction state Y, Z", count="MSFP_NB * 2"),
    Array("foot", Quantity("m"), "height of the foot of the mass, and rate", count="2", default=False),
    Array("memory", Quantity(""), "parts of what surfaces remember", count="MSFP_NB * MSFP_MEMORY"),
    Array("origin", Quantity("m"), "r_01 - r_nn without displacement", count="3", default=False),
    Array(
        "monitor_heat",
        Quantity("K"),
        "parts of the temperature rise of its monitor",
        count="MSFP_NB * MSFP_HEAT_STATES",
    ),
    Array(
        "monitor_heating",
        Quantity("K s^1/2/J", least=0.0, computed=True),
        "heating by unit heat flux",
        count="MSFP_NB",
    ),
    Array(
        "monitor_reach",
        Quantity("m", least=0.0, computed=True),
        "sliding displacement up to which the contact covers the centre",
        count="MSFP_NB",
    ),
    Array("law_load", Quantity("N", computed=True), "normal forces for which the law was checked", count="2 * MSFP_NB"),
)
LARGEST_FRICTION_STATE = 1.0 + 1e-9  # Y^2 + Z^2: friction does not exceed mu N; the margin is for rounding
MAX_ROWS = 1e8  # output rows of a run; about 100 GB


def surface_of(effects: Effects) -> tuple[Value, ...]:
    """The values of a surface that every model with these effects has, in order."""
    of_effects = (values for effect, values in SURFACE_OF_EFFECTS.items() if getattr(effects, effect))
    return (*SURFACE, *(value for values in of_effects for value in values))


def surface_values(effects: Effects) -> tuple[str, ...]:
    """Names of the values of a surface in order: the numbers of friction law and drilling moment come last."""
    return (*names(surface_of(effects)), *effects.surface_numbers)


@dataclass(frozen=True)
class Word:
    """One entry of an enumeration: its name in Python, and what it is."""

    name: str
    meaning: str


WORKS = (  # [J]; what each is called in `History.energy`
    Word("input", "work done on the bearing and its top by the base motion and the loads"),
    Word("friction_stored", "recoverable energy stored in friction while stuck"),
    Word("friction_dissipated", "energy dissipated by friction"),
    Word("contact_dissipated", "energy dissipated by the damping of sheared contacts"),
    Word("rim_dissipated", "energy dissipated at the rims"),
    Word("top_dissipated", "energy dissipated by the dampers of the top"),
    Word("seat_dissipated", "energy dissipated in the unilateral contacts"),
)
EVENT_KINDS = (
    Word("rim_contact", "a slider meets its rim"),
    Word("rim_release", "a slider leaves its rim"),
    Word("stop", "the stop condition of the scene is met"),
    Word("lift_off", "the faces of a surface separate"),
    Word("landing", "the faces of a surface meet again"),
)
COUNTERS = (
    Word("steps", "accepted steps"),
    Word("rejected_steps", "steps that failed or whose error was too large"),
    Word("newton_iterations", "iterations of Newton's method"),
    Word("evaluations", "evaluations of the equations"),
    Word("factorisations", "factorisations of a tangent"),
    Word("newton_failures", "steps in which Newton's method did not converge"),
    Word("events", "recorded events"),
    Word("halved_newton_steps", "halvings of a Newton step that did not reduce the residual"),
    Word("fresh_tangents", "tangents evaluated again because old factors converged slowly"),
    Word("other_starts", "stages solved again from the rates of the present state"),
    Word("quasistatic_starts", "stages solved again from rates that balance all forces but inertia"),
)
METHODS = (
    Word("implicit", "TR-BDF2"),
    Word("dopri5", "Dormand-Prince 5(4), explicit"),
    Word("esdirk4", "ESDIRK of order 4"),
)
MONITORS = (
    Word("rims", "a slider is beyond the capacity of its surface [m]"),
    Word("uplift", "a normal force is below its least value, or above its largest [N]"),
    Word("inertia", "inertial force of a slider over the normal force below it"),
    Word("heat", "temperature rise of a surface [K]"),
    Word("law_speed", "slip velocity outside the range in which the friction law was checked [m/s]"),
    Word("law_load", "normal force outside that range [N]"),
    Word("law_temperature", "temperature outside that range [degC]"),
    Word("footprint", "the normal force acts beside the axis of a slider by more than the radius of its face [m]"),
)


@dataclass(frozen=True)
class Status:
    """How a run or an evaluation ended.

    name: the public word. meaning: the row of docs/glossary.md. failure: what a failed run says, with the remedy.
    evaluation: the same of a single evaluation, None where it cannot end so. quantity: what the number beside a failure
    is. motion: the bearing did it, so that the message shows the last state. compiled: the C knows it.
    """

    name: str
    meaning: str
    failure: str = ""
    evaluation: str | None = None
    quantity: str | None = None
    motion: bool = False
    compiled: bool = True


STATUSES = (
    Status("ok", "the run reached its end"),
    Status("stopped", "the run met the scene's stop condition"),
    Status(
        "newton",
        "Newton's method did not converge at the smallest step; the bearing may have jammed",
        "Newton's method did not converge at the smallest step: the bearing may have jammed (docs/model.md); "
        "lower the friction or the motion, or give a larger solver.rtol where it is small",
        "Newton's method found no accelerations; the state may be beyond what the bearing can carry",
        quantity="residual",
        motion=True,
    ),
    Status(
        "step",
        "the error control asks for a step below the smallest",
        "the error control asks for a step below the smallest; loosen solver.rtol or check the motion for spikes",
        motion=True,
    ),
    Status(
        "irregular",
        "loss of regularity: the determinant changed sign, or a normal force grew without bound",
        "the equations lost regularity (the determinant changed sign, or a normal force has no bound): "
        "tilts and friction are too high for a unique motion here; lower the friction or the motion",
        "the equations have lost regularity: friction and inertia admit no unique acceleration",
        motion=True,
    ),
    Status(
        "uplift",
        "an interface would have to transmit tension, and the model has no separation",
        "the interface would have to pull; uplift is not modelled: increase the axial load or reduce the motion, "
        "or give effects.uplift = true",
        "an interface would have to pull; uplift is not modelled: increase the load on the top",
        quantity="P.t3 [N]",
        motion=True,
    ),
    Status(
        "angle",
        "a tilt exceeds 1.5 rad, next to the singularity of the Euler angles",
        "a tilt nears 90 degrees, where the Euler angles are singular; check the capacity and the rims",
        quantity="angle [rad]",
        motion=True,
    ),
    Status(
        "steps",
        "the permitted number of steps is used up",
        "the allowed number of steps is used up; raise solver.max_steps",
    ),
    Status(
        "finite",
        "a value is not finite",
        "a value is not finite",
        "a value is not finite; check the state and the load",
    ),
    Status("memory", "no memory for more rows", "no memory for more rows; give output_step"),
    Status("monitor", "a monitor stopped the run (`strict`)", "what the model leaves out would matter from here on"),
    Status(
        "separated",
        "a separated body lies farther from its place than the radius of its slider: the stack has come apart",
        "a body is beside its place by more than the radius of its slider: the stack has come apart; reduce the "
        "motion or raise the load",
        quantity="aside [m]",
        motion=True,
    ),
    Status(
        "stiff",
        "the explicit method runs at its limit of stability, where its error estimate has no meaning",
        "the explicit method has reached its limit of stability, where its error estimate means nothing; "
        "use solver.method = 'implicit'",
    ),
    Status(
        "law",
        "the friction law gives a coefficient below zero",
        "the friction law gives a coefficient below zero here; give a law that holds at the velocity, pressure, "
        "temperature and normal force that the run reaches, or reduce the motion",
        "the friction law gives a coefficient below zero; check the law, its numbers and the rates",
        quantity="friction coefficient",
        motion=True,
    ),
    Status("interrupted", "the user or the system stopped the run", "interrupted", compiled=False),
)


def names(entries: tuple[Value | Word | Status, ...]) -> tuple[str, ...]:
    """Names of the entries of a table, in order."""
    return tuple(entry.name for entry in entries)


class Extent(StrEnum):
    """Length of a dimension of a row's field that the model decides: the macro of the C header."""

    SURFACES = "MSFP_NB"  # n - 1: moving bodies, or surfaces
    COORDINATES = "MSFP_NQ"  # psi, theta, phi; in models with uplift then the separation along E1, E2, E3
    WORKS = "MSFP_WORKS"  # integrals over the run, `WORKS`


@dataclass(frozen=True)
class Recorded:
    """One field of a row of output. needs: the feature of a model without which it is absent ("" for none)."""

    name: str
    shape: tuple[Extent | int, ...]
    unit: str
    meaning: str
    needs: str = ""


_Field = TypeVar("_Field", bound=Recorded)
_N = Extent.SURFACES
_MOTION = (_N, Extent.COORDINATES)
_ROW = (
    Recorded("time", (), "s", "time"),
    Recorded("q", _MOTION, "rad, m", "coordinates of the moving bodies: psi, theta, phi, then the separation"),
    Recorded("v", _MOTION, "rad/s, m/s", "their rates"),
    Recorded("a", _MOTION, "rad/s^2, m/s^2", "their second derivatives"),
    Recorded("f", (_N, 2), "-", "friction state Y, Z"),
    Recorded("normal", (_N,), "N", "normal force"),
    Recorded("angles", (_N, 2), "rad", "contact position psi~, theta~"),
    Recorded("sliding", (_N,), "m", "sliding displacement (3.20)"),
    Recorded("gap", (_N,), "m", "gap to the rim (3.21)"),
    Recorded("rim", (_N,), "N", "rim force, compression positive"),
    Recorded("force", (_N, 3), "N", "interface force on the body above"),
    Recorded("slip", (_N, 2), "m/s", "slip velocity u~, v~ (2.98)"),
    Recorded("compression", (_N,), "m", "compression of the unilateral contact; negative: open", "uplift"),
    Recorded("base", (3,), "m", "displacement of the base"),
    Recorded("base_angles", (3,), "rad", "angles psi, theta, phi of the base"),
    Recorded("top", (3,), "m", "position of r_nn at the top plate"),
    Recorded("top_force", (3,), "N", "force of the bearing on the top support"),
    Recorded("top_moment", (3,), "N m", "moment of the bearing on the top support at r_nn"),
    Recorded("top_settlement", (), "m", "compression of the vertical spring of the top"),
    Recorded("kinetic", (), "J", "kinetic energy relative to the base"),
    Recorded("potential", (), "J", "potential energy"),
    Recorded("restraint", (), "J", "energy of the springs of the top"),
    Recorded("rim_stored", (), "J", "energy of the springs of the rims"),
    Recorded("seat_stored", (), "J", "energy of the springs of the unilateral contacts"),
    Recorded("work", (Extent.WORKS,), "J", "integrals over the run"),
    Recorded("mu", (_N,), "-", "friction coefficient", "law"),
    Recorded("temperature", (_N,), "degC", "temperature of the surface", "heat"),
    Recorded("memory", (_N,), "-", "what the surface remembers, on which its friction law depends", "memory"),
)


ACROSS = "across"
"""Displacement across the bearing: base less top, less the same at the start. No field of a row has it."""


@dataclass(frozen=True)
class Extreme(Recorded):
    """Extremes of a field of the rows: of each surface, or of a vector, along E1, E2, E3 and in the horizontal plane.

    of: the field, or `ACROSS`. least: the least counts, otherwise the largest. positions: it follows from positions
    alone. loaded: only surfaces that carry a normal force count. opening: of a compression how far it is below 0.
    """

    of: str = ""
    least: bool = False
    positions: bool = False
    loaded: bool = False
    opening: bool = False


_VECTOR = "largest magnitude along E1, E2, E3 and in the horizontal plane"
EXTREMES = (
    Extreme("displacement", (4,), "m", _VECTOR, of=ACROSS, positions=True),
    Extreme("top_force", (4,), "N", _VECTOR, of="top_force"),
    Extreme("sliding", (_N,), "m", "largest sliding displacement", of="sliding", positions=True),
    Extreme("gap", (_N,), "m", "least gap to the rim", of="gap", least=True, positions=True),
    Extreme("rim_force", (_N,), "N", "largest rim force", of="rim"),
    Extreme("slip_speed", (_N,), "m/s", "largest slip velocity", of="slip", loaded=True),
    Extreme("least_normal", (_N,), "N", "least normal force", of="normal", least=True),
    Extreme("most_normal", (_N,), "N", "largest normal force", of="normal"),
    Extreme("least_friction", (_N,), "-", "least friction coefficient", "law", of="mu", least=True),
    Extreme("most_friction", (_N,), "-", "largest friction coefficient", "law", of="mu"),
    Extreme("temperature", (_N,), "degC", "highest temperature", "heat", of="temperature"),
    Extreme(
        "lift",
        (_N,),
        "m",
        "largest clearance between the faces of a unilateral contact",
        "uplift",
        of="compression",
        opening=True,
    ),
)


def row(effects: Effects) -> tuple[Recorded, ...]:
    """Fields of a row of a model with these effects, in order."""
    return _present(_ROW, effects)


def extremes(effects: Effects) -> tuple[Extreme, ...]:
    """Extremes that a run of a model with these effects records over all of its steps, in order."""
    return _present(EXTREMES, effects)


def _present(quantities: tuple[_Field, ...], effects: Effects) -> tuple[_Field, ...]:
    law, memory = effects.law, None if effects.law is None else effects.law.memory
    has = {
        "": True,
        "uplift": effects.uplift,
        "law": law is not None,
        "heat": memory in TEMPERATURES,
        "memory": memory not in (None, *TEMPERATURES),
    }
    return tuple(quantity for quantity in quantities if has[quantity.needs])
