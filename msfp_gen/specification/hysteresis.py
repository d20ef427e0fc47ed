"""Hysteresis laws of friction: the switches of the Bouc-Wen equations (3.18). `Effects.bouc_wen` selects one by name.

dY/dt = (u - Y (a Y u + b Z v))/d_y and dZ/dt = (v - Z (a Y u + b Z v))/d_y, where u, v are the components of the slip
velocity. A law gives the switches a, b, each 0 or 1, from the products Y u and Z v. They are 1 where the friction state
grows and 0 where it unloads elastically.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple


class Hysteresis(NamedTuple):
    """One hysteresis law.

    Attributes:
        meaning: text for help and explanations.
        switches: function of Y u [m/s], Z v [m/s] and `step` that returns (a, b); `step` is the Heaviside function, 1
            for a positive argument and 0 otherwise.
    """

    meaning: str
    switches: Callable[[Any, Any, Callable[[Any], Any]], tuple[Any, Any]]


HYSTERESIS = {
    "report": Hysteresis(
        "one switch for each axis (2.94)-(2.98)",
        lambda yu, zv, step: (step(yu), step(zv)),
    ),
    "isotropic": Hysteresis(
        "one switch along the slip velocity, the same in every direction",
        lambda yu, zv, step: (step(yu + zv),) * 2,
    ),
}


class _Product:
    """Stands for Y u when a law is inspected: adding zero returns it, and any other operation raises TypeError."""

    def __add__(self, other: object) -> _Product:
        return self if other == 0 else NotImplemented

    __radd__ = __add__


def integrates_to_tanh(law: str) -> bool:
    """Whether (3.18) in the plane, where Z v = 0, integrates to a tanh of the slip: the switch is a = step(Y u)."""
    yu, step_of_yu = _Product(), object()
    try:
        switch = HYSTERESIS[law].switches(yu, 0, lambda x: step_of_yu if x is yu else None)[0]
    except TypeError:  # the switch is another expression of Y u
        return False
    return switch is step_of_yu
