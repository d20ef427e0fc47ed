"""Conversion of input texts with units to SI: "112 kN" becomes 112000.0. All other code uses SI only.

Pint is slow to import, so it is imported only for a text with a unit. Pint would evaluate expressions, so a text must
first match a small grammar of numbers and units: nothing in a scene file is executed.
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Any

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_TERM = r"[A-Za-zµμ°%_]+(?:(?:\^|\*\*)-?\d)?[²³]?"
_PRODUCT = rf"{_TERM}(?:\s*[*·⋅]\s*{_TERM}|\s+{_TERM})*"
_FACTOR = rf"(?:\s*[*/·⋅]\s*{_TERM}|\s+{_TERM}|\s*/\s*\(\s*{_PRODUCT}\s*\))"
_TEXT = re.compile(rf"\s*({_NUMBER})\s*((?:1\s*/\s*)?{_TERM}{_FACTOR}*)?\s*")

# Pint treats radians as dimensionless and would accept 0.1 Hz for 0.1 rad/s, so angular units are checked here.
_ANGLE = re.compile(r"(?<![A-Za-z])(?:[mµμ]?rad(?:ian)?s?|deg(?:ree)?s?|°|turns?|rev(?:olution)?s?|rpm)(?![A-Za-z])")
_ANGULAR = {"rad", "rad/s"}
_NOT_ANGULAR = {"Hz"}

# Pint reads g as gram and gal as gallon; in an acceleration they are the standard gravity and cm/s^2.
_ACCELERATION_NAMES = {"g": "standard_gravity", "gal": "Gal"}
_PERCENT = {"%": 0.01, "percent": 0.01}


def to_si(text: str, unit: str) -> float:
    """The value of a quantity such as "75 mm", in SI.

    Args:
        text: a number and its unit.
        unit: SI unit of the result; "" for a plain number, which may be given in percent.

    Raises:
        ValueError: the text is not a quantity, or has another dimension. The message states the remedy; the caller
            adds the field and the value.
    """
    remedy = f"give a number [{unit}] or a text with a unit of [{unit}]" if unit else "give a plain number"
    match = _TEXT.fullmatch(text)
    if match is None:
        raise ValueError(f"this is no number with a unit; {remedy}")
    number, unit_text = float(match[1]), match[2]
    if unit_text is None:
        raise ValueError(f"this text names no unit; {remedy}")
    if not unit:
        if unit_text not in _PERCENT:
            raise ValueError(f"this field has no unit; {remedy}")
        return number * _PERCENT[unit_text]
    angular = _ANGLE.search(unit_text) is not None
    if (unit in _ANGULAR and not angular) or (unit in _NOT_ANGULAR and angular):
        raise ValueError(f"the unit {unit_text!r} is not a unit of [{unit}]; {remedy}")
    return _convert(number, unit_text, unit, remedy)


def _convert(number: float, unit_text: str, unit: str, remedy: str) -> float:
    import pint

    name = unit_text
    if unit == "m/s^2":
        name = re.sub(r"[A-Za-z_]+", lambda word: _ACCELERATION_NAMES.get(word[0], word[0]), name)
    try:
        return float(_registry().Quantity(number, name.replace("⋅", "·").replace("·", "*")).to(unit).magnitude)
    except pint.DimensionalityError:
        raise ValueError(f"the unit {unit_text!r} is not a unit of [{unit}]; {remedy}") from None
    except Exception:  # pint raises several types of exception for a unit that it cannot parse
        raise ValueError(f"the unit {unit_text!r} is unknown; {remedy}") from None


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()
