"""A bearing by its data sheet: `Sheet` comes in; the values of its surfaces and bodies go out (docs/bearing.md).

A sheet has radii, heights, diameters and friction; what a run needs beside them follows: the capacity of each surface,
the edges of the sliders, masses and moments of inertia of steel. SI units throughout.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import pairwise
from math import asin, pi, sin, sqrt
from typing import Annotated, Any, Literal

import numpy as np

from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Quantity, check_fields

SheetValues = dict[str, Any]
Face = tuple[float, float, float] | None  # radius of its sphere, of its edge [m], 1 if convex, -1 if concave
_LENGTHS = Quantity("m", above=0.0, shape=(None,))
_COEFFICIENTS = Quantity("", least=0.0, shape=(None,))
# Device -> (number of concave-up surfaces, of concave-down ones) of its layout.
LAYOUTS = {"single": (1, 1), "double": (1, 1), "triple": (2, 2), "quintuple": (3, 3)}
RIM_STIFFNESS, RIM_DAMPING = 1e8, 1e3  # of steel on steel [N/m], [N s/m], as in the presets for buildings
# Capacity of the joint below a single pendulum's plate, over its radius: a usual one, and more than its dish permits.
JOINT_TILT, MOST_JOINT_TILT, OVER_DISH = 0.45, 0.9, 1.5
BOUNDS = ("friction_lower", "friction_upper")


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """The data sheet of a bearing. Lists go from the bottom; of a symmetric stack the lower half is enough.

    Attributes:
        device: "single", "double", "triple" or "quintuple". The slider of a single turns in a joint below the top
            plate, about which nothing need be known; the slider of a double is one rigid piece.
        radius: R of each surface [m].
        effective_radius: R_eff, from the centre of the sphere to the pivot [m].
        height: h = R - R_eff of each surface, from it to the pivot [m]. Two of the three are given.
        friction: coefficient of each surface at the pivot, as published formulas have it [-].
        friction_lower, friction_upper: its lower and upper values, for a bounding analysis.
        slider_diameter: of the face that slides in each surface [m].
        dish_diameter: of each surface, to its rim [m].
        capacity: arc of the slider to rim contact [m]; in place of dish_diameter.
        yield_displacement: of each surface before it slides [m].
        axial_load: at rest [N].
        plate_height: of the base and of the top plate at their axes [m]; only masses and the drawing depend on it.
        density: of the bodies; masses and moments of inertia follow from it [kg/m^3].

    Raises InputError.
    """

    device: Literal["single", "double", "triple", "quintuple"]
    radius: Annotated[tuple[float, ...] | None, _LENGTHS] = None
    effective_radius: Annotated[tuple[float, ...] | None, _LENGTHS] = None
    height: Annotated[tuple[float, ...] | None, Quantity("m", least=0.0, shape=(None,))] = None
    friction: Annotated[tuple[float, ...], _COEFFICIENTS]
    friction_lower: Annotated[tuple[float, ...] | None, _COEFFICIENTS] = None
    friction_upper: Annotated[tuple[float, ...] | None, _COEFFICIENTS] = None
    slider_diameter: Annotated[tuple[float, ...], _LENGTHS]
    dish_diameter: Annotated[tuple[float, ...] | None, _LENGTHS] = None
    capacity: Annotated[tuple[float, ...] | None, _LENGTHS] = None
    yield_displacement: Annotated[float, Quantity("m", above=0.0)] = 5e-4
    axial_load: Annotated[float, Quantity("N", above=0.0)]
    plate_height: Annotated[float, Quantity("m", above=0.0)] = 0.05
    density: Annotated[float, Quantity("kg/m^3", above=0.0)] = 7850.0

    def __post_init__(self) -> None:
        check_fields(self, "sheet")
        for field in fields(self):
            if isinstance(value := getattr(self, field.name), tuple):
                object.__setattr__(self, field.name, self._whole(field.name, value))
        self._complete_radii()
        self._complete_dishes()
        for name in BOUNDS:
            if (getattr(self, name) is None) != (getattr(self, BOUNDS[0]) is None):
                raise InputError(f"sheet.{name}: give both friction_lower and friction_upper, or neither")
        if self.device != "single":
            self._check_inner()
            self._check_nesting()
            self._check_dishes()

    @property
    def surfaces(self) -> int:
        """Number of sliding surfaces on the sheet; the joint of a single pendulum is none."""
        return 1 if self.device == "single" else sum(LAYOUTS[self.device])

    def _whole(self, name: str, value: tuple[float, ...]) -> tuple[float, ...]:
        """A list with an entry for every surface: the lower half of a symmetric stack is mirrored."""
        count = self.surfaces
        if len(value) == count:
            return value
        if 2 * len(value) == count:
            return (*value, *value[::-1])
        half = f", or {count // 2} of a symmetric stack" if count > 1 else ""
        raise InputError(f"sheet.{name} has {len(value)} entries: a {self.device} pendulum needs {count}{half}")

    def _complete_radii(self) -> None:
        """Radius, effective radius and height of two of them."""
        names = ("radius", "effective_radius", "height")
        if len(known := [name for name in names if getattr(self, name) is not None]) != 2:
            raise InputError(f"sheet: {', '.join(known) or 'nothing'} of {', '.join(names)} is given; give two of them")
        radius, effective, height = self.radius, self.effective_radius, self.height
        if radius is None:
            radius = tuple(np.add(effective or (), height or ()).tolist())
        elif effective is None:
            effective = tuple(np.subtract(radius, height or ()).tolist())
        else:
            height = tuple(np.subtract(radius, effective).tolist())
        for name, values in zip(names, (radius, effective, height), strict=True):
            if values is None or min(values) < 0 or (name != "height" and min(values) == 0):
                raise InputError(f"sheet.{name} = {values} [m]: radius = effective_radius + height; give other values")
            object.__setattr__(self, name, values)

    def _complete_dishes(self) -> None:
        """Capacities of the diameters of dishes, or the reverse."""
        if (self.dish_diameter is None) == (self.capacity is None):
            raise InputError("sheet: give either dish_diameter or capacity")
        assert self.radius is not None
        rows = list(zip(self.radius, self.slider_diameter, strict=True))
        for radius, slider in rows:
            if slider >= 2 * radius:
                raise InputError(
                    f"sheet.slider_diameter = {slider:g} [m]: give less than twice the radius, {2 * radius:g}"
                )
        if self.capacity is not None:
            dishes = [2 * R * sin(s / R + asin(b / 2 / R)) for (R, b), s in zip(rows, self.capacity, strict=True)]
            object.__setattr__(self, "dish_diameter", tuple(dishes))
            return
        assert self.dish_diameter is not None
        for (radius, slider), dish in zip(rows, self.dish_diameter, strict=True):
            if not slider < dish < 2 * radius:
                raise InputError(
                    f"sheet.dish_diameter = {dish:g} [m]: give more than the slider_diameter, {slider:g}, and "
                    f"less than twice the radius, {2 * radius:g}"
                )
        arcs = [R * (asin(D / 2 / R) - asin(b / 2 / R)) for (R, b), D in zip(rows, self.dish_diameter, strict=True)]
        object.__setattr__(self, "capacity", tuple(arcs))

    def _check_inner(self) -> None:
        """Raise InputError for values of the innermost pair that one rigid slider cannot have."""
        lower = self.surfaces // 2 - 1
        names = ["slider_diameter", *([] if self.device == "double" else ["friction", *BOUNDS])]
        for name in names:
            pair = (getattr(self, name) or (0.0,) * self.surfaces)[lower : lower + 2]
            if pair[0] != pair[1]:
                raise InputError(
                    f"sheet.{name} of surfaces {lower + 1} and {lower + 2} = {pair[0]:g}, {pair[1]:g}: both are faces "
                    "of one rigid slider, which turns on both at once; give equal values"
                )

    def _check_nesting(self) -> None:
        """Raise InputError where a surface is not farther from the pivot than the one inside."""
        assert self.height is not None
        half = self.surfaces // 2
        for side in (self.height[:half][::-1], self.height[half:]):
            if any(outer <= inner for inner, outer in pairwise((0.0, *side))):
                raise InputError(
                    f"sheet.height = {self.height} [m]: each surface is farther from the pivot than the one inside"
                )

    def _check_dishes(self) -> None:
        """Raise InputError where two dishes that face each other would meet at rest."""
        assert self.radius and self.height and self.dish_diameter
        for lower in range(self.surfaces // 2):
            upper = self.surfaces - 1 - lower
            edge = min(self.dish_diameter[lower], self.dish_diameter[upper]) / 2
            deep = sum(_sagitta(self.radius[index], edge) for index in (lower, upper))
            apart = self.height[lower] + self.height[upper]
            if deep >= apart:
                raise InputError(
                    f"sheet.dish_diameter = {2 * edge:g} [m]: the dishes of surfaces {lower + 1} and {upper + 1} are "
                    f"{apart:.4g} m apart on their axis and {deep:.4g} m deep together: they would meet; give smaller "
                    "dishes or a greater height"
                )

    @property
    def values(self) -> SheetValues:
        """The fields of a bearing as plain values; friction is at the pivot, of one or two surfaces at these."""
        assert self.radius and self.effective_radius and self.height and self.capacity
        m, p = LAYOUTS[self.device]
        radii, capacities, inner = list(self.radius), list(self.capacity), self.slider_diameter[0] / 2
        frictions = {name: getattr(self, name) for name in ("friction", *BOUNDS) if getattr(self, name) is not None}
        heights, at = list(self.height), "pivot"
        if self.device == "single":
            joint, ratio = 2 * inner, self.effective_radius[0] / radii[0]
            tilt = min(MOST_JOINT_TILT, max(JOINT_TILT, OVER_DISH * capacities[0] / radii[0]))
            radii, capacities = [*radii, joint], [*capacities, tilt * joint]
            heights, at = [heights[0], joint], "surface"  # the pivot is the centre of the joint
            frictions = {name: (values[0] * ratio, 0.0) for name, values in frictions.items()}
        elif self.device == "double":  # its slider is one piece, whose middle need not be the pivot of the sheet
            arms, at = [own / R for own, R in zip(self.effective_radius, radii, strict=True)], "surface"
            frictions = {
                name: tuple(mu * arm for mu, arm in zip(values, arms, strict=True))
                for name, values in frictions.items()
            }
        nominal = frictions.pop("friction")
        levels = [-h for h in heights[:m]] + heights[m:]
        thicknesses = [self.plate_height, *np.diff(levels).tolist(), self.plate_height]
        return {
            "layout": {"n": m + p + 1, "m": m, "p": p},
            "base_height": thicknesses[0],
            "surfaces": [
                {
                    "radius": R,
                    "capacity": s,
                    "friction": mu,
                    "yield_displacement": self.yield_displacement,
                    "rim_stiffness": RIM_STIFFNESS,
                    "rim_damping": RIM_DAMPING,
                }
                for R, s, mu in zip(radii, capacities, nominal, strict=True)
            ],
            "bodies": [self._body(k, thicknesses[k], radii, m) for k in range(1, m + p + 1)],
            "friction_at": at,
            **{name: list(values) for name, values in frictions.items()},
        }

    def _body(self, index: int, height: float, radii: Sequence[float], m: int) -> SheetValues:
        """Values of a body (index from 0, the base first): of revolution, between its two faces."""
        lower, upper = self._face(index - 1, index, radii, m), self._face(index, index, radii, m)
        mass, centroid, moments = revolved(height, lower, upper, self.density)
        edges = [face for face in (lower, upper) if face is not None and face[2] > 0]  # of faces that slide
        centroid = min(centroid if index <= m else height - centroid, height)  # a deep dish has its steel above it
        body = {"height": height, "centroid": centroid, "mass": mass}
        if edges and index < len(radii):
            body["rim_radius"] = min(face[1] for face in edges)
            body["rim_offset"] = float(np.mean([_sagitta(*face[:2]) for face in edges]))
        return {**body, "inertia": list(moments)}

    def _face(self, surface: int, body: int, radii: Sequence[float], m: int) -> Face:
        """Radius of a face, radius of its edge, and 1 for a slider's, -1 for a dish; None: the body has none there."""
        if not 0 <= surface < len(radii):
            return None
        slides = (surface + 1 if surface < m else surface) == body
        if surface >= self.surfaces:  # the joint of a single pendulum
            edge = self.slider_diameter[0] / 2
        else:
            assert self.dish_diameter is not None
            edge = (self.slider_diameter if slides else self.dish_diameter)[surface] / 2
        return radii[surface], edge, 1.0 if slides else -1.0


def _sagitta(radius: float, edge: float) -> float:
    """Height of a spherical cap [m]: of a face at its edge over its middle."""
    return radius - sqrt(radius**2 - edge**2)


def revolved(height: float, lower: Face, upper: Face, density: float) -> tuple[float, float, tuple[float, float]]:
    """Mass [kg], centroid above the middle of the lower face [m] and moments of inertia (transverse, axial) [kg m^2].

    A body of revolution of one material between two faces, `height` apart on its axis. A face: radius of its sphere,
    radius of its edge [m], and 1 if convex, -1 if concave; beyond its edge it is level. None: level throughout.
    """
    edges = sorted({0.0, *(face[1] for face in (lower, upper) if face is not None)})
    nodes, weights = np.polynomial.legendre.leggauss(24)
    r = np.concatenate([a + (b - a) * (nodes + 1) / 2 for a, b in pairwise(edges)])
    dr = np.concatenate([(b - a) * weights / 2 for a, b in pairwise(edges)])

    def depth(face: Face) -> Any:
        if face is None:
            return np.zeros_like(r)
        inside = np.minimum(r, face[1])
        return face[2] * inside**2 / (face[0] + np.sqrt(face[0] ** 2 - inside**2))

    bottom, top = depth(lower), height - depth(upper)
    if np.any(top <= bottom):
        raise InputError(
            f"sheet: a body {height * 1e3:.4g} mm high at its axis has no thickness at its edge;"
            " give greater heights, radii or smaller diameters"
        )
    shells = density * 2 * pi * r * (top - bottom) * dr
    mass = float(shells.sum())
    middle = (top + bottom) / 2
    centroid = float(shells @ middle) / mass
    transverse = float(shells @ (r**2 / 2 + (top - bottom) ** 2 / 12 + (middle - centroid) ** 2))
    return mass, centroid, (transverse, float(shells @ r**2))
