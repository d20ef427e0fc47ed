"""Hysteresis laws of friction. `Effects.bouc_wen` selects one by name.

Bouc-Wen (3.18): dY/dt = (u - Y (a Y u + b Z v))/d_y and dZ/dt = (v - Z (a Y u + b Z v))/d_y, where u, v are the
components of the slip velocity. A law gives the switches a, b, each 0 or 1, from the products Y u and Z v. They are 1
where the friction state grows and 0 where it unloads elastically.

Elastic-perfectly plastic: (Y, Z) follows the slip over d_y and is projected onto the unit disc (radial return).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple


class Hysteresis(NamedTuple):
    """One hysteresis law.

    Attributes:
        meaning: text for help and explanations.
        switches: function of Y u [m/s], Z v [m/s] and `step` that returns (a, b); `step` is the Heaviside function, 1
            for a positive argument and 0 otherwise. None: elastic-perfectly plastic, which has no switches.
    """

    meaning: str
    switches: Callable[[Any, Any, Callable[[Any], Any]], tuple[Any, Any]] | None


HYSTERESIS = {
    "report": Hysteresis(
        "one switch for each axis (2.94)-(2.98)",
        lambda yu, zv, step: (step(yu), step(zv)),
    ),
    "isotropic": Hysteresis(
        "one switch along the slip velocity, the same in every direction",
        lambda yu, zv, step: (step(yu + zv),) * 2,
    ),
    "plastic": Hysteresis("elastic-perfectly plastic: no creep under small cycles, friction along the slip", None),
}


class _Product:
    """Stands for Y u when a law is inspected: adding zero returns it, and any other operation raises TypeError."""

    def __add__(self, other: object) -> _Product:
        return self if other == 0 else NotImplemented

    __radd__ = __add__


def is_plastic(law: str) -> bool:
    """Whether a law is elastic-perfectly plastic."""
    return HYSTERESIS[law].switches is None


def has_closed_form(law: str) -> bool:
    """Whether the friction state in the plane, where Z v = 0, is a function of the slip in closed form.

    It is a tanh where the switch is a = step(Y u), and a bounded line where the law is plastic.
    """
    switches = HYSTERESIS[law].switches
    if switches is None:
        return True
    yu, step_of_yu = _Product(), object()
    try:
        switch = switches(yu, 0, lambda x: step_of_yu if x is yu else None)[0]
    except TypeError:  # the switch is another expression of Y u
        return False
    return switch is step_of_yu
