"""Laws of the friction coefficient as data: each a formula over what a surface feels and the numbers it carries.

A formula has the names of `VARIABLES` and of the fields of `Surface`; `mu` is the coefficient of reference,
`Surface.friction`. Everything else follows from the formula: which numbers a surface must carry, and whether it needs
a pressure or a temperature. The generator derives from the same formula; `law_numbers` puts numbers into it.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass
from functools import cached_property, lru_cache

from msfp_gen.errors import InputError
from msfp_gen.law_text import names_in, parse, units_of

COEFFICIENTS = ("c1", "c2", "c3", "c4")
# What a law may depend on: sliding velocity, pressure, temperature and normal force, with their units.
VARIABLES = {"v": "m/s", "p": "Pa", "T": "degC", "N": "N"}
# Numbers of a surface that a variable brings with it, with their defaults; the slider's rim gives the patch its radius.
PATCH: dict[str, float | None] = {"patch_radius": None}
HEAT_TIMES = (1e-3, 1e3)  # times over which the heat of friction is followed [s]
HEAT: dict[str, float | None] = {"conductivity": 18.0, "diffusivity": 4.44e-6, "start_temperature": 20.0}

NUMBERS: dict[str, tuple[str, str]] = {
    "friction_slow": ("-", "friction coefficient at rest"),
    "velocity_rate": ("s/m", "a, how fast friction rises with the slip velocity"),
    "velocity_drop": ("-", "share of friction that is missing at rest"),
    "reference_pressure": ("Pa", "pressure at which mu is given"),
    "pressure_ratio": ("-", "factor on friction for 50 MPa more"),
    "temperature_ratio": ("-", "0.7 in Kumar et al. (2015); 1: temperature does not matter"),
    "area": ("m^2", "of the contact patch"),
    "reach": ("m", "how far from the centre of the surface the patch still covers it"),
    "heating": ("K s^1/2 m^2/J", "sqrt(D/pi)/k of the half-space that is heated"),
    "start_temperature": ("degC", "temperature at the start"),
    **dict.fromkeys(COEFFICIENTS, ("SI", "parameter of the law")),
}
"""Unit and meaning of every number that a law takes or makes of them."""


@dataclass(frozen=True)
class Law:
    """A law: what it means, its formula, and the numbers of a surface in it with their defaults (None: must be given).

    beside: numbers that a surface may carry all the same, for a wider law that may follow (docs/effects.md).
    """

    word: str
    meaning: str
    text: str
    values: tuple[tuple[str, float | None], ...]
    beside: tuple[str, ...] = ()

    @cached_property
    def tree(self) -> ast.expr:
        """The formula, read."""
        return parse(self.text, {"mu", *VARIABLES, *(name for name, _ in self.values)})

    @cached_property
    def heats(self) -> bool:
        """Whether the coefficient depends on temperature."""
        return "T" in names_in(self.tree)

    @cached_property
    def takes(self) -> dict[str, float | None]:
        """Numbers of a surface that the law takes, with their defaults."""
        needs_patch = self.heats or "p" in names_in(self.tree)
        return {**dict(self.values), **(PATCH if needs_patch else {}), **(HEAT if self.heats else {})}

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """Numbers of one surface in the order in which the compiled model takes them."""
        patch = ("area",) if "patch_radius" in self.takes else ()
        heat = ("reach", "heating", "start_temperature") if self.heats else ()
        return (*(name for name, _ in self.values), *patch, *heat)


_VELOCITY = "mu - (mu - friction_slow) * exp(-velocity_rate * v)"
_PVT = (
    "mu * pressure_ratio ** ((p - reference_pressure) / 50e6) * (1 - velocity_drop * exp(-velocity_rate * v))"
    " * (temperature_ratio ** (T / 50) + 0.4) / (temperature_ratio ** (20 / 50) + 0.4)"
)
_AT_START = _PVT.replace("T /", "start_temperature /")
_NUMBERS: tuple[tuple[str, float | None], ...] = (
    ("reference_pressure", None), ("pressure_ratio", 0.7), ("velocity_drop", 0.5), ("velocity_rate", 100.0),
    ("temperature_ratio", 0.7),
)  # fmt: skip
_LAWS = (
    Law("velocity", "it rises with the sliding velocity, exponentially from friction_slow to friction",
        _VELOCITY, (("friction_slow", None), ("velocity_rate", None))),
    Law("pv", "it follows pressure and velocity (Kumar et al. 2015), at the temperature of the start",
        _AT_START, (*_NUMBERS, ("start_temperature", HEAT["start_temperature"])), tuple(HEAT)),
    Law("pvt", "it follows pressure, velocity and temperature (Kumar et al. 2015)", _PVT, _NUMBERS),
)  # fmt: skip
BUILT_IN = {law.word: law for law in _LAWS}
FRICTION = {
    "constant": "the friction coefficient does not change",
    **{law.word: law.meaning for law in _LAWS},
    "custom": "it follows the formula below",
}
"""The words of `Effects.friction` and what they mean."""


@lru_cache(maxsize=32)
def law_of(word: str, text: str | None = None) -> Law | None:
    """The law of `Effects.friction` and `Effects.friction_law`; None for constant friction. Raises InputError."""
    if word != "custom":
        if text is not None:
            raise InputError(f"effects.friction_law = {text!r}: friction = {word!r} has a formula of its own; "
                             "give friction = 'custom', or leave it out")  # fmt: skip
        return BUILT_IN.get(word)
    if text is None:
        raise InputError(
            "effects.friction_law is missing: friction = 'custom' needs a formula, "
            "such as 'mu * (1 - c1 * exp(-c2 * v))'"
        )
    try:
        tree = parse(text, {"mu", *VARIABLES, *COEFFICIENTS})
        units_of(tree, COEFFICIENTS)
    except ValueError as error:
        raise InputError(f"effects.friction_law = {text!r}: {error}") from None
    values = tuple((name, None) for name in COEFFICIENTS if name in names_in(tree))
    return Law("custom", FRICTION["custom"], ast.unparse(tree), values)


def own_numbers() -> tuple[str, ...]:
    """Fields of `Surface` that belong to some law: None on a surface of constant friction."""
    known = dict.fromkeys(name for law in BUILT_IN.values() for name in law.takes)
    return (*known, *COEFFICIENTS)
