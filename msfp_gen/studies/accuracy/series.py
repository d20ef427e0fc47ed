"""The linearised bearing: published closed forms as springs, friction and gaps in series, small angles, no inertia.

Fenz and Constantinou (2008) give it for triple pendulums; here it is generalised to any stack. With F = force over
axial load, the slider over surface k tilts by F - mu_k along the motion, at most capacity/R_k more than the next body
outwards. The displacement of the bearing is the sum of these tilts times the differences of effective radii. For a path
in the horizontal plane, a tilt is constant while |F - tilt| < mu_k, and follows F beyond. The elements of structural
analysis programs use the same model.
"""

from __future__ import annotations

import time
from math import hypot
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError, RunError
from msfp_gen.scene.backbone import Link, series_links
from msfp_gen.scene.top import MassTop, PrescribedTop, RigTop
from msfp_gen.studies.accuracy.timed_run import OK, ROWS, Trial, comparison_times, require_base_motion_only

if TYPE_CHECKING:
    from msfp_gen.scene.bearing import Bearing
    from msfp_gen.scene.scene import Scene

DIFFERENCE_STEP = 1e-8  # increment of F for difference quotients
ROUNDING = 1e-4  # radius over which the corner at the onset of sliding is rounded, relative to the friction
RESIDUAL_TOLERANCE = 1e-9  # [m]


class Series:
    """A linearised bearing and its current tilts, outermost links first.

    rims: whether capacity limits the tilts. arms: whether friction acts at the radius of its surface (`series_links`).
    """

    def __init__(self, bearing: Bearing, rims: bool, arms: bool = False) -> None:
        self.links = series_links(bearing, rims, arms)
        self.tilts = [0j] * len(self.links)

    def displacement(self, force: complex, load: float) -> tuple[complex, list[complex]]:
        """Displacement across the bearing [m] and tilts [rad] at `force` over axial load; `load` is the latter [N]."""
        tilts: list[complex] = []
        total = 0j
        for link, tilt in zip(self.links, self.tilts, strict=True):
            tilt = _updated_tilt(force, tilt, link.friction)
            outside = 0j if link.outside is None else tilts[link.outside]
            relative = abs(tilt - outside)
            if relative > link.limit:
                tilt = outside + (tilt - outside) * (link.limit / relative)
            tilts.append(tilt)
            total += link.share * tilt + _elastic_displacement(link, force - tilt, load)
        return total, tilts

    def force(self, target: complex, load: float, flexibility: float, guess: complex) -> complex:
        """Force over load at which the bearing and a spring of `flexibility` [m] in series move by `target` [m].

        Newton's method with difference quotients; steps that increase the residual are halved. The tilts of the
        solution become the current ones. Raises RunError if the method does not converge.
        """

        def residual(force: complex) -> complex:
            return self.displacement(force, load)[0] + flexibility * force - target

        h = DIFFERENCE_STEP
        force, value = guess, residual(guess)
        for _ in range(60):
            if abs(value) < RESIDUAL_TOLERANCE:
                break
            step = _newton_step((residual(force + h) - value) / h, (residual(force + h * 1j) - value) / h, value)
            for _ in range(30):
                new = residual(force - step)
                if abs(new) < abs(value):
                    break
                step /= 2
            force, value = force - step, new
        else:
            raise RunError(f"linearised bearing: no force found at {abs(target):.4g} m", status="newton")
        self.tilts = self.displacement(force, load)[1]
        return force

    def sliding(self, force: complex, count: int) -> list[float]:
        """Sliding of every surface at the current tilts [m], shape (count,)."""
        out = [0.0] * count
        for link, tilt in zip(self.links, self.tilts, strict=True):
            outside = 0j if link.outside is None else self.tilts[link.outside]
            elastic = link.yielding * _friction_state(link, force - tilt)
            out[link.surface] = abs(link.radius * (tilt - outside) + elastic)
        return out


def _updated_tilt(force: complex, tilt: complex, friction: float) -> complex:
    """The tilt after `force` is applied: constant while |force - tilt| < friction, following the force beyond.

    The corner between both is rounded, since Newton's method does not converge over it.
    """
    distance = abs(force - tilt)
    if not distance:
        return tilt
    excess = distance - friction
    return tilt + (force - tilt) * ((excess + hypot(excess, ROUNDING * friction)) / (2 * distance))


def _friction_state(link: Link, traction: complex) -> complex:
    """Friction state Y + iZ of the surface under the horizontal force over load that it transmits; at most one."""
    return traction / max(link.friction, abs(traction), 1e-300)


def _elastic_displacement(link: Link, traction: complex, load: float) -> complex:
    """Displacement [m] by elastic slip within the yield displacement and by compression of the rim."""
    excess = abs(traction) - link.friction
    rim = traction * (excess * load / (link.rim * abs(traction))) if excess > 1e-12 and link.rim else 0j
    return link.effective / link.radius * link.yielding * _friction_state(link, traction) + rim


def _newton_step(column_x: complex, column_y: complex, value: complex) -> complex:
    """Solution of the two linear equations with these columns and right side `value`; zero if they are singular."""
    determinant = column_x.real * column_y.imag - column_y.real * column_x.imag
    if not determinant:
        return 0j
    x = (value.real * column_y.imag - column_y.real * value.imag) / determinant
    y = (column_x.real * value.imag - value.real * column_x.imag) / determinant
    return complex(x, y)


def run_series(scene: Scene, steps: int, arms: bool = False) -> Trial:
    """Run `scene` by the linearised bearing in `steps` equal steps; `arms` as in `series_links`.

    Raises InputError for a prescribed load, or a rig without axial load or stiffness.
    """
    require_base_motion_only(scene)
    begin = time.perf_counter()
    times = np.linspace(0.0, scene.end, steps + 1)
    series = Series(scene.bearing, scene.modelled.rims, arms)
    integrate = _run_rig if isinstance(scene.top, RigTop) else _run_mass
    if isinstance(scene.top, PrescribedTop):
        raise InputError("top.kind = 'prescribed': the linearised bearing is driven by displacements; give a rig")
    force, sliding = integrate(scene, series, times)
    seconds, at = time.perf_counter() - begin, comparison_times(scene.end)
    columns = np.column_stack([force.real, force.imag, sliding])
    rows = np.column_stack([np.interp(at, times, column) for column in columns.T])
    assert len(rows) == ROWS + 1
    return Trial(
        "linearised",
        scene.end / steps,
        OK,
        seconds,
        scene.end,
        scene.end,
        0,
        0,
        steps,
        rows[:, :2],
        rows[:, 2:],
        stepped=True,
    )


def _as_complex(vectors: Array) -> list[complex]:
    return [complex(x, y) for x, y in vectors[:, :2].tolist()]


def _run_rig(scene: Scene, series: Series, times: Array) -> tuple[Array, Array]:
    """Impose displacements through the springs of a rig: force [N], shape (T,), and sliding [m], shape (T, n-1)."""
    top = scene.top
    assert isinstance(top, RigTop)
    load, count = top.axial_load, scene.bearing.layout.surfaces
    if not load or not top.stiffness:
        raise InputError("top: the linearised bearing needs an axial load and a stiffness of the rig; give both")
    motion = scene.motion.displacement(times)
    force, forces, sliding = 0j, [], []
    for target in _as_complex(motion - motion[0]):
        force = series.force(target, load, load / top.stiffness, force)
        forces.append(load * force)
        sliding.append(series.sliding(force, count))
    return np.array(forces), np.array(sliding)


def _run_mass(scene: Scene, series: Series, times: Array) -> tuple[Array, Array]:
    """Integrate a mass on the bearing by central differences; the axial load follows the vertical acceleration."""
    top = scene.top
    assert isinstance(top, MassTop)
    ground, count, step = scene.motion.acceleration(times), scene.bearing.layout.surfaces, float(times[1])
    loads = (top.mass * (scene.bearing.gravity + ground[:, 2])).tolist()
    u, previous, force, forces, sliding = 0j, 0j, 0j, [], []
    for load, acceleration in zip(loads, _as_complex(ground), strict=True):
        force = series.force(u, load, 0.0, force)
        forces.append(load * force)
        sliding.append(series.sliding(force, count))
        u, previous = 2 * u - previous + step**2 * (acceleration - load * force / top.mass), u
    return np.array(forces), np.array(sliding)
