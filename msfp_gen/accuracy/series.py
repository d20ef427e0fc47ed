"""The linearised bearing: published closed forms as springs, friction and gaps in series, small angles, no inertia.

Fenz and Constantinou (2008) for triple pendulums, and the same for any stack: with F = force over axial load, the
slider over surface k hangs at the tilt F - mu_k along the motion, at most capacity/R_k ahead of the one outside it,
and the bearing moves by the sum of these tilts times the differences of effective radii. Here for any path in the
plane: a tilt stays until F is mu_k away from it, then follows. That is what elements of structural programs hold.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from math import hypot
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.accuracy.trial import OK, ROWS, Trial, base_alone, grid
from msfp_gen.errors import InputError, RunError
from msfp_gen.history import Array
from msfp_gen.top import MassTop, PrescribedTop, RigTop

if TYPE_CHECKING:
    from msfp_gen.bearing import Bearing
    from msfp_gen.scene import Scene

NUDGE = 1e-8  # of F, for its derivative
CORNER = 1e-4  # of the friction: what the corners of friction are rounded by
CLOSE = 1e-9  # [m]


@dataclass(frozen=True)
class Link:
    """One surface of the series: the link outside it (None: a plate), and its numbers.

    radius, effective (to the pivot), share (effective less that of the link inside) [m]; limit: largest tilt ahead of
    the link outside [rad]; yielding [m]; rim [N/m]. Planar vectors are complex numbers.
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


class Series:
    """A linearised bearing with its tilts, outermost links first."""

    def __init__(self, bearing: Bearing, rims: bool, arms: bool = False) -> None:
        self.links = _links(bearing, rims, arms)
        self.tilts = [0j] * len(self.links)

    def displacement(self, force: complex, load: float) -> tuple[complex, list[complex]]:
        """Displacement across the bearing [m] at `force` over axial load, and the tilts there."""
        tilts: list[complex] = []
        total = 0j
        for link, tilt in zip(self.links, self.tilts, strict=True):
            tilt = _follow(force, tilt, link.friction)
            outside = 0j if link.outside is None else tilts[link.outside]
            ahead = abs(tilt - outside)
            if ahead > link.limit:
                tilt = outside + (tilt - outside) * (link.limit / ahead)
            tilts.append(tilt)
            total += link.share * tilt + _give(link, force - tilt, load)
        return total, tilts

    def force(self, wanted: complex, load: float, flexibility: float, guess: complex) -> complex:
        """Force over load at which the bearing and a spring of `flexibility` [m] in series move by `wanted` [m].

        Newton's method with differences; steps that do not help are halved. RunError where it does not converge.
        """

        def missing(force: complex) -> complex:
            return self.displacement(force, load)[0] + flexibility * force - wanted

        force, off = guess, missing(guess)
        for _ in range(60):
            if abs(off) < CLOSE:
                break
            step = _solved((missing(force + NUDGE) - off) / NUDGE, (missing(force + NUDGE * 1j) - off) / NUDGE, off)
            for _ in range(30):
                there = missing(force - step)
                if abs(there) < abs(off):
                    break
                step /= 2
            force, off = force - step, there
        else:
            raise RunError(f"linearised bearing: no force found at {abs(wanted):.4g} m", status="newton")
        self.tilts = self.displacement(force, load)[1]
        return force

    def sliding(self, force: complex, count: int) -> list[float]:
        """Sliding of every surface at the tilts in force [m], shape (count,)."""
        out = [0.0] * count
        for link, tilt in zip(self.links, self.tilts, strict=True):
            outside = 0j if link.outside is None else self.tilts[link.outside]
            out[link.surface] = abs(link.radius * (tilt - outside) + link.yielding * _bent(link, force - tilt))
        return out


def _follow(force: complex, tilt: complex, friction: float) -> complex:
    """The tilt stays while `force` is within `friction` of it, then follows; a corner would mislead Newton's method."""
    ahead = abs(force - tilt)
    if not ahead:
        return tilt
    beyond = ahead - friction
    return tilt + (force - tilt) * ((beyond + hypot(beyond, CORNER * friction)) / (2 * ahead))


def _bent(link: Link, held: complex) -> complex:
    """Y, Z of the surface: how far friction is bent, at most by one."""
    return held / max(link.friction, abs(held), 1e-300)


def _give(link: Link, held: complex, load: float) -> complex:
    """What friction before it slides and a rim that is pressed add to the displacement."""
    beyond = abs(held) - link.friction
    pressed = held * (beyond * load / (link.rim * abs(held))) if beyond > 1e-12 and link.rim else 0j
    return link.effective / link.radius * link.yielding * _bent(link, held) + pressed


def _solved(along: complex, across: complex, off: complex) -> complex:
    """The step whose images under the two columns of derivatives add up to `off`; none where nothing gives."""
    determinant = along.real * across.imag - across.real * along.imag
    if not determinant:
        return 0j
    x = (off.real * across.imag - across.real * off.imag) / determinant
    y = (along.real * off.imag - off.real * along.imag) / determinant
    return complex(x, y)


def _links(bearing: Bearing, rims: bool, arms: bool) -> list[Link]:
    """Links of both chains, from the plates inwards. The pivot is the middle of the innermost slider.

    arms: friction acts at the radius of its surface, not at the effective one (docs/devices.md), so that a surface
    slides at (mu R - mu' R')/(R_eff - R_eff') with ' of the surface inside.
    """
    layout, surfaces = bearing.layout, bearing.surfaces
    tops = np.cumsum([bearing.base_height, *(body.height for body in bearing.bodies)])
    centres = [tops[k] + sign * surfaces[k].radius for k, sign in enumerate(layout.signs)]
    if layout.m and layout.p:
        pivot = tops[layout.m] - bearing.bodies[layout.m - 1].height / 2
    else:  # one chain: up to the top of the stack, or down to its bottom
        pivot = tops[-1] if layout.m else 0.0
    links: list[Link] = []
    for chain in (range(layout.m), range(layout.surfaces - 1, layout.m - 1, -1)):
        effective = [float(abs(centres[k] - pivot)) for k in chain]
        for place, k in enumerate(chain):
            cup = surfaces[k]
            limit = cup.capacity / cup.radius if rims else float("inf")
            inside, grip = 0.0, 0.0
            if place + 1 < len(effective):
                inner = surfaces[chain[place + 1]]
                inside, grip = effective[place + 1], inner.friction * inner.radius
            share = effective[place] - inside
            friction = (cup.friction * cup.radius - grip) / share if arms else cup.friction
            links.append(Link(len(links) - 1 if place else None, k, cup.radius, effective[place], share,
                              friction, limit, cup.yield_displacement, cup.rim_stiffness))  # fmt: skip
    return links


def run_series(scene: Scene, steps: int, arms: bool = False) -> Trial:
    """`scene` by the linearised bearing in `steps` equal steps. Raises InputError for a prescribed load."""
    base_alone(scene)
    begin = time.perf_counter()
    times = np.linspace(0.0, scene.end, steps + 1)
    series = Series(scene.bearing, scene.modelled.rims, arms)
    follow = _rig if isinstance(scene.top, RigTop) else _mass
    if isinstance(scene.top, PrescribedTop):
        raise InputError("top.kind = 'prescribed': the linearised bearing is driven by displacements; give a rig")
    force, sliding = follow(scene, series, times)
    seconds, at = time.perf_counter() - begin, grid(scene.end)
    columns = np.column_stack([force.real, force.imag, sliding])
    rows = np.column_stack([np.interp(at, times, column) for column in columns.T])
    assert len(rows) == ROWS + 1
    return Trial("linearised", scene.end / steps, OK, seconds, scene.end, scene.end, 0, 0, steps, rows[:, :2],
                 rows[:, 2:], stepped=True)  # fmt: skip


def _plane(vectors: Array) -> list[complex]:
    return [complex(x, y) for x, y in vectors[:, :2].tolist()]


def _rig(scene: Scene, series: Series, times: Array) -> tuple[Array, Array]:
    """Displacements imposed through the springs of a rig: force [N] and sliding."""
    top = scene.top
    assert isinstance(top, RigTop)
    load, count = top.axial_load, scene.bearing.layout.surfaces
    if not load or not top.stiffness:
        raise InputError("top: the linearised bearing needs an axial load and a stiffness of the rig; give both")
    motion = scene.motion.displacement(times)
    force, found, sliding = 0j, [], []
    for wanted in _plane(motion - motion[0]):
        force = series.force(wanted, load, load / top.stiffness, force)
        found.append(load * force)
        sliding.append(series.sliding(force, count))
    return np.array(found), np.array(sliding)


def _mass(scene: Scene, series: Series, times: Array) -> tuple[Array, Array]:
    """A mass on the bearing, central differences; the axial load follows the vertical motion."""
    top = scene.top
    assert isinstance(top, MassTop)
    ground, count, step = scene.motion.acceleration(times), scene.bearing.layout.surfaces, float(times[1])
    loads = (top.mass * (scene.bearing.gravity + ground[:, 2])).tolist()
    now, before, force, found, sliding = 0j, 0j, 0j, [], []
    for load, pushed in zip(loads, _plane(ground), strict=True):
        force = series.force(now, load, 0.0, force)
        found.append(load * force)
        sliding.append(series.sliding(force, count))
        now, before = 2 * now - before + step**2 * (pushed - load * force / top.mass), now
    return np.array(found), np.array(sliding)
