"""Values of the bearing in the example of a generated folder: any layout, any effects, SI units."""

from __future__ import annotations

from typing import NamedTuple

from msfp_gen.specification import contract
from msfp_gen.specification.layout import ModelSpec

GRAVITY = 9.8  # [m/s^2]
LOAD = 500e3  # on the top plate, downwards [N]
ACCELERATION, DURATION = 0.05, 2.0  # of the base along E1 [m/s^2], [s]: 0.1 m
OUTPUT_STEP = 0.05  # [s]
STROKE = 0.1  # of the upper end of a two-port [m]

OTHER = 0.1  # numbers of friction laws and drilling moments that are not listed below
_BASE = {"height": 0.05, "centroid": 0.025}
_SLIDER = {
    "height": 0.06, "centroid": 0.03, "mass": 20.0, "inertia_transverse": 0.06, "inertia_axial": 0.1,
    "rim_radius": 0.1, "rim_offset": 0.005,
}  # fmt: skip
_PLATE = {"height": 0.05, "centroid": 0.025, "mass": 150.0, "inertia_transverse": 5.0, "inertia_axial": 10.0}
_SURFACE = {
    "radius": 1.0, "capacity": 0.15, "yield_displacement": 5e-4, "rim_stiffness": 1e7, "rim_damping": 1e3,
    "contact_damping": 1e-4, "seat_stiffness": 5e10, "seat_damping": 10.0,
    "friction_slow": 0.03, "velocity_rate": 50.0, "velocity_drop": 0.5, "reference_pressure": 15e6,
    "pressure_ratio": 0.7, "temperature_ratio": 0.7, "area": 0.03, "reach": 0.1, "heating": 6.6e-5,
    "plate_heating": 7e-6, "plate_rate": 0.01, "start_temperature": 20.0,
}  # fmt: skip
_TOP = {"stiffness": 1e9, "damping": 1e4, "rotational_stiffness": 1e8, "rotational_damping": 1e4}
_INTERFACE = _TOP | {"vertical_stiffness": 3e8, "vertical_damping": 1e5}


class Example(NamedTuple):
    """Rows of values in the order of the contract: of every body (base first), of every surface, of the top."""

    bodies: list[list[float]]
    surfaces: list[list[float]]
    top: list[float]


def example(spec: ModelSpec) -> Example:
    """Values for a model; the friction coefficient rises from surface to surface, so that they slide in turn."""
    body, top = contract.names(contract.BODY), contract.names(contract.TOP)
    surface, count = contract.surface_values(spec.effects), spec.layout.surfaces
    sliders = [_SLIDER] * (count - 1)
    edge = {name: _SLIDER[name] for name in ("rim_radius", "rim_offset")}
    # Without surfaces that are concave down, or up, the top plate or the base is a slider.
    plate, base = _PLATE | (edge if spec.layout.p == 0 else {}), _BASE | (edge if spec.layout.m == 0 else {})
    return Example(
        [[values.get(name, 0.0) for name in body] for values in (base, *sliders, plate)],
        [[(_SURFACE | {"friction": 0.05 + 0.01 * k}).get(name, OTHER) for name in surface] for k in range(count)],
        # Over one surface the top plate must tilt: a rig that holds it level would hold the bearing.
        [0.0 if count == 1 and name.startswith("rotational") else _TOP.get(name, 0.0) for name in top],
    )


def interface() -> list[float]:
    """Values of the interface of a two-port: springs and dampers in all directions."""
    return [_INTERFACE.get(name, 0.0) for name in contract.names(contract.TOP)]
