"""The kinds of `[load]`, `[top_rotation]` and `motion.rotation` in a scene file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Annotated, Any, ClassVar

from msfp_gen.common.fields import Quantity
from msfp_gen.errors import InputError
from msfp_gen.motions.prescribed import Load, Prescribed, Rotation

_TIME = Quantity("s", above=0.0)
_TIMES = Quantity("s", least=0.0, shape=(None,))
_FORCE, _MOMENT, _ANGLE = Quantity("N", shape=(3,)), Quantity("N m", shape=(3,)), Quantity("rad")
_FREQUENCY, _COUNT = Quantity("Hz", above=0.0), Quantity("", above=0.0)
_NONE = (0.0, 0.0, 0.0)
Rows = tuple[tuple[float, ...], ...]


@dataclass(frozen=True, kw_only=True)
class HistoryTable:
    """Table of one kind. of: the class of the history; make: the name of its constructor, which takes the fields."""

    kind: ClassVar[str]
    of: ClassVar[type[Prescribed]]
    make: ClassVar[str]

    def build(self) -> Prescribed:
        """The history. Raises InputError."""
        return getattr(self.of, self.make)(**{f.name: getattr(self, f.name) for f in fields(self)})  # type: ignore[no-any-return]


@dataclass(frozen=True, kw_only=True)
class _Ramp(HistoryTable):
    kind, make = "ramp", "ramp"
    duration: Annotated[float, _TIME]


@dataclass(frozen=True, kw_only=True)
class _Harmonic(HistoryTable):
    kind, make = "harmonic", "harmonic"
    frequency: Annotated[float, _FREQUENCY]
    cycles: Annotated[float, _COUNT]
    phase: Annotated[float, _ANGLE] = 0.0
    lead_in: Annotated[float | None, _TIME] = None


@dataclass(frozen=True, kw_only=True)
class ConstantLoad(HistoryTable):
    """`Load.constant`."""

    kind, of, make = "constant", Load, "constant"
    force: Annotated[tuple[float, float, float], _FORCE] = _NONE
    moment: Annotated[tuple[float, float, float], _MOMENT] = _NONE


@dataclass(frozen=True, kw_only=True)
class RampLoad(_Ramp, ConstantLoad):
    """`Load.ramp`."""


@dataclass(frozen=True, kw_only=True)
class HarmonicLoad(_Harmonic, ConstantLoad):
    """`Load.harmonic`."""


@dataclass(frozen=True, kw_only=True)
class SampledLoad(HistoryTable):
    """`Load.from_arrays`: linear between samples; two samples at the same time make a jump."""

    kind, of, make = "samples", Load, "from_arrays"
    time: Annotated[tuple[float, ...], _TIMES]
    force: Annotated[Rows, Quantity("N", shape=(None, 3))]
    moment: Annotated[Rows | None, Quantity("N m", shape=(None, 3))] = None


@dataclass(frozen=True, kw_only=True)
class LoadPieces(HistoryTable):
    """The polynomials of a `Load`."""

    kind, of, make = "pieces", Load, "of"
    knots: Annotated[tuple[float, ...], _TIMES]
    coefficients: Annotated[tuple[Any, ...], Quantity("", shape=(None, 6, 6), computed=True)]
    name: str = ""


@dataclass(frozen=True, kw_only=True)
class ConstantRotation(HistoryTable):
    """`Rotation.constant`."""

    kind, of, make = "constant", Rotation, "constant"
    psi: Annotated[float, _ANGLE] = 0.0
    theta: Annotated[float, _ANGLE] = 0.0


@dataclass(frozen=True, kw_only=True)
class RampRotation(_Ramp, ConstantRotation):
    """`Rotation.ramp`."""


@dataclass(frozen=True, kw_only=True)
class HarmonicRotation(_Harmonic, ConstantRotation):
    """`Rotation.harmonic`."""


@dataclass(frozen=True, kw_only=True)
class SampledRotation(HistoryTable):
    """`Rotation.from_arrays`: a spline through psi, theta with zero rates at its ends."""

    kind, of, make = "samples", Rotation, "from_arrays"
    time: Annotated[tuple[float, ...], _TIMES]
    angles: Annotated[Rows, Quantity("rad", shape=(None, 2))]


@dataclass(frozen=True, kw_only=True)
class RotationPieces(HistoryTable):
    """The polynomials of a `Rotation`."""

    kind, of, make = "pieces", Rotation, "of"
    knots: Annotated[tuple[float, ...], _TIMES]
    name: str = ""
    coefficients: Annotated[tuple[Any, ...], Quantity("", shape=(None, 2, 6), computed=True)]


LOADS: dict[str, type[HistoryTable]] = {
    kind.kind: kind for kind in (ConstantLoad, RampLoad, HarmonicLoad, SampledLoad, LoadPieces)
}
ROTATIONS: dict[str, type[HistoryTable]] = {
    kind.kind: kind for kind in (ConstantRotation, RampRotation, HarmonicRotation, SampledRotation, RotationPieces)
}


def history_from(kinds: Mapping[str, type[HistoryTable]], table: Mapping[str, Any], path: str) -> Any:
    """The load or rotation history of a validated table; raises InputError whose message starts with `path`."""
    values = dict(table)
    try:
        return kinds[values.pop("kind")](**values).build()
    except InputError as error:
        text = str(error)
        for word in ("load", "rotation"):
            text = text.removeprefix(word) if text.startswith((f"{word}.", f"{word}:", f"{word} ")) else text
        raise InputError(path + text if text != str(error) else f"{path}: {text}") from None


def table_of(history: Prescribed) -> dict[str, Any]:
    """The table of any load or rotation history: its polynomials."""
    table: dict[str, Any] = {"kind": "pieces", "knots": history.knots.tolist()}
    table["coefficients"] = history.coefficients.tolist()
    return table | ({"name": history.name} if history.name else {})
