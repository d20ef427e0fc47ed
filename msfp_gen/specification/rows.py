"""What a run records, in order: the fields of a row of output, and the extremes over all of its steps."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

from msfp_gen.specification.friction_laws import TEMPERATURE

if TYPE_CHECKING:
    from msfp_gen.specification.layout import Effects


class Extent(StrEnum):
    """Length of a dimension of a row's field that the model decides: the macro of the C header."""

    SURFACES = "MSFP_NB"  # n - 1: moving bodies, or surfaces
    COORDINATES = "MSFP_NQ"  # psi, theta, phi; in models with uplift then the separation along E1, E2, E3
    WORKS = "MSFP_WORKS"  # integrals over the run, `WORKS`


@dataclass(frozen=True)
class Quantity:
    """One field of a row of output. needs: the feature of a model without which it is absent ("" for none)."""

    name: str
    shape: tuple[Extent | int, ...]
    unit: str
    meaning: str
    needs: str = ""


_N = Extent.SURFACES
_MOTION = (_N, Extent.COORDINATES)
_ROW = (
    Quantity("time", (), "s", "time"),
    Quantity("q", _MOTION, "rad, m", "coordinates of the moving bodies: psi, theta, phi, then the separation"),
    Quantity("v", _MOTION, "rad/s, m/s", "their rates"),
    Quantity("a", _MOTION, "rad/s^2, m/s^2", "their second derivatives"),
    Quantity("f", (_N, 2), "-", "friction state Y, Z"),
    Quantity("normal", (_N,), "N", "normal force"),
    Quantity("angles", (_N, 2), "rad", "contact position psi~, theta~"),
    Quantity("sliding", (_N,), "m", "sliding displacement (3.20)"),
    Quantity("gap", (_N,), "m", "gap to the rim (3.21)"),
    Quantity("rim", (_N,), "N", "rim force, compression positive"),
    Quantity("force", (_N, 3), "N", "interface force on the body above"),
    Quantity("slip", (_N, 2), "m/s", "slip velocity u~, v~ (2.98)"),
    Quantity("compression", (_N,), "m", "compression of the unilateral contact; negative: open", "uplift"),
    Quantity("base", (3,), "m", "displacement of the base"),
    Quantity("top", (3,), "m", "position of r_nn at the top plate"),
    Quantity("top_force", (3,), "N", "force of the bearing on the top support"),
    Quantity("top_moment", (3,), "N m", "moment of the bearing on the top support at r_nn"),
    Quantity("top_settlement", (), "m", "compression of the vertical spring of the top"),
    Quantity("kinetic", (), "J", "kinetic energy relative to the base"),
    Quantity("potential", (), "J", "potential energy"),
    Quantity("restraint", (), "J", "energy of the springs of the top"),
    Quantity("rim_stored", (), "J", "energy of the springs of the rims"),
    Quantity("seat_stored", (), "J", "energy of the springs of the unilateral contacts"),
    Quantity("work", (Extent.WORKS,), "J", "integrals over the run"),
    Quantity("mu", (_N,), "-", "friction coefficient", "law"),
    Quantity("temperature", (_N,), "degC", "temperature of the surface", "heat"),
    Quantity("memory", (_N,), "-", "what the surface remembers, on which its friction law depends", "memory"),
)


_EXTREMES = (
    Quantity("displacement", (4,), "m", "largest magnitude along E1, E2, E3 and in the horizontal plane"),
    Quantity("top_force", (4,), "N", "largest magnitude along E1, E2, E3 and in the horizontal plane"),
    Quantity("sliding", (_N,), "m", "largest sliding displacement"),
    Quantity("gap", (_N,), "m", "least gap to the rim"),
    Quantity("slip_speed", (_N,), "m/s", "largest slip velocity"),
    Quantity("least_normal", (_N,), "N", "least normal force"),
    Quantity("most_normal", (_N,), "N", "largest normal force"),
    Quantity("least_friction", (_N,), "-", "least friction coefficient", "law"),
    Quantity("most_friction", (_N,), "-", "largest friction coefficient", "law"),
    Quantity("temperature", (_N,), "degC", "highest temperature", "heat"),
)


def row(effects: Effects) -> tuple[Quantity, ...]:
    """Fields of a row of a model with these effects, in order."""
    return _present(_ROW, effects)


def extremes(effects: Effects) -> tuple[Quantity, ...]:
    """Extremes that a run of a model with these effects records over all of its steps, in order."""
    return _present(_EXTREMES, effects)


def _present(quantities: tuple[Quantity, ...], effects: Effects) -> tuple[Quantity, ...]:
    law, memory = effects.law, None if effects.law is None else effects.law.memory
    has = {
        "": True,
        "uplift": effects.uplift,
        "law": law is not None,
        "heat": memory is TEMPERATURE,
        "memory": memory not in (None, TEMPERATURE),
    }
    return tuple(quantity for quantity in quantities if has[quantity.needs])
