"""Friction as data: laws of its coefficient, frictional heating, hysteresis, and what resists spin.

A formula contains names of `VARIABLES` and of fields of `Surface`; `mu` is the reference coefficient
`Surface.friction`. The formula determines which parameters a surface must define and whether the law needs the pressure
or a memory of the surface, such as its temperature. The generator derives the equations from the same formula, and
`scene/friction_parameters.py` evaluates it.

Heating: the temperature is T = T_0 + sqrt(D/pi)/k times the integral of q(t - tau)/sqrt(tau) over tau (Carslaw and
Jaeger; Kumar et al. 2015). With 1/sqrt(tau) approximated by the sum of w_i exp(-lambda_i tau) it becomes T = T_0 + sum
of h_i, where dh_i/dt = -lambda_i h_i + w_i flux: each h_i is one state of a surface. The rates lambda_i form a
geometric progression. The weights w_i minimise the largest relative error over [SHORTEST, LONGEST] under two
conditions: none is negative, and the integral over [0, SHORTEST] is exact. They are fitted by
`benchmarks/heat_kernel.py`.

A plate of thickness d with an insulated back face has the kernel 1/sqrt(tau) (1 + 2 sum exp(-n^2 d^2/(D tau))), which
equals sqrt(D)/d times one function of tau D/d^2. The sum of exponentials of that function therefore serves plates of
every thickness: D/d^2, the `pace` of a surface, multiplies its rates. Its first two terms are exact: the mean
temperature of the plate, sqrt(pi), and the slowest mode across it, 2 sqrt(pi) exp(-pi^2 tau). Within LONGEST a plate
thicker than sqrt(THICK D LONGEST) is a half-space, and is taken with that thickness.

Hysteresis by Bouc-Wen (3.18): dY/dt = (u - Y (a Y u + b Z v))/d_y and dZ/dt = (v - Z (a Y u + b Z v))/d_y, where u, v
are the components of the slip velocity. A law, which `Effects.bouc_wen` selects by name, gives the switches a, b, each
0 or 1, from the products Y u and Z v. They are 1 where the friction state grows and 0 where it unloads elastically.
Elastic-perfectly plastic: (Y, Z) follows the slip over d_y and is projected onto the unit disc (radial return).

Spin: what resists it between the two bodies of a surface, which `Effects.spin` selects by name, is a formula of the
drilling moment about the contact normal. Its derivatives, its power, its part in the momentum balances and the columns
of the C arrays follow from it.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property, lru_cache
from typing import Any, NamedTuple

from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Quantity
from msfp_gen.specification.formula import names_in, parse, units_of
from msfp_gen.specification.values import Value


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
        "one switch for each axis (3.18)",
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


SHORTEST, LONGEST = 1e-3, 1e3
"""Range of times over which the sum approximates the kernel [s]; heat older than LONGEST is neglected."""
HEAT_ERROR = 1.8e-3
"""Bound of the relative error of the kernel in that range [-]."""
HEAT_ONSET = 6e-3
"""Bound of half the integral of |error| over [0, SHORTEST] [s^1/2]: temperature error per unit change of a flux that
changes within that time (docs/friction.md)."""

HEAT_KERNEL: tuple[tuple[float, float], ...] = (
    (6.0000000000e03, 1.2078817073e02),
    (1.6832329748e03, 2.8458871434e01),
    (4.7221220791e02, 1.5622216602e01),
    (1.3247385991e02, 8.3021979222e00),
    (3.7164061550e01, 4.3187491334e00),
    (1.0425962313e01, 2.3486816271e00),
    (2.9248872599e00, 1.2081621465e00),
    (8.2054444726e-01, 6.5997556553e-01),
    (2.3019457849e-01, 3.3852067045e-01),
    (6.4578517522e-02, 1.8581755062e-01),
    (1.8116781693e-02, 9.3342760085e-02),
    (5.0824607238e-03, 5.7161762604e-02),
    (1.4258275806e-03, 1.0537004578e-02),
    (4.0000000000e-04, 4.2786061899e-02),
)
"""(lambda_i [1/s], w_i [s^-1/2])."""
THICK = 7.0
"""(d^2/D)/LONGEST of a plate whose images are 2 exp(-THICK) at LONGEST, no more than HEAT_ERROR."""
PLATE_KERNEL: tuple[tuple[float, float], ...] = (
    (0.0000000000e00, 1.7724538509e00),
    (9.8696044011e00, 3.5449077018e00),
    (4.2636691013e01, 4.5342002511e00),
    (1.4950097304e02, 8.8450433575e00),
    (5.2420908867e02, 1.5888362165e01),
    (1.8380828102e03, 3.0952533403e01),
    (6.4450397561e03, 5.5738969894e01),
    (2.2598838980e04, 1.0852945540e02),
    (7.9240399214e04, 1.9540808856e02),
    (2.7784794048e05, 3.8079161189e02),
    (9.7424393103e05, 6.8427698851e02),
    (3.4160816003e06, 1.3407746004e03),
    (1.1978122858e07, 2.2823076164e03),
    (4.2000000000e07, 1.0235675390e04),
)
"""(lambda_i, w_i) in the time tau D/d^2, within HEAT_ERROR from SHORTEST/(THICK LONGEST) on [-]."""


COEFFICIENTS = ("c1", "c2", "c3", "c4")
# Surface parameters that a law of pressure (PATCH) or temperature (HEAT) needs besides its own, with their defaults.
# The default of `patch_radius` is the rim radius of the slider.
PATCH: dict[str, float | None] = {"patch_radius": None}
HEAT: dict[str, float | None] = {"conductivity": 18.0, "diffusivity": 4.44e-6, "start_temperature": 20.0}
PLATE: dict[str, float | None] = {"plate_thickness": None}


@dataclass(frozen=True)
class Memory:
    """A state of a surface on which a law may depend: its start plus parts, d(part)/dt = weight source - rate part.

    Attributes:
        variable: its name in formulas.
        unit, powers: of the state, and its exponents of m, s, kg, K.
        source_unit: of its source; weight times source is a rate of the state.
        meaning: what it is.
        source: formula of v, p, N and `values`.
        parts: (rate [1/s], weight) of each part.
        scale: the tolerance of the state is a hundredth of it and of the state itself at `rtol` = 1e-3.
        checked: (lowest, highest, number) of the values at which a law is checked.
        by_friction: whether the source is also proportional to the friction coefficient.
        where_covered: whether it is zero where the contact patch does not cover the centre of the surface.
        start: the parameter of the surface with its value at the start; "": zero.
        parameters: surface parameters that it needs, with their defaults.
        values: derived values of the surface that the compiled model stores for it.
        pace: the one of them that multiplies the rates of the parts; "": none.
    """

    variable: str
    unit: str
    powers: tuple[int, int, int, int]
    source_unit: str
    meaning: str
    source: str
    parts: tuple[tuple[float, float], ...]
    scale: float
    checked: tuple[float, float, int]
    by_friction: bool = False
    where_covered: bool = False
    start: str = ""
    parameters: tuple[tuple[str, float | None], ...] = ()
    values: tuple[str, ...] = ()
    pace: str = ""

    @cached_property
    def tree(self) -> ast.expr:
        """Syntax tree of the source."""
        return parse(self.source, {"v", "p", "N", *self.values})


TEMPERATURE = Memory(
    "T", "degC", (0, 0, 0, 1), "K/s^1/2",
    "temperature at the centre, heated by friction",
    "heating * p * v",
    HEAT_KERNEL,
    scale=10.0,
    checked=(-40.0, 600.0, 17),
    by_friction=True,
    where_covered=True,
    start="start_temperature",
    parameters=tuple(HEAT.items()),
    values=("reach", "heating", "start_temperature"),
)  # fmt: skip
PLATE_TEMPERATURE = replace(
    TEMPERATURE,
    variable="Td",
    source_unit="K/s",
    meaning="temperature at the centre of a plate of finite thickness, heated by friction",
    source="plate_heating * p * v",
    parts=PLATE_KERNEL,
    parameters=tuple((HEAT | PLATE).items()),
    values=("reach", "plate_heating", "start_temperature", "plate_rate"),
    pace="plate_rate",
)
TEMPERATURES = (TEMPERATURE, PLATE_TEMPERATURE)
MEMORIES = {
    memory.variable: memory
    for memory in (
        TEMPERATURE,
        PLATE_TEMPERATURE,
        Memory(
            "s",
            "m",
            (1, 0, 0, 0),
            "m/s",
            "path of sliding since the start",
            "v",
            ((0.0, 1.0),),
            scale=1.0,
            checked=(0.0, 1e3, 9),
        ),
    )
}
"""What a surface may remember of its sliding, by the name in formulas; a law takes at most one of them."""
# Variables of a law and their units: sliding velocity, pressure, normal force, and the memories.
VARIABLES = {"v": "m/s", "p": "Pa", "N": "N", **{name: memory.unit for name, memory in MEMORIES.items()}}

_NUMBERS = (
    Value("friction_slow", Quantity("", least=0.0), "friction coefficient at rest"),
    Value(
        "velocity_rate",
        Quantity("s/m", least=0.0),
        "rate a of the exponential increase of friction with the slip velocity",
    ),
    Value("velocity_drop", Quantity("", least=0.0), "relative reduction of friction at rest"),
    Value("reference_pressure", Quantity("Pa", least=0.0), "pressure at which mu is given"),
    Value("pressure_ratio", Quantity("", above=0.0), "factor on friction for a pressure increase of 50 MPa"),
    Value("temperature_ratio", Quantity("", above=0.0), "0.7 in Kumar et al. (2015); 1: no influence of temperature"),
    Value("patch_radius", Quantity("m", above=0.0), "radius of the contact patch"),
    Value("conductivity", Quantity("W/(m K)", above=0.0), "thermal conductivity of the heated plate"),
    Value("diffusivity", Quantity("m^2/s", above=0.0), "its thermal diffusivity"),
    Value("plate_thickness", Quantity("m", above=0.0), "its thickness; no heat leaves its back face"),
    Value("area", Quantity("m^2", above=0.0, computed=True), "area of the contact patch"),
    Value(
        "reach",
        Quantity("m", above=0.0, computed=True),
        "distance from the centre of the surface within which the patch covers that centre",
    ),
    Value("heating", Quantity("K s^1/2 m^2/J", above=0.0, computed=True), "sqrt(D/pi)/k of the heated half-space"),
    Value(
        "plate_heating",
        Quantity("K m^2/J", above=0.0, computed=True),
        "D/(sqrt(pi) k d) of the heated plate, whose mean temperature rises by sqrt(pi) times that per unit of heat",
    ),
    Value("plate_rate", Quantity("1/s", above=0.0, computed=True), "D/d^2 of the heated plate"),
    Value("start_temperature", Quantity("degC"), "temperature at the start"),
    *(Value(name, Quantity(""), "parameter of the law", other_unit="SI") for name in COEFFICIENTS),
)
NUMBERS = {value.name: value for value in _NUMBERS}
"""Every parameter of a law, and every value derived from parameters for the compiled model."""


@dataclass(frozen=True)
class Law:
    """One friction law.

    Attributes:
        word: its name, a value of `Effects.friction`.
        meaning: text for help and explanations.
        text: the formula.
        values: (name, default) of the surface parameters in the formula; default None: must be given.
        also_accepted: further parameters that a surface may define without effect. They serve a more general law to
            which effect selection may switch (docs/effects.md).
    """

    word: str
    meaning: str
    text: str
    values: tuple[tuple[str, float | None], ...]
    also_accepted: tuple[str, ...] = ()

    @cached_property
    def tree(self) -> ast.expr:
        """Syntax tree of the formula."""
        return parse(self.text, {"mu", *VARIABLES, *(name for name, _ in self.values)})

    @cached_property
    def memory(self) -> Memory | None:
        """The memory of the surface that the formula contains; None without one."""
        return next((memory for name, memory in MEMORIES.items() if name in names_in(self.tree)), None)

    @property
    def depends_on_temperature(self) -> bool:
        """Whether the formula contains a temperature, T or Td."""
        return self.memory in TEMPERATURES

    @cached_property
    def needs_pressure(self) -> bool:
        """Whether the formula, or the source of its memory, contains the pressure."""
        return any("p" in names_in(item.tree) for item in (self, self.memory) if item is not None)

    @cached_property
    def parameters(self) -> dict[str, float | None]:
        """Surface parameters that the law needs -> default; None: must be given."""
        memory = dict(self.memory.parameters) if self.memory else {}
        return {**dict(self.values), **(PATCH if self.needs_pressure else {}), **memory}

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """Names of the values of one surface in the order in which the compiled model stores them."""
        patch = ("area",) if self.needs_pressure else ()
        return (*(name for name, _ in self.values), *patch, *(self.memory.values if self.memory else ()))


_VELOCITY = "mu - (mu - friction_slow) * exp(-velocity_rate * v)"
_PVT = (
    "mu * pressure_ratio ** ((p - reference_pressure) / 50e6) * (1 - velocity_drop * exp(-velocity_rate * v))"
    " * (temperature_ratio ** (T / 50) + 0.4) / (temperature_ratio ** (20 / 50) + 0.4)"
)
_PV = _PVT.replace("T /", "start_temperature /")
_PVTD = _PVT.replace("T /", "Td /")
_KUMAR_PARAMETERS: tuple[tuple[str, float | None], ...] = (
    ("reference_pressure", None),
    ("pressure_ratio", 0.7),
    ("velocity_drop", 0.5),
    ("velocity_rate", 100.0),
    ("temperature_ratio", 0.7),
)
_LAWS = (
    Law(
        "velocity",
        "it increases exponentially with the sliding velocity, from friction_slow to friction",
        _VELOCITY,
        (("friction_slow", None), ("velocity_rate", None)),
    ),
    Law(
        "pv",
        "it depends on pressure and velocity (Kumar et al. 2015), at the start temperature",
        _PV,
        (*_KUMAR_PARAMETERS, ("start_temperature", HEAT["start_temperature"])),
        tuple(HEAT),
    ),
    Law("pvt", "it depends on pressure, velocity and temperature (Kumar et al. 2015)", _PVT, _KUMAR_PARAMETERS),
    Law("pvtd", "the same, where the heated plates have a thickness", _PVTD, _KUMAR_PARAMETERS),
)
BUILT_IN = {law.word: law for law in _LAWS}
FRICTION = {
    "constant": "the friction coefficient is constant",
    **{law.word: law.meaning for law in _LAWS},
    "custom": "it is given by the formula friction_law",
}
"""Values of `Effects.friction` and their meaning."""


@lru_cache(maxsize=32)
def law_of(word: str, text: str | None = None) -> Law | None:
    """Friction law that `Effects.friction` (word) and `Effects.friction_law` (text) define; None for constant friction.

    Raises:
        InputError: a custom law has no formula, a built-in one has a formula, or the formula is invalid.
    """
    if word != "custom":
        if text is not None:
            raise InputError(
                f"effects.friction_law = {text!r}: friction = {word!r} has a formula of its own; "
                "give friction = 'custom', or leave it out"
            )
        return BUILT_IN.get(word)
    if text is None:
        raise InputError(
            "effects.friction_law is missing: friction = 'custom' needs a formula, "
            "such as 'mu * (1 - c1 * exp(-c2 * v))'"
        )
    try:
        tree = parse(text, {"mu", *VARIABLES, *COEFFICIENTS})
        units_of(tree, COEFFICIENTS, {name: memory.powers for name, memory in MEMORIES.items()})
        if len(used := sorted(names_in(tree) & set(MEMORIES))) > 1:
            raise ValueError(f"a law depends on one memory of the surface at most; leave out one of {', '.join(used)}")
    except ValueError as error:
        raise InputError(f"effects.friction_law = {text!r}: {error}") from None
    values = tuple((name, None) for name in COEFFICIENTS if name in names_in(tree))
    return Law("custom", FRICTION["custom"], ast.unparse(tree), values)


@cache
def law_parameter_names() -> tuple[str, ...]:
    """Fields of `Surface` that are parameters of any friction law; they are None on a surface of constant friction."""
    names = dict.fromkeys(name for law in BUILT_IN.values() for name in law.parameters)
    return (*names, *COEFFICIENTS)


SPIN_VARIABLES = (
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
        return parse(self.moment, {*(variable.name for variable in SPIN_VARIABLES), *self.values})


SPIN = {
    "locked": Spin("bodies do not turn about their own axis", locked=True),
    "patch": Spin(
        "a drilling moment over the contact patch resists spin",
        "-2 / 3 * mu * r * N * w / sqrt(w ** 2 + 0.01 ** 2)",  # w_0 = 0.01 rad/s: docs/model.md
    ),
    "free": Spin("no moment resists spin, as in PEER 2017/07"),
}
_SPIN_NUMBERS: tuple[Value, ...] = ()
SPIN_NUMBERS = {value.name: value for value in _SPIN_NUMBERS}
"""Every number of a surface in a formula."""
