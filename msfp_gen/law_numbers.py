"""Numbers in a law of friction: those of one surface, and whether the law holds with them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from math import pi, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from msfp_gen.errors import InputError
from msfp_gen.generator.friction_laws import BUILT_IN, VARIABLES, Law, own_numbers
from msfp_gen.law_text import Operations, fold, names_in

if TYPE_CHECKING:
    from msfp_gen.bearing import Bearing

# Where a law must be finite and positive.
RANGES: dict[str, NDArray[np.float64]] = {
    "v": np.r_[0.0, np.geomspace(1e-6, 2.0, 20)],
    "p": np.geomspace(1e3, 2e8, 16),
    "T": np.linspace(-40.0, 600.0, 17),
    "N": np.geomspace(1.0, 1e8, 9),
}
Pair = tuple[Any, Any]  # a value and its derivative by one of what the law depends on


def _times(factor: Any, rate: Any) -> Any:
    """A term of a derivative: none where the argument does not change, whatever the factor."""
    return np.where(rate == 0.0, 0.0, factor * rate)


def _exp(a: Pair) -> Pair:
    return np.exp(a[0]), _times(np.exp(a[0]), a[1])


def _log(a: Pair) -> Pair:
    return np.log(a[0]), _times(1 / a[0], a[1])


def _mul(a: Pair, b: Pair) -> Pair:
    return a[0] * b[0], _times(b[0], a[1]) + _times(a[0], b[1])


def _less(a: Pair, b: Pair, first: Any) -> Pair:
    return np.where(first, a[0], b[0]), np.where(first, a[1], b[1])


OPERATIONS: Operations = {
    "number": lambda x: (np.float64(x), 0.0),
    "neg": lambda a: (-a[0], -a[1]),
    "add": lambda a, b: (a[0] + b[0], a[1] + b[1]),
    "sub": lambda a, b: (a[0] - b[0], a[1] - b[1]),
    "mul": _mul,
    "div": lambda a, b: (a[0] / b[0], _times(1 / b[0], a[1]) - _times(a[0] / b[0] ** 2, b[1])),
    "pow": lambda a, b: (a[0] ** b[0], _times(b[0] * a[0] ** (b[0] - 1.0), a[1])),
    "power": lambda a, b: _exp(_mul(_log(a), b)),
    "exp": _exp,
    "log": _log,
    "sqrt": lambda a: (np.sqrt(a[0]), _times(0.5 / np.sqrt(a[0]), a[1])),
    "tanh": lambda a: (np.tanh(a[0]), _times(1 - np.tanh(a[0]) ** 2, a[1])),
    "Abs": lambda a: (np.abs(a[0]), _times(np.sign(a[0]), a[1])),
    "Min": lambda a, b: _less(a, b, a[0] < b[0]),
    "Max": lambda a, b: _less(a, b, a[0] > b[0]),
}


def coefficient(law: Law, values: Mapping[str, Any], by: str = "") -> Pair:
    """Mu by the law at `values` of all names in it, arrays or numbers, and its derivative by one of them."""
    pairs = {name: (np.asarray(value, float), float(name == by)) for name, value in values.items()}
    with np.errstate(all="ignore"):
        mu, slope = fold(law.tree, pairs, OPERATIONS)
    shape = np.broadcast_shapes(*(pair[0].shape for pair in pairs.values()))
    return np.broadcast_to(mu, shape), np.broadcast_to(slope, shape)


def check_bearing(law: Law | None, word: str, bearing: Bearing) -> None:
    """Raise InputError unless every surface carries the numbers of the law, no others, and the law holds with them."""
    takes = set() if law is None else {*law.takes, *law.beside}
    for index, surface in enumerate(bearing.surfaces):
        for name in own_numbers():
            if name not in takes and getattr(surface, name) is not None:
                carriers = [word for word, other in BUILT_IN.items() if name in {*other.takes, *other.beside}]
                users = " or ".join(map(repr, carriers)) or "'custom'"
                raise InputError(
                    f"bearing.surfaces[{index}].{name} = {getattr(surface, name)} (surface {index + 1}): "
                    f"effects.friction = {word!r} takes no such value; leave it out or give {users}"
                )
        if law is not None:
            flaw = _flaw(law, (("mu", surface.friction), *numbers(law, bearing, index).items()))
            if flaw is not None:
                raise InputError(f"bearing.surfaces[{index}] (surface {index + 1}): the law of effects.friction = "
                                 f"{law.word!r} {flaw}")  # fmt: skip


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
    return {name: float(value) for name, value in {**found, **derived(found)}.items() if value is not None}


def derived(found: Mapping[str, float | None]) -> dict[str, float]:
    """Area of the patch pi r^2; half the side of the square of that area, within which the patch covers the centre
    (Kumar et al. 2015); and sqrt(D/pi)/k.
    """
    out: dict[str, float] = {}
    if (radius := found.get("patch_radius")) is not None:
        out |= {"area": pi * radius**2, "reach": radius * sqrt(pi / 4)}
    if (k := found.get("conductivity")) is not None and (d := found.get("diffusivity")) is not None:
        out["heating"] = sqrt(d / pi) / k
    return out


def proportional(law: Law, bearing: Bearing) -> bool:
    """Whether the law grows in proportion to the coefficient of reference, and the second one where it has one."""
    factor, found = 1.25, []
    for index, surface in enumerate(bearing.surfaces):
        values, points = numbers(law, bearing, index), _points(law)
        more = values | {name: factor * values[name] for name in ("friction_slow",) if name in values}
        once, twice = (coefficient(law, {**each, **points, "mu": mu})[0]
                       for each, mu in ((values, surface.friction), (more, factor * surface.friction)))  # fmt: skip
        found.append(np.allclose(twice, factor * once, rtol=1e-9, atol=0.0))
    return all(found)


def _points(law: Law) -> dict[str, NDArray[np.float64]]:
    """A grid over the ranges of what the law depends on."""
    used = [name for name in RANGES if name in names_in(law.tree)]
    return dict(zip(used, np.meshgrid(*(RANGES[name] for name in used), indexing="ij"), strict=True))


@lru_cache(maxsize=256)
def _flaw(law: Law, values: tuple[tuple[str, float], ...]) -> str | None:
    """What is wrong with a law and the numbers of one surface, `mu` among them; surfaces are often alike.

    Over the `RANGES` a law must be finite, positive where the coefficient of reference is, and nowhere vertical.
    """
    points = _points(law)
    at: dict[str, Any] = {**dict(values), **points}
    mu = coefficient(law, at)[0]
    slopes = {f"d mu/d{name}": coefficient(law, at, name)[1] for name in points}
    unfit = ~np.isfinite(mu) | (mu < 0) | ((mu == 0) & (at["mu"] > 0))
    checks = [("mu", mu, unfit, "finite and positive"),
              *((what, slope, ~np.isfinite(slope), "of finite slope") for what, slope in slopes.items())]  # fmt: skip
    for what, found, wrong, remedy in checks:
        if wrong.any():
            where = np.unravel_index(int(np.argmax(wrong)), wrong.shape)
            place = ", ".join(f"{name} = {points[name][where]:.4g} {VARIABLES[name]}" for name in points)
            return (f"gives {what} = {found[where]:.4g} at {place or 'every point'}; give a law and numbers with which "
                    f"it is {remedy}")  # fmt: skip
    return None
