"""Units at the input edge: "112 kN" becomes 112000.0. Inside the package everything is SI.

Pint is slow to import, so it is touched only when a string with a unit is met. The text is matched against a small
grammar before pint sees it: a scene file is data and nothing in it is evaluated.
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

# Pint calls radians dimensionless and would take 0.1 Hz for 0.1 rad/s without a word, so angles are told apart here.
_ANGLE = re.compile(r"(?<![A-Za-z])(?:[mµμ]?rad(?:ian)?s?|deg(?:ree)?s?|°|turns?|rev(?:olution)?s?|rpm)(?![A-Za-z])")
_ANGULAR = {"rad", "rad/s"}
_NOT_ANGULAR = {"Hz"}

# Pint reads g as gram and gal as gallon; for an acceleration neither can be meant.
_ACCELERATION_NAMES = {"g": "standard_gravity", "gal": "Gal"}
_PERCENT = {"%": 0.01, "percent": 0.01}


def to_si(text: str, unit: str) -> float:
    """The number that `text` gives in the SI `unit` ("" for a plain number, for which only % may stand).

    Raises ValueError with the remedy where the text is no quantity or has another dimension; the caller adds the
    field and the value.
    """
    wanted = f"give a number [{unit}] or a text with a unit of [{unit}]" if unit else "give a plain number"
    match = _TEXT.fullmatch(text)
    if match is None:
        raise ValueError(f"this is no number with a unit; {wanted}")
    number, given = float(match[1]), match[2]
    if given is None:
        raise ValueError(f"this text names no unit; {wanted}")
    if not unit:
        if given not in _PERCENT:
            raise ValueError(f"this field has no unit; {wanted}")
        return number * _PERCENT[given]
    angular = _ANGLE.search(given) is not None
    if (unit in _ANGULAR and not angular) or (unit in _NOT_ANGULAR and angular):
        raise ValueError(f"the unit {given!r} is not a unit of [{unit}]; {wanted}")
    return _convert(number, given, unit, wanted)


def _convert(number: float, given: str, unit: str, wanted: str) -> float:
    import pint

    name = given
    if unit == "m/s^2":
        name = re.sub(r"[A-Za-z_]+", lambda word: _ACCELERATION_NAMES.get(word[0], word[0]), name)
    try:
        return float(_registry().Quantity(number, name.replace("⋅", "·").replace("·", "*")).to(unit).magnitude)
    except pint.DimensionalityError:
        raise ValueError(f"the unit {given!r} is not a unit of [{unit}]; {wanted}") from None
    except Exception:  # pint raises many kinds for a text it cannot read
        raise ValueError(f"the unit {given!r} is unknown; {wanted}") from None


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()
