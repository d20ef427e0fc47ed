"""Units of variables as exponents of the base units of SI, as FMI wants them."""

from __future__ import annotations

import re

# Exponents of kg, m, s, K, rad.
BASE = ("kg", "m", "s", "K", "rad")
_KNOWN = {
    "kg": (1, 0, 0, 0, 0),
    "m": (0, 1, 0, 0, 0),
    "s": (0, 0, 1, 0, 0),
    "K": (0, 0, 0, 1, 0),
    "rad": (0, 0, 0, 0, 1),
    "N": (1, 1, -2, 0, 0),
    "J": (1, 2, -2, 0, 0),
    "W": (1, 2, -3, 0, 0),
    "Pa": (1, -1, -2, 0, 0),
}
CELSIUS = "degC"
OFFSET = 273.15  # of degC from K
_FACTOR = re.compile(r"([A-Za-z]+)(?:\^(\d+))?")


def base_units(unit: str) -> dict[str, int] | None:
    """Base unit -> exponent other than 0, of a unit such as "N m/rad" or "kg m^2"; None where it is no unit of FMI.

    Factors are separated by spaces; all after a slash divide, also after a second one.
    """
    if unit == CELSIUS:
        return {"K": 1}
    total = [0] * len(BASE)
    for i, part in enumerate(unit.split("/")):
        for factor in part.split():
            match = _FACTOR.fullmatch(factor)
            if factor == "1":
                continue
            if match is None or match[1] not in _KNOWN:
                return None
            sign = (-1 if i else 1) * int(match[2] or 1)
            total = [have + sign * each for have, each in zip(total, _KNOWN[match[1]], strict=True)]
    return {name: power for name, power in zip(BASE, total, strict=True) if power}
