"""Parameters of a scene, numbers by which a run is differentiated or that a fit changes: paths, values, changed scenes.

Paths are such as `bearing.surfaces[*].friction`, `top.mass`, `motion.scale`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from msfp_gen.common.errors import InputError, prefixed
from msfp_gen.common.fields import Quantity, errors_at, ruled_fields
from msfp_gen.scene.bearing import Bearing, Body, Surface
from msfp_gen.scene.fidelity import check_stack
from msfp_gen.scene.friction_parameters import law_parameters
from msfp_gen.scene.scene_fields import InitialState
from msfp_gen.scene.standing import seat_stiffness

if TYPE_CHECKING:
    from msfp_gen.motions.motion import Motion
    from msfp_gen.scene.scene import Scene


@dataclass(frozen=True)
class Parameter:
    """One number of a scene.

    Attributes:
        path: such as `bearing.surfaces[0].friction`.
        part: "bearing", "surfaces", "bodies", "top", "motion", "load" or "initial_state".
        field: name of the field of that part.
        index: of the surface or body, then of the component of the field; indices count from zero.
        unit: SI unit; "" for a plain number.
        value: in the scene.
        least, above: bounds that its field has, inclusive and exclusive [unit]; None: unbounded.
    """

    path: str
    part: str
    field: str
    index: tuple[int, ...]
    unit: str
    value: float
    least: float | None = None
    above: float | None = None

    def __str__(self) -> str:
        return f"{self.path} = {self.value:g}" + (f" {self.unit}" if self.unit else "")


_STEP = re.compile(r"([a-z]\w*)((?:\[(?:\d+|\*)\])*)")
_ROWS: dict[str, type] = {"surfaces": Surface, "bodies": Body}
_STATE = {"q": ("rad", 3), "v": ("rad/s", 3), "h": ("", 2)}
# Numbers that a run does not depend on smoothly, or not at all: path -> why.
_WITHOUT = {
    "bearing.base_centroid": "a run does not depend on it",
    "bearing.friction_lower": "a run does not depend on it",
    "bearing.friction_upper": "a run does not depend on it",
}
_MOTION_FIELDS = {"amplitude": "m", "acceleration": "m/s^2"}  # fields to which the motion is proportional
_ANALYTIC = ("harmonic", "circle", "figure-eight", "ramp")
REMEDY = (
    "give paths such as bearing.surfaces[0].friction, bearing.surfaces[*].friction, bearing.bodies[0].mass, "
    "bearing.gravity, top.mass, motion.scale, load.scale or initial_state.q[0][1]"
)


class _ParameterPlace(NamedTuple):
    """The place that a path names: part, field, indices with None for all, and how many there are of each."""

    part: str
    field: str
    indices: tuple[int | None, ...]
    counts: tuple[int, ...]


def parameters_of(scene: Scene, paths: Sequence[str], name: str = "gradients") -> tuple[Parameter, ...]:
    """The parameters of a scene at some paths; `[*]` stands for all indices. Raises InputError that names `name`."""
    if isinstance(paths, str) or not all(isinstance(path, str) for path in paths):
        raise InputError(f"{name} = {paths!r}: give a list of paths, such as ['bearing.surfaces[*].friction']")
    parameters: dict[str, Parameter] = {}
    for text in paths:
        with prefixed(f"{name} = {text!r}: "):
            for parameter in _parameters(scene, text):
                if parameter.part in _ROWS:
                    check_stack(scene)
                if parameter.path in parameters:
                    raise InputError(f"{parameter.path} is given twice; give each parameter once")
                parameters[parameter.path] = parameter
    return tuple(parameters.values())


def _parameters(scene: Scene, text: str) -> Iterator[Parameter]:
    place = _place(scene, text)
    for index_or_all, count in zip(place.indices, place.counts, strict=True):
        if index_or_all is not None and index_or_all >= count:
            raise InputError(f"there are {count} of them; give an index from 0 to {count - 1}, or *")
    for index in product(*(range(n) if i is None else (i,) for i, n in zip(place.indices, place.counts, strict=True))):
        yield _parameter(scene, place.part, place.field, index)


def _place(scene: Scene, text: str) -> _ParameterPlace:
    """The place of a path. Raises InputError where there is none."""
    steps = [_STEP.fullmatch(step) for step in text.split(".")]
    names = [step[1] for step in steps if step]
    brackets = [re.findall(r"\d+|\*", step[2]) for step in steps if step]
    if not all(steps) or not 2 <= len(names) <= 3:
        raise InputError(f"no path of a parameter; {REMEDY}")
    count = scene.bearing.layout.surfaces
    if names[0] == "bearing" and len(names) == 2:
        for part, kind in _ROWS.items():  # the short form bearing.friction[0] of bearing.surfaces[0].friction
            if names[1] in _quantities(kind):
                return _row_place(part, kind, names[1], brackets[1][:1], brackets[1][1:], count, brackets[0])
        return _field_place("bearing", Bearing, names[1], brackets)
    if names[0] == "bearing" and names[1] in _ROWS:
        kind = _ROWS[names[1]]
        return _row_place(names[1], kind, names[2], brackets[1], brackets[2], count, brackets[0])
    if len(names) == 2 and not brackets[0]:
        if names[0] == "top":
            return _field_place("top", type(scene.top), names[1], brackets)
        if names[0] == "initial_state" and names[1] in _STATE:
            return _ParameterPlace(names[0], names[1], _indices(brackets[1], 2), (count, _STATE[names[1]][1]))
        if names[0] in ("motion", "load"):
            return _history_place(scene, names[0], names[1], brackets[1])
    raise InputError(f"a run has no gradient with respect to it; {REMEDY}")


def _row_place(
    part: str, kind: type, field: str, row: list[str], component: list[str], count: int, extra: list[str]
) -> _ParameterPlace:
    if extra:
        raise InputError("there is one bearing; leave out its index")
    rule = _rule(f"bearing.{part}", kind, field)
    _refuse_without(part, field)
    if len(row) != 1:
        raise InputError(f"there are {count} {part}; give bearing.{part}[0].{field}, or bearing.{part}[*].{field}")
    return _ParameterPlace(part, field, _indices(row, 1) + _components(rule, component), (count, *_shape(rule)))


def _field_place(part: str, kind: type, field: str, brackets: list[list[str]]) -> _ParameterPlace:
    if brackets[0]:
        raise InputError(f"there is one {part}; leave out its index")
    rule = _rule(part, kind, field)
    _refuse_without(part, field)
    return _ParameterPlace(part, field, _components(rule, brackets[1]), _shape(rule))


def _history_place(scene: Scene, part: str, field: str, brackets: list[str]) -> _ParameterPlace:
    known = ["scale", "direction"] if part == "motion" else ["scale"]
    table = scene.motion_table or {}
    if part == "motion" and table.get("kind") in _ANALYTIC:
        known += [name for name in _MOTION_FIELDS if name in table]
    if part == "load" and scene.load is None:
        raise InputError("this scene has no load history; give one")
    if field not in known or brackets:
        raise InputError(f"no parameter of this {part}; give {' or '.join(f'{part}.{name}' for name in known)}")
    return _ParameterPlace(part, field, (), ())


def _refuse_without(part: str, field: str) -> None:
    if (why := _WITHOUT.get(f"{part}.{field}")) is not None:
        raise InputError(f"{why}; leave it out")


def _quantities(kind: type) -> dict[str, Quantity]:
    """Fields of a class that hold numbers."""
    return {name: rule for name, rule, _ in ruled_fields(kind) if isinstance(rule, Quantity)}


def _rule(where: str, kind: type, field: str) -> Quantity:
    known = _quantities(kind)
    if field not in known:
        close = get_close_matches(field, known, 1)
        hint = f"; did you mean {close[0]}?" if close else f"; give one of {', '.join(known)}"
        raise InputError(f"{where} has no number {field!r}{hint}")
    return known[field]


def _shape(rule: Quantity) -> tuple[int, ...]:
    return tuple(size or 0 for size in rule.shape)


def _components(rule: Quantity, brackets: list[str]) -> tuple[int | None, ...]:
    if len(brackets) != len(rule.shape):
        indices = "[0], [1] or [*]" if rule.shape else "no index"
        raise InputError(
            f"this field holds {rule.shape[0] if rule.shape else 1} numbers; give {indices} after its name"
        )
    return _indices(brackets, len(rule.shape))


def _indices(brackets: Iterable[str], count: int) -> tuple[int | None, ...]:
    indices = tuple(None if text == "*" else int(text) for text in brackets)
    if len(indices) != count:
        raise InputError(f"it needs {count} indices, such as {'[0]' * count} or {'[*]' * count}")
    return indices


def _parameter(scene: Scene, part: str, field: str, index: tuple[int, ...]) -> Parameter:
    if part in ("motion", "load"):
        return _history_parameter(scene, part, field)
    if part == "initial_state":
        path = f"{part}.{field}[{index[0]}][{index[1]}]"
        values = None if scene.initial_state is None else getattr(scene.initial_state, field)
        return Parameter(path, part, field, index, _STATE[field][0], values[index[0]][index[1]] if values else 0.0)
    owner: Any = {"bearing": scene.bearing, "top": scene.top}.get(part)
    path, component = f"{part}.{field}", index
    if owner is None:
        owner, component = getattr(scene.bearing, part)[index[0]], index[1:]
        path = f"bearing.{part}[{index[0]}].{field}"
    rule, value = _quantities(type(owner))[field], getattr(owner, field)
    if field.startswith("seat_") and not scene.modelled.uplift:
        raise InputError("this scene has no uplift, and its surfaces stay closed; leave it out, or give uplift = true")
    if value is None and field == "seat_stiffness":
        value = float(seat_stiffness(scene.bearing, scene.top)[index[0]])
    elif value is None and part == "surfaces":
        value = _law_value(scene, field, index[0])
    if part == "top" and field.startswith("vertical_") and not scene.top.vertical_stiffness:
        raise InputError("this top has no vertical spring, and a run changes abruptly with the first; give it one")
    value = value[component[0]] if component else value
    path += "".join(f"[{i}]" for i in component)
    return Parameter(path, part, field, index, rule.unit, float(value), rule.least, rule.above)


def _law_value(scene: Scene, field: str, index: int) -> float:
    """Value of a number of the friction law that the surface does not give: the default of the law."""
    word, law = scene.law
    values = {} if law is None else law_parameters(law, scene.bearing, index)
    if field not in values:
        raise InputError(f"effects.friction = {word!r} has no such number; leave it out, or give a law that has it")
    return values[field]


def _history_parameter(scene: Scene, part: str, field: str) -> Parameter:
    table = scene.motion_table or {}
    value, unit = 1.0, ""
    if field in _MOTION_FIELDS:
        value, unit = float(table[field]), _MOTION_FIELDS[field]
    elif field == "direction":
        value, unit = float(table.get("direction") or table.get("rotated_by") or 0.0), "rad"
        if scene.motion.coefficients[:, 3:5].any():
            raise InputError("this motion rocks the base, and its angles do not turn with it; leave it out")
    elif part == "motion" and table.get("scale_to") is None:
        value = float(table.get("scale", 1.0))
    return Parameter(f"{part}.{field}", part, field, (), unit, value)


def changed_parameters(scene: Scene, values: Mapping[Parameter, float]) -> Scene:
    """`scene` with other values of parameters, which `parameters_of(scene, ...)` must have given.

    Raises InputError where a field does not accept its value.
    """
    for parameter, value in values.items():
        scene = _changed(scene, parameter, float(value))
    return scene


def _changed(scene: Scene, parameter: Parameter, value: float) -> Scene:
    part, name = parameter.part, parameter.field
    if part == "motion":
        motion = scaled_motion(scene.motion, value / parameter.value) if name != "direction" else None
        motion = scene.motion.rotated(value - parameter.value) if motion is None else motion
        return replace(scene, motion=motion, motion_table=None)
    if part == "load":
        assert scene.load is not None
        return replace(scene, load=replace(scene.load, coefficients=value / parameter.value * scene.load.coefficients))
    if part == "initial_state":
        return replace(scene, initial_state=_state(scene, name, parameter.index, value))
    if part == "top":
        return replace(scene, top=_with(scene.top, name, parameter.index, value))
    if part == "bearing":
        return replace(scene, bearing=scene.bearing.replace(**{name: value}))
    rows = list(getattr(scene.bearing, part))
    row = parameter.index[0]
    with errors_at("surface" if part == "surfaces" else "body", f"bearing.{part}[{row}]"):
        rows[row] = _with(rows[row], name, parameter.index[1:], value)
    changes: dict[str, Any] = {part: rows}
    return replace(scene, bearing=replace(scene.bearing, **changes))


def scaled_motion(motion: Motion, factor: float) -> Motion:
    """A motion with its displacements multiplied by a factor; rotations of the base are unchanged."""
    coefficients = motion.coefficients.copy()
    coefficients[:, :3] *= factor
    return replace(motion, coefficients=coefficients)


def _with(owner: Any, name: str, component: tuple[int, ...], value: float) -> Any:
    """A copy of a surface, body or top with one number changed."""
    if not component:
        return replace(owner, **{name: value})
    numbers = list(getattr(owner, name))
    numbers[component[0]] = value
    return replace(owner, **{name: tuple(numbers)})


def _state(scene: Scene, name: str, index: tuple[int, ...], value: float) -> InitialState:
    """The initial state with one number changed; centred and at rest where the scene gives none."""
    count, state = scene.bearing.layout.surfaces, scene.initial_state
    arrays: dict[str, Any] = {
        key: np.zeros((count, size)) if state is None else np.array(getattr(state, key), dtype=float)
        for key, size in (("q", 3), ("v", 3), ("h", 2))
    }
    arrays[name][index] = value
    return InitialState(arrays["q"].tolist(), arrays["v"].tolist(), arrays["h"].tolist())
