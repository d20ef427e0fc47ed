"""The unknowns of a fit: parameters of the scene, some of them tied, with bounds; and an offset of force per test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.scene.parameters import Parameter, changed_parameters, parameters_of

if TYPE_CHECKING:
    from msfp_gen.scene.scene import Scene

RANGE = 10.0  # default bounds: the value at the start, divided and multiplied by this
_OF_THE_TEST = {
    "motion": "the tests give the motion",
    "load": "the tests have no load history",
    "initial_state": "a test starts at the centre of the bearing",
}


@dataclass(frozen=True)
class Unknown:
    """One value to be fitted.

    Attributes:
        name: path of the parameter; of tied parameters all paths, separated by `=`.
        members: parameters that have this value.
        low, high: bounds [unit].
    """

    name: str
    members: tuple[Parameter, ...]
    low: float
    high: float

    @property
    def start(self) -> float:
        """Value at the start of the fit [unit]."""
        return self.members[0].value

    @property
    def unit(self) -> str:
        """SI unit."""
        return self.members[0].unit


def unknowns_of(
    scene: Scene, paths: Sequence[str], bounds: Mapping[str, tuple[float, float]] | None = None
) -> tuple[Unknown, ...]:
    """The unknowns at some paths; `A=B` is one unknown for both. bounds: path, as given or of one parameter -> (low,
    high). Raises InputError that names the path.
    """
    if isinstance(paths, str) or not paths:
        raise InputError(f"parameters = {paths!r}: give a list of paths, such as ['bearing.surfaces[*].friction']")
    rest, found = {_whole(path): limits for path, limits in (bounds or {}).items()}, []
    for path in map(_whole, paths):
        parts = path.split("=")
        members = [parameters_of(scene, [part], "parameters") for part in parts]
        groups = [(each,) for each in members[0]] if len(parts) == 1 else [tuple(p for m in members for p in m)]
        limits = rest.pop(path, None)
        for group in groups:
            name = "=".join(parameter.path for parameter in group)
            found.append(_unknown(name, group, rest.pop(name, limits)))
    if rest:
        raise InputError(f"bounds: {next(iter(rest))!r} is no parameter of this fit; give one of its paths")
    _check_members([member for unknown in found for member in unknown.members])
    return tuple(found)


def changed_scene(scene: Scene, unknowns: Sequence[Unknown], values: Array) -> Scene:
    """The scene with these values of the unknowns. Raises InputError where a field does not accept its value."""
    pairs = zip(unknowns, values, strict=True)
    return changed_parameters(scene, {p: float(value) for unknown, value in pairs for p in unknown.members})


def _whole(path: str) -> str:
    """A path, or tied paths, with `friction[0]` written as `bearing.friction[0]`."""
    parts = [part.strip() for part in str(path).split("=")]
    return "=".join(part if "." in part else f"bearing.{part}" for part in parts)


def _unknown(name: str, members: tuple[Parameter, ...], limits: tuple[float, float] | None) -> Unknown:
    first = members[0]
    if len({(member.unit, member.field) for member in members}) > 1:
        raise InputError(f"parameters = {name!r}: different quantities cannot have one value; give them apart")
    if limits is None:
        if first.value == 0:
            raise InputError(f"parameters = {name!r}: it is 0 in the scene, which gives no range; give bounds for it")
        limits = (min(first.value / RANGE, first.value * RANGE), max(first.value / RANGE, first.value * RANGE))
    low, high = (float(limit) for limit in limits)
    if not low < high or not np.isfinite([low, high]).all():
        raise InputError(f"bounds of {name} = {low:g}, {high:g}: give a lower bound below an upper one")
    if (first.least is not None and low < first.least) or (first.above is not None and low <= first.above):
        least = f"at least {first.least:g}" if first.least is not None else f"more than {first.above:g}"
        raise InputError(f"bounds of {name} = {low:g}, {high:g}: this field is {least}; raise the lower bound")
    if not low < first.value < high:
        raise InputError(f"bounds of {name} = {low:g}, {high:g}: the scene has {first.value:g}; start between them")
    return Unknown(name, members, low, high)


def _check_members(members: Sequence[Parameter]) -> None:
    paths = [member.path for member in members]
    for member in members:
        if paths.count(member.path) > 1:
            raise InputError(f"parameters = {member.path!r}: given twice; give each parameter once")
        if member.part in _OF_THE_TEST:
            raise InputError(f"parameters = {member.path!r}: {_OF_THE_TEST[member.part]}; leave it out")
