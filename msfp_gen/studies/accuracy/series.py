"""Trials of a scene by other models of the bearing: published closed forms in series, and the element of OpenSees.

The linearised bearing has springs, friction and gaps in series, small angles and no inertia. Fenz and Constantinou
(2008) give this model for triple pendulums; here it is generalised to any stack. With F = force over axial load, the
slider over surface k tilts by F - mu_k along the motion, at most capacity/R_k more than the next body outwards. The
displacement of the bearing is the sum of these tilts times the differences of effective radii. For a path in the
horizontal plane, a tilt is constant while |F - tilt| < mu_k, and follows F beyond. The elements of structural analysis
programs use the same model; `TripleFrictionPendulum` of OpenSees is run where openseespy is installed.
"""

from __future__ import annotations

import time
from importlib import import_module
from importlib.util import find_spec
from math import hypot
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.scene.fidelity import Link, series_links
from msfp_gen.scene.top import MassTop, PrescribedTop, RigTop
from msfp_gen.specification.layout import Layout
from msfp_gen.studies.accuracy.timed_run import OK, Trial, comparison_times, of_bearing, require_base_motion_only

if TYPE_CHECKING:
    from msfp_gen.scene.bearing import Bearing
    from msfp_gen.scene.scene import Scene
    from msfp_gen.scene.system import System

DIFFERENCE_STEP = 1e-8  # increment of F for difference quotients [-]
ROUNDING = 1e-4  # radius of the rounded corner at the onset of sliding, over the friction coefficient
RESIDUAL_TOLERANCE = 1e-9  # [m]


class Series:
    """A linearised bearing and its current tilts, outermost links first.

    rims: whether capacity limits the tilts. arms: whether friction acts at the radius of its surface (`series_links`).
    """

    def __init__(self, bearing: Bearing, rims: bool, arms: bool = False) -> None:
        self.links = series_links(bearing, rims, arms)
        self.tilts = [0j] * len(self.links)

    def displacement(self, force: complex, load: float) -> tuple[complex, list[complex]]:
        """Displacement across the bearing [m], and tilts [rad], at `force` over axial load [-] and axial `load` [N]."""
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
        solution become the current tilts. Raises RunError if the method does not converge.
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
        sliding = [0.0] * count
        for link, tilt in zip(self.links, self.tilts, strict=True):
            outside = 0j if link.outside is None else self.tilts[link.outside]
            elastic = link.yielding * _friction_state(link, force - tilt)
            sliding[link.surface] = abs(link.radius * (tilt - outside) + elastic)
        return sliding


def _updated_tilt(force: complex, tilt: complex, friction: float) -> complex:
    """The tilt after `force` is applied: constant while |force - tilt| < friction, following the force beyond."""
    # The corner at |force - tilt| = friction is rounded, since Newton's method does not converge over it.
    distance = abs(force - tilt)
    if not distance:
        return tilt
    excess = distance - friction
    return tilt + (force - tilt) * ((excess + hypot(excess, ROUNDING * friction)) / (2 * distance))


def _friction_state(link: Link, traction: complex) -> complex:
    """Friction state Y + iZ of a surface, at most one in size. traction: horizontal force over load on it."""
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


def run_series(system: System, steps: int, arms: bool = False) -> Trial:
    """Run one bearing by the linearised bearing in `steps` equal steps; `arms` as in `series_links`.

    Raises InputError for a prescribed load, or a rig without axial load or stiffness.
    """
    scene = require_base_motion_only(system)
    begin = time.perf_counter()
    times = np.linspace(0.0, scene.end, steps + 1)
    series = Series(scene.bearing, scene.modelled.rims, arms)
    integrate = _run_rig if isinstance(scene.top, RigTop) else _run_mass
    if isinstance(scene.top, PrescribedTop):
        raise InputError("top.kind = 'prescribed': the linearised bearing is driven by displacements; give a rig")
    force, sliding = integrate(scene, series, times)
    columns, seconds = np.column_stack([force.real, force.imag, sliding]), time.perf_counter() - begin
    return _trial("linearised", scene, steps, times, columns, seconds)


def _trial(name: str, scene: Scene, steps: int, times: Array, columns: Array, seconds: float) -> Trial:
    """The trial of a run in equal steps. times: of its steps; a run that failed ends before the scene."""
    # columns: force [N] and sliding [m] at the times, shape (T, 2 + surfaces).
    at, last = comparison_times(scene.end), float(times[-1])
    at = at[at <= last * (1 + 1e-12)]
    rows = np.column_stack([np.interp(at, times, column) for column in columns.T])
    reached = len(times) - 1
    status, message = (OK, "") if reached == steps else ("failed", f"analyze failed at t = {last:.4g} s")
    cost, setting = (0, 0, reached), scene.end / steps
    parts = rows[:, :2], rows[:, 2:]
    return Trial(name, setting, status, seconds, last, scene.end, *cost, of_bearing(*parts), message, stepped=True)


def _as_complex(vectors: Array) -> list[complex]:
    """The horizontal components of vectors, shape (T, 3), as complex numbers x + iy."""
    return [complex(x, y) for x, y in vectors[:, :2].tolist()]


def _run_rig(scene: Scene, series: Series, times: Array) -> tuple[Array, Array]:
    """Impose displacements through the springs of a rig; returns force, (T,) [N], and sliding, shape (T, n-1) [m]."""
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
    # Returns as `_run_rig`.
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


BASE, TOP, ELEMENT = 1, 2, 1  # tags of the nodes and of the element
STIFF = 1e10  # stiffness of the other degrees of freedom [N/m, N m/rad]
YIELD = 1e-4  # least yield displacement passed to the element [m]; its manual recommends 0.25 to 1 mm


def run_opensees(system: System, steps: int) -> Trial:
    """Run one bearing by OpenSees in `steps` equal steps. The trial has no sliding, since the element computes none.

    Raises InputError if OpenSees is not installed, or the element cannot represent this bearing under this load.
    """
    scene = require_base_motion_only(system)
    if find_spec("openseespy") is None:
        raise InputError("TripleFrictionPendulum needs openseespy; pip install openseespy")
    lower, upper, inner = _links(scene)
    try:
        ops = import_module("openseespy.opensees")
    except (ImportError, RuntimeError) as error:
        raise InputError(
            f"openseespy cannot be imported ({error}): see its page for the libraries that it needs"
        ) from None
    times = np.linspace(0.0, scene.end, steps + 1)
    begin = time.perf_counter()
    try:
        _define_model(ops, scene, lower, upper, inner)
        reached, force = _integrate(ops, scene, times)
    finally:
        ops.wipe()
    seconds = time.perf_counter() - begin
    return _trial("OpenSees", scene, steps, times[: reached + 1], force, seconds)


def _links(scene: Scene) -> tuple[Link, Link, Link]:
    """Outer lower, outer upper and inner surface; the element has one friction and radius for both inner surfaces."""
    if scene.bearing.layout != Layout.tfp():
        raise InputError("bearing.layout: TripleFrictionPendulum has four surfaces, (5, 2, 2)")
    if not _load(scene):
        raise InputError("top: TripleFrictionPendulum needs a rig, or a mass with weight, for its axial load; give one")
    links = {link.surface: link for link in series_links(scene.bearing, rims=True, arms=False)}
    if links[1].friction != links[2].friction or abs(links[1].effective / links[2].effective - 1) > 1e-9:
        raise InputError("bearing.surfaces: TripleFrictionPendulum needs equal inner surfaces")
    return links[0], links[3], links[1]


def _load(scene: Scene) -> float:
    """Axial load [N]; zero for a prescribed top."""
    top = scene.top
    if isinstance(top, RigTop):
        return top.axial_load
    return top.mass * scene.bearing.gravity if isinstance(top, MassTop) else 0.0


def _define_model(ops: Any, scene: Scene, lower: Link, upper: Link, inner: Link) -> None:
    """Define two nodes at the same point and the element between them."""
    load = _load(scene)
    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    ops.node(BASE, 0.0, 0.0, 0.0)
    ops.node(TOP, 0.0, 0.0, 0.0)
    ops.fix(BASE, 1, 1, 1, 1, 1, 1)
    ops.fix(TOP, 0, 0, 0, 1, 1, 1)
    for tag, link in enumerate((inner, lower, upper), start=1):
        ops.frictionModel("Coulomb", tag, link.friction)
    for tag in range(1, 5):
        ops.uniaxialMaterial("Elastic", tag, STIFF)
    capacities = [link.limit * link.effective for link in (inner, lower, upper)]
    yielding = max(YIELD, min(link.yielding for link in (inner, lower, upper)))
    radii = [link.effective for link in (inner, lower, upper)]
    tags = (ELEMENT, BASE, TOP, 1, 2, 3, 1, 2, 3, 4)  # the element, its nodes, its laws of friction and materials
    ops.element("TripleFrictionPendulum", *tags, *radii, *capacities, load, yielding, STIFF, 0.1, 1e-5)
    if isinstance(scene.top, MassTop):
        ops.mass(TOP, *(scene.top.mass,) * 3, 0.0, 0.0, 0.0)


def _integrate(ops: Any, scene: Scene, times: Array) -> tuple[int, Array]:
    """Apply the axial load, then the motion; returns the number of steps, and the horizontal forces, (k, 2) [N]."""
    # The first row is the start, with zero force.
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    ops.load(TOP, 0.0, 0.0, -_load(scene), 0.0, 0.0, 0.0)
    _settings(ops)
    ops.integrator("LoadControl", 0.1)
    ops.analysis("Static")
    ops.analyze(10)
    ops.loadConst("-time", 0.0)
    ops.wipeAnalysis()
    forces, rig = np.zeros((len(times), 2)), isinstance(scene.top, RigTop)
    (_static if rig else _dynamic)(ops, scene, times)
    # With a rig the top is moved instead of the base, so displacement and force change sign.
    sign, step = (1.0, ()) if rig else (-1.0, (float(times[1]),))
    for row in range(1, len(times)):
        if ops.analyze(1, *step):
            return row - 1, forces[:row]
        forces[row] = sign * np.array(ops.eleForce(ELEMENT))[6:8]  # at the upper node
    return len(times) - 1, forces


def _padded(values: Array) -> list[float]:
    """`values`, the last one twice: OpenSees takes zero after the end, where rounding may put the last step."""
    return [*values.tolist(), float(values[-1])]


def _static(ops: Any, scene: Scene, times: Array) -> None:
    """Impose the displacements of the base on the top node, with opposite sign of the relative displacement."""
    motion = scene.motion.displacement(times)
    for axis in (0, 1):
        tag = 10 + axis
        ops.timeSeries("Path", tag, "-dt", float(times[1]), "-values", *_padded(motion[:, axis] - motion[0, axis]))
        ops.pattern("Plain", tag, tag)
        ops.sp(TOP, axis + 1, 1.0)
    _settings(ops)
    ops.integrator("LoadControl", float(times[1]))
    ops.analysis("Static")


def _dynamic(ops: Any, scene: Scene, times: Array) -> None:
    """Impose base accelerations on a supported mass; HHT damps frequencies that the steps do not resolve."""
    ground = scene.motion.acceleration(times)
    for axis in range(3):
        tag = 10 + axis
        ops.timeSeries("Path", tag, "-dt", float(times[1]), "-values", *_padded(ground[:, axis]))
        ops.pattern("UniformExcitation", tag, axis + 1, "-accel", tag)
    _settings(ops)
    ops.integrator("HHT", 0.67)
    ops.analysis("Transient")


def _settings(ops: Any) -> None:
    """Set constraints, equations and Newton's method of an analysis."""
    ops.constraints("Transformation")
    ops.numberer("Plain")
    ops.system("FullGeneral")
    ops.test("NormUnbalance", 1e-3, 50, 0)
    ops.algorithm("Newton")
