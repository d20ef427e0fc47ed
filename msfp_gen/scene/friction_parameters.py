"""Parameters of a friction law on one surface, the check that the law is valid with them, and its selection."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from functools import lru_cache
from math import log, pi, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from msfp_gen.common.errors import InputError
from msfp_gen.specification.formula import Operations, fold, names_in
from msfp_gen.specification.friction_laws import (
    BUILT_IN,
    HEAT,
    LONGEST,
    MEMORIES,
    SPIN,
    SPIN_NUMBERS,
    THICK,
    VARIABLES,
    Law,
    Spin,
    law_parameter_names,
)

if TYPE_CHECKING:
    from msfp_gen.scene.bearing import Bearing, Surface
    from msfp_gen.specification.layout import Effects

# Range of every variable over which a law is checked: v [m/s], p [Pa], N [N], and of the memories.
RANGES: dict[str, NDArray[np.float64]] = {
    "v": np.r_[0.0, np.geomspace(1e-6, 2.0, 20)],
    "p": np.geomspace(1e3, 2e8, 16),
    "N": np.geomspace(1.0, 1e8, 9),
    **{name: np.linspace(*memory.checked) for name, memory in MEMORIES.items()},
}
Dual = tuple[Any, Any]  # a value and its derivative with respect to one variable (forward-mode differentiation)


def _chain(factor: Any, rate: Any) -> Any:
    """A term `factor * rate` of the chain rule; 0 where the rate is 0, even if the factor is not finite."""
    return np.where(rate == 0.0, 0.0, factor * rate)


def _exp(a: Dual) -> Dual:
    return np.exp(a[0]), _chain(np.exp(a[0]), a[1])


def _log(a: Dual) -> Dual:
    return np.log(a[0]), _chain(1 / a[0], a[1])


def _mul(a: Dual, b: Dual) -> Dual:
    return a[0] * b[0], _chain(b[0], a[1]) + _chain(a[0], b[1])


def _select(a: Dual, b: Dual, first: Any) -> Dual:
    """`a` where `first` is true, else `b`."""
    return np.where(first, a[0], b[0]), np.where(first, a[1], b[1])


OPERATIONS: Operations = {
    "number": lambda x: (np.float64(x), 0.0),
    "neg": lambda a: (-a[0], -a[1]),
    "add": lambda a, b: (a[0] + b[0], a[1] + b[1]),
    "sub": lambda a, b: (a[0] - b[0], a[1] - b[1]),
    "mul": _mul,
    "div": lambda a, b: (a[0] / b[0], _chain(1 / b[0], a[1]) - _chain(a[0] / b[0] ** 2, b[1])),
    "pow": lambda a, b: (a[0] ** b[0], _chain(b[0] * a[0] ** (b[0] - 1.0), a[1])),
    "power": lambda a, b: _exp(_mul(_log(a), b)),
    "exp": _exp,
    "log": _log,
    "sqrt": lambda a: (np.sqrt(a[0]), _chain(0.5 / np.sqrt(a[0]), a[1])),
    "tanh": lambda a: (np.tanh(a[0]), _chain(1 - np.tanh(a[0]) ** 2, a[1])),
    "Abs": lambda a: (np.abs(a[0]), _chain(np.sign(a[0]), a[1])),
    "Min": lambda a, b: _select(a, b, a[0] < b[0]),
    "Max": lambda a, b: _select(a, b, a[0] > b[0]),
}


def coefficient(law: Law, values: Mapping[str, Any], by: str = "") -> Dual:
    """Friction coefficient of a law, and its derivative with respect to one of its names.

    values: a number or an array for every name in the formula. by: the name for the derivative; "": none. Returns two
    arrays of the broadcast shape.
    """
    pairs = {name: (np.asarray(value, float), float(name == by)) for name, value in values.items()}
    with np.errstate(all="ignore"):
        mu, slope = fold(law.tree, pairs, OPERATIONS)
    shape = np.broadcast_shapes(*(pair[0].shape for pair in pairs.values()))
    return np.broadcast_to(mu, shape), np.broadcast_to(slope, shape)


def check_bearing(law: Law | None, word: str, spin: str, bearing: Bearing) -> None:
    """Check the friction parameters of a bearing.

    Raises InputError where a surface lacks a parameter of the law or of the drilling moment, has one of another, or
    where the law is not valid with its parameters. law: None for constant friction. word, spin: as in
    `Effects.friction` and `Effects.spin`.
    """
    laws, names = {**BUILT_IN, word: law}, law_parameter_names()
    for index, surface in enumerate(bearing.surfaces):
        _check_takers(surface, index, names, f"effects.friction = {word!r}", laws, word)
        _check_takers(surface, index, SPIN_NUMBERS, f"effects.spin = {spin!r}", SPIN, spin)
        _drilling_numbers(spin, surface, index)
        if law is not None:
            defect = _defect(law, (("mu", surface.friction), *law_parameters(law, bearing, index).items()))
            if defect is not None:
                raise InputError(
                    f"bearing.surfaces[{index}] (surface {index + 1}): the law of effects.friction = "
                    f"{law.word!r} {defect}"
                )


def bearing_for(bearing: Bearing, friction: str | None) -> Bearing:
    """The bearing without the numbers that a built-in law, or constant friction, does not take; None: as it is."""
    if friction is None:
        return bearing
    law = BUILT_IN.get(friction)
    known = set() if law is None else {*law.parameters, *law.also_accepted}
    gone: dict[str, Any] = dict.fromkeys(set(law_parameter_names()) - known)
    return replace(bearing, surfaces=tuple(replace(surface, **gone) for surface in bearing.surfaces))


def _taken(by: Law | Spin | None) -> Collection[str]:
    """The fields of a surface that a law or a drilling moment takes; none with constant friction."""
    if by is None:
        return ()
    return by.values if isinstance(by, Spin) else {*by.parameters, *by.also_accepted}


def _check_takers(
    surface: Surface, index: int, names: Iterable[str], chosen: str, takers: Mapping[str, Law | Spin | None], word: str
) -> None:
    """Raise InputError where a surface has a number that the taker of the word, `chosen` in messages, does not take."""
    values = vars(surface)
    for name in names:
        if values[name] is not None and name not in _taken(takers[word]):
            users = " or ".join(repr(other) for other, taker in takers.items() if name in _taken(taker)) or "'custom'"
            raise InputError(
                f"bearing.surfaces[{index}].{name} = {values[name]} (surface {index + 1}): "
                f"{chosen} has no such parameter; leave it out or give {users}"
            )


def _drilling_numbers(spin: str, surface: Surface, index: int) -> dict[str, float]:
    """Numbers of the drilling moment on one surface. Raises InputError where one is missing."""
    for name in SPIN[spin].values:
        if getattr(surface, name) is None:
            raise InputError(
                f"bearing.surfaces[{index}].{name} is missing (surface {index + 1}): effects.spin = {spin!r} needs it"
            )
    return {name: getattr(surface, name) for name in SPIN[spin].values}


def surface_numbers(effects: Effects, bearing: Bearing, index: int) -> dict[str, float]:
    """Numbers of friction law and drilling moment on one surface (index from 0), by name.

    Raises InputError where one without a default is missing.
    """
    law = {} if effects.law is None else law_parameters(effects.law, bearing, index)
    return law | _drilling_numbers(effects.spin, bearing.surfaces[index], index)


def law_parameters(law: Law, bearing: Bearing, index: int) -> dict[str, float]:
    """Parameters of a law on one surface (index from 0), defaults and derived ones included, by their names.

    Raises InputError where a parameter without a default is missing.
    """
    surface, values = bearing.surfaces[index], dict[str, float | None]()
    defaults = {**law.parameters, "patch_radius": bearing.slider_rim_radius(index) or None}
    for name in law.parameters:
        value = getattr(surface, name)
        values[name] = defaults[name] if value is None else value
        if values[name] is None:
            more = ", or the slider's rim_radius" if name == "patch_radius" else ""
            raise InputError(
                f"bearing.surfaces[{index}].{name} is missing (surface {index + 1}): "
                f"effects.friction = {law.word!r} needs it{more}"
            )
    return {name: float(value) for name, value in {**values, **derived_parameters(values)}.items() if value is not None}


def derived_parameters(parameters: Mapping[str, float | None]) -> dict[str, float]:
    """Parameters that follow from others.

    area: of the contact patch, pi r^2 [m^2]. reach: half the side of the square of that area; the patch covers the
    centre of the surface while the sliding displacement is smaller (Kumar et al. 2015) [m]. heating: sqrt(D/pi)/k
    [K s^1/2 m^2/J]. plate_heating, plate_rate: D/(sqrt(pi) k d) [K m^2/J] and D/d^2 [1/s] with the thickness d of the
    plate, at most that beyond which it is a half-space. Each is given where its inputs are.
    """
    out: dict[str, float] = {}
    if (radius := parameters.get("patch_radius")) is not None:
        out |= {"area": pi * radius**2, "reach": radius * sqrt(pi / 4)}
    if (k := parameters.get("conductivity")) is not None and (d := parameters.get("diffusivity")) is not None:
        out["heating"] = (d / pi) ** 0.5 / k
        if (thickness := parameters.get("plate_thickness")) is not None:
            across = min(thickness**2 / d, THICK * LONGEST, key=lambda time: time.real)  # complex in `derived_slopes`
            out |= {"plate_heating": out["heating"] / across**0.5, "plate_rate": 1 / across}
    return out


def derived_slopes(parameters: Mapping[str, float | None], name: str) -> dict[str, float]:
    """Derivatives of the `derived_parameters` with respect to the parameter `name`, by a complex step."""
    step = 1e-200
    moved: Any = {key: value for key, value in parameters.items() if value is not None}
    moved[name] += step * 1j
    derived: dict[str, Any] = derived_parameters(moved)
    return {key: value.imag / step for key, value in derived.items() if isinstance(value, complex)}


def proportional(law: Law, bearing: Bearing) -> bool:
    """Whether the coefficient of a law is proportional to the reference coefficient mu of every surface.

    A law with `friction_slow` must be proportional to both coefficients together.
    """
    return all(
        _scales(law, surface.friction, tuple(law_parameters(law, bearing, index).items()))
        for index, surface in enumerate(bearing.surfaces)
    )


@lru_cache(maxsize=256)
def _scales(law: Law, friction: float, parameters: tuple[tuple[str, float], ...]) -> bool:
    """Whether the coefficient of a law on one surface is multiplied by a factor with its reference coefficients."""
    factor, values, points = 1.25, dict(parameters), _grid(law)
    scaled = values | {name: factor * values[name] for name in ("friction_slow",) if name in values}
    base, raised = (
        coefficient(law, {**own, **points, "mu": mu})[0]
        for own, mu in ((values, friction), (scaled, factor * friction))
    )
    return bool(np.allclose(raised, factor * base, rtol=1e-9, atol=0.0))


def _grid(law: Law) -> dict[str, NDArray[np.float64]]:
    """A grid over the `RANGES` of the variables of a law: an array of all points for each variable."""
    used = [name for name in RANGES if name in names_in(law.tree)]
    return dict(zip(used, np.meshgrid(*(RANGES[name] for name in used), indexing="ij"), strict=True))


def checked_range(law: Law | None, bearing: Bearing, lower_load_limit: bool = True) -> dict[str, Any]:
    """Range over which the law was checked, as arguments of a compiled run; empty for constant friction.

    law_speed: largest slip velocity [m/s]. law_load: smallest and largest normal force of each surface, shape (n-1, 2)
    [N]; the smallest is 0 unless `lower_load_limit`. law_temperature: lowest and highest, shape (2,) [degC]. Each is
    given if the law depends on that variable.
    """
    used, ranges = frozenset() if law is None else names_in(law.tree), dict[str, Any]()
    if "v" in used:
        ranges["law_speed"] = float(RANGES["v"][-1])
    if law is not None and used & {"p", "N"}:
        limits = np.tile([0.0, np.inf], (len(bearing.surfaces), 1))
        for index in range(len(bearing.surfaces)):
            area = law_parameters(law, bearing, index).get("area", np.nan)
            sides = [RANGES[name][[0, -1]] * (area if name == "p" else 1.0) for name in ("p", "N") if name in used]
            limits[index] = max(side[0] for side in sides) if lower_load_limit else 0.0, min(side[1] for side in sides)
        ranges["law_load"] = limits
    if law is not None and law.depends_on_temperature:
        assert law.memory is not None
        ranges["law_temperature"] = RANGES[law.memory.variable][[0, -1]]
    return ranges


@lru_cache(maxsize=256)
def _defect(law: Law, values: tuple[tuple[str, float], ...]) -> str | None:
    """Why a law is not valid with the parameters of one surface, `mu` included; None where it is valid."""
    # Over the `RANGES`, mu must be finite, positive where the reference coefficient is, and of finite slope. Results
    # are cached, since the surfaces of a bearing often have equal parameters.
    points = _grid(law)
    at: dict[str, Any] = {**dict(values), **points}
    mu = coefficient(law, at)[0]
    slopes = {f"d mu/d{name}": coefficient(law, at, name)[1] for name in points}
    invalid = ~np.isfinite(mu) | (mu < 0) | ((mu == 0) & (at["mu"] > 0))
    checks = [
        ("mu", mu, invalid, "finite and positive"),
        *((name, slope, ~np.isfinite(slope), "of finite slope") for name, slope in slopes.items()),
    ]
    for quantity, results, failed, remedy in checks:
        if failed.any():
            where = np.unravel_index(int(np.argmax(failed)), failed.shape)
            place = ", ".join(f"{name} = {points[name][where]:.4g} {VARIABLES[name]}" for name in points)
            return (
                f"gives {quantity} = {results[where]:.4g} at {place or 'every point'}; give a law and parameters with "
                f"which it is {remedy}"
            )
    return None


def select_friction(bearing: Bearing, text: str | None) -> str:
    """The word of the friction law whose parameters the surfaces have. text: formula of a custom law, or None.

    Parameters of pressure, velocity and temperature select "pv": the monitor of heat adds temperature when needed. It
    knows half-spaces only, so plates with a thickness select "pvtd".
    """
    if text is not None:
        return "custom"
    words = {"pvtd": "plate_thickness", "pv": "reference_pressure", "velocity": "friction_slow"}
    words_of_surfaces = (w for w, name in words.items() if any(getattr(s, name) is not None for s in bearing.surfaces))
    return next(words_of_surfaces, "constant")


def thermal_softening(law: Law | None, bearing: Bearing) -> float:
    """Largest relative decrease of a friction coefficient per kelvin, at the start temperature [1/K].

    It follows from the temperature factor of Kumar et al. (2015), which is steepest there. Where the surfaces do not
    have its parameters, the published values are used.
    """
    slopes = []
    for index, surface in enumerate(bearing.surfaces):
        parameters = {} if law is None else law_parameters(law, bearing, index)
        ratio, start = parameters.get("temperature_ratio", 0.7), parameters.get("start_temperature", 20.0)
        power = ratio ** (start / 50.0)
        slopes.append(abs(log(ratio)) / 50.0 * power / (power + 0.4) if surface.friction > 0 else 0.0)
    return max(slopes)


def published_softening(rise: float) -> float:
    """Relative decrease of friction by a temperature rise from 20 degC [K], after Kumar et al. (2015) [-]."""
    cold, warm = (0.7 ** (temperature / 50.0) + 0.4 for temperature in (20.0, 20.0 + rise))
    return float(1.0 - warm / cold)


def start_temperatures(bearing: Bearing) -> NDArray[np.float64]:
    """Temperatures of the surfaces at the start, with the default of `HEAT`, shape (n-1,) [degC]."""
    default = HEAT["start_temperature"]
    return np.array([default if x.start_temperature is None else x.start_temperature for x in bearing.surfaces], float)


def heated_contacts(bearing: Bearing) -> list[tuple[float, float]]:
    """sqrt(D/pi)/k over the contact area of every surface, with the defaults of `HEAT` [K s^1/2/J]; and the sliding
    displacement up to which the contact covers the centre of the surface [m].

    Both are 0 where the contact area is not known.
    """
    out = []
    for index, surface in enumerate(bearing.surfaces):
        radius = surface.patch_radius or bearing.slider_rim_radius(index)
        values = {name: getattr(surface, name) or default for name, default in HEAT.items()}
        parameters = derived_parameters({**values, "patch_radius": radius or None})
        out.append((parameters["heating"] / parameters["area"], parameters["reach"]) if radius else (0.0, 0.0))
    return out
