"""The same scene by the element that analysts have: `TripleFrictionPendulum` of OpenSees, if it is installed."""

from __future__ import annotations

import time
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.accuracy.series import Link, Series
from msfp_gen.accuracy.trial import OK, Trial, base_alone, grid
from msfp_gen.errors import InputError
from msfp_gen.history import Array
from msfp_gen.layout import Layout
from msfp_gen.top import MassTop, RigTop

if TYPE_CHECKING:
    from msfp_gen.scene import Scene

BASE, TOP, ELEMENT = 1, 2, 1
STIFF, TOLERANCE = 1e10, 1e-10
YIELD = 1e-4  # [m]: the least that the element is sure to take (its page says 0.25 to 1 mm)


def run_opensees(scene: Scene, steps: int) -> Trial:
    """`scene` by OpenSees in `steps` equal steps. The element does not tell how far each surface slides: none is given.

    Raises InputError: OpenSees is not installed, or the element cannot be this bearing under this load.
    """
    base_alone(scene)
    if find_spec("openseespy") is None:
        raise InputError("openseespy is not installed: pip install openseespy to have TripleFrictionPendulum beside")
    lower, upper, inner = _links(scene)
    ops = import_module("openseespy.opensees")
    times = np.linspace(0.0, scene.end, steps + 1)
    begin = time.perf_counter()
    try:
        _model(ops, scene, lower, upper, inner)
        reached, force = _drive(ops, scene, times)
    finally:
        ops.wipe()
    seconds, at = time.perf_counter() - begin, grid(scene.end)
    at = at[at <= times[reached] * (1 + 1e-12)]
    rows = np.column_stack([np.interp(at, times[: reached + 1], column) for column in force.T])
    status, message = (OK, "") if reached == steps else ("failed", f"analyze failed at t = {times[reached]:.4g} s")
    return Trial("OpenSees", scene.end / steps, status, seconds, float(times[reached]), scene.end, 0, 0, reached, rows,
                 np.zeros((len(rows), 0)), message, stepped=True)  # fmt: skip


def _links(scene: Scene) -> tuple[Link, Link, Link]:
    """Outer lower, outer upper and inner surfaces, as the element wants them: one inner friction and radius."""
    if scene.bearing.layout != Layout.tfp():
        raise InputError("bearing.layout: TripleFrictionPendulum has four surfaces, (5, 2, 2)")
    if not _load(scene):
        raise InputError("top: TripleFrictionPendulum is driven under a rig or a mass with weight; give one")
    links = {link.surface: link for link in Series(scene.bearing, rims=True).links}
    if links[1].friction != links[2].friction or abs(links[1].effective / links[2].effective - 1) > 1e-9:
        raise InputError("bearing.surfaces: TripleFrictionPendulum takes equal inner surfaces only")
    return links[0], links[3], links[1]


def _load(scene: Scene) -> float:
    top = scene.top
    if isinstance(top, RigTop):
        return top.axial_load
    return top.mass * scene.bearing.gravity if isinstance(top, MassTop) else 0.0


def _model(ops: Any, scene: Scene, lower: Link, upper: Link, inner: Link) -> None:
    """Two nodes at one place and the element between them."""
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
    reach = [link.limit * link.effective for link in (inner, lower, upper)]
    yielding = max(YIELD, min(link.yielding for link in (inner, lower, upper)))
    radii = [link.effective for link in (inner, lower, upper)]
    ops.element("TripleFrictionPendulum", ELEMENT, BASE, TOP, 1, 2, 3, 1, 2, 3, 4, *radii, *reach, load, yielding,
                STIFF, 0.1, 1e-5)  # fmt: skip
    if isinstance(scene.top, MassTop):
        ops.mass(TOP, *(scene.top.mass,) * 3, 0.0, 0.0, 0.0)


def _drive(ops: Any, scene: Scene, times: Array) -> tuple[int, Array]:
    """Weight, then the motion; how many steps were taken, and the horizontal force after each [N]."""
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    ops.load(TOP, 0.0, 0.0, -_load(scene), 0.0, 0.0, 0.0)
    _settings(ops, "Transformation")
    ops.integrator("LoadControl", 0.1)
    ops.analysis("Static")
    ops.analyze(10)
    ops.loadConst("-time", 0.0)
    ops.wipeAnalysis()
    found, rig = np.zeros((len(times), 2)), isinstance(scene.top, RigTop)
    (_static if rig else _dynamic)(ops, scene, times)
    # A rig is mirrored: the top moves as the base does. A mass lags behind its base, as it does here.
    sign, step = (1.0, ()) if rig else (-1.0, (float(times[1]),))
    for row in range(1, len(times)):
        if ops.analyze(1, *step):
            return row - 1, found[:row]
        found[row] = sign * np.array(ops.eleForce(ELEMENT))[6:8]  # at the upper node
    return len(times) - 1, found


def _held(values: Array) -> list[float]:
    """With the last value once more: past its end a path is zero, and rounding may take the last step there."""
    return [*values.tolist(), float(values[-1])]


def _static(ops: Any, scene: Scene, times: Array) -> None:
    """Top held by displacements that mirror those of the base."""
    motion = scene.motion.displacement(times)
    for axis in (0, 1):
        tag = 10 + axis
        ops.timeSeries("Path", tag, "-dt", float(times[1]), "-values", *_held(motion[:, axis] - motion[0, axis]))
        ops.pattern("Plain", tag, tag)
        ops.sp(TOP, axis + 1, 1.0)
    _settings(ops, "Transformation")
    ops.integrator("LoadControl", float(times[1]))
    ops.analysis("Static")


def _dynamic(ops: Any, scene: Scene, times: Array) -> None:
    """Base accelerations on a supported mass; damped for frequencies that the steps do not resolve."""
    ground = scene.motion.acceleration(times)
    for axis in range(3):
        tag = 10 + axis
        ops.timeSeries("Path", tag, "-dt", float(times[1]), "-values", *_held(ground[:, axis]))
        ops.pattern("UniformExcitation", tag, axis + 1, "-accel", tag)
    _settings(ops, "Transformation")
    ops.integrator("HHT", 0.67)
    ops.analysis("Transient")


def _settings(ops: Any, constraints: str) -> None:
    ops.constraints(constraints)
    ops.numberer("Plain")
    ops.system("FullGeneral")
    ops.test("NormUnbalance", 1e-3, 50, 0)
    ops.algorithm("Newton")
