"""Laws of the hysteresis of friction as data: where Y, Z of (3.18) saturate. `Effects.bouc_wen` is one of their words.

dY/dt = (u - Y (a Y u + b Z v))/d_y and dZ/dt = (v - Z (a Y u + b Z v))/d_y, with the switches a, b on while friction
grows. A law gives a and b from Y u and Z v by `step`, which is 1 where its argument is positive and else 0.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple


class Hysteresis(NamedTuple):
    """What a law means, and its switches (a, b) as a function of Y u, Z v and `step`."""

    meaning: str
    switches: Callable[[Any, Any, Callable[[Any], Any]], tuple[Any, Any]]


HYSTERESIS = {
    "report": Hysteresis(
        "switches for each axis (2.94)-(2.98)",
        lambda yu, zv, step: (step(yu), step(zv)),
    ),
    "isotropic": Hysteresis(
        "one switch along the slip, the same in every direction",
        lambda yu, zv, step: (step(yu + zv),) * 2,
    ),
}


class _Symbol:
    """Y u, of which nothing is known but itself: nothing added leaves it, and all else is an error."""

    def __add__(self, other: object) -> _Symbol:
        return self if other == 0 else NotImplemented

    __radd__ = __add__


def grows_alone(law: str) -> bool:
    """Whether in the plane, where Z v = 0, the switch is on exactly while Y u > 0: then (3.18) integrates to tanh."""
    yu, on = _Symbol(), object()
    try:
        switch = HYSTERESIS[law].switches(yu, 0, lambda x: on if x is yu else None)[0]
    except TypeError:  # another expression
        return False
    return switch is on
