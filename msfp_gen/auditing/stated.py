"""What the data of a bearing say about its force, for any stack: radius, friction, rims and friction law.

The links of a stack are the distances between the centres of its spheres. A link that tilts by an angle a under an
axial force N and a horizontal force F is in balance where F L - N L a = m - m', with moments of at most mu N R about
the centres at its two ends. The sum over all links leaves the moments of the outermost surfaces: F/N - u/L is at most
(mu_1 R_1 + mu_k R_k)/L, with L the distance of the outermost centres, whatever the surfaces between them do; it is that
while both outermost surfaces slide the same way.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, prefixed
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.fidelity import Backbone, Link, series_links
from msfp_gen.scene.file.loader import bearing_from_table, scene_table
from msfp_gen.scene.file.source import scene_of
from msfp_gen.scene.friction_parameters import coefficient, law_parameters, select_friction
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.top import MassTop
from msfp_gen.specification.friction_laws import Law, Memory, law_of

MOST_ROUNDS, SAME_TEMPERATURE = 40, 0.1  # of friction and temperature in turn; change between rounds [K]
SETTLED = 5.0  # yield displacements within which the friction of a surface has turned to its new direction (tanh)


class Coefficients(NamedTuple):
    """Friction over axial force at the outermost surfaces: by the law at its start, and as it heats, (T,) each [-].

    temperature: of the surface that heats most, (T,) [degC]; None where the law does not heat.
    """

    cold: Array
    heated: Array
    temperature: Array | None


@dataclass(frozen=True)
class Stated:
    """The data of a bearing.

    Attributes:
        name: of the bearing.
        bearing: its values.
        law: its friction law; None: constant friction.
        mass: that its scene supports [kg]; None: not stated.
        scene: the scene; None where a data sheet alone is given.
    """

    name: str
    bearing: Bearing
    law: Law | None
    mass: float | None = None
    scene: Scene | None = None

    @cached_property
    def links(self) -> list[Link]:
        """Links of both chains, from the plates inwards; friction acts at the radii of its surfaces."""
        return series_links(self.bearing, rims=True, arms=True)

    @cached_property
    def outer(self) -> list[Link]:
        """The links at the plates: one, or two of a stack with surfaces up and down."""
        return [link for link in self.links if link.outside is None]

    @cached_property
    def radius(self) -> float:
        """Distance of the outermost centres L [m]."""
        return sum(link.effective for link in self.outer)

    @cached_property
    def friction(self) -> float:
        """Friction over axial force while both outermost surfaces slide, at the coefficients of the surfaces [-]."""
        return sum(link.radius * self.bearing.surfaces[link.surface].friction for link in self.outer) / self.radius

    @cached_property
    def pivot_ratio(self) -> float:
        """Friction if coefficients were taken at the pivot in place of the surface, over `friction` [-]; 1: without."""
        try:
            own = [surface.friction for surface in self.bearing.surfaces]
            at_pivot = replace(self, bearing=self.bearing.replace(friction=own, friction_at="pivot"))
        except InputError:  # its pivot is not the middle of a slider
            return 1.0
        return at_pivot.friction / self.friction if self.friction else 1.0

    @cached_property
    def backbone(self) -> Backbone:
        """Its published backbone, with rims."""
        return Backbone.of(self.bearing)

    @property
    def rigid(self) -> bool:
        """Whether the stack is one link, which turns on both surfaces at once; or one surface."""
        return self.bearing.layout.n <= 3 and len(self.outer) == len(self.links)

    @cached_property
    def turning(self) -> float:
        """Travel after which both outermost surfaces slide in a new direction [m]."""
        if self.rigid:
            return 2.0 * SETTLED * self.yielding
        first = self.backbone.displacement(max(link.friction for link in self.outer))
        return 2.0 * (first + SETTLED * self.yielding)

    @cached_property
    def yielding(self) -> float:
        """Displacement within which friction is elastic [m]."""
        elastic = [link.yielding / link.radius for link in self.outer]  # rotation [rad]
        if self.rigid:
            return self.radius * max(elastic)
        return sum(angle * link.effective for angle, link in zip(elastic, self.outer, strict=True))

    @cached_property
    def first_rim(self) -> float:
        """Displacement at which a slider may meet its rim [m]."""
        if self.rigid:
            return self.radius * min(link.limit for link in self.outer)
        forces = [link.friction + self._tilt_limit(link) for link in self.links]
        return self.backbone.displacement(min(forces))

    def _tilt_limit(self, link: Link) -> float:
        return link.limit + (0.0 if link.outside is None else self._tilt_limit(self.links[link.outside]))

    @cached_property
    def steepest(self) -> float:
        """Largest slope of a rim, the tangent of the largest tilt of a slider [-]."""
        return float(np.tan(max(self._tilt_limit(link) for link in self.links)))

    @property
    def capacity(self) -> float:
        """Displacement at which the last slider meets its rim [m]."""
        return self.first_rim if self.rigid else self.backbone.capacity

    def coefficients(self, time: Array, speed: Array, travel: Array, axial: Array) -> Coefficients:
        """Friction by the law over time. speed, travel: of the bearing, (T,) [m/s], [m]; axial: (T,) [N]."""
        cold, heated, hottest = np.zeros_like(time), np.zeros_like(time), None
        for link in self.outer:
            share = link.radius / self.radius  # of the motion of the bearing that this surface slides
            each = self._of_surface(link.surface, time, share * speed, share * travel, axial)
            cold += share * each.cold
            heated += share * each.heated
            if each.temperature is not None and (hottest is None or each.temperature.max() > hottest.max()):
                hottest = each.temperature
        return Coefficients(cold, heated, hottest)

    def _of_surface(self, index: int, time: Array, speed: Array, travel: Array, axial: Array) -> Coefficients:
        """The coefficient of one surface, by its law, heated as docs/friction.md has it."""
        mu = self.bearing.surfaces[index].friction
        if self.law is None:
            return Coefficients(np.full_like(time, mu), np.full_like(time, mu), None)
        own = law_parameters(self.law, self.bearing, index)
        load = np.maximum(axial, 1e-3 * np.median(axial))
        pressure = load / own.get("area", np.inf)
        state: dict[str, Any] = {**own, "mu": mu, "v": speed, "N": load, "p": pressure}
        memory = self.law.memory
        if memory is None:
            values = np.broadcast_to(coefficient(self.law, state)[0], time.shape)
            return Coefficients(values, values, None)
        start = own.get(memory.start, 0.0)
        cold = np.broadcast_to(coefficient(self.law, state | {memory.variable: start})[0], time.shape)
        if not self.law.depends_on_temperature:
            return Coefficients(cold, cold, None)
        heated, temperature = np.array(cold), np.full_like(time, start)
        by_flux, pace = (own["plate_heating"], own[memory.pace]) if memory.pace else (own["heating"], 1.0)
        flux = by_flux * pressure * speed * (np.abs(travel) < own["reach"])
        for _ in range(MOST_ROUNDS):
            before, temperature = temperature, start + _heat(memory, pace, time, flux * heated)
            heated = np.array(coefficient(self.law, state | {memory.variable: temperature})[0])
            if np.abs(temperature - before).max() < SAME_TEMPERATURE:
                break
        return Coefficients(cold, heated, temperature)


def _heat(memory: Memory, pace: float, time: Array, source: Array) -> Array:
    """Rise of temperature by a source over time, as the memory of the compiled model has it, (T,) [K]."""
    rates, weights = np.array(memory.parts).T
    steps = np.append(np.diff(time), 0.0)[:, None]
    decays, slow = np.exp(-pace * rates * steps), rates == 0.0
    gains = source[:, None] * weights * np.where(slow, steps, (1.0 - decays) / (pace * (rates + slow)))
    parts, rise = np.zeros(len(rates)), np.zeros_like(time)
    for row in range(1, len(time)):
        parts = parts * decays[row - 1] + gains[row - 1]
        rise[row] = parts.sum()
    return rise


def stated_of(source: Any) -> Stated:
    """The data of a bearing: of a `Bearing`, a `Scene`, or the file of one or of a data sheet. Raises InputError."""
    if isinstance(source, Bearing):
        return Stated("bearing", source, _law(source))
    scene = source
    if not isinstance(scene, Scene):
        table, path = scene_table(source)
        with prefixed(f"{path or source}: "):
            if "motion" not in table and isinstance(table.get("bearing"), dict):
                bearing = bearing_from_table(table["bearing"])
                return Stated(str(table.get("name") or path), bearing, _law(bearing))
            scene = scene_of(table, None if path is None else path.parent)
            if not isinstance(scene, Scene):
                raise InputError("this is not one bearing alone; give a scene or a data sheet of one bearing")
    mass = scene.top.mass if isinstance(scene.top, MassTop) else None
    law = scene.law[1]
    if law is not None and law.word == "pv" and scene.effects.friction is None:
        law = law_of("pvt")
    return Stated(scene.name or "scene", scene.bearing, law, mass, scene)


def _law(bearing: Bearing) -> Law | None:
    """The law whose parameters the surfaces have, with heat."""
    word = select_friction(bearing, None)
    return law_of("pvt" if word == "pv" else word)
