"""The data of one bearing: lengths, masses, friction. They are values: changing them never recompiles a model.

Everything is in SI units. Paths in messages count surfaces and bodies from zero, as the lists do; the number of
PEER 2017/07 follows in brackets.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import MISSING, InitVar, dataclass
from dataclasses import fields as dataclass_fields
from dataclasses import replace as dataclass_replace
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray

from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Quantity, check_fields, errors_at, paired, require_type
from msfp_gen.common.tables import LabelledValues, Printed
from msfp_gen.scene.sheet import BOUNDS, Sheet
from msfp_gen.specification import contract
from msfp_gen.specification.layout import Layout
from msfp_gen.specification.values import Bound, rules

if TYPE_CHECKING:
    pass

_BODY = rules(contract.BODY)
_SURFACE = rules((*contract.EVERY_SURFACE, *contract.NUMBERS.values()))


@dataclass(frozen=True)
class Surface:
    """One sliding surface gamma; all values are finite.

    radius: R of the sphere [m]. capacity: s_c, the sliding displacement at which the slider meets the rim (2.101) [m].
    friction: friction coefficient mu. yield_displacement: d_y of the Bouc-Wen equations [m]; R_gamma/R_0 of (2.94),
    with its values in SI, is 1/d_y. rim_stiffness: k_c [N/m]. rim_damping: c_c [N s/m] (2.103).
    seat_stiffness [N/m], seat_damping [s/m]: k and c of the unilateral contact of models with uplift, whose force is
    k (s + c abs(s) ds/dt) at compression s (docs/uplift.md); k = None: chosen from the top. contact_damping: T
    [s]; friction is mu N (Y + T dY/dt) in place of mu N Y (docs/friction.md). The remaining fields are parameters of
    friction laws (docs/friction.md) and of drilling moments: each is given if, and only if, the law of
    `Effects.friction` or the moment of `Effects.spin` has it. Raises InputError.
    """

    radius: Annotated[float, _SURFACE["radius"]]
    capacity: Annotated[float, _SURFACE["capacity"]]
    friction: Annotated[float, _SURFACE["friction"]]
    yield_displacement: Annotated[float, _SURFACE["yield_displacement"]]
    rim_stiffness: Annotated[float, _SURFACE["rim_stiffness"]] = 0.0
    rim_damping: Annotated[float, _SURFACE["rim_damping"]] = 0.0
    seat_stiffness: Annotated[float | None, _SURFACE["seat_stiffness"]] = None
    seat_damping: Annotated[float, _SURFACE["seat_damping"]] = 10.0
    contact_damping: Annotated[float, _SURFACE["contact_damping"]] = 1e-4
    friction_slow: Annotated[float | None, _SURFACE["friction_slow"]] = None
    velocity_rate: Annotated[float | None, _SURFACE["velocity_rate"]] = None
    velocity_drop: Annotated[float | None, _SURFACE["velocity_drop"]] = None
    reference_pressure: Annotated[float | None, _SURFACE["reference_pressure"]] = None
    pressure_ratio: Annotated[float | None, _SURFACE["pressure_ratio"]] = None
    temperature_ratio: Annotated[float | None, _SURFACE["temperature_ratio"]] = None
    patch_radius: Annotated[float | None, _SURFACE["patch_radius"]] = None
    conductivity: Annotated[float | None, _SURFACE["conductivity"]] = None
    diffusivity: Annotated[float | None, _SURFACE["diffusivity"]] = None
    plate_thickness: Annotated[float | None, _SURFACE["plate_thickness"]] = None
    start_temperature: Annotated[float | None, _SURFACE["start_temperature"]] = None
    c1: Annotated[float | None, _SURFACE["c1"]] = None
    c2: Annotated[float | None, _SURFACE["c2"]] = None
    c3: Annotated[float | None, _SURFACE["c3"]] = None
    c4: Annotated[float | None, _SURFACE["c4"]] = None

    def __post_init__(self) -> None:
        check_fields(self, "surface")


@dataclass(frozen=True)
class Body:
    """One moving body k = 2..n, axisymmetric; all values are finite.

    height: l, between the centres of its faces [m]. centroid: z, position of the centre of mass on the axis, from the
    bottom where the lower face is concave up (3.6) and from the top where it is concave down (3.10) [m]. mass [kg].
    inertia: J, (transverse, axial) about the centre of mass, or one value for both [kg m^2].
    rim_radius, rim_offset: r and p, radius and height of the edge that meets the rim of a surface (3.25) [m].
    Raises InputError.
    """

    height: Annotated[float, _BODY["height"]]
    centroid: Annotated[float, _BODY["centroid"]]
    mass: Annotated[float, _BODY["mass"]]
    inertia: Annotated[tuple[float, float] | float, paired(_BODY["inertia_transverse"])]
    rim_radius: Annotated[float, _BODY["rim_radius"]] = 0.0
    rim_offset: Annotated[float, _BODY["rim_offset"]] = 0.0

    def __post_init__(self) -> None:
        check_fields(self, "body")
        transverse, axial = self.moments
        values = {**vars(self), "inertia_transverse": transverse, "inertia_axial": axial}
        shown = {name: f"body.{name} = {value}" for name, value in values.items()}
        _check_bounds(contract.BODY_BOUNDS, values, shown | {"inertia_axial": f"body.inertia = {self.inertia}"})

    @property
    def moments(self) -> tuple[float, float]:
        """(transverse, axial) moments of inertia [kg m^2]."""
        assert isinstance(self.inertia, tuple)  # check_fields has expanded a single number to a pair
        return self.inertia


_COEFFICIENTS = Quantity("", least=0.0, shape=(None,))
_LISTS: dict[str, type] = {"surfaces": Surface, "bodies": Body}
_SURFACE_ARRAYS = tuple(  # the stiffness of unilateral contacts depends on the top where it is not given
    name for name in contract.names(contract.EVERY_SURFACE) if name != "seat_stiffness"
)


@dataclass(frozen=True, repr=False)
class Bearing(Printed):
    """A stack of bodies with `layout`: n - 1 surfaces, and the bodies 2..n above the base (body 1), bottom first.

    base_height: l_1 [m]. gravity: g [m/s^2], by default 9.8 as in PEER 2017/07; the unit g of texts is 9.80665 m/s^2.
    base_rim_radius, base_rim_offset: r_1, p_1, used where the first surface is concave down [m].
    base_centroid: z_1, which only defines the named point r_1 (3.2); None: half the height [m].
    friction_lower, friction_upper: coefficients of the surfaces at the bounds of a bounding analysis, bottom first;
    None: the analysis needs factors.
    friction_at: "pivot" where the coefficients of `surfaces`, and their bounds, come from a data sheet; the bearing
    keeps the coefficients at the surfaces (`friction_from_pivot`).
    Raises InputError: a wrong number of entries, a value out of range, or a geometry that cannot be built.
    """

    layout: Layout
    base_height: Annotated[float, _BODY["height"]]
    surfaces: Sequence[Surface]
    bodies: Sequence[Body]
    gravity: Annotated[float, contract.GRAVITY.rule] = 9.8
    base_rim_radius: Annotated[float, _BODY["rim_radius"]] = 0.0
    base_rim_offset: Annotated[float, _BODY["rim_offset"]] = 0.0
    base_centroid: Annotated[float | None, _BODY["centroid"]] = None
    friction_lower: Annotated[tuple[float, ...] | None, _COEFFICIENTS] = None
    friction_upper: Annotated[tuple[float, ...] | None, _COEFFICIENTS] = None
    friction_at: InitVar[str] = "surface"

    def __post_init__(self, friction_at: str) -> None:
        require_type(self.layout, Layout, "bearing.layout")
        check_fields(self, "bearing")
        for name, kind in _LISTS.items():
            self._check_list(name, kind)
        base = dict(zip(_BODY, self._base, strict=True))
        shown = {name: f"bearing.base_{name} = {value}" for name, value in base.items()}
        _check_bounds(contract.BODY_BOUNDS, base, shown)
        for index in range(self.layout.surfaces):
            self._check_geometry(index)
        object.__setattr__(self, "_given_at", friction_at)
        self._check_friction_bounds()
        if _is_at_pivot(friction_at):
            radii, heights = (
                [s.radius for s in self.surfaces],
                (self.base_height, *(body.height for body in self.bodies)),
            )
            converted = friction_from_pivot(self.layout, radii, heights, [s.friction for s in self.surfaces])
            rows = zip(self.surfaces, converted, strict=True)
            object.__setattr__(self, "surfaces", tuple(dataclass_replace(row, friction=mu) for row, mu in rows))
            for name in BOUNDS:
                if (bound := getattr(self, name)) is not None:
                    object.__setattr__(self, name, tuple(friction_from_pivot(self.layout, radii, heights, bound)))

    @classmethod
    def from_sheet(cls, **sheet: Any) -> Bearing:
        """The bearing of a data sheet, by the names of docs/bearing.md: `from_sheet(device="triple", ...)`.

        Capacities, edges of the sliders, masses and moments of inertia follow from it; `replace` changes them. Raises
        InputError.
        """
        unknown = [name for name in sheet if name not in _names(Sheet)]
        if unknown:
            raise InputError(f"sheet.{unknown[0]}: unknown name; give one of {', '.join(_names(Sheet))}")
        missing = [
            field.name for field in dataclass_fields(Sheet) if field.default is MISSING and field.name not in sheet
        ]
        if missing:
            raise InputError(f"sheet.{missing[0]} is missing: a data sheet needs it")
        return cls.of_values(Sheet(**sheet).values)

    @classmethod
    def of_values(cls, values: dict[str, Any]) -> Bearing:
        """The bearing of plain values, as a complete `[bearing]` table has them. Raises InputError."""
        layout = Layout(**values["layout"])
        rows = {name: [kind(**row) for row in values[name]] for name, kind in _LISTS.items()}
        return cls(**{**values, "layout": layout, **rows})

    def _check_friction_bounds(self) -> None:
        """Raise InputError where bounds do not enclose the coefficients of the surfaces."""
        nominal = [surface.friction for surface in self.surfaces]
        for name, sign in zip(BOUNDS, (1, -1), strict=True):
            if (bound := getattr(self, name)) is None:
                continue
            if len(bound) != len(nominal):
                raise InputError(f"bearing.{name} has {len(bound)} entries: give {len(nominal)}, one for each surface")
            for index, (value, middle) in enumerate(zip(bound, nominal, strict=True)):
                if sign * value > sign * middle or (not middle and value):
                    word = "most" if sign > 0 else "least"
                    raise InputError(
                        f"bearing.{name}[{index}] = {value:g} (surface {index + 1}): give at {word} its "
                        f"friction, {middle:g}"
                    )

    def _check_list(self, name: str, kind: type) -> None:
        items = getattr(self, name)
        path = f"bearing.{name}"
        if isinstance(items, str) or not isinstance(items, Iterable):
            raise InputError(f"{path} = {items!r}: give a list of {kind.__name__}")
        items = tuple(items)
        for index, item in enumerate(items):
            require_type(item, kind, f"{path}[{index}]")
        count = self.layout.surfaces
        if len(items) != count:
            meaning = "one per sliding surface" if kind is Surface else "bodies 2..n; the base is base_height"
            raise InputError(f"{path} has {len(items)} entries: layout {self.layout.name} needs {count}, {meaning}")
        object.__setattr__(self, name, items)

    def printed_rows(self) -> tuple[str, LabelledValues]:
        """Layout, and the values of every surface and body, bottom first, in six rows."""
        columns = {"R [m]": "radius", "s_c [m]": "capacity", "mu": "friction", "d_y [m]": "yield_displacement"}
        rows = {label: [getattr(part, name) for part in self.surfaces] for label, name in columns.items()}
        rows |= {"l [m]": [self.base_height, *(part.height for part in self.bodies)]}
        rows |= {"m [kg]": [part.mass for part in self.bodies]}
        shown = [(label, ", ".join(f"{x:.4g}" for x in values)) for label, values in rows.items()]
        return f"Bearing {self.layout.name}", shown

    def slider(self, surface: int) -> int:
        """Index 0..n-1, base first, of the slider of a surface (index from 0): the body that meets its rim.

        It is the body above a concave-up surface and the body below a concave-down one (3.25).
        """
        return surface + 1 if self.layout.signs[surface] > 0 else surface

    def slider_rim_radius(self, surface: int) -> float:
        """Rim radius r [m] of the slider of a surface (index from 0)."""
        body = self.slider(surface)
        return self.bodies[body - 1].rim_radius if body else self.base_rim_radius

    def _check_geometry(self, index: int) -> None:
        body, rim = self.slider(index), self.slider_rim_radius(index)
        surface, field = self.surfaces[index], f"bodies[{body - 1}].rim_radius" if body else "base_rim_radius"
        shown = {
            "rim_radius": f"bearing.{field} = {rim} (body {body + 1})",
            "capacity": f"bearing.surfaces[{index}].capacity = {surface.capacity} (surface {index + 1})",
        }
        _check_bounds(contract.SURFACE_BOUNDS, {**vars(surface), "rim_radius": rim}, shown)

    @property
    def _base(self) -> tuple[float, ...]:
        """The values of the base, as a body has them in `contract.BODY`; mass and moments of inertia 0."""
        centroid = self.base_height / 2 if self.base_centroid is None else self.base_centroid
        return (self.base_height, centroid, 0.0, 0.0, 0.0, self.base_rim_radius, self.base_rim_offset)

    def replace(self, **changes: Any) -> Bearing:
        """A copy with some values changed: fields of the bearing, or one field of all its surfaces or bodies.

        A field of surfaces or bodies takes a list, bottom first (`friction=[0.064, 0.168, 0.168, 0.064]`), or one value
        for all. With `friction_at="pivot"` the coefficients in `friction` come from a data sheet, which refers them to
        the pivot of the bearing, and are converted: `friction_from_pivot`. Raises InputError: an unknown name, a list
        of the wrong length, or an invalid value.
        """
        friction_at = changes.pop("friction_at", "surface")
        if _is_at_pivot(friction_at) and not {"friction", "surfaces"} & changes.keys():
            raise InputError("bearing.friction_at = 'pivot': no friction coefficients are given; give friction with it")
        bounds: dict[str, Any] = {name: getattr(self, name) for name in BOUNDS}
        if {"friction", "surfaces"} & changes.keys():
            bounds = dict.fromkeys(BOUNDS)
        bounds |= {name: changes.pop(name) for name in BOUNDS if name in changes}
        kept = self.friction_given_at if not {"friction", "surfaces"} & changes.keys() else friction_at
        list_of = {column: name for name, kind in _LISTS.items() for column in _names(kind)}
        own = {name: changes.pop(name) for name in _names(Bearing) if name in changes}
        base = dataclass_replace(self, **{**own, **dict.fromkeys(BOUNDS)})
        rows = {name: list(getattr(base, name)) for name in _LISTS}
        for column, entry in changes.items():
            if column not in list_of:
                known = ", ".join([*_names(Bearing), *list_of])
                raise InputError(f"bearing.{column}: unknown name; give one of {known}")
            items = rows[list_of[column]]
            values = _expanded(column, entry, len(items))
            for index, value in enumerate(values):
                with errors_at(type(items[index]).__name__.lower(), f"bearing.{list_of[column]}[{index}]"):
                    items[index] = dataclass_replace(items[index], **{column: value})
        changed = dataclass_replace(
            base, surfaces=rows["surfaces"], bodies=rows["bodies"], friction_at=friction_at, **bounds
        )
        object.__setattr__(changed, "_given_at", kept)
        return changed

    @property
    def friction_given_at(self) -> str:
        """Where the coefficients were given, "surface" or "pivot": factors of a bounding analysis act there."""
        return str(vars(self)["_given_at"])

    @property
    def friction_at_pivot(self) -> tuple[float, ...] | None:
        """Coefficients of a data sheet, which `friction_from_pivot` converts to the surfaces, bottom first [-].

        None where the pivot is not the middle of a slider, or where a surface has the arm of the next one.
        """
        if self.layout.m != self.layout.p:
            return None
        surfaces = self.surfaces
        radii, heights = [s.radius for s in surfaces], (self.base_height, *(body.height for body in self.bodies))
        sheet = [0.0] * len(surfaces)
        for chain in _pivot_chains(self.layout, radii, heights):
            inner_arm = inner_moment = 0.0
            for index, arm in chain:
                moment = surfaces[index].friction * radii[index]
                if arm == inner_arm:
                    return None
                sheet[index] = (moment - inner_moment) / (arm - inner_arm)
                inner_arm, inner_moment = arm, moment
        return tuple(sheet)

    def arrays(self) -> dict[str, NDArray[np.float64]]:
        """All values as float64 arrays.

        Per surface, shape (n-1,): radius, capacity, friction, yield_displacement, rim_stiffness, rim_damping,
        contact_damping, seat_damping. Per body, shape (n,), base first with mass and inertia 0: height,
        centroid, mass, inertia_transverse, inertia_axial, rim_radius, rim_offset. And gravity, shape (). [SI]
        """
        rows = [(b.height, b.centroid, b.mass, *b.moments, b.rim_radius, b.rim_offset) for b in self.bodies]
        arrays = dict(zip(_BODY, np.array([self._base, *rows]).T.copy(), strict=True))
        for name in _SURFACE_ARRAYS:
            arrays[name] = np.array([getattr(surface, name) for surface in self.surfaces])
        return {**arrays, "gravity": np.array(self.gravity)}


def _check_bounds(bounds: Iterable[Bound], values: Mapping[str, float], shown: Mapping[str, str]) -> None:
    """Raise InputError where a value is beyond what others permit. shown: path and value of each, for the message."""
    for bound in bounds:
        if (limit := bound.excess(values)) is not None:
            unit = (_BODY | _SURFACE)[bound.name].unit
            raise InputError(f"{shown[bound.name]}: {bound.remedy}, {limit:.6g} [{unit}]")


def _names(kind: type) -> list[str]:
    return [field.name for field in dataclass_fields(kind)]


def _is_at_pivot(word: Any) -> bool:
    """Whether the coefficients refer to the pivot. Raises InputError for another word."""
    if word not in ("surface", "pivot"):
        raise InputError(f"bearing.friction_at = {word!r}: give 'surface' or 'pivot'")
    return bool(word == "pivot")


def _expanded(column: str, value: Any, count: int) -> list[Any]:
    """A list with one entry per row; one number, or one (transverse, axial) pair, is repeated for all rows."""
    is_list = isinstance(value, Sequence | np.ndarray) and not isinstance(value, str)
    if not is_list or (column == "inertia" and isinstance(value[0], int | float)):
        return [value] * count
    if len(value) != count:
        raise InputError(f"bearing.{column} has {len(value)} entries: give {count}, or one value for all")
    return list(value)


def friction_from_pivot(
    layout: Layout, radii: Sequence[float], heights: Sequence[float], coefficients: Sequence[float]
) -> list[float]:
    """Friction coefficients mu of the surfaces [-], from the coefficients of a data sheet, which refer to the pivot.

    Published formulas let friction act at the pivot, the middle of the innermost slider, and not at the sliding
    surface. The coefficient of an outer surface in such a formula contains the lever arms of the inner ones:
    docs/bearing.md, "Which friction a data sheet means". With R_eff the distance from the sphere centre to the pivot
    and ' for the next surface towards the pivot: mu = (mu_pivot (R_eff - R_eff') + mu' R')/R.

    Args:
        layout: of the bearing, with as many surfaces concave up as down.
        radii: radius of each surface, bottom first [m].
        heights: height of each body, base first [m].
        coefficients: coefficient of each surface at the pivot, bottom first.

    Raises:
        InputError: the pivot of the layout is not the middle of a slider, or a coefficient would be negative.
    """
    if layout.m != layout.p:
        raise InputError(
            f"bearing.friction_at = 'pivot': layout {layout.name} has {layout.m} surfaces concave up and {layout.p} "
            "down, so its pivot is not the middle of its inner slider; give the coefficients at the surfaces"
        )
    converted = [0.0] * layout.surfaces
    for chain in _pivot_chains(layout, radii, heights):
        inner_arm = inner_moment = 0.0
        for index, arm in chain:
            moment = coefficients[index] * (arm - inner_arm) + inner_moment
            if moment < 0:
                raise InputError(
                    f"bearing.surfaces[{index}].friction = {coefficients[index]:g} at the pivot: at "
                    "the surface it would be negative; give a larger one, or coefficients at the surfaces"
                )
            converted[index] = moment / radii[index]
            inner_arm, inner_moment = arm, moment
    return converted


def _pivot_chains(
    layout: Layout, radii: Sequence[float], heights: Sequence[float]
) -> tuple[list[tuple[int, float]], list[tuple[int, float]]]:
    """Index and R_eff [m] of the surfaces below and above the pivot, from it outwards; arguments as above."""
    interfaces = [sum(heights[: index + 1]) for index in range(layout.surfaces)]
    pivot = (interfaces[layout.m - 1] + interfaces[layout.m]) / 2
    arms = [abs(z + sign * R - pivot) for z, sign, R in zip(interfaces, layout.signs, radii, strict=True)]
    below, above = range(layout.m - 1, -1, -1), range(layout.m, layout.surfaces)
    return [(index, arms[index]) for index in below], [(index, arms[index]) for index in above]
