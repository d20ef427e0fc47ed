"""Inputs that determine the equations: the layout of a stack and the modelled effects.

`ModelSpec = Layout + Effects` identifies one set of equations and so one compiled model. Radii, friction coefficients,
motions and loads are values of other classes: changing them never recompiles.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Annotated, Literal, TypeVar

from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Choice, Quantity, check_fields
from msfp_gen.specification.friction_laws import FRICTION, HYSTERESIS, SPIN, Law, Spin, has_closed_form, law_of

T = TypeVar("T")
_COUNT = Quantity("", least=0, whole=True)


@dataclass(frozen=True)
class Layout:
    """Layout (n, m, p) of a stack, after PEER 2017/07 section 3.

    Attributes:
        n: number of bodies, base and top plate included.
        m: number of concave-up surfaces, the lower ones.
        p: number of concave-down surfaces, above them.

    Raises:
        InputError: n is not m + p + 1, or is below 2.
    """

    n: Annotated[int, _COUNT]
    m: Annotated[int, _COUNT]
    p: Annotated[int, _COUNT]

    def __post_init__(self) -> None:
        check_fields(self, "layout")
        if self.n < 2:
            raise InputError(f"layout.n = {self.n}: a bearing needs at least 2 bodies, a base and a top plate")
        if self.n != self.m + self.p + 1:
            raise InputError(
                f"layout.n = {self.n}: {self.m} concave-up and {self.p} concave-down surfaces lie between "
                f"{self.m + self.p + 1} bodies; give n = m + p + 1"
            )

    @classmethod
    def tfp(cls) -> Layout:
        """Triple friction pendulum, PEER 2017/07 chapter 2: five bodies, two surfaces concave up and two down."""
        return cls(5, 2, 2)

    @classmethod
    def dfp(cls) -> Layout:
        """Double friction pendulum: three bodies, one surface concave up and one concave down."""
        return cls(3, 1, 1)

    @property
    def surfaces(self) -> int:
        """Number of sliding surfaces, n - 1."""
        return self.n - 1

    @property
    def signs(self) -> tuple[int, ...]:
        """For each surface, bottom first: +1 where it is concave up, -1 where it is concave down."""
        return (1,) * self.m + (-1,) * self.p

    @property
    def name(self) -> str:
        """`n_m_p`, part of the name of a generated module."""
        return f"{self.n}_{self.m}_{self.p}"


@dataclass(frozen=True)
class Effects:
    """Physical effects that the equations include. Every field takes one of the listed values, each with its meaning.

    Options of the command line, their help, scene files and names of models are generated from these fields. For
    friction, uplift and top_rotation see docs/friction.md, docs/uplift.md and docs/motion.md.

    Raises:
        InputError: a value is not permitted, the values exclude each other, or `friction_law` is not a valid formula.
    """

    dimension: Annotated[
        Literal["spatial", "planar"],
        Choice(
            {
                "spatial": "every body translates and rotates in three directions",
                "planar": "motion in one vertical plane",
            }
        ),
    ] = "spatial"
    spin: Annotated[str, Choice({word: way.meaning for word, way in SPIN.items()})] = "locked"
    sliders: Annotated[
        Literal["inertial", "massless"],
        Choice(
            {
                "inertial": "mass and rotary inertia of every body are included",
                "massless": "quasi-static: weights are included, inertia of the bodies is not",
            }
        ),
    ] = "inertial"
    rims: Annotated[
        bool,
        Choice(
            {
                True: "sliders are stopped by the rims of the dishes (3.20)-(3.25)",
                False: "no rims: the sliding displacement may exceed the capacity",
            }
        ),
    ] = True
    bouc_wen: Annotated[str, Choice({word: law.meaning for word, law in HYSTERESIS.items()})] = "report"
    friction: Annotated[str, Choice(FRICTION)] = "constant"
    friction_law: str | None = None
    uplift: Annotated[
        bool,
        Choice(
            {
                False: "surfaces stay closed; a run in which one would open stops with status uplift",
                True: "every surface may open and close (unilateral contact)",
            }
        ),
    ] = False
    top_rotation: Annotated[
        bool,
        Choice(
            {
                False: "the support of the top plate does not rotate",
                True: "the support of the top plate rotates as prescribed",
            }
        ),
    ] = False

    def __post_init__(self) -> None:
        check_fields(self, "effects")
        if self.friction == "custom" and self.law is not None:
            # A canonical spelling of the formula, so that equal laws share one compiled model.
            object.__setattr__(self, "friction_law", self.law.text)
        else:
            law_of(self.friction, self.friction_law)
        if self.sliders == "massless" and not self.determines_spin:
            words = " or ".join(repr(word) for word, way in SPIN.items() if way.locked or way.moment)
            raise InputError(
                f"effects.spin = {self.spin!r} with effects.sliders = 'massless': nothing determines the spin of a "
                f"body without inertia; give spin = {words}"
            )
        if self.sliders == "massless" and self.uplift:
            raise InputError(
                "effects.uplift = True with effects.sliders = 'massless': a separated body moves by its inertia; "
                "give sliders = 'inertial'"
            )

    @property
    def law(self) -> Law | None:
        """Friction law of the model; None for a constant friction coefficient."""
        return law_of(self.friction, self.friction_law)

    @property
    def drilling(self) -> Spin | None:
        """What resists spin by a moment; None where bodies do not spin, or do so freely."""
        way = SPIN[self.spin]
        return way if way.moment and self.dimension == "spatial" else None

    @property
    def determines_spin(self) -> bool:
        """Whether the spin of a body without inertia is determined."""
        return SPIN[self.spin].locked or bool(SPIN[self.spin].moment)

    @property
    def surface_numbers(self) -> tuple[str, ...]:
        """Names of the numbers of a surface that friction law and drilling moment need, in order of the C arrays."""
        law = () if self.law is None else self.law.columns
        return (*law, *(() if self.drilling is None else self.drilling.values))

    @property
    def permits_moving_ends(self) -> bool:
        """Whether a bearing can be a two-port, whose ends another program moves: in space, with locked spin, where the
        support of the top plate rotates.
        """
        return self.top_rotation and self.dimension == "spatial" and self.spin == "locked"

    @property
    def permits_dopri5(self) -> bool:
        """Whether runs can take the method of the report, which integrates accelerations of closed stacks."""
        return self.sliders == "inertial" and not self.uplift

    @property
    def permits_quasistatic_steps(self) -> bool:
        """Whether a run needs no integration: a planar model without inertia, uplift and friction law, whose friction
        state Y is a closed-form function of the slip.
        """
        quasistatic = self.dimension == "planar" and self.sliders == "massless" and not self.uplift
        return quasistatic and self.law is None and has_closed_form(self.bouc_wen)


OF_THE_SCENE = ("top_rotation",)
"""Fields of `Effects` that follow from the parts of a scene."""


def _with_other_effects(kind: type[T]) -> type[T]:
    """Give a class the fields of `Effects` that it does not state, with their rules and defaults."""
    for field in fields(Effects):
        if field.name not in (*kind.__annotations__, *OF_THE_SCENE):
            kind.__annotations__[field.name] = Effects.__annotations__[field.name]
            setattr(kind, field.name, field.default)
    return kind


@dataclass(frozen=True)
@_with_other_effects
class Auto:
    """Effects, with None for each one that is selected from the scene by stated criteria (docs/effects.md).

    Attributes:
        dimension, sliders, rims, uplift: a value of `Effects` to prescribe, or None to select it.
        friction: a value of `Effects`; None: the law whose parameters the surfaces define.
        spin, bouc_wen, friction_law: as in `Effects`, and so is any other of its fields that the scene does not decide.
        error: permitted change of the result by all effects left out, as a share of the friction force.

    Raises:
        InputError: a value is not permitted, or the prescribed effects exclude each other.
    """

    dimension: Annotated[str | None, Choice(("spatial", "planar"))] = None
    sliders: Annotated[str | None, Choice(("inertial", "massless"))] = None
    rims: Annotated[bool | None, Choice((True, False))] = None
    uplift: Annotated[bool | None, Choice((True, False))] = None
    spin: Annotated[str, Choice(SPIN)] = "locked"
    bouc_wen: Annotated[str, Choice(HYSTERESIS)] = "report"
    friction: Annotated[str | None, Choice(FRICTION)] = None
    friction_law: str | None = None
    error: Annotated[float, Quantity("", above=0.0)] = 0.005

    def __post_init__(self) -> None:
        check_fields(self, "effects")
        if self.error >= 1:
            raise InputError(f"effects.error = {self.error}: a share of the friction force; give less than 1: 0.005")
        self.resolve(friction=self.friction or ("custom" if self.friction_law else None))

    def resolve(self, **choices: object) -> Effects:
        """The prescribed effects with `choices` (field of `Effects` -> value) put in; other fields have defaults.

        Raises InputError if the values exclude each other.
        """
        known = {field.name: getattr(self, field.name) for field in fields(Effects) if hasattr(self, field.name)}
        return Effects(**{name: value for name, value in {**known, **choices}.items() if value is not None})


SELECTABLE = ("dimension", "sliders", "rims", "uplift")
"""Fields of `Auto` that are selected from the scene where they are None."""


@dataclass(frozen=True)
class ModelSpec:
    """All inputs that determine one set of equations and so one compiled model.

    Attributes:
        layout, effects: see their classes.
        gradients: whether the model also computes the derivatives of a run with respect to parameters.
    """

    layout: Layout
    effects: Effects = Effects()
    gradients: bool = False

    @property
    def planar(self) -> bool:
        """Whether the model is planar."""
        return self.effects.dimension == "planar"

    @property
    def key(self) -> str:
        """Unique name of the model, such as `5_2_2-spatial-locked-inertial-rims-report-constant`."""
        name = self.layout.name
        for field in fields(Effects):
            value = getattr(self.effects, field.name)
            if isinstance(value, bool):  # named where it is on, or where it is off and the default is on
                name += f"-{field.name}" if value else f"-no{field.name}" if field.default else ""
            elif field.name != "friction_law":
                name += f"-{value}"
            elif value is not None:
                name += f"[{value.replace(' ', '')}]"
        return f"{name}-gradients" if self.gradients else name


def point_names(n: int) -> Iterator[tuple[int, str, str]]:
    """The named points of a stack of n bodies (3.1)-(3.11): index of the body from 0, which of its points, name.

    Points: "lo" bottom, "cm" centre of mass, "up" top, "sc" sphere centre above. In stacks of ten and more bodies pairs
    have a stroke, since "11" would be both a point of body 1 and the centre of body 11.
    """
    between = "" if n < 10 else "_"
    for k in range(1, n + 1):
        yield k - 1, "lo", "01" if k == 1 else f"{k - 1}{between}{k}"
        yield k - 1, "cm", str(k)
        yield k - 1, "up", f"{k}{between}{k}"
        if k < n:
            yield k - 1, "sc", f"{k}c"
