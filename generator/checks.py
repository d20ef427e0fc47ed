"""The checks of the C interface as text: the ranges and limits of the contract, which Python checks too."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from math import inf
from typing import TYPE_CHECKING, Any

from msfp_gen.specification import contract
from msfp_gen.specification.heat_kernel import LONGEST

from .interface import surface_values

if TYPE_CHECKING:
    from msfp_gen.specification.layout import ModelSpec
    from msfp_gen.specification.values import Bound, Value

_IN_C = {"pi": "MSFP_PI", "asin": "msfp_asin"}  # words of a limit that are no values


def checks_context(spec: ModelSpec) -> dict[str, Any]:
    """What the template of the checks needs."""
    surface = surface_values(spec)
    words = _IN_C | {
        value.name: f"{kind}[{_index(kind, value)}]"
        for kind, values in (("body", contract.BODY), ("surface", surface))
        for value in values
    }
    return {
        "largest_friction_state": repr(contract.LARGEST_FRICTION_STATE),
        "longest_heating": repr(LONGEST),
        "max_rows": repr(contract.MAX_ROWS),
        "ranges": {
            "body": [_range(value, "bodies: ", _index("body", value)) for value in contract.BODY],
            "surface": [_range(value, "surfaces: ", _index("surface", value)) for value in surface],
            "top": [_range(value, "top: ", _index("top", value)) for value in contract.TOP],
            "top_mass": [_range(value, "top: ", _index("top", value)) for value in contract.TOP_MASS],
            "interface": [_range(value, "bearing: top: ", _index("top", value)) for value in contract.INTERFACE],
            "gravity": [_range(contract.GRAVITY)],
            "axial_load": [_range(contract.AXIAL_LOAD)],
            "scene": [_range(value, at=_place(value)) for value in contract.RUN],
        },
        "arrays": [(*_range(value, at=_place(value)), value.count, int(value.default)) for value in contract.ARRAYS],
        "bounds": {
            "body": list(_bounds(contract.BODY_BOUNDS, "bodies", words)),
            "surface": list(_bounds(contract.SURFACE_BOUNDS, "surfaces", words)),
        },
    }


def _index(kind: str, value: Value) -> str:
    return f"MSFP_{kind}_VALUES_{value.name}".upper()


def _place(value: Value) -> str:
    return f"offsetof(msfp_scene, {value.name})"


def _range(value: Value, of: str = "", at: str = "0") -> tuple[str, str, str, int, int, str]:
    """Where it is, the least and the largest number, whether 0 is one too, whether the base has none, the message."""
    rule, (least, most) = value.rule, value.rule.limits
    if rule.computed:  # any that is as large as that
        least, most = (-inf if least < 0 else least), inf
    message = f"{of}{value.name.partition('[')[0]}: {rule.remedy_with_limits}"
    message += f"; 0: {value.zero}" if value.zero else ""
    return at, _number(least), _number(most), int(bool(value.zero)), int(not value.base), message


def _number(x: float) -> str:
    return repr(x).replace("inf", "INFINITY")


def _bounds(bounds: Iterable[Bound], of: str, words: Mapping[str, str]) -> Iterable[tuple[str, str]]:
    """Condition and message of each."""
    for bound in bounds:
        limit = re.sub(r"[a-z]\w*", lambda word: words[word[0]], bound.limit)
        sign = "<" if bound.open else "<="
        yield f"{words[bound.name]} {sign} {limit}", f"{of}: {bound.name}: {bound.remedy}"
