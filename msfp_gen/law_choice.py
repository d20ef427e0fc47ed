"""Which law of friction the numbers of a bearing belong to, and what heat would do where the law knows none."""

from __future__ import annotations

from math import log
from typing import TYPE_CHECKING

from msfp_gen.generator.friction_laws import HEAT, Law
from msfp_gen.law_numbers import derived, numbers

if TYPE_CHECKING:
    from msfp_gen.bearing import Bearing


def friction_of(bearing: Bearing, text: str | None) -> str:
    """The law whose numbers the surfaces carry; of pressure and velocity before temperature, which a watch takes in."""
    if text is not None:
        return "custom"
    words = {"pv": "reference_pressure", "velocity": "friction_slow"}
    carried = (w for w, name in words.items() if any(getattr(s, name) is not None for s in bearing.surfaces))
    return next(carried, "constant")


def softening_of(law: Law | None, bearing: Bearing) -> float:
    """Largest relative change of the friction coefficient for each kelvin, by the law with temperature [1/K]; near the
    start, where it is steepest.
    """
    slopes = []
    for index, surface in enumerate(bearing.surfaces):
        found = {} if law is None else numbers(law, bearing, index)
        ratio, start = found.get("temperature_ratio", 0.7), found.get("start_temperature", 20.0)
        power = ratio ** (start / 50.0)
        slopes.append(abs(log(ratio)) / 50.0 * power / (power + 0.4) if surface.friction > 0 else 0.0)
    return max(slopes)


def heating_of(bearing: Bearing) -> list[float]:
    """sqrt(D/pi)/k over the area of contact of every surface [K s^1/2/J], with the defaults of `HEAT`; 0 where no area
    is known.
    """
    out = []
    for index, surface in enumerate(bearing.surfaces):
        radius = surface.patch_radius or bearing.slider_rim_radius(index)
        given = {name: getattr(surface, name) or default for name, default in HEAT.items()}
        found = derived({**given, "patch_radius": radius or None})
        out.append(found["heating"] / found["area"] if radius else 0.0)
    return out
