"""Laws of the friction coefficient as data: each a formula over what a surface feels and the numbers it carries.

A formula has the names of `VARIABLES` and of the fields of `Surface`; `mu` is the coefficient of reference,
`Surface.friction`. Everything else follows from the formula: which numbers a surface must carry, and whether it needs
a pressure or a temperature. The generator derives from the same formula.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import pi, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.errors import InputError
from msfp_gen.law_text import NUMBERS, fold, names_in, parse, units_of

if TYPE_CHECKING:
    from msfp_gen.bearing import Bearing, Surface

COEFFICIENTS = ("c1", "c2", "c3", "c4")
# What a law may depend on: unit, and the range over which it must be finite and positive.
VARIABLES: dict[str, tuple[str, np.ndarray[Any, np.dtype[np.float64]]]] = {
    "v": ("m/s", np.r_[0.0, np.geomspace(1e-6, 2.0, 20)]),
    "p": ("Pa", np.geomspace(1e3, 2e8, 16)),
    "T": ("degC", np.linspace(-40.0, 600.0, 17)),
    "N": ("N", np.geomspace(1.0, 1e8, 9)),
}
# Numbers of a surface that a variable brings with it, with their defaults; the slider's rim gives the patch its radius.
PATCH: dict[str, float | None] = {"patch_radius": None}
HEAT_TIMES = (1e-3, 1e3)  # times over which the heat of friction is followed [s]
HEAT: dict[str, float | None] = {"conductivity": 18.0, "diffusivity": 4.44e-6, "start_temperature": 20.0}


@dataclass(frozen=True)
class Law:
    """A law: its formula, and the numbers of a surface in it with their defaults (None: must be given)."""

    word: str
    text: str
    values: tuple[tuple[str, float | None], ...]

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
BUILT_IN: dict[str, Law] = {
    "velocity": Law("velocity", _VELOCITY, (("friction_slow", None), ("velocity_rate", None))),
    "pvt": Law("pvt", _PVT, (("reference_pressure", None), ("pressure_ratio", 0.7), ("velocity_drop", 0.5),
                             ("velocity_rate", 100.0), ("temperature_ratio", 0.7))),
}  # fmt: skip


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
    return Law("custom", ast.unparse(tree), tuple((c, None) for c in COEFFICIENTS if c in names_in(tree)))


def own_numbers() -> tuple[str, ...]:
    """Fields of `Surface` that belong to some law: None on a surface of constant friction."""
    known = dict.fromkeys(name for law in BUILT_IN.values() for name in law.takes)
    return (*known, *COEFFICIENTS)


def check_bearing(law: Law | None, word: str, bearing: Bearing) -> None:
    """Raise InputError unless every surface carries the numbers of the law, no others, and the law holds with them."""
    takes = {} if law is None else law.takes
    for index, surface in enumerate(bearing.surfaces):
        for name in own_numbers():
            if name not in takes and getattr(surface, name) is not None:
                users = " or ".join(repr(w) for w, other in BUILT_IN.items() if name in other.takes) or "'custom'"
                raise InputError(
                    f"bearing.surfaces[{index}].{name} = {getattr(surface, name)} (surface {index + 1}): "
                    f"effects.friction = {word!r} takes no such value; leave it out or give {users}"
                )
        if law is not None:
            _check_values(law, f"bearing.surfaces[{index}]", index, surface, numbers(law, bearing, index))


def numbers(law: Law, bearing: Bearing, index: int) -> dict[str, float]:
    """The numbers of one surface (index from 0) by the names in `columns`, defaults put in. Raises InputError."""
    surface, found = bearing.surfaces[index], dict[str, float | None]()
    defaults = {**law.takes, "patch_radius": bearing.slider_rim_radius(index) or None}
    for name in law.takes:
        value = getattr(surface, name)
        found[name] = defaults[name] if value is None else value
        if found[name] is None:
            more = ", or the slider's rim_radius" if name == "patch_radius" else ""
            raise InputError(
                f"bearing.surfaces[{index}].{name} is missing (surface {index + 1}): "
                f"effects.friction = {law.word!r} needs it{more}"
            )
    return {name: float(value) for name, value in {**found, **_derived(found)}.items() if value is not None}


def _derived(found: Mapping[str, float | None]) -> dict[str, float]:
    """Area of the patch pi r^2; half the side of the square of that area, within which the patch covers the centre
    (Kumar et al. 2015); and sqrt(D/pi)/k.
    """
    out: dict[str, float] = {}
    if (radius := found.get("patch_radius")) is not None:
        out |= {"area": pi * radius**2, "reach": radius * sqrt(pi / 4)}
    if (k := found.get("conductivity")) is not None and (d := found.get("diffusivity")) is not None:
        out["heating"] = sqrt(d / pi) / k
    return out


def _check_values(law: Law, path: str, index: int, surface: Surface, values: Mapping[str, float]) -> None:
    """A law must be finite, and positive where the coefficient of reference is, over the ranges of `VARIABLES`."""
    used = [name for name in VARIABLES if name in names_in(law.tree)]
    grid = np.meshgrid(*(VARIABLES[name][1] for name in used), indexing="ij")
    points = dict(zip(used, grid, strict=True))
    with np.errstate(all="ignore"):
        mu = fold(law.tree, {**values, **points, "mu": np.float64(surface.friction)}, NUMBERS)
    mu = np.broadcast_to(mu, grid[0].shape if grid else ())
    wrong = ~np.isfinite(mu) | (mu < 0) | ((mu == 0) & (surface.friction > 0))
    if wrong.any():
        where = np.unravel_index(int(np.argmax(wrong)), mu.shape)
        at = ", ".join(f"{name} = {points[name][where]:.4g} {VARIABLES[name][0]}" for name in used) or "every point"
        raise InputError(
            f"{path} (surface {index + 1}): the law of effects.friction = {law.word!r} gives mu = {mu[where]:.4g} "
            f"at {at}; give numbers with which it is finite and positive"
        )


def heating_of(bearing: Bearing) -> list[float]:
    """sqrt(D/pi)/k over the area of contact of every surface [K s^1/2/J], with the defaults of `HEAT`; 0 where no area
    is known.
    """
    out = []
    for index, surface in enumerate(bearing.surfaces):
        radius = surface.patch_radius or bearing.slider_rim_radius(index)
        given = {name: getattr(surface, name) or default for name, default in HEAT.items()}
        numbers = _derived({**given, "patch_radius": radius or None})
        out.append(numbers["heating"] / numbers["area"] if radius else 0.0)
    return out
