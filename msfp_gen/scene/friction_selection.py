"""Selection of the friction law from the parameters of a bearing, and the criteria of the monitor of heat."""

from __future__ import annotations

from math import log
from typing import TYPE_CHECKING

from msfp_gen.scene.friction_parameters import derived_parameters, law_parameters
from msfp_gen.specification.friction_laws import HEAT, Law

if TYPE_CHECKING:
    from msfp_gen.scene.bearing import Bearing


def select_friction(bearing: Bearing, text: str | None) -> str:
    """The word of the friction law whose parameters the surfaces have. text: formula of a custom law, or None.

    Parameters of pressure, velocity and temperature select "pv": the monitor of heat adds temperature when needed.
    """
    if text is not None:
        return "custom"
    words = {"pv": "reference_pressure", "velocity": "friction_slow"}
    found = (w for w, name in words.items() if any(getattr(s, name) is not None for s in bearing.surfaces))
    return next(found, "constant")


def thermal_softening(law: Law | None, bearing: Bearing) -> float:
    """Largest relative decrease of a friction coefficient per kelvin, at the start temperature [1/K].

    It follows from the temperature factor of Kumar et al. (2015), which is steepest there. Where the surfaces do not
    have its parameters, the published values are used.
    """
    slopes = []
    for index, surface in enumerate(bearing.surfaces):
        found = {} if law is None else law_parameters(law, bearing, index)
        ratio, start = found.get("temperature_ratio", 0.7), found.get("start_temperature", 20.0)
        power = ratio ** (start / 50.0)
        slopes.append(abs(log(ratio)) / 50.0 * power / (power + 0.4) if surface.friction > 0 else 0.0)
    return max(slopes)


def heated_contacts(bearing: Bearing) -> list[tuple[float, float]]:
    """sqrt(D/pi)/k over the contact area of every surface, with the defaults of `HEAT` [K s^1/2/J]; and the sliding
    displacement up to which the contact covers the centre of the surface [m].

    Both are 0 where the contact area is not known.
    """
    out = []
    for index, surface in enumerate(bearing.surfaces):
        radius = surface.patch_radius or bearing.slider_rim_radius(index)
        given = {name: getattr(surface, name) or default for name, default in HEAT.items()}
        found = derived_parameters({**given, "patch_radius": radius or None})
        out.append((found["heating"] / found["area"], found["reach"]) if radius else (0.0, 0.0))
    return out
