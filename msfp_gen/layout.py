"""What changes equations: the layout of a stack and the effects that are modelled.

`ModelSpec = Layout + Effects` names one set of equations, so one compiled model. Radii, friction, motions and loads are
values and live elsewhere: changing them never recompiles.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Annotated, Literal

from msfp_gen.errors import InputError
from msfp_gen.fields import Choice, Quantity, check_fields
from msfp_gen.generator.friction_laws import FRICTION, Law, law_of
from msfp_gen.generator.hysteresis import HYSTERESIS, grows_alone

_COUNT = Quantity("", least=0, whole=True)


@dataclass(frozen=True)
class Layout:
    """`n` bodies of which the first `m` surfaces are concave up and the next `p` concave down (report section 3.1).

    Raises InputError unless n = m + p + 1 and n >= 2.
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
        """The triple friction pendulum of chapter 2: five bodies, two surfaces up and two down."""
        return cls(5, 2, 2)

    @classmethod
    def dfp(cls) -> Layout:
        """The double friction pendulum: three bodies, one surface up and one down."""
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
        """`n_m_p`, as in the name of a generated module."""
        return f"{self.n}_{self.m}_{self.p}"


@dataclass(frozen=True)
class Effects:
    """What the equations take into account; every field is one of a few words, each with what it means.

    Explanations, options of the command line, scene files and names of models follow from these fields. More about
    friction, uplift and top_rotation: docs/friction.md, docs/uplift.md, docs/loads.md.
    """

    dimension: Annotated[Literal["spatial", "planar"], Choice({
        "spatial": "three translations and rotations of every body",
        "planar": "motion in one vertical plane",
    })] = "spatial"
    spin: Annotated[Literal["locked", "patch", "free"], Choice({
        "locked": "bodies do not turn about their own axis",
        "patch": "a drilling moment over the contact patch resists spin",
        "free": "nothing but friction at a point resists spin, the literal report",
    })] = "locked"
    sliders: Annotated[Literal["inertial", "massless"], Choice({
        "inertial": "mass and rotary inertia of every body count",
        "massless": "quasi-static: weights count, inertia of the sliders does not",
    })] = "inertial"
    rims: Annotated[bool, Choice({
        True: "sliders meet the rims of the surfaces (2.99)-(2.109)",
        False: "surfaces have no rims: sliders may pass their capacity",
    })] = True
    bouc_wen: Annotated[str, Choice({word: law.meaning for word, law in HYSTERESIS.items()})] = "report"
    friction: Annotated[str, Choice(FRICTION)] = "constant"
    friction_law: str | None = None
    uplift: Annotated[bool, Choice({
        False: "bodies never part; a run in which they would stops with a named error",
        True: "bodies may part, fly and land at every surface",
    })] = False
    top_rotation: Annotated[bool, Choice({
        False: "what holds the top plate stays level",
        True: "what holds the top plate turns as given",
    })] = False

    def __post_init__(self) -> None:
        check_fields(self, "effects")
        if self.friction == "custom" and self.law is not None:
            object.__setattr__(self, "friction_law", self.law.text)  # one spelling, so that equal laws are one model
        else:
            law_of(self.friction, self.friction_law)
        if self.sliders == "massless" and self.spin == "free":
            raise InputError(
                "effects.spin = 'free' with effects.sliders = 'massless': nothing determines the spin of a body "
                "without inertia; give spin = 'locked' or 'patch'"
            )
        if self.sliders == "massless" and self.uplift:
            raise InputError(
                "effects.uplift = True with effects.sliders = 'massless': a body in flight moves by its inertia; "
                "give sliders = 'inertial'"
            )

    @property
    def law(self) -> Law | None:
        """The law of the friction coefficient; None where it is constant."""
        return law_of(self.friction, self.friction_law)

    @property
    def flows(self) -> bool:
        """Whether Y follows slip in closed form, so that a model without masses needs no integration."""
        quasistatic = self.dimension == "planar" and self.sliders == "massless" and not self.uplift
        return quasistatic and self.law is None and grows_alone(self.bouc_wen)


@dataclass(frozen=True)
class Auto:
    """Effects of which those left None are chosen from the scene: the smallest set that can matter (docs/effects.md).

    dimension, sliders, rims, uplift: a word of `Effects` to insist on, or None. friction: likewise; None: the law whose
    numbers the surfaces carry. spin, bouc_wen, friction_law: as in `Effects`. error: what leaving an effect out may
    change, as a share of the friction force. Raises InputError.
    """

    dimension: Annotated[str | None, Choice(("spatial", "planar"))] = None
    sliders: Annotated[str | None, Choice(("inertial", "massless"))] = None
    rims: Annotated[bool | None, Choice((True, False))] = None
    uplift: Annotated[bool | None, Choice((True, False))] = None
    spin: Literal["locked", "patch", "free"] = "locked"
    bouc_wen: Annotated[str, Choice(HYSTERESIS)] = "report"
    friction: Annotated[str | None, Choice(FRICTION)] = None
    friction_law: str | None = None
    error: Annotated[float, Quantity("", above=0.0)] = 0.005

    def __post_init__(self) -> None:
        check_fields(self, "effects")
        if self.error >= 1:
            raise InputError(f"effects.error = {self.error}: a share of the friction force; give less than 1: 0.005")
        self.closed(friction=self.friction or ("custom" if self.friction_law else None))

    def closed(self, **choices: object) -> Effects:
        """Effects with the given choices; what is still open is modelled, but uplift. Raises InputError."""
        given = {field.name: getattr(self, field.name) for field in fields(Effects) if hasattr(self, field.name)}
        return Effects(**{name: value for name, value in {**given, **choices}.items() if value is not None})


CHOSEN = ("dimension", "sliders", "rims", "uplift")
"""Effects that `Auto` chooses."""


@dataclass(frozen=True)
class ModelSpec:
    """Everything that determines one set of equations, and so one compiled model."""

    layout: Layout
    effects: Effects = Effects()

    @property
    def key(self) -> str:
        """A stable name, such as `5_2_2-spatial-locked-inertial-rims-report-constant`."""
        name = self.layout.name
        for field in fields(Effects):
            value = getattr(self.effects, field.name)
            if isinstance(value, bool):  # said where it is on, and where it is off against the default
                name += f"-{field.name}" if value else f"-no{field.name}" if field.default else ""
            elif field.name != "friction_law":
                name += f"-{value}"
            elif value is not None:
                name += f"[{value.replace(' ', '')}]"
        return name
