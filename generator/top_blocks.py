"""The blocks of the top: what stands on the top plate, and what it exerts on it."""

from __future__ import annotations

from .program import AXIAL, POLAR, Block, Maker


def top_blocks(new: Maker) -> dict[str, Block]:
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
        "foot_before": new("foot_before")
        .scalar("y", "m", "y of the foot less beta^2 y'', what the earlier stages give; y outside of a step")
        .scalar("y1", "m/s", "its rate less beta y''; y' outside of a step")
        .scalar("beta", "s", "diagonal entry of the stage formula; 0 outside of a step")
        .build(),
        "resting_foot": new("resting_foot")
        .scalar("y", "m", "height of the foot at rest, or of the fixed end of the spring")
        .scalar("y1", "m/s", "its velocity")
        .build(),
        "foot_stage": new("foot_stage")
        .scalar("y", "m", "as in foot_before")
        .scalar("y1", "m/s", "as in foot_before")
        .scalar("beta", "s", "the same where a mass rests on the spring; else 0")
        .scalar("mobility", "1/kg", "1/(m + c beta + k beta^2); 0 where no mass rests on the spring")
        .scalar("share", "-", "m times mobility; 1 where no mass rests on the spring")
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
