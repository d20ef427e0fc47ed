"""The blocks that programs exchange: the numbers that C stores per body, per surface and at the top.

The order of the fields here is the order in memory, which the emitted header `msfp_model.h` states. In a planar model
polar vectors keep (E1, E3), axial ones keep E2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from msfp_gen.specification import contract

from .program import AXIAL, POLAR, Block, BlockBuilder

Maker = Callable[[str], BlockBuilder]
"""Begins the block of a given name."""


def _top(new: Maker) -> dict[str, Block]:
    """Parameters of the top, its wrench, the foot of a mass on a vertical spring, the rotating support."""
    return {
        "top_parameters": new("top_parameters")
        .scalar("k", "N/m", "horizontal stiffness of the rig")
        .scalar("c", "N s/m", "horizontal damping of the rig")
        .scalar("kr", "N m/rad", "rotational stiffness")
        .scalar("cr", "N m s/rad", "rotational damping")
        .scalar("m", "kg", "supported mass")
        .scalar("jt", "kg m^2", "its transverse moment of inertia")
        .scalar("ja", "kg m^2", "its axial moment of inertia")
        .scalar("h", "m", "height of its centre above r_nn")
        .scalar("g", "m/s^2", "gravitational acceleration")
        .scalar("mz", "kg", "supported mass that follows the top plate vertically; 0 on a vertical spring")
        .scalar("kv", "N/m", "vertical stiffness between top plate and foot")
        .scalar("cv", "N s/m", "vertical damping between top plate and foot")
        .scalar("sr", "-", "compliance of vertical spring and unilateral contacts over that of the spring alone")
        .vector("x0", "m", "anchor of the rig springs (r_nn at the start when centred)", POLAR)
        .build(),
        "top_wrench": new("top_wrench")
        .vector("F", "N", "-F_top: what the bearing exerts on the top support", POLAR)
        .vector("M", "N m", "-M_top about r_nn", AXIAL)
        .build(),
        "foot_previous": new("foot_previous")
        .scalar("y", "m", "y of the foot less beta^2 y'', what the earlier stages give; y outside of a step")
        .scalar("y1", "m/s", "its rate less beta y''; y' outside of a step")
        .scalar("beta", "s", "diagonal entry of the stage formula; 0 outside of a step")
        .build(),
        "resting_foot": new("resting_foot")
        .scalar("y", "m", "height of the foot at rest, or of the fixed end of the spring")
        .scalar("y1", "m/s", "its velocity")
        .build(),
        "foot_stage": new("foot_stage")
        .scalar("y", "m", "as in foot_previous")
        .scalar("y1", "m/s", "as in foot_previous")
        .scalar("beta", "s", "the same where a mass rests on the spring; else 0", fixed=True)
        .scalar("mobility", "1/kg", "1/(m + c beta + k beta^2); 0 where no mass rests on the spring", fixed=True)
        .scalar("share", "-", "m times mobility; 1 where no mass rests on the spring", fixed=True)
        .build(),
        "foot": new("foot")
        .scalar("y", "m", "height of the foot: the lower end of the supported mass, or the fixed end of the spring")
        .scalar("y1", "m/s", "its velocity")
        .scalar("y2", "m/s^2", "its acceleration")
        .build(),
        "support": new("support")
        .scalar("psi", "rad", "psi of the support of the top plate", 0)
        .scalar("theta", "rad", "theta of the support of the top plate")
        .scalar("psi1", "rad/s", "d psi/dt", 0)
        .scalar("theta1", "rad/s", "d theta/dt")
        .build(),
        "upright": new("upright")
        .vector("e", "-", "axis of the support, in line with the t_3 of the top plate at rest", POLAR)
        .vector("w", "rad/s", "its angular velocity", AXIAL)
        .build(),
    }


@dataclass(frozen=True)
class Blocks:
    """All blocks of one model."""

    body_parameters: Block
    surface_parameters: Block
    compliance: Block
    rim_bound: Block
    top_parameters: Block
    coordinates: Block
    body: Block
    force: Block
    moment: Block
    wrench: Block
    contact_frame: Block
    relative: Block
    friction: Block
    friction_force: Block
    friction_previous: Block
    friction_stage: Block
    slip: Block
    slip_end: Block
    friction_end: Block
    slip_work: Block
    tilt: Block
    load_end: Block
    load_work: Block
    unknowns: Block
    contact: Block
    surface_results: Block
    report_contact: Block
    friction_rates: Block
    rim: Block
    rim_coordinates: Block
    rim_wrench: Block
    split: Block
    contact_angles: Block
    gap: Block
    top_wrench: Block
    foot_previous: Block
    foot_stage: Block
    resting_foot: Block
    foot: Block
    support: Block
    upright: Block
    linear: Block
    angular: Block
    balances: Block
    points: Block
    pair: Block
    length: Block
    base_motion: Block
    energy: Block
    unilateral: Block
    unilateral_depth: Block
    friction_power: Block
    rim_motion: Block
    rim_energy: Block
    restraint: Block
    top_power: Block
    lock: Block
    unilateral_energy: Block
    works: Block
    power: Block
    turn: Block
    rotation_angles: Block
    far_end: Block
    end_wrench: Block
    coefficient: Block | None = None
    """The friction coefficient as an unknown, where it follows a law."""
    memory: Block | None = None
    """A part of what a surface remembers, before a stage."""
    memory_part: Block | None = None
    """The constants of that part."""
    diagonal: Block | None = None
    """The diagonal entry of the stage formula, in which a memory is solved for."""
    memory_end: Block | None = None
    """The part and its rate at the end of a stage."""
    memory_past: Block | None = None
    memory_gain: Block | None = None


def _parameters(new: Maker) -> dict[str, Block]:
    """Parameters of bodies and surfaces."""
    return {
        "body_parameters": new("body_parameters")
        .scalar("c", "m", "from the sphere centre below to the centre of mass, along t3")
        .scalar("e", "m", "from the sphere centre below to the sphere centre above (top plate: to r_nn), along t3")
        .scalar("m", "kg", "mass")
        .scalar("jt", "kg m^2", "lambda_1 = lambda_2, transverse moment of inertia (2.118)")
        .scalar("ja", "kg m^2", "lambda_3, axial moment of inertia (2.118)")
        .scalar("g", "m/s^2", "gravitational acceleration")
        .build(),
        "surface_parameters": new("surface_parameters")
        .scalar("sign", "-", "+1 concave up, -1 concave down")
        .scalar("R", "m", "radius of the sliding surface")
        .scalar("sc", "m", "s_c, sliding capacity (3.21)")
        .scalar("mu", "-", "friction coefficient (3.16)")
        .scalar("dy", "m", "yield displacement, R_0/R of (3.18)")
        .scalar("td", "s", "T, damping time of the sheared contact (docs/friction.md)")
        .scalar("kc", "N/m", "rim stiffness (3.23)")
        .scalar("cc", "N s/m", "rim damping (3.23)")
        .scalar("rs", "m", "radius of the slider that carries the contact patch")
        .scalar("pr", "m", "p, height of the rim contact above the slider's face (3.25)")
        .scalar("ks", "N/m", "stiffness of the unilateral contact, along the interface force (docs/uplift.md)")
        .scalar("cs", "s/m", "damping of the unilateral contact, over its stiffness and compression")
        .scalar("ca", "-", "cosine of the half-angle of the footprint, friction angle included")
        .scalar("sa", "-", "sine of that angle")
        .build(),
        "rim_bound": new("rim_bound")
        .scalar("cosine", "-", "of the tilt at which the rim is met")
        .scalar("slope", "m", "derivative of the gap (3.21) by the cosine of the tilt, at that tilt")
        .build(),
        "compliance": new("compliance").scalar("compliance", "m/N", "of the unilateral contact of a surface").build(),
    }


def _coordinates(new: Maker, uplift: bool) -> Block:
    """Angles of a body, and with uplift the separation of its lower sphere centre from that of the surface below."""
    builder = (
        new("coordinates")
        .scalar("psi", "rad", "psi, first Euler angle", 0)
        .scalar("theta", "rad", "theta, second Euler angle")
        .scalar("phi", "rad", "phi, spin", 0)
        .scalar("psi1", "rad/s", "d psi/dt", 0)
        .scalar("theta1", "rad/s", "d theta/dt")
        .scalar("phi1", "rad/s", "d phi/dt", 0)
        .scalar("psi2", "rad/s^2", "second derivative of psi", 0)
        .scalar("theta2", "rad/s^2", "second derivative of theta")
        .scalar("phi2", "rad/s^2", "second derivative of phi", 0)
    )
    if uplift:
        builder.vector("d", "m", "separation delta of the sphere centres, along E1, E2, E3", POLAR)
        builder.vector("d1", "m/s", "d delta/dt", POLAR)
        builder.vector("d2", "m/s^2", "second derivative of delta", POLAR)
    return builder.build()


def _motion(new: Maker, uplift: bool) -> dict[str, Block]:
    """Coordinates and kinematics of a body, and the motion of the base."""
    return {
        "coordinates": _coordinates(new, uplift),
        "body": new("body")
        .vector("t1", "-", "t_1 (2.1)", POLAR)
        .vector("t2", "-", "t_2 (2.1)", (0, 1, 0))
        .vector("t3", "-", "t_3, axis of symmetry (2.1)", POLAR)
        .vector("w", "rad/s", "omega without spin (3.12)", AXIAL)
        .vector("wp", "rad/s", "omega', with spin (3.12)", AXIAL)
        .vector("al", "rad/s^2", "d omega/dt", AXIAL)
        .vector("alp", "rad/s^2", "d omega'/dt", AXIAL)
        .vector("C", "m", "sphere centre above (3.4), (3.8); top plate: r_nn (3.11)", POLAR)
        .vector("V", "m/s", "its velocity", POLAR)
        .vector("A", "m/s^2", "its acceleration", POLAR)
        .vector("ac", "m/s^2", "acceleration of the centre of mass", POLAR)
        .vector("vc", "m/s", "velocity of the centre of mass", POLAR)
        .vector("rc", "m", "centre of mass (3.6), (3.10)", POLAR)
        .scalar("sp", "-", "sin psi", 0)
        .scalar("cp", "-", "cos psi", 1)
        .scalar("st", "-", "sin theta")
        .scalar("ct", "-", "cos theta")
        .build(),
        "points": _points(new),
        "pair": new("pair").scalar("x", "-", "a number of a row").scalar("y", "-", "a second one, or 0").build(),
        "length": new("length").scalar("value", "-", "length of a pair").build(),
        "base_motion": new("base_motion")
        .vector("U", "m/s", "velocity of the base", POLAR)
        .vector("B", "m/s^2", "acceleration of the base", POLAR)
        .vector("O", "m", "displacement of the base", POLAR)
        .build(),
        "energy": new("energy")
        .scalar("kinetic", "J", "kinetic energy relative to the moving base")
        .scalar("potential", "J", "m g times height above the base")
        .scalar("power", "W", "power of the base acceleration")
        .build(),
    }


def _points(new: Maker) -> Block:
    """The named points of a body (3.2)-(3.11) with velocity and acceleration."""
    builder = new("points")
    for name, meaning in (
        ("lo", "r_k-1,k bottom centre"),
        ("cm", "r_k centre of mass"),
        ("up", "r_k,k top centre"),
        ("sc", "r_kc sphere centre above"),
    ):
        for order, unit in (("r", "m"), ("v", "m/s"), ("a", "m/s^2")):
            builder.vector(f"{order}_{name}", unit, f"{meaning}: {order}", POLAR)
    return builder.build()


def _interfaces(new: Maker) -> dict[str, Block]:
    """Interface force and moment of a surface, its friction and its contact."""
    return {
        "force": new("force").vector("F", "N", "force on the body above the interface", POLAR).build(),
        "moment": new("moment").vector("M", "N m", "moment on the body above, about the sphere centre", AXIAL).build(),
        "wrench": new("wrench")
        .vector("F", "N", "force on the body above the interface", POLAR)
        .vector("M", "N m", "moment on the body above, about the sphere centre", AXIAL)
        .build(),
        "split": new("split")
        .vector("M", "N m", "moment on the body above, about its sphere centre", AXIAL)
        .vector("B", "N m", "its opposite on the body below, about the sphere centre of that body", AXIAL)
        .build(),
        "contact_frame": new("contact_frame")
        .vector("p", "N", "contact force (normal and friction) in the basis of the body below", POLAR)
        .vector("dw", "rad/s", "omega'_above - omega'_below, same basis", AXIAL)
        .build(),
        "relative": new("relative")
        .vector("dw", "rad/s", "omega'_above - omega'_below, basis of the body below", AXIAL)
        .build(),
        "friction": new("friction").scalar("Y", "-", "Y (3.18)").scalar("Z", "-", "Z (3.18)", 0).build(),
        "friction_force": new("friction_force")
        .scalar("Y", "-", "friction force along t~1 over -mu N: Y + T dY/dt")
        .scalar("Z", "-", "friction force along t~2 over -mu N: Z + T dZ/dt", 0)
        .build(),
        "friction_previous": new("friction_previous")
        .scalar("Y", "-", "Y that the earlier stages of the step give; Y itself outside of a step")
        .scalar("Z", "-", "Z likewise", 0)
        .scalar("beta", "s", "diagonal entry of the stage formula; 0 outside of a step", fixed=True)
        .build(),
        "friction_stage": new("friction_stage")
        .scalar("Y", "-", "Y that the earlier stages of the step give; Y itself outside of a step")
        .scalar("Z", "-", "Z likewise", 0)
        .scalar("tau", "s", "beta + T, with beta the diagonal entry of the stage formula; 0 outside of a step")
        .scalar("rest", "-", "T/(beta + T)")
        .build(),
        "slip": new("slip")
        .scalar("Y", "-", "Y at the start of a step whose slip determines it")
        .scalar("turn", "rad", "rotation of the body above in the step, less beta omega'")
        .scalar("beta", "s", "diagonal entry of the stage formula of that rotation")
        .build(),
        "slip_end": new("slip_end")
        .scalar("Y", "-", "Y at the end of the step")
        .scalar("N", "N", "mean of the normal forces at its ends")
        .build(),
        "friction_end": new("friction_end")
        .scalar("Y", "-", "Y at the end of the step")
        .scalar("g", "-", "friction force over -mu N: Y + T dY/dt")
        .build(),
        "slip_work": new("slip_work")
        .scalar("stored", "J", "stored in the step")
        .scalar("lost", "J", "dissipated by plastic slip in the step")
        .build(),
        "load_end": new("load_end")
        .vector("F", "N", "force of the load at one end of a step", POLAR)
        .vector("M", "N m", "its moment", AXIAL)
        .vector("d", "m", "r_nn from the base", POLAR)
        .scalar("tilt", "rad", "tilt of the top plate")
        .build(),
        "tilt": new("tilt").scalar("theta", "rad", "theta of a body, of the top plate their sum").build(),
        "load_work": new("load_work").scalar("work", "J", "work of the load over a step").build(),
        "unknowns": new("unknowns")
        .scalar("psi", "rad", "psi~, first angle of the normal's position (2.85)", 0)
        .scalar("theta", "rad", "theta~, second angle of the normal's position")
        .scalar("N", "N", "normal force")
        .build(),
        "contact": new("contact")
        .vector("M", "N m", "moment about the sphere centre, basis of the body below", AXIAL)
        .scalar("dY", "1/s", "dY/dt (3.18)")
        .scalar("dZ", "1/s", "dZ/dt (3.18)", 0)
        .scalar("N", "N", "normal force")
        .scalar("Y", "-", "Y (3.18)")
        .scalar("Z", "-", "Z (3.18)", 0)
        .scalar("sp", "-", "sin psi~", 0)
        .scalar("cp", "-", "cos psi~", 1)
        .scalar("st", "-", "sin theta~")
        .scalar("ct", "-", "cos theta~")
        .scalar("u", "m/s", "slip velocity along t~1 (2.98)")
        .scalar("v", "m/s", "slip velocity along t~2 (2.98)", 0)
        .scalar("drill", "W", "power of the drilling moment", 0)
        .scalar("YY", "1/s", "d(dY/dt)/dY at constant slip velocity")
        .scalar("YZ", "1/s", "d(dY/dt)/dZ", 0)
        .scalar("ZY", "1/s", "d(dZ/dt)/dY", 0)
        .scalar("ZZ", "1/s", "d(dZ/dt)/dZ", 0)
        .build(),
        "surface_results": new("surface_results")
        .scalar("dY", "1/s", "dY/dt (3.18)")
        .scalar("dZ", "1/s", "dZ/dt (3.18)", 0)
        .scalar("N", "N", "normal force")
        .build(),
        "friction_rates": new("friction_rates")
        .scalar("dY", "1/s", "dY/dt (3.18)")
        .scalar("dZ", "1/s", "dZ/dt (3.18)", 0)
        .build(),
        "report_contact": new("report_contact")
        .vector("p", "N", "N + F_f, basis of the body below (3.15)-(3.17)", POLAR)
        .vector("M", "N m", "moment about the sphere centre, same basis", AXIAL)
        .scalar("dY", "1/s", "dY/dt (3.18)")
        .scalar("dZ", "1/s", "dZ/dt (3.18)", 0)
        .build(),
    }


def _rim_coordinates(new: Maker, uplift: bool) -> Block:
    """Coordinates of the gap of a rim: the tilts of the body above, and with uplift the separation."""
    builder = (
        new("rim_coordinates")
        .scalar("psi", "rad", "psi of the body above", 0)
        .scalar("theta", "rad", "theta of the body above")
        .scalar("psi1", "rad/s", "its rate", 0)
        .scalar("theta1", "rad/s", "its rate")
    )
    if uplift:
        builder.vector("d", "m", "separation delta, basis of the body below", POLAR)
        builder.vector("d1", "m/s", "rate of these components", POLAR)
    return builder.build()


def _rims(new: Maker, uplift: bool) -> dict[str, Block]:
    """Gap, rim and unilateral contact of a surface."""
    return {
        "rim": new("rim")
        .vector("f", "N", "F_c (3.22), basis of the body below", POLAR)
        .vector("M", "N m", "its moment about the sphere centre, same basis", AXIAL)
        .scalar("g", "m", "gap (3.21)")
        .scalar("dg", "m/s", "d gap/dt (2.102)")
        .scalar("fc", "N", "signed magnitude k g + c dg/dt (3.23)")
        .build(),
        "rim_coordinates": _rim_coordinates(new, uplift),
        "rim_wrench": new("rim_wrench")
        .vector("F", "N", "F_c on the body above, along E1, E2, E3", POLAR)
        .vector("T", "N m", "F_c x delta: moment on the slider about its sphere centre, beside that of the rim", AXIAL)
        .build(),
        "contact_angles": new("contact_angles")
        .scalar("psi", "rad", "psi~, first angle of the normal's position (2.85)", 0)
        .scalar("theta", "rad", "theta~, second angle of the normal's position")
        .build(),
        "gap": new("gap").scalar("s", "m", "sliding displacement (3.20)").scalar("g", "m", "gap (3.21)").build(),
        "unilateral_depth": new("unilateral_depth")
        .scalar("depth", "m", "penetration; negative where the contact is open")
        .scalar("beyond", "m", "how far s + c depth ds/dt points out of the footprint; positive: edge contact")
        .build(),
        "unilateral": new("unilateral")
        .vector("F", "N", "force on the body above, along E1, E2, E3", POLAR)
        .vector("T", "N m", "moment on the slider about its sphere centre, of F through the other centre", AXIAL)
        .scalar("stored", "J", "elastic energy")
        .scalar("lost", "W", "power dissipated; where the contact lets go, what its spring releases")
        .scalar("penetration", "m", "of the slider, positive")
        .build(),
    }


def _powers(new: Maker) -> dict[str, Block]:
    """Energies of springs and powers of the energy balance."""
    return {
        "friction_power": new("friction_power")
        .scalar("stored", "W", "stored and recoverable")
        .scalar("damped", "W", "dissipated by contact damping")
        .scalar("lost", "W", "dissipated by plastic slip and by the drilling moment")
        .build(),
        "rim_motion": new("rim_motion").scalar("g", "m", "gap (3.21)").scalar("dg", "m/s", "d gap/dt (2.102)").build(),
        "rim_energy": new("rim_energy")
        .scalar("stored", "J", "energy of the spring")
        .scalar("lost", "W", "power dissipated by the damper")
        .build(),
        "restraint": new("restraint")
        .scalar("stored", "J", "energy of the springs of the top")
        .scalar("settlement", "m", "compression of its vertical spring")
        .build(),
        "top_power": new("top_power")
        .scalar("load", "W", "power of the load, relative to the base")
        .scalar("prescribed", "W", "power of the moving ends of the springs and dampers of a rig")
        .scalar("support", "W", "power of a rotating support, and of the spring against spin")
        .scalar("damped", "W", "power dissipated by the dampers")
        .build(),
        "unilateral_energy": new("unilateral_energy")
        .scalar("stored", "J", "elastic energy of the unilateral contacts")
        .scalar("lost", "W", "power dissipated there")
        .build(),
        "works": _works(new),
        "lock": new("lock").scalar("moment", "N m", "axial moment that locks the spin").build(),
        "power": new("power").scalar("power", "W", "power").build(),
    }


def _works(new: Maker) -> Block:
    """The integrands of the works (`contract.WORKS`), and two parts of that of the input."""
    builder = new("works")
    for word in contract.WORKS:
        builder.scalar(word.name, "W", f"power: {word.meaning}")
    builder.scalar("prescribed", "W", "power of all that moves as prescribed")
    builder.scalar("load", "W", "power of the load, relative to the moving base")
    return builder.build()


def _ends(new: Maker) -> dict[str, Block]:
    """Ends of a two-port: their rotations, in space also where the model is planar, the interface, the wrenches."""
    turn, angles = new("turn"), new("rotation_angles")
    for order, per in enumerate(("", "/s", "/s^2")):
        suffix = str(order or "")
        turn.vector(f"r{suffix}", f"rad{per}", f"rotation vector, derivative {order} in time", (None, None, None))
        for name in ("psi", "theta", "phi"):
            angles.scalar(f"{name}{suffix}", f"rad{per}", f"{name}, derivative {order} in time")
    far_end = (
        new("far_end")
        .vector("u", "m", "displacement of the far side of the interface", POLAR)
        .vector("v", "m/s", "its rate", POLAR)
        .vector("a", "m", "where the springs of the top are fixed: a displacement of the far side", POLAR, fixed=True)
        .vector("rest", "m", "position of the far side at u = 0: r_nn at rest", POLAR, fixed=True)
        .scalar("axial", "N", "axial load at rest", fixed=True)
    )
    wrench = (
        new("end_wrench")
        .vector("F", "N", "force that the end exerts on the bearing", POLAR)
        .vector("M", "N m", "moment about the present position of the end", AXIAL)
    )
    built = {"turn": turn, "rotation_angles": angles, "far_end": far_end, "end_wrench": wrench}
    return {name: builder.build() for name, builder in built.items()}


def _balances(new: Maker) -> dict[str, Block]:
    """Residuals of the balances of a body."""
    return {
        "linear": new("linear")
        .vector("r", "N", "(3.26), (3.28): left side less right side, along E1, E2, E3", POLAR)
        .build(),
        "angular": new("angular")
        .vector("r", "N m", "(3.27), (3.29): left side less right side, along t_1, t_2, t_3", AXIAL)
        .build(),
        "balances": new("balances")
        .vector("F", "N", "linear balance of a body, along E1, E2, E3", POLAR)
        .vector("M", "N m", "angular balance, along t_1, t_2, t_3", AXIAL)
        .build(),
    }


def make_blocks(planar: bool, uplift: bool) -> Blocks:
    """The blocks of a planar or spatial model, with or without uplift."""

    def new(name: str) -> BlockBuilder:
        return BlockBuilder(name, planar)

    return Blocks(
        **_parameters(new),
        **_motion(new, uplift),
        **_interfaces(new),
        **_rims(new, uplift),
        **_powers(new),
        **_ends(new),
        **_balances(new),
        **_top(new),
    )
