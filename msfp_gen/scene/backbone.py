"""The published backbone of a stack: its surfaces as links in series, small angles, no inertia.

Fenz and Constantinou (2008) give it for triple pendulums; here it is generalised to any stack. With F = force over
axial load, the slider over surface k tilts by F - mu_k along the motion, at most capacity/R_k more than the next body
outwards. The displacement of the bearing is the sum of these tilts times the differences of effective radii.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array

if TYPE_CHECKING:
    from msfp_gen.scene.bearing import Bearing


@dataclass(frozen=True)
class Link:
    """One surface of the series. Horizontal vectors are complex numbers.

    Attributes:
        outside: index of the next link outwards; None at a plate.
        surface: index of the surface, from 0.
        radius: radius of the surface [m].
        effective: effective radius, from the sphere centre to the pivot [m].
        share: effective radius less that of the next link inwards [m].
        friction: friction coefficient [-].
        limit: largest tilt relative to the next link outwards, at rim contact [rad].
        yielding: yield displacement [m].
        rim: rim stiffness [N/m].
    """

    outside: int | None
    surface: int
    radius: float
    effective: float
    share: float
    friction: float
    limit: float
    yielding: float
    rim: float


def series_links(bearing: Bearing, rims: bool, arms: bool) -> list[Link]:
    """Links of both chains, from the plates inwards. The pivot is the middle of the innermost slider.

    arms: friction acts at the radius of its surface, not at the effective radius (docs/devices.md), so a surface slides
    from F = (mu R - mu' R')/(R_eff - R_eff') on, with ' for the next surface inwards.
    """
    layout, surfaces = bearing.layout, bearing.surfaces
    tops = np.cumsum([bearing.base_height, *(body.height for body in bearing.bodies)])
    centres = [tops[k] + sign * surfaces[k].radius for k, sign in enumerate(layout.signs)]
    if layout.m and layout.p:
        pivot = tops[layout.m] - bearing.bodies[layout.m - 1].height / 2
    else:  # one chain: the pivot is the top of the stack, or its bottom
        pivot = tops[-1] if layout.m else 0.0
    links: list[Link] = []
    for chain in (range(layout.m), range(layout.surfaces - 1, layout.m - 1, -1)):
        effective = [float(abs(centres[k] - pivot)) for k in chain]
        for place, k in enumerate(chain):
            surface = surfaces[k]
            limit = surface.capacity / surface.radius if rims else float("inf")
            inner_radius, inner_moment = 0.0, 0.0  # effective radius, and mu R, of the next surface inwards
            if place + 1 < len(effective):
                inner = surfaces[chain[place + 1]]
                inner_radius, inner_moment = effective[place + 1], inner.friction * inner.radius
            share = effective[place] - inner_radius
            friction = (surface.friction * surface.radius - inner_moment) / share if arms else surface.friction
            links.append(
                Link(
                    len(links) - 1 if place else None,
                    k,
                    surface.radius,
                    effective[place],
                    share,
                    friction,
                    limit,
                    surface.yield_displacement,
                    surface.rim_stiffness,
                )
            )
    return links


@dataclass(frozen=True)
class Backbone:
    """Force over axial load of a stack that is pushed from its centre, piecewise linear.

    links: as of `series_links`. yielding: displacement within which friction is elastic [m]. load: on the stack [N],
    under which surfaces yield before they slide and rims give way; 0: neither, as published.
    """

    links: tuple[Link, ...]
    yielding: float
    load: float = 0.0

    @classmethod
    def of(cls, bearing: Bearing, load: float = 0.0) -> Backbone:
        """That of a bearing, with rims and friction at the radii of its surfaces."""
        links = tuple(series_links(bearing, rims=True, arms=True))
        first = min(link.friction for link in links)
        elastic = [
            link.effective / link.radius * link.yielding for link in links if link.friction <= first * (1 + 1e-9)
        ]
        return cls(links, sum(elastic), load)

    def softness(self, link: Link) -> float:
        """By how much a link tilts with the force over load once its slider presses on the rim [rad]."""
        return self.load / (self.load + link.rim * link.radius)

    def tilts(self, force: float) -> list[float]:
        """Tilt of every link [rad] at a force over load, outermost first."""
        tilts: list[float] = []
        for link in self.links:
            most = link.limit + (0.0 if link.outside is None else tilts[link.outside])
            free = max(force - link.friction, 0.0)
            tilts.append(free if free <= most else most + (free - most) * self.softness(link))
        return tilts

    def displacement(self, force: float) -> float:
        """Displacement [m] at a force over load."""
        elastic = sum(
            link.effective / link.radius * link.yielding * min(force / link.friction, 1.0)
            for link in self.links
            if self.load and link.friction > 0
        )
        return elastic + sum(link.share * tilt for link, tilt in zip(self.links, self.tilts(force), strict=True))

    @cached_property
    def points(self) -> tuple[Array, Array]:
        """Displacements [m] and forces over load at which the slope changes, from the first onset of sliding (under a
        load: from 0) to the last rim; ndarrays, shape (k,).
        """
        forces: set[float] = {0.0} if self.load else set()
        limits: list[float] = []
        for link in self.links:  # that rims give way moves the corners by next to nothing
            limits.append(link.limit + (0.0 if link.outside is None else limits[link.outside]))
            forces |= {link.friction, link.friction + limits[-1]}
        rising = np.array(sorted(forces))
        displacements = np.array([self.displacement(force) for force in rising])
        last = int(np.searchsorted(displacements, displacements[-1] * (1 - 1e-12)))
        rising, displacements = rising[: last + 1], displacements[: last + 1]
        moved = np.append(True, np.diff(displacements) > 1e-12)
        return displacements[moved], rising[moved]

    def force(self, displacement: Array) -> Array:
        """Force over load at displacements [m], of their shape; beyond the last rim it stays where rims are rigid."""
        beyond = np.maximum(np.asarray(displacement) - self.capacity, 0.0)
        return np.asarray(np.interp(displacement, *self.points) + beyond * self.last_slope)

    def sliding(self, displacement: float) -> list[float]:
        """Sliding displacement of every surface [m] at a displacement of the bearing [m], in the order of surfaces."""
        tilts = self.tilts(float(self.force(np.array(displacement))))
        out = [0.0] * len(self.links)
        for link, tilt in zip(self.links, tilts, strict=True):
            out[link.surface] = link.radius * (tilt - (0.0 if link.outside is None else tilts[link.outside]))
        return [max(value, 0.0) for value in out]

    @cached_property
    def last_slope(self) -> float:
        """Slope where all sliders press on their rims [1/m]; 0 where rims are rigid."""
        first = 2 * float(self.points[1][-1])
        compliance = self.displacement(first + 1.0) - self.displacement(first)
        return 1 / compliance if compliance > 0 else 0.0

    @property
    def capacity(self) -> float:
        """Displacement at which the last slider meets its rim [m]."""
        return float(self.points[0][-1])
