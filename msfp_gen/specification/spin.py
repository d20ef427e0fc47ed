"""What resists the spin of the two bodies of a surface against each other. `Effects.spin` selects it by name.

A formula gives the drilling moment about the contact normal. Its derivatives, its power, its part in the momentum
balances and the columns of the C arrays follow from it.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass
from functools import cached_property

from msfp_gen.common.fields import Quantity
from msfp_gen.specification.formula import parse
from msfp_gen.specification.values import Value

VARIABLES = (
    Value("mu", Quantity(""), "friction coefficient"),
    Value("N", Quantity("N"), "normal force"),
    Value("r", Quantity("m"), "radius of the rim of the slider"),
    Value("w", Quantity("rad/s"), "spin of the body above against the body below, about the contact normal"),
)
"""What a formula may contain besides the numbers of the surface."""


@dataclass(frozen=True)
class Spin:
    """One way in which spin is resisted.

    Attributes:
        meaning: text for help and explanations.
        moment: formula of the moment on the body above, about the contact normal [N m]; empty: none.
        values: numbers of the surface in the formula, which must be given.
        locked: whether bodies do not spin at all.
    """

    meaning: str
    moment: str = ""
    values: tuple[str, ...] = ()
    locked: bool = False

    @cached_property
    def tree(self) -> ast.expr:
        """Syntax tree of the moment."""
        return parse(self.moment, {*(variable.name for variable in VARIABLES), *self.values})


SPIN = {
    "locked": Spin("bodies do not turn about their own axis", locked=True),
    "patch": Spin(
        "a drilling moment over the contact patch resists spin",
        "-2 / 3 * mu * r * N * w / sqrt(w ** 2 + 0.01 ** 2)",  # w_0 = 0.01 rad/s: docs/model.md
    ),
    "free": Spin("no moment resists spin, as in PEER 2017/07"),
}
_NUMBERS: tuple[Value, ...] = ()
NUMBERS = {value.name: value for value in _NUMBERS}
"""Every number of a surface in a formula."""
